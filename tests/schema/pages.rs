//! The tables of keys on the pages are those of the code. `MONOLAYER_DOCS=write cargo test --test schema` writes them.

use std::collections::BTreeMap;

use monolayer::measure::OutputField;
use monolayer::measure::fields::{self, Scalar};
use monolayer::measure::list::ALL;
use monolayer::mesh::generate::{key_rows, shape_rows};
use monolayer::model::boundary::{POLARITY, VELOCITY, rows as conditions};
use monolayer::model::terms::factor;
use monolayer::results::PlotKind;
use monolayer::results::plots::{self, When};
use monolayer::schema::{FileKind, choices, row, rows};
use monolayer::{scene, study};
use serde_json::Value;

use super::root;

const KEYS: &str = "| key | meaning | values | default |";
const CHOICES: &str = "| value | meaning |";

/// What is said of a kind of scene or study.
fn said(kinds: &[FileKind], kind: &str) -> Value {
    (FileKind::named(kind, kinds).unwrap().said)()
}

fn table(header: &str, rows: Vec<String>) -> String {
    assert!(!rows.is_empty(), "{header}");
    let columns = header.matches('|').count() - 1;
    format!("{header}\n|{}\n{}\n", " --- |".repeat(columns), rows.join("\n"))
}

/// Every table by its name.
fn tables() -> BTreeMap<&'static str, String> {
    let tissue = said(&scene::schema::kinds(), "incompressible");
    let stokes = said(&scene::schema::kinds(), "stokes");
    let advection = said(&scene::schema::kinds(), "advection");
    let particles = said(&scene::schema::kinds(), "particles");
    let at = |value: &Value, path: &str| value.pointer(path).unwrap_or_else(|| panic!("no {path}")).clone();
    let keys = |value: &Value, path: &str| table(KEYS, rows(&at(value, path)));
    let values = |value: &Value, path: &str| table(CHOICES, choices(&at(value, path)));
    let study = |kind: &str| table(KEYS, rows(&said(&study::schema::KINDS, kind)));
    let mut all = BTreeMap::new();
    all.insert("model", keys(&tissue, "/properties/model"));
    let factors =
        factor::all().map(|(factor, _)| format!("| `{}` | {} | `{}` |", factor.key, factor.help, factor.symbol));
    all.insert("terms", table("| key | meaning | symbol |", factors.collect()));
    all.insert("shapes of meshes", table("| `shape` | domain | must have | may have | boundary tags |", shape_rows()));
    all.insert("mesh", table(KEYS, key_rows()));
    all.insert("space", keys(&tissue, "/properties/space"));
    let both = [conditions("velocity", &VELOCITY), conditions("polarity", &POLARITY)].concat();
    all.insert("conditions", table("| key | value | condition |", both));
    all.insert("start", values(&tissue, "/properties/initial/properties/polarity"));
    all.insert("source", keys(&tissue, "/properties/source"));
    all.insert("exact", keys(&tissue, "/properties/exact"));
    for name in ["time", "steady", "coupling", "strain"] {
        all.insert(name, keys(&tissue, &format!("/properties/{name}")));
    }
    let output = "/properties/output/items";
    all.insert("output", keys(&tissue, output));
    let code = |names: &[&str]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let field = |field: &&OutputField| {
        let usual = if fields::IN_CUTS.contains(field) { "usual: " } else { "" };
        let (symbol, columns) = (field.symbol.to_string(), code(field.columns));
        format!("| `{}` | {symbol} | {} | {} | {usual}{columns} |", field.name, field.help, field.subject())
    };
    let header = "| field | symbol | what it is | of | columns of cuts |";
    all.insert("fields", table(header, fields::ALL.iter().map(field).collect()));
    let quantity = |scalar: Scalar| {
        let colours = if scalar.part.signed { "blue below zero, red above" } else { "from dark to light" };
        let symbol = scalar.part.symbol.to_string().replace('|', "\\|");
        format!("| `{}` | {symbol} | `{}` | {colours} |", scalar.part.name, scalar.field.name)
    };
    all.insert(
        "quantities",
        table("| quantity | shows | of the field | colours |", Scalar::all().map(quantity).collect()),
    );
    let section = at(&tissue, &format!("{output}/properties/cuts/items/anyOf/1"));
    all.insert("sections", table(KEYS, rows(&section)));
    let measure = |measure: &&monolayer::measure::Measure| {
        let tag = if measure.is_on_a_tag() { ":TAG" } else { "" };
        let columns: Vec<String> = measure.column_names().map(|name| format!("`{name}{tag}`")).collect();
        format!("| `{}` | {} | {} | {} |", measure.name, measure.help, measure.subject(), columns.join(", "))
    };
    let measures = ALL.iter().map(measure).collect();
    all.insert("measures", table("| measure | what it is | of | columns |", measures));
    let map = at(&tissue, &format!("{output}/properties/maps/items/anyOf/1"));
    all.insert("map", table(KEYS, rows(&map)));
    let plot = |kind: &&PlotKind| {
        let usual = if kind.when == When::Named { "no" } else { "yes" };
        format!("| `{}` | {} | {usual} | {} |", kind.name, kind.help, kind.needs)
    };
    all.insert("plots", table("| `--what` | shows | unasked | needs |", plots::ALL.iter().map(plot).collect()));
    for (name, path) in
        [("body", "body/items"), ("bodies", "bodies/items"), ("wall", "wall/items"), ("contact", "contact")]
    {
        all.insert(name, keys(&particles, &format!("/properties/{path}")));
    }
    all.insert("shapes of bodies", values(&particles, "/properties/body/items/properties/shape"));
    all.insert("motions", values(&particles, "/properties/body/items/properties/motion"));
    all.insert("rigid", keys(&stokes, "/properties/rigid"));
    all.insert("model of stokes", keys(&stokes, "/properties/model"));
    all.insert("time of motion", keys(&particles, "/properties/time"));
    let meets = at(&stokes, "/properties/boundary/additionalProperties/properties/bodies");
    all.insert("boundary of bodies", table(KEYS, vec![row("bodies", &meets, false, None)]));
    all.insert("model of particles", keys(&particles, "/properties/model"));
    all.insert("model of advection", keys(&advection, "/properties/model"));
    all.insert("space of advection", keys(&advection, "/properties/space"));
    all.insert("boundary of advection", keys(&advection, "/properties/boundary/additionalProperties"));
    all.insert("start of advection", keys(&advection, "/properties/initial"));
    all.insert("time of advection", keys(&advection, "/properties/time"));
    all.insert("order", study("order"));
    all.insert("branch", study("branch"));
    all.insert("tradeoff", study("tradeoff"));
    let reference = at(&said(&study::schema::KINDS, "tradeoff"), "/properties/reference/anyOf/1");
    all.insert("reference", table(KEYS, rows(&reference)));
    all.insert("study", study("study"));
    all.insert("compare", study("compare"));
    all
}

