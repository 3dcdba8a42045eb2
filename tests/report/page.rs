//! The page as a text: what must be on it, and what must not.

use monolayer::report::page;
use monolayer::results::Results;

use crate::common::{copy_of, results, succeeds};

fn page_of(names: &[&str]) -> String {
    page(&names.iter().map(|name| Results::read(&results().join(name)).unwrap()).collect::<Vec<_>>())
}

/// Every value of an attribute.
pub fn values<'a>(html: &'a str, attribute: &str) -> Vec<&'a str> {
    let opening = format!(" {attribute}=\"");
    html.split(opening.as_str()).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn nothing_is_loaded_and_nothing_in_a_title_runs() {
    let html = page_of(&["one", "two", "sweep", "orders"]);
    assert!(html.contains("&lt;script&gt;document.title"));
    assert_eq!(html.matches("<script").count(), 1, "the page's own script alone");
    assert!(values(&html, "src").iter().all(|uri| uri.starts_with("data:image/")));
    assert!(values(&html, "href").iter().all(|target| target.starts_with('#')));
    for outside in ["http://", "https://", "@import", "url(", "<link", "<iframe", "<object"] {
        assert!(!html.contains(outside), "{outside}");
    }
    let alts = values(&html, "alt");
    assert_eq!(alts.len(), html.matches("<img").count());
    assert!(alts.iter().all(|alt| !alt.trim().is_empty()));
    assert_eq!(html.matches("<th").count() - html.matches("<thead").count(), html.matches(" scope=\"").count());
}

#[test]
fn a_run_says_what_was_solved_found_and_spent() {
    let html = page_of(&["one"]);
    for part in [
        "finished",
        "The end time was reached at t = 1.5 after 6 steps",
        "An incompressible sheet",
        "asymmetry of v between the two sides",
        "free energy rate",
        "relaxation time of the polarity",
        "dirichlet (1, 0)",
        "strip-with-disc",
        "aligned-around-disc",
        "peak memory (MiB)",
        "seconds in all",
        "alt=\"Free energy and its rate\"",
        "<details><summary>Settings (scene.toml)",
    ] {
        assert!(html.contains(part), "{part}");
    }
    let pictures = html.matches("<img").count();
    assert_eq!(pictures, 10, "one of each SVG and PNG");
}

#[test]
fn a_study_names_what_failed_first() {
    let html = page_of(&["sweep"]);
    let failure = html.find("Failed").expect("the refused case is named");
    assert!(failure < html.find("What was found").unwrap() && html[failure..].contains("h_disc"));
    assert!(html.contains("6 of 7 runs finished"));
    // what runs are is the same in the table of the page and in that of the study
    let table = std::fs::read_to_string(results().join("sweep/results.csv")).unwrap();
    let first = html.split("<tbody>").nth(1).unwrap().split("</tbody>").next().unwrap();
    assert_eq!(first.matches("<tr").count(), table.lines().count() - 1);
    let orders = page_of(&["orders"]);
    assert!(orders.contains("2 of 2 levels finished") && orders.contains("Errors and observed orders"));
    assert_eq!(orders.matches("<img").count(), 1);
}

#[test]
fn estimates_and_notes_of_a_summary_are_shown() {
    let copy = copy_of(&results().join("one"));
    let path = copy.path().join("summary.json");
    let mut summary: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    summary["estimates"] = serde_json::json!({ "free_energy": 0.0125, "asymmetry_velocity": { "error": 3.5e-5 } });
    summary["said"] = serde_json::json!(["note: look <here>"]);
    std::fs::write(&path, summary.to_string()).unwrap();
    let html = page(&[Results::read(copy.path()).unwrap()]);
    for part in ["estimated error", "± 0.0125", "± 3.5e−5", "look &lt;here&gt;"] {
        assert!(html.contains(part), "{part}");
    }
    // the copy has no pictures: the page draws them
    assert_eq!(html.matches("<img").count(), 10);
}

#[test]
fn broken_files_are_named_and_the_rest_is_shown() {
    let copy = copy_of(&results().join("one"));
    let at = |name: &str| copy.path().join(name);
    std::fs::write(at("summary.json"), "{\"status\": \"fini").unwrap();
    std::fs::write(at("scene.toml"), "title = ").unwrap();
    std::fs::write(at("cuts/axis-1.csv"), "").unwrap();
    std::fs::create_dir(at("plots")).unwrap();
    std::fs::write(at("plots/cut-off.svg"), "<svg xmlns=\"http://www.w3.org/2000/svg\"><g>").unwrap();
    std::fs::write(at("plots/cut-off.png"), b"\x89PNG\r\n\x1a\n").unwrap();
    let html = page(&[Results::read(copy.path()).unwrap()]);
    for part in
        ["summary.json cannot be read", "scene.toml is not TOML", "cut-off.svg is left out", "axis-1.csv", "not ended"]
    {
        assert!(html.contains(part), "{part}");
    }
    assert!(html.contains("alt=\"Free energy\""), "the history is whole");
    let said = succeeds(copy.path(), &["report", "."]);
    assert!(said.contains("note: .: summary.json cannot be read") && said.contains("written ./report.html"), "{said}");
}
