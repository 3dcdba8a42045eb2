//! Runs every sweep in `studies/extremes` and writes what came of it to `docs/extremes.md`.
//!
//! `cargo run --release --example extremes`; with numbers, as in `-- 22 25`, only those sweeps, and to the screen.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use monolayer::measure::errors::Norm;
use monolayer::model::fields::{DENSITY, FieldId, POLARITY, PRESSURE, VELOCITY};
use monolayer::output::progress::Verbosity;
use monolayer::study::SweepStudy;
use monolayer::study::results::Row;
use monolayer::study::sweep::{self, Settings};

type Failure = Box<dyn std::error::Error>;

const STUDIES: &str = "studies/extremes";
const PAGE: &str = "docs/extremes.md";

/// Exact fields in these studies are of size one: an error above this is a wrong answer.
const WRONG: f64 = 0.1;

fn main() -> Result<(), Failure> {
    // names in the page start at the root of the repository, on any machine
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR"))?;
    let out = (1..).map(|k| PathBuf::from(format!("out/extremes-{k}"))).find(|folder| !folder.exists());
    let out = out.expect("there are many numbers");
    let begin = std::time::Instant::now();
    let (mut sections, mut files, mut runs) = (String::new(), 0, 0);
    let mut wrong: Vec<String> = Vec::new();
    let only: Vec<String> = std::env::args().skip(1).collect();
    for path in sweeps(Path::new(STUDIES))? {
        let study = SweepStudy::read(&path, &[])?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if !only.is_empty() && !only.iter().any(|number| name.starts_with(&format!("{number}-"))) {
            continue;
        }
        let folder = out.join(&name);
        let rows = sweep::run(&study, &folder, &Settings::here(Verbosity::Quiet, &NEVER))?.rows;
        let seconds: f64 = rows.iter().map(|row| row.seconds).sum();
        eprintln!("{name}: {} runs, {seconds:.0} s", rows.len());
        for file in texts(&folder)? {
            files += 1;
            if has_nan(&std::fs::read_to_string(&file)?) {
                wrong.push(format!("{} has a number that is none", file.display()));
            }
        }
        runs += rows.len();
        wrong.extend(rows.iter().filter(|row| is_wrong(row)).map(|row| {
            format!("{name}, run {}: ended well, said nothing, and is off by {:.1e}", row.case.folder, worst(row))
        }));
        for row in &rows {
            let kept = Kept::read(&folder.join(&row.case.folder))?;
            if row.found.is_good() && kept.is_some_and(|kept| !kept.is_sound()) {
                wrong.push(format!(
                    "{name}, run {}: ended well, but lost mass or has a negative density",
                    row.case.folder
                ));
            }
        }
        sections.push_str(&section(&study, &name, &rows, seconds, &folder)?);
    }
    let total = begin.elapsed().as_secs_f64();
    if !wrong.is_empty() {
        return Err(format!("{}\nnothing is written to {PAGE}", wrong.join("\n")).into());
    }
    if !only.is_empty() {
        println!("{sections}");
        return Ok(());
    }
    let old = std::fs::read_to_string(PAGE).unwrap_or_default();
    std::fs::write(PAGE, page(&old, &sections, files, runs, total))?;
    println!("{runs} runs in {total:.0} s; {PAGE} is written, the results are in {}", out.display());
    Ok(())
}

static NEVER: AtomicBool = AtomicBool::new(false);

/// The sweeps of a folder by name; scenes lie beside them.
fn sweeps(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let table: toml::Table = std::fs::read_to_string(&path)?.parse()?;
        if table.contains_key("scene") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// All files of text below a folder; the writer of fields refuses what is not finite by itself.
fn texts(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(texts(&path)?);
        } else if path.extension().is_some_and(|e| e == "csv" || e == "json" || e == "pvd") {
            files.push(path);
        }
    }
    Ok(files)
}

fn has_nan(text: &str) -> bool {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    words.into_iter().any(|word| ["nan", "inf", "infinity"].contains(&word.to_ascii_lowercase().as_str()))
}

/// The largest error of velocity, pressure and polarity, in space and time; 0 without exact fields.
fn worst(row: &Row) -> f64 {
    if !has_errors(row) {
        return 0.0;
    }
    let error = |field: FieldId| row.error(field, Norm::Largest).unwrap_or(f64::NAN);
    fields(row).into_iter().map(error).fold(0.0, f64::max)
}

/// Whether a run was compared with exact fields.
fn has_errors(row: &Row) -> bool {
    row.summary().is_some_and(|summary| !summary.errors.is_empty())
}

/// The fields of a sheet's errors; a compressible one has no error of the pressure.
fn fields(row: &Row) -> [FieldId; 3] {
    let dense = row.error(DENSITY, Norm::Largest).is_some();
    let second = if dense { DENSITY } else { PRESSURE };
    [VELOCITY, second, POLARITY]
}

