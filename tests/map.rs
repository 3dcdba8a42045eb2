//! Maps: colours, mask, contour lines, arrows, files, the command, and the cuts that go with them.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::atomic::AtomicBool;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use monolayer::measure::fields::{self, TissueFields};
use monolayer::mesh::Point;
use monolayer::model::State;
use monolayer::model::fields::{POLARITY, PRESSURE, VELOCITY};
use monolayer::output::plot::map::{Layer, Map, Palette, Window, contours, nice_levels};
use monolayer::output::plot::{PNG_SCALE, PlotError};
use monolayer::output::progress::Verbosity;
use monolayer::run::maps::{Caption, Draft};
use monolayer::run::{self, Options, RunError, Setup};
use monolayer::scene::{ArrowsOf, MapOptions, MapRequest, Quantity, Scene, SceneError, SceneSource};
use monolayer::schema::Listed;
use monolayer::space::project::interpolate_vector;
use tiny_skia::Pixmap;

static NEVER: AtomicBool = AtomicBool::new(false);

/// Tissue that turns about the middle of a square; its polarity has the Laplacian (2, 0).
const SQUARE: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
peclet = 2.0
coherence = 0.5
elasticity = 0.4

[mesh]
shape = "square"
length = [-1.0, 1.0]
n = 4

[boundary]
left = { velocity = { dirichlet = ["2*y", "-2*x"] }, polarity = { dirichlet = ["x^2", "0"] } }
right = { velocity = { dirichlet = ["2*y", "-2*x"] }, polarity = { dirichlet = ["x^2", "0"] } }
bottom = { velocity = { dirichlet = ["2*y", "-2*x"] }, polarity = { dirichlet = ["x^2", "0"] } }
top = { velocity = { dirichlet = ["2*y", "-2*x"] }, polarity = { dirichlet = ["x^2", "0"] } }

[initial]
polarity = ["x^2", "0"]

[time]
scheme = "bdf1"
step = 1e-9
end = 1e-9

[[output]]
maps = ["speed", { of = "polarity_laplacian_1", name = "spread", arrows = "velocity", streamlines = true, mesh = true }]
[[output]]
cuts = [{ name = "circle", center = [0.1, 0.0], radius = 0.5, points = 8 },
    { name = "far", centre = [0, 0], radius = 1.2 }]
[[output]]
fields = ["polarity_laplacian"]
"#;

/// A disc in a strip.
const STRIP: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
peclet = 2.0
coherence = 0.5

[mesh]
shape = "strip-with-disc"
length = [-4.0, 6.0]
width = 6.0
h = 1.6
h_disc = 0.5

[boundary.inlet]
velocity = { dirichlet = ["1", "0"] }
polarity = { dirichlet = ["1", "0"] }
[boundary.outlet]
velocity = "traction"
polarity = "neumann"
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[boundary.disc]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = ["1 + x + 2*y", "0"]

[time]
scheme = "bdf1"
step = 0.1
end = 0.1
"#;

fn scene(text: &str, sets: &[(&str, &str)]) -> Result<Scene, SceneError> {
    let mut source = SceneSource::parse(text, Path::new("test.toml"))?;
    for (key, value) in sets {
        source.set(key, value)?;
    }
    Scene::check(source)
}

fn request(name: &str) -> MapRequest {
    let (name, of) = (name.to_owned(), Quantity::named(name).expect("a quantity"));
    MapRequest { name, of, arrows: None, streamlines: false, mesh: false, window: None, range: None }
}

/// Where the first image of an SVG is on paper: left, top, width, height.
fn place(svg: &str) -> [f64; 4] {
    let image = svg.split("<image").nth(1).and_then(|s| s.split("/>").next()).expect("an image");
    ["x", "y", "width", "height"].map(|name| {
        let value = image.split(&format!(" {name}=\"")).nth(1).and_then(|s| s.split('"').next()).expect(name);
        value.parse().expect("a number")
    })
}

/// The pixel of the PNG that shows the pixel (i, j) of the map, from its upper left corner.
fn pixel(png: &Pixmap, [left, top, ..]: [f64; 4], i: usize, j: usize) -> [u8; 3] {
    let at = |from: f64, k: usize| (from * f64::from(PNG_SCALE)).round() as u32 + k as u32;
    let colour = png.pixel(at(left, i), at(top, j)).expect("inside");
    [colour.red(), colour.green(), colour.blue()]
}

