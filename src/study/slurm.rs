//! A sweep as a job array of Slurm: a shard for each task, and a job that joins their tables.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use schemars::JsonSchema;
use serde::Deserialize;

use super::source::refuse;
use super::sweep_file::SweepStudy;
use super::{StudyError, memory_gate};
use crate::output::{OutputError, write_whole};
use crate::run::memory::MIB;
use crate::scene::SceneSource;
use crate::schema::in_order;

/// `[slurm]`: what `sbatch` is told beside what the study knows.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = in_order::<Self>)]
pub struct SlurmTable {
    /// Limit on the time of a task, such as `"02:00:00"`.
    pub time: Option<String>,
    /// Where it runs.
    pub partition: Option<String>,
    /// Further options of `sbatch`, such as `"--account=tissue"`.
    #[serde(default)]
    pub options: Vec<String>,
}

impl SlurmTable {
    /// # Errors
    /// Texts that would break the lines of a script.
    pub(super) fn check(&self, source: &SceneSource) -> Result<(), StudyError> {
        let plain = |text: &String| !text.is_empty() && !text.contains(['\n', '\r']);
        let parts = [("slurm.time", &self.time), ("slurm.partition", &self.partition)];
        for (key, value) in parts.into_iter().filter_map(|(key, value)| Some((key, value.as_ref()?))) {
            if !plain(value) || value.contains(char::is_whitespace) {
                let rule = "must be one word, as `sbatch` takes it";
                return Err(refuse(source, key, format!("{value:?}"), rule, "such as \"02:00:00\""));
            }
        }
        match self.options.iter().position(|option| !plain(option) || !option.starts_with('-')) {
            None => Ok(()),
            Some(at) => {
                let (key, value) = (format!("slurm.options.{at}"), format!("{:?}", self.options[at]));
                Err(refuse(source, &key, value, "must be an option of `sbatch`", "such as \"--account=tissue\""))
            }
        }
    }
}

/// What a caller decides about the jobs.
#[derive(Debug)]
pub struct Array<'a> {
    /// This program, where the nodes find it, too.
    pub program: &'a Path,
    /// Tasks of the array; as many as there are units of runs if it is not given.
    pub shards: Option<usize>,
    /// Cores of a task.
    pub threads: usize,
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scripts {
    /// Does the runs.
    pub array: PathBuf,
    /// Joins their tables.
    pub gather: PathBuf,
    /// Tasks of the array.
    pub tasks: usize,
}

/// Memory of the study's own process beside its run, MiB.
const OWN: f64 = 64.0;
/// For whatever the estimate misses: a task above its limit is killed.
const MARGIN: f64 = 1.25;

/// Writes `slurm.sh`, `gather.sh` and the folder of their logs into `out`, which is the study's already.
///
/// # Errors
/// Files that cannot be written; an override that the study in the folder cannot hold.
pub fn write(study: &SweepStudy, out: &Path, array: &Array) -> Result<Scripts, StudyError> {
    if let Some(key) = study.lost_override() {
        return Err(StudyError::Launch {
            what: format!("`--set {key}=…` replaces a whole table, which cannot be handed on to the jobs"),
            hint: "set its keys one by one, or put it into the scene".to_owned(),
        });
    }
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| OutputError::io(path, &e));
    let (out, program) = (absolute(out)?, absolute(array.program)?);
    let logs = out.join("slurm");
    std::fs::create_dir_all(&logs).map_err(|e| OutputError::io(&logs, &e))?;
    let tasks = array.shards.unwrap_or(usize::MAX).min(study.units().len());
    let needs = (0..study.cases.len()).filter_map(|at| memory_gate::need(&study.scene_of(at).ok()?));
    let memory = (needs.fold(0.0, f64::max) / MIB * MARGIN + OWN).ceil();
    let (program, folder) = (quoted(&program), quoted(&out));
    let head = |name: &str, log: &str, cores: usize, memory: f64| {
        let mut text = format!("#!/bin/sh\n#SBATCH --job-name={name}\n#SBATCH --output={}\n", option(&logs.join(log)));
        let _ = write!(text, "#SBATCH --ntasks=1\n#SBATCH --cpus-per-task={cores}\n#SBATCH --mem={memory}M\n");
        if let Some(partition) = &study.slurm.partition {
            let _ = writeln!(text, "#SBATCH --partition={partition}");
        }
        text
    };
    let mut script = head("monolayer", "%a.log", array.threads, memory);
    let _ = writeln!(script, "#SBATCH --array=1-{tasks}");
    if let Some(time) = &study.slurm.time {
        let _ = writeln!(script, "#SBATCH --time={time}");
    }
    // a minute to write checkpoints before the time is over
    let _ = writeln!(script, "#SBATCH --signal=B:TERM@60");
    for option in &study.slurm.options {
        let _ = writeln!(script, "#SBATCH {}", whole(option));
    }
    let _ = writeln!(
        script,
        "exec {program} study {folder}/study.toml --out {folder} --shard \"$SLURM_ARRAY_TASK_ID/{tasks}\" --jobs 1 \
         --threads {}",
        array.threads
    );
    let mut join = head("monolayer-gather", "gather.log", 1, 4.0 * OWN);
    let _ = writeln!(join, "exec {program} study --gather {folder}");
    let scripts = Scripts { array: out.join("slurm.sh"), gather: out.join("gather.sh"), tasks };
    write_whole(&scripts.array, |file| file.write_all(script.as_bytes()))?;
    write_whole(&scripts.gather, |file| file.write_all(join.as_bytes()))?;
    Ok(scripts)
}

/// Hands both to `sbatch`; the second begins when the first has ended, well or not. Their numbers.
///
/// # Errors
/// No `sbatch`, or one that refuses.
pub fn submit(scripts: &Scripts) -> Result<[String; 2], StudyError> {
    let array = sbatch(&[], &scripts.array)?;
    let gather = sbatch(&[format!("--dependency=afterany:{array}")], &scripts.gather)?;
    Ok([array, gather])
}

fn sbatch(options: &[String], script: &Path) -> Result<String, StudyError> {
    let refused = |reason: String| StudyError::Launch {
        what: format!("`sbatch` did not take {}: {reason}", script.display()),
        hint: "`--dry-run` only writes the scripts; see that `sbatch` is there, and what it says of the options in \
               [slurm]"
            .to_owned(),
    };
    let output = Command::new("sbatch").arg("--parsable").args(options).arg(script).output();
    let output = output.map_err(|error| refused(error.to_string()))?;
    if !output.status.success() {
        return Err(refused(String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; ")));
    }
    // with several clusters the name of one follows
    let said = String::from_utf8_lossy(&output.stdout);
    Ok(said.trim().split(';').next().unwrap_or_default().to_owned())
}

/// A path for the shell.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.to_string_lossy().replace('\'', "'\\''"))
}

/// An option whose value has spaces, in one piece.
fn whole(option: &str) -> String {
    match option.split_once('=') {
        Some((name, value)) if value.contains(char::is_whitespace) && !value.contains(['"', '\'']) => {
            format!("{name}=\"{value}\"")
        }
        Some(_) | None => option.to_owned(),
    }
}

/// A path as the value of an option in a script's head.
fn option(path: &Path) -> String {
    let text = path.to_string_lossy();
    if text.contains(char::is_whitespace) { format!("\"{text}\"") } else { text.into_owned() }
}
