//! The common input of all builders of sources, and the checks that they share.

use super::categorical::carried_field;
use super::check::check_density;
use super::mass::check_mass;
use super::sampled::{SampledCarried, SampledDensity, Sampler};
use super::{CarriedField, CarriedInfo, FieldOptions, ScalarField, Source};
use crate::error::{Error, Result};
use sph::domain::Domain;
use sph_formats::{Location, Variable};
use std::sync::Arc;

/// The numbers of a file, less their geometry.
pub(crate) struct Input<'a, const D: usize> {
    pub(crate) density: Variable,
    pub(crate) others: Vec<Variable>,
    pub(crate) options: &'a FieldOptions<D>,
    pub(crate) notes: Vec<String>,
}

impl<const D: usize> Input<'_, D> {
    /// Refuses values that are no density and notes missing ones; `place` names the position of a value.
    pub(crate) fn check(&mut self, place: &dyn Fn(usize) -> String) -> Result<()> {
        let name = &self.density.name;
        let (_, replaced) = check_density(name, &mut self.density.values, self.options.missing, place)?;
        if replaced > 0 {
            self.notes.push(format!("{replaced} missing values of '{name}' were set to 0"));
        }
        Ok(())
    }

    /// The source. Density and variables at its location share `sampler`; `other` makes the sampler of another location.
    ///
    /// # Errors
    /// A mass that is not positive or not finite, and the errors of `other`.
    pub(crate) fn finish<S: Sampler<D> + 'static>(
        self,
        sampler: Arc<S>,
        domain: Domain<D>,
        other: &dyn Fn(Location) -> Result<Arc<dyn Sampler<D>>>,
    ) -> Result<Source<D>> {
        self.finish_as(sampler, domain, other, &|density| Box::new(density))
    }

    /// [`Self::finish`] with a density that is made from the sampled one.
    ///
    /// # Errors
    /// Those of [`Self::finish`].
    pub(crate) fn finish_as<S: Sampler<D> + 'static>(
        mut self,
        sampler: Arc<S>,
        domain: Domain<D>,
        other: &dyn Fn(Location) -> Result<Arc<dyn Sampler<D>>>,
        made: &dyn Fn(SampledDensity<S>) -> Box<dyn ScalarField<D>>,
    ) -> Result<Source<D>> {
        let carried = self.carried(&(Arc::clone(&sampler) as Arc<dyn Sampler<D>>), other)?;
        let name = self.density.name;
        let density = made(SampledDensity { sampler, values: self.density.values });
        let mass = density.integral(&domain).map(|m| check_mass(&name, m)).transpose()?;
        Ok(Source { density, carried, domain, mass, radial: None, notes: self.notes })
    }

    fn carried(
        &mut self,
        sampler: &Arc<dyn Sampler<D>>,
        other: &dyn Fn(Location) -> Result<Arc<dyn Sampler<D>>>,
    ) -> Result<Vec<Box<dyn CarriedField<D>>>> {
        let mut carried = Vec::new();
        for variable in std::mem::take(&mut self.others) {
            let here = variable.location == self.density.location;
            let sampler = if here { Arc::clone(sampler) } else { other(variable.location)? };
            let sampler = sampler.of_carried().unwrap_or(sampler);
            carried.push(carried_field(variable, &|variable| {
                let components = if variable.components > 1 { D } else { 1 };
                Ok(Box::new(SampledCarried {
                    sampler: Arc::clone(&sampler),
                    stride: variable.components,
                    info: CarriedInfo { name: variable.name, unit: variable.unit, components },
                    values: variable.values,
                }))
            })?);
        }
        Ok(carried)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Repeats {
    Allowed,
    Refused,
}

pub(crate) fn check_ascending(name: &str, what: &str, values: &[f64], repeats: Repeats) -> Result<()> {
    if let Some(i) = values.iter().position(|v| !v.is_finite()) {
        return Err(Error::field(name, format!("{what} is {} at node {i}; it must be finite", values[i])));
    }
    let falls = |w: &[f64]| w[1] < w[0] || repeats == Repeats::Refused && w[1] == w[0];
    if let Some(i) = values.windows(2).position(falls) {
        return Err(Error::field(
            name,
            format!(
                "{what} goes from {} at node {i} to {} at the next; it must ascend: sort the file",
                values[i],
                values[i + 1]
            ),
        ));
    }
    match (values.first(), values.last()) {
        (Some(a), Some(b)) if b > a || values.len() == 1 => Ok(()),
        _ => Err(Error::field(name, format!("{what} has {} node(s) and no extent", values.len()))),
    }
}
