//! What `check` says of a study: how many runs there are, what they take, and which of them are refused.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use serde::Serialize;

use super::compare::CompareStudy;
use super::{BranchStudy, OrderStudy, StudyError, SweepStudy, TradeoffStudy};
use crate::run::AnyScene;
use crate::run::available::available;
use crate::run::disk;
use crate::run::kinds::{self, Amounts};
use crate::run::memory::MIB;
use crate::scene::SceneSource;

/// What a file is a study of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StudyKind {
    /// Of `monolayer study`.
    Study,
    /// Of `monolayer order`.
    Order,
    /// Of `monolayer tradeoff`.
    Tradeoff,
    /// Of `monolayer branch`.
    Branch,
    /// Of `monolayer compare`.
    Compare,
}

impl StudyKind {
    fn shown(self) -> &'static str {
        match self {
            StudyKind::Study => "a sweep",
            StudyKind::Order => "a study of orders",
            StudyKind::Tradeoff => "a study of what accuracy costs",
            StudyKind::Branch => "a study of branches",
            StudyKind::Compare => "a comparison with measured velocities",
        }
    }
}

/// The kind of study that a file holds; `None` of a scene and of what cannot be read.
pub fn kind(file: &Path) -> Option<StudyKind> {
    Some(match SceneSource::read(file).ok()?.study_command()? {
        "order" => StudyKind::Order,
        "branch" => StudyKind::Branch,
        "tradeoff" => StudyKind::Tradeoff,
        "compare" => StudyKind::Compare,
        _ => StudyKind::Study,
    })
}

/// What a study will run.
#[derive(Debug, Clone, Serialize)]
pub struct StudyReport {
    /// One line for reports.
    pub title: Option<String>,
    /// Which command does it.
    pub kind: StudyKind,
    /// How many there are; of branches at most.
    pub runs: usize,
    /// Fewest and most of a run.
    pub cells: [usize; 2],
    /// Steps of the full length, of all runs.
    pub steps: f64,
    /// Of the run that takes most.
    pub memory_mib: f64,
    /// Memory that there is, where the system tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub available_mib: Option<f64>,
    /// Of all runs.
    pub disk_mib: f64,
    /// How long it takes, in its author's words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration: Option<String>,
    /// Runs that are refused before their first step, and why.
    pub refused: Vec<(String, String)>,
    /// What is said of the runs, each remark once with the number of runs.
    pub remarks: Vec<String>,
}

/// Runs that are checked as `check` does a scene of its own; of further ones with a mesh and degrees that have
/// occurred, the tables are.
const WHOLE: usize = 4;

/// A run of a study, as far as it can be read.
type Run = (String, Result<AnyScene, StudyError>);

/// Reads a study and every scene that it runs.
///
/// # Errors
/// A study that cannot be read; a run that is refused is a row of the report.
pub fn check(kind: StudyKind, file: &Path, sets: &[(String, String)]) -> Result<StudyReport, StudyError> {
    Ok(match kind {
        StudyKind::Study => {
            let study = SweepStudy::read(file, sets)?;
            let runs =
                study.cases.iter().enumerate().map(|(at, case)| (format!("run {}", case.folder), study.scene_of(at)));
            let mut report = gather(kind, study.title.clone(), runs)?;
            report.duration.clone_from(&study.duration);
            report
        }
        StudyKind::Order => {
            let study = OrderStudy::read(file, sets)?;
            let all = study.variants.iter().flat_map(|variant| study.levels.iter().map(move |n| (variant, *n)));
            let runs = all.map(|(variant, n)| {
                let scene = study.scene_at(variant, n);
                (format!("{}{}n = {n}", variant.name, if variant.name.is_empty() { "" } else { ", " }), scene)
            });
            gather(kind, study.title.clone(), runs)?
        }
        StudyKind::Tradeoff => {
            let study = TradeoffStudy::read(file, sets)?;
            let runs = study.settings.iter().map(|setting| {
                let scene = study.scene_of(setting, None).map(AnyScene::new);
                (setting.name.clone(), scene)
            });
            gather(kind, study.title.clone(), runs)?
        }
        StudyKind::Branch => {
            let study = BranchStudy::read(file, sets)?;
            let scene = study.scene_at(study.start).map(AnyScene::new);
            let name = format!("{} = {}", study.parameter, study.start);
            let mut report = gather(kind, study.title.clone(), std::iter::once((name, scene)))?;
            report.runs = study.settings.max_points.saturating_mul(study.settings.max_branches);
            report
        }
        StudyKind::Compare => {
            let study = CompareStudy::read(file, sets)?;
            gather(kind, study.title.clone(), std::iter::empty())?
        }
    })
}