/// The middle of the pixel (i, j) in the window.
fn middle(window: &Window, [_, _, width, height]: [f64; 4], i: usize, j: usize) -> Point {
    let scale = f64::from(PNG_SCALE);
    window.at((i as f64 + 0.5) / (width * scale), 1.0 - (j as f64 + 0.5) / (height * scale))
}

fn near(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1)
}

#[test]
fn each_pixel_has_the_colour_of_the_value_at_its_middle() {
    let linear = |x: Point| Some(x.x + 2.0 * x.y).filter(|_| x.x < 0.75);
    let window = Window::new([-1.0, -0.5], [1.0, 0.5]).expect("window");
    for (palette, range) in [(Palette::Sequential, None), (Palette::Diverging, Some([-1.0, 1.5]))] {
        let picture = Map { palette, range, name: "u".into(), ..Map::new(window, &linear) }.draw().expect("drawn");
        let png = Pixmap::decode_png(&picture.png().expect("png")).expect("readable");
        let at = place(&picture.svg());
        let [columns, rows] = [at[2], at[3]].map(|side| (side * f64::from(PNG_SCALE)) as usize);
        assert!((columns as f64 / rows as f64 - 2.0).abs() < 2e-3, "axes of one scale: {columns} x {rows}");
        for (i, j) in [(40, 40), (columns / 2, rows / 2), (columns / 3, rows - 30), (2 * columns / 3, 25)] {
            let x = middle(&window, at, i, j);
            let wanted = palette.colour(x.x + 2.0 * x.y, picture.range());
            assert_eq!(pixel(&png, at, i, j), wanted, "{palette:?} at {x:?}");
        }
        assert_eq!(pixel(&png, at, columns - 20, rows / 2), [255; 3], "nothing there");
        let half = 0.5 / columns as f64 * 2.0;
        assert!((picture.extent()[0] + 2.0).abs() < 4.0 * half, "{:?}", picture.extent());
        assert_eq!(picture.range(), range.unwrap_or(picture.extent()));
    }
}

