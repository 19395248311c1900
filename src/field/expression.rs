//! Expressions of the coordinates, as scene files state them.
//!
//! ```text
//! comparison  a < b   a <= b   a > b   a >= b   a == b   a != b      1 where true, else 0
//! sum         a + b   a - b
//! product     a * b   a / b
//! sign        -a   +a                                                -x^2 is -(x^2)
//! power       a ^ b   a ** b                                         right to left
//! variables   x, y, z (as many as there are dimensions), r = |position - center|
//! constants   pi, tau, e
//! functions   sqrt cbrt exp ln log (natural) log10 log2 sin cos tan asin acos atan sinh cosh tanh abs sign
//!             floor ceil round step heaviside (0 below 0, else 1)
//!             min(a, b, ...) max(a, b, ...) pow(a, b) atan2(y, x) hypot(a, b) mod(a, b)
//!             if(condition, then, else)                              only the branch taken counts
//! ```
//!
//! The evaluator is `exmex`. Its own grammar puts signs before powers (there `exp(-r^2)` grows), takes
//! functions of two arguments at most and gives errors without a place. So the text is parsed here and handed
//! over with every operand in parentheses.

use crate::error::{Error, Result};
use exmex::{BinOp, Express, FlatEx, MakeOperators, MatchLiteral, Operator};
use sph::geometry::distance;

/// Nesting beyond this is refused, not recursed into.
const MAX_DEPTH: usize = 64;
const MAX_LENGTH: usize = 10_000;

type Unary = fn(f64) -> f64;
type Binary = fn(f64, f64) -> f64;

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

/// Operators and their names within `exmex`.
const INFIX: &[(&str, &str, Binary)] = &[
    ("+", "op_add", |a, b| a + b),
    ("-", "op_sub", |a, b| a - b),
    ("*", "op_mul", |a, b| a * b),
    ("/", "op_div", |a, b| a / b),
    ("^", "op_pow", f64::powf),
    ("<", "op_lt", |a, b| f64::from(a < b)),
    ("<=", "op_le", |a, b| f64::from(a <= b)),
    (">", "op_gt", |a, b| f64::from(a > b)),
    (">=", "op_ge", |a, b| f64::from(a >= b)),
    ("==", "op_eq", |a, b| f64::from(a == b)),
    ("!=", "op_ne", |a, b| f64::from(a != b)),
    // `if(c, a, b)` is `(c op_then a) op_else b`.
    ("then", "op_then", |c, a| if c != 0.0 { a } else { f64::from_bits(NOT_TAKEN) }),
    ("else", "op_else", |a, b| if a.to_bits() == NOT_TAKEN { b } else { a }),
];

/// A quiet NaN that no arithmetic yields: the mark of a branch that was not taken.
const NOT_TAKEN: u64 = 0x7ff8_5eed_0b57_ac1e;

fn step(x: f64) -> f64 {
    if x >= 0.0 {
        1.0
    } else if x < 0.0 {
        0.0
    } else {
        f64::NAN
    }
}

#[derive(Clone, Debug)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let binary = |name, apply| Operator::make_bin(name, BinOp { apply, prio: 0, is_commutative: false });
        let mut all: Vec<Operator<'a, f64>> = UNARY.iter().map(|&(n, f)| Operator::make_unary(n, f)).collect();
        all.push(Operator::make_unary("op_neg", |a: f64| -a));
        all.extend(BINARY.iter().map(|&(n, f)| binary(n, f)));
        all.extend(INFIX.iter().map(|&(_, n, f)| binary(n, f)));
        all
    }
}

exmex::literal_matcher_from_pattern!(Literal, r"^[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?");

/// A parsed expression of x, y, z and r. Cheap to evaluate, from any thread.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    flat: FlatEx<f64, Operators, Literal>,
    /// Which of x, y, z, r each variable of `flat` is.
    slots: Vec<usize>,
}

