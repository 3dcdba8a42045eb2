//! What stands between the columns of a text.

use serde::Deserialize;

use super::is_missing;

/// What stands between two columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Separator {
    #[serde(rename = "tab", alias = "\t")]
    Tab,
    #[serde(rename = ";", alias = "semicolon")]
    Semicolon,
    #[serde(rename = ",", alias = "comma")]
    Comma,
    /// One or more spaces or tabs.
    #[serde(rename = "space", alias = " ")]
    Space,
}

impl Separator {
    /// In the order in which they are tried: what may stand within a column comes later.
    pub const ALL: [Self; 4] = [Self::Tab, Self::Semicolon, Self::Comma, Self::Space];

    /// In a study.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tab => "tab",
            Self::Semicolon => ";",
            Self::Comma => ",",
            Self::Space => "space",
        }
    }

    /// In a sentence.
    pub fn plural(self) -> &'static str {
        match self {
            Self::Tab => "tabs",
            Self::Semicolon => "semicolons",
            Self::Comma => "commas",
            Self::Space => "spaces",
        }
    }

    /// The byte between columns, after [`Self::prepare`].
    pub fn byte(self) -> u8 {
        match self {
            Self::Tab | Self::Space => b'\t',
            Self::Semicolon => b';',
            Self::Comma => b',',
        }
    }

    /// A line with one byte between its columns.
    pub fn prepare(self, line: &str) -> String {
        match self {
            Self::Space => line.split_whitespace().collect::<Vec<_>>().join("\t"),
            Self::Tab | Self::Semicolon | Self::Comma => line.to_owned(),
        }
    }

    /// The columns of one line.
    pub fn split(self, line: &str) -> Vec<String> {
        let line = self.prepare(line);
        let reader = csv::ReaderBuilder::new()
            .delimiter(self.byte())
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(line.as_bytes());
        let record = reader.into_records().next().and_then(Result::ok).unwrap_or_default();
        record.iter().map(str::to_owned).collect()
    }

    /// Whether a comma may be the decimal mark of a number.
    pub fn allows_decimal_commas(self) -> bool {
        self != Self::Comma
    }

    /// The separator that makes the most of some lines numbers; `None` where none does.
    pub fn detect<'l>(lines: impl Iterator<Item = &'l str> + Clone) -> Option<Self> {
        let worth = |separator: Self| -> f64 { lines.clone().map(|line| separator.share_of_numbers(line)).sum() };
        let best = Self::ALL.map(|separator| (separator, worth(separator)));
        let most = best.iter().map(|(_, worth)| *worth).fold(0.0, f64::max);
        best.into_iter()
            .find(|(_, worth)| *worth > 0.0 && *worth >= most * (1.0 - 1e-9))
            .map(|(separator, _)| separator)
    }

    /// Share of the columns of a line that are numbers or missing; 0 if it has one column or no number.
    fn share_of_numbers(self, line: &str) -> f64 {
        let fields = self.split(line);
        let numbers = fields.iter().filter(|field| number(field, self).is_some()).count();
        let missing = fields.iter().filter(|field| is_missing(field)).count();
        if fields.len() < 2 || numbers == 0 { 0.0 } else { (numbers + missing) as f64 / fields.len() as f64 }
    }
}

/// A number, with a point or, where that is possible, a comma as its decimal mark; also with the exponents of Fortran.
pub(super) fn number(text: &str, separator: Separator) -> Option<f64> {
    if let Ok(value) = text.parse::<f64>() {
        return Some(value);
    }
    let begins = text.trim_start_matches(['-', '+']).starts_with(|c: char| c.is_ascii_digit() || c == '.' || c == ',');
    let once = text.bytes().filter(|b| *b == b',').count() == 1 && !text.contains('.');
    let comma = separator.allows_decimal_commas() && once;
    let fortran = text.bytes().filter(|b| matches!(b, b'd' | b'D')).count() == 1;
    if !begins || !(comma || fortran) {
        return None;
    }
    let plain = if comma { text.replace(',', ".") } else { text.to_owned() };
    plain.replace(['d', 'D'], "e").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separators_are_found_out() {
        let cases = [
            ("1,2,3", Separator::Comma),
            ("1.5, 2.5, 3", Separator::Comma),
            ("1;2;3", Separator::Semicolon),
            ("1,5;2,5;3", Separator::Semicolon),
            ("1,5;2,5", Separator::Semicolon),
            ("1.5\t2.5", Separator::Tab),
            ("1,5\t2,5", Separator::Tab),
            ("1,5 2,5", Separator::Space),
            ("  1.0   -2e-3  NaN", Separator::Space),
            ("cell 12, 1.0, 2.0", Separator::Comma),
            ("ID12,12,,0.5,\"a, b\"", Separator::Comma),
            ("1.0 \t 2.0", Separator::Tab),
        ];
        for (line, separator) in cases {
            assert_eq!(Separator::detect([line, line].into_iter()), Some(separator), "{line}");
        }
        assert_eq!(Separator::detect(["x,y", "a b"].into_iter()), None);
    }

    #[test]
    fn numbers_of_other_places() {
        let space = |text| number(text, Separator::Space);
        assert_eq!(space("1,5"), Some(1.5));
        assert_eq!(space("-1,5e-3"), Some(-1.5e-3));
        assert_eq!(space("1.5D+02"), Some(150.0));
        assert_eq!(space("1,234.5"), None);
        assert_eq!(space("1,2,3"), None);
        assert_eq!(space("dead"), None);
        assert_eq!(number("1,5", Separator::Comma), None);
    }
}
