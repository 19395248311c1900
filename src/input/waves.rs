//! Waves that fit a box a whole number of times, for random fields that repeat over it.

use rand::RngExt;
use sph::domain::Domain;

/// One of each pair k and -k.
pub(crate) struct Whole<const D: usize> {
    /// Its number among all that were looked at.
    pub index: u64,
    /// Waves along each edge; the first that is not 0 is positive.
    pub count: [i64; D],
    /// In radians per length.
    pub k: [f64; D],
    /// In waves across the longest edge.
    pub length: f64,
}

/// All waves around `domain` with lengths from `least` to `most`.
pub(crate) fn whole_waves<const D: usize>(domain: &Domain<D>, [least, most]: [f64; 2]) -> Vec<Whole<D>> {
    let extent = domain.extent();
    // Lengths of k count in waves across the longest edge.
    let longest = extent.iter().fold(0.0_f64, |m, e| m.max(*e));
    let reach = extent.map(|e| (most * e / longest).floor() as i64);
    let mut waves = Vec::new();
    let mut n: [i64; D] = reach.map(|r| -r);
    let mut index = 0;
    loop {
        let length = (0..D).map(|d| (n[d] as f64 * longest / extent[d]).powi(2)).sum::<f64>().sqrt();
        let is_first = n.iter().find(|v| **v != 0).is_some_and(|v| *v > 0);
        if is_first && length >= least && length <= most {
            let k = sph::array(|d| std::f64::consts::TAU * n[d] as f64 / extent[d]);
            waves.push(Whole { index, count: n, k, length });
        }
        index += 1;
        let Some(d) = (0..D).find(|&d| n[d] < reach[d]) else { break };
        n[d] += 1;
        n[..d].iter_mut().zip(reach).for_each(|(v, r)| *v = -r);
    }
    waves
}

/// A normal number of the variance 1 (Box and Muller).
pub(crate) fn normal(random: &mut impl RngExt) -> f64 {
    let [u, v]: [f64; 2] = [random.random(), random.random()];
    // 1 - u is never 0.
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
