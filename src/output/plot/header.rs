//! Title and subtitle.

use super::scene::{Anchor, GREY, Group, INK, Shape, Text};
use super::text::{Font, Label};

const LINE: f64 = 1.3;
const TOP: f64 = 10.0;

/// Title and subtitle broken into lines of a given size and colour.
pub(super) struct Header {
    lines: Vec<(Label, f64, [u8; 3])>,
    limit: f64,
}

impl Header {
    /// Breaks title and subtitle, of these sizes, at `limit`; the notes follow the subtitle.
    pub fn new(texts: [&str; 2], sizes: [f64; 2], notes: &[String], font: &Font, limit: f64) -> Self {
        let parts = std::iter::once(texts[1]).chain(notes.iter().map(String::as_str));
        let subtitle = parts.filter(|s| !s.trim().is_empty()).collect::<Vec<_>>().join("; ");
        let title = font.wrap(texts[0], sizes[0], limit);
        let small = font.wrap(&subtitle, sizes[1], limit);
        let mut lines: Vec<_> = title.into_iter().map(|label| (label, sizes[0], INK)).collect();
        lines.extend(small.into_iter().map(|label| (label, sizes[1], GREY)));
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
