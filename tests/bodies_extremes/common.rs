//! Scenes as text, run into a folder that is gone after the test.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::AnyScene;
use monolayer::run::{Ending, Options, Summary, kinds};
use tempfile::TempDir;

/// A state of one body in `bodies.csv`.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
pub struct Row {
    pub time: f64,
    pub body: String,
    pub x: f64,
    pub y: f64,
    pub theta: f64,
    pub vx: f64,
    pub vy: f64,
    pub spin: f64,
    pub fx: f64,
    pub fy: f64,
    pub torque: f64,
}

/// What a run left.
pub struct Left {
    pub folder: TempDir,
    pub summary: Summary,
    pub rows: Vec<Row>,
}

impl Left {
    /// The last state of a body.
    pub fn last(&self, body: &str) -> &Row {
        self.rows.iter().rev().find(|row| row.body == body).unwrap_or_else(|| panic!("`{body}` is in the table"))
    }

    /// All states of a body.
    pub fn track(&self, body: &str) -> Vec<&Row> {
        self.rows.iter().filter(|row| row.body == body).collect()
    }

    pub fn measure(&self, name: &str) -> f64 {
        self.summary.measures.get(name).copied().unwrap_or_else(|| panic!("{name}: {:?}", self.summary.measures))
    }

    /// The largest overlap of all steps.
    pub fn overlap(&self) -> f64 {
        self.summary.bodies.as_ref().expect("the scene has bodies").largest_overlap
    }

    /// Largest value of a column of `history.csv`.
    pub fn most(&self, column: &str) -> f64 {
        let mut table = csv::Reader::from_path(self.folder.path().join("out/history.csv")).unwrap();
        let at = table.headers().unwrap().iter().position(|name| name == column).expect("the column is there");
        let values = table.records().map(|row| row.unwrap()[at].parse().unwrap_or(f64::NEG_INFINITY));
        values.fold(f64::NEG_INFINITY, f64::max)
    }

    pub fn bytes(&self, file: &str) -> Vec<u8> {
        std::fs::read(self.folder.path().join("out").join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
    }

    /// The reason of a failure.
    pub fn reason(&self) -> &str {
        match &self.summary.ending {
            Ending::Failed { reason } => reason,
            other => panic!("the run must fail, and ended as {other:?} at {}", self.summary.time),
        }
    }

    pub fn ended(self) -> Self {
        assert!(matches!(self.summary.ending, Ending::EndTime), "{:?}", self.summary.ending);
        self
    }
}

fn folder_of(folder: &TempDir) -> std::path::PathBuf {
    folder.path().join("out")
}

fn attempt(text: &str, folder: &Path, resume: bool) -> Result<Summary, String> {
    let scene = AnyScene::parse(text, &folder.join("scene.toml")).map_err(|error| error.to_string())?;
    let interrupt = AtomicBool::new(false);
    let options = Options { out: folder.join("out"), resume, verbosity: Verbosity::Quiet, interrupt: &interrupt };
    kinds::run(&scene, &options).map_err(|error| error.to_string())
}

/// Runs a scene, or tells why it is refused.
pub fn try_to_run(text: &str) -> Result<Left, String> {
    let folder = tempfile::tempdir().unwrap();
    let summary = attempt(text, folder.path(), false)?;
    Ok(read(folder, summary))
}

/// Runs a scene.
///
/// # Panics
/// Where it is refused.
pub fn run(text: &str) -> Left {
    try_to_run(text).unwrap_or_else(|message| panic!("refused: {message}"))
}

/// Goes on with what a run left, as the scene `text` has it now.
pub fn resume(left: Left, text: &str) -> Left {
    let summary = attempt(text, left.folder.path(), true).unwrap_or_else(|message| panic!("refused: {message}"));
    read(left.folder, summary)
}

fn read(folder: TempDir, summary: Summary) -> Left {
    let table = folder_of(&folder).join("bodies.csv");
    let rows = match csv::Reader::from_path(table) {
        Ok(mut table) => table.deserialize().map(|row| row.expect("a row of numbers")).collect(),
        Err(_) => Vec::new(),
    };
    Left { folder, summary, rows }
}

/// The message of a scene that is refused before its first step; nothing must be left of it.
pub fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let message = attempt(text, folder.path(), false).expect_err("it must be refused");
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 0, "something is left of a scene that was refused: {message}");
    assert!(message.contains("hint: "), "no hint in: {message}");
    message
}

