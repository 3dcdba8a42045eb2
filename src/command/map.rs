//! `monolayer map`: pictures of the fields that runs have left.

use std::path::{Path, PathBuf};

use clap::Args;
use monolayer::output::OutputError;
use monolayer::output::bodies::{Colour, Look, picture};
use monolayer::output::console;
use monolayer::output::plot::map::Window;
use monolayer::results::bodies::BodiesAtTime;
use monolayer::run::AnyScene;
use monolayer::run::{RunError, finished};
use monolayer::scene::renamed::name_now;
use monolayer::scene::{ArrowsOf, MapOptions, MapRequest, Quantity};
use monolayer::schema::Listed;
use serde::Deserialize;
use serde::de::value::{Error as NameError, StrDeserializer};

use crate::Failure;

/// What `monolayer map` is told.
#[derive(Debug, Args)]
pub struct MapArgs {
    /// Folders of runs.
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// Quantity to show; may be repeated [default: speed and polarity; speed of a Stokes flow; bodies of particles].
    #[arg(long, value_name = "Q", value_parser = named::<Quantity>)]
    of: Vec<Quantity>,
    /// Vector to show as arrows, such as velocity or polarity.
    #[arg(long, value_name = "VECTOR", value_parser = named::<ArrowsOf>)]
    arrows: Option<ArrowsOf>,
    /// Draw contour lines of the stream function.
    #[arg(long)]
    streamlines: bool,
    /// Draw the edges of the cells.
    #[arg(long)]
    mesh: bool,
    /// Part of the plane to show [default: the whole domain].
    #[arg(long, value_name = "x0,y0,x1,y1", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    window: Option<Vec<f64>>,
    /// Ends of the colour bar [default: the smallest and the largest value].
    #[arg(long, value_name = "lo,hi", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    range: Option<Vec<f64>>,
    /// The same colour bar for all runs, from the smallest to the largest value of all.
    #[arg(long, conflicts_with = "range")]
    same_range: bool,
    /// Colours of bodies in pictures of the bodies alone: speed, force (of the contacts) or name [default: speed].
    #[arg(long, value_name = "COLOUR", value_parser = named::<Colour>)]
    colour: Option<Colour>,
    /// Folder of the pictures [default: `maps` in the folder of each run].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A name as in a scene; the message lists those that exist.
fn named<T: for<'de> Deserialize<'de>>(text: &str) -> Result<T, NameError> {
    T::deserialize(StrDeserializer::new(&name_now(text).0))
}

/// Draws the pictures and says where they are.
pub fn run(args: &MapArgs, quiet: bool) -> Result<(), Failure> {
    let window = args.window.as_deref().map(|w| match *w {
        [x0, y0, x1, y1] => Ok([[x0, y0], [x1, y1]]),
        _ => Err(format!("`--window` has {} numbers, must have 4; hint: such as `--window -5,-5,10,5`", w.len())),
    });
    let range = args.range.as_deref().map(|r| match *r {
        [low, high] => Ok([low, high]),
        _ => Err(format!("`--range` has {} numbers, must have 2; hint: such as `--range 0,1.5`", r.len())),
    });
    let (window, range) = (window.transpose()?, range.transpose()?);
    let mut of = if args.of.is_empty() {
        ["speed", "polarity"].into_iter().filter_map(Quantity::named).collect()
    } else {
        args.of.clone()
    };
    let mut seen = Vec::new();
    of.retain(|quantity| {
        !seen.contains(quantity) && {
            seen.push(*quantity);
            true
        }
    });
    let options = |of: Quantity| MapOptions {
        of,
        name: None,
        arrows: args.arrows,
        streamlines: args.streamlines,
        mesh: args.mesh,
        window,
        range,
    };
    let stems = stems(&args.runs);
    let drawn = args.runs.iter().map(|folder| what_of(folder, args)).collect::<Result<Vec<_>, _>>()?;
    of.retain(|quantity| *quantity != Quantity::Bodies);
    let mut requests: Vec<MapRequest> = of.iter().map(|of| request(&options(*of))).collect();
    let fields: Vec<PathBuf> = args.runs.iter().zip(&drawn).filter(|(_, d)| d.fields).map(|(r, _)| r.clone()).collect();
    if args.same_range {
        same_range(&fields, &mut requests, &options, !args.of.is_empty())?;
    }
    if drawn.iter().any(|drawn| drawn.bodies.is_some()) {
        options(Quantity::Bodies).check_frame().map_err(|error| format!("option {error}"))?;
    }
    let look = Look {
        // a wrong one was refused above, or is refused with the fields
        window: window.and_then(|[low, high]| Window::new(low, high).ok()),
        colour: args.colour.unwrap_or_default(),
        range,
        ..Look::default()
    };
    for ((folder, stem), drawn) in args.runs.iter().zip(&stems).zip(&drawn) {
        let out = args.out.as_deref();
        let mut written =
            if drawn.fields { draw(folder, stem, out, &requests, &options, !args.of.is_empty())? } else { Vec::new() };
        if let Some(seen) = &drawn.bodies {
            written.push(draw_bodies(folder, stem, out, seen, &look)?);
        }
        if !quiet {
            written.iter().for_each(|path| console::tell(&format!("written {}.png and .svg", path.display())));
        }
    }
    Ok(())
}

/// What is drawn of a run.
struct Drawn {
    /// Its fields, with the bodies above them.
    fields: bool,
    /// Its bodies alone.
    bodies: Option<BodiesAtTime>,
}

/// Runs of particles have their bodies drawn alone, and all runs where `--of bodies` asks for it.
fn what_of(folder: &Path, args: &MapArgs) -> Result<Drawn, Failure> {
    // what is wrong with the scene is told where it is read
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap_or_default();
    let scene: toml::Table = text.parse().unwrap_or_default();
    let kind = scene.get("model").and_then(|model| model.get("kind")).and_then(toml::Value::as_str).unwrap_or_default();
    let (flow, asked) = (kind != "particles", args.of.contains(&Quantity::Bodies));
    if flow && !asked {
        return Ok(Drawn { fields: true, bodies: None });
    }
    let folder_name = folder.display();
    if let Some(other) = args.of.iter().find(|of| !flow && **of != Quantity::Bodies) {
        let other = other.name();
        let rule = format!("a run of kind `{kind}` has no map of it; hint: take `--of bodies`");
        return Err(format!("{folder_name}: option `--of {other}`: {rule}").into());
    }
    if !flow && (args.arrows.is_some() || args.streamlines || args.mesh || args.same_range) {
        let rule =
            format!("a run of kind `{kind}` has no map of a field; hint: take `--window`, `--range` and `--colour`");
        let options = "`--arrows`, `--streamlines`, `--mesh`, `--same-range`";
        return Err(format!("{folder_name}: options {options}: {rule}").into());
    }
    let none = || {
        let hint = "`bodies = true` in an [[output]] of the scene makes a run write bodies.json and bodies.csv";
        format!("{folder_name}: has no bodies that could be drawn; hint: {hint}")
    };
    let seen = BodiesAtTime::read(folder, None)?.ok_or_else(none)?;
    let fields = flow && args.of.iter().any(|of| *of != Quantity::Bodies);
    Ok(Drawn { fields, bodies: Some(seen) })
}

/// Draws the bodies alone, as they were at the last time of their table.
fn draw_bodies(
    folder: &Path,
    stem: &str,
    out: Option<&Path>,
    seen: &BodiesAtTime,
    look: &Look,
) -> Result<PathBuf, Failure> {
    let plots = out.map_or_else(|| folder.join("maps"), Path::to_owned);
    std::fs::create_dir_all(&plots).map_err(|e| OutputError::io(&plots, &e))?;
    let prefix = if out.is_some() { format!("{stem}-") } else { String::new() };
    let path = plots.join(format!("{prefix}bodies-last"));
    Ok(picture(&seen.moment(), look)?.write_new(&path)?)
}

fn request(options: &MapOptions) -> MapRequest {
    let MapOptions { of, name: _, arrows, streamlines, mesh, window, range } = options.clone();
    MapRequest { name: of.file_name(), of, arrows, streamlines, mesh, window, range }
}

/// Reads the scene of a run and the quantities that are drawn of it, and refuses what its model does not have.
fn read(
    folder: &Path,
    requests: &[MapRequest],
    options: &dyn Fn(Quantity) -> MapOptions,
    named: bool,
) -> Result<(AnyScene, Vec<MapRequest>), Failure> {
    let mut requests = requests.to_vec();
    let path = folder.join("scene.toml");
    if !path.is_file() {
        return Err(RunError::NoRun { folder: folder.display().to_string(), file: "scene.toml" }.into());
    }
    let scene = AnyScene::read(&path)?;
    if !named {
        // a usual quantity that not every kind has
        let has = |of: Quantity| of.field().is_some_and(|field| scene.source().kind().has(field));
        requests.retain(|request| has(request.of));
    }
    for request in &requests {
        let options = options(request.of);
        scene.check_map(&options).map_err(|error| format!("{}: option {error}", folder.display()))?;
    }
    Ok((scene, requests))
}

/// Gives every quantity the range of its values in all runs.
fn same_range(
    runs: &[PathBuf],
    requests: &mut [MapRequest],
    options: &dyn Fn(Quantity) -> MapOptions,
    named: bool,
) -> Result<(), Failure> {
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; requests.len()];
    for folder in runs {
        let (scene, drawn) = read(folder, requests, options, named)?;
        finished::look(folder, &scene, &mut |last| {
            let wanted = ranges.iter_mut().zip(requests.iter()).filter(|(_, request)| drawn.contains(request));
            for (range, request) in wanted {
                let [low, high] = last.extent(request)?;
                *range = [range[0].min(low), range[1].max(high)];
            }
            Ok(())
        })?;
    }
    let found = |range: &[f64; 2]| range[0] <= range[1];
    requests.iter_mut().zip(ranges).filter(|(_, range)| found(range)).for_each(|(r, range)| r.range = Some(range));
    Ok(())
}

