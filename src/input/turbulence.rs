//! Random velocities of a given spectrum: a sum of waves,
//!
//! v(x) = sum_k a_k cos(k x) + b_k sin(k x),
//!
//! over all k of whole waves across the box with a length in the range asked for, one of each pair k and -k. The components of
//! a_k and b_k are normal numbers whose variance is that of the spectrum, E(k) ~ k^-p over k^(d-1); what lies along k carries
//! the compressive share of the energy (Helmholtz's decomposition wave by wave; Federrath et al. 2010, A&A 512, A81). Motion along the waves
//! and across them is scaled, each by one factor, so that this share and the mean square over the box are exact. In gas that is not even the mean
//! over the mass is then taken out, and the rest is scaled by one more factor: it is the mean square over the mass that counts.

use crate::error::{Error, Result};
use crate::input::waves::{normal, whole_waves};
use crate::random::{Purpose, keyed};
use crate::scene::TurbulenceInput;
use sph::domain::Domain;
use sph::parallel;
use std::f64::consts::TAU;

/// A wave of velocities.
struct Wave<const D: usize> {
    k: [f64; D],
    cosine: [f64; D],
    sine: [f64; D],
}

impl<const D: usize> Wave<D> {
    /// Over a box in which it repeats.
    fn mean_square(&self) -> f64 {
        0.5 * self.cosine.iter().chain(&self.sine).map(|v| v * v).sum::<f64>()
    }
}

/// Waves that repeat over a box.
pub(crate) struct Turbulence<const D: usize> {
    corner: [f64; D],
    waves: Vec<Wave<D>>,
    /// Velocity of the gas as a whole, which is taken out.
    drift: [f64; D],
}

/// Waves times places by which means over the mass are found, at most, and places along an axis, at least.
const MOST_TERMS: f64 = 5e7;
const FEWEST: f64 = 8.0;

impl<const D: usize> Turbulence<D> {
    /// With the root mean square 1 over the box around `domain`.
    ///
    /// # Errors
    /// No waves in the range, or motion across the waves in 1-D.
    pub fn new(input: &TurbulenceInput, seed: u64, domain: &Domain<D>) -> Result<Self> {
        let share = input.compressive.unwrap_or(if D == 1 { 1.0 } else { 0.0 });
        if D == 1 && share != 1.0 {
            return Err(Error::scene(
                "turbulence.compressive",
                format!("is {share}, but in 1-D all motion is along the waves: 1"),
            ));
        }
        let [least, most] = input.wavenumbers;
        let pairs: Vec<[Wave<D>; 2]> = whole_waves(domain, input.wavenumbers)
            .iter()
            .map(|w| {
                let amplitude = (w.length.powf(-input.slope) / w.length.powi(D as i32 - 1)).sqrt();
                waves(w.k, amplitude, (seed, w.index))
            })
            .collect();
        let shares = [share, 1.0 - share];
        // What has no share need not be there.
        let factors: [f64; 2] = sph::array(|part| {
            let mean: f64 = pairs.iter().map(|pair| pair[part].mean_square()).sum();
            if shares[part] > 0.0 { (shares[part] / mean).sqrt() } else { 0.0 }
        });
        if pairs.is_empty() || !factors.iter().all(|f| f.is_finite()) {
            let problem = format!("are {least} to {most}, in which no wave fits the box a whole number of times");
            return Err(Error::scene("turbulence.wavenumbers", problem));
        }
        let sum = |a: &[f64; D], b: &[f64; D]| sph::array(|d| factors[0] * a[d] + factors[1] * b[d]);
        let joined = |[along, across]: &[Wave<D>; 2]| Wave {
            k: along.k,
            cosine: sum(&along.cosine, &across.cosine),
            sine: sum(&along.sine, &across.sine),
        };
        Ok(Self { corner: domain.lo, waves: pairs.iter().map(joined).collect(), drift: [0.0; D] })
    }

