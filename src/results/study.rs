//! The table of a study: what it varied, what it found, and what that cost.

use super::Table;

/// Columns that tell how a run went and what it cost, not what it found.
const ASIDE: [&str; 28] = [
    "run",
    "name",
    "status",
    "ending",
    "reason",
    "cells",
    "unknowns",
    "time",
    "steps",
    "rejected",
    "iterations",
    "nonlinear_iterations",
    "accepted_late",
    "residual",
    "stability",
    "seconds",
    "seconds_total",
    "said",
    "memory_mib",
    "peak_memory_mib",
    "threads",
    "attempts",
    "warm_start",
    "branch",
    "distance",
    "from",
    "note",
    "notes",
];

/// What the columns of a study's table are.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Columns {
    /// Keys of the scene that differ.
    pub keys: Vec<String>,
    /// Numbers that were found.
    pub measures: Vec<String>,
    /// How the runs went and what they cost.
    pub others: Vec<String>,
}

impl Columns {
    /// Sorts the columns of a table: keys have a dot or stand before `status`, measures are numbers that are not about
    /// the run.
    pub fn of(table: &Table) -> Self {
        let before = table.position("status").unwrap_or(0);
        let mut columns = Self::default();
        for (at, name) in table.header.iter().enumerate() {
            let aside = ASIDE.contains(&name.as_str()) || name.starts_with("seconds");
            if !aside && (at < before || (name.contains('.') && !name.starts_with("error_"))) {
                columns.keys.push(name.clone());
            } else if !aside && table.numbers(name).is_some_and(|all| all.iter().any(|x| x.is_finite())) {
                columns.measures.push(name.clone());
            } else {
                columns.others.push(name.clone());
            }
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_sorted_without_a_fixed_set() {
        let header = ["run", "model.peclet", "status", "later", "reason", "defects", "seconds", "note"];
        let row = ["01", "2", "finished", "", "", "4", "1.5", "fine"];
        let texts = |all: [&str; 8]| all.map(str::to_owned).to_vec();
        let table = Table { header: texts(header), rows: vec![texts(row)], cut_off: false };
        let columns = Columns::of(&table);
        assert_eq!(columns.keys, ["model.peclet"]);
        assert_eq!(columns.measures, ["defects"]);
        assert_eq!(columns.others, ["run", "status", "later", "reason", "seconds", "note"]);
    }
}
