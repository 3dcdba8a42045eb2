//! Kills at random moments: a run that goes on after them leaves what one leaves that was never stopped, file by file.
//!
//! ```text
//! MONOLAYER_KILLS=100 MONOLAYER_SEED=7 cargo test --release --test kills random -- --nocapture
//! ```

use std::collections::BTreeMap;
use std::fs::File;
use std::os::fd::OwnedFd;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::{SQUARE, files, good, program};

/// Every kind of scene, with every kind of file: name and text.
fn scenes() -> Vec<(&'static str, String)> {
    let checkpoint = "[[output]]\ncheckpoint = true\nevery = { steps = 7 }\n";
    let tissue = r#"
[[output]]
fields = ["velocity", "polarity"]
every = { time = 0.05 }
[[output]]
measures = ["free_energy", "defects"]
every = { steps = 3 }
[[output]]
cuts = [{ name = "middle", from = [0, 0.4], to = [1, 0.4], points = 50 }]
every = { steps = 4 }
[[output]]
maps = [{ of = "speed" }]
every = { steps = 40 }
"#;
    let small = |text: &str| text.replace("step = 0.1\nend = 0.5", "step = 0.01\nend = 0.3");
    let bodies = r#"
[[output]]
fields = ["velocity"]
every = { time = 0.05 }
[[output]]
bodies = true
contacts = true
every = { time = 0.03 }
[[output]]
measures = ["body", "contacts"]
every = { steps = 2 }
[[output]]
maps = [{ of = "bodies" }]
every = { steps = 40 }
"#;
    let free = r#"
[[body]]
name = "disc"
shape = { disc = { radius = 0.2 } }
position = [0.45, 0.5]
force = ["0.3*cos(9*t)", "0.2"]
"#;
    let walls = r#"
[[body]]
name = "one"
shape = { disc = { radius = 0.1 } }
position = [0.4, 0.5]
force = ["mass*sin(7*t)", "-mass"]
[[body]]
name = "two"
shape = { disc = { radius = 0.15 } }
position = [0.66, 0.55]
force = ["-mass*sin(5*t)", "-mass"]
[[wall]]
segment = [[-2.0, 0.3], [3.0, 0.3]]
[contact]
law = "gluey"
"#;
    let particles = format!(
        "[model]\nkind = \"particles\"\n{walls}\n[time]\nstep = 0.002\nend = 0.5\n{}",
        bodies.replace("[[output]]\nfields = [\"velocity\"]\nevery = { time = 0.05 }\n", "")
    );
    let stokes = format!(
        "[model]\nkind = \"stokes\"\n[mesh]\nshape = \"square\"\nn = 6\n[boundary]\n\
         left = {{ velocity = {{ dirichlet = [0, 0] }} }}\n\
         right = {{ velocity = {{ dirichlet = [0, 0] }} }}\ntop = {{ velocity = \"traction\" }}\n\
         bottom = {{ velocity = {{ dirichlet = [0, 0] }} }}\n{free}[time]\nstep = 0.01\nend = 0.6\n{bodies}"
    );
    let of_tissue = [(", \"contacts\"]", "]"), ("contacts = true\n", ""), ("of = \"bodies\"", "of = \"speed\"")];
    let bodies = of_tissue.iter().fold(bodies.to_owned(), |text, (from, to)| text.replace(from, to));
    let carried = small(SQUARE) + free + &bodies;
    vec![
        ("tissue", small(SQUARE) + tissue + checkpoint),
        ("particles", particles + checkpoint),
        ("stokes", stokes + checkpoint),
        ("carried", carried + checkpoint),
    ]
}

/// Always the same numbers, between 0 and 1, for a seed.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Blow {
    Kill,
    Terminate,
    /// The terminal that the program writes to is closed, and the system says so.
    CloseTerminal,
}

/// A program with a terminal of its own.
struct Started {
    child: Child,
    terminal: Option<OwnedFd>,
}

fn start(mut command: Command) -> Started {
    let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    rustix::fs::fcntl_setfl(&terminal, rustix::fs::OFlags::NONBLOCK).unwrap();
    grantpt(&terminal).unwrap();
    unlockpt(&terminal).unwrap();
    let name = ptsname(&terminal, Vec::new()).unwrap().into_string().unwrap();
    let side = || Stdio::from(File::options().read(true).write(true).open(&name).unwrap());
    command.stdout(side()).stderr(side());
    Started { child: command.spawn().unwrap(), terminal: Some(terminal) }
}

impl Started {
    fn strike(&mut self, blow: Blow) {
        let signal = match blow {
            Blow::Kill => "-KILL",
            Blow::Terminate => "-TERM",
            Blow::CloseTerminal => {
                drop(self.terminal.take());
                "-HUP"
            }
        };
        let done = Command::new("kill").args([signal, &self.child.id().to_string()]).stderr(Stdio::null()).status();
        done.unwrap();
    }

    /// Takes what the program has printed: a terminal that is full would keep it waiting.
    fn read(&self) {
        let mut room = [0; 4096];
        let read = |room: &mut [u8]| self.terminal.as_ref().map_or(Ok(0), |terminal| rustix::io::read(terminal, room));
        while read(&mut room).is_ok_and(|count| count > 0) {}
    }

