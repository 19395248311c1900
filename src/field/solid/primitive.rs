//! Smooth surfaces from which solids are put together, each in a frame of its own: nearest points, and where lines are inside.

use super::super::quadrature::binade;
use super::super::surface::Surface;
use super::roots::roots;
use crate::roots::bisect;
use sph::domain::Hull;
use sph::geometry::distance;
use std::sync::Arc;

/// What a smooth surface encloses.
#[derive(Debug, Clone)]
pub(crate) enum Shape<const D: usize> {
    /// All on the side of the origin against the unit normal, or beyond.
    HalfSpace {
        normal: [f64; D],
    },
    Ellipsoid {
        radii: [f64; D],
    },
    /// About the last axis, without ends.
    Cylinder {
        radius: f64,
    },
    /// A tube about a circle about the last axis.
    Torus {
        radius: f64,
        tube: f64,
    },
    /// In the frame of the scene.
    Surface(Arc<Surface<D>>),
}

/// A shape with its place: coordinates of its own are those of x - center along the rows of `frame`.
#[derive(Debug, Clone)]
pub(crate) struct Primitive<const D: usize> {
    pub shape: Shape<D>,
    pub center: [f64; D],
    pub frame: [[f64; D]; D],
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| a[k] * b[k]).sum()
}

/// The frame of the scene.
pub(crate) fn upright<const D: usize>() -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))))
}

impl<const D: usize> Primitive<D> {
    fn own(&self, x: &[f64; D]) -> [f64; D] {
        let offset: [f64; D] = sph::array(|k| x[k] - self.center[k]);
        sph::array(|i| dot(&self.frame[i], &offset))
    }

    fn outer(&self, y: &[f64; D]) -> [f64; D] {
        sph::array(|k| self.center[k] + (0..D).map(|i| self.frame[i][k] * y[i]).sum::<f64>())
    }

    pub(crate) fn contains(&self, x: &[f64; D]) -> bool {
        let y = self.own(x);
        match &self.shape {
            Shape::HalfSpace { normal } => dot(normal, &y) <= 0.0,
            Shape::Ellipsoid { radii } => (0..D).map(|k| (y[k] / radii[k]).powi(2)).sum::<f64>() <= 1.0,
            Shape::Cylinder { radius } => across(&y) <= *radius,
            Shape::Torus { radius, tube } => (across(&y) - radius).hypot(y[D - 1]) <= *tube,
            Shape::Surface(surface) => surface.contains(x),
        }
    }

    /// A smooth function that is not positive inside; none of a surface of facets.
    pub(crate) fn level(&self, x: &[f64; D]) -> Option<f64> {
        let y = self.own(x);
        match &self.shape {
            Shape::HalfSpace { normal } => Some(dot(normal, &y)),
            Shape::Ellipsoid { radii } => Some((0..D).map(|k| (y[k] / radii[k]).powi(2)).sum::<f64>() - 1.0),
            Shape::Cylinder { radius } => Some((across(&y) / radius).powi(2) - 1.0),
            Shape::Torus { radius, tube } => Some((across(&y) - radius).hypot(y[D - 1]) / tube - 1.0),
            Shape::Surface(_) => None,
        }
    }

    /// The nearest point of the surface; one of them where several are as near.
    pub(crate) fn nearest(&self, x: &[f64; D]) -> [f64; D] {
        let y = self.own(x);
        let p = match &self.shape {
            Shape::HalfSpace { normal } => {
                let height = dot(normal, &y);
                sph::array(|k| y[k] - height * normal[k])
            }
            Shape::Ellipsoid { radii } => nearest_on_ellipsoid(radii, &y),
            Shape::Cylinder { radius } => onto_ring(&y, *radius),
            Shape::Torus { radius, tube } => {
                let mut ring = onto_ring(&y, *radius);
                ring[D - 1] = 0.0;
                let away = distance(&ring, &y);
                match away > 0.0 {
                    true => sph::array(|k| ring[k] + tube / away * (y[k] - ring[k])),
                    false => {
                        ring[D - 1] = *tube;
                        ring
                    }
                }
            }
            Shape::Surface(surface) => return surface.nearest_on_surface(x),
        };
        self.outer(&p)
    }

