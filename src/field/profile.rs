//! Spherically symmetric density profiles (3-D; rings in 2-D, sheets in 1-D) and their enclosed mass
//! `M(r) = int_0^r S_d r^(d-1) rho dr` with `S_d` = 2, 2 pi, 4 pi.
//!
//! Node values go through a monotone [`Curve`]. Cell averages are reconstructed from the mass that they
//! enclose: `M` as a monotone cubic of the volume `r^d` passes through every cell face, so that each cell keeps
//! its mass and `rho = dM/dV`, a parabola in `r^d`, is continuous and never negative.
//!
//! Radii and densities are divided by powers of two on entry, which is exact and keeps powers of the radius in
//! range.

use super::MassEstimate;
use super::curve::{Curve, Shape, monotone_slopes};
use super::intervals::Intervals;
use super::quadrature::{Sum, binade, integrate};
use sph::geometry::{unit_ball_volume, unit_sphere_area};

/// Radii up to this much beyond the surface count as the surface: they come from rounding.
const SLACK: f64 = 1e-12;
/// Relative step of the density at a node given twice that makes it a discontinuity.
const DISCONTINUITY: f64 = 1e-6;

#[derive(Debug, Clone, Copy)]
enum Density {
    /// By `t = (r - r0) / (r1 - r0)`.
    Radius(Shape),
    /// By `t = (r^d - r0^d) / (r1^d - r0^d)`: cell average and the values at both faces.
    Volume { mean: f64, inner: f64, outer: f64 },
}

#[derive(Debug, Clone, Copy)]
struct Segment {
    r0: f64,
    r1: f64,
    density: Density,
}

/// Density as a function of the distance from a center: constant within the first node, 0 beyond the last.
#[derive(Debug, Clone)]
pub struct RadialProfile {
    dimension: usize,
    starts: Intervals,
    segments: Vec<Segment>,
    /// Mass within the start of each segment, and the total: scaled.
    cumulative: Vec<f64>,
    error: f64,
    /// Scaled radii at which the density is discontinuous, ascending.
    discontinuities: Vec<f64>,
    radius_unit: f64,
    density_unit: f64,
}

impl RadialProfile {
    /// From values at nodes. `nodes` ascend from 0 or above, with equal neighbors for a discontinuity, and the last
    /// lies above the first; `values` are finite and not negative. The caller has checked all of that.
    pub(crate) fn from_nodes(dimension: usize, nodes: &[f64], values: &[f64]) -> Self {
        let (r, y, units) = normalized(nodes, values);
        let mut segments = Vec::new();
        if r[0] > 0.0 {
            segments.push(Segment { r0: 0.0, r1: r[0], density: Density::Radius(Shape::Constant(y[0])) });
        }
        segments.extend(Curve::through(&r, &y).segments().map(|(r0, r1, shape)| Segment {
            r0,
            r1,
            density: Density::Radius(shape),
        }));
        Self { discontinuities: discontinuities(&r, &y), ..Self::assemble(dimension, segments, units) }
    }

    /// From averages over the cells between neighboring nodes (`values` has one entry less). Cells without
    /// volume are skipped.
    pub(crate) fn from_cells(dimension: usize, nodes: &[f64], values: &[f64]) -> Self {
        let (r, y, units) = normalized(nodes, values);
        let cells: Vec<usize> = (0..y.len()).filter(|&i| r[i + 1] > r[i]).collect();
        let widths: Vec<f64> = cells.iter().map(|&i| volume_step(dimension, r[i], r[i + 1])).collect();
        let means: Vec<f64> = cells.iter().map(|&i| y[i]).collect();
        let faces = monotone_slopes(&widths, &means);
        let mut segments = Vec::new();
        if r[0] > 0.0 {
            segments.push(Segment { r0: 0.0, r1: r[0], density: Density::Radius(Shape::Constant(faces[0])) });
        }
        segments.extend(cells.iter().enumerate().map(|(k, &i)| Segment {
            r0: r[i],
            r1: r[i + 1],
            density: Density::Volume { mean: y[i], inner: faces[k], outer: faces[k + 1] },
        }));
        Self::assemble(dimension, segments, units)
    }

