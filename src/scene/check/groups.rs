//! The rules of `[[bodies]]`.

use super::Checker;
use super::bodies::{Around, Symbols, numbers, point};
use crate::body::{Body, Hold};
use crate::contact::Wall;
use crate::expression::{Expression, Formula};
use crate::mesh::Point;
use crate::scene::bodies::place::{Region, radii, scatter};
use crate::scene::bodies::tables::{BodiesTable, CircleTable, GroupMotion, MOST, Radii, RingTable};
use crate::scene::error::SceneError;
use crate::shape::{Disc, Pose, Shape, Twist};

/// Of radii and places, where none is given.
const SEED: u64 = 1;

/// The angle of the k-th of so many places on a circle.
fn share(k: usize, count: usize) -> f64 {
    std::f64::consts::TAU * k as f64 / count as f64
}

/// What bodies are placed among.
#[derive(Debug, Clone, Copy)]
pub(super) struct Among<'b> {
    pub around: Around,
    /// Names and values that their formulas may use.
    pub symbols: Symbols<'b>,
    /// Bodies that are there.
    pub before: &'b [Body],
    pub walls: &'b [Wall],
}

impl Checker<'_> {
    pub(super) fn group(&self, key: &str, table: &mut BodiesTable, among: Among) -> Result<Vec<Body>, SceneError> {
        let at = |name: &str| format!("{key}.{name}");
        let name = table.name.clone().unwrap_or_default();
        self.body_name(&at("name"), &name)?;
        let density = *table.density.get_or_insert(1.0);
        self.positive(&at("density"), density, "mass per area; 1 is that of the medium")?;
        let count = self.group_count(key, table)?;
        let seed = *table.seed.get_or_insert(SEED);
        let radii = radii(count, self.group_radii(&at("radius"), table.radius)?, seed);
        let centres = self.group_centres(key, table, &radii, among)?;
        let friction = self.body_friction(&at("friction"), &mut table.friction, among.around)?;
        let motion = *table.motion.get_or_insert(GroupMotion::Free);
        let turning =
            table.ring.as_ref().and_then(|ring| ring.angle.as_ref().map(|angle| (ring.clone(), angle.clone())));
        let moves = turning.is_some() && motion == GroupMotion::Fixed;
        self.require(!moves, &at("motion"), "\"fixed\"", "a ring with an `angle` moves", "remove one of the two")?;
        let mut bodies = Vec::new();
        for (k, (&radius, centre)) in radii.iter().zip(&centres).enumerate() {
            let shape = Shape::from(Disc { radius });
            self.computable(&at("density"), &shape, density)?;
            let known = numbers(&shape, density, among.symbols);
            let start = Pose { position: *centre, angle: 0.0 };
            let hold = match (motion, &turning) {
                (_, Some((ring, angle))) => self.turning(&at("ring.angle"), ring, angle, share(k, count), &known)?,
                (GroupMotion::Free, None) => Hold::Free,
                (GroupMotion::Fixed, None) => Hold::Fixed,
            };
            let start = match &hold {
                Hold::Path { position, angle } => {
                    let value = |f: &Expression| f.eval_at(Point::zeros(), 0.0, 0.0);
                    Pose { position: Point::new(value(&position[0]), value(&position[1])), angle: value(angle) }
                }
                Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Held { .. } => start,
            };
            bodies.push(Body {
                name: format!("{name}-{}", k + 1),
                key: key.to_owned(),
                force: self.force(&at("force"), &mut table.force, &known, &start)?,
                torque: self.torque(&at("torque"), &mut table.torque, &known, &start)?,
                shape,
                hold,
                density,
                friction,
                start,
                start_twist: Twist::ZERO,
            });
        }
        Ok(bodies)
    }

    pub(super) fn group_count(&self, key: &str, table: &BodiesTable) -> Result<usize, SceneError> {
        let places = [table.in_box.is_some(), table.in_disc.is_some(), table.ring.is_some(), table.at.is_some()];
        let one = places.iter().filter(|given| **given).count() == 1;
        let rule = "exactly one of `box`, `disc`, `ring` and `at` is needed: where the bodies are";
        self.require(one, key, "(a table)", rule, "such as box = [[0, 0], [1, 1]]")?;
        let count = format!("{key}.count");
        match (&table.at, table.count) {
            (Some(at), None) => {
                self.require(!at.is_empty(), &format!("{key}.at"), "[]", "the list is empty", "list the centres")?;
                Ok(at.len())
            }
            (Some(_), Some(given)) => {
                Err(self.error(&count, given, "`at` tells how many there are", "remove one of the two"))
            }
            (None, Some(given)) => {
                let rule = format!("must lie between 1 and {MOST}");
                self.require(BodiesTable::COUNT.has_count(given), &count, given, &rule, "how many bodies to place")?;
                Ok(given)
            }
            (None, None) => Err(self.missing(key, "count", "add `count = 100`, the number of bodies")),
        }
    }

    pub(super) fn group_radii(&self, key: &str, given: Radii) -> Result<[f64; 2], SceneError> {
        match given {
            Radii::Equal(radius) => self.length(key, radius, "a length, or a range [0.01, 0.02]").map(|r| [r, r]),
            Radii::Between([low, high]) => {
                let holds = low > 0.0 && low <= high && high.is_finite();
                let rule = "must be two lengths greater than 0, the smaller one first";
                self.require(holds, key, point([low, high]), rule, "such as [0.015, 0.025]")?;
                self.length(key, low, "such as [0.015, 0.025]")?;
                self.length(key, high, "such as [0.015, 0.025]")?;
                Ok([low, high])
            }
        }
    }

    pub(super) fn group_centres(
        &self,
        key: &str,
        table: &BodiesTable,
        radii: &[f64],
        among: Among,
    ) -> Result<Vec<Point>, SceneError> {
        let at = |name: &str| format!("{key}.{name}");
        let finite = |name: &str, x: [f64; 2]| {
            self.require(x.iter().all(|x| x.is_finite()), &at(name), point(x), "must be finite", "such as [0, 0]")
        };
        if let Some(centres) = &table.at {
            centres.iter().enumerate().try_for_each(|(k, x)| finite(&format!("at.{k}"), *x))?;
            return Ok(centres.iter().map(|x| Point::from(*x)).collect());
        }
        if let Some(RingTable { centre, radius, .. }) = &table.ring {
            finite("ring.centre", *centre)?;
            self.positive(&at("ring.radius"), *radius, "of the circle on which the centres lie")?;
            let angle = |k: usize| share(k, radii.len());
            let on = |k: usize| Point::from(*centre) + *radius * Point::new(angle(k).cos(), angle(k).sin());
            return Ok((0..radii.len()).map(on).collect());
        }
        let (region, name) = match (table.in_box, table.in_disc) {
            (Some([low, high]), _) => {
                let holds = low.iter().chain(&high).all(|x| x.is_finite()) && low[0] < high[0] && low[1] < high[1];
                let shown = format!("[{}, {}]", point(low), point(high));
                let rule = "must be the lower left and the upper right corner";
                self.require(holds, &at("box"), shown, rule, "such as [[0, 0], [1, 1]]")?;
                (Region::Box([low.into(), high.into()]), "box")
            }
            (None, Some(CircleTable { centre, radius })) => {
                finite("disc.centre", centre)?;
                self.positive(&at("disc.radius"), radius, "of the disc in which the bodies lie")?;
                (Region::Disc { centre: centre.into(), radius }, "disc")
            }
            (None, None) => unreachable!("one of four places was given"),
        };
        let widest = radii.iter().copied().fold(0.0, f64::max);
        let rule = format!("must be at most {}: a larger body does not fit into the `{name}`", region.inradius());
        self.require(
            widest <= region.inradius(),
            &at("radius"),
            widest,
            &rule,
            "take smaller bodies or a larger place",
        )?;
        let others: Vec<(Shape, Pose)> = among.before.iter().map(|body| (body.shape.clone(), body.start)).collect();
        let seed = table.seed.unwrap_or(SEED);
        scatter(&region, radii, seed, &others, among.walls).map_err(|filled| {
            let rule = format!(
                "there is no room: with {:.1} % of the `{name}` filled, the next one finds no place",
                100.0 * filled
            );
            let hint = "random places fill at most about half: take fewer or smaller bodies, or a larger place";
            self.error(&at("count"), radii.len(), &rule, hint)
        })
    }

    /// The path of a body of a ring that turns, whose place on it is at the angle `first` when it has not turned yet.
    pub(super) fn turning(
        &self,
        key: &str,
        ring: &RingTable,
        angle: &Formula,
        first: f64,
        known: &[(&str, f64)],
    ) -> Result<Hold, SceneError> {
        let turned = self.of_body(key, angle, known)?;
        let rule = "must be a formula of t alone";
        let alone = turned.depends_on_time_alone();
        self.require(alone, key, format!("\"{angle}\""), rule, "such as \"0.5*t\"")?;
        let [x, y] = ring.centre;
        let along = |centre: f64, function: &str| {
            Formula::Text(format!("{centre:?} + {:?}*{function}({first:?} + ({angle}))", ring.radius))
        };
        let position = self.of_body_pair(key, &[along(x, "cos"), along(y, "sin")], known)?;
        Ok(Hold::Path { position, angle: turned })
    }
}
