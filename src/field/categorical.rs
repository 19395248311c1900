//! Categorical variables, such as material numbers. Between two points of the input a particle receives the category of larger weight, not an
//! intermediate number.
//!
//! Every sampler is a weighted sum of the input's values. Sampling a variable that is 1 where the input is of a kind and
//! 0 elsewhere therefore gives that kind's weight.

use super::{CarriedField, CarriedInfo};
use crate::error::Result;
use sph_formats::common::particle_names as names;
use sph_formats::{Values, Variable};

/// A variable with more values than this does not name kinds.
pub(super) const MAX_KINDS: usize = 32;

struct Categorical<const D: usize> {
    info: CarriedInfo,
    /// Each kind and its weight, in ascending order of kinds.
    kinds: Vec<(f64, Box<dyn CarriedField<D>>)>,
}

/// Makes the field of one variable from its values.
pub(crate) type Make<'a, const D: usize> = dyn Fn(Variable) -> Result<Box<dyn CarriedField<D>>> + 'a;

/// The field of a variable as `make` makes it or, where it names kinds, of its kinds.
///
/// # Errors
/// Those of `make`.
pub(crate) fn carried_field<const D: usize>(
    variable: Variable,
    make: &Make<'_, D>,
) -> Result<Box<dyn CarriedField<D>>> {
    match kinds(&variable) {
        Some(found) => categorical(&variable, found, make),
        None => make(variable),
    }
}

/// The kinds that a variable names, in ascending order; `None` where it names none, too many, or numbers that are not
/// whole.
pub(super) fn kinds(variable: &Variable) -> Option<Vec<f64>> {
    if variable.components != 1 || names::standard(&variable.name) != Some(names::MATERIAL_IDS) {
        return None;
    }
    let mut found: Vec<f64> = Vec::new();
    for i in 0..variable.values.len() {
        let v = variable.values.get(i);
        if v.is_nan() || found.contains(&v) {
            continue;
        }
        if v.fract() != 0.0 || found.len() == MAX_KINDS {
            return None;
        }
        found.push(v);
    }
    found.sort_by(f64::total_cmp);
    Some(found)
}

fn categorical<const D: usize>(
    variable: &Variable,
    found: Vec<f64>,
    make: &Make<'_, D>,
) -> Result<Box<dyn CarriedField<D>>> {
    let mut kinds = Vec::with_capacity(found.len());
    for kind in found {
        let is = |i: usize| if variable.values.get(i) == kind { 1.0 } else { 0.0 };
        let weight = Variable {
            name: variable.name.clone(),
            description: None,
            unit: None,
            location: variable.location,
            components: 1,
            values: Values::F32((0..variable.values.len()).map(is).collect()),
        };
        kinds.push((kind, make(weight)?));
    }
    let info = CarriedInfo { name: variable.name.clone(), unit: None, components: 1 };
    Ok(Box::new(Categorical { info, kinds }))
}

impl<const D: usize> CarriedField<D> for Categorical<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let mut best = (f64::NEG_INFINITY, 0.0);
        for (kind, weight) in &self.kinds {
            let mut w = [0.0];
            weight.evaluate(x, &mut w);
            if w[0] > best.0 {
                best = (w[0], *kind);
            }
        }
        out[0] = best.1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph_formats::Location;

    /// Linear interpolation between the values at 0, 1, 2 ...
    struct Line(CarriedInfo, Values);

    impl CarriedField<1> for Line {
        fn info(&self) -> &CarriedInfo {
            &self.0
        }

        fn evaluate(&self, x: &[f64; 1], out: &mut [f64]) {
            let i = (x[0] as usize).min(self.1.len() - 2);
            let t = x[0] - i as f64;
            out[0] = (1.0 - t) * self.1.get(i) + t * self.1.get(i + 1);
        }
    }

    fn line(v: Variable) -> Result<Box<dyn CarriedField<1>>> {
        Ok(Box::new(Line(CarriedInfo { name: v.name, unit: None, components: 1 }, v.values)))
    }

    fn variable(values: Vec<f64>) -> Variable {
        Variable {
            name: "material".into(),
            description: None,
            unit: None,
            location: Location::Node,
            components: 1,
            values: Values::F64(values),
        }
    }

    #[test]
    fn no_kind_between_two_kinds_is_made() {
        // Half-way from 400 to 402 lies 401, which is another material.
        let v = variable(vec![402.0, 402.0, 400.0, 401.0]);
        let field = carried_field(v, &line).unwrap();
        let at = |x: f64| {
            let mut out = [0.0];
            field.evaluate(&[x], &mut out);
            out[0]
        };
        assert_eq!([0.5, 1.45, 1.55, 2.4, 2.6, 3.0].map(at), [402.0, 402.0, 400.0, 400.0, 401.0, 401.0]);
    }

    #[test]
    fn fractions_are_no_kinds() {
        assert!(kinds(&variable(vec![1.0, 1.5])).is_none());
        assert!(kinds(&variable((0..40).map(f64::from).collect())).is_none());
    }
}
