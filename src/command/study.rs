//! `monolayer study`: arguments and printing.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use monolayer::output::console;
use monolayer::output::progress::Verbosity;
use monolayer::study::sweep::{self, Settings, Shard, Sweep};
use monolayer::study::{SweepStudy, slurm, table};

use super::signals;
use crate::{Cli, Failure, INTERRUPT, Sets, numbered_folders, study_folder};

#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Study file.
    #[arg(required_unless_present = "gather", conflicts_with = "gather")]
    study: Option<PathBuf>,
    #[command(flatten)]
    sets: Sets,
    /// Folder of the results; one that holds a part of this study is completed [default: out/NAME, numbered if it is
    /// taken].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs at a time, as far as memory allows [default: as many as there are cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Only every N-th run, from number I on, into the same folder; the table is results.I-of-N.csv.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Insist on completing what was begun: in `--out`, or in the latest of the numbered folders.
    #[arg(long)]
    resume: bool,
    /// Do runs that failed or were refused again.
    #[arg(long)]
    retry_failed: bool,
    /// Join the tables of all runs that are in this folder; run nothing.
    #[arg(
        long,
        value_name = "DIR",
        conflicts_with_all = ["sets", "out", "jobs", "shard", "resume", "retry_failed", "launcher"]
    )]
    gather: Option<PathBuf>,
    /// Who does the runs.
    #[arg(long, value_enum, default_value = "local", conflicts_with_all = ["jobs", "shard"])]
    launcher: Launcher,
    /// Tasks of the job array [default: one for each run].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "gather")]
    shards: Option<u32>,
    /// Only write the scripts of the launcher.
    #[arg(long, conflicts_with = "gather")]
    dry_run: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Launcher {
    /// This machine.
    Local,
    /// A job array of Slurm.
    Slurm,
}

pub fn execute(cli: &Cli, args: &StudyArgs) -> Result<ExitCode, Failure> {
    if let Some(folder) = &args.gather {
        return gather(cli, folder);
    }
    let file = args.study.as_deref().ok_or("no study is named; hint: `monolayer study STUDY`")?;
    if args.launcher == Launcher::Local && (args.shards.is_some() || args.dry_run) {
        return Err("`--shards` and `--dry-run` are for a launcher; hint: add `--launcher slurm`".into());
    }
    let study = SweepStudy::read(file, &crate::pairs_of_study(cli, file, &args.sets)?)?;
    let out = folder(file, args);
    if let Some(duration) = study.duration.as_ref().filter(|_| cli.verbosity() > Verbosity::Quiet) {
        console::note(&format!("{} runs, about {duration} on 2 cores", study.cases.len()));
    }
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    let cores = cli.threads.map_or(all, |threads| usize::from(threads).min(all));
    let program = std::env::current_exe()?;
    let settings = Settings {
        program: Some(&program),
        jobs: args.jobs.map(usize::from),
        cores,
        shard: args.shard,
        must_resume: args.resume,
        retry_failed: args.retry_failed,
        verbosity: cli.verbosity(),
        interrupt: &INTERRUPT,
    };
    if args.launcher == Launcher::Slurm {
        sweep::prepare(&study, &out, &settings)?;
        if args.retry_failed {
            sweep::forget_failed(&study, &out)?;
        }
        let threads = cli.threads.map_or(1, usize::from);
        let shards = args.shards.map(|n| n as usize);
        return launch(cli, &study, &out, &slurm::Array { program: &program, shards, threads }, args.dry_run);
    }
    signals::catch("finishing the steps at work and writing the table")?;
    let sweep = sweep::run(&study, &out, &settings)?;
    conclude(cli, &study, &sweep, &out)
}

fn gather(cli: &Cli, folder: &Path) -> Result<ExitCode, Failure> {
    let study = SweepStudy::read_left(folder)?;
    let sweep = sweep::gather(&study, folder)?;
    if !sweep.missing.is_empty() {
        console::note(&format!("not there or not complete: {}", sweep.missing.join(", ")));
    }
    conclude(cli, &study, &sweep, folder)
}

/// Says what became of the runs.
fn conclude(cli: &Cli, study: &SweepStudy, sweep: &Sweep, out: &Path) -> Result<ExitCode, Failure> {
    for row in sweep.rows.iter().filter(|row| !row.found.is_good()) {
        console::note(&format!("error: run {}: {}", row.case.folder, row.found.reason().unwrap_or_default()));
    }
    if cli.verbosity() > Verbosity::Quiet {
        console::tell(&format!("{} of {} runs, results in {}", sweep.rows.len(), study.cases.len(), out.display()));
    }
    let good = sweep.missing.is_empty() && sweep.rows.iter().all(|row| row.found.is_good());
    Ok(match (sweep.interrupted, good) {
        (true, _) => ExitCode::from(130),
        (false, true) => ExitCode::SUCCESS,
        (false, false) => ExitCode::FAILURE,
    })
}

fn launch(cli: &Cli, study: &SweepStudy, out: &Path, array: &slurm::Array, dry_run: bool) -> Result<ExitCode, Failure> {
    let scripts = slurm::write(study, out, array)?;
    let text = if dry_run {
        format!("written {} and {}", scripts.array.display(), scripts.gather.display())
    } else {
        let [first, second] = slurm::submit(&scripts)?;
        format!("job {first} with {} tasks, then job {second}; results in {}", scripts.tasks, out.display())
    };
    if cli.verbosity() > Verbosity::Quiet {
        console::tell(&text);
    }
    Ok(ExitCode::SUCCESS)
}

/// The folder that was asked for; the latest that holds a study to resume; or the first that holds no results.
fn folder(file: &Path, args: &StudyArgs) -> PathBuf {
    if args.out.is_none() && args.resume {
        let taken = numbered_folders(file).take_while(|folder| table::is_occupied(folder));
        return taken.last().or_else(|| numbered_folders(file).next()).unwrap_or_default();
    }
    study_folder(file, args.out.as_deref())
}