pub fn has(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

/// A number as TOML has it.
pub fn number(x: f64) -> String {
    format!("{x:?}").replace("NaN", "nan")
}

/// Particles with `model` keys and the rest of a scene; outputs at every step.
pub fn particles(model: &str, rest: &str, step: f64, end: f64) -> String {
    format!(
        "[model]\nkind = \"particles\"\n{model}\n{rest}\n[time]\nstep = {}\nend = {end:?}\n{}",
        number(step),
        outputs()
    )
}

/// Bodies and all measures at every step.
fn outputs() -> &'static str {
    "[[output]]\nbodies = true\nevery = { steps = 1 }\n\
     [[output]]\nmeasures = [\"kinetic_energy\", \"gap\", \"overlap\", \"contacts\", \"wall_force\"]\n\
     every = { steps = 1 }\n"
}

/// A body with further keys.
pub fn disc(name: &str, radius: f64, x: f64, y: f64, more: &str) -> String {
    let shape = format!("shape = {{ disc = {{ radius = {radius:?} }} }}");
    format!("[[body]]\nname = \"{name}\"\n{shape}\nposition = [{x:?}, {y:?}]\n{more}\n")
}

pub fn segment(a: [f64; 2], b: [f64; 2]) -> String {
    format!("[[wall]]\nsegment = [{a:?}, {b:?}]\n")
}

pub const REST: &str = "[\"0\", \"0\"]";

/// A Stokes flow in the unit square with `v` on its sides.
pub fn stokes(n: usize, v: &str, rest: &str, step: f64, end: f64) -> String {
    let sides = ["left", "right", "bottom", "top"];
    let sides: String = sides.map(|tag| format!("[boundary.{tag}]\nvelocity = {{ dirichlet = {v} }}\n")).concat();
    let mesh = format!("[mesh]\nshape = \"square\"\nn = {n}\n");
    format!(
        "[model]\nkind = \"stokes\"\n{mesh}{sides}{rest}\n[time]\nstep = {}\nend = {end:?}\n{}\
         [[output]]\nfields = [\"velocity\", \"pressure\"]\n",
        number(step),
        outputs()
    )
}

/// A tissue that streams along a short strip, or along a square with `side` on the walls.
pub fn tissue(rest: &str, step: f64, end: f64) -> String {
    format!(
        "[model]\nkind = \"incompressible\"\nbeta = 0.75\npeclet = 2.0\ncoherence = 0.3\nelasticity = 0.2\n\
         [mesh]\nshape = \"strip\"\nlength = [-3.0, 3.0]\nwidth = 4.0\nh = 0.8\n\
         [boundary.inlet]\nvelocity = {{ dirichlet = [\"1\", \"0\"] }}\npolarity = {{ dirichlet = [\"1\", \"0\"] }}\n\
         [boundary.outlet]\nvelocity = \"traction\"\npolarity = \"neumann\"\n\
         [boundary.walls]\nvelocity = \"slip\"\npolarity = \"neumann\"\n\
         [initial]\npolarity = [\"1\", \"0\"]\n{rest}\n\
         [time]\nscheme = \"bdf2\"\nstep = {}\nend = {end:?}\n[coupling]\nkind = \"anderson\"\n{}\
         [[output]]\nfields = [\"velocity\", \"polarity\"]\n",
        number(step),
        outputs()
    )
}

/// Runs with so many threads.
pub fn with_threads<T: Send>(threads: usize, what: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start").install(what)
}
