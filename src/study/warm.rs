//! Runs that start from the last state of their neighbour, and whether they stayed on its branch of states.

use std::path::{Path, PathBuf};

use super::StudyError;
use super::results::{Branch, Found, Start};
use super::run_launcher::RunLauncher;
use super::source::Values;
use super::sweep_file::SweepStudy;
use crate::form::Integrator;
use crate::output::OutputError;
use crate::output::lock::Lock;
use crate::run::RunError;
use crate::run::last_state;
use crate::scene::Scene;

/// A distance above this is looked into: steps that are half as long, and so on.
pub const FAR: f64 = 0.2;
/// States this near are one.
pub const ALIKE: f64 = 0.02;
/// Steps are halved so often at most.
pub const DEPTH: usize = 4;

/// A state on the way: where it lies, and where along the way, from 0 at the neighbour to 1 at the run.
#[derive(Debug, Clone)]
struct Stop {
    folder: PathBuf,
    place: f64,
}

/// What the study does on the way from one run to the next.
struct Way<'a> {
    study: &'a SweepStudy,
    launcher: &'a RunLauncher<'a>,
    at: usize,
    neighbour: usize,
    /// Folder of the steps in between.
    steps: PathBuf,
    lock: &'a Lock,
    taken: usize,
    /// The longest way between neighbours that halving did not shorten.
    jump: f64,
}

/// Why small steps did not come through.
enum Halt {
    Failed(String),
    Interrupted,
    Broken(Box<StudyError>),
}

/// The overrides that let a scene start from a state.
///
/// # Errors
/// A path that cannot be made absolute.
pub(super) fn start_from(folder: &Path, scene: &Scene) -> Result<Values, OutputError> {
    let file = std::path::absolute(folder.join("checkpoint.bin")).map_err(|e| OutputError::io(folder, &e))?;
    let text = format!("{{ file = {} }}", toml::Value::from(file.to_string_lossy().into_owned()));
    let keys = ["initial.polarity"].into_iter().chain(scene.initial_density.as_ref().map(|_| "initial.density"));
    Ok(keys.map(|key| (key.to_owned(), text.clone())).collect())
}

/// `‖p_a − p_b‖/‖p_b‖` in L² on the mesh of b, p the last polarity of the runs in these folders.
///
/// # Errors
/// Folders without checkpoints, domains that differ.
pub fn distance(a: &Path, b: &Path) -> Result<f64, RunError> {
    let (a, b) = (a.join("checkpoint.bin"), b.join("checkpoint.bin"));
    let base = last_state::last_polarity(&b)?;
    let other = last_state::polarity_of(&base.space, &a)?;
    let mut difference = other;
    difference.values.iter_mut().zip(&base.values).for_each(|(x, y)| *x -= y);
    let loops = Integrator::new(&base.space.mesh);
    let norm = |field: &crate::space::Field| {
        loops.sum(2 * field.space.degree, |x| field.vector(&x.site).norm_squared()).sqrt()
    };
    let (difference, size) = (norm(&difference), norm(&base));
    Ok(if size > 0.0 { difference / size } else { difference })
}

