//! How much a scene asks for: what no machine can give is refused before any of it is taken.

use super::{Checker, shown};
use crate::scene::error::SceneError;
use crate::scene::output::{Output, What};
use crate::scheme::Schedule;

/// Most steps of a run: a hundred million rows of its history take some ten gigabytes.
pub(super) const MOST_STEPS: f64 = 1e9;
/// Most files that one output writes.
const MOST_FILES: f64 = 1e6;

/// How a run goes from 0 to its end.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct Course {
    pub step: f64,
    pub end: f64,
    pub max_steps: Option<usize>,
}

impl Course {
    /// Steps of the full length, at most.
    fn steps(self) -> f64 {
        let most = self.max_steps.map_or(f64::INFINITY, |most| most as f64);
        (self.end / self.step).ceil().min(most)
    }
}

impl Checker<'_> {
    /// Refuses more steps and more files than anybody can want.
    pub(in crate::scene) fn amounts(&self, outputs: &[Output], course: Course) -> Result<(), SceneError> {
        let Course { step, end, .. } = course;
        let steps = course.steps();
        let rule = format!("leads to the end {end:?} in {steps:.1e} steps, and at most {MOST_STEPS:.0e} may be taken");
        let hint = "take a longer step or an earlier `time.end`, or limit the run by `time.max_steps`";
        self.require(steps <= MOST_STEPS, "time.step", shown(step), &rule, hint)?;
        for (at, output) in outputs.iter().enumerate() {
            let count = output.schedule.count(steps, end);
            let (key, every) = match output.schedule {
                Schedule::Time(every) => (format!("output.{at}.every.time"), every),
                Schedule::Steps(every) => (format!("output.{at}.every.steps"), every as f64),
                Schedule::End => continue,
            };
            let most = match &output.what {
                What::Fields(_) | What::Cuts { .. } | What::Maps(_) | What::Bodies { .. } => MOST_FILES,
                // rows of a table; a step ends at each of them
                What::Measures(_) | What::Checkpoint => MOST_STEPS,
            };
            let rule =
                format!("means {count:.1e} outputs until the end {end:?}, and at most {most:.0e} may be written");
            self.require(count <= most, &key, shown(every), &rule, "write less often")?;
        }
        Ok(())
    }
}
