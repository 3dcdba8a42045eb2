//! Scenes on files of Gmsh: hostile tags, notes, cuts and parts reach `check` and a run.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::{self, Ending, Options};
use monolayer::scene::{Scene, SceneSource};

use super::sample::{Form, Sample, Version};

static NEVER: AtomicBool = AtomicBool::new(false);

const HOSTILE: [&str; 3] = ["a.b", "my <wall> & 'x'", "back\\slash = [#1]"];

/// A closed tissue on a file, whose tags get slip walls.
fn scene_text(tags: &[&str]) -> String {
    let mut text = r#"
[model]
kind = "incompressible"
friction = 1.0
peclet = 1.0
coherence = 0.5
elasticity = 0.2
[mesh]
file = "mesh.msh"
[initial]
polarity = ["1 + 0.2*y", "0.3*x"]
[time]
scheme = "bdf2"
step = 0.1
end = 0.2
[[output]]
fields = ["velocity", "pressure", "stream-function"]
every = { time = 0.1 }
[[output]]
maps = [{ of = "speed" }]
every = { time = 0.1 }
[[output]]
measures = ["free_energy"]
every = { steps = 1 }
"#
    .to_owned();
    for tag in tags {
        let key = monolayer::scene::path::quoted(tag);
        text += &format!("[boundary.{key}]\nvelocity = \"slip\"\npolarity = \"neumann\"\n");
    }
    text
}

fn prepare(sample: &Sample, tags: &[&str]) -> (tempfile::TempDir, SceneSource) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.msh"), sample.bytes(Version::FourOne, Form::Little)).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene_text(tags)).unwrap();
    (folder, SceneSource::read(&path).unwrap())
}

fn hostile() -> Sample {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.names = (1..4).zip(HOSTILE).map(|(group, name)| (1, group, name)).collect();
    sample
}

fn run_in(folder: &Path, scene: &Scene) -> run::Summary {
    let out = folder.join("out");
    let options = Options { out, resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    run::run(scene, &options).unwrap()
}

#[test]
fn hostile_tags_run_and_leave_files_that_can_be_read() {
    let (folder, mut source) = prepare(&hostile(), &HOSTILE);
    source.set("boundary.\"a.b\".polarity", "{ dirichlet = [1, 0] }").unwrap();
    source.set("boundary.'back\\slash = [#1]'.velocity", "slip").unwrap();
    let scene = Scene::check(source).unwrap();
    let report = run::report::report(&scene).unwrap();
    assert!(
        report.remarks.iter().any(|note| note.contains("mesh file: not used of the file: 2 point elements")),
        "{report}"
    );
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["mesh"]["tags"][1][0], HOSTILE[1]);
    let summary = run_in(folder.path(), &scene);
    assert_eq!(summary.ending, Ending::EndTime);
    let out = folder.path().join("out");
    let told = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(told.contains("mesh file: not used of the file: 2 point elements"), "{told}");
    let again = Scene::read(&out.join("scene.toml")).unwrap();
    assert_eq!(again.boundary, scene.boundary);
    let page = monolayer::report::page(&[monolayer::results::Results::read(&out).unwrap()]);
    assert!(page.contains("my &lt;wall&gt; &amp; 'x'") && !page.contains("<wall>"));
}

#[test]
fn hints_about_hostile_tags_are_toml() {
    let (_folder, source) = prepare(&hostile(), &HOSTILE[..2]);
    let text = run::report::report(&Scene::check(source).unwrap()).unwrap_err().to_string();
    let table = "[boundary.\"back\\\\slash = [#1]\"]";
    assert!(text.contains(&format!("add {table}")), "{text}");
    assert!(table.parse::<toml::Table>().is_ok());

    // a tag that is not there is no new part of the boundary
    let (_folder, mut source) = prepare(&hostile(), &HOSTILE);
    source.set("boundary.\"a.c\"", "{ velocity = \"traction\", polarity = \"neumann\" }").unwrap();
    let text = run::report::report(&Scene::check(source).unwrap()).unwrap_err().to_string();
    let words = ["[boundary.\"a.c\"] names no part", "did you mean `\"a.b\"`?", "\"my <wall> & 'x'\""];
    words.iter().for_each(|word| assert!(text.contains(word), "{word}: {text}"));
}

/// Two halves that share no nodes are refused, or flow each for itself with `mesh.slits`.
#[test]
fn a_cut_in_a_file_is_refused_and_may_be_kept_by_the_scene() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.nodes.extend([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    for (_, nodes) in &mut sample.triangles[2..] {
        nodes.iter_mut().for_each(|n| {
            *n = if *n == 2 {
                7
            } else if *n == 5 {
                8
            } else {
                *n
            }
        });
    }
    sample.lines[1].1[0] = 7;
    sample.lines[3].1[1] = 8;
    let (folder, mut source) = prepare(&sample, &["in let", "outlet", "walls", "boundary"]);
    let scene = Scene::check(source.clone()).unwrap();
    let text = run::report::report(&scene).unwrap_err().to_string();
    assert!(text.contains("cut through") && text.contains("mesh.msh") && text.contains("mesh.slits"), "{text}");
    source.set("mesh.slits", "true").unwrap();
    let scene = Scene::check(source).unwrap();
    let report = run::report::report(&scene).unwrap();
    let run::report::MeshReport::Built(mesh) = &report.mesh else { panic!("a mesh of a file is read") };
    assert_eq!((mesh.parts, mesh.coincident_vertices), (2, 2));
    let said = report.to_string();
    assert!(
        said.contains("2 parts that share no faces") && said.contains("2 boundary vertices lie on others"),
        "{said}"
    );
    let summary = run_in(folder.path(), &scene);
    assert_eq!(summary.ending, Ending::EndTime);
}
