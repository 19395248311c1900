//! Functions, operators and constants by their names.

use super::program::{Binary, Outcome, Step, Unary};

/// What a name before parentheses stands for.
#[derive(Clone, Copy)]
pub(super) enum Function {
    Unary(Unary, Outcome),
    Binary(Binary, Outcome),
    Power,
    If,
}

impl Function {
    pub fn named(name: &str) -> Option<Self> {
        let unary = || UNARY.iter().find(|u| u.0 == name).map(|u| Self::Unary(u.1, u.2));
        let binary = || BINARY.iter().find(|b| b.0 == name).map(|b| Self::Binary(b.1, b.2));
        match name {
            "if" => Some(Self::If),
            "pow" => Some(Self::Power),
            _ => unary().or_else(binary),
        }
    }

    /// All names, sorted.
    pub fn names() -> Vec<&'static str> {
        let mut all: Vec<&str> =
            UNARY.iter().map(|u| u.0).chain(BINARY.iter().map(|b| b.0)).chain(["if", "pow"]).collect();
        all.sort_unstable();
        all
    }
}

pub(super) fn constant(name: &str) -> Option<f64> {
    match name {
        "pi" => Some(std::f64::consts::PI),
        "tau" => Some(std::f64::consts::TAU),
        "e" => Some(std::f64::consts::E),
        _ => None,
    }
}

/// The step of an operator between two operands.
pub(super) fn infix(symbol: &str) -> Step {
    match symbol {
        "+" => Step::Add,
        "-" => Step::Subtract,
        "*" => Step::Multiply,
        "/" => Step::Divide,
        "<" => Step::Binary(|a, b| f64::from(a < b), Outcome::Less),
        "<=" => Step::Binary(|a, b| f64::from(a <= b), Outcome::Less),
        ">" => Step::Binary(|a, b| f64::from(a > b), Outcome::More),
        ">=" => Step::Binary(|a, b| f64::from(a >= b), Outcome::More),
        "==" => Step::Binary(|a, b| f64::from(a == b), Outcome::Truth),
        "!=" => Step::Binary(|a, b| f64::from(a != b), Outcome::Truth),
        _ => Step::Power,
    }
}

const UNARY: &[(&str, Unary, Outcome)] = &[
    ("sqrt", f64::sqrt, Outcome::Smooth),
    ("cbrt", f64::cbrt, Outcome::Side),
    ("exp", f64::exp, Outcome::Smooth),
    ("ln", f64::ln, Outcome::Smooth),
    ("log", f64::ln, Outcome::Smooth),
    ("log10", f64::log10, Outcome::Smooth),
    ("log2", f64::log2, Outcome::Smooth),
    ("sin", f64::sin, Outcome::Smooth),
    ("cos", f64::cos, Outcome::Smooth),
    ("tan", f64::tan, Outcome::Smooth),
    ("asin", f64::asin, Outcome::Smooth),
    ("acos", f64::acos, Outcome::Smooth),
    ("atan", f64::atan, Outcome::Smooth),
    ("sinh", f64::sinh, Outcome::Smooth),
    ("cosh", f64::cosh, Outcome::Smooth),
    ("tanh", f64::tanh, Outcome::Smooth),
    ("abs", f64::abs, Outcome::Side),
    ("sign", |a| if a == 0.0 { 0.0 } else { a.signum() }, Outcome::Sign),
    ("floor", f64::floor, Outcome::Floor),
    ("ceil", f64::ceil, Outcome::Ceil),
    ("round", f64::round, Outcome::Round),
    ("step", step, Outcome::Sign),
    ("heaviside", step, Outcome::Sign),
];

/// Named functions of two arguments; those that take more are folded from the left.
const BINARY: &[(&str, Binary, Outcome)] = &[
    // Unlike f64::min and max, these pass a NaN on.
    ("min", |a, b| if b < a || b.is_nan() { b } else { a }, Outcome::Choice),
    ("max", |a, b| if b > a || b.is_nan() { b } else { a }, Outcome::Choice),
    ("atan2", f64::atan2, Outcome::Cut),
    ("hypot", f64::hypot, Outcome::Smooth),
    ("mod", f64::rem_euclid, Outcome::Quotient),
];

fn step(x: f64) -> f64 {
    if x >= 0.0 {
        1.0
    } else if x < 0.0 {
        0.0
    } else {
        f64::NAN
    }
}
