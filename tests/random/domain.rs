//! Domains: whether a point is in them, the same as part of a scene, and where they lie in the box of the output.

use super::draw::{Draw, Point};
use super::solid::{Solid, distance};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    Periodic,
    Reflecting,
    Open,
}

impl Boundary {
    fn name(self) -> &'static str {
        match self {
            Self::Periodic => "periodic",
            Self::Reflecting => "reflecting",
            Self::Open => "open",
        }
    }
}

#[derive(Debug, Clone)]
pub enum Kind {
    Box,
    Ball {
        inner: f64,
        radius: f64,
    },
    Cylinder {
        axis: usize,
        inner: f64,
        radius: f64,
    },
    Torus {
        axis: usize,
        radius: f64,
        tube: f64,
    },
    Ellipsoid {
        radii: Point,
    },
    /// A box without a ball.
    Less {
        center: Point,
        radius: f64,
    },
    /// Two balls, apart or not.
    Two {
        centers: [Point; 2],
        radii: [f64; 2],
    },
}

/// Where particles may be, in the scene's own unit of length.
#[derive(Debug, Clone)]
pub struct Domain {
    pub d: usize,
    pub kind: Kind,
    pub lo: Point,
    pub hi: Point,
    pub center: Point,
    pub boundary: [Boundary; 3],
}

/// Edge of the box of an isolated body over the body's own.
const BOX_FACTOR: f64 = 4.0;

impl Domain {
    pub fn draw(draw: &mut Draw, d: usize) -> Self {
        let origin = if draw.percent(50) { 0.0 } else { draw.between(-3.0, 3.0) };
        let place: Point = std::array::from_fn(|k| if k < d { origin * (k as f64 - 0.7) } else { 0.0 });
        let size = draw.decades(-0.5, 0.5);
        if draw.percent(55) {
            let cubic = draw.percent(40);
            let edges: Point = std::array::from_fn(|_| size * if cubic { 1.0 } else { draw.decades(-0.5, 0.3) });
            let hi = std::array::from_fn(|k| if k < d { place[k] + edges[k] } else { 0.0 });
            let one = draw.one(&[Boundary::Periodic, Boundary::Periodic, Boundary::Reflecting, Boundary::Open]);
            let mixed = draw.percent(25);
            let mut of_axis = || draw.one(&[Boundary::Periodic, Boundary::Reflecting, Boundary::Open]);
            let boundary = std::array::from_fn(|_| if mixed { of_axis() } else { one });
            return Self::new(d, Kind::Box, [place, hi], boundary);
        }
        let around = |half: Point| -> [Point; 2] {
            let corner = |sign: f64| std::array::from_fn(|k| if k < d { place[k] + sign * half[k] } else { 0.0 });
            [corner(-1.0), corner(1.0)]
        };
        let wall = if draw.percent(25) { Boundary::Reflecting } else { Boundary::Open };
        let hollow = if draw.percent(25) { draw.between(0.1, 0.9) } else { 0.0 };
        let axis = draw.below(3);
        let turned = |along: f64, across: f64| std::array::from_fn(|k| if k == axis { along } else { across });
        let (kind, bounds) = match draw.below(if d == 3 { 10 } else { 8 }) {
            0..=3 => (Kind::Ball { inner: hollow * size, radius: size }, around([size; 3])),
            4 => {
                let radii: Point = std::array::from_fn(|_| size * draw.decades(-0.5, 0.0));
                (Kind::Ellipsoid { radii }, around(radii))
            }
            5 => {
                let radius = size * draw.between(0.1, 0.8);
                (Kind::Less { center: place, radius }, around([size; 3]))
            }
            6 | 7 => {
                let radii = [size * draw.between(0.2, 0.5), size * draw.between(0.2, 0.5)];
                let gap = draw.between(0.9, 2.0) * (radii[0] + radii[1]);
                let centers = [place, std::array::from_fn(|k| place[k] + if k == 0 { gap } else { 0.0 })];
                let reach = |k: usize, sign: f64| {
                    let at = |i: usize| sign * (centers[i][k] + sign * radii[i]);
                    if k < d { sign * at(0).max(at(1)) } else { 0.0 }
                };
                let bounds = [-1.0, 1.0].map(|sign| std::array::from_fn(|k| reach(k, sign)));
                (Kind::Two { centers, radii }, bounds)
            }
            8 => {
                let along = size * draw.decades(-0.5, 0.5);
                (Kind::Cylinder { axis, inner: hollow * size, radius: size }, around(turned(along, size)))
            }
            _ => {
                let tube = size * draw.between(0.15, 0.7);
                (Kind::Torus { axis, radius: size, tube }, around(turned(tube, size + tube)))
            }
        };
        let mut boundary = [wall; 3];
        if let Kind::Cylinder { axis, .. } = kind {
            boundary[axis] = draw.one(&[Boundary::Periodic, Boundary::Reflecting, Boundary::Open]);
        }
        Self::new(d, kind, bounds, boundary)
    }

    fn new(d: usize, kind: Kind, [lo, hi]: [Point; 2], boundary: [Boundary; 3]) -> Self {
        let center = std::array::from_fn(|k| 0.5 * (lo[k] + hi[k]));
        Self { d, kind, lo, hi, center, boundary }
    }

    /// A ball about the origin, as the domain of a profile is.
    pub fn of_profile(d: usize, radius: f64) -> Self {
        let corner = |sign: f64| std::array::from_fn(|k| if k < d { sign * radius } else { 0.0 });
        Self::new(d, Kind::Ball { inner: 0.0, radius }, [corner(-1.0), corner(1.0)], [Boundary::Open; 3])
    }

