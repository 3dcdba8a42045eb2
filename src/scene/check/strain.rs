//! The rules of `[strain]`.

use super::Checker;
use crate::element::MAX_DEGREE;
use crate::measure::fields::Tool;
use crate::measure::list::Premise;
use crate::scene::error::SceneError;
use crate::scene::output::{Output, What};
use crate::scene::tables::{DegreeTable, StrainTable};
use crate::scene::{Space, StrainSettings};

/// What a scene breaks that has no table of it.
pub(super) const NO_STRAIN: &str = "there is no elastic strain without a table [strain]";

impl Checker<'_> {
    pub(super) fn strain(
        &self,
        table: &mut Option<StrainTable>,
        space: &Space,
        outputs: &[Output],
    ) -> Result<Option<StrainSettings>, SceneError> {
        let Some(table) = table else {
            let mut asked = outputs.iter().map(|output| asks_for_strain(&output.what)).enumerate();
            let first = asked.find_map(|(at, name)| Some((at, name?)));
            return first.map_or(Ok(None), |(at, name)| {
                let hint = "add a table [strain] with `weissenberg = …`, or remove it";
                Err(self.error(&format!("output.{at}"), format!("\"{name}\""), NO_STRAIN, hint))
            });
        };
        let hint = "the time in which the strain relaxes, over that of the flow; 1 is usual";
        let weissenberg = self.positive("strain.weissenberg", table.weissenberg, hint)?;
        let degree = *table.degree.get_or_insert((space.velocity - 1).max(1));
        let rule = format!("must lie between 1 and {MAX_DEGREE}");
        let usual = "without it, the velocity's degree less one, that of its gradient";
        self.require(DegreeTable::ANY.has_count(degree), "strain.degree", degree, &rule, usual)?;
        Ok(Some(StrainSettings { weissenberg, degree }))
    }
}

/// The name of what needs the strain; cuts that name no fields take it along where there is one.
fn asks_for_strain(what: &What) -> Option<&'static str> {
    let field = what.fields().into_iter().find(|field| field.tool == Some(Tool::Strain)).map(|field| field.name);
    let measures = || what.measures().iter().map(|asked| asked.measure);
    field.or_else(|| measures().find(|measure| measure.needs(Premise::Strain)).map(|found| found.name))
}
