//! Keeps mass where particles have it, where their densities are fitted by a field that does not follow them.
//!
//! A field through densities that jump, or that sums over neighbors have smoothed, has more mass on one side of the jump than the particles there and
//! less on the other. So the mass of the field about each particle, `sum_j w_ij F_j` with the mass `F_j` of the field where particle `j` is the nearest, is
//! compared with that of the particles, `sum_j w_ij M_j`, with the weights `w_ij = (1 - r^2/R_i^2)^3` up to a distance `R_i` of two and a half spacings, and
//! the densities are multiplied by the ratio. Where the two are the same but for the noise of such sums, nothing is changed.

use super::listed::Listed;
use super::outline::share;
use sph::domain::Domain;
use sph::{parallel, reduce};

/// Particles about one whose masses are compared, in one, two and three dimensions: those within two and a half spacings.
const ABOUT: [usize; 3] = [6, 20, 64];
/// Places for each particle at which the field is looked at, at least so many in all, and at most.
const PLACES: usize = 16;
const FEWEST: usize = 20_000;
const MOST: usize = 20_000_000;
/// A difference that noise does not make, of so much of the mass.
const MUCH: f64 = 0.05;
const OF_MASS: f64 = 0.05;
/// The largest factor on a density: more is of another kind.
const LARGEST: f64 = 2.0;

/// The mass of a field where each particle is the nearest, and where its center lies from the particle.
pub(super) struct Lumps<const D: usize> {
    masses: Vec<f64>,
    offsets: Vec<[f64; D]>,
}

impl<const D: usize> Lumps<D> {
    /// Of a field in `domain`: `found` is the density at a place with the nearest particle, none outside. `None` for too many particles.
    pub fn new(
        (particles, domain): (&Listed<D>, &Domain<D>),
        found: impl Fn(&[f64; D]) -> Option<(f64, usize)> + Sync,
    ) -> Option<Self> {
        let count = PLACES * particles.len().max(FEWEST / PLACES);
        if count > MOST {
            return None;
        }
        let extent = domain.extent();
        let place = |i: usize| -> [f64; D] { sph::array(|k| domain.lo[k] + share(i, k, D) * extent[k]) };
        let looked = parallel::map(count, |i| found(&place(i)));
        let volume = extent.iter().product::<f64>() / count as f64;
        let n = particles.len();
        let mut lumps = Self { masses: vec![0.0; n], offsets: vec![[0.0; D]; n] };
        for (i, seen) in looked.into_iter().enumerate() {
            let Some((density, near)) = seen else { continue };
            let (mass, way) = (density * volume, domain.displacement(&particles.points()[near], &place(i)));
            lumps.masses[near] += mass;
            (0..D).for_each(|k| lumps.offsets[near][k] += mass * way[k]);
        }
        for (offset, mass) in lumps.offsets.iter_mut().zip(&lumps.masses).filter(|(_, mass)| **mass > 0.0) {
            offset.iter_mut().for_each(|v| *v /= mass);
        }
        Some(lumps)
    }

    /// Whether the field may be that of particles with these masses: all of it is not far off.
    pub fn are_of(&self, masses: &[f64]) -> bool {
        let [own, of_field]: [f64; 2] = [masses, &self.masses].map(|all| all.iter().sum());
        (1.0 / LARGEST..=LARGEST).contains(&(own / of_field))
    }

    /// Logarithms of the masses of the particles over those of the field about each one, of those for which `is_alike`.
    pub fn lacking(
        &self,
        (particles, domain): (&Listed<D>, &Domain<D>),
        masses: &[f64],
        is_alike: impl Fn(usize, usize) -> bool + Sync,
    ) -> Vec<f64> {
        parallel::map(particles.len(), |i| {
            let x = &particles.points()[i];
            let about = particles.about(i, ABOUT[D - 1].min(particles.len()));
            let reach = about.last().map_or(0.0, |f| f.1);
            let weight = |way: &[f64; D]| {
                let left = 1.0 - way.iter().map(|v| v * v).sum::<f64>() / (reach * reach);
                left.max(0.0).powi(3)
            };
            let (mut own, mut of_field) = (0.0, 0.0);
            for &(j, _) in about.iter().filter(|f| is_alike(i, f.0)) {
                let way = domain.displacement(x, &particles.points()[j]);
                own += masses[j] * weight(&way);
                of_field += self.masses[j] * weight(&sph::array(|k| way[k] + self.offsets[j][k]));
            }
            let factor = own / of_field;
            if factor.is_finite() && factor > 0.0 { factor.clamp(1.0 / LARGEST, LARGEST).ln() } else { 0.0 }
        })
    }
}

