//! Tables as other programs write them: all give the field of the plain table.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use monolayer::study::compare::{CompareStudy, Comparison, compare};

/// A cell: place, frame and velocity; all numbers are short in binary and in decimal notation.
#[derive(Debug, Clone, Copy)]
struct Cell {
    x: f64,
    y: f64,
    frame: usize,
    v: [f64; 2],
}

const FRAMES: usize = 5;

fn cells() -> Vec<Cell> {
    let place = |k: usize, n: usize, step: f64| ((k * 37 + k / 7) % n) as f64 * step - (n as f64 * step) / 2.0 + 0.125;
    (0..40 * FRAMES)
        .map(|k| {
            let (x, y) = (place(k, 31, 0.25), place(k * 3 + 1, 23, 0.25));
            Cell { x, y, frame: k % FRAMES, v: [1.0 + x / 4.0, -0.5 * y + 0.25 * (k % 3) as f64] }
        })
        .collect()
}

/// A line for each cell.
fn lines(head: &str, line: impl Fn(&Cell) -> String) -> String {
    cells().iter().fold(format!("{head}\n"), |text, cell| text + &line(cell) + "\n")
}

fn plain() -> String {
    lines("x,y,t,vx,vy", |c| format!("{},{},{},{},{}", c.x, c.y, c.frame, c.v[0], c.v[1]))
}

const KEYS: &str = "box = [[-4, -3], [4, 3]]\nbins = [8, 6]\n";

fn read(folder: &Path, keys: &str) -> Result<Comparison, String> {
    std::fs::write(folder.join("c.toml"), format!("{keys}\n{KEYS}")).unwrap();
    let study = CompareStudy::read(&folder.join("c.toml"), &[]).map_err(|error| error.to_string())?;
    compare(&study).map_err(|error| error.to_string())
}

/// A folder with one file.
fn with(name: &str, bytes: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    folder
}

/// The averages of the plain table, and that there is something in them.
fn expected() -> String {
    let found = read(with("t.csv", plain().as_bytes()).path(), "data = 't.csv'").unwrap();
    assert!(found.measured.values.iter().filter(|v| v.norm() > 0.0).count() > 30);
    shown(&found)
}

fn shown(found: &Comparison) -> String {
    format!("{} frames {:?} {:?}", found.tracks.frames, found.averages, found.measured)
}

/// Reads a folder and asserts that it gives the field of the plain table, with these words in its notes.
#[track_caller]
fn same_in(folder: &Path, keys: &str, notes: &[&str]) {
    let found = read(folder, keys).unwrap_or_else(|error| panic!("{keys}: {error}"));
    assert_eq!(shown(&found), expected(), "{keys}");
    let said = found.tracks.notes.join("\n");
    assert_eq!(found.tracks.notes.len(), notes.len(), "{said}");
    notes.iter().for_each(|note| assert!(said.contains(note), "`{note}` is not in {said}"));
}

#[track_caller]
fn same(text: &str, keys: &str, notes: &[&str]) {
    same_in(with("t.txt", text.as_bytes()).path(), &format!("data = 't.txt'\n{keys}"), notes);
}

#[test]
fn separators_and_decimal_marks_are_found_out() {
    let with = |separator: &str| plain().replace(',', separator);
    same(&with("\t"), "", &[]);
    same(&with(";"), "", &[]);
    same(&with("   "), "", &[]);
    same(&with(" , "), "", &[]);
    let commas = |separator: &str| with(separator).replace('.', ",");
    same(&commas(";"), "", &[]);
    same(&commas("\t"), "", &[]);
    same(&commas("  "), "", &[]);
    same(&with("\t"), "separator = 'tab'", &[]);
    same(&with(";"), "separator = ';'", &[]);
    same(&with(" "), "separator = 'space'", &[]);
}

#[test]
fn comments_line_ends_marks_and_encodings() {
    let text = plain();
    same(&format!("# measured on a Monday\n% by hand\n\n{text}# the end\n"), "", &[]);
    same(&text.replace('\n', "\r\n"), "", &[]);
    same(&text.replace('\n', "\r"), "", &[]);
    same(&format!("\u{feff}{text}"), "", &[]);
    same(text.trim_end(), "", &[]);
    // numpy: names in a comment, separated by spaces, above numbers with exponents
    let numpy = |c: &Cell| format!("{:.18e},{:e},{:e},{:e},{:e}", c.x, c.y, c.frame as f64, c.v[0], c.v[1]);
    same(&lines("# x y t vx vy", numpy), "", &[]);
    let fortran = |c: &Cell| {
        format!("  {:e}  {:e}  {} {:e} {:e}", c.x, c.y, c.frame, c.v[0], c.v[1])
            .replace('e', "D+00")
            .replace("D+00-", "D-0")
    };
    same(&lines("x y t vx vy", fortran), "", &[]);
    // Latin-1, as microscopes write it: µ is one byte
    let latin: Vec<u8> = text.replace("x,y,t", "x (µm),y (µm),t").chars().map(|c| c as u8).collect();
    assert!(String::from_utf8(latin.clone()).is_err());
    same_in(with("t.csv", &latin).path(), "data = 't.csv'", &[]);
    let wide: Vec<u8> = "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    same_in(with("t.csv", &wide).path(), "data = 't.csv'", &[]);
}

