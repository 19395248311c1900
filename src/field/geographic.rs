//! Grids of longitude, latitude (degrees) and radius as spherical shells in x, y, z.
//!
//! `x = r cos(lat) cos(lon)`, `y = r cos(lat) sin(lon)`, `z = r sin(lat)`. Longitude repeats after 360 degrees;
//! values continue as constants from the last latitudes to the poles. The mass is the tensor product of the
//! axes' integrals over `d lon`, `cos(lat) d lat` and `r^2 dr`.

use super::MassEstimate;
use super::grid::Grid;
use super::sampled::{Outside, Sampler};
use crate::error::{Error, Result};
use sph::domain::{Domain, Region, Wall};
use sph_formats::Values;

/// A gap in longitude of more than this is a regional grid, not a shell.
const MAX_GAP_DEGREES: f64 = 30.0;

pub(crate) struct Geographic {
    pub(crate) grid: Grid<3>,
}

impl Geographic {
    /// # Errors
    /// Axes that do not cover the sphere, or radii that are not positive.
    pub(crate) fn new(name: &str, grid: Grid<3>) -> Result<Self> {
        let [_, latitude, radius] = &grid.axes;
        if latitude.lo < -90.001 || latitude.hi > 90.001 {
            return Err(Error::field(
                name,
                format!(
                    "latitudes run from {} to {}; they must lie within -90 and 90 degrees",
                    latitude.lo, latitude.hi
                ),
            ));
        }
        if latitude.hi - latitude.lo < 180.0 - MAX_GAP_DEGREES {
            return Err(Error::field(
                name,
                format!(
                    "latitudes cover {} to {} degrees only; regional grids are not supported, a shell needs all of them",
                    latitude.lo, latitude.hi
                ),
            ));
        }
        if radius.lo < 0.0 {
            return Err(Error::field(name, format!("the radius starts at {}; it must not be negative", radius.lo)));
        }
        Ok(Self { grid })
    }

    /// Whether longitudes span the circle up to a gap that interpolation may close.
    pub(crate) fn check_longitudes(name: &str, lo: f64, hi: f64) -> Result<()> {
        if !(360.0 - MAX_GAP_DEGREES..=360.0 + 1e-6).contains(&(hi - lo)) {
            return Err(Error::field(
                name,
                format!(
                    "longitudes cover {lo} to {hi} degrees; regional grids are not supported, a shell needs 360 degrees"
                ),
            ));
        }
        Ok(())
    }

    pub(crate) fn domain<const D: usize>(&self) -> Result<Domain<D>> {
        let radius = &self.grid.axes[2];
        let mut domain = Domain::ball([0.0; D], radius.hi, Wall::Open)?;
        if let Region::Ball { inner_radius, .. } = &mut domain.region {
            *inner_radius = radius.lo;
        }
        Ok(domain)
    }

    fn coordinates<const D: usize>(x: &[f64; D]) -> [f64; 3] {
        let [x, y, z]: [f64; 3] = sph::array(|k| x.get(k).copied().unwrap_or(0.0));
        let ring = x.hypot(y);
        let r = ring.hypot(z);
        [y.atan2(x).to_degrees(), z.atan2(ring).to_degrees(), r]
    }
}

impl<const D: usize> Sampler<D> for Geographic {
    fn sample(&self, values: &Values, stride: usize, x: &[f64; D], outside: Outside, out: &mut [f64]) -> bool {
        let u = Self::coordinates(x);
        let clamp = [true, true, outside == Outside::Clamp];
        let mut inside = u;
        for k in 0..3 {
            match self.grid.axes[k].admit(u[k], clamp[k]) {
                Some(v) => inside[k] = v,
                None => return false,
            }
        }
        self.grid.combine(values, stride, &inside, out);
        true
    }

