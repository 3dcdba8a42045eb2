//! Tables such as a microscope gives, made from a run: for tests and demonstrations.

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::RunVelocity;
use crate::mesh::Point;
use crate::output::{OutputError, number, write_whole};
use crate::study::StudyError;

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Synthesis {
    /// In every frame.
    pub cells: usize,
    /// At t = 0, 1, 2, ….
    pub frames: usize,
    /// Standard deviation of each component.
    pub noise: f64,
    /// `s` of a velocity `s x_1` that is added to the first component.
    pub trend: f64,
    /// The same seed gives the same data.
    pub seed: u64,
    /// Lower left and upper right corner of the field of view in disc radii; without it the whole domain.
    pub view: Option<[Point; 2]>,
}

/// Most rows of a table.
const MOST_ROWS: usize = 10_000_000;

/// Draws without a hit after which a view counts as outside of the domain.
const PATIENCE: usize = 100_000;

/// Cells at places that are uniform in the domain and new in every frame, each with the velocity of the run there plus
/// normal noise, written as `x,y,t,vx,vy` in disc radii about the disc's centre, to six digits.
///
/// The places do not depend on noise and trend.
///
/// # Errors
/// No cells or frames, a noise that is none, a view that misses the domain, a file that cannot be written.
pub fn synthesize(run: &RunVelocity, synthesis: &Synthesis, path: &Path) -> Result<(), StudyError> {
    if path.symlink_metadata().is_ok() {
        // a table bears no mark, and looks like a measured one
        return Err(OutputError::foreign(path).into());
    }
    check(synthesis)?;
    let [low, high] = synthesis.view.unwrap_or_else(|| run.bounds());
    let mut generator = ChaCha8Rng::seed_from_u64(synthesis.seed);
    let mut lines = vec!["x,y,t,vx,vy".to_owned()];
    for frame in 0..synthesis.frames {
        for _ in 0..synthesis.cells {
            let mut draw = || {
                let [s, t] = [0, 1].map(|_| generator.random_range(0.0..1.0));
                let x = low + (high - low).component_mul(&Point::new(s, t));
                run.at(x).map(|v| (x, v))
            };
            let Some((x, v)) = (0..PATIENCE).find_map(|_| draw()) else {
                return Err(refuse(
                    "box",
                    format!("({}, {}) to ({}, {})", low.x, low.y, high.x, high.y),
                    "misses the run's domain",
                ));
            };
            let noise = Point::from([0, 1].map(|_| generator.sample::<f64, _>(StandardNormal)));
            let v = v + synthesis.noise * noise + Point::new(synthesis.trend * x.x, 0.0);
            let [x, y, vx, vy] = [x.x, x.y, v.x, v.y].map(six_digits);
            lines.push(format!("{x},{y},{frame},{vx},{vy}"));
        }
    }
    lines.push(String::new());
    write_whole(path, |file| file.write_all(lines.join("\n").as_bytes()))?;
    Ok(())
}

fn six_digits(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().expect("a number that was just written");
    number(rounded)
}

fn check(synthesis: &Synthesis) -> Result<(), StudyError> {
    let Synthesis { cells, frames, noise, trend, view, .. } = *synthesis;
    if cells == 0 || frames == 0 {
        let key = if cells == 0 { "cells" } else { "frames" };
        return Err(refuse(key, "0".to_owned(), "must be at least 1"));
    }
    if cells.saturating_mul(frames) > MOST_ROWS {
        let shown = format!("{cells} in each of {frames} frames");
        return Err(refuse("cells", shown, &format!("must be at most {MOST_ROWS} rows in all")));
    }
    if !(noise.is_finite() && noise >= 0.0) {
        return Err(refuse("noise", noise.to_string(), "must be 0 or greater, and finite"));
    }
    if !trend.is_finite() {
        return Err(refuse("trend", trend.to_string(), "must be finite"));
    }
    let ordered = |[low, high]: [Point; 2]| (0..2).all(|c| low[c] < high[c] && (high[c] - low[c]).is_finite());
    match view {
        Some(view) if !ordered(view) => {
            let [low, high] = view;
            let value = format!("{},{},{},{}", low.x, low.y, high.x, high.y);
            Err(refuse("box", value, "must be X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1"))
        }
        Some(_) | None => Ok(()),
    }
}

fn refuse(option: &str, value: String, rule: &str) -> StudyError {
    let (place, what) = (format!("--{option}"), format!("{value}: {rule}"));
    StudyError::Data { place, what, hint: "such as --cells 500 --frames 20 --noise 0.1 --box=-10,-5,10,5".to_owned() }
}