#[test]
fn columns_by_number_and_among_thousands() {
    let bare = plain().lines().skip(1).fold(String::new(), |text, line| text + line + "\n");
    same(&bare, "columns = { x = 1, y = 2, t = 3, vx = 4, vy = 5 }", &[]);
    let titles = format!("a table,of mine\nwith,two,titles\n{bare}");
    same(&titles, "columns = { x = 1, y = 2, t = 3, vx = 4, vy = 5 }", &[]);
    same(&titles, "header = 2\ncolumns = { x = 1, y = 2, t = 3, vx = 4, vy = 5 }", &[]);
    same(&format!("7,8,9,10,11\n{bare}"), "header = 1\ncolumns = { x = 1, y = 2, t = 3, vx = 4, vy = 5 }", &[]);
    let names: Vec<String> = (0..3000).map(|k| format!("gene {k}")).collect();
    let rest = vec!["0.5"; 3000].join(",");
    let wide = lines(&format!("{},u,v,x,y,frame", names.join(",")), |c| {
        format!("{rest},{},{},{},{},{}", c.v[0], c.v[1], c.x, c.y, c.frame)
    });
    same(&wide, "columns = { t = 'frame', vx = 'u', vy = 'v' }", &[]);
    let quoted = lines("\"cell, name\";\"x [µm]\";\"y [µm]\";t;\"vx [µm/h]\";\"vy [µm/h]\"", |c| {
        format!("\"cell; {}\";{};\"{}\";{};{};{}", c.frame, c.x, c.y, c.frame, c.v[0], c.v[1])
    });
    same(&quoted, "", &[]);
}

#[test]
fn what_was_not_measured_is_left_out_and_counted() {
    let mut text = plain();
    text.insert_str(text.find('\n').unwrap() + 1, "NaN,1,0,1,1\n1,nan,1,NaN,\n");
    text += ",,3,1,2\n0,0,2,NA,1\n,,,,\n";
    same(&text, "", &["4 of 204 rows lack a position, time or velocity"]);
    let chosen = lines("x,y,t,vx,vy,good", |c| {
        let row = format!("{},{},{}", c.x, c.y, c.frame);
        format!("{row},{},{},1\n{row},99,99,0\n{row},98,9,7", c.v[0], c.v[1])
    });
    same(&chosen, "keep = { good = [1, 2] }", &["400 of 600 rows are left out for the value of their column `good`"]);
}

#[test]
fn packed_and_parquet() {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(plain().as_bytes()).unwrap();
    same_in(with("t.csv.gz", &packed.finish().unwrap()).path(), "data = 't.csv.gz'", &[]);
    for (case, compression) in ["SNAPPY", "ZSTD(3)", "GZIP(6)", "LZ4_RAW", "UNCOMPRESSED"].into_iter().enumerate() {
        let folder = tempfile::tempdir().unwrap();
        parquet_file(&folder.path().join("t.parquet"), compression);
        let note = "1 of 201 rows lack";
        same_in(folder.path(), &format!("data = 't.parquet'\ntitle = '{case}'\ncolumns.t = 'frame'"), &[note]);
    }
}

