//! Separated texts: which line names the columns, where the numbers begin, and the numbers.

use super::separator::number;
use super::{Column, Cut, NameNumbers, Rows, Separator, Wanted, Wrong, find, is_missing};

/// Lines from the top among which the names of the columns are looked for.
const HEAD: usize = 200;

/// Lines of them by which the separator is found out.
const SAMPLE: usize = 40;

/// A line that is not empty.
#[derive(Debug, Clone, Copy)]
struct Line<'t> {
    number: u64,
    /// Without the mark of a comment.
    text: &'t str,
    is_comment: bool,
}

impl<'t> Line<'t> {
    fn new((at, text): (usize, &'t str)) -> Option<Self> {
        let text = text.trim_matches([' ', '\n']);
        let bare = text.trim_start_matches(['#', '%']);
        let is_comment = bare.len() < text.len();
        let text = if is_comment { bare.trim() } else { text };
        (!text.trim().is_empty()).then_some(Self { number: at as u64 + 1, text, is_comment })
    }
}

/// Where the columns are, and where the numbers may begin.
#[derive(Debug)]
struct Layout {
    separator: Separator,
    places: Vec<Option<usize>>,
    /// The last line before the numbers that is known.
    above: u64,
    /// Number of the line of names and of the columns that it names, where rows must have as many.
    named: Option<(u64, usize)>,
}

/// Reads the wanted columns of a text.
///
/// # Errors
/// No table, a separator that does not separate it, columns that it has not, an entry that is neither a number nor
/// missing; with the line.
pub(super) fn read(text: &str, cut: Cut, wanted: &[Wanted], names: &mut NameNumbers) -> Result<Rows, Wrong> {
    let head: Vec<Line> = text.lines().enumerate().take(HEAD).filter_map(Line::new).collect();
    if head.is_empty() {
        return Err(Wrong::new(None, "is empty: it has no column", "name a table of positions and velocities"));
    }
    let layout = layout(&head, cut, wanted)?;
    let prepared: String;
    let body = match layout.separator {
        Separator::Space => {
            prepared = text.lines().map(|line| Separator::Space.prepare(line) + "\n").collect();
            prepared.as_str()
        }
        Separator::Tab | Separator::Semicolon | Separator::Comma => text,
    };
    rows(body, &layout, wanted, names)
}

/// Separator, line of names and columns.
fn layout(head: &[Line], cut: Cut, wanted: &[Wanted]) -> Result<Layout, Wrong> {
    let above = cut.header.map(|lines| lines as u64);
    let data = || head.iter().filter(|l| !l.is_comment && above.is_none_or(|n| l.number > n)).map(|l| l.text);
    let found = Separator::detect(data().take(SAMPLE));
    let separator = cut.separator.or(found).or_else(|| usual(head)).unwrap_or(Separator::Comma);
    let numbers = |column: &Wanted| matches!(column.column, Column::Number(_));
    if wanted.iter().all(|column| numbers(column) || column.optional) && wanted.iter().any(numbers) {
        let width = data().map(|line| separator.split(line).len()).max().unwrap_or(0);
        let names: Vec<String> = (0..width).map(|_| String::new()).collect();
        let first = head.iter().find(|line| !line.is_comment && above.is_none_or(|n| line.number > n));
        let blame = |wrong| first.and_then(|line| blame_separator(line, cut, found)).unwrap_or(wrong);
        let places = find(&names, wanted, None).map_err(blame)?;
        return Ok(Layout { separator, places, above: above.unwrap_or(0), named: None });
    }
    let numbers_by = [separator, found.unwrap_or(separator)];
    let first = head
        .iter()
        .find(|line| above.is_none_or(|n| line.number > n) && numbers_by.iter().any(|way| is_of_numbers(line, *way)));
    match named(head, separator, above, first, wanted) {
        Ok(layout) => Ok(layout),
        Err(Some((line, wrong))) => Err(blame_separator(line, cut, found).unwrap_or(wrong)),
        Err(None) => without_names(head, separator, above, wanted),
    }
}

/// Columns by the line that names them all, above the `first` line of numbers; otherwise what is wrong with the line
/// that comes nearest, if one can be meant.
fn named<'l, 't>(
    head: &'l [Line<'t>],
    separator: Separator,
    above: Option<u64>,
    first: Option<&Line>,
    wanted: &[Wanted],
) -> Result<Layout, Option<(&'l Line<'t>, Wrong)>> {
    let width = first.map(|line| separator.split(line.text).len());
    let mut nearest: Option<(usize, &Line, Wrong)> = None;
    for line in head.iter().filter(|line| above.is_none_or(|n| line.number <= n)) {
        // the line of names may be separated in another way than the numbers, as that of numpy is
        for way in std::iter::once(separator).chain(Separator::ALL.into_iter().filter(|_| line.is_comment)) {
            let names = names_of(line.text, way);
            let wrong = match find(&names, wanted, Some(line.number)) {
                Ok(places) => {
                    let like_rows = way == separator && !line.is_comment;
                    let named = like_rows.then_some((line.number, names.len()));
                    return Ok(Layout { separator, places, above: above.unwrap_or(line.number), named });
                }
                Err(wrong) => wrong,
            };
            let is_known = |w: &&Wanted| !w.optional && find(&names, std::slice::from_ref(*w), None).is_ok();
            let known = wanted.iter().filter(is_known).count();
            let above_numbers = first.is_none_or(|first| line.number < first.number);
            let may_be = known > 0 || above_numbers && (!line.is_comment || Some(names.len()) == width);
            // of lines that have none of the names the last one is nearest to the numbers
            if may_be && nearest.as_ref().is_none_or(|(most, ..)| known > *most || known == 0 && *most == 0) {
                nearest = Some((known, line, wrong));
            }
        }
    }
    Err(nearest.map(|(_, line, wrong)| (line, wrong)))
}

