//! Collisionless particles of a file as a source of gravity: the spherical average of their mass around their densest point.
//!
//! The center is found by spheres that shrink about the center of mass within them (Power et al. 2003, MNRAS 338, 14, section 2.5). Shells of equal numbers of particles
//! have the density of what they hold, so that the mass within a radius is known to its Poisson noise, 1/sqrt(n) for n particles within.

use crate::error::{Error, Result};
use crate::field::RadialProfile;
use sph::geometry::{distance, unit_ball_volume};
use sph_formats::ParticleFile;
use sph_formats::common::particle_names as names;

/// Radius of a sphere over that of the one before, and particles in the last.
const SHRINKS: f64 = 0.9;
const FEWEST: usize = 100;
/// Shells, at least and at most; between them the square root of the number of particles.
const SHELLS: [usize; 2] = [8, 400];
/// Particles that are a body and not some points.
const ENOUGH: usize = 64;

/// A sphere of particles, in the units of their file.
pub(super) struct Halo {
    pub profile: RadialProfile,
    pub mass: f64,
    pub count: usize,
}

/// Whether a particle file has particles, but none that are gas.
pub(super) fn is_without_gas(file: &ParticleFile) -> bool {
    let has = |gas: bool| file.species.iter().any(|s| (s.part_type == 0) == gas && s.table.count > 0);
    has(false) && !has(true)
}

impl Halo {
    /// All particles of a file in three dimensions.
    ///
    /// # Errors
    /// Too few, or particles without places or masses that are such.
    pub(super) fn of(name: &str, file: &ParticleFile) -> Result<Self> {
        let wrong = |problem: String| Error::field(name, problem);
        if file.header.dimension != 3 {
            return Err(wrong(format!("is in {}-D, expected 3-D: it attracts a body there", file.header.dimension)));
        }
        let mut points: Vec<([f64; 3], f64)> = Vec::new();
        for table in file.species.iter().map(|s| &s.table).filter(|table| table.count > 0) {
            let missing = |name: &str| wrong(format!("has particles without {name}, and cannot attract"));
            let x = table.column(names::COORDINATES).ok_or_else(|| missing(names::COORDINATES))?;
            let masses = table.column(names::MASSES).ok_or_else(|| missing(names::MASSES))?;
            for i in 0..table.count {
                let place: [f64; 3] = sph::array(|k| x.values.get(i * x.components + k));
                let mass = masses.values.get(i);
                if !(mass >= 0.0 && mass.is_finite() && place.iter().all(|v| v.is_finite())) {
                    let problem = format!(
                        "particle {i} has mass {mass} at {place:?}; expected finite numbers, and none negative"
                    );
                    return Err(wrong(problem));
                }
                points.push((place, mass));
            }
        }
        let mass: f64 = points.iter().map(|p| p.1).sum();
        if points.len() < ENOUGH || !(mass > 0.0 && mass.is_finite()) {
            let problem = format!(
                "has {} particles with a mass of {mass:e} together, expected {ENOUGH} or more that have some: a few are better stated as point masses",
                points.len()
            );
            return Err(wrong(problem));
        }
        let center = densest(&points);
        let mut shells: Vec<(f64, f64)> = points.iter().map(|(x, m)| (distance(x, &center), *m)).collect();
        shells.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        if !(shells[shells.len() - 1].0 > 0.0) {
            return Err(wrong("has all of its particles at one place; state a point mass".into()));
        }
        Ok(Self { profile: profile(&shells), mass, count: points.len() })
    }
}

/// The center of mass of the last of the spheres that shrink about it.
fn densest(points: &[([f64; 3], f64)]) -> [f64; 3] {
    let mean = |within: &[([f64; 3], f64)]| -> [f64; 3] {
        let total: f64 = within.iter().map(|p| p.1).sum();
        sph::array(|k| within.iter().map(|(x, m)| m * x[k]).sum::<f64>() / total)
    };
    let mut within = points.to_vec();
    let mut center = mean(&within);
    let mut radius = within.iter().map(|(x, _)| distance(x, &center)).fold(0.0, f64::max);
    loop {
        radius *= SHRINKS;
        let inner: Vec<_> = within.iter().copied().filter(|(x, _)| distance(x, &center) <= radius).collect();
        if inner.len() < FEWEST || !(radius > 0.0) || inner.iter().all(|p| p.1 == 0.0) {
            return center;
        }
        within = inner;
        center = mean(&within);
    }
}

/// Densities of shells that hold equal numbers of these, which ascend by their distance.
fn profile(shells: &[(f64, f64)]) -> RadialProfile {
    let n = shells.len();
    let count = n.isqrt().clamp(SHELLS[0], SHELLS[1]);
    let volume = |r: f64| unit_ball_volume(3) * r.powi(3);
    let (mut nodes, mut values, mut waiting) = (vec![0.0], Vec::new(), 0.0);
    for shell in 0..count {
        let [from, to] = [shell, shell + 1].map(|s| s * n / count);
        waiting += shells[from..to].iter().map(|s| s.1).sum::<f64>();
        // Half way to the next one, or as far beyond the last.
        let (last, before) = (shells[to - 1].0, shells[to.saturating_sub(2)].0);
        let end = shells.get(to).map_or(last + 0.5 * (last - before), |next| 0.5 * (last + next.0));
        let start = nodes[nodes.len() - 1];
        // Several in one place make no shell by themselves.
        if end > start {
            values.push(waiting / (volume(end) - volume(start)));
            nodes.push(end);
            waiting = 0.0;
        }
    }
    RadialProfile::from_cells(3, &nodes, &values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Hernquist sphere (1990, ApJ 356, 359) of radius 1 about a place: m(r) = r^2/(1 + r)^2, in directions that fill the sphere evenly.
    #[test]
    fn the_mass_within_a_radius_is_that_of_the_particles() {
        let (n, center) = (20_000, [3.0, -2.0, 5.0]);
        let all: Vec<(f64, f64)> = (0..n)
            .map(|i| {
                let root = ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
                (root / (1.0 - root), 1.0 / f64::from(n))
            })
            .collect();
        let found = profile(&all);
        for r in [0.1_f64, 0.5, 1.0, 5.0, 50.0] {
            let expected = (r / (1.0 + r)).powi(2);
            // Within a shell the mass is where a parabola has it: a part of the noise of those within.
            let slack = 0.15 / (f64::from(n) * expected).sqrt() + 1e-3;
            assert!((found.enclosed_mass(r) / expected - 1.0).abs() < slack, "{r}: {}", found.enclosed_mass(r));
        }
        let place = |i: usize, r: f64| {
            let z = 1.0 - 2.0 * ((i as f64 * 0.618_033_988_75) % 1.0);
            let (ring, turn) = ((1.0 - z * z).sqrt(), 2.4 * i as f64);
            [center[0] + r * ring * turn.cos(), center[1] + r * ring * turn.sin(), center[2] + r * z]
        };
        let points: Vec<_> = all.iter().enumerate().map(|(i, (r, m))| (place(i, *r), *m)).collect();
        // The last hundred lie within 0.08 of it.
        assert!(distance(&densest(&points), &center) < 0.05, "{:?}", densest(&points));
    }
}