    fn assemble(dimension: usize, segments: Vec<Segment>, (radius_unit, density_unit): (f64, f64)) -> Self {
        let mut cumulative = Vec::with_capacity(segments.len() + 1);
        let mut sum = Sum::default();
        let mut error = Sum::default();
        cumulative.push(0.0);
        for segment in &segments {
            let mass = segment.mass(dimension, segment.r1);
            sum.add(mass.value);
            error.add(mass.error);
            cumulative.push(sum.value());
        }
        Self {
            dimension,
            starts: Intervals::new(segments.iter().map(|s| s.r0).collect()),
            segments,
            cumulative,
            error: error.value() + 4.0 * f64::EPSILON * sum.value(),
            discontinuities: Vec::new(),
            radius_unit,
            density_unit,
        }
    }

    /// The same profile with another density within `radius`: through `values` at `nodes`, which ascend from 0 to the radius.
    pub(crate) fn with_interior(&self, radius: f64, nodes: &[f64], values: &[f64]) -> Self {
        let cut = radius / self.radius_unit;
        let mut r: Vec<f64> = nodes.iter().map(|r| r / self.radius_unit).collect();
        r.iter_mut().last().into_iter().for_each(|last| *last = cut);
        let y: Vec<f64> = values.iter().map(|v| v / self.density_unit).collect();
        let inner = Curve::through(&r, &y);
        let inner = inner.segments().map(|(r0, r1, shape)| Segment { r0, r1, density: Density::Radius(shape) });
        let outer = self.segments.iter().filter(|s| s.r1 > cut).map(|s| s.beyond(self.dimension, cut));
        let units = (self.radius_unit, self.density_unit);
        Self {
            discontinuities: self.discontinuities.iter().copied().filter(|d| *d > cut).collect(),
            ..Self::assemble(self.dimension, inner.chain(outer).collect(), units)
        }
    }

    /// The same profile with radii multiplied by `length` and densities by `density`.
    #[must_use]
    pub fn scaled(&self, length: f64, density: f64) -> Self {
        Self { radius_unit: self.radius_unit * length, density_unit: self.density_unit * density, ..self.clone() }
    }

    /// Space dimension whose shells the enclosed mass counts.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Radii above 0 between which the density is interpolated, ascending.
    pub(crate) fn nodes(&self) -> Vec<f64> {
        let ends = self.segments.iter().map(|s| s.r1 * self.radius_unit);
        ends.filter(|r| *r > 0.0).collect()
    }

    /// Radius of the last node.
    pub fn outer_radius(&self) -> f64 {
        self.segments.last().map_or(0.0, |s| s.r1) * self.radius_unit
    }

    /// Radii at which the density is discontinuous, ascending: those given twice with densities that differ.
    pub fn discontinuities(&self) -> Vec<f64> {
        self.discontinuities.iter().map(|r| r * self.radius_unit).collect()
    }

    /// How many discontinuities lie at or within the radius `r`.
    pub fn layer(&self, r: f64) -> usize {
        let r = r.abs() / self.radius_unit;
        self.discontinuities.partition_point(|d| *d <= r)
    }

    /// The layer at the radius `r`, and the radii that bound it: negative infinity within the innermost, and beyond the last
    /// node one more layer without end.
    pub(crate) fn layer_within(&self, r: f64) -> (usize, [f64; 2]) {
        let layer = self.layer(r);
        let outer = self.outer_radius();
        if r > outer {
            return (self.discontinuities.len() + 1, [outer, f64::INFINITY]);
        }
        let radius = |d: &f64| d * self.radius_unit;
        let inner = layer.checked_sub(1).and_then(|i| self.discontinuities.get(i)).map_or(f64::NEG_INFINITY, radius);
        (layer, [inner, self.discontinuities.get(layer).map_or(outer, radius)])
    }

    /// Density at the radius `r`, in the units of the nodes and values; 0 beyond the last node.
    #[inline]
    pub fn density(&self, r: f64) -> f64 {
        let r = r.abs() / self.radius_unit;
        let Some(last) = self.segments.last() else {
            return 0.0;
        };
        if r.is_nan() || r > last.r1 * (1.0 + SLACK) {
            return 0.0;
        }
        let i = self.starts.find(r);
        self.segments[i].evaluate(self.dimension, r).max(0.0) * self.density_unit
    }

    /// Mass within the radius `r`, in the unit of density times length to the dimension.
    pub fn enclosed_mass(&self, r: f64) -> f64 {
        let r = r.abs() / self.radius_unit;
        let i = self.starts.find(r);
        let segment = &self.segments[i];
        let mass = if r >= segment.r1 {
            self.cumulative[i + 1]
        } else {
            self.cumulative[i] + segment.mass(self.dimension, r).value
        };
        mass * self.mass_unit()
    }

