//! Curves: which pictures there are, what they show, and what is said of wishes that cannot be met.

use monolayer::output::plot::Plot;
use monolayer::results::curves::{CurveSettings, curves};
use monolayer::results::{Drawn, Image, PlotKind, Results, Table, labels, plots};

use crate::common::{copy_of, fails, files, results, succeeds};

fn read(name: &str) -> Results {
    Results::read(&results().join(name)).unwrap()
}

/// The curves of the picture of this name.
fn plot<'d>(drawn: &'d Drawn, name: &str) -> &'d Plot {
    drawn.pictures.iter().find(|picture| picture.name == name).and_then(|picture| picture.image.curves()).expect(name)
}

#[test]
fn a_run_leaves_the_curves_of_what_it_measured() {
    let names = files(results().join("one/plots"));
    let mut expected: Vec<String> = ["asymmetry", "energy", "lissajous", "residual"].map(String::from).to_vec();
    for way in ["x1", "x2"] {
        expected.extend(["polarity-1", "pressure", "velocity-1"].map(|q| format!("sections-along-{way}-{q}")));
    }
    let mut expected: Vec<String> = expected.iter().flat_map(|n| [format!("{n}.png"), format!("{n}.svg")]).collect();
    expected.sort();
    assert_eq!(names, expected);
    let svg = std::fs::read_to_string(results().join("one/plots/lissajous.svg")).unwrap();
    assert!(svg.contains("t = 0.25") && svg.contains("t = 1.5"), "times beside the curve");
    assert!(svg.contains("Pe = 2") && svg.contains("dimensionless"));
}

#[test]
fn a_run_without_measures_and_cuts_draws_nothing() {
    let at = results();
    succeeds(at, &["-q", "run", "strip.toml", "--set", "output=[]", "--set", "time.end=0.25", "--out", "bare"]);
    assert!(!at.join("bare/plots").exists());
    let said = fails(at, &["plot", "bare"]);
    assert!(said.contains("bare: nothing to draw; hint: curves need measures"), "{said}");
}

#[test]
fn sections_stop_at_the_disc() {
    let one = read("one");
    let wish = CurveSettings { what: vec![&plots::SECTIONS], ..CurveSettings::default() };
    let drawn = curves(&[&one], &wish).unwrap();
    let plot = plot(&drawn, "sections-along-x1-velocity-1");
    // axis 1 goes through the disc, axis 2a passes it
    assert_eq!(plot.series.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().len(), 3);
    let ends: Vec<f64> =
        plot.series[..2].iter().flat_map(|s| [s.points[0].0, s.points[s.points.len() - 1].0]).collect();
    assert!((ends[1] + 1.0).abs() < 0.02 && (ends[2] - 1.0).abs() < 0.02, "{ends:?}");
    assert_eq!(plot.series[0].colour, plot.series[1].colour);
    let inlet = plot.series[0].points[0];
    assert!((inlet.0 + 4.0).abs() < 1e-9 && (inlet.1 - 1.0).abs() < 1e-6, "{inlet:?}");
    assert_eq!(plot.x.label, "x₁ (disc radii)");
}

#[test]
fn legends_say_what_differs() {
    let (one, two) = (read("one"), read("two"));
    let both = [&one, &two];
    assert_eq!(labels(&both, &[]), ["Pe = 2", "Pe = 0.5"]);
    assert_eq!(labels(&both, &["mine".to_owned()]), ["mine", "Pe = 0.5"]);
    let drawn =
        curves(&both, &CurveSettings { quantities: vec!["speed".to_owned()], ..CurveSettings::default() }).unwrap();
    let section = plot(&drawn, "section-axis-3-speed");
    assert_eq!(section.title, "|v| on axis 3 (x₁ = 0)");
    assert!(section.subtitle.contains("β = 0.75") && !section.subtitle.contains("Pe"));
    assert!(!section.subtitle.contains("T_a"), "the traction is the friction");
    // below and above the disc, of two runs
    assert_eq!(section.series.len(), 4);
}

