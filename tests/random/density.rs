//! Densities: what they are at a point, and the same as an expression.

use super::draw::{Draw, Point, direction};
use super::solid::{Solid, distance};
use std::f64::consts::TAU;

/// A density without jumps.
#[derive(Debug, Clone)]
pub enum Law {
    Uniform,
    /// 1 + a sin(k x + phase), with as many waves in the box as `waves` says.
    Wave {
        strength: f64,
        wavevector: Point,
        phase: f64,
    },
    Gaussian {
        center: Point,
        width: f64,
    },
    /// (r^2 + core^2)^(-slope/2).
    Power {
        center: Point,
        core: f64,
        slope: f64,
    },
    /// r^-slope: infinite in the center.
    Cusp {
        center: Point,
        slope: f64,
    },
    /// exp(-n x/height).
    Atmosphere {
        normal: Point,
        foot: f64,
        height: f64,
    },
    /// exp(-R/length) / cosh(z/height)^2, the last axis across.
    Disc {
        center: Point,
        length: f64,
        height: f64,
    },
    /// (1 + (r/core)^2)^-6 + envelope max(1 - r/radius, 0)^1.5: a core that holds much of the mass.
    Giant {
        center: Point,
        core: f64,
        envelope: f64,
        radius: f64,
    },
}

impl Law {
    pub fn draw(draw: &mut Draw, d: usize, [lo, hi]: [&Point; 2], center: Point) -> Self {
        let edge = |k: usize| hi[k] - lo[k];
        let least = (0..d).map(edge).fold(f64::INFINITY, f64::min);
        let somewhere = |draw: &mut Draw| -> Point {
            if draw.percent(60) {
                return center;
            }
            std::array::from_fn(|k| if k < d { draw.between(lo[k], hi[k]) } else { 0.0 })
        };
        match draw.below(10) {
            0 | 1 => Self::Uniform,
            2 | 3 => {
                let waves: Point = std::array::from_fn(|_| draw.below(4) as f64);
                let wavevector = std::array::from_fn(|k| if k < d { TAU * waves[k] / edge(k) } else { 0.0 });
                Self::Wave { strength: draw.between(0.0, 0.98), wavevector, phase: draw.between(0.0, TAU) }
            }
            4 => Self::Gaussian { center: somewhere(draw), width: least * draw.decades(-1.6, -0.2) },
            5 => {
                let (center, core) = (somewhere(draw), least * draw.decades(-2.3, -0.3));
                Self::Power { center, core, slope: draw.between(0.5, 4.0) }
            }
            6 => Self::Cusp { center: somewhere(draw), slope: d as f64 * draw.between(0.2, 0.8) },
            7 => {
                let normal = if draw.percent(50) { direction(draw, d) } else { axis(d - 1) };
                let foot = (0..d).map(|k| normal[k] * if normal[k] > 0.0 { lo[k] } else { hi[k] }).sum();
                Self::Atmosphere { normal, foot, height: least * draw.decades(-2.0, 0.3) }
            }
            8 => {
                let length = least * draw.decades(-1.2, 0.0);
                Self::Disc { center, length, height: length * draw.decades(-1.3, 0.0) }
            }
            _ => {
                let core = least * draw.decades(-2.3, -1.0);
                Self::Giant { center, core, envelope: draw.decades(-12.0, -1.0), radius: 0.5 * least }
            }
        }
    }

    pub fn value(&self, x: &Point, d: usize) -> f64 {
        match self {
            Self::Uniform => 1.0,
            Self::Wave { strength, wavevector, phase } => {
                1.0 + strength * ((0..3).map(|k| wavevector[k] * x[k]).sum::<f64>() + phase).sin()
            }
            Self::Gaussian { center, width } => (-0.5 * (distance(x, center) / width).powi(2)).exp(),
            Self::Power { center, core, slope } => (distance(x, center).powi(2) + core * core).powf(-0.5 * slope),
            Self::Cusp { center, slope } => distance(x, center).powf(-slope),
            Self::Atmosphere { normal, foot, height } => {
                (-((0..3).map(|k| normal[k] * x[k]).sum::<f64>() - foot) / height).exp()
            }
            Self::Disc { center, length, height } => {
                let mut in_plane = *x;
                in_plane[d - 1] = center[d - 1];
                let across = (x[d - 1] - center[d - 1]) / height;
                (-distance(&in_plane, center) / length).exp() / across.cosh().powi(2)
            }
            Self::Giant { center, core, envelope, radius } => {
                let r = distance(x, center);
                (1.0 + (r / core).powi(2)).powi(-6) + envelope * (1.0 - r / radius).max(0.0).powf(1.5)
            }
        }
    }