#[test]
fn palettes_have_their_ends_and_their_middle() {
    let diverging = |v: f64| Palette::Diverging.colour(v, [-1.0, 2.0]);
    let [red, green, blue] = diverging(0.0);
    let (dark, light) = (red.min(green).min(blue), red.max(green).max(blue));
    assert!(dark > 230 && light - dark < 8, "zero is nearly white: {red} {green} {blue}");
    assert!(diverging(2.0)[0] > 2 * diverging(2.0)[2], "red above");
    assert!(diverging(-1.0)[2] > diverging(-1.0)[0] + 50, "blue below, half as strong as the red above");
    assert_eq!(diverging(7.0), diverging(2.0), "beyond the end");
    let grey = |v: f64| {
        let [r, g, b] = Palette::Sequential.colour(v, [0.0, 1.0]).map(f64::from);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    assert!((0..50).all(|k| grey(f64::from(k + 1) / 50.0) > grey(f64::from(k) / 50.0)), "lighter and lighter");
}

#[test]
fn fields_are_exact_and_the_hole_is_white() {
    let scene = scene(STRIP, &[]).expect("scene");
    let setup = Setup::new(&scene).expect("setup");
    let march = setup.start(&scene).expect("start");
    let fields = TissueFields { model: &*setup.model, state: &march.state, t: 0.0 };
    let draft = Draft::new(&fields, &setup.ground, 0.0);
    let (low, high) = ([-2.0, -2.0], [2.0, 1.5]);
    let request = MapRequest { window: Some([low, high]), ..request("polarity_1") };
    let picture = draft.draw(&request, &Caption::of(&scene)).expect("drawn");
    let png = Pixmap::decode_png(&picture.png().expect("png")).expect("readable");
    let (at, window) = (place(&picture.svg()), Window::new(low, high).expect("window"));
    let [columns, rows] = [at[2], at[3]].map(|side| (side * f64::from(PNG_SCALE)) as usize);
    let mut counts = (0, 0);
    for (j, i) in (3..rows - 3).step_by(7).flat_map(|j| (3..columns - 3).step_by(7).map(move |i| (j, i))) {
        let x = middle(&window, at, i, j);
        let found = pixel(&png, at, i, j);
        if x.norm() < 0.99 {
            assert_eq!(found, [255; 3], "{x:?} is in the hole");
            counts.0 += 1;
        } else if x.norm() > 1.01 {
            // the initial polarity is linear: on any mesh its values are those of the formula
            let wanted = Palette::Diverging.colour(1.0 + x.x + 2.0 * x.y, picture.range());
            assert!(near(found, wanted), "{x:?}: {found:?} is not {wanted:?}");
            counts.1 += 1;
        }
    }
    assert!(counts.0 > 1000 && counts.1 > 3000, "{counts:?}");
    let extent = picture.extent();
    assert!((extent[0] + 5.0).abs() < 0.02 && (extent[1] - 6.0).abs() < 0.02, "{extent:?}");
}

#[test]
fn contour_lines_are_where_the_levels_are() {
    let hill = |x: Point| (x.x < 0.6).then(|| x.norm_squared());
    let window = Window::new([-1.0, -1.0], [1.0, 1.0]).expect("window");
    let lines = contours(&hill, &window, [200, 200], &[0.25, 0.49]);
    assert_eq!(lines.len(), 2);
    for (line, level) in lines.iter().zip([0.25f64, 0.49]) {
        assert!(line.iter().all(|x| (x.norm() - level.sqrt()).abs() < 1e-4));
    }
    assert_eq!(lines[0].first(), lines[0].last(), "a closed line");
    let ends = [lines[1][0], lines[1][lines[1].len() - 1]];
    assert!(ends.iter().all(|x| x.x > 0.57 && x.x < 0.6), "a line that ends where values end: {ends:?}");
    // length of the first circle
    let length: f64 = lines[0].windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    assert!((length - std::f64::consts::PI).abs() < 1e-3, "{length}");

    let (levels, step) = nice_levels([-5.0, 5.0], 12);
    assert_eq!((step, levels.len(), levels[0], levels[9]), (1.0, 10, -4.5, 4.5));
    assert_eq!(nice_levels([2.0, 2.0], 12).0, Vec::<f64>::new());
}

#[test]
fn streamlines_of_turning_tissue_are_circles() {
    let scene = scene(SQUARE, &[]).expect("scene");
    let setup = Setup::new(&scene).expect("setup");
    let march = setup.start(&scene).expect("start");
    let model = &setup.model;
    let v = interpolate_vector(model.space(VELOCITY), |x| Point::new(2.0 * x.y, -2.0 * x.x));
    let state = State::incompressible(v, march.state[PRESSURE].clone(), march.state[POLARITY].clone());
    let fields = TissueFields { model: &*setup.model, state: &state, t: 0.0 };
    let draft = Draft::new(&fields, &setup.ground, 0.0);
    let (low, high) = ([-1.2, -1.2], [1.2, 1.2]);
    let request = MapRequest { window: Some([low, high]), streamlines: true, ..request("speed") };
    let svg = draft.draw(&request, &Caption::of(&scene)).expect("drawn").svg();
    // ψ = x² + y² less its mean 2/3, with the spacing that is told
    let step: f64 = svg.split("Δψ = ").nth(1).and_then(|s| s.split('<').next()).expect("told").parse().expect("number");
    let [left, top, width, height] = place(&svg);
    let group = svg.split("<title>Δψ</title>").nth(1).and_then(|s| s.split("</g>").next()).expect("lines");
    let mut levels = std::collections::BTreeSet::new();
    for line in group.split("points=\"").skip(1) {
        let points = line.split('"').next().expect("points");
        for point in points.split(' ') {
            let (x, y) = point.split_once(',').expect("two numbers");
            let (x, y): (f64, f64) = (x.parse().expect("x"), y.parse().expect("y"));
            let x = Point::new(low[0] + 2.4 * (x - left) / width, high[1] - 2.4 * (y - top) / height);
            let level = (x.norm_squared() - 2.0 / 3.0) / step - 0.5;
            assert!((level - level.round()).abs() * step < 2e-3, "{x:?} lies between two levels: {level}");
            levels.insert(level.round() as i64);
        }
    }
    assert!((8..=30).contains(&levels.len()), "{levels:?}");
}

#[test]
fn arrows_point_along_the_vector_and_tell_their_scale() {
    let one = |_: Point| Some(1.0);
    let up = |x: Point| Some(Point::new(0.0, 3.0 * (1.0 + x.x)));
    let window = Window::new([0.0, 0.0], [1.0, 1.0]).expect("window");
    let layers = vec![Layer::Arrows { name: "|w|".into(), of: &up }];
    let svg = Map { layers, ..Map::new(window, &one) }.draw().expect("drawn").svg();
    let group = svg.split("<title>|w|</title>").nth(1).and_then(|s| s.split("</g>").next()).expect("arrows");
    let bodies: Vec<Vec<(f64, f64)>> = group
        .split("points=\"")
        .skip(1)
        .filter(|polygon| polygon.contains("fill=\"#222222\""))
        .map(|polygon| {
            let points = polygon.split('"').next().expect("points").split(' ');
            points
                .map(|p| p.split_once(',').expect("two"))
                .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
                .collect()
        })
        .collect();
    assert!(bodies.len() > 200, "{}", bodies.len());
    let [left, _, width, _] = place(&svg);
    let length = |body: &Vec<(f64, f64)>| {
        let lowest = body.iter().map(|p| p.1).fold(f64::MIN, f64::max);
        // the tip is the fourth corner
        (body[3].0, lowest - body[3].1)
    };
    let scale = |body: &Vec<(f64, f64)>| {
        let (x, long) = length(body);
        long / (3.0 * (1.0 + (x - left) / width))
    };
    assert!(bodies.iter().all(|b| length(b).1 > 0.0), "upwards");
    let first = scale(&bodies[0]);
    assert!(bodies.iter().all(|b| (scale(b) / first - 1.0).abs() < 2e-2), "lengths in proportion");
    assert!(svg.contains("|w| = 5"), "the largest round number below 6");
}

/// The names and texts of an SVG, read as XML.
fn texts(svg: &str) -> String {
    use quick_xml::events::Event;
    let mut reader = quick_xml::Reader::from_str(svg);
    let (mut text, mut depth) = (String::new(), 0);
    loop {
        match reader.read_event().expect("well-formed") {
            Event::Start(_) => depth += 1,
            Event::End(_) => depth -= 1,
            Event::Text(part) => text.push_str(&part),
            Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!(depth, 0);
    text
}

#[test]
fn pictures_are_well_formed_told_and_the_same_every_time() {
    let scene = scene(SQUARE, &[]).expect("scene");
    let setup = Setup::new(&scene).expect("setup");
    let march = setup.start(&scene).expect("start");
    let fields = TissueFields { model: &*setup.model, state: &march.state, t: 0.125 };
    let draft = Draft::new(&fields, &setup.ground, 0.125);
    let arrows = Some(ArrowsOf(&fields::POLARITY));
    let request = MapRequest { arrows, streamlines: true, mesh: true, range: Some([0.0, 0.5]), ..request("speed") };
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let picture = pool.install(|| draft.draw(&request, &Caption::of(&scene))).expect("drawn");
        (picture.svg(), picture.png().expect("png"))
    };
    let (svg, png) = draw(1);
    assert!((svg.clone(), png) == draw(3), "bytes depend on the threads");
    // a parameter is not torn from its value
    let text = texts(&svg).replace('\u{a0}', " ");
    for part in ["speed |v| at t = 0.125", "Pe = 2", "κ = 0.5", "a = 1", "(clipped)", "Δψ", "|p| = 0.5"] {
        assert!(text.contains(part), "{part} is not told: {text}");
    }
    let encoded = svg.split("base64,").nth(1).and_then(|s| s.split('"').next()).expect("an image");
    let image = Pixmap::decode_png(&BASE64.decode(encoded).expect("base64")).expect("a PNG");
    let [_, _, width, height] = place(&svg);
    assert_eq!((image.width(), image.height()), ((2.0 * width) as u32, (2.0 * height) as u32));
    // no text is smaller than 7 points when the picture is 8 cm wide
    let sizes = svg.split("<text ").skip(1).filter_map(|t| t.split("font-size=\"").nth(1)?.split('"').next());
    let smallest = sizes.map(|s| s.parse::<f64>().expect("a size")).fold(f64::MAX, f64::min);
    assert!(smallest * 80.0 / 25.4 * 72.0 / 840.0 > 6.99, "{smallest}");
}

#[test]
fn every_quantity_can_be_drawn() {
    let scene = scene(STRIP, &[("model.elasticity", "0.4")]).expect("scene");
    let setup = Setup::new(&scene).expect("setup");
    let march = setup.start(&scene).expect("start");
    let fields = TissueFields { model: &*setup.model, state: &march.state, t: 0.0 };
    let draft = Draft::new(&fields, &setup.ground, 0.0);
    let drawable = |of: &Quantity| {
        let options = MapOptions::of(*of);
        options.check(&scene.parameters).and_then(|()| options.check_strain(scene.strain)).is_ok()
    };
    let all: Vec<Quantity> = Quantity::all().filter(drawable).collect();
    assert_eq!(all.len() + 5, Quantity::all().count(), "but for the density, the strain and bodies alone");
    for of in all {
        let thin = MapRequest { window: Some([[-4.0, 1.1], [6.0, 1.6]]), ..request(of.name()) };
        let [low, high] = draft.extent(&thin, &Caption::of(&scene)).expect("sampled");
        assert!(low <= high && low.is_finite() && high.is_finite(), "{}", of.name());
        let Quantity::Of(scalar) = of else { panic!("bodies have no field") };
        assert!(scalar.part.signed || low >= 0.0, "{}", of.name());
    }
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().expect("started")
}

#[test]
fn a_run_leaves_maps_and_cuts_and_the_command_draws_the_same() {
    let root = tempfile::tempdir().expect("folder");
    let out = root.path().join("square");
    let scene = scene(SQUARE, &[]).expect("scene");
    let options = Options { out: out.clone(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    run::run(&scene, &options).expect("run");
    for name in ["speed", "spread"].map(|name| format!("plots/{name}-000001")) {
        assert!(out.join(format!("{name}.svg")).is_file() && out.join(format!("{name}.png")).is_file(), "{name}");
    }
    // κ²Δp = (0.5, 0), to rounding: the discrete Laplacian of a quadratic is exact where its boundary data are
    let table = std::fs::read_to_string(out.join("cuts/circle.csv")).expect("table");
    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("theta,x1,x2,v1,v2,pressure,p1,p2,laplacian1,laplacian2"));
    let rows: Vec<Vec<f64>> = rows.map(|r| r.split(',').map(|v| v.parse().expect("number")).collect()).collect();
    assert_eq!(rows.len(), 8);
    for (k, row) in rows.iter().enumerate() {
        let angle = std::f64::consts::TAU * k as f64 / 8.0;
        assert!((row[0] - angle).abs() < 1e-14);
        assert!((row[1] - 0.1 - 0.5 * angle.cos()).abs() < 1e-14 && (row[2] - 0.5 * angle.sin()).abs() < 1e-14);
        assert!((row[6] - row[1] * row[1]).abs() < 1e-6, "{row:?}");
        assert!((row[8] - 0.5).abs() < 1e-5 && row[9].abs() < 1e-5, "{row:?}");
    }
    // of the large circle only the parts in the corners lie in the square
    let far = std::fs::read_to_string(out.join("cuts/far.csv")).expect("table");
    // 23 degrees in each of them, and the head
    assert_eq!(far.lines().count(), 4 * 23 + 1);
    let vtu = std::fs::read_to_string(out.join("fields/step-000001.vtu")).expect("fields");
    assert!(vtu.contains("Name=\"polarity_laplacian\" NumberOfComponents=\"3\""));

    let drawn = program(&["map", "square", "--of", "speed", "--out", "pictures"], root.path());
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    for ending in ["svg", "png"] {
        let before = std::fs::read(out.join(format!("plots/speed-000001.{ending}"))).expect("picture");
        let after = std::fs::read(root.path().join(format!("pictures/square-speed-000001.{ending}"))).expect("picture");
        assert!(before == after, "{ending} from the checkpoint differs");
    }
    nothing_is_replaced(root.path());
    two_runs_of_one_range(root.path());
    commands_that_fail(root.path());
}

/// Maps of a run go beside its own pictures, and other maps beside those.
fn nothing_is_replaced(root: &Path) {
    let plots = || {
        let read =
            std::fs::read_dir(root.join("square/plots")).expect("folder").map(|entry| entry.expect("entry").path());
        let mut all: Vec<_> = read.map(|path| (std::fs::read(&path).expect("picture"), path)).collect();
        all.sort();
        all
    };
    let maps = || {
        let read = std::fs::read_dir(root.join("square/maps")).expect("folder");
        let mut names: Vec<_> =
            read.map(|entry| entry.expect("entry").file_name().into_string().expect("name")).collect();
        names.sort();
        names
    };
    let draw = |options: &[&str]| {
        let drawn = program(&[&["map", "square", "--of", "speed"], options].concat(), root);
        assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
        String::from_utf8_lossy(&drawn.stdout).into_owned()
    };
    let before = plots();
    assert!(draw(&[]).contains("square/maps/speed-000001.png"));
    assert_eq!(maps(), ["speed-000001.png", "speed-000001.svg"]);
    draw(&[]);
    assert_eq!(maps().len(), 2, "the same picture is there already");
    assert!(draw(&["--range", "0,9"]).contains("square/maps/speed-000001-2.png"));
    draw(&["--mesh"]);
    let names =
        ["speed-000001-2", "speed-000001-3", "speed-000001"].map(|name| [".png", ".svg"].map(|e| name.to_owned() + e));
    assert_eq!(maps(), names.concat());
    assert!(plots() == before, "the run's own pictures are as they were");
}

/// A second run with twice the speed.
fn two_runs_of_one_range(root: &Path) {
    let fast = scene(&SQUARE.replace("\"2*y\", \"-2*x\"", "\"4*y\", \"-4*x\""), &[]).expect("scene");
    let options = Options { out: root.join("fast"), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    run::run(&fast, &options).expect("run");
    let drawn = program(&["map", "square", "fast", "--same-range", "--of", "speed", "--out", "both"], root);
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    let bars: Vec<String> = ["square", "fast"]
        .map(|run| std::fs::read_to_string(root.join(format!("both/{run}-speed-000001.svg"))).expect("picture"))
        .iter()
        .map(|svg| svg.split("<title>colours</title>").nth(1).and_then(|s| s.split("</g>").next()).unwrap().to_owned())
        .collect();
    assert_eq!(bars[0], bars[1], "one colour bar");
    assert!(bars[0].contains(">5<"), "up to 4√2");
}

fn commands_that_fail(root: &Path) {
    let fails = |arguments: &[&str], parts: &[&str]| {
        let output = program(arguments, root);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{arguments:?}");
        parts.iter().for_each(|part| assert!(message.contains(part), "{part} is not in: {message}"));
    };
    fails(&["map", "nowhere"], &["nowhere", "scene.toml", "hint"]);
    fails(&["map", "square", "--of", "speeed"], &["speeed", "speed", "polarity_laplacian"]);
    fails(&["map", "square", "--of", "density"], &["square", "`of`", "density of an incompressible sheet", "hint"]);
    fails(&["map", "square", "--window", "-1,-1,1"], &["`--window` has 3 numbers", "hint"]);
    fails(&["map", "square", "--window", "1,-1,-1,1"], &["`window`", "lower left", "hint"]);
    fails(&["map", "square", "--window", "5,5,6,6"], &["map `speed`", "no value in the window", "hint"]);
    fails(&["map", "square", "--range", "2,1"], &["`range` = [2, 1]", "smaller one first"]);
    std::fs::remove_file(root.join("fast/checkpoint.bin")).expect("removed");
    fails(&["map", "fast"], &["fast", "no checkpoint.bin"]);
}

#[test]
fn wrong_scenes_are_refused() {
    let wrong = |sets: &[(&str, &str)], parts: &[&str]| {
        let message = match scene(SQUARE, sets) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{sets:?} was taken"),
        };
        parts.iter().for_each(|part| assert!(message.contains(part), "{part} is not in: {message}"));
    };
    let maps = "output.0.maps";
    wrong(&[(maps, "[\"density\"]")], &["`output.0.maps.0` = \"density\"", "incompressible", "hint"]);
    wrong(&[(maps, "[\"sped\"]")], &["`output.0.maps.0`", "did you mean", "speed"]);
    wrong(&[(maps, "[]")], &["`output.0.maps` = []", "empty"]);
    wrong(&[(maps, "[\"speed\", { of = \"speed\", mesh = true }]")], &["two maps", "`name`"]);
    wrong(&[(maps, "[{ of = \"speed\", arrow = \"velocity\" }]")], &["no key `output.0.maps.0.arrow`", "arrows"]);
    wrong(
        &[(maps, "[{ of = \"speed\", arrows = \"pressure\" }]")],
        &["`output.0.maps.0.arrows`", "velocity, polarity"],
    );
    wrong(&[(maps, "[{ of = \"speed\", name = \"a/b\" }]")], &["`output.0.maps.0.name` = \"a/b\"", "file name"]);
    wrong(
        &[(maps, "[{ of = \"speed\", window = [[1, 0], [0, 1]] }]")],
        &["`output.0.maps.0.window` = [[1, 0], [0, 1]]", "lower left"],
    );
    wrong(&[(maps, "[{ of = \"speed\", window = [[0, 0], [100, 1]] }]")], &["25 times"]);
    wrong(&[(maps, "[{ of = \"speed\", range = [1, 1] }]")], &["`output.0.maps.0.range` = [1, 1]", "smaller"]);
    wrong(&[("output.0.cuts", "[\"axis-1\"]")], &["exactly one of", "`maps`"]);
    let cuts = "output.1.cuts";
    wrong(&[(cuts, "[{ name = \"c\", radius = 1 }]")], &["`output.1.cuts.0.centre` is missing"]);
    wrong(
        &[(cuts, "[{ name = \"c\", centre = [0, 0], radius = 0 }]")],
        &["`output.1.cuts.0.radius` = 0", "greater than 0"],
    );
    wrong(
        &[(cuts, "[{ name = \"c\", centre = [0, 0], radius = 1, to = [1, 1] }]")],
        &["`output.1.cuts.0.to`", "no ends"],
    );
    wrong(&[(cuts, "[{ name = \"c\", centre = [0, 0], radius = 1, points = 2 }]")], &["between 3 and"]);

    let compressible = SQUARE
        .replace("\"incompressible\"", "\"compressible\"\ndensity = { penalty = 1.0 }")
        .replace("polarity = { dirichlet", "density = 1.0, polarity = { dirichlet")
        .replace("[initial]", "[initial]\ndensity = 1.0");
    let message = scene(&compressible, &[]).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(message.contains("`output.0.maps.1.streamlines` = true") && message.contains("hint"), "{message}");
    assert!(scene(&compressible, &[(maps, "[\"density\"]")]).is_ok());
}

#[test]
fn a_window_beside_the_domain_is_refused_before_anything_is_solved() {
    let root = tempfile::tempdir().expect("folder");
    let sets = [("output.0.maps", "[\"polarity\", { of = \"speed\", window = [[3, 3], [4, 4]] }]")];
    let options = Options { out: root.path().join("a"), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let error = run::run(&scene(SQUARE, &sets).expect("scene"), &options).expect_err("refused");
    let text = error.to_string();
    assert!(matches!(error, RunError::Map { .. }), "{text}");
    assert!(text.contains("output.0.maps") && text.contains("`speed` has no value") && text.contains("hint"), "{text}");
    assert!(matches!(Window::new([0.0, 0.0], [0.0, 1.0]), Err(PlotError::Window { .. })));
    assert!(Window::new([0.0, f64::NAN], [1.0, 1.0]).is_err());
}

#[test]
fn scenes_with_maps_and_circles_come_back_as_they_are() {
    let first = scene(SQUARE, &[]).expect("scene");
    let text = first.resolved_toml();
    let second = Scene::parse(&text, Path::new("test.toml")).expect("parses");
    assert_eq!(first.outputs, second.outputs);
    assert!(text.contains("points = 360"), "defaults are filled in: {text}");
}
