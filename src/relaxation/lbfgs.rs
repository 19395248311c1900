//! Limited-memory BFGS (Nocedal & Wright 2006, algorithm 7.4) on one vector per particle.
//!
//! The recursion runs over the products of all vectors with each other, not over the vectors (Chen, Wang & Zhou
//! 2014, Advances in Neural Information Processing Systems 27): these are read twice for a direction and once for
//! a new pair, instead of four times each.
//!
//! Pairs are kept in half precision: they only shape the direction, whose error the line search bears.

use super::snapshot::rows;
use half::slice::{HalfBitsSliceExt, HalfFloatSliceExt};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sph::exchange::{Alone, Exchange};
use sph::{parallel, reduce};
use std::ops::Range;

/// Pairs kept; more cost memory (12 bytes per pair and particle in 3-D) and save few evaluations.
const PAIRS: usize = 6;
/// Particles whose vectors are gone over together: all pairs of them fit the cache.
const CHUNK: usize = 1024;
/// Binary digits of the largest component in its unit: below it halves reach down for a factor of 2e8 with all their digits.
const DIGITS: i32 = 14;

/// Largest components that have a unit.
const PLAIN: std::ops::RangeInclusive<f64> = 1e-290..=1e290;

/// A vector per particle in half precision, in units of a power of two.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Halves<const D: usize> {
    unit: f64,
    #[serde(with = "rows")]
    bits: Vec<[u16; D]>,
}

impl<const D: usize> Halves<D> {
    fn zero(count: usize) -> Self {
        Self { unit: 1.0, bits: vec![[0; D]; count] }
    }

    fn set(&mut self, vector: impl Fn(usize) -> [f64; D] + Sync) {
        let largest = reduce::max(self.bits.len(), |i| vector(i).iter().fold(0.0, |most: f64, v| most.max(v.abs())));
        // Others have no unit with an inverse; what is left of them is no curvature.
        let is_plain = PLAIN.contains(&largest);
        self.unit = if is_plain { 2.0_f64.powi(largest.log2() as i32 - DIGITS) } else { 1.0 };
        let inverse = self.unit.recip();
        self.bits.par_chunks_mut(CHUNK).enumerate().for_each(|(c, bits)| {
            let values: Vec<[f32; D]> =
                (0..bits.len()).map(|i| vector(c * CHUNK + i).map(|v| (v * inverse) as f32)).collect();
            bits.as_flattened_mut().reinterpret_cast_mut::<half::f16>().convert_from_f32_slice(values.as_flattened());
        });
    }

    /// Components of the particles `range`, in units.
    fn of(&self, range: Range<usize>) -> Vec<f32> {
        let halves = self.bits[range].as_flattened().reinterpret_cast::<half::f16>();
        let mut out = vec![0.0; halves.len()];
        halves.convert_to_f32_slice(&mut out);
        out
    }

    fn reorder(&mut self, order: &[u32]) {
        self.bits = parallel::reordered(&self.bits, order);
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Pair<const D: usize> {
    step: Halves<D>,
    change: Halves<D>,
}

/// Products of pairs, by age: oldest first.
type Products = [[f64; PAIRS]; PAIRS];

/// The history of steps and gradient changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Lbfgs<const D: usize> {
    pairs: std::collections::VecDeque<Pair<D>>,
    /// step_i . change_j and change_i . change_j.
    step_change: Box<Products>,
    change_change: Box<Products>,
}

pub(super) fn product<A, B, const D: usize>(a: &[[A; D]], b: &[[B; D]]) -> f64
where
    A: Copy + Into<f64> + Sync,
    B: Copy + Into<f64> + Sync,
{
    product_among(&Alone, a, b)
}

/// [`product`] of vectors of particles that are over several ranks.
pub(super) fn product_among<A, B, const D: usize>(exchange: &dyn Exchange, a: &[[A; D]], b: &[[B; D]]) -> f64
where
    A: Copy + Into<f64> + Sync,
    B: Copy + Into<f64> + Sync,
{
    let own = |range: Range<usize>| [dot(a[range.clone()].as_flattened(), b[range].as_flattened())];
    exchange.sum(reduce::chunk_sums(a.len(), CHUNK, own)[0])
}

impl<const D: usize> Lbfgs<D> {
    pub fn new() -> Self {
        let none = Box::new([[0.0; PAIRS]; PAIRS]);
        Self { pairs: std::collections::VecDeque::with_capacity(PAIRS), step_change: none.clone(), change_change: none }
    }

    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Whether it is a history of `count` particles.
    pub fn is_of(&self, count: usize) -> bool {
        self.pairs.len() <= PAIRS
            && self.pairs.iter().all(|p| p.step.bits.len() == count && p.change.bits.len() == count)
    }