    pub fn text(&self, names: &[String]) -> String {
        let d = names.len();
        let r = |center: &Point, axes: usize| {
            let terms: Vec<String> = (0..axes).map(|k| format!("({} - {:?})^2", names[k], center[k])).collect();
            if terms.is_empty() { "0".to_owned() } else { format!("sqrt({})", terms.join(" + ")) }
        };
        let along = |v: &Point| (0..d).map(|k| format!("{:?}*{}", v[k], names[k])).collect::<Vec<_>>().join(" + ");
        match self {
            Self::Uniform => "1".into(),
            Self::Wave { strength, wavevector, phase } => {
                format!("(1 + {strength:?}*sin({} + {phase:?}))", along(wavevector))
            }
            Self::Gaussian { center, width } => format!("exp(-0.5*({}/{width:?})^2)", r(center, d)),
            Self::Power { center, core, slope } => {
                format!("({}^2 + {:?})^{:?}", r(center, d), core * core, -0.5 * slope)
            }
            Self::Cusp { center, slope } => format!("{}^{:?}", r(center, d), -slope),
            Self::Atmosphere { normal, foot, height } => format!("exp(-({} - {foot:?})/{height:?})", along(normal)),
            Self::Disc { center, length, height } => format!(
                "exp(-{}/{length:?})/cosh(({} - {:?})/{height:?})^2",
                r(center, d - 1),
                names[d - 1],
                center[d - 1]
            ),
            Self::Giant { center, core, envelope, radius } => {
                let r = r(center, d);
                format!("((1 + ({r}/{core:?})^2)^-6 + {envelope:?}*max(1 - {r}/{radius:?}, 0)^1.5)")
            }
        }
    }

    fn pole(&self) -> Option<&Point> {
        if let Self::Cusp { center, .. } = self { Some(center) } else { None }
    }

    /// Where along an axis a quadrature should have faces.
    fn faces(&self, axis: usize) -> Vec<f64> {
        let around = |center: &Point, width: f64| {
            [-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0].map(|f| center[axis] + f * width).to_vec()
        };
        match self {
            Self::Gaussian { center, width } => around(center, *width),
            Self::Power { center, core, .. } | Self::Giant { center, core, .. } => around(center, *core),
            Self::Cusp { center, .. } => around(center, 0.01),
            Self::Disc { center, height, .. } => around(center, *height),
            Self::Uniform | Self::Wave { .. } | Self::Atmosphere { .. } => Vec::new(),
        }
    }
}

fn axis(k: usize) -> Point {
    std::array::from_fn(|i| f64::from(u8::from(i == k)))
}

/// A law with a factor and a floor.
#[derive(Debug, Clone)]
pub struct Matter {
    pub factor: f64,
    pub law: Law,
    pub floor: f64,
}

impl Matter {
    /// 0 right in a pole, as in the program.
    pub fn value(&self, x: &Point, d: usize) -> f64 {
        let value = self.factor * self.law.value(x, d) + self.floor;
        if self.factor == 0.0 || !value.is_finite() { 0.0 } else { value }
    }

    fn text(&self, names: &[String]) -> String {
        let floor = if self.floor > 0.0 { format!(" + {:?}", self.floor) } else { String::new() };
        match self.law {
            Law::Uniform => format!("{:?}", self.factor + self.floor),
            _ if self.factor == 0.0 => "0".into(),
            _ => format!("{:?}*{}{floor}", self.factor, self.law.text(names)),
        }
    }
}

/// Matter, with other matter in solids, of which the first counts that a point is in.
#[derive(Debug, Clone)]
pub struct Density {
    pub d: usize,
    pub solids: Vec<(Solid, Matter)>,
    pub around: Matter,
}

impl Density {
    /// The solid that `x` is in; as many as there are outside of them.
    pub fn region(&self, x: &Point) -> usize {
        self.solids.iter().position(|(solid, _)| solid.contains(x)).unwrap_or(self.solids.len())
    }

    pub fn regions(&self) -> usize {
        self.solids.len() + 1
    }

    pub fn matter(&self, region: usize) -> &Matter {
        self.solids.get(region).map_or(&self.around, |(_, matter)| matter)
    }

    pub fn value(&self, x: &Point) -> f64 {
        self.matter(self.region(x)).value(x, self.d)
    }

    pub fn text(&self, names: &[String]) -> String {
        self.solids.iter().rev().fold(self.around.text(names), |inner, (solid, matter)| {
            format!("if({}, {}, {inner})", solid.condition(names), matter.text(names))
        })
    }

    pub fn faces(&self, axis: usize) -> Vec<f64> {
        let of_solids =
            self.solids.iter().flat_map(|(solid, matter)| solid.faces(axis).into_iter().chain(matter.law.faces(axis)));
        of_solids.chain(self.around.law.faces(axis)).collect()
    }

    /// Whether a law is infinite somewhere in a box or on its faces.
    pub fn has_pole_within(&self, lo: &Point, hi: &Point) -> bool {
        let laws = self.solids.iter().map(|(_, matter)| &matter.law).chain([&self.around.law]);
        laws.filter_map(Law::pole).any(|pole| (0..self.d).all(|k| (lo[k]..=hi[k]).contains(&pole[k])))
    }

    /// Whether solids stand out by more than a factor wherever they end.
    pub fn is_stepped(&self, factor: f64) -> bool {
        let level = |region: usize| {
            let matter = self.matter(region);
            matches!(matter.law, Law::Uniform).then_some(matter.factor + matter.floor)
        };
        let levels: Option<Vec<f64>> = (0..self.regions()).map(level).collect();
        levels.is_some_and(|levels| {
            (0..levels.len()).all(|i| (0..i).all(|j| levels[i].max(levels[j]) > factor * levels[i].min(levels[j])))
        })
    }
}