/// A page with the tables in their places, and the names of these.
fn filled(page: &str, tables: &BTreeMap<&'static str, String>) -> (String, Vec<String>) {
    const BEGIN: &str = "<!-- from the code: ";
    const END: &str = "<!-- end -->";
    let (mut out, mut names) = (String::new(), Vec::new());
    let mut parts = page.split(BEGIN);
    out.push_str(parts.next().unwrap());
    for part in parts {
        let (name, rest) = part.split_once(" -->").expect("a comment that ends");
        let (_, rest) = rest.split_once(END).unwrap_or_else(|| panic!("`{name}` has no {END}"));
        let table = tables.get(name).unwrap_or_else(|| panic!("there is no table `{name}`"));
        out.push_str(&format!("{BEGIN}{name} -->\n{table}{END}{rest}"));
        names.push(name.to_owned());
    }
    (out, names)
}

#[test]
fn the_tables_of_the_pages_are_those_of_the_code() {
    let tables = tables();
    let write = std::env::var("MONOLAYER_DOCS").is_ok_and(|what| what == "write");
    let mut shown = Vec::new();
    for page in ["scene.md", "study.md", "compare.md", "report.md"] {
        let path = root().join("docs").join(page);
        let text = std::fs::read_to_string(&path).unwrap();
        let (now, names) = filled(&text, &tables);
        shown.extend(names);
        if write {
            std::fs::write(&path, &now).unwrap();
        } else if let Some((old, new)) = text.lines().zip(now.lines()).find(|(old, new)| old != new) {
            let how = "MONOLAYER_DOCS=write cargo test --release --test schema";
            panic!("docs/{page} is not what the code says; `{how}` writes it\n  page: {old}\n  code: {new}");
        } else {
            assert_eq!(text, now, "docs/{page}");
        }
    }
    shown.sort();
    let all: Vec<&str> = tables.keys().copied().collect();
    assert_eq!(shown, all, "each table is on one page");
}