    /// Follows the particles into a new order.
    pub fn reorder(&mut self, order: &[u32]) {
        for pair in &mut self.pairs {
            pair.step.reorder(order);
            pair.change.reorder(order);
        }
    }

    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Takes up a step and the change of the gradient over it; passes over pairs without positive curvature.
    pub fn push<G: Copy + Into<f64> + Sync>(&mut self, step: &[[G; D]], before: &[[G; D]], after: &[[G; D]]) {
        self.push_among(&Alone, step, before, after);
    }

    /// [`Self::push`] of particles that are over several ranks.
    pub fn push_among<G: Copy + Into<f64> + Sync>(
        &mut self,
        exchange: &dyn Exchange,
        step: &[[G; D]],
        before: &[[G; D]],
        after: &[[G; D]],
    ) {
        let oldest = if self.pairs.len() == PAIRS { self.forget_oldest() } else { None };
        let count = step.len();
        let mut pair = oldest.unwrap_or_else(|| Pair { step: Halves::zero(count), change: Halves::zero(count) });
        pair.step.set(|i| step[i].map(Into::into));
        pair.change.set(|i| sph::array(|k| after[i][k].into() - before[i][k].into()));
        self.pairs.push_back(pair);
        let new = self.pairs.len() - 1;
        let products = self.products_of_newest(exchange);
        for i in 0..=new {
            self.step_change[new][i] = products[0][i];
            self.step_change[i][new] = products[1][i];
            self.change_change[new][i] = products[2][i];
            self.change_change[i][new] = products[2][i];
        }
        let (curvature, squared) = (self.step_change[new][new], self.change_change[new][new]);
        if !(curvature > 1e-10 * squared && squared > 0.0) {
            self.pairs.pop_back();
        }
    }

    fn forget_oldest(&mut self) -> Option<Pair<D>> {
        for products in [&mut self.step_change, &mut self.change_change] {
            products.rotate_left(1);
            products.iter_mut().for_each(|row| row.rotate_left(1));
        }
        self.pairs.pop_front()
    }

    /// The newest step by all changes, all steps by the newest change, and the newest change by all changes.
    fn products_of_newest(&self, exchange: &dyn Exchange) -> [[f64; PAIRS]; 3] {
        let Some(newest) = self.pairs.back() else { return [[0.0; PAIRS]; 3] };
        let sums: [f64; 3 * PAIRS] = reduce::chunk_sums(newest.step.bits.len(), CHUNK, |range| {
            let mut out = [0.0; 3 * PAIRS];
            let (step, change) = (newest.step.of(range.clone()), newest.change.of(range.clone()));
            let [step_unit, change_unit] = [newest.step.unit, newest.change.unit];
            for (i, pair) in self.pairs.iter().enumerate() {
                let (of_step, of_change) = (pair.step.of(range.clone()), pair.change.of(range.clone()));
                out[i] = step_unit * pair.change.unit * dot(&step, &of_change);
                out[PAIRS + i] = pair.step.unit * change_unit * dot(&of_step, &change);
                out[2 * PAIRS + i] = change_unit * pair.change.unit * dot(&change, &of_change);
            }
            out
        });
        let sums = exchange.together(sums);
        sph::array(|row| sph::array(|i| sums[row * PAIRS + i]))
    }

    /// Minus the inverse Hessian's estimate times `gradient`.
    pub fn direction<G: Copy + Into<f64> + Sync>(&self, gradient: &[[G; D]]) -> Vec<[f32; D]> {
        self.direction_among(&Alone, gradient)
    }

    /// [`Self::direction`] of particles that are over several ranks.
    pub fn direction_among<G>(&self, exchange: &dyn Exchange, gradient: &[[G; D]]) -> Vec<[f32; D]>
    where
        G: Copy + Into<f64> + Sync,
    {
        let [by_gradient, by_step, by_change] = self.shares(exchange, gradient);
        let mut direction = vec![[0.0; D]; gradient.len()];
        direction.par_chunks_mut(CHUNK).enumerate().for_each(|(c, out)| {
            let range = c * CHUNK..c * CHUNK + out.len();
            let from = gradient[range.clone()].as_flattened();
            let mut sum: Vec<f64> = from.iter().map(|&g| by_gradient[0] * g.into()).collect();
            for (i, pair) in self.pairs.iter().enumerate() {
                let (of_step, of_change) = (by_step[i] * pair.step.unit, by_change[i] * pair.change.unit);
                let (step, change) = (pair.step.of(range.clone()), pair.change.of(range.clone()));
                sum.iter_mut()
                    .zip(step.iter().zip(&change))
                    .for_each(|(o, (&s, &y))| *o += of_step * f64::from(s) + of_change * f64::from(y));
            }
            out.as_flattened_mut().iter_mut().zip(sum).for_each(|(out, sum)| *out = sum as f32);
        });
        direction
    }

