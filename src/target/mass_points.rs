//! The target as point masses, several for each particle: the target smoothed by the kernel is then a sum over neighbors.
//!
//! rho_s(x) = int W(|x - y|, H) rho*(y) d^d y = sum_c m_c W(|x - y_c|, H) for cells with mass m_c and center of mass y_c, with an error of
//! second order in their size over H. Cells are those that mass bisection begins with: fine where mass is, however thin it lies.

use super::cells::{Cell, Rule};
use super::partition::partition;
use super::{Positions, Resolution, Target, at};
use sph::domain::{Domain, Wall};
use sph::kernel::KernelName;
use sph::neighbors::{GhostTree, Reach, Sources, Tree};
use sph::parallel;
use sph::sums::{Actors, DensitySums, density, scatter_gradient};

/// Points to each particle along each axis.
const PER_SPACING: usize = 2;
/// The same where cells are merged, which lie less evenly then.
const MERGED_PER_SPACING: usize = 4;
/// Points, at most: they take some 150 bytes each while they are made. Where more particles show a target, less of it is too steep for them.
const MOST: usize = 1 << 22;
/// Share of the most that a point stands for, and departure from the density in its middle, up to which a cell's middle is its point.
const SMALL: f64 = 0.5;
const EVEN: f64 = 0.1;
/// By what halves may exceed the mass of a cell.
const GROWN: f64 = 1.5;
/// Halvings of a cell, at most: a pole is as deep as the digits.
const MOST_HALVINGS: usize = 60;

/// Points of mass in tree order.
pub(crate) struct MassPoints<const D: usize> {
    tree: Tree<D>,
    positions: Positions<D>,
    /// Of the particles; they add up to 1.
    share: Vec<f64>,
    /// Mass of a particle there over the mean, where particles differ in mass.
    heaviness: Option<Vec<f64>>,
}

impl<const D: usize> MassPoints<D> {
    /// Whether a target has so many particles that its points would be too many.
    pub fn are_too_many(target: &Target<'_, D>) -> bool {
        target.count > MOST / PER_SPACING.pow(D as u32)
    }

    /// Of all of a target; none where it is zero wherever it is looked at, or where they would be too many.
    pub fn new(target: &Target<'_, D>) -> Option<Self> {
        if Self::are_too_many(target) {
            return None;
        }
        Some(Self::of_cells(target, &partition(target, Rule::Gauss).ok()?))
    }

    /// Of all of a target, which these cells are the [`partition`] of.
    pub fn of_cells(target: &Target<'_, D>, cells: &[Cell<D>]) -> Self {
        let total: f64 = cells.iter().map(|c| c.mass).sum();
        let all = |per_spacing: usize| per_spacing.pow(D as u32) * target.count;
        let limit = total / all(PER_SPACING) as f64;
        let parts = parallel::map(cells.len(), |i| {
            let mut parts = Vec::new();
            divide(target, cells[i], (limit, MOST_HALVINGS), &mut parts);
            parts
        });
        let mut cells: Vec<([f64; D], f64)> = parts.into_iter().flatten().collect();
        if cells.len() > all(MERGED_PER_SPACING) {
            let mut merged = Vec::new();
            merge(&mut cells, total / all(MERGED_PER_SPACING) as f64, &mut merged);
            cells = merged;
        }
        let positions: Positions<D> = std::array::from_fn(|k| cells.iter().map(|(x, _)| x[k]).collect());
        let tree = Tree::build(&positions);
        let sorted = positions.each_ref().map(|x| tree.to_tree_order(x));
        let mass: Vec<f64> = cells.iter().map(|(_, m)| *m).collect();
        let total: f64 = mass.iter().sum();
        let share = tree.to_tree_order(&mass).into_iter().map(|m| m / total).collect();
        let heaviness = matches!(target.resolution, Resolution::NumberDensity(_)).then(|| {
            let mean = target.mass / target.count as f64;
            parallel::map(cells.len(), |i| {
                let x = at(&sorted, i);
                let n = target.number_density(&x);
                if n > 0.0 { target.density.value(&x) / (n * mean) } else { 0.0 }
            })
        });
        Self { tree, positions: sorted, share, heaviness }
    }

