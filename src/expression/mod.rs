//! Formulas of `x`, `y`, `t` and the model's parameters, as a scene writes them.
//!
//! Usual mathematics: `+ - * / ^`, comparisons (1 or 0), function calls, `pi` (or `PI`, `π`), `tau`, `e`. The power
//! is
//! right-associative and binds tighter than a minus sign on its left, so `exp(-x^2)` decays. `if(c, a, b)` is `a`
//! where
//! `c ≠ 0` and `b` elsewhere; `heaviside(s)` is 1 for `s ≥ 0` and 0 below. Parameters become numbers when the text is
//! read, so an evaluation sees `x`, `y`, `t` only.

mod breaks;
mod formula;
mod parse;
mod series;
mod settle;
mod taylor;
mod tree;

use std::fmt;
use std::sync::Arc;

use crate::mesh::Point;

pub use formula::{Formula, VectorFormula, parse_vector};
use series::Series;
pub use taylor::Taylor;
use tree::{Tree, Variable};

/// What can be wrong with a formula.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum ExpressionError {
    #[error("`{text}` is no formula: at character {column}, {what}; hint: {hint}")]
    Syntax { text: String, column: usize, what: String, hint: String },
    #[error("`{text}` uses `{name}`, which is not defined{suggestion}; hint: the {kind} that exist are {known}")]
    Unknown { text: String, name: String, kind: &'static str, suggestion: String, known: String },
    #[error(
        "{given}`{text}` is {value} at x = {x}, y = {y}, t = {t}; hint: a formula must be finite wherever it is used"
    )]
    NotFinite { given: String, text: String, value: f64, x: f64, y: f64, t: f64 },
    #[error("{given}`{text}` is {value} at x = {x}, y = {y}, t = {t}; hint: {what} must not be negative")]
    Negative { given: String, text: String, value: f64, x: f64, y: f64, t: f64, what: &'static str },
    /// `place` is [`crate::body::Body::formula`].
    #[error("{place}: {error}")]
    OfBody { place: String, error: Box<ExpressionError> },
}

impl ExpressionError {
    /// The formula.
    pub fn text(&self) -> &str {
        match self {
            Self::Syntax { text, .. }
            | Self::Unknown { text, .. }
            | Self::NotFinite { text, .. }
            | Self::Negative { text, .. } => text,
            Self::OfBody { error, .. } => error.text(),
        }
    }
}

/// A parsed formula; cheap to clone, and evaluated from any thread.
#[derive(Clone)]
pub struct Expression {
    text: String,
    tree: Arc<Tree>,
    /// File and key that gave it, as messages begin; nothing where no file did.
    given: Arc<str>,
}

impl Expression {
    /// Reads `text`; `parameters` are the names that stand for numbers.
    ///
    /// # Errors
    /// A syntax error with its position, a name that does not exist, a constant formula that is not finite.
    pub fn parse(text: &str, parameters: &[(&str, f64)]) -> Result<Self, ExpressionError> {
        Self::parse_with(text, Variable::OF_FIELDS, parameters)
    }

    /// Reads a formula of a rigid body, which knows the angle `theta` as well; `x` and `y` are the body's position.
    ///
    /// # Errors
    /// A syntax error with its position, a name that does not exist, a constant formula that is not finite.
    pub fn of_body(text: &str, parameters: &[(&str, f64)]) -> Result<Self, ExpressionError> {
        Self::parse_with(text, &Variable::ALL, parameters)
    }

    fn parse_with(text: &str, variables: &[Variable], parameters: &[(&str, f64)]) -> Result<Self, ExpressionError> {
        let tree = Arc::new(parse::tree(text, variables, parameters)?);
        let expression = Self { text: text.to_owned(), tree, given: Arc::default() };
        if expression.is_constant() {
            expression.try_eval(Point::zeros(), 0.0)?;
        }
        Ok(expression)
    }

    /// The formula that has one value everywhere.
    pub fn constant(value: f64) -> Self {
        Self { text: value.to_string(), tree: Arc::new(Tree::Number(value)), given: Arc::default() }
    }

    /// The same formula, told apart in messages by where it was given; one that has been told already keeps its
    /// place.
    #[must_use]
    pub fn given_at(mut self, place: &str) -> Self {
        if self.given.is_empty() {
            self.given = place.into();
        }
        self
    }

    /// Where it was given, as a message begins: ``square.toml: `source.force`: ``.
    pub fn given(&self) -> &str {
        &self.given
    }

    /// Value at the point `x` and the time `t`; NaN or infinity outside the formula's domain.
    pub fn eval(&self, x: Point, t: f64) -> f64 {
        self.tree.eval([x.x, x.y, t, 0.0])
    }

    /// Value for a body at `position` that is turned by `angle`, at the time `t`.
    pub fn eval_at(&self, position: Point, angle: f64, t: f64) -> f64 {
        self.tree.eval([position.x, position.y, t, angle])
    }