/// Compares the run `at`, which started from its neighbour, with it; where they lie far apart, looks whether small
/// steps lead to the same state. `None` if interrupted.
///
/// # Errors
/// Folders that cannot be written.
pub(super) fn judge(
    study: &SweepStudy,
    launcher: &RunLauncher,
    out: &Path,
    at: usize,
    neighbour: usize,
    lock: &Lock,
) -> Result<Option<(Start, Vec<String>)>, StudyError> {
    let folder = |at: usize| out.join(&study.cases[at].folder);
    let (here, there) = (folder(at), folder(neighbour));
    let far = distance(&here, &there)?;
    let told = |branch, said: Option<String>| {
        Ok(Some((Start { branch, distance: Some(far) }, said.into_iter().collect::<Vec<String>>())))
    };
    if far <= FAR {
        return told(Branch::Same, None);
    }
    let mut way = Way { study, launcher, at, neighbour, steps: here.join("steps"), lock, taken: 0, jump: 0.0 };
    let name = &study.cases[neighbour].folder;
    let (start, end) = (Stop { folder: there, place: 0.0 }, Stop { folder: here.clone(), place: 1.0 });
    let reached = way.reach(&start, 0.5, 1).and_then(|middle| way.reach(&middle, end.place, 1));
    match reached {
        Err(Halt::Interrupted) => Ok(None),
        Err(Halt::Broken(error)) => Err(*error),
        Err(Halt::Failed(reason)) => told(
            Branch::Changed,
            Some(format!(
                "the state lies {far:.2} from that of run {name}, and small steps from there did not come through \
                 ({reason}): it may belong to another branch"
            )),
        ),
        Ok(last) => {
            let apart = distance(&last.folder, &here)?;
            let (steps, jump) = (way.taken, way.jump);
            if apart <= ALIKE && jump == 0.0 {
                return told(Branch::Same, None);
            }
            if apart <= ALIKE {
                return told(
                    Branch::Changed,
                    Some(format!(
                        "the state lies {far:.2} from that of run {name}; {steps} smaller steps from there lead to the \
                         same one, but with a jump of {jump:.2} that no halving shortens: it belongs to another branch"
                    )),
                );
            }
            let inside = last.folder.strip_prefix(out).unwrap_or(&last.folder).display();
            told(
                Branch::Changed,
                Some(format!(
                    "the state lies {far:.2} from that of run {name}; {steps} smaller steps from there lead to another \
                     one, {apart:.2} from it (in {inside}): it belongs to another branch"
                )),
            )
        }
    }
}

impl Way<'_> {
    /// The state at a place, reached from another in steps that are short enough, as far as they may be halved.
    fn reach(&mut self, from: &Stop, to: f64, depth: usize) -> Result<Stop, Halt> {
        let next = self.step(from, to)?;
        let far = distance(&next.folder, &from.folder).map_err(|e| Halt::Broken(Box::new(e.into())))?;
        if far <= FAR || depth >= DEPTH {
            if far > FAR {
                self.jump = self.jump.max(far);
            }
            return Ok(next);
        }
        let middle = self.reach(from, 0.5 * (from.place + to), depth + 1)?;
        self.reach(&middle, to, depth + 1)
    }

    /// One run in between.
    fn step(&mut self, from: &Stop, to: f64) -> Result<Stop, Halt> {
        self.taken += 1;
        let folder = self.steps.join(format!("{:02}", self.taken));
        let failed = |error: StudyError| Halt::Failed(error.to_string());
        let broken = |error: OutputError| Halt::Broken(Box::new(error.into()));
        let plain = self.study.scene_of(self.at).map_err(failed)?;
        let mut set = self.values(to)?;
        let plain = plain.tissue().expect("only sweeps of tissue start warm");
        set.extend(start_from(&from.folder, plain).map_err(broken)?);
        let scene = self.study.scene_with(self.at, &set).map_err(failed)?;
        std::fs::create_dir_all(&folder).map_err(|e| broken(OutputError::io(&folder, &e)))?;
        match self.launcher.ensure(&folder, &scene, self.lock).map_err(broken)? {
            None => Err(Halt::Interrupted),
            Some((found, _)) if !found.is_complete() => Err(Halt::Interrupted),
            Some((found, _)) if found.is_good() => Ok(Stop { folder, place: to }),
            Some((found, _)) => Err(Halt::Failed(found.reason().unwrap_or_default().to_owned())),
        }
    }

    /// What the keys of the axis are at a place of the way.
    fn values(&self, place: f64) -> Result<Values, Halt> {
        let of = |at: usize, key: &str| {
            let set = &self.study.cases[at].set;
            set.iter().find(|(name, _)| name == key).and_then(|(_, value)| value.parse::<f64>().ok())
        };
        let between = |key: &String| {
            let ends = of(self.neighbour, key).zip(of(self.at, key));
            let (a, b) = ends.ok_or_else(|| Halt::Failed(format!("`{key}` is no number")))?;
            // the ends are those of the study, to the bit
            let value = if place >= 1.0 { b } else { a + (b - a) * place };
            Ok((key.clone(), format!("{value:?}")))
        };
        self.study.warm.iter().map(between).collect()
    }
}

/// Whether a run left a state that another can start from.
pub(super) fn can_follow(found: &Found, folder: &Path) -> bool {
    found.is_good() && found.is_complete() && folder.join("checkpoint.bin").exists()
}
