//! One file, or one for each frame.

use std::path::{Path, PathBuf};

/// A file and the number of its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameFile {
    pub path: PathBuf,
    pub frame: f64,
}

/// Whether a path stands for several files.
pub fn is_pattern(path: &Path) -> bool {
    !path.exists() && path.to_string_lossy().contains(['*', '?', '['])
}

/// The files of a path or pattern, in the order of their frames; a message for a pattern that is none.
///
/// The number of a frame is the first number in which the files' names differ; where they do not differ by a number,
/// the place of the file in the order of the names, from 0.
pub fn list(path: &Path) -> Result<Vec<FrameFile>, String> {
    if !is_pattern(path) {
        return Ok(vec![FrameFile { path: path.to_owned(), frame: 0.0 }]);
    }
    let found = glob::glob(&path.to_string_lossy()).map_err(|error| error.to_string())?;
    let mut paths: Vec<PathBuf> = found.filter_map(Result::ok).filter(|path| path.is_file()).collect();
    paths.sort();
    let names: Vec<String> = paths.iter().map(|path| path.to_string_lossy().into_owned()).collect();
    let numbers = numbers(&names).unwrap_or_else(|| (0..names.len()).map(|k| k as f64).collect());
    let mut files: Vec<FrameFile> =
        paths.into_iter().zip(numbers).map(|(path, frame)| FrameFile { path, frame }).collect();
    files.sort_by(|a, b| a.frame.total_cmp(&b.frame));
    Ok(files)
}

/// The number in each name that begins where they first differ; `None` unless all have one, each another.
fn numbers(names: &[String]) -> Option<Vec<f64>> {
    let first = names.first()?.as_bytes();
    let common = |other: &String| first.iter().zip(other.as_bytes()).take_while(|(a, b)| a == b).count();
    let differ = names.iter().map(common).min()?;
    // a number may begin with digits that are the same in all
    let begin = first[..differ].iter().rposition(|byte| !byte.is_ascii_digit()).map_or(0, |at| at + 1);
    let number = |name: &String| {
        let digits: String = name.bytes().skip(begin).take_while(u8::is_ascii_digit).map(char::from).collect();
        digits.parse::<f64>().ok()
    };
    let found: Vec<f64> = names.iter().map(number).collect::<Option<_>>()?;
    let mut sorted = found.clone();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    (sorted.len() == names.len()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_frames_come_from_the_names() {
        let of = |names: &[&str]| numbers(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
        assert_eq!(of(&["a/f_08.txt", "a/f_09.txt", "a/f_10.txt"]), Some(vec![8.0, 9.0, 10.0]));
        assert_eq!(of(&["f100_a.txt", "f101_a.txt", "f11_a.txt"]), Some(vec![100.0, 101.0, 11.0]));
        assert_eq!(of(&["e2_9.txt", "e2_10.txt"]), Some(vec![9.0, 10.0]));
        assert_eq!(of(&["day-a.txt", "day-b.txt"]), None);
        assert_eq!(of(&["f1_a.txt", "f1_b.txt"]), None);
        assert_eq!(of(&["f7.txt"]), None);
    }
}
