//! Bodies that leave the mesh: the run goes on around those that are left.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::results::bodies::BodiesAtTime;
use monolayer::run::{AnyScene, Ending, Options, Summary, kinds};
use tempfile::TempDir;

const METHODS: [&str; 2] = ["nitsche", "penalty"];

/// What a run left.
struct Left {
    folder: TempDir,
    summary: Summary,
}

/// A row of `bodies.csv`: time, x, y, angle.
type Row = [f64; 4];

impl Left {
    fn out(&self) -> std::path::PathBuf {
        self.folder.path().join("out")
    }

    fn bytes(&self, file: &str) -> Vec<u8> {
        std::fs::read(self.out().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
    }

    fn ended(self) -> Self {
        assert!(matches!(self.summary.ending, Ending::EndTime), "{:?}", self.summary.ending);
        self
    }

    fn reason(&self) -> &str {
        match &self.summary.ending {
            Ending::Failed { reason } => reason,
            other => panic!("the run must fail, and ended as {other:?} at {}", self.summary.time),
        }
    }

    /// The rows of every body.
    fn tracks(&self) -> BTreeMap<String, Vec<Row>> {
        let mut table = csv::Reader::from_path(self.out().join("bodies.csv")).unwrap();
        let mut tracks: BTreeMap<String, Vec<Row>> = BTreeMap::new();
        for row in table.records().map(Result::unwrap) {
            let numbers = [0, 2, 3, 4].map(|at| row[at].parse().expect("a number"));
            tracks.entry(row[1].to_owned()).or_default().push(numbers);
        }
        tracks
    }

    /// A column of `history.csv`.
    fn column(&self, name: &str) -> Vec<Option<f64>> {
        let mut table = csv::Reader::from_path(self.out().join("history.csv")).unwrap();
        let at = table.headers().unwrap().iter().position(|other| other == name).expect("the column is there");
        table.records().map(|row| row.unwrap()[at].parse().ok()).collect()
    }

    /// Name and tag of every body that has left, as `summary.json` has them.
    fn gone(&self) -> Vec<(String, String)> {
        let summary: serde_json::Value = serde_json::from_slice(&self.bytes("summary.json")).unwrap();
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        let left = summary["left"].as_array().cloned().unwrap_or_default();
        left.iter().map(|gone| (text(&gone["body"]), text(&gone["through"]))).collect()
    }
}

fn attempt(text: &str, folder: &Path, resume: bool) -> Result<Summary, String> {
    let scene = AnyScene::parse(text, &folder.join("scene.toml")).map_err(|error| error.to_string())?;
    let interrupt = AtomicBool::new(false);
    let options = Options { out: folder.join("out"), resume, verbosity: Verbosity::Quiet, interrupt: &interrupt };
    kinds::run(&scene, &options).map_err(|error| error.to_string())
}

fn run(text: &str) -> Left {
    let folder = tempfile::tempdir().unwrap();
    let summary = attempt(text, folder.path(), false).unwrap_or_else(|message| panic!("refused: {message}"));
    Left { folder, summary }
}

/// Runs so many steps, and goes on from there.
fn run_in_parts(text: &str, steps: usize) -> Left {
    let begun = run(&text.replace("\nend = ", &format!("\nmax_steps = {steps}\nend = ")));
    assert!(matches!(begun.summary.ending, Ending::MaxSteps), "{:?}", begun.summary.ending);
    let summary = attempt(text, begun.folder.path(), true).unwrap_or_else(|message| panic!("refused: {message}"));
    Left { summary, ..begun }
}

fn refused(text: &str, parts: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let message = attempt(text, folder.path(), false).expect_err("it must be refused");
    for part in parts.iter().chain(&["hint: "]) {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn disc(name: &str, radius: f64, [x, y]: [f64; 2], more: &str) -> String {
    let shape = format!("shape = {{ disc = {{ radius = {radius:?} }} }}");
    format!("[[body]]\nname = \"{name}\"\n{shape}\nposition = [{x:?}, {y:?}]\n{more}\n")
}

fn outputs(more: &str) -> String {
    format!(
        "[[output]]\nbodies = true\ncontacts = true\nevery = {{ steps = 1 }}\n\
         [[output]]\nmeasures = [\"body\", {{ body = \"second\" }}, \"gap\", \"kinetic_energy\"]\nevery = {{ steps = 1 }}\n\
         {more}"
    )
}

/// A Stokes flow from left to right; `right` is what holds there, and `rest` has the bodies.
fn channel(right: &str, rest: &str, (step, end): (f64, f64), more: &str) -> String {
    format!(
        "[model]\nkind = \"stokes\"\n[mesh]\nshape = \"square\"\nn = 6\n\
         [boundary.left]\nvelocity = {{ dirichlet = [\"4*y*(1-y)\", \"0\"] }}\n\
         [boundary.right]\n{right}\n\
         [boundary.bottom]\nvelocity = {{ dirichlet = [\"0\", \"0\"] }}\n\
         [boundary.top]\nvelocity = {{ dirichlet = [\"0\", \"0\"] }}\n\
         {rest}\n[time]\nstep = {step:?}\nend = {end:?}\n{}",
        outputs(more)
    )
}

const OUTLET: &str = "velocity = \"traction\"";

/// The first of two discs leaves at about t = 0.5, the second at about 1.
fn two(method: &str, end: f64, more: &str) -> String {
    let bodies = disc("first", 0.12, [0.7, 0.52], "") + &disc("second", 0.1, [0.25, 0.45], "");
    channel(OUTLET, &format!("{bodies}[rigid]\nmethod = \"{method}\"\norder = 1\n"), (0.05, end), more)
}

#[test]
fn a_flow_goes_on_around_the_body_that_is_left() {
    for method in METHODS {
        let pictures = "[[output]]\nmaps = [\"speed\", \"bodies\"]\nevery = { steps = 6 }\n[[output]]\nfields = [\"velocity\"]\nevery = { steps = 6 }\n";
        let left = run(&two(method, 0.75, pictures)).ended();
        assert_eq!(left.gone(), [("first".to_owned(), "right".to_owned())], "{method}");
        let tracks = left.tracks();
        let (first, second) = (&tracks["first"], &tracks["second"]);
        assert_eq!(second.len(), 16, "{method}");
        assert!((5..14).contains(&first.len()) && first.last().unwrap()[1] < 1.12, "{method}: {first:?}");
        // the measures of the first body end with it, those of the second go on
        let (of_first, of_second) = (left.column("body_x1"), left.column("body_x1:second"));
        assert!(of_second.iter().all(Option::is_some), "{method}");
        let last = of_first.iter().rposition(Option::is_some).unwrap();
        assert!(of_first[..=last].iter().all(Option::is_some) && last + 2 == first.len(), "{method}: {of_first:?}");
        assert!(left.summary.said.iter().any(|note| note.contains("`first` has left through `right`")), "{method}");
        assert!(left.summary.to_string().contains("`first` has left"), "{method}");
        // one that begins where the second was then goes the same way
        let start = second[first.len()];
        let alone = disc("second", 0.1, [start[1], start[2]], &format!("angle = {:?}", start[3]));
        let rest = format!("{alone}[rigid]\nmethod = \"{method}\"\norder = 1\n");
        let steps = second.len() - first.len() - 1;
        let alone = run(&channel(OUTLET, &rest, (0.05, 0.05 * steps as f64), "")).ended();
        for (row, other) in second[first.len()..].iter().zip(&alone.tracks()["second"]) {
            let apart = (1..4).map(|k| (row[k] - other[k]).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{method}: {row:?} {other:?}");
        }
        // what is read of the folder is the state at its end
        let seen = BodiesAtTime::read(&left.out(), None).unwrap().unwrap();
        assert_eq!((seen.time, seen.solids.bodies.len()), (second[15][0], 1), "{method}");
        assert_eq!(seen.solids.bodies[0].name, "second");
    }
}

#[test]
fn a_flow_goes_on_without_bodies() {
    for method in METHODS {
        let left = run(&two(method, 1.4, "")).ended();
        let gone: Vec<String> = left.gone().into_iter().map(|(body, _)| body).collect();
        assert_eq!(gone, ["first", "second"], "{method}");
        assert_eq!(left.column("time").len(), 28);
        assert_eq!(left.column("kinetic_energy").last(), Some(&None), "{method}");
    }
}

#[test]
fn a_flow_that_is_resumed_after_a_body_has_left_has_the_same_bits() {
    for method in METHODS {
        let scene = two(method, 0.75, "").replace("order = 1", "order = 2");
        let whole = run(&scene).ended();
        let parts = run_in_parts(&scene, 13).ended();
        assert_eq!(parts.gone(), whole.gone());
        for file in ["bodies.csv", "history.csv", "contacts.csv", "checkpoint.bin"] {
            assert!(whole.bytes(file) == parts.bytes(file), "{method}: {file} differs");
        }
    }
}

/// A tissue that streams along a strip, with two discs of which the first leaves at about t = 1.2.
fn tissue(method: &str, end: f64, more: &str) -> String {
    let bodies = disc("first", 0.5, [2.4, 0.1], "") + &disc("second", 0.5, [-1.5, -0.2], "");
    format!(
        "[model]\nkind = \"incompressible\"\nbeta = 0.75\npeclet = 2.0\ncoherence = 0.3\nelasticity = 0.2\n\
         [mesh]\nshape = \"strip\"\nlength = [-3.0, 3.0]\nwidth = 4.0\nh = 1.0\n\
         [boundary.inlet]\nvelocity = {{ dirichlet = [\"1\", \"0\"] }}\npolarity = {{ dirichlet = [\"1\", \"0\"] }}\n\
         [boundary.outlet]\nvelocity = \"traction\"\npolarity = \"neumann\"\n\
         [boundary.walls]\nvelocity = \"slip\"\npolarity = \"neumann\"\n\
         [initial]\npolarity = [\"1\", \"0.2*sin(y)\"]\n{bodies}[rigid]\nmethod = \"{method}\"\n\
         [time]\nscheme = \"bdf2\"\nstep = 0.25\nend = {end:?}\n[coupling]\nkind = \"anderson\"\n{}",
        outputs(more)
    )
}

#[test]
fn a_tissue_goes_on_around_the_body_that_is_left() {
    for method in METHODS {
        let pictures = "[[output]]\nmaps = [\"speed\"]\nevery = { steps = 4 }\n";
        let whole = run(&tissue(method, 1.75, pictures)).ended();
        assert_eq!(whole.gone(), [("first".to_owned(), "outlet".to_owned())], "{method}");
        let tracks = whole.tracks();
        let (first, second) = (&tracks["first"], &tracks["second"]);
        assert_eq!((second.len(), (3..7).contains(&first.len())), (8, true), "{method}: {first:?}");
        // both are carried along
        let way = second[7][1] - second[0][1];
        assert!((way - 1.75).abs() < 0.4, "{method}: {way}");
        let parts = run_in_parts(&tissue(method, 1.75, pictures), 6).ended();
        assert_eq!(parts.gone(), whole.gone());
        for file in ["bodies.csv", "history.csv", "checkpoint.bin"] {
            assert!(whole.bytes(file) == parts.bytes(file), "{method}: {file} differs");
        }
    }
}

#[test]
fn a_tissue_goes_on_without_bodies() {
    for method in METHODS {
        let scene = tissue(method, 2.0, "").replace("[-1.5, -0.2]", "[1.2, 1.3]");
        let left = run(&scene.replace("end = 2.0", "end = 3.0")).ended();
        let mut gone: Vec<String> = left.gone().into_iter().map(|(body, _)| body).collect();
        gone.sort();
        assert_eq!(gone, ["first", "second"], "{method}");
        assert_eq!(left.column("gap").last(), Some(&None), "{method}");
    }
}

#[test]
fn a_wall_keeps_a_body_inside() {
    let body = disc("first", 0.12, [0.6, 0.5], "force = [\"5\", \"0\"]") + &disc("second", 0.05, [0.2, 0.3], "");
    let right = format!("{OUTLET}\nbodies = \"wall\"");
    let left = run(&channel(&right, &body, (0.05, 0.5), "")).ended();
    assert!(left.gone().is_empty());
    let tracks = left.tracks();
    let rightmost = tracks["first"].iter().map(|row| row[1]).fold(0.0, f64::max);
    assert!((0.87..0.88 + 1e-9).contains(&rightmost), "it leans on the wall: {rightmost}");
    // the same as a table of walls says
    let by_table = run(&channel(OUTLET, &format!("{body}[[wall]]\ntag = \"right\"\n"), (0.05, 0.5), "")).ended();
    assert!(left.bytes("bodies.csv") == by_table.bytes("bodies.csv"));
}

/// A held disc that a step takes through the right side at once.
fn jump(right: &str) -> String {
    let held = "motion = { held = { velocity = [\"1\", \"0\"] } }";
    let bodies = disc("second", 0.1, [0.7, 0.5], held) + "[rigid]\norder = 1\n";
    channel(right, &bodies, (0.5, 1.0), "").replace("[\"4*y*(1-y)\", \"0\"]", "[\"0\", \"0\"]")
}

#[test]
fn a_closed_side_lets_bodies_go_only_where_the_scene_says_it() {
    let at_rest = "velocity = { dirichlet = [\"0\", \"0\"] }";
    let left = run(&jump(at_rest));
    for part in ["`second`", "gone out through `right`", "boundary.right.bodies", "hint: "] {
        assert!(left.reason().contains(part), "`{part}` is not in: {}", left.reason());
    }
    assert_eq!((left.gone().len(), left.tracks()["second"].len()), (0, 1));
    let left = run(&jump(&format!("{at_rest}\nbodies = \"leave\""))).ended();
    assert_eq!(left.gone(), [("second".to_owned(), "right".to_owned())]);
    assert_eq!((left.tracks()["second"].len(), left.column("time").len()), (1, 2));
}

#[test]
fn what_a_scene_says_of_bodies_at_its_boundary_is_filled_in() {
    let resolved = |scene: &str| {
        let parsed = AnyScene::parse(scene, Path::new("scene.toml")).unwrap();
        let text = parsed.resolved_toml();
        assert_eq!(AnyScene::parse(&text, Path::new("scene.toml")).unwrap().resolved_toml(), text);
        let value: toml::Value = toml::from_str(&text).unwrap();
        move |tag: &str| value["boundary"][tag].get("bodies").and_then(|said| said.as_str()).map(str::to_owned)
    };
    let said = resolved(&two("nitsche", 0.5, ""));
    assert_eq!(["left", "right", "top"].map(said), [Some("leave".into()), Some("leave".into()), None]);
    let walls = two("nitsche", 0.5, "[[wall]]\ntag = \"right\"\n");
    assert_eq!(resolved(&walls)("right").as_deref(), Some("wall"));
    let said = resolved(&tissue("penalty", 1.0, ""));
    assert_eq!([said("outlet").as_deref(), said("walls").as_deref()], [Some("leave"), None]);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let scene = |right: &str, rest: &str| channel(right, rest, (0.05, 0.5), "");
    let bodies = disc("first", 0.1, [0.7, 0.5], "") + &disc("second", 0.1, [0.3, 0.5], "");
    let said = |what: &str| format!("{OUTLET}\nbodies = {what}");
    for what in ["\"leaves\"", "\"periodic\""] {
        refused(&scene(&said(what), &bodies), &["boundary.right.bodies", "leave", "wall"]);
    }
    let both = format!("{bodies}[[wall]]\ntag = \"right\"\n");
    refused(
        &scene(&said("\"leave\""), &both),
        &["boundary.right.bodies", "\"leave\"", "`wall.0.tag` keeps bodies inside"],
    );
    let alone = scene(&said("\"leave\""), "");
    let alone = &alone[..alone.find("[[output]]").unwrap()];
    refused(alone, &["boundary.right.bodies", "no body"]);
    let squeezed = include_str!("data/compressible.toml");
    let squeezed = squeezed.replace("polarity = \"neumann\"\n\n", "polarity = \"neumann\"\nbodies = \"leave\"\n\n");
    refused(&squeezed, &["boundary.walls.bodies", "no rigid bodies"]);
    let outside = disc("first", 0.1, [1.3, 0.5], "motion = { held = { velocity = [\"-1\", \"0\"] } }")
        + &disc("second", 0.1, [0.3, 0.5], "");
    refused(&scene(OUTLET, &outside), &["`first`", "wholly outside", "do not enter"]);
    let overlaps = disc("first", 0.1, [0.95, 0.5], "") + &disc("second", 0.1, [0.3, 0.5], "");
    refused(&scene(&said("\"wall\""), &overlaps), &["`first`", "the wall `boundary.right`"]);
    let round = "[model]\nkind = \"stokes\"\nfriction = 1.0\n[mesh]\nshape = \"disc\"\nradius = 1.0\nh = 0.5\n\
                 [boundary.wall]\nvelocity = \"slip\"\nbodies = \"wall\"\n";
    let curved =
        format!("{round}{}[time]\nstep = 0.1\nend = 0.2\n", disc("first", 0.2, [0.0, 0.0], "force = [\"1\", \"0\"]"));
    refused(&curved, &["boundary.wall.bodies", "curved", "hollow"]);
}

#[test]
fn halved_steps_are_counted_in_the_history_and_in_the_summary() {
    let pulled = |by: f64| format!("force = [\"-{by}*(x-0.5)\", \"0\"]");
    let flow = disc("first", 0.12, [0.6, 0.5], &pulled(400.0)) + &disc("second", 0.05, [0.2, 0.3], "");
    let flow = channel(OUTLET, &flow, (0.1, 0.2), "");
    let tissue = tissue("nitsche", 0.5, "")
        .replace("position = [2.4, 0.1]\n", &format!("position = [0.6, 0.1]\n{}", pulled(100.0)));
    for scene in [flow, tissue] {
        let left = run(&scene).ended();
        let halved: f64 = left.column("rejected").into_iter().map(|count| count.expect("a number")).sum();
        assert!(halved > 0.0 && halved == left.summary.counts.rejected as f64, "{halved} {:?}", left.summary.counts);
    }
}

#[test]
fn contact_goes_on_between_those_that_are_left() {
    // below the second one a third, which pushes against it and sticks
    let third = disc("third", 0.08, [0.25, 0.25], "force = [\"0\", \"4\"]");
    let scene = two("nitsche", 0.65, "").replace("[rigid]", &format!("{third}[contact]\nlaw = \"gluey\"\n[rigid]"));
    let whole = run(&scene).ended();
    assert_eq!(whole.gone(), [("first".to_owned(), "right".to_owned())]);
    let left_at = whole.summary.bodies.as_ref().unwrap().left[0].time;
    let mut table = csv::Reader::from_path(whole.out().join("contacts.csv")).unwrap();
    let mut touching = 0;
    for row in table.records().map(Result::unwrap) {
        let [time, gap, force] = [0, 3, 4].map(|at| row[at].parse::<f64>().expect("a number"));
        if time >= left_at {
            assert_eq!([&row[1], &row[2]], ["second", "third"], "{row:?}");
            assert!(gap > -1e-9, "{row:?}");
            touching += usize::from(force != 0.0);
        }
    }
    assert!(touching > 0, "the third one presses");
    let parts = run_in_parts(&scene, whole.column("time").len() - 2).ended();
    for file in ["bodies.csv", "history.csv", "contacts.csv", "checkpoint.bin"] {
        assert!(whole.bytes(file) == parts.bytes(file), "{file} differs");
    }
}
