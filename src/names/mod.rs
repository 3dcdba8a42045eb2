//! The mark of the program's files, and hints for names that do not exist: the word that another paper or program has
//! for it, else the nearest name that does.

mod words;

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use words::{Row, WORDS};

/// The mark of files that are written where a user's own may lie, in a comment or whatever a format has for it.
pub const MADE_BY: &str = "made by monolayer";

/// A text for as long as the program runs, each once: a table knows its columns by such names.
pub(crate) fn kept(text: String) -> &'static str {
    static ALL: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = all.get(text.as_str()) {
        return known;
    }
    let new: &'static str = text.leak();
    all.insert(new);
    new
}

/// What is said where a feature of the crate would be needed that it was built without; `does` is what that does.
pub(crate) fn absent(feature: &str, does: &str) -> String {
    format!("built without the feature `{feature}`, which {does}")
}

/// Keys that have had another name, and their names now: one row each. Only the last part of a path changes.
pub const RENAMED: [(&str, &str); 2] = [("model.slip", "model.alignment"), ("space.slip", "space.walls")];

/// The name that a parameter of formulas has now.
pub(super) fn parameter_now(name: &str) -> Option<&'static str> {
    let row = RENAMED.iter().find(|row| row.0.strip_prefix("model.") == Some(name))?;
    row.1.strip_prefix("model.")
}

/// ` (did you mean `…`?)` with one of `known`, ` (…)` with what is to be written instead, or nothing where nothing is
/// known.
pub fn did_you_mean(name: &str, known: &[&str]) -> String {
    if let Some(say) = said_elsewhere(name, known) {
        return format!(" ({say})");
    }
    nearest(name, known).map_or_else(String::new, |found| format!(" (did you mean `{found}`?)"))
}

/// The nearest of `known` within a third of the name's length in edits (at least one), the first of equals; never its
/// opposite.
pub fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    let allowed = near_enough(name);
    let candidates = known.iter().filter(|candidate| !opposite(name, candidate));
    let edits = |candidate: &str| if same_letters(name, candidate) { 0 } else { distance(name, candidate) };
    let best = candidates.map(|candidate| (edits(candidate), *candidate)).min_by_key(|(d, _)| *d)?;
    (best.0 <= allowed).then_some(best.1)
}

/// Whether two names differ in `_`, `-` and blanks alone, such as `vx` and `v_x`.
fn same_letters(a: &str, b: &str) -> bool {
    let letters = |name: &str| name.replace(['_', '-', ' '], "");
    letters(a) == letters(b)
}

/// A third of the name's length in edits, at least one; a single capital is a symbol and not mistyped.
fn near_enough(name: &str) -> usize {
    match name.as_bytes() {
        [letter] if letter.is_ascii_uppercase() => 0,
        _ => (name.chars().count() / 3).max(1),
    }
}

/// What the table of words says of a name, alone or behind dots: `model.kappa` where `model.coherence` is known.
fn said_elsewhere(name: &str, known: &[&str]) -> Option<String> {
    // a word that is meant goes before one that might have been mistyped, but not before the name itself
    let typing = if word(name, known, false).is_some() { 0 } else { near_enough(name).min(1) };
    if known.iter().any(|candidate| distance(name, candidate) <= typing && !opposite(name, candidate)) {
        return None;
    }
    if known.iter().all(|path| path.contains('.')) && !known.is_empty() {
        let (before, last) = name.rsplit_once('.').unwrap_or(("", name));
        let end = |path: &&'_ str| path.rsplit_once('.').is_some_and(|(table, _)| before.is_empty() || table == before);
        let inside: Vec<&str> = known.iter().copied().filter(end).collect();
        let ends: Vec<&str> = inside.iter().filter_map(|path| path.rsplit('.').next()).collect();
        let found = word(last, &ends, true).filter(|found| ends.contains(found)).or_else(|| nearest(last, &ends))?;
        let path = inside[ends.iter().position(|end| *end == found)?];
        return (path != name).then(|| format!("did you mean `{path}`?"));
    }
    let found = word(name, known, true)?;
    if known.contains(&found) { Some(format!("did you mean `{found}`?")) } else { Some(found.to_owned()) }
}

