//! The pushes of weighted Voronoi tessellation relaxation (Diehl et al. 2015, PASA 32, e048, sec. 4): away from all
//! neighbors within the support radius.

use super::registers::{separation, splat};
use crate::domain::Domain;
use crate::kernel::{Kernel, KernelName, evaluate, with_kernel};
use crate::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use pulp::Simd;
use serde::{Deserialize, Serialize};
use std::any::Any;

/// The weight f of a neighbor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// [h/(r + eps)]^2 + const, the paper's own.
    InverseSquare,
    /// The SPH kernel, the paper's alternative and ALARIC's choice.
    #[default]
    Kernel,
}

/// How neighbors of different target volume count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bias {
    /// By target volume: no drift along gradients.
    #[default]
    Corrected,
    /// All alike with the mean h of the pair, as in the paper.
    Plain,
}

/// Softening of the inverse-square weight, in h; the paper's eps.
const SOFTENING: f64 = 0.01;

/// How pushes are summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pushes {
    pub weight: Weight,
    pub bias: Bias,
    /// N_H = V_d n H^d.
    pub kernel_neighbors: f64,
}

/// Pushes on every particle of `sources[0]`. Channel 0 is the target volume with its feedback (corrected) or the support
/// radius (plain), channel 1 the target volume.
pub fn pushes<const D: usize>(
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, 2>],
    pushes: Pushes,
) -> Vec<Push<D>> {
    compiled::<D, 2, f32, Push<D>>(|shape| push_pass(kernel, pushes, shape)).drive(domain, sources, 1.0)
}

/// The weight f of a neighbor at the distance `q` in support radii.
pub fn push_weight<const D: usize>(weight: Weight, kernel: KernelName, q: f64) -> f64 {
    match weight {
        Weight::Kernel => with_kernel!(kernel, kernel => evaluate::<_, D>(kernel, q).0),
        Weight::InverseSquare => ((2.0 * q + SOFTENING).powi(-2) - (2.0 + SOFTENING).powi(-2)).max(0.0),
    }
}

/// Sums of one particle.
#[derive(Debug, Clone, Copy)]
pub struct Push<const D: usize> {
    /// Sum of W at the particle's target support radius.
    pub number_density: f64,
    /// sum_j (V_j / V_i) f r^_ij, away from neighbors.
    pub shift: [f64; D],
}

impl<const D: usize> Default for Push<D> {
    fn default() -> Self {
        Self { number_density: 0.0, shift: [0.0; D] }
    }
}

struct PushPass<K> {
    kernel: K,
    weight: Weight,
    bias: Bias,
    kernel_neighbors: f64,
}

fn push_pass(kernel: KernelName, pushes: Pushes, shape: Shape) -> Box<dyn Any> {
    let Pushes { weight, bias, kernel_neighbors } = pushes;
    in_shape!(shape, D => with_kernel!(kernel, kernel => {
        let pass = PushPass { kernel, weight, bias, kernel_neighbors };
        Box::new(Compiled::<D, 2, f32, Push<D>>::new(pass))
    }))
}

/// Channel 0: target volume (corrected) or support radius (plain).
impl<const D: usize, K: Kernel, R: Real> LeafPass<D, 2, R> for PushPass<K> {
    type Output = Push<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, 2, R>, out: &mut [Self::Output]) {
        match (self.weight, self.bias) {
            (Weight::Kernel, Bias::Corrected) => self.targets::<D, R, S, true, true>(simd, batch, out),
            (Weight::Kernel, Bias::Plain) => self.targets::<D, R, S, true, false>(simd, batch, out),
            (Weight::InverseSquare, Bias::Corrected) => self.targets::<D, R, S, false, true>(simd, batch, out),
            (Weight::InverseSquare, Bias::Plain) => self.targets::<D, R, S, false, false>(simd, batch, out),
        }
    }
}

