//! Reads a folder of results, whichever command left it.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{ResultsError, Table};
use crate::scene::renamed;

/// What a folder holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultsKind {
    /// Of `monolayer run`.
    Run,
    /// Of `monolayer study`: `results.csv` and a folder for every run.
    Sweep,
    /// Of `monolayer order`: `runs.csv`, `orders.csv`, or a folder for every variant.
    Order,
    /// Of `monolayer branch`: `branches.csv`.
    Branches,
    /// `tradeoff.csv`: errors and what they cost.
    Tradeoff,
    /// Of `monolayer compare`: `comparison.csv`, fields on bins and sections.
    Comparison,
    /// Sections alone, as measurements have them.
    Sections,
}

/// A section that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SectionFile {
    /// Name of the cut, such as `axis-3`.
    pub name: String,
    /// Step of a section that was written on the way; `None` for the last state.
    pub step: Option<usize>,
    /// Its table.
    pub path: PathBuf,
}

/// A folder of results.
#[derive(Debug, Clone)]
pub struct Results {
    /// The folder.
    pub path: PathBuf,
    /// Last part of the path.
    pub name: String,
    /// What has left it.
    pub kind: ResultsKind,
    /// `scene.toml`.
    pub scene: Option<toml::Table>,
    /// The settings as text: `scene.toml`, or a study's `study.toml`.
    pub settings: Option<String>,
    /// `summary.json`.
    pub summary: Option<Value>,
    /// Tables by file name, but for histories and sections.
    pub tables: Vec<(String, Table)>,
    /// Pictures, of `x.svg` and `x.png` the first alone.
    pub pictures: Vec<PathBuf>,
    /// Tables along lines and circles.
    pub sections: Vec<SectionFile>,
    /// The runs of a sweep, the variants of a study of orders.
    pub parts: Vec<Results>,
    /// What is missing or broken.
    pub problems: Vec<String>,
}

/// Tables that studies and comparisons leave, and what they make of a folder.
const TABLES: [(&str, ResultsKind); 8] = [
    ("comparison.csv", ResultsKind::Comparison),
    ("tradeoff.csv", ResultsKind::Tradeoff),
    ("pareto.csv", ResultsKind::Tradeoff),
    ("results.csv", ResultsKind::Sweep),
    ("richardson.csv", ResultsKind::Sweep),
    ("branches.csv", ResultsKind::Branches),
    ("orders.csv", ResultsKind::Order),
    ("runs.csv", ResultsKind::Order),
];

/// Files of a run.
const RUN: [&str; 4] = ["summary.json", "history.csv", "checkpoint.bin", "scene.toml"];

impl Results {
    /// Reads a folder; of a study the folders of its runs as well.
    ///
    /// # Errors
    /// [`ResultsError::Folder`]: no folder, or one without results. What is broken inside of it is a problem of the
    /// results.
    pub fn read(path: &Path) -> Result<Self, ResultsError> {
        let wrong =
            |what: &str, hint| ResultsError::Folder { folder: path.display().to_string(), what: what.to_owned(), hint };
        if !path.exists() {
            return Err(wrong("there is no such folder", "name the folder that `--out` of a run or a study named"));
        }
        if !path.is_dir() {
            return Err(wrong("this is a file, not a folder of results", "name the folder in which it lies"));
        }
        let kind = kind_of(path).ok_or_else(|| {
            let (what, hint) = foreign(path);
            wrong(what, hint)
        })?;
        Ok(Self::of_kind(path, kind))
    }

    fn of_kind(path: &Path, kind: ResultsKind) -> Self {
        // the name of `.` or of `..` is that of the folder it leads to
        let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let name = real.file_name().unwrap_or(real.as_os_str()).to_string_lossy().into_owned();
        let mut results = Self {
            path: path.to_owned(),
            name,
            kind,
            scene: None,
            settings: None,
            summary: None,
            tables: Vec::new(),
            pictures: pictures(path),
            sections: section_files(path),
            parts: Vec::new(),
            problems: Vec::new(),
        };
        results.read_settings();
        match kind {
            ResultsKind::Run => results.read_run(),
            ResultsKind::Sweep | ResultsKind::Tradeoff => results.read_sweep(),
            ResultsKind::Order => results.read_order(),
            ResultsKind::Branches => results.read_tables(&["branches.csv"]),
            ResultsKind::Comparison => results.read_comparison(),
            ResultsKind::Sections => {}
        }
        results
    }

    /// `history.csv`.
    ///
    /// # Errors
    /// [`ResultsError::Broken`]: a file that cannot be read, has no header, or rows of another length.
    pub fn history(&self) -> Result<Option<Table>, ResultsError> {
        let path = self.path.join("history.csv");
        if path.exists() { Table::read(&path).map(Some) } else { Ok(None) }
    }

