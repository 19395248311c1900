//! Pairs: particles that are far closer together than the target's spacing at their position, or even coincide.
//!
//! No force of a smooth kernel parts what coincides (its gradient vanishes at the origin), and at jumps that N
//! particles do not resolve a stage may press two together. Here each of a pair moves away from the other until
//! they are apart (mirror images at walls count, a particle's own too); which way coincident ones go is drawn by their place in the tree.

use super::hold::Hold;
use crate::metrics::Measured;
use crate::random::Purpose;
use crate::target::{Positions, Target, at};
use sph::domain::Domain;
use sph::exchange::{Alone, Exchange};
use sph::geometry::distance;
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph::neighbors::{Halo, Reach, Sees, Sources, Tree};
use sph::parallel;
use sph::sums::{Apart, Parting, partings, support_guess};

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
    part_pairs_among(&Alone, target, positions, threshold)
}

/// [`part_pairs`] of particles that are over several ranks.
pub(super) fn part_pairs_among<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
    threshold: f64,
) -> usize {
    part_within((exchange, &|_| true), target, positions, threshold, &[])
}

/// Parts the particles of a block that are [`PAIRED`] from each other and from those about it, which stay; returns how many were found so.
pub fn part_pairs_of_block<const D: usize>(
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
    holds: &[Hold],
) -> usize {
    part_crowded((&Alone, &|i| holds[i] == Hold::Free), target, positions)
}

/// The same where particles are [`PAIRED`], by the spacing of the target or that which their sums say, whichever is smaller: where
/// the target changes by far more than its spacing lets particles show, they lie closer together than it says.
pub(super) fn part_crowded_pairs<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
) -> usize {
    part_crowded((exchange, &|_| true), target, positions)
}

/// Which particles may move.
type May<'a> = &'a (dyn Fn(usize) -> bool + Sync);

fn part_crowded<const D: usize>(
    (exchange, may_move): (&dyn Exchange, May<'_>),
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
) -> usize {
    let (own, all) = (positions[0].len(), exchange.count(positions[0].len()));
    let domain = target.domain.mirrored();
    let spacing = spacings(target, positions);
    let is_paired = |close: Vec<bool>| (0..own).any(|i| close[i] && may_move(i));
    let beside = exchange.count(part_from_surface(target, positions, &spacing, may_move));
    if all < 2 || !exchange.any(is_paired(closer_than(exchange, &domain, positions, &spacing, PAIRED))) {
        return beside;
    }
    let most = measured_spacings(exchange, target, positions, &spacing);
    beside.max(part_within((exchange, may_move), target, positions, PAIRED, &most))
}

/// The spacing of each particle as the target has it there.
pub(super) fn spacings<const D: usize>(target: &Target<'_, D>, positions: &Positions<D>) -> Vec<f64> {
    let density = target.number_densities(positions);
    parallel::map(density.len(), |i| target.spacing(density[i]).min(target.domain.size()))
}

/// The spacing of each particle by the number density that their sums say, where the target's is `spacing`.
pub(super) fn measured_spacings<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    spacing: &[f64],
) -> Vec<f64> {
    let own = spacing.len();
    let (kernel, neighbors) = (KernelName::default(), default_kernel_neighbors(D));
    let even = target.domain.mirrored().mean_spacing(exchange.count(own));
    let guess = support_guess::<D>(neighbors, own, |i| spacing[i].min(even));
    let measured = Measured::among(exchange, kernel, target.domain, positions, &vec![1.0; own], &guess, neighbors);
    let ratio = support_over_spacing(D, neighbors);
    parallel::map(own, |i| measured.support[i] / ratio)
}

/// Parts particles from their own images in a curved surface, which trees of particles do not hold; returns how many were so close to them.
fn part_from_surface<const D: usize>(
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
    spacing: &[f64],
    may_move: May<'_>,
) -> usize {
    let region = &target.domain.region;
    if region.wall().is_none() {
        return 0;
    }
    let moved = parallel::map(spacing.len(), |i| {
        let x = at(positions, i);
        if !may_move(i) || !region.is_surface_within(&x, 0.5 * PAIRED * spacing[i]) {
            return None;
        }
        let image = region.mirror(&x)?;
        let apart = distance(&image, &x);
        if !(apart > 0.0) {
            // Of one right on the surface nothing tells the way.
            return None;
        }
        let share = 0.5 * (APART * spacing[i] / apart - 1.0);
        let shift: [f64; D] = sph::array(|k| share * (x[k] - image[k]));
        parted(target, target.domain, &x, &shift, APART * spacing[i])
    });
    let found = moved.iter().flatten().count();
    for (i, x) in moved.into_iter().enumerate().filter_map(|(i, x)| Some((i, x?))) {
        (0..D).for_each(|k| positions[k][i] = x[k]);
    }
    found
}