    /// Of gas of this `density` that rests as a whole, with the root mean square 1 over its mass.
    #[must_use]
    pub fn at_rest_in(mut self, domain: &Domain<D>, density: &(dyn Fn(&[f64; D]) -> f64 + Sync)) -> Self {
        let extent = domain.extent();
        let along = |wave: &Wave<D>| (0..D).map(|k| (wave.k[k] * extent[k] / TAU).abs()).fold(0.0, f64::max);
        let finest = self.waves.iter().map(along).fold(0.0, f64::max);
        let affordable = (MOST_TERMS / self.waves.len() as f64).powf(1.0 / D as f64).floor();
        let n = (4.0 * finest + 4.0).min(affordable).max(FEWEST) as usize;
        let weighed = parallel::map(n.pow(D as u32), |i| {
            let x = sph::array(|k| {
                let along = i / n.pow(k as u32) % n;
                domain.lo[k] + extent[k] * (along as f64 + 0.5) / n as f64
            });
            (x, if domain.contains(&x) { density(&x).max(0.0) } else { 0.0 })
        });
        if weighed.windows(2).all(|w| w[0].1 == w[1].1) {
            return self;
        }
        let found = parallel::map(weighed.len(), |i| {
            let mut v = [0.0; D];
            if weighed[i].1 > 0.0 {
                self.add(&weighed[i].0, 1.0, &mut v);
            }
            v
        });
        let (mut mass, mut sum, mut square) = (0.0, [0.0; D], 0.0);
        for ((_, weight), v) in weighed.iter().zip(&found) {
            mass += weight;
            (0..D).for_each(|k| sum[k] += weight * v[k]);
            square += weight * v.iter().map(|c| c * c).sum::<f64>();
        }
        let drift: [f64; D] = sph::array(|k| sum[k] / mass);
        let left = square / mass - drift.iter().map(|c| c * c).sum::<f64>();
        if !(left > 0.0 && left.is_finite()) {
            return self;
        }
        let factor = 1.0 / left.sqrt();
        for wave in &mut self.waves {
            (wave.cosine, wave.sine) = (wave.cosine.map(|c| factor * c), wave.sine.map(|c| factor * c));
        }
        Self { drift: drift.map(|c| factor * c), ..self }
    }

    /// Adds the velocity at `x`, times `scale`.
    pub fn add(&self, x: &[f64; D], scale: f64, out: &mut [f64]) {
        for wave in &self.waves {
            let phase = (0..D).map(|d| wave.k[d] * (x[d] - self.corner[d])).sum::<f64>();
            let (sin, cos) = phase.sin_cos();
            (0..D).for_each(|d| out[d] += scale * (wave.cosine[d] * cos + wave.sine[d] * sin));
        }
        (0..D).for_each(|d| out[d] -= scale * self.drift[d]);
    }
}

