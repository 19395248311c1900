//! Grids of cells in spherical coordinates, or in those of a cylinder, in Cartesian space.
//!
//! | coordinates | axes | x, y, z | volume element |
//! |---|---|---|---|
//! | spherical | r, theta, phi | r sin(theta) cos(phi), r sin(theta) sin(phi), r cos(theta) | r^2 sin(theta) |
//! | polar | R, phi, z | R cos(phi), R sin(phi), z | R |
//! | cylindrical | R, z, phi | the same | R |
//!
//! The mass is the tensor product of the axes' integrals with these elements. One cell in phi is symmetry about the z axis. Vectors
//! are known by their components along r, theta, phi or R, phi, z; those are interpolated, and turned at the place that is asked for, so
//! that rotation about the axis is right on the coarsest grid.
//!
//! Between cells, values across the axis and the center are those of the opposite cells: at theta < theta_0 of the first cells
//! f = (1 + theta/theta_0)/2 f(theta_0, phi) + (1 - theta/theta_0)/2 f(theta_0, phi + pi), which leaves the mass as it is.

use super::grid::Grid;
use super::sampled::{Outside, Sampler};
use super::sector::{Meridian, Sector, across};
use super::{Interpolation, MassEstimate};
use crate::error::{Error, Result};
use sph::domain::{Axis, Domain, Hull, Region, Wall};
use sph_formats::{Coordinates, Values};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Faces this near to an axis or to a full circle are there: files have single precision.
const SAME_ANGLE: f64 = 1e-6;
/// Gauss's points along an angle or a radius, per cell.
const ORDER: usize = 6;

pub(crate) struct Curvilinear {
    pub(crate) grid: Grid<3>,
    is_spherical: bool,
    /// Which axis is theta, or z.
    height: usize,
    azimuth: usize,
}

impl Curvilinear {
    pub(crate) fn new(coordinates: Coordinates, grid: Grid<3>) -> Self {
        let [height, azimuth] = coordinates.height_and_azimuth();
        Self { grid, is_spherical: coordinates == Coordinates::Spherical, height, azimuth }
    }

    fn is_round(&self) -> bool {
        self.grid.axes[self.azimuth].is_periodic()
    }

    fn ends(&self, axis: usize) -> [f64; 2] {
        [self.grid.axes[axis].lo, self.grid.axes[axis].hi]
    }

    fn has_all_colatitudes(&self) -> bool {
        self.is_spherical && self.ends(self.height) == [0.0, PI]
    }

    /// What the cells fill.
    ///
    /// # Errors
    /// A region without extent.
    pub(crate) fn domain<const D: usize>(&self) -> Result<Domain<D>> {
        let [inner, outer] = self.ends(0);
        if self.is_round() && (self.has_all_colatitudes() || D == 2) {
            let mut domain = Domain::ball([0.0; D], outer, Wall::Open)?;
            if let Region::Ball { inner_radius, .. } = &mut domain.region {
                *inner_radius = inner;
            }
            return Ok(domain);
        }
        let [low, high] = self.ends(self.height);
        if self.is_round() && !self.is_spherical {
            let center = sph::array(|k| if k == 2 { 0.5 * (low + high) } else { 0.0 });
            let along = if self.grid.axes[self.height].is_periodic() { Axis::Periodic } else { Axis::OPEN };
            return Ok(Domain::cylinder(center, 2, [inner, outer], high - low, (Wall::Open, along))?);
        }
        let sector = self.sector::<D>();
        let [lo, hi] = sector.corners();
        Ok(Domain::new(lo, hi, [Axis::OPEN; D], Region::Hull(Arc::new(sector), Wall::Open))?)
    }

    fn sector<const D: usize>(&self) -> Sector<D> {
        let (radius, height) = (self.ends(0), self.ends(self.height));
        let meridian = match (self.is_spherical, D) {
            (true, _) => Meridian::Annular { radius, theta: height },
            (false, 2) => Meridian::Rectangle { distance: radius, height: [f64::NEG_INFINITY, f64::INFINITY] },
            (false, _) => Meridian::Rectangle { distance: radius, height },
        };
        Sector { meridian, azimuth: (!self.is_round()).then(|| self.ends(self.azimuth)) }
    }

