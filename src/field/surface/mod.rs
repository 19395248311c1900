//! Closed surfaces of facets (triangles, or segments in 2-D) as regions: a point with a winding number above one half is inside.
//!
//! Volume: by the divergence theorem where the surface is closed and passes through itself nowhere that matters, checked against
//! the integral of its chords; else that integral. A query takes O(log n) of n facets.

mod edges;
mod octants;
mod repair;
mod winding;

use super::MassEstimate;
use super::bvh::Aabb;
use super::chords::chord_integral;
use super::facets::{FacetTree, closest_on_facet, normal};
use super::quadrature::radical_inverse;
use crate::roots::bisect;
use edges::Edges;
use octants::Octants;
use rayon::prelude::*;
use repair::{Repaired, repair};
use sph::domain::Hull;
use sph::geometry::distance;
use winding::{Facet, Winding, enclosed};

/// Region within facets. Lengths are in the unit of the corners.
#[derive(Debug)]
pub struct Surface<const D: usize> {
    facets: Vec<Facet<D>>,
    /// How many of them are the surface; the rest closes cracks.
    own: usize,
    tree: FacetTree<D>,
    /// What of the facets has the outside on one side, where the rest is within the body.
    skin: Option<(Vec<Facet<D>>, FacetTree<D>)>,
    winding: Winding<D>,
    octants: Option<Octants<D>>,
    /// Of a closed surface that passes through itself nowhere.
    edges: Option<Edges<D>>,
    is_closed: bool,
    /// Area of the caps of holes over that of the facets.
    capped: f64,
    bounds: Aabb<D>,
    volume: MassEstimate,
}

/// Evaluations that the integral of chords takes, at most.
const CHORDS: usize = 24_000;
/// The same of a surface that passes through itself, which has no other volume.
const MORE_CHORDS: usize = 400_000;
/// The same of a surface with gaps, whose chords take many winding numbers.
const LOOSE_CHORDS: usize = 12_000;
/// Difference of the volumes by divergence and by chords, in the latter, that still counts as none.
const AGREEMENT: f64 = 1e-4;
/// Places along a chord of a surface with gaps at which it is looked whether they are inside, and halvings where that changes.
const LOOKS: usize = 6;
const HALVINGS: usize = 30;
/// Places in the bounding box at which a surface with gaps is judged.
const PROBES: usize = 1 << 13;

/// Area of closed holes over that of the surface from which on it is worth a warning.
const LARGE_HOLES: f64 = 0.02;
/// How far to the side of a facet it is looked whether that is outside, in diagonals of the whole.
const SIDE_STEP: f64 = 1e-7;

/// Facets that are looked at for walls within the body.
const LOOKED_AT: usize = 4096;
/// What is left of a facet that is within the body in part, in diagonals of the whole: it is halved until its edges are shorter.
const FINEST: f64 = 2e-3;

/// What is found of a volume.
struct Measured {
    volume: MassEstimate,
    /// What is to be said of a surface that goes around some of it more than once.
    passes_itself: Option<String>,
}

/// The parts between the corners of a facet and the middles of its edges.
fn halves<const D: usize>(facet: &Facet<D>) -> Vec<Facet<D>> {
    let middle = |i: usize, j: usize| -> [f64; D] { sph::array(|k| 0.5 * (facet[i][k] + facet[j][k])) };
    let mut parts: Vec<Facet<D>> =
        (0..D).map(|corner| std::array::from_fn(|i| if i == corner { facet[i] } else { middle(corner, i) })).collect();
    if D == 3 {
        parts.push(std::array::from_fn(|i| middle(i, (i + 1) % D)));
    }
    parts
}

impl<const D: usize> Surface<D> {
    /// The region within `facets`, which name their corners among `points`; with notes on what was repaired.
    ///
    /// # Errors
    /// Facets that enclose nothing: a sentence on why, with the remedy.
    pub fn new(points: Vec<[f64; D]>, facets: Vec<[u32; D]>) -> Result<(Self, Vec<String>), String> {
        let Repaired { mut facets, seams, is_closed, capped, mut notes } = repair(points, facets);
        let own = facets.len();
        if own == 0 {
            return Err("none of its facets has an area".into());
        }
        facets.extend(seams);
        let tree = FacetTree::new(facets.len(), |i| &facets[i as usize]);
        let winding = Winding::new(&tree.tree, &facets);
        let bounds = Aabb::around(facets[..own].iter().flatten());
        if let Some(k) = (0..D).find(|&k| !(bounds.hi[k] > bounds.lo[k])) {
            return Err(format!("it is flat: all of it lies at {} = {:e}", ["x", "y", "z"][k], bounds.lo[k]));
        }
        let volume = MassEstimate { value: 0.0, error: 0.0 };
        let mut surface = Self {
            facets,
            own,
            tree,
            skin: None,
            winding,
            octants: None,
            edges: None,
            is_closed,
            capped,
            bounds,
            volume,
        };
        if is_closed {
            let clear = |x: &[f64; D], reach: f64| surface.nearest_within(x, reach).is_none();
            let octants = Octants::new(bounds, &clear, &|x| surface.times(x) > 0);
            surface.octants = Some(octants);
        } else {
            surface.refuse_open(&mut notes)?;
        }
        let measured = surface.measured()?;
        surface.volume = measured.volume;
        if let Some(note) = measured.passes_itself {
            surface.skin = Some(surface.outer_facets());
            notes.push(note);
        } else if is_closed && surface.has_inner_walls() {
            surface.skin = Some(surface.outer_facets());
            notes.push("closed parts of the surface touch each other: the walls between them are within the body, and left aside".into());
        } else if is_closed {
            surface.edges = Some(Edges::new(&surface.facets[..own]));
        }
        Ok((surface, notes))
    }

