//! Text: the embedded font, script markup, width and line breaking.

use super::PlotError;
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};

/// Size of scripts relative to the text.
pub(super) const SCRIPT_SIZE: f64 = 0.7;

const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻⁼⁽⁾ⁿⁱ";
const RAISED_BASE: &str = "0123456789+−=()ni";
const LOWERED: &str = "₀₁₂₃₄₅₆₇₈₉₊₋₌₍₎ₐₑₒₓₔₕₖₗₘₙₚₛₜᵢᵣᵤᵥⱼ";
const LOWERED_BASE: &str = "0123456789+−=()aeoxəhklmnpstiruvj";

/// Height of a run against the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    Base,
    Raised,
    Lowered,
}

impl Level {
    /// Upward shift in units of the text size.
    pub fn shift(self) -> f64 {
        match self {
            Self::Base => 0.0,
            Self::Raised => 0.36,
            Self::Lowered => -0.18,
        }
    }

    /// Size in units of the text size.
    pub fn size(self) -> f64 {
        match self {
            Self::Base => 1.0,
            Self::Raised | Self::Lowered => SCRIPT_SIZE,
        }
    }
}

/// Text on one level.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    pub text: String,
    pub level: Level,
}

/// One line of text with its markup resolved.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Label {
    /// Text as the caller wrote it.
    pub source: String,
    /// What is drawn, from left to right.
    pub runs: Vec<Run>,
}

impl Label {
    /// Resolves the markup.
    pub fn parse(source: &str) -> Self {
        let chars: Vec<char> = source.chars().collect();
        let mut label = Self { source: source.to_owned(), runs: Vec::new() };
        let mut at = 0;
        while at < chars.len() {
            let level = match chars[at] {
                '_' => Level::Lowered,
                '^' => Level::Raised,
                _ => Level::Base,
            };
            let script = if level == Level::Base { None } else { script_after(&chars, at) };
            if let Some((first, last, next)) = script {
                chars[first..last].iter().for_each(|&c| label.push(c, level));
                at = next;
            } else {
                let (c, level) = resolve_script(chars[at]);
                label.push(c, level);
                at += 1;
            }
        }
        label
    }

    fn push(&mut self, c: char, level: Level) {
        match self.runs.last_mut() {
            Some(run) if run.level == level => run.text.push(c),
            Some(_) | None => self.runs.push(Run { text: c.to_string(), level }),
        }
    }
}

// Characters [first, last) of the script that the mark at `at` opens, and where the text goes on.
fn script_after(chars: &[char], at: usize) -> Option<(usize, usize, usize)> {
    if at == 0 || chars[at - 1].is_whitespace() {
        return None;
    }
    let next = *chars.get(at + 1)?;
    if next == '{' {
        let length = chars[at + 2..].iter().position(|&c| c == '}')?;
        return Some((at + 2, at + 2 + length, at + 3 + length));
    }
    // Several marks in one word mean a program's name, not mathematics.
    let word = chars[..at].iter().rev().take_while(|c| c.is_alphanumeric() || **c == '_');
    let single = !word.into_iter().any(|&c| c == '_');
    let ends = chars.get(at + 2).is_none_or(|c| !c.is_alphanumeric() && *c != '_');
    ((next.is_alphanumeric() || next == '∞') && ends && single).then_some((at + 1, at + 2, at + 2))
}

fn resolve_script(c: char) -> (char, Level) {
    let find = |from: &str, to: &str| from.chars().position(|f| f == c).and_then(|i| to.chars().nth(i));
    if let Some(base) = find(RAISED, RAISED_BASE) {
        return (base, Level::Raised);
    }
    find(LOWERED, LOWERED_BASE).map_or((c, Level::Base), |base| (base, Level::Lowered))
}

/// The embedded DejaVu Sans.
pub(super) struct Font {
    face: FontRef<'static>,
}

impl Font {
    /// Reads the embedded font.
    ///
    /// # Errors
    /// [`PlotError::Font`] if it is not a font.
    pub fn load() -> Result<Self, PlotError> {
        let face = FontRef::new(dejavu::sans::regular()).map_err(|e| PlotError::Font { reason: e.to_string() })?;
        Ok(Self { face })
    }

