//! Gas in equilibrium in a disc that is isothermal along z.
//!
//! With the sound speed c(R) and Phi of all gravity, the density is rho = Sigma(R)/I(R) exp(-[Phi(R, z) - Phi(R, 0)]/c^2), where I makes
//! the surface density Sigma, and the gas stays in its place along R if it turns with
//!
//! v_phi^2/R = dPhi/dR (R, 0) + c^2 d ln(Sigma/I)/dR + dc^2/dR (1 + [Phi(R, z) - Phi(R, 0)]/c^2)
//!
//! (Takeuchi & Lin 2002, ApJ 581, 1344, for a point mass).
//!
//! For a code whose gas has the temperature of its distance r from the star, c(r) ~ r^-q, the pressure is P = c^2(R) Sigma/I exp(-E) with
//! E = integral of dPhi/dz / c^2(r) along z, the density P/c^2(r), and v_phi^2/R = dPhi/dR + dP/dR / rho at every height.

use super::law::{Law, WIDTHS};
use super::own::Own;
use super::rows::Rows;
use super::well::Well;
use crate::error::{Error, Result};
use crate::field::MassEstimate;
use crate::field::quadrature::integrate;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Rows of the tables: steps as a part of the scale height, and how many there are at least and at most.
const STEP: f64 = 0.5;
const NUMBER: [usize; 2] = [48, 1200];
/// Panels of the integral along z, as a part of the scale height. Far above it, where the density of a hot disc about a point mass falls no
/// further, they are so many times smaller than z.
const PANEL: f64 = 0.5;
const FAR: f64 = 16.0;
const ORDER: usize = 6;
/// exp(-x) of the density in the plane is nothing.
const NOTHING: f64 = 40.0;
/// The disc is cut where the density is exp(-x) of that in the plane.
const TOP: f64 = 11.5;
/// Gas that is not down to exp(-x) within twice the outer radius is no disc.
const BOUND: f64 = 6.0;
/// Steps by which the width of the inner edge is found.
const EDGE_STEPS: usize = 60;
/// Edges count in what is refused and reported where they leave more than this of the surface density.
const EDGE: f64 = 0.05;

/// All of a disc, in the units of the input.
pub(super) struct Gas {
    law: Law,
    well: Well,
    /// q of c ~ r^-q, where the temperature is that of the distance from the center; `None` where it is that of the distance from the axis.
    fall: Option<f64>,
    own: Option<Own>,
    rows: Rows,
    /// ln I by row.
    column: Vec<f64>,
    scale: f64,
    /// Largest height.
    pub top: f64,
    pub mass: MassEstimate,
}

/// Figures of a disc for the report.
pub(super) struct Figures {
    /// Least and largest c over the circular speed in the plane.
    pub aspect_ratio: [f64; 2],
    /// Toomre's Q where it is least, and the radius.
    pub stability: (f64, f64),
    /// The radius at which rings are unstable: their angular momentum falls outward.
    pub unstable_rings: Option<f64>,
}

impl Gas {
    /// # Errors
    /// A disc that nothing holds, that is too heavy or too hot, or narrower than its edges.
    pub fn new(
        (mut law, well): (Law, Well),
        mass: f64,
        edge_width: f64,
        (has_own, fall): (bool, Option<f64>),
    ) -> Result<Self> {
        let of_own = |scale: f64| if has_own { scale } else { 0.0 };
        if edge_width > 0.0 {
            // What bends a steep edge back is the rotation about other bodies, where there are any.
            let rough = if well.is_empty() { of_own(mass / law.integral().0) } else { 0.0 };
            let width = |r: f64| law.scale_height(&well, r, rough).map(|height| edge_width * height);
            let [inner, outer] = law.edges;
            let mut widths = [if inner > 0.0 { width(inner)? } else { 0.0 }, width(outer)?];
            // Where the inner edge ends the scale height is larger than where it begins.
            for _ in 0..EDGE_STEPS {
                if inner > 0.0 {
                    widths[0] = width((inner + WIDTHS * widths[0]).min(outer))?;
                }
            }
            law.widths = widths;
            let both = WIDTHS * (widths[0] + widths[1]);
            if both > outer - inner {
                let problem = format!(
                    "is {edge_width}, with which the edges are {:.3} times as wide as the disc; take less, or 0 for sharp edges",
                    both / (outer - inner)
                );
                return Err(Error::scene("input.profile.disc.edge_width", problem));
            }
        }
        let (integral, error) = law.integral();
        let scale = mass / integral;
        if !(scale > 0.0 && scale.is_finite()) {
            let problem = format!("has the integral {integral:e} over the disc, expected a positive number");
            return Err(Error::scene("input.profile.disc.surface_density", problem));
        }
        let height = |r: f64| law.scale_height(&well, r, of_own(scale)).unwrap_or(f64::INFINITY);
        let rows = || Rows::new(law.edges, |r| STEP * height(r), NUMBER);
        let own = has_own.then(|| Own::new(&law, &well, rows(), scale)).transpose()?;
        let rows = rows().halved();
        let mass = MassEstimate { value: mass, error: mass * (error / integral).max(1e-12) };
        let mut gas =
            Self { law, well, fall, own, column: vec![0.0; rows.places().len()], rows, scale, top: 0.0, mass };
        gas.top = gas.highest()?;
        let column = |&r: &f64| gas.integral_along_z(r).map(f64::ln);
        gas.column = gas.rows.places().par_iter().map(column).collect::<Result<_>>()?;
        gas.check_rotation()?;
        Ok(gas)
    }

