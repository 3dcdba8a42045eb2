//! The rules of `[[output]]`.

use std::collections::{BTreeMap, BTreeSet};

use super::{CONSTANT_DENSITY, Checker, WRONG_KIND, broken_by};
use crate::body::Body;
use crate::measure::fields::ALL;
use crate::measure::list::{self, Asked, Of, On, Premise, Which};
use crate::measure::{Measure, OutputField};
use crate::mesh::Point;
use crate::mesh::generate::{GENERATORS, MeshScene};
use crate::model::{Conditions, ModelKind, Parameters};
use crate::names;
use crate::scene::Initial;
use crate::scene::error::SceneError;
use crate::scene::kinds::{self, SceneKind};
use crate::scene::maps::{MapRequest, MapTable};
use crate::scene::output::{
    Cut, CutTable, EveryTable, LEAST_ON_A_CIRCLE, MOST_POINTS, Output, OutputTable, SectionTable, What,
};
use crate::schema::Range;
use crate::scheme::Schedule;

/// Most bodies that a message names.
const TOLD: usize = 12;

/// What there is to be written.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct Scope<'a> {
    /// Of a tissue.
    pub tissue: Option<&'a Parameters>,
    pub kind: &'static SceneKind,
    /// The rigid bodies that there are.
    pub bodies: &'a [Body],
    /// By tag, where forces act on the boundary of a flow.
    pub boundary: Option<&'a BTreeMap<String, Conditions>>,
}

/// Why a domain has no way around.
fn rule_of_tracks() -> String {
    let round: Vec<&str> = GENERATORS.iter().filter(|shape| shape.has_track()).map(|shape| shape.name).collect();
    let (last, others) = round.split_last().map_or(("", &[][..]), |(last, others)| (*last, others));
    format!("only the shapes {} and {last} have a way around", others.join(", "))
}

