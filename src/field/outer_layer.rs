//! Corrects the mass of a field fitted to a body of particles, separately in the deep interior and in the outermost layer.
//!
//! The field that is fitted to particles' densities need not have their mass within the surface at which they end: sums over neighbors
//! smooth the density at a surface, and some of the mass of the outermost particles may belong beyond it, as where the density falls to zero. A
//! common factor would move that mass to the middle. So the density gets two factors: one deep inside, with which the field has the mass that the
//! particles have there, and one more towards the surface, with which it has all of it.

use super::outline::{Ends, share};
use crate::error::Result;
use crate::roots::bisect;
use sph::{parallel, reduce};

/// Spacings from the surface up to which the second factor counts, less and less.
const LAYER: f64 = 2.5;
/// Spacings from the surface from which on particles begin to count as those deep inside, and where all do. The mass beyond the surface is
/// that of particles nearer to it; a wide transition makes little of where its layers of particles are.
const INSIDE: [f64; 2] = [1.0, 4.0];
/// Spacings from the surface from which on they are all the same.
pub(super) const DEEP: f64 = if LAYER > INSIDE[1] { LAYER } else { INSIDE[1] };
/// Part of the mass that is deep inside, at least, if a factor is to be found from it.
const ENOUGH: f64 = 0.1;
/// Factors beyond which densities and masses are of different things.
const LARGEST_INSIDE: f64 = 1.25;
const LARGEST: f64 = 3.0;
/// Places at which the field is looked at for each particle, and at least and at most, and how many in the box about them are tried for each.
const PLACES: usize = 20;
const FEWEST: usize = 20_000;
const MOST: usize = 200_000;
const TRIES: usize = 16;
/// Places from which on the mass of a field is known to a percent or two: bodies far apart fill little of the box about them.
const KNOWN: usize = 500;

/// Some mass and how many spacings from the surface it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portion {
    pub mass: f64,
    pub depth: f64,
}

/// Factors on the density that a field of particles has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LayerFactors {
    /// Everywhere.
    pub inside: f64,
    /// At the surface, beside the other.
    pub outside: f64,
}

/// How much a depth counts as the outermost layer.
fn towards_surface(depth: f64) -> f64 {
    (1.0 - depth / LAYER).clamp(0.0, 1.0).powi(2)
}

/// How much a depth counts as deep inside.
pub(super) fn deep(depth: f64) -> f64 {
    let t = ((depth - INSIDE[0]) / (INSIDE[1] - INSIDE[0])).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// How the mass of a field and that of the particles that it is of go together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Balance {
    Kept(LayerFactors),
    /// Deep inside the field has so many times the mass of the particles there, which is not that of the same body.
    Contradicted(f64),
    /// They cannot be compared, or only the layer at the surface is far off.
    Unknown,
}

impl Balance {
    /// With the factors by which the field's portions get the particles' mass.
    pub(super) fn new(particles: &[Portion], field: &[Portion]) -> Self {
        let sum = |of: &[Portion], weight: &(dyn Fn(f64) -> f64 + Sync)| {
            reduce::sum(of.len(), |i| of[i].mass * weight(of[i].depth))
        };
        if field.len() < KNOWN {
            return Self::Unknown;
        }
        let total = sum(particles, &|_| 1.0);
        let own = sum(particles, &deep);
        let inside = if own > ENOUGH * total { own / sum(field, &deep) } else { 1.0 };
        if !(1.0 / LARGEST_INSIDE..=LARGEST_INSIDE).contains(&inside) {
            return if inside > 0.0 && inside.is_finite() { Self::Contradicted(1.0 / inside) } else { Self::Unknown };
        }
        let lacks = |log: f64| inside * sum(field, &|depth| (log * towards_surface(depth)).exp()) < total;
        let ends @ [lo, hi] = [-LARGEST.ln(), LARGEST.ln()];
        if lacks(hi) || !lacks(lo) {
            return Self::Unknown;
        }
        let [lo, hi] = bisect(lacks, ends, HALVINGS);
        Self::Kept(LayerFactors { inside, outside: (0.5 * (lo + hi)).exp() })
    }

    /// What is probably not meant, with the remedy.
    pub(crate) fn doubt(&self) -> Option<String> {
        let Self::Contradicted(times) = self else { return None };
        Some(format!(
            "the densities of the file have {times:.1e} times the mass of its particles: one of them is in another unit, or out of date; \
             without a column of densities these are summed from masses and positions"
        ))
    }
}

impl LayerFactors {
    /// The logarithm of the factor at a depth.
    pub(super) fn log_at(&self, depth: f64) -> f64 {
        self.inside.ln() + self.outside.ln() * towards_surface(depth)
    }

