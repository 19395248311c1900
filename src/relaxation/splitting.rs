//! Particle splitting: converge the coarse features with few particles, then replace each by several
//! (ALARIC sec. 2.4).

use crate::target::{Positions, Target, at};
use sph::kernel::support_over_spacing;
use sph::parallel;

/// Children of one particle: its place and the corners of a simplex about it, 3, 4 or 5 in 1-D to 3-D.
pub const fn children(d: usize) -> usize {
    d + 2
}

/// Particles to start from so that `splittings` stages of splitting can end at exactly `count`.
pub fn coarse_count(d: usize, count: usize, splittings: usize) -> usize {
    (0..splittings).fold(count, |n, _| n.div_ceil(children(d)))
}

/// Tries to keep a child in the domain: each halves its distance from the parent.
const RETREATS: usize = 30;

/// Replaces each particle by its children, as many as make `count` in all. Where `count` is not a multiple,
/// particles spread evenly over the order of `positions` get fewer. `target` is the target for the given
/// positions, of which there must be at least `count / (d + 2)` and at most `count`.
pub fn split<const D: usize>(
    target: &Target<'_, D>,
    positions: &Positions<D>,
    kernel_neighbors: f64,
    count: usize,
) -> Positions<D> {
    let n = positions[0].len();
    let offset = offset(D, kernel_neighbors);
    let families: Vec<Vec<[f64; D]>> = parallel::map(n, |i| {
        // Bresenham's share of the places that are to be filled.
        let mine = ((i + 1) * count) / n - (i * count) / n;
        let parent = at(positions, i);
        let reach = offset * target.spacing(target.number_density(&parent)).min(target.domain.size());
        siblings(target, &parent, reach, mine)
    });
    std::array::from_fn(|k| families.iter().flatten().map(|x| x[k]).collect())
}

/// Distance of children from their parent over its spacing (eq. 42): 2 H / (p N_H)^(1/d); with H = (N_H / (V_d n))^(1/d) a fraction of
/// the spacing.
fn offset(d: usize, kernel_neighbors: f64) -> f64 {
    2.0 * support_over_spacing(d, kernel_neighbors) / (children(d) as f64 * kernel_neighbors).powf(1.0 / d as f64)
}

/// So many children, up to d + 2, at `reach` from their parent.
fn siblings<const D: usize>(target: &Target<'_, D>, parent: &[f64; D], reach: f64, count: usize) -> Vec<[f64; D]> {
    let corners = simplex::<D>();
    // With all children one sits at the center; with fewer the center stays free.
    let center = (count == children(D) || count == 1).then_some(*parent);
    let others = count - usize::from(center.is_some());
    let child = |corner: &[f64; D]| place(target, parent, corner, reach);
    center.into_iter().chain(corners.iter().take(others).map(child)).collect()
}

/// Places for `count` particles where one of a `spacing` is. More than d + 2 are the children of its children, and so on.
pub fn family<const D: usize>(
    target: &Target<'_, D>,
    parent: &[f64; D],
    spacing: f64,
    kernel_neighbors: f64,
    count: usize,
) -> Vec<[f64; D]> {
    let reach = offset(D, kernel_neighbors) * spacing.min(target.domain.size());
    if count <= children(D) {
        return siblings(target, parent, reach, count);
    }
    let heads = siblings(target, parent, reach, children(D));
    let own = |i: usize| ((i + 1) * count) / children(D) - (i * count) / children(D);
    let nearer = spacing * (children(D) as f64).powf(-1.0 / D as f64);
    let families = heads.iter().enumerate().map(|(i, head)| family(target, head, nearer, kernel_neighbors, own(i)));
    families.flatten().collect()
}

/// The child at `reach` from its parent towards a corner, nearer where the domain ends.
fn place<const D: usize>(target: &Target<'_, D>, parent: &[f64; D], corner: &[f64; D], reach: f64) -> [f64; D] {
    let mut length = reach;
    for _ in 0..RETREATS {
        let mut x: [f64; D] = sph::array(|k| parent[k] + length * corner[k]);
        target.domain.wrap(&mut x);
        if target.admits(&x) {
            return x;
        }
        length *= 0.5;
    }
    *parent
}

