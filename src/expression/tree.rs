//! The syntax tree of a formula: its value in any arithmetic, its derivatives.

/// What a formula may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variable {
    X,
    Y,
    T,
    /// Angle of a body; only formulas of bodies know it.
    Theta,
}

impl Variable {
    pub(super) const ALL: [Variable; 4] = [Variable::X, Variable::Y, Variable::T, Variable::Theta];

    /// What formulas of fields may depend on.
    pub(super) const OF_FIELDS: &'static [Variable] = &[Variable::X, Variable::Y, Variable::T];

    pub(super) fn name(self) -> &'static str {
        match self {
            Variable::X => "x",
            Variable::Y => "y",
            Variable::T => "t",
            Variable::Theta => "theta",
        }
    }
}

/// Declares an enum of functions with the name that formulas use, so that name and variant cannot drift apart.
macro_rules! named {
    ($(#[$doc:meta])* $enum:ident { $($variant:ident = $name:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(super) enum $enum { $($variant),+ }
        impl $enum {
            pub(super) const ALL: &'static [(&'static str, $enum)] = &[$(($name, $enum::$variant)),+];
        }
    };
}

named!(
    /// Functions of one argument.
    Unary {
        Minus = "-", Sin = "sin", Cos = "cos", Tan = "tan", Asin = "asin", Acos = "acos", Atan = "atan", Sinh = "sinh",
        Cosh = "cosh", Tanh = "tanh", Exp = "exp", Ln = "ln", Log = "log", Log10 = "log10", Sqrt = "sqrt", Abs = "abs",
        Sign = "sign", Floor = "floor", Heaviside = "heaviside",
    }
);

named!(
    /// Operators and functions of two arguments.
    Binary {
        Add = "+", Sub = "-", Mul = "*", Div = "/", Pow = "^", Less = "<", LessEqual = "<=", Greater = ">",
        GreaterEqual = ">=", Min = "min", Max = "max", Atan2 = "atan2", Hypot = "hypot",
    }
);

#[derive(Debug, PartialEq, Clone)]
pub(super) enum Tree {
    Number(f64),
    Variable(Variable),
    Unary(Unary, Box<Tree>),
    Binary(Binary, Box<Tree>, Box<Tree>),
    /// The second where the first is not zero, else the third.
    If(Box<[Tree; 3]>),
}

/// What a tree can be evaluated in: plain numbers, or series.
pub(super) trait Arithmetic {
    fn number(value: f64) -> Self;
    fn variable(variable: Variable, value: f64) -> Self;
    fn unary(f: Unary, a: Self) -> Self;
    fn binary(f: Binary, a: Self, b: Self) -> Self;
}

impl Arithmetic for f64 {
    fn number(value: f64) -> Self {
        value
    }

    fn variable(_: Variable, value: f64) -> Self {
        value
    }

    fn unary(f: Unary, a: Self) -> Self {
        f.apply(a)
    }

    fn binary(f: Binary, a: Self, b: Self) -> Self {
        f.apply(a, b)
    }
}

impl Unary {
    pub(super) fn apply(self, a: f64) -> f64 {
        match self {
            Unary::Minus => -a,
            Unary::Sin => a.sin(),
            Unary::Cos => a.cos(),
            Unary::Tan => a.tan(),
            Unary::Asin => a.asin(),
            Unary::Acos => a.acos(),
            Unary::Atan => a.atan(),
            Unary::Sinh => a.sinh(),
            Unary::Cosh => a.cosh(),
            Unary::Tanh => a.tanh(),
            Unary::Exp => a.exp(),
            Unary::Ln | Unary::Log => a.ln(),
            Unary::Log10 => a.log10(),
            Unary::Sqrt => a.sqrt(),
            Unary::Abs => a.abs(),
            // f64::signum(0) is 1, mathematics says 0
            Unary::Sign => keep_nan(a, f64::from(i8::from(a > 0.0) - i8::from(a < 0.0))),
            Unary::Floor => a.floor(),
            Unary::Heaviside => keep_nan(a, f64::from(u8::from(a >= 0.0))),
        }
    }

