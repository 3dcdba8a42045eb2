//! The picture as a caller sees it: texts and geometry of the SVG, pixels of the PNG, hostile data.

use monolayer::output::plot::{Axis, Line, Markers, PNG_SCALE, Plot, PlotError, Scale, Series, Slope, Symbol};
use quick_xml::Reader;
use quick_xml::events::Event;

fn sample() -> Plot {
    let errors = |first: f64, order: f64| {
        [0.177, 0.0884, 0.0442].iter().map(|h: &f64| (*h, first * (h / 0.177).powf(order))).collect()
    };
    let mut series =
        vec![Series::new("v, L²(L²)", errors(5.26e-4, 3.0)), Series::new("Δ_h p, L^∞(L²)", errors(0.3, 2.0))];
    series.push(Series::new("Π <&> \"q\"", errors(2e-3, 2.5)));
    Plot {
        title: "Convergence & more".into(),
        subtitle: "κ = 0.1, ρ = 1".into(),
        x: Axis::log("mesh width h"),
        y: Axis::log("error ‖v − v_h‖"),
        series,
        slopes: vec![Slope { order: 2.0 }, Slope { order: 3.0 }],
    }
}

// Corners of all elements of one kind; fails if the document is not well-formed.
fn corners(svg: &str, element: &str) -> Vec<Vec<(f64, f64)>> {
    let (mut found, mut depth) = (Vec::new(), 0i32);
    let mut reader = Reader::from_str(svg);
    loop {
        match reader.read_event().expect("well-formed XML") {
            Event::Eof => break,
            Event::Start(e) => {
                depth += 1;
                e.attributes().for_each(|a| drop(a.expect("well-formed attribute")));
            }
            Event::Empty(e) => {
                for attribute in e.attributes() {
                    let attribute = attribute.expect("well-formed attribute");
                    if e.name().as_ref() == element && attribute.key.as_ref() == "points" {
                        found.push(attribute.value.split(' ').map(point).collect());
                    }
                }
            }
            Event::End(_) => depth -= 1,
            _ => {}
        }
    }
    assert_eq!(depth, 0, "every element is closed");
    found
}

fn point(pair: &str) -> (f64, f64) {
    let (x, y) = pair.split_once(',').expect("x,y");
    (x.parse().expect("x"), y.parse().expect("y"))
}

fn check(plot: &Plot, case: &str) -> String {
    let svg = plot.svg().unwrap_or_else(|e| panic!("{case}: {e}"));
    corners(&svg, "polygon");
    for wrong in ["NaN", "inf\"", "inf,", "inf "] {
        assert!(!svg.contains(wrong), "{case}: {wrong}");
    }
    plot.png().unwrap_or_else(|e| panic!("{case}: {e}"));
    svg
}

#[test]
fn svg_names_everything() {
    let plot = sample();
    let svg = check(&plot, "sample");
    for text in ["v, L²(L²)", "Δ_h p, L^∞(L²)", "Π &lt;&amp;&gt; &quot;q&quot;", "mesh width h", "error ‖v − v_h‖"]
    {
        assert!(svg.contains(text), "{text}");
    }
    assert!(svg.contains("Convergence &amp; more") && svg.contains("κ = 0.1, ρ = 1"));
    assert!(!svg.contains("left out"));
}

#[test]
fn triangles_have_their_order_and_cover_no_curve() {
    let svg = check(&sample(), "sample");
    let curves: Vec<_> = corners(&svg, "polyline").into_iter().filter(|p| p.len() == 3).collect();
    assert_eq!(curves.len(), 3);
    // The first curve has order 3, so it tells how steep one order is on paper.
    let first = &curves[0];
    let steepness = (first[2].1 - first[0].1) / (first[2].0 - first[0].0) / 3.0;
    let triangles: Vec<_> = corners(&svg, "polygon").into_iter().filter(|p| p.len() == 3).collect();
    assert_eq!(triangles.len(), 2);
    for (triangle, order) in triangles.iter().zip([2.0, 3.0]) {
        let (from, right, top) = (triangle[0], triangle[1], triangle[2]);
        let own = (top.1 - from.1) / (top.0 - from.0) / steepness;
        assert!((own - order).abs() < 0.02, "{own} instead of {order}");
        let samples = curves.iter().flat_map(|c| c.windows(2)).flat_map(|s| {
            (0..=100)
                .map(|k| f64::from(k) / 100.0)
                .map(|t| (s[0].0 + t * (s[1].0 - s[0].0), s[0].1 + t * (s[1].1 - s[0].1)))
        });
        let inside = |p: (f64, f64)| (from.0..=right.0).contains(&p.0) && (top.1..=from.1).contains(&p.1);
        assert!(!samples.into_iter().any(inside), "triangle {order}");
    }
}