/// A table with columns of several types, others between them, and a row without a place.
fn parquet_file(path: &Path, compression: &str) {
    use parquet::data_type::{ByteArrayType, DoubleType, FloatType, Int32Type};
    let schema = "message table {
        optional double x; required binary name (UTF8); required float y; required int32 frame; required double vx;
        required double vy;
    }";
    let schema = std::sync::Arc::new(parquet::schema::parser::parse_message_type(schema).unwrap());
    let compression = compression.parse().unwrap();
    let properties = parquet::file::properties::WriterProperties::builder().set_compression(compression).build();
    let file = std::fs::File::create(path).unwrap();
    let mut writer = parquet::file::writer::SerializedFileWriter::new(file, schema, properties.into()).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let cells = cells();
    let of = |f: &dyn Fn(&Cell) -> f64| -> Vec<f64> { cells.iter().map(f).chain([1.0]).collect() };
    let mut column = group.next_column().unwrap().unwrap();
    let given: Vec<i16> = cells.iter().map(|_| 1).chain([0]).collect();
    let x: Vec<f64> = cells.iter().map(|c| c.x).collect();
    column.typed::<DoubleType>().write_batch(&x, Some(&given), None).unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let names: Vec<_> = (0..=cells.len()).map(|k| format!("cell {k}").into_bytes().into()).collect();
    column.typed::<ByteArrayType>().write_batch(&names, None, None).unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let y: Vec<f32> = of(&|c| c.y).into_iter().map(|y| y as f32).collect();
    column.typed::<FloatType>().write_batch(&y, None, None).unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let frames: Vec<i32> = of(&|c| c.frame as f64).into_iter().map(|t| t as i32).collect();
    column.typed::<Int32Type>().write_batch(&frames, None, None).unwrap();
    column.close().unwrap();
    for component in 0..2 {
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&of(&|c| c.v[component]), None, None).unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
}

/// A file for each frame, named by a function of its number.
fn by_frame(
    name: impl Fn(usize) -> String,
    head: impl Fn(usize) -> String,
    line: impl Fn(&Cell) -> String,
) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for frame in 0..FRAMES {
        let rows = cells().into_iter().filter(|cell| cell.frame == frame);
        let text = rows.fold(head(frame), |text, cell| text + &line(&cell) + "\n");
        std::fs::write(folder.path().join(name(frame)), text).unwrap();
    }
    folder
}

#[test]
fn a_file_for_each_frame() {
    let line = |c: &Cell| format!("{},{},{},{}", c.x, c.y, c.v[0], c.v[1]);
    let head = |_| "x,y,vx,vy\n".to_owned();
    for name in ["frame_{}.txt", "{}.csv", "e2_{}_a.dat"] {
        // 8, 9, 10, …: the order of numbers is not that of letters
        let folder = by_frame(|k| name.replace("{}", &(k + 8).to_string()), head, line);
        same_in(folder.path(), &format!("data = '{}'", name.replace("{}", "*")), &[]);
    }
    let folder = by_frame(|k| format!("day-{}.txt", ["a", "b", "c", "d", "e"][k]), head, line);
    same_in(folder.path(), "data = 'day-?.txt'", &[]);
    // files that are joined: the times are in them
    let joined = |c: &Cell| format!("{},{},{},{},{}", c.x, c.y, c.frame, c.v[0], c.v[1]);
    let folder = by_frame(|k| format!("part{}.txt", FRAMES - k), |_| "x,y,when,vx,vy\n".to_owned(), joined);
    same_in(folder.path(), "data = 'part*.txt'\ncolumns.t = 'when'", &[]);
}

#[test]
fn files_of_pivlab() {
    // pixels of half a unit, a frame each quarter of a unit of time; y and v downwards, origin in the picture's corner
    let row = |c: &Cell, separator: &str| {
        let (x, y) = (2.0 * c.x + 100.0, -2.0 * c.y + 50.0);
        [x, y, c.v[0] / 2.0, -c.v[1] / 2.0, 1.0].map(|value| value.to_string()).join(separator)
    };
    let keys = "data = 'PIVlab_*.txt'\nformat = 'pivlab'\npixel = 0.5\nframe = 0.25\ncentre = [50, 25]\n";
    for separator in [",", "\t", " "] {
        let names = ["x [px]", "y [px]", "u [px/frame]", "v [px/frame]", "Vector type [-]"].join(separator);
        let info = |k: usize| {
            format!(
                "PIVlab by W.Th. & E.J.S., ASCII chart output - 30-Nov-2026\r\nFRAME: {k}, filenames: A: a.tif & B: \
                 b.tif, conversion factor xy (px -> m): 1, conversion factor uv (px/frame -> m/s): 1\r\n"
            )
        };
        let name = |k: usize| format!("PIVlab_{:04}.txt", k + 1);
        let folder = by_frame(name, |k| format!("{}{names}\r\n", info(k)), |c| row(c, separator) + "\r");
        same_in(folder.path(), keys, &[]);
        let folder = by_frame(name, |_| format!("{names}\n"), |c| row(c, separator));
        same_in(folder.path(), keys, &[]);
        let folder = by_frame(name, |_| String::new(), |c| row(c, separator));
        same_in(folder.path(), keys, &[]);
    }
    // vectors under the mask and interpolated ones
    let lines = |c: &Cell| format!("{}\n100,50,NaN,NaN,0\n100,50,9,9,2", row(c, ","));
    let head = |_| "x [px],y [px],u [px/frame],v [px/frame],Vector type [-],vorticity [1/frame]\n".to_owned();
    let folder = by_frame(|k| format!("PIVlab_{k}.txt"), head, |c| lines(c).replace('\n', ",0\n") + ",0");
    same_in(folder.path(), keys, &["400 of 600 rows are left out for the value of their column `Vector type`"]);
    let error = read(folder.path(), "data = 'PIVlab_1.txt'\nformat = 'pivlab'").unwrap_err();
    assert!(error.contains("`data` = \"PIVlab_1.txt\"") && error.contains("a file for each frame"), "{error}");
}

