//! The tables and figures of the ALARIC paper, as far as they are quick; `cargo test --test all -- --nocapture paper::`
//! prints them, with `--ignored` the long ones. [`results`] says how the page of results is made.

mod cost;
mod disc;
mod results;
mod splitting;
mod table1;

use sph::domain::{Axis, Domain, Region};
use sph_prep::field::ScalarField;
use sph_prep::relaxation::Control;
use sph_prep::target::{Positions, Target};
use std::sync::atomic::AtomicBool;

static NOT_INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// No deadline, no observer.
pub fn control() -> Control<'static> {
    Control { deadline: None, interrupted: &NOT_INTERRUPTED, observer: &|_| {} }
}

/// A density given as a function.
pub struct Density<F>(pub F);

impl<const D: usize, F: Fn(&[f64; D]) -> f64 + Send + Sync> ScalarField<D> for Density<F> {
    fn value(&self, x: &[f64; D]) -> f64 {
        (self.0)(x)
    }
}

/// The paper's well, eq. 46, seen from [0, 1] instead of [-1, 1].
pub fn well(delta: f64) -> impl Fn(&[f64; 1]) -> f64 {
    move |x| {
        let r = (2.0 * x[0] - 1.0).abs();
        (1.0 + delta) - (5.0 * r).cos() * (-5.0 * r * r).exp()
    }
}

/// Equal masses over a periodic unit interval.
pub fn interval() -> Domain<1> {
    Domain::new([0.0], [1.0], [Axis::Periodic], Region::Box).unwrap()
}

pub fn target<'a, const D: usize>(
    domain: &'a Domain<D>,
    density: &'a dyn ScalarField<D>,
    count: usize,
    mass: f64,
) -> Target<'a, D> {
    Target::of_equal_masses(domain, density, count, mass)
}

/// Midpoint rule; the integrands are smooth and periodic or short-ranged.
pub fn integral(f: impl Fn(f64) -> f64) -> f64 {
    let n = 100_000;
    (0..n).map(|i| f((i as f64 + 0.5) / n as f64)).sum::<f64>() / n as f64
}

pub fn uniform(n: usize) -> Positions<1> {
    [(0..n).map(|i| (i as f64 + 0.5) / n as f64).collect()]
}