impl Expression {
    /// Parses `text`, in which the first `dimension` of x, y, z and r may occur. `key` names the place in the
    /// scene.
    ///
    /// # Errors
    /// Anything that is no expression, with the column.
    pub fn parse(key: &str, text: &str, dimension: usize) -> Result<Self> {
        let fail = |at: usize, problem: String| {
            Error::scene(key, format!("'{text}', column {}: {problem}", text[..at.min(text.len())].chars().count() + 1))
        };
        if text.len() > MAX_LENGTH {
            return Err(Error::scene(
                key,
                format!("the expression has {} bytes, at most {MAX_LENGTH} are allowed", text.len()),
            ));
        }
        let mut parser = Parser { text, at: 0, depth: 0, dimension };
        let translated = parser
            .comparison()
            .and_then(|t| match parser.peek() {
                None => Ok(t),
                Some(c) => Err((parser.at, format!("unexpected '{c}' after the end of the expression"))),
            })
            .map_err(|(at, problem)| fail(at, problem))?;
        let flat = FlatEx::<f64, Operators, Literal>::parse(&translated)
            .map_err(|e| Error::scene(key, format!("'{text}': {e}")))?;
        let slots = flat.var_names().iter().map(|n| VARIABLES.iter().position(|v| v == n).unwrap_or(3)).collect();
        Ok(Self { text: text.to_owned(), flat, slots })
    }

    /// Whether it has no variable but r.
    pub fn is_radial(&self) -> bool {
        self.slots.iter().all(|&slot| VARIABLES[slot] == "r")
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// Value at `x`, with `r` measured from `center`. NaN where the expression is not defined.
    pub fn evaluate<const D: usize>(&self, x: &[f64; D], center: &[f64; D]) -> f64 {
        let mut vars = [0.0; 4];
        for (value, &slot) in vars.iter_mut().zip(&self.slots) {
            *value = match slot {
                3 => distance(x, center),
                k => x.get(k).copied().unwrap_or(0.0),
            };
        }
        self.flat.eval(&vars[..self.slots.len()]).unwrap_or(f64::NAN)
    }
}

const VARIABLES: [&str; 4] = ["x", "y", "z", "r"];

/// Byte position and what is wrong there.
type Failure = (usize, String);
type Parsed = std::result::Result<String, Failure>;

/// Recursive descent that emits the same expression with explicit parentheses and this module's operators.
struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    dimension: usize,
}