#[test]
fn the_table_of_a_study_is_drawn_over_what_it_varies() {
    let sweep = read("sweep");
    let drawn = curves(&[&sweep], &CurveSettings { what: vec![&plots::STUDY], ..CurveSettings::default() }).unwrap();
    let energy = plot(&drawn, "study-free-energy");
    assert_eq!(energy.x.label, "Pe");
    assert_eq!(energy.series.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["κ = 0.5", "κ = 1"]);
    assert_eq!(energy.series[0].points.iter().map(|p| p.0).collect::<Vec<_>>(), [0.5, 2.0, 10.0], "in order");
}

#[test]
fn the_command_draws_several_runs_and_windows() {
    let at = results();
    let options = ["--what", "sections", "--axis", "axis-3", "--quantity", "velocity_1", "--window", "-2,2"];
    let mut arguments = vec!["plot", "one", "two", "--out", "compared"];
    arguments.extend(options);
    let said = succeeds(at, &arguments);
    assert!(said.contains("written compared/section-axis-3-velocity-1.svg and .png"), "{said}");
    assert_eq!(files(at.join("compared")), ["section-axis-3-velocity-1.png", "section-axis-3-velocity-1.svg"]);
}

#[test]
fn a_kymograph_has_the_cuts_of_all_times() {
    let at = results();
    let every = ["--set", "output.1.every={ steps = 1 }", "--out", "course"];
    succeeds(at, &[&["-q", "run", "strip.toml"][..], &every].concat());
    let (one, course) = (read("one"), read("course"));
    let wish = CurveSettings { what: vec![PlotKind::named("kymograph").unwrap()], ..CurveSettings::default() };
    let drawn = curves(&[&course], &wish).unwrap();
    let picture = drawn.pictures.iter().find(|picture| picture.name == "kymograph-axis-1-velocity-1").unwrap();
    let Image::Colours(grid) = &picture.image else { panic!("no colours") };
    assert_eq!(grid.y, [0.25, 0.5, 0.75, 1.0, 1.25, 1.5]);
    assert_eq!((grid.axes[0].as_str(), grid.axes[1].as_str()), ("x₁ (disc radii)", "time t (dimensionless)"));
    for step in [1, 4, 6] {
        let file = course.path.join(format!("cuts/axis-1-step-{step:06}.csv"));
        let table = Table::read(&file).unwrap();
        for (x, v) in table.points("x1", "v1").into_iter().step_by(97) {
            let there = grid.at(x, grid.y[step - 1]).unwrap_or_else(|| panic!("nothing at {x}"));
            assert!((there - v).abs() < 1e-12, "{there} in the picture at {x}, {v} in the table");
        }
    }
    assert_eq!(grid.at(0.0, 0.8), None, "in the disc");
    let between = grid.at(3.0, 0.625).unwrap();
    let around = [0.5, 0.75].map(|t| grid.at(3.0, t).unwrap());
    assert!((between - (around[0] + around[1]) / 2.0).abs() < 1e-12);
    // of two runs each has its own; a run without cuts on the way has none
    let drawn =
        curves(&[&course, &one], &CurveSettings { quantities: vec!["speed".to_owned()], ..wish.clone() }).unwrap();
    let names: Vec<&str> = drawn.pictures.iter().map(|picture| picture.name.as_str()).collect();
    let cuts = ["axis-1", "axis-2a", "axis-3", "axis-4"];
    assert_eq!(names, cuts.map(|cut| format!("kymograph-{cut}-speed-course")));
    let said = fails(at, &["plot", "one", "--what", "kymograph"]);
    assert!(said.contains("`--what kymograph`") && said.contains("`cuts` with `every`"), "{said}");
    succeeds(at, &["plot", "course", "--what", "kymograph", "--axis", "axis-3", "--out", "colours"]);
    let pictures = ["polarity-1", "pressure", "velocity-1"].map(|q| format!("kymograph-axis-3-{q}"));
    assert_eq!(files(at.join("colours")), pictures.map(|name| [format!("{name}.png"), format!("{name}.svg")]).concat());
}

