//! The rules of `[[wall]]` and `[contact]`.

use super::bodies::{Around, point};
use super::{Checker, shown};
use crate::contact::in_flow::FlowCoupling;
use crate::contact::{Law, Wall};
use crate::mesh::Point;
use crate::scene::bodies::ContactSettings;
use crate::scene::bodies::tables::{CircleTable, ContactTable, LawName, WallTable};
use crate::scene::error::SceneError;
use crate::schema::Range;

/// Walls, and those that are boundary tags, with the keys that make them such.
type Walls = (Vec<Wall>, Vec<(String, String)>);

impl Checker<'_> {
    pub(super) fn walls(&self, tables: &mut [WallTable], around: Around) -> Result<Walls, SceneError> {
        let (mut walls, mut tags) = (Vec::new(), Vec::new());
        for (at, table) in tables.iter().enumerate() {
            let key = format!("wall.{at}");
            let one = "exactly one of `segment`, `disc`, `hollow` and `tag` is needed";
            match (table.segment, table.disc, table.hollow, &table.tag) {
                (Some([a, b]), None, None, None) => {
                    let (a, b) = (Point::from(a), Point::from(b));
                    let length = (b - a).norm();
                    let shown = format!("[{}, {}]", point(a.into()), point(b.into()));
                    let rule = "must be two finite points that differ";
                    let holds = length.is_finite() && length > 0.0;
                    self.require(holds, &format!("{key}.segment"), shown, rule, "such as [[0, 0], [1, 0]]")?;
                    walls.push(Wall::Segment([a, b]));
                }
                (None, Some(circle), None, None) => {
                    let (centre, radius) = self.circle_of_wall(&format!("{key}.disc"), circle)?;
                    walls.push(Wall::Disc { centre, radius });
                }
                (None, None, Some(circle), None) => {
                    let (centre, radius) = self.circle_of_wall(&format!("{key}.hollow"), circle)?;
                    walls.push(Wall::Hollow { centre, radius });
                }
                (None, None, None, Some(tag)) => {
                    let key = format!("{key}.tag");
                    let hint = "give a `segment`, a `disc` or a `hollow`";
                    let rule = "particles have no mesh whose boundary could have a tag";
                    self.require(around == Around::Flow, &key, format!("\"{tag}\""), rule, hint)?;
                    let rule = "another wall has this tag";
                    self.require(
                        !tags.iter().any(|(_, other)| other == tag),
                        &key,
                        format!("\"{tag}\""),
                        rule,
                        "remove one of the two",
                    )?;
                    tags.push((key, tag.clone()));
                }
                (_, _, _, _) => {
                    return Err(self.error(&key, "(a table)", one, "write one [[wall]] for each"));
                }
            }
        }
        Ok((walls, tags))
    }

    pub(super) fn circle_of_wall(&self, key: &str, circle: CircleTable) -> Result<(Point, f64), SceneError> {
        let finite = circle.centre.iter().all(|x| x.is_finite());
        self.require(finite, &format!("{key}.centre"), point(circle.centre), "must be finite", "such as [0, 0]")?;
        let radius = self.positive(&format!("{key}.radius"), circle.radius, "such as 1")?;
        Ok((circle.centre.into(), radius))
    }

    pub(super) fn contact(
        &self,
        given: &mut Option<ContactTable>,
        touch: bool,
        around: Around,
    ) -> Result<Option<ContactSettings>, SceneError> {
        if !touch {
            let hint = "remove it, or add another body or a [[wall]]";
            self.require(
                given.is_none(),
                "contact",
                "(given)",
                "there is nothing that a single body could meet",
                hint,
            )?;
            return Ok(None);
        }
        let table = given.get_or_insert_default();
        let law = match (table.law, table.gamma_min) {
            (LawName::Inelastic, None) => Law::Inelastic,
            (LawName::Inelastic, Some(value)) => {
                let rule = "bodies do not stick in inelastic contact, so there is no threshold of roughness";
                let hint = "remove it, or take law = \"gluey\"";
                return Err(self.error("contact.gamma_min", value, rule, hint));
            }
            (LawName::Gluey, given) => {
                let gamma_min = given.unwrap_or(f64::NEG_INFINITY);
                let hint = "-inf, the default, is smooth glue; -1 lets go earlier; 0 is inelastic contact";
                self.require(gamma_min <= 0.0, "contact.gamma_min", gamma_min, "must not be above 0", hint)?;
                table.gamma_min = Some(gamma_min);
                Law::Gluey { gamma_min }
            }
        };
        let (margin, tolerance) = (table.margin, table.tolerance);
        let holds = Range::NOT_NEGATIVE.has(margin);
        let hint = "0 lets bodies touch; about one cell keeps a layer of fluid between them";
        self.require(holds, "contact.margin", margin, "must be finite and not negative", hint)?;
        let holds = ContactTable::TOLERANCE.has(tolerance);
        let hint = "1e-12 is the usual value";
        self.require(holds, "contact.tolerance", shown(tolerance), "must lie between 1e-14 and 1e-3", hint)?;
        let (friction, restitution) = (table.friction.unwrap_or(0.0), table.restitution.unwrap_or(0.0));
        let (holds, hint) = (ContactTable::FRICTION.has(friction), "0.3 is that of many solids");
        self.require(holds, "contact.friction", shown(friction), "must lie between 0 and 1e3", hint)?;
        let (holds, hint) = (ContactTable::RESTITUTION.has(restitution), "0 is inelastic, 1 loses no energy");
        self.require(holds, "contact.restitution", shown(restitution), "must lie between 0 and 1", hint)?;
        self.has_dry_contact("contact.friction", friction, (law, around, true))?;
        let inertia = around == Around::Nothing { inertia: true };
        self.has_dry_contact("contact.restitution", restitution, (law, around, inertia))?;
        let solver = table.solver;
        let flow = self.flow_coupling(&mut table.flow, around)?;
        Ok(Some(ContactSettings { law, margin, friction, restitution, flow, tolerance, solver }))
    }

    /// Whether contact acts on the flow, where there is one.
    fn flow_coupling(&self, given: &mut Option<FlowCoupling>, around: Around) -> Result<FlowCoupling, SceneError> {
        match (around, *given) {
            (Around::Flow, _) => Ok(*given.get_or_insert_default()),
            (Around::Nothing { .. }, None) => Ok(FlowCoupling::default()),
            (Around::Nothing { .. }, Some(_)) => {
                let rule = "there is no flow on which contact could act";
                Err(self.error("contact.flow", "(given)", rule, "remove it; tissue and Stokes flows have it"))
            }
        }
    }

    /// Refuses what only dry bodies have.
    fn has_dry_contact(
        &self,
        key: &str,
        value: f64,
        (law, around, can): (Law, Around, bool),
    ) -> Result<(), SceneError> {
        if value == 0.0 {
            return Ok(());
        }
        let value = shown(value);
        let rule = "bodies in a flow are kept apart by its film";
        self.require(around != Around::Flow, key, &value, rule, "remove it; model.kind = \"particles\" has it")?;
        let rule = "bodies that stick neither rub nor bounce";
        self.require(law == Law::Inelastic, key, &value, rule, "remove it, or take contact.law = \"inelastic\"")?;
        self.require(can, key, value, "what has no inertia does not bounce", "take model.dynamics = \"inertial\"")
    }
}