    /// Those of them, of a part of the target, that have any of `others`, or an image of one, within their `radii`; none where all are farther off.
    pub fn about(&self, kernel: KernelName, domain: &Domain<D>, radii: &[f64], others: &Positions<D>) -> Option<Self> {
        let reaches = self.reach(kernel, domain, radii, others);
        let of = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(&reaches).filter(|(_, reaches)| **reaches).map(|(v, _)| *v).collect()
        };
        if !reaches.contains(&true) {
            return None;
        }
        let positions = self.positions.each_ref().map(|x| of(x));
        let tree = Tree::build(&positions);
        let sorted = |values: &[f64]| tree.to_tree_order(&of(values));
        let (share, heaviness) = (sorted(&self.share), self.heaviness.as_deref().map(sorted));
        let positions = positions.each_ref().map(|x| tree.to_tree_order(x));
        Some(Self { tree, positions, share, heaviness })
    }

    /// The mass density of a target of which these are the points, of the whole `mass`, as `kernel` sees it at `positions` with the radii
    /// `support`; 0 where a radius is 0. Beyond faces and surfaces is what `domain` says: vacuum or an image.
    pub fn mass_densities(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        (positions, support): (&Positions<D>, &[f64]),
        mass: f64,
    ) -> Vec<f64> {
        let weight =
            parallel::map(self.share.len(), |c| mass * self.share[c] * self.heaviness.as_ref().map_or(1.0, |h| h[c]));
        self.sums(kernel, domain, (positions, support), (&weight, 1.0)).into_iter().map(|s| s.weighted).collect()
    }

    /// The number density of `count` particles, with its gradient, in the same way; images count as what they mirror, whatever the volume.
    pub fn number_densities(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        (positions, support): (&Positions<D>, &[f64]),
        count: usize,
    ) -> Vec<DensitySums<D>> {
        let weight = parallel::map(self.share.len(), |c| count as f64 * self.share[c]);
        self.sums(kernel, domain, (positions, support), (&weight, 0.0))
    }

    fn sums(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        (positions, support): (&Positions<D>, &[f64]),
        (weight, power): (&[f64], f64),
    ) -> Vec<DensitySums<D>> {
        let Some(seeing) = Seeing::new(positions, support) else {
            return vec![DensitySums::default(); support.len()];
        };
        let radii = seeing.of(support);
        let widest = radii.iter().fold(0.0_f64, |m, h| m.max(*h));
        // Of those that only see, the channel is the unit of the others'.
        let unit = vec![weight.iter().fold(0.0_f64, |m, w| m.max(*w)); radii.len()];
        let ghosts = self.images(domain, widest);
        let of_ghosts = ghosts.as_ref().map(|g| g.inherit(weight, power));
        let mut sources = vec![
            Sources::new(&seeing.tree, &radii, [unit.as_slice()], Reach::Target).silent(),
            Sources::new(&self.tree, &[], [weight], Reach::Target),
        ];
        if let Some((ghosts, weight)) = ghosts.as_ref().zip(of_ghosts.as_ref()) {
            sources.push(Sources::new(&ghosts.tree, &[], [weight.as_slice()], Reach::Target));
        }
        seeing.spread(&density::<D, 1, f32>(kernel, domain, &sources), DensitySums::default())
    }

    /// Whether any of `others`, or an image of them, lies within the radius of each of the points, in tree order.
    pub fn reach(&self, kernel: KernelName, domain: &Domain<D>, radii: &[f64], others: &Positions<D>) -> Vec<bool> {
        if others[0].is_empty() {
            return vec![false; radii.len()];
        }
        let (theirs, units) = (Tree::build(others), [vec![1.0; radii.len()], vec![1.0; others[0].len()]]);
        let sources = [
            Sources::new(&self.tree, radii, [units[0].as_slice()], Reach::Target).silent(),
            Sources::new(&theirs, &[], [units[1].as_slice()], Reach::Target),
        ];
        density::<D, 1, f32>(kernel, domain, &sources).into_iter().map(|sums| sums.weighted > 0.0).collect()
    }

    /// What the points do to particles at their own radii, `own` being these and a strength A_c for each point, in tree order: the gradient
    /// of sum_c A_c W(|x - y_c|, H_c) at `positions`, zero where a particle's radius is 0. What the particles have as radii and strengths is
    /// a guess of those of points near them.
    pub fn seen_gradient(
        &self,
        kernel: KernelName,
        domain: &Domain<D>,
        (positions, support, strength): (&Positions<D>, &[f64], &[f64]),
        own: (&[f64], &[f64]),
    ) -> Vec<[f64; D]> {
        let Some(seeing) = Seeing::new(positions, support) else {
            return vec![[0.0; D]; support.len()];
        };
        let (support, strength) = (seeing.of(support), seeing.of(strength));
        let widest = own.0.iter().fold(0.0_f64, |m, h| m.max(*h));
        let ghosts = self.images(domain, widest).map(|g| (g.inherit(own.0, 0.0), g.inherit(own.1, 0.0), g));
        let mut actors = vec![
            Actors { tree: &seeing.tree, support: &support, strength: &strength, silent: true },
            Actors { tree: &self.tree, support: own.0, strength: own.1, silent: false },
        ];
        if let Some((support, strength, ghosts)) = &ghosts {
            actors.push(Actors { tree: &ghosts.tree, support, strength, silent: false });
        }
        let sums = scatter_gradient::<D, f32>(kernel, domain, &actors);
        seeing.spread(&parallel::map(sums.len(), |i| sums[i].0), [0.0; D])
    }

    /// Images in a curved surface that mirrors.
    fn images(&self, domain: &Domain<D>, reach: f64) -> Option<GhostTree<D>> {
        match domain.region.wall() {
            Some(Wall::Reflecting) => GhostTree::mirror(domain, &self.positions, |_| reach),
            _ => None,
        }
    }

    /// Places, in tree order.
    pub fn positions(&self) -> &Positions<D> {
        &self.positions
    }

    /// The share of the particles that each stands for, in tree order.
    pub fn share(&self) -> &[f64] {
        &self.share
    }
}

