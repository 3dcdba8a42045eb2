//! The forces of a flow on its boundary, as what the boundary does to keep the balance of momentum.
//!
//! Let `R(w)` be the weak balance of momentum without what is given on the boundary: of smooth fields
//! `R(w) = ∫_Γ (n·σ)·w`, n outwards, and of discrete ones `R(w) = 0` where nothing is prescribed of w and no traction
//! is given. So −R of a function that is 1 on a tag is the force on it, whatever the function is elsewhere, and −R of
//! a rotation the torque. Being tested with functions of the discrete space, it converges with twice the order of
//! `∫ n·σ_h` (Babuška and Miller 1984; Giles, Larson, Levenstam and Süli 1997).
//!
//! R is known node by node. Where two tags meet, the node's part is shared: each takes `∫ (n·σ_h)·φ` over its own
//! faces, and half of what these leave of R. So the forces on all tags add up to what acts inside, to rounding.
//!
//! Bodies by penalty are a part of what flows, and the forces on them act inside. By Nitsche's method R is that of the
//! fluid alone, with what the boundaries of the bodies and the ghost penalty add to it: the forces on all tags and
//! those of the flow on all bodies add up to what acts on the fluid.

use std::collections::BTreeMap;

use super::Conditions;
use super::compressible::Compressible;
use super::fields::{DENSITY, POLARITY, PRESSURE, State, VELOCITY};
use super::immersed::FlowWithBodies;
use super::immersed::flow::Flow;
use super::incompressible::Incompressible;
use super::momentum::{Momentum, MomentumError, body_force};
use super::numbers::Fluid;
use super::polarity::data_of;
use super::sources::Sources;
use super::terms::{At, FlowTerms, Given, MOMENTUM, Sum};
use crate::element::basis;
use crate::form::upwind::Carrier;
use crate::form::words::{Trace, Vector};
use crate::form::{Density, Faces, Integrator, Linear, stokes};
use crate::mesh::Point;
use crate::shape::Wrench;
use crate::solve::axpy;
use crate::space::{Field, Space};

/// The forces of a flow on its boundary, by tag and node.
#[derive(Debug, Clone)]
pub struct Reactions {
    /// Of every tag: places of its nodes, and the force on each.
    tags: Vec<Vec<(Point, Point)>>,
}

impl Reactions {
    /// Of a balance with the residual R; `form` is what R was assembled of.
    fn new(loops: &Integrator, velocity: &Space, residual: &[f64], form: &Linear<Vector>) -> Self {
        let mesh = &loops.mesh;
        let mut tags_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (face, tag) in mesh.faces.iter().filter_map(|face| Some((face, face.tag?))) {
            for local in basis::face_nodes(velocity.degree, face.minus.face) {
                let tags = tags_of.entry(velocity.node(face.minus.cell, local)).or_default();
                if !tags.contains(&tag) {
                    tags.push(tag);
                }
            }
        }
        let meets = |tag: usize| tags_of.values().any(|tags| tags.len() > 1 && tags.contains(&tag));
        // `∫ (n·σ_h)·φ` over the faces of each tag that meets another one
        let surface = |tag: usize| {
            let degree = form.cell_degree() + velocity.degree;
            let load = Linear::zero().faces(Faces::tag(tag), degree, |s| {
                let traction = form.traction(s, &mesh.faces[s.face]);
                move |w: Trace<Vector>| traction.dot(&w.minus.value)
            });
            loops.vector(&load, velocity)
        };
        let surfaces: Vec<Option<Vec<f64>>> =
            (0..mesh.tags.len()).map(|tag| meets(tag).then(|| surface(tag))).collect();
        let at = |values: &[f64], node: usize| Point::new(values[2 * node], values[2 * node + 1]);
        let positions = velocity.node_positions();
        let mut tags = vec![Vec::new(); mesh.tags.len()];
        for (node, meeting) in tags_of {
            let own = |tag: usize| surfaces[tag].as_ref().map_or_else(Point::zeros, |values| at(values, node));
            let all: Point = meeting.iter().map(|&tag| own(tag)).sum();
            let rest = (at(residual, node) - all) / meeting.len() as f64;
            meeting.iter().for_each(|&tag| tags[tag].push((positions[node], -(own(tag) + rest))));
        }
        Self { tags }
    }

    /// Of a Stokes flow under the force of its sources.
    ///
    /// # Errors
    /// A load on a body that is not finite.
    pub fn of_flow(
        flow: &Flow,
        carried: &FlowWithBodies,
        fluid: &Fluid,
        sources: &Sources,
    ) -> Result<Self, MomentumError> {
        let momentum = &flow.momentum;
        let velocity = &momentum.velocity;
        let v = Field::new(velocity, carried.v.clone());
        let pi = Field::new(&momentum.pressure, carried.pi.clone());
        let sources = sources.at_time(flow.t);
        let form = flowing(momentum, &FlowTerms::of(fluid), &v, &pi) - body_force(velocity, fluid, &sources, flow.t);
        let fluid = flow.fluid();
        let mut residual = fluid.vector(&form, velocity);
        add_bodies(momentum, &v.values, &[&flow.loads()?, &carried.holding], &mut residual);
        momentum.add_surfaces(carried, &mut residual);
        Ok(Self::new(&fluid, velocity, &residual, &form))
    }