    /// Derivative of the function at `a`; the inner derivative is the caller's.
    fn diff(self, a: &Tree) -> Tree {
        let of = |f: Unary| unary(f, a.clone());
        let one_over = |b: Tree| binary(Binary::Div, number(1.0), b);
        let one_minus_square = || binary(Binary::Sub, number(1.0), square(a.clone()));
        match self {
            Unary::Minus => number(-1.0),
            Unary::Sin => of(Unary::Cos),
            Unary::Cos => unary(Unary::Minus, of(Unary::Sin)),
            Unary::Tan => one_over(square(of(Unary::Cos))),
            Unary::Asin => one_over(unary(Unary::Sqrt, one_minus_square())),
            Unary::Acos => unary(Unary::Minus, one_over(unary(Unary::Sqrt, one_minus_square()))),
            Unary::Atan => one_over(binary(Binary::Add, number(1.0), square(a.clone()))),
            Unary::Sinh => of(Unary::Cosh),
            Unary::Cosh => of(Unary::Sinh),
            Unary::Tanh => binary(Binary::Sub, number(1.0), square(of(Unary::Tanh))),
            Unary::Exp => of(Unary::Exp),
            Unary::Ln | Unary::Log => one_over(a.clone()),
            Unary::Log10 => one_over(binary(Binary::Mul, number(std::f64::consts::LN_10), a.clone())),
            Unary::Sqrt => one_over(binary(Binary::Mul, number(2.0), of(Unary::Sqrt))),
            Unary::Abs => of(Unary::Sign),
            Unary::Sign | Unary::Floor | Unary::Heaviside => number(0.0),
        }
    }
}

impl Binary {
    pub(super) fn apply(self, a: f64, b: f64) -> f64 {
        let truth = |c: bool| keep_nan(a, keep_nan(b, f64::from(u8::from(c))));
        match self {
            Binary::Add => a + b,
            Binary::Sub => a - b,
            Binary::Mul => a * b,
            Binary::Div => a / b,
            Binary::Pow => a.powf(b),
            Binary::Less => truth(a < b),
            Binary::LessEqual => truth(a <= b),
            Binary::Greater => truth(a > b),
            Binary::GreaterEqual => truth(a >= b),
            // f64::min and max would hide a NaN
            Binary::Min => keep_nan(a, if a < b { a } else { b }),
            Binary::Max => keep_nan(a, if a > b { a } else { b }),
            Binary::Atan2 => a.atan2(b),
            Binary::Hypot => a.hypot(b),
        }
    }

    /// Derivative of `self(a, b)`, given those of `a` and `b`.
    fn diff(self, a: &Tree, b: &Tree, da: Tree, db: Tree) -> Tree {
        let (a, b) = (a.clone(), b.clone());
        let choose = |c: Binary| choose(binary(c, a.clone(), b.clone()), da.clone(), db.clone());
        match self {
            Binary::Add | Binary::Sub => binary(self, da, db),
            Binary::Mul => binary(Binary::Add, binary(Binary::Mul, da, b), binary(Binary::Mul, a, db)),
            Binary::Div => {
                let second = binary(Binary::Div, binary(Binary::Mul, a, db), square(b.clone()));
                binary(Binary::Sub, binary(Binary::Div, da, b), second)
            }
            Binary::Pow => diff_power(a, b, da, db),
            Binary::Less | Binary::LessEqual | Binary::Greater | Binary::GreaterEqual => number(0.0),
            Binary::Min => choose(Binary::Less),
            Binary::Max => choose(Binary::Greater),
            Binary::Atan2 => {
                let norm = binary(Binary::Add, square(a.clone()), square(b.clone()));
                binary(Binary::Div, binary(Binary::Sub, binary(Binary::Mul, da, b), binary(Binary::Mul, a, db)), norm)
            }
            Binary::Hypot => {
                let norm = binary(Binary::Hypot, a.clone(), b.clone());
                binary(Binary::Div, binary(Binary::Add, binary(Binary::Mul, a, da), binary(Binary::Mul, b, db)), norm)
            }
        }
    }
}

/// `(a^b)′`: the logarithm appears only if the exponent varies, so that `x^2` has a derivative for `x ≤ 0`.
fn diff_power(a: Tree, b: Tree, da: Tree, db: Tree) -> Tree {
    let lower = binary(Binary::Pow, a.clone(), binary(Binary::Sub, b.clone(), number(1.0)));
    let base = binary(Binary::Mul, binary(Binary::Mul, b.clone(), lower), da);
    if db == Tree::Number(0.0) {
        return base;
    }
    let power = binary(Binary::Pow, a.clone(), b);
    binary(Binary::Add, base, binary(Binary::Mul, binary(Binary::Mul, power, unary(Unary::Ln, a)), db))
}