    /// The formula's Taylor series in `(x, y)` about the point `x` at the time `t`, up to degree 3. Its value is
    /// that of
    /// [`eval`](Self::eval), bit for bit; a function with a corner or a jump counts as the branch taken at the point.
    pub fn taylor(&self, x: Point, t: f64) -> Taylor {
        self.tree.eval::<Series>([x.x, x.y, t, 0.0]).into()
    }

    /// Like [`eval`](Self::eval).
    ///
    /// # Errors
    /// A value that is not finite, with the formula and the place.
    pub fn try_eval(&self, x: Point, t: f64) -> Result<f64, ExpressionError> {
        let value = self.eval(x, t);
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.not_finite(value, x, t))
    }

    /// The error of a value that is not finite.
    pub(crate) fn not_finite(&self, value: f64, x: Point, t: f64) -> ExpressionError {
        let (given, text) = (self.given.to_string(), self.text.clone());
        ExpressionError::NotFinite { given, text, value, x: x.x, y: x.y, t }
    }

    /// The value of a density at the point `x` and the time `t`.
    ///
    /// # Errors
    /// A value that is not finite or below zero, with the formula and the place.
    pub fn try_density(&self, x: Point, t: f64) -> Result<f64, ExpressionError> {
        self.try_amount(x, t, "a density")
    }

    /// The value at the point `x` and the time `t` of what cannot be negative; `what` it is, for messages.
    ///
    /// # Errors
    /// A value that is not finite or below zero, with the formula and the place.
    pub fn try_amount(&self, x: Point, t: f64, what: &'static str) -> Result<f64, ExpressionError> {
        let value = self.try_eval(x, t)?;
        if value >= 0.0 {
            return Ok(value);
        }
        let (given, text) = (self.given.to_string(), self.text.clone());
        Err(ExpressionError::Negative { given, text, value, x: x.x, y: x.y, t, what })
    }

    /// Partial derivative with respect to `"x"`, `"y"` or `"t"`; one-sided where `abs`, `min`, `max`, `if` and the
    /// like
    /// have a corner or a jump.
    ///
    /// # Errors
    /// Any other name.
    pub fn diff(&self, variable: &str) -> Result<Self, ExpressionError> {
        let known = Variable::ALL.iter().find(|v| v.name() == variable);
        let &by = known.ok_or_else(|| ExpressionError::Unknown {
            text: self.text.clone(),
            name: variable.to_owned(),
            kind: "variables",
            suggestion: String::new(),
            known: "x, y, t".to_owned(),
        })?;
        let (text, given) = (format!("∂({})/∂{variable}", self.text), self.given.clone());
        Ok(Self { text, tree: Arc::new(self.tree.diff(by)), given })
    }

    /// The formula at the time `t`: what depends on the time alone is computed now, once.
    pub fn at_time(&self, t: f64) -> Self {
        Self { text: self.text.clone(), tree: Arc::new(self.tree.bind(Variable::T, t)), given: self.given.clone() }
    }

    /// The text that was parsed; `∂(…)/∂x` for a derivative.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether the value is the same everywhere and always.
    pub fn is_constant(&self) -> bool {
        Variable::ALL.iter().all(|&v| !self.tree.depends_on(v))
    }

    /// Whether the value is zero everywhere, as far as constants show.
    pub fn is_zero(&self) -> bool {
        self.is_constant() && self.eval(Point::zeros(), 0.0) == 0.0
    }

    /// Whether no place and no angle occurs.
    pub fn depends_on_time_alone(&self) -> bool {
        [Variable::X, Variable::Y, Variable::Theta].iter().all(|&v| !self.tree.depends_on(v))
    }

    /// The time from which on the value no longer changes, wherever it is taken in `[x_0, x_1] × [y_0, y_1]`: 0 for
    /// a formula
    /// without `t`, 1 for `if(t < 1, 0, 1)` and `min(t, 1)`, 37 or so for `1 - exp(-t)`, which is 1 to the last bit
    /// from then on. `None`
    /// where the value changes for ever, or where comparisons, `min`, `max` and the like do not show that it stays.
    pub fn constant_from(&self, place: [[f64; 2]; 2]) -> Option<f64> {
        settle::constant_from(&self.tree, place)
    }

    /// Whether `t` occurs.
    pub fn depends_on_time(&self) -> bool {
        self.tree.depends_on(Variable::T)
    }
}

/// A formula without parameters: `"1 - y^2".parse()?`.
impl std::str::FromStr for Expression {
    type Err = ExpressionError;

    fn from_str(text: &str) -> Result<Self, ExpressionError> {
        Self::parse(text, &[])
    }
}

impl fmt::Debug for Expression {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Expression(`{}`)", self.text)
    }
}

/// Equal formulas: same text and, parameters bound, same meaning.
impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text && self.tree == other.tree
    }
}
