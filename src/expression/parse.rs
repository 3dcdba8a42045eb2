//! From text to tree: a scanner and a parser by binding strength.

use super::ExpressionError;
use super::tree::{Binary, Tree, Unary, Variable, binary, choose, unary};
use crate::names;

/// Deeper nesting and longer texts are refused, so that no formula can exhaust the stack.
const MAX_DEPTH: usize = 100;
pub(super) const MAX_LENGTH: usize = 10_000;

const CONSTANTS: [(&str, f64); 6] = [
    ("pi", std::f64::consts::PI),
    ("PI", std::f64::consts::PI),
    ("π", std::f64::consts::PI),
    ("tau", std::f64::consts::TAU),
    ("e", std::f64::consts::E),
    ("E", std::f64::consts::E),
];

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Symbol(&'static str),
    End,
}

/// Binding strength of comparisons, the weakest.
const COMPARISON: u8 = 1;

/// Binding strength of a minus sign: above `*`, below `^`.
const MINUS: u8 = 4;

fn operator(symbol: &str) -> Option<(Binary, u8)> {
    let (_, operator) = Binary::ALL.iter().find(|(name, _)| *name == symbol)?;
    match operator {
        Binary::Less | Binary::LessEqual | Binary::Greater | Binary::GreaterEqual => Some((*operator, COMPARISON)),
        Binary::Add | Binary::Sub => Some((*operator, 2)),
        Binary::Mul | Binary::Div => Some((*operator, 3)),
        Binary::Pow => Some((*operator, 5)),
        Binary::Min | Binary::Max | Binary::Atan2 | Binary::Hypot => None,
    }
}

/// The tree of `text`, which may depend on `variables`, with parameters and constants as numbers.
pub(super) fn tree(text: &str, variables: &[Variable], parameters: &[(&str, f64)]) -> Result<Tree, ExpressionError> {
    let tokens = scan(text)?;
    let mut parser = Parser { text, variables, parameters, tokens, next: 0, depth: 0 };
    let tree = parser.sum(0)?;
    match parser.peek() {
        Token::End => Ok(tree),
        Token::Number(_) | Token::Name(_) | Token::Symbol(_) => Err(parser.unexpected("an operator or the end")),
    }
}

/// Splits the text into tokens, each with its character position (from 1).
fn scan(text: &str) -> Result<Vec<(Token, usize)>, ExpressionError> {
    const SYMBOLS: [&str; 12] = ["<=", ">=", "+", "-", "*", "/", "^", "(", ")", ",", "<", ">"];
    let characters: Vec<char> = text.chars().collect();
    if characters.len() > MAX_LENGTH {
        let what = format!("the formula is longer than {MAX_LENGTH} characters");
        return Err(syntax(&format!("{}…", &text.chars().take(40).collect::<String>()), MAX_LENGTH, what, "split it"));
    }
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(&c) = characters.get(at) {
        let start = at;
        if c.is_whitespace() {
            at += 1;
            continue;
        }
        let token = if c.is_ascii_digit() || c == '.' {
            at = number_end(&characters, at);
            let digits: String = characters[start..at].iter().collect();
            let value = digits.parse().map_err(|_| syntax(text, start, format!("`{digits}` is no number"), ""))?;
            Token::Number(value)
        } else if c.is_alphabetic() || c == '_' {
            while characters.get(at).is_some_and(|c| c.is_alphanumeric() || *c == '_') {
                at += 1;
            }
            Token::Name(characters[start..at].iter().collect())
        } else {
            let matches = |s: &&&str| s.chars().enumerate().all(|(i, c)| characters.get(at + i) == Some(&c));
            let symbol = SYMBOLS.iter().find(matches);
            let symbol = symbol.ok_or_else(|| syntax(text, at, format!("`{c}` has no meaning"), ""))?;
            at += symbol.len();
            Token::Symbol(symbol)
        };
        tokens.push((token, start));
    }
    tokens.push((Token::End, characters.len()));
    Ok(tokens)
}

/// End of the number that starts at `at`: digits and points, and an exponent if digits follow it.
fn number_end(characters: &[char], mut at: usize) -> usize {
    let digit = |i: usize| characters.get(i).is_some_and(char::is_ascii_digit);
    while digit(at) || characters.get(at) == Some(&'.') {
        at += 1;
    }
    if matches!(characters.get(at), Some('e' | 'E')) {
        let sign = usize::from(matches!(characters.get(at + 1), Some('+' | '-')));
        if digit(at + 1 + sign) {
            at += 1 + sign;
            while digit(at) {
                at += 1;
            }
        }
    }
    at
}

fn syntax(text: &str, at: usize, what: String, hint: &str) -> ExpressionError {
    let hint = if hint.is_empty() { "a formula looks like `1 - y^2` or `sin(pi*x)*exp(-t)`" } else { hint };
    ExpressionError::Syntax { text: text.to_owned(), column: at + 1, what, hint: hint.to_owned() }
}

struct Parser<'a> {
    text: &'a str,
    variables: &'a [Variable],
    parameters: &'a [(&'a str, f64)],
    tokens: Vec<(Token, usize)>,
    next: usize,
    depth: usize,
}

