//! The mass ledger: compares the target's mass in nested boxes and in each of its regions with the mass of the particles there.
//!
//! Boxes come from halving the target's mass again and again, down to some hundred particles, so that each of a level
//! should hold the same mass. A particle counts as a cube of its own volume: one that a box cuts in two belongs to both
//! sides in proportion, so that an even arrangement fills boxes evenly wherever their faces lie.

use super::Measured;
use super::centers;
use crate::target::cells::{Cell, Rule};
use crate::target::cut::{Cut, cut_closely};
use crate::target::mass_points::MassPoints;
use crate::target::partition::partition;
use crate::target::refinement::refine;
use crate::target::{Positions, Resolution, Target, at};
use serde::Serialize;
use sph::domain::{Axis, Domain};
use sph::exchange::{Alone, Exchange};
use sph::parallel;
use std::sync::{Arc, OnceLock};

/// How well particles keep to the ledger.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LedgerFigures {
    /// From halves of the whole to the smallest boxes.
    pub levels: Vec<LedgerLevel>,
    /// Share of the mass in the smallest boxes that hold what they should to [`IN_PLACE`].
    pub in_place: f64,
    /// Of pieces of the target that discontinuities or vacuum separate; empty where there is but one.
    pub regions: Vec<RegionFigures>,
}

/// Deviation of a box within which its mass counts as being where it should be.
pub const IN_PLACE: f64 = 0.01;

/// All boxes of one level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LedgerLevel {
    pub boxes: usize,
    /// Largest |found / wanted - 1|, the mass as given.
    pub largest_deviation: f64,
    /// Root mean square of found / wanted - 1.
    pub rms_deviation: f64,
}

/// One region of the target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RegionFigures {
    /// Particles that belong there, and that are there.
    pub wanted: f64,
    pub found: f64,
    /// Distance of the particles' center from that of the region over the mean spacing there, where all is done; none where few particles are, or the
    /// region has one center with all others.
    pub shift: Option<f64>,
}

impl RegionFigures {
    /// Whether what is there is within `share` of what should be, or within one particle.
    pub fn is_kept(&self, share: f64) -> bool {
        (self.found - self.wanted).abs() <= (share * self.wanted).max(1.0)
    }
}

impl LedgerFigures {
    /// Largest deviation of any level.
    pub fn largest_deviation(&self) -> f64 {
        self.levels.iter().map(|l| l.largest_deviation).fold(0.0, f64::max)
    }

    /// The largest distance of a region's particles from where they belong as a whole, in spacings.
    pub fn largest_shift(&self) -> Option<f64> {
        self.regions.iter().filter_map(|region| region.shift).reduce(f64::max)
    }

    /// The region that is farthest from what it should hold, in particles.
    pub fn worst_region(&self) -> Option<&RegionFigures> {
        let off = |r: &RegionFigures| (r.found - r.wanted).abs();
        self.regions.iter().max_by(|a, b| off(a).total_cmp(&off(b)))
    }
}

/// The mass that a target has in nested boxes.
pub struct Ledger<const D: usize> {
    domain: Domain<D>,
    nodes: Vec<Node>,
    levels: usize,
    /// Particles that it was made for: those that a stage begins with may be fewer.
    count: usize,
    /// What the target was divided into first, where it was.
    cells: Vec<Cell<D>>,
    points: OnceLock<Option<Arc<MassPoints<D>>>>,
}

/// That of a target, made when it is first asked for.
pub struct LedgerOf<'a, const D: usize> {
    target: Target<'a, D>,
    ledger: OnceLock<Ledger<D>>,
}

impl<'a, const D: usize> LedgerOf<'a, D> {
    pub const fn new(target: Target<'a, D>) -> Self {
        Self { target, ledger: OnceLock::new() }
    }

    pub fn get(&self) -> &Ledger<D> {
        self.ledger.get_or_init(|| Ledger::new(&self.target))
    }

    /// The points of mass of the whole target, where `target` is that: a stage is of it, of a part of it or of fewer particles.
    pub(crate) fn points_of_whole(&self, target: &Target<'_, D>) -> Option<Option<Arc<MassPoints<D>>>> {
        let is_whole = target.count == self.target.count && target.part.is_none() && self.target.part.is_none();
        is_whole.then(|| self.get().shared_points(&self.target))
    }
}

