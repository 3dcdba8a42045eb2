//! The text of a file, whatever it was written with.

use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::Wrong;

/// Bytes of a file, unpacked if it was packed by gzip, whatever its name.
pub(super) fn read(file: &Path) -> Result<Vec<u8>, Wrong> {
    let wrong = |error: &std::io::Error| Wrong::new(None, format!("cannot be read ({error})"), "is it the right file?");
    let bytes = std::fs::read(file).map_err(|error| wrong(&error))?;
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let mut unpacked = Vec::new();
    MultiGzDecoder::new(&bytes[..]).read_to_end(&mut unpacked).map_err(|error| {
        Wrong::new(None, format!("cannot be unpacked ({error})"), "the file was cut off, or is no gzip: copy it again")
    })?;
    Ok(unpacked)
}

/// UTF-8 with or without its mark, UTF-16 with its mark, else Latin-1; line ends of any system become `\n`.
pub(super) fn decode(bytes: Vec<u8>) -> Result<String, Wrong> {
    let text = match bytes[..] {
        [0xff, 0xfe, ref rest @ ..] => wide(rest, u16::from_le_bytes)?,
        [0xfe, 0xff, ref rest @ ..] => wide(rest, u16::from_be_bytes)?,
        [0xef, 0xbb, 0xbf, ref rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        _ => narrow(bytes)?,
    };
    let is_text = !text.chars().take(1000).any(|c| c == '\0');
    if !is_text {
        return Err(Wrong::new(None, "is no text", known_kinds()));
    }
    // lines that end as on old Macintoshes, alone or before \n
    Ok(if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text })
}

fn known_kinds() -> &'static str {
    "tables are texts (comma, semicolon, tab or space separated, gzipped or not) or Parquet; save it as one of these"
}

fn narrow(bytes: Vec<u8>) -> Result<String, Wrong> {
    let kinds = [
        (&b"PK\x03\x04"[..], "an Excel or zip file"),
        (b"\x89HDF", "an HDF5 or MATLAB file"),
        (b"MATLAB", "a MATLAB file"),
    ];
    if let Some((_, kind)) = kinds.iter().find(|(mark, _)| bytes.starts_with(mark)) {
        return Err(Wrong::new(None, format!("is {kind}"), known_kinds()));
    }
    // each byte of Latin-1 is the character of that number
    Ok(String::from_utf8(bytes).unwrap_or_else(|error| error.into_bytes().into_iter().map(char::from).collect()))
}

fn wide(bytes: &[u8], join: fn([u8; 2]) -> u16) -> Result<String, Wrong> {
    let units = bytes.chunks_exact(2).map(|pair| join([pair[0], pair[1]]));
    let text: Result<String, _> = char::decode_utf16(units).collect();
    text.map_err(|_| Wrong::new(None, "begins as UTF-16 and is none", "save it as UTF-8"))
}
