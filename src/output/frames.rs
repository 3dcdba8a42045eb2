//! Lists of the pictures that make a film: `frames.csv` for tables, and for each film a text file in the format of
//! ffmpeg's `concat` demuxer.
//!
//! ```text
//! ffmpeg -f concat -i frames-NAME.txt -pix_fmt yuv420p NAME.mp4
//! ```
//! A frame lasts in proportion to the time until the next one, and half of them no longer than 1/25 second.

use std::path::{Path, PathBuf};

use super::{OutputError, number, write_whole};

/// Seconds of the frame of median duration.
const SECONDS: f64 = 0.04;

/// The list of all frames, in the folder of a run.
pub const TABLE: &str = "frames.csv";

const HEADER: [&str; 4] = ["film", "file", "time", "duration"];

/// A picture of a film.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Name of the film: that of the pictures.
    pub film: String,
    /// Relative to the folder of the list.
    pub file: String,
    /// Time of the fields.
    pub time: f64,
}

/// The lists of a folder; both files are replaced as a whole by every change.
#[derive(Debug)]
pub struct Frames {
    folder: PathBuf,
    frames: Vec<Frame>,
}

impl Frames {
    /// Starts empty lists.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    pub fn create(folder: &Path) -> Result<Self, OutputError> {
        let frames = Self { folder: folder.into(), frames: Vec::new() };
        frames.write_table().map(|()| frames)
    }

    /// Continues the lists from `time` on: later frames are dropped. Without a file they start empty.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] for a file that is no list of frames, [`OutputError::Io`] if it cannot be read or
    /// written.
    pub fn resume(folder: &Path, time: f64) -> Result<Self, OutputError> {
        let path = folder.join(TABLE);
        if !path.exists() {
            return Self::create(folder);
        }
        let mut frames = read(&path)?;
        frames.retain(|frame| frame.time <= time);
        let frames = Self { folder: folder.into(), frames };
        frames.write_table()?;
        let mut films: Vec<&str> = frames.frames.iter().map(|frame| frame.film.as_str()).collect();
        films.sort_unstable();
        films.dedup();
        films.into_iter().try_for_each(|film| frames.write_film(film))?;
        Ok(frames)
    }

    /// Adds a picture to a film; one of the same file is replaced.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    ///
    /// # Panics
    /// When the time is not a number or infinite.
    pub fn append(&mut self, film: &str, file: &str, time: f64) -> Result<(), OutputError> {
        assert!(time.is_finite(), "picture at time {time}");
        self.frames.retain(|frame| frame.file != file);
        self.frames.push(Frame { film: film.into(), file: file.into(), time });
        self.write_table()?;
        self.write_film(film)
    }

    /// The frames so far.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    fn of<'s>(&'s self, film: &'s str) -> impl Iterator<Item = &'s Frame> {
        self.frames.iter().filter(move |frame| frame.film == film)
    }

    fn write_table(&self) -> Result<(), OutputError> {
        let mut films: Vec<(&str, std::vec::IntoIter<f64>)> = Vec::new();
        let mut duration = |film| match films.iter_mut().find(|(name, _)| *name == film) {
            Some((_, left)) => left.next().expect("a duration for every frame"),
            None => {
                let times: Vec<f64> = self.of(film).map(|frame| frame.time).collect();
                let mut left = durations(&times).into_iter();
                let first = left.next().expect("a duration for every frame");
                films.push((film, left));
                first
            }
        };
        let rows = self.frames.iter().map(|frame| {
            let numbers = [frame.time, duration(&frame.film)].map(number);
            [frame.film.clone(), frame.file.clone()].into_iter().chain(numbers).collect::<Vec<_>>()
        });
        let mut table = csv::Writer::from_writer(Vec::new());
        let header = HEADER.map(str::to_owned).to_vec();
        std::iter::once(header).chain(rows).for_each(|row| table.write_record(row).expect("rows of equal length"));
        let bytes = table.into_inner().expect("writing to memory does not fail");
        write_whole(&self.folder.join(TABLE), |out| out.write_all(&bytes))
    }

    fn write_film(&self, film: &str) -> Result<(), OutputError> {
        let times: Vec<f64> = self.of(film).map(|frame| frame.time).collect();
        let durations = durations(&times);
        write_whole(&self.folder.join(format!("frames-{film}.txt")), |out| {
            writeln!(out, "ffconcat version 1.0")?;
            for (frame, seconds) in self.of(film).zip(&durations) {
                writeln!(out, "file {}\nduration {seconds:.6}", quoted(&frame.file))?;
            }
            // the duration of the last frame counts only if another follows
            match self.of(film).last() {
                Some(last) => writeln!(out, "file {}", quoted(&last.file)),
                None => Ok(()),
            }
        })
    }
}

/// Seconds that each frame stays: in proportion to the time until the next one; the last one stays as long as the
/// median.
pub fn durations(times: &[f64]) -> Vec<f64> {
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().filter(|step| *step > 0.0);
    let seconds = |step: f64| median.map_or(SECONDS, |median| (SECONDS * step / median).max(0.001));
    steps.iter().map(|step| seconds(*step)).chain(times.last().map(|_| SECONDS)).collect()
}

/// A file name as the demuxer reads it.
fn quoted(file: &str) -> String {
    format!("'{}'", file.replace('\'', r"'\''"))
}

/// Reads a list of frames; a row that was cut off is left out.
///
/// # Errors
/// [`OutputError::Malformed`] for another table.
pub fn read(path: &Path) -> Result<Vec<Frame>, OutputError> {
    let malformed = |what: String| OutputError::Malformed {
        path: path.display().to_string(),
        what,
        hint: "it is not the list of frames of this run; move it away to begin a new one",
    };
    let mut reader = csv::Reader::from_path(path).map_err(|e| malformed(e.to_string()))?;
    if !reader.headers().map_err(|e| malformed(e.to_string()))?.iter().eq(HEADER) {
        return Err(malformed(format!("its columns are not {}", HEADER.join(","))));
    }
    let frame = |row: csv::StringRecord| {
        let time = row.get(2).and_then(|t| t.parse().ok()).filter(|t: &f64| t.is_finite())?;
        Some(Frame { film: row.get(0)?.into(), file: row.get(1)?.into(), time })
    };
    Ok(reader.records().map_while(Result::ok).filter_map(frame).collect())
}