#[test]
fn left_out_points_are_counted() {
    let mut plot = sample();
    plot.series[0].points.extend([(f64::NAN, 1.0), (0.1, f64::INFINITY), (0.1, 0.0), (-0.1, 1.0)]);
    assert!(check(&plot, "four").contains("4 points left out (not finite, or not positive on a log axis)"));
    plot.x.scale = Scale::Linear;
    plot.y.scale = Scale::Linear;
    let svg = check(&plot, "linear");
    assert!(svg.contains("2 points left out (not finite)") && svg.contains("2 reference slopes left out"));
}

#[test]
fn hostile_data_do_not_panic() {
    let extremes = [f64::NAN, f64::INFINITY, -f64::MAX, f64::MAX, -0.0, 5e-324, 1e-15, 1.0, 1.0 + f64::EPSILON];
    for (x, y) in [(Scale::Log, Scale::Log), (Scale::Linear, Scale::Log), (Scale::Linear, Scale::Linear)] {
        for a in extremes {
            for b in extremes {
                let mut plot = sample();
                (plot.x.scale, plot.y.scale) = (x, y);
                plot.series = vec![Series::new("s", vec![(a, b), (b, a), (a, a)])];
                plot.slopes = [0.0, -2.0, 1e300, 1e-300, f64::NAN].map(|order| Slope { order }).to_vec();
                let svg = plot.svg().unwrap_or_else(|e| panic!("{x:?} {y:?} {a} {b}: {e}"));
                assert!(!svg.contains("NaN") && !svg.contains("inf,"), "{x:?} {y:?} {a} {b}");
            }
        }
    }
}

#[test]
fn odd_plots_can_be_drawn() {
    check(&Plot::default(), "empty");
    let mut plot = sample();
    plot.series = vec![Series::new("one", vec![(0.1, 1e-3)])];
    check(&plot, "one point");
    plot.series = vec![Series::new("equal", vec![(0.1, 1e-3); 5])];
    check(&plot, "equal values");
    plot.series =
        (0..30).map(|i| Series::new(format!("curve {i}"), vec![(0.1, 10f64.powi(i - 15)), (1.0, 1.0)])).collect();
    plot.series[0].colour = Some(usize::MAX);
    check(&plot, "many curves");
    plot.title = format!("a\u{0}b\u{b}c {}", "x".repeat(500));
    plot.series[0].name = "y".repeat(500);
    plot.x.label = "z".repeat(500);
    check(&plot, "long and forbidden characters");
    plot.subtitle = "word ".repeat(100_000);
    assert!(matches!(plot.png(), Err(PlotError::Canvas { .. })));
}

#[test]
fn twelve_curves_look_different() {
    let mut plot = sample();
    plot.series = (0..12).map(|i| Series::new(format!("c{i}"), vec![(1.0 + f64::from(i), 1.0)])).collect();
    let svg = check(&plot, "twelve");
    let groups: Vec<&str> = svg.split("<g>").filter(|g| g.contains("<title>c")).collect();
    assert_eq!(groups.len(), 12);
    let colours = |g: &str| g.split('#').skip(1).map(|c| c[..6].to_owned()).find(|c| c != "ffffff");
    let distinct: std::collections::BTreeSet<_> = groups.iter().map(|g| colours(g)).collect();
    assert_eq!(distinct.len(), 12);
}