#[test]
fn files_of_openpiv() {
    let row = |c: &Cell| format!("{:9.4}\t{:9.4}\t{:9.4}\t{:9.4}", c.x, c.y, c.v[0], c.v[1]);
    let keys = "data = 'exp1_*.txt'\nformat = 'openpiv'\n";
    let name = |k: usize| format!("exp1_{k:03}.txt");
    let masked = |c: &Cell| format!("{0}\t0\t0\n1\t1\tnan\tnan\t0\t1\n1\t1\t5\t5\t1\t0", row(c));
    let folder = by_frame(name, |_| "# x\ty\tu\tv\tflags\tmask\n".to_owned(), masked);
    same_in(
        folder.path(),
        keys,
        &[
            "200 of 600 rows are left out for the value of their column `flags`",
            "200 of 600 rows are left out for the value of their column `mask`",
        ],
    );
    let folder = by_frame(name, |_| "#x\ty\tu\tv\tmask\n".to_owned(), |c| format!("{}\t0.0000", row(c)));
    same_in(folder.path(), keys, &[]);
    let folder = by_frame(name, |_| String::new(), |c| format!("{}   0", row(c)).replace('\t', "  "));
    same_in(folder.path(), keys, &[]);
    let folder = by_frame(name, |_| "# x y u v\n".to_owned(), |c| row(c).replace('\t', " "));
    same_in(folder.path(), keys, &[]);
}

/// A track of three spots for each cell, whose middle one has the cell's velocity.
fn spots(spot: impl Fn(usize, f64, f64, usize) -> String) -> String {
    let mut text = String::new();
    for (track, c) in cells().iter().enumerate() {
        for step in 0..3 {
            let s = step as f64 - 1.0;
            let _ = writeln!(text, "{}", spot(track, c.x + s * c.v[0], -(c.y + s * c.v[1]), c.frame + step));
        }
    }
    text
}

#[test]
fn spots_of_trackmate() {
    let names = "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME,RADIUS\n";
    let more = "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,Radius\nLabel,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,R\n\
                ,,,(quality),(micron),(micron),(micron),(sec),,(micron)\n";
    let spot = |k: usize, x: f64, y: f64, frame: usize| format!("ID{k},{k},{k},0.9,{x},{y},0,{},{frame},5", frame * 60);
    let lone = "ID9,9,,0.9,0,0,0,60,1,5\nID9,9,None,0.9,0,0,0,60,1,5\n";
    let keys = "data = 't.csv'\nformat = 'trackmate'\n";
    let ends = "400 of 600 spots have no velocity: their track has no spot in the frame before or after";
    let new = format!("{names}{more}{}{lone}", spots(spot));
    same_in(with("t.csv", new.as_bytes()).path(), keys, &["2 of 602 rows belong to no track", ends]);
    let old = format!("{names}{}", spots(spot));
    same_in(with("t.csv", old.as_bytes()).path(), keys, &[ends]);
    let older = format!(
        " \t{}{}",
        names.replace(',', "\t"),
        spots(|k, x, y, t| format!("{k},{}", spot(k, x, y, t))).replace(',', "\t")
    );
    same_in(with("t.csv", older.as_bytes()).path(), keys, &[ends]);
    // by the time in seconds, a minute being the unit of time
    let timed = format!("{keys}columns.t = 'POSITION_T'\nspeed = {}\n", 1.0 / 60.0);
    let found = read(with("t.csv", old.as_bytes()).path(), &timed).unwrap();
    let wanted = read(with("t.csv", plain().as_bytes()).path(), "data = 't.csv'").unwrap();
    for (a, b) in found.measured.values.iter().zip(&wanted.measured.values) {
        assert!((a - b).norm() < 1e-12 || a.x.is_nan() && b.x.is_nan(), "{a} {b}");
    }
}

