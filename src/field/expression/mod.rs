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

mod enclosure;
mod functions;
mod interval;
mod parser;
mod program;

use crate::error::{Error, Result};
use crate::field::Trace;
use crate::field::patch::{Enclosure, Patch};
use interval::Interval;
pub(crate) use parser::Names;
use parser::{RADIUS, VARIABLES};
use program::Program;
use sph::geometry::distance;

const MAX_LENGTH: usize = 10_000;

/// A parsed expression of x, y, z, r and, where it is one of fields, of others by name. Cheap to evaluate, from any thread.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    program: Program,
    has_radius: bool,
}

impl Expression {
    /// Parses `text`, in which the first `dimension` of x, y, z and r may occur. `key` names the place in the
    /// scene.
    ///
    /// # Errors
    /// Anything that is no expression, with the column.
    pub fn parse(key: &str, text: &str, dimension: usize) -> Result<Self> {
        Self::parse_with(key, text, Names { dimension, others: &[], constants: &|_| None })
    }

    /// [`Self::parse`] with more constants, and variables, whose values [`Self::evaluate_with`] takes.
    pub(crate) fn parse_with(key: &str, text: &str, names: Names<'_>) -> Result<Self> {
        if text.len() > MAX_LENGTH {
            return Err(Error::scene(
                key,
                format!("the expression has {} bytes, at most {MAX_LENGTH} are allowed", text.len()),
            ));
        }
        let program = parser::parse(text, names).map_err(|(at, problem)| {
            Error::scene(key, format!("'{text}', column {}: {problem}", text[..at.min(text.len())].chars().count() + 1))
        })?;
        Ok(Self { text: text.to_owned(), has_radius: program.has_variable(|k| k == RADIUS), program })
    }

    /// Whether it has no variable but r.
    pub fn is_radial(&self) -> bool {
        !self.program.has_variable(|k| k != RADIUS)
    }

