//! Pictures that were drawn: shapes, and the font of their texts.

use super::map::{Map, Picture, arrange::Arranged};
use super::scene::Scene;
use super::text::Font;
use super::{Plot, PlotError, layout, raster, svg};

/// A picture that was drawn.
pub(super) struct Drawn {
    scene: Scene,
    font: Font,
}

impl Drawn {
    /// The SVG document.
    pub(super) fn svg(&self) -> String {
        svg::render(&self.scene)
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// [`PlotError::Canvas`], [`PlotError::Encode`].
    pub(super) fn png(&self) -> Result<Vec<u8>, PlotError> {
        raster::render(&self.scene, &self.font)
    }
}

/// Draws a plot.
///
/// # Errors
/// [`PlotError::Font`]
pub(super) fn plot(plot: &Plot) -> Result<Drawn, PlotError> {
    let font = Font::load()?;
    Ok(Drawn { scene: layout::arrange(plot, &font), font })
}

/// Smallest and largest value that a map would show.
///
/// # Errors
/// As [`map`].
pub(super) fn extent(map: &Map) -> Result<[f64; 2], PlotError> {
    let font = Font::load()?;
    Ok(Arranged::new(map, &font)?.extent())
}

/// Draws a map.
///
/// # Errors
/// [`PlotError::Font`]; [`PlotError::Blank`] where its scalar has no value in the window.
pub(super) fn map(map: &Map) -> Result<Picture, PlotError> {
    let font = Font::load()?;
    let arranged = Arranged::new(map, &font)?;
    let (extent, range) = (arranged.extent(), arranged.range);
    Ok(Picture { drawn: Drawn { scene: arranged.scene(), font }, extent, range })
}

/// Draws the layers of a map on white.
///
/// # Errors
/// [`PlotError::Font`]
pub(super) fn layers(map: &Map) -> Result<Picture, PlotError> {
    let font = Font::load()?;
    let arranged = Arranged::plain(map, &font);
    let (extent, range) = (arranged.extent(), arranged.range);
    Ok(Picture { drawn: Drawn { scene: arranged.scene(), font }, extent, range })
}
