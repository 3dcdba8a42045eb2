//! Notes of bodies that are smaller than the cells of a flow, and of gaps between them that are.

use std::collections::BTreeSet;

use crate::body::Body;
use crate::body::leaving::Exits;
use crate::contact::{Contact, Partner};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::shape::{Pose, turned};

/// Least half thickness of a body in cells. The mobility of a disc of 0.4 cells is off by 5 percent, of 0.8 by 2, and
/// what is much smaller has that of about a cell.
const LEAST: f64 = 1.0;

/// Points of an outline that are looked at, and the share of the way from the centre at which they are: what touches a
/// wall does not reach over it.
const OUTLINE: usize = 16;
const INNER: f64 = 0.95;

/// Which bodies of a flow have been told to be unresolved.
#[derive(Debug)]
pub(super) struct Resolution {
    locator: Locator,
    /// By name, as all.
    told: BTreeSet<String>,
    /// Which bodies reach over the boundary, and are known to.
    over: BTreeSet<String>,
    gap_told: bool,
    exits: Exits,
}

impl Resolution {
    /// Nothing has been told.
    pub fn new(mesh: &Mesh, exits: Exits) -> Self {
        let (told, over) = (BTreeSet::new(), BTreeSet::new());
        Self { locator: Locator::new(mesh), told, over, gap_told: false, exits }
    }

    /// A note for the bodies that are not resolved where they are and have not been told yet.
    pub fn of_bodies(&mut self, mesh: &Mesh, bodies: &[Body], poses: &[Pose]) -> Option<String> {
        let mut worst: Option<(usize, f64, f64)> = None;
        let mut count = 0;
        for (at, (body, pose)) in bodies.iter().zip(poses).enumerate() {
            if self.told.contains(&body.name) {
                continue;
            }
            let Some(cell) = self.cell(mesh, pose.position) else { continue };
            let ratio = body.shape.inradius() / cell;
            if ratio < LEAST {
                self.told.insert(body.name.clone());
                count += 1;
                if worst.is_none_or(|(_, least, _)| ratio < least) {
                    worst = Some((at, ratio, cell));
                }
            }
        }
        let (at, ratio, cell) = worst?;
        let others = if count > 1 { format!(" ({} more bodies likewise)", count - 1) } else { String::new() };
        Some(format!(
            "`{}` is not resolved{others}: half of its thickness, {:.3e}, is {ratio:.2e} of the cell there, \
             {cell:.3e}; below {LEAST} its mobility is percents off, and far below it is that of a body of about a \
             cell: take smaller cells where it is",
            bodies[at].name,
            bodies[at].shape.inradius()
        ))
    }

    /// A note for the bodies that have come to reach over the boundary of the domain, which alone holds nothing back,
    /// where they do not leave.
    pub fn of_boundary(&mut self, mesh: &Mesh, bodies: &[Body], poses: &[Pose]) -> Option<String> {
        let over = |body: &Body, pose: &Pose| {
            let mut points = body.shape.outline(OUTLINE).into_iter();
            points.any(|x| {
                let x = pose.position + turned(x * INNER, pose.angle);
                let leaves = || self.exits.beside(x).is_some_and(|(_, leaves)| leaves);
                self.locator.locate(mesh, x).is_none() && !leaves()
            })
        };
        let new = |at: &usize| !self.over.contains(&bodies[*at].name) && over(&bodies[*at], &poses[*at]);
        let found: Vec<usize> = (0..bodies.len()).filter(new).collect();
        self.over.extend(found.iter().map(|at| bodies[*at].name.clone()));
        let first = found.first()?;
        let others =
            if found.len() > 1 { format!(" ({} more bodies likewise)", found.len() - 1) } else { String::new() };
        Some(format!(
            "`{}` reaches over the boundary of the domain{others}, near ({:.3e}, {:.3e}): the flow in the last gap is \
             not resolved and holds it back too little; a [[wall]] with the tag keeps bodies inside, or smaller cells and \
             steps",
            bodies[*first].name, poses[*first].position.x, poses[*first].position.y
        ))
    }

    /// A note for the first gap between bodies, or between a body and a wall, that is smaller than a cell.
    pub fn of_gaps(&mut self, mesh: &Mesh, bodies: &[Body], contacts: &[Contact]) -> Option<String> {
        if self.gap_told {
            return None;
        }
        let narrow = contacts.iter().find_map(|contact| {
            let cell = self.cell(mesh, contact.point)?;
            (contact.gap < cell).then_some((contact, cell))
        });
        let (contact, cell) = narrow?;
        self.gap_told = true;
        let partner = match contact.partner {
            Partner::Body(other) => format!("`{}`", bodies[other].name),
            Partner::Wall(wall) => format!("wall {}", wall + 1),
        };
        Some(format!(
            "the gap between `{}` and {partner}, {:.3e}, is {:.2e} of the cell there, {cell:.3e}: the flow in it is \
             not resolved; \
             `contact.margin` keeps bodies apart",
            bodies[contact.body].name,
            contact.gap.max(0.0),
            contact.gap.max(0.0) / cell
        ))
    }

    /// Size `(2|K|)^½` of the cell at a point.
    fn cell(&self, mesh: &Mesh, x: Point) -> Option<f64> {
        let (cell, _) = self.locator.locate(mesh, x)?;
        Some((2.0 * mesh.cell_area(cell)).sqrt())
    }
}

/// The note for bodies where a run begins.
pub(super) fn at_start(mesh: &Mesh, bodies: &[Body]) -> Option<String> {
    let poses: Vec<Pose> = bodies.iter().map(|body| body.start).collect();
    Resolution::new(mesh, Exits::default()).of_bodies(mesh, bodies, &poses)
}
