//! `monolayer plot`: curves from folders of results.

use std::path::PathBuf;

use monolayer::measure::fields::{Part, Scalar};
use monolayer::results::curves::{CurveSettings, curves};
use monolayer::results::plots::{self, PlotKind, When};
use monolayer::results::{Results, ResultsError, ResultsKind};

/// What `--what` takes, in a line.
fn plots_in_brief() -> String {
    format!("Plots to draw, separated by commas: {} [default: all that the folders have]", plots::names())
}

/// As [`plots_in_brief`], with what each shows; a star marks those that are drawn by their names alone.
fn plots_in_full() -> String {
    let row = |kind: &&PlotKind| {
        let mark = if kind.when == When::Named { "*" } else { "" };
        format!("  {}{mark}: {}", kind.name, kind.help)
    };
    let rows: Vec<String> = plots::ALL.iter().map(row).collect();
    let default = "[default: all that the folders have, but those with a star]";
    format!("Plots to draw, separated by commas {default}:\n{}", rows.join("\n"))
}

/// What `--quantity` takes.
fn quantities() -> String {
    let names = |of: &dyn Fn(&Part) -> bool| {
        Scalar::all()
            .map(|scalar| scalar.part)
            .filter(|part| of(part))
            .map(|part| part.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let (all, usual) = (names(&|_| true), names(&|part| part.in_curves));
    format!("Quantities along sections: {all}, or a column of the tables [default: {usual}]")
}

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders that runs, studies or comparisons have left; several runs go into one picture.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    #[arg(long, value_name = "KIND", value_delimiter = ',', help = plots_in_brief(), long_help = plots_in_full())]
    what: Vec<String>,
    #[arg(long, value_name = "NAME", value_delimiter = ',', help = quantities())]
    quantity: Vec<String>,
    /// Cuts, such as axis-3 [default: all].
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    axis: Vec<String>,
    /// Rigid bodies whose curves are drawn, by their names [default: the first ones that move].
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    body: Vec<String>,
    /// The part of the horizontal axis to show.
    #[arg(long, value_name = "LO,HI", allow_hyphen_values = true)]
    window: Option<String>,
    /// Folder of the pictures [default: plots in the folder of a single one, else out/plots].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Name of a run in the legend; may be repeated, in the order of the folders [default: what differs between the
    /// scenes].
    #[arg(long, value_name = "NAME")]
    label: Vec<String>,
}

impl Args {
    /// Draws the pictures and returns what there is to say, a line for each picture or note.
    ///
    /// # Errors
    /// Folders without results, wishes that cannot be met, files that cannot be written.
    pub fn execute(&self) -> Result<Vec<String>, Box<dyn std::error::Error>> {
        let folders: Vec<Results> = self.folders.iter().map(|path| Results::read(path)).collect::<Result<_, _>>()?;
        let wish = self.wish()?;
        let drawn = curves(&folders.iter().collect::<Vec<_>>(), &wish)?;
        let mut said: Vec<String> = drawn.notes.iter().map(|note| format!("note: {note}")).collect();
        if drawn.pictures.is_empty() {
            let folder = folders.iter().map(|f| f.path.display().to_string()).collect::<Vec<_>>().join(", ");
            let what = match folders.iter().flat_map(|f| &f.problems).chain(&drawn.notes).next() {
                Some(problem) => format!("nothing to draw: {problem}"),
                None => "nothing to draw".to_owned(),
            };
            let drawn_already = folders
                .iter()
                .all(|f| matches!(f.kind, ResultsKind::Order | ResultsKind::Branches | ResultsKind::Tradeoff));
            let hint = if drawn_already {
                "the study has drawn its picture itself; `monolayer report` shows it with its tables"
            } else {
                "curves need measures with `every`, or cuts, in an [[output]] of the scene"
            };
            return Err(ResultsError::Folder { folder, what, hint }.into());
        }
        let out = match (&self.out, &self.folders[..]) {
            (Some(out), _) => out.clone(),
            (None, [only]) => only.join("plots"),
            (None, _) => PathBuf::from("out/plots"),
        };
        drawn.write(&out)?;
        said.extend(drawn.pictures.iter().map(|p| format!("written {}.svg and .png", out.join(&p.name).display())));
        Ok(said)
    }

    fn wish(&self) -> Result<CurveSettings, ResultsError> {
        Ok(CurveSettings {
            what: self.what.iter().map(|name| PlotKind::named(name)).collect::<Result<_, _>>()?,
            quantities: self.quantity.clone(),
            axes: self.axis.clone(),
            bodies: self.body.clone(),
            window: self.window.as_deref().map(window).transpose()?,
            labels: self.label.clone(),
        })
    }
}

fn window(text: &str) -> Result<[f64; 2], ResultsError> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let both = text.split_once(',').and_then(|(lo, hi)| Some([number(lo)?, number(hi)?]));
    both.ok_or_else(|| ResultsError::Option {
        option: "--window",
        value: text.to_owned(),
        rule: "must be two numbers".to_owned(),
        hint: "write `--window -5,5`, in units of the horizontal axis".to_owned(),
    })
}
