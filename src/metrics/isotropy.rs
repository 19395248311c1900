//! Isotropy: whether the directions to neighbors are the same everywhere, as in a lattice, or uniformly distributed, as in a glass.
//!
//! Bond-orientational order after Steinhardt, Nelson & Ronchetti (1983, Phys. Rev. B 28, 784, eqs. 1.2 and 1.3),
//! taken over all bonds at once: Q_l^2 = 4 pi/(2l + 1) sum_m |<Y_lm(bond)>|^2 for l = 4 and 6; in the plane
//! |<exp(i l theta)>|. A perfect lattice has (Q_4, Q_6) = (0.76, 0.35) simple cubic, (0.19, 0.57) face-centered cubic,
//! (0.10, 0.48) hexagonal close-packed, (1, 0) square, (0, 1) hexagonal; directions that are all alike leave one over the
//! square root of the number of bonds. Crystals that lie askew to each other cancel, as do shells about a
//! center: the measure shows preferred directions in space, not local order.

use super::Measured;
use pulp::Simd;
use serde::Serialize;
use sph::domain::Domain;
use sph::exchange::{Alone, Exchange};
use sph::neighbors::{Batch, LeafPass, Reach, Sources, for_each_in_chosen_leaves};
use sph::{parallel, reduce};

/// Bond-orientational order of all particles together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BondOrder {
    /// 0 (no preferred direction) to 1.
    pub q4: f64,
    pub q6: f64,
    /// What random directions would leave: 1/sqrt(bonds).
    pub random: f64,
}

/// Particles that are sampled, about, and how many in a row.
const SAMPLED: usize = 50_000;
const ROW: usize = 64;
/// Bonds reach this many spacings n^(-1/d): between the first and second neighbors of all common lattices.
const REACH: f64 = 1.3;
/// Real and imaginary parts for l = 4 (m = 0 to 4), then l = 6 (m = 0 to 6).
const TERMS: usize = 24;
const FIRST_OF_SIX: usize = 10;

#[derive(Debug, Clone, Copy)]
struct Bonds {
    sums: [f64; TERMS],
    count: u32,
}

impl Default for Bonds {
    fn default() -> Self {
        Self { sums: [0.0; TERMS], count: 0 }
    }
}

struct BondPass<'a> {
    reach: &'a [f64],
}

impl<const D: usize> LeafPass<D, 0, f64> for BondPass<'_> {
    type Output = Bonds;

    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, 0, f64>, out: &mut [Bonds]) {
        let length = batch.unit().length;
        for (i, out) in batch.targets().zip(out) {
            let target = batch.target(i);
            let limit = (self.reach[i] / length).powi(2);
            *out = Bonds::default();
            for j in 0..batch.len() {
                let x = batch.position(j);
                let d: [f64; D] = sph::array(|k| x[k] - target[k]);
                let r2 = d.iter().map(|v| v * v).sum::<f64>();
                if r2 < limit && r2 > 1e-24 {
                    let r = r2.sqrt();
                    out.add(&d.map(|v| v / r));
                }
            }
        }
    }
}

impl Bonds {
    /// Counts a bond in the direction of the unit vector `d`.
    fn add<const D: usize>(&mut self, d: &[f64; D]) {
        self.count += 1;
        let azimuth = if D > 1 { d[1].atan2(d[0]) } else { 0.0 };
        if D < 3 {
            for (first, l) in [(0, 4.0), (FIRST_OF_SIX, 6.0)] {
                self.sums[first] += (l * azimuth).cos();
                self.sums[first + 1] += (l * azimuth).sin();
            }
            return;
        }
        for (first, l) in [(0, 4_i32), (FIRST_OF_SIX, 6)] {
            for m in 0..=l {
                let amplitude = legendre(l, m, d[D - 1]);
                let (sin, cos) = (f64::from(m) * azimuth).sin_cos();
                self.sums[first + 2 * m as usize] += amplitude * cos;
                self.sums[first + 2 * m as usize + 1] += amplitude * sin;
            }
        }
    }
}

/// Associated Legendre function with the factor that makes sum_m over -l..=l of its squares 1 at every point.
fn legendre(l: i32, m: i32, x: f64) -> f64 {
    let s = (1.0 - x * x).max(0.0).sqrt();
    let mut before = 0.0;
    let mut now = (0..m).map(|k| f64::from(2 * k + 1) * s).product::<f64>();
    for n in m + 1..=l {
        let next = (f64::from(2 * n - 1) * x * now - f64::from(n + m - 1) * before) / f64::from(n - m);
        (before, now) = (now, next);
    }
    let ratio: f64 = (l - m + 1..=l + m).map(f64::from).product();
    now / ratio.sqrt()
}

impl BondOrder {
    /// The order of all bonds of `measured`; none in one dimension and without bonds.
    pub fn new<const D: usize>(measured: &Measured<D>, domain: &Domain<D>) -> Option<Self> {
        Self::of_every(&Alone, 1, measured, domain)
    }

    /// The order of the bonds of as many particles, over all ranks, as tell it to a thousandth.
    pub fn sampled<const D: usize>(
        exchange: &dyn Exchange,
        measured: &Measured<D>,
        domain: &Domain<D>,
    ) -> Option<Self> {
        Self::of_every(exchange, exchange.count(measured.own()).div_ceil(SAMPLED), measured, domain)
    }

