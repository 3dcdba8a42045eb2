//! Which value of a scene is farthest outside of what is usual: the first to look at where numbers overflow or a
//! solution fails.
//!
//! A message of a solver knows its matrix and not the scene. Whoever has the scene puts the value that was given, not
//! a default that follows from it, in the place of the solver's hint.

use super::domain::build_mesh;
use super::forecast;
use crate::expression::Expression;
use crate::mesh::{Point, generate};
use crate::model::Conditions;
use crate::model::boundary::PolarityCondition;
use crate::model::terms::factor;
use crate::scene::path::quoted;
use crate::scene::{Initial, InitialDensity, Scene, SceneSource};

/// A key with a number or a list of them, the usual sizes, and what to do.
type Usual = (&'static str, [f64; 2], &'static str);

const NEAR_ONE: &str = "take a value near 1, or units in which lengths and times are near 1";
const LENGTH: &str = "take a unit in which lengths are near 1; friction and coherence length change with it";
const LENGTHS: [f64; 2] = [1e-5, 1e5];
const TOLERANCE: &str = "leave it out";

/// Where 0 is allowed, small values do no harm.
const OF_MODEL: [Usual; 10] = [
    ("model.friction", [0.0, 1e6], NEAR_ONE),
    ("model.beta", [0.0, 1.0 - 1e-6], "take such as 0.75, or give `friction`"),
    ("model.traction", [0.0, 1e6], NEAR_ONE),
    ("model.active_stress", [0.0, 1e6], NEAR_ONE),
    ("model.active_stress_iso", [0.0, 1e6], NEAR_ONE),
    ("model.peclet", [1e-6, 1e6], NEAR_ONE),
    ("model.coherence", [1e-5, 1e5], "take about a tenth of the domain's width"),
    ("model.elasticity", [0.0, 1e6], NEAR_ONE),
    ("model.density.penalty", [0.0, 1e6], NEAR_ONE),
    ("model.density.critical", [0.0, 1e3], "take a value below the density of the start"),
];

/// Numbers of other tables, beside lengths of the mesh.
const OF_OTHERS: [Usual; 8] = [
    ("time.step", [1e-9, 1e6], "take about a tenth of the time in which the flow changes"),
    ("time.end", [1e-9, 1e9], "take some times the time in which the flow changes"),
    ("time.step_min", [0.0, 1e6], TOLERANCE),
    ("coupling.tolerance", [1e-12, 1e-2], TOLERANCE),
    ("coupling.accept", [1e-12, 1.0], TOLERANCE),
    ("steady.residual", [1e-12, 1e-2], TOLERANCE),
    ("rigid.epsilon", [1e-9, 1e-1], TOLERANCE),
    ("initial.polarity.random.amplitude", [0.0, 1e3], "take a value near 0.1"),
];

/// Keys without which others are what follows from them.
const FOLLOWERS: [(&str, &str); 2] = [("model.friction", "model.traction"), ("model.beta", "model.traction")];

/// A value outside of the usual range, by so many powers of ten.
struct Suspect {
    decades: f64,
    /// Whether it is the size of the domain.
    is_length: bool,
    said: String,
}

impl Suspect {
    fn new(size: f64, [low, high]: [f64; 2], said: impl FnOnce() -> String) -> Option<Self> {
        let decades = match size {
            size if size > high => (size / high).log10(),
            size if size > 0.0 && size < low => (low / size).log10(),
            _ => return None,
        };
        Some(Self { decades, is_length: false, said: said() })
    }
}

/// What a scene gives that is farthest outside of the usual, and what to do about it.
pub fn of_scene(scene: &Scene) -> Option<String> {
    let points = points(scene);
    let source = scene.source();
    let times = [0.0, scene.time.end];
    let formulas = formulas(scene).into_iter().filter(|(key, ..)| is_formula(source, key));
    let of_formulas = formulas.filter_map(|(key, usual, formulas)| {
        let sizes = times.iter().flat_map(|t| points.iter().map(move |x| (*x, *t)));
        let at = |(x, t): (Point, f64)| formulas.iter().map(|f| f.eval(x, t).abs()).fold(0.0, f64::max);
        let size = sizes.map(at).fold(0.0, f64::max);
        let said = || {
            let (place, high) = (source.place(&key), usual);
            format!("`{key}` ({place}) reaches {size:.0e}, and at most {high:.0e} is usual; take values near 1")
        };
        Suspect::new(size, [0.0, usual], said)
    });
    let numbers: Vec<Suspect> = of_file(source, &points).into_iter().chain(of_numbers(source)).collect();
    // what a formula reaches in a domain that is too large grows with it
    let length = numbers.iter().filter(|suspect| suspect.is_length).map(|suspect| suspect.decades).fold(0.0, f64::max);
    let of_formulas = of_formulas.map(|suspect| Suspect { decades: suspect.decades - length, ..suspect });
    worst(numbers.into_iter().chain(of_formulas))
}

/// As [`of_scene`], by the numbers of a scene of any kind alone.
pub fn of_source(source: &SceneSource) -> Option<String> {
    worst(of_numbers(source))
}

/// A message whose hint is replaced by that of a suspect, if there is one.
pub fn hinted(message: String, suspect: Option<String>) -> String {
    match suspect {
        Some(hint) => {
            let what = message.split("; hint: ").next().unwrap_or_default();
            format!("{what}; hint: {hint}")
        }
        None => message,
    }
}

