//! The bar on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

const TICKS: f64 = 10_000.0;

/// A bar with a line of text.
#[derive(Debug)]
pub(super) struct Bar(ProgressBar);

impl Bar {
    /// An empty one.
    pub fn new() -> Option<Self> {
        let style = ProgressStyle::with_template("{bar:12} {percent:>3}%  {wide_msg}").expect("a valid template");
        Some(Self(ProgressBar::new(TICKS as u64).with_style(style)))
    }

    /// A line above it.
    pub fn say(&self, text: &str) {
        self.0.println(text);
    }

    /// How much is done, from 0 to 1, and what is said beside it.
    pub fn show(&self, share: f64, text: String) {
        self.0.set_position((TICKS * share) as u64);
        self.0.set_message(text);
    }

    /// Clears its line.
    pub fn take_away(&self) {
        self.0.finish_and_clear();
    }
}
