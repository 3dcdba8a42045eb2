//! The rules of `[strain]`.

use super::Checker;
use crate::element::MAX_DEGREE;
use crate::scene::error::SceneError;
use crate::scene::output::{Field, Measure, Output, What};
use crate::scene::tables::StrainTable;
use crate::scene::{Space, StrainSettings};

impl Checker<'_> {
    pub(super) fn strain(
        &self,
        table: &mut Option<StrainTable>,
        space: &Space,
        outputs: &[Output],
    ) -> Result<Option<StrainSettings>, SceneError> {
        let Some(table) = table else {
            let asked = outputs.iter().position(|output| asks_for_strain(&output.what));
            return asked.map_or(Ok(None), |at| {
                let rule = "there is no elastic strain without a table [strain]";
                let hint = "add a table [strain] with `weissenberg = …`, or remove it";
                Err(self.error(&format!("output.{at}"), "\"elastic_strain\"", rule, hint))
            });
        };
        let hint = "the time in which the strain relaxes, over that of the flow; 1 is usual";
        let weissenberg = self.positive("strain.weissenberg", table.weissenberg, hint)?;
        let degree = *table.degree.get_or_insert((space.velocity - 1).max(1));
        let rule = format!("must lie between 1 and {MAX_DEGREE}");
        let usual = "without it, the velocity's degree less one, that of its gradient";
        self.require((1..=MAX_DEGREE).contains(&degree), "strain.degree", degree, &rule, usual)?;
        Ok(Some(StrainSettings { weissenberg, degree }))
    }
}

/// Whether the strain itself is named; cuts take it along where there is one.
fn asks_for_strain(what: &What) -> bool {
    match what {
        What::Fields(fields) => fields.contains(&Field::ElasticStrain),
        What::Measures(measures) => measures.contains(&Measure::ElasticStrain),
        What::Cuts(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => false,
    }
}