    /// The radius that encloses `mass`: 0 for nothing, the last node for all of it or more.
    pub fn radius_of_mass(&self, mass: f64) -> f64 {
        let total = self.cumulative[self.segments.len()];
        let m = mass / self.mass_unit();
        if m.is_nan() || m <= 0.0 {
            return 0.0;
        }
        if m >= total {
            return self.outer_radius();
        }
        let i = self.cumulative.partition_point(|&c| c <= m).saturating_sub(1).min(self.segments.len() - 1);
        self.segments[i].radius_of_mass(self.dimension, m - self.cumulative[i]) * self.radius_unit
    }

    /// The radius within which the fraction `fraction` of the mass lies.
    pub fn radius_of_fraction(&self, fraction: f64) -> f64 {
        self.radius_of_mass(fraction * self.total_mass().value)
    }

    /// Mass within the last node, with the error of its quadrature.
    pub fn total_mass(&self) -> MassEstimate {
        let unit = self.mass_unit();
        MassEstimate { value: self.cumulative[self.segments.len()] * unit, error: self.error * unit }
    }

    fn mass_unit(&self) -> f64 {
        self.density_unit * self.radius_unit.powi(self.dimension as i32)
    }
}

type Units = (f64, f64);

fn normalized(nodes: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>, Units) {
    let peak = values.iter().fold(0.0, |a: f64, &b| a.max(b));
    let units = (binade(nodes[nodes.len() - 1]), binade(peak));
    (nodes.iter().map(|r| r / units.0).collect(), values.iter().map(|v| v / units.1).collect(), units)
}

/// Nodes given more than once between the center and the last, where the first and the last of their values differ.
fn discontinuities(nodes: &[f64], values: &[f64]) -> Vec<f64> {
    let mut found = Vec::new();
    let mut first = 0;
    for i in 1..nodes.len() {
        if nodes[i] != nodes[i - 1] {
            first = i;
        }
        let is_last = nodes.get(i + 1).is_some_and(|next| *next != nodes[i]);
        let (a, b) = (values[first], values[i]);
        if is_last && first < i && nodes[i] > 0.0 && (a - b).abs() > DISCONTINUITY * a.max(b) {
            found.push(nodes[i]);
        }
    }
    found
}

/// `b^d - a^d` without cancellation.
fn volume_step(d: usize, a: f64, b: f64) -> f64 {
    (b - a)
        * match d {
            1 => 1.0,
            2 => a + b,
            _ => a * a + a * b + b * b,
        }
}

/// Points of a rule for the mass of a segment whose density is no polynomial, the part of it that is known to, and halvings at most.
const ORDER: usize = 8;
const ENOUGH: f64 = 1e-14;
const DEPTH: u32 = 12;

impl Segment {
    #[inline]
    fn evaluate(&self, d: usize, r: f64) -> f64 {
        match self.density {
            Density::Radius(shape) => shape.evaluate(self.share(r).clamp(0.0, 1.0)),
            Density::Volume { mean, inner, outer } => {
                let t = self.volume_fraction(d, r);
                let u = 1.0 - t;
                mean + (inner - mean) * u * (1.0 - 3.0 * t) + (outer - mean) * t * (3.0 * t - 2.0)
            }
        }
    }

    fn volume_fraction(&self, d: usize, r: f64) -> f64 {
        (volume_step(d, self.r0, r) / volume_step(d, self.r0, self.r1)).clamp(0.0, 1.0)
    }

    /// The part beyond `r`, with the same densities.
    fn beyond(&self, d: usize, r: f64) -> Self {
        if r <= self.r0 {
            return *self;
        }
        let density = match self.density {
            Density::Radius(shape) => Density::Radius(shape.rest(self.share(r))),
            Density::Volume { outer, .. } => {
                let mass = self.mass(d, self.r1).value - self.mass(d, r).value;
                let volume = unit_ball_volume(d) * volume_step(d, r, self.r1);
                Density::Volume { mean: mass / volume, inner: self.evaluate(d, r), outer }
            }
        };
        Self { r0: r, r1: self.r1, density }
    }

