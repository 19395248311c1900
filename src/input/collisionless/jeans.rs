//! Gaussian velocities of the dispersion that holds a body: rho sigma^2 = int_r^R rho M/r^2 dr (Jeans's equation for isotropic
//! velocities; Binney & Tremaine 2008, equation 4.216), 0 at the edge.
//!
//! Speeds are cut at that of escape, and the Gaussians are so much wider that the dispersion is what it should be.

use super::well::{Sphere, Well};
use crate::field::quadrature::integrate;
use crate::input::waves::normal;
use crate::roots::bisect;
use rand::RngExt;

const ORDER: usize = 4;
/// Gauss points of the mean square of a cut Gaussian; it is cut at no more than this many standard deviations.
const POINTS: usize = 16;
const WIDEST: f64 = 12.0;
const BISECTIONS: usize = 60;
/// The mean square of speeds below the cut is at most this part of its square: that of a uniform ball.
const UNIFORM: f64 = 0.6;
/// Draws before a speed is left at what a uniform ball has: one in e^100 comes so far.
const MOST_DRAWS: usize = 1_000_000;

pub(super) struct Jeans {
    radii: Vec<f64>,
    /// Standard deviation of a component, before the cut.
    width: Vec<f64>,
    escape: Vec<f64>,
}

impl Jeans {
    /// # Errors
    /// Where particles would have to be faster than what escapes.
    pub fn new(sphere: &Sphere<'_>, well: &Well) -> Result<Self, String> {
        let outer = sphere.nodes.last().copied().unwrap_or(0.0);
        let mut radii: Vec<f64> = well.radii.iter().copied().filter(|r| *r < outer).collect();
        radii.push(outer);
        let pull = |r: f64| (sphere.density)(r) * (sphere.enclosed)(r) / (r * r);
        let mut pressure = vec![0.0; radii.len()];
        for i in (0..radii.len() - 1).rev() {
            pressure[i] = pressure[i + 1] + integrate(ORDER, radii[i], radii[i + 1], &pull);
        }
        let (mut width, mut escape) = (Vec::new(), Vec::new());
        for (r, p) in radii.iter().zip(&pressure) {
            let density = (sphere.density)(*r);
            let square = if density > 0.0 { p / density } else { 0.0 };
            let fastest = 2.0 * (well.escape - well.at(*r).1);
            if !(3.0 * square < UNIFORM * fastest) {
                return Err(format!(
                    "would have to be faster than what escapes: at {:.3} of the outer radius the dispersion is {:.3} of the escape speed; \
                     state more mass, or another density",
                    r / outer,
                    (square / fastest).sqrt()
                ));
            }
            escape.push(fastest.sqrt());
            width.push(fastest.sqrt() / cut(3.0 * square / fastest));
        }
        Ok(Self { radii, width, escape })
    }

    /// A speed at the radius `r`.
    pub fn speed(&self, r: f64, random: &mut impl RngExt) -> f64 {
        let i = self.radii.partition_point(|x| *x <= r).saturating_sub(1).min(self.radii.len() - 2);
        let share = ((r - self.radii[i]) / (self.radii[i + 1] - self.radii[i])).clamp(0.0, 1.0);
        let between = |values: &[f64]| values[i] + share * (values[i + 1] - values[i]);
        let (width, escape) = (between(&self.width), between(&self.escape));
        for _ in 0..MOST_DRAWS {
            let v: [f64; 3] = sph::array(|_| width * normal(random));
            let speed = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            if speed < escape {
                return speed;
            }
        }
        escape * UNIFORM.sqrt()
    }
}

/// Mean square of the speed of a Gaussian in three dimensions that is cut at `x` standard deviations, over x^2.
fn mean_square(x: f64) -> f64 {
    let moment = |power: i32| {
        let end = x.min(WIDEST);
        let half = |a: f64, b: f64| integrate(POINTS, a, b, &|t| t.powi(power) * (-0.5 * t * t).exp());
        (0..4).map(|i| half(end * f64::from(i) / 4.0, end * f64::from(i + 1) / 4.0)).sum::<f64>()
    };
    moment(4) / (moment(2) * x * x)
}

/// Where to cut a Gaussian, in standard deviations, for a mean square of this part of that of the cut.
fn cut(part: f64) -> f64 {
    // Far out the cut changes nothing: the mean square is 3.
    if part < 3.0 / (WIDEST * WIDEST) {
        return (3.0 / part).sqrt();
    }
    let [low, high] = bisect(|x| mean_square(x) > part, [1e-3, WIDEST], BISECTIONS);
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 without a cut, 0.6 x^2 for a cut far within.
    #[test]
    fn cut_gaussians_have_the_mean_square_asked_for() {
        assert!((mean_square(10.0) * 100.0 - 3.0).abs() < 1e-10);
        assert!((mean_square(0.01) - UNIFORM).abs() < 1e-4);
        for part in [0.55, 0.3, 0.1, 0.03, 0.01] {
            let x = cut(part);
            assert!((mean_square(x) / part - 1.0).abs() < 1e-9, "{part}: {x}");
        }
        assert_eq!(cut(0.0), f64::INFINITY);
    }
}
