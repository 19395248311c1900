//! The bounding box with its axes, and the region within it.

use super::region::{Region, Wall};
use crate::geometry::unit_ball_volume;

/// A domain that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DomainError {
    #[error("axis {axis} runs from {lo} to {hi}; both must be finite and the second the larger")]
    Bounds { axis: usize, lo: f64, hi: f64 },
    #[error("a cylinder exists in 3-D only, not in {dimension}-D; use a ball")]
    Cylinder { dimension: usize },
}

/// What happens at the two ends of an axis of the bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    Periodic,
    Walls { lo: Wall, hi: Wall },
}

impl Axis {
    pub const OPEN: Self = Self::Walls { lo: Wall::Open, hi: Wall::Open };
    pub const REFLECTING: Self = Self::Walls { lo: Wall::Reflecting, hi: Wall::Reflecting };
}

/// Bounding box, its axes, and the region within it. Lengths in code units.
#[derive(Debug, Clone)]
pub struct Domain<const D: usize> {
    pub lo: [f64; D],
    pub hi: [f64; D],
    pub axes: [Axis; D],
    pub region: Region<D>,
}

/// Image of space along one axis: `x -> sign * x + shift`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisImage {
    pub sign: f64,
    pub shift: f64,
}

impl AxisImage {
    pub const IDENTITY: Self = Self { sign: 1.0, shift: 0.0 };

    pub fn apply(self, x: f64) -> f64 {
        self.sign * x + self.shift
    }
}

impl<const D: usize> Domain<D> {
    /// A box that fills its bounds.
    ///
    /// # Errors
    /// Bounds that are not finite or enclose nothing.
    pub fn new(lo: [f64; D], hi: [f64; D], axes: [Axis; D], region: Region<D>) -> Result<Self, DomainError> {
        for k in 0..D {
            if !(lo[k].is_finite() && hi[k].is_finite() && lo[k] < hi[k]) {
                return Err(DomainError::Bounds { axis: k, lo: lo[k], hi: hi[k] });
            }
        }
        Ok(Self { lo, hi, axes, region })
    }

    /// A ball (interval, disc, sphere) with its bounding box.
    ///
    /// # Errors
    /// A radius that is not positive and finite.
    pub fn ball(center: [f64; D], radius: f64, wall: Wall) -> Result<Self, DomainError> {
        let lo = crate::array(|k| center[k] - radius);
        let hi = crate::array(|k| center[k] + radius);
        Self::new(lo, hi, [Axis::OPEN; D], Region::Ball { center, inner_radius: 0.0, radius, wall })
    }

    /// A cylinder along `axis` with its bounding box; `ends` is what that axis does.
    ///
    /// # Errors
    /// A radius or length that is not positive and finite, or fewer than three dimensions.
    pub fn cylinder(
        center: [f64; D],
        axis: usize,
        [inner_radius, radius]: [f64; 2],
        length: f64,
        (wall, ends): (Wall, Axis),
    ) -> Result<Self, DomainError> {
        if D != 3 || axis >= D {
            return Err(DomainError::Cylinder { dimension: D });
        }
        let half = |k: usize| if k == axis { 0.5 * length } else { radius };
        let lo = crate::array(|k| center[k] - half(k));
        let hi = crate::array(|k| center[k] + half(k));
        let axes = std::array::from_fn(|k| if k == axis { ends } else { Axis::OPEN });
        Self::new(lo, hi, axes, Region::Cylinder { center, axis, inner_radius, radius, wall })
    }

    pub fn extent(&self) -> [f64; D] {
        crate::array(|k| self.hi[k] - self.lo[k])
    }

    /// Longest edge of the bounding box.
    pub fn size(&self) -> f64 {
        self.extent().into_iter().fold(0.0, f64::max)
    }

    /// Volume of the region (area, length).
    pub fn volume(&self) -> f64 {
        match &self.region {
            Region::Box => self.extent().into_iter().product(),
            Region::Ball { inner_radius, radius, .. } => {
                unit_ball_volume(D) * (radius.powi(D as i32) - inner_radius.powi(D as i32))
            }
            Region::Cylinder { axis, inner_radius, radius, .. } => {
                unit_ball_volume(2) * (radius.powi(2) - inner_radius.powi(2)) * (self.hi[*axis] - self.lo[*axis])
            }
            Region::Hull(hull, _) => hull.volume(),
        }
    }

    /// Edge of the cube that each of so many particles has of it.
    pub fn mean_spacing(&self, count: usize) -> f64 {
        (self.volume() / count as f64).powf(1.0 / D as f64)
    }

