//! A build without pictures: there is none, and whoever wants one hears why.

use std::convert::Infallible;

use super::map::{Map, Picture};
use super::{Plot, PlotError};

/// A picture that was drawn: none ever is.
pub(super) struct Drawn(Infallible);

impl Drawn {
    /// The SVG document.
    pub(super) fn svg(&self) -> String {
        match self.0 {}
    }

    /// The bytes of a PNG file.
    pub(super) fn png(&self) -> Result<Vec<u8>, PlotError> {
        match self.0 {}
    }
}

/// No plot.
///
/// # Errors
/// [`PlotError::Off`]
pub(super) fn plot(_: &Plot) -> Result<Drawn, PlotError> {
    Err(PlotError::Off)
}

/// No extent of a map.
///
/// # Errors
/// [`PlotError::Off`]
pub(super) fn extent(_: &Map) -> Result<[f64; 2], PlotError> {
    Err(PlotError::Off)
}

/// No map.
///
/// # Errors
/// [`PlotError::Off`]
pub(super) fn map(_: &Map) -> Result<Picture, PlotError> {
    Err(PlotError::Off)
}

/// No layers.
///
/// # Errors
/// [`PlotError::Off`]
pub(super) fn layers(_: &Map) -> Result<Picture, PlotError> {
    Err(PlotError::Off)
}
