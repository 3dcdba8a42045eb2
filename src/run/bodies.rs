//! What `check` says of the bodies of a scene.

use std::fmt;

use serde::Serialize;

use crate::body::Hold;
use crate::contact::Law;
use crate::contact::in_flow::FlowCoupling;
use crate::model::TermStatus;
use crate::model::immersed::flow::{Method, Penalty, Strength};
use crate::scene::Bodies;

/// The bodies of a scene and how they meet.
#[derive(Debug, Clone, Serialize)]
pub struct BodiesReport {
    /// How many there are.
    pub count: usize,
    /// Bodies that flow, forces and contact move.
    pub free: usize,
    /// Bodies whose motion is prescribed, but for those at rest.
    pub held: usize,
    /// Smallest and largest distance of a body's points from its centre.
    pub size: [f64; 2],
    /// Those of `[[wall]]`; a tag of the boundary counts as one.
    pub walls: usize,
    /// Boundary tags through which bodies leave.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub exits: Vec<String>,
    /// The law of contact, and the settings that differ from none.
    pub contact: String,
    /// Names of the first few.
    pub names: Vec<String>,
}

/// Bodies that are named.
const NAMED: usize = 8;

impl BodiesReport {
    /// Of the bodies of a scene.
    pub fn new(bodies: &Bodies) -> Self {
        let all = &bodies.bodies;
        let how = |wanted: fn(&Hold) -> bool| all.iter().filter(|body| wanted(&body.hold)).count();
        let sizes = || all.iter().map(|body| body.shape.circumradius());
        Self {
            count: all.len(),
            free: how(|hold| matches!(hold, Hold::Free | Hold::Pinned(_))),
            held: how(|hold| matches!(hold, Hold::Held { .. } | Hold::Path { .. })),
            size: [sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max)],
            walls: bodies.walls.len() + bodies.wall_tags.len(),
            exits: bodies.open_tags.clone(),
            contact: contact_term(bodies).reason,
            names: all.iter().take(NAMED).map(|body| body.name.clone()).collect(),
        }
    }
}

impl fmt::Display for BodiesReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fixed = self.count - self.free - self.held;
        let dots = if self.count > self.names.len() { ", …" } else { "" };
        writeln!(out, "bodies          {} ({} free, {} held, {fixed} fixed)", self.count, self.free, self.held)?;
        writeln!(out, "  names         {}{dots}", self.names.join(", "))?;
        writeln!(out, "  size          {} to {} from centre to edge", self.size[0], self.size[1])?;
        writeln!(out, "  walls         {}", self.walls)?;
        if !self.exits.is_empty() {
            writeln!(out, "  leave through {}", self.exits.join(", "))?;
        }
        write!(out, "  contact       {}", self.contact)
    }
}

/// The rigid bodies of a flow and their contact, among the terms that are told.
pub(super) fn body_terms(bodies: Option<&Bodies>) -> Vec<TermStatus> {
    let (name, penalty) = ("bodies", "(2/ε) Σ (D(v)|D(w))_B");
    let Some(bodies) = bodies else {
        return vec![TermStatus { name, formula: penalty, on: false, reason: "no [[body]]".to_owned() }];
    };
    let (formula, how) = match bodies.rigid.method {
        Method::Penalty(Penalty { epsilon, strength }) => {
            let where_cut = match strength {
                Strength::Harmonic => "",
                Strength::Full => ", in full in cut cells",
            };
            (penalty, format!("by penalty, epsilon = {epsilon:e}{where_cut}"))
        }
        Method::Nitsche => ("v = u_i on ∂B_i", "by Nitsche's method".to_owned()),
    };
    let reason = format!("{} of them, {how}", bodies.bodies.len());
    vec![TermStatus { name, formula, on: true, reason }, contact_term(bodies)]
}

/// The contact of bodies, on or off.
pub(super) fn contact_term(bodies: &Bodies) -> TermStatus {
    let name = "contact";
    match &bodies.contact {
        None => TermStatus { name, formula: "D ≥ 0", on: false, reason: "nothing can touch".to_owned() },
        Some(contact) => {
            let (formula, law) = match contact.law {
                Law::Inelastic => ("D ≥ 0", "inelastic".to_owned()),
                Law::Gluey { gamma_min } => ("D ≥ 0, γ ≤ 0, Dγ = 0", format!("gluey, gamma_min = {gamma_min}")),
            };
            let margin = if contact.margin > 0.0 { format!(", margin {}", contact.margin) } else { String::new() };
            let walls = bodies.walls.len() + bodies.wall_tags.len();
            let split = if contact.flow == FlowCoupling::Split { ", split from the flow" } else { "" };
            TermStatus { name, formula, on: true, reason: format!("{law}, {walls} walls{margin}{split}") }
        }
    }
}