    /// What the report says of the region.
    pub(crate) fn notes<const D: usize>(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let [inner, outer] = self.ends(0);
        let letter = if self.is_spherical { 'r' } else { 'R' };
        if inner > 0.0 {
            notes.push(format!(
                "the grid begins at {letter} = {inner:.6}: the hole within, {:.1e} of the outer radius, is no part of the domain",
                inner / outer
            ));
        }
        if self.is_spherical && !self.has_all_colatitudes() {
            let [low, high] = self.ends(self.height);
            notes.push(format!(
                "the grid covers theta from {low:.6} to {high:.6}: what is nearer to the axis is no part of the domain"
            ));
        }
        let azimuth = &self.grid.axes[self.azimuth];
        match (self.is_round(), azimuth.len()) {
            (true, 1) => {
                notes.push("one cell in phi: the values are those of all azimuths, over the full circle".into())
            }
            (false, _) => {
                let [from, to] = self.ends(self.azimuth);
                notes.push(format!(
                    "the grid covers phi from {from:.6} to {to:.6} alone, {:.1} % of the circle: the domain is this sector",
                    100.0 * (to - from) / TAU
                ));
            }
            _ => {}
        }
        if D == 2 && self.grid.axes[self.height].len() == 1 {
            notes.push("one cell in z: the domain is the plane of R and phi".into());
        }
        notes
    }

    /// Coordinates of a place in the order of the axes.
    fn coordinates(&self, x: [f64; 3]) -> [f64; 3] {
        let ring = across(x[0], x[1]);
        let [from, to] = self.ends(self.azimuth);
        let middle = 0.5 * (from + to);
        // The turn that is nearest to the middle of the cells.
        let phi = middle - PI + (x[1].atan2(x[0]) - middle + PI).rem_euclid(TAU);
        let mut u = [0.0; 3];
        u[self.azimuth] = phi;
        (u[0], u[self.height]) = if self.is_spherical { (across(ring, x[2]), ring.atan2(x[2])) } else { (ring, x[2]) };
        u
    }

    /// Turns components along the axes at `x` to Cartesian ones.
    fn turned(&self, x: [f64; 3], along: [f64; 3]) -> [f64; 3] {
        let ring = across(x[0], x[1]);
        let (cos, sin) = if ring > 0.0 { (x[0] / ring, x[1] / ring) } else { (1.0, 0.0) };
        let (first, second, third) = (along[0], along[self.height], along[self.azimuth]);
        let (out, up) = match self.is_spherical {
            true => {
                let r = across(ring, x[2]);
                let (st, ct) = if r > 0.0 { (ring / r, x[2] / r) } else { (0.0, 1.0) };
                (first * st + second * ct, first * ct - second * st)
            }
            false => (first, second),
        };
        [out * cos - third * sin, out * sin + third * cos, up]
    }

    /// The cells on the other side of the axis or the center, where `u` is nearer to it than the first cells: the first place, the
    /// opposite one, the weight of the first, and the signs of components there.
    fn across(&self, u: &[f64; 3]) -> Option<([f64; 3], [f64; 3], f64, [f64; 3])> {
        if !self.is_round() || self.grid.interpolation == Interpolation::Constant {
            return None;
        }
        let mut near = *u;
        let opposite = |near: &[f64; 3]| {
            let mut other = *near;
            other[self.azimuth] += PI;
            other
        };
        let mut signs = [-1.0; 3];
        let [first, _] = self.grid.axes[0].outermost();
        if self.ends(0)[0] == 0.0 && u[0] < first && (self.has_all_colatitudes() || !self.is_spherical) {
            near[0] = first;
            let mut other = opposite(&near);
            if self.is_spherical {
                other[self.height] = PI - other[self.height];
            }
            signs[self.height] = 1.0;
            return Some((near, other, 0.5 + 0.5 * u[0] / first, signs));
        }
        if !self.is_spherical {
            return None;
        }
        let ([low, high], [first, last]) = (self.ends(self.height), self.grid.axes[self.height].outermost());
        let theta = u[self.height];
        let (end, share) = if low == 0.0 && theta < first {
            (first, theta / first)
        } else if high == PI && theta > last {
            (last, (PI - theta) / (PI - last))
        } else {
            return None;
        };
        near[self.height] = end;
        signs[0] = 1.0;
        Some((near, opposite(&near), 0.5 + 0.5 * share, signs))
    }

    /// Values at coordinates within the axes; of a vector, along these.
    fn gather(&self, values: &Values, stride: usize, u: &[f64; 3], out: &mut [f64]) {
        let Some((near, other, weight, signs)) = self.across(u) else {
            let mut inside = *u;
            for k in 0..3 {
                inside[k] = self.grid.axes[k].admit(u[k], true).unwrap_or(u[k]);
            }
            return self.grid.combine(values, stride, &inside, out);
        };
        let mut beyond = [0.0; 3];
        self.gather(values, stride, &near, out);
        self.gather(values, stride, &other, &mut beyond[..out.len()]);
        for (k, v) in out.iter_mut().enumerate() {
            let sign = if stride > 1 { signs[k] } else { 1.0 };
            *v = weight * *v + (1.0 - weight) * sign * beyond[k];
        }
    }

