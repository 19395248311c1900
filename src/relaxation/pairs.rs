//! Pairs: particles far closer together than the spacing that the target has there, down to the same place.
//!
//! No force of a smooth kernel parts what coincides (its gradient vanishes at the origin), and at jumps that N
//! particles do not resolve a stage may press two together. Here each of a pair moves away from the other until
//! they are apart (mirror images at walls count, a particle's own too); which way coincident ones go is drawn by their place in the tree.

use crate::metrics::Measured;
use crate::random::Purpose;
use crate::target::{Positions, Target, at};
use sph::domain::Domain;
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph::neighbors::{Reach, Sources, Tree};
use sph::parallel;
use sph::sums::{Apart, partings, support_guess};

/// Distance over the smaller spacing of the two below which particles are the same one twice.
pub const COINCIDENT: f64 = 1e-3;
/// Distance below which the particles of a result count as paired; random points have some, relaxed ones none.
pub const PAIRED: f64 = 0.15;
/// How far pairs are moved apart, in spacings.
const APART: f64 = 0.25;
/// Rounds after which the rest is left: thousands at one place are apart by then.
const MAX_ROUNDS: usize = 1000;

/// Parts particles that are closer than `threshold` of the smaller of their spacings; returns how many were
/// found so. Without pairs this is one pass, and positions stay as they are, bit for bit.
pub fn part_pairs<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>, threshold: f64) -> usize {
    part_within(target, positions, threshold, &[])
}

/// The same where particles are [`PAIRED`], by the spacing of the target or that which their sums say, whichever is smaller: where
/// the target changes by far more than its spacing lets particles show, they lie closer together than it says.
pub(super) fn part_crowded_pairs<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>) -> usize {
    let n = positions[0].len();
    let domain = target.domain.mirrored();
    let spacing = parallel::map(n, |i| target.spacing(target.number_density(&at(positions, i))).min(domain.size()));
    if n < 2 || !closer_than(&domain, positions, &spacing, PAIRED).contains(&true) {
        return 0;
    }
    let (kernel, neighbors) = (KernelName::default(), default_kernel_neighbors(D));
    let even = (domain.volume() / n as f64).powf(1.0 / D as f64);
    let guess = support_guess::<D>(neighbors, n, |i| spacing[i].min(even));
    let measured = Measured::new(kernel, target.domain, positions, &vec![1.0; n], &guess, neighbors);
    let ratio = support_over_spacing(D, neighbors);
    part_within(target, positions, PAIRED, &parallel::map(n, |i| measured.support[i] / ratio))
}

/// [`part_pairs`] with spacings that count as no more than `most`, if there are any.
fn part_within<const D: usize>(
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
    threshold: f64,
    most: &[f64],
) -> usize {
    let n = positions[0].len();
    if n < 2 {
        return 0;
    }
    let domain = target.domain.mirrored();
    let mut found = 0;
    for round in 0..MAX_ROUNDS {
        let tree = Tree::build(positions);
        let apart = parallel::map(n, |place| {
            let i = tree.order()[place] as usize;
            let most = most.get(i).copied().unwrap_or(f64::INFINITY);
            APART * target.spacing(target.number_density(&at(positions, i))).min(most).min(domain.size())
        });
        let sources = [Sources::<D, 1>::new(&tree, &apart, [&apart], Reach::Target)];
        let partings =
            partings(&domain, &sources, (Apart::Smaller, threshold / APART), (round as u64, Purpose::Parting as u64));
        let paired = partings.iter().filter(|p| p.paired).count();
        if paired == 0 {
            break;
        }
        found = found.max(paired);
        for ((parting, &i), limit) in partings.iter().zip(tree.order()).zip(&apart).filter(|((p, _), _)| p.paired) {
            if let Some(x) = parted(target, &domain, &at(positions, i as usize), &parting.shift, *limit) {
                (0..D).for_each(|k| positions[k][i as usize] = x[k]);
            }
        }
    }
    found
}

