//! `monolayer compare`: measured velocities against a run, and tables made from a run.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use monolayer::mesh::Point;
use monolayer::output::console;
use monolayer::study::compare::{self, CompareStudy, RunVelocity, Synthesis};

use crate::{Failure, Sets, study_folder};

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// File of the comparison.
    #[arg(required_unless_present = "synthesize", conflicts_with = "synthesize")]
    file: Option<PathBuf>,
    #[command(flatten)]
    sets: Sets,
    /// Folder of the run to compare with, in place of the file's `run`.
    #[arg(long, value_name = "DIR", conflicts_with = "synthesize")]
    run: Option<PathBuf>,
    /// Folder of the results [default: out/NAME, numbered if it is taken]; with --synthesize the table [default:
    /// tracks.csv].
    #[arg(long, value_name = "DIR|FILE")]
    out: Option<PathBuf>,
    /// Make a table of measured velocities from the run in this folder.
    #[arg(long, value_name = "RUN", conflicts_with = "sets")]
    synthesize: Option<PathBuf>,
    #[command(flatten)]
    draw: Draw,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "With --synthesize")]
struct Draw {
    /// Cells in every frame.
    #[arg(long, value_name = "N", default_value_t = 500, conflicts_with = "file")]
    cells: usize,
    /// Number of frames, at t = 0, 1, 2, ….
    #[arg(long, value_name = "M", default_value_t = 20, conflicts_with = "file")]
    frames: usize,
    /// Standard deviation of the noise on each component.
    #[arg(long, value_name = "S", default_value_t = 0.0, conflicts_with = "file")]
    noise: f64,
    /// Slope of a velocity that is added to the first component and grows along x₁.
    #[arg(long, value_name = "SLOPE", default_value_t = 0.0, allow_negative_numbers = true, conflicts_with = "file")]
    trend: f64,
    /// Seed of places and noise.
    #[arg(long, value_name = "K", default_value_t = 0, conflicts_with = "file")]
    seed: u64,
    /// Field of view in disc radii, such as --box=-10,-5,10,5 [default: the whole domain].
    #[arg(
        long,
        value_name = "X0,Y0,X1,Y1",
        allow_hyphen_values = true,
        value_parser = corners,
        conflicts_with = "file"
    )]
    r#box: Option<[Point; 2]>,
}

/// Lower left and upper right corner.
fn corners(text: &str) -> Result<[Point; 2], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) => Ok([Point::new(x0, y0), Point::new(x1, y1)]),
        Ok(_) | Err(_) => Err("must be four numbers; hint: such as --box=-10,-5,10,5".to_owned()),
    }
}

impl CompareArgs {
    /// Runs the command.
    ///
    /// # Errors
    /// Whatever is wrong with the file, its data or its run.
    pub fn execute(&self, quiet: bool) -> Result<ExitCode, Failure> {
        let text = match (&self.synthesize, &self.file) {
            (Some(run), _) => self.draw.execute(run, self.out.as_deref())?,
            (None, file) => {
                let file = file.as_ref().expect("required by the parser");
                let study = CompareStudy::read(file, &self.pairs()?)?;
                let out = study_folder(file, self.out.as_deref());
                let comparison = compare::run(&study, &out)?;
                format!("{comparison}\nresults in {}", out.display())
            }
        };
        if !quiet {
            console::tell(&text);
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl CompareArgs {
    /// The overrides; `--run` starts in the working folder, whereas a path in a file starts in the folder of the file.
    fn pairs(&self) -> Result<Vec<(String, String)>, Failure> {
        let mut pairs = self.sets.pairs()?;
        if let Some(run) = &self.run {
            pairs.push(("run".to_owned(), std::path::absolute(run)?.to_string_lossy().into_owned()));
        }
        Ok(pairs)
    }
}

impl Draw {
    fn execute(&self, run: &Path, out: Option<&Path>) -> Result<String, Failure> {
        let path = out.unwrap_or(Path::new("tracks.csv"));
        let Self { cells, frames, noise, trend, seed, r#box: view } = *self;
        let synthesis = Synthesis { cells, frames, noise, trend, seed, view };
        compare::synthesize(&RunVelocity::read(run)?, &synthesis, path)?;
        Ok(format!("{} rows in {}", cells * frames, path.display()))
    }
}