#[test]
fn a_folder_of_sections_alone_is_drawn_with_a_run() {
    let measured = tempfile::tempdir().unwrap();
    let folder = measured.path().join("measured");
    std::fs::create_dir_all(folder.join("cuts")).unwrap();
    std::fs::write(folder.join("cuts/axis-3.csv"), "s,x1,x2,v1,v2\n0,0,-3,1,0\n1,0,-2,1.2,0\n2,0,-1,1.1,0\n").unwrap();
    let measured = Results::read(&folder).unwrap();
    assert!(measured.problems.is_empty(), "{:?}", measured.problems);
    let one = read("one");
    let drawn = curves(&[&one, &measured], &CurveSettings { what: vec![&plots::SECTIONS], ..CurveSettings::default() })
        .unwrap();
    let last = plot(&drawn, "section-axis-3-velocity-1").series.last().unwrap();
    assert_eq!((last.name.as_str(), last.points.len()), ("measured", 3));
}

#[test]
fn a_run_that_was_cut_off_is_drawn_as_far_as_it_came() {
    let copy = copy_of(&results().join("one"));
    let at = |name: &str| copy.path().join(name);
    std::fs::remove_file(at("summary.json")).unwrap();
    std::fs::rename(at("cuts/axis-1.csv"), at("cuts/axis-1-step-000003.csv")).unwrap();
    let history = std::fs::read_to_string(at("history.csv")).unwrap();
    std::fs::write(at("history.csv"), &history[..history.len() - 40]).unwrap();
    let run = Results::read(copy.path()).unwrap();
    let told = run.problems.join("\n");
    assert!(told.contains("the run has not ended") && told.contains("so far 5 steps, up to t = 1.25"), "{told}");
    assert!(told.contains("--resume") && told.contains("the last row of history.csv was cut off"), "{told}");
    let drawn = curves(&[&run], &CurveSettings::default()).unwrap();
    assert!(drawn.pictures.iter().any(|p| p.name == "energy"));
    assert!(drawn.notes.iter().any(|n| n.contains("axis-1 is that of step 3")), "{:?}", drawn.notes);
}

#[test]
fn wrong_wishes_are_explained() {
    let at = results();
    std::fs::create_dir_all(at.join("empty")).unwrap();
    let cases: [(&[&str], &[&str]); 10] = [
        (&["plot", "nowhere"], &["nowhere: there is no such folder; hint: name the folder"]),
        (&["plot", "strip.toml"], &["this is a file, not a folder"]),
        (&["plot", "empty"], &["empty: is empty; hint:"]),
        (
            &["plot", "one", "--what", "heat"],
            &["`--what heat`: there are no such curves; hint: the kinds are energy, lissajous"],
        ),
        (&["plot", "one", "--what", "budget"], &["`--what budget`: there is nothing to draw", "`energy_budget`"]),
        (&["plot", "one", "--axis", "axis-9"], &["`--axis axis-9`", "the cuts are axis-1, axis-2a, axis-3, axis-4"]),
        (
            &["plot", "one", "--quantity", "heat"],
            &["`--quantity heat`", "velocity_1", "columns laplacian1, laplacian2, p1, p2, pressure"],
        ),
        (&["plot", "orders"], &["orders: nothing to draw; hint: the study has drawn its picture itself"]),
        (&["plot", "one", "--window", "2"], &["`--window 2`: must be two numbers"]),
        (&["plot", "one", "--label", "a", "--label", "b"], &["`--label b`: there are 2 labels for 1 runs"]),
    ];
    for (arguments, expected) in cases {
        let said = fails(at, arguments);
        expected.iter().for_each(|part| assert!(said.contains(part), "{arguments:?}: {said}"));
    }
    let said = fails(at, &["report", "one", "--out", "one"]);
    assert!(said.contains("one: is a folder; hint: name the file"), "{said}");
}