impl Tree {
    /// The value at `x, y, t, theta = at`.
    pub(super) fn eval<A: Arithmetic>(&self, at: [f64; 4]) -> A {
        match self {
            Tree::Number(value) => A::number(*value),
            Tree::Variable(v) => A::variable(*v, at[*v as usize]),
            Tree::Unary(f, a) => A::unary(*f, a.eval(at)),
            Tree::Binary(f, a, b) => A::binary(*f, a.eval(at), b.eval(at)),
            Tree::If(parts) => {
                let [condition, yes, no] = &**parts;
                let c = condition.eval::<f64>(at);
                if c.is_nan() {
                    return A::number(c);
                }
                if c != 0.0 { yes.eval(at) } else { no.eval(at) }
            }
        }
    }

    /// The tree with `value` for `variable`, and what has become constant computed.
    pub(super) fn bind(&self, variable: Variable, value: f64) -> Tree {
        match self {
            Tree::Variable(v) if *v == variable => number(value),
            Tree::Number(_) | Tree::Variable(_) => self.clone(),
            Tree::Unary(f, a) => unary(*f, a.bind(variable, value)),
            Tree::Binary(f, a, b) => binary(*f, a.bind(variable, value), b.bind(variable, value)),
            Tree::If(parts) => {
                let [condition, yes, no] = parts.each_ref().map(|part| part.bind(variable, value));
                choose(condition, yes, no)
            }
        }
    }

    pub(super) fn depends_on(&self, variable: Variable) -> bool {
        match self {
            Tree::Number(_) => false,
            Tree::Variable(v) => *v == variable,
            Tree::Unary(_, a) => a.depends_on(variable),
            Tree::Binary(_, a, b) => a.depends_on(variable) || b.depends_on(variable),
            Tree::If(parts) => parts.iter().any(|part| part.depends_on(variable)),
        }
    }

    pub(super) fn diff(&self, by: Variable) -> Tree {
        match self {
            Tree::Number(_) => number(0.0),
            Tree::Variable(v) => number(if *v == by { 1.0 } else { 0.0 }),
            // without this, the outer derivative of a constant part could bring in 0·∞
            Tree::Unary(..) | Tree::Binary(..) if !self.depends_on(by) => number(0.0),
            Tree::Unary(f, a) => binary(Binary::Mul, f.diff(a), a.diff(by)),
            Tree::Binary(f, a, b) => f.diff(a, b, a.diff(by), b.diff(by)),
            Tree::If(parts) => {
                let [condition, yes, no] = &**parts;
                choose(condition.clone(), yes.diff(by), no.diff(by))
            }
        }
    }
}

/// `value`, unless `a` is NaN: a NaN must never become a finite number.
fn keep_nan(a: f64, value: f64) -> f64 {
    if a.is_nan() { a } else { value }
}

fn number(value: f64) -> Tree {
    Tree::Number(value)
}

fn square(a: Tree) -> Tree {
    binary(Binary::Pow, a, number(2.0))
}

/// `f(a)`, folded if `a` is a number.
pub(super) fn unary(f: Unary, a: Tree) -> Tree {
    if let Tree::Number(value) = a { number(f.apply(value)) } else { Tree::Unary(f, Box::new(a)) }
}

/// `f(a, b)`, folded if both are numbers, and without the zeros and ones that derivatives leave.
pub(super) fn binary(f: Binary, a: Tree, b: Tree) -> Tree {
    let is = |tree: &Tree, value: f64| *tree == Tree::Number(value);
    match (f, &a, &b) {
        (_, Tree::Number(p), Tree::Number(q)) => number(f.apply(*p, *q)),
        (Binary::Mul, _, _) if is(&a, 0.0) || is(&b, 0.0) => number(0.0),
        (Binary::Div, _, _) if is(&a, 0.0) => number(0.0),
        (Binary::Mul, _, _) | (Binary::Add, _, _) if is(&a, if f == Binary::Mul { 1.0 } else { 0.0 }) => b,
        (Binary::Add | Binary::Sub, _, _) if is(&b, 0.0) => a,
        (Binary::Mul | Binary::Div | Binary::Pow, _, _) if is(&b, 1.0) => a,
        (Binary::Sub, _, _) if is(&a, 0.0) => unary(Unary::Minus, b),
        (_, _, _) => Tree::Binary(f, Box::new(a), Box::new(b)),
    }
}

/// `if(condition, yes, no)`, decided now if the condition is a number.
pub(super) fn choose(condition: Tree, yes: Tree, no: Tree) -> Tree {
    match condition {
        Tree::Number(0.0) => no,
        Tree::Number(c) if !c.is_nan() => yes,
        Tree::Number(_) | Tree::Variable(_) | Tree::Unary(..) | Tree::Binary(..) | Tree::If(_) => {
            Tree::If(Box::new([condition, yes, no]))
        }
    }
}
