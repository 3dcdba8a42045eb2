//! Tests that cannot run everywhere say so, where a run of all of them gathers it.

use std::io::Write;

/// Tells that `test` did nothing, and why: on standard output, and on a line of the file that `MONOLAYER_SKIPPED`
/// names, which
/// `.ci/run` lists at its end.
pub fn skip(test: &str, reason: &str) {
    println!("skipped: {test}: {reason}");
    let Some(file) = std::env::var_os("MONOLAYER_SKIPPED") else { return };
    let mut file =
        std::fs::OpenOptions::new().create(true).append(true).open(&file).expect("MONOLAYER_SKIPPED is a file");
    // one write, for other tests append to the same file
    file.write_all(format!("{test}: {reason}\n").as_bytes()).expect("MONOLAYER_SKIPPED can be written");
}
