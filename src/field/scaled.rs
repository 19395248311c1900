//! Change of units by linear factors, without copying data.

use super::{CarriedField, CarriedInfo, Enclosure, MassEstimate, Patch, RadialSource, ScalarField, Source, Trace};
use sph::domain::Domain;
use std::sync::Arc;

impl<const D: usize> Source<D> {
    /// The same source with coordinates multiplied by `length` and densities by `density` (both positive and
    /// finite). Carried values are left as they are.
    #[must_use]
    pub fn scaled(self, length: f64, density: f64) -> Self {
        if length == 1.0 && density == 1.0 {
            return self;
        }
        let mass = density * length.powi(D as i32);
        Self {
            density: Box::new(ScaledField {
                inner: self.density,
                coordinates: Coordinates::Times(length),
                value: density,
            }),
            carried: self
                .carried
                .into_iter()
                .map(|inner| Box::new(ScaledCarried { inner, length }) as Box<dyn CarriedField<D>>)
                .collect(),
            domain: self.domain.scaled(length),
            mass: self.mass.map(|m| MassEstimate { value: m.value * mass, error: m.error * mass }),
            radial: self.radial.map(|r| RadialSource {
                profile: Arc::new(r.profile.scaled(length, density)),
                center: r.center.map(|c| c * length),
            }),
            notes: self.notes,
        }
    }
}

/// How coordinates follow from those of the inner field. A factor and its inverse round differently, and each use has one
/// of the two at hand.
#[derive(Debug, Clone, Copy)]
enum Coordinates {
    Times(f64),
    Over(f64),
}

impl Coordinates {
    fn to_inner<const D: usize>(self, x: &[f64; D]) -> [f64; D] {
        match self {
            Self::Times(length) => sph::array(|k| x[k] / length),
            Self::Over(length) => sph::array(|k| x[k] * length),
        }
    }

    /// Of the outer coordinates over that of the inner ones.
    fn volume<const D: usize>(self) -> f64 {
        match self {
            Self::Times(length) => length.powi(D as i32),
            Self::Over(length) => length.powi(-(D as i32)),
        }
    }

    fn to_outer<const D: usize>(self, x: &[f64; D]) -> [f64; D] {
        match self {
            Self::Times(length) => sph::array(|k| x[k] * length),
            Self::Over(length) => sph::array(|k| x[k] / length),
        }
    }
}

/// `field` as a function of coordinates in units of `length`; its values are left as they are, in any unit. It is
/// integrated by cubature.
pub(crate) fn in_units_of<const D: usize>(length: f64, field: Box<dyn ScalarField<D>>) -> Box<dyn ScalarField<D>> {
    Box::new(ScaledField { inner: field, coordinates: Coordinates::Over(length), value: 1.0 })
}

struct ScaledField<const D: usize> {
    inner: Box<dyn ScalarField<D>>,
    coordinates: Coordinates,
    /// Factor on values.
    value: f64,
}

impl<const D: usize> ScalarField<D> for ScaledField<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.value * self.inner.value(&self.coordinates.to_inner(x))
    }

    fn log_slope(&self, x: &[f64; D]) -> Option<[f64; D]> {
        // Lengths of the slope are inverse ones.
        let slope = self.inner.log_slope(&self.coordinates.to_inner(x))?;
        Some(self.coordinates.to_inner(&slope))
    }

    fn piece(&self, x: &[f64; D]) -> u64 {
        self.inner.piece(&self.coordinates.to_inner(x))
    }

    fn value_and_piece(&self, x: &[f64; D]) -> (f64, u64) {
        let (value, piece) = self.inner.value_and_piece(&self.coordinates.to_inner(x));
        (self.value * value, piece)
    }

    fn is_piecewise(&self) -> bool {
        self.inner.is_piecewise()
    }

    fn keeps_apart(&self, a: u64, b: u64) -> bool {
        self.inner.keeps_apart(a, b)
    }

    fn trace(&self, x: &[f64; D]) -> Trace {
        self.inner.trace(&self.coordinates.to_inner(x))
    }

    fn has_parts(&self) -> bool {
        self.inner.has_parts()
    }

    fn center(&self) -> Option<[f64; D]> {
        self.inner.center().map(|c| self.coordinates.to_outer(&c))
    }

    fn enclosure(&self, patch: &Patch<D>) -> Option<Enclosure> {
        let inner = |x: &[f64; D]| self.coordinates.to_inner(x);
        let distance = patch.distance.map(|(center, ends)| {
            let [a, b] = ends.map(|r| self.coordinates.to_inner(&[r; D])[0]);
            (inner(&center), [a, b])
        });
        let (lo, hi, middle) = (inner(&patch.lo), inner(&patch.hi), inner(&patch.middle));
        Some(self.inner.enclosure(&Patch { lo, hi, middle, distance })?.times([self.value; 2]))
    }

    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        let Coordinates::Times(length) = self.coordinates else { return None };
        let m = self.inner.integral(&domain.scaled(1.0 / length))?;
        let factor = self.value * length.powi(D as i32);
        Some(MassEstimate { value: m.value * factor, error: m.error * factor })
    }

    fn integral_of_box(&self, lo: &[f64; D], hi: &[f64; D], has: &dyn Fn(u64) -> bool) -> Option<f64> {
        let (lo, hi) = (self.coordinates.to_inner(lo), self.coordinates.to_inner(hi));
        Some(self.value * self.coordinates.volume::<D>() * self.inner.integral_of_box(&lo, &hi, has)?)
    }

    fn piece_integrals(&self, domain: &Domain<D>) -> Option<Vec<(u64, MassEstimate)>> {
        let Coordinates::Times(length) = self.coordinates else { return None };
        let pieces = self.inner.piece_integrals(&domain.scaled(1.0 / length))?;
        let factor = self.value * length.powi(D as i32);
        let scaled = |m: MassEstimate| MassEstimate { value: m.value * factor, error: m.error * factor };
        Some(pieces.into_iter().map(|(piece, m)| (piece, scaled(m))).collect())
    }
}

struct ScaledCarried<const D: usize> {
    inner: Box<dyn CarriedField<D>>,
    length: f64,
}

impl<const D: usize> CarriedField<D> for ScaledCarried<D> {
    fn info(&self) -> &CarriedInfo {
        self.inner.info()
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        self.inner.evaluate(&sph::array(|k| x[k] / self.length), out);
    }
}