    fn sound_speed(&self, radius: f64) -> f64 {
        self.law.sound_speed(&self.well, radius)
    }

    /// Phi(R, z) - Phi(R, 0) of all gravity. At a point mass in the middle it would be infinite.
    fn rise(&self, radius: f64, z: f64) -> f64 {
        self.well.rise(self.law.off_center(radius), z) + self.own.as_ref().map_or(0.0, |own| own.rise(radius, z))
    }

    /// The integral of dPhi/dz / c^2 from the plane.
    fn exponent(&self, radius: f64, z: f64) -> f64 {
        let plane = self.sound_speed(radius).powi(2);
        let Some(fall) = self.fall else { return self.rise(radius, z) / plane };
        let points = self.well.points_rise(self.law.off_center(radius), z, fall);
        (points + self.others_exponent(radius, z, fall)) / plane
    }

    /// That of all but points that are not softened, times the c^2 in the plane.
    fn others_exponent(&self, radius: f64, z: f64, fall: f64) -> f64 {
        let own = self.own.as_ref().map(|own| own.rises(radius));
        if own.is_none() && !self.well.has_others() {
            return 0.0;
        }
        // By parts: 1/c^2 changes little where there is gas.
        let radius = self.law.off_center(radius);
        let rise = |z: f64| self.well.others_rise(radius, z) + own.as_ref().map_or(0.0, |own| own(z));
        let warmth = |z: f64| self.cooling(radius, z).recip();
        let slope = |z: f64| 2.0 * fall * z / (radius * radius + z * z) * warmth(z);
        rise(z) * warmth(z) - integrate(ORDER, 0.0, z, &|z| rise(z) * slope(z))
    }

    /// c^2 over that in the plane.
    fn cooling(&self, radius: f64, z: f64) -> f64 {
        self.fall.map_or(1.0, |fall| (-fall * (z / self.law.off_center(radius)).powi(2).ln_1p()).exp())
    }

    fn scale_height(&self, radius: f64) -> Result<f64> {
        let scale = if self.own.is_some() { self.scale } else { 0.0 };
        self.law.scale_height(&self.well, radius, scale)
    }

    /// The height at which the density has fallen to next to nothing everywhere.
    fn highest(&self) -> Result<f64> {
        let limit = 2.0 * self.law.edges[1];
        let one = |&r: &f64| {
            if self.exponent(r, limit) < BOUND {
                let problem = format!(
                    "is so hot at R = {r:e} that gravity does not hold it in a disc: at a height of twice the outer radius the density is {:.2e} of that in the \
                     plane; take less than about 0.3 for H/R",
                    (-self.exponent(r, limit)).exp()
                );
                return Err(Error::scene("input.profile.disc", problem));
            }
            let (mut low, mut high) = (0.0, limit);
            while high - low > 1e-6 * limit {
                let middle = 0.5 * (low + high);
                if self.exponent(r, middle) < TOP { low = middle } else { high = middle }
            }
            Ok(high)
        };
        let heights: Vec<f64> = self.rows.places().par_iter().map(one).collect::<Result<_>>()?;
        Ok(heights.into_iter().fold(0.0, f64::max))
    }

    /// I: of the density over that in the plane, over all heights within the disc.
    fn integral_along_z(&self, radius: f64) -> Result<f64> {
        let height = self.scale_height(radius)?;
        let (mut z, mut sum) = (0.0, 0.0);
        while z < self.top && self.exponent(radius, z) < NOTHING {
            let end = (z + PANEL * height.max(z / FAR)).min(self.top);
            sum += integrate(ORDER, z, end, &|z| (-self.exponent(radius, z)).exp() / self.cooling(radius, z));
            z = end;
        }
        Ok(2.0 * sum)
    }

