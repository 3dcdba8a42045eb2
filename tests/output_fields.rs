//! Every listed output field in scenes: which have it, that files hold it, and cuts.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::element::basis;
use monolayer::measure::OutputField;
use monolayer::measure::fields::{ALL, Fields, IN_CUTS, Tool};
use monolayer::mesh::Point;
use monolayer::output::progress::Verbosity;
use monolayer::run::stepper::Ground;
use monolayer::run::{AnyScene, Options, finished, kinds};
use monolayer::scene::{MapRequest, Quantity};
use monolayer::schema::Listed;
use monolayer::space::Field;
use vtkio::model::{Attribute, DataSet, IOBuffer, Vtk};

static NEVER: AtomicBool = AtomicBool::new(false);

const TISSUE: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
traction = 0.5
peclet = 2.0
coherence = 0.5
elasticity = 0.4
[mesh]
shape = "disc"
h = 0.9
[boundary.wall]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["cos(2*y)", "sin(2*x)"]
[strain]
weissenberg = 0.1
[time]
scheme = "bdf1"
step = 0.1
end = 0.2
"#;

const STOKES: &str = r#"
[model]
kind = "stokes"
[mesh]
shape = "square"
n = 3
[boundary.left]
velocity = { dirichlet = ["0", "0"] }
[boundary.right]
velocity = { dirichlet = ["0", "0"] }
[boundary.bottom]
velocity = { dirichlet = ["0", "0"] }
[boundary.top]
velocity = { dirichlet = ["16*x^2*(1-x)^2", "0"] }
[time]
step = 0.1
end = 0.1
"#;

const ADVECTION: &str = r#"
[model]
kind = "advection"
velocity = ["y", "-x"]
[mesh]
shape = "disc"
h = 0.9
[boundary.wall]
density = 1.0
[initial]
density = "1 + x"
[time]
step = 0.05
end = 0.1
"#;

/// A scene of each kind that has fields.
fn scenes() -> [(&'static str, String); 4] {
    let sheet =
        include_str!("data/compressible.toml").split("[[output]]").next().unwrap().replace("end = 2.0", "end = 0.1");
    [
        ("incompressible", TISSUE.to_owned()),
        ("compressible", format!("{sheet}[strain]\nweissenberg = 0.1\n")),
        ("stokes", STOKES.to_owned()),
        ("advection", ADVECTION.to_owned()),
    ]
}

fn read(text: &str) -> Result<AnyScene, String> {
    AnyScene::parse(text, Path::new("test.toml")).map_err(|error| error.to_string())
}

/// The names as a list of TOML.
fn quoted(fields: &[&OutputField]) -> String {
    fields.iter().map(|field| format!("\"{}\"", field.name)).collect::<Vec<_>>().join(", ")
}

/// The fields that scenes of a kind have.
fn of_kind(kind: &str) -> Vec<&'static OutputField> {
    ALL.iter().copied().filter(|field| field.kinds().split(' ').any(|one| one == kind)).collect()
}