    /// What is said of it; nothing where it is next to nothing.
    pub(crate) fn note(&self) -> Option<String> {
        let percent = |factor: f64| 100.0 * (factor - 1.0);
        let [inside, outside] = [self.inside, self.inside * self.outside].map(percent);
        (inside.abs().max(outside.abs()) >= 0.1).then(|| {
            format!(
                "so that mass stays where the particles are, their densities are changed by {inside:+.1} % inside, and by {outside:+.1} % at the surface, \
                 which sums over neighbors smooth"
            )
        })
    }
}

/// The logarithm of the second factor is found to 1e-9.
const HALVINGS: usize = 32;

/// The mass of a density at places that fill what particles fill evenly; `found` is the density with the spacing there, none outside.
///
/// # Errors
/// None, as there is a box about them.
pub(super) fn portions<const D: usize>(
    ends: &Ends<D>,
    particles: usize,
    found: impl Fn(&[f64; D]) -> Option<(f64, f64)> + Sync,
) -> Result<Vec<Portion>> {
    let domain = ends.domain()?;
    let extent = domain.extent();
    let wanted = (PLACES * particles).clamp(FEWEST, MOST);
    let look = |i: usize| -> Option<Portion> {
        let x = sph::array(|k| domain.lo[k] + share(i, k, D) * extent[k]);
        let (density, spacing) = found(&x)?;
        Some(Portion { mass: density, depth: ends.distance(&x, DEEP * spacing) / spacing })
    };
    let (mut all, mut tried) = (Vec::new(), 0);
    while all.len() < wanted && tried < TRIES * wanted {
        all.extend(parallel::map(wanted, |i| look(tried + i)).into_iter().flatten());
        tried += wanted;
    }
    let volume = extent.iter().product::<f64>() / tried as f64;
    all.iter_mut().for_each(|portion| portion.mass *= volume);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Portions of a ball of radius 1 with layers of particles `spacing` apart, and of a density within `radius`.
    fn of_ball(density: impl Fn(f64) -> f64, radius: f64, step: f64, spacing: f64) -> Vec<Portion> {
        let count = (radius / step).round() as usize;
        let shell = |i: usize| {
            let r = (i as f64 + 0.5) * step;
            Portion { mass: 4.0 * std::f64::consts::PI * r * r * step * density(r), depth: (radius - r) / spacing }
        };
        (0..count).map(shell).collect()
    }

    #[test]
    fn what_sums_smooth_away_at_a_surface_is_put_back_there() {
        let particles = of_ball(|_| 1.0, 1.0, 0.05, 0.05);
        let smoothed = of_ball(|r| 1.02 * (1.0 - 0.4 * towards_surface((1.0 - r) / 0.05)), 1.0, 1e-3, 0.05);
        let Balance::Kept(factors) = Balance::new(&particles, &smoothed) else { panic!("no factors") };
        assert!((factors.inside * 1.02 - 1.0).abs() < 3e-3, "{factors:?}");
        assert!(factors.outside > 1.4 && factors.outside < 1.8, "{factors:?}");
        let mass = |of: &[Portion]| of.iter().map(|p| p.mass).sum::<f64>();
        let made: f64 = smoothed.iter().map(|p| p.mass * factors.log_at(p.depth).exp()).sum();
        assert!((made / mass(&particles) - 1.0).abs() < 1e-8);
        assert!(factors.note().is_some_and(|note| note.contains(" % inside, and by +5")), "{:?}", factors.note());
    }

    #[test]
    fn what_has_its_mass_is_left_and_what_has_another_is_not_guessed_at() {
        let particles = of_ball(|_| 1.0, 1.0, 0.05, 0.05);
        let same = of_ball(|_| 1.0, 1.0, 1e-3, 0.05);
        let Balance::Kept(factors) = Balance::new(&particles, &same) else { panic!("no factors") };
        assert!((factors.inside - 1.0).abs() < 3e-3 && (factors.outside - 1.0).abs() < 0.05, "{factors:?}");
        let other = Balance::new(&particles, &of_ball(|_| 7.0, 1.0, 1e-3, 0.05));
        assert!(matches!(other, Balance::Contradicted(times) if (times / 7.0 - 1.0).abs() < 3e-3), "{other:?}");
        assert!(other.doubt().is_some_and(|doubt| doubt.contains("times the mass")));
        for nothing in [of_ball(|_| 0.0, 1.0, 1e-3, 0.05), Vec::new()] {
            assert_eq!(Balance::new(&particles, &nothing), Balance::Unknown);
        }
    }
}