/// One along k, and one across it.
fn waves<const D: usize>(k: [f64; D], amplitude: f64, (seed, index): (u64, u64)) -> [Wave<D>; 2] {
    let mut random = keyed(seed, Purpose::Turbulence, index);
    let length = k.iter().map(|v| v * v).sum::<f64>().sqrt();
    let way = k.map(|v| v / length);
    let mut vectors = || -> [[f64; D]; 2] {
        let normal: [f64; D] = sph::array(|_| normal(&mut random));
        let along: f64 = (0..D).map(|d| normal[d] * way[d]).sum();
        [sph::array(|d| amplitude * along * way[d]), sph::array(|d| amplitude * (normal[d] - along * way[d]))]
    };
    let (cosines, sines) = (vectors(), vectors());
    let wave = |part: usize| Wave { k, cosine: cosines[part], sine: sines[part] };
    [wave(0), wave(1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph::domain::{Axis, Region};

    fn domain() -> Domain<3> {
        Domain::new([1.0, 0.0, -1.0], [3.0, 1.0, 1.0], [Axis::Periodic; 3], Region::Box).unwrap()
    }

    fn field(compressive: f64) -> Turbulence<3> {
        let input = TurbulenceInput { compressive: Some(compressive), wavenumbers: [1.0, 5.0], ..Default::default() };
        Turbulence::new(&input, 3, &domain()).unwrap()
    }

    fn at(field: &Turbulence<3>, x: [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        field.add(&x, 1.0, &mut out);
        out
    }

    /// Slopes d v_i / d x_j by central differences.
    fn slopes(field: &Turbulence<3>, x: [f64; 3]) -> [[f64; 3]; 3] {
        let h = 1e-5;
        let mut slopes = [[0.0; 3]; 3];
        for j in 0..3 {
            let moved = |way: f64| {
                let mut y = x;
                y[j] += way * h;
                at(field, y)
            };
            let (a, b) = (moved(-1.0), moved(1.0));
            (0..3).for_each(|i| slopes[i][j] = (b[i] - a[i]) / (2.0 * h));
        }
        slopes
    }

    #[test]
    fn motion_is_without_divergence_or_without_curl_as_asked_for() {
        let (solenoidal, compressive) = (field(0.0), field(1.0));
        for x in [[1.3, 0.2, 0.5], [2.9, 0.9, -0.9], [1.0, 0.0, -1.0]] {
            let s = slopes(&solenoidal, x);
            let size = s.iter().flatten().map(|v| v.abs()).fold(0.0, f64::max);
            assert!((s[0][0] + s[1][1] + s[2][2]).abs() < 1e-7 * size, "{s:?}");
            let s = slopes(&compressive, x);
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                assert!((s[i][j] - s[j][i]).abs() < 1e-7 * size, "{s:?}");
            }
        }
    }

    /// On a lattice with more points than waves the mean square of a sum of waves is exact, and means vanish.
    #[test]
    fn the_mean_square_is_one_and_the_field_repeats() {
        let field = field(0.3);
        let n = 12;
        let (mut square, mut mean) = (0.0, [0.0; 3]);
        for i in 0..n * n * n {
            let u = [i % n, i / n % n, i / n / n].map(|v| v as f64 / n as f64);
            let v = at(&field, [1.0 + 2.0 * u[0], u[1], -1.0 + 2.0 * u[2]]);
            square += v.iter().map(|c| c * c).sum::<f64>() / f64::from((n * n * n) as u32);
            (0..3).for_each(|k| mean[k] += v[k]);
        }
        assert!((square - 1.0).abs() < 1e-12, "{square}");
        assert!(mean.iter().all(|m| m.abs() < 1e-9), "{mean:?}");
        let (a, b) = (at(&field, [1.1, 0.3, 0.2]), at(&field, [3.1, -0.7, -1.8]));
        (0..3).for_each(|k| assert!((a[k] - b[k]).abs() < 1e-12));
    }

    /// By sums over many more places than those that it is found by.
    #[test]
    fn uneven_gas_rests_as_a_whole() {
        let density = |x: &[f64; 3]| (-8.0 * ((x[0] - 1.4).powi(2) + (x[1] - 0.6).powi(2) + x[2] * x[2])).exp();
        let over_mass = |field: &Turbulence<3>| {
            let n = 60;
            let (mut mass, mut mean, mut square) = (0.0, [0.0; 3], 0.0);
            for i in 0..n * n * n {
                let u = [i % n, i / n % n, i / n / n].map(|v| (v as f64 + 0.5) / n as f64);
                let x = [1.0 + 2.0 * u[0], u[1], -1.0 + 2.0 * u[2]];
                let (v, weight) = (at(field, x), density(&x));
                mass += weight;
                square += weight * v.iter().map(|c| c * c).sum::<f64>();
                (0..3).for_each(|k| mean[k] += weight * v[k]);
            }
            ((mean.iter().map(|m| m * m).sum::<f64>().sqrt() / mass), square / mass)
        };
        let (drift, _) = over_mass(&field(0.3));
        assert!(drift > 0.1, "{drift}");
        let (drift, square) = over_mass(&field(0.3).at_rest_in(&domain(), &density));
        assert!(drift < 1e-3 && (square - 1.0).abs() < 1e-3, "{drift} {square}");
    }

    /// Energies of shells of k fall as k^-p, within what the random numbers of some hundred waves leave: 1/sqrt(100).
    #[test]
    fn the_spectrum_has_its_slope() {
        let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
        let input = TurbulenceInput { slope: 2.0, wavenumbers: [1.0, 16.0], ..Default::default() };
        let field = Turbulence::<3>::new(&input, 5, &domain).unwrap();
        let energy = |lo: f64, hi: f64| {
            let within = |w: &&Wave<3>| {
                let n = w.k.iter().map(|v| v * v).sum::<f64>().sqrt() / std::f64::consts::TAU;
                n >= lo && n < hi
            };
            let square = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>();
            field.waves.iter().filter(within).map(|w| square(&w.cosine) + square(&w.sine)).sum::<f64>()
        };
        // The integral of k^-2 from 4 to 8 is twice that from 8 to 16.
        let ratio = energy(4.0, 8.0) / energy(8.0, 16.0);
        assert!((ratio / 2.0 - 1.0).abs() < 0.15, "{ratio}");
    }

    /// By Helmholtz's decomposition of the sum's waves: exactly, not on average over seeds.
    #[test]
    fn the_compressive_share_of_the_energy_is_what_was_asked_for() {
        for share in [0.0, 0.3, 0.5, 1.0] {
            for seed in 0..5 {
                let input = TurbulenceInput { compressive: Some(share), wavenumbers: [1.0, 2.0], ..Default::default() };
                let field = Turbulence::new(&input, seed, &domain()).unwrap();
                let along = |w: &Wave<3>| {
                    let square = w.k.iter().map(|v| v * v).sum::<f64>();
                    let part = |v: &[f64; 3]| (0..3).map(|d| v[d] * w.k[d]).sum::<f64>().powi(2) / square;
                    0.5 * (part(&w.cosine) + part(&w.sine))
                };
                let found: f64 = field.waves.iter().map(along).sum();
                assert!((found - share).abs() < 1e-12, "{found} of {share}");
            }
        }
    }

    #[test]
    fn in_one_dimension_all_motion_is_along_the_waves() {
        let domain = Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
        assert!(Turbulence::<1>::new(&TurbulenceInput::default(), 1, &domain).is_ok());
        let input = TurbulenceInput { compressive: Some(0.0), ..Default::default() };
        assert!(Turbulence::<1>::new(&input, 1, &domain).err().unwrap().to_string().contains("1-D"));
        let none = TurbulenceInput { wavenumbers: [1.2, 1.3], ..Default::default() };
        assert!(Turbulence::<1>::new(&none, 1, &domain).err().unwrap().to_string().contains("no wave"));
    }
}