    /// The direction as a sum: shares of the gradient (the first of its list), of the steps and of the changes.
    fn shares<G: Copy + Into<f64> + Sync>(&self, exchange: &dyn Exchange, gradient: &[[G; D]]) -> [[f64; PAIRS]; 3] {
        let count = self.pairs.len();
        let (step_gradient, change_gradient) = self.products_with(exchange, gradient);
        let mut by_gradient = -1.0;
        let (mut by_step, mut by_change) = ([0.0; PAIRS], [0.0; PAIRS]);
        for i in (0..count).rev() {
            let along = (i + 1..count).map(|j| by_change[j] * self.step_change[i][j]).sum::<f64>();
            by_change[i] = -(by_gradient * step_gradient[i] + along) / self.step_change[i][i];
        }
        if let Some(newest) = count.checked_sub(1) {
            let scale = self.step_change[newest][newest] / self.change_change[newest][newest];
            by_gradient *= scale;
            let shares = by_change.map(|c| -c);
            by_change = by_change.map(|c| c * scale);
            for i in 0..count {
                let along: f64 = (0..count)
                    .map(|j| by_change[j] * self.change_change[i][j] + by_step[j] * self.step_change[j][i])
                    .sum();
                let other = (by_gradient * change_gradient[i] + along) / self.step_change[i][i];
                by_step[i] = shares[i] - other;
            }
        }
        [[by_gradient; PAIRS], by_step, by_change]
    }

    /// Products of the steps and of the changes with `gradient`.
    fn products_with<G>(&self, exchange: &dyn Exchange, gradient: &[[G; D]]) -> ([f64; PAIRS], [f64; PAIRS])
    where
        G: Copy + Into<f64> + Sync,
    {
        let sums: [f64; 2 * PAIRS] = reduce::chunk_sums(gradient.len(), CHUNK, |range| {
            let mut out = [0.0; 2 * PAIRS];
            let gradient = gradient[range.clone()].as_flattened();
            for (i, pair) in self.pairs.iter().enumerate() {
                out[i] = pair.step.unit * dot(&pair.step.of(range.clone()), gradient);
                out[PAIRS + i] = pair.change.unit * dot(&pair.change.of(range.clone()), gradient);
            }
            out
        });
        let sums = exchange.together(sums);
        (sph::array(|i| sums[i]), sph::array(|i| sums[PAIRS + i]))
    }
}

/// Independent partial sums, so that a product runs at the speed of the vector units.
const LANES: usize = 16;

fn dot<A: Copy + Into<f64>, B: Copy + Into<f64>>(a: &[A], b: &[B]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (head_a, tail_a) = a.as_chunks::<LANES>();
    let (head_b, tail_b) = b.as_chunks::<LANES>();
    for (a, b) in head_a.iter().zip(head_b) {
        (0..LANES).for_each(|l| lanes[l] += a[l].into() * b[l].into());
    }
    let rest: f64 = tail_a.iter().zip(tail_b).map(|(&a, &b)| a.into() * b.into()).sum();
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a quadratic with as many pairs as dimensions the direction becomes Newton's.
    #[test]
    fn solves_a_quadratic() {
        let stiffness = |i: usize, k: usize| 1.0 + (3 * i + 7 * k) as f64;
        let gradient = |x: &[[f64; 2]]| -> Vec<[f64; 2]> {
            x.iter().enumerate().map(|(i, v)| sph::array(|k| stiffness(i, k) * (v[k] - 1.0))).collect()
        };
        let mut x = vec![[0.0; 2], [3.0, -1.0], [0.5, 2.0]];
        let mut memory = Lbfgs::new();
        let mut g = gradient(&x);
        for _ in 0..60 {
            let d = memory.direction(&g);
            let t = if memory.is_empty() { 0.05 } else { 1.0 };
            let step: Vec<[f64; 2]> = d.iter().map(|v| v.map(|c| t * f64::from(c))).collect();
            x.iter_mut().zip(&step).for_each(|(x, s)| (0..2).for_each(|k| x[k] += s[k]));
            let next = gradient(&x);
            memory.push(&step, &g, &next);
            g = next;
        }
        x.iter().flatten().for_each(|v| assert!((v - 1.0).abs() < 1e-6, "{x:?}"));
    }
    /// Whatever their size, and zero and what is no number as such.
    #[test]
    fn halves_have_eleven_digits() {
        for size in [1.0, 3e-200, 7e250] {
            let value = |i: usize| size * [(i as f64).sin(), 1e-6 * (i as f64 + 0.5).cos()][i % 2];
            let mut halves = Halves::<1>::zero(5000);
            halves.set(|i| [value(i)]);
            let found = halves.of(0..5000);
            for (i, found) in found.iter().enumerate() {
                let (found, value) = (halves.unit * f64::from(*found), value(i));
                // The last digit of the smallest halves is 6e-8 of a unit.
                let error = 4.9e-4 * value.abs() + 3e-8 * halves.unit;
                assert!((found - value).abs() <= error, "{size}: {found} {value}");
            }
        }
        let mut halves = Halves::<2>::zero(3);
        halves.set(|_| [0.0; 2]);
        assert_eq!(halves.of(0..3), [0.0; 6]);
        halves.set(|i| [i as f64, f64::NAN]);
        assert!(halves.of(0..3)[1].is_nan());
    }
}
