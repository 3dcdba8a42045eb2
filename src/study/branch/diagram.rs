//! The diagram of branches: its table, its picture and what is told of it.

use std::collections::BTreeMap;
use std::path::Path;

use crate::output::plot::{Line, Markers, Plot, Scale, Series, Symbol, if_drawn};
use crate::output::{OutputError, number as number_of};
use crate::results::names;
use crate::steady::Stability;
use crate::steady::branch::{Branch, Special};
use crate::study::StudyError;
use crate::study::branch_file::{BranchStudy, ParameterScale};
use crate::study::table::write_rows;

/// What a study of branches found.
#[derive(Debug)]
pub struct Diagram {
    /// Both directions of each branch.
    pub branches: Vec<Branch>,
    /// Measures of every point, by direction; a point that was inserted between others has its measures here as well.
    pub measures: Vec<Vec<BTreeMap<&'static str, f64>>>,
    /// Branches that begin and were not followed, for there are `max_branches`.
    pub left: usize,
    /// Wall seconds that it took.
    pub seconds: f64,
    /// Whether somebody stopped it.
    pub interrupted: bool,
    /// Why the state to which the instability of the first one leads begins no branch.
    pub refused: Option<String>,
    /// What ended it before all was followed.
    pub broken: Option<String>,
}

impl Special {
    /// As in the table.
    pub fn name(self) -> &'static str {
        match self {
            Special::Fold => "fold",
            Special::Pitchfork => "pitchfork",
            Special::BranchPoint => "branch-point",
            Special::Hopf => "hopf",
        }
    }
}

impl Diagram {
    pub(super) fn write(&self, study: &BranchStudy, out: &Path) -> Result<(), StudyError> {
        write_rows(&out.join("branches.csv"), &self.rows())?;
        let plot = self.plot(study);
        if_drawn(plot.write(&out.join("branches"))).map_err(|error| OutputError::Malformed {
            path: out.join("branches.svg").display().to_string(),
            what: error.to_string(),
            hint: "the table beside it is complete",
        })?;
        Ok(())
    }

    /// The directions of each branch.
    fn curves(&self) -> Vec<Vec<usize>> {
        let count = self.branches.iter().map(|branch| branch.curve + 1).max().unwrap_or(0);
        let of = |curve: usize| (0..self.branches.len()).filter(|b| self.branches[*b].curve == curve).collect();
        (0..count).map(of).collect()
    }

    /// Direction and number of every point of a branch, from one of its ends to the other.
    fn along(&self, directions: &[usize]) -> Vec<[usize; 2]> {
        let points = |b: usize| {
            let count = self.branches[b].points.len().min(self.measures.get(b).map_or(0, Vec::len));
            (0..count).map(move |k| [b, k])
        };
        match *directions {
            [back, ahead] => {
                // both begin at the start; of a branch that crosses another each begins beside the crossing
                let twice = usize::from(self.branches[ahead].parent.is_none());
                points(back).rev().chain(points(ahead).skip(twice)).collect()
            }
            _ => directions.iter().flat_map(|b| points(*b)).collect(),
        }
    }

    /// One row per point.
    fn rows(&self) -> Vec<Vec<String>> {
        let known = self.measures.iter().flatten().flat_map(BTreeMap::keys);
        let columns: std::collections::BTreeSet<&str> = known.copied().collect();
        let head = ["branch", "from", "point", "parameter", "stability", "unstable_dimension", "special"];
        let tail = ["growth", "frequency", "corrections"];
        let mut rows = vec![head.into_iter().chain(columns.iter().copied()).chain(tail).map(String::from).collect()];
        for (curve, directions) in self.curves().iter().enumerate() {
            for (number, [b, k]) in self.along(directions).into_iter().enumerate() {
                let (branch, point) = (&self.branches[b], &self.branches[b].points[k]);
                let values = &self.measures[b][k];
                let from = branch.parent.map_or_else(String::new, |[b, _]| (self.branches[b].curve + 1).to_string());
                let leading = point.eigenvalues.first();
                let mut row = vec![(curve + 1).to_string(), from, (number + 1).to_string(), number_of(point.parameter)];
                row.extend([point.stability.name().to_owned(), point.unstable_dimension.to_string()]);
                row.push(point.special.map_or_else(String::new, |special| special.name().to_owned()));
                row.extend(columns.iter().map(|c| values.get(c).map_or_else(String::new, |v| number_of(*v))));
                row.push(leading.map_or_else(String::new, |l| number_of(l.re)));
                row.push(leading.map_or_else(String::new, |l| number_of(l.im)));
                row.push(point.corrections.to_string());
                rows.push(row);
            }
        }
        rows
    }

