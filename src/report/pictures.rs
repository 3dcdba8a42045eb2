//! Pictures as data URIs.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use quick_xml::Reader;
use quick_xml::events::Event;

use crate::output::frames::Frame;
use crate::results::{Drawn, Results};

/// An SVG with more bytes than these gives way to the PNG beside it.
const LARGEST_SVG: usize = 1_500_000;

/// A picture that can be shown.
struct Shown {
    uri: String,
    /// What it shows: its title, or the name of its file.
    title: String,
    file: String,
}

/// Every picture of the folder, of a film the last one; what cannot be shown is a note. Returns how many there are.
pub(super) fn of_folder(folder: &Results, frames: &[Frame], notes: &mut Vec<String>) -> (Markup, usize) {
    let mut shown = Vec::new();
    let last = |film: &str| frames.iter().rfind(|frame| frame.film == film).map(|frame| &frame.file);
    let passed = |path: &Path| {
        let frame =
            frames.iter().find(|frame| folder.path.join(&frame.file).with_extension("") == path.with_extension(""));
        frame.is_some_and(|frame| last(&frame.film) != Some(&frame.file))
    };
    for path in folder.pictures.iter().filter(|path| !passed(path)) {
        match read(path) {
            Ok(picture) => shown.push(picture),
            Err(reason) => notes.push(format!("the picture {} is left out: {reason}", path.display())),
        }
    }
    (figures(&shown), shown.len())
}

/// Curves that were drawn for the page.
pub(super) fn drawn(drawn: &Drawn) -> Markup {
    let shown = drawn.pictures.iter().filter_map(|picture| {
        let svg = picture.plot.svg().ok()?;
        let title = picture.plot.title.clone();
        Some(Shown { uri: uri("svg+xml", svg.as_bytes()), title, file: String::new() })
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
