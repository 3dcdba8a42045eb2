//! Files and pictures of rigid bodies hold what was given, and a resumed run leaves those of an uninterrupted one.

use std::path::Path;
use std::process::{Command, Output};

use monolayer::contact::{Contact, Partner, Wall};
use monolayer::measure::bodies::{Load, kinetic_energy, loads, overlap, smallest_gap, touching, wall_force};
use monolayer::mesh::Point;
use monolayer::output::bodies::{
    BodyFiles, BodyOutputs, Colour, Look, Member, Moment, Solids, overlay, picture, write_bodies, write_contacts,
    write_walls,
};
use monolayer::output::frames::durations;
use monolayer::output::plot::map::{Map, Window};
use monolayer::output::pvd::{Entry, Series};
use monolayer::output::timed::TimedTable;
use monolayer::results::bodies::{BodiesAtTime, tracks};
use monolayer::shape::{Disc, Ellipse, Polygon, Pose, Shape, Twist};
use tiny_skia::Pixmap;
use vtkio::model::{Attribute, DataSet, IOBuffer, PolyDataPiece, VertexNumbers, Vtk};

fn at(x: f64, y: f64) -> Point {
    Point::new(x, y)
}

fn member(name: &str, shape: Shape) -> Member {
    Member { name: name.into(), shape, fixed: false }
}

/// A disc on a ground, and a square beside it that touches it.
fn solids() -> Solids {
    let square = Shape::from(Polygon { vertices: vec![at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)] });
    Solids {
        bodies: vec![member("disc, the \"first\"", Shape::from(Disc { radius: 0.25 })), member("square", square)],
        walls: vec![
            Wall::Segment([at(-1.0, 0.0), at(2.0, 0.0)]),
            Wall::Hollow { centre: at(0.5, 0.0), radius: 3.0 },
            Wall::Disc { centre: at(1.0, 2.0), radius: 0.1 },
        ],
    }
}

fn poses() -> [Pose; 2] {
    [Pose { position: at(0.0, 0.25), angle: 0.5 }, Pose { position: at(0.75, 0.5), angle: 0.0 }]
}

fn twists() -> [Twist; 2] {
    [Twist { velocity: at(3.0, -4.0), spin: 2.0 }, Twist { velocity: at(0.1, 0.0), spin: -1.0 }]
}

fn contacts() -> [Contact; 3] {
    let contact = |body, partner, gap, force, point, normal| Contact {
        body,
        partner,
        gap,
        force,
        friction: 0.0,
        gamma: 0.0,
        point,
        normal,
    };
    [
        contact(0, Partner::Body(1), -1e-12, 2.0, at(0.25, 0.25), at(1.0, 0.0)),
        contact(0, Partner::Wall(0), 0.125, 0.0, at(0.0, 0.0), at(0.0, -1.0)),
        Contact { gamma: -0.5, ..contact(1, Partner::Wall(0), 0.0, -3.0, at(0.75, 0.0), at(0.0, -1.0)) },
    ]
}

fn with<R>(solids: &Solids, time: f64, poses: &[Pose], then: impl FnOnce(&Moment) -> R) -> R {
    let (contacts, twists) = (contacts(), twists());
    let loads = loads(poses, &contacts);
    then(&Moment { solids, time, poses, twists: &twists, flow: &[], loads: &loads, contacts: &contacts })
}

fn parse(path: &Path) -> PolyDataPiece {
    let DataSet::PolyData { pieces, .. } = Vtk::import(path).unwrap().data else { panic!("other data set") };
    let [piece] = <[_; 1]>::try_from(pieces).unwrap();
    piece.into_loaded_piece_data(None).unwrap()
}

fn floats(buffer: &IOBuffer) -> Vec<f64> {
    let IOBuffer::F64(values) = buffer else { panic!("{:?}", buffer.scalar_type()) };
    values.clone()
}

fn cell_data(piece: &PolyDataPiece, wanted: &str) -> Vec<f64> {
    let found = piece.data.cell.iter().find_map(|attribute| match attribute {
        Attribute::DataArray(array) if array.name == wanted => Some(array.data.cast_into::<f64>().unwrap()),
        Attribute::DataArray(_) | Attribute::Field { .. } => None,
    });
    found.unwrap_or_else(|| panic!("no array {wanted}"))
}

fn ends(cells: &VertexNumbers) -> Vec<u64> {
    cells.clone().into_xml().1
}

