//! Curves of rigid bodies from `bodies.csv`.

use super::{Draw, PlotKind, When};
use crate::output::plot::{Axis, Line, Markers, Plot, Series, Symbol};
use crate::results::bodies::{Track, tracks};
use crate::results::curves::{CurveSettings, Drawn, Image, Picture, Source};
use crate::results::{ResultsError, label};

/// Paths, speeds and angles.
pub const BODIES: PlotKind = PlotKind {
    name: "bodies",
    help: "paths, speeds and angles of the first twelve rigid bodies that move, or of those that `--body NAME,…` names",
    needs: "`bodies = true` with `every` in an [[output]] of the scene",
    when: When::OfAFolder,
    draw: Draw::With(draw),
};

/// Most bodies of a picture.
const MOST: usize = 12;

fn draw(kind: &'static PlotKind, source: &Source, drawn: &mut Drawn) -> Result<(), ResultsError> {
    let Source { runs, labels, wish, .. } = *source;
    let (mut all, mut with) = (Vec::new(), Vec::new());
    let folders: Vec<_> = runs.iter().zip(labels).filter(|(run, _)| run.path.join("bodies.csv").exists()).collect();
    let each = (MOST / folders.len().max(1)).max(1);
    for (run, label) in &folders {
        match tracks(&run.path, &wish.bodies, each) {
            Ok((found, left_out)) => {
                if left_out > 0 {
                    let count = found.len() + left_out;
                    drawn.notes.push(format!(
                        "{left_out} of {count} bodies of {} are left out of the curves: name some with `--body`",
                        run.name
                    ));
                }
                with.push(**run);
                let name = |body: &str| if folders.len() > 1 { format!("{label}: {body}") } else { body.to_owned() };
                all.extend(found.into_iter().map(|track| Track { name: name(&track.name), ..track }));
            }
            Err(error @ ResultsError::Option { .. }) => return Err(error),
            Err(error) => drawn.notes.push(error.to_string()),
        }
    }
    all.retain(|track| track.rows.len() > 1);
    if all.is_empty() {
        return Ok(());
    }
    let subtitle = label::common(&with);
    let time = "time t (dimensionless)";
    let mut add = |name: &str, title: &str, [x, y]: [&str; 2], series: Vec<Series>| {
        let (x, y) = (Axis::linear(x), Axis::linear(y));
        let plot = Plot { title: title.into(), subtitle: subtitle.clone(), x, y, series, slopes: Vec::new() };
        drawn.pictures.push(Picture { name: name.into(), kind, image: Image::Curves(plot) });
    };
    add("bodies-path", "Paths of the bodies", ["x₁", "x₂"], paths(&all, wish));
    let over_time = |of: fn(&(f64, crate::shape::Pose, crate::shape::Twist)) -> f64| {
        let curve = |track: &Track| {
            let points = track.rows.iter().map(|row| (row.0, of(row))).collect();
            Series { markers: Markers::None, ..Series::new(&track.name, wish.inside(points)) }
        };
        all.iter().map(curve).collect::<Vec<_>>()
    };
    add("bodies-speed", "Speeds of the bodies", [time, "speed |V|"], over_time(|row| row.2.velocity.norm()));
    if all.iter().any(|track| track.rows.iter().any(|row| row.1.angle != track.rows[0].1.angle)) {
        add("bodies-angle", "Angles of the bodies", [time, "angle θ"], over_time(|row| row.1.angle));
    }
    Ok(())
}

/// Paths, each with a mark at its end.
fn paths(all: &[Track], wish: &CurveSettings) -> Vec<Series> {
    let inside = |t: f64| wish.window.is_none_or(|[lo, hi]| (lo..=hi).contains(&t));
    let path = |track: &Track| {
        let rows = track.rows.iter().filter(|row| inside(row.0));
        rows.map(|(_, pose, _)| (pose.position.x, pose.position.y)).collect::<Vec<_>>()
    };
    let curve = |(k, track): (usize, &Track)| {
        let points = path(track);
        let end = points.last().copied().into_iter().collect();
        let line = Series { markers: Markers::None, colour: Some(k), ..Series::new(&track.name, points) };
        let markers = Markers::Filled(Symbol::Circle);
        [line, Series { line: Line::None, markers, colour: Some(k), ..Series::new("", end) }]
    };
    all.iter().enumerate().flat_map(curve).collect()
}