/// What a compressible run must keep to, over all its steps.
struct Kept {
    /// The smallest density at the points at which one is evaluated.
    lowest: f64,
    /// The largest difference between the mass and what is counted of it, relative to that mass or, where there is
    /// none, itself.
    defect: f64,
    /// Most cells limited in a step.
    limited: f64,
    /// Mean of |p| on axis 1 at the end, where the run cuts there.
    ordered: Option<f64>,
}

impl Kept {
    /// From what a run left in `folder`; `None` for other runs.
    fn read(folder: &Path) -> Result<Option<Kept>, Failure> {
        let Ok(mut table) = csv::Reader::from_path(folder.join("history.csv")) else { return Ok(None) };
        let head = table.headers()?.clone();
        let column = |name: &str| head.iter().position(|column| column == name);
        let columns = ["density_min", "mass_defect", "mass", "limited_cells"].map(column);
        let [Some(lowest), Some(defect), Some(mass), Some(limited)] = columns else { return Ok(None) };
        let mut kept = Kept { lowest: f64::INFINITY, defect: 0.0, limited: 0.0, ordered: ordered(folder)? };
        for record in table.records() {
            let record = record?;
            let at = |k: usize| record[k].parse::<f64>();
            let whole = at(mass)?.abs();
            kept.lowest = kept.lowest.min(at(lowest)?);
            kept.defect = kept.defect.max(at(defect)?.abs() / if whole > 0.0 { whole } else { 1.0 });
            kept.limited = kept.limited.max(at(limited)?);
        }
        Ok(kept.lowest.is_finite().then_some(kept))
    }

    /// No density is negative and no mass is lost.
    fn is_sound(&self) -> bool {
        self.lowest >= 0.0 && self.defect <= 1e-10
    }

    fn text(&self) -> String {
        let lowest = if self.lowest == 0.0 { "0".to_owned() } else { format!("{:.1e}", self.lowest) };
        let ordered = self.ordered.map_or_else(String::new, |p| format!(", mean \\|p\\| {p:.4}"));
        format!("ρ ≥ {lowest}, mass to {:.0e}, limited {}{ordered}", self.defect, self.limited)
    }
}

/// Mean of |p| over the points of axis 1.
fn ordered(folder: &Path) -> Result<Option<f64>, Failure> {
    let Ok(mut table) = csv::Reader::from_path(folder.join("cuts/axis-1.csv")) else { return Ok(None) };
    let head = table.headers()?.clone();
    let (Some(p1), Some(p2)) = (head.iter().position(|c| c == "p1"), head.iter().position(|c| c == "p2")) else {
        return Ok(None);
    };
    let (mut sum, mut count) = (0.0, 0);
    for record in table.records() {
        let record = record?;
        sum += record[p1].parse::<f64>()?.hypot(record[p2].parse::<f64>()?);
        count += 1;
    }
    Ok((count > 0).then(|| sum / f64::from(count)))
}

/// Whether a run ended well and said nothing of resolution, but its fields are wrong.
fn is_wrong(row: &Row) -> bool {
    let warned = row.said.iter().any(|note| note.contains("not resolved"));
    row.found.is_good() && !warned && (worst(row) > WRONG || worst(row).is_nan())
}

/// A study's heading and table, and what was said in its runs.
fn section(study: &SweepStudy, name: &str, rows: &[Row], seconds: f64, folder: &Path) -> Result<String, Failure> {
    let mut text = String::new();
    let title = study.title.as_deref().unwrap_or(name);
    writeln!(text, "\n## {title}\n")?;
    let paired = rows.iter().any(|row| row.case.name.is_none() && reference_of(row, rows).is_some());
    let reference = if paired { "; reference in brackets: the same with half the step" } else { "" };
    writeln!(text, "`{STUDIES}/{name}.toml`, {} runs in {seconds:.0} s{reference}.\n", rows.len())?;
    let keys: Vec<&str> = study.keys().into_iter().filter(|key| !(paired && *key == "time.step")).collect();
    let named = rows.iter().any(|row| row.case.name.is_some());
    let head = if named { "case".to_owned() } else { keys.join(", ") };
    writeln!(text, "| {head} | ending | steps (rejected) | iterations | accuracy | s | said |")?;
    writeln!(text, "| --- | --- | --- | --- | --- | --- | --- |")?;
    let mut notes: Vec<&str> = Vec::new();
    for row in rows {
        let reference = reference_of(row, rows);
        // what only serves as a reference stands in the row that it serves
        if paired && reference.is_none() {
            continue;
        }
        let values: Vec<&str> = keys.iter().filter_map(|key| value(row, key)).collect();
        let label = row.case.name.clone().unwrap_or_else(|| values.join(", "));
        let said = row.said.iter().map(String::as_str).chain(row.found.reason());
        let marks: Vec<String> = said.map(|note| mark(note, &mut notes)).collect();
        let (ending, work) = ending(row);
        let kept = Kept::read(&folder.join(&row.case.folder))?.map(|kept| kept.text());
        let found = Some(accuracy(row, reference)).filter(|text| !text.is_empty());
        let accuracy = found.into_iter().chain(kept).collect::<Vec<_>>().join("; ");
        let marks = marks.join(", ");
        writeln!(text, "| {label} | {ending} | {work} | {accuracy} | {:.1} | {marks} |", row.seconds)?;
    }
    if !notes.is_empty() {
        writeln!(text)?;
    }
    for (k, note) in notes.iter().enumerate() {
        writeln!(text, "{}. {}", k + 1, note.strip_prefix("note: ").unwrap_or(note))?;
    }
    Ok(text)
}