/// The answer of the first row that fits; where none fits and `near` is set, of the first that fits but for one letter.
fn word(name: &str, known: &[&str], near: bool) -> Option<&'static str> {
    let name = plain(name);
    let here = |row: &&Row| row.0.is_empty() || row.0.split(' ').all(|key| known.contains(&key));
    let words = |row: &Row| row.1.split(' ').collect::<Vec<_>>();
    let exact = WORDS.iter().filter(here).find(|row| words(row).contains(&name.as_str()));
    let almost = || {
        let close = |word: &&str| word.len() >= 6 && distance(word, &name) == 1;
        WORDS.iter().filter(here).find(|row| words(row).iter().any(&close))
    };
    exact.or_else(|| almost().filter(|_| near)).map(|row| row.2)
}

/// Lower case, Greek letters by their names, and nothing but letters and digits: `S_a` and `s-a` are `sa`.
fn plain(name: &str) -> String {
    const GREEK: [(char, &str); 20] = [
        ('α', "alpha"),
        ('β', "beta"),
        ('γ', "gamma"),
        ('δ', "delta"),
        ('ε', "epsilon"),
        ('ζ', "zeta"),
        ('η', "eta"),
        ('θ', "theta"),
        ('κ', "kappa"),
        ('λ', "lambda"),
        ('μ', "mu"),
        ('ν', "nu"),
        ('ξ', "xi"),
        ('π', "pi"),
        ('ρ', "rho"),
        ('σ', "sigma"),
        ('τ', "tau"),
        ('φ', "phi"),
        ('ψ', "psi"),
        ('ω', "omega"),
    ];
    let mut out = String::new();
    for letter in name.chars().flat_map(char::to_lowercase) {
        match GREEK.iter().find(|(greek, _)| *greek == letter) {
            Some((_, latin)) => out.push_str(latin),
            None if letter == '\'' => out.push_str("prime"),
            None => out.extend(letter.is_alphanumeric().then_some(letter)),
        }
    }
    out
}

/// Whether one name is the other with its meaning turned round: `noslip` and `slip`, `step_max` and `step_min`.
fn opposite(a: &str, b: &str) -> bool {
    const NOT: [&str; 8] = ["no", "non", "not", "un", "in", "im", "anti", "dis"];
    const GREEK_NOT: [(&str, &str); 2] = [("asymm", "symm"), ("aniso", "iso")];
    const PAIRS: [(&str, &str); 14] = [
        ("min", "max"),
        ("in", "out"),
        ("left", "right"),
        ("top", "bottom"),
        ("upper", "lower"),
        ("plus", "minus"),
        ("start", "end"),
        ("first", "last"),
        ("free", "fixed"),
        ("inner", "outer"),
        ("before", "after"),
        ("implicit", "explicit"),
        ("high", "low"),
        ("on", "off"),
    ];
    let (a, b) = (plain(a), plain(b));
    let close = |x: &str, y: &str| x == y || (x.len() >= 6 && distance(x, y) <= 1);
    let negates = |x: &str, y: &str| {
        let greek = GREEK_NOT.iter().any(|(one, other)| x.starts_with(one) && close(&x.replacen(one, other, 1), y));
        greek || NOT.iter().any(|not| x.strip_prefix(not).is_some_and(|rest| rest.len() > 2 && close(rest, y)))
    };
    let turned = |x: &str, y: &str| {
        PAIRS.iter().any(|(one, other)| {
            [(one, other), (other, one)].iter().any(|(one, other)| {
                x.matches(**one).count() == 1 && !x.contains(**other) && close(&x.replacen(**one, other, 1), y)
            })
        })
    };
    a != b && (negates(&a, &b) || negates(&b, &a) || turned(&a, &b))
}

/// Edits (insert, delete, replace, swap neighbours) from `a` to `b`, without regard to case and `-` against `_`.
fn distance(a: &str, b: &str) -> usize {
    let fold = |s: &str| s.to_lowercase().replace('-', "_").chars().collect::<Vec<_>>();
    let (a, b) = (fold(a), fold(b));
    let mut table = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            table[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replace = table[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
                let swap = if swapped { table[i - 2][j - 2] + 1 } else { usize::MAX };
                replace.min(table[i - 1][j] + 1).min(table[i][j - 1] + 1).min(swap)
            };
        }
    }
    table[a.len()][b.len()]
}