    /// The facets of a closed surface, as far as they are not within the body: only these end it.
    fn outer_facets(&self) -> (Vec<Facet<D>>, FacetTree<D>) {
        let outer: Vec<Facet<D>> =
            self.facets[..self.own].par_iter().flat_map_iter(|facet| self.outside_of(facet)).collect();
        let tree = FacetTree::new(outer.len(), |i| &outer[i as usize]);
        (outer, tree)
    }

    /// The parts of a facet that have the outside on their side, to [`FINEST`].
    fn outside_of(&self, facet: &Facet<D>) -> Vec<Facet<D>> {
        let mut sides = self.sides(facet);
        let middle = sides.next().unwrap_or(true);
        let is_fine = || {
            let finest = FINEST * self.bounds.diagonal();
            (0..D).all(|i| distance(&facet[i], &facet[(i + 1) % D]) < finest)
        };
        if sides.all(|corner| corner == middle) || is_fine() {
            return if middle { vec![*facet] } else { Vec::new() };
        }
        halves(facet).iter().flat_map(|part| self.outside_of(part)).collect()
    }

    /// Whether the middle of a facet, and then places near its corners, have the outside on their side.
    fn sides(&self, facet: &Facet<D>) -> impl Iterator<Item = bool> {
        let (normal, step) = (normal(facet).normalize(), SIDE_STEP * self.bounds.diagonal());
        let is_outer = move |weights: [f64; D]| {
            let beside = |k: usize| (0..D).map(|i| weights[i] * facet[i][k]).sum::<f64>() + step * normal[k];
            self.times(&sph::array(beside)) <= 0
        };
        let near =
            |corner: usize| -> [f64; D] { sph::array(|i| if i == corner { 0.9 } else { 0.1 / (D as f64 - 1.0) }) };
        std::iter::once([1.0 / D as f64; D]).chain((0..D).map(near)).map(is_outer)
    }

    /// Whether facets have the inside on both sides: closed parts of the surface touch there. Many facets are looked at, not all.
    fn has_inner_walls(&self) -> bool {
        let step = self.own.div_ceil(LOOKED_AT);
        let looked: Vec<&Facet<D>> = self.facets[..self.own].iter().step_by(step).collect();
        looked.into_par_iter().any(|facet| !self.sides(facet).all(|is_outer| is_outer))
    }

    /// The bounding box.
    pub fn bounds(&self) -> [[f64; D]; 2] {
        [self.bounds.lo, self.bounds.hi]
    }

    /// The volume (area) with its error.
    pub fn volume_estimate(&self) -> MassEstimate {
        self.volume
    }

    fn winds(&self, x: &[f64; D]) -> bool {
        self.winding.value(&self.tree.tree, &self.facets, x) > 0.5
    }

    /// The winding number of a closed surface: how often a ray from `x` leaves it, less how often it enters. A tenth of the
    /// time that the sum of angles takes, which it equals.
    fn times(&self, x: &[f64; D]) -> i32 {
        let extent = |k: usize| self.bounds.hi[k] - self.bounds.lo[k];
        let axis = (1..D).fold(0, |best, k| if extent(k) < extent(best) { k } else { best });
        let reaches =
            |b: &Aabb<D>| (0..D).all(|k| if k == axis { x[k] <= b.hi[k] } else { x[k] >= b.lo[k] && x[k] <= b.hi[k] });
        let mut times = 0;
        self.tree.tree.walk(
            |_, bounds| reaches(bounds),
            |i| {
                if let Some((_, step)) = crossing(&self.facets[i as usize], axis, x).filter(|c| c.0 > x[axis]) {
                    times -= step;
                }
            },
        );
        times
    }