    /// Whether a particle may be at `x` (periodic axes take any value).
    #[inline]
    pub fn contains(&self, x: &[f64; D]) -> bool {
        // Without branches: it is asked at every place at which a field is.
        let within = |y: &[f64; D]| (0..D).fold(true, |all, k| all & (y[k] >= self.lo[k]) & (y[k] <= self.hi[k]));
        if within(x) {
            return self.region.contains(x);
        }
        let y = self.wrapped(x);
        within(&y) && self.region.contains(&y)
    }

    /// The same place with periodic coordinates in `[lo, hi)`.
    pub fn wrapped(&self, x: &[f64; D]) -> [f64; D] {
        let mut x = *x;
        self.wrap(&mut x);
        x
    }

    /// Moves periodic coordinates into `[lo, hi)`.
    pub fn wrap(&self, x: &mut [f64; D]) {
        for k in 0..D {
            if self.axes[k] == Axis::Periodic && !(x[k] >= self.lo[k] && x[k] < self.hi[k]) {
                let length = self.hi[k] - self.lo[k];
                let wrapped = self.lo[k] + (x[k] - self.lo[k]).rem_euclid(length);
                // rem_euclid rounds up to `length` for tiny negative arguments.
                x[k] = if wrapped < self.hi[k] { wrapped } else { self.lo[k] };
            }
        }
    }

    /// Brings a moved particle back: periodic axes wrap, others mirror it at the face or surface that it
    /// crossed, and what is still outside returns to `from`, which must lie inside.
    pub fn confine(&self, from: &[f64; D], x: &mut [f64; D]) {
        self.wrap(x);
        for k in 0..D {
            if self.axes[k] != Axis::Periodic {
                let (lo, hi) = (self.lo[k], self.hi[k]);
                if x[k] < lo {
                    x[k] = 2.0 * lo - x[k];
                } else if x[k] > hi {
                    x[k] = 2.0 * hi - x[k];
                }
            }
        }
        if !self.region.contains(x)
            && let Some(mirrored) = self.region.mirror(x)
        {
            *x = mirrored;
        }
        if !self.contains(x) {
            *x = *from;
        }
    }

    /// Shortest vector `from -> to` through periodic images.
    pub fn displacement(&self, from: &[f64; D], to: &[f64; D]) -> [f64; D] {
        crate::array(|k| {
            let d = to[k] - from[k];
            let length = self.hi[k] - self.lo[k];
            // Rounding is a call into the mathematics library, in programs for any x86-64.
            if self.axes[k] == Axis::Periodic && d.abs() >= 0.5 * length {
                d - length * (d / length).round()
            } else {
                d
            }
        })
    }

    /// Square of the smallest distance between two boxes, each given by its corners, through periodic images.
    pub fn squared_distance_of_boxes(&self, a: [&[f64; D]; 2], b: [&[f64; D]; 2]) -> f64 {
        let along = |k: usize| {
            let gap = |shift: f64| (a[0][k] - b[1][k] - shift).max(b[0][k] + shift - a[1][k]).max(0.0);
            let length = self.hi[k] - self.lo[k];
            match self.axes[k] {
                Axis::Periodic => gap(0.0).min(gap(length)).min(gap(-length)),
                Axis::Walls { .. } => gap(0.0),
            }
        };
        (0..D).map(|k| along(k).powi(2)).sum()
    }

    /// Images of axis `k`, identity first, whose copy of the box reaches into `[a, b]`.
    pub fn axis_images(&self, k: usize, a: f64, b: f64) -> Vec<AxisImage> {
        let (lo, hi) = (self.lo[k], self.hi[k]);
        let length = hi - lo;
        let reaches = |image: &AxisImage| {
            let (p, q) = (image.apply(lo), image.apply(hi));
            p.min(q) <= b && p.max(q) >= a
        };
        let mut images = vec![AxisImage::IDENTITY];
        let copies = ((lo - a).max(b - hi) / length).ceil().clamp(0.0, MAX_IMAGES as f64) as i64 + 1;
        let mut push = |sign: f64, shift: f64| {
            let image = AxisImage { sign, shift };
            if reaches(&image) {
                images.push(image);
            }
        };
        match self.axes[k] {
            Axis::Periodic => (1..=copies).for_each(|c| {
                push(1.0, c as f64 * length);
                push(1.0, -c as f64 * length);
            }),
            Axis::Walls { lo: Wall::Reflecting, hi: Wall::Reflecting } => (0..=copies).for_each(|c| {
                let shift = 2.0 * c as f64 * length;
                push(-1.0, 2.0 * lo - shift);
                push(-1.0, 2.0 * hi + shift);
                if c > 0 {
                    push(1.0, shift);
                    push(1.0, -shift);
                }
            }),
            Axis::Walls { lo: Wall::Reflecting, .. } => push(-1.0, 2.0 * lo),
            Axis::Walls { hi: Wall::Reflecting, .. } => push(-1.0, 2.0 * hi),
            Axis::Walls { .. } => {}
        }
        images
    }

