//! Tables, numbers and boxes of notes.

use maud::{Markup, html};

use crate::results::Table;

/// A number with six digits; as a table has it where it is a text.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || value.fract() == 0.0 && value.abs() < 1e9 {
        return format!("{value}").replace('-', "−");
    }
    if !(1e-3..1e6).contains(&value.abs()) {
        let text = format!("{value:.4e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let mantissa =
            if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
        return format!("{mantissa}e{exponent}").replace('-', "−");
    }
    let digits = (5.0 - value.abs().log10().floor()).clamp(0.0, 8.0) as usize;
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

/// A cell: numbers to the right and short, with all digits for sorting; texts as they are.
pub(super) fn cell(text: &str) -> Markup {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => html! { td.number data-value=(text.trim()) { (short(value)) } },
        Ok(_) | Err(_) if text.trim().is_empty() => html! { td {} },
        Ok(_) | Err(_) => html! { td.text { (text) } },
    }
}

/// What must be read first: failures in red, notes below.
pub(super) fn notes(failures: &[String], notes: &[String]) -> Markup {
    html! {
        @if !failures.is_empty() {
            div.notes.bad role="alert" {
                p { (if failures.len() == 1 { "Failed" } else { "Failures" }) }
                ul { @for text in failures { li { (text) } } }
            }
        }
        @if !notes.is_empty() {
            div.notes role="note" {
                p { (if notes.len() == 1 { "Note" } else { "Notes" }) }
                ul { @for text in notes { li { (text.strip_prefix("note: ").unwrap_or(text)) } } }
            }
        }
    }
}

/// Two columns: names and values.
pub(super) fn pairs(caption: &str, head: [&str; 2], rows: &[(String, String)]) -> Markup {
    html! {
        @if !rows.is_empty() {
            div.scroll {
                table {
                    caption { (caption) }
                    thead { tr { th scope="col" { (head[0]) } th.number scope="col" { (head[1]) } } }
                    tbody { @for (name, value) in rows { tr { th scope="row" { (name) } (cell(value)) } } }
                }
            }
        }
    }
}

/// Columns of a table of a file, the first as the row's name; sorted by a click.
pub(super) fn sortable(caption: &str, table: &Table, columns: &[String], is_bad: &dyn Fn(usize) -> bool) -> Markup {
    let filled = |column: &usize| table.rows.iter().any(|row| !row[*column].trim().is_empty());
    let at: Vec<usize> = columns.iter().filter_map(|name| table.position(name)).filter(filled).collect();
    let is_number = |column: usize| {
        let mut filled = table.rows.iter().map(|row| row[column].trim()).filter(|text| !text.is_empty()).peekable();
        filled.peek().is_some() && filled.all(|text| text.parse::<f64>().is_ok())
    };
    html! {
        @if !at.is_empty() && !table.rows.is_empty() {
            div.scroll tabindex="0" role="region" aria-label=(caption) {
                table.sortable.wide {
                    caption { (caption) }
                    thead {
                        tr {
                            @for &column in &at {
                                th.number[is_number(column)] scope="col" { (heading(&table.header[column])) }
                            }
                        }
                    }
                    tbody {
                        @for (k, row) in table.rows.iter().enumerate() {
                            tr.bad[is_bad(k)] {
                                @for (position, &column) in at.iter().enumerate() {
                                    @if position == 0 { th scope="row" { (row[column]) } }
                                    @else { (cell(&row[column])) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A column's name in words: keys as in formulas, marks as spaces.
fn heading(name: &str) -> Markup {
    let symbol = crate::results::symbol(name);
    html! { @if symbol == name { (name.replace('_', " ")) } @else { span title=(name) { (plain(symbol)) } } }
}

/// A symbol of plots without its marks: the lower index as HTML has it.
pub(super) fn plain(symbol: &str) -> Markup {
    match symbol.split_once('_') {
        Some((base, index)) => {
            let index = index.trim_matches(|c| c == '{' || c == '}');
            let (index, tail) = index.strip_suffix('\'').map_or((index, ""), |index| (index, "'"));
            html! { (base) sub { (index) } (tail) }
        }
        None => html! { (symbol) },
    }
}

/// A value of a scene as one reads it: strings without their quotes.
pub(super) fn toml_text(value: &toml::Value) -> String {
    match value {
        toml::Value::String(text) => text.clone(),
        toml::Value::Array(all) => format!("({})", all.iter().map(toml_text).collect::<Vec<_>>().join(", ")),
        toml::Value::Table(all) => {
            all.iter().map(|(key, value)| format!("{key} {}", toml_text(value))).collect::<Vec<_>>().join(", ")
        }
        toml::Value::Integer(_) | toml::Value::Float(_) | toml::Value::Boolean(_) | toml::Value::Datetime(_) => {
            value.to_string()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_true() {
        let cases = [
            (0.0, "0"),
            (2978.0, "2978"),
            (-0.0331234567, "−0.0331235"),
            (2.23606798, "2.23607"),
            (5.39e-7, "5.39e−7"),
            (1.5e300, "1.5e300"),
            (123456.789, "123457"),
            (1.5, "1.5"),
        ];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
    }
}