#[test]
fn scenes_have_the_fields_of_their_kind_and_no_others() {
    for (kind, text) in scenes() {
        let has = of_kind(kind);
        for field in ALL {
            let [name, cut] = [field.name, "{ name = \"line\", from = [0.1, 0.1], to = [0.9, 0.2] }"];
            let mut outputs = vec![
                ("fields", format!("fields = [\"{name}\"]")),
                ("columns", format!("cuts = [{cut}]\ncolumns = [\"{name}\"]")),
            ];
            let quantity = |part: &str| format!("maps = [\"{part}\"]");
            outputs.extend(field.parts.iter().map(|part| ("maps", quantity(part.name))));
            for (key, output) in outputs {
                match read(&format!("{text}\n[[output]]\n{output}\n")) {
                    Ok(_) => assert!(has.contains(field), "{kind} takes {output}"),
                    Err(why) => {
                        assert!(!has.contains(field), "{kind}: {why}");
                        let told = why.contains(&format!("`output.0.{key}")) && why.contains("hint: ");
                        assert!(told && (key == "maps" || why.contains(name)), "{kind}: {why}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_there_is_not_is_refused_with_what_there_is() {
    let (_, text) = &scenes()[0];
    let why = |output: &str| read(&format!("{text}\n[[output]]\n{output}\n")).expect_err("a mistake");
    for (output, parts) in [
        ("fields = [\"velocty\"]", ["`output.0.fields", "did you mean `velocity`?"]),
        ("maps = [\"sped\"]", ["`output.0.maps", "did you mean `speed`?"]),
        ("maps = [{ of = \"speed\", arrows = \"pressure\" }]", ["`output.0.maps.0.arrows`", "velocity"]),
        ("cuts = [\"axis-1\"]\ncolumns = [\"velocty\"]", ["`output.0.columns", "did you mean `velocity`?"]),
        ("cuts = [\"axis-1\"]\ncolumns = []", ["`output.0.columns` = []", "the list is empty"]),
        ("fields = [\"velocity\"]\ncolumns = [\"velocity\"]", ["`output.0.columns`", "put it beside `cuts`"]),
    ] {
        let said = why(output);
        parts.iter().for_each(|part| assert!(said.contains(part), "{output}: {said}"));
    }
    let without = text.replace("[strain]\nweissenberg = 0.1\n", "");
    let strained = ALL.iter().find(|field| field.tool == Some(Tool::Strain)).expect("a strain");
    for output in [format!("fields = [{}]", quoted(&[strained])), format!("maps = [\"{}\"]", strained.parts[0].name)] {
        let said = read(&format!("{without}\n[[output]]\n{output}\n")).expect_err("no strain");
        assert!(said.contains("without a table [strain]") && said.contains(strained.name), "{said}");
    }
}

/// Numbers at the nodes of a VTU file, and how many there are at each.
fn arrays(path: &Path) -> Vec<(String, usize, Vec<f64>)> {
    let DataSet::UnstructuredGrid { pieces, .. } = Vtk::import(path).unwrap().data else { panic!("other data") };
    let piece = pieces.into_iter().next().unwrap().into_loaded_piece_data(None).unwrap();
    let read = |attribute: &Attribute| match attribute {
        Attribute::DataArray(array) => {
            let IOBuffer::F64(values) = &array.data else { panic!("no numbers") };
            (array.name.clone(), array.num_comp(), values.clone())
        }
        Attribute::Field { .. } => panic!("no array"),
    };
    piece.data.point.iter().map(read).collect()
}

/// Where a file has the components of a tensor.
const PLACES: [usize; 3] = [0, 3, 1];

/// Compares an array with the field at the nodes of every cell.
fn compare(field: &OutputField, found: &Field, (name, width, values): &(String, usize, Vec<f64>)) {
    assert_eq!((name.as_str(), *width), (field.name, field.value.written()));
    let cells = found.space.mesh.cells.len();
    let per_cell = values.len() / width / cells;
    let degree = (1..6).find(|degree| basis::node_count(*degree) == per_cell).expect("a degree");
    let scale = values.iter().fold(1e-9_f64, |most, value| most.max(value.abs()));
    for cell in 0..cells {
        for (node, xi) in basis::nodes(degree).into_iter().enumerate() {
            for (c, place) in PLACES.into_iter().enumerate().take(field.value.components()) {
                let place = if *width == 6 { place } else { c };
                let (there, here) = (values[(cell * per_cell + node) * width + place], found.component_at(cell, xi, c));
                assert!((there - here).abs() < 1e-12 * scale, "{field:?}: {there} in the file, not {here}");
            }
        }
    }
}

/// The values of the columns of a cut, which are those of the fields there.
fn compare_cut(table: &str, fields: &[&'static OutputField], at: (&dyn Fields, &Ground)) {
    let mut lines = table.lines();
    let columns = fields.iter().flat_map(|field| field.columns.iter().copied());
    let header: Vec<&str> = ["s", "x1", "x2"].into_iter().chain(columns).collect();
    assert_eq!(lines.next().unwrap().split(',').collect::<Vec<_>>(), header);
    let found: Vec<Field> =
        fields.iter().map(|field| (field.find)(&at.1.at(at.0)).unwrap().expect("a field")).collect();
    let mut rows = 0;
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
        let x = Point::new(row[1], row[2]);
        let (cell, xi) = at.1.locator.locate(&at.1.mesh, x).expect("in the mesh");
        let values = found.iter().flat_map(|field| (0..field.space.components).map(move |c| (field, c)));
        for ((field, c), there) in values.zip(&row[3..]) {
            let here = field.component_at(cell, xi, c);
            assert!((here - there).abs() < 1e-7 * here.abs().max(1.0), "{there} in the table, not {here}");
        }
        rows += 1;
    }
    assert_eq!(rows, 7);
}

#[test]
fn files_and_cuts_hold_the_fields_of_the_last_state() {
    let mut seen = BTreeSet::new();
    for (kind, text) in scenes() {
        let has = of_kind(kind);
        let all = quoted(&has);
        let line = "{ name = \"line\", from = [0.13, 0.11], to = [0.57, 0.23], points = 7 }";
        let usual = line.replace("line", "usual");
        let outputs = format!(
            "\n[[output]]\nfields = [{all}]\n[[output]]\ncuts = [{line}]\ncolumns = [{all}]\n\
             [[output]]\ncuts = [{usual}]\n"
        );
        let scene = read(&format!("{text}{outputs}")).unwrap();
        let out = tempfile::tempdir().unwrap();
        let options =
            Options { out: out.path().to_owned(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
        kinds::run(&scene, &options).unwrap();
        let file = std::fs::read_dir(out.path().join("fields")).unwrap().map(|entry| entry.unwrap().path()).max();
        let arrays = arrays(&file.unwrap());
        assert_eq!(arrays.len(), has.len(), "{kind}");
        finished::look(out.path(), &scene, &mut |last| {
            let (fields, ground) = last.view.fields.zip(last.ground).expect("fields on a mesh");
            for (field, array) in has.iter().zip(&arrays) {
                let found = (field.find)(&ground.at(fields))?.expect("the kind has it");
                compare(field, &found, array);
                seen.insert(field.name);
            }
            let table = |name: &str| std::fs::read_to_string(out.path().join(format!("cuts/{name}.csv"))).unwrap();
            compare_cut(&table("line"), &has, (fields, ground));
            let usual: Vec<_> = IN_CUTS.iter().copied().filter(|field| has.contains(field)).collect();
            compare_cut(&table("usual"), &usual, (fields, ground));
            Ok(())
        })
        .unwrap();
    }
    assert_eq!(seen, ALL.iter().map(|field| field.name).collect());
}

#[test]
fn every_scalar_of_a_run_can_be_drawn() {
    let (kind, text) = &scenes()[0];
    let scene = read(text).unwrap();
    let out = tempfile::tempdir().unwrap();
    let options = Options { out: out.path().to_owned(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    kinds::run(&scene, &options).unwrap();
    finished::look(out.path(), &scene, &mut |last| {
        for part in of_kind(kind).iter().flat_map(|field| field.parts) {
            let of = Quantity::named(part.name).expect("a quantity");
            // few pixels
            let window = Some([[-0.9, -0.05], [0.9, 0.05]]);
            let (name, arrows) = (of.file_name(), None);
            let request = MapRequest { name, of, arrows, streamlines: false, mesh: false, window, range: None };
            let [low, high] = last.extent(&request)?;
            assert!(low.is_finite() && low <= high && (part.signed || low >= 0.0), "{}: {low} to {high}", part.name);
        }
        Ok(())
    })
    .unwrap();
}
