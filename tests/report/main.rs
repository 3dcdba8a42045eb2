//! `monolayer plot` and `monolayer report` on what runs and studies leave.

mod browser;
mod common;
mod curves;
mod folders;
mod page;
#[path = "../skipped/mod.rs"]
mod skipped;