    /// Mass between the segment's start and `r`.
    fn mass(&self, d: usize, r: f64) -> MassEstimate {
        let exact = |value| MassEstimate { value, error: 0.0 };
        let ball = unit_ball_volume(d);
        match self.density {
            Density::Radius(Shape::Constant(y)) => exact(ball * y * volume_step(d, self.r0, r)),
            Density::Volume { mean, inner, outer } => {
                let t = self.volume_fraction(d, r);
                let u = 1.0 - t;
                let fraction = mean * t * t * (3.0 - 2.0 * t) + inner * t * u * u - outer * t * t * u;
                exact(ball * volume_step(d, self.r0, self.r1) * fraction.max(0.0))
            }
            // Degree 3 times r^2: four points are exact.
            Density::Radius(shape @ Shape::Cubic { .. }) => exact(self.of_shape(d, shape, 4, [0.0, self.share(r)])),
            Density::Radius(shape @ Shape::Log { .. }) => {
                let all = [0.0, self.share(r)];
                let whole = self.of_shape(d, shape, ORDER, all);
                self.adaptive(d, shape, all, (whole, ENOUGH * whole, DEPTH))
            }
        }
    }

    /// Where a radius is within the segment, from 0 to 1.
    fn share(&self, r: f64) -> f64 {
        (r - self.r0) / (self.r1 - self.r0)
    }

    /// Mass between two places within the segment, each from 0 to 1: radii of a thin one far out have few digits left to tell them apart.
    fn of_shape(&self, d: usize, shape: Shape, order: usize, [from, to]: [f64; 2]) -> f64 {
        let width = self.r1 - self.r0;
        let surface = |t: f64| (self.r0 + t * width).powi(d as i32 - 1);
        unit_sphere_area(d) * width * integrate(order, from, to, &|t| shape.evaluate(t) * surface(t))
    }

    /// The same by halving as often as it takes for an error of no more than `enough`.
    fn adaptive(
        &self,
        d: usize,
        shape: Shape,
        [from, to]: [f64; 2],
        (whole, enough, depth): (f64, f64, u32),
    ) -> MassEstimate {
        let middle = 0.5 * (from + to);
        let halves = [[from, middle], [middle, to]].map(|half| (half, self.of_shape(d, shape, ORDER, half)));
        let value = halves[0].1 + halves[1].1;
        let error = (value - whole).abs();
        if depth == 0 || error <= enough {
            return MassEstimate { value, error };
        }
        let [l, r] = halves.map(|(half, mass)| self.adaptive(d, shape, half, (mass, enough, depth - 1)));
        MassEstimate { value: l.value + r.value, error: l.error + r.error }
    }