/// A box: a cut one, whose left half comes next, or the smallest.
#[derive(Debug, Clone, Copy)]
struct Node {
    axis: usize,
    plane: f64,
    /// How far the right half is ahead; 0 for the smallest.
    right: usize,
    level: usize,
}

/// One that is not cut, of the first level.
const SMALLEST_BOX: Node = Node { axis: 0, plane: 0.0, right: 0, level: 0 };
/// Particles in the smallest boxes, at least.
const SMALLEST: usize = 128;
/// Halvings, at most.
const MOST_LEVELS: usize = 12;
/// Cells by which a box's mass is known, at least: so many, or, of few particles, so many of each of them. With them, and those at a
/// plane sliced, boxes of a star are known to some 1e-3; 32 times as many say the same of its shells.
const CELLS: usize = 1 << 11;
const CELLS_PER_PARTICLE: usize = 8;

impl<const D: usize> Ledger<D> {
    /// The boxes of `target`; none where it is zero wherever it is looked at, or has too few particles.
    pub fn new(target: &Target<'_, D>) -> Self {
        let levels = ((target.count / SMALLEST).max(1)).ilog2() as usize;
        let levels = levels.min(MOST_LEVELS);
        let (cells, nodes) = match levels {
            // One box holds all: nothing is to be found.
            0 => (Vec::new(), vec![SMALLEST_BOX]),
            _ => partition(target, Rule::Gauss)
                .map_or_else(|_| (Vec::new(), Vec::new()), |cells| (cells.clone(), divided(target, cells, 0, levels))),
        };
        Self { domain: target.domain.clone(), nodes, levels, count: target.count, cells, points: OnceLock::new() }
    }

    /// Whether [`Self::points`] would be too many.
    pub(super) fn has_too_many_points(&self, target: &Target<'_, D>) -> bool {
        MassPoints::are_too_many(&self.for_all(target))
    }

    /// The target as points of mass, found when they are first asked for; none where it is zero wherever it is looked at.
    pub(super) fn points(&self, target: &Target<'_, D>) -> Option<&MassPoints<D>> {
        self.find_points(target).as_deref()
    }

    /// The same, to be kept by others.
    fn shared_points(&self, target: &Target<'_, D>) -> Option<Arc<MassPoints<D>>> {
        self.find_points(target).clone()
    }

    fn find_points(&self, target: &Target<'_, D>) -> &Option<Arc<MassPoints<D>>> {
        let find = || match self.for_all(target) {
            all if self.cells.is_empty() || MassPoints::are_too_many(&all) => MassPoints::new(&all),
            all => Some(MassPoints::of_cells(&all, &self.cells)),
        };
        self.points.get_or_init(|| find().map(Arc::new))
    }

