//! Pictures as data URIs.

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use quick_xml::Reader;
use quick_xml::events::Event;

use crate::results::{Drawn, Results};

/// An SVG with more bytes than these gives way to a smaller PNG beside it.
const LARGEST_SVG: usize = 300_000;

/// Most bytes of the pictures of a page, so that it can be mailed.
const MOST: usize = 6_000_000;

/// Digits at the end of the name of a picture that is one of many, after a hyphen.
const DIGITS: usize = 6;

/// A picture that can be shown.
struct Shown {
    uri: String,
    /// What it shows: its title, or the name of its file.
    title: String,
    file: String,
}

/// How many bytes of pictures a page still takes.
#[derive(Debug)]
pub(super) struct ByteBudget(usize);

impl ByteBudget {
    pub(super) fn of_page() -> Self {
        Self(MOST)
    }

    /// An equal share for each of the `count` parts of the page that are left.
    pub(super) fn share(&mut self, count: usize) -> Self {
        let share = self.0 / count.max(1);
        self.0 -= share;
        Self(share)
    }

    /// Takes the bytes of a picture, if there are so many.
    fn take(&mut self, picture: &Shown) -> bool {
        let fits = picture.uri.len() <= self.0;
        if fits {
            self.0 -= picture.uri.len();
        }
        fits
    }
}

/// The pictures of a folder, of a series the last one; what is not shown is a note. Returns how many there are.
pub(super) fn of_folder(folder: &Results, budget: &mut ByteBudget, notes: &mut Vec<String>) -> (Markup, usize) {
    let (chosen, series) = chosen(&folder.pictures);
    notes.extend(series);
    let (mut shown, mut left_out) = (Vec::new(), Vec::new());
    for path in chosen {
        match read(path) {
            Ok(picture) if budget.take(&picture) => shown.push(picture),
            Ok(_) => left_out.push(relative(path, folder)),
            Err(reason) => notes.push(format!("the picture {} is left out: {reason}", path.display())),
        }
    }
    if !left_out.is_empty() {
        let (count, megabytes) = (left_out.len(), MOST / 1_000_000);
        let which = left_out.join(", ");
        notes.push(format!(
            "{count} pictures are left out, for a page has at most {megabytes} MB of them; in {}: {which}",
            folder.path.display()
        ));
    }
    (figures(&shown), shown.len())
}

fn relative(path: &Path, folder: &Results) -> String {
    path.strip_prefix(&folder.path).unwrap_or(path).display().to_string()
}

/// Of pictures `NAME-NNNNNN` the last of each name, and all others; notes tell where the others of a series are.
fn chosen(pictures: &[PathBuf]) -> (Vec<&PathBuf>, Vec<String>) {
    let mut chosen: Vec<(&PathBuf, usize)> = Vec::new();
    for path in pictures {
        let name = series(path);
        match chosen.iter_mut().find(|(other, _)| name.is_some() && series(other) == name) {
            Some((last, earlier)) => {
                *earlier += 1;
                if number(path) > number(last) {
                    *last = path;
                }
            }
            None => chosen.push((path, 0)),
        }
    }
    let note = |(last, earlier): &(&PathBuf, usize)| {
        let name = series(last)?;
        let (short, place) = (name.file_name()?.to_string_lossy().into_owned(), name.parent()?.display().to_string());
        (*earlier > 0)
            .then(|| format!("of the pictures {short}-NNNNNN the last one is shown; {earlier} more are in {place}"))
    };
    let notes = chosen.iter().filter_map(note).collect();
    (chosen.into_iter().map(|(path, _)| path).collect(), notes)
}

/// `plots/NAME` of `plots/NAME-NNNNNN.svg`.
fn series(path: &Path) -> Option<PathBuf> {
    let stem = path.file_stem()?.to_str()?;
    let (name, digits) = stem.rsplit_once('-')?;
    let numbered = digits.len() >= DIGITS && digits.bytes().all(|byte| byte.is_ascii_digit());
    numbered.then(|| path.with_file_name(name))
}

fn number(path: &Path) -> Option<u64> {
    path.file_stem()?.to_str()?.rsplit_once('-')?.1.parse().ok()
}

/// Curves that were drawn for the page.
pub(super) fn drawn(drawn: &Drawn) -> Markup {
    let shown = drawn.pictures.iter().filter_map(|picture| {
        let svg = picture.image.svg().ok()?;
        let small = if svg.len() > LARGEST_SVG { picture.image.png().ok() } else { None };
        let uri = small.map_or_else(|| uri("svg+xml", svg.as_bytes()), |png| uri("png", &png));
        Some(Shown { uri, title: picture.image.title().to_owned(), file: String::new() })
    });
    figures(&shown.collect::<Vec<_>>())
}

