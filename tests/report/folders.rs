//! Folders of every kind: what the page shows of them, and what is said of those that hold no results.

use std::path::Path;

use crate::common::{copy_of, fails, files, results, succeeds};

/// A folder `cmp` in which a table made from the run `one` was compared with it.
fn comparison() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    let at = root.path();
    let run = results().join("one");
    let run = run.to_str().unwrap();
    let draw = ["--cells", "150", "--frames", "5", "--noise", "0.1", "--seed", "3", "--out", "t.csv"];
    succeeds(at, &[&["compare", "--synthesize", run][..], &draw].concat());
    let table = std::fs::read_to_string(at.join("t.csv")).unwrap();
    std::fs::write(at.join("t.csv"), table + "NaN,0,1,0,0\n").unwrap();
    let keys = format!(
        "title = \"cells & run\"\ndata = \"t.csv\"\nrun = '{run}'\nbox = [[-4, -3], [6, 3]]\nbins = [14, 10]\n\
         window = 2.0\n"
    );
    std::fs::write(at.join("c.toml"), keys).unwrap();
    let said = succeeds(at, &["compare", "c.toml", "--out", "cmp"]);
    assert!(said.contains("note: 1 of 751 rows lack a position, time or velocity"), "{said}");
    root
}

#[test]
fn a_comparison_is_shown_with_its_numbers_and_pictures() {
    let root = comparison();
    succeeds(root.path(), &["report", "cmp"]);
    let page = std::fs::read_to_string(root.path().join("cmp/report.html")).unwrap();
    for part in [
        "cells &amp; run",
        "A comparison with measured velocities",
        "from the run (root mean square, relative)",
        "Their own scatter makes",
        "standard error",
        "correlation v1",
        "flux minus",
        "1 of 751 rows lack",
        "bins with cells",
        "14 × 10",
        "alt=\"cells &amp; run: measured\"",
        "alt=\"cells &amp; run: data less run\"",
        "Settings (study.toml)",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for wrong in ["no run has ended", "not ended", "A study"] {
        assert!(!page.contains(wrong), "{wrong}");
    }
    let axes = files(root.path().join("cmp/plots")).iter().filter(|name| name.ends_with(".svg")).count();
    assert!(axes > 4 && page.matches("<img").count() == axes, "all pictures");
    // the number of the summary is the one on the page
    let summary = std::fs::read_to_string(root.path().join("cmp/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let relative = summary["measures"]["relative"]["value"].as_f64().unwrap();
    assert!(page.contains(&format!("{relative:.4}")[..5]), "{relative}");

    // sections beside those of a run
    let run = results().join("one");
    succeeds(root.path(), &["plot", "cmp", run.to_str().unwrap(), "--axis", "axis-1", "--out", "both"]);
    assert!(!files(root.path().join("both")).is_empty());
    // one that was stopped before it found anything
    std::fs::remove_file(root.path().join("cmp/comparison.csv")).unwrap();
    std::fs::remove_file(root.path().join("cmp/summary.json")).unwrap();
    let said = succeeds(root.path(), &["report", "cmp"]);
    assert!(said.contains("comparison.csv is missing"), "{said}");
}

#[test]
fn a_page_with_many_pictures_stays_small() {
    let copy = copy_of(&results().join("one"));
    let plots = copy.path().join("plots");
    std::fs::create_dir(&plots).unwrap();
    let svg = |title: &str| {
        let filling = "x".repeat(400_000);
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\"><title>{title}</title><!--{filling}--></svg>")
    };
    for k in 0..20 {
        std::fs::write(plots.join(format!("speed-{k:06}.svg")), svg(&format!("speed {k}"))).unwrap();
        std::fs::write(plots.join(format!("other{k:02}.svg")), svg(&format!("other {k}"))).unwrap();
    }
    let said = succeeds(copy.path(), &["report", "."]);
    let page = std::fs::read_to_string(copy.path().join("report.html")).unwrap();
    assert!(page.len() < 6_500_000, "{} bytes", page.len());
    assert!(page.matches("<img").count() >= 10);
    for part in [
        "of the pictures speed-NNNNNN the last one is shown; 19 more are in ./plots",
        "pictures are left out, for a page has at most 6 MB of them; in .: plots/other",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(said.contains("written ./report.html"), "{said}");
}

#[test]
fn folders_without_results_are_told_apart() {
    let root = tempfile::tempdir().unwrap();
    let at = root.path();
    std::fs::create_dir(at.join("nothing")).unwrap();
    std::fs::create_dir(at.join("foreign")).unwrap();
    std::fs::write(at.join("foreign/letter.txt"), "dear all").unwrap();
    let scene = results().join("strip.toml");
    succeeds(at, &["mesh", scene.to_str().unwrap(), "--out", "meshes"]);
    let all = results().to_str().unwrap();
    for command in ["report", "plot"] {
        let said = |folder: &str, parts: &[&str]| {
            let error = fails(at, &[command, folder]);
            parts.iter().chain(&["hint"]).for_each(|part| assert!(error.contains(part), "`{part}` is not in {error}"));
        };
        said("nothing", &["nothing: is empty", "monolayer run"]);
        said("foreign", &["foreign: holds no results", "comparison.csv"]);
        said("meshes", &["holds a mesh, and no results", "ParaView"]);
        said(all, &["holds no results itself", "folders of results in it"]);
        said("nowhere", &["there is no such folder"]);
        said("foreign/letter.txt", &["this is a file"]);
    }
    assert!(!Path::new(all).join("report.html").exists());
}
