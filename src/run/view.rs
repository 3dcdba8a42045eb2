//! What a run shows of itself between two steps: fields by their names, rigid bodies, and what only a tissue has.

use crate::measure::fields::Fields;
use crate::measure::list::{Bodies, OfMarch};
use crate::model::State;
use crate::time::Sheet;

/// What only a tissue shows.
#[derive(Debug, Clone, Copy)]
pub struct TissueNow<'a> {
    /// What is solved.
    pub model: &'a dyn Sheet,
    /// Its fields.
    pub state: &'a State,
    /// `∂_t p`
    pub rate_of_p: &'a [f64],
    /// What the march has counted.
    pub march: OfMarch,
}

/// All that there is between two steps.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Time of the state.
    pub t: f64,
    /// `None` where there is nothing but bodies.
    pub fields: Option<&'a dyn Fields>,
    /// `None` where there are no bodies.
    pub bodies: Option<Bodies<'a>>,
    /// `None` where there is no tissue.
    pub tissue: Option<TissueNow<'a>>,
}
