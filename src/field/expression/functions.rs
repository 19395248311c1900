//! Functions, operators and constants by their names.

use super::program::{Binary, Course, Outcome, Step, Unary};

/// What a name before parentheses stands for.
#[derive(Clone, Copy)]
pub(super) enum Function {
    Unary(Unary, Outcome, Course),
    Binary(Binary, Outcome),
    Power,
    If,
}

impl Function {
    pub fn named(name: &str) -> Option<Self> {
        let unary = || UNARY.iter().find(|u| u.0 == name).map(|u| Self::Unary(u.1, u.2, u.3));
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

const UNARY: &[(&str, Unary, Outcome, Course)] = &[
    ("sqrt", f64::sqrt, Outcome::Smooth, Course::Monotone),
    ("cbrt", f64::cbrt, Outcome::Side, Course::Monotone),
    ("exp", f64::exp, Outcome::Smooth, Course::Monotone),
    ("ln", f64::ln, Outcome::Smooth, Course::Monotone),
    ("log", f64::ln, Outcome::Smooth, Course::Monotone),
    ("log10", f64::log10, Outcome::Smooth, Course::Monotone),
    ("log2", f64::log2, Outcome::Smooth, Course::Monotone),
    ("sin", f64::sin, Outcome::Smooth, Course::Sine),
    ("cos", f64::cos, Outcome::Smooth, Course::Cosine),
    ("tan", f64::tan, Outcome::Smooth, Course::Tangent),
    ("asin", f64::asin, Outcome::Smooth, Course::Monotone),
    ("acos", f64::acos, Outcome::Smooth, Course::Monotone),
    ("atan", f64::atan, Outcome::Smooth, Course::Monotone),
    ("sinh", f64::sinh, Outcome::Smooth, Course::Monotone),
    ("cosh", f64::cosh, Outcome::Smooth, Course::Even),
    ("tanh", f64::tanh, Outcome::Smooth, Course::Monotone),
    ("abs", f64::abs, Outcome::Side, Course::Even),
    ("sign", |a| if a == 0.0 { 0.0 } else { a.signum() }, Outcome::Sign, Course::Monotone),
    ("floor", f64::floor, Outcome::Floor, Course::Monotone),
    ("ceil", f64::ceil, Outcome::Ceil, Course::Monotone),
    ("round", f64::round, Outcome::Round, Course::Monotone),
    ("step", step, Outcome::Sign, Course::Monotone),
    ("heaviside", step, Outcome::Sign, Course::Monotone),
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