impl Parser<'_> {
    fn peek(&self) -> &Token {
        &self.tokens[self.next].0
    }

    /// Takes the token; the end is never passed.
    fn take(&mut self) -> Token {
        let token = self.peek().clone();
        self.next = (self.next + 1).min(self.tokens.len() - 1);
        token
    }

    fn take_symbol(&mut self, symbol: &'static str) -> Result<(), ExpressionError> {
        if *self.peek() != Token::Symbol(symbol) {
            return Err(self.unexpected(&format!("`{symbol}`")));
        }
        self.take();
        Ok(())
    }

    fn unexpected(&self, wanted: &str) -> ExpressionError {
        let (found, hint) = match self.peek() {
            Token::Number(value) => (format!("`{value}`"), "a product is written with `*`"),
            Token::Name(name) => (format!("`{name}`"), "a product is written with `*`"),
            Token::Symbol("(") => ("`(`".to_owned(), "a product is written with `*`"),
            Token::Symbol("*") => ("`*`".to_owned(), "a power is written with `^`"),
            Token::Symbol(symbol) => (format!("`{symbol}`"), ""),
            Token::End => ("the end".to_owned(), ""),
        };
        syntax(self.text, self.tokens[self.next].1, format!("expected {wanted}, found {found}"), hint)
    }

    /// An operand and every operator after it that binds at least as strongly as `least`.
    fn sum(&mut self, least: u8) -> Result<Tree, ExpressionError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let what = format!("the formula is nested more than {MAX_DEPTH} levels deep");
            return Err(syntax(self.text, self.tokens[self.next].1, what, "split it or simplify it"));
        }
        let mut left = self.operand()?;
        let mut compared = false;
        while let Token::Symbol(symbol) = *self.peek() {
            let Some((operator, strength)) = operator(symbol).filter(|(_, strength)| *strength >= least) else { break };
            if strength == COMPARISON && std::mem::replace(&mut compared, true) {
                let what = "comparisons cannot be chained".to_owned();
                return Err(syntax(self.text, self.tokens[self.next].1, what, "write (1 < x)*(x < 2) for 1 < x < 2"));
            }
            self.take();
            let right = self.sum(if operator == Binary::Pow { strength } else { strength + 1 })?;
            left = binary(operator, left, right);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn operand(&mut self) -> Result<Tree, ExpressionError> {
        match self.peek().clone() {
            Token::Number(value) => {
                self.take();
                Ok(Tree::Number(value))
            }
            Token::Name(name) => self.name(&name),
            Token::Symbol("-") => {
                self.take();
                Ok(unary(Unary::Minus, self.sum(MINUS)?))
            }
            Token::Symbol("+") => {
                self.take();
                self.sum(MINUS)
            }
            Token::Symbol("(") => {
                self.take();
                let inner = self.sum(0)?;
                self.take_symbol(")")?;
                Ok(inner)
            }
            Token::Symbol(_) | Token::End => Err(self.unexpected("a number, a name or `(`")),
        }
    }

    fn name(&mut self, name: &str) -> Result<Tree, ExpressionError> {
        if self.tokens[self.next + 1].0 == Token::Symbol("(") {
            return self.call(name);
        }
        let name = names::parameter_now(name).unwrap_or(name);
        let variable = self.variables.iter().find(|v| v.name() == name).map(|&v| Tree::Variable(v));
        let numbers = self.parameters.iter().chain(&CONSTANTS);
        let number = || numbers.clone().find(|(known, _)| *known == name).map(|&(_, value)| Tree::Number(value));
        let Some(found) = variable.or_else(number) else {
            let known = self.variables.iter().map(|v| v.name()).chain(self.parameters.iter().map(|(n, _)| *n));
            let known: Vec<&str> = known.chain(["pi", "tau", "e"]).collect();
            return Err(self.unknown(name, "variables", &known));
        };
        self.take();
        Ok(found)
    }

    fn unknown(&self, name: &str, kind: &'static str, known: &[&str]) -> ExpressionError {
        let (text, name, suggestion) = (self.text.to_owned(), name.to_owned(), names::did_you_mean(name, known));
        ExpressionError::Unknown { text, name, kind, suggestion, known: known.join(", ") }
    }

    fn call(&mut self, name: &str) -> Result<Tree, ExpressionError> {
        let place = self.tokens[self.next].1;
        let one = Unary::ALL.iter().find(|(known, _)| *known == name).map(|(_, f)| *f);
        let two = Binary::ALL.iter().find(|(known, _)| *known == name).map(|(_, f)| *f);
        let wanted = match (one, two, name) {
            (Some(_), _, _) => 1,
            (None, Some(_), _) => 2,
            (None, None, "if") => 3,
            (None, None, _) => return Err(self.unknown(name, "functions", &function_names())),
        };
        let arguments = self.arguments()?;
        let found = arguments.len();
        let mut arguments = arguments.into_iter();
        let wrong =
            || syntax(self.text, place, format!("`{name}` takes {wanted} argument(s), here it has {found}"), "");
        let mut argument = || arguments.next().filter(|_| found == wanted).ok_or_else(wrong);
        match (one, two) {
            (Some(f), _) => Ok(unary(f, argument()?)),
            (None, Some(f)) => Ok(binary(f, argument()?, argument()?)),
            (None, None) => Ok(choose(argument()?, argument()?, argument()?)),
        }
    }

    /// `(a, b, …)` after the name of a function.
    fn arguments(&mut self) -> Result<Vec<Tree>, ExpressionError> {
        self.take();
        self.take_symbol("(")?;
        let mut arguments = vec![self.sum(0)?];
        while *self.peek() == Token::Symbol(",") {
            self.take();
            arguments.push(self.sum(0)?);
        }
        self.take_symbol(")")?;
        Ok(arguments)
    }
}

fn function_names() -> Vec<&'static str> {
    let all = Unary::ALL.iter().map(|(name, _)| *name).chain(Binary::ALL.iter().map(|(name, _)| *name));
    all.filter(|name| name.starts_with(char::is_alphabetic)).chain(["if"]).collect()
}
