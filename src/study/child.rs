//! One scene as a child process of this program: what ends it ends no study.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, ExitStatus, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Deserialize;

use crate::model::fields::{self, Role};
use crate::output::{OutputError, write_whole};
use crate::time::march::Counts;

/// What rows need of a `summary.json`; a number that was not finite is `None`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct RunSummary {
    /// One line for reports.
    pub title: Option<String>,
    /// `finished`, `interrupted` or `failed`.
    pub status: String,
    /// Why the run ended.
    pub ending: String,
    /// Of a failure.
    #[serde(default)]
    pub reason: Option<String>,
    /// Time that was reached.
    pub time: f64,
    /// The size of its mesh.
    pub mesh: MeshCounts,
    /// How many numbers it solves for.
    pub unknowns: UnknownCounts,
    /// Totals over its steps.
    #[serde(flatten)]
    pub counts: Counts,
    /// Of the stationary equations.
    #[serde(default)]
    pub residual: Option<f64>,
    /// At the end, by column.
    #[serde(default)]
    pub measures: BTreeMap<String, Option<f64>>,
    /// By field and norm, against the exact fields.
    #[serde(default)]
    pub errors: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Of the measures' errors.
    #[serde(default)]
    pub estimates: BTreeMap<String, Option<f64>>,
    /// Whether they are still to come.
    #[serde(default)]
    pub estimates_pending: bool,
    /// Of a search for a steady state.
    #[serde(default)]
    pub steady: Option<SteadyNumbers>,
    /// Notes, in order.
    #[serde(default)]
    pub said: Vec<String>,
    /// Wall seconds by phase.
    #[serde(default)]
    pub seconds: BTreeMap<String, f64>,
    /// Wall seconds.
    pub seconds_total: f64,
    /// Most memory at a time, where the system tells.
    #[serde(default)]
    pub peak_memory_mib: Option<f64>,
    /// How many it had.
    pub threads: usize,
    /// Of the program.
    pub version: String,
}

/// Of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct MeshCounts {
    /// Number of cells.
    pub cells: usize,
}

/// Unknowns by field, and of the flow's linear system.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct UnknownCounts {
    /// Rows of the flow's matrix.
    pub stokes_system: usize,
    /// Of each field, by its name.
    #[serde(flatten)]
    pub fields: BTreeMap<String, usize>,
}

impl UnknownCounts {
    /// Those that are solved for: of the flow's matrix, and of what it carries.
    pub fn solved(&self) -> usize {
        let carried = |name: &str| fields::named(name).is_some_and(|field| field.role == Role::Carried);
        self.stokes_system + self.fields.iter().filter(|(name, _)| carried(name)).map(|(_, count)| count).sum::<usize>()
    }
}

/// What a search for a steady state found.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct SteadyNumbers {
    /// `stable`, `unstable` or `not-known`.
    #[serde(default)]
    pub stability: Option<String>,
    /// Of the linearisation, the leading one first.
    #[serde(default)]
    pub eigenvalues: Vec<EigenvalueNumbers>,
    /// Number of modes that grow.
    #[serde(default)]
    pub unstable_dimension: Option<usize>,
    /// Where the flow repeats itself.
    #[serde(default)]
    pub oscillation: Option<OscillationNumbers>,
}

/// Growth rate and angular frequency.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct EigenvalueNumbers {
    /// Rate of growth.
    pub re: f64,
    /// Angular frequency.
    pub im: f64,
}

/// Period and amplitudes of a flow that repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct OscillationNumbers {
    /// Time after which the flow is the same again.
    pub period: f64,
    /// Of the polarity.
    pub amplitude: f64,
    /// Of the velocity.
    pub amplitude_velocity: f64,
}

impl RunSummary {
    /// Reads a folder's `summary.json`; `None` where there is none, or none of this version.
    pub fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(folder.join("summary.json")).ok()?).ok()
    }

    /// Whether nothing is left to do.
    pub fn is_complete(&self) -> bool {
        self.status != "interrupted" && !self.estimates_pending
    }

    /// Measures, and what a search for a steady state found; those that are finite.
    pub fn numbers(&self) -> BTreeMap<String, f64> {
        let measures = self.measures.iter().filter_map(|(name, value)| Some((name.clone(), (*value)?)));
        let steady = self.steady.iter().flat_map(SteadyNumbers::numbers);
        measures.chain(steady.map(|(name, value)| (name.to_owned(), value))).collect()
    }

    /// The error of a field in a norm, as in tables, where it is known.
    pub fn error(&self, field: &str, norm: &str) -> Option<f64> {
        self.errors.get(field)?.get(norm).copied().flatten()
    }
}

impl SteadyNumbers {
    /// Growth rate and frequency of the leading mode; period and amplitudes of an oscillation.
    pub fn numbers(&self) -> Vec<(&'static str, f64)> {
        let leading = self.eigenvalues.first().map(|e| [("growth", e.re), ("frequency", e.im)]);
        let cycle = self.oscillation.map(|o| {
            [("period", o.period), ("amplitude_polarity", o.amplitude), ("amplitude_velocity", o.amplitude_velocity)]
        });
        leading.into_iter().flatten().chain(cycle.into_iter().flatten()).collect()
    }
}

