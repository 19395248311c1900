//! The laws of a disc that a scene states: surface density, temperature and edges as functions of radius.

use super::well::Well;
use crate::error::{Error, Result};
use crate::field::quadrature::integrate;
use crate::input::formula::Formula;
use std::f64::consts::{PI, TAU};

/// Slopes are those between two radii so far apart, as a part of the radius.
const STEP: f64 = 1e-4;
/// Cells over which the surface density is integrated, and Gauss points in each.
const CELLS: usize = 2048;
const ORDER: usize = 4;
/// An edge falls over so many widths.
pub(super) const WIDTHS: f64 = 3.0;
/// Steps at which a power law is looked for, and by how much their powers may differ.
const TRIES: u32 = 16;
const SAME_POWER: f64 = 1e-6;
/// In place of a radius of 0, as a part of the outer one.
const CENTER: f64 = 1e-6;

/// What sets the temperature.
pub(super) enum Temperature {
    SoundSpeed(Formula),
    AspectRatio(Formula),
}

/// A disc by radius, but for its scale.
pub(super) struct Law {
    pub surface: Formula,
    pub temperature: Temperature,
    /// Inner and outer radius.
    pub edges: [f64; 2],
    /// Widths of the edges; 0 where they are sharp.
    pub widths: [f64; 2],
}

impl Law {
    /// Tries both expressions.
    ///
    /// # Errors
    /// Values that are not positive.
    pub fn check(&self) -> Result<()> {
        self.surface.check(self.edges)?;
        let (Temperature::SoundSpeed(formula) | Temperature::AspectRatio(formula)) = &self.temperature;
        formula.check(self.edges)
    }

    /// What the edges leave of the surface density, from 0 to 1.
    pub fn edge(&self, radius: f64) -> f64 {
        let [inner, outer] = self.edges;
        let depths = [radius - inner, outer - radius];
        let of = |k: usize| {
            let missing = WIDTHS - depths[k] / self.widths[k];
            if self.widths[k] > 0.0 && missing > 0.0 { (-0.5 * missing * missing).exp() } else { 1.0 }
        };
        of(0) * of(1)
    }

    /// Within this radius all is as it is there: what falls or rises as a power of R has no value in the middle.
    pub fn center(&self) -> f64 {
        CENTER * self.edges[1]
    }

    /// The radius, or that of the center where it is within.
    pub fn off_center(&self, radius: f64) -> f64 {
        radius.max(self.center())
    }

    /// Without its scale.
    pub fn surface_density(&self, radius: f64) -> f64 {
        self.surface.at(self.off_center(radius)) * self.edge(radius)
    }

    /// Integral of the surface density over the disc, and how far it is off at most.
    pub fn integral(&self) -> (f64, f64) {
        let [inner, outer] = self.edges;
        let over = |cells: usize| -> f64 {
            let at = |i: usize| inner + (outer - inner) * (i as f64 / cells as f64).powi(2);
            let ring = |r: f64| TAU * r * self.surface_density(r);
            (0..cells).map(|i| integrate(ORDER, at(i), at(i + 1), &ring)).sum()
        };
        let fine = over(CELLS);
        (fine, (fine - over(CELLS / 2)).abs())
    }

    pub fn sound_speed(&self, well: &Well, radius: f64) -> f64 {
        let radius = self.off_center(radius);
        match &self.temperature {
            Temperature::SoundSpeed(speed) => speed.at(radius),
            Temperature::AspectRatio(ratio) => ratio.at(radius) * (well.pull(radius) * radius).sqrt(),
        }
    }

    /// q where the sound speed falls as R^-q from edge to edge, with q above 0.
    pub fn fall(&self, well: &Well) -> Option<f64> {
        let [inner, outer] = self.edges;
        let inner = self.off_center(inner);
        let place = |i: u32| inner * (outer / inner).powf(f64::from(i) / f64::from(TRIES));
        let slope = |i: u32| {
            let [low, high] = [place(i), place(i + 1)];
            -(self.sound_speed(well, high) / self.sound_speed(well, low)).ln() / (high / low).ln()
        };
        let first = slope(0);
        (first > SAME_POWER && (1..TRIES).all(|i| (slope(i) - first).abs() < SAME_POWER)).then_some(first)
    }

    /// That of thin gas that `well` holds, or that of gas that holds itself if it is the smaller one; `scale` is that of the surface
    /// density, 0 for gas without gravity of its own.
    ///
    /// # Errors
    /// Gas that nothing holds.
    pub fn scale_height(&self, well: &Well, radius: f64, scale: f64) -> Result<f64> {
        let radius = self.off_center(radius);
        let speed = self.sound_speed(well, radius);
        let held = speed * (radius / well.pull(radius)).sqrt();
        let own = speed * speed / (PI * well.constant * scale * self.surface_density(radius));
        match held.min(own) {
            height if height > 0.0 && height.is_finite() => Ok(height),
            _ => Err(Error::scene(
                "input.profile.disc",
                format!(
                    "has no scale height at R = {radius:e}: its sound speed there is {speed:e}, and gravity {:e}",
                    well.pull(radius)
                ),
            )),
        }
    }

    /// The two radii between which slopes at one are taken.
    pub fn around(&self, radius: f64) -> (f64, f64) {
        let [inner, outer] = self.edges;
        let step = STEP * self.off_center(radius);
        ((radius - step).max(inner), (radius + step).min(outer))
    }

    /// d ln Sigma/dR and dc^2/dR.
    pub fn slopes(&self, well: &Well, radius: f64) -> [f64; 2] {
        let (low, high) = self.around(radius);
        let speed = |r: f64| self.sound_speed(well, r).powi(2);
        let surface = |r: f64| self.surface_density(r).ln();
        [(surface(high) - surface(low)) / (high - low), (speed(high) - speed(low)) / (high - low)]
    }
}