/// Whether more of the mass than noise makes lies where the field has another one; `weights` are how much each particle counts.
pub(super) fn is_elsewhere(lacking: &[f64], masses: &[f64], weights: &[f64]) -> bool {
    let n = lacking.len();
    let all = reduce::sum(n, |i| weights[i] * masses[i]);
    let off = reduce::sum(n, |i| if lacking[i].abs() > MUCH { weights[i] * masses[i] } else { 0.0 });
    off > OF_MASS * all
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;
    use sph::domain::{Axis, Region};

    /// Particles of a jump at x = 0.5 from 10 to 1, and fields that have these densities, or others.
    fn lacks<const D: usize>(field: impl Fn(f64) -> f64 + Sync) -> (Vec<f64>, Vec<f64>, Vec<[f64; D]>) {
        let side = [400_usize, 30, 12][D - 1];
        let mut random = Random::new(7);
        let cell = 1.0 / side as f64;
        let points: Vec<[f64; D]> = (0..side.pow(D as u32))
            .map(|i| {
                sph::array(|k| ((i / side.pow(k as u32) % side) as f64 + 0.5 + 0.1 * (random.unit() - 0.5)) * cell)
            })
            .collect();
        let masses: Vec<f64> =
            points.iter().map(|x| if x[0] < 0.5 { 10.0 } else { 1.0 } * cell.powi(D as i32)).collect();
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
        let particles = Listed::new("rho", &points, &domain, 16).unwrap();
        let lumps = Lumps::new((&particles, &domain), |x| Some((field(x[0]), particles.near(x).0))).unwrap();
        (lumps.lacking((&particles, &domain), &masses, |_, _| true), masses, points)
    }

    fn in_dimension<const D: usize>() {
        let (same, masses, points) = lacks::<D>(|x| if x < 0.5 { 10.0 } else { 1.0 });
        // At the jumps it is the cells of heavy particles that reach across.
        let is_away = |x: &[f64; D]| (x[0] - 0.75).abs() < 0.05 || (x[0] - 0.25).abs() < 0.05;
        let away: Vec<f64> = points.iter().map(|x| f64::from(is_away(x))).collect();
        let worst = same.iter().zip(&away).map(|(v, away)| v.abs() * away).fold(0.0, f64::max);
        assert!(worst < MUCH && !is_elsewhere(&same, &masses, &away), "{D}-D: {worst}");
        // A third too much on the light side.
        let (lacking, masses, points) = lacks::<D>(|x| if x < 0.5 { 10.0 } else { 1.333 });
        let heavy: Vec<f64> = points.iter().map(|x| f64::from((x[0] - 0.25).abs() < 0.05)).collect();
        assert!(!is_elsewhere(&lacking, &masses, &heavy), "{D}-D");
        let light: Vec<f64> = points.iter().map(|x| f64::from(x[0] > 0.5)).collect();
        assert!(is_elsewhere(&lacking, &masses, &light), "{D}-D");
        let middle = points.iter().zip(&lacking).filter(|(x, _)| (x[0] - 0.75).abs() < 0.05).map(|(_, v)| *v);
        middle.for_each(|v| assert!((v + 1.333_f64.ln()).abs() < MUCH, "{D}-D: {v}"));
    }

    #[test]
    fn mass_that_a_field_has_elsewhere_is_found_in_every_dimension() {
        in_dimension::<1>();
        in_dimension::<2>();
        in_dimension::<3>();
    }
}