fn figures(shown: &[Shown]) -> Markup {
    html! {
        @if !shown.is_empty() {
            div.figures {
                @for picture in shown {
                    figure {
                        img src=(picture.uri) alt=(picture.title);
                        @if !picture.file.is_empty() { figcaption { (picture.file) } }
                    }
                }
            }
        }
    }
}

fn uri(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))
}

fn read(path: &Path) -> Result<Shown, String> {
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let name = path.file_stem().unwrap_or_default().to_string_lossy().replace(['-', '_'], " ");
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        check_png(&bytes)?;
        return Ok(Shown { uri: uri("png", &bytes), title: name, file });
    }
    let text = std::str::from_utf8(&bytes).map_err(|_| "not an SVG text".to_owned())?;
    let title = svg_title(text)?.filter(|title| !title.trim().is_empty()).unwrap_or(name);
    let png = path.with_extension("png");
    if bytes.len() > LARGEST_SVG
        && let Ok(pixels) = std::fs::read(&png)
        && pixels.len() < bytes.len()
        && check_png(&pixels).is_ok()
    {
        return Ok(Shown { uri: uri("png", &pixels), title, file });
    }
    Ok(Shown { uri: uri("svg+xml", &bytes), title, file })
}

/// A PNG begins with its signature and ends with an empty `IEND`.
fn check_png(bytes: &[u8]) -> Result<(), String> {
    let whole =
        bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.len() > 12 && &bytes[bytes.len() - 8..][..4] == b"IEND";
    if whole { Ok(()) } else { Err("not a whole PNG".to_owned()) }
}

/// The title of a well-formed SVG.
fn svg_title(text: &str) -> Result<Option<String>, String> {
    let mut reader = Reader::from_str(text);
    let (mut depth, mut root, mut in_title, mut title) = (0usize, false, false, None::<String>);
    loop {
        match reader.read_event().map_err(|e| e.to_string())? {
            Event::Start(element) => {
                root |= depth == 0 && element.local_name().as_ref() == "svg";
                in_title = depth == 1 && element.local_name().as_ref() == "title" && title.is_none();
                depth += 1;
            }
            Event::Empty(element) => root |= depth == 0 && element.local_name().as_ref() == "svg",
            Event::End(_) => {
                depth = depth.saturating_sub(1);
                in_title = false;
            }
            Event::Text(piece) if in_title => {
                title.get_or_insert_default().push_str(&piece);
            }
            Event::GeneralRef(name) if in_title => {
                let known = quick_xml::escape::resolve_predefined_entity(&name);
                title.get_or_insert_default().push_str(known.unwrap_or("\u{fffd}"));
            }
            Event::Eof => break,
            Event::Text(_) | Event::GeneralRef(_) | Event::CData(_) | Event::Comment(_) => {}
            Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
        }
    }
    match (root, depth) {
        (false, _) => Err("not an SVG".to_owned()),
        (true, 0) => Ok(title),
        (true, _) => Err("the SVG was cut off".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_series_the_last_one_is_shown() {
        let names = [
            "plots/speed-000002.svg",
            "plots/speed-000010.svg",
            "plots/p-000004.png",
            "maps/speed-000001.svg",
            "a-12.svg",
            "a-13.svg",
        ];
        let paths = names.map(PathBuf::from);
        let (chosen, notes) = chosen(&paths);
        let shown: Vec<_> = chosen.iter().map(|path| path.display().to_string()).collect();
        assert_eq!(
            shown,
            ["plots/speed-000010.svg", "plots/p-000004.png", "maps/speed-000001.svg", "a-12.svg", "a-13.svg"]
        );
        assert_eq!(notes, ["of the pictures speed-NNNNNN the last one is shown; 1 more are in plots"]);
    }

    #[test]
    fn a_page_has_room_for_some_pictures() {
        let picture = |bytes: usize| Shown { uri: "x".repeat(bytes), title: String::new(), file: String::new() };
        let mut page = ByteBudget(100);
        let mut first = page.share(2);
        assert!(first.take(&picture(30)) && !first.take(&picture(30)) && first.take(&picture(20)));
        assert!(page.share(1).take(&picture(50)) && !page.share(1).take(&picture(1)));
    }

    #[test]
    fn titles_of_pictures_and_what_is_none() {
        let svg =
            "<?xml version=\"1.0\"?>\n<svg xmlns=\"x\"><title>a &lt; b &amp; c</title><g><title>no</title></g></svg>";
        assert_eq!(svg_title(svg), Ok(Some("a < b & c".to_owned())));
        assert_eq!(svg_title("<svg/>"), Ok(None));
        for broken in ["", "text", "<html></html>", "<svg><g>", &svg[..60]] {
            assert!(svg_title(broken).is_err(), "{broken}");
        }
        assert!(check_png(b"\x89PNG\r\n\x1a\n").is_err());
    }
}
