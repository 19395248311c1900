//! The number density for free particles that are relaxed among held ones: in the space that held particles take it is that of each held particle
//! at its own position and zero elsewhere, and in the rest of the domain it is that of the free particles.

use super::ScalarField;
use super::cloud::Cloud;
use crate::error::Result;
use sph::domain::Domain;

/// Distance over the spacing of a held particle within which a place is its own.
const SAME: f64 = 1e-9;

/// Whether a place is taken, by the particle that is nearest to it.
pub(crate) type Taken<'a, const D: usize> = dyn Fn(&[f64; D], usize) -> bool + Send + Sync + 'a;

/// The number density for particles that are relaxed against those that are held.
pub(crate) struct FreeSpace<'a, const D: usize> {
    cloud: Cloud<D>,
    /// Number densities of the particles of the cloud that are held.
    held: Vec<Option<f64>>,
    /// Number density of the free ones.
    base: &'a (dyn Fn(&[f64; D]) -> f64 + Send + Sync),
    taken: &'a Taken<'a, D>,
}

impl<'a, const D: usize> FreeSpace<'a, D> {
    /// Among `points` of a domain, some of which are `held`, with their number densities.
    ///
    /// # Errors
    /// Points that span no volume.
    pub fn new(
        (points, held): (&[[f64; D]], Vec<Option<f64>>),
        domain: &Domain<D>,
        base: &'a (dyn Fn(&[f64; D]) -> f64 + Send + Sync),
        taken: &'a Taken<'a, D>,
    ) -> Result<Self> {
        Ok(Self { cloud: Cloud::new("Coordinates", points, Some(domain))?, held, base, taken })
    }

    /// The nearest particle of the cloud, and its distance.
    pub fn nearest(&self, x: &[f64; D]) -> (usize, f64) {
        self.cloud.near(x)
    }

    /// Distance to the nearest particle of the cloud.
    pub fn distance(&self, x: &[f64; D]) -> f64 {
        self.nearest(x).1
    }
}

impl<const D: usize> ScalarField<D> for FreeSpace<'_, D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        let (nearest, distance) = self.cloud.near(x);
        match self.held[nearest] {
            Some(own) if distance.powi(D as i32) * own <= SAME.powi(D as i32) => own,
            _ if (self.taken)(x, nearest) => 0.0,
            _ => (self.base)(x),
        }
    }
}