    /// Whether a point within the bounds is in it, but for `slack`.
    pub fn contains(&self, x: &Point, slack: f64) -> bool {
        let c = &self.center;
        match &self.kind {
            Kind::Box => true,
            Kind::Ball { inner, radius } => (inner - slack..=radius + slack).contains(&distance(x, c)),
            Kind::Cylinder { axis, inner, radius } => {
                let mut level = *x;
                level[*axis] = c[*axis];
                (inner - slack..=radius + slack).contains(&distance(&level, c))
            }
            Kind::Torus { axis, radius, tube } => {
                let mut level = *x;
                level[*axis] = c[*axis];
                (distance(&level, c) - radius).hypot(x[*axis] - c[*axis]) <= tube + slack
            }
            Kind::Ellipsoid { radii } => {
                let squares = (0..self.d).map(|k| ((x[k] - c[k]) / (radii[k] + slack)).powi(2));
                squares.sum::<f64>() <= 1.0
            }
            Kind::Less { center, radius } => distance(x, center) >= radius - slack,
            Kind::Two { centers, radii } => (0..2).any(|i| distance(x, &centers[i]) <= radii[i] + slack),
        }
    }

    /// As a key of a scene whose unit of length is `unit` times shorter.
    pub fn text(&self, unit: f64) -> String {
        let d = self.d;
        let point = |x: &Point| {
            let numbers: Vec<String> = x[..d].iter().map(|v| format!("{:?}", v * unit)).collect();
            format!("[{}]", numbers.join(", "))
        };
        let ball = |center: &Point, inner: f64, radius: f64| {
            let inner = if inner > 0.0 { format!(", inner_radius: {:?}", inner * unit) } else { String::new() };
            format!("ball: {{center: {}, radius: {:?}{inner}}}", point(center), radius * unit)
        };
        let name = |axis: usize| ["x", "y", "z"][axis];
        let center = point(&self.center);
        let shape = match &self.kind {
            Kind::Box => format!("box: [{}, {}]", point(&self.lo), point(&self.hi)),
            Kind::Ball { inner, radius } => ball(&self.center, *inner, *radius),
            Kind::Cylinder { axis, inner, radius } => format!(
                "cylinder: {{center: {center}, axis: {}, radius: {:?}, inner_radius: {:?}, length: {:?}}}",
                name(*axis),
                radius * unit,
                inner * unit,
                (self.hi[*axis] - self.lo[*axis]) * unit
            ),
            Kind::Torus { axis, radius, tube } => format!(
                "torus: {{center: {center}, axis: {}, radius: {:?}, tube_radius: {:?}}}",
                name(*axis),
                radius * unit,
                tube * unit
            ),
            Kind::Ellipsoid { radii } => format!("ellipsoid: {{center: {center}, radii: {}}}", point(radii)),
            Kind::Less { center, radius } => format!(
                "difference: [{{box: [{}, {}]}}, {{{}}}]",
                point(&self.lo),
                point(&self.hi),
                ball(center, 0.0, *radius)
            ),
            Kind::Two { centers, radii } => {
                format!("union: [{{{}}}, {{{}}}]", ball(&centers[0], 0.0, radii[0]), ball(&centers[1], 0.0, radii[1]))
            }
        };
        let boundary: Vec<&str> = self.boundary[..d].iter().map(|b| b.name()).collect();
        format!("domain: {{{shape}, boundary: [{}]}}", boundary.join(", "))
    }

    /// Whether it ends at the faces of its bounds along an axis.
    pub fn has_faces(&self, k: usize) -> bool {
        match &self.kind {
            Kind::Box => true,
            Kind::Cylinder { axis, .. } => *axis == k,
            _ => false,
        }
    }

    pub fn edge(&self, k: usize) -> f64 {
        self.hi[k] - self.lo[k]
    }

    pub fn is_periodic(&self, k: usize) -> bool {
        k < self.d && self.has_faces(k) && self.boundary[k] == Boundary::Periodic
    }

    /// Edges of the output's box, and what is added to coordinates there.
    pub fn frame(&self) -> (Point, Point) {
        let size = (0..self.d).map(|k| self.edge(k)).fold(0.0, f64::max);
        let is_open = |k: usize| !self.has_faces(k) || self.boundary[k] == Boundary::Open;
        let edges: Point = std::array::from_fn(|k| if is_open(k) { BOX_FACTOR * size } else { self.edge(k) });
        let shift =
            std::array::from_fn(|k| if k < self.d { 0.5 * (edges[k] - self.edge(k)) - self.lo[k] } else { 0.0 });
        (edges, shift)
    }

    /// Where along an axis a quadrature should have faces.
    pub fn faces(&self, axis: usize) -> Vec<f64> {
        let c = self.center[axis];
        match &self.kind {
            Kind::Ball { inner, .. } | Kind::Cylinder { inner, .. } => vec![c - inner, c, c + inner],
            Kind::Less { center, radius } => Solid::Ball { center: *center, radius: *radius }.faces(axis),
            Kind::Two { centers, radii } => {
                (0..2).flat_map(|i| Solid::Ball { center: centers[i], radius: radii[i] }.faces(axis)).collect()
            }
            _ => vec![c],
        }
    }

    /// Distance of two points, by the shortest way around.
    pub fn distance(&self, x: &Point, y: &Point) -> f64 {
        let along = |k: usize| {
            let v = x[k] - y[k];
            if self.is_periodic(k) { v - self.edge(k) * (v / self.edge(k)).round() } else { v }
        };
        (0..self.d).map(|k| along(k).powi(2)).sum::<f64>().sqrt()
    }
}