    /// A table that was read.
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|(file, _)| file == name).map(|(_, table)| table)
    }

    /// The value of a key of the scene, such as `model.peclet`.
    pub fn setting(&self, key: &str) -> Option<&toml::Value> {
        super::label::value_of(self.scene.as_ref()?, key)
    }

    /// The title that the scene or the study gives itself, or else the folder's name.
    pub fn title(&self) -> String {
        let own = self.setting("title").and_then(toml::Value::as_str).map(str::to_owned);
        own.filter(|title| !title.trim().is_empty()).unwrap_or_else(|| self.name.clone())
    }

    /// Whether the rows of its history are pseudo-steps of a search for a steady state, whose time does not count.
    pub fn is_search(&self) -> bool {
        self.setting("steady").is_some()
    }

    /// The runs in it: itself, or its parts.
    pub fn runs(&self) -> Vec<&Results> {
        match self.kind {
            ResultsKind::Run | ResultsKind::Comparison | ResultsKind::Sections => vec![self],
            ResultsKind::Sweep | ResultsKind::Tradeoff => self.parts.iter().collect(),
            ResultsKind::Order | ResultsKind::Branches => Vec::new(),
        }
    }

    fn read_settings(&mut self) {
        let name = match self.kind {
            ResultsKind::Run | ResultsKind::Sections => "scene.toml",
            ResultsKind::Sweep
            | ResultsKind::Order
            | ResultsKind::Branches
            | ResultsKind::Tradeoff
            | ResultsKind::Comparison => "study.toml",
        };
        let path = self.path.join(name);
        if !path.exists() {
            if self.kind != ResultsKind::Sections {
                self.problems.push(format!("{name} is missing: the settings are not known"));
            }
            return;
        }
        match std::fs::read_to_string(&path) {
            Ok(text) => {
                match renamed::table(&text) {
                    Ok(table) => self.scene = Some(table),
                    Err(error) => self.problems.push(format!("{name} is not TOML: {}", error.message())),
                }
                self.settings = Some(text);
            }
            Err(error) => self.problems.push(format!("{name} cannot be read: {error}")),
        }
    }

    /// `summary.json`, if it is there.
    fn read_summary(&mut self) {
        let read = std::fs::read(self.path.join("summary.json")).map_err(|e| e.to_string());
        match read.and_then(|bytes| serde_json::from_slice::<Value>(&bytes).map_err(|e| e.to_string())) {
            Ok(summary @ Value::Object(_)) => self.summary = Some(summary),
            Ok(_) => self.problems.push("summary.json is no summary".to_owned()),
            Err(error) => self.problems.push(format!("summary.json cannot be read: {error}")),
        }
    }

    fn read_comparison(&mut self) {
        self.read_tables(&["comparison.csv"]);
        if self.table("comparison.csv").is_none() {
            self.problems
                .push("comparison.csv is missing: the comparison was stopped before it found anything".to_owned());
        }
        match self.path.join("summary.json").exists() {
            true => self.read_summary(),
            false => self.problems.push("summary.json is missing: what was read is not known".to_owned()),
        }
    }

    fn read_run(&mut self) {
        if self.path.join("summary.json").exists() {
            self.read_summary();
        } else {
            let so_far = self.history().ok().flatten().map(|table| how_far(&table)).unwrap_or_default();
            let resume = if self.path.join("checkpoint.bin").exists() {
                "; `monolayer run` with `--resume` goes on from the checkpoint"
            } else {
                ""
            };
            self.problems.push(format!("the run has not ended: there is no summary.json{so_far}{resume}"));
        }
        match self.history() {
            Ok(Some(table)) if table.cut_off => {
                self.problems.push("the last row of history.csv was cut off, and is left out".to_owned());
            }
            Ok(Some(_)) => {}
            Ok(None) => self.problems.push("history.csv is missing: there are no curves over time".to_owned()),
            Err(error) => self.problems.push(error.to_string()),
        }
    }

    fn read_sweep(&mut self) {
        self.read_tables(&["results.csv", "tradeoff.csv", "pareto.csv", "richardson.csv"]);
        if self.kind == ResultsKind::Sweep && !self.path.join("results.csv").exists() {
            self.problems.push("results.csv is missing: no run has ended yet".to_owned());
        }
        let named: Vec<String> = self
            .table("results.csv")
            .and_then(|table| table.texts("run").map(|texts| texts.map(str::to_owned).collect()))
            .unwrap_or_default();
        let mut inside = folders(&self.path);
        inside.retain(|folder| kind_of(folder) == Some(ResultsKind::Run));
        self.parts = inside.iter().map(|folder| Self::of_kind(folder, ResultsKind::Run)).collect();
        let unfinished: Vec<&str> =
            self.parts.iter().map(|run| run.name.as_str()).filter(|name| !named.iter().any(|n| n == name)).collect();
        if !unfinished.is_empty() && self.kind == ResultsKind::Sweep {
            self.problems.push(format!("begun and not in results.csv: {}", unfinished.join(", ")));
        }
        // the order of the table is that of the study
        let place = |name: &str| named.iter().position(|n| n == name).unwrap_or(usize::MAX);
        self.parts.sort_by(|a, b| (place(&a.name), &a.name).cmp(&(place(&b.name), &b.name)));
    }

    fn read_order(&mut self) {
        self.read_tables(&["orders.csv", "runs.csv"]);
        if self.table("runs.csv").is_none() {
            self.problems.push("runs.csv is missing: no level is complete yet".to_owned());
        }
        if self.table("orders.csv").is_none() {
            let variants = folders(&self.path).into_iter().filter(|folder| folder.join("orders.csv").exists());
            for folder in variants {
                let mut part = Self::of_kind(&folder, ResultsKind::Order);
                // study.toml and runs.csv lie above
                part.problems.clear();
                self.parts.push(part);
            }
        }
    }

    fn read_tables(&mut self, names: &[&str]) {
        for &name in names {
            let path = self.path.join(name);
            if !path.exists() {
                continue;
            }
            match Table::read(&path) {
                Ok(table) => self.tables.push((name.to_owned(), table)),
                Err(error) => self.problems.push(error.to_string()),
            }
        }
    }
}

