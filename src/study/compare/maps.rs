//! Maps of a comparison: speed of the data and of the run, and their difference.

use std::path::Path;

use super::{CompareStudy, Comparison};
use crate::mesh::Point;
use crate::output::OutputError;
use crate::output::plot::if_drawn;
use crate::output::plot::map::{Layer, Look, Map, Palette, Vector, Window};

/// Pieces of the obstacle's outline.
const PIECES: usize = 120;

/// Writes `measured-speed`, and with a run `run-speed` and `difference`, as SVG and PNG into a folder. A box that is
/// too long for a picture has none.
pub(super) fn write(study: &CompareStudy, found: &Comparison, folder: &Path) -> Result<(), OutputError> {
    let (low, high) = (study.bins.low, study.bins.high);
    let Ok(window) = Window::new(low.into(), high.into()) else { return Ok(()) };
    let tissue = |x: Point| Some(x).filter(|x| x.norm() >= study.obstacle);
    let title = study.title.clone().unwrap_or_else(|| "measured velocity".to_owned());
    let draw = |file: &str, map: Map| {
        let path = folder.join(file);
        if_drawn(map.draw().and_then(|picture| picture.write(&path))).map_err(|error| OutputError::Malformed {
            path: path.display().to_string(),
            what: error.to_string(),
            hint: "the tables beside it are complete",
        })
    };
    let measured = |x: Point| found.measured.at(tissue(x)?);
    let range = range(found);
    let speed = |file: &str, what: &str, v: Vector| {
        let of_speed = |x: Point| v(x).map(|v| v.norm());
        let arrows = Layer::Arrows { name: "|v|".to_owned(), of: v };
        let map = Map {
            title: format!("{title}: {what}"),
            name: "|v|".to_owned(),
            range,
            layers: vec![arrows, outline(study)],
            ..Map::new(window, &of_speed)
        };
        draw(file, map)
    };
    speed("measured-speed", "measured", &measured)?;
    let Some(computed) = &found.computed else { return Ok(()) };
    speed("run-speed", "run", &|x| computed.run.at(tissue(x)?))?;
    let end = study.window.unwrap_or(f64::INFINITY);
    let difference = |x: Point| {
        let x = tissue(x).filter(|x| x.x.abs() <= end)?;
        Some(found.measured.at(x)? - computed.field.at(x)?)
    };
    let first = |x: Point| difference(x).map(|e| e.x);
    let map = Map {
        title: format!("{title}: measured less run"),
        subtitle: "run averaged over the bins, filtered and corrected as the data".to_owned(),
        name: "Δv₁".to_owned(),
        palette: Palette::Diverging,
        layers: vec![Layer::Arrows { name: "|Δv|".to_owned(), of: &difference }, outline(study)],
        ..Map::new(window, &first)
    };
    draw("difference", map)
}

/// Smallest and largest speed in the bins, of data and run.
fn range(found: &Comparison) -> Option<[f64; 2]> {
    let fields = std::iter::once(&found.measured).chain(found.computed.iter().map(|computed| &computed.field));
    let speeds = fields.flat_map(|field| {
        (0..field.bins.len()).filter(|bin| field.is_filled(*bin)).map(|bin| field.values[bin].norm())
    });
    let [low, high] = speeds.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], speed| [a.min(speed), b.max(speed)]);
    (low < high).then_some([low, high])
}

fn outline(study: &CompareStudy) -> Layer<'static> {
    let at = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / PIECES as f64;
        study.obstacle * Point::new(angle.cos(), angle.sin())
    };
    Layer::Lines { lines: vec![(0..=PIECES).map(at).collect()], look: Look::Outline }
}
