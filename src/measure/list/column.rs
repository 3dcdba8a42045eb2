//! Columns of tables, and what they are called where people read them.

/// Unit of what is a ratio to the scales of the model.
pub const DIMENSIONLESS: &str = "dimensionless";

/// A number that runs find or cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// As in tables and summaries.
    pub name: &'static str,
    /// With its symbol.
    pub words: &'static str,
    /// Empty where it has none, or is a length of the scene.
    pub unit: &'static str,
    /// Among others of its kind, as in a legend.
    pub short: &'static str,
    /// Whether it belongs to a march in time: a steady state by itself does not have it.
    pub of_a_march: bool,
    /// Whether it counts cells of the mesh, and so has no limit on finer ones.
    pub counts_cells: bool,
    /// The key of `[model]` without which a scene does not have it: the factor of a term.
    pub key: Option<&'static str>,
    /// Whether a scene without bodies does not have it.
    pub of_bodies: bool,
}

impl Column {
    /// A column that states have.
    pub const fn new(name: &'static str, words: &'static str, unit: &'static str, short: &'static str) -> Self {
        Self { name, words, unit, short, of_a_march: false, counts_cells: false, key: None, of_bodies: false }
    }

    /// The same, of a march in time.
    pub const fn of_a_march(self) -> Self {
        Self { of_a_march: true, ..self }
    }

    /// The same, of scenes that give this key.
    pub const fn with(self, key: Option<&'static str>) -> Self {
        Self { key, ..self }
    }

    /// The same, of scenes with bodies.
    pub const fn with_bodies(self) -> Self {
        Self { of_bodies: true, ..self }
    }

    /// The same, of which there is no estimate.
    pub const fn counting_cells(self) -> Self {
        Self { counts_cells: true, ..self }
    }
}
