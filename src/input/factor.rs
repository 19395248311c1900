//! `input.factor`: multiplies the density by a number or by an expression of position.

use crate::error::{Error, Result};
use crate::field::{Enclosure, Patch, ScalarField, Source, in_units_of};
use crate::input::constants::Constants;
use crate::scene::{Conversion, Scene, Term};
use sph_formats::UnitDimension;

/// A density times a field.
struct Product<const D: usize> {
    density: Box<dyn ScalarField<D>>,
    factor: Box<dyn ScalarField<D>>,
}

impl<const D: usize> ScalarField<D> for Product<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        let density = self.density.value(x);
        // Outside of the density the factor need not be a number.
        if density == 0.0 { 0.0 } else { density * self.factor.value(x) }
    }

    fn piece(&self, x: &[f64; D]) -> u64 {
        self.density.piece(x)
    }

    fn is_piecewise(&self) -> bool {
        self.density.is_piecewise()
    }

    fn enclosure(&self, _: &Patch<D>) -> Option<Enclosure> {
        None
    }
}

/// The source with the factor of the scene on its density; `conversion` leads from the scene's numbers to those of the source.
///
/// # Errors
/// An expression that cannot be read, or that is negative or no number somewhere.
pub(crate) fn apply<const D: usize>(scene: &Scene, source: Source<D>, conversion: &Conversion) -> Result<Source<D>> {
    const KEY: &str = "input.factor";
    let text = match &scene.input.factor {
        None => return Ok(source),
        Some(Term::Number(factor)) => {
            let scaled = source.scaled(1.0, *factor);
            return match scaled.mass.is_none_or(|m| m.value.is_finite()) {
                true => Ok(scaled),
                false => Err(Error::scene(KEY, format!("is {factor:e}, with which the mass is beyond f64"))),
            };
        }
        Some(Term::Text(text)) => text,
    };
    let unit = conversion.factor(UnitDimension::LENGTH);
    let own = source.domain.scaled(1.0 / unit);
    let center = source.center().map(|c| c / unit);
    let field = Constants::new(scene, conversion.from).field::<D>((KEY, text), UnitDimension::NONE, center)?;
    field.check(&own).map_err(|error| Error::scene(KEY, format!("is no factor of a density: {error}")))?;
    let field: Box<dyn ScalarField<D>> = Box::new(field);
    let factor = if unit == 1.0 { field } else { in_units_of(1.0 / unit, field) };
    let density = Box::new(Product { density: source.density, factor });
    Ok(Source { density, mass: None, radial: None, ..source })
}