impl Parser<'_> {
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        let trimmed = rest.trim_start();
        self.at += rest.len() - trimmed.len();
        trimmed.chars().next()
    }

    /// Consumes the first of `symbols` that comes next.
    fn accept(&mut self, symbols: &[&'static str]) -> Option<&'static str> {
        self.peek();
        let found = symbols.iter().find(|s| self.text[self.at..].starts_with(**s))?;
        self.at += found.len();
        Some(found)
    }

    fn expect(&mut self, symbol: &'static str) -> std::result::Result<(), Failure> {
        if self.accept(&[symbol]).is_some() {
            return Ok(());
        }
        let found = self.peek().map_or("the end".to_owned(), |c| format!("'{c}'"));
        Err((self.at, format!("found {found}, expected '{symbol}'")))
    }

    fn comparison(&mut self) -> Parsed {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err((self.at, format!("nested more than {MAX_DEPTH} deep")));
        }
        let left = self.sum()?;
        let result = match self.accept(&["<=", ">=", "==", "!=", "<", ">"]) {
            Some(op) => infix(op, &left, &self.sum()?),
            None => left,
        };
        self.depth -= 1;
        Ok(result)
    }

    fn sum(&mut self) -> Parsed {
        let mut left = self.product()?;
        while let Some(op) = self.accept(&["+", "-"]) {
            left = infix(op, &left, &self.product()?);
        }
        Ok(left)
    }

    fn product(&mut self) -> Parsed {
        let mut left = self.signed()?;
        loop {
            self.peek();
            if self.text[self.at..].starts_with("**") {
                return Ok(left);
            }
            let Some(op) = self.accept(&["*", "/"]) else {
                return Ok(left);
            };
            left = infix(op, &left, &self.signed()?);
        }
    }

    fn signed(&mut self) -> Parsed {
        let mut negative = false;
        while let Some(sign) = self.accept(&["-", "+"]) {
            negative ^= sign == "-";
        }
        let value = self.power()?;
        Ok(if negative { format!("(op_neg({value}))") } else { value })
    }

    fn power(&mut self) -> Parsed {
        let base = self.primary()?;
        if self.accept(&["^", "**"]).is_none() {
            return Ok(base);
        }
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err((self.at, format!("nested more than {MAX_DEPTH} deep")));
        }
        let exponent = self.signed()?;
        self.depth -= 1;
        Ok(infix("^", &base, &exponent))
    }

    fn primary(&mut self) -> Parsed {
        match self.peek() {
            None => Err((self.at, "the expression ends where a value is expected".into())),
            Some('(') => {
                self.at += 1;
                let inner = self.comparison()?;
                self.expect(")")?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            Some(c) => Err((self.at, format!("unexpected '{c}' where a value is expected"))),
        }
    }

    fn number(&mut self) -> Parsed {
        let rest = &self.text.as_bytes()[self.at..];
        let mut end = rest.iter().take_while(|c| c.is_ascii_digit() || **c == b'.').count();
        if matches!(rest.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(rest.get(end + 1), Some(b'+' | b'-')));
            let digits = rest[end + 1 + sign..].iter().take_while(|c| c.is_ascii_digit()).count();
            if digits > 0 {
                end += 1 + sign + digits;
            }
        }
        let text = &self.text[self.at..self.at + end];
        match text.parse::<f64>() {
            Ok(v) if v.is_finite() => {
                self.at += end;
                Ok(literal(v))
            }
            _ => Err((self.at, format!("'{text}' is no number in the range of double precision"))),
        }
    }

    fn name(&mut self) -> Parsed {
        let start = self.at;
        let length = self.text[start..].bytes().take_while(|c| c.is_ascii_alphanumeric() || *c == b'_').count();
        let name = &self.text[start..start + length];
        self.at += length;
        if self.peek() == Some('(') {
            return self.call(name, start);
        }
        match name {
            "pi" => Ok(literal(std::f64::consts::PI)),
            "tau" => Ok(literal(std::f64::consts::TAU)),
            "e" => Ok(literal(std::f64::consts::E)),
            _ => match VARIABLES.iter().position(|v| *v == name) {
                Some(k) if k == 3 || k < self.dimension => Ok(name.to_owned()),
                Some(_) => Err((start, format!("'{name}' does not exist in {} dimension(s)", self.dimension))),
                None => {
                    let known = VARIABLES[..self.dimension].join(", ");
                    Err((start, format!("unknown name '{name}'; known are {known}, r, pi, tau, e and functions")))
                }
            },
        }
    }

    fn call(&mut self, name: &str, start: usize) -> Parsed {
        self.expect("(")?;
        let mut arguments = vec![self.comparison()?];
        while self.accept(&[","]).is_some() {
            arguments.push(self.comparison()?);
        }
        self.expect(")")?;
        let wrong =
            |expected: &str| Err((start, format!("'{name}' takes {expected}, found {} argument(s)", arguments.len())));
        if name == "if" {
            let [c, a, b] = arguments.as_slice() else {
                return wrong("three arguments");
            };
            return Ok(infix("else", &infix("then", c, a), b));
        }
        if UNARY.iter().any(|u| u.0 == name) {
            let [a] = arguments.as_slice() else {
                return wrong("one argument");
            };
            return Ok(format!("({name}({a}))"));
        }
        if BINARY.iter().any(|b| b.0 == name) {
            let many = matches!(name, "min" | "max");
            if arguments.len() < 2 || !many && arguments.len() > 2 {
                return wrong(if many { "two arguments or more" } else { "two arguments" });
            }
            let folded = arguments.into_iter().reduce(|a, b| format!("(({a}) {name} ({b}))"));
            return folded.ok_or((start, "no arguments".into()));
        }
        let mut known: Vec<&str> = UNARY.iter().map(|u| u.0).chain(BINARY.iter().map(|b| b.0)).chain(["if"]).collect();
        known.sort_unstable();
        Err((start, format!("unknown function '{name}'; known are {}", known.join(", "))))
    }
}

fn infix(op: &str, a: &str, b: &str) -> String {
    let name = INFIX.iter().find(|i| i.0 == op).map_or(op, |i| i.1);
    format!("(({a}) {name} ({b}))")
}