/// Places with a radius, from which points are seen.
struct Seeing<const D: usize> {
    tree: Tree<D>,
    /// Which of all places they are, in tree order.
    places: Vec<usize>,
    all: usize,
}

impl<const D: usize> Seeing<D> {
    /// None where no radius is more than 0.
    fn new(positions: &Positions<D>, support: &[f64]) -> Option<Self> {
        let seeing: Vec<usize> = (0..support.len()).filter(|&i| support[i] > 0.0).collect();
        if seeing.is_empty() {
            return None;
        }
        let tree = Tree::build(&positions.each_ref().map(|x| seeing.iter().map(|&i| x[i]).collect()));
        let places = tree.to_tree_order(&seeing);
        Some(Self { tree, places, all: support.len() })
    }

    /// Their values, in tree order.
    fn of(&self, values: &[f64]) -> Vec<f64> {
        self.places.iter().map(|&i| values[i]).collect()
    }

    /// What they see, in the order of all places; `nothing` at the others.
    fn spread<T: Copy>(&self, seen: &[T], nothing: T) -> Vec<T> {
        let mut out = vec![nothing; self.all];
        self.places.iter().zip(seen).for_each(|(&i, seen)| out[i] = *seen);
        out
    }
}

/// Points taken together where they have no more than the mass `limit`, within boxes that halve their number across the longest edge: where
/// there are far more cells than particles, each with hardly any mass, sums need not go over all of them.
fn merge<const D: usize>(points: &mut [([f64; D], f64)], limit: f64, out: &mut Vec<([f64; D], f64)>) {
    let mass: f64 = points.iter().map(|(_, m)| m).sum();
    if points.len() <= 1 || mass <= limit {
        let center = |k: usize| points.iter().map(|(x, m)| m * x[k]).sum::<f64>() / mass;
        if mass > 0.0 {
            out.push((sph::array(center), mass));
        }
        return;
    }
    let extent = |k: usize| {
        let of = |(lo, hi): (f64, f64), (x, _): &([f64; D], f64)| (lo.min(x[k]), hi.max(x[k]));
        let (lo, hi) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), of);
        hi - lo
    };
    let longest = (1..D).fold(0, |best, k| if extent(k) > extent(best) { k } else { best });
    // Of those level along the edge, the other coordinates decide: which half each is in never depends on their order.
    let before = |a: &([f64; D], f64), b: &([f64; D], f64)| {
        let along = (longest..D).chain(0..longest);
        along.map(|k| a.0[k].total_cmp(&b.0[k])).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    };
    let half = points.len() / 2;
    points.select_nth_unstable_by(half, before);
    let (first, last) = points.split_at_mut(half);
    merge(first, limit, out);
    merge(last, limit, out);
}