    fn for_all<'a>(&self, target: &Target<'a, D>) -> Target<'a, D> {
        target.with_count(target.count.max(self.count))
    }

    /// What `target.count` particles with these masses have in each box and region; where the resolution is one of its own, they count
    /// alike, and the mass of each is what the target says.
    pub fn figures(
        &self,
        measured: &Measured<D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        masses: &[f64],
    ) -> LedgerFigures {
        self.figures_among(&Alone, measured, target, positions, masses)
    }

    /// [`Self::figures`] of particles that are over several ranks.
    pub fn figures_among(
        &self,
        exchange: &dyn Exchange,
        measured: &Measured<D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        masses: &[f64],
    ) -> LedgerFigures {
        // Boxes are of equal numbers of particles where these do not go by mass.
        let alike = matches!(target.resolution, Resolution::NumberDensity(_)).then(|| vec![1.0; masses.len()]);
        let masses = alike.as_deref().unwrap_or(masses);
        let found = exchange.sums(self.found(measured, target, positions, masses));
        LedgerFigures { regions: region_figures(exchange, target, positions), ..self.figures_of(&found) }
    }

    /// How far the particles of each region are from it as a whole; none where all have the center of the whole, or would take too many points.
    pub(super) fn shifts(&self, target: &Target<'_, D>, positions: &Positions<D>) -> Vec<Option<f64>> {
        let Some(regions) = target.regions().filter(|_| target.density.center().is_none()) else { return Vec::new() };
        if self.has_too_many_points(target) {
            return Vec::new();
        }
        let Some(points) = self.points(target) else { return Vec::new() };
        centers::shifts((target, regions), &centers::of_points((target.domain, regions), points), positions)
    }

    /// What the first of the measured particles, which these are, have in each box: those of others add up with it.
    pub fn found(
        &self,
        measured: &Measured<D>,
        target: &Target<'_, D>,
        positions: &Positions<D>,
        masses: &[f64],
    ) -> Vec<f64> {
        let edge = |i: usize| measured.sums[i].number_density.powf(-1.0 / D as f64);
        let home = |x: &[f64; D]| target.regions().and_then(|regions| regions.of(x));
        self.in_boxes((positions, masses), &edge, &home)
    }

    /// The figures of what all particles have in each box, where there are no regions.
    pub fn figures_of(&self, found: &[f64]) -> LedgerFigures {
        let (levels, in_place) = self.compared(found);
        LedgerFigures { levels, in_place, regions: Vec::new() }
    }

    fn in_boxes(
        &self,
        (positions, masses): (&Positions<D>, &[f64]),
        edge: &(dyn Fn(usize) -> f64 + Sync),
        home: &(dyn Fn(&[f64; D]) -> Option<usize> + Sync),
    ) -> Vec<f64> {
        let found = parallel::pieces(masses.len(), masses.len().div_ceil(PIECES).max(SMALLEST), |range| {
            let mut found = vec![0.0; self.nodes.len()];
            range.for_each(|i| self.enter(&mut found, &at(positions, i), (edge(i), masses[i]), home));
            found
        });
        (0..self.nodes.len()).map(|k| found.iter().map(|f| f[k]).sum()).collect()
    }

    /// Levels, and the share of the mass that is in place.
    fn compared(&self, found: &[f64]) -> (Vec<LedgerLevel>, f64) {
        let total = found.first().copied().unwrap_or(0.0);
        let deviations = |level: usize| {
            let of_level = self.nodes.iter().zip(found).filter(move |(node, _)| node.level == level);
            of_level.map(move |(_, found)| found / total * (1_usize << level) as f64 - 1.0)
        };
        let levels = (1..=self.levels).map(|level| {
            let (largest, squares) = deviations(level).fold((0.0_f64, 0.0), |(m, s), d| (m.max(d.abs()), s + d * d));
            let boxes = 1_usize << level;
            LedgerLevel { boxes, largest_deviation: largest, rms_deviation: (squares / boxes as f64).sqrt() }
        });
        let smallest = (1_usize << self.levels) as f64;
        let in_place = deviations(self.levels).filter(|d| d.abs() <= IN_PLACE).count() as f64 / smallest;
        (levels.collect(), in_place)
    }

    /// Adds a cube of mass `m` to the boxes that it is in; `home` tells the region of a place.
    fn enter(&self, found: &mut [f64], x: &[f64; D], (edge, m): (f64, f64), home: &dyn Fn(&[f64; D]) -> Option<usize>) {
        if self.nodes.is_empty() {
            return;
        }
        let half = 0.5 * edge;
        let is_of_another = |lo: &[f64; D], hi: &[f64; D]| {
            let there = self.domain.wrapped(&sph::array(|k| 0.5 * (lo[k] + hi[k])));
            home(&there) != home(x)
        };
        self.enter_wrapped(found, (x.map(|v| v - half), x.map(|v| v + half)), m, 0, &is_of_another);
    }

    /// Divides what reaches beyond a periodic face, from `axis` on. Where another region begins there, nothing does: the particle's own
    /// volume ends at the face.
    fn enter_wrapped(
        &self,
        found: &mut [f64],
        (lo, hi): ([f64; D], [f64; D]),
        m: f64,
        axis: usize,
        is_of_another: &dyn Fn(&[f64; D], &[f64; D]) -> bool,
    ) {
        let Some(axis) = (axis..D).find(|&k| self.domain.axes[k] == Axis::Periodic) else {
            return self.descend(found, 0, lo, hi, m);
        };
        let (first, last) = (self.domain.lo[axis], self.domain.hi[axis]);
        let (width, length) = (hi[axis] - lo[axis], last - first);
        if !(width > 0.0 && width < length) {
            return self.enter_wrapped(found, (lo, hi), m, axis + 1, is_of_another);
        }
        let between = |from: f64, to: f64| {
            let (mut a, mut b) = (lo, hi);
            (a[axis], b[axis]) = (from, to);
            (to > from).then_some((a, b))
        };
        let own = |part: Option<([f64; D], [f64; D])>| part.filter(|(a, b)| !is_of_another(a, b));
        let beyond = [(own(between(lo[axis], first)), length), (own(between(last, hi[axis])), -length)];
        let inside = between(lo[axis].max(first), hi[axis].min(last));
        let width = |part: &Option<([f64; D], [f64; D])>| part.map_or(0.0, |(a, b)| b[axis] - a[axis]);
        let whole: f64 = width(&inside) + beyond.iter().map(|(part, _)| width(part)).sum::<f64>();
        for (part, shift) in beyond.into_iter().chain([(inside, 0.0)]) {
            let share = width(&part) / whole;
            if let Some((mut a, mut b)) = part {
                a[axis] += shift;
                b[axis] += shift;
                self.enter_wrapped(found, (a, b), m * share, axis + 1, is_of_another);
            }
        }
    }

    fn descend(&self, found: &mut [f64], place: usize, lo: [f64; D], hi: [f64; D], m: f64) {
        found[place] += m;
        let Node { axis, plane, right, .. } = self.nodes[place];
        if right == 0 {
            return;
        }
        let halves = [place + 1, place + right];
        if hi[axis] <= plane {
            self.descend(found, halves[0], lo, hi, m);
        } else if lo[axis] >= plane {
            self.descend(found, halves[1], lo, hi, m);
        } else {
            let share = (plane - lo[axis]) / (hi[axis] - lo[axis]);
            let (mut left, mut right) = (hi, lo);
            (left[axis], right[axis]) = (plane, plane);
            self.descend(found, halves[0], lo, left, share * m);
            self.descend(found, halves[1], right, hi, (1.0 - share) * m);
        }
    }
}

