//! Random numbers of a scene.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Coordinates; those beyond the dimension are 0.
pub type Point = [f64; 3];

/// The random numbers of one scene, all of them from its number.
pub struct Draw(Xoshiro256PlusPlus);

impl Draw {
    pub fn new(number: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(number))
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }

    /// True in so many of a hundred cases.
    pub fn percent(&mut self, n: usize) -> bool {
        self.below(100) < n
    }

    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.0.random::<f64>()
    }

    /// 10 to a power between two.
    pub fn decades(&mut self, lo: f64, hi: f64) -> f64 {
        10_f64.powf(self.between(lo, hi))
    }

    pub fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

/// A unit vector in `d` dimensions.
pub fn direction(draw: &mut Draw, d: usize) -> Point {
    match d {
        1 => [1.0, 0.0, 0.0],
        2 => {
            let angle = draw.between(0.0, TAU);
            [angle.cos(), angle.sin(), 0.0]
        }
        _ => {
            let (height, angle) = (draw.between(-1.0, 1.0), draw.between(0.0, TAU));
            let across = (1.0 - height * height).sqrt();
            [across * angle.cos(), across * angle.sin(), height]
        }
    }
}
