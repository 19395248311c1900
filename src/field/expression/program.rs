//! An expression as steps over a stack of values.

use crate::field::trace::{Level, Trace, chained};

pub(super) type Unary = fn(f64) -> f64;
pub(super) type Binary = fn(f64, f64) -> f64;

/// What tells the parts of a function that is smooth but for discontinuities and kinks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Nothing: the function is smooth.
    Smooth,
    /// Whether the first operand is less than the second, or more. Discontinuous.
    Less,
    More,
    /// Whether something is so that comparisons have told, or that ends at single points. Discontinuous.
    Truth,
    /// The sign of the operand. Discontinuous.
    Sign,
    /// The value: the integer at or below the operand, at or above it, next to it. Discontinuous.
    Floor,
    Ceil,
    Round,
    /// How many times the second operand goes into the first. Discontinuous.
    Quotient,
    /// Which of the operands is the value. A kink.
    Choice,
    /// On which side of 0 the operand lies. A kink.
    Side,
    /// On which side of 0 the first operand lies where the second is negative. Discontinuous, but not between points to
    /// which ways lead that go around.
    Cut,
}

impl Outcome {
    fn is_discontinuous(self) -> bool {
        !matches!(self, Self::Smooth | Self::Choice | Self::Side | Self::Cut)
    }

    /// Adds what became of operands and value to the number of a piece, as [`Self::record`] does.
    fn number(self, [a, b]: [f64; 2], value: f64, piece: &mut u64) {
        match self {
            Self::Quotient => *piece = chained(*piece, ((a - value) / b).round()),
            _ if self.is_discontinuous() => *piece = chained(*piece, value),
            _ => {}
        }
    }

    /// Tells `trace` of operands and value.
    fn record(self, [a, b]: [f64; 2], value: f64, trace: &mut Trace) {
        let side = |x: f64| if x < 0.0 { (f64::NEG_INFINITY, 0.0) } else { (0.0, f64::INFINITY) };
        let quotient = |v: f64| ((a - v) / b).round();
        let (number, level, (lo, hi)) = match self {
            Self::Smooth => return,
            Self::Cut if !(b < 0.0) => return,
            Self::Truth => return trace.discontinuity(value),
            Self::Less => (value, a - b, side(0.5 - value)),
            Self::More => (value, a - b, side(value - 0.5)),
            Self::Sign => (value, a, side(a)),
            Self::Floor => (value, a, (value, value + 1.0)),
            Self::Ceil => (value, a, (value - 1.0, value)),
            Self::Round => (value, a, (value - 0.5, value + 0.5)),
            Self::Quotient => (quotient(value), a / b, (quotient(value), quotient(value) + 1.0)),
            Self::Choice => (f64::from(a < b), a - b, side(a - b)),
            Self::Side | Self::Cut => (f64::from(a < 0.0), a, side(a)),
        };
        if self.is_discontinuous() {
            trace.discontinuity(number)
        } else {
            trace.kink(number)
        }
        trace.push(Level { value: level, lo, hi });
    }
}

/// How a function of one argument goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    /// Rising throughout, or falling.
    Monotone,
    /// The same on both sides of 0, and rising beyond.
    Even,
    Sine,
    Cosine,
    Tangent,
}

/// Stacks up to here need no allocation, and up to `FLAT` hardly any clearing.
const SHALLOW: usize = 32;
const FLAT: usize = 6;
/// Exponents up to here, if whole, are multiplications.
const LARGEST_WHOLE: f64 = 64.0;

/// Takes its operands from the top of the stack and puts its value there.
#[derive(Debug, Clone, Copy)]
pub(super) enum Step {
    Number(f64),
    /// One of x, y, z, r by its place.
    Variable(usize),
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Unary(Unary, Outcome, Course),
    Binary(Binary, Outcome),
    /// An operator whose second operand is a number.
    PlusNumber(f64),
    TimesNumber(f64),
    OverNumber(f64),
    /// Multiplied with itself, which is exact to the last digits and ten times as fast as a power of any other exponent.
    Whole(i32),
    /// To the other branch of an `if` whose condition, which it takes, is 0.
    Unless(usize),
    /// Over the other branch.
    Jump(usize),
}

/// Steps in the order in which they run. Those whose operands are numbers run while it is built.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    steps: Vec<Step>,
    /// Values on the stack after the last step, and the most there ever are.
    height: usize,
    most: usize,
    /// Steps before this one belong to an `if`, whose value is not that of its last step alone.
    settled: usize,
}

impl Step {
    fn operands(self) -> usize {
        match self {
            Self::Number(_) | Self::Variable(_) | Self::Jump(_) => 0,
            Self::Add | Self::Subtract | Self::Multiply | Self::Divide | Self::Power | Self::Binary(..) => 2,
            _ => 1,
        }
    }

    /// The same with the number `k` as its second operand.
    fn with_number(self, k: f64) -> Option<Self> {
        match self {
            Self::Add => Some(Self::PlusNumber(k)),
            Self::Subtract => Some(Self::PlusNumber(-k)),
            Self::Multiply => Some(Self::TimesNumber(k)),
            Self::Divide => Some(Self::OverNumber(k)),
            Self::Power if k.fract() == 0.0 && k.abs() <= LARGEST_WHOLE => Some(Self::Whole(k as i32)),
            _ => None,
        }
    }
}

