//! The JSON Schema of studies, and the tables of their keys in the docs.

use serde_json::Value;

use super::branch_file::BranchFile;
use super::compare::CompareFile;
use super::file::OrderFile;
use super::sweep_file::SweepFile;
use super::tradeoff_file::TradeoffFile;
use crate::schema::{self, printed};

/// Every kind of study by its command, with its file: all that is said of its keys.
pub const KINDS: [(&str, fn() -> Value); 5] = [
    ("study", schema::of::<SweepFile>),
    ("order", schema::of::<OrderFile>),
    ("branch", schema::of::<BranchFile>),
    ("tradeoff", schema::of::<TradeoffFile>),
    ("compare", schema::of::<CompareFile>),
];

/// The schema of the studies of a command; `None` of one that has none.
pub fn of_kind(command: &str) -> Option<Value> {
    let (_, of) = KINDS.iter().find(|(name, _)| *name == command)?;
    Some(printed(of()))
}