/// Looks at every run.
fn gather(kind: StudyKind, title: Option<String>, runs: impl Iterator<Item = Run>) -> Result<StudyReport, StudyError> {
    let available = available()?.map(|bytes| bytes / MIB);
    let mut report = StudyReport {
        title,
        kind,
        runs: 0,
        cells: [usize::MAX, 0],
        steps: 0.0,
        memory_mib: 0.0,
        available_mib: available,
        disk_mib: 0.0,
        duration: None,
        refused: Vec::new(),
        remarks: Vec::new(),
    };
    let mut seen: HashMap<String, Looked> = HashMap::new();
    for (name, scene) in runs {
        report.runs += 1;
        let looked = scene.and_then(|scene| look(&scene, report.runs <= WHOLE, &mut seen));
        match looked {
            Ok(Looked { amounts, refused }) => {
                report.cells = [report.cells[0].min(amounts.cells), report.cells[1].max(amounts.cells)];
                report.steps += amounts.steps;
                report.memory_mib = report.memory_mib.max(amounts.memory_mib);
                report.disk_mib += amounts.disk_mib;
                report.refused.extend(refused.map(|reason| (name, reason)));
            }
            Err(error) => report.refused.push((name, error.to_string())),
        }
    }
    report.cells[0] = report.cells[0].min(report.cells[1]);
    Ok(report)
}

/// What a run takes, and why that is refused, if it is.
#[derive(Debug, Clone)]
struct Looked {
    amounts: Amounts,
    refused: Option<String>,
}

/// What a run takes; `whole` where it is checked as far as its first step.
fn look(scene: &AnyScene, whole: bool, seen: &mut HashMap<String, Looked>) -> Result<Looked, StudyError> {
    let key = alike(scene);
    if let (false, Some(known)) = (whole, seen.get(&key)) {
        return Ok(known.clone());
    }
    let report = kinds::check(scene)?;
    let looked = Looked { amounts: report.amounts(), refused: report.refused().first().cloned() };
    seen.insert(key, looked.clone());
    Ok(looked)
}

/// What the amounts of a run depend on.
fn alike(scene: &AnyScene) -> String {
    let text = scene.resolved_toml();
    let table: toml::Table = text.parse().unwrap_or_default();
    let of = |key: &str| table.get(key).map(ToString::to_string).unwrap_or_default();
    ["mesh", "space", "boundary", "time", "coupling", "steady", "strain", "output", "bodies", "body"].map(of).concat()
}

impl fmt::Display for StudyReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(title) = &self.title {
            writeln!(out, "{title}\n")?;
        }
        writeln!(out, "{}", self.kind.shown())?;
        let runs = match self.kind {
            StudyKind::Branch => format!("at most {} points", self.runs),
            StudyKind::Compare => return write!(out, "it reads a table and a run; nothing is solved"),
            StudyKind::Study | StudyKind::Order | StudyKind::Tradeoff => self.runs.to_string(),
        };
        writeln!(out, "  runs     {runs}")?;
        let [least, most] = self.cells;
        if most > 0 {
            writeln!(
                out,
                "  cells    {}",
                if least == most { most.to_string() } else { format!("{least} to {most}") }
            )?;
        }
        if self.steps > 0.0 {
            writeln!(out, "  steps    {} of the full length in all", self.steps)?;
        }
        writeln!(out, "  memory   about {:.0} MiB for the largest run", self.memory_mib)?;
        write!(out, "  disk     about {} in all", disk::shown(self.disk_mib))?;
        if let Some(duration) = &self.duration {
            write!(out, "\n  time     about {duration} on 2 cores, its author says")?;
        }
        if !self.refused.is_empty() {
            write!(out, "\n  refused  {}", self.refused.len())?;
        }
        self.remarks.iter().try_for_each(|remark| write!(out, "\n\nnote: {remark}"))
    }
}
