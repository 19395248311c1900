//! Scene keys for surfaces as inputs.

use crate::error::{Error, Result};
use crate::scene::{DomainInput, Scene};
use sph_formats::{Geometry, RawField, Unit, UnitDimension};

/// The density within a surface that is stated as a number with its unit: both.
pub(crate) fn density_within(scene: &Scene, field: Option<&RawField>) -> Option<(String, Option<Unit>)> {
    field.filter(|field| matches!(field.geometry, Geometry::Surface { .. }))?;
    let (number, unit) = scene.input.density.as_deref()?.trim().split_once(char::is_whitespace)?;
    let unit = Unit::parse(unit.trim()).filter(|u| u.dimension == UnitDimension::mass_density(3))?;
    number.parse::<f64>().is_ok().then(|| (number.to_owned(), Some(unit)))
}

/// A surface is a domain of its own.
pub(crate) fn refuse_domain_of_a_surface(domain: &DomainInput) -> Result<()> {
    if domain.has_extent() {
        let problem = "is given beside a surface, which is a domain itself; leave it out, or give the surface as `domain.surface`";
        return Err(Error::scene("domain", problem));
    }
    Ok(())
}

/// What is not a surface is not scaled or turned.
pub(crate) fn refuse_orientation(scene: &Scene, field: &RawField) -> Result<()> {
    let is_turned = !(scene.input.scale.is_empty() && scene.input.rotate.is_empty());
    if is_turned && !matches!(field.geometry, Geometry::Surface { .. }) {
        let problem = format!("is of a surface, but the input is a {}; leave it out", field.geometry.kind());
        return Err(Error::scene(if scene.input.scale.is_empty() { "input.rotate" } else { "input.scale" }, problem));
    }
    Ok(())
}
