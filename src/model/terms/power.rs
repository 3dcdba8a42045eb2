//! What terms do for the energy law: those that give energy to the sheet or take it away each have a line there.

use super::{At, MOLECULAR, MOMENTUM, POLARITY, Side, Term};
use crate::element::basis;
use crate::form::words::Vector;
use crate::form::{Density, Integrator, Linear};
use crate::model::parameters::Parameters;
use crate::solve::dot;
use crate::space::Field;

/// The power of a term, a line of the energy law on the side where the term's formula stands.
pub struct Power {
    /// Where it is written.
    pub line: Line,
    /// The power at a state: the formula with `w = v` in the momentum balance, and with `q = L_h/(Pe ρ)` in the
    /// equation of the polarity.
    pub of: for<'a> fn(&At<'a>, &Loops) -> f64,
}

/// A line of the energy law. Terms of one column are one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line {
    /// As in tables, e.g. `budget_friction`.
    pub column: &'static str,
    /// E.g. `energy law: friction`.
    pub words: &'static str,
    /// Among the other lines, e.g. `friction`.
    pub short: &'static str,
}

/// What powers are integrals over.
#[derive(Debug, Clone, Copy)]
pub struct Loops<'a> {
    /// All of the mesh that no body covers.
    pub tissue: &'a Integrator,
    /// All that flows: the whole mesh, but for bodies that are boundaries.
    pub flow: &'a Integrator,
}

/// A line, the side where it stands, and the key of `[model]` without which a scene does not have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Listed {
    /// Where it is written.
    pub line: Line,
    /// Of the energy law.
    pub side: Side,
    /// Of `[model]`, without which a scene does not have it.
    pub key: Option<&'static str>,
}

impl Listed {
    /// Whether a sheet has the line.
    pub fn is_of(&self, parameters: &Parameters) -> bool {
        self.key.is_none_or(|key| parameters.factors.of(key) != 0.0)
    }
}

/// The lines of both sides, as many as there are terms at most.
pub struct Lines<const N: usize> {
    all: [Listed; N],
    count: usize,
}

impl<const N: usize> Lines<N> {
    /// As the law is written: from the left side, the momentum balance from its last term to the first, then the
    /// polarity; from the right side both from the first to the last.
    const fn new() -> Self {
        let nothing = Line { column: "", words: "", short: "" };
        let mut lines = Self { all: [Listed { line: nothing, side: Side::Left, key: None }; N], count: 0 };
        let mut k = MOMENTUM.len();
        while k > 0 {
            k -= 1;
            lines.add(&MOMENTUM[k], true);
        }
        lines.add_all(POLARITY, true);
        lines.add_all(MOLECULAR, true);
        lines.add_all(MOMENTUM, false);
        lines.add_all(POLARITY, false);
        lines.add_all(MOLECULAR, false);
        lines
    }

    const fn add_all(&mut self, terms: &'static [Term<Vector>], left: bool) {
        let mut k = 0;
        while k < terms.len() {
            self.add(&terms[k], left);
            k += 1;
        }
    }

    /// Adds the line of a term of this side, once.
    const fn add(&mut self, term: &'static Term<Vector>, left: bool) {
        let Some(power) = &term.power else { return };
        if left != matches!(term.side, Side::Left) {
            return;
        }
        let mut k = 0;
        while k < self.count {
            if alike(self.all[k].line.column, power.line.column) {
                return;
            }
            k += 1;
        }
        let key = match &term.factor {
            Some(factor) => Some(factor.key),
            None => None,
        };
        self.all[self.count] = Listed { line: power.line, side: term.side, key };
        self.count += 1;
    }
}

/// Whether two names are the same.
const fn alike(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut k = 0;
    while k < a.len() && k < b.len() && a[k] == b[k] {
        k += 1;
    }
    k == a.len() && k == b.len()
}

const MOST: usize = MOMENTUM.len() + POLARITY.len() + MOLECULAR.len();
const FOUND: Lines<MOST> = Lines::new();

/// How many lines terms have.
pub const COUNT: usize = FOUND.count;

/// The lines that terms have, in the order of the law, those of the left side first.
pub const LINES: [Listed; COUNT] = {
    let mut lines = [FOUND.all[0]; COUNT];
    let mut k = 0;
    while k < COUNT {
        lines[k] = FOUND.all[k];
        k += 1;
    }
    lines
};

/// The powers at a state, in the order of [`LINES`]; zero where the terms are off.
pub fn powers(at: &At, loops: &Loops) -> [f64; COUNT] {
    let mut powers = [0.0; COUNT];
    for term in [MOMENTUM, POLARITY, MOLECULAR].into_iter().flatten().filter(|term| term.is_on(at.parameters)) {
        let Some(power) = &term.power else { continue };
        let place = LINES.iter().position(|listed| listed.line == power.line).expect("lines are of the lists");
        powers[place] += term.factor(at.parameters) * (power.of)(at, loops);
    }
    powers
}

/// The power of a form in the equation of the polarity, the form with `q = L_h/(Pe ρ)`, interpolated where ρ is a
/// field; zero without elasticity, and where there is no tissue.
pub fn along_field<'a>(at: &At<'a>, loops: &Loops, form: Linear<'a, Vector>) -> f64 {
    let of = |q: &[f64]| dot(&loops.tissue.vector(&form, &at.p.space), q);
    match (at.parameters.elasticity, at.rho) {
        (0.0, _) => 0.0,
        (b, Density::One) => b / at.parameters.peclet * of(&at.molecular().values),
        (b, Density::Of(rho)) => b / at.parameters.peclet * of(&over_density(at.molecular(), rho)),
    }
}

/// `L/ρ` at the nodes of L; zero where ρ is not above 0.
fn over_density(l: &Field, rho: &Field) -> Vec<f64> {
    let (space, nodes) = (&l.space, basis::nodes(l.space.degree));
    let mut values = l.values.clone();
    for cell in 0..space.mesh.cells.len() {
        for (i, &xi) in nodes.iter().enumerate() {
            let rho = rho.scalar_at(cell, xi);
            for c in 0..space.components {
                let value = &mut values[space.dof(cell, c, i)];
                *value = if rho > 0.0 { *value / rho } else { 0.0 };
            }
        }
    }
    values
}
