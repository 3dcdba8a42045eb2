//! The JSON Schema of studies, and the tables of their keys in the docs.

use serde_json::Value;

use super::branch_file::BranchFile;
use super::compare::CompareFile;
use super::file::OrderFile;
use super::sweep_file::SweepFile;
use super::tradeoff_file::TradeoffFile;
use crate::schema::{FileKind, printed};

/// Every kind of study by its command, with its file: all that is said of its keys.
pub const KINDS: [FileKind; 5] = [
    FileKind::of::<SweepFile>("study"),
    FileKind::of::<OrderFile>("order"),
    FileKind::of::<BranchFile>("branch"),
    FileKind::of::<TradeoffFile>("tradeoff"),
    FileKind::of::<CompareFile>("compare"),
];

/// The schema of the studies of a command; `None` of one that has none.
pub fn of_kind(command: &str) -> Option<Value> {
    let title = format!("A file of `monolayer {command}`");
    FileKind::named(command, &KINDS).map(|kind| printed((kind.said)(), &title))
}
