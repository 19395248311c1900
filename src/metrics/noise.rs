//! Noise of the pressure force: what a fluid at rest under constant pressure feels (Diehl et al. 2015, sec. 5).
//!
//! The force a_i of a constant pressure should vanish. It is made dimensionless as |a_i| rho_i H_i and set
//! against its root mean square in a random (Poisson) set of points, summed by the same code with the same
//! kernel and neighbor number.
//!
//! Part of it is systematic: where the target varies, the kernel's bias and the gradient of H leave a force that neighbors share.
//! More order does not help against that part, nor does a better density against the other. They are told apart by how forces
//! f of neighbors go together: the mean of f_i . <f_j> over the neighbors j of i, without i itself, is the mean square of what
//! varies slowly over a support radius, and zero for what varies from particle to particle.

use super::Measured;
use crate::random::{Purpose, keyed};
use crate::target::Positions;
use pulp::Simd;
use rand::RngExt;
use serde::Serialize;
use sph::domain::{Axis, Domain, Region};
use sph::exchange::{Alone, Exchange};
use sph::kernel::KernelName;
use sph::neighbors::{Batch, LeafPass, Reach, Sources, for_each_in_chosen_leaves};
use sph::sums::{Vector, support_guess};
use sph::{parallel, reduce};

/// The constant-pressure force as a fraction of that of a Poisson set: root mean square against root mean square, median
/// against median. Where the density jumps, a few particles make the first of the two.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseFigures {
    /// Over all particles.
    pub all: f64,
    /// The median over all particles.
    pub median: f64,
    /// Over particles whose support lies inside the domain, and that are in reach of none across a jump of the target.
    pub interior: Option<f64>,
    /// The median over these.
    pub interior_median: Option<f64>,
    /// What the interior's is made of, where that is asked for.
    pub parts: Option<NoiseParts>,
}

/// The two parts of the noise of the interior, whose squares add up to its square (over a sample of the particles).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseParts {
    /// What neighbors share: it varies slowly over a support radius.
    pub systematic: f64,
    /// What differs from particle to particle.
    pub scatter: f64,
}

impl NoiseFigures {
    /// The noise of `measured` with these masses; one Poisson set is measured beside it.
    pub fn new<const D: usize>(
        kernel: KernelName,
        measured: &Measured<D>,
        domain: &Domain<D>,
        masses: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        Self::among(&Alone, kernel, measured, domain, masses, kernel_neighbors)
    }

    /// [`Self::new`] of particles that are over several ranks.
    pub(super) fn among<const D: usize>(
        exchange: &dyn Exchange,
        kernel: KernelName,
        measured: &Measured<D>,
        domain: &Domain<D>,
        masses: &[f64],
        kernel_neighbors: f64,
    ) -> Self {
        let forces = measured.constant_pressure_forces(kernel, domain, masses);
        Self::of_forces(exchange, &forces, (measured, &measured.interior), kernel, kernel_neighbors).0
    }

    /// The same of particles over ranks, of which there may be one alone; that one tells the parts of the interior's. And the noise of each of
    /// this rank's particles.
    pub fn with_each<const D: usize>(
        exchange: &dyn Exchange,
        kernel: KernelName,
        (measured, interior): (&Measured<D>, &[bool]),
        domain: &Domain<D>,
        masses: &[f64],
        kernel_neighbors: f64,
    ) -> (Self, Vec<f64>) {
        let forces = measured.constant_pressure_forces(kernel, domain, masses);
        let (figures, squares, poisson) =
            Self::of_forces(exchange, &forces, (measured, interior), kernel, kernel_neighbors);
        // Forces of neighbors on other ranks are not known here.
        let parts = if exchange.is_alone() { parts(forces, (measured, interior), domain, poisson) } else { None };
        (Self { parts, ..figures }, squares.into_iter().map(|square| square.sqrt() / poisson).collect())
    }

