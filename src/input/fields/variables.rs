//! The variables of a scene's own fields: expressions, files and the positions at which they are evaluated.

use crate::field::{CarriedField, CarriedInfo, Expression, ScalarField};
use crate::input::differences;
use crate::input::turbulence::Turbulence;
use crate::input::way::Way;
use std::sync::Arc;

/// Variables of every expression beside x, y, z and r.
pub(super) const PLACES: [&str; 4] = ["R", "phi", "theta", "rho"];
const RHO: usize = 3;
/// Values of x, y, z and r come before those of the others.
const COORDINATES: usize = 4;

/// What coordinates and the density are, in the input's units.
pub(super) struct Base<const D: usize> {
    /// The scene's units per one of the input's.
    pub length: f64,
    pub density_unit: f64,
    pub density: Arc<dyn ScalarField<D>>,
    pub center: [f64; D],
    pub axis: [f64; 3],
    pub step: f64,
}

/// What has a value at each place.
#[derive(Clone)]
pub(super) enum Term<const D: usize> {
    /// With the places of the scalars that come before it.
    Expression(Expression, Vec<usize>),
    /// One component of what a file has, in the scene's units.
    File(Arc<dyn CarriedField<D>>, usize),
}

/// All that expressions can refer to.
pub(super) struct Variables<const D: usize> {
    pub base: Base<D>,
    /// First axis of the azimuth, and the second.
    pub across: [[f64; 3]; 2],
    /// By place; the first are none.
    pub scalars: Vec<Scalar<D>>,
}

pub(super) enum Scalar<const D: usize> {
    Place,
    /// Times a factor.
    File(Arc<dyn CarriedField<D>>, f64),
    Stated(Expression),
}

/// Turbulence, and its root mean square in the scene's units.
pub(super) type Stirred<const D: usize> = (Turbulence<D>, f64);

/// How components come from terms.
pub(super) enum Rule<const D: usize> {
    Each(Vec<Term<D>>),
    Velocity(Vec<(Way, Term<D>)>, Option<Stirred<D>>),
    Curl(Vec<Term<D>>),
}

pub(super) struct StatedField<const D: usize> {
    /// As in the scene.
    pub key: String,
    pub info: CarriedInfo,
    pub variables: Arc<Variables<D>>,
    pub rule: Rule<D>,
}

impl<const D: usize> Variables<D> {
    /// Values of x, y, z, r, then of the places, as far as `needs` says beyond the first.
    fn at(&self, x: &[f64; D], needs: &[usize]) -> Vec<f64> {
        let mut values = vec![0.0; COORDINATES + self.scalars.len()];
        let d = self.offset(x);
        let [along, first, second] = self.components(d);
        let radius = d.iter().map(|v| v * v).sum::<f64>().sqrt();
        let distance = first.hypot(second);
        let length = self.base.length;
        (0..D).for_each(|k| values[k] = length * x[k]);
        values[COORDINATES - 1] = length * radius;
        values[COORDINATES..COORDINATES + RHO].copy_from_slice(&[
            length * if D == 1 { radius } else { distance },
            second.atan2(first),
            distance.atan2(along),
        ]);
        values[COORDINATES + RHO] = self.base.density_unit * self.base.density.value(x);
        for &place in needs {
            values[COORDINATES + place] = match &self.scalars[place] {
                Scalar::Place => values[COORDINATES + place],
                Scalar::File(field, factor) => {
                    let mut out = [0.0];
                    field.evaluate(x, &mut out);
                    factor * out[0]
                }
                Scalar::Stated(expression) => expression.evaluate_with(&values),
            };
        }
        values
    }

    fn offset(&self, x: &[f64; D]) -> [f64; 3] {
        sph::array(|k| if k < D { x[k] - self.base.center[k] } else { 0.0 })
    }

    /// Along the axis, and along the two directions across it.
    fn components(&self, d: [f64; 3]) -> [f64; 3] {
        [self.base.axis, self.across[0], self.across[1]].map(|way| (0..3).map(|k| way[k] * d[k]).sum())
    }

    /// A vector of length 1, or of none on the axis or in the center.
    fn way(&self, x: &[f64; D], way: Way) -> [f64; 3] {
        let d = self.offset(x);
        let [along, first, second] = self.components(d);
        let distance = first.hypot(second);
        let radius = along.hypot(distance);
        let unit = |parts: [f64; 3], length: f64| -> [f64; 3] {
            let all = [self.base.axis, self.across[0], self.across[1]];
            sph::array(|k| if length > 0.0 { (0..3).map(|j| all[j][k] * parts[j]).sum::<f64>() / length } else { 0.0 })
        };
        match way {
            Way::Axis(axis) => sph::array(|k| f64::from(u8::from(k == axis))),
            Way::Outward => unit([along, first, second], radius),
            Way::FromAxis => unit([0.0, first, second], distance),
            Way::Azimuthal => unit([0.0, -second, first], distance),
            Way::Polar => unit([-distance * distance, along * first, along * second], radius * distance),
        }
    }

    pub fn value(&self, x: &[f64; D], term: &Term<D>) -> f64 {
        match term {
            Term::Expression(expression, needs) => expression.evaluate_with(&self.at(x, needs)),
            Term::File(field, component) => {
                let mut out = [0.0; 3];
                field.evaluate(x, &mut out[..field.info().components]);
                out[*component]
            }
        }
    }

    /// d term / dx_k by central differences of sixth order.
    fn slope(&self, x: &[f64; D], term: &Term<D>, k: usize) -> f64 {
        let at = |h: f64| {
            let mut y = *x;
            y[k] += h;
            self.value(&y, term)
        };
        differences::slope(self.base.step, at) / self.base.length
    }
}

impl<const D: usize> CarriedField<D> for StatedField<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let variables = &self.variables;
        out.fill(0.0);
        match &self.rule {
            // Components beyond the stated ones are 0.
            Rule::Each(terms) => out.iter_mut().zip(terms).for_each(|(v, term)| *v = variables.value(x, term)),
            Rule::Velocity(parts, turbulence) => {
                if let Some((turbulence, speed)) = turbulence {
                    turbulence.add(x, *speed, out);
                }
                for (way, term) in parts {
                    let (value, way) = (variables.value(x, term), variables.way(x, *way));
                    out.iter_mut().zip(way).for_each(|(v, w)| *v += value * w);
                }
            }
            // In 2-D the potential has a component along z alone.
            Rule::Curl(terms) => {
                let slope = |component: usize, k: usize| match terms.len() {
                    1 if component == 2 && k < D => variables.slope(x, &terms[0], k),
                    3 if k < D => variables.slope(x, &terms[component], k),
                    _ => 0.0,
                };
                let curl = [(2, 1, 1, 2), (0, 2, 2, 0), (1, 0, 0, 1)];
                out.iter_mut().zip(curl).for_each(|(v, (a, da, b, db))| *v = slope(a, da) - slope(b, db));
            }
        }
    }
}
