//! What is linked may be: licences and sources of all crates, by the lists of `deny.toml`. `cargo deny` says more.

use std::path::Path;
use std::process::Command;

/// Whether a list of licences satisfies an expression such as `(MIT OR Apache-2.0) AND Unicode-3.0`.
fn satisfied(expression: &str, allowed: &[&str]) -> bool {
    let text = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = text.split_whitespace().collect();
    let (holds, rest) = any(&words, allowed);
    assert!(rest.is_empty(), "`{expression}` cannot be read");
    holds
}

/// Alternatives, of which `AND` binds more tightly.
fn any<'w>(words: &'w [&'w str], allowed: &[&str]) -> (bool, &'w [&'w str]) {
    let (mut holds, mut rest) = all(words, allowed);
    while let ["OR", after @ ..] = rest {
        let (other, after) = all(after, allowed);
        (holds, rest) = (holds | other, after);
    }
    (holds, rest)
}

fn all<'w>(words: &'w [&'w str], allowed: &[&str]) -> (bool, &'w [&'w str]) {
    let (mut holds, mut rest) = one(words, allowed);
    while let ["AND", after @ ..] = rest {
        let (other, after) = one(after, allowed);
        (holds, rest) = (holds & other, after);
    }
    (holds, rest)
}

fn one<'w>(words: &'w [&'w str], allowed: &[&str]) -> (bool, &'w [&'w str]) {
    match words {
        ["(", inside @ ..] => {
            let (holds, rest) = any(inside, allowed);
            (holds, rest.strip_prefix(&[")"]).expect("a bracket is closed"))
        }
        // an exception only adds rights
        [name, "WITH", _, rest @ ..] | [name, rest @ ..] => (allowed.contains(name), rest),
        [] => panic!("a licence is missing"),
    }
}

#[test]
fn expressions_are_read_as_spdx_has_them() {
    let allowed = ["MIT", "Zlib"];
    for (expression, holds) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("GPL-3.0 OR MIT", true),
        ("GPL-3.0 AND MIT", false),
        ("GPL-3.0/MIT", true),
        ("GPL-3.0 OR MIT AND Zlib", true),
        ("(GPL-3.0 OR MIT) AND Zlib", true),
        ("(GPL-3.0 OR MIT) AND BSL-1.0", false),
        ("MIT WITH LLVM-exception OR GPL-3.0", true),
    ] {
        assert_eq!(satisfied(expression, &allowed), holds, "{expression}");
    }
}

#[test]
fn every_crate_has_a_licence_and_a_source_that_are_allowed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rules: toml::Table = toml::from_str(&std::fs::read_to_string(root.join("deny.toml")).unwrap()).unwrap();
    let list = |table: &str, key: &str| -> Vec<&str> {
        rules[table][key].as_array().unwrap().iter().map(|entry| entry.as_str().unwrap()).collect()
    };
    let (licences, sources) = (list("licenses", "allow"), list("sources", "allow-registry"));
    // of this system: crates of others may never have been fetched
    let host = Command::new("rustc").arg("-vV").output().expect("a compiler");
    let host = String::from_utf8(host.stdout).unwrap();
    let host = host.lines().find_map(|line| line.strip_prefix("host: ")).expect("the compiler names its system");
    let mut metadata = Command::new(env!("CARGO"));
    metadata.args(["metadata", "--offline", "--locked", "--format-version", "1", "--filter-platform", host]);
    let output = metadata.current_dir(root).output().expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    assert!(packages.len() > 50, "{} crates", packages.len());
    for package in packages {
        let name = format!("{} {}", package["name"], package["version"]);
        let licence = package["license"].as_str().unwrap_or_else(|| panic!("{name} names no licence"));
        assert!(satisfied(licence, &licences), "{name}: {licence}");
        // only this crate has none
        let source = package["source"].as_str().and_then(|source| source.strip_prefix("registry+"));
        let fits = source.map_or(package["name"] == "monolayer", |source| sources.contains(&source));
        assert!(fits, "{name} comes from {}", package["source"]);
    }
}
