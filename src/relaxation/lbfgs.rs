//! Limited-memory BFGS (Nocedal & Wright 2006, algorithm 7.4) on one vector per particle.
//!
//! The recursion runs over the products of all vectors with each other, not over the vectors (Chen, Wang & Zhou
//! 2014, Advances in Neural Information Processing Systems 27): these are read twice for a direction and once for
//! a new pair, instead of four times each.
//!
//! Pairs are kept in single precision: they only shape the direction, whose error the line search bears.

use super::snapshot::rows;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sph::exchange::{Alone, Exchange};
use sph::{parallel, reduce};

/// Pairs kept; more cost memory (24 bytes per pair and particle in 3-D) and save few evaluations.
const PAIRS: usize = 6;
/// Particles whose vectors are gone over together: all pairs of them fit the cache.
const CHUNK: usize = 1024;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Pair<const D: usize> {
    #[serde(with = "rows")]
    step: Vec<[f32; D]>,
    #[serde(with = "rows")]
    change: Vec<[f32; D]>,
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

pub(super) fn product<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    product_among(&Alone, a, b)
}

/// [`product`] of vectors of particles that are over several ranks.
pub(super) fn product_among<const D: usize>(exchange: &dyn Exchange, a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    let own = |range: std::ops::Range<usize>| [dot(a[range.clone()].as_flattened(), b[range].as_flattened())];
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
        self.pairs.len() <= PAIRS && self.pairs.iter().all(|p| p.step.len() == count && p.change.len() == count)
    }

    /// Follows the particles into a new order.
    pub fn reorder(&mut self, order: &[u32]) {
        for pair in &mut self.pairs {
            pair.step = parallel::reordered(&pair.step, order);
            pair.change = parallel::reordered(&pair.change, order);
        }
    }

    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Takes up a step and the change of the gradient over it; passes over pairs without positive curvature.
    pub fn push(&mut self, step: &[[f64; D]], before: &[[f64; D]], after: &[[f64; D]]) {
        self.push_among(&Alone, step, before, after);
    }

    /// [`Self::push`] of particles that are over several ranks.
    pub fn push_among(&mut self, exchange: &dyn Exchange, step: &[[f64; D]], before: &[[f64; D]], after: &[[f64; D]]) {
        let oldest = if self.pairs.len() == PAIRS { self.forget_oldest() } else { None };
        let mut pair =
            oldest.unwrap_or_else(|| Pair { step: vec![[0.0; D]; step.len()], change: vec![[0.0; D]; step.len()] });
        parallel::update(&mut pair.step, |i, to| *to = step[i].map(|v| v as f32));
        parallel::update(&mut pair.change, |i, to| *to = sph::array(|k| (after[i][k] - before[i][k]) as f32));
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
        let sums: [f64; 3 * PAIRS] = reduce::chunk_sums(newest.step.len(), CHUNK, |range| {
            let mut out = [0.0; 3 * PAIRS];
            let (step, change) =
                (newest.step[range.clone()].as_flattened(), newest.change[range.clone()].as_flattened());
            for (i, pair) in self.pairs.iter().enumerate() {
                let of_step = pair.step[range.clone()].as_flattened();
                let of_change = pair.change[range.clone()].as_flattened();
                out[i] = dot(step, of_change);
                out[PAIRS + i] = dot(of_step, change);
                out[2 * PAIRS + i] = dot(change, of_change);
            }
            out
        });
        let sums = exchange.together(sums);
        sph::array(|row| sph::array(|i| sums[row * PAIRS + i]))
    }

    /// Minus the inverse Hessian's estimate times `gradient`.
    pub fn direction(&self, gradient: &[[f64; D]]) -> Vec<[f64; D]> {
        self.direction_among(&Alone, gradient)
    }

    /// [`Self::direction`] of particles that are over several ranks.
    pub fn direction_among(&self, exchange: &dyn Exchange, gradient: &[[f64; D]]) -> Vec<[f64; D]> {
        let [by_gradient, by_step, by_change] = self.shares(exchange, gradient);
        let mut direction = vec![[0.0; D]; gradient.len()];
        direction.par_chunks_mut(CHUNK).enumerate().for_each(|(c, out)| {
            let range = c * CHUNK..c * CHUNK + out.len();
            let out = out.as_flattened_mut();
            let from = gradient[range.clone()].as_flattened();
            out.iter_mut().zip(from).for_each(|(o, g)| *o = by_gradient[0] * g);
            for (i, pair) in self.pairs.iter().enumerate() {
                let (step, change) =
                    (pair.step[range.clone()].as_flattened(), pair.change[range.clone()].as_flattened());
                out.iter_mut()
                    .zip(step.iter().zip(change))
                    .for_each(|(o, (&s, &y))| *o += by_step[i] * f64::from(s) + by_change[i] * f64::from(y));
            }
        });
        direction
    }

    /// The direction as a sum: shares of the gradient (the first of its list), of the steps and of the changes.
    fn shares(&self, exchange: &dyn Exchange, gradient: &[[f64; D]]) -> [[f64; PAIRS]; 3] {
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
    fn products_with(&self, exchange: &dyn Exchange, gradient: &[[f64; D]]) -> ([f64; PAIRS], [f64; PAIRS]) {
        let sums: [f64; 2 * PAIRS] = reduce::chunk_sums(gradient.len(), CHUNK, |range| {
            let mut out = [0.0; 2 * PAIRS];
            let gradient = gradient[range.clone()].as_flattened();
            for (i, pair) in self.pairs.iter().enumerate() {
                out[i] = dot(pair.step[range.clone()].as_flattened(), gradient);
                out[PAIRS + i] = dot(pair.change[range.clone()].as_flattened(), gradient);
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
            let step: Vec<[f64; 2]> = d.iter().map(|v| v.map(|c| t * c)).collect();
            x.iter_mut().zip(&step).for_each(|(x, s)| (0..2).for_each(|k| x[k] += s[k]));
            let next = gradient(&x);
            memory.push(&step, &g, &next);
            g = next;
        }
        x.iter().flatten().for_each(|v| assert!((v - 1.0).abs() < 1e-6, "{x:?}"));
    }
}
