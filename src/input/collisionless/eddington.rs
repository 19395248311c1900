//! The isotropic distribution function of a density in a potential (Eddington 1916, MNRAS 76, 572; Binney & Tremaine 2008,
//! equation 4.46b):
//!
//! f(E) = 1/(sqrt(8) pi^2) int_0^E d^2 rho/d psi^2 d psi / sqrt(E - psi) + boundary, for particles of any mass.
//!
//! Between places rho'' is linear in psi and integrated in closed form; below the last of them it is all in one
//! place. Errors are second order in the places' distance: some 1e-4.

use super::well::Well;
use rand::RngExt;
use std::f64::consts::PI;

/// Speeds are drawn below a bound that is so much larger than the largest value at a place.
const ABOVE: f64 = 1.02;
/// Radii, by places, at which the share of negative f is counted.
const STRIDE: usize = 20;
/// Draws of which none is taken before the speed is left at 0: less than one in 1e6 is taken nowhere.
const MOST_DRAWS: usize = 1_000_000;

pub(super) struct Eddington<'a> {
    well: &'a Well,
    /// At the lifts; beyond the last it falls to 0 at the end.
    values: Vec<f64>,
    /// Most of v^2 f from each place outward.
    most: Vec<f64>,
    /// Share of the mass with a negative f, which is taken for 0, and the energies, as parts of the well's depth.
    pub negative: Option<(f64, [f64; 2])>,
}

impl<'a> Eddington<'a> {
    pub fn new(well: &'a Well) -> Self {
        let n = well.lift.len();
        let mut values: Vec<f64> = (0..n).map(|k| value(well, k)).collect();
        let negative = negative(well, &values);
        values.iter_mut().for_each(|f| *f = f.max(0.0));
        let most = |i: usize| {
            let all = (i..n).map(|j| 2.0 * (well.lift[j] - well.lift[i]) * values[j]);
            // Between the last place and the end f falls linearly.
            let last = 2.0 * (well.end - well.lift[i]) * values[n - 1];
            ABOVE * all.fold(last, f64::max)
        };
        let most = (0..n).map(most).collect();
        Self { well, values, most, negative }
    }

    /// f at a lift.
    fn value(&self, lift: f64) -> f64 {
        let (all, end) = (&self.well.lift, self.well.end);
        let n = all.len();
        let i = all.partition_point(|l| *l <= lift);
        if i == 0 {
            return self.values[0];
        }
        if i == n {
            return self.values[n - 1] * ((end - lift) / (end - all[n - 1])).max(0.0);
        }
        let share = (lift - all[i - 1]) / (all[i] - all[i - 1]);
        self.values[i - 1] + share * (self.values[i] - self.values[i - 1])
    }

    /// A speed at the radius `r`, whose square times f is its probability.
    pub fn speed(&self, r: f64, random: &mut impl RngExt) -> f64 {
        let (i, lift) = self.well.at(r);
        let fastest = (2.0 * (self.well.end - lift).max(0.0)).sqrt();
        for _ in 0..MOST_DRAWS {
            let [u, chance]: [f64; 2] = [random.random(), random.random()];
            let v = fastest * u;
            if chance * self.most[i] < v * v * self.value(lift + 0.5 * v * v) {
                return v;
            }
        }
        0.0
    }

    /// 4 pi int v^2 f dv: the density that f makes.
    #[cfg(test)]
    pub fn density(&self, r: f64) -> f64 {
        use crate::field::quadrature::integrate;
        let lift = self.well.at(r).1;
        let fastest = (2.0 * (self.well.end - lift)).sqrt();
        let step = |j: usize| fastest * f64::from(j as u32) / 2000.0;
        let f = |v: f64| v * v * self.value(lift + 0.5 * v * v);
        4.0 * PI * (0..2000).map(|j| integrate(4, step(j), step(j + 1), &f)).sum::<f64>()
    }

    /// f by the energy below that of the edge.
    #[cfg(test)]
    pub fn by_energy(&self, energy: f64) -> f64 {
        self.value(self.well.end - energy)
    }
}

/// f at place `k`.
fn value(well: &Well, k: usize) -> f64 {
    let n = well.lift.len();
    let above = |j: usize| (well.lift[j] - well.lift[k]).max(0.0);
    let mut sum = 0.0;
    for j in k..n - 1 {
        let (a, b) = (above(j), above(j + 1));
        if !(b > a) {
            continue;
        }
        let (low, high) = (a.sqrt(), b.sqrt());
        let slope = (well.bend[j + 1] - well.bend[j]) / (b - a);
        sum += 2.0 * well.bend[j] * (high - low) + slope * (2.0 / 3.0 * (b * high - a * low) - 2.0 * a * (high - low));
    }
    // From the edge to the last place.
    (sum + well.slope[n - 1] / (well.edge - well.lift[k]).sqrt()) / (8.0_f64.sqrt() * PI * PI)
}

/// The share of the mass in energies at which f is negative, and these energies over the depth of the well.
fn negative(well: &Well, values: &[f64]) -> Option<(f64, [f64; 2])> {
    let n = values.len();
    let below = |j: usize| (values[j] < 0.0).then_some(well.lift[j] / well.end);
    let first = (0..n).find_map(below)?;
    let last = (0..n).rev().find_map(below)?;
    let (mut whole, mut part) = (0.0, 0.0);
    for k in (0..n - 1).step_by(STRIDE) {
        let next = (k + STRIDE).min(n - 1);
        let shell = well.radii[k].powi(2) * (well.radii[next] - well.radii[k]);
        for j in k..n - 1 {
            let speed = (2.0 * (0.5 * (well.lift[j] + well.lift[j + 1]) - well.lift[k])).max(0.0).sqrt();
            let width = speed * (well.lift[j + 1] - well.lift[j]) * shell;
            whole += width * values[j].max(0.0);
            part += width * (-values[j]).max(0.0);
        }
    }
    Some((if whole > 0.0 { part / whole } else { f64::INFINITY }, [first, last]))
}