    /// What a reader compares the two with.
    pub fn yardsticks(dimension: usize) -> &'static str {
        if dimension == 2 {
            "square lattice 1 and 0, hexagonal 0 and 1"
        } else {
            "fcc 0.19 and 0.57, hcp 0.10 and 0.48, bcc 0.04 and 0.51, cubic 0.76 and 0.35; glasses and shells below 0.05"
        }
    }

    fn of_every<const D: usize>(
        exchange: &dyn Exchange,
        every: usize,
        measured: &Measured<D>,
        domain: &Domain<D>,
    ) -> Option<Self> {
        if D < 2 {
            return None;
        }
        let (order, own) = (measured.tree.order(), measured.own());
        let reach = parallel::map(order.len(), |place| {
            let i = order[place] as usize;
            // Rows, whose members have neighbors in common; those of other ranks are sampled there.
            let is_taken = (place / ROW).is_multiple_of(every.max(1)) && i < own;
            if is_taken { REACH * measured.sums[i].number_density.powf(-1.0 / D as f64) } else { 0.0 }
        });
        let sources = [Sources::<D, 0>::new(&measured.tree, &reach, [], Reach::Target)];
        let found = for_each_in_chosen_leaves::<D, 0, f64, _>(domain, &sources, 1.0, &BondPass { reach: &reach });
        let bonds = exchange.sum(reduce::sum(found.len(), |i| f64::from(found[i].count)));
        let sum = |term: usize| reduce::sum(found.len(), |i| found[i].sums[term]);
        let totals = exchange.sums((0..TERMS).map(sum).collect());
        let mean = |term: usize| totals[term] / bonds;
        let order = |first: usize, l: usize| {
            // Negative m have the same size; in the plane there is one term.
            let weight = |m: usize| if m > 0 { 2.0 } else { 1.0 };
            let size2 = |m: usize| mean(first + 2 * m).powi(2) + mean(first + 2 * m + 1).powi(2);
            (0..=if D > 2 { l } else { 0 }).map(|m| weight(m) * size2(m)).sum::<f64>().sqrt()
        };
        (bonds > 0.0).then(|| Self { q4: order(0, 4), q6: order(FIRST_OF_SIX, 6), random: bonds.sqrt().recip() })
    }

    /// The larger of the two.
    pub fn largest(&self) -> f64 {
        self.q4.max(self.q6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, keyed};
    use crate::target::Positions;
    use rand::RngExt;
    use sph::domain::{Axis, Region};
    use sph::kernel::{KernelName, default_kernel_neighbors};

    fn order<const D: usize>(extent: [f64; D], x: &Positions<D>) -> BondOrder {
        let domain = Domain::new([0.0; D], extent, [Axis::Periodic; D], Region::Box).unwrap();
        let n = x[0].len();
        let guess = vec![2.5 * domain.mean_spacing(n); n];
        let neighbors = default_kernel_neighbors(D);
        let measured = Measured::new(KernelName::WendlandC4, &domain, x, &vec![1.0; n], &guess, neighbors);
        BondOrder::new(&measured, &domain).unwrap()
    }

    /// `sites` (in edges) in every cell of `cells`.
    fn lattice<const D: usize>(cells: usize, edges: [f64; D], sites: &[[f64; D]]) -> ([f64; D], Positions<D>) {
        let mut x: Positions<D> = std::array::from_fn(|_| Vec::new());
        for cell in 0..cells.pow(D as u32) {
            for site in sites {
                for k in 0..D {
                    let index = cell / cells.pow(k as u32) % cells;
                    x[k].push((index as f64 + site[k] + 1e-3) * edges[k]);
                }
            }
        }
        (edges.map(|e| e * cells as f64), x)
    }

    fn is(got: BondOrder, q4: f64, q6: f64) {
        assert!((got.q4 - q4).abs() < 1e-3 && (got.q6 - q6).abs() < 1e-3, "{got:?} against {q4} {q6}");
    }

    #[test]
    fn lattices_have_the_published_order() {
        let (extent, x) = lattice(8, [1.0; 3], &[[0.0; 3]]);
        is(order(extent, &x), 0.7638, 0.3536);
        let (extent, x) = lattice(6, [1.0; 3], &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]]);
        is(order(extent, &x), 0.1909, 0.5745);
        let (extent, x) = lattice(12, [1.0; 2], &[[0.0; 2]]);
        is(order(extent, &x), 1.0, 0.0);
        let (extent, x) = lattice(12, [1.0, 3_f64.sqrt()], &[[0.0; 2], [0.5; 2]]);
        is(order(extent, &x), 0.0, 1.0);
    }

    #[test]
    fn random_points_have_none() {
        fn check<const D: usize>() {
            let mut x: Positions<D> = std::array::from_fn(|_| Vec::new());
            for i in 0..4000 {
                let mut rng = keyed(11, Purpose::Measure, i);
                x.iter_mut().for_each(|x| x.push(rng.random::<f64>()));
            }
            let got = order([1.0; D], &x);
            assert!(got.largest() < 4.0 * got.random && got.random < 0.02, "{got:?}");
        }
        check::<2>();
        check::<3>();
    }

    /// The addition theorem: at any point the squares add up to one.
    #[test]
    fn the_functions_are_normalized() {
        for l in [4, 6] {
            for x in [-0.9, 0.0, 0.3, 1.0] {
                let sum: f64 = (0..=l).map(|m| if m > 0 { 2.0 } else { 1.0 } * legendre(l, m, x).powi(2)).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{l} {x}: {sum}");
            }
        }
    }
}