/// The number of a note below the table.
fn mark<'a>(note: &'a str, notes: &mut Vec<&'a str>) -> String {
    let at = notes.iter().position(|other| *other == note).unwrap_or_else(|| {
        notes.push(note);
        notes.len() - 1
    });
    format!("{}", at + 1)
}

fn value<'a>(row: &'a Row, key: &str) -> Option<&'a str> {
    row.case.set.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
}

fn step(row: &Row) -> Option<f64> {
    value(row, "time.step")?.parse().ok()
}

/// The run with half the step and otherwise the same values.
fn reference_of<'a>(row: &Row, rows: &'a [Row]) -> Option<&'a Row> {
    let half = 0.5 * step(row)?;
    let others = |row: &Row| row.case.set.iter().filter(|(key, _)| key != "time.step").cloned().collect::<Vec<_>>();
    rows.iter().find(|other| step(other) == Some(half) && others(other) == others(row))
}

/// How a run ended, and its work: steps, rejected steps and iterations of a step.
fn ending(row: &Row) -> (String, String) {
    match row.summary() {
        Some(summary) => {
            let counts = &summary.counts;
            let each = counts.nonlinear_iterations as f64 / counts.steps.max(1) as f64;
            let late =
                if counts.accepted_late > 0 { format!(", {} late", counts.accepted_late) } else { String::new() };
            (summary.ending.clone(), format!("{} ({}) | {each:.1}{late}", counts.steps, counts.rejected))
        }
        None => (row.found.status().to_owned(), "– | –".to_owned()),
    }
}

/// Errors against exact fields, or a measure beside that of the reference.
fn accuracy(row: &Row, reference: Option<&Row>) -> String {
    if row.summary().is_none() {
        return "–".to_owned();
    }
    if has_errors(row) {
        let of = |field: FieldId| match row.error(field, Norm::Largest).unwrap_or(f64::NAN) {
            0.0 => format!("{} 0", field.symbol),
            error => format!("{} {error:.1e}", field.symbol),
        };
        return fields(row).into_iter().map(of).collect::<Vec<_>>().join(", ");
    }
    let Some(other) = reference else {
        return measured(row).map_or_else(String::new, |found| format!("{} {}", found.name, found.text()));
    };
    let (here, there) = (measured(row), measured(other));
    let text = |found: &Option<Measured>| found.as_ref().map_or("failed".to_owned(), Measured::text);
    let apart = here.as_ref().zip(there.as_ref()).is_some_and(|(here, there)| here.is_far_from(there));
    let remark = if apart { ", **the step is too long**" } else { "" };
    let name = here.as_ref().map_or("", |found| found.name);
    format!("{name} {} ({}){remark}", text(&here), text(&there))
}

/// A number that stands for the whole run.
struct Measured {
    name: &'static str,
    value: f64,
}

impl Measured {
    fn text(&self) -> String {
        if self.name == "F" { format!("{:.4}", self.value) } else { format!("{:.2} %", self.value) }
    }

    /// Whether the largest velocity, or the free energy, differs by more than a tenth.
    fn is_far_from(&self, other: &Measured) -> bool {
        let whole = |found: &Measured| if found.name == "F" { found.value } else { 100.0 + found.value };
        (whole(self) - whole(other)).abs() > 0.1 * whole(other).abs()
    }
}

/// The overshoot of the velocity, or else the free energy, at the end of a run that did not fail.
fn measured(row: &Row) -> Option<Measured> {
    let summary = row.summary()?;
    let of = |key: &str, name| summary.measures.get(key).copied().flatten().map(|value| Measured { name, value });
    if row.found.is_good() { of("overshoot_velocity", "overshoot").or_else(|| of("free_energy", "F")) } else { None }
}

/// The text above the tables is kept as it is; all below this line is written anew.
const BELOW: &str = "<!-- examples/extremes.rs writes what follows -->";

fn page(old: &str, sections: &str, files: usize, runs: usize, total: f64) -> String {
    let above = old.split_once(BELOW).map_or(old, |(above, _)| above).trim_end();
    let (minutes, threads) = (total / 60.0, rayon::current_num_threads());
    format!(
        "{above}\n\n{BELOW}\n\n{runs} runs, {minutes:.1} minutes with {threads} thread{}; {files} tables and summaries \
         searched, no NaN and no infinity found; no run that ended well without a note on resolution is off by more \
         than {WRONG}.\n\
         {sections}",
        if threads == 1 { "" } else { "s" }
    )
}
