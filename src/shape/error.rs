//! What a shape must be.

/// What can be wrong with a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum ShapeError {
    #[error("{what} = {value}: must be a positive number; hint: lengths are in the unit of the scene")]
    Size { what: &'static str, value: f64 },
    #[error("{what} = {value}: must not be negative; hint: {hint}")]
    Negative { what: &'static str, value: f64, hint: &'static str },
    #[error("the polygon has {count} vertices: at least 3 are needed; hint: a rod is a capsule")]
    FewVertices { count: usize },
    #[error("vertex {index} of the polygon is ({x}, {y}): coordinates must be finite; hint: write plain numbers")]
    NotFinite { index: usize, x: f64, y: f64 },
    #[error(
        "vertices {index} and {next} of the polygon are the same point; hint: list every corner once, the first not again at the end"
    )]
    Repeated { index: usize, next: usize },
    #[error(
        "the polygon is not convex at vertex {index}, ({x}, {y}); hint: list the corners in their order around the body, and leave out those in the middle of a side"
    )]
    NotConvex { index: usize, x: f64, y: f64 },
    #[error("the polygon winds round more than once; hint: list the corners in their order around the body")]
    Winding,
    #[error(
        "the {shape} is a sliver: its width is {width:.1e} of its length, and {least:.0e} is the least; \
         hint: {hint}",
        least = NARROWEST
    )]
    Sliver { shape: &'static str, width: f64, hint: &'static str },
}

/// The narrowest shape, width over length, that distances and cuts are computed for.
pub(super) const NARROWEST: f64 = 1e-6;

/// What to do about a sliver.
pub(super) const THICKER: &str =
    "make it thicker: what is thinner than the gaps around it, or than a cell of a mesh, changes nothing";

impl ShapeError {
    /// Refuses a size that is no positive number.
    pub(super) fn positive(what: &'static str, value: f64) -> Result<(), ShapeError> {
        match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => Err(ShapeError::Size { what, value }),
        }
    }
}