    fn is_within(&self, radius: f64, z: f64) -> bool {
        // The edges themselves belong to the disc, in spite of rounding.
        let [inner, outer] = self.law.edges;
        let near = 1e-12 * outer;
        radius >= inner - near && radius <= outer + near && z.abs() <= self.top * (1.0 + 1e-12)
    }

    pub fn density(&self, radius: f64, z: f64) -> f64 {
        if !self.is_within(radius, z) {
            return 0.0;
        }
        let column = self.rows.value(&self.column, radius);
        let exponent = column + self.exponent(radius, z);
        self.scale * self.law.surface_density(radius) * (-exponent).exp() / self.cooling(radius, z)
    }

    pub fn pressure(&self, radius: f64, z: f64) -> f64 {
        self.sound_speed(radius).powi(2) * self.cooling(radius, z) * self.density(radius, z)
    }

    /// dPhi/dR in the plane.
    fn pull(&self, radius: f64) -> f64 {
        self.well.pull(self.law.off_center(radius)) + self.own.as_ref().map_or(0.0, |own| own.pull(radius))
    }

    /// Square of the speed of rotation; negative where no rotation holds the gas.
    fn rotation(&self, radius: f64, z: f64) -> f64 {
        let [surface, speed] = self.law.slopes(&self.well, radius);
        let column = self.rows.slope(&self.column, radius);
        let squared = self.sound_speed(radius).powi(2);
        if self.fall.is_some() {
            let (low, high) = self.law.around(radius);
            let slope = |of: &dyn Fn(f64) -> f64| (of(high) - of(low)) / (high - low);
            let lifted = slope(&|r| self.rise(r, z));
            let along = surface - column + speed / squared - slope(&|r| self.exponent(r, z));
            return radius * (self.pull(radius) + lifted + squared * self.cooling(radius, z) * along);
        }
        let pressure = squared * (surface - column) + speed * (1.0 + self.exponent(radius, z));
        radius * (self.pull(radius) + pressure)
    }

    /// v_phi of gas in equilibrium.
    pub fn speed(&self, radius: f64, z: f64) -> f64 {
        let [inner, outer] = self.law.edges;
        self.rotation(radius.clamp(inner, outer), z).max(0.0).sqrt()
    }

    /// v_phi of what feels no pressure, on circles at its height: R dPhi/dR there.
    pub fn orbital_speed(&self, radius: f64, z: f64) -> f64 {
        let [inner, outer] = self.law.edges;
        let radius = radius.clamp(inner, outer);
        let (low, high) = self.law.around(radius);
        let lifted = (self.rise(high, z) - self.rise(low, z)) / (high - low);
        (radius * (self.pull(radius) + lifted)).max(0.0).sqrt()
    }

    fn counts(&self, radius: f64) -> bool {
        self.law.edge(radius) > EDGE
    }

    fn check_rotation(&self) -> Result<()> {
        let is_pushed_out = |r: f64| r > self.law.center() && self.counts(r) && self.rotation(r, 0.0) < 0.0;
        match self.rows.places().iter().find(|&&r| is_pushed_out(r)) {
            None => Ok(()),
            Some(r) => Err(Error::scene(
                "input.profile.disc",
                format!(
                    "cannot be in equilibrium at R = {r:e}: its pressure force exceeds gravity; choose a lower \
                     aspect_ratio or sound_speed, or a surface_density or edge \
                     that falls less steeply"
                ),
            )),
        }
    }

    pub fn figures(&self) -> Figures {
        let places: Vec<f64> =
            self.rows.places().iter().copied().filter(|&r| r > 1e-3 * self.law.edges[1] && self.counts(r)).collect();
        let moment = |r: f64| r * r * self.rotation(r, 0.0).max(0.0);
        let mut found =
            Figures { aspect_ratio: [f64::INFINITY, 0.0], stability: (f64::INFINITY, 0.0), unstable_rings: None };
        let [inner, outer] = self.law.edges;
        for &r in &places {
            let ratio = self.sound_speed(r) / (self.pull(r) * r).max(0.0).sqrt();
            found.aspect_ratio = [found.aspect_ratio[0].min(ratio), found.aspect_ratio[1].max(ratio)];
            let (low, high) = ((r * 0.999).max(inner), (r * 1.001).min(outer));
            let squared = (moment(high) - moment(low)) / (high - low) / r.powi(3);
            if squared < 0.0 {
                found.unstable_rings.get_or_insert(r);
            }
            let surface = self.scale * self.law.surface_density(r);
            let stability = self.sound_speed(r) * squared.max(0.0).sqrt() / (PI * self.well.constant * surface);
            // Edges are not what a whole disc's stability goes by, nor are rings that rotation itself makes unstable.
            if squared > 0.0 && self.law.edge(r) > 0.5 && stability < found.stability.0 {
                found.stability = (stability, r);
            }
        }
        found
    }
}
