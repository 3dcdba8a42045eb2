//! A build without the program has no bar; plain lines tell the same.

use std::convert::Infallible;

/// A bar, of which there is none.
#[derive(Debug)]
pub(super) struct Bar(Infallible);

impl Bar {
    /// None.
    pub fn new() -> Option<Self> {
        None
    }

    /// A line above it.
    pub fn say(&self, _: &str) {
        match self.0 {}
    }

    /// How much is done.
    pub fn show(&self, _: f64, _: String) {
        match self.0 {}
    }

    /// Clears its line.
    pub fn take_away(&self) {
        match self.0 {}
    }
}