    /// From forces in the tree's order. And the squares for each particle, with the root mean square of a Poisson set.
    fn of_forces<const D: usize>(
        exchange: &dyn Exchange,
        forces: &[Vector<D>],
        (measured, interior): (&Measured<D>, &[bool]),
        kernel: KernelName,
        kernel_neighbors: f64,
    ) -> (Self, Vec<f64>, f64) {
        let squares = squares(forces, measured);
        let random = poisson_squares::<D>(kernel, kernel_neighbors);
        let poisson = (reduce::sum(random.len(), |i| random[i]) / random.len() as f64).sqrt();
        let middle = median(&Alone, &random);
        let half = |squares: &[f64]| (median(exchange, squares) / middle).sqrt();
        let n = squares.len();
        let rms = |set: &(dyn Fn(usize) -> bool + Sync)| {
            let count = exchange.count((0..n).filter(|&i| set(i)).count());
            let mean = exchange.sum(reduce::sum(n, |i| if set(i) { squares[i] } else { 0.0 })) / count as f64;
            (count > 0).then(|| mean.sqrt() / poisson)
        };
        let inside: Vec<f64> = (0..n).filter(|&i| interior[i]).map(|i| squares[i]).collect();
        let interior = rms(&|i| interior[i]);
        let figures = Self {
            all: rms(&|_| true).unwrap_or(0.0),
            median: half(&squares),
            interior,
            interior_median: Some(half(&inside)).filter(|_| interior.is_some()),
            parts: None,
        };
        (figures, squares, poisson)
    }
}

/// Particles whose neighbors' forces are compared with their own, about: a mean needs no more.
const SAMPLED: usize = 50_000;
/// That many in a row: neighbors of one are mostly those of the next.
const ROW: usize = 64;

/// Forces along three axes, and whether a particle is in the interior.
const CHANNELS: usize = 4;

/// f_i . <f_j> and |f_i|^2.
#[derive(Debug, Clone, Copy, Default)]
struct Shared {
    product: f64,
    square: f64,
    is_known: bool,
}

struct SharedPass;

impl<const D: usize> LeafPass<D, CHANNELS, f64> for SharedPass {
    type Output = Shared;

    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, batch: &mut Batch<'_, D, CHANNELS, f64>, out: &mut [Shared]) {
        let (length, scale) = (batch.unit().length, batch.unit().channels);
        let targets = batch.targets();
        for (i, out) in targets.zip(out) {
            *out = Shared::default();
            let limit = (batch.support(i) / length).powi(2);
            let at = batch.target(i);
            let own: [f64; 3] = sph::array(|k| scale[k] * batch.target_channel(k, i));
            let (mut mean, mut weights) = ([0.0; 3], 0.0);
            for j in 0..batch.len() {
                let x = batch.position(j);
                let r2: f64 = (0..D).map(|k| (x[k] - at[k]).powi(2)).sum();
                // Not itself, nor what lies in the same place.
                if r2 >= limit || r2 < 1e-24 {
                    continue;
                }
                let weight = (1.0 - r2 / limit).powi(2) * batch.channel(3, j);
                weights += weight;
                (0..3).for_each(|k| mean[k] += weight * scale[k] * batch.channel(k, j));
            }
            if weights > 0.0 {
                let product = own.iter().zip(mean).map(|(f, m)| f * m).sum::<f64>() / weights;
                *out = Shared { product, square: own.iter().map(|f| f * f).sum(), is_known: true };
            }
        }
    }
}

