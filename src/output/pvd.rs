//! The index of a time series for ParaView (`.pvd`): which file holds which time.

use std::path::{Path, PathBuf};

use quick_xml::Reader;
use quick_xml::escape::escape;
use quick_xml::events::{BytesStart, Event};

use super::{OutputError, write_whole};

const HINT: &str = "the index is not one of this program: remove it, or start the run afresh in another folder";

/// One file of the series.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Time of the fields.
    pub time: f64,
    /// Files of one time and different parts are shown together.
    pub part: usize,
    /// Relative to the folder of the index.
    pub file: String,
}

/// A time series on disk. The index is replaced as a whole by every change, so it can be opened while a run goes on.
#[derive(Debug)]
pub struct Series {
    path: PathBuf,
    entries: Vec<Entry>,
}

impl Series {
    /// Starts an empty series, in place of one that may exist.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let series = Self { path: path.to_owned(), entries: Vec::new() };
        series.write().map(|()| series)
    }

    /// Continues a series from `time` on: later entries are dropped. Without a file it starts an empty one.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] for a file that is no index, [`OutputError::Io`] if it cannot be read or written.
    pub fn resume(path: &Path, time: f64) -> Result<Self, OutputError> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Self::create(path),
            Err(error) => return Err(OutputError::io(path, &error)),
        };
        let malformed = |what| OutputError::Malformed { path: path.display().to_string(), what, hint: HINT };
        let mut entries = parse(&text).map_err(malformed)?;
        entries.retain(|entry| entry.time <= time);
        let series = Self { path: path.to_owned(), entries };
        series.write().map(|()| series)
    }

    /// Adds a file. One that is in the series already is given the new time and the last place.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    ///
    /// # Panics
    /// When the time is not a number or infinite.
    pub fn append(&mut self, time: f64, file: &str) -> Result<(), OutputError> {
        assert!(time.is_finite(), "output at time {time}");
        self.entries.retain(|entry| entry.file != file);
        self.entries.push(Entry { time, part: 0, file: file.to_owned() });
        self.write()
    }

    /// Adds files that are shown together with what else the series has at this time, each as a part with its number. A
    /// file that never changes may be added at every time.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    ///
    /// # Panics
    /// When the time is not a number or infinite.
    pub fn append_parts(&mut self, time: f64, parts: &[(usize, String)]) -> Result<(), OutputError> {
        assert!(time.is_finite(), "output at time {time}");
        let mut new = parts.iter().map(|(part, file)| Entry { time, part: *part, file: file.clone() }).collect();
        self.entries.retain(|entry| !parts.iter().any(|(part, _)| entry.time == time && entry.part == *part));
        self.entries.append(&mut new);
        self.write()
    }

    /// The files so far.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn write(&self) -> Result<(), OutputError> {
        write_whole(&self.path, |out| {
            writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
            writeln!(out, r#"<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">"#)?;
            writeln!(out, "<Collection>")?;
            for Entry { time, part, file } in &self.entries {
                let file = escape(file.as_str());
                writeln!(out, r#"<DataSet timestep="{time}" group="" part="{part}" file="{file}"/>"#)?;
            }
            writeln!(out, "</Collection>\n</VTKFile>")
        })
    }
}

/// The entries of an index.
fn parse(text: &str) -> Result<Vec<Entry>, String> {
    let mut reader = Reader::from_str(text);
    let (mut entries, mut closed) = (Vec::new(), false);
    loop {
        match reader.read_event().map_err(|e| format!("at byte {}: {e}", reader.error_position()))? {
            Event::Start(tag) | Event::Empty(tag) if tag.name().as_ref() == "DataSet" => entries.push(entry(&tag)?),
            Event::End(tag) if tag.name().as_ref() == "Collection" => closed = true,
            Event::Eof if closed => return Ok(entries),
            Event::Eof => return Err("there is no complete <Collection> in it".to_owned()),
            _ => {}
        }
    }
}

fn entry(tag: &BytesStart) -> Result<Entry, String> {
    let find = |name: &str| {
        let attribute = tag.try_get_attribute(name).map_err(|e| e.to_string())?;
        let attribute = attribute.ok_or_else(|| format!("a <DataSet> has no attribute `{name}`"))?;
        attribute.normalized_value(quick_xml::XmlVersion::Implicit1_0).map(String::from).map_err(|e| e.to_string())
    };
    let (time, part, file) = (find("timestep")?, find("part")?, find("file")?);
    let number = time.parse().ok().filter(|t: &f64| t.is_finite());
    let number = number.ok_or_else(|| format!("the time `{time}` is not a number"))?;
    let part = part.parse().map_err(|_| format!("the part `{part}` is not a whole number"))?;
    Ok(Entry { time: number, part, file })
}
