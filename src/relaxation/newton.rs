//! Newton's method for arrangements in which the forces vanish.
//!
//! Near a minimum it converges faster than a descent. A kernel with the pairing instability has force-free arrangements in
//! which particles lie apart, but they are saddles: a descent leaves them, where J d = -g leads to them. J, the symmetric matrix of the forces' derivatives, is never made:
//! MINRES (Paige & Saunders 1975, SIAM J. Numer. Anal. 12, 617) asks for its products alone, which are differences of
//! forces, and is stopped early, which leaves the soft modes as they are.

use super::lbfgs::product;
use super::snapshot::rows;
use serde::{Deserialize, Serialize};
use sph::parallel;

/// The step d of the smallest residual |J d + g| among those that the products so far tell of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct MinimalResidual<const D: usize> {
    #[serde(with = "rows")]
    step: Vec<[f64; D]>,
    /// Vectors of Lanczos, and of the step's last two parts.
    #[serde(with = "rows")]
    last: Vec<[f64; D]>,
    #[serde(with = "rows")]
    now: Vec<[f64; D]>,
    #[serde(with = "rows")]
    older: Vec<[f64; D]>,
    #[serde(with = "rows")]
    newer: Vec<[f64; D]>,
    /// Lanczos' beta, and cosines and sines of the last two rotations, newest first.
    beta: f64,
    cosines: [f64; 2],
    sines: [f64; 2],
    eta: f64,
    /// |J d + g| / |g|.
    residual: f64,
    exhausted: bool,
}

impl<const D: usize> MinimalResidual<D> {
    /// Begins with d = 0 for g = `gradient`.
    pub fn new(gradient: &[[f64; D]]) -> Self {
        let zero = || vec![[0.0; D]; gradient.len()];
        let norm = product(gradient, gradient).sqrt();
        let exhausted = !(norm > 0.0 && norm.is_finite());
        Self {
            step: zero(),
            last: zero(),
            now: if exhausted { zero() } else { scaled(gradient, -1.0 / norm) },
            older: zero(),
            newer: zero(),
            beta: norm,
            cosines: [1.0; 2],
            sines: [0.0; 2],
            eta: norm,
            residual: 1.0,
            exhausted,
        }
    }

    /// The vector v of length 1 of which J v is to be told.
    pub fn asks_for(&self) -> &[[f64; D]] {
        &self.now
    }

    /// Takes J v.
    pub fn take(&mut self, mut applied: Vec<[f64; D]>) {
        let Self { step, last, now, older, newer, beta, .. } = self;
        let alpha = product(now, &applied);
        parallel::update(&mut applied, |i, to| (0..D).for_each(|k| to[k] -= alpha * now[i][k] + *beta * last[i][k]));
        let next_beta = product(&applied, &applied).sqrt();
        let ([cosine, last_cosine], [sine, last_sine]) = (self.cosines, self.sines);
        let delta = cosine * alpha - last_cosine * sine * *beta;
        let diagonal = delta.hypot(next_beta);
        if !(diagonal > 0.0 && diagonal.is_finite()) {
            self.exhausted = true;
            return;
        }
        let (above, second) = (sine * alpha + last_cosine * cosine * *beta, last_sine * *beta);
        parallel::update(older, |i, w| {
            (0..D).for_each(|k| w[k] = (now[i][k] - second * w[k] - above * newer[i][k]) / diagonal);
        });
        std::mem::swap(older, newer);
        self.cosines = [delta / diagonal, cosine];
        self.sines = [next_beta / diagonal, sine];
        let scale = self.cosines[0] * self.eta;
        parallel::update(step, |i, x| (0..D).for_each(|k| x[k] += scale * newer[i][k]));
        self.eta *= -self.sines[0];
        self.residual *= self.sines[0].abs();
        self.exhausted = !(next_beta > 0.0);
        if !self.exhausted {
            *last = std::mem::replace(now, scaled(&applied, 1.0 / next_beta));
            *beta = next_beta;
        }
    }

