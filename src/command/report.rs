//! `monolayer report`: one HTML page of runs and studies.

use std::path::PathBuf;

use monolayer::output::{OutputError, mark, write_whole};
use monolayer::results::Results;

use crate::Failure;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders that runs or studies have left.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// The page [default: report.html in the folder of a single one, else out/report.html].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Args {
    /// Writes the page and returns what there is to say, a line for each problem and one for the file.
    ///
    /// # Errors
    /// Folders without results, a file that cannot be written.
    pub fn execute(&self) -> Result<Vec<String>, Failure> {
        let folders: Vec<Results> = self.folders.iter().map(|path| Results::read(path)).collect::<Result<_, _>>()?;
        let out = match (&self.out, &self.folders[..]) {
            (Some(out), _) => out.clone(),
            (None, [only]) => only.join("report.html"),
            (None, _) => PathBuf::from("out/report.html"),
        };
        if out.is_dir() {
            return Err(format!(
                "{}: is a folder; hint: name the file, such as `--out {}`",
                out.display(),
                out.join("report.html").display()
            )
            .into());
        }
        mark::check(&out)?;
        let html = page(&folders)?;
        if let Some(folder) = out.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|e| OutputError::io(folder, &e))?;
        }
        write_whole(&out, |file| file.write_all(html.as_bytes()))?;
        let note = |folder: &Results| {
            let name = folder.path.display().to_string();
            folder.problems.iter().map(move |problem| format!("note: {name}: {problem}")).collect::<Vec<_>>()
        };
        let mut said: Vec<String> = folders.iter().flat_map(note).collect();
        said.push(format!("written {}", out.display()));
        Ok(said)
    }
}

#[cfg(feature = "html")]
fn page(folders: &[Results]) -> Result<String, Failure> {
    Ok(monolayer::report::page(folders))
}

#[cfg(not(feature = "html"))]
fn page(_: &[Results]) -> Result<String, Failure> {
    Err("no page: built without the feature `html`, which writes reports; hint: build with `--features html`".into())
}
