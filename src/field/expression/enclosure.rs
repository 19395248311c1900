//! An expression over a box of its variables: all values that it may have there, and whether one smooth function is behind them.

use super::interval::Interval;
use super::program::{Course, Outcome, Program, Step};
use crate::field::patch::Enclosure;
use std::f64::consts::{FRAC_PI_2, PI};

impl Program {
    /// All values where the variables are anywhere in `variables`, perhaps more; whether no discontinuity lies there; and the
    /// bounds of what tells the parts, in the order and as far as at the place `middle`.
    pub fn enclosure(&self, variables: &[Interval], middle: &[f64]) -> Enclosure {
        let is_followed = true;
        let found = Enclosure::new(0.0, 0.0, true);
        let mut over =
            Over { steps: self.steps(), variables, middle, stack: Vec::with_capacity(8), is_followed, found };
        over.run(0, self.steps().len());
        let value = over.pop().all;
        over.found.is_continuous &= value.is_defined;
        over.found.within(value.lo, value.hi)
    }
}

/// An operand: all that it may be, and what it is in the middle.
#[derive(Debug, Clone, Copy)]
struct Operand {
    all: Interval,
    middle: f64,
}

struct Over<'a> {
    steps: &'a [Step],
    variables: &'a [Interval],
    middle: &'a [f64],
    stack: Vec<Operand>,
    /// Whether the steps are among those of the middle.
    is_followed: bool,
    /// Levels, and whether there are no discontinuities.
    found: Enclosure,
}

impl Over<'_> {
    fn pop(&mut self) -> Operand {
        self.stack.pop().unwrap_or(Operand { all: Interval::ANYTHING, middle: f64::NAN })
    }

    /// The steps from `at` up to `end`.
    fn run(&mut self, mut at: usize, end: usize) {
        while at < end {
            let step = self.steps[at];
            at += 1;
            let value = match step {
                Step::Number(v) => Operand { all: Interval::point(v), middle: v },
                Step::Variable(k) => Operand {
                    all: self.variables.get(k).copied().unwrap_or(Interval::ANYTHING),
                    middle: self.middle.get(k).copied().unwrap_or(f64::NAN),
                },
                Step::Unless(otherwise) => {
                    at = self.branch(at, otherwise);
                    continue;
                }
                Step::Jump(place) => {
                    at = place;
                    continue;
                }
                Step::Add | Step::Subtract | Step::Multiply | Step::Divide | Step::Power | Step::Binary(..) => {
                    let (b, a) = (self.pop(), self.pop());
                    self.of_two(step, a, b)
                }
                _ => {
                    let a = self.pop();
                    self.of_one(step, a)
                }
            };
            self.stack.push(value);
        }
    }

    /// One branch of an `if`, or both where the condition may be either; returns the step after it. The first branch begins at
    /// `then`, the other at `otherwise`, with a jump to its end before it.
    fn branch(&mut self, then: usize, otherwise: usize) -> usize {
        let condition = self.pop();
        let Step::Jump(end) = self.steps[otherwise - 1] else { return otherwise };
        if condition.all.is_single() && condition.all.lo == 0.0 {
            self.run(otherwise, end);
        } else if condition.all.is_defined && !condition.all.contains(0.0) {
            self.run(then, otherwise - 1);
        } else {
            self.found.is_continuous = false;
            let is_followed = self.is_followed;
            self.is_followed = is_followed && condition.middle != 0.0;
            self.run(then, otherwise - 1);
            let first = self.pop();
            self.is_followed = is_followed && condition.middle == 0.0;
            self.run(otherwise, end);
            let second = self.pop();
            self.is_followed = is_followed;
            let middle = if condition.middle == 0.0 { second.middle } else { first.middle };
            self.stack.push(Operand { all: first.all.union(second.all), middle });
        }
        end
    }

    fn of_one(&mut self, step: Step, a: Operand) -> Operand {
        let of = |all: Interval, middle: f64| Operand { all, middle };
        match step {
            Step::Negate => of(a.all.negated(), -a.middle),
            Step::PlusNumber(k) => of(a.all.plus(Interval::point(k)), a.middle + k),
            Step::TimesNumber(k) => of(a.all.times(Interval::point(k)), a.middle * k),
            Step::OverNumber(k) => of(a.all.over(Interval::point(k)), a.middle / k),
            Step::Whole(k) => of(a.all.whole_power(k), a.middle.powi(k)),
            Step::Unary(f, outcome, course) => {
                let all = match course {
                    Course::Monotone => a.all.monotone(f),
                    Course::Even => a.all.even(f),
                    Course::Sine => a.all.wave(f, FRAC_PI_2),
                    Course::Cosine => a.all.wave(f, 0.0),
                    Course::Tangent => tangent(a.all),
                };
                let none = Operand { all: Interval::point(0.0), middle: 0.0 };
                self.note(outcome, [a, none], all);
                of(all, f(a.middle))
            }
            _ => of(Interval::ANYTHING, f64::NAN),
        }
    }

    fn of_two(&mut self, step: Step, a: Operand, b: Operand) -> Operand {
        let of = |all: Interval, middle: f64| Operand { all, middle };
        match step {
            Step::Add => of(a.all.plus(b.all), a.middle + b.middle),
            Step::Subtract => of(a.all.plus(b.all.negated()), a.middle - b.middle),
            Step::Multiply => of(a.all.times(b.all), a.middle * b.middle),
            Step::Divide => of(a.all.over(b.all), a.middle / b.middle),
            Step::Power => of(a.all.power(b.all), a.middle.powf(b.middle)),
            Step::Binary(f, outcome) => {
                let all = binary(f, outcome, a.all, b.all);
                self.note(outcome, [a, b], all);
                of(all, f(a.middle, b.middle))
            }
            _ => of(Interval::ANYTHING, f64::NAN),
        }
    }

    /// Whether an outcome is the same for all of the operands, and the bounds of what it depends on, as [`Outcome::record`] has it.
    fn note(&mut self, outcome: Outcome, [a, b]: [Operand; 2], value: Interval) {
        let is_settled = match outcome {
            // Continuous.
            Outcome::Smooth | Outcome::Choice | Outcome::Side | Outcome::Cut => true,
            Outcome::Quotient => quotient(a.all, b.all).is_some(),
            _ => value.is_single(),
        };
        self.found.is_continuous &= is_settled;
        let level = match outcome {
            Outcome::Smooth | Outcome::Truth => return,
            Outcome::Cut if !(b.middle < 0.0) => return,
            Outcome::Less | Outcome::More | Outcome::Choice => a.all.plus(b.all.negated()),
            Outcome::Quotient => a.all.over(b.all),
            _ => a.all,
        };
        if self.is_followed {
            self.found.push([level.lo, level.hi]);
        }
    }
}

