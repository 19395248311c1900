//! Solids: primitives put together by union, intersection and difference (constructive solid geometry), as regions.
//!
//! Boxes and cylinders are intersections themselves, so that what is left are smooth surfaces. The nearest point of a solid's surface
//! is the nearest one of a primitive's, or of the curve in which two of them meet, or of a point in which three do, as far as it belongs
//! to the solid's surface: where an arbitrary choice of sides of the primitives that it lies on changes whether it is inside.

mod primitive;
mod roots;

use super::MassEstimate;
use super::bvh::Aabb;
use super::chords::chord_integral;
use nalgebra::{DMatrix, DVector};
pub(crate) use primitive::{Primitive, Shape, upright};
use sph::domain::Hull;
use sph::geometry::distance;

/// How primitives, by number, make a solid.
#[derive(Debug, Clone)]
pub(crate) enum Tree {
    Leaf(usize),
    All(Vec<Tree>),
    Any(Vec<Tree>),
    /// The first without the others.
    Less(Box<Tree>, Vec<Tree>),
}

/// Region of a solid. Lengths are in the unit of its primitives.
#[derive(Debug)]
pub struct Solid<const D: usize> {
    primitives: Vec<Primitive<D>>,
    tree: Tree,
    bounds: Aabb<D>,
    volume: MassEstimate,
    /// Primitives that do not hold all of the bounding box.
    telling: Vec<usize>,
}

/// Chords that the volume takes, at most.
const CHORDS: usize = 200_000;
/// Distance from a primitive at which a point lies on it, in sizes of the solid.
const ON: f64 = 1e-8;
/// Steps towards a curve or a point in which primitives meet.
const STEPS: usize = 24;

impl Tree {
    pub(crate) fn contains(&self, inside: &dyn Fn(usize) -> bool) -> bool {
        match self {
            Self::Leaf(i) => inside(*i),
            Self::All(parts) => parts.iter().all(|p| p.contains(inside)),
            Self::Any(parts) => parts.iter().any(|p| p.contains(inside)),
            Self::Less(first, others) => first.contains(inside) && !others.iter().any(|p| p.contains(inside)),
        }
    }

    fn chords(&self, of: &dyn Fn(usize) -> Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        match self {
            Self::Leaf(i) => of(*i),
            Self::All(parts) => parts.iter().map(|p| p.chords(of)).reduce(|a, b| both(&a, &b)).unwrap_or_default(),
            Self::Any(parts) => either(parts.iter().flat_map(|p| p.chords(of)).collect()),
            Self::Less(first, others) => {
                let taken = either(others.iter().flat_map(|p| p.chords(of)).collect());
                both(&first.chords(of), &gaps(&taken))
            }
        }
    }
}

/// Common parts of ascending intervals.
fn both(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let pairs = a.iter().flat_map(|p| b.iter().map(move |q| [p[0].max(q[0]), p[1].min(q[1])]));
    pairs.filter(|p| p[1] > p[0]).collect()
}

/// Intervals joined where they overlap.
fn either(mut all: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for next in all {
        match joined.last_mut() {
            Some(last) if last[1] >= next[0] => last[1] = last[1].max(next[1]),
            _ => joined.push(next),
        }
    }
    joined
}

/// What is between ascending intervals.
fn gaps(taken: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let starts = std::iter::once(f64::NEG_INFINITY).chain(taken.iter().map(|p| p[1]));
    let ends = taken.iter().map(|p| p[0]).chain([f64::INFINITY]);
    starts.zip(ends).map(|(a, b)| [a, b]).filter(|p| p[1] > p[0]).collect()
}

/// Whether a half-space holds all of a box, but for rounding.
fn holds<const D: usize>(primitive: &Primitive<D>, bounds: &Aabb<D>) -> bool {
    let corner = |c: usize| sph::array(|k| if c >> k & 1 == 1 { bounds.hi[k] } else { bounds.lo[k] });
    let height = |c: usize| primitive.level(&corner(c)).unwrap_or(f64::INFINITY);
    let reach = ON * bounds.diagonal();
    matches!(primitive.shape, Shape::HalfSpace { .. }) && (0..1 << D).all(|c| height(c) < reach)
}

impl<const D: usize> Solid<D> {
    /// `bounds` hold all of it.
    ///
    /// # Errors
    /// A solid without a volume, as a sentence.
    pub(crate) fn new(primitives: Vec<Primitive<D>>, tree: Tree, bounds: Aabb<D>) -> Result<Self, String> {
        let volume = MassEstimate { value: 0.0, error: 0.0 };
        let telling = (0..primitives.len()).filter(|&i| !holds(&primitives[i], &bounds)).collect();
        let mut solid = Self { primitives, tree, bounds, volume, telling };
        let found = chord_integral(&solid, &bounds, CHORDS, &|_, chord| chord[1] - chord[0]);
        solid.volume =
            found.filter(|v| v.value > 0.0).ok_or("nothing is left of it: its parts do not overlap, or take all")?;
        Ok(solid)
    }

    /// The bounding box.
    pub fn bounds(&self) -> [[f64; D]; 2] {
        [self.bounds.lo, self.bounds.hi]
    }