    /// The outward unit normal at a point of the surface; the direction to it from `beside`, which is elsewhere, for a surface of facets.
    pub(crate) fn normal(&self, at: &[f64; D], beside: &[f64; D]) -> [f64; D] {
        let y = self.own(at);
        let own: [f64; D] = match &self.shape {
            Shape::HalfSpace { normal } => *normal,
            Shape::Ellipsoid { radii } => sph::array(|k| y[k] / (radii[k] * radii[k])),
            Shape::Cylinder { .. } => sph::array(|k| if k + 1 < D { y[k] } else { 0.0 }),
            Shape::Torus { radius, .. } => {
                let mut ring = onto_ring(&y, *radius);
                ring[D - 1] = 0.0;
                sph::array(|k| y[k] - ring[k])
            }
            Shape::Surface(_) => return unit(&sph::array(|k| at[k] - beside[k])),
        };
        let turned = sph::array(|k| (0..D).map(|i| self.frame[i][k] * own[i]).sum());
        unit(&turned)
    }

    /// Where the line through `x` along an axis is inside: ascending intervals of that coordinate.
    pub(crate) fn chords(&self, axis: usize, x: &[f64; D]) -> Vec<[f64; 2]> {
        if let Shape::Surface(surface) = &self.shape {
            return surface.chords(axis, x).unwrap_or_default();
        }
        // y + t way, with t the coordinate along the axis.
        let mut start = *x;
        start[axis] = 0.0;
        let (y, way) = (self.own(&start), std::array::from_fn::<_, D, _>(|i| self.frame[i][axis]));
        // Coefficients of one size, whatever the unit of length: a power of two, so that no digit is lost.
        let unit = binade(y.iter().fold(self.size(), |m, c| m.max(c.abs())));
        let y = y.map(|c| c / unit);
        let polynomial = match &self.shape {
            Shape::HalfSpace { normal } => vec![dot(normal, &y), dot(normal, &way)],
            Shape::Ellipsoid { radii } => {
                let over = |v: [f64; D]| sph::array(|k| v[k] / (radii[k] / unit));
                square::<D>(&over(y), &over(way), D, 1.0).to_vec()
            }
            Shape::Cylinder { radius } => square(&y, &way, D - 1, (radius / unit).powi(2)).to_vec(),
            Shape::Torus { radius, tube } => torus(&y, &way, radius / unit, tube / unit),
            Shape::Surface(_) => Vec::new(),
        };
        negative(&polynomial).into_iter().map(|ends| ends.map(|t| t * unit)).collect()
    }

    /// Some length of the shape; that of a half-space is as good as any.
    fn size(&self) -> f64 {
        match &self.shape {
            Shape::Ellipsoid { radii } => radii.iter().fold(0.0, |m, r| m.max(*r)),
            Shape::Cylinder { radius } | Shape::Torus { radius, .. } => *radius,
            Shape::HalfSpace { .. } | Shape::Surface(_) => f64::MIN_POSITIVE,
        }
    }
}

fn unit<const D: usize>(v: &[f64; D]) -> [f64; D] {
    let length = dot(v, v).sqrt();
    if length > 0.0 { v.map(|c| c / length) } else { sph::array(|k| f64::from(u8::from(k == 0))) }
}