/// Unit vectors to the corners of a regular simplex: left and right, triangle, tetrahedron.
fn simplex<const D: usize>() -> Vec<[f64; D]> {
    let root = |x: f64| x.sqrt();
    let corners: &[[f64; 3]] = match D {
        1 => &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        2 => &[[0.0, 1.0, 0.0], [-0.5 * root(3.0), -0.5, 0.0], [0.5 * root(3.0), -0.5, 0.0]],
        _ => &[
            [0.0, 0.0, 1.0],
            [root(8.0) / 3.0, 0.0, -1.0 / 3.0],
            [-root(2.0) / 3.0, root(6.0) / 3.0, -1.0 / 3.0],
            [-root(2.0) / 3.0, -root(6.0) / 3.0, -1.0 / 3.0],
        ],
    };
    corners.iter().map(|c| sph::array(|k| c[k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::ScalarField;
    use crate::target::Resolution;
    use sph::domain::{Axis, Domain, Region, Wall};

    struct Uniform;
    impl<const D: usize> ScalarField<D> for Uniform {
        fn value(&self, _: &[f64; D]) -> f64 {
            1.0
        }
    }

    fn check<const D: usize>(domain: &Domain<D>, count: usize) {
        let parents = coarse_count(D, count, 1);
        let target = Target {
            domain,
            density: &Uniform,
            resolution: Resolution::EqualMass,
            count: parents,
            mass: 1.0,
            resolution_integral: domain.volume(),
            largest_spacing: f64::INFINITY,
            pieces: None,
            part: None,
        };
        let at_corner: Positions<D> = std::array::from_fn(|k| vec![domain.lo[k] + 0.4 * domain.extent()[k]; parents]);
        let out = split(&target, &at_corner, 30.0, count);
        out.iter().for_each(|x| assert_eq!(x.len(), count));
        (0..count).for_each(|i| assert!(domain.contains(&at(&out, i))));
    }

    #[test]
    fn exactly_the_number_asked_for_within_the_domain() {
        for count in [1, 2, 3, 7, 100, 101, 4096] {
            check(&Domain::new([0.0], [1.0], [Axis::OPEN], Region::Box).unwrap(), count);
            check(&Domain::ball([0.0; 2], 1.0, Wall::Open).unwrap(), count);
            check(&Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap(), count);
        }
    }

    #[test]
    fn a_family_has_as_many_members_as_asked_for_about_its_parent() {
        fn check<const D: usize>() {
            let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
            let target = Target::of_equal_masses(&domain, &Uniform, 1000, 1.0);
            for count in [1, 2, 3, 5, 8, 27, 64] {
                let found = family(&target, &[0.5; D], 0.1, 30.0, count);
                assert_eq!(found.len(), count);
                // Offsets of generations are a geometric series of ratio (d + 2)^(-1/d), a third to 0.6 of each.
                let far = |x: &[f64; D]| x.iter().map(|v| (v - 0.5).powi(2)).sum::<f64>().sqrt() > 0.2;
                assert!(!found.iter().any(far), "{D}-D {count}");
                let apart =
                    |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                for (i, a) in found.iter().enumerate() {
                    assert!(found[..i].iter().all(|b| apart(a, b) > 1e-6), "{D}-D {count}: {found:?}");
                }
            }
        }
        check::<1>();
        check::<2>();
        check::<3>();
    }

    #[test]
    fn corners_are_unit_vectors_that_sum_to_zero() {
        fn check<const D: usize>() {
            let corners = simplex::<D>();
            assert_eq!(corners.len(), children(D) - 1);
            for k in 0..D {
                assert!(corners.iter().map(|c| c[k]).sum::<f64>().abs() < 1e-15);
            }
            corners.iter().for_each(|c| assert!((c.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-15));
        }
        check::<1>();
        check::<2>();
        check::<3>();
    }

    #[test]
    fn children_of_a_line_are_evenly_spaced() {
        let domain = Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
        let target = Target::of_equal_masses(&domain, &Uniform, 10, 1.0);
        let parents = [(0..10).map(|i| (i as f64 + 0.5) / 10.0).collect()];
        let mut x = split(&target, &parents, 8.0, 30)[0].clone();
        x.sort_by(f64::total_cmp);
        x.windows(2).for_each(|w| assert!((w[1] - w[0] - 1.0 / 30.0).abs() < 1e-14));
    }
}