impl Program {
    pub fn push(&mut self, step: Step) {
        let operands = step.operands();
        let before = self.height - operands;
        self.height = before + usize::from(!matches!(step, Step::Unless(_) | Step::Jump(_)));
        self.most = self.most.max(self.height);
        let first = self.steps.len().saturating_sub(operands);
        let known = |steps: &[Step]| steps.iter().all(|s| matches!(s, Step::Number(_)));
        let is_computed = first >= self.settled && !matches!(step, Step::Unless(_));
        if operands > 0 && is_computed && known(&self.steps[first..]) {
            self.steps.push(step);
            let value = run(&self.steps[first..], &[0.0; 4], &mut [0.0; 2], unwatched);
            self.steps.truncate(first);
            self.steps.push(Step::Number(value));
            return;
        }
        if let (true, Some(&Step::Number(k))) = (operands == 2 && self.steps.len() > self.settled, self.steps.last())
            && let Some(short) = step.with_number(k)
        {
            self.steps.pop();
            self.steps.push(short);
            return;
        }
        self.steps.push(step);
    }

    /// Begins the branch for a condition that holds; its place is for [`Self::otherwise`].
    pub fn unless(&mut self) -> usize {
        self.push(Step::Unless(usize::MAX));
        self.steps.len() - 1
    }

    /// Begins the other branch; its place is for [`Self::end`].
    pub fn otherwise(&mut self, unless: usize) -> usize {
        self.push(Step::Jump(usize::MAX));
        // Either branch leaves one value.
        self.height -= 1;
        self.steps[unless] = Step::Unless(self.steps.len());
        self.steps.len() - 1
    }

    /// Ends the other branch.
    pub fn end(&mut self, jump: usize) {
        self.settled = self.steps.len();
        self.steps[jump] = Step::Jump(self.settled);
    }

    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Whether `is_wanted` for a variable that occurs.
    pub fn has_variable(&self, is_wanted: impl Fn(usize) -> bool) -> bool {
        self.steps.iter().any(|step| matches!(step, Step::Variable(k) if is_wanted(*k)))
    }

    /// Whether a step can make the value discontinuous.
    pub fn is_piecewise(&self) -> bool {
        self.steps.iter().any(|step| match step {
            Step::Unless(_) => true,
            Step::Unary(_, outcome, _) | Step::Binary(_, outcome) => outcome.is_discontinuous(),
            _ => false,
        })
    }

    /// Whether a step can make the value or its slope discontinuous.
    pub fn has_parts(&self) -> bool {
        let is_kinked =
            |step: &Step| matches!(step, Step::Unary(_, o, _) | Step::Binary(_, o) if *o != Outcome::Smooth);
        self.is_piecewise() || self.steps.iter().any(is_kinked)
    }

    pub fn run(&self, variables: &[f64]) -> f64 {
        self.watched(variables, unwatched)
    }

    /// The value, and a number for the outcomes on the way to it that can be discontinuous, as in [`Self::trace`].
    pub fn value_and_piece(&self, variables: &[f64]) -> (f64, u64) {
        let mut piece = 0;
        let value = self.watched(variables, |outcome, operands, value| outcome.number(operands, value, &mut piece));
        (value, piece)
    }

    fn watched(&self, variables: &[f64], watch: impl FnMut(Outcome, [f64; 2], f64)) -> f64 {
        if self.most <= FLAT {
            run(&self.steps, variables, &mut [0.0; FLAT], watch)
        } else if self.most <= SHALLOW {
            run(&self.steps, variables, &mut [0.0; SHALLOW], watch)
        } else {
            run(&self.steps, variables, &mut vec![0.0; self.most], watch)
        }
    }

    /// The value; a new `trace` gets the outcomes on the way to it: branches taken, comparisons, steps, integer parts, kinks.
    pub fn trace(&self, variables: &[f64], trace: &mut Trace) -> f64 {
        self.watched(variables, |outcome, operands, value| outcome.record(operands, value, trace))
    }
}

const fn unwatched(_: Outcome, _: [f64; 2], _: f64) {}

/// The topmost value is kept apart from those `below` it. `watch` is told what can be discontinuous, its operands and
/// its value.
fn run(steps: &[Step], variables: &[f64], below: &mut [f64], mut watch: impl FnMut(Outcome, [f64; 2], f64)) -> f64 {
    let (mut top, mut height, mut at) = (0.0, 0, 0);
    while let Some(&step) = steps.get(at) {
        at += 1;
        match step {
            Step::Number(value) => (below[height], top, height) = (top, value, height + 1),
            Step::Variable(k) => (below[height], top, height) = (top, variables[k], height + 1),
            Step::Negate => top = -top,
            Step::Unary(f, outcome, _) => {
                let value = f(top);
                watch(outcome, [top, 0.0], value);
                top = value;
            }
            Step::Jump(place) => at = place,
            Step::Unless(place) => {
                watch(Outcome::Truth, [top, 0.0], f64::from(top != 0.0));
                if top == 0.0 {
                    at = place;
                }
                height -= 1;
                top = below[height];
            }
            Step::Add => (top, height) = (below[height - 1] + top, height - 1),
            Step::Subtract => (top, height) = (below[height - 1] - top, height - 1),
            Step::Multiply => (top, height) = (below[height - 1] * top, height - 1),
            Step::Divide => (top, height) = (below[height - 1] / top, height - 1),
            Step::Power => (top, height) = (below[height - 1].powf(top), height - 1),
            Step::PlusNumber(k) => top += k,
            Step::TimesNumber(k) => top *= k,
            Step::OverNumber(k) => top /= k,
            Step::Whole(2) => top *= top,
            Step::Whole(k) => top = top.powi(k),
            Step::Binary(f, outcome) => {
                let operands = [below[height - 1], top];
                (top, height) = (f(operands[0], operands[1]), height - 1);
                watch(outcome, operands, top);
            }
        }
    }
    top
}