    /// Whether the residual is below `reduction` |g|, or no product leads on.
    pub fn is_below(&self, reduction: f64) -> bool {
        self.exhausted || !(self.residual > reduction)
    }

    pub fn step(self) -> Vec<[f64; D]> {
        self.step
    }

    /// Whether it is of `count` particles.
    pub fn is_of(&self, count: usize) -> bool {
        [&self.step, &self.last, &self.now, &self.older, &self.newer].iter().all(|v| v.len() == count)
    }
}

fn scaled<const D: usize>(vectors: &[[f64; D]], factor: f64) -> Vec<[f64; D]> {
    parallel::map(vectors.len(), |i| vectors[i].map(|c| factor * c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn symmetric(n: usize) -> DMatrix<f64> {
        let entry = |i: usize, j: usize| {
            ((i * j + 3 * (i + j)) as f64).sin() + if i == j { 4.0 * (-1f64).powi(i as i32) } else { 0.0 }
        };
        DMatrix::from_fn(n, n, |i, j| 0.5 * (entry(i, j) + entry(j, i)))
    }

    fn solved(matrix: &DMatrix<f64>, gradient: &[[f64; 1]], products: usize, reduction: f64) -> (Vec<f64>, usize) {
        let mut made = 0;
        let mut solver = MinimalResidual::new(gradient);
        while made < products && !solver.is_below(reduction) {
            made += 1;
            let v = solver.asks_for();
            let out = matrix * DVector::from_iterator(v.len(), v.iter().map(|c| c[0]));
            solver.take(out.iter().map(|c| [*c]).collect());
        }
        (solver.step().iter().map(|c| c[0]).collect(), made)
    }

    /// An indefinite matrix of n rows is solved by n products, as by elimination.
    #[test]
    fn a_saddle_is_found() {
        let n = 9;
        let matrix = symmetric(n);
        let eigenvalues = matrix.clone().symmetric_eigenvalues();
        assert!(eigenvalues.min() < -1.0 && eigenvalues.max() > 1.0, "indefinite: {eigenvalues}");
        let gradient: Vec<[f64; 1]> = (0..n).map(|i| [1.0 + i as f64]).collect();
        let wanted = matrix.clone().lu().solve(&DVector::from_fn(n, |i, _| -gradient[i][0])).unwrap();
        let (step, _) = solved(&matrix, &gradient, n, 0.0);
        for (a, b) in step.iter().zip(wanted.iter()) {
            assert!((a - b).abs() < 1e-9 * wanted.norm(), "{step:?} in place of {wanted}");
        }
    }

    /// Each product brings the residual down, to the least that its Krylov space allows; it stops where it is asked to.
    #[test]
    fn the_residual_falls_until_it_is_small_enough() {
        let n = 40;
        let matrix = symmetric(n);
        let gradient: Vec<[f64; 1]> = (0..n).map(|i| [(i as f64).cos()]).collect();
        let residual = |step: &[f64]| {
            let out = &matrix * DVector::from_column_slice(step);
            (0..n).map(|i| (out[i] + gradient[i][0]).powi(2)).sum::<f64>().sqrt()
        };
        let norm = residual(&vec![0.0; n]);
        let mut last = norm;
        for products in 1..12 {
            let now = residual(&solved(&matrix, &gradient, products, 0.0).0);
            assert!(now <= last * (1.0 + 1e-9), "{now} after {last}");
            last = now;
        }
        let (step, made) = solved(&matrix, &gradient, n, 0.5);
        assert!(residual(&step) <= 0.5 * norm && made < n, "{made} products");
        assert!(residual(&solved(&matrix, &gradient, made - 1, 0.0).0) > 0.5 * norm);
    }

    #[test]
    fn no_force_asks_for_no_step() {
        let (step, made) = solved(&symmetric(4), &[[0.0]; 4], 10, 0.0);
        assert_eq!((step, made), (vec![0.0; 4], 0));
    }
}
