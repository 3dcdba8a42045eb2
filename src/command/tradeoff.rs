//! `monolayer tradeoff`

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use monolayer::output::console;
use monolayer::output::progress::Verbosity;
use monolayer::study::tradeoff::{TradeoffOptions, run};
use monolayer::study::{TradeoffStudy, tradeoff_table};

/// Runs a study of a trade-off and prints its table.
pub fn tradeoff(
    file: &Path,
    sets: &[(String, String)],
    out: &Path,
    repeat: usize,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
) -> Result<ExitCode, crate::Failure> {
    let study = TradeoffStudy::read(file, sets)?;
    let (program, threads) = (std::env::current_exe()?, rayon::current_num_threads());
    let options = TradeoffOptions { program: &program, out: out.to_owned(), repeat, threads, verbosity };
    let found = run(&study, &options, interrupt)?;
    for point in &found.points {
        if let Some(reason) = &point.failure {
            console::note(&format!("error: {}: {reason}", point.setting));
        }
    }
    if verbosity > Verbosity::Quiet {
        console::tell(&tradeoff_table::text(&study, &found));
        console::tell(&format!("results in {}", out.display()));
    }
    Ok(match (found.interrupted, found.points.iter().all(|point| point.failure.is_none())) {
        (true, _) => ExitCode::from(130),
        (false, true) => ExitCode::SUCCESS,
        (false, false) => ExitCode::FAILURE,
    })
}
