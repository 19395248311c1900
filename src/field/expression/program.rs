//! An expression as steps over a stack of values.

pub(super) type Unary = fn(f64) -> f64;
pub(super) type Binary = fn(f64, f64) -> f64;

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
    Unary(Unary),
    Binary(Binary),
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
            Step::Negate | Step::Unary(_) | Step::Unless(_) => 1,
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
            let value = run(&self.steps[first..], &[0.0; 4], &mut [0.0; 2]);
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

    pub fn run(&self, variables: &[f64; 4]) -> f64 {
        if self.most <= SHALLOW {
            run(&self.steps, variables, &mut [0.0; SHALLOW])
        } else {
            run(&self.steps, variables, &mut vec![0.0; self.most])
        }
    }
}

/// The topmost value is kept apart from those `below` it.
fn run(steps: &[Step], variables: &[f64; 4], below: &mut [f64]) -> f64 {
    let (mut top, mut height, mut at) = (0.0, 0, 0);
    while let Some(&step) = steps.get(at) {
        at += 1;
        match step {
            Step::Number(value) => (below[height], top, height) = (top, value, height + 1),
            Step::Variable(k) => (below[height], top, height) = (top, variables[k], height + 1),
            Step::Negate => top = -top,
            Step::Unary(f) => top = f(top),
            Step::Jump(place) => at = place,
            Step::Unless(place) => {
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
            Step::Binary(f) => (top, height) = (f(below[height - 1], top), height - 1),
        }
    }
    top
}