/// The box that `cells` fill, with all that is in it.
fn divided<const D: usize>(target: &Target<'_, D>, mut cells: Vec<Cell<D>>, level: usize, levels: usize) -> Vec<Node> {
    if level == levels {
        return vec![Node { level, ..SMALLEST_BOX }];
    }
    refine(target, &mut cells, (CELLS_PER_PARTICLE * (target.count >> level)).min(CELLS), Rule::Shared);
    let Cut { axis, plane, left, right } = cut_closely(target, cells, 0.5, Rule::Shared);
    let (left, right) =
        parallel::join(|| divided(target, left, level + 1, levels), || divided(target, right, level + 1, levels));
    let mut nodes = vec![Node { axis, plane, right: 1 + left.len(), level }];
    nodes.extend(left);
    nodes.extend(right);
    nodes
}

/// Particles in each region of the target.
fn region_figures<const D: usize>(
    exchange: &dyn Exchange,
    target: &Target<'_, D>,
    positions: &Positions<D>,
) -> Vec<RegionFigures> {
    let Some(regions) = target.regions() else { return Vec::new() };
    let n = positions[0].len();
    let mut found = vec![0.0; regions.number()];
    parallel::map(n, |i| regions.of(&at(positions, i))).into_iter().flatten().for_each(|region| found[region] += 1.0);
    let (found, n) = (exchange.sums(found), exchange.count(n));
    let wanted = |region: usize| regions.get(region).share * n as f64;
    found
        .iter()
        .enumerate()
        .map(|(region, &found)| RegionFigures { wanted: wanted(region), found, shift: None })
        .collect()
}