/// The parts of the noise of the interior; none where there is no interior.
fn parts<const D: usize>(
    forces: Vec<Vector<D>>,
    (measured, interior): (&Measured<D>, &[bool]),
    domain: &Domain<D>,
    poisson: f64,
) -> Option<NoiseParts> {
    let tree = &measured.tree;
    let order = tree.order();
    let own = |place: usize| order[place] as usize;
    // As a fraction of what one neighbor does; first of all, since forces are the most that a run holds here.
    let along: [Vec<f64>; D] = std::array::from_fn(|k| {
        parallel::map(order.len(), |p| forces[p].0[k] * measured.sums[own(p)].weighted * measured.support[own(p)])
    });
    drop(forces);
    let inside = tree.to_tree_order(interior);
    let every = order.len().div_ceil(SAMPLED);
    let is_taken = |i: usize| inside[i] && (i / ROW).is_multiple_of(every);
    let support = parallel::map(order.len(), |p| if is_taken(p) { measured.support[own(p)] } else { 0.0 });
    let is_inside = parallel::map(order.len(), |p| f64::from(u8::from(inside[p])));
    let none = if D < 3 { vec![0.0; order.len()] } else { Vec::new() };
    let channels: [&[f64]; CHANNELS] = std::array::from_fn(|c| match c {
        3 => is_inside.as_slice(),
        _ => along.get(c).unwrap_or(&none),
    });
    let sources = [Sources::new(tree, &support, channels, Reach::Target)];
    let found = for_each_in_chosen_leaves::<D, CHANNELS, f64, _>(domain, &sources, 1.0, &SharedPass);
    let count = found.iter().filter(|s| s.is_known).count();
    let mean = |of: &(dyn Fn(&Shared) -> f64 + Sync)| reduce::sum(found.len(), |i| of(&found[i])) / count as f64;
    let square = mean(&|s| s.square);
    // Of none, and of sums beyond f64, nothing can be said.
    if !square.is_finite() {
        return None;
    }
    let shared = mean(&|s| s.product).max(0.0).min(square);
    Some(NoiseParts { systematic: shared.sqrt() / poisson, scatter: (square - shared).sqrt() / poisson })
}

/// (|a_i| rho_i H_i)^2 of every particle of this rank, from forces in the tree's order.
fn squares<const D: usize>(forces: &[Vector<D>], measured: &Measured<D>) -> Vec<f64> {
    let mut squares = vec![0.0; forces.len()];
    for (force, &i) in forces.iter().zip(measured.tree.order()) {
        let (sums, support) = (&measured.sums[i as usize], measured.support[i as usize]);
        squares[i as usize] = force.0.iter().map(|f| f * f).sum::<f64>() * (sums.weighted * support).powi(2);
    }
    squares.truncate(measured.own());
    squares
}

/// The same from particles that are measured.
pub(super) fn force_squares<const D: usize>(
    kernel: KernelName,
    measured: &Measured<D>,
    domain: &Domain<D>,
    masses: &[f64],
) -> Vec<f64> {
    squares(&measured.constant_pressure_forces(kernel, domain, masses), measured)
}

/// Points of the reference set: its force is known to about 1 %.
const POISSON_POINTS: usize = 10_000;

/// Root mean square of |a| rho H over random points in a periodic unit box.
pub fn poisson_force<const D: usize>(kernel: KernelName, kernel_neighbors: f64) -> f64 {
    let squares = poisson_squares::<D>(kernel, kernel_neighbors);
    (reduce::sum(POISSON_POINTS, |i| squares[i]) / POISSON_POINTS as f64).sqrt()
}

fn median(exchange: &dyn Exchange, values: &[f64]) -> f64 {
    let count = exchange.count(values.len());
    if count == 0 { 0.0 } else { exchange.nth(&mut values.to_vec(), count / 2) }
}

/// (|a| rho H)^2 of random points in a periodic unit box.
fn poisson_squares<const D: usize>(kernel: KernelName, kernel_neighbors: f64) -> Vec<f64> {
    let mut positions: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(POISSON_POINTS));
    for i in 0..POISSON_POINTS {
        let mut rng = keyed(0, Purpose::Measure, 1 + i as u64);
        positions.iter_mut().for_each(|x| x.push(rng.random::<f64>()));
    }
    let domain = Domain { lo: [0.0; D], hi: [1.0; D], axes: [Axis::Periodic; D], region: Region::Box };
    let masses = vec![1.0 / POISSON_POINTS as f64; POISSON_POINTS];
    let spacing = (POISSON_POINTS as f64).powf(-1.0 / D as f64);
    let guess = support_guess::<D>(kernel_neighbors, POISSON_POINTS, |_| spacing);
    let measured = Measured::new(kernel, &domain, &positions, &masses, &guess, kernel_neighbors);
    squares(&measured.constant_pressure_forces(kernel, &domain, &masses), &measured)
}
