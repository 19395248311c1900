//! Measures how far a self-gravitating body has expanded or contracted relative to its target.
//!
//! Pressure holds gravity with many thermal states, each with a mass profile of its own. Which of them a body comes to follows
//! from a factor that is fitted to forces, and forces between particles on shells are not those of the arrangement to which
//! they relax. So the smooth part of the displacement is taken back before the factor is fitted anew: with mass where the
//! target has it, the factor is that of the target, whatever the one before it was.

use super::arrangement::Arrangement;
use super::thermal::{Basis, enclosed_fractions};
use crate::target::{Equilibrium, at};
use sph::geometry::{distance, unit_sphere_area};
use sph::gravity::strength;
use sph::lanes::Real;
use sph::{parallel, reduce};

/// A body displaced by more, as a fraction of the radius, is no neighbor of its target, and is left as it is.
const LARGEST: f64 = 0.2;

/// Per particle, the smooth part of r*(M) / r - 1, where r*(M) is the radius within which the target has the mass M that
/// particles have within r: fitted over `set`, and beyond it as at its edge. `place` is where the target says what a particle is
/// like. `None` where the particles do not determine it, or are too far off.
pub(super) fn shortfall<const D: usize, R: Real>(
    arrangement: &Arrangement<'_, D, R>,
    equilibrium: &dyn Equilibrium<D>,
    center: &[f64; D],
    place: &[[f64; D]],
    set: Option<&[bool]>,
) -> Option<Vec<f64>> {
    let (positions, target) = (arrangement.positions(), &arrangement.target);
    let n = arrangement.len();
    let particle = target.mass / target.count as f64;
    let fraction = enclosed_fractions(positions, center);
    let basis = Basis::over::<D>(Some(&fraction), set);
    // Relative to the mass within r: what lacks, and what a change of radius by its own length brings.
    let lacks_and_brings = parallel::map(n, |i| {
        let r = distance(&at(positions, i), center);
        let there = distance(&place[i], center);
        let pull = equilibrium.gravity(&place[i], 0.0).iter().map(|g| g * g).sum::<f64>().sqrt();
        // A point mass in the center attracts, too, but is no mass of particles.
        let point = equilibrium.point_mass().map_or(0.0, |point| point.enclosed_mass(there));
        let wanted = pull * there.powi(D as i32 - 1) / strength(D) - point;
        let within = fraction[i] * target.mass;
        let brings = unit_sphere_area(D) * r.powi(D as i32) * particle * target.number_density(&place[i]);
        [(within - wanted) / within, brings / within]
    });
    let functions: Vec<Vec<[f64; 1]>> =
        (0..basis.len()).map(|k| parallel::map(n, |i| [basis.value(k, i) * lacks_and_brings[i][1]])).collect();
    let wanted = parallel::map(n, |i| [lacks_and_brings[i][0]]);
    // Within a spacing of the center the mass says nothing of radii: they are known to about a spacing.
    let resolved = parallel::map(n, |i| match set.is_none_or(|s| s[i]) {
        true => (distance(&at(positions, i), center) / target.spacing(target.number_density(&place[i]))).powi(2),
        false => 0.0,
    });
    let mean = reduce::sum(n, |i| resolved[i]) / parallel::count(n, |i| resolved[i] > 0.0).max(1) as f64;
    let weight = parallel::map(n, |i| resolved[i] / mean);
    let found = basis.nearest(&functions, &wanted, &weight)?;
    let share = parallel::map(n, |i| basis.sum(&found, i));
    share.iter().all(|q| q.abs() < LARGEST).then_some(share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;
    use crate::seeding::{Seeding, seed};
    use crate::target::{Positions, Target};
    use sph::domain::{Domain, Wall};
    use sph::geometry::unit_ball_volume;
    use sph::kernel::{KernelName, default_kernel_neighbors};

    struct Even;
    impl<const D: usize> ScalarField<D> for Even {
        fn value(&self, _: &[f64; D]) -> f64 {
            1.0
        }
    }

    /// Gravity of an even ball of density 1.
    impl<const D: usize> Equilibrium<D> for Even {
        fn pressure(&self, _: &[f64; D]) -> f64 {
            1.0
        }
        fn gravity(&self, x: &[f64; D], _: f64) -> [f64; D] {
            x.map(|v| -strength(D) * unit_ball_volume(D) * v)
        }
        fn has_gravity(&self) -> bool {
            true
        }
        fn gamma(&self) -> f64 {
            5.0 / 3.0
        }
    }

    /// r over r* after a smooth change of radii, and after what is found of it is taken back: largest difference from 1
    /// beyond three spacings from the center.
    fn before_and_after<const D: usize>(count: usize) -> [f64; 2] {
        let domain = Domain::ball([0.0; D], 1.0, Wall::Open).unwrap();
        let mass = unit_ball_volume(D);
        let target = Target::of_equal_masses(&domain, &Even, count, mass);
        let at_rest = seed(&target, Seeding::MassBisection, 1).unwrap().positions;
        let radius = |p: &Positions<D>, i: usize| distance(&at(p, i), &[0.0; D]);
        let swollen: Positions<D> =
            std::array::from_fn(|k| (0..count).map(|i| at_rest[k][i] * (0.93 + 0.05 * radius(&at_rest, i))).collect());
        let kernel_neighbors = default_kernel_neighbors(D);
        let (kernel, space) = (KernelName::WendlandC4, domain.clone());
        let arrangement = Arrangement::<D, f32>::new(kernel, target, space, swollen, kernel_neighbors);
        let place: Vec<[f64; D]> = (0..count).map(|i| at(arrangement.positions(), i)).collect();
        let share = shortfall(&arrangement, &Even, &[0.0; D], &place, None).unwrap();
        let nearest = 3.0 * (mass / count as f64).powf(1.0 / D as f64);
        let mut largest = [0.0_f64; 2];
        for (x, share) in place.iter().zip(&share).filter(|(x, _)| distance(x, &[0.0; D]) > nearest) {
            let r = distance(x, &[0.0; D]);
            // r = r* (0.93 + 0.05 r*), solved for r*.
            let rest = ((0.93_f64.powi(2) + 0.2 * r).sqrt() - 0.93) / 0.1;
            largest = [largest[0].max((r / rest - 1.0).abs()), largest[1].max((r * (1.0 + share) / rest - 1.0).abs())];
        }
        largest
    }

    #[test]
    fn a_smooth_change_of_radii_is_found_and_taken_back() {
        // To within a tenth of a spacing over the radius, and what a linear step leaves of 7 %: its square.
        for (d, [before, after]) in
            [(1, before_and_after::<1>(2000)), (2, before_and_after::<2>(3000)), (3, before_and_after::<3>(8000))]
        {
            assert!(before > 0.05 && after < 0.01, "{d}-D: {before} {after}");
        }
    }
}
