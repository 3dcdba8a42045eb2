//! The program `monolayer`: arguments and printing.

#![warn(clippy::too_many_arguments, clippy::too_many_lines)]

mod command {
    pub mod compare;
    pub mod map;
    pub mod plot;
    pub mod report;
    pub mod schema;
    pub mod signals;
    pub mod study;
    pub mod tradeoff;
}

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use clap::{Args, Parser, Subcommand};
use command::signals;
use monolayer::mesh::gmsh::{self, Encoding};
use monolayer::output::progress::Verbosity;
use monolayer::output::vtk::{Grid, write_vtu};
use monolayer::output::{OutputError, console, lock, mark};
use monolayer::run::AnyScene;
use monolayer::run::{self, Ending, Options};
use monolayer::scene::path;
use monolayer::scene::{Scene, SceneSource, kinds};
use monolayer::study::{self, BranchStudy, OrderStudy};

/// Set by Ctrl-C.
static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Solver for thin active tissue: velocity, pressure and polarity of a confluent cell sheet.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// A line for every step.
    #[arg(short, long, global = true)]
    verbose: bool,
    /// Threads to use, at most the cores there are; results do not depend on it [default: all cores].
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run one scene to its end: fields, tables, summary.
    Run {
        #[command(flatten)]
        scene: SceneArgs,
        /// Folder of the results [default: out/NAME, numbered if it is taken].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Continue from the checkpoint in the folder of the results.
        #[arg(long)]
        resume: bool,
        /// Search for a steady state instead of marching in time, as if the scene had the table [steady].
        #[arg(long)]
        steady: bool,
        /// End cleanly when standard input is closed: by the study that began this run, or by its end.
        #[arg(long, hide = true)]
        leash: bool,
    },
    /// Read a scene or a study and say what will be solved and what it takes, or what is wrong; solve nothing.
    Check {
        #[command(flatten)]
        scene: SceneArgs,
        /// Print the report as JSON.
        #[arg(long)]
        json: bool,
        /// As in `run`.
        #[arg(long)]
        steady: bool,
    },
    /// Errors and observed orders of convergence on a sequence of meshes and steps.
    Order {
        /// Study file.
        study: PathBuf,
        #[command(flatten)]
        sets: Sets,
        /// Folder of the results [default: out/NAME, numbered if it is taken].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// One scene with many values: a run for each, and one table.
    Study(command::study::StudyArgs),
    /// What accuracy costs: error against time over the settings of a scene.
    Tradeoff {
        /// Study file.
        study: PathBuf,
        #[command(flatten)]
        sets: Sets,
        /// Folder of the results; finished settings of the same study are kept [default: out/NAME, numbered if it is
        /// taken].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Time each setting so often and take the median.
        #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
        repeat: u16,
    },
    /// Branches of steady states in one parameter: folds, pitchforks, Hopf points, a diagram.
    Branch {
        /// Study file.
        study: PathBuf,
        #[command(flatten)]
        sets: Sets,
        /// Folder of the results [default: out/NAME, numbered if it is taken].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Compare measured velocities with a run.
    Compare(command::compare::CompareArgs),
    /// Draw pictures of the fields that runs have left in their folders; solve nothing.
    Map(command::map::MapArgs),
    /// Curves from folders of results: sections, measures over time, several runs in one picture.
    Plot(command::plot::Args),
    /// One self-contained HTML page of what runs and studies found.
    Report(command::report::Args),
    /// Print the JSON Schema of scenes or studies, for editors that complete and check TOML.
    Schema(command::schema::SchemaArgs),
    /// Build or read a mesh, report its quality, write it as VTU and Gmsh.
    Mesh {
        /// A scene (.toml) or a Gmsh 4.1 file (.msh).
        #[arg(value_name = "SCENE|FILE")]
        input: PathBuf,
        #[command(flatten)]
        sets: Sets,
        /// Write NAME.vtu and NAME.msh into this folder.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Write the Gmsh file as text instead of binary.
        #[arg(long)]
        ascii: bool,
    },
}

#[derive(Debug, Args)]
struct SceneArgs {
    /// Scene file.
    scene: PathBuf,
    #[command(flatten)]
    sets: Sets,
}

#[derive(Debug, Args)]
struct Sets {
    /// Change a value of the file, such as model.peclet=4; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

type Failure = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let cli = Cli::parse();
    match execute(&cli) {
        Ok(code) => code,
        Err(error) => {
            console::note(&format!("error: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn execute(cli: &Cli) -> Result<ExitCode, Failure> {
    if let Some(threads) = cli.threads {
        // more threads than cores only wait for each other
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads).min(cores)).build_global()?;
    }
    match &cli.command {
        Command::Run { scene, out, resume, steady, leash } => {
            if *leash {
                signals::end_with_input();
            }
            let out = out.clone().unwrap_or_else(|| default_folder(&scene.scene, *resume));
            let options = Options { out, resume: *resume, verbosity: cli.verbosity(), interrupt: &INTERRUPT };
            run_scene(&scene.any(*steady)?, &options, *leash)
        }
        Command::Check { scene, json, steady } => {
            if let Some(kind) = study::check::kind(&scene.scene) {
                return check_study(kind, scene, *json);
            }
            let report = run::kinds::check(&scene.any(*steady)?)?;
            console::answer(&if *json { report.json()? } else { report.to_string() })?;
            Ok(refuse(report.refused().iter().cloned()))
        }
        Command::Order { study, sets, out } => order(cli, study, sets, out.as_deref()),
        Command::Study(args) => command::study::execute(cli, args),
        Command::Branch { study, sets, out } => branch(cli, study, sets, out.as_deref()),
        Command::Compare(args) => args.execute(cli.quiet),
        Command::Map(args) => command::map::run(args, cli.quiet).map(|()| ExitCode::SUCCESS),
        Command::Plot(args) => tell(cli, args.execute()?),
        Command::Report(args) => tell(cli, args.execute()?),
        Command::Schema(args) => args.execute(),
        Command::Tradeoff { study, sets, out, repeat } => {
            let (pairs, out, repeat) =
                (pairs_of_study(cli, study, sets)?, study_folder(study, out.as_deref()), usize::from(*repeat));
            signals::catch("keeping the settings that are finished")?;
            command::tradeoff::tradeoff(study, &pairs, &out, repeat, cli.verbosity(), &INTERRUPT)
        }
        Command::Mesh { input, sets, out, ascii } => mesh(cli, input, sets, out.as_deref(), *ascii),
    }
}

impl Cli {
    fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (false, true) => Verbosity::Verbose,
            (false, false) => Verbosity::Normal,
        }
    }
}

impl SceneArgs {
    fn any(&self, steady: bool) -> Result<AnyScene, Failure> {
        let mut source = self.sets.source(&self.scene)?;
        if steady && *source.kind() != kinds::TISSUE {
            // refuses the kind
            Scene::check(source.clone())?;
        }
        if steady && !source.has("steady") {
            source.set("steady", "{}")?;
        }
        Ok(AnyScene::check(source)?)
    }
}

impl Sets {
    fn apply(&self, file: &Path) -> Result<AnyScene, Failure> {
        Ok(AnyScene::check(self.source(file)?)?)
    }

    fn source(&self, file: &Path) -> Result<SceneSource, Failure> {
        let mut source = SceneSource::read(file)?;
        for (key, value) in self.pairs()? {
            source.set(&key, &value)?;
        }
        Ok(source)
    }

    fn pairs(&self) -> Result<Vec<(String, String)>, Failure> {
        let pair = |set: &String| {
            let (key, value) = path::assignment(set).ok_or_else(|| {
                format!("`--set {set}` has no `=`; hint: write `--set KEY=VALUE`, such as `--set model.peclet=4`")
            })?;
            Ok((key.to_owned(), value.to_owned()))
        };
        self.sets.iter().map(pair).collect()
    }
}

/// The overrides of a study; says which words of its file, its scene and the overrides have another name today.
fn pairs_of_study(cli: &Cli, file: &Path, sets: &Sets) -> Result<Vec<(String, String)>, Failure> {
    let pairs = sets.pairs()?;
    if cli.verbosity() > Verbosity::Quiet {
        study::renamed_words(file, &pairs).iter().for_each(|note| console::note(&format!("note: {note}")));
    }
    Ok(pairs)
}

fn tell(cli: &Cli, said: Vec<String>) -> Result<ExitCode, Failure> {
    if cli.verbosity() > Verbosity::Quiet {
        console::tell(&said.join("\n"));
    }
    Ok(ExitCode::SUCCESS)
}

/// A run on the leash of a study is in a folder that the study holds.
fn run_scene(scene: &AnyScene, options: &Options, leash: bool) -> Result<ExitCode, Failure> {
    let (out, verbosity) = (&options.out, options.verbosity);
    signals::catch("finishing this step and writing a checkpoint")?;
    let summary = if leash {
        lock::sign(out);
        run::kinds::run_held(scene, options)?
    } else {
        run::kinds::run(scene, options)?
    };
    if verbosity > Verbosity::Quiet {
        console::tell(&format!("{summary}\nresults in {}", out.display()));
    }
    if summary.estimates_pending {
        // interrupted, if only while it made its estimates
        return Ok(ExitCode::from(130));
    }
    Ok(match &summary.ending {
        Ending::Failed { reason } => {
            console::note(&format!("error: {reason}; the last good state is in {}", out.display()));
            ExitCode::FAILURE
        }
        Ending::Interrupted => ExitCode::from(130),
        Ending::EndTime | Ending::MaxSteps | Ending::Stationary | Ending::EnergyAtRest => ExitCode::SUCCESS,
        Ending::Steady | Ending::Oscillating => ExitCode::SUCCESS,
    })
}

/// Says what a study will run, or what is wrong with it.
fn check_study(kind: study::check::StudyKind, args: &SceneArgs, json: bool) -> Result<ExitCode, Failure> {
    let report = study::check::check(kind, &args.scene, &args.sets.pairs()?)?;
    console::answer(&if json { serde_json::to_string_pretty(&report)? } else { report.to_string() })?;
    Ok(refuse(report.refused.iter().map(|(run, reason)| format!("{run}: {reason}"))))
}

/// Says what `run` would refuse, below a report that is right nonetheless.
fn refuse(reasons: impl Iterator<Item = String>) -> ExitCode {
    let mut code = ExitCode::SUCCESS;
    for reason in reasons {
        console::note(&format!("error: {reason}"));
        code = ExitCode::FAILURE;
    }
    code
}

fn order(cli: &Cli, file: &Path, sets: &Sets, out: Option<&Path>) -> Result<ExitCode, Failure> {
    let study = OrderStudy::read(file, &pairs_of_study(cli, file, sets)?)?;
    let out = study_folder(file, out);
    signals::catch("writing the tables of what is complete")?;
    let outcomes = study::run(&study, &out, cli.verbosity(), &INTERRUPT)?;
    let interrupted = outcomes.iter().any(|outcome| outcome.interrupted);
    let mut good = true;
    for outcome in &outcomes {
        if cli.verbosity() > Verbosity::Quiet {
            console::tell(&study::table::text(outcome));
        }
        // what was stopped is no failure
        for line in study::table::shortfalls(&study, outcome).iter().filter(|_| !interrupted) {
            good = false;
            console::note(&format!(
                "error: {}{}{line}",
                outcome.variant,
                if outcome.variant.is_empty() { "" } else { ": " }
            ));
        }
    }
    if cli.verbosity() > Verbosity::Quiet {
        console::tell(&format!("results in {}", out.display()));
    }
    Ok(match (interrupted, good) {
        (true, _) => ExitCode::from(130),
        (false, true) => ExitCode::SUCCESS,
        (false, false) => ExitCode::FAILURE,
    })
}

fn branch(cli: &Cli, file: &Path, sets: &Sets, out: Option<&Path>) -> Result<ExitCode, Failure> {
    let study = BranchStudy::read(file, &pairs_of_study(cli, file, sets)?)?;
    let out = study_folder(file, out);
    signals::catch("writing the table of what is complete")?;
    let diagram = study::branch::run(&study, &out, cli.verbosity(), &INTERRUPT)?;
    if cli.verbosity() > Verbosity::Quiet {
        console::tell(&format!("{diagram}\nresults in {}", out.display()));
    }
    if let Some(why) = &diagram.broken {
        console::note(&format!("error: {why}; the branches so far are in {}", out.display()));
        return Ok(ExitCode::FAILURE);
    }
    Ok(if diagram.interrupted { ExitCode::from(130) } else { ExitCode::SUCCESS })
}

/// The folder that was asked for, or the first of the numbered ones that holds no results.
fn study_folder(file: &Path, out: Option<&Path>) -> PathBuf {
    let free = || numbered_folders(file).find(|folder| !study::table::is_occupied(folder)).unwrap_or_default();
    out.map_or_else(free, Path::to_owned)
}

/// `out/NAME`, `out/NAME-2`, … for a file NAME.
fn numbered_folders(file: &Path) -> impl Iterator<Item = PathBuf> {
    let stem = file.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned());
    (1..).map(move |k| Path::new("out").join(if k == 1 { stem.clone() } else { format!("{stem}-{k}") }))
}

