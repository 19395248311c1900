//! Density errors of more particles than fit in memory: accumulated over parts of them in three passes.

use super::ErrorFigures;
use super::density_error::FEW;

/// Densities of a part with what they should be. Particles have one mass.
#[derive(Debug, Clone, Copy)]
pub struct Ratios<'a> {
    pub density: &'a [f64],
    pub target: &'a [f64],
    pub mass: f64,
}

/// Bins per decade of a ratio or a deviation: what 99 % stay below is known to a third of a percent of itself.
const PER_DECADE: f64 = 768.0;
/// Decades from the smallest that is told from 0 to the largest.
const DECADES: f64 = 24.0;
const SMALLEST: f64 = 1e-16;

/// How many of some positive numbers are in bins of equal ratios.
#[derive(Debug, Clone, PartialEq)]
struct Histogram(Vec<u64>);

impl Default for Histogram {
    fn default() -> Self {
        Self(vec![0; (PER_DECADE * DECADES) as usize])
    }
}

impl Histogram {
    fn add(&mut self, value: f64) {
        let place = (PER_DECADE * (value / SMALLEST).log10()).clamp(0.0, (self.0.len() - 1) as f64);
        self.0[place as usize] += 1;
    }

    /// What so many of them are not above, to a bin.
    fn nth(&self, count: u64) -> f64 {
        let mut before = 0;
        let bin = self.0.iter().position(|n| {
            before += n;
            before > count
        });
        SMALLEST * 10.0_f64.powf((bin.unwrap_or(self.0.len() - 1) as f64 + 0.5) / PER_DECADE)
    }
}

/// What the mass is to be multiplied by: the mean of rho*/rho over those of a set that are within a factor of two of the median.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DensityFold {
    count: u64,
    ratios: Histogram,
    sum: f64,
    counted: u64,
}

impl DensityFold {
    /// First, looks at each part.
    pub fn look(&mut self, part: &Ratios<'_>, set: &[bool]) {
        for i in part.of(set) {
            self.count += 1;
            self.ratios.add(part.target[i] / part.density[i]);
        }
    }

    /// Then, takes the mean over each part.
    pub fn refit(&mut self, part: &Ratios<'_>, set: &[bool]) {
        let median = self.ratios.nth(self.count / 2);
        for ratio in part.of(set).map(|i| part.target[i] / part.density[i]) {
            if ratio > 0.5 * median && ratio < 2.0 * median {
                self.sum += ratio;
                self.counted += 1;
            }
        }
    }

    /// The factor, once all parts have been gone through twice.
    pub fn factor(&self) -> f64 {
        if self.counted > 0 { self.sum / self.counted as f64 } else { 1.0 }
    }

    /// Figures with a factor on the mass, for which each part is to be taken up.
    pub fn with(&self, factor: f64) -> FiguresFold {
        FiguresFold { factor, ..FiguresFold::default() }
    }
}

/// Figures over what was taken up.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FiguresFold {
    factor: f64,
    particles: u64,
    squares: f64,
    norm: f64,
    sum: f64,
    max: f64,
    deviations: Histogram,
}

impl FiguresFold {
    pub fn take(&mut self, part: &Ratios<'_>, set: &[bool]) {
        for i in part.of(set) {
            let (density, target, volume) =
                (self.factor * part.density[i], part.target[i], part.mass / part.density[i]);
            let deviation = (density / target - 1.0).abs();
            self.particles += 1;
            self.squares += (density - target).powi(2) * volume;
            self.norm += target.powi(2) * volume;
            self.sum += deviation;
            self.max = self.max.max(deviation);
            self.deviations.add(deviation);
        }
    }

    /// None of an empty set.
    pub fn figures(&self) -> Option<ErrorFigures> {
        let most = ((1.0 - FEW) * self.particles as f64) as u64;
        (self.particles > 0).then(|| ErrorFigures {
            particles: self.particles as usize,
            epsilon: self.squares / self.norm,
            mean: self.sum / self.particles as f64,
            most: self.deviations.nth(most.min(self.particles - 1)).min(self.max),
            max: self.max,
        })
    }
}

impl Ratios<'_> {
    /// Those of the set that have a target.
    fn of<'s>(&'s self, set: &'s [bool]) -> impl Iterator<Item = usize> + 's {
        (0..self.density.len()).filter(|&i| set[i] && self.target[i] > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::density_error::{figures, refit};
    use sph::exchange::Alone;

    /// In parts, what all of them give at once.
    #[test]
    fn parts_make_the_figures_of_the_whole() {
        let n = 5000;
        let wave = |i: usize| 1e-3 * (0.7 * i as f64).sin().powi(3) + if i.is_multiple_of(977) { 2.5 } else { 0.0 };
        let target: Vec<f64> = (0..n).map(|i| 1.0 + (i % 13) as f64).collect();
        let density: Vec<f64> = (0..n).map(|i| 1.02 * target[i] * (1.0 + wave(i))).collect();
        let volume: Vec<f64> = density.iter().map(|rho| 0.5 / rho).collect();
        let set: Vec<bool> = (0..n).map(|i| i % 3 != 0).collect();
        let parts = [0..700, 700..701, 701..n];
        let mut fold = DensityFold::default();
        let part =
            |r: &std::ops::Range<usize>| Ratios { density: &density[r.clone()], target: &target[r.clone()], mass: 0.5 };
        parts.iter().for_each(|r| fold.look(&part(r), &set[r.clone()]));
        parts.iter().for_each(|r| fold.refit(&part(r), &set[r.clone()]));
        let expected = refit(&Alone, &density, &target, &set);
        assert!((fold.factor() / expected - 1.0).abs() < 1e-12, "{} {expected}", fold.factor());
        for factor in [1.0, expected] {
            let mut found = fold.with(factor);
            parts.iter().for_each(|r| found.take(&part(r), &set[r.clone()]));
            let (found, expected) =
                (found.figures().unwrap(), figures(&Alone, (&density, factor), &target, &volume, &set));
            assert_eq!(found.particles, expected.particles);
            for (found, expected, most) in [
                (found.epsilon, expected.epsilon, 1e-12),
                (found.mean, expected.mean, 1e-12),
                (found.max, expected.max, 1e-12),
                (found.most, expected.most, 4e-3),
            ] {
                assert!((found / expected - 1.0).abs() < most, "{found:e} {expected:e}");
            }
        }
        assert!(FiguresFold::default().figures().is_none());
    }
}
