//! Solids: whether a point is in them, and the same as a condition of an expression.

use super::draw::{Draw, Point, direction};

/// Parts of space whose density is another than that around them, in the scene's own unit of length.
#[derive(Debug, Clone)]
pub enum Solid {
    Ball {
        center: Point,
        radius: f64,
    },
    Shell {
        center: Point,
        inner: f64,
        outer: f64,
    },
    /// All beneath a plane.
    HalfSpace {
        normal: Point,
        offset: f64,
    },
    Layer {
        normal: Point,
        middle: f64,
        half: f64,
    },
    Box {
        lo: Point,
        hi: Point,
    },
    /// About the last axis; in two dimensions a ring.
    Torus {
        center: Point,
        radius: f64,
        tube: f64,
    },
    Ellipsoid {
        center: Point,
        radii: Point,
    },
}

pub fn distance(x: &Point, y: &Point) -> f64 {
    (0..3).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt()
}

fn dot(x: &Point, y: &Point) -> f64 {
    (0..3).map(|k| x[k] * y[k]).sum()
}

impl Solid {
    /// Some solid that reaches into the box from `lo` to `hi`.
    pub fn draw(draw: &mut Draw, d: usize, [lo, hi]: [&Point; 2]) -> Self {
        let center: Point = std::array::from_fn(|k| if k < d { draw.between(lo[k], hi[k]) } else { 0.0 });
        let least = (0..d).map(|k| hi[k] - lo[k]).fold(f64::INFINITY, f64::min);
        let size = least * draw.decades(-1.3, -0.35);
        match draw.below(7) {
            0 => Self::Ball { center, radius: size },
            1 => Self::Shell { center, inner: size * draw.between(0.3, 0.95), outer: size },
            2 => {
                let normal = direction(draw, d);
                Self::HalfSpace { offset: dot(&normal, &center), normal }
            }
            3 => {
                let axis = draw.below(d);
                let normal = std::array::from_fn(|k| f64::from(u8::from(k == axis)));
                Self::Layer { normal, middle: center[axis], half: least * draw.decades(-3.0, -0.7) }
            }
            4 => {
                let normal = direction(draw, d);
                Self::Layer { middle: dot(&normal, &center), normal, half: least * draw.decades(-1.7, -0.7) }
            }
            5 if d > 1 => Self::Torus { center, radius: size, tube: size * draw.between(0.1, 0.6) },
            6 => {
                let radii = std::array::from_fn(|k| if k < d { size * draw.between(0.4, 1.6) } else { 1.0 });
                Self::Ellipsoid { center, radii }
            }
            _ => {
                let half: Point = std::array::from_fn(|_| size * draw.between(0.3, 1.5));
                let corner = |sign: f64| std::array::from_fn(|k| if k < d { center[k] + sign * half[k] } else { sign });
                Self::Box { lo: corner(-1.0), hi: corner(1.0) }
            }
        }
    }

    pub fn contains(&self, x: &Point) -> bool {
        match self {
            Self::Ball { center, radius } => distance(x, center) < *radius,
            Self::Shell { center, inner, outer } => (*inner..*outer).contains(&distance(x, center)),
            Self::HalfSpace { normal, offset } => dot(normal, x) < *offset,
            Self::Layer { normal, middle, half } => (dot(normal, x) - middle).abs() < *half,
            Self::Box { lo, hi } => (0..3).all(|k| x[k] > lo[k] && x[k] < hi[k]),
            Self::Torus { center, radius, tube } => {
                let across = (x[0] - center[0]).hypot(x[1] - center[1]);
                (across - radius).hypot(x[2] - center[2]) < *tube
            }
            Self::Ellipsoid { center, radii } => {
                (0..3).map(|k| ((x[k] - center[k]) / radii[k]).powi(2)).sum::<f64>() < 1.0
            }
        }
    }

    /// As text, with what stands for the coordinates.
    pub fn condition(&self, names: &[String]) -> String {
        let d = names.len();
        let squares = |center: &Point| {
            let terms: Vec<String> = (0..d).map(|k| format!("({} - {:?})^2", names[k], center[k])).collect();
            terms.join(" + ")
        };
        let along =
            |normal: &Point| (0..d).map(|k| format!("{:?}*{}", normal[k], names[k])).collect::<Vec<_>>().join(" + ");
        match self {
            Self::Ball { center, radius } => format!("sqrt({}) < {radius:?}", squares(center)),
            Self::Shell { center, inner, outer } => {
                let r = format!("sqrt({})", squares(center));
                format!("({r} >= {inner:?})*({r} < {outer:?})")
            }
            Self::HalfSpace { normal, offset } => format!("{} < {offset:?}", along(normal)),
            Self::Layer { normal, middle, half } => format!("abs({} - {middle:?}) < {half:?}", along(normal)),
            Self::Box { lo, hi } => {
                let terms: Vec<String> =
                    (0..d).map(|k| format!("({0} > {1:?})*({0} < {2:?})", names[k], lo[k], hi[k])).collect();
                terms.join("*")
            }
            Self::Torus { center, radius, tube } => {
                let across = format!("hypot({} - {:?}, {} - {:?})", names[0], center[0], names[1], center[1]);
                match d {
                    3 => format!("hypot({across} - {radius:?}, {} - {:?}) < {tube:?}", names[2], center[2]),
                    _ => format!("abs({across} - {radius:?}) < {tube:?}"),
                }
            }
            Self::Ellipsoid { center, radii } => {
                let terms: Vec<String> =
                    (0..d).map(|k| format!("(({} - {:?})/{:?})^2", names[k], center[k], radii[k])).collect();
                format!("{} < 1", terms.join(" + "))
            }
        }
    }

    /// The box around it along each axis, infinite where it goes on.
    pub fn bounds(&self) -> [Point; 2] {
        let around = |center: &Point, half: &Point| {
            [std::array::from_fn(|k| center[k] - half[k]), std::array::from_fn(|k| center[k] + half[k])]
        };
        let endless = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
        match self {
            Self::Ball { center, radius } | Self::Shell { center, outer: radius, .. } => around(center, &[*radius; 3]),
            Self::Torus { center, radius, tube } => around(center, &[radius + tube, radius + tube, *tube]),
            Self::Ellipsoid { center, radii } => around(center, radii),
            Self::Box { lo, hi } => [*lo, *hi],
            Self::HalfSpace { .. } => endless,
            Self::Layer { normal, middle, half } => {
                let mut bounds = endless;
                if let Some(k) = normal.iter().position(|n| *n == 1.0) {
                    (bounds[0][k], bounds[1][k]) = (middle - half, middle + half);
                }
                bounds
            }
        }
    }

    /// Where along an axis a quadrature should have faces.
    pub fn faces(&self, axis: usize) -> Vec<f64> {
        let [lo, hi] = self.bounds();
        let (a, b) = (lo[axis], hi[axis]);
        let within = match self {
            Self::Torus { tube, .. } if axis < 2 => vec![a + 2.0 * tube, b - 2.0 * tube],
            Self::Shell { center, inner, .. } => vec![center[axis] - inner, center[axis] + inner],
            _ => Vec::new(),
        };
        within.into_iter().chain([a, 0.5 * (a + b), b]).filter(|v| v.is_finite()).collect()
    }
}