/// A comparison, a choice or a function of two arguments, which its outcome tells.
fn binary(f: fn(f64, f64) -> f64, outcome: Outcome, a: Interval, b: Interval) -> Interval {
    if !(a.is_defined && b.is_defined) {
        return Interval::ANYTHING;
    }
    let corners = a.corners(b, f);
    let over_corners = || Interval::around(&corners);
    match outcome {
        Outcome::Less | Outcome::More | Outcome::Choice => over_corners(),
        // Whether they are equal.
        Outcome::Truth if a.hi < b.lo || b.hi < a.lo || a.is_single() && b.is_single() => over_corners(),
        Outcome::Truth => Interval::between(0.0, 1.0),
        Outcome::Quotient if quotient(a, b).is_some() => Interval::between(corners[0], corners[0] + (a.hi - a.lo)),
        Outcome::Quotient => Interval::between(0.0, b.lo.abs().max(b.hi.abs())),
        // The angle of a point: that of a corner, where the origin and the cut are elsewhere.
        Outcome::Cut if b.lo > 0.0 || a.lo > 0.0 || a.hi < 0.0 => over_corners(),
        Outcome::Cut => Interval::between(-PI, PI),
        // The hypotenuse: rising with the sizes of both.
        _ => {
            let (a, b) = (a.even(f64::abs), b.even(f64::abs));
            Interval::between(f(a.lo, b.lo), f(a.hi, b.hi))
        }
    }
}

/// How many times a number goes into `a`, where that is the same for all of it.
fn quotient(a: Interval, b: Interval) -> Option<f64> {
    let times = |v: f64| (v / b.lo).floor();
    (b.is_single() && b.lo != 0.0 && times(a.lo) == times(a.hi)).then(|| times(a.lo))
}

/// Between two of its poles.
fn tangent(a: Interval) -> Interval {
    let turn = |v: f64| ((v + FRAC_PI_2) / PI).floor();
    if turn(a.lo) == turn(a.hi) { a.monotone(f64::tan) } else { Interval::ANYTHING }
}