    /// Distance from `x` to the nearest edge at which matter may end: a face without periodic images, or the
    /// region's surface. Infinite for a fully periodic box.
    pub fn distance_to_edge(&self, x: &[f64; D]) -> f64 {
        let mut distance = self.region.distance_to_surface(x);
        for k in (0..D).filter(|&k| self.axes[k] != Axis::Periodic && self.has_faces(k)) {
            distance = distance.min(x[k] - self.lo[k]).min(self.hi[k] - x[k]);
        }
        distance
    }

    /// Whether an edge at which matter may end is nearer than `reach`: [`Self::distance_to_edge`] without looking farther.
    pub fn is_edge_within(&self, x: &[f64; D], reach: f64) -> bool {
        let face = |k: usize| x[k] - self.lo[k] < reach || self.hi[k] - x[k] < reach;
        (0..D).any(|k| self.axes[k] != Axis::Periodic && self.has_faces(k) && face(k))
            || self.region.is_surface_within(x, reach)
    }

    /// The same space in other units of length: all lengths times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let times = |v: [f64; D]| v.map(|c| c * factor);
        Self { lo: times(self.lo), hi: times(self.hi), axes: self.axes, region: self.region.scaled(factor) }
    }

    /// The space with mirrors in the place of open faces and surfaces: vacuum would push particles out.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let mut mirrored = self.clone();
        for axis in &mut mirrored.axes {
            if let Axis::Walls { lo, hi } = axis {
                (*lo, *hi) = (Wall::Reflecting, Wall::Reflecting);
            }
        }
        // The box of a curved region is no wall: its surface has ghosts of its own.
        if mirrored.region.wall().is_some() {
            for k in (0..D).filter(|&k| self.axes[k] != Axis::Periodic && !self.has_faces(k)) {
                mirrored.axes[k] = Axis::OPEN;
            }
        }
        mirrored
    }

    /// Whether a flat wall mirrors.
    pub fn has_mirrors(&self) -> bool {
        let mirrors = |axis: &Axis| {
            matches!(axis, Axis::Walls { lo: Wall::Reflecting, .. } | Axis::Walls { hi: Wall::Reflecting, .. })
        };
        self.axes.iter().any(mirrors)
    }

    /// The space with open faces in the place of flat mirrors.
    #[must_use]
    pub fn without_mirrors(&self) -> Self {
        let mut open = self.clone();
        open.axes.iter_mut().filter(|axis| **axis != Axis::Periodic).for_each(|axis| *axis = Axis::OPEN);
        open
    }

    /// Distance from `x` to the nearest flat wall that mirrors; infinite where none does.
    pub fn distance_to_mirror(&self, x: &[f64; D]) -> f64 {
        let of = |wall: Wall, distance: f64| if wall == Wall::Reflecting { distance } else { f64::INFINITY };
        let along = |k: usize| match self.axes[k] {
            Axis::Walls { lo, hi } => of(lo, x[k] - self.lo[k]).min(of(hi, self.hi[k] - x[k])),
            Axis::Periodic => f64::INFINITY,
        };
        (0..D).map(along).fold(f64::INFINITY, f64::min)
    }

    /// The middle of the domain: the center of a ball, else of the bounding box.
    pub fn center(&self) -> [f64; D] {
        match &self.region {
            Region::Ball { center, .. } => *center,
            _ => crate::array(|k| 0.5 * (self.lo[k] + self.hi[k])),
        }
    }

    /// Whether the region reaches the faces of its bounding box along axis `k`, as more than touching them.
    pub fn has_faces(&self, k: usize) -> bool {
        match self.region {
            Region::Box => true,
            Region::Cylinder { axis, .. } => axis == k,
            Region::Ball { .. } | Region::Hull(..) => false,
        }
    }
}

/// A support radius beyond this many box lengths is refused elsewhere; the cap keeps image lists finite.
const MAX_IMAGES: i64 = 4096;
