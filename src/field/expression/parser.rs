//! The grammar.

use super::functions::{Function, constant, infix};
use super::program::{Program, Step};

/// Nesting beyond this is refused, not recursed into.
const MAX_DEPTH: usize = 64;

pub(super) const VARIABLES: [&str; 4] = ["x", "y", "z", "r"];
/// The place of r.
pub(super) const RADIUS: usize = 3;

/// Byte position and what is wrong there.
pub(super) type Failure = (usize, String);
type Parsed = std::result::Result<(), Failure>;

/// What a name stands for that is none of the coordinates: its number, or why it has none here.
pub(crate) type Constants<'a> = &'a dyn Fn(&str) -> Option<std::result::Result<f64, String>>;

/// What names there are.
#[derive(Clone, Copy)]
pub(crate) struct Names<'a> {
    /// How many of x, y and z there are.
    pub dimension: usize,
    /// Variables whose values follow those of x, y, z and r.
    pub others: &'a [&'a str],
    pub constants: Constants<'a>,
}

/// The steps of `text`, in which the first `dimension` of x, y, z, and r and the others may occur.
pub(super) fn parse(text: &str, names: Names<'_>) -> std::result::Result<Program, Failure> {
    let mut parser = Parser { text, at: 0, depth: 0, names, program: Program::default() };
    parser.comparison()?;
    match parser.peek() {
        None => Ok(parser.program),
        Some(c) => Err((parser.at, format!("unexpected '{c}' after the end of the expression{}", logic(Some(c))))),
    }
}

/// How conditions are combined, for those who write it as in C.
fn logic(found: Option<char>) -> &'static str {
    match found {
        Some('&' | '|') => {
            ": conditions are 1 or 0, and both of two hold where (x < 1)*(y < 2) is 1, either of them where max(x < 1, y < 2) is"
        }
        _ => "",
    }
}

/// Recursive descent; every rule appends the steps of what it has read.
struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    names: Names<'a>,
    program: Program,
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

    fn expect(&mut self, symbol: &'static str) -> Parsed {
        if self.accept(&[symbol]).is_some() {
            return Ok(());
        }
        let next = self.peek();
        let found = next.map_or("the end".to_owned(), |c| format!("'{c}'"));
        Err((self.at, format!("found {found}, expected '{symbol}'{}", logic(next))))
    }

    fn comparison(&mut self) -> Parsed {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err((self.at, format!("nested more than {MAX_DEPTH} deep")));
        }
        self.sum()?;
        if let Some(symbol) = self.accept(&["<=", ">=", "==", "!=", "<", ">"]) {
            self.sum()?;
            self.program.push(infix(symbol));
        }
        self.depth -= 1;
        Ok(())
    }

    fn sum(&mut self) -> Parsed {
        self.product()?;
        while let Some(symbol) = self.accept(&["+", "-"]) {
            self.product()?;
            self.program.push(infix(symbol));
        }
        Ok(())
    }

    fn product(&mut self) -> Parsed {
        self.signed()?;
        loop {
            self.peek();
            if self.text[self.at..].starts_with("**") {
                return Ok(());
            }
            let Some(symbol) = self.accept(&["*", "/"]) else {
                return Ok(());
            };
            self.signed()?;
            self.program.push(infix(symbol));
        }
    }

    fn signed(&mut self) -> Parsed {
        let mut negative = false;
        while let Some(sign) = self.accept(&["-", "+"]) {
            negative ^= sign == "-";
        }
        self.power()?;
        if negative {
            self.program.push(Step::Negate);
        }
        Ok(())
    }

    fn power(&mut self) -> Parsed {
        self.primary()?;
        let Some(symbol) = self.accept(&["^", "**"]) else {
            return Ok(());
        };
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err((self.at, format!("nested more than {MAX_DEPTH} deep")));
        }
        self.signed()?;
        self.depth -= 1;
        self.program.push(infix(symbol));
        Ok(())
    }

    fn primary(&mut self) -> Parsed {
        match self.peek() {
            None => Err((self.at, "the expression ends where a value is expected".into())),
            Some('(') => {
                self.at += 1;
                self.comparison()?;
                self.expect(")")
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
                self.program.push(Step::Number(v));
                Ok(())
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
        if let Some(value) = constant(name) {
            self.program.push(Step::Number(value));
            return Ok(());
        }
        let dimension = self.names.dimension;
        let step = match VARIABLES.iter().position(|v| *v == name) {
            Some(k) if k == RADIUS || k < dimension => Step::Variable(k),
            Some(_) => return Err((start, format!("'{name}' does not exist in {dimension} dimension(s)"))),
            None => match self.names.others.iter().position(|v| *v == name) {
                Some(k) => Step::Variable(VARIABLES.len() + k),
                None => Step::Number(self.other_constant(name, start)?),
            },
        };
        self.program.push(step);
        Ok(())
    }

    fn other_constant(&self, name: &str, start: usize) -> std::result::Result<f64, Failure> {
        match (self.names.constants)(name) {
            Some(value) => value.map_err(|problem| (start, problem)),
            None => {
                let coordinates = VARIABLES[..self.names.dimension].iter().chain(&VARIABLES[RADIUS..]);
                let known: Vec<&str> = coordinates.chain(self.names.others).copied().collect();
                let known = known.join(", ");
                Err((start, format!("unknown name '{name}'; known are {known}, pi, tau, e and functions")))
            }
        }
    }

    fn call(&mut self, name: &str, start: usize) -> Parsed {
        let function = Function::named(name);
        self.expect("(")?;
        // Places of the jumps of an `if`.
        let (mut unless, mut jump) = (0, 0);
        let mut count = 0;
        loop {
            self.comparison()?;
            count += 1;
            match (function, count) {
                (Some(Function::Unary(f, outcome, course)), 1) => self.program.push(Step::Unary(f, outcome, course)),
                // More than two arguments are taken from the left.
                (Some(Function::Binary(f, outcome)), 2..) => self.program.push(Step::Binary(f, outcome)),
                (Some(Function::Power), 2) => self.program.push(Step::Power),
                (Some(Function::If), 1) => unless = self.program.unless(),
                (Some(Function::If), 2) => jump = self.program.otherwise(unless),
                (Some(Function::If), 3) => self.program.end(jump),
                _ => {}
            }
            if self.accept(&[","]).is_none() {
                break;
            }
        }
        self.expect(")")?;
        let expected = match function {
            None => {
                let known = Function::names().join(", ");
                return Err((start, format!("unknown function '{name}'; known are {known}")));
            }
            Some(Function::Unary(..)) if count != 1 => "one argument",
            Some(Function::Binary(..)) if count < 2 && takes_many(name) => "two arguments or more",
            Some(Function::Binary(..)) if count != 2 && !takes_many(name) => "two arguments",
            Some(Function::Power) if count != 2 => "two arguments",
            Some(Function::If) if count != 3 => "three arguments",
            _ => return Ok(()),
        };
        Err((start, format!("'{name}' takes {expected}, found {count} argument(s)")))
    }
}

fn takes_many(name: &str) -> bool {
    matches!(name, "min" | "max")
}