/// What separates the first line where there are no numbers.
fn usual(head: &[Line]) -> Option<Separator> {
    let line = head.first()?;
    Separator::ALL.into_iter().find(|separator| separator.split(line.text).len() > 1)
}

/// Names of columns; where spaces separate them, a unit in brackets ends a name.
fn names_of(line: &str, separator: Separator) -> Vec<String> {
    let fields = separator.split(line);
    let is_unit = |field: &String| field.starts_with(['[', '(']) && field.ends_with([']', ')']);
    if separator != Separator::Space || !fields.iter().any(is_unit) {
        return fields;
    }
    let mut names = Vec::new();
    let mut parts: Vec<String> = Vec::new();
    for field in fields {
        let ends = is_unit(&field);
        parts.push(field);
        if ends {
            names.push(std::mem::take(&mut parts).join(" "));
        }
    }
    names.extend(parts);
    names
}

fn is_of_numbers(line: &Line, separator: Separator) -> bool {
    let fields = separator.split(line.text);
    let is_number = |field: &String| number(field, separator).is_some() || is_missing(field);
    !line.is_comment && fields.iter().all(is_number)
}

/// Says that another separator than the one given separates the columns.
fn blame_separator(line: &Line, cut: Cut, found: Option<Separator>) -> Option<Wrong> {
    let given = cut.separator?;
    let better = found.filter(|found| *found != given)?;
    let count = given.split(line.text).len();
    let columns = if count == 1 { "one column".to_owned() } else { format!("{count} columns") };
    let what = format!("with `separator` = \"{}\" this is {columns}: {}", given.name(), short(line.text));
    let hint =
        format!("{} separate its columns: `separator` = \"{}\", or leave it out", better.plural(), better.name());
    Some(Wrong::new(Some(line.number), what, hint))
}

/// The beginning of a line, its tabs written as `\\t`.
fn short(text: &str) -> String {
    const MOST: usize = 60;
    let more = if text.chars().count() > MOST { "…" } else { "" };
    let mut shown = String::new();
    for letter in text.chars().take(MOST) {
        if letter.is_control() { shown.extend(letter.escape_debug()) } else { shown.push(letter) }
    }
    shown + more
}

/// The columns of a text that begins with numbers, as far as its form tells their numbers.
fn without_names(head: &[Line], separator: Separator, above: Option<u64>, wanted: &[Wanted]) -> Result<Layout, Wrong> {
    let first = head.iter().find(|line| !line.is_comment && above.is_none_or(|n| line.number > n));
    let line = first.or(head.first()).map(|line| line.number);
    let width = first.map_or(0, |line| separator.split(line.text).len());
    let known = wanted.iter().all(|w| w.without_names.is_some() || w.optional || matches!(w.column, Column::Number(_)));
    if !known {
        let what = "the columns have no names: these are numbers";
        let hint = format!(
            "take columns by their numbers, such as columns = {{ x = 1, y = 2, … }}: of {width}, separated by {}",
            separator.plural()
        );
        return Err(Wrong::new(line, what, hint));
    }
    let place = |column: &Wanted| {
        let number = match column.column {
            Column::Number(number) => Some(number),
            Column::Name(_) => column.without_names,
        };
        match number {
            Some(number) if number <= width => Ok(Some(number - 1)),
            Some(_) | None if column.optional => Ok(None),
            Some(number) => {
                let what = format!("there is no column {number} (`{}`): it has {width}", column.key);
                Err(Wrong::new(line, what, "check `format`, `separator` and `columns`"))
            }
            None => Ok(None),
        }
    };
    let places = wanted.iter().map(place).collect::<Result<_, _>>()?;
    Ok(Layout { separator, places, above: above.unwrap_or(0), named: None })
}

