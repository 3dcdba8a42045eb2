//! Dotted paths of keys, as TOML writes them: `model.peclet`, `boundary."my wall".velocity`.

/// More keys than any scene has one below the other.
const DEEPEST: usize = 32;

/// A key as TOML writes it in a path: bare if it can be, else in quotes.
pub fn quoted(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !key.is_empty() && key.chars().all(bare) {
        return key.to_owned();
    }
    let mut out = String::from('"');
    for c in key.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", c as u32)),
            c => out.push(c),
        }
    }
    out + "\""
}

/// Keys as one path.
pub fn join<K: AsRef<str>>(keys: &[K]) -> String {
    keys.iter().map(|key| quoted(key.as_ref())).collect::<Vec<_>>().join(".")
}

/// The keys of a path. A key with dots, spaces at its ends or quotes stands in quotes, `"…"` with escapes or `'…'`
/// without.
///
/// # Errors
/// Rule and hint: an empty key, quotes that do not close, a path that is deeper than any scene.
pub fn split(path: &str) -> Result<Vec<String>, (String, String)> {
    let example = || "write keys with dots between, as in model.peclet or boundary.\"my wall\".velocity".to_owned();
    let mut keys = Vec::new();
    let mut rest = path.trim();
    loop {
        let end = key_end(rest).ok_or_else(|| ("a quote in the path is not closed".to_owned(), example()))?;
        let key = rest[..end].trim();
        let key = match key.chars().next() {
            None => return Err(("this is no path of keys".to_owned(), example())),
            Some('"' | '\'') => {
                let parsed = key.parse::<toml_edit::Key>();
                let shown: String = key.chars().take(60).collect();
                let parsed = parsed.map_err(|_| (format!("`{shown}` is no key in quotes"), example()))?;
                parsed.get().to_owned()
            }
            Some(_) => key.to_owned(),
        };
        keys.push(key);
        if keys.len() > DEEPEST {
            return Err((
                format!("a path of more than {DEEPEST} keys"),
                "no scene is that deep: check the path".to_owned(),
            ));
        }
        match rest.get(end + 1..) {
            Some(next) if end < rest.len() => rest = next,
            Some(_) | None => return Ok(keys),
        }
    }
}

/// Where the first key ends: at a dot that is in no quotes, or at the end of the text.
fn key_end(text: &str) -> Option<usize> {
    unquoted(text, '.').map(|at| at.unwrap_or(text.len()))
}

/// `KEY=VALUE` at the first `=` that is in no quotes of the key.
pub fn assignment(text: &str) -> Option<(&str, &str)> {
    let at = unquoted(text, '=').flatten().or_else(|| text.find('='))?;
    Some((text[..at].trim(), text[at + 1..].trim()))
}

/// The first `wanted` that is in no quotes; `None` where a quote does not close. Quotes begin a key, and nothing else.
fn unquoted(text: &str, wanted: char) -> Option<Option<usize>> {
    let (mut quote, mut begins, mut escaped) = (None, true, false);
    for (at, c) in text.char_indices() {
        match quote {
            Some(_) if escaped => escaped = false,
            Some('"') if c == '\\' => escaped = true,
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if begins && (c == '"' || c == '\'') => (quote, begins) = (Some(c), false),
            None if c == wanted => return Some(Some(at)),
            None => begins = c == '.' || begins && c.is_whitespace(),
        }
    }
    quote.is_none().then_some(None)
}

#[cfg(test)]
mod tests {
    use super::{assignment, join, split};

    #[test]
    fn a_path_that_is_split_and_joined_is_the_same() {
        for keys in
            [&["model", "peclet"][..], &["boundary", "my wall", "velocity"], &["a.b", "\"", "\\", "\n'\u{1}", "ä", ""]]
        {
            if keys.iter().all(|key| !key.is_empty()) {
                assert_eq!(split(&join(keys)).unwrap(), keys);
            }
        }
        assert_eq!(split("boundary.my wall . velocity").unwrap(), ["boundary", "my wall", "velocity"]);
        assert_eq!(split("boundary.'a.\"b'.velocity").unwrap(), ["boundary", "a.\"b", "velocity"]);
        assert_eq!(split("a.it's").unwrap(), ["a", "it's"]);
        assert!(split("a..b").is_err() && split("").is_err() && split("a.").is_err() && split("a.\"b").is_err());
        assert!(split(&"a.".repeat(5000)).is_err());
        assert_eq!(assignment("boundary.\"a=b\".velocity = slip"), Some(("boundary.\"a=b\".velocity", "slip")));
        assert_eq!(assignment("title=\"x=1\""), Some(("title", "\"x=1\"")));
        assert_eq!(assignment("title"), None);
    }
}
