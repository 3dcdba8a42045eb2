//! The rules of `[time]`, `[steady]` and `[coupling]`.

use std::collections::BTreeMap;

use super::{CONSTANT_DENSITY, Checker, WRONG_KIND, exact_hint, shown};
use crate::model::{Conditions, ModelKind, Parameters};
use crate::scene::error::SceneError;
use crate::scene::tables::{
    CouplingName, CouplingTable, DensityScheme, SceneFile, SteadyTable, StopTable, TimeStart, TimeTable,
};
use crate::scene::{ControlSettings, CouplingSettings, Sources, SteadySettings, Time};
use crate::schema::Range;
use crate::time::CouplingKind;

/// Whether a positive number is farther from 1 than another by more than three powers of ten: it is to blame where
/// the two do not go together.
fn is_odder(one: f64, other: f64) -> bool {
    one.log10().abs() > other.log10().abs() + 3.0
}

impl Checker<'_> {
    pub(super) fn time(&self, file: &mut SceneFile, p: &Parameters) -> Result<Time, SceneError> {
        let table = &mut file.time;
        let step = self.positive("time.step", table.step, "the first and largest step, such as 0.1")?;
        let end = self.positive("time.end", table.end, "runs start at t = 0")?;
        self.step_counts(step, end)?;
        let step_min = self.step_min(step, table.step_min)?;
        table.step_min = Some(step_min.value());
        self.step_before_end(step, end)?;
        self.most_steps(table.max_steps)?;
        self.growth(table)?;
        let (stop_residual, stop_energy_rate) = self.stop(&table.stop, p)?;
        let exact_start = self.exact_start(table, file.exact.is_some(), p.kind())?;
        let density_implicit = self.density_implicit(&mut table.density_scheme, p.kind())?;
        let (growth, growth_wait, growth_rate) = (table.growth, table.growth_wait, table.growth_rate);
        Ok(Time {
            order: table.scheme.order(),
            density_implicit,
            control: ControlSettings { step, step_min, growth, growth_wait, growth_rate },
            end,
            exact_start,
            alternate: table.alternate,
            max_steps: table.max_steps,
            stop_residual,
            stop_energy_rate,
            rests_from: 0.0,
        })
    }

    /// The limit on the number of steps, of a march of any kind.
    pub(in crate::scene) fn most_steps(&self, given: Option<usize>) -> Result<(), SceneError> {
        let holds = given.is_none_or(|most| Range::SOME.has_count(most));
        self.require(holds, "time.max_steps", 0, "must be at least 1", "leave it out for no limit")
    }

    fn growth(&self, table: &TimeTable) -> Result<(), SceneError> {
        let (rule, hint) = ("must be finite and at least 1", "1 never lets the step grow");
        self.require(TimeTable::GROWTH.has(table.growth), "time.growth", table.growth, rule, hint)?;
        self.positive("time.growth_wait", table.growth_wait, "50 is the usual value")?;
        let rate = table.growth_rate;
        self.require(Range::ANY.has(rate), "time.growth_rate", rate, "must be finite", "0.55 is the usual value")
    }

    /// Bounds on the residual and on the rate of the energy, at which the run ends.
    fn stop(&self, stop: &StopTable, p: &Parameters) -> Result<(Option<f64>, Option<f64>), SceneError> {
        let none = "leave it out for no limit";
        let residual = stop.residual.map(|value| self.positive("time.stop.residual", value, none)).transpose()?;
        let rate = stop.energy_rate.map(|value| self.positive("time.stop.energy_rate", value, none)).transpose()?;
        if let (Some(value), false) = (rate, p.has_free_energy()) {
            let rule = match p.kind() {
                ModelKind::Incompressible => {
                    "with elasticity = 0 the free energy is zero, so the run would end at once"
                }
                ModelKind::Compressible => {
                    "with elasticity = 0 and density.penalty = 0 the free energy is zero, so the run would end at once"
                }
            };
            return Err(self.error("time.stop.energy_rate", shown(value), rule, "use time.stop.residual"));
        }
        Ok((residual, rate))
    }

    /// Whether the first steps are those of the exact fields, and the ratio of successive steps.
    fn exact_start(&self, table: &TimeTable, given: bool, kind: ModelKind) -> Result<bool, SceneError> {
        let exact_start = table.start == TimeStart::Exact;
        let hint = exact_hint(kind);
        self.require(!exact_start || given, "time.start", "\"exact\"", "the scene has no exact fields", hint)?;
        let alternate = table.alternate;
        let rule = "must lie between 1 and 5: beyond, a step takes a lower order";
        let hint = "1 keeps the steps equal; 2 makes every other step twice as long";
        self.require(TimeTable::ALTERNATE.has(alternate), "time.alternate", alternate, rule, hint)?;
        let skipped = if exact_start { table.scheme.order() - 1 } else { 0 };
        let rule = format!("the exact start takes {skipped} steps, and no step is left to solve");
        let longest = 2.0 * alternate / (1.0 + alternate) * table.step;
        let left = skipped as f64 * longest < table.end && table.max_steps.is_none_or(|most| most > skipped);
        self.require(left, "time.start", "\"exact\"", &rule, "take shorter or more steps, or a lower order")?;
        Ok(exact_start)
    }

    /// A step that the clock does not see at the end would never get there.
    pub(in crate::scene) fn step_counts(&self, step: f64, end: f64) -> Result<(), SceneError> {
        let holds = end + 0.5 * step > end;
        let hint = "numbers have 16 digits: raise `step` or lower `end`";
        if is_odder(end, step) {
            let rule = format!("makes time.step = {} be lost: t + step would be t", shown(step));
            return self.require(holds, "time.end", shown(end), &rule, hint);
        }
        let rule = format!("is lost beside time.end = {}: t + step would be t", shown(end));
        self.require(holds, "time.step", shown(step), &rule, hint)
    }

    pub(in crate::scene) fn step_before_end(&self, step: f64, end: f64) -> Result<(), SceneError> {
        let hint = "lower `step` or raise `end`";
        if is_odder(end, step) {
            let rule = format!("must not be shorter than a step, time.step = {}", shown(step));
            return self.require(step <= end, "time.end", shown(end), &rule, hint);
        }
        let rule = format!("must not be longer than the run, time.end = {}", shown(end));
        self.require(step <= end, "time.step", shown(step), &rule, hint)
    }

    fn density_implicit(&self, scheme: &mut Option<DensityScheme>, kind: ModelKind) -> Result<bool, SceneError> {
        match (kind, *scheme) {
            (ModelKind::Incompressible, None) => Ok(false),
            (ModelKind::Incompressible, Some(_)) => {
                Err(self.error("time.density_scheme", "(given)", CONSTANT_DENSITY, WRONG_KIND))
            }
            (ModelKind::Compressible, _) => Ok(match scheme.get_or_insert_default() {
                DensityScheme::Abdf => false,
                DensityScheme::Bdf => true,
            }),
        }
    }

    pub(super) fn steady(
        &self,
        file: &mut SceneFile,
        boundary: &BTreeMap<String, Conditions>,
        sources: &Sources,
    ) -> Result<Option<SteadySettings>, SceneError> {
        let end = file.time.end;
        let Some(table) = &mut file.steady else { return Ok(None) };
        let residual = self.positive("steady.residual", table.residual, "1e-9 is the usual value")?;
        let step =
            self.positive("steady.step", table.step, "in units of time; 1 is usual, smaller for rough starts")?;
        let (most, count) = (table.max_steps, table.eigenvalues);
        self.require(Range::SOME.has_count(most), "steady.max_steps", most, "must be at least 1", "300 is usual")?;
        let few = SteadyTable::EIGENVALUES.has_count(count);
        self.require(few, "steady.eigenvalues", count, "must be at most 60", "6 is usual, 0 finds none")?;
        let march = *table.march.get_or_insert(end);
        self.require(
            Range::NOT_NEGATIVE.has(march),
            "steady.march",
            shown(march),
            "must be finite and not negative",
            "time.end is usual",
        )?;
        self.without_time(boundary, sources)?;
        let want = table.want;
        Ok(Some(SteadySettings { residual, step, max_steps: most, want, eigenvalues: count, march }))
    }

    pub(super) fn coupling(&self, file: &mut SceneFile) -> Result<CouplingSettings, SceneError> {
        let table = &mut file.coupling;
        let tolerance = self.positive("coupling.tolerance", table.tolerance, "1e-8 is the usual value")?;
        let small = CouplingTable::TOLERANCE.has(tolerance);
        self.require(small, "coupling.tolerance", tolerance, "must be less than 1", "1e-8 is usual")?;
        self.positive("coupling.diverged", table.diverged, "1e4 is the usual value")?;
        let accept = *table.accept.get_or_insert(tolerance.sqrt());
        let (low, high) = (shown(tolerance), shown(table.diverged));
        let rule = format!("must lie between the tolerance {low} and `diverged` = {high}");
        let ordered = tolerance <= accept && accept < table.diverged;
        self.require(ordered, "coupling.accept", shown(accept), &rule, "without it, sqrt(tolerance) is taken")?;
        let (most, depth) = (table.max_iterations, table.depth);
        self.require(
            Range::SOME.has_count(most),
            "coupling.max_iterations",
            most,
            "must be at least 1",
            "100 is usual",
        )?;
        let few = CouplingTable::DEPTH.has_count(depth);
        self.require(few, "coupling.depth", depth, "must lie in 1..100", "10 is usual")?;
        let kind = match table.kind {
            CouplingName::FixedPoint => CouplingKind::FixedPoint,
            CouplingName::Anderson => CouplingKind::Anderson { depth },
            CouplingName::Newton => CouplingKind::Newton,
        };
        Ok(CouplingSettings { kind, tolerance, accept, diverged: table.diverged, max_iterations: most })
    }
}