// A pitchfork at λ = 1: rest stable before it and unstable after, a flow that ends in a Hopf point at λ = 4, and 30
// points.
fn branches(x: Axis) -> Plot {
    let part = |name: &str, line, colour, from: f64, to: f64, y: &dyn Fn(f64) -> f64| {
        let points = (0..=50).map(|k| from + (to - from) * f64::from(k) / 50.0).map(|l| (l, y(l))).collect();
        Series { line, markers: Markers::None, colour: Some(colour), ..Series::new(name, points) }
    };
    let special = |name: &str, markers, points| Series {
        line: Line::None,
        markers,
        colour: Some(4),
        ..Series::new(name, points)
    };
    let flow = |l: f64| (l - 1.0).sqrt();
    let cloud = (0..30).map(|k| (2.0 + 1e-3 * f64::from(k), 1.5)).collect();
    let series = vec![
        part("rest", Line::Dashed, 0, 1.0, 8.0, &|_| 0.0),
        part("rest", Line::Solid, 0, 0.1, 1.0, &|_| 0.0),
        part("flow", Line::Solid, 1, 1.0, 4.0, &flow),
        part("flow", Line::Dashed, 1, 4.0, 8.0, &flow),
        part("flow", Line::Solid, 2, 1.0, 4.0, &|l| -flow(l)),
        special("pitchfork", Markers::Filled(Symbol::Circle), vec![(1.0, 0.0)]),
        special("Hopf", Markers::Open(Symbol::Diamond), vec![(4.0, flow(4.0)), (4.0, -flow(4.0))]),
        special("cloud", Markers::Open(Symbol::Square), cloud),
        Series { line: Line::Dashed, markers: Markers::None, colour: Some(4), ..Series::new("unstable", vec![]) },
    ];
    Plot { x, y: Axis::linear("v"), series, ..Plot::default() }
}

// The groups of the curves with this name, as text.
fn groups<'a>(svg: &'a str, name: &str) -> Vec<&'a str> {
    let title = format!("<title>{name}</title>");
    svg.split("<g>").filter(|g| g.contains(&title)).map(|g| g.split("</g>").next().expect("closed")).collect()
}

#[test]
fn branches_have_stable_and_unstable_parts_of_one_colour() {
    const COLOURS: [&str; 5] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000"];
    for axis in [Axis::linear("λ"), Axis::log("λ")] {
        let svg = check(&branches(axis), "branches");
        let looks = |name: &str| -> Vec<(bool, usize)> {
            let look =
                |g: &&str| (g.contains("dasharray"), COLOURS.iter().position(|c| g.contains(c)).expect("colour"));
            groups(&svg, name).iter().map(look).collect()
        };
        assert_eq!(looks("rest"), [(true, 0), (false, 0)]);
        assert_eq!(looks("flow"), [(false, 1), (true, 1), (false, 2)]);
        for name in ["rest", "flow"] {
            let parts = groups(&svg, name);
            assert!(parts.iter().all(|g| g.matches("<polyline").count() == 1 && !g.contains("<circle")), "{name}");
            assert!(parts.iter().all(|g| !g.contains("<polygon")), "{name}: no markers");
        }
    }
}

#[test]
fn special_points_are_all_marked_and_not_joined() {
    let svg = check(&branches(Axis::log("λ")), "branches");
    let counts = |name: &str| {
        let [group] = groups(&svg, name)[..] else { panic!("{name}: one group") };
        assert!(!group.contains("<polyline"), "{name}: no line");
        let open = group.matches("fill=\"#ffffff\"").count();
        (group.matches("<circle").count(), group.matches("<polygon").count(), open)
    };
    assert_eq!(counts("pitchfork"), (1, 0, 0));
    assert_eq!(counts("Hopf"), (0, 2, 2));
    assert_eq!(counts("cloud"), (0, 30, 30));
    // four corners each, upright on a corner and flat on a side
    let tops = |name: &str| {
        let shapes = corners(&format!("<g>{}</g>", groups(&svg, name)[0]), "polygon");
        let top = shapes[0].iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        (shapes[0].len(), shapes[0].iter().filter(|p| p.1 < top + 1.0).count())
    };
    assert_eq!((tops("Hopf"), tops("cloud")), ((4, 1), (4, 2)));
}