    /// Refuses what surrounds less than it leaves undecided.
    fn refuse_open(&self, notes: &mut Vec<String>) -> Result<(), String> {
        let margin = 0.05 * self.bounds.diagonal();
        let Aabb { lo, hi } = self.bounds.grown(margin);
        let of = |i: usize| {
            let place = |k: usize| lo[k] + (hi[k] - lo[k]) * radical_inverse(i + 1, [2, 3, 5][k]);
            self.winding.value(&self.tree.tree, &self.facets, &sph::array(place))
        };
        let values: Vec<f64> = (0..PROBES).into_par_iter().map(of).collect();
        let inside = values.iter().filter(|w| **w > 0.5).count();
        let undecided = values.iter().filter(|w| (0.25..0.75).contains(*w)).count();
        if inside == 0 || undecided > inside {
            let share = |n: usize| 100.0 * n as f64 / PROBES as f64;
            return Err(format!(
                "it is an open sheet rather than the surface of a body: its winding number is above 0.5 in {:.1} % of its box and between \
                 0.25 and 0.75 in {:.1} %; close it",
                share(inside),
                share(undecided)
            ));
        }
        notes.push("the surface has gaps; inside is where its winding number is above 0.5".into());
        Ok(())
    }

    /// The volume.
    fn measured(&self) -> Result<Measured, String> {
        let most = if self.is_closed { CHORDS } else { LOOSE_CHORDS };
        let chords = chord_integral(self, &self.bounds, most, &|_, chord| chord[1] - chord[0]);
        let Some(by_chords) = chords.filter(|v| v.value > 0.0) else {
            return Err("it encloses nothing: check whether it is closed".into());
        };
        let exact = enclosed(&self.facets, &self.bounds.lo);
        let apart = (exact - by_chords.value).abs();
        if self.is_closed && apart <= by_chords.error.max(AGREEMENT * by_chords.value) {
            let volume = MassEstimate { value: exact, error: 1e-14 * exact };
            return Ok(Measured { volume, passes_itself: None });
        }
        let more = || chord_integral(self, &self.bounds, MORE_CHORDS, &|_, chord| chord[1] - chord[0]);
        let by_chords = if self.is_closed { more().unwrap_or(by_chords) } else { by_chords };
        let passes_itself = self.is_closed.then(|| {
            format!(
                "the surface passes through itself, or a closed part of it lies within another that is turned the same way, and counts as filled (turn \
                 its triangles over, and it is a cavity): by the divergence theorem it encloses {exact:.6e}, counting twice what it goes around \
                 twice; its volume is {:.6e}",
                by_chords.value
            )
        });
        Ok(Measured { volume: by_chords, passes_itself })
    }

    /// Where the line through `x` along `axis` meets facets, with +1 where it enters and -1 where it leaves, in order. Of facets that share
    /// a ridge a line through that meets one.
    fn crossings(&self, axis: usize, x: &[f64; D]) -> Vec<(f64, i32)> {
        let across = |k: &usize| *k != axis;
        let mut found = Vec::new();
        let reaches = |b: &Aabb<D>| (0..D).filter(across).all(|k| x[k] >= b.lo[k] && x[k] <= b.hi[k]);
        self.tree.tree.walk(
            |_, bounds| reaches(bounds),
            |i| {
                found.extend(crossing(&self.facets[i as usize], axis, x));
            },
        );
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        found
    }

    /// Chords of a surface with gaps: where the winding number passes one half, between crossings too.
    fn loose_chords(&self, axis: usize, x: &[f64; D], crossings: &[(f64, i32)]) -> Vec<[f64; 2]> {
        let margin = 0.5 * (self.bounds.hi[axis] - self.bounds.lo[axis]);
        let (first, last) = (self.bounds.lo[axis] - margin, self.bounds.hi[axis] + margin);
        let mut ends: Vec<f64> = vec![first];
        ends.extend(crossings.iter().map(|c| c.0).chain([last]));
        let at = |t: f64| {
            let mut y = *x;
            y[axis] = t;
            self.winds(&y)
        };
        let mut chords: Vec<[f64; 2]> = Vec::new();
        let mut add = |a: f64, b: f64| match chords.last_mut() {
            Some(chord) if chord[1] >= a => chord[1] = b,
            _ => chords.push([a, b]),
        };
        for pair in ends.windows(2).filter(|pair| pair[1] > pair[0]) {
            let place = |i: usize| pair[0] + (pair[1] - pair[0]) * (i as f64 + 0.5) / LOOKS as f64;
            let (mut begin, mut was) = (pair[0], at(place(0)));
            for i in 1..LOOKS {
                let is = at(place(i));
                if is == was {
                    continue;
                }
                let [a, b] = bisect(|t| at(t) == was, [place(i - 1), place(i)], HALVINGS);
                if was {
                    add(begin, a);
                }
                (begin, was) = (b, is);
            }
            if was {
                add(begin, pair[1]);
            }
        }
        chords
    }
}