fn how_far(history: &Table) -> String {
    let last = history.rows.len().checked_sub(1);
    let entry = |name: &str| last.and_then(|row| history.at(row, name)).unwrap_or("0").to_owned();
    format!("; so far {} steps, up to t = {}", entry("step"), entry("time"))
}

fn kind_of(path: &Path) -> Option<ResultsKind> {
    let has = |name: &str| path.join(name).exists();
    if let Some((_, kind)) = TABLES.iter().find(|(name, _)| has(name)) {
        return Some(*kind);
    }
    if has("study.toml") {
        // begun, and nothing found yet
        let text = std::fs::read_to_string(path.join("study.toml")).unwrap_or_default();
        let table: toml::Table = text.parse().unwrap_or_default();
        let has = |key: &str| table.contains_key(key);
        return Some(match () {
            () if has("data") && !has("scene") => ResultsKind::Comparison,
            () if has("levels") => ResultsKind::Order,
            () if has("parameter") => ResultsKind::Branches,
            () if has("setting") => ResultsKind::Tradeoff,
            () => ResultsKind::Sweep,
        });
    }
    if RUN.iter().any(|name| has(name)) {
        return Some(ResultsKind::Run);
    }
    (!section_files(path).is_empty()).then_some(ResultsKind::Sections)
}

/// What a folder without results is, and what to do.
fn foreign(path: &Path) -> (&'static str, &'static str) {
    let all = entries(path);
    let has = |ending: &str| all.iter().any(|entry| has_ending(entry, ending));
    let inside = all.iter().any(|entry| entry.is_dir() && kind_of(entry).is_some());
    match () {
        () if all.is_empty() => ("is empty", "`monolayer run SCENE --out` this folder fills it"),
        () if inside => ("holds no results itself", "name the folders of results in it"),
        () if has("vtu") && has("msh") => (
            "holds a mesh, and no results",
            "open the .vtu in ParaView; `monolayer mesh` on the .msh tells its quality",
        ),
        () => (
            "holds no results",
            "a run leaves history.csv and summary.json there, a study results.csv, runs.csv or branches.csv, a \
             comparison comparison.csv",
        ),
    }
}

/// Entries of a folder in the order of their names; none if it cannot be read.
fn entries(path: &Path) -> Vec<PathBuf> {
    let read = std::fs::read_dir(path).into_iter().flatten().filter_map(Result::ok);
    let mut all: Vec<PathBuf> = read.map(|entry| entry.path()).collect();
    all.sort();
    all
}

fn folders(path: &Path) -> Vec<PathBuf> {
    entries(path).into_iter().filter(|entry| entry.is_dir()).collect()
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// Pictures of the folder itself, of its `plots/` and `maps/`; a PNG beside an SVG of the same name is the same
/// picture.
fn pictures(path: &Path) -> Vec<PathBuf> {
    let places = [path.to_owned(), path.join("plots"), path.join("maps")];
    let all: Vec<PathBuf> = places.iter().flat_map(|folder| entries(folder)).collect();
    let kept = |p: &&PathBuf| has_ending(p, "svg") || (has_ending(p, "png") && !all.contains(&p.with_extension("svg")));
    all.iter().filter(kept).cloned().collect()
}

/// `NAME.csv` and `NAME-step-NNNNNN.csv` in `cuts/`.
fn section_files(path: &Path) -> Vec<SectionFile> {
    let tables = entries(&path.join("cuts")).into_iter().filter(|path| has_ending(path, "csv"));
    let named = tables.map(|path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let on_the_way = stem.rsplit_once("-step-").and_then(|(name, step)| Some((name, step.parse().ok()?)));
        match on_the_way {
            Some((name, step)) => SectionFile { name: name.to_owned(), step: Some(step), path },
            None => SectionFile { name: stem, step: None, path },
        }
    });
    named.collect()
}