#[test]
fn tracks_of_other_tables() {
    let line = |k: usize, x: f64, y: f64, frame: usize| format!("cell {k},{x},{},{frame}", -y);
    let ends = "400 of 600 spots have no velocity";
    same(&format!("cell,x,y,t\n{}", spots(line)), "columns.track = 'cell'", &[ends]);
    // a file for each frame, with names of cells that run through all
    let folder = tempfile::tempdir().unwrap();
    for frame in 0..FRAMES + 2 {
        let of_frame =
            |k: usize, x: f64, y: f64, t: usize| if t == frame { format!("c{k}\t{x}\t{}", -y) } else { String::new() };
        std::fs::write(folder.path().join(format!("f{frame}.txt")), format!("name\tx\ty\n{}", spots(of_frame)))
            .unwrap();
    }
    same_in(folder.path(), "data = 'f*.txt'\ncolumns.track = 'name'", &[ends]);
}

#[track_caller]
fn fails(text: &str, keys: &str, parts: &[&str]) {
    let folder = with("t.txt", text.as_bytes());
    let error = read(folder.path(), &format!("data = 't.txt'\n{keys}")).expect_err("should fail");
    println!("{error}");
    for part in parts.iter().chain(&["hint"]) {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

#[test]
fn wrong_separators_and_columns_are_named_as_such() {
    let text = plain();
    let semicolons = text.replace(',', ";");
    fails(
        &semicolons,
        "separator = ','",
        &["t.txt, line 1", "with `separator` = \",\" this is one column: x;y;t", "semicolons", "`separator` = \";\""],
    );
    fails(&text, "separator = 'tab'", &["t.txt, line 1", "\"tab\"", "one column", "`separator` = \",\""]);
    fails(
        &text,
        "separator = 'space'\ncolumns = { x = 1, y = 2, t = 3, vx = 4, vy = 5 }",
        &["line 1", "one column", "`separator` = \",\""],
    );
    fails(&text, "separator = '|'", &["separator", "`|` is not among the choices", "tab"]);
    fails(
        &text,
        "columns.vx = 'u'",
        &["line 1", "there is no column `u`", "the columns are x, y, t, vx, vy", "`columns.vx`"],
    );
    fails(&text, "columns.vx = 9", &["there is no column 9: it has 5", "`columns.vx`"]);
    fails(&text, "columns.vx = 0", &["columns.vx", "numbered from 1"]);
    fails(&text, "columns.vx = true", &["columns.vx", "the name of a column, or its number"]);
    fails(&text, "keep = { good = [1] }", &["there is no column `good`", "keep.good"]);
    fails(&text, "format = 'pivlabs'", &["format", "pivlabs", "pivlab", "trackmate"]);
    fails(&text, "pixel = 0", &["`pixel`", "greater than 0"]);
    fails(&text, "frame = -1", &["`frame`", "greater than 0"]);
    fails(&text, "y = 'left'", &["y", "left", "up"]);
    let bare = text.split_once('\n').unwrap().1;
    fails(bare, "", &["line 1", "the columns have no names", "columns = { x = 1", "of 5, separated by commas"]);
    fails(&text.replace(',', ";").replace("1.25", "1,234.5"), "", &["1,234.5", "finite number"]);
    fails("x;y;t;vx;vy\n1,5;1;0;1;1\n1.5;1;1;1;1\n", "", &["line 3", "line 2", "decimal mark"]);
    fails("x,y,t,vx,vy\n1,5,1,0,1,1\n", "", &["line 2", "has 6 values", "5 columns", "decimal commas"]);
    fails("x,y,t,vx,vy\n1,2,0,inf,1\n1,2,1,1,1\n", "", &["line 2", "`vx` = inf", "finite number"]);
    fails("x,y,t,vx,vy\nNaN,1,1,1,1\n", "", &["none of its 1 rows can be used", "lack"]);
    fails(
        "id,x,y,t\n1,0,0,0\n1,0,0,1\n",
        "columns.track = 'id'",
        &["none of its 2 rows", "no spot in the frame before or after"],
    );
    fails("PK\u{3}\u{4}abc", "", &["is an Excel or zip file", "Parquet"]);
    let folder = with("a1.txt", text.as_bytes());
    let error = read(folder.path(), "data = 'b*.txt'").unwrap_err();
    assert!(error.contains("no file has such a name"), "{error}");
    let error = read(folder.path(), "data = '.'").unwrap_err();
    assert!(error.contains("this is a folder") && error.contains("pattern"), "{error}");
}
