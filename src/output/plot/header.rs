//! Title and subtitle.

use super::Plot;
use super::scene::{Anchor, GREY, Group, INK, Shape, Text};
use super::text::{Font, Label};

const TITLE_SIZE: f64 = 27.0;
const SUBTITLE_SIZE: f64 = 20.0;
const LINE: f64 = 1.3;
const TOP: f64 = 10.0;

/// Title and subtitle broken into lines of a given size and colour.
pub(super) struct Header {
    lines: Vec<(Label, f64, [u8; 3])>,
    limit: f64,
}

impl Header {
    /// Breaks the texts at `limit`; the notes follow the subtitle.
    pub fn new(plot: &Plot, notes: &[String], font: &Font, limit: f64) -> Self {
        let parts = std::iter::once(plot.subtitle.as_str()).chain(notes.iter().map(String::as_str));
        let subtitle = parts.filter(|s| !s.trim().is_empty()).collect::<Vec<_>>().join("; ");
        let title = font.wrap(&plot.title, TITLE_SIZE, limit);
        let small = font.wrap(&subtitle, SUBTITLE_SIZE, limit);
        let mut lines: Vec<_> = title.into_iter().map(|label| (label, TITLE_SIZE, INK)).collect();
        lines.extend(small.into_iter().map(|label| (label, SUBTITLE_SIZE, GREY)));
        Self { lines, limit }
    }

    /// Height with the space above.
    pub fn height(&self) -> f64 {
        TOP + self.lines.iter().map(|(_, size, _)| size * LINE).sum::<f64>()
    }

    /// Draws the lines with their left end at `x`; a word too long for its line is made smaller.
    pub fn draw(self, x: f64, font: &Font) -> Group {
        let mut group = Group::default();
        let mut y = TOP;
        for (label, size, colour) in self.lines {
            y += size * LINE;
            let size = font.fit(&label, size, self.limit);
            group.shapes.push(Shape::Text(Text::new(label, (x, y - 0.3 * size), size, Anchor::Start, colour)));
        }
        group
    }
}
