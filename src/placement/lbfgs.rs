//! Limited-memory BFGS (Nocedal & Wright 2006, algorithm 7.4) on one vector per particle.
//!
//! Pairs are kept in single precision: they only shape the direction, whose error the line search bears.

use super::arrangement::reordered;
use super::snapshot::rows;
use crate::reduce;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Pairs kept; more cost memory (24 bytes per pair and particle in 3-D) and save few evaluations.
const PAIRS: usize = 6;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Pair<const D: usize> {
    #[serde(with = "rows")]
    step: Vec<[f32; D]>,
    #[serde(with = "rows")]
    change: Vec<[f32; D]>,
    /// 1 / (step . change).
    inverse: f64,
}

/// The history of steps and gradient changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Lbfgs<const D: usize> {
    pairs: std::collections::VecDeque<Pair<D>>,
    /// step . change / change . change of the newest pair, the scale of the initial inverse Hessian.
    scale: f64,
}

pub(super) fn product<const D: usize, A, B>(a: &[[A; D]], b: &[[B; D]]) -> f64
where
    A: Copy + Into<f64> + Sync,
    B: Copy + Into<f64> + Sync,
{
    reduce::sum(a.len(), |i| (0..D).map(|k| a[i][k].into() * b[i][k].into()).sum())
}

impl<const D: usize> Lbfgs<D> {
    pub fn new() -> Self {
        Self { pairs: std::collections::VecDeque::with_capacity(PAIRS), scale: 1.0 }
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
            pair.step = reordered(&pair.step, order);
            pair.change = reordered(&pair.change, order);
        }
    }

    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Takes up a step and the change of the gradient over it; passes over pairs without positive curvature.
    pub fn push(&mut self, step: &[[f64; D]], before: &[[f64; D]], after: &[[f64; D]]) {
        let mut oldest = if self.pairs.len() == PAIRS { self.pairs.pop_front() } else { None }.unwrap_or(Pair {
            step: vec![[0.0; D]; step.len()],
            change: vec![[0.0; D]; step.len()],
            inverse: 0.0,
        });
        oldest.step.par_iter_mut().zip(step).for_each(|(to, from)| *to = from.map(|v| v as f32));
        oldest.change.par_iter_mut().zip(before.par_iter().zip(after)).for_each(|(to, (b, a))| {
            *to = std::array::from_fn(|k| (a[k] - b[k]) as f32);
        });
        let curvature = product(&oldest.step, &oldest.change);
        let squared = product(&oldest.change, &oldest.change);
        if curvature > 1e-10 * squared && squared > 0.0 {
            oldest.inverse = 1.0 / curvature;
            self.scale = curvature / squared;
            self.pairs.push_back(oldest);
        }
    }

    /// Minus the inverse Hessian's estimate times `gradient`.
    pub fn direction(&self, gradient: &[[f64; D]]) -> Vec<[f64; D]> {
        let mut q: Vec<[f64; D]> = gradient.par_iter().map(|g| g.map(|v| -v)).collect();
        let mut shares = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let share = pair.inverse * product(&pair.step, &q);
            subtract(&mut q, share, &pair.change);
            shares.push(share);
        }
        q.par_iter_mut().for_each(|v| *v = v.map(|c| c * self.scale));
        for (pair, share) in self.pairs.iter().zip(shares.into_iter().rev()) {
            let other = pair.inverse * product(&pair.change, &q);
            subtract(&mut q, other - share, &pair.step);
        }
        q
    }
}

fn subtract<const D: usize>(q: &mut [[f64; D]], factor: f64, v: &[[f32; D]]) {
    q.par_iter_mut().zip(v).for_each(|(q, v)| (0..D).for_each(|k| q[k] -= factor * f64::from(v[k])));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a quadratic with as many pairs as dimensions the direction becomes Newton's.
    #[test]
    fn solves_a_quadratic() {
        let stiffness = |i: usize, k: usize| 1.0 + (3 * i + 7 * k) as f64;
        let gradient = |x: &[[f64; 2]]| -> Vec<[f64; 2]> {
            x.iter().enumerate().map(|(i, v)| std::array::from_fn(|k| stiffness(i, k) * (v[k] - 1.0))).collect()
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
