//! Where a formula jumps or has a kink.

use std::sync::Arc;

use super::Expression;
use super::tree::{Binary, Tree, Unary, Variable, binary};
use crate::space::project::{Break, Level};

impl Expression {
    /// The lines on which the formula may jump or have a kink at the time `t`: the zeros of what it compares, of the
    /// arguments of `abs`, `sign`, `heaviside`, of differences in `min` and `max`, and where the argument of `floor` is
    /// an integer. A line that hangs on another one comes after it.
    pub fn breaks(&self, t: f64) -> Vec<Break<'static>> {
        let mut found = Vec::new();
        self.tree.bind(Variable::T, t).add_breaks(&mut found);
        let as_break = |(tree, level): (Tree, Level)| {
            let of = Self { text: self.text.clone(), tree: Arc::new(tree), given: self.given.clone() };
            Break { of: Box::new(move |x| of.eval(x, t)), level }
        };
        found.into_iter().map(as_break).collect()
    }
}

impl Tree {
    fn add_breaks(&self, found: &mut Vec<(Tree, Level)>) {
        let own = match self {
            Tree::Number(_) | Tree::Variable(_) => None,
            Tree::Unary(f, a) => {
                a.add_breaks(found);
                f.level().map(|level| ((**a).clone(), level))
            }
            Tree::Binary(f, a, b) => {
                a.add_breaks(found);
                b.add_breaks(found);
                f.break_of(a, b).map(|tree| (tree, Level::Zero))
            }
            Tree::If(parts) => {
                parts.iter().for_each(|part| part.add_breaks(found));
                None
            }
        };
        let in_space = |tree: &Tree| tree.depends_on(Variable::X) || tree.depends_on(Variable::Y);
        found.extend(own.filter(|(tree, _)| in_space(tree)).filter(|own| !found.contains(own)));
    }
}

impl Unary {
    /// At which values of its argument the function is not smooth, of those at which it is finite.
    fn level(self) -> Option<Level> {
        match self {
            Unary::Abs | Unary::Sign | Unary::Heaviside | Unary::Sqrt => Some(Level::Zero),
            Unary::Floor => Some(Level::Integers),
            Unary::Minus
            | Unary::Sin
            | Unary::Cos
            | Unary::Tan
            | Unary::Asin
            | Unary::Acos
            | Unary::Atan
            | Unary::Sinh
            | Unary::Cosh
            | Unary::Tanh
            | Unary::Exp
            | Unary::Ln
            | Unary::Log
            | Unary::Log10 => None,
        }
    }
}

impl Binary {
    /// What is zero where the function is not smooth.
    fn break_of(self, a: &Tree, b: &Tree) -> Option<Tree> {
        match self {
            Binary::Less | Binary::LessEqual | Binary::Greater | Binary::GreaterEqual | Binary::Min | Binary::Max => {
                Some(binary(Binary::Sub, a.clone(), b.clone()))
            }
            // the cut of the angle
            Binary::Atan2 => Some(a.clone()),
            Binary::Add | Binary::Sub | Binary::Mul | Binary::Div | Binary::Pow | Binary::Hypot => None,
        }
    }
}