/// Parts of the particles that are summed by themselves: as many for any number of threads.
const PIECES: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{AnalyticField, ScalarField};
    use sph::domain::Region;

    fn target<'a, const D: usize>(
        domain: &'a Domain<D>,
        density: &'a dyn ScalarField<D>,
        count: usize,
    ) -> Target<'a, D> {
        let mass = crate::field::total_mass(density, domain, 1e-6).unwrap().value;
        let resolution = Resolution::EqualMass;
        Target {
            domain,
            density,
            resolution,
            count,
            mass,
            resolution_integral: mass,
            largest_spacing: f64::INFINITY,
            pieces: None,
            part: None,
        }
    }

    fn lattice<const D: usize>(edge: usize) -> Positions<D> {
        let place = |i: usize, k: usize| ((i / edge.pow(k as u32) % edge) as f64 + 0.3) / edge as f64;
        std::array::from_fn(|k| (0..edge.pow(D as u32)).map(|i| place(i, k)).collect())
    }

    /// Of what is even in u, x = u^1.1 has 2 (1/2)^(1/1.1) - 1 too much in the half next to the origin.
    #[test]
    fn a_shift_of_mass_is_found_at_every_level() {
        fn check<const D: usize>(edge: usize) {
            for axis in [Axis::Periodic, Axis::REFLECTING] {
                let domain = Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap();
                let field = AnalyticField::<D>::new("density", "1", [0.0; D]).unwrap();
                let mut x = lattice::<D>(edge);
                let n = x[0].len();
                let ledger = Ledger::new(&target(&domain, &field, n));
                let spacing = 1.0 / edge as f64;
                let masses = vec![1.0 / n as f64; n];
                let (levels, in_place) = ledger.compared(&ledger.in_boxes((&x, &masses), &|_| spacing, &|_| None));
                let even = levels.iter().map(|l| l.largest_deviation).fold(0.0, f64::max);
                if axis == Axis::Periodic {
                    assert!(even < 1e-9 && in_place == 1.0, "{D}-D: {even:e}");
                }
                // Everything moves toward the origin: x -> x^1.1 along the first axis.
                x[0].iter_mut().for_each(|v| *v = v.powf(1.1));
                let (levels, in_place) = ledger.compared(&ledger.in_boxes((&x, &masses), &|_| spacing, &|_| None));
                let (found, shifted) = (levels[0].largest_deviation, 2.0 * 0.5_f64.powf(1.0 / 1.1) - 1.0);
                assert!((found - shifted).abs() < 0.5 * spacing, "{D}-D: {found} {shifted}");
                assert!(in_place < 0.7, "{D}-D: {in_place}");
            }
        }
        check::<1>(1000);
        check::<2>(40);
        check::<3>(12);
    }

    /// At a periodic face with hardly anything beyond it no particle's volume counts there.
    #[test]
    fn volumes_end_where_another_region_begins() {
        fn check<const D: usize>(edge: usize) {
            let hi = sph::array(|k| if k == 0 { 4.0 } else { 1.0 });
            let domain = Domain::new([0.0; D], hi, [Axis::Periodic; D], Region::Box).unwrap();
            let field = AnalyticField::<D>::new("density", "if(x > 2, 1e6, 1)", [0.0; D]).unwrap();
            let n = edge.pow(D as u32);
            let target = target(&domain, &field, n);
            let ledger = Ledger::new(&target);
            // Layers in their places, with volumes so wide that a quarter of the outermost one's reaches beyond the face.
            let mut x = lattice::<D>(edge);
            x[0].iter_mut().for_each(|v| *v = 2.0 + 2.0 * (*v + 0.2 / edge as f64));
            let (width, masses) = (4.0 / edge as f64, vec![1.0; n]);
            let off = |home: &(dyn Fn(&[f64; D]) -> Option<usize> + Sync)| {
                let (levels, _) = ledger.compared(&ledger.in_boxes((&x, &masses), &|_| width, home));
                levels[0].largest_deviation
            };
            let (bound, free) = (off(&|x| Some(usize::from(x[0] > 2.0))), off(&|_| None));
            assert!((free * edge as f64 - 0.5).abs() < 0.01, "{D}-D: {free}");
            assert!(bound < 0.1 * free, "{D}-D: {bound} and {free}");
        }
        check::<1>(400);
        check::<2>(40);
        check::<3>(12);
    }

    #[test]
    fn boxes_follow_the_mass_of_a_steep_target() {
        let domain = Domain::new([0.0; 2], [1.0; 2], [Axis::OPEN; 2], Region::Box).unwrap();
        let field = AnalyticField::<2>::new("density", "exp(-x/0.01)", [0.0; 2]).unwrap();
        let n = 1600;
        let target = target(&domain, &field, n);
        // Quantiles of the exponential in x, even in y.
        let u = |i: usize| (i as f64 + 0.5) / 40.0;
        let x = [(0..n).map(|i| -0.01 * (1.0 - u(i % 40)).ln()).collect(), (0..n).map(|i| u(i / 40)).collect()];
        let ledger = Ledger::new(&target);
        let (levels, in_place) =
            ledger.compared(&ledger.in_boxes((&x, &vec![1.0 / n as f64; n]), &|_| 1e-6, &|_| None));
        assert!(levels[0].largest_deviation < 0.06, "{levels:?}");
        assert!(in_place <= 1.0);
    }
}
