//! A function of radius that a scene states for a body: a number with its unit, or an expression.

use crate::error::{Error, Result};
use crate::field::Expression;
use crate::input::constants::Constants;
use crate::scene::{Conversion, Term};
use sph_formats::UnitDimension;

/// An expression in the distance from the center (r) or from the axis (R), in the units of the input.
pub(crate) struct Formula {
    key: String,
    expression: Expression,
    /// The input's units per one of the expression's: of length and of the value.
    length: f64,
    unit: f64,
}

impl Formula {
    /// # Errors
    /// A text that is no expression in it, nor a number with a unit of `dimension`.
    pub fn new(
        (key, term): (String, &Term),
        dimension: UnitDimension,
        (constants, conversion): (&Constants, &Conversion),
    ) -> Result<Self> {
        let text = match term {
            Term::Number(number) => format!("{number:e}"),
            Term::Text(text) => constants.number(&key, text, dimension)?,
        };
        let expression = constants.expression::<1>(&key, &text, &["R"])?;
        let (length, unit) = (conversion.factor(UnitDimension::LENGTH), conversion.factor(dimension));
        Ok(Self { key, expression, length, unit })
    }

    pub fn at(&self, radius: f64) -> f64 {
        let r = radius / self.length;
        self.unit * self.expression.evaluate_with(&[r, 0.0, 0.0, r, r])
    }

    /// Tries it at radii between two.
    ///
    /// # Errors
    /// A value that is not positive.
    pub fn check(&self, [inner, outer]: [f64; 2]) -> Result<()> {
        let tries = 512;
        for i in 0..=tries {
            let r = inner + (outer - inner) * f64::from(i) / f64::from(tries);
            let value = self.at(r);
            let is_pole = r == 0.0 && !value.is_finite();
            if !(is_pole || value > 0.0 && value.is_finite()) {
                let problem = format!(
                    "is {} at a radius of {}, expected a positive number everywhere in the body",
                    value / self.unit,
                    r / self.length
                );
                return Err(Error::scene(&self.key, problem));
            }
        }
        Ok(())
    }
}