    /// The measure over the parameter: stable parts solid, unstable ones dashed, special points marked.
    fn plot(&self, study: &BranchStudy) -> Plot {
        let scale = match study.scale {
            ParameterScale::Linear => Scale::Linear,
            ParameterScale::Log => Scale::Log,
        };
        let (x, y) = (names::axis(&study.parameter, scale), names::axis(&study.measure, Scale::Linear));
        let mut series = Vec::new();
        for (branch, measures) in self.branches.iter().zip(&self.measures) {
            let colour = usize::from(branch.parent.is_some());
            let at = |k: usize| {
                let value = measures.get(k).and_then(|m| m.get(study.measure.as_str()));
                (branch.points[k].parameter, value.copied().unwrap_or(f64::NAN))
            };
            let stable = |k: usize| branch.points[k].stability == Stability::Stable;
            let count = branch.points.len().min(measures.len());
            // a branch point belongs to both of its sides
            let origin = branch.parent.and_then(|[b, k]| {
                let value = self.measures.get(b)?.get(k)?.get(study.measure.as_str())?;
                Some((self.branches[b].points[k].parameter, *value))
            });
            let mut part: Vec<(f64, f64)> = origin.into_iter().collect();
            for k in 0..count {
                part.push(at(k));
                let special = branch.points[k].special.is_some();
                let ends = k + 1 == count || special || stable(k) != stable(k + 1);
                if ends {
                    let solid = if special && k + 1 < count && k > 0 { stable(k - 1) } else { stable(k) };
                    let (name, line) = if solid { ("stable", Line::Solid) } else { ("unstable", Line::Dashed) };
                    let points = std::mem::take(&mut part);
                    series.push(Series {
                        name: name.into(),
                        points,
                        line,
                        markers: Markers::None,
                        colour: Some(colour),
                    });
                    part.push(at(k));
                }
            }
        }
        series.extend(self.special_points(study));
        let title = study
            .title
            .clone()
            .unwrap_or_else(|| format!("branches of steady states in {}", names::words(&study.parameter)));
        let cells = format!("range {} to {}", number_of(study.range[0]), number_of(study.range[1]));
        Plot { title, subtitle: cells, x, y, series, slopes: Vec::new() }
    }

    fn special_points(&self, study: &BranchStudy) -> Vec<Series> {
        let kinds = [
            (Special::Pitchfork, Symbol::Circle),
            (Special::Fold, Symbol::Square),
            (Special::Hopf, Symbol::Triangle),
            (Special::BranchPoint, Symbol::Diamond),
        ];
        let of_kind = |(kind, symbol): (Special, Symbol)| {
            let all = self.branches.iter().zip(&self.measures).flat_map(|(b, m)| b.points.iter().zip(m));
            let points: Vec<(f64, f64)> = all
                .filter(|(point, _)| point.special == Some(kind))
                .filter_map(|(point, m)| Some((point.parameter, *m.get(study.measure.as_str())?)))
                .collect();
            let (name, line) = (kind.name().replace('-', " "), Line::None);
            let markers = Markers::Open(symbol);
            (!points.is_empty()).then_some(Series { name, points, line, markers, colour: Some(2) })
        };
        kinds.into_iter().filter_map(of_kind).collect()
    }
}

impl std::fmt::Display for Diagram {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let plural = |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let curves = self.curves();
        let along: Vec<Vec<[usize; 2]>> = curves.iter().map(|directions| self.along(directions)).collect();
        let points: usize = along.iter().map(Vec::len).sum();
        let branches = plural(curves.len(), "branch", "branches");
        write!(out, "{branches}, {}, {:.1} s", plural(points, "point", "points"), self.seconds)?;
        for (k, (directions, along)) in curves.iter().zip(&along).enumerate() {
            write!(out, "\nbranch {}:", k + 1)?;
            for (at, b) in directions.iter().enumerate() {
                let branch = &self.branches[*b];
                let [first, last] =
                    [branch.points.first(), branch.points.last()].map(|p| p.map_or(f64::NAN, |p| p.parameter));
                let and = if at > 0 { ";" } else { "" };
                write!(out, "{and} from {first:.5} to {last:.5}, ended: {}", branch.end)?;
            }
            for [b, at] in along {
                let point = &self.branches[*b].points[*at];
                if let Some(special) = point.special {
                    write!(out, "\n  {} at {:.5}", special.name(), point.parameter)?;
                }
            }
        }
        if self.left > 0 {
            let others = plural(self.left, "branch that begins was", "branches that begin were");
            write!(out, "\nnote: {others} not followed: a larger `max_branches` allows it")?;
        }
        if let Some(why) = &self.refused {
            write!(out, "\nnote: of the other steady state that was found at the start, {why}")?;
        }
        Ok(())
    }
}