/// Halves a cell until no part has more mass than the limit, or so many times; centers of mass and masses of the parts.
fn divide<const D: usize>(
    target: &Target<'_, D>,
    cell: Cell<D>,
    (limit, left): (f64, usize),
    out: &mut Vec<([f64; D], f64)>,
) {
    if !(cell.mass > 0.0) {
        return;
    }
    if let Some(points) = cell.points_on_lines(target, limit) {
        return out.extend(points);
    }
    // Where the density hardly changes, its middle says enough.
    let is_even = cell.is_even(target, EVEN);
    if cell.mass > limit && left > 0 {
        let shared = if is_even { cell.shared_halves(target) } else { None };
        let mut halves = shared.unwrap_or_else(|| cell.halves(target, Rule::Gauss));
        let found = halves.iter().map(|half| half.mass).sum::<f64>();
        // At a pole without a finite mass each look finds more: what there was is shared, or there is no end.
        if found > GROWN * cell.mass {
            halves.iter_mut().for_each(|half| half.mass *= cell.mass / found);
        }
        // A cell whose halves miss its mass (a spike at its center) is kept as it is.
        if found > 0.0 {
            return halves.into_iter().for_each(|half| divide(target, half, (limit, left - 1), out));
        }
    }
    let place = if is_even && cell.mass <= SMALL * limit { cell.center() } else { cell.center_of_mass(target) };
    out.push((place, cell.mass));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{AnalyticField, ScalarField, total_mass};
    use sph::domain::{Axis, Region};
    use sph::kernel::{evaluate, with_kernel};

    const KERNEL: KernelName = KernelName::WendlandC4;

    fn cube<const D: usize>(axis: Axis) -> Domain<D> {
        Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap()
    }

    fn target<'a, const D: usize>(domain: &'a Domain<D>, field: &'a dyn ScalarField<D>, count: usize) -> Target<'a, D> {
        Target::of_equal_masses(domain, field, count, total_mass(field, domain, 1e-8).unwrap().value)
    }

    fn at_points<const D: usize>(points: &[[f64; D]]) -> Positions<D> {
        std::array::from_fn(|k| points.iter().map(|x| x[k]).collect())
    }

    /// W over all of a plane at a distance: sums over rings (points in 2-D, where it is a line).
    fn over_plane<const D: usize>(distance: f64, support: f64) -> f64 {
        let steps = 4000;
        let shape = |q: f64| with_kernel!(KERNEL, kernel => evaluate::<_, D>(kernel, q).0);
        let ring = |s: f64| match D {
            1 => 0.0,
            2 => 2.0,
            _ => std::f64::consts::TAU * s,
        };
        if D == 1 {
            return KERNEL.sigma(1) * shape(distance / support) / support;
        }
        let sum: f64 = (0..steps)
            .map(|i| (i as f64 + 0.5) / steps as f64 * support)
            .map(|s| ring(s) * shape((s.hypot(distance) / support).min(1.0)) * support / steps as f64)
            .sum();
        KERNEL.sigma(D) * sum / support.powi(D as i32)
    }

    #[test]
    fn there_are_no_more_points_than_fit_into_memory() {
        let domain = cube::<3>(Axis::Periodic);
        let field = AnalyticField::<3>::new("density", "1 + x", [0.0; 3]).unwrap();
        let most = target(&domain, &field, MOST / 8);
        assert!(!MassPoints::are_too_many(&most));
        let more = most.with_count(MOST / 8 + 1);
        assert!(MassPoints::are_too_many(&more) && MassPoints::new(&more).is_none());
    }

    /// Whatever mass a target has been said to have: looked at closely, each half of a cell at this pole has as much as the whole.
    #[test]
    fn poles_without_a_finite_mass_have_no_more_points_than_others() {
        let domain = cube::<1>(Axis::OPEN);
        let field = AnalyticField::<1>::new("density", "abs(x - 0.3)^-2", [0.0]).unwrap();
        let points = MassPoints::new(&Target::of_equal_masses(&domain, &field, 500, 1e10)).unwrap();
        let most = MERGED_PER_SPACING * 500 + MOST_HALVINGS;
        assert!((1..=most).contains(&points.share().len()), "{} points", points.share().len());
    }

    /// Of a sheet with all of the mass the smoothed density is W over the plane, wherever it is looked from.
    #[test]
    fn a_sheet_thinner_than_anything_is_seen_at_every_distance() {
        fn check<const D: usize>(count: usize) {
            let domain = cube::<D>(Axis::Periodic);
            let field = AnalyticField::<D>::new("density", "if(abs(x - 0.5) < 1e-5, 5e4, 0)", [0.0; D]).unwrap();
            let target = target(&domain, &field, count);
            let points = MassPoints::new(&target).unwrap();
            let places: Vec<[f64; D]> =
                (0..9).map(|i| sph::array(|k| if k == 0 { 0.5 + 0.025 * f64::from(i) } else { 0.3 })).collect();
            let support = vec![0.22; places.len()];
            let found = points.mass_densities(KERNEL, &domain, (&at_points(&places), &support), target.mass);
            for (x, found) in places.iter().zip(found) {
                let wanted = over_plane::<D>(x[0] - 0.5, 0.22);
                assert!((found - wanted).abs() < 5e-3 * over_plane::<D>(0.0, 0.22), "{D}-D {x:?}: {found} of {wanted}");
            }
        }
        check::<1>(100);
        check::<2>(1000);
        check::<3>(4000);
    }

    /// Masses of particles that differ are those of the density, wherever the points lie.
    #[test]
    fn where_particles_differ_in_mass_the_density_is_that_of_the_mass() {
        let domain = cube::<2>(Axis::Periodic);
        let field = AnalyticField::<2>::new("density", "1 + 0.5*sin(2*pi*x)", [0.0; 2]).unwrap();
        let finer = AnalyticField::<2>::new("density", "1 + 0.9*cos(2*pi*y)", [0.0; 2]).unwrap();
        let target = Target { resolution: Resolution::NumberDensity(&finer), ..target(&domain, &field, 20_000) };
        let points = MassPoints::new(&target).unwrap();
        let x = at_points(&[[0.25, 0.5], [0.75, 0.1], [0.0, 0.9]]);
        let found = points.mass_densities(KERNEL, &domain, (&x, &[0.1; 3]), target.mass);
        for (i, wanted) in [1.5, 0.5, 1.0].into_iter().enumerate() {
            assert!((found[i] / wanted - 1.0).abs() < 0.02, "{} of {wanted}", found[i]);
        }
    }

    /// Gradients against differences, and what points do at their own radii against sums over all pairs.
    #[test]
    fn gradients_are_those_of_the_sums() {
        fn check<const D: usize>() {
            let domain = cube::<D>(Axis::REFLECTING);
            let field = AnalyticField::<D>::new("density", "exp(-3*x)*(2 + cos(5*x))", [0.0; D]).unwrap();
            let target = target(&domain, &field, 120);
            let points = MassPoints::new(&target).unwrap();
            let (x, h) = ([0.4; D], 0.35);
            let value = |shift: f64| {
                let y = sph::array(|k| x[k] + if k == 0 { shift } else { 0.0 });
                points.number_densities(KERNEL, &domain, (&at_points(&[y]), &[h]), 120)[0]
            };
            let difference = (value(1e-2).weighted - value(-1e-2).weighted) / 2e-2;
            let found = value(0.0).gradient[0];
            assert!((found / difference - 1.0).abs() < 0.02, "{D}-D: {found} against {difference}");

            let n = points.share().len();
            let radii: Vec<f64> = (0..n).map(|c| 0.1 + 0.1 * points.positions()[0][c]).collect();
            let strength: Vec<f64> = (0..n).map(|c| 1.0 + 0.3 * points.positions()[0][c]).collect();
            let potential = |shift: f64| -> f64 {
                let y: [f64; D] = sph::array(|k| x[k] + if k == 0 { shift } else { 0.0 });
                let of = |c: usize| {
                    let r = (0..D).map(|k| (points.positions()[k][c] - y[k]).powi(2)).sum::<f64>().sqrt();
                    let shape = with_kernel!(KERNEL, kernel => evaluate::<_, D>(kernel, (r / radii[c]).min(1.0)).0);
                    strength[c] * KERNEL.sigma(D) * shape / radii[c].powi(D as i32)
                };
                (0..n).map(of).sum()
            };
            let difference = (potential(1e-4) - potential(-1e-4)) / 2e-4;
            let seen = points.seen_gradient(KERNEL, &domain, (&at_points(&[x]), &[0.15], &[1.0]), (&radii, &strength));
            assert!(
                (seen[0][0] - difference).abs() < 1e-3 * potential(0.0),
                "{D}-D: {} against {difference}",
                seen[0][0]
            );
        }
        check::<1>();
        check::<2>();
        check::<3>();
    }
}