/// Where a particle goes by `shift`, of no more than `limit`; `None` where the target has no place for it or another region begins.
pub(super) fn parted<const D: usize>(
    target: &Target<'_, D>,
    domain: &Domain<D>,
    from: &[f64; D],
    shift: &[f64; D],
    limit: f64,
) -> Option<[f64; D]> {
    let size = shift.iter().map(|s| s * s).sum::<f64>().sqrt();
    let scale = if size > limit { limit / size } else { 1.0 };
    let mut x = sph::array(|k| from[k] + scale * shift[k]);
    domain.confine(from, &mut x);
    (target.admits(&x) && target.keeps_region(from, &x)).then_some(x)
}

/// Which particles are closer to another than `distance` of the smaller of their spacings.
pub(super) fn closer_than<const D: usize>(
    domain: &Domain<D>,
    positions: &Positions<D>,
    spacing: &[f64],
    distance: f64,
) -> Vec<bool> {
    let tree = Tree::build(positions);
    let reach = parallel::map(spacing.len(), |place| distance * spacing[tree.order()[place] as usize]);
    let sources = [Sources::<D, 1>::new(&tree, &reach, [&reach], Reach::Target)];
    let mut out = vec![false; spacing.len()];
    for (parting, &i) in
        partings(domain, &sources, (Apart::Smaller, 1.0), (0, Purpose::Parting as u64)).iter().zip(tree.order())
    {
        out[i as usize] = parting.paired;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;
    use sph::domain::{Axis, Region};

    struct One;

    impl<const D: usize> ScalarField<D> for One {
        fn value(&self, _: &[f64; D]) -> f64 {
            1.0
        }
    }

    fn in_box<const D: usize>(start: Positions<D>, threshold: f64) -> (Positions<D>, usize) {
        let domain = Domain::new([0.0; D], [1.0; D], [Axis::REFLECTING; D], Region::Box).unwrap();
        let target = Target::of_equal_masses(&domain, &One, start[0].len(), 1.0);
        let mut positions = start;
        let found = part_pairs(&target, &mut positions, threshold);
        assert!((0..target.count).all(|i| domain.contains(&at(&positions, i))));
        (positions, found)
    }

    fn closest<const D: usize>(x: &Positions<D>) -> f64 {
        let distance2 = |i: usize, j: usize| (0..D).map(|k| (x[k][i] - x[k][j]).powi(2)).sum::<f64>();
        let n = x[0].len();
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.fold(f64::INFINITY, |m, (i, j)| m.min(distance2(i, j))).sqrt()
    }

    #[test]
    fn particles_at_one_place_part_the_same_way_each_time() {
        let start: Positions<3> = std::array::from_fn(|_| vec![0.3; 200]);
        let (x, found) = in_box(start.clone(), COINCIDENT);
        assert_eq!(found, 200);
        assert!(closest(&x) > COINCIDENT * 200_f64.powf(-1.0 / 3.0), "{}", closest(&x));
        assert_eq!(x, in_box(start, COINCIDENT).0);
        let corner: Positions<2> = std::array::from_fn(|_| vec![1.0; 50]);
        assert!(closest(&in_box(corner, PAIRED).0) > PAIRED * 50_f64.powf(-0.5));
        let line: Positions<1> = [vec![0.0; 20]];
        assert!(closest(&in_box(line, PAIRED).0) > PAIRED / 20.0);
    }

    #[test]
    fn those_that_are_too_close_are_found_across_a_seam_and_by_the_smaller_spacing() {
        let line = Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
        let found = |x: &[f64], spacing: &[f64]| closer_than(&line, &[x.to_vec()], spacing, 0.5);
        assert_eq!(found(&[0.02, 0.4, 0.5, 0.98], &[0.1; 4]), [true, false, false, true]);
        assert_eq!(found(&[0.1, 0.14, 0.5, 0.58], &[0.1, 0.1, 0.1, 0.2]), [true, true, false, false]);
    }

    #[test]
    fn what_is_apart_stays_bit_for_bit() {
        let place = |i: usize| (i as f64 + 0.5) / 10.0;
        let start: Positions<2> =
            [(0..100).map(|i| place(i % 10)).collect(), (0..100).map(|i| place(i / 10)).collect()];
        assert_eq!(in_box(start.clone(), PAIRED), (start, 0));
    }
}