    /// Waits so long for its end.
    fn wait(&mut self, patience: Duration) -> Option<ExitStatus> {
        let begin = Instant::now();
        loop {
            self.read();
            match self.child.try_wait().unwrap() {
                Some(status) => return Some(status),
                None if begin.elapsed() >= patience => return None,
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        }
    }
}

const LONG: Duration = Duration::from_secs(300);

/// A file without what differs from one process to the next: times, memory, counts of this process.
fn lasting(path: &Path, bytes: &[u8]) -> Vec<u8> {
    const OF_THE_PROCESS: [&str; 7] = [
        "seconds",
        "seconds_total",
        "peak_memory_mib",
        "factorisations",
        "direct_solves",
        "threads",
        "seconds_per_iteration",
    ];
    let name = path.file_name().unwrap().to_string_lossy();
    match &*name {
        "summary.json" | "row.json" => {
            let mut value: serde_json::Map<String, serde_json::Value> = serde_json::from_slice(bytes).unwrap();
            value.retain(|key, _| !OF_THE_PROCESS.contains(&key.as_str()));
            serde_json::to_vec(&value).unwrap()
        }
        "results.csv" => {
            let mut reader = csv::Reader::from_reader(bytes);
            let header = reader.headers().unwrap().clone();
            let rows = std::iter::once(header.clone()).chain(reader.records().map(Result::unwrap));
            let kept = |row: csv::StringRecord| {
                let cells = row.iter().zip(&header).filter(|(_, name)| !OF_THE_PROCESS.contains(name));
                cells.map(|(cell, _)| cell.to_owned()).collect::<Vec<_>>().join(",")
            };
            rows.map(kept).collect::<Vec<_>>().join("\n").into_bytes()
        }
        "results.parquet" => Vec::new(),
        _ => bytes.to_vec(),
    }
}

fn left(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    files(folder).into_iter().map(|(path, bytes)| (path.clone(), lasting(&path, &bytes))).collect()
}

/// What is to survive: a command, and how it goes on.
struct Victim {
    name: &'static str,
    begin: Vec<String>,
    go_on: Vec<String>,
    expected: BTreeMap<PathBuf, Vec<u8>>,
    takes: Duration,
}

impl Victim {
    fn new(root: &Path, name: &'static str, begin: &[&str], go_on: &[&str]) -> Self {
        let whole = format!("{name}-whole");
        let since = Instant::now();
        good(root, &[begin, &["--out", whole.as_str()]].concat());
        let takes = since.elapsed();
        let own = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        Self { name, begin: own(begin), go_on: own(go_on), expected: left(&root.join(whole)), takes }
    }

    /// Stops it up to three times at random moments, lets it end, and compares. The number of blows that it felt.
    fn survives(&self, root: &Path, out: &str, dice: &mut Dice) -> usize {
        let (mut felt, mut history) = (0, Vec::new());
        let blows = 1 + (3.0 * dice.roll()) as usize;
        loop {
            let begun = root.join(out).join("lock").exists();
            let words = if begun { &self.go_on } else { &self.begin };
            let words: Vec<&str> = words.iter().map(String::as_str).chain(["--out", out]).collect();
            let mut started = start(program(root, &words));
            let patience = if felt < blows { self.takes.mul_f64(0.9 * dice.roll()) } else { LONG };
            if let Some(status) = started.wait(patience) {
                assert!(status.success(), "{}: {status} after {history:?}", self.name);
                break;
            }
            let blow = [Blow::Kill, Blow::Terminate, Blow::CloseTerminal][(3.0 * dice.roll()) as usize];
            started.strike(blow);
            let status = started.wait(LONG).expect("it ends after a blow");
            history.push((blow, patience.as_millis()));
            felt += 1;
            match blow {
                Blow::Kill => assert!(status.signal() == Some(9) || status.success(), "{status}"),
                Blow::Terminate | Blow::CloseTerminal => {
                    assert!(status.code() == Some(130) || status.success(), "{}: {status} {history:?}", self.name);
                }
            }
        }
        let found = left(&root.join(out));
        for path in self.expected.keys().chain(found.keys()) {
            let same = self.expected.get(path) == found.get(path);
            assert!(same, "{}: {} differs after {history:?}, in {}", self.name, path.display(), root.display());
        }
        felt
    }
}

fn number_of(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name} = {text}")))
}

#[test]
fn what_was_killed_at_random_moments_ends_as_if_it_was_not() {
    let kills = number_of("MONOLAYER_KILLS").unwrap_or(10) as usize;
    let seed = number_of("MONOLAYER_SEED").unwrap_or(1);
    println!("{kills} kills with seed {seed}");
    let temporary = tempfile::tempdir().unwrap();
    let root = temporary.path();
    let mut victims = Vec::new();
    for (name, text) in scenes() {
        let file = format!("{name}.toml");
        std::fs::write(root.join(&file), text).unwrap();
        let begin = ["run", file.as_str(), "-v"];
        victims.push(Victim::new(root, name, &begin, &[&begin[..], &["--resume"]].concat()));
    }
    let sweep =
        "scene = \"tissue.toml\"\nset = { \"time.end\" = 0.2 }\nvary = { \"model.peclet\" = [0.5, 1.0, 2.0] }\n";
    std::fs::write(root.join("sweep.toml"), sweep).unwrap();
    let study = ["study", "sweep.toml", "--jobs", "2"];
    victims.push(Victim::new(root, "study", &study, &study));
    let (mut dice, mut felt) = (Dice(seed), 0);
    for round in 0.. {
        if felt >= kills {
            break;
        }
        let victim = &victims[round % victims.len()];
        let out = format!("{}-{round}", victim.name);
        felt += victim.survives(root, &out, &mut dice);
        println!("{felt} of {kills}: {out} is whole");
        std::fs::remove_dir_all(root.join(out)).unwrap();
    }
}