#[test]
fn polydata_hold_the_bodies_and_the_network_of_contacts() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let solids = solids();
    with(&solids, 0.1 + 0.2, &poses(), |moment| {
        write_bodies(&path("bodies.vtp"), moment).unwrap();
        write_contacts(&path("contacts.vtp"), moment).unwrap();
        write_contacts(&path("none.vtp"), &Moment { contacts: &[], ..*moment }).unwrap();
    });
    write_walls(&path("walls.vtp"), &solids.walls).unwrap();

    let bodies = parse(&path("bodies.vtp"));
    let points = floats(&bodies.points);
    let polygons = ends(bodies.polys.as_ref().unwrap());
    assert_eq!(polygons.len(), 2);
    let first = polygons[0] as usize;
    assert_eq!(
        points[3 * first..],
        [0.25, 0.0, 0.0, 1.25, 0.0, 0.0, 1.25, 1.0, 0.0, 0.25, 1.0, 0.0],
        "corners as they are"
    );
    assert!(points[..3 * first].chunks(3).all(|x| (x[0].hypot(x[1] - 0.25) - 0.25).abs() < 1e-15));
    // the outline begins where the body's first axis leaves it
    assert!((points[0] - 0.25 * 0.5_f64.cos()).abs() < 1e-15);
    assert_eq!(cell_data(&bodies, "body"), [0.0, 1.0]);
    assert_eq!(cell_data(&bodies, "position"), [0.0, 0.25, 0.0, 0.75, 0.5, 0.0]);
    assert_eq!(cell_data(&bodies, "angle"), [0.5, 0.0]);
    assert_eq!(cell_data(&bodies, "velocity"), [3.0, -4.0, 0.0, 0.1, 0.0, 0.0]);
    assert_eq!(cell_data(&bodies, "spin"), [2.0, -1.0]);
    assert_eq!(cell_data(&bodies, "contact_force"), [-2.0, 0.0, 0.0, 2.0, -3.0, 0.0]);
    // the push from the left acts a quarter below the square's centre
    assert_eq!(cell_data(&bodies, "contact_torque"), [0.0, 0.5]);
    assert!(std::fs::read_to_string(path("bodies.vtp")).unwrap().contains(">0.30000000000000004</DataArray>"));

    let network = parse(&path("contacts.vtp"));
    assert_eq!(ends(network.lines.as_ref().unwrap()), [2, 4, 6]);
    let lines = floats(&network.points);
    assert_eq!(lines[..6], [0.0, 0.25, 0.0, 0.75, 0.5, 0.0], "from centre to centre");
    assert_eq!(lines[6..12], [0.0, 0.25, 0.0, 0.0, -0.0625, 0.0], "from centre to wall, half a gap from the middle");
    assert_eq!(cell_data(&network, "multiplier"), [2.0, 0.0, -3.0]);
    assert_eq!(cell_data(&network, "gap"), [-1e-12, 0.125, 0.0]);
    assert_eq!(cell_data(&network, "gamma"), [0.0, 0.0, -0.5]);
    assert_eq!(cell_data(&network, "partner"), [1.0, 2.0, 2.0], "walls are numbered after the bodies");
    assert!(std::fs::read_to_string(path("none.vtp")).unwrap().contains(r#"NumberOfPoints="0""#));
    assert_eq!(ends(parse(&path("walls.vtp")).lines.as_ref().unwrap()), [2, 131, 260]);
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_the_name_of_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let solids = solids();
    let mut wrong = poses();
    wrong[1].angle = f64::NAN;
    let mut files =
        BodyFiles::new(folder.path(), solids.clone(), BodyOutputs { bodies: true, ..BodyOutputs::default() }, None)
            .unwrap();
    let table = std::fs::read(folder.path().join("bodies.csv")).unwrap();
    with(&solids, 0.0, &wrong, |moment| {
        let error = files.write(0, moment).unwrap_err().to_string();
        for part in ["bodies.csv", "`square`", "angle", "NaN", "hint"] {
            assert!(error.contains(part), "{error}");
        }
        assert!(files.parts(0, moment).is_err());
    });
    with(&solids, 0.0, &poses(), |moment| {
        let mut contacts = contacts();
        contacts[2].force = f64::INFINITY;
        let error = files.write(0, &Moment { contacts: &contacts, ..*moment }).unwrap_err().to_string();
        assert!(error.contains("the contact of `square` and `wall-1`") && error.contains("multiplier"), "{error}");
    });
    assert_eq!(std::fs::read(folder.path().join("bodies.csv")).unwrap(), table);
    assert_eq!(std::fs::read_dir(folder.path().join("bodies")).unwrap().count(), 0);
}

/// Writes the steps of a run that begins new or at a time.
fn write(folder: &Path, steps: std::ops::Range<usize>, resume: Option<f64>) {
    let solids = solids();
    let asked = BodyOutputs { bodies: true, contacts: true, pictures: true, flow: false };
    let mut files = BodyFiles::new(folder, solids.clone(), asked, resume).unwrap();
    let index = folder.join("fields.pvd");
    let mut fields = resume.map_or_else(|| Series::create(&index), |t| Series::resume(&index, t)).unwrap();
    for step in steps {
        let (t, mut poses) = (0.1 * step as f64, poses());
        poses[0].position.x -= t;
        with(&solids, t, &poses, |moment| {
            for _ in 0..2 {
                files.write(step, moment).unwrap();
            }
            fields.append(t, &format!("fields/step-{step:06}.vtu")).unwrap();
            fields.append_parts(t, &files.parts(step, moment).unwrap()).unwrap();
            files.note_picture("bodies", step, t).unwrap();
            files.note_picture("it's", step, t).unwrap();
        });
    }
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn a_resumed_run_leaves_the_files_of_an_uninterrupted_one() {
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    write(whole.path(), 0..5, None);
    // the checkpoint is of step 2, and a row was cut off when the run was killed
    write(parts.path(), 0..4, None);
    let table = parts.path().join("bodies.csv");
    std::fs::write(&table, text(parts.path(), "bodies.csv") + "0.4,square,0.7").unwrap();
    write(parts.path(), 2..5, Some(0.2));
    for name in
        ["bodies.csv", "contacts.csv", "bodies.pvd", "contacts.pvd", "fields.pvd", "frames.csv", "frames-bodies.txt"]
    {
        assert_eq!(text(whole.path(), name), text(parts.path(), name), "{name}");
    }
    let rows: Vec<_> = text(whole.path(), "bodies.csv").lines().map(str::to_owned).collect();
    assert_eq!(rows.len(), 1 + 5 * 2);
    assert_eq!(rows[0], "time,body,x,y,theta,vx,vy,spin,fx,fy,torque");
    assert_eq!(rows[1], "0,\"disc, the \"\"first\"\"\",0,0.25,0.5,3,-4,2,-2,0,0");
    assert_eq!(text(whole.path(), "contacts.csv").lines().nth(3), Some("0,square,wall-1,0,-3,-0.5,0.75,0,0"));

    let fields = text(whole.path(), "fields.pvd");
    let line =
        |part: usize, file: &str| format!("<DataSet timestep=\"0.4\" group=\"\" part=\"{part}\" file=\"{file}\"/>\n");
    let names = ["fields/step-000004.vtu", "bodies/step-000004.vtp", "bodies/contacts-000004.vtp", "bodies/walls.vtp"];
    let together: String = names.iter().enumerate().map(|(part, file)| line(part, file)).collect();
    assert!(fields.contains(&together), "{fields}");
    let read = Series::resume(&whole.path().join("bodies.pvd"), 0.0).unwrap();
    let entry = |part, file: &str| Entry { time: 0.0, part, file: file.into() };
    assert_eq!(read.entries(), [entry(0, "bodies/step-000000.vtp"), entry(1, "bodies/walls.vtp")]);

    let list = text(whole.path(), "frames-it's.txt");
    assert!(list.starts_with("ffconcat version 1.0\nfile 'plots/it'\\''s-000000.png'\nduration 0.04"), "{list}");
    assert_eq!(list.lines().filter(|line| line.starts_with("file")).count(), 6, "the last picture stays as long");
    assert_eq!(text(whole.path(), "frames.csv").lines().nth(3), Some("bodies,plots/bodies-000001.png,0.1,0.04"));

    std::fs::write(&table, "t,body\n").unwrap();
    let error = TimedTable::resume(&table, &["body", "x"], 0.0).unwrap_err().to_string();
    assert!(error.contains("columns are not time,body,x") && error.contains("hint"), "{error}");
}

#[test]
fn frames_last_in_proportion_to_time() {
    assert_eq!(durations(&[]), [0.0; 0]);
    assert_eq!(durations(&[3.0]), [0.04]);
    assert_eq!(durations(&[0.0, 1.0, 2.0, 4.0]), [0.04, 0.04, 0.08, 0.04]);
    // a last step that only lands on the end does not slow the film down
    assert!(durations(&[0.0, 1.0, 2.0, 2.0 + 1e-9])[2] >= 0.001);
}

#[test]
fn measures_by_hand() {
    let (contacts, twists) = (contacts(), twists());
    assert_eq!(
        kinetic_energy(&[2.0, 4.0], &[0.5, 3.0], &twists),
        0.5 * (2.0 * 25.0 + 0.5 * 4.0 + 4.0 * 0.1 * 0.1 + 3.0)
    );
    assert_eq!((smallest_gap(&contacts), smallest_gap(&[])), (Some(-1e-12), None));
    assert_eq!((overlap(&contacts), overlap(&contacts[1..])), (1e-12, 0.0));
    assert_eq!(touching(&contacts), 2);
    let wall = wall_force(&contacts);
    assert_eq!(wall, at(0.0, 3.0), "the glue pulls the wall up");
    let sum = loads(&poses(), &contacts).iter().fold(Load::ZERO.force, |sum, load| sum + load.force);
    assert_eq!(sum, -wall, "bodies push each other with opposite forces");
}

/// Left, top, width and height of the embedded image of a map.
fn image(svg: &str) -> [f64; 4] {
    let element = svg.split("<image").nth(1).expect("an image");
    ["x", "y", "width", "height"].map(|name| {
        let text = element.split(&format!(" {name}=\"")).nth(1).expect("an attribute");
        text.split('"').next().expect("a value").parse().expect("a number")
    })
}

const GREY: [u8; 3] = [0xc4; 3];

#[test]
fn bodies_are_drawn_where_they_are() {
    let solids = Solids {
        bodies: vec![
            member("moving", Shape::from(Disc { radius: 0.25 })),
            Member { fixed: true, ..member("fixed", Shape::from(Ellipse { semi_axes: [0.4, 0.1] })) },
        ],
        walls: Vec::new(),
    };
    // the ellipse is upright
    let up = std::f64::consts::FRAC_PI_2;
    let poses = [Pose { position: at(0.5, 1.25), angle: -0.75 * up }, Pose { position: at(1.9, 0.5), angle: up }];
    let twists = twists();
    let moment = Moment {
        solids: &solids,
        time: 0.0,
        poses: &poses,
        twists: &twists,
        flow: &[],
        loads: &[Load::ZERO; 2],
        contacts: &[],
    };
    let window = Window::new([0.0, 0.0], [2.0, 2.0]).unwrap();
    let slope = |x: Point| Some(x.x);
    let map = Map { title: "x".into(), layers: overlay(&moment, true), ..Map::new(window, &slope) }.draw().unwrap();
    let bare = Map { title: "x".into(), ..Map::new(window, &slope) }.draw().unwrap();
    let look = Look { title: Some("x".into()), window: Some(window), ..Look::default() };
    let alone = picture(&moment, &look).unwrap();
    let [left, top, width, height] = image(&bare.svg());
    let [above, below, alone] = [&map, &bare, &alone].map(|p| Pixmap::decode_png(&p.png().unwrap()).unwrap());
    let pixel = |of: &Pixmap, x: f64, y: f64| {
        let place = |start: f64, share: f64, size: f64| (2.0 * (start + share * size)) as u32;
        let colour = of.pixel(place(left, x / 2.0, width), place(top, 1.0 - y / 2.0, height)).unwrap();
        [colour.red(), colour.green(), colour.blue()]
    };
    // speed 5 is the largest of those that move: the last colour of the palette
    let last = colorous::VIRIDIS.eval_continuous(1.0).into_array();
    let inside = [(0.35, 1.25), (0.5, 1.48), (0.27, 1.25), (0.5, 1.30)];
    for (x, y) in inside {
        assert_eq!(pixel(&above, x, y), GREY, "({x}, {y})");
        assert_eq!(pixel(&alone, x, y), last, "({x}, {y})");
    }
    for (x, y) in [(0.5, 1.52), (0.23, 1.25), (1.77, 0.5), (1.9, 0.93), (1.0, 1.0)] {
        assert_eq!(pixel(&above, x, y), pixel(&below, x, y), "({x}, {y}): nothing of a body");
        assert_eq!(pixel(&alone, x, y), [255; 3], "({x}, {y})");
    }
    for (x, y) in [(1.9, 0.85), (1.83, 0.5), (1.98, 0.5), (1.9, 0.15)] {
        assert_eq!([pixel(&above, x, y), pixel(&alone, x, y)], [GREY; 2], "({x}, {y}): what never moves is grey");
    }
    let mark = pixel(&alone, 0.5 + 0.2 * poses[0].angle.cos(), 1.25 + 0.2 * poses[0].angle.sin());
    assert!(mark.iter().all(|c| *c < 0x60), "no mark of the angle: {mark:?}");
    assert_eq!(alone.width(), 1680);
}

#[test]
fn what_is_out_of_view_is_counted_and_no_bodies_are_no_error() {
    let solids = solids();
    let window = Some(Window::new([-0.5, 0.1], [0.1, 0.5]).unwrap());
    let svg =
        with(&solids, 0.0, &poses(), |moment| picture(moment, &Look { window, ..Look::default() }).unwrap().svg());
    assert!(svg.contains("1 body is out of view") && !svg.contains("bodies are out of view"));
    let all =
        with(&solids, 0.0, &poses(), |m| picture(m, &Look { colour: Colour::Name, ..Look::default() }).unwrap().svg());
    assert!(!all.contains("out of view") && all.contains("square</text>") && !all.contains("colours</title>"));
    let none = Solids::default();
    let empty = Moment { solids: &none, time: 0.5, poses: &[], twists: &[], flow: &[], loads: &[], contacts: &[] };
    assert!(picture(&empty, &Look::default()).unwrap().svg().contains("no bodies at"));
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn results_of_bodies_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    std::fs::create_dir(&run).unwrap();
    std::fs::write(run.join("scene.toml"), "[model]\nkind = \"particles\"\n").unwrap();
    write(&run, 0..3, None);

    let seen = BodiesAtTime::read(&run, None).unwrap().unwrap();
    let mut last = poses();
    last[0].position.x -= 0.2;
    assert_eq!(
        (seen.time, &seen.solids, &seen.poses[..], &seen.twists[..]),
        (0.2, &solids(), &last[..], &twists()[..])
    );
    assert_eq!(seen.contacts[2].partner, Partner::Wall(0));
    assert_eq!(BodiesAtTime::read(&run, Some(0.1)).unwrap().unwrap().poses[0].position.x, -0.1);
    assert_eq!(BodiesAtTime::read(&run, Some(0.15)).unwrap(), None);
    let (found, left_out) = tracks(&run, &[], 1).unwrap();
    assert_eq!((found[0].rows.len(), left_out), (3, 1));

    let drawn = program(&["map", "run", "--colour", "force", "--window", "-1,-1,2,2"], folder.path());
    assert!(drawn.status.success(), "{}", said(&drawn));
    assert!(text(&run, "maps/bodies-last.svg").contains("contact force"));
    let curves = program(&["plot", "run", "--what", "bodies", "--body", "square"], folder.path());
    assert!(curves.status.success(), "{}", said(&curves));
    assert!(text(&run, "plots/bodies-path.svg").contains("square"));

    for name in ["bodies-000000.png", "bodies-000001.png", "bodies-000002.png"] {
        std::fs::copy(run.join("maps/bodies-last.png"), run.join("plots").join(name)).unwrap();
    }
    let report = program(&["report", "run"], folder.path());
    assert!(report.status.success(), "{}", said(&report));
    let page = text(&run, "report.html");
    assert!(page.contains("bodies-000002.png") && !page.contains("bodies-000001.png"), "the last picture of a film");
    for part in
        ["ffmpeg -f concat -i frames-bodies.txt", "at t = 0.2", "disc, the &quot;first&quot;", "Rigid bodies with"]
    {
        assert!(page.contains(part), "{part}");
    }

    for (arguments, parts) in [
        (&["map", "run", "--of", "polarity"][..], &["--of polarity", "particles", "hint"][..]),
        (&["map", "run", "--mesh"], &["--mesh", "particles", "hint"]),
        (&["map", "run", "--window", "1,1,0,0"], &["window", "lower left", "hint"]),
        (&["plot", "run", "--what", "bodies", "--body", "disk"], &["--body disk", "no body", "bodies.csv"]),
        (&["map", "run", "--colour", "mass"], &["mass", "speed", "force", "name"]),
    ] {
        let output = program(arguments, folder.path());
        let error = said(&output);
        assert!(!output.status.success() && parts.iter().all(|part| error.contains(part)), "{error}");
    }
    std::fs::write(run.join("bodies.json"), "{}").unwrap();
    let error = BodiesAtTime::read(&run, None).unwrap_err().to_string();
    assert!(error.contains("bodies.json") && error.contains("hint"), "{error}");
}