/// A scene to be run.
#[derive(Debug)]
pub struct Job<'a> {
    /// This program.
    pub program: &'a Path,
    /// The resolved scene; written to the folder's `scene.toml`, which the child reads.
    pub scene: &'a str,
    /// Folder of the results.
    pub out: PathBuf,
    /// How many it may use.
    pub threads: usize,
    /// Continue from the folder's checkpoint.
    pub resume: bool,
    /// Bytes that the child may take, where not all that is free.
    pub memory: Option<f64>,
    /// Whether the child says every step; else it says only what went wrong.
    pub verbose: bool,
    /// An open lock that has to last as long as the child, even if this process ends before: the child inherits it.
    pub lock: Option<File>,
}

/// What became of a child.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended {
    /// How the process ended.
    pub status: ExitStatus,
    /// Wall seconds of the whole process.
    pub seconds: f64,
    /// What it left; `None` if it came to no end of its own.
    pub summary: Option<RunSummary>,
    /// The end of what it said to its standard error.
    pub last_lines: Vec<String>,
}

impl Ended {
    /// Whether the system or somebody else ended it.
    pub fn was_killed(&self) -> bool {
        self.status.code().is_none()
    }

    /// Why there is no summary: the program's own error, or how it died.
    pub fn reason(&self) -> String {
        if let Some(error) = self.last_lines.iter().rev().find_map(|line| line.strip_prefix("error: ")) {
            return error.to_owned();
        }
        let said = self.last_lines.join("; ");
        let said = if said.is_empty() { String::new() } else { format!(": {said}") };
        let hint = "if its signal was 9, memory may have run out: try fewer `--jobs` or a coarser mesh";
        format!("the process ended with {}{said}; hint: {hint}", self.status)
    }
}

/// Lines that are kept of what a child says.
const LAST: usize = 8;
const POLL: Duration = Duration::from_millis(20);

/// Runs a scene to its end. Once `interrupt` is set, the child is asked to end after its step, and waited for.
///
/// The child ends cleanly, with a checkpoint, when its standard input is closed: so it does when this process is
/// killed. `said` is given every line as it comes.
///
/// # Errors
/// A folder that cannot be written, a program that cannot be started.
pub fn run(job: Job, interrupt: &AtomicBool, said: &(dyn Fn(&str) + Sync)) -> Result<Ended, OutputError> {
    let out = std::path::absolute(&job.out).map_err(|e| OutputError::io(&job.out, &e))?;
    std::fs::create_dir_all(&out).map_err(|e| OutputError::io(&out, &e))?;
    write_whole(&out.join("scene.toml"), |file| file.write_all(job.scene.as_bytes()))?;
    // what a summary of an earlier process says is not about this one
    let _ = std::fs::remove_file(out.join("summary.json"));
    let begin = Instant::now();
    // names in messages start at the folder around, wherever that lies
    let (around, name) = (out.parent().unwrap_or(&out), Path::new(out.file_name().unwrap_or_default()));
    let mut command = Command::new(job.program);
    command.current_dir(around).arg("run").arg(name.join("scene.toml")).arg("--out").arg(name);
    command.arg("--leash").arg("--threads").arg(job.threads.to_string());
    command.arg(if job.verbose { "--verbose" } else { "--quiet" });
    command.args(job.resume.then_some("--resume"));
    if let Some(bytes) = job.memory {
        command.env("MONOLAYER_MEMORY", format!("{}", bytes / crate::run::memory::MIB));
    }
    command.stdin(Stdio::piped()).stderr(Stdio::piped()).stdout(job.lock.map_or_else(Stdio::null, Stdio::from));
    let mut child = command.spawn().map_err(|e| OutputError::io(job.program, &e))?;
    // the command holds a copy of the lock
    drop(command);
    let (leash, stderr) = (child.stdin.take(), child.stderr.take());
    let last = Mutex::new(VecDeque::new());
    let status = std::thread::scope(|scope| {
        scope.spawn(|| {
            for line in stderr.into_iter().flat_map(|pipe| BufReader::new(pipe).split(b'\n').map_while(Result::ok)) {
                let line = String::from_utf8_lossy(&line).trim_end().to_owned();
                said(&line);
                let mut last = last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                last.push_back(line);
                if last.len() > LAST {
                    last.pop_front();
                }
            }
        });
        wait(&mut child, leash, interrupt)
    });
    let status = status.map_err(|e| OutputError::io(job.program, &e))?;
    let last = last.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let last_lines = last.into_iter().filter(|line| !line.is_empty()).collect();
    let summary = RunSummary::read(&out);
    Ok(Ended { status, seconds: begin.elapsed().as_secs_f64(), summary, last_lines })
}

/// Waits for the end; lets go of the leash when somebody interrupts.
fn wait(
    child: &mut std::process::Child,
    mut leash: Option<ChildStdin>,
    interrupt: &AtomicBool,
) -> std::io::Result<ExitStatus> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if interrupt.load(Ordering::Relaxed) {
            drop(leash.take());
        }
        std::thread::sleep(POLL);
    }
}
