//! From when on a formula no longer changes: its values are enclosed in intervals, for all times after a given one.

use super::tree::{Binary, Tree, Unary, Variable};

/// What changes only later than this changes for ever.
const LATEST: f64 = 1e30;

/// The smallest time `T ≥ 0` from which on the value at every place of the rectangle `[x_0, x_1] × [y_0, y_1]` is
/// the same at
/// every `t ≥ T`, to the last bit; `None` where the intervals show none.
pub(super) fn constant_from(tree: &Tree, place: [[f64; 2]; 2]) -> Option<f64> {
    let moves = |time: f64| tree.range(&Region { place, time }).moves;
    if !moves(0.0) {
        return Some(0.0);
    }
    if moves(LATEST) {
        return None;
    }
    // positive numbers are ordered as their bits are
    let (mut before, mut after) = (0, LATEST.to_bits());
    while after - before > 1 {
        let middle = before + (after - before) / 2;
        if moves(f64::from_bits(middle)) { before = middle } else { after = middle }
    }
    Some(f64::from_bits(after))
}

/// A rectangle, from a time on.
struct Region {
    place: [[f64; 2]; 2],
    time: f64,
}

/// An interval in which the values lie, and whether a value may change with the time.
#[derive(Debug, Clone, Copy)]
struct Range {
    low: f64,
    high: f64,
    moves: bool,
}

const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

impl Range {
    /// Nothing is known where rounding or infinities have left no number; a single value does not move.
    fn new([low, high]: [f64; 2], moves: bool) -> Self {
        let [low, high] = if low.is_nan() || high.is_nan() { ALL } else { [low, high] };
        Self { low, high, moves: moves && !(low == high && low.is_finite()) }
    }

    fn point(value: f64) -> Self {
        Self::new([value, value], false)
    }

    fn ends(self) -> [f64; 2] {
        [self.low, self.high]
    }

    fn is_zero(self) -> bool {
        self.ends() == [0.0, 0.0]
    }

    fn contains_zero(self) -> bool {
        self.low <= 0.0 && self.high >= 0.0
    }

    /// Smallest and largest size.
    fn sizes(self) -> [f64; 2] {
        let [a, b] = self.ends().map(f64::abs);
        [if self.contains_zero() { 0.0 } else { a.min(b) }, a.max(b)]
    }
}

/// The smallest and the largest of some numbers; NaN if one of them is none.
fn hull(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for value in values {
        if value.is_nan() {
            return [f64::NAN; 2];
        }
        ends = [ends[0].min(value), ends[1].max(value)];
    }
    ends
}

impl Tree {
    fn range(&self, region: &Region) -> Range {
        match self {
            Tree::Number(value) => Range::point(*value),
            Tree::Variable(Variable::X) => Range::new(region.place[0], false),
            Tree::Variable(Variable::Y) => Range::new(region.place[1], false),
            Tree::Variable(Variable::T) => Range::new([region.time, f64::INFINITY], true),
            Tree::Variable(Variable::Theta) => Range::new(ALL, false),
            Tree::Unary(f, a) => f.range(a.range(region)),
            Tree::Binary(f, a, b) => f.range(a.range(region), b.range(region)),
            Tree::If(parts) => {
                let [condition, yes, no] = parts.each_ref().map(|part| part.range(region));
                match (condition.is_zero(), condition.contains_zero()) {
                    (true, _) => no,
                    (false, false) => yes,
                    (false, true) => {
                        let moves = condition.moves || yes.moves || no.moves;
                        Range::new(hull([yes.ends(), no.ends()].into_iter().flatten()), moves)
                    }
                }
            }
        }
    }
}

impl Unary {
    fn range(self, a: Range) -> Range {
        let at = |x: f64| self.apply(x);
        let ends = match self {
            _ if a.low == a.high => [at(a.low); 2],
            Unary::Asin | Unary::Atan | Unary::Sinh | Unary::Tanh | Unary::Exp | Unary::Ln | Unary::Log => {
                a.ends().map(at)
            }
            Unary::Log10 | Unary::Sqrt | Unary::Sign | Unary::Floor | Unary::Heaviside => a.ends().map(at),
            Unary::Minus | Unary::Acos => [at(a.high), at(a.low)],
            Unary::Abs | Unary::Cosh => a.sizes().map(at),
            Unary::Sin | Unary::Cos => [-1.0, 1.0],
            Unary::Tan => ALL,
        };
        Range::new(ends, a.moves)
    }
}

impl Binary {
    fn range(self, a: Range, b: Range) -> Range {
        let moves = a.moves || b.moves;
        let corners = |f: &dyn Fn(f64, f64) -> f64, a: [f64; 2], b: [f64; 2]| {
            hull(a.into_iter().flat_map(|x| b.into_iter().map(move |y| (x, y))).map(|(x, y)| f(x, y)))
        };
        // true, false, or not known
        let truth = |always: bool, never: bool| match (always, never) {
            (true, _) => Range::point(1.0),
            (false, true) => Range::point(0.0),
            (false, false) => Range::new([0.0, 1.0], moves),
        };
        let less = |a: Range, b: Range| truth(a.high < b.low, a.low >= b.high);
        let less_equal = |a: Range, b: Range| truth(a.high <= b.low, a.low > b.high);
        let ends = match self {
            Binary::Less => return less(a, b),
            Binary::Greater => return less(b, a),
            Binary::LessEqual => return less_equal(a, b),
            Binary::GreaterEqual => return less_equal(b, a),
            Binary::Min if a.high <= b.low => return a,
            Binary::Min if b.high <= a.low => return b,
            Binary::Max if a.low >= b.high => return a,
            Binary::Max if b.low >= a.high => return b,
            Binary::Add => [a.low + b.low, a.high + b.high],
            Binary::Sub => [a.low - b.high, a.high - b.low],
            // an end that is infinite is never reached
            Binary::Mul => corners(&|x, y| if x == 0.0 || y == 0.0 { 0.0 } else { x * y }, a.ends(), b.ends()),
            Binary::Div if b.contains_zero() => ALL,
            Binary::Div => corners(&|x, y| x / y, a.ends(), b.ends()),
            Binary::Pow => power(a, b),
            Binary::Min | Binary::Max => [self.apply(a.low, b.low), self.apply(a.high, b.high)],
            Binary::Atan2 if a.low == a.high && b.low == b.high => [a.low.atan2(b.low); 2],
            Binary::Atan2 => [-std::f64::consts::PI, std::f64::consts::PI],
            Binary::Hypot => corners(&f64::hypot, a.sizes(), b.sizes()),
        };
        Range::new(ends, moves)
    }
}

/// `a^b`, monotone in both where `a > 0`.
fn power(a: Range, b: Range) -> [f64; 2] {
    let whole = b.low == b.high && b.low.fract() == 0.0;
    let even = whole && (b.low / 2.0).fract() == 0.0;
    let to = |x: f64| x.powf(b.low);
    if a.low > 0.0 || (a.low == 0.0 && b.low >= 0.0) {
        hull([a.low.powf(b.low), a.low.powf(b.high), a.high.powf(b.low), a.high.powf(b.high)])
    } else if whole && (b.low >= 0.0 || !a.contains_zero()) {
        hull(if even { a.sizes().map(to) } else { a.ends().map(to) })
    } else {
        ALL
    }
}
