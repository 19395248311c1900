//! Functions, operators and constants by their names.

use super::program::{Binary, Step, Unary};

/// What a name before parentheses stands for.
#[derive(Clone, Copy)]
pub(super) enum Function {
    Unary(Unary),
    Binary(Binary),
    If,
}

impl Function {
    pub fn named(name: &str) -> Option<Self> {
        let unary = || UNARY.iter().find(|u| u.0 == name).map(|u| Self::Unary(u.1));
        let binary = || BINARY.iter().find(|b| b.0 == name).map(|b| Self::Binary(b.1));
        if name == "if" { Some(Self::If) } else { unary().or_else(binary) }
    }

    /// All names, sorted.
    pub fn names() -> Vec<&'static str> {
        let mut all: Vec<&str> = UNARY.iter().map(|u| u.0).chain(BINARY.iter().map(|b| b.0)).chain(["if"]).collect();
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
        "<" => Step::Binary(|a, b| f64::from(a < b)),
        "<=" => Step::Binary(|a, b| f64::from(a <= b)),
        ">" => Step::Binary(|a, b| f64::from(a > b)),
        ">=" => Step::Binary(|a, b| f64::from(a >= b)),
        "==" => Step::Binary(|a, b| f64::from(a == b)),
        "!=" => Step::Binary(|a, b| f64::from(a != b)),
        _ => Step::Binary(f64::powf),
    }
}

const UNARY: &[(&str, Unary)] = &[
    ("sqrt", f64::sqrt),
    ("cbrt", f64::cbrt),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log", f64::ln),
    ("log10", f64::log10),
    ("log2", f64::log2),
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("abs", f64::abs),
    ("sign", |a| if a == 0.0 { 0.0 } else { a.signum() }),
    ("floor", f64::floor),
    ("ceil", f64::ceil),
    ("round", f64::round),
    ("step", step),
    ("heaviside", step),
];

/// Named functions of two arguments; those that take more are folded from the left.
const BINARY: &[(&str, Binary)] = &[
    // Unlike f64::min and max, these pass a NaN on.
    ("min", |a, b| if b < a || b.is_nan() { b } else { a }),
    ("max", |a, b| if b > a || b.is_nan() { b } else { a }),
    ("pow", f64::powf),
    ("atan2", f64::atan2),
    ("hypot", f64::hypot),
    ("mod", f64::rem_euclid),
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