    /// Ranges of the axes that a region fills, if it is one of whole cells' kind.
    fn ranges<const D: usize>(&self, domain: &Domain<D>) -> Option<[[f64; 2]; 3]> {
        let mut ranges = [0, 1, 2].map(|k| self.ends(k));
        let is_center = |center: &[f64; D], scale: f64| center.iter().all(|c| c.abs() <= 1e-12 * scale);
        match &domain.region {
            Region::Ball { center, inner_radius, radius, .. } if is_center(center, *radius) => {
                if !self.is_round() || !(D == 2 || self.has_all_colatitudes()) {
                    return None;
                }
                ranges[0] = [*inner_radius, *radius];
            }
            Region::Cylinder { center, axis: 2, inner_radius, radius, .. } if !self.is_spherical && self.is_round() => {
                if center[0].hypot(center[1]) > 1e-12 * radius {
                    return None;
                }
                ranges[0] = [*inner_radius, *radius];
                ranges[self.height] = [domain.lo[2], domain.hi[2]];
            }
            Region::Hull(hull, _) => {
                let sector = self.sector::<D>();
                let own = sector.corners();
                let size = domain.size();
                let is_own = (hull.volume() / sector.volume() - 1.0).abs() < 1e-9
                    && (0..D).all(|k| {
                        (domain.lo[k] - own[0][k]).abs() < 1e-9 * size && (domain.hi[k] - own[1][k]).abs() < 1e-9 * size
                    });
                if !is_own {
                    return None;
                }
            }
            _ => return None,
        }
        Some(ranges)
    }
}

/// Faces of the cells of three axes, with those at the ends of angles put where they belong, and whether phi goes all around.
///
/// # Errors
/// Radii below 0, colatitudes beyond 0 to pi, more than a circle.
pub(crate) fn check_faces(
    name: &str,
    coordinates: Coordinates,
    mut faces: [Vec<f64>; 3],
) -> Result<([Vec<f64>; 3], bool)> {
    let [height, azimuth] = coordinates.height_and_azimuth();
    if faces[0][0] < 0.0 {
        return Err(Error::field(name, format!("the radius starts at {}; it must not be negative", faces[0][0])));
    }
    if coordinates == Coordinates::Spherical {
        let theta = &mut faces[height];
        let last = theta.len() - 1;
        if theta[0] < -SAME_ANGLE || theta[last] > PI + SAME_ANGLE {
            let problem = format!(
                "theta runs from {} to {}; it must lie within 0 and pi (radians, from the axis)",
                theta[0], theta[last]
            );
            return Err(Error::field(name, problem));
        }
        if theta[0] < SAME_ANGLE {
            theta[0] = 0.0;
        }
        if theta[last] > PI - SAME_ANGLE {
            theta[last] = PI;
        }
    }
    let phi = &mut faces[azimuth];
    let last = phi.len() - 1;
    let turn = phi[last] - phi[0];
    // The width of a single cell has no meaning.
    let is_round = last == 1 || (turn - TAU).abs() < SAME_ANGLE;
    if !is_round && turn > TAU {
        return Err(Error::field(
            name,
            format!("phi runs from {} to {}, over more than a circle of 2 pi (radians)", phi[0], phi[last]),
        ));
    }
    if last == 1 {
        phi[0] = 0.0;
    }
    if is_round {
        phi[last] = phi[0] + TAU;
    }
    Ok((faces, is_round))
}

impl<const D: usize> Sampler<D> for Curvilinear {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        let x: [f64; 3] = sph::array(|k| x.get(k).copied().unwrap_or(0.0));
        let mut u = self.coordinates(x);
        if D == 2 {
            // The plane's only cell.
            u[self.height] = self.grid.axes[self.height].outermost()[0];
        }
        for k in 0..3 {
            match self.grid.axes[k].admit(u[k], outside == Outside::Clamp) {
                Some(inside) => u[k] = inside,
                None => return false,
            }
        }
        if stride == 1 {
            self.gather(values, 1, &u, out);
            return true;
        }
        let mut along = [0.0; 3];
        self.gather(values, stride, &u, &mut along[..stride.min(3)]);
        out.iter_mut().zip(self.turned(x, along)).for_each(|(v, c)| *v = c);
        true
    }

    fn integral(&self, values: &Values, domain: &Domain<D>) -> Option<MassEstimate> {
        let kind = self.grid.interpolation;
        if kind == Interpolation::Cubic {
            return None;
        }
        let ranges = self.ranges(domain)?;
        let weights = std::array::from_fn(|k| {
            let measure: &dyn Fn(f64) -> f64 = match (k, self.is_spherical) {
                (0, true) => &|r| r * r,
                (0, false) => &|r| r,
                (k, true) if k == self.height => &|theta| theta.sin(),
                _ => &|_| 1.0,
            };
            if D == 2 && k == self.height {
                return vec![1.0];
            }
            self.grid.axes[k].integral_weights(ranges[k][0], ranges[k][1], kind, ORDER, measure)
        });
        Some(self.grid.tensor_integral(values, &weights))
    }
}

#[cfg(test)]
#[path = "curvilinear_tests.rs"]
mod tests;