#[test]
fn parts_of_a_branch_share_a_legend_entry() {
    let plot = branches(Axis::linear("λ"));
    let svg = check(&plot, "branches");
    let legend = svg.split("<g>").last().expect("the legend comes last");
    let entries: Vec<&str> = legend.split("</text>").filter(|e| e.contains("<text")).collect();
    let find = |name: &str| entries.iter().filter(|e| e.ends_with(&format!(">{name}"))).collect::<Vec<_>>();
    assert_eq!(entries.len(), 7);
    // one entry for both parts of the rest; two flows of different colours keep theirs
    let ([rest], [first, second]) = (&find("rest")[..], &find("flow")[..]) else { panic!("{legend}") };
    assert!([rest, first, second].iter().all(|e| e.contains("<polyline") && !e.contains("dasharray")));
    assert!([rest, first, second].iter().all(|e| !e.contains("<circle") && !e.contains("<polygon")));
    assert!(first.contains("#d55e00") && second.contains("#009e73"));
    let [points] = find("pitchfork")[..] else { panic!("{legend}") };
    assert!(points.contains("<circle") && !points.contains("<polyline"));
    let [unstable] = find("unstable")[..] else { panic!("{legend}") };
    assert!(unstable.contains("dasharray"));
}

#[test]
fn dashes_and_points_show_in_the_pixels() {
    let flat = |line, markers| {
        let points = (0..=40).map(|k| (f64::from(k), 1.0)).collect();
        let frame = Series { markers: Markers::None, colour: Some(3), ..Series::new("", vec![(0.0, 0.0), (0.0, 2.0)]) };
        let curve = Series { line, markers, colour: Some(0), ..Series::new("", points) };
        let plot = Plot { series: vec![frame, curve], ..Plot::default() };
        let pixels = tiny_skia::Pixmap::decode_png(&plot.png().expect("png")).expect("readable");
        let blue = |p: &&tiny_skia::PremultipliedColorU8| (p.red(), p.green(), p.blue()) == (0x00, 0x72, 0xb2);
        pixels.pixels().iter().filter(blue).count() as f64
    };
    let solid = flat(Line::Solid, Markers::None);
    assert!(solid > 1000.0);
    assert_eq!(flat(Line::None, Markers::None), 0.0);
    let dashed = flat(Line::Dashed, Markers::None) / solid;
    assert!((0.55..0.75).contains(&dashed), "dashes of 9 and gaps of 5: {dashed}");
    let (filled, open) = (Markers::Filled(Symbol::Circle), Markers::Open(Symbol::Circle));
    assert!(flat(Line::Solid, filled) > 1.2 * solid);
    assert!(flat(Line::None, filled) > 1.5 * flat(Line::None, open));
}

#[test]
fn markers_on_a_line_keep_apart() {
    let mut plot = sample();
    plot.slopes.clear();
    let clumped = |line| {
        let mut points: Vec<(f64, f64)> = (0..10).map(|k| (1.0 + 1e-4 * f64::from(k), 1.0)).collect();
        points.extend([(1.5, 1.0), (2.0, 1.0)]);
        Series { line, markers: Markers::Filled(Symbol::Circle), ..Series::new("clumped", points) }
    };
    plot.series = vec![clumped(Line::Solid), clumped(Line::None)];
    let svg = check(&plot, "clumped");
    let counts: Vec<usize> = groups(&svg, "clumped").iter().map(|g| g.matches("<circle").count()).collect();
    assert_eq!(counts, [3, 12]);
}

#[test]
fn same_input_gives_same_bytes() {
    let (a, b) = (sample(), sample());
    assert_eq!(a.svg().expect("svg"), b.svg().expect("svg"));
    assert_eq!(a.png().expect("png"), b.png().expect("png"));
}

#[test]
fn files_are_written_in_the_right_size() {
    let folder = tempfile::tempdir().expect("folder");
    let plot = sample();
    plot.write(&folder.path().join("errors.v1")).expect("written");
    let svg = std::fs::read_to_string(folder.path().join("errors.v1.svg")).expect("svg");
    let png = std::fs::read(folder.path().join("errors.v1.png")).expect("png");
    assert_eq!(svg, plot.svg().expect("svg"));
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let word = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes"));
    let view = svg.split("viewBox=\"0 0 ").nth(1).and_then(|s| s.split('"').next()).expect("viewBox");
    let (width, height) = view.split_once(' ').expect("two numbers");
    assert_eq!(word(16), width.parse::<u32>().expect("whole") * PNG_SCALE);
    assert_eq!(word(20), height.parse::<u32>().expect("whole") * PNG_SCALE);
    let missing = plot.write(&folder.path().join("no").join("errors"));
    assert!(matches!(missing, Err(PlotError::Write { .. })));
}
