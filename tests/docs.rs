//! The code and the model page cite the same formulas.

mod sources;

use std::collections::BTreeSet;
use std::path::Path;

use sources::sources;

/// Tags such as `[7.6d]`, `[9.1.2]` or `[B.54]`.
fn tags(text: &str) -> BTreeSet<String> {
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split_once(']').map(|(tag, _)| tag));
    let parts = inside.flat_map(|tag| tag.split(['–', ',']).map(str::trim));
    let is_tag = |tag: &&str| {
        let Some((chapter, number)) = tag.split_once('.') else { return false };
        let chapter_fits = chapter == "B" || (!chapter.is_empty() && chapter.chars().all(|c| c.is_ascii_digit()));
        chapter_fits
            && number.starts_with(|c: char| c.is_ascii_digit())
            && number.trim_end_matches(char::is_alphabetic).chars().all(|c| c.is_ascii_digit() || c == '.')
            && !number.contains("..")
    };
    parts.filter(is_tag).map(str::to_owned).collect()
}

#[test]
fn every_tag_in_the_code_is_on_the_model_page() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = tags(&std::fs::read_to_string(root.join("docs/model.md")).unwrap());
    let files = sources(&root.join("src"));
    let mut cited = BTreeSet::new();
    for file in &files {
        // tags stand in comments; code has floats and ranges in brackets
        let text = std::fs::read_to_string(file).unwrap();
        let comments: String = text.lines().filter(|l| l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
        for tag in tags(&comments) {
            if !page.contains(&tag) {
                panic!("{} cites [{tag}], which docs/model.md does not have", file.display());
            }
            cited.insert(tag);
        }
    }
    assert!(cited.len() > 15, "the code cites {cited:?} only");
}