    fn integral(&self, values: &Values, domain: &Domain<D>) -> Option<MassEstimate> {
        let Region::Ball { center, inner_radius, radius, .. } = &domain.region else {
            return None;
        };
        if center.iter().any(|c| c.abs() > 1e-12 * radius) || self.grid.interpolation == super::Interpolation::Cubic {
            return None;
        }
        let [longitude, latitude, depth] = &self.grid.axes;
        let kind = self.grid.interpolation;
        let mut polar =
            latitude.integral_weights(latitude.lo, latitude.hi, kind, 6, &|l| l.to_radians().cos() * 1f64.to_radians());
        // Caps between the last latitudes and the poles take the last values.
        if let Some(first) = polar.first_mut() {
            *first += 1.0 + latitude.lo.to_radians().sin();
        }
        if let Some(last) = polar.last_mut() {
            *last += 1.0 - latitude.hi.to_radians().sin();
        }
        let weights = [
            longitude.integral_weights(longitude.lo, longitude.lo + 360.0, kind, 1, &|_| 1f64.to_radians()),
            polar,
            depth.integral_weights(*inner_radius, *radius, kind, 6, &|r| r * r),
        ];
        Some(self.grid.tensor_integral(values, &weights))
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid_axis::AxisTable;
    use super::super::{Interpolation, Period, ScalarField};
    use super::*;
    use crate::field::sampled::SampledDensity;
    use std::f64::consts::PI;
    use std::sync::Arc;

    fn shell(f: impl Fn(f64, f64, f64) -> f64) -> SampledDensity<Geographic> {
        let lon: Vec<f64> = (0..36).map(|i| -180.0 + 10.0 * f64::from(i)).collect();
        let lat: Vec<f64> = (0..17).map(|i| -80.0 + 10.0 * f64::from(i)).collect();
        let r = vec![1.0, 1.5, 1.5, 2.0];
        let mut values = Vec::new();
        for &r in &r {
            for &lat in &lat {
                values.extend(lon.iter().map(|&lon| f(lon, lat, r)));
            }
        }
        let grid = Grid::new(
            [
                AxisTable::nodes("lon", lon, Some(Period::Length(360.0)), false).unwrap(),
                AxisTable::nodes("lat", lat, None, false).unwrap(),
                AxisTable::nodes("r", r, None, false).unwrap(),
            ],
            Interpolation::Linear,
        );
        SampledDensity { sampler: Arc::new(Geographic::new("rho", grid).unwrap()), values: Values::F64(values) }
    }

    #[test]
    fn a_uniform_shell_has_its_mass_and_support() {
        let field = shell(|_, _, _| 3.0);
        let domain = field.sampler.domain::<3>().unwrap();
        let mass = ScalarField::<3>::integral(&field, &domain).unwrap();
        assert!((mass.value / (3.0 * 4.0 / 3.0 * PI * 7.0) - 1.0).abs() < 1e-13, "{mass:?}");
        for x in [[0.0, 0.0, 1.9], [0.0, 0.0, -1.2], [-1.7, 1e-9, 0.0], [-1.7, -1e-9, 0.0]] {
            assert!((field.value(&x) - 3.0).abs() < 1e-14);
        }
        assert_eq!(field.value(&[0.0, 0.5, 0.0]), 0.0);
        assert_eq!(field.value(&[2.0, 0.5, 0.0]), 0.0);
    }

    #[test]
    fn longitude_latitude_and_radius_are_read_where_they_are() {
        let field = shell(|lon, lat, r| 1000.0 + lon + 0.1 * lat + r);
        let (lon, lat, r) = (35.0_f64, -22.0_f64, 1.7);
        let (a, b) = (lon.to_radians(), lat.to_radians());
        let x = [r * b.cos() * a.cos(), r * b.cos() * a.sin(), r * b.sin()];
        assert!((field.value(&x) - (1000.0 + lon + 0.1 * lat + r)).abs() < 1e-10);
        // Between 170 and 180 = -180 degrees the interval runs through the wrap: 1170 -> 820.
        let x = [-1.7 * 5f64.to_radians().cos(), 1.7 * 5f64.to_radians().sin(), 0.0];
        assert!((field.value(&x) - (0.5 * (1170.0 + 820.0) + 1.7)).abs() < 1e-9, "{}", field.value(&x));
        assert!(Geographic::check_longitudes("rho", 0.0, 120.0).is_err());
    }
}