    /// The volume with its error.
    pub fn volume_estimate(&self) -> MassEstimate {
        self.volume
    }

    /// The primitives whose surfaces are nearer to `x` than `reach`: how far away, which, and their nearest points.
    fn near(&self, x: &[f64; D], reach: f64) -> Vec<(f64, usize, [f64; D])> {
        let mut near = Vec::with_capacity(self.primitives.len());
        for (i, primitive) in self.primitives.iter().enumerate() {
            let p = primitive.nearest(x);
            let away = distance(&p, x);
            if away < reach {
                near.push((away, i, p));
            }
        }
        near
    }

    /// Whether `y` is on the surface: its primitives there, taken to be on either side, decide whether it is inside.
    fn is_on_surface(&self, y: &[f64; D]) -> bool {
        let on = self.near(y, ON * self.bounds.diagonal());
        let inside: Vec<bool> = self.primitives.iter().map(|p| p.contains(y)).collect();
        let by = |code: usize| {
            self.tree.contains(&|i| match on.iter().position(|near| near.1 == i) {
                Some(place) => code >> place & 1 == 1,
                None => inside[i],
            })
        };
        let codes = 1_usize << on.len().min(MOST_MEETING);
        !on.is_empty() && (1..codes).any(|code| by(code) != by(0))
    }

    /// The point nearest to `x` in which the primitives of `set` meet; `None` where they do not.
    ///
    /// Newton's steps: the nearest point to `x` in the planes that touch the primitives near the last one.
    fn meeting(&self, set: &[usize], x: &[f64; D]) -> Option<[f64; D]> {
        let reach = ON * self.bounds.diagonal();
        let mut y = self.primitives[set[0]].nearest(x);
        for _ in 0..STEPS {
            let touching: Vec<([f64; D], [f64; D])> = set
                .iter()
                .map(|&i| {
                    let p = self.primitives[i].nearest(&y);
                    (p, self.primitives[i].normal(&p, &y))
                })
                .collect();
            let normals = DMatrix::from_fn(set.len(), D, |i, k| touching[i].1[k]);
            let heights = DVector::from_fn(set.len(), |i, _| {
                (0..D).map(|k| touching[i].1[k] * (touching[i].0[k] - x[k])).sum::<f64>()
            });
            // Parallel planes meet nowhere.
            let gram = &normals * normals.transpose();
            let weights = gram.lu().solve(&heights)?;
            let step = normals.transpose() * weights;
            let next: [f64; D] = sph::array(|k| x[k] + step[k]);
            let moved = distance(&next, &y);
            y = next;
            if !moved.is_finite() {
                return None;
            }
            if moved < 1e-3 * reach {
                break;
            }
        }
        let misses = set.iter().any(|&i| !(distance(&self.primitives[i].nearest(&y), &y) < reach));
        (!misses).then_some(y)
    }
}

/// Primitives in one point, of which the sides are tried.
const MOST_MEETING: usize = 12;

impl<const D: usize> Hull<D> for Solid<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        self.tree.contains(&|i| self.primitives[i].contains(x))
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        self.nearest_within(x, f64::INFINITY).unwrap_or(*x)
    }

    fn nearest_within(&self, x: &[f64; D], reach: f64) -> Option<[f64; D]> {
        let mut near = self.near(x, reach);
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best = (reach, None);
        for (away, _, p) in &near {
            if *away < best.0 && self.is_on_surface(p) {
                best = (*away, Some(*p));
                break;
            }
        }
        // What is farther than the best has no point that is nearer.
        let closer = |best: f64| near.iter().take_while(|n| n.0 < best).map(|n| n.1).collect::<Vec<_>>();
        for count in 2..=D {
            let candidates = closer(best.0);
            for set in subsets(&candidates, count) {
                let Some(y) = self.meeting(&set, x) else { continue };
                let away = distance(&y, x);
                if away < best.0 && self.is_on_surface(&y) {
                    best = (away, Some(y));
                }
            }
        }
        best.1
    }

    fn volume(&self) -> f64 {
        self.volume.value
    }

    fn levels(&self, x: &[f64; D], each: &mut dyn FnMut(f64)) -> bool {
        self.telling.iter().map(|&i| self.primitives[i].level(x)).all(|level| level.map(&mut *each).is_some())
    }

    fn chords(&self, axis: usize, x: &[f64; D]) -> Option<Vec<[f64; 2]>> {
        let ends = [self.bounds.lo[axis], self.bounds.hi[axis]];
        Some(both(&self.tree.chords(&|i| self.primitives[i].chords(axis, x)), &[ends]))
    }
}

/// All choices of two or three.
fn subsets(of: &[usize], count: usize) -> Vec<Vec<usize>> {
    let mut sets = Vec::new();
    for (i, &a) in of.iter().enumerate() {
        for (j, &b) in of.iter().enumerate().skip(i + 1) {
            match count {
                2 => sets.push(vec![a, b]),
                _ => sets.extend(of[j + 1..].iter().map(|&c| vec![a, b, c])),
            }
        }
    }
    sets
}

#[cfg(test)]
mod tests;
