//! An expression as steps over a stack of values.

pub(super) type Unary = fn(f64) -> f64;
pub(super) type Binary = fn(f64, f64) -> f64;

/// What tells the pieces of a function that is smooth but for discontinuities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Nothing: the function is continuous.
    Smooth,
    /// Its value, which is constant between discontinuities.
    Value,
    /// How many times the second operand goes into the first.
    Quotient,
}

impl Outcome {
    /// The number of the piece; `None` where there is but one.
    fn number(self, [a, b]: [f64; 2], value: f64) -> Option<f64> {
        match self {
            Self::Smooth => None,
            Self::Value => Some(value),
            Self::Quotient => Some(((a - value) / b).round()),
        }
    }
}

/// Stacks up to here need no allocation.
const SHALLOW: usize = 32;

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
    Unary(Unary, Outcome),
    Binary(Binary, Outcome),
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

impl Program {
    pub fn push(&mut self, step: Step) {
        let operands = match step {
            Step::Number(_) | Step::Variable(_) | Step::Jump(_) => 0,
            Step::Negate | Step::Unary(..) | Step::Unless(_) => 1,
            _ => 2,
        };
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
        } else {
            self.steps.push(step);
        }
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

    /// Whether `is_wanted` for a variable that occurs.
    pub fn has_variable(&self, is_wanted: impl Fn(usize) -> bool) -> bool {
        self.steps.iter().any(|step| matches!(step, Step::Variable(k) if is_wanted(*k)))
    }

    /// Whether a step can make the value discontinuous.
    pub fn is_piecewise(&self) -> bool {
        self.steps.iter().any(|step| match step {
            Step::Unless(_) => true,
            Step::Unary(_, outcome) | Step::Binary(_, outcome) => *outcome != Outcome::Smooth,
            _ => false,
        })
    }

    pub fn run(&self, variables: &[f64; 4]) -> f64 {
        if self.most <= SHALLOW {
            run(&self.steps, variables, &mut [0.0; SHALLOW], unwatched)
        } else {
            run(&self.steps, variables, &mut vec![0.0; self.most], unwatched)
        }
    }

    /// The value, and a number for the outcomes on the way to it: branches taken, comparisons, steps, integer parts.
    pub fn trace(&self, variables: &[f64; 4]) -> (f64, u64) {
        let mut piece = 0;
        let watch = |outcome: Outcome, operands, value| {
            if let Some(number) = outcome.number(operands, value) {
                piece = chained(piece, number);
            }
        };
        let value = if self.most <= SHALLOW {
            run(&self.steps, variables, &mut [0.0; SHALLOW], watch)
        } else {
            run(&self.steps, variables, &mut vec![0.0; self.most], watch)
        };
        (value, piece)
    }
}

/// A number for what `piece` stands for, and `outcome` after it: FNV-1a over words, then SplitMix64's finalizer.
fn chained(piece: u64, outcome: f64) -> u64 {
    // One zero, and one NaN.
    let bits = if outcome.is_nan() { u64::MAX } else { (outcome + 0.0).to_bits() };
    let mut z = (piece ^ bits).wrapping_mul(0x0100_0000_01b3).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

const fn unwatched(_: Outcome, _: [f64; 2], _: f64) {}

/// The topmost value is kept apart from those `below` it. `watch` is told what can be discontinuous, its operands and
/// its value.
fn run(steps: &[Step], variables: &[f64; 4], below: &mut [f64], mut watch: impl FnMut(Outcome, [f64; 2], f64)) -> f64 {
    let (mut top, mut height, mut at) = (0.0, 0, 0);
    while let Some(&step) = steps.get(at) {
        at += 1;
        match step {
            Step::Number(value) => (below[height], top, height) = (top, value, height + 1),
            Step::Variable(k) => (below[height], top, height) = (top, variables[k], height + 1),
            Step::Negate => top = -top,
            Step::Unary(f, outcome) => {
                let value = f(top);
                watch(outcome, [top, 0.0], value);
                top = value;
            }
            Step::Jump(place) => at = place,
            Step::Unless(place) => {
                watch(Outcome::Value, [top, 0.0], f64::from(top != 0.0));
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
            Step::Binary(f, outcome) => {
                let operands = [below[height - 1], top];
                (top, height) = (f(operands[0], operands[1]), height - 1);
                watch(outcome, operands, top);
            }
        }
    }
    top
}