/// `out/NAME`, or `out/NAME-2`, … when that holds results already; the latest of them to resume.
fn default_folder(scene: &Path, resume: bool) -> PathBuf {
    let is_taken = |folder: &PathBuf| folder.join("scene.toml").exists() || lock::is_held(folder);
    if !resume {
        return numbered_folders(scene).find(|folder| !is_taken(folder)).unwrap_or_default();
    }
    let is_begun = |folder: &PathBuf| folder.join("checkpoint.bin").exists() || lock::is_marked(folder);
    let taken = numbered_folders(scene).take_while(|folder| is_taken(folder) || lock::is_marked(folder));
    taken.filter(is_begun).last().or_else(|| numbered_folders(scene).next()).unwrap_or_default()
}

fn mesh(cli: &Cli, input: &Path, sets: &Sets, out: Option<&Path>, ascii: bool) -> Result<ExitCode, Failure> {
    let mesh = if gmsh::is_mesh_file(input) {
        gmsh::read(input)?
    } else {
        let scene = sets.apply(input)?;
        run::kinds::announce_mesh(&scene, cli.verbosity());
        run::kinds::mesh(&scene)?
    };
    let notes = run::domain::mesh_remarks(&mesh).into_iter().map(|note| format!("\nnote: {note}"));
    let quality = mesh.quality().to_string() + &notes.collect::<String>();
    let Some(out) = out else {
        console::answer(&quality)?;
        return Ok(ExitCode::SUCCESS);
    };
    std::fs::create_dir_all(out).map_err(|e| OutputError::io(out, &e))?;
    let stem = input.file_stem().map_or_else(|| "mesh".into(), |s| s.to_string_lossy().into_owned());
    let degree = mesh.curved.iter().flatten().map(|nodes| nodes.degree).max().unwrap_or(1);
    let (vtu, msh) = (out.join(format!("{stem}.vtu")), out.join(format!("{stem}.msh")));
    [&vtu, &msh].into_iter().try_for_each(|path| mark::check(path))?;
    write_vtu(&vtu, &Grid::new(&mesh, degree), 0.0, &[])?;
    gmsh::write(&mesh, &msh, if ascii { Encoding::Ascii } else { Encoding::Binary })?;
    console::tell(&format!("{quality}\nwritten {} and {}", vtu.display(), msh.display()));
    Ok(ExitCode::SUCCESS)
}