    /// Whether it has no variable at all.
    pub fn is_constant(&self) -> bool {
        !self.program.has_variable(|_| true)
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// Value at `x`, with `r` measured from `center`. NaN where the expression is not defined.
    pub fn evaluate<const D: usize>(&self, x: &[f64; D], center: &[f64; D]) -> f64 {
        self.program.run(&self.variables(x, center))
    }

    /// Value where the variables have `values`: x, y, z (as many as were parsed for, else anything), r, and the others in
    /// their order.
    pub(crate) fn evaluate_with(&self, values: &[f64]) -> f64 {
        self.program.run(values)
    }

    /// Whether the variable occurs that is at this place of the others.
    pub(crate) fn has_other(&self, place: usize) -> bool {
        self.program.has_variable(|k| k == VARIABLES.len() + place)
    }

    /// The value, and the piece alone of what [`Self::trace`] tells.
    pub(crate) fn value_and_piece<const D: usize>(&self, x: &[f64; D], center: &[f64; D]) -> (f64, u64) {
        self.program.value_and_piece(&self.variables(x, center))
    }

    /// The value as [`Self::evaluate`] gives it; a new `trace` gets numbers for the piece that `x` lies in: for the branch of each `if`
    /// that was taken, and the outcomes of comparisons, of sign, step and heaviside, and the integer parts of floor, ceil,
    /// round and mod, as far as they were evaluated; and for the smooth part of it, which kinks end too.
    pub(crate) fn trace<const D: usize>(&self, x: &[f64; D], center: &[f64; D], trace: &mut Trace) -> f64 {
        self.program.trace(&self.variables(x, center), trace)
    }

    /// What is known of the values in all of a patch.
    pub(crate) fn enclosure<const D: usize>(&self, patch: &Patch<D>, center: &[f64; D]) -> Enclosure {
        let mut variables = [Interval::point(0.0); VARIABLES.len()];
        for k in 0..D {
            variables[k] = Interval::between(patch.lo[k], patch.hi[k]);
        }
        if self.has_radius {
            let square = |k: usize| variables[k].plus(Interval::point(-center[k])).whole_power(2);
            let squares = (1..D).fold(square(0), |sum, k| sum.plus(square(k)));
            let distance = squares.monotone(f64::sqrt);
            let known = patch.distance.filter(|known| known.0 == *center);
            variables[RADIUS] = known.map_or(distance, |(_, [a, b])| distance.intersection(Interval::between(a, b)));
        }
        self.program.enclosure(&variables, &self.variables(&patch.middle, center))
    }

    /// Whether the piece that [`Self::trace`] gives can differ between points.
    pub(crate) fn is_piecewise(&self) -> bool {
        self.program.is_piecewise()
    }

    /// Whether the part that [`Self::trace`] gives can differ between points.
    pub(crate) fn has_parts(&self) -> bool {
        self.program.has_parts()
    }

    #[inline]
    fn variables<const D: usize>(&self, x: &[f64; D], center: &[f64; D]) -> [f64; VARIABLES.len()] {
        let mut variables = sph::array(|k| if k < D { x[k] } else { 0.0 });
        if self.has_radius {
            variables[RADIUS] = distance(x, center);
        }
        variables
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    fn traced<const D: usize>(expression: &Expression, x: &[f64; D], center: &[f64; D]) -> (f64, Trace) {
        let mut trace = Trace::new(0, 0);
        (expression.trace(x, center, &mut trace), trace)
    }

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
    fn a_branch_is_not_its_last_number() {
        for (text, at_0, at_1) in [
            ("-if(x, 1, 2)", -2.0, -1.0),
            ("if(x, 1, 2) + 3", 5.0, 4.0),
            ("2*if(x, 1 + 1, 3*4)", 24.0, 4.0),
            ("if(if(x, 0, 1), if(x, 5, 6), if(x, 7, 8))", 6.0, 7.0),
            ("max(if(x, 1, 2), 1.5, if(x, 4, 0))", 2.0, 4.0),
        ] {
            assert_eq!((value(text, [0.0; 3]), value(text, [1.0, 0.0, 0.0])), (at_0, at_1), "{text}");
        }
    }

    #[test]
    fn pieces_are_told_by_what_was_evaluated() {
        let piece = |text: &str, x: f64| {
            let (value, trace) = traced(&Expression::parse("density", text, 3).unwrap(), &[x, 0.0, 0.0], &[0.0; 3]);
            assert_eq!(value.to_bits(), self::value(text, [x, 0.0, 0.0]).to_bits(), "{text}");
            trace.piece
        };
        // Each has its discontinuities at the integers, and nothing else between -0.9 and 1.9.
        for text in [
            "floor(x)",
            "ceil(x)",
            "round(x - 0.5)",
            "mod(x, 1)",
            "1 + mod(3*x, -3)",
            "step(x) + heaviside(x - 1)",
            "sign(x) + sign(x - 1)",
            "(x < 0) + 2*(x >= 1)",
            "if(x < 0, 1, if(x < 1, 2, 3))",
            "if(x > 0, if(x > 1, exp(x), x), -x)",
        ] {
            assert_eq!(piece(text, -0.9), piece(text, -0.1), "{text}");
            assert_eq!(piece(text, 0.1), piece(text, 0.9), "{text}");
            assert_eq!(piece(text, 1.1), piece(text, 1.9), "{text}");
            let all = [-0.5, 0.5, 1.5].map(|x| piece(text, x));
            assert!(all[0] != all[1] && all[1] != all[2] && all[0] != all[2], "{text}: {all:?}");
        }
        let hidden = "if(x < 0, 1 + (x < -1), 2)";
        assert_eq!(piece(hidden, 1.0), piece(hidden, 2.0));
        assert_ne!(piece(hidden, -0.5), piece(hidden, -1.5));
        assert_eq!(piece("sin(x) + abs(x)*max(x, 0) + floor(2.5)", -1.0), 0);
    }

    #[test]
    fn long_and_deep_expressions_are_evaluated() {
        assert_eq!(value(&["x"; 4000].join("+"), [2.0, 0.0, 0.0]), 8000.0);
        let deep = format!("{}x{}", "(x + x*(".repeat(30), "))".repeat(30));
        assert_eq!(value(&deep, [1.0, 0.0, 0.0]), 31.0);
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
            ("if(x < 1 && y < 2, 1, 0)", 3, vec!["found '&'", "(x < 1)*(y < 2)"]),
            ("x < 1 || y < 2", 3, vec!["unexpected '|'", "max(x < 1, y < 2)"]),
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

    /// Each with its values at 2000 points of each of some boxes.
    #[test]
    fn enclosures_hold_all_values_and_discontinuities() {
        let texts = [
            "1 + 0.9*sin(3*x + 5*y) - cos(7*z)^2 + tan(x/9)",
            "if((r >= 0.3)*(r < 0.7), 5*x, if(y > 0.2, z, -z))",
            "max(1 - r/0.6, 0)^1.5 + min(x, y, z)",
            "abs(x - 0.2)^-0.7 + cbrt(y) + exp(-z^2/0.01)",
            "floor(3*x) + ceil(2*y) + round(5*z) + sign(x) + step(y - 0.1) + mod(x, 0.3) + mod(y, -0.7)",
            "atan2(y, x) + hypot(x, y - z) + x/(y + 1.5) + (x + 2)^y + acos(x/3) + asin(z/3) + x^3 - x^-2",
            "(x == y) + (x != 0.5) + (x <= 0)*(y >= 0) + ln(x + 3) + cosh(x) + sinh(y) + log10(z + 2)",
            "sqrt(x) + ln(y)",
            "if(mod(floor(4*x) + floor(4*y), 2) < 1, 2 - x*y, sqrt(z + 1))",
        ];
        let mut random = crate::field::testing::Random::new(3);
        for (text, trial) in texts.iter().flat_map(|text| (0..200).map(move |i| (text, i))) {
            let expression = Expression::parse("density", text, 3).unwrap();
            let size = 2.0 * 0.1_f64.powi(trial % 4);
            let lo: [f64; 3] = sph::array(|_| 2.0 * random.unit() - 1.0);
            let hi = lo.map(|v| v + size * random.unit());
            let patch = Patch::of_box(lo, hi);
            let found = expression.enclosure(&patch, &[0.1, 0.0, 0.0]);
            let traces: Vec<(f64, Trace)> = (0..100)
                .map(|_| sph::array(|k| lo[k] + (hi[k] - lo[k]) * random.unit()))
                .map(|x| traced(&expression, &x, &[0.1, 0.0, 0.0]))
                .collect();
            let (_, middle) = traced(&expression, &patch.middle, &[0.1, 0.0, 0.0]);
            for (value, trace) in &traces {
                let slack = 1e-12 * (1.0 + value.abs());
                let is_within = found.least - slack <= *value && *value <= found.most + slack;
                // What is no number is told by a discontinuity.
                assert!(is_within || value.is_nan() && !found.is_continuous, "{text} {patch:?}: {value} {found:?}");
                assert!(!found.is_continuous || trace.piece == middle.piece, "{text} {patch:?}");
                if trace.part == middle.part {
                    assert_eq!(found.levels().len(), middle.levels().len(), "{text}");
                    for (level, [least, most]) in trace.levels().iter().zip(found.levels()) {
                        assert!(least - 1e-12 <= level.value && level.value <= most + 1e-12, "{text} {level:?}");
                    }
                }
            }
        }
    }

    /// Bounds fall with the box: those of a distance, a wave and a power law are exact but for rounding.
    #[test]
    fn enclosures_of_monotone_functions_are_exact() {
        let patch = Patch::of_box([0.5, 0.0, 0.0], [0.6, 0.1, 0.2]);
        let of = |text: &str| Expression::parse("density", text, 3).unwrap().enclosure(&patch, &[0.0; 3]);
        let far = (0.36_f64 + 0.01 + 0.04).sqrt();
        for (text, least, most) in [
            ("r", 0.5, far),
            ("r^-2.5", far.powf(-2.5), 0.5_f64.powf(-2.5)),
            ("sin(2*x)", 1.0_f64.sin(), 1.2_f64.sin()),
        ] {
            let found = of(text);
            assert!((found.least - least).abs() < 1e-14 && (found.most - most).abs() < 1e-13, "{text}: {found:?}");
            assert!(found.is_continuous);
        }
        assert!(!of("if(r < 0.55, 1, 2)").is_continuous && of("if(r < 0.49, 1, 2)").is_continuous);
    }

    #[test]
    fn any_text_is_an_expression_or_an_error() {
        let mut random = Random::new(6);
        let letters: Vec<char> = "-+*/^()<>=!., xyzr0123456789abcdef".chars().collect();
        for _ in 0..2000 {
            let text: String = (0..random.whole(0, 41)).map(|_| letters[random.whole(0, letters.len())]).collect();
            if let Ok(e) = Expression::parse("density", &text, 3) {
                e.evaluate(&[1.0, 2.0, 3.0], &[0.0; 3]);
            }
        }
    }

    #[test]
    fn literals_survive_exactly() {
        let mut random = Random::new(7);
        for _ in 0..256 {
            let v = random.unit() * 10f64.powi(random.whole(0, 617) as i32 - 308);
            let e = Expression::parse("density", &format!("{v:e}"), 1).unwrap();
            assert_eq!(e.evaluate(&[0.0], &[0.0]), v);
        }
    }
}