/// The first of those that are farthest outside.
fn worst(suspects: impl Iterator<Item = Suspect>) -> Option<String> {
    suspects.reduce(|worst, next| if next.decades > worst.decades { next } else { worst }).map(|worst| worst.said)
}

fn of_numbers(source: &SceneSource) -> impl Iterator<Item = Suspect> {
    let rows = |rows: &'static [Usual]| rows.iter().map(|(key, usual, advice)| ((*key).to_owned(), *usual, *advice));
    let lengths = generate::lengths().into_iter().map(|key| (format!("mesh.{key}"), LENGTHS, LENGTH));
    let factors = factor::all().map(|(factor, _)| (format!("model.{}", factor.key), [0.0, 1e6], NEAR_ONE));
    rows(&OF_MODEL).chain(factors).chain(lengths).chain(rows(&OF_OTHERS)).filter_map(|(key, usual, advice)| {
        let key = key.as_str();
        let item = source.at(key)?;
        let number = |value: &toml_edit::Value| value.as_float().or(value.as_integer().map(|n| n as f64));
        let value = item.as_value()?;
        let list = value.as_array().into_iter().flatten().filter_map(number);
        let size = number(value).into_iter().chain(list).map(f64::abs).fold(0.0, f64::max);
        let suspect = Suspect::new(size, usual, || {
            let [low, high] = usual.map(|bound| if bound == 0.0 { "0".to_owned() } else { format!("{bound:e}") });
            let shown =
                number(value).map_or_else(|| value.to_string().trim().to_owned(), |number| format!("{number:?}"));
            let place = source.place(key);
            format!(
                "`{key}` = {shown} ({place}) is far outside of the usual {low} to {high}{}; {advice}",
                follower(source, key)
            )
        })?;
        Some(Suspect { is_length: usual == LENGTHS && key.starts_with("mesh."), ..suspect })
    })
}

/// What is not given and follows from a key.
fn follower(source: &SceneSource, key: &str) -> String {
    let follows = FOLLOWERS.iter().find(|(from, other)| *from == key && source.at(other).is_none());
    let tissue = *source.kind() == crate::scene::kinds::TISSUE;
    let said = |(_, other): &(&str, &str)| format!(", and `{other}`, which is not given, follows from it");
    follows.filter(|_| tissue).map_or_else(String::new, said)
}

/// A mesh from a file in an unusual unit.
fn of_file(source: &SceneSource, points: &[Point]) -> Option<Suspect> {
    source.at("mesh.file")?;
    let first = *points.first()?;
    let (low, high) = points.iter().fold((first, first), |(low, high), x| (low.inf(x), high.sup(x)));
    let size = (high - low).max();
    let said = || format!("the mesh of `mesh.file` ({}) is {size:.1e} across; {LENGTH}", source.place("mesh.file"));
    Suspect::new(size, LENGTHS, said).map(|suspect| Suspect { is_length: true, ..suspect })
}

/// Whether a formula was given under a key, and does not come from the exact fields.
fn is_formula(source: &SceneSource, key: &str) -> bool {
    let named = key.ends_with(".velocity") || key.ends_with(".polarity");
    source.at(key).is_some_and(|item| !(named && item.is_str()))
}

/// Keys of formulas, and their largest usual size.
fn formulas(scene: &Scene) -> Vec<(String, f64, Vec<&Expression>)> {
    const POLARITY: f64 = 1e3;
    const OTHER: f64 = 1e6;
    let mut all: Vec<(String, f64, Vec<&Expression>)> = Vec::new();
    if let Initial::Expressions(pair) = &scene.initial {
        all.push(("initial.polarity".to_owned(), POLARITY, pair.iter().collect()));
    }
    if let Some(InitialDensity::Formula(formula)) = &scene.initial_density {
        all.push(("initial.density".to_owned(), POLARITY, vec![formula]));
    }
    for (tag, Conditions { velocity, polarity, density }) in &scene.boundary {
        let key = |name: &str| format!("boundary.{}.{name}", quoted(tag));
        all.push((key("velocity"), OTHER, velocity.formulas().iter().collect()));
        if let PolarityCondition::Dirichlet(pair) = polarity {
            all.push((key("polarity"), POLARITY, pair.iter().collect()));
        }
        all.extend(density.iter().map(|formula| (key("density"), POLARITY, vec![formula])));
    }
    let sources = &scene.sources;
    for (key, pair) in [("source.force", &sources.force), ("source.polarity", &sources.polarity)] {
        all.extend(pair.iter().map(|pair| (key.to_owned(), OTHER, pair.iter().collect())));
    }
    all.extend(sources.density.iter().map(|formula| ("source.density".to_owned(), OTHER, vec![formula])));
    all
}

/// Cells of the mesh at whose vertices formulas are looked at.
const CELLS: f64 = 700.0;

/// Vertices of the scene's mesh, or of a coarser one; none where there is none soon.
fn points(scene: &Scene) -> Vec<Point> {
    let cells = scene.mesh.expected().unwrap_or(0.0);
    let coarse = || forecast::smaller(&scene.mesh, (cells / CELLS).sqrt(), scene.source()).map(|(_, mesh)| mesh);
    let mesh = if cells > 2.0 * CELLS { coarse() } else { build_mesh(scene).ok() };
    mesh.map_or_else(Vec::new, |mesh| mesh.vertices.clone())
}
