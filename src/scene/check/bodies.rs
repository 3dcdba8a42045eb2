//! The rules of `[[body]]` and `[rigid]`, and of all tables of bodies together.

use super::groups::Among;
use super::passages::Side;
use super::{Checker, shown};
use crate::body::{Body, Hold};
use crate::contact::{Partner, Wall};
use crate::expression::{Expression, Formula, VectorFormula};
use crate::mesh::Point;
use crate::model::ModelError;
use crate::model::immersed::flow::{EPSILON, Method, Penalty, Settings};
use crate::scene::bodies::Bodies;
use crate::scene::bodies::place::{Overlap, crowded_rule, first_crowded, first_overlap};
use crate::scene::bodies::tables::{BodyTable, BodyTables, MOST, MethodName, MotionTable, RigidTable, zero};
use crate::scene::error::SceneError;
use crate::schema::Range;
use crate::shape::{Pose, Rules, Shape, ShapeError, Twist};

/// What surrounds the bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Around {
    /// Nothing: forces and contact alone move them, with their inertia or without.
    Nothing { inertia: bool },
    /// A fluid or a tissue.
    Flow,
}

/// Why a compressible sheet has no bodies.
pub(super) const NO_BODIES: &str = "a sheet that can be squeezed carries no rigid bodies";

