//! The rules of `boundary.TAG.bodies`.

use super::Checker;
use crate::body::leaving::Passage;
use crate::body::{Body, Hold};
use crate::expression::Expression;
use crate::model::boundary::{Held, VelocityCondition};
use crate::scene::error::SceneError;
use crate::scene::path::quoted;

/// A part of the boundary, as bodies meet it.
pub(super) struct Side<'a> {
    /// Its tag.
    pub tag: &'a str,
    /// What the scene says.
    pub given: &'a mut Option<Passage>,
    /// What the flow does there.
    pub flow: &'a VelocityCondition,
}

impl Side<'_> {
    fn key(&self) -> String {
        format!("boundary.{}.bodies", quoted(self.tag))
    }

    /// Whether something can flow through it.
    fn lets_through(&self) -> bool {
        match self.flow.holds() {
            Held::Nothing | Held::Tangent => true,
            Held::Normal => false,
            Held::Both => !self.flow.formulas().iter().all(Expression::is_zero),
        }
    }
}

impl Checker<'_> {
    /// The tags through which bodies leave. Those that keep them inside become walls; what the scene does not say is
    /// filled in, where some body moves.
    pub(super) fn passages(
        &self,
        sides: &mut [Side],
        bodies: &[Body],
        walls: &mut Vec<(String, String)>,
    ) -> Result<Vec<String>, SceneError> {
        let mut open = Vec::new();
        let moves = bodies.iter().any(|body| !matches!(body.hold, Hold::Fixed));
        for side in sides {
            let wall = walls.iter().find(|(_, tag)| tag == side.tag).map(|(key, _)| key.clone());
            if side.given.is_none() && moves {
                let usual = wall.as_ref().map(|_| Passage::Wall);
                *side.given = usual.or_else(|| side.lets_through().then_some(Passage::Leave));
            }
            match (*side.given, wall) {
                (Some(Passage::Leave), Some(wall)) => {
                    let rule = format!("`{wall}` keeps bodies inside here");
                    return Err(self.error(&side.key(), "\"leave\"", &rule, "remove one of the two"));
                }
                (Some(Passage::Leave), None) => open.push(side.tag.to_owned()),
                (Some(Passage::Wall), None) => walls.push((side.key(), side.tag.to_owned())),
                (Some(Passage::Wall), Some(_)) | (None, _) => {}
            }
        }
        Ok(open)
    }

    /// Refuses what is said of bodies where there are none.
    pub(super) fn no_passage(&self, sides: &[Side], rule: &str, hint: &str) -> Result<(), SceneError> {
        let said = sides.iter().find(|side| side.given.is_some());
        said.map_or(Ok(()), |side| Err(self.error(&side.key(), "(given)", rule, hint)))
    }
}