impl<K: Kernel> PushPass<K> {
    #[inline(always)]
    fn targets<const D: usize, R: Real, S: Simd, const KERNEL: bool, const CORRECTED: bool>(
        &self,
        simd: S,
        batch: &Batch<'_, D, 2, R>,
        out: &mut [Push<D>],
    ) {
        let constant = |x: f64| R::splat(simd, R::from_f64(x));
        let length = batch.unit().length;
        let (zero, tiny) = (constant(0.0), constant(1e-12));
        let edge = constant(-(2.0 + SOFTENING).powi(-2));
        for (i, out) in batch.targets().zip(out) {
            let (xs, channels) = batch.registers::<S>();
            let target = splat::<D, R, S>(simd, &batch.target(i));
            let inverse = constant(length / batch.support(i));
            let (mut sum, mut shift, mut gradient) = (zero, [zero; D], [zero; D]);
            let own_volume = batch.target_channel(1, i);
            let (one, per_own) = (constant(1.0), constant(1.0 / own_volume));
            // Plain: H_ij = (H_i + H_j)/2 in buffer units.
            let pair_scale = constant(0.5 * batch.unit().channels[0] / length);
            let pair_own = constant(0.5 * batch.support(i) / length);
            for j in 0..xs[0].len() {
                let (d, q) = separation::<D, R, S>(simd, &xs, &target, inverse, j);
                let (value, slope) = self.kernel.shape::<D, R, S>(simd, q);
                sum = R::add(simd, sum, value);
                let pair_q = if CORRECTED {
                    q
                } else {
                    let pair_support = R::mul_add(simd, pair_scale, channels[0][j], pair_own);
                    R::div(simd, R::mul(simd, q, constant(batch.support(i) / length)), pair_support)
                };
                let mut f = if KERNEL {
                    if CORRECTED { value } else { self.kernel.shape::<D, R, S>(simd, pair_q).0 }
                } else {
                    let root =
                        R::div(simd, constant(1.0), R::mul_add(simd, pair_q, constant(2.0), constant(SOFTENING)));
                    R::max(simd, R::mul_add(simd, root, root, edge), zero)
                };
                if CORRECTED {
                    f = R::mul(simd, f, channels[0][j]);
                    // V_j (V_j / V_i - 1) grad W sums to grad V / V.
                    let volume = channels[1][j];
                    let change = R::sub(simd, R::mul(simd, volume, per_own), one);
                    let pull = R::mul(simd, R::mul(simd, volume, change), slope);
                    for k in 0..D {
                        gradient[k] = R::mul_add(simd, d[k], pull, gradient[k]);
                    }
                }
                // r^ = d / r; q H is r. The particle itself has d = 0.
                let pull = R::div(simd, f, R::max(simd, q, tiny));
                for k in 0..D {
                    shift[k] = R::mul_add(simd, d[k], pull, shift[k]);
                }
            }
            let scale = length / batch.support(i) / if CORRECTED { batch.target_channel(0, i) } else { 1.0 };
            let support = batch.support(i);
            let per_length = K::SIGMA[D - 1] * batch.unit().channels[1] * length / support.powi(D as i32 + 2);
            let own_cell = if CORRECTED { self.own_cell::<D>() * support * per_length } else { 0.0 };
            out.number_density = K::SIGMA[D - 1] / batch.support(i).powi(D as i32) * R::sum(simd, sum);
            for k in 0..D {
                out.shift[k] = -scale * R::sum(simd, shift[k]) - own_cell * R::sum(simd, gradient[k]);
            }
        }
    }
}

impl<K: Kernel> PushPass<K> {
    /// f(R_0) R_0 / (d H), R_0 the radius of a ball of one particle's volume: what the missing push of a
    /// particle's own cell weighs against H grad ln n*.
    fn own_cell<const D: usize>(&self) -> f64 {
        let q = self.kernel_neighbors.powf(-1.0 / D as f64);
        let f = match self.weight {
            Weight::Kernel => evaluate::<K, D>(self.kernel, q).0,
            Weight::InverseSquare => (2.0 * q + SOFTENING).powi(-2) - (2.0 + SOFTENING).powi(-2),
        };
        f * q / D as f64
    }
}
