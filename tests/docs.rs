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

/// Comments without the programs in them; formulas, whose fences say `text`, stay.
fn without_examples<'l>(comments: impl Iterator<Item = &'l str>) -> String {
    let (mut kept, mut program, mut fenced) = (String::new(), false, false);
    for line in comments {
        let content = line.trim_start_matches(['/', '!']).trim_start();
        if content.starts_with("```") {
            fenced = !fenced;
            program = fenced && content == "```";
        } else if !program {
            kept += content;
            kept.push('\n');
        }
    }
    kept
}

#[test]
fn every_tag_in_the_code_is_on_the_model_page() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = tags(&std::fs::read_to_string(root.join("docs/model.md")).unwrap());
    let files = sources(&root.join("src"));
    let mut cited = BTreeSet::new();
    for file in &files {
        // tags stand in comments; code has floats and ranges in brackets, also where it is an example
        let text = std::fs::read_to_string(file).unwrap();
        let comments = text.lines().map(str::trim_start).filter(|line| line.starts_with("//"));
        for tag in tags(&without_examples(comments)) {
            if !page.contains(&tag) {
                panic!("{} cites [{tag}], which docs/model.md does not have", file.display());
            }
            cited.insert(tag);
        }
    }
    assert!(cited.len() > 15, "the code cites {cited:?} only");
}

#[test]
fn every_shape_is_on_the_page_of_scenes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/scene.md")).unwrap();
    for row in monolayer::shape::SHAPES {
        let example = format!("`{{ {} = {{ ", row.name);
        assert!(page.contains(&example), "docs/scene.md says nothing of {example}");
    }
}

/// Lines of a program that is shown, without those that only its test needs.
fn shown(text: &str) -> usize {
    text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with("# ")).count()
}

#[test]
fn programs_that_are_shown_are_short() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ring = std::fs::read_to_string(root.join("examples/ring.rs")).unwrap();
    assert!(ring.lines().count() <= 25, "a ring of tissue takes {} lines", ring.lines().count());
    let mut longest = 0;
    for file in sources(&root.join("src")) {
        let text = std::fs::read_to_string(&file).unwrap();
        let docs = text.lines().map(|line| line.trim_start()).filter_map(|line| line.strip_prefix("//!"));
        let docs: Vec<&str> = docs.map(|line| line.strip_prefix(' ').unwrap_or(line)).collect();
        // what stands between two fences
        for example in docs.join("\n").split("\n```\n").skip(1).step_by(2) {
            let count = shown(example);
            assert!(count <= 30, "{} shows a program of {count} lines", file.display());
            longest = longest.max(count);
        }
    }
    assert!(longest > 20, "no example was found");
}

/// Names and years such as `Keller 1977` or `Zhang and Shu (2010)`: the last name before the year.
fn citations(text: &str) -> BTreeSet<(String, String)> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let year = |word: &str| -> Option<String> {
        let digits = word.trim_matches(|c: char| !c.is_alphanumeric());
        let fits = digits.len() == 4 && digits.chars().all(|c| c.is_ascii_digit());
        (fits && ["19", "20"].contains(&&digits[..2])).then(|| digits.to_owned())
    };
    let name = |word: &str| -> Option<String> {
        let name = word.trim_start_matches('(');
        let fits = name.chars().next()?.is_uppercase() && name.chars().all(char::is_alphabetic);
        (fits && name.chars().count() > 2).then(|| name.to_owned())
    };
    words.windows(2).filter_map(|pair| Some((name(pair[0])?, year(pair[1])?))).collect()
}

#[test]
fn what_is_cited_is_in_the_bibliography_and_the_other_way_round() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/bibliography.md")).unwrap();
    let entries: Vec<String> = page.split("\n- ").skip(1).map(|entry| entry.replace('\n', " ")).collect();
    let mut texts = vec![("docs".to_owned(), String::new())];
    for entry in std::fs::read_dir(root.join("docs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "md") && !path.ends_with("bibliography.md") {
            texts[0].1 += &std::fs::read_to_string(path).unwrap();
        }
    }
    for file in sources(&root.join("src")) {
        let text = std::fs::read_to_string(&file).unwrap();
        let comments = text.lines().map(str::trim_start).filter(|l| l.starts_with("//"));
        let comments: Vec<&str> = comments.map(|l| l.trim_start_matches(['/', '!'])).collect();
        let name = file.strip_prefix(root.join("src")).unwrap().to_str().unwrap().replace('\\', "/");
        texts.push((name, comments.join(" ")));
    }
    let mut found = 0;
    for (file, text) in &texts {
        for (name, year) in citations(text) {
            let known = entries.iter().any(|entry| entry.contains(&name) && entry.contains(&year));
            assert!(known, "{file} cites {name} {year}, which docs/bibliography.md does not have");
            found += 1;
        }
    }
    assert!(found > 12, "{found} citations");
    for entry in &entries {
        let (who, places) = entry.rsplit_once('—').expect("an entry says where it is cited");
        let surname = who.split(['.', ',']).map(str::trim).find(|part| part.chars().count() > 2).unwrap();
        let surname = surname.split(' ').next_back().unwrap();
        for place in places.split('`').skip(1).step_by(2) {
            let (_, text) = texts.iter().find(|(file, _)| file == place).unwrap_or_else(|| panic!("no file {place}"));
            assert!(text.contains(surname), "{place} does not cite {surname}");
        }
    }
}