    /// Of an incompressible sheet in a state.
    ///
    /// # Errors
    /// Forces on bodies that cannot be solved for.
    pub fn of_incompressible(model: &Incompressible, state: &State, t: f64) -> Result<Self, MomentumError> {
        let (momentum, parameters) = (&model.momentum, &model.parameters);
        let (velocity, v, p) = (&*momentum.velocity, &state[VELOCITY], &state[POLARITY]);
        let sources = model.sources.at_time(t);
        let (given, molecular) = (everywhere(model.given(t), &model.conditions, &sources), model.molecular(p, v, t));
        let at = At::new(parameters, p, &given).with_flow(velocity, Carrier::from(v)).with_field(molecular.as_ref());
        let whole = flowing(momentum, &FlowTerms::of(parameters), v, &state[PRESSURE]);
        let inner = Sum::of(&[MOMENTUM]).value(&at) - body_force(velocity, parameters, &sources, t);
        // by penalty bodies flow, too
        let flowing = if momentum.boundaries().is_some() { model.tissue() } else { &model.loops };
        let mut residual = flowing.vector(&whole, velocity);
        axpy(1.0, &model.tissue().vector(&inner, velocity), &mut residual);
        if momentum.boundaries().is_some() {
            momentum.add_boundaries((&v.values, &state[PRESSURE].values), &model.twists(state, t)?, &mut residual);
            axpy(-1.0, &model.tractions(&inner).flow, &mut residual);
        } else if let Some(floating) = &model.bodies {
            let loads = floating.guide.loads(&floating.poses, t)?;
            add_bodies(momentum, &v.values, &[&loads, &model.carried(state, t)?.holding], &mut residual);
        }
        Ok(Self::new(&model.loops, velocity, &residual, &(whole + inner)))
    }

    /// Of a compressible sheet in a state.
    pub fn of_compressible(model: &Compressible, state: &State, t: f64) -> Self {
        let (velocity, parameters) = (&*model.velocity, &model.parameters);
        let (v, rho, p) = (&state[VELOCITY], &state[DENSITY], &state[POLARITY]);
        let sources = model.sources.at_time(t);
        let given = model.given(t);
        let molecular = model.molecular(&model.molecular_functional(rho, p, t));
        let at = model.at(rho, p, v, &given).with_field(molecular.as_ref());
        let form = FlowTerms::of(parameters).matrix(velocity, Density::Of(rho)).at(v) + Sum::of(&[MOMENTUM]).value(&at)
            - body_force(velocity, parameters, &sources, t);
        Self::new(&model.loops, velocity, &model.loops.vector(&form, velocity), &form)
    }

    /// The force on a tag of the mesh.
    pub fn force(&self, tag: usize) -> Point {
        self.tags[tag].iter().map(|(_, force)| force).sum()
    }

    /// The torque on a tag of the mesh about a point.
    pub fn torque(&self, tag: usize, around: Point) -> f64 {
        self.tags[tag].iter().map(|(x, force)| (x - around).perp(force)).sum()
    }
}

/// `2(D(v)|D(w)) + C_F(v|w) + b(w,Π)`, test w, by the terms of a model.
fn flowing<'a>(momentum: &Momentum, terms: &FlowTerms, v: &'a Field, pi: &'a Field) -> Linear<'a, Vector> {
    terms.matrix(&momentum.velocity, Density::One).at(v)
        + stokes::divergence(&momentum.velocity, &momentum.pressure).at(pi)
}

/// What bodies add to the balance: their penalty and friction, and the loads on them.
fn add_bodies(momentum: &Momentum, v: &[f64], loads: &[&[Wrench]], residual: &mut [f64]) {
    let Some(bodies) = momentum.bodies() else { return };
    bodies.add_residual(v, residual);
    let mut force = vec![0.0; residual.len()];
    loads.iter().for_each(|loads| momentum.add_body_loads(loads, &mut force));
    axpy(-1.0, &force, residual);
}

/// What the boundary gives, with the boundary terms of the energy-consistent force on all tags: there, too, where the
/// equations need none because nothing is free.
fn everywhere<'m>(given: Given<'m>, conditions: &[Conditions], sources: &Sources) -> Given<'m> {
    let sloped = |c: &Conditions| data_of(c).is_some() || sources.boundary().is_some();
    let of = |(tag, c): (usize, &Conditions)| if sloped(c) { Faces::tag(tag) } else { Faces::NONE };
    let sloped = conditions.iter().enumerate().map(of).fold(Faces::NONE, |all, one| all | one);
    given.with_natural([Faces::BOUNDARY, sloped])
}