/// Draws every quantity of one run.
fn draw(
    folder: &Path,
    stem: &str,
    out: Option<&Path>,
    requests: &[MapRequest],
    options: &dyn Fn(Quantity) -> MapOptions,
    named: bool,
) -> Result<Vec<PathBuf>, Failure> {
    let (scene, requests) = read(folder, requests, options, named)?;
    let plots = out.map_or_else(|| folder.join("maps"), Path::to_owned);
    std::fs::create_dir_all(&plots).map_err(|e| OutputError::io(&plots, &e))?;
    // pictures of several runs in one folder are told apart by the runs' names
    let prefix = if out.is_some() { format!("{stem}-") } else { String::new() };
    let mut drawn = Vec::new();
    finished::look(folder, &scene, &mut |last| {
        for request in &requests {
            let path = plots.join(format!("{prefix}{}-{:06}", request.name, last.steps));
            drawn.push((path, last.draw(request)?));
        }
        Ok(())
    })?;
    let written = drawn.iter().map(|(path, picture)| picture.write_new(path)).collect::<Result<_, _>>()?;
    Ok(written)
}

/// A name for each run: that of its folder, numbered where several have the same.
fn stems(runs: &[PathBuf]) -> Vec<String> {
    let name = |run: &PathBuf| {
        let whole = run.canonicalize().unwrap_or_else(|_| run.clone());
        whole.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned())
    };
    let names: Vec<String> = runs.iter().map(name).collect();
    let twice = |name: &String| names.iter().filter(|other| *other == name).count() > 1;
    names.iter().enumerate().map(|(k, n)| if twice(n) { format!("{n}-{}", k + 1) } else { n.clone() }).collect()
}