impl Checker<'_> {
    pub(in crate::scene) fn outputs(&self, tables: &[OutputTable], scope: Scope) -> Result<Vec<Output>, SceneError> {
        let numbered = tables.iter().enumerate();
        let outputs: Vec<Output> =
            numbered.map(|(at, table)| self.output(&format!("output.{at}"), table, scope)).collect::<Result<_, _>>()?;
        self.one_name_each(&outputs)?;
        self.one_torque_each(&outputs)?;
        self.one_picture_each(&outputs)?;
        Ok(outputs)
    }

    /// What goes around needs a domain that one can go around in.
    pub(super) fn on_a_track(&self, mesh: &MeshScene, initial: &Initial, outputs: &[Output]) -> Result<(), SceneError> {
        let closed = mesh.track().is_some();
        let rule = rule_of_tracks();
        let circulates = *initial == Initial::Circulating;
        let hint = "take one of these shapes, or give two formulas";
        self.require(closed || !circulates, "initial.polarity", "\"circulating\"", &rule, hint)?;
        for (at, output) in outputs.iter().enumerate() {
            let goes_around = output.what.measures().iter().filter(|asked| asked.measure.needs(Premise::Track));
            for asked in goes_around {
                let (key, shown) = (format!("output.{at}.measures"), asked.to_string());
                self.require(closed, &key, shown, &rule, "take one of these shapes, or remove it")?;
            }
        }
        Ok(())
    }

    /// Torques on one tag about different points would have the same column.
    fn one_torque_each(&self, outputs: &[Output]) -> Result<(), SceneError> {
        let mut seen: BTreeMap<&str, &Asked> = BTreeMap::new();
        for (at, output) in outputs.iter().enumerate() {
            for asked in output.what.measures() {
                for column in asked.column_names() {
                    let first = *seen.entry(column).or_insert(asked);
                    let rule = format!("{first} has the column `{column}` already");
                    let hint = "keep one of the two: T₂ = T₁ + (x₁ − x₂) × F gives the other";
                    self.require(first == asked, &format!("output.{at}.measures"), asked, &rule, hint)?;
                }
            }
        }
        Ok(())
    }

    /// Cuts of one name would overwrite each other's table.
    fn one_name_each(&self, outputs: &[Output]) -> Result<(), SceneError> {
        let mut names = BTreeSet::new();
        for (at, output) in outputs.iter().enumerate() {
            for cut in output.what.cuts() {
                let name = cut.name();
                let hint = "give every cut a name of its own";
                let rule = "two cuts have this name, and would write the same file";
                self.require(names.insert(name), &format!("output.{at}.cuts"), format!("\"{name}\""), rule, hint)?;
            }
        }
        Ok(())
    }

    fn output(&self, key: &str, table: &OutputTable, scope: Scope) -> Result<Output, SceneError> {
        let one =
            "exactly one of `fields`, `measures`, `cuts`, `maps`, `bodies = true` and `checkpoint = true` is needed";
        let split = "write one [[output]] for each";
        let flags = (table.bodies, table.checkpoint);
        let what = match (&table.fields, &table.measures, &table.cuts, &table.maps, flags) {
            (Some(fields), None, None, None, (None, None)) => {
                What::Fields(self.fields_of(&format!("{key}.fields"), fields, scope)?)
            }
            (None, Some(measures), None, None, (None, None)) => What::Measures(self.measures(key, measures, scope)?),
            (None, None, Some(cuts), None, (None, None)) => self.cuts_of(key, cuts, (table, scope))?,
            (None, None, None, Some(maps), (None, None)) => What::Maps(self.maps_of(key, maps, scope)?),
            (None, None, None, None, (Some(true), None)) => self.bodies_of(key, table, scope)?,
            (None, None, None, None, (None, Some(true))) => What::Checkpoint,
            (_, _, _, _, _) => return Err(self.error(key, "(a table)", one, split)),
        };
        let rule = "only an output of `bodies` has a table of contacts";
        let beside = table.contacts.is_none() || table.bodies.is_some();
        self.require(
            beside,
            &format!("{key}.contacts"),
            "(given)",
            rule,
            "put it beside `bodies = true`, or remove it",
        )?;
        let (rule, hint) = ("only tables of cuts have columns of fields", "put it beside `cuts`, or remove it");
        let beside = table.columns.is_none() || table.cuts.is_some();
        self.require(beside, &format!("{key}.columns"), "(given)", rule, hint)?;
        let empty = match &what {
            What::Fields(list) => list.is_empty().then_some("fields"),
            What::Measures(list) => list.is_empty().then_some("measures"),
            What::Cuts { columns: Some(list), .. } if list.is_empty() => Some("columns"),
            What::Cuts { cuts, .. } => cuts.is_empty().then_some("cuts"),
            What::Maps(list) => list.is_empty().then_some("maps"),
            What::Bodies { .. } | What::Checkpoint => None,
        };
        if let Some(list) = empty {
            let hint = "name something or remove the [[output]]";
            return Err(self.error(&format!("{key}.{list}"), "[]", "the list is empty", hint));
        }
        let estimate = self.estimate(&format!("{key}.estimate"), table)?;
        Ok(Output { what, schedule: self.schedule(&format!("{key}.every"), table.every.as_ref())?, estimate })
    }

    fn estimate(&self, key: &str, table: &OutputTable) -> Result<bool, SceneError> {
        let Some(asked) = table.estimate else { return Ok(false) };
        let (rule, hint) = ("only measures have estimates", "put it beside `measures`, or remove it");
        self.require(table.measures.is_some(), key, asked, rule, hint)?;
        let rule = "errors are estimated of scenes of tissue alone";
        let tissue = *self.source.kind() == kinds::TISSUE;
        self.require(tissue, key, asked, rule, "remove it, and compare runs with smaller steps and cells")?;
        let rule = "the errors are estimated on coarser meshes, and a mesh from a file has none";
        let hint = "give `mesh.shape` instead of `mesh.file`, or remove it and compare with a finer file";
        let mesh = self.source.value("mesh").and_then(toml_edit::Item::as_table_like);
        let from_file = mesh.is_some_and(|mesh| mesh.contains_key("file"));
        self.require(!(asked && from_file), key, asked, rule, hint)?;
        Ok(asked)
    }

    fn measures(&self, key: &str, measures: &[Asked], scope: Scope) -> Result<Vec<Asked>, SceneError> {
        let key = &format!("{key}.measures");
        measures.iter().try_for_each(|asked| self.measure(key, asked, scope))?;
        Ok(measures.to_vec())
    }

    fn measure(&self, key: &str, asked: &Asked, scope: Scope) -> Result<(), SceneError> {
        let (measure, shown) = (asked.measure, || asked.to_string());
        if let (true, Some(on), Some(boundary)) = (measure.is_on_a_tag(), &asked.on, scope.boundary) {
            return self.tag(key, asked, on, boundary);
        }
        match (measure.of, scope.tissue) {
            (Of::Bodies(which, _) | Of::Body(which, _), _) => {
                let hint = "add a [[body]], or remove it";
                self.require(!scope.bodies.is_empty(), key, shown(), "the scene has no rigid body", hint)?;
                let in_flow = scope.kind.flows();
                let (holds, rule) = match which {
                    Which::Any | Which::Moving => (true, ""),
                    Which::InAFlow => (in_flow, "particles are in no flow that would act on them"),
                    Which::InATissue => (scope.tissue.is_some(), "only a tissue has an energy law"),
                };
                self.require(holds, key, shown(), rule, "remove it")?;
                asked.on.as_ref().map_or(Ok(()), |on| self.named_body(key, asked, &on.name, scope.bodies))
            }
            (Of::Flow(_) | Of::Boundary { .. } | Of::Tissue(..), Some(_)) => Ok(()),
            (Of::Compressible(_), Some(p)) => {
                self.require(p.kind() == ModelKind::Compressible, key, shown(), CONSTANT_DENSITY, WRONG_KIND)
            }
            (Of::Flow(_) | Of::Boundary { .. } | Of::Tissue(..) | Of::Compressible(_), None) => {
                let rule = format!("{} has no such measure", scope.kind.shown);
                let flows = scope.kind.flows();
                let driven = |m: &Measure| scope.boundary.is_some() || !m.is_on_a_tag();
                let has = |m: &&&Measure| m.is_of_bodies() || flows && !m.is_of_tissue() && driven(m);
                let known: Vec<&str> = list::ALL.iter().filter(has).map(|m| m.name).collect();
                let hint = format!("the measures that it has are {}", known.join(", "));
                self.require(flows && !measure.is_of_tissue() && driven(measure), key, shown(), &rule, &hint)
            }
        }
    }

    /// A measure of a body that there is.
    fn named_body(&self, key: &str, asked: &Asked, name: &str, bodies: &[Body]) -> Result<(), SceneError> {
        if bodies.iter().any(|body| body.name == name) {
            return Ok(());
        }
        let known: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
        let rule = format!("there is no body `{name}`{}", names::did_you_mean(name, &known));
        let dots = if known.len() > TOLD { ", …" } else { "" };
        let told: Vec<&str> = known.into_iter().take(TOLD).collect();
        Err(self.error(key, asked, &rule, &format!("the bodies are {}{dots}", told.join(", "))))
    }

    /// A measure on a tag that the boundary has.
    fn tag(
        &self,
        key: &str,
        asked: &Asked,
        on: &On,
        boundary: &BTreeMap<String, Conditions>,
    ) -> Result<(), SceneError> {
        let known: Vec<&str> = boundary.keys().map(String::as_str).collect();
        let rule = format!("there is no boundary tag `{}`{}", on.name, names::did_you_mean(&on.name, &known));
        let hint = format!("the tags with conditions are {}", known.join(", "));
        self.require(boundary.contains_key(&on.name), key, asked, &rule, &hint)?;
        let finite = on.around.is_none_or(|around| around.iter().all(|c| c.is_finite()));
        self.require(finite, key, asked, "`around` must be finite", "two numbers, such as [0, 0]")
    }

    /// The fields that a list names, where the scene has them.
    fn fields_of(
        &self,
        key: &str,
        fields: &[&'static OutputField],
        scope: Scope,
    ) -> Result<Vec<&'static OutputField>, SceneError> {
        let has_fields = !scope.kind.fields.is_empty();
        self.require(has_fields, key, "(given)", "particles have no fields", "write `bodies = true` instead")?;
        for field in fields {
            let shown = format!("\"{}\"", field.name);
            if let Some(p) = scope.tissue {
                let (rule, hint) = broken_by(field, p).unwrap_or_default();
                self.require(rule.is_empty(), key, &shown, rule, hint)?;
            }
            let rule = format!("{} has no such field", scope.kind.shown);
            let all: Vec<&str> = ALL.iter().filter(|field| scope.kind.has(field)).map(|field| field.name).collect();
            let hint = format!("the fields that it has are {}", all.join(", "));
            self.require(scope.kind.has(field), key, shown, &rule, &hint)?;
        }
        Ok(fields.to_vec())
    }

    fn cuts_of(&self, key: &str, cuts: &[CutTable], (table, scope): (&OutputTable, Scope)) -> Result<What, SceneError> {
        let rule = "particles have no fields that could be cut";
        let has_fields = !scope.kind.fields.is_empty();
        self.require(has_fields, &format!("{key}.cuts"), "(given)", rule, "write `bodies = true` instead")?;
        let named = |fields: &Vec<_>| self.fields_of(&format!("{key}.columns"), fields, scope);
        let columns = table.columns.as_ref().map(named).transpose()?;
        Ok(What::Cuts { cuts: self.cuts(key, cuts)?, columns: columns.map(|fields| OutputField::in_order(&fields)) })
    }

    fn maps_of(&self, key: &str, maps: &[MapTable], scope: Scope) -> Result<Vec<MapRequest>, SceneError> {
        if let Some(p) = scope.tissue {
            return self.maps(key, maps, p);
        }
        let numbered = maps.iter().enumerate();
        numbered.map(|(at, map)| self.map_without_tissue(&format!("{key}.maps.{at}"), map, scope)).collect()
    }

    fn bodies_of(&self, key: &str, table: &OutputTable, scope: Scope) -> Result<What, SceneError> {
        let rule = "the scene has no rigid body";
        self.require(!scope.bodies.is_empty(), &format!("{key}.bodies"), true, rule, "add a [[body]], or remove it")?;
        Ok(What::Bodies { contacts: table.contacts.unwrap_or(false) })
    }

    fn cuts(&self, key: &str, cuts: &[CutTable]) -> Result<Vec<Cut>, SceneError> {
        let numbered = cuts.iter().enumerate();
        numbered
            .map(|(at, cut)| match cut {
                CutTable::Axis(axis) => Ok(Cut::Axis(*axis)),
                CutTable::Section(section) if section.is_circle() => self.circle(&format!("{key}.cuts.{at}"), section),
                CutTable::Section(section) => self.line(&format!("{key}.cuts.{at}"), section),
            })
            .collect()
    }

    fn line(&self, table: &str, line: &SectionTable) -> Result<Cut, SceneError> {
        let key = |name: &str| format!("{table}.{name}");
        self.file_name(&key("name"), &line.name, "such as \"wake\"")?;
        let point = |name: &str, given: Option<[f64; 2]>| {
            given
                .map(Point::from)
                .ok_or_else(|| self.missing(table, name, "a line has `from` and `to`, a circle `centre` and `radius`"))
        };
        let (from, to) = (point("from", line.from)?, point("to", line.to)?);
        let length = (to - from).norm();
        let apart = length.is_finite() && length > 0.0;
        let shown = format!("[{}, {}]", to.x, to.y);
        self.require(apart, &key("to"), shown, "must be finite and differ from `from`", "give two points")?;
        let points = line.points.unwrap_or_default();
        let rule = format!("must lie between 2 and {MOST_POINTS}");
        self.require(SectionTable::POINTS.has_count(points), &key("points"), points, &rule, "200 is usual")?;
        Ok(Cut::Line { name: line.name.clone(), from, to, points })
    }

    fn circle(&self, table: &str, circle: &SectionTable) -> Result<Cut, SceneError> {
        let key = |name: &str| format!("{table}.{name}");
        self.file_name(&key("name"), &circle.name, "such as \"circle\"")?;
        for (name, given) in [("from", circle.from), ("to", circle.to)] {
            if let Some([x, y]) = given {
                let hint = "remove it, or remove `centre` and `radius` to have a line";
                return Err(self.error(&key(name), format!("[{x}, {y}]"), "a circle has no ends", hint));
            }
        }
        let hint = "such as { name = \"circle\", centre = [0, 0], radius = 1.05 }";
        let centre = circle.centre.ok_or_else(|| self.missing(table, "centre", hint))?;
        let finite = centre.iter().all(|c| c.is_finite());
        self.require(finite, &key("centre"), format!("[{}, {}]", centre[0], centre[1]), "must be finite", hint)?;
        let radius = circle.radius.ok_or_else(|| self.missing(table, "radius", hint))?;
        let radius = self.positive(&key("radius"), radius, hint)?;
        let points = circle.points.unwrap_or_default();
        let rule = format!("must lie between {LEAST_ON_A_CIRCLE} and {MOST_POINTS}");
        self.require(
            points >= LEAST_ON_A_CIRCLE && SectionTable::POINTS.has_count(points),
            &key("points"),
            points,
            &rule,
            "360 is usual",
        )?;
        Ok(Cut::Circle { name: circle.name.clone(), centre: centre.into(), radius, points })
    }

    /// A name that files may have.
    pub(super) fn file_name(&self, key: &str, name: &str, hint: &str) -> Result<(), SceneError> {
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
        let holds = !name.is_empty() && name.chars().all(plain);
        let rule = "must be a file name of letters, digits, `-`, `_`";
        self.require(holds, key, format!("\"{name}\""), rule, hint)
    }

    fn schedule(&self, key: &str, every: Option<&EveryTable>) -> Result<Schedule, SceneError> {
        match every.map(|every| (every.time, every.steps)) {
            None => Ok(Schedule::End),
            Some((Some(time), None)) => {
                let positive = self.positive(&format!("{key}.time"), time, "the time between two outputs")?;
                Ok(Schedule::Time(positive))
            }
            Some((None, Some(steps))) => {
                let hint = "the number of steps between two outputs";
                self.require(Range::SOME.has_count(steps), &format!("{key}.steps"), steps, "must be at least 1", hint)?;
                Ok(Schedule::Steps(steps))
            }
            Some((Some(_), Some(_)) | (None, None)) => {
                let rule = "exactly one of `time` and `steps` is needed";
                Err(self.error(key, "(a table)", rule, "leave `every` out to write only at the end"))
            }
        }
    }
}