/// Names and values that formulas may use.
pub(super) type Symbols<'a> = &'a [(&'static str, f64)];

impl Checker<'_> {
    /// The bodies of a scene, with every default filled in the tables; `None` where nothing is said.
    pub(super) fn bodies(
        &self,
        tables: &mut BodyTables,
        around: Around,
        symbols: Symbols,
        sides: &mut [Side],
    ) -> Result<Option<Bodies>, SceneError> {
        if tables.is_empty() {
            let rule = "there is no body that could meet this boundary";
            self.no_passage(sides, rule, "remove it, or add [[body]] with `shape` and `position`")?;
            return Ok(None);
        }
        self.some_body(tables)?;
        let rigid = self.rigid(tables, around)?;
        let (walls, mut wall_tags) = self.walls(&mut tables.wall, around)?;
        let mut bodies: Vec<Body> = Vec::new();
        for (at, table) in tables.body.iter_mut().enumerate() {
            table.name.get_or_insert_with(|| format!("body-{}", at + 1));
            bodies.push(self.body(&format!("body.{at}"), table, around, symbols)?);
        }
        for (at, table) in tables.bodies.iter_mut().enumerate() {
            let name = || if at == 0 { "disc".to_owned() } else { format!("disc{}", at + 1) };
            table.name.get_or_insert_with(name);
            let key = format!("bodies.{at}");
            let among = Among { around, symbols, before: &bodies, walls: &walls };
            let group = self.group(&key, table, among)?;
            bodies.extend(group);
            let rule = format!("there are more than {MOST} bodies");
            self.require(bodies.len() <= MOST, &format!("bodies.{at}.count"), bodies.len(), &rule, "take fewer")?;
        }
        self.names_differ(&bodies)?;
        let numbers: Vec<usize> = (0..tables.wall.len()).filter(|at| tables.wall[*at].tag.is_none()).collect();
        self.apart(&bodies, &walls, &numbers, around)?;
        let open_tags = self.passages(sides, &bodies, &mut wall_tags)?;
        let touch = bodies.len() > 1 || !(walls.is_empty() && wall_tags.is_empty());
        let contact = self.contact(&mut tables.contact, touch, around)?;
        if let Some(contact) = &contact {
            let crowded = first_crowded(&bodies, &walls, contact.margin);
            crowded.map_or(Ok(()), |(at, partner, gap)| {
                let partner = match partner {
                    Partner::Body(other) => format!("`{}`", bodies[other].name),
                    Partner::Wall(wall) => format!("the wall `wall.{}`", numbers[wall]),
                };
                let (rule, hint) = crowded_rule(&bodies[at].name, &partner, gap);
                Err(self.error("contact.margin", contact.margin, &rule, &hint))
            })?;
        }
        Ok(Some(Bodies { bodies, walls, wall_tags, open_tags, contact, rigid }))
    }

    /// Walls and settings without a body are a mistake.
    fn some_body(&self, tables: &BodyTables) -> Result<(), SceneError> {
        if !(tables.body.is_empty() && tables.bodies.is_empty()) {
            return Ok(());
        }
        let key = match tables {
            BodyTables { wall, .. } if !wall.is_empty() => "wall",
            BodyTables { contact: Some(_), .. } => "contact",
            BodyTables { .. } => "rigid",
        };
        let hint = "add [[body]] with `shape` and `position`, or remove it";
        Err(self.error(key, "(given)", "there is no body that it could act on", hint))
    }

    fn rigid(&self, tables: &mut BodyTables, around: Around) -> Result<Settings, SceneError> {
        match around {
            Around::Nothing { .. } => Ok(Settings::default()),
            Around::Flow => {
                let table = tables.rigid.get_or_insert_default();
                let (order, hint) = (table.order, "2 matches bdf2, 1 is explicit Euler");
                self.require(RigidTable::ORDER.has_count(order), "rigid.order", order, "must be 1 or 2", hint)?;
                Ok(Settings { method: self.method(table)?, order })
            }
        }
    }

    fn method(&self, table: &mut RigidTable) -> Result<Method, SceneError> {
        let usual = table.usual_method();
        match *table.method.get_or_insert(usual) {
            MethodName::Penalty => {
                let epsilon = *table.epsilon.get_or_insert(EPSILON);
                let strength = *table.strength.get_or_insert_default();
                let rule = "must lie between 0 and 1, both excluded";
                let hint = "1/ε is how much more viscous a body is than what surrounds it; 1e-8 is usual";
                let holds = RigidTable::EPSILON.has(epsilon);
                self.require(holds, "rigid.epsilon", shown(epsilon), rule, hint)?;
                Ok(Method::Penalty(Penalty { epsilon, strength }))
            }
            MethodName::Nitsche => {
                let strength = table.strength.map(|strength| format!("\"{strength:?}\"").to_lowercase());
                for (key, given) in [("rigid.epsilon", table.epsilon.map(shown)), ("rigid.strength", strength)] {
                    let rule = "only the penalty has it, and `rigid.method` is \"nitsche\"";
                    let hint = "remove it, or set `rigid.method = \"penalty\"`";
                    given.map_or(Ok(()), |given| Err(self.error(key, given, rule, hint)))?;
                }
                Ok(Method::Nitsche)
            }
        }
    }

    fn body(&self, key: &str, table: &mut BodyTable, around: Around, symbols: Symbols) -> Result<Body, SceneError> {
        let at = |name: &str| format!("{key}.{name}");
        let name = table.name.clone().unwrap_or_default();
        self.body_name(&at("name"), &name)?;
        let key_of_shape = format!("{}.{}", at("shape"), table.shape.name());
        let (shape, centre) = table.shape.make(&ShapeRules { checker: self, key: key_of_shape })?;
        let density = *table.density.get_or_insert(1.0);
        self.positive(&at("density"), density, "mass per area; 1 is that of the medium")?;
        self.computable(&at("density"), &shape, density)?;
        let known = numbers(&shape, density, symbols);
        let motion = table.motion.get_or_insert(MotionTable::Free).clone();
        let start = self.start(key, table, &motion, centre, &known)?;
        let hold = self.hold(&at("motion"), &motion, &shape, &start, &known)?;
        let force = self.force(&at("force"), &mut table.force, &known, &start)?;
        let torque = self.torque(&at("torque"), &mut table.torque, &known, &start)?;
        let friction = self.body_friction(&at("friction"), &mut table.friction, around)?;
        let start_twist = self.start_twist(key, table, &hold, around)?;
        let key = key.to_owned();
        Ok(Body { name, key, shape, hold, density, force, torque, friction, start, start_twist })
    }

    /// Mass and moment of inertia must be numbers that can be computed with.
    pub(super) fn computable(&self, key: &str, shape: &Shape, density: f64) -> Result<(), SceneError> {
        let (mass, inertia) = (density * shape.area(), density * shape.second_moment());
        let rule =
            format!("makes a mass of {mass:e} and a moment of inertia of {inertia:e}: no numbers to compute with");
        let holds = mass.is_normal() && inertia.is_normal();
        self.require(holds, key, shown(density), &rule, "1 is the density of the medium")
    }

    /// A name that tables, messages and `--set` can use.
    pub(super) fn body_name(&self, key: &str, name: &str) -> Result<(), SceneError> {
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
        let holds = !name.is_empty() && name.chars().all(plain) && name.parse::<usize>().is_err();
        let rule = "must be a name of letters, digits, `-`, `_`, and no number";
        self.require(holds, key, format!("\"{name}\""), rule, "such as \"disc\" or \"obstacle-1\"")
    }

    fn start(
        &self,
        key: &str,
        table: &mut BodyTable,
        motion: &MotionTable,
        centre: Option<Point>,
        known: &[(&str, f64)],
    ) -> Result<Pose, SceneError> {
        let at = |name: &str| format!("{key}.{name}");
        if let MotionTable::Path(path) = motion {
            let hint = "remove it, or take another motion";
            for (name, given) in [("position", table.position.is_some()), ("angle", table.angle.is_some())] {
                self.require(!given, &at(name), "(given)", "the path of the motion gives it", hint)?;
            }
            let formulas = self.of_body_pair(&at("motion.path.position"), &path.position, known)?;
            let angle = self.of_body(&at("motion.path.angle"), &path.angle, known)?;
            let value = |f: &Expression| f.eval_at(Point::zeros(), 0.0, 0.0);
            let position = Point::new(value(&formulas[0]), value(&formulas[1]));
            let pose = Pose { position, angle: value(&angle) };
            let finite = [pose.position.x, pose.position.y, pose.angle].iter().all(|x| x.is_finite());
            let rule = "must be finite at t = 0";
            self.require(finite, &at("motion.path"), "(formulas)", rule, "the path is a formula of t alone")?;
            return Ok(pose);
        }
        let angle = *table.angle.get_or_insert(0.0);
        self.require(angle.is_finite(), &at("angle"), angle, "must be finite", "an angle in radians")?;
        if table.position.is_none() {
            table.position = centre.map(|x| [x.x, x.y]);
        }
        let position = table.position.ok_or_else(|| self.missing(key, "position", "add `position = [x, y]`"))?;
        let finite = position.iter().all(|x| x.is_finite());
        self.require(finite, &at("position"), point(position), "must be finite", "such as [0.5, 0.5]")?;
        Ok(Pose { position: position.into(), angle })
    }

    fn hold(
        &self,
        key: &str,
        motion: &MotionTable,
        shape: &Shape,
        start: &Pose,
        known: &[(&str, f64)],
    ) -> Result<Hold, SceneError> {
        Ok(match motion {
            MotionTable::Free => Hold::Free,
            MotionTable::Fixed => Hold::Fixed,
            MotionTable::Pinned(pin) => {
                let key = format!("{key}.pinned");
                let away = (Point::from(*pin) - start.position).norm();
                let rule =
                    format!("must be finite, and no farther than {} from the body's centre", shape.circumradius());
                let holds = away.is_finite() && away <= shape.circumradius() * (1.0 + 1e-9);
                self.require(holds, &key, point(*pin), &rule, "a point of the body, in the coordinates of the scene")?;
                Hold::Pinned(start.to_body((*pin).into()))
            }
            MotionTable::Held(held) => Hold::Held {
                velocity: self.of_body_pair(&format!("{key}.held.velocity"), &held.velocity, known)?,
                spin: self.of_body(&format!("{key}.held.spin"), &held.spin, known)?,
            },
            MotionTable::Path(path) => {
                let position = self.of_body_pair(&format!("{key}.path.position"), &path.position, known)?;
                let angle = self.of_body(&format!("{key}.path.angle"), &path.angle, known)?;
                let alone = position.iter().chain([&angle]).all(Expression::depends_on_time_alone);
                let (rule, hint) =
                    ("must be formulas of t alone", "held = { velocity, spin } may depend on x, y, theta");
                self.require(alone, &format!("{key}.path"), "(formulas)", rule, hint)?;
                Hold::Path { position, angle }
            }
        })
    }

    fn start_twist(&self, key: &str, table: &mut BodyTable, hold: &Hold, around: Around) -> Result<Twist, SceneError> {
        let moves = match (around, hold) {
            (Around::Nothing { inertia: true }, Hold::Free | Hold::Pinned(_)) => true,
            (Around::Nothing { .. } | Around::Flow, _) => false,
        };
        if moves {
            let velocity = *table.velocity.get_or_insert([0.0, 0.0]);
            let spin = *table.spin.get_or_insert(0.0);
            let finite = velocity.iter().all(|v| v.is_finite());
            self.require(finite, &format!("{key}.velocity"), point(velocity), "must be finite", "such as [1, 0]")?;
            self.require(spin.is_finite(), &format!("{key}.spin"), spin, "must be finite", "such as 0")?;
            return Ok(Twist { velocity: velocity.into(), spin });
        }
        let rule = match around {
            Around::Flow => "the flow gives the velocity of a body at every time",
            Around::Nothing { inertia: true } => "the motion gives the velocity of this body at every time",
            Around::Nothing { inertia: false } => "without inertia, forces give the velocity at every time",
        };
        let hint = "remove it; only free and pinned bodies of inertial particles have a velocity to start with";
        for (name, given) in [("velocity", table.velocity.is_some()), ("spin", table.spin.is_some())] {
            self.require(!given, &format!("{key}.{name}"), "(given)", rule, hint)?;
        }
        Ok(Twist::ZERO)
    }

    pub(super) fn of_body(
        &self,
        key: &str,
        formula: &Formula,
        known: &[(&str, f64)],
    ) -> Result<Expression, SceneError> {
        let parsed = formula.parse_of_body(known).map(|parsed| parsed.given_at(&self.given(key)));
        parsed.map_err(|error| {
            let error = ModelError::of_expression(key, &error);
            self.error(key, error.value, &error.rule, &error.hint)
        })
    }

    pub(super) fn of_body_pair(
        &self,
        key: &str,
        formulas: &VectorFormula,
        known: &[(&str, f64)],
    ) -> Result<[Expression; 2], SceneError> {
        let [f, g] = formulas;
        Ok([self.of_body(key, f, known)?, self.of_body(key, g, known)?])
    }

    pub(super) fn force(
        &self,
        key: &str,
        given: &mut Option<VectorFormula>,
        known: &[(&str, f64)],
        start: &Pose,
    ) -> Result<[Expression; 2], SceneError> {
        let force = self.of_body_pair(key, given.get_or_insert_with(|| [zero(), zero()]), known)?;
        force.iter().try_for_each(|f| self.finite_at_start(key, f, start))?;
        Ok(force)
    }

    pub(super) fn torque(
        &self,
        key: &str,
        given: &mut Option<Formula>,
        known: &[(&str, f64)],
        start: &Pose,
    ) -> Result<Expression, SceneError> {
        let torque = self.of_body(key, given.get_or_insert_with(zero), known)?;
        self.finite_at_start(key, &torque, start)?;
        Ok(torque)
    }

    fn finite_at_start(&self, key: &str, formula: &Expression, start: &Pose) -> Result<(), SceneError> {
        let value = formula.eval_at(start.position, start.angle, 0.0);
        let rule = format!("is {value} for the body at the start");
        let hint = "a formula must be finite wherever it is used";
        self.require(value.is_finite(), key, format!("\"{}\"", formula.text()), &rule, hint)
    }

    pub(super) fn body_friction(&self, key: &str, given: &mut Option<f64>, around: Around) -> Result<f64, SceneError> {
        match around {
            Around::Flow => {
                let friction = *given.get_or_insert(0.0);
                let holds = BodyTable::FRICTION.has(friction);
                let hint = "friction of the body with the substrate, per area; 0 is none";
                self.require(holds, key, shown(friction), "must lie between 0 and 1e12", hint)?;
                Ok(friction)
            }
            Around::Nothing { .. } => {
                let hint = "remove it; `model.drag` slows particles down";
                let rule = "particles have no friction with a substrate";
                self.require(given.is_none(), key, given.map(shown).unwrap_or_default(), rule, hint)?;
                Ok(0.0)
            }
        }
    }

    fn names_differ(&self, bodies: &[Body]) -> Result<(), SceneError> {
        let mut seen = std::collections::BTreeSet::new();
        for body in bodies {
            let (name, key) = (&body.name, &body.key);
            let value = format!("\"{name}\"");
            let rule = "two bodies have this name";
            let hint = "names tell bodies apart in tables: give each one of its own";
            self.require(seen.insert(name), &format!("{key}.name"), value, rule, hint)?;
        }
        Ok(())
    }

    /// Nothing overlaps at the start; what nothing moves may in the absence of a flow.
    fn apart(&self, bodies: &[Body], walls: &[Wall], numbers: &[usize], around: Around) -> Result<(), SceneError> {
        let immobile = |body: &Body| match (around, &body.hold) {
            (Around::Nothing { .. }, Hold::Fixed | Hold::Held { .. } | Hold::Path { .. }) => true,
            (Around::Nothing { .. } | Around::Flow, _) => false,
        };
        let place = |i: usize| {
            let key = &bodies[i].key;
            let key = if key.starts_with("body.") { format!("{key}.position") } else { key.clone() };
            let at = bodies[i].start.position;
            (key, format!("[{}, {}] (`{}`)", at.x, at.y, bodies[i].name))
        };
        match first_overlap(bodies, walls, &immobile) {
            None => Ok(()),
            Some(Overlap::Coincident(i, j)) => {
                let (key, value) = place(j);
                let rule =
                    format!("has its centre where `{}` has, so nothing tells which way to part them", bodies[i].name);
                Err(self.error(&key, value, &rule, "move one of the two"))
            }
            Some(Overlap::Bodies(i, j, depth)) => {
                let (key, value) = place(j);
                let rule = format!("overlaps `{}` by {depth:.3e}", bodies[i].name);
                Err(self.error(&key, value, &rule, "move one of the two apart, or make it smaller"))
            }
            Some(Overlap::Wall(i, wall, depth)) => {
                let (key, value) = place(i);
                let inside = match walls[wall] {
                    Wall::Hollow { radius, .. } => format!(", a hollow of radius {radius}"),
                    Wall::Segment(_) => ", which it has to stay on the left of".to_owned(),
                    Wall::Disc { radius, .. } => format!(", a disc of radius {radius}"),
                };
                let rule = format!("overlaps the wall `wall.{}`{inside}, by {depth:.3e}", numbers[wall]);
                Err(self.error(&key, value, &rule, "move the body away from it, or make it smaller"))
            }
        }
    }

    /// Refuses bodies in a scene whose kind has none.
    pub(super) fn no_bodies(&self, tables: &BodyTables) -> Result<(), SceneError> {
        let given = [
            ("body", !tables.body.is_empty()),
            ("bodies", !tables.bodies.is_empty()),
            ("wall", !tables.wall.is_empty()),
            ("contact", tables.contact.is_some()),
            ("rigid", tables.rigid.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map_or(Ok(()), |(key, _)| {
            Err(self.error(key, "(given)", NO_BODIES, "remove it, or take kind = \"incompressible\" or \"stokes\""))
        })
    }
}

/// The rules on the keys of a shape, below the key of its table.
struct ShapeRules<'a, 'c> {
    checker: &'a Checker<'c>,
    key: String,
}

impl Rules for ShapeRules<'_, '_> {
    type Error = SceneError;

    fn length(&self, key: &str, value: f64, hint: &str) -> Result<f64, SceneError> {
        self.checker.length(&format!("{}.{key}", self.key), value, hint)
    }

    fn within(&self, key: &str, value: f64, range: Range, rule: &str, hint: &str) -> Result<f64, SceneError> {
        self.checker.within(&format!("{}.{key}", self.key), value, range, rule, hint)
    }

    fn wrong(&self, key: &str, value: String, error: &ShapeError) -> SceneError {
        let text = error.to_string();
        let (rule, hint) = text.split_once("; hint: ").unwrap_or((&text, "give another shape"));
        self.checker.error(&format!("{}.{key}", self.key), value, rule, hint)
    }
}

/// Names that the formulas of a body may use.
pub(super) fn numbers<'a>(shape: &Shape, density: f64, symbols: &'a [(&'static str, f64)]) -> Vec<(&'a str, f64)> {
    let area = shape.area();
    let mut all = vec![("area", area), ("mass", density * area), ("inertia", density * shape.second_moment())];
    all.extend(shape.round_radius().map(|radius| ("radius", radius)));
    all.extend(symbols);
    all
}

pub(super) fn point([x, y]: [f64; 2]) -> String {
    format!("[{x}, {y}]")
}