/// Where a line along `axis` through `x` meets a facet: the coordinate, and +1 where it enters.
fn crossing<const D: usize>(p: &Facet<D>, axis: usize, x: &[f64; D]) -> Option<(f64, i32)> {
    if D == 2 {
        let k = 1 - axis;
        let is_left = |c: &[f64; D]| c[k] <= x[k];
        if is_left(&p[0]) == is_left(&p[1]) {
            return None;
        }
        let t = (x[k] - p[0][k]) / (p[1][k] - p[0][k]);
        // The outward normal of a segment has the component dy along x and -dx along y.
        let normal = if axis == 0 { p[1][1] - p[0][1] } else { p[0][0] - p[1][0] };
        return Some((p[0][axis] + t * (p[1][axis] - p[0][axis]), if normal < 0.0 { 1 } else { -1 }));
    }
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = |c: &[f64; D]| [c[i], c[j]];
    // Twice the area of x with an edge, with the same rounding for both facets of the edge; 0 counts as left of the edge taken
    // in ascending order.
    let side = |a: [f64; 2], b: [f64; 2]| {
        let (low, high, sign) = if a < b { (a, b, 1.0) } else { (b, a, -1.0) };
        let area = (low[0] - x[i]) * (high[1] - x[j]) - (low[1] - x[j]) * (high[0] - x[i]);
        (sign * area, (area >= 0.0) == (sign > 0.0))
    };
    let [a, b, c] = [flat(&p[0]), flat(&p[1]), flat(&p[2])];
    let [(wc, in_ab), (wa, in_bc), (wb, in_ca)] = [side(a, b), side(b, c), side(c, a)];
    if in_ab != in_bc || in_bc != in_ca {
        return None;
    }
    let total = wa + wb + wc;
    let t = match total == 0.0 {
        true => p[0][axis],
        false => (wa * p[0][axis] + wb * p[1][axis] + wc * p[2][axis]) / total,
    };
    // Counterclockwise as seen from the far end: the normal points along the line, which leaves.
    Some((t, if in_ab { -1 } else { 1 }))
}

impl<const D: usize> Hull<D> for Surface<D> {
    fn contains(&self, x: &[f64; D]) -> bool {
        match &self.octants {
            Some(octants) => octants.contains(x).unwrap_or_else(|| self.times(x) > 0),
            None => self.winds(x),
        }
    }

    fn nearest_on_surface(&self, x: &[f64; D]) -> [f64; D] {
        self.nearest_within(x, f64::INFINITY).unwrap_or(*x)
    }

    fn volume(&self) -> f64 {
        self.volume.value
    }

    fn nearest_within(&self, x: &[f64; D], reach: f64) -> Option<[f64; D]> {
        let away = |i: u32| match (i as usize) < self.own {
            true => distance(x, &closest_on_facet(&self.facets[i as usize], x)).powi(2),
            false => f64::INFINITY,
        };
        if let Some((outer, tree)) = &self.skin {
            let on = |i: u32| closest_on_facet(&outer[i as usize], x);
            return tree.nearest_below(x, reach * reach, |i| distance(x, &on(i)).powi(2)).map(on);
        }
        let nearest = self.tree.nearest_below(x, reach * reach, away)?;
        Some(closest_on_facet(&self.facets[nearest as usize], x))
    }

    fn doubt(&self) -> Option<String> {
        (self.capped > LARGE_HOLES).then(|| {
            format!(
                "holes of the surface were closed whose area is {:.0} % of the surface's: how the body goes on there is a guess (flat, to the middle of \
                 each rim); give the surface without holes if that is not meant",
                100.0 * self.capped
            )
        })
    }

    fn is_edge_within(&self, x: &[f64; D], reach: f64) -> bool {
        self.edges.as_ref().is_none_or(|edges| edges.is_within(x, reach))
    }

    fn chords(&self, axis: usize, x: &[f64; D]) -> Option<Vec<[f64; 2]>> {
        let crossings = self.crossings(axis, x);
        if !self.is_closed {
            return Some(self.loose_chords(axis, x, &crossings));
        }
        let (mut chords, mut times, mut begin) = (Vec::new(), 0, 0.0);
        for (t, step) in crossings {
            if times == 0 && step > 0 {
                begin = t;
            } else if times == 1 && step < 0 && t > begin {
                chords.push([begin, t]);
            }
            times += step;
        }
        Some(chords)
    }
}

#[cfg(test)]
mod tests;