    /// Advance of a character.
    pub fn advance(&self, c: char, size: f64) -> f64 {
        let metrics = self.face.glyph_metrics(Size::new(size as f32), LocationRef::default());
        metrics.advance_width(self.glyph(c)).map_or(0.0, f64::from)
    }

    /// Draws the outline of a character with its origin at (0, 0), y upwards; a missing one as a box.
    pub fn outline(&self, c: char, size: f64, pen: &mut impl OutlinePen) {
        let settings = DrawSettings::unhinted(Size::new(size as f32), LocationRef::default());
        if let Some(outline) = self.face.outline_glyphs().get(self.glyph(c)) {
            // An outline that cannot be drawn leaves a gap in the text, which is all that is wrong then.
            outline.draw(settings, pen).ok();
        }
    }

    fn glyph(&self, c: char) -> GlyphId {
        self.face.charmap().map(c).unwrap_or(GlyphId::NOTDEF)
    }

    /// Width of a line.
    pub fn width(&self, label: &Label, size: f64) -> f64 {
        let run = |r: &Run| r.text.chars().map(|c| self.advance(c, size * r.level.size())).sum::<f64>();
        label.runs.iter().map(run).sum()
    }

    /// Largest size up to `size` at which the line is at most `limit` wide.
    pub fn fit(&self, label: &Label, size: f64, limit: f64) -> f64 {
        let width = self.width(label, size);
        if width > limit { size * limit / width } else { size }
    }

    /// Breaks text at its spaces, but not at those of no break, into lines at most `limit` wide; a longer word has a
    /// line of its own.
    pub fn wrap(&self, text: &str, size: f64, limit: f64) -> Vec<Label> {
        let mut lines: Vec<String> = Vec::new();
        let mut room = 0.0;
        let space = self.advance(' ', size);
        for word in text.split_ascii_whitespace() {
            let width = self.width(&Label::parse(word), size);
            if let Some(line) = lines.last_mut()
                && space + width <= room
            {
                line.push(' ');
                line.push_str(word);
                room -= space + width;
            } else {
                lines.push(word.to_owned());
                room = limit - width;
            }
        }
        lines.iter().map(|line| Label::parse(line)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn script_maps_pair_up() {
        assert_eq!(RAISED.chars().count(), RAISED_BASE.chars().count());
        assert_eq!(LOWERED.chars().count(), LOWERED_BASE.chars().count());
    }

    #[test]
    fn marks_open_scripts_only_at_the_end_of_a_word() {
        let drawn = |s: &str| Label::parse(s).runs.iter().map(|r| (r.text.clone(), r.level)).collect::<Vec<_>>();
        let base = |s: &str| (s.to_owned(), Level::Base);
        assert_eq!(drawn("Δ_h p"), [base("Δ"), ("h".to_owned(), Level::Lowered), base(" p")]);
        assert_eq!(drawn("10^{-3}m"), [base("10"), ("-3".to_owned(), Level::Raised), base("m")]);
        assert_eq!(drawn("10⁻³"), [base("10"), ("−3".to_owned(), Level::Raised)]);
        assert_eq!(drawn("L^∞(L²)")[1], ("∞".to_owned(), Level::Raised));
        for plain in ["my_name", "a_b_c", "_x", "x_", "x_{y", "^", "a ^2"] {
            assert_eq!(drawn(plain), [base(plain)], "{plain}");
        }
    }

    #[test]
    fn the_font_has_the_mathematics_used() {
        let font = Font::load().expect("the embedded font is readable");
        for c in "Δ‖²ₕ∞κΠρ·×−∇∂√∑∫≤≥≈∈θμντφψωΩΓ°…".chars() {
            assert_ne!(font.glyph(c), GlyphId::NOTDEF, "{c}");
        }
    }

    #[test]
    fn wrapped_lines_keep_every_word_and_fit() {
        let font = Font::load().expect("the embedded font is readable");
        let text = "one two three four five six seven eight nine ten";
        let lines = font.wrap(text, 20.0, 150.0);
        assert!(lines.len() > 2);
        assert!(lines.iter().all(|l| font.width(l, 20.0) <= 150.0 + 1e-3));
        assert_eq!(lines.iter().map(|l| l.source.as_str()).collect::<Vec<_>>().join(" "), text);
    }
}
