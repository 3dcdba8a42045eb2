//! The loops on a part of the mesh: outside of bodies, or inside.

use std::sync::Arc;

use super::integrate::{CellPoint, FacePoint, Integrator};
use crate::cut::{Class, Cover, MeshPart};
use crate::element::quadrature::MAX_TRIANGLE_DEGREE;

/// A part of the mesh.
#[derive(Debug, Clone)]
pub(super) struct Restriction {
    pub cover: Arc<Cover>,
    pub part: MeshPart,
}

impl Restriction {
    /// Whether the part holds all of a cell or face of the class; `None` if it is cut.
    fn holds(&self, class: Class) -> Option<bool> {
        match (class, self.part) {
            (Class::Cut(_), _) => None,
            (Class::Outside, part) => Some(part == MeshPart::Outside),
            (Class::Inside(_), MeshPart::Outside) => Some(false),
            (Class::Inside(body), MeshPart::Inside(asked)) => Some(asked.is_none_or(|asked| asked == body)),
        }
    }

    pub fn visits(&self, cell: usize) -> bool {
        let part_of_cut = || match self.part {
            MeshPart::Inside(Some(body)) => self.cover.bodies_of_cell(cell).contains(&body),
            MeshPart::Outside | MeshPart::Inside(None) => true,
        };
        self.holds(self.cover.cell(cell)).unwrap_or_else(part_of_cut)
    }

    pub fn each_cell_point(&self, loops: &Integrator, cell: usize, degree: usize, visit: &mut dyn FnMut(&CellPoint)) {
        let class = self.cover.cell(cell);
        match (class, self.holds(class)) {
            (_, Some(false)) => {}
            (Class::Outside | Class::Inside(_), _) => loops.each_point_of_whole_cell(cell, degree, visit),
            (Class::Cut(cut), _) => {
                let degree = match &loops.mesh.curved[cell] {
                    Some(nodes) => (degree.max(1) + 2 * nodes.degree).min(MAX_TRIANGLE_DEGREE),
                    None => degree,
                };
                let rule = self.cover.cell_rule(cut, cell, self.part, degree);
                for (q, w) in rule.weights.iter().enumerate() {
                    let (site, jacobian) = loops.site(cell, &rule.tables, q);
                    visit(&CellPoint { site, weight: w * jacobian.determinant() });
                }
            }
        }
    }

    /// The degree is that of the rule.
    pub fn each_face_point(&self, loops: &Integrator, index: usize, degree: usize, visit: &mut dyn FnMut(&FacePoint)) {
        let class = self.cover.face(index);
        match (class, self.holds(class)) {
            (_, Some(false)) => {}
            (Class::Outside | Class::Inside(_), _) => loops.each_point_of_whole_face(index, degree, visit),
            (Class::Cut(cut), _) => {
                let rule = self.cover.face_rule(cut, index, self.part, degree);
                loops.each_point_on_face(index, (&[], &rule.weights), (&rule.minus, rule.plus.as_ref()), visit);
            }
        }
    }
}