    /// Inverse of [`Self::mass`] by Newton's method within a shrinking bracket.
    fn radius_of_mass(&self, d: usize, mass: f64) -> f64 {
        let surface = unit_sphere_area(d);
        let (mut lo, mut hi) = (self.r0, self.r1);
        let mut r = 0.5 * (lo + hi);
        for _ in 0..100 {
            let excess = self.mass(d, r).value - mass;
            if excess > 0.0 {
                hi = r;
            } else {
                lo = r;
            }
            let slope = surface * r.powi(d as i32 - 1) * self.evaluate(d, r);
            let newton = r - excess / slope;
            let next = if newton > lo && newton < hi { newton } else { 0.5 * (lo + hi) };
            if (next - r).abs() <= 4.0 * f64::EPSILON * r || hi - lo <= 2.0 * f64::EPSILON * hi {
                return next;
            }
            r = next;
        }
        r
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;
    use std::f64::consts::PI;

    fn nodes(n: usize, radius: f64) -> Vec<f64> {
        (0..=n).map(|i| radius * i as f64 / n as f64).collect()
    }

    /// Outside the densities and masses stay what they are, wherever within a segment the radius lies.
    #[test]
    fn an_interior_can_be_replaced() {
        let r = nodes(7, 3.0);
        let y: Vec<f64> = r.iter().map(|r| (-2.5 * r).exp()).collect();
        let steep = RadialProfile::from_nodes(3, &r, &y);
        let flat = RadialProfile::from_nodes(3, &r, &r.iter().map(|r| 4.0 - r).collect::<Vec<_>>());
        let cells = RadialProfile::from_cells(3, &r, &y[..7]);
        for profile in [steep, flat, cells] {
            for radius in [0.2, 1.0, 3.0 / 7.0, 2.9] {
                let edge = profile.density(radius);
                let other = profile.with_interior(radius, &[0.0, radius], &[edge; 2]);
                let ball = 4.0 / 3.0 * PI * radius.powi(3) * edge;
                assert!((other.enclosed_mass(radius) / ball - 1.0).abs() < 1e-12);
                for i in 0..50 {
                    let x = radius + (3.0 - radius) * f64::from(i) / 49.0;
                    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * profile.total_mass().value.max(1.0);
                    assert!(near(other.density(x), profile.density(x)), "{radius} {x}");
                    let beyond = |p: &RadialProfile| p.enclosed_mass(x) - p.enclosed_mass(radius);
                    assert!(near(beyond(&other), beyond(&profile)), "{radius} {x}");
                }
                assert_eq!(other.density(0.5 * radius), edge);
            }
        }
    }

    #[test]
    fn a_polytrope_of_index_one_has_its_mass() {
        // rho = sin(pi r) / (pi r), M = 4 pi / pi^2 = 4 / pi.
        let r = nodes(400, 1.0);
        let rho: Vec<f64> =
            r.iter().map(|&r| if r == 0.0 { 1.0 } else { ((PI * r).sin() / (PI * r)).max(0.0) }).collect();
        let profile = RadialProfile::from_nodes(3, &r, &rho);
        let mass = profile.total_mass();
        assert!((mass.value * PI / 4.0 - 1.0).abs() < 3e-5, "{mass:?}");
        for i in 1..400 {
            assert_eq!(profile.density(r[i]), rho[i]);
        }
        let half = profile.radius_of_fraction(0.5);
        assert!((profile.enclosed_mass(half) / mass.value - 0.5).abs() < 1e-13);
        assert_eq!(profile.density(1.01), 0.0);
    }

    #[test]
    fn uniform_balls_have_the_closed_form_mass_in_every_dimension() {
        for d in 1..=3 {
            let profile = RadialProfile::from_nodes(d, &[0.0, 0.5, 2.0], &[3.0; 3]);
            let expected = 3.0 * unit_ball_volume(d) * 2f64.powi(d as i32);
            let mass = profile.total_mass();
            assert!((mass.value - expected).abs() <= mass.error.max(1e-14 * expected), "{d}: {mass:?}");
            let hollow = RadialProfile::from_nodes(d, &[1.0, 2.0], &[3.0; 2]);
            assert!((hollow.total_mass().value / expected - 1.0).abs() < 1e-14, "constant inside");
        }
    }

    #[test]
    fn a_gaussian_over_twenty_decades_is_integrated_in_log() {
        let r = nodes(300, 7.0);
        let rho: Vec<f64> = r.iter().map(|r| (-r * r).exp()).collect();
        let profile = RadialProfile::from_nodes(3, &r, &rho);
        assert!((profile.total_mass().value / PI.powf(1.5) - 1.0).abs() < 1e-5, "{:?}", profile.total_mass());
        let x = 5.01_f64;
        assert!((profile.density(x) / (-x * x).exp() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn discontinuities_integrate_piecewise() {
        let profile = RadialProfile::from_nodes(3, &[0.0, 1.0, 1.0, 2.0], &[10.0, 10.0, 1.0, 1.0]);
        let expected = 4.0 / 3.0 * PI * (10.0 + 7.0);
        assert!((profile.total_mass().value / expected - 1.0).abs() < 1e-14);
        assert_eq!(profile.density(0.999_999), 10.0);
        assert_eq!(profile.density(1.0), 1.0);
    }

    #[test]
    fn cells_keep_their_masses() {
        // Ten decades of density and cells as thin as 1e-11 of the radius, as MESA writes them.
        let mut r = vec![0.0];
        let mut rho = Vec::new();
        for i in 0..300 {
            let width = if i % 7 == 3 { 1e-11 } else { 0.01 * 1.01_f64.powi(i) };
            r.push(r[i as usize] + width);
            rho.push(150.0 * (-0.08 * f64::from(i)).exp());
        }
        let profile = RadialProfile::from_cells(3, &r, &rho);
        for (k, segment) in profile.segments.iter().enumerate() {
            let expected = rho[k] / profile.density_unit * unit_ball_volume(3) * volume_step(3, segment.r0, segment.r1);
            let mass = segment.mass(3, segment.r1).value;
            assert!((mass / expected - 1.0).abs() < 1e-14, "cell {k}");
            // The density that is evaluated has that mass too, not only its antiderivative.
            let shell = |r: f64| 4.0 * PI * segment.evaluate(3, r) * r * r;
            let sampled = integrate(6, segment.r0, segment.r1, &shell);
            // Within thin cells the radius itself is rounded.
            let rounding = 1e-11 + 1e-15 * segment.r1 / (segment.r1 - segment.r0);
            assert!((sampled / expected - 1.0).abs() < rounding, "cell {k}: {sampled} {expected}");
        }
        let total: f64 = (0..300).map(|i| rho[i] * unit_ball_volume(3) * volume_step(3, r[i], r[i + 1])).sum();
        assert!((profile.total_mass().value / total - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_mesa_model_encloses_the_mass_that_its_own_column_states() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/mesa/mesa2hydro_profile_redgiant_logE.data");
        let Ok(text) = std::fs::read_to_string(path) else {
            println!("skipped: no {path}");
            return;
        };
        let lines: Vec<&str> = text.lines().collect();
        let names: Vec<&str> = lines[5].split_whitespace().collect();
        let column = |name: &str| -> Vec<f64> {
            let at = names.iter().position(|n| *n == name).unwrap();
            let number = |line: &&str| line.split_whitespace().nth(at).map(|v| v.parse::<f64>().unwrap());
            lines[6..].iter().rev().filter_map(number).collect()
        };
        let mut r = vec![0.0];
        r.extend(column("logR").iter().map(|v| 10f64.powf(*v)));
        let rho: Vec<f64> = column("logRho").iter().map(|v| 10f64.powf(*v)).collect();
        let mass = column("mass");
        let profile = RadialProfile::from_cells(3, &r, &rho);
        let unit = profile.total_mass().value / mass[mass.len() - 1];
        for (r, m) in r[1..].iter().zip(&mass) {
            assert!((profile.enclosed_mass(*r) / unit / m - 1.0).abs() < 1e-6, "r = {r}");
        }
    }

    #[test]
    fn cells_converge_to_a_smooth_density() {
        let error = |n: usize| {
            let r = nodes(n, 2.0);
            // rho = exp(-r^2) in 2-D: the cell average is exact by r^2.
            let rho: Vec<f64> = r
                .windows(2)
                .map(|w| ((-w[0] * w[0]).exp() - (-w[1] * w[1]).exp()) / (w[1] * w[1] - w[0] * w[0]))
                .collect();
            let profile = RadialProfile::from_cells(2, &r, &rho);
            (0..200)
                .map(|i| 0.01 * f64::from(i))
                .map(|r| (profile.density(r) - (-r * r).exp()).abs())
                .fold(0.0, f64::max)
        };
        assert!(error(50) < 3e-3 && error(200) < error(50) / 3.0, "{} {}", error(50), error(200));
    }

    #[test]
    fn extreme_magnitudes_survive() {
        for (radius, density) in [(1.0, 1e300), (1.0, 1e-300), (1e11, 1e150), (1e-50, 1e-100)] {
            let profile =
                RadialProfile::from_nodes(3, &[0.0, 0.5 * radius, radius], &[density, density, 1e-3 * density]);
            let unit = RadialProfile::from_nodes(3, &[0.0, 0.5, 1.0], &[1.0, 1.0, 1e-3]);
            let ratio = profile.total_mass().value / density / radius.powi(3) / unit.total_mass().value;
            assert!((ratio - 1.0).abs() < 1e-13, "{radius} {density}: {ratio}");
            assert!((profile.radius_of_fraction(0.3) / radius / unit.radius_of_fraction(0.3) - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn mass_and_radius_are_inverse() {
        let mut random = Random::new(9);
        for case in 0..256 {
            let (mut r, mut y) = (vec![0.0], vec![]);
            for _ in 0..random.whole(2, 20) {
                r.push(r[r.len() - 1] + random.between(1e-3, 1.0));
                y.push(10f64.powf(random.between(-6.0, 2.0)));
            }
            let d = 1 + case % 3;
            let profile = if random.unit() < 0.5 {
                RadialProfile::from_cells(d, &r, &y)
            } else {
                y.push(0.0);
                RadialProfile::from_nodes(d, &r, &y)
            };
            let fraction = random.between(0.001, 0.999);
            let radius = profile.radius_of_fraction(fraction);
            let found = profile.enclosed_mass(radius) / profile.total_mass().value;
            assert!((found - fraction).abs() < 1e-11, "{d}-D, {r:?}, {y:?}: {found} in place of {fraction}");
            for i in 0..200 {
                assert!(profile.density(0.005 * f64::from(i) * profile.outer_radius()) >= 0.0, "{d}-D, {r:?}, {y:?}");
            }
        }
    }
}