/// [`part_pairs_among`] with spacings that count as no more than `most`, if there are any.
fn part_within<const D: usize>(
    (exchange, may_move): (&dyn Exchange, May<'_>),
    target: &Target<'_, D>,
    positions: &mut Positions<D>,
    threshold: f64,
    most: &[f64],
) -> usize {
    if exchange.count(positions[0].len()) < 2 {
        return 0;
    }
    let domain = target.domain.mirrored();
    let mut found = 0;
    for round in 0..MAX_ROUNDS {
        let apart = parallel::map(positions[0].len(), |i| {
            let most = most.get(i).copied().unwrap_or(f64::INFINITY);
            APART * target.spacing(target.number_density(&at(positions, i))).min(most).min(domain.size())
        });
        let close = (Apart::Smaller, threshold / APART);
        let mut partings = partings_among(exchange, &domain, positions, |i| apart[i], close, round as u64);
        partings.retain(|(i, parting)| parting.paired && may_move(*i));
        let paired = exchange.count(partings.len());
        if paired == 0 {
            break;
        }
        found = found.max(paired);
        for (i, parting) in partings {
            if let Some(x) = parted(target, &domain, &at(positions, i), &parting.shift, apart[i]) {
                (0..D).for_each(|k| positions[k][i] = x[k]);
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
    exchange: &dyn Exchange,
    domain: &Domain<D>,
    positions: &Positions<D>,
    spacing: &[f64],
    distance: f64,
) -> Vec<bool> {
    closer_than_by(Apart::Smaller, exchange, domain, positions, spacing, distance)
}

/// [`closer_than`] that of another than the smaller of their spacings.
pub(super) fn closer_than_by<const D: usize>(
    apart: Apart,
    exchange: &dyn Exchange,
    domain: &Domain<D>,
    positions: &Positions<D>,
    spacing: &[f64],
    distance: f64,
) -> Vec<bool> {
    let mut out = vec![false; spacing.len()];
    let reach = |i: usize| distance * spacing[i];
    for (i, parting) in partings_among(exchange, domain, positions, reach, (apart, 1.0), 0) {
        out[i] = parting.paired;
    }
    out
}

/// How each particle of this rank parts from others, of all ranks, that are closer than a threshold of its `reach` or of what the two's come to. In
/// the order of a tree; coincident ones go another way in each `round`.
pub(super) fn partings_among<const D: usize>(
    exchange: &dyn Exchange,
    domain: &Domain<D>,
    positions: &Positions<D>,
    reach: impl Fn(usize) -> f64 + Sync,
    (apart, threshold): (Apart, f64),
    round: u64,
) -> Vec<(usize, Parting<D>)> {
    let tree = Tree::build(positions);
    let reach = parallel::map(positions[0].len(), |place| reach(tree.order()[place] as usize));
    let (sees, whose) = match apart {
        Apart::Smaller => (Sees::Targets, Reach::Target),
        Apart::Mean | Apart::Larger => (Sees::Either, Reach::Either),
    };
    let halo = (!exchange.is_alone()).then(|| {
        let halo = Halo::new(exchange, domain, (&tree, &reach), None, sees);
        let [theirs] = halo.values(exchange, [[&reach, &[]]]);
        (halo.tree, theirs)
    });
    let mut sources = vec![Sources::<D, 1>::new(&tree, &reach, [&reach], whose)];
    sources.extend(halo.as_ref().map(|(tree, theirs)| Sources::new(tree, theirs, [theirs], whose)));
    // Two at one place have the same number on two ranks, perhaps.
    let seed = round | (exchange.rank() as u64) << u32::BITS;
    let found = partings(domain, &sources, (apart, threshold), (seed, Purpose::Parting as u64));
    tree.order().iter().map(|&i| i as usize).zip(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;
    use sph::domain::{Axis, Region, Wall};

    /// On a curved surface that mirrors or is open, a particle would be at its own image.
    #[test]
    fn no_particle_ends_at_its_image_in_a_curved_surface() {
        let on_sphere = |count: usize, radius: f64| -> Positions<3> {
            let turn = |i: usize| 2.4 * i as f64;
            let height = |i: usize| 1.0 - (2 * i + 1) as f64 / count as f64;
            let ring = |i: usize| (1.0 - height(i) * height(i)).sqrt();
            [
                (0..count).map(|i| radius * ring(i) * turn(i).cos()).collect(),
                (0..count).map(|i| radius * ring(i) * turn(i).sin()).collect(),
                (0..count).map(|i| radius * height(i)).collect(),
            ]
        };
        for wall in [Wall::Open, Wall::Reflecting] {
            let domain = Domain::ball([0.0; 3], 1.0, wall).unwrap();
            let target = Target::of_equal_masses(&domain, &One, 60, 1.0);
            let spacing = target.spacing(target.number_density(&[0.0; 3]));
            let mut positions = on_sphere(60, 1.0 - 0.01 * spacing);
            assert_eq!(part_crowded_pairs(&Alone, &target, &mut positions), 60, "{wall:?}");
            for i in 0..60 {
                let x = at(&positions, i);
                let depth = (1.0 - x.iter().map(|v| v * v).sum::<f64>().sqrt()) / spacing;
                assert!((depth / (0.5 * APART) - 1.0).abs() < 1e-9, "{wall:?}: {depth}");
            }
            let before = positions.clone();
            assert_eq!(part_crowded_pairs(&Alone, &target, &mut positions), 0);
            assert_eq!(positions, before);
        }
    }

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
        let found = |x: &[f64], spacing: &[f64]| closer_than(&Alone, &line, &[x.to_vec()], spacing, 0.5);
        assert_eq!(found(&[0.02, 0.4, 0.5, 0.98], &[0.1; 4]), [true, false, false, true]);
        assert_eq!(found(&[0.1, 0.14, 0.5, 0.58], &[0.1, 0.1, 0.1, 0.2]), [true, true, false, false]);
    }

    #[test]
    fn in_a_block_those_that_are_held_stay() {
        let mut start: Positions<2> = std::array::from_fn(|k| {
            (0..100).map(|i| [i % 10, i / 10][k]).map(f64::from).map(|x| (x + 0.5) / 10.0).collect()
        });
        let domain = Domain::new([0.0; 2], [1.0; 2], [Axis::REFLECTING; 2], Region::Box).unwrap();
        let target = Target::of_equal_masses(&domain, &One, 100, 1.0);
        let holds: Vec<Hold> = (0..100).map(|i| if i < 50 { Hold::Free } else { Hold::Held }).collect();
        // A free one beside a held one, two held ones, two free ones.
        for (from, to) in [(0, 50), (60, 61), (10, 11)] {
            (0..2).for_each(|k| start[k][from] = start[k][to] + 1e-4);
        }
        let mut parted = start.clone();
        assert_eq!(part_pairs_of_block(&target, &mut parted, &holds), 3);
        let moved: Vec<usize> = (0..100).filter(|&i| at(&start, i) != at(&parted, i)).collect();
        assert_eq!(moved, [0, 10, 11]);
        let apart = |i: usize, j: usize| (0..2).map(|k| (parted[k][i] - parted[k][j]).powi(2)).sum::<f64>().sqrt();
        // By the spacing that their sums say, which is a little less than the target's.
        let least = 0.8 * PAIRED / 10.0;
        assert!(apart(0, 50) > least && apart(10, 11) > least, "{} {}", apart(0, 50), apart(10, 11));
    }

    #[test]
    fn what_is_apart_stays_bit_for_bit() {
        let place = |i: usize| (i as f64 + 0.5) / 10.0;
        let start: Positions<2> =
            [(0..100).map(|i| place(i % 10)).collect(), (0..100).map(|i| place(i / 10)).collect()];
        assert_eq!(in_box(start.clone(), PAIRED), (start, 0));
    }
}