/// In a form that the literal pattern takes.
fn literal(v: f64) -> String {
    format!("({v:e})")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(text: &str, x: [f64; 3]) -> f64 {
        Expression::parse("density", text, 3).unwrap().evaluate(&x, &[0.0; 3])
    }

    #[test]
    fn precedence_is_that_of_mathematics() {
        let x = [2.0, 3.0, 6.0];
        for (text, expected) in [
            ("-x^2", -4.0),
            ("exp(-r^2/49)", (-1.0_f64).exp()),
            ("2^-x", 0.25),
            ("2^3^2", 512.0),
            ("2**3", 8.0),
            ("12/x/y", 2.0),
            ("12/x*y", 18.0),
            ("1 - 2 - 3", -4.0),
            ("2*-x^2", -8.0),
            ("2/-x^2", -0.5),
            ("--x", 2.0),
            ("1e-3*x + 1.5E+2 + .5", 150.502),
            ("r", 7.0),
            ("pi*e/tau", std::f64::consts::E / 2.0),
            ("(x + y)*z", 30.0),
            ("sin(x)^2 + cos(x)^2", 1.0),
            ("x*y/z*x", 2.0),
        ] {
            assert!((value(text, x) - expected).abs() < 1e-13 * expected.abs(), "{text} = {}", value(text, x));
        }
    }

    #[test]
    fn functions_and_branches_work() {
        let x = [0.0, -1.0, 2.0];
        for (text, expected) in [
            ("min(z, 1, y)", -1.0),
            ("max(z, 1, y)", 2.0),
            ("min(sqrt(y), 1)", f64::NAN),
            ("min(1, sqrt(y))", f64::NAN),
            ("max(1, sqrt(y))", f64::NAN),
            ("step(y) + step(x) + heaviside(z)", 2.0),
            ("if(x > 0, 1/x, 5)", 5.0),
            ("if(x == 0, 5, 1/x)", 5.0),
            ("if(y < 0, if(z >= 2, 3, 4), 1)", 3.0),
            ("if(1, sqrt(y), 3)", f64::NAN),
            ("(z > 1) * 7", 7.0),
            ("abs(y) + sign(y) + sign(x)", 0.0),
            ("mod(y, 3) + pow(z, 3) + hypot(3, 4) + atan2(x, 1)", 15.0),
            ("log(e) + ln(e) + log10(100) + log2(8)", 7.0),
        ] {
            let v = value(text, x);
            assert!(v.is_nan() && expected.is_nan() || (v - expected).abs() < 1e-14, "{text} = {v}");
        }
    }

    #[test]
    fn errors_name_the_column() {
        for (text, dimension, parts) in [
            ("1 + ", 3, vec!["column 5", "ends"]),
            ("1 + foo", 3, vec!["column 5", "unknown name 'foo'"]),
            ("y", 1, vec!["column 1", "'y' does not exist in 1"]),
            ("sin(x", 3, vec!["column 6", "expected ')'"]),
            ("x )", 3, vec!["column 3", "unexpected ')'"]),
            ("sinn(x)", 3, vec!["unknown function 'sinn'"]),
            ("sin(x, y)", 3, vec!["takes one argument", "found 2"]),
            ("1e999", 3, vec!["no number"]),
            ("1.2.3", 3, vec!["no number"]),
            ("", 3, vec!["column 1"]),
            ("2 x", 3, vec!["unexpected 'x'"]),
            ("µ", 3, vec!["column 1", "'µ'"]),
        ] {
            let error = Expression::parse("density", text, dimension).unwrap_err().to_string();
            for part in parts {
                assert!(error.contains(part), "{text}: {error}");
            }
            assert!(error.contains("density"));
        }
        assert!(Expression::parse("density", &"(".repeat(5000), 3).is_err());
        assert!(Expression::parse("density", &"2^".repeat(3000), 3).is_err());
        assert!(Expression::parse("density", &"-".repeat(9000), 3).is_err());
    }

    proptest! {
        #[test]
        fn any_text_is_an_expression_or_an_error(text in "[-+*/^()<>=!., xyzr0-9a-f]{0,40}") {
            if let Ok(e) = Expression::parse("density", &text, 3) {
                e.evaluate(&[1.0, 2.0, 3.0], &[0.0; 3]);
            }
        }

        #[test]
        fn literals_survive_exactly(v in 0.0..f64::MAX) {
            let text = format!("{v:e}");
            let e = Expression::parse("density", &text, 1).unwrap();
            prop_assert_eq!(e.evaluate(&[0.0], &[0.0]), v);
        }
    }
}