/// The numbers of all rows below the head.
fn rows(body: &str, layout: &Layout, wanted: &[Wanted], names: &mut NameNumbers) -> Result<Rows, Wrong> {
    let mut table = csv::ReaderBuilder::new()
        .delimiter(layout.separator.byte())
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(body.as_bytes());
    let mut entries = Entries { layout, wanted, names, marks: [None; 2] };
    let mut found = Rows::default();
    let mut record = csv::StringRecord::new();
    loop {
        match table.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => {
                let line = error.position().map(csv::Position::line);
                return Err(Wrong::new(line, format!("cannot be read ({error})"), "is a quotation mark left open?"));
            }
        }
        let line = record.position().map_or(0, csv::Position::line);
        let first = record.get(0).unwrap_or("");
        let empty = record.iter().all(str::is_empty);
        // below the names there may be more lines of texts, such as units
        let more = found.values.is_empty() && !entries.has_number(&record);
        if line <= layout.above || first.starts_with(['#', '%']) || empty || more {
            continue;
        }
        found.values.push(entries.row(&record, line)?);
        found.lines.push(line);
    }
    Ok(found)
}

/// Takes the wanted entries of records.
struct Entries<'w> {
    layout: &'w Layout,
    wanted: &'w [Wanted],
    names: &'w mut NameNumbers,
    /// A line in which a number has a decimal comma, and one in which it has a point.
    marks: [Option<u64>; 2],
}

impl<'w> Entries<'w> {
    fn has_number(&self, record: &csv::StringRecord) -> bool {
        let is_number = |at: &usize| {
            let entry = record.get(*at).unwrap_or("");
            number(entry, self.layout.separator).is_some() || !entry.is_empty() && is_missing(entry)
        };
        self.layout.places.iter().flatten().any(is_number)
    }

    fn row(&mut self, record: &csv::StringRecord, line: u64) -> Result<Vec<f64>, Wrong> {
        if let Some((of_names, count)) = self.layout.named {
            // a separator at the end of a row makes no column
            let filled = (0..record.len()).rev().find(|at| !record[*at].is_empty()).map_or(0, |at| at + 1);
            if record.len() < count || filled > count {
                let what = format!("has {} values, and line {of_names} names {count} columns", record.len());
                let hint = match self.layout.separator {
                    Separator::Comma => {
                        "commas separate the values: decimal commas need semicolons or tabs between them"
                    }
                    Separator::Tab | Separator::Semicolon | Separator::Space => "check this line, and `separator`",
                };
                return Err(Wrong::new(Some(line), what, hint));
            }
        }
        let (layout, wanted) = (self.layout, self.wanted);
        layout.places.iter().zip(wanted).map(|(at, column)| self.entry(record, *at, column, line)).collect()
    }

    fn entry(
        &mut self,
        record: &csv::StringRecord,
        at: Option<usize>,
        column: &Wanted,
        line: u64,
    ) -> Result<f64, Wrong> {
        let Some(at) = at else { return Ok(f64::NAN) };
        let Some(text) = record.get(at) else {
            let what = format!("has {} values, and {} is to be read", record.len(), column.column);
            return Err(Wrong::new(Some(line), what, "check this line, `separator` and `columns`"));
        };
        if is_missing(text) {
            return Ok(f64::NAN);
        }
        if column.names {
            return Ok(self.names.number(text));
        }
        let value = match text {
            "true" | "True" | "TRUE" => Some(1.0),
            "false" | "False" | "FALSE" => Some(0.0),
            _ => number(text, self.layout.separator),
        };
        let value = value.filter(|value| value.is_finite()).ok_or_else(|| {
            let what = format!("{} = {}: must be a finite number, or missing", column.column, short(text));
            Wrong::new(Some(line), what, "leave the entry empty, or write NaN, where nothing was measured")
        })?;
        self.check_mark(text, column, line)?;
        Ok(value)
    }

    /// Refuses commas in one number and points in another one: the comma could separate thousands.
    fn check_mark(&mut self, text: &str, column: &Wanted, line: u64) -> Result<(), Wrong> {
        let marks = [text.contains(','), text.contains('.')];
        for (mark, has) in self.marks.iter_mut().zip(marks) {
            *mark = mark.or(has.then_some(line));
        }
        match self.marks {
            [Some(comma), Some(point)] => {
                let other = if marks[0] { point } else { comma };
                let mark = if marks[0] { "a comma" } else { "a point" };
                let what =
                    format!("{} = {text} has {mark}, and line {other} has the other decimal mark", column.column);
                Err(Wrong::new(Some(line), what, "use one decimal mark, and no separators of thousands"))
            }
            [_, _] => Ok(()),
        }
    }
}