/// Distance from the last axis.
fn across<const D: usize>(y: &[f64; D]) -> f64 {
    y[..D - 1].iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// The point at a distance from the last axis, at the same place along it.
fn onto_ring<const D: usize>(y: &[f64; D], radius: f64) -> [f64; D] {
    let away = across(y);
    let mut p = *y;
    for k in 0..D - 1 {
        p[k] = if away > 0.0 { y[k] * radius / away } else { radius * f64::from(u8::from(k == 0)) };
    }
    p
}

/// |y + t way|^2 - limit over the first `axes` coordinates, in powers of t.
fn square<const D: usize>(y: &[f64; D], way: &[f64; D], axes: usize, limit: f64) -> [f64; 3] {
    let sum = |f: &dyn Fn(usize) -> f64| (0..axes).map(f).sum::<f64>();
    [sum(&|k| y[k] * y[k]) - limit, 2.0 * sum(&|k| y[k] * way[k]), sum(&|k| way[k] * way[k])]
}

/// (|p|^2 + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2) along a line.
fn torus<const D: usize>(y: &[f64; D], way: &[f64; D], radius: f64, tube: f64) -> Vec<f64> {
    let whole = square(y, way, D, tube * tube - radius * radius);
    let ring = square(y, way, D - 1, 0.0);
    let mut p = vec![0.0; 5];
    for i in 0..3 {
        for j in 0..3 {
            p[i + j] += whole[i] * whole[j];
        }
        p[i] -= 4.0 * radius * radius * ring[i];
    }
    p
}

/// Intervals on which a polynomial is not positive.
fn negative(polynomial: &[f64]) -> Vec<[f64; 2]> {
    let mut ends = vec![f64::NEG_INFINITY];
    ends.extend(roots(polynomial));
    ends.push(f64::INFINITY);
    let value = |t: f64| polynomial.iter().rev().fold(0.0, |v, c| v * t + c);
    let mut intervals: Vec<[f64; 2]> = Vec::new();
    for pair in ends.windows(2) {
        let middle = match (pair[0].is_finite(), pair[1].is_finite()) {
            (true, true) => 0.5 * (pair[0] + pair[1]),
            (true, false) => pair[0] + pair[0].abs().max(1.0),
            (false, true) => pair[1] - pair[1].abs().max(1.0),
            (false, false) => 0.0,
        };
        if pair[1] > pair[0] && value(middle) <= 0.0 {
            match intervals.last_mut() {
                Some(last) if last[1] == pair[0] => last[1] = pair[1],
                _ => intervals.push([pair[0], pair[1]]),
            }
        }
    }
    intervals
}

/// Nearest point of an ellipsoid: y_k = a_k^2 x_k / (a_k^2 + t) with the largest t for which it lies on the surface, found by
/// bisection (Eberly 2013, "Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid").
fn nearest_on_ellipsoid<const D: usize>(radii: &[f64; D], x: &[f64; D]) -> [f64; D] {
    let least = (0..D).fold(0, |best, k| if radii[k] < radii[best] { k } else { best });
    if radii.iter().all(|r| *r == radii[0]) {
        let away = dot(x, x).sqrt();
        let along = |k: usize| if away > 0.0 { x[k] / away } else { f64::from(u8::from(k == 0)) };
        return sph::array(|k| radii[0] * along(k));
    }
    let excess = |t: f64| (0..D).map(|k| (radii[k] * x[k] / (radii[k] * radii[k] + t)).powi(2)).sum::<f64>() - 1.0;
    let floor = -radii[least] * radii[least];
    let low = floor + radii[least] * x[least].abs();
    let high = floor + (0..D).map(|k| (radii[k] * x[k]).powi(2)).sum::<f64>().sqrt();
    if x[least] == 0.0 && !(excess(floor * (1.0 - 1e-12)) > 0.0) {
        // In the plane across the shortest axis, near the middle: the nearest point is off that plane.
        let mut p: [f64; D] = sph::array(|k| match k == least {
            true => 0.0,
            false => radii[k] * radii[k] * x[k] / (radii[k] * radii[k] + floor),
        });
        // Axes as short as the shortest have no place of their own.
        (0..D).filter(|&k| radii[k] == radii[least]).for_each(|k| p[k] = 0.0);
        let rest = 1.0 - (0..D).map(|k| (p[k] / radii[k]).powi(2)).sum::<f64>();
        p[least] = radii[least] * rest.max(0.0).sqrt();
        return p;
    }
    let [low, high] = bisect(|t| excess(t) > 0.0, [low, high], HALVINGS);
    let t = 0.5 * (low + high);
    sph::array(|k| radii[k] * radii[k] * x[k] / (radii[k] * radii[k] + t))
}

/// After which f64 tells no difference.
const HALVINGS: usize = 80;
