//! Artificial viscosity that acts where the flow converges (ALARIC eq. 15 and 35; Morris & Monaghan 1997).

use super::registers::separation;
use crate::domain::Domain;
use crate::kernel::{Kernel, KernelName, with_kernel};
use crate::lanes::Real;
use crate::neighbors::{Batch, Compiled, LeafPass, Shape, Sources, compiled, in_shape};
use pulp::Simd;
use std::any::Any;

/// Channels of [`shear`]: the velocity (padded to three components), alpha, 1/H and n.
pub const CHANNELS: usize = 6;
const ALPHA: usize = 3;
const INVERSE_SUPPORT: usize = 4;
const NUMBER_DENSITY: usize = 5;

/// What the relative motion of its neighbors does to one particle.
#[derive(Debug, Clone, Copy)]
pub struct Shear<const D: usize> {
    /// -sum_b alpha_b (v_ab . r^) r F / n r^ with F and n averaged over the pair; times v_sig an acceleration.
    pub drag: [f64; D],
    /// div v at the particle.
    pub divergence: f64,
}

impl<const D: usize> Default for Shear<D> {
    fn default() -> Self {
        Self { drag: [0.0; D], divergence: 0.0 }
    }
}

/// Relative motion about every particle of `sources[0]`.
pub fn shear<const D: usize, R: Real>(
    kernel: KernelName,
    domain: &Domain<D>,
    sources: &[Sources<'_, D, CHANNELS>],
) -> Vec<Shear<D>> {
    compiled::<D, CHANNELS, R, Shear<D>>(|shape| viscosity_pass(kernel, shape)).drive(domain, sources, 1.0)
}

fn viscosity_pass(kernel: KernelName, shape: Shape) -> Box<dyn Any> {
    in_shape!(shape, D, R => with_kernel!(kernel, kernel => {
        Box::new(Compiled::<D, CHANNELS, R, Shear<D>>::new(ViscosityPass(kernel)))
    }))
}

struct ViscosityPass<K>(K);

impl<const D: usize, K: Kernel, R: Real> LeafPass<D, CHANNELS, R> for ViscosityPass<K> {
    type Output = Shear<D>;

    #[inline(always)]
    fn leaf<S: Simd>(&self, simd: S, batch: &mut Batch<'_, D, CHANNELS, R>, out: &mut [Self::Output]) {
        let unit = batch.unit();
        let constant = |x: f64| R::splat(simd, R::from_f64(x));
        let tiny = constant(1e-12);
        for (i, out) in batch.targets().zip(out) {
            let (xs, channels) = batch.registers::<S>();
            let target = batch.target(i).map(|x| R::splat(simd, x));
            let velocity: [R::Vector<S>; D] = std::array::from_fn(|k| constant(batch.target_channel(k, i)));
            let own = batch.support(i);
            let own_inverse = constant(unit.length / own);
            let inverse_scale = constant(unit.channels[INVERSE_SUPPORT] * unit.length);
            // F in units of sigma / H_a^(d+2).
            let rescale = constant(own * unit.channels[INVERSE_SUPPORT]);
            let own_density = constant(batch.target_channel(NUMBER_DENSITY, i));
            let mut drag = [constant(0.0); D];
            let mut divergence = constant(0.0);
            for j in 0..xs[0].len() {
                let (d, q) = separation::<D, R, S>(simd, &xs, &target, own_inverse, j);
                let (_, f_own) = self.0.shape::<D, R, S>(simd, q);
                let inverse = channels[INVERSE_SUPPORT][j];
                let (_, q_other) = separation::<D, R, S>(simd, &xs, &target, R::mul(simd, inverse, inverse_scale), j);
                let (_, mut f_other) = self.0.shape::<D, R, S>(simd, q_other);
                let ratio = R::mul(simd, inverse, rescale);
                for _ in 0..D + 2 {
                    f_other = R::mul(simd, f_other, ratio);
                }
                let mut approach = constant(0.0);
                for k in 0..D {
                    // The velocities of one particle may scale apart; bring each component to its unit.
                    let relative = R::mul(simd, R::sub(simd, channels[k][j], velocity[k]), constant(unit.channels[k]));
                    approach = R::mul_add(simd, relative, d[k], approach);
                }
                divergence = R::mul_add(simd, approach, f_own, divergence);
                let pair = R::div(
                    simd,
                    R::mul(simd, R::mul(simd, R::add(simd, f_own, f_other), channels[ALPHA][j]), approach),
                    R::max(simd, R::mul(simd, q, R::add(simd, own_density, channels[NUMBER_DENSITY][j])), tiny),
                );
                for k in 0..D {
                    drag[k] = R::mul_add(simd, d[k], pair, drag[k]);
                }
            }
            let norm = K::SIGMA[D - 1] / own.powi(D as i32 + 2) * unit.length;
            let per_density = 1.0 / unit.channels[NUMBER_DENSITY];
            // q H_a is r; the lengths of d . v and d make two units of length, one of them is divided out.
            let scale = norm * unit.channels[ALPHA] * per_density * unit.length / own;
            *out = Shear {
                drag: drag.map(|x| scale * R::sum(simd, x)),
                divergence: norm * R::sum(simd, divergence) * per_density / batch.target_channel(NUMBER_DENSITY, i),
            };
        }
    }
}
