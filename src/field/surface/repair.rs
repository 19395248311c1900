//! Detects and repairs errors in a surface's facets: flipped facets, inverted bodies, holes and cracks.
//!
//! Facets that share a ridge (an edge in 3-D, a point in 2-D) with one other are turned alike. The ridges that are left over, each
//! with its direction, are the boundary of the whole, which has no boundary itself: they form closed rims, whatever the facets are.
//! The cone from the middle of a rim over its ridges closes it. The surface then is closed, and its winding numbers are whole.

use super::super::bvh::{Aabb, Bvh};
use super::super::skin::merge_points;
use super::winding::{Facet, Winding, area_vector, centroid, enclosed, length};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap, HashSet};

/// A surface after repair.
pub(crate) struct Repaired<const D: usize> {
    /// As given, but turned; without those that have no extent. Then the caps of holes.
    pub facets: Vec<Facet<D>>,
    /// What closes cracks. They enclose next to nothing and are no part of the surface.
    pub seams: Vec<Facet<D>>,
    /// Whether facets, caps and seams leave no ridge over.
    pub is_closed: bool,
    /// Area of the caps of holes over that of the facets.
    pub capped: f64,
    pub notes: Vec<String>,
}

/// Corners this near to each other, in diagonals of the whole, are one where the surface is not closed as it is: single precision
/// and six digits of text tell them apart.
const ONE_POINT: f64 = 2e-6;
/// Caps whose area is more than this part of the facets' are not holes of a surface: what it encloses is for the winding number
/// to say.
const MOST_CAPS: f64 = 0.5;
/// A cap whose facets cancel, so that the vector of its area is less than this part of its area, closes a crack.
const CRACK: f64 = 0.2;

/// Facets by the numbers of their corners.
struct Soup<const D: usize> {
    points: Vec<[f64; D]>,
    facets: Vec<[u32; D]>,
}

/// A ridge of a facet: the numbers of its corners in ascending order, and whether the facet goes along it that way.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Ridge {
    corners: [u32; 2],
    facet: u32,
    is_forward: bool,
}

pub(crate) fn repair<const D: usize>(points: Vec<[f64; D]>, facets: Vec<[u32; D]>) -> Repaired<D> {
    let mut notes = Vec::new();
    let given = facets.len();
    let exact = merge_points(&points);
    let mut soup = Soup { points, facets };
    let mut numbers = exact;
    if soup.rims(&soup.ridges(&numbers)).next().is_some() {
        numbers = merge_near(&soup.points, numbers);
    }
    let extended = |f: &[u32; D]| (0..D).all(|i| (0..i).all(|j| numbers[f[i] as usize] != numbers[f[j] as usize]));
    soup.facets.retain(extended);
    let flat = given - soup.facets.len();
    if flat > 0 {
        notes.push(format!("{flat} of the surface's {given} facets have no extent and were left aside"));
    }
    let extended = soup.facets.len();
    let mut known = HashSet::new();
    soup.facets.retain(|f| known.insert(from_least(f, &numbers)));
    let twice = extended - soup.facets.len();
    if twice > 0 {
        notes.push(format!("{twice} of the surface's {given} facets are there more than once, and count once"));
    }
    let turned = soup.turn(&soup.ridges(&numbers));
    if turned > 0 {
        notes.push(format!("{turned} of the surface's {given} facets were turned, so that all face outward"));
    }
    let mut facets = soup.corners();
    let ridges = soup.ridges(&numbers);
    let area: f64 = facets.iter().map(|f| length(&area_vector(f))).sum();
    let (caps, seams) = soup.caps(&ridges, &numbers);
    let capped: f64 = caps.iter().flatten().map(|f| length(&area_vector(f))).sum();
    if capped > MOST_CAPS * area {
        return Repaired { facets, seams: Vec::new(), is_closed: false, capped: 0.0, notes };
    }
    if !caps.is_empty() {
        let share = 100.0 * capped / area;
        notes.push(format!(
            "{} holes of the surface were closed from the middle of their rims; their area is {share:.2} % of the surface's",
            caps.len()
        ));
    }
    if !seams.is_empty() {
        notes.push(format!("{} cracks of the surface were closed", seams.len()));
    }
    facets.extend(caps.into_iter().flatten());
    let seams = seams.into_iter().flatten().collect();
    Repaired { facets, seams, is_closed: true, capped: capped / area, notes }
}

/// The corners of a facet from the least number on, in the same sense: the other side of it is another.
fn from_least<const D: usize>(facet: &[u32; D], numbers: &[u32]) -> [u32; D] {
    let mut corners = facet.map(|corner| numbers[corner as usize]);
    if D > 2 {
        let least = (0..D).min_by_key(|&k| corners[k]).unwrap_or(0);
        corners.rotate_left(least);
    }
    corners
}

/// Points within [`ONE_POINT`] of each other get one number.
fn merge_near<const D: usize>(points: &[[f64; D]], mut numbers: Vec<u32>) -> Vec<u32> {
    let width = ONE_POINT * Aabb::around(points).diagonal();
    if !(width > 0.0 && width.is_finite()) {
        return numbers;
    }
    let mut seen: HashMap<[i64; D], Vec<u32>> = HashMap::new();
    for i in 0..points.len() {
        if numbers[i] as usize != i {
            numbers[i] = numbers[numbers[i] as usize];
            continue;
        }
        let cell = points[i].map(|v| (v / width).floor() as i64);
        let apart = |j: u32| length(&std::array::from_fn::<_, D, _>(|k| points[j as usize][k] - points[i][k]));
        let near = (0..3_usize.pow(D as u32)).find_map(|code| {
            let beside = sph::array(|k| cell[k] + (code / 3_usize.pow(k as u32) % 3) as i64 - 1);
            seen.get(&beside)?.iter().copied().find(|&j| apart(j) <= width)
        });
        match near {
            Some(j) => numbers[i] = j,
            None => seen.entry(cell).or_default().push(i as u32),
        }
    }
    numbers
}

impl<const D: usize> Soup<D> {
    fn corners(&self) -> Vec<Facet<D>> {
        self.facets.iter().map(|f| f.map(|i| self.points[i as usize])).collect()
    }

    /// All ridges of all facets, sorted.
    fn ridges(&self, numbers: &[u32]) -> Vec<Ridge> {
        let of = |(facet, corners): (usize, &[u32; D])| {
            let corners = corners.map(|i| numbers[i as usize]);
            let facet = facet as u32;
            std::array::from_fn::<_, D, _>(|k| match D {
                2 => Ridge { corners: [corners[k], 0], facet, is_forward: k == 1 },
                _ => {
                    let (a, b) = (corners[k], corners[(k + 1) % D]);
                    Ridge { corners: [a.min(b), a.max(b)], facet, is_forward: a < b }
                }
            })
        };
        let mut ridges: Vec<Ridge> = self.facets.par_iter().enumerate().flat_map_iter(of).collect();
        ridges.par_sort_unstable();
        ridges
    }

    /// Ridges that are left over: how often, forward less backward.
    fn rims<'r>(&self, ridges: &'r [Ridge]) -> impl Iterator<Item = ([u32; 2], i32)> + 'r {
        ridges.chunk_by(|a, b| a.corners == b.corners).filter_map(|same| {
            let net: i32 = same.iter().map(|r| if r.is_forward { 1 } else { -1 }).sum();
            (net != 0).then_some((same[0].corners, net))
        })
    }

    /// Turns facets so that neighbors agree, the greater area of each part decides, and bodies that are inside out, unless they
    /// are hollows in others; returns how many.
    fn turn(&mut self, ridges: &[Ridge]) -> usize {
        let (parts, mut flips, is_bounded) = self.parts(ridges);
        let given = self.corners();
        let areas: Vec<f64> = given.iter().map(|f| length(&area_vector(f))).collect();
        let mut balance = vec![0.0; given.len()];
        (0..given.len()).for_each(|i| balance[parts[i]] += if flips[i] { -areas[i] } else { areas[i] });
        (0..given.len()).for_each(|i| flips[i] ^= balance[parts[i]] < 0.0);
        let mut facets = given;
        facets.iter_mut().zip(&flips).filter(|(_, flip)| **flip).for_each(|(f, _)| f.swap(0, 1));
        let center = Aabb::around(&self.points);
        let center = sph::array(|k| 0.5 * (center.lo[k] + center.hi[k]));
        if enclosed(&facets, &center) < 0.0 {
            facets.iter_mut().for_each(|f| f.swap(0, 1));
            flips.iter_mut().for_each(|f| *f = !*f);
        }
        let inverted = inverted(&facets, &parts, &is_bounded);
        (0..flips.len()).for_each(|i| flips[i] ^= inverted[parts[i]]);
        for (facet, _) in self.facets.iter_mut().zip(&flips).filter(|(_, flip)| **flip) {
            facet.swap(0, 1);
        }
        flips.iter().filter(|f| **f).count()
    }

    /// The part that each facet belongs to (the number of one of its facets), whether it is to be turned to agree with that
    /// one, and whether a part has ridges that are not those of two facets.
    fn parts(&self, ridges: &[Ridge]) -> (Vec<usize>, Vec<bool>, Vec<bool>) {
        let mut sets = Parity::new(self.facets.len());
        for same in ridges.chunk_by(|a, b| a.corners == b.corners) {
            if let [a, b] = same {
                sets.join(a.facet as usize, b.facet as usize, a.is_forward == b.is_forward);
            }
        }
        let found: Vec<(usize, bool)> = (0..self.facets.len()).map(|i| sets.find(i)).collect();
        let mut is_bounded = vec![false; self.facets.len()];
        for same in ridges.chunk_by(|a, b| a.corners == b.corners).filter(|same| same.len() != 2) {
            same.iter().for_each(|r| is_bounded[found[r.facet as usize].0] = true);
        }
        (found.iter().map(|f| f.0).collect(), found.iter().map(|f| f.1).collect(), is_bounded)
    }

    /// Cones over the rims: those that close holes, and those that close cracks.
    fn caps(&self, ridges: &[Ridge], numbers: &[u32]) -> (Vec<Vec<Facet<D>>>, Vec<Vec<Facet<D>>>) {
        let rims: Vec<([u32; 2], i32)> = self.rims(ridges).collect();
        if rims.is_empty() {
            return (Vec::new(), Vec::new());
        }
        // Rims that share a point are one; in 2-D the ends of a chain belong together.
        let mut sets = Parity::new(self.points.len());
        match D {
            2 => self.facets.iter().for_each(|f| {
                sets.join(numbers[f[0] as usize] as usize, numbers[f[1] as usize] as usize, false);
            }),
            _ => rims.iter().for_each(|(c, _)| sets.join(c[0] as usize, c[1] as usize, false)),
        }
        let mut groups: BTreeMap<usize, Vec<([u32; 2], i32)>> = BTreeMap::new();
        for rim in rims {
            groups.entry(sets.find(rim.0[0] as usize).0).or_default().push(rim);
        }
        let (mut caps, mut seams) = (Vec::new(), Vec::new());
        for rim in groups.values() {
            let cone = self.cone(rim);
            let total = cone.iter().map(area_vector).fold([0.0; D], |sum, n| sph::array(|k| sum[k] + n[k]));
            let area: f64 = cone.iter().map(|f| length(&area_vector(f))).sum();
            if length(&total) > CRACK * area { caps.push(cone) } else { seams.push(cone) }
        }
        (caps, seams)
    }

    fn cone(&self, rim: &[([u32; 2], i32)]) -> Vec<Facet<D>> {
        let corners = if D == 2 { 1 } else { 2 };
        let (mut middle, mut weight) = ([0.0; D], 0.0);
        let at = |i: u32| self.points[i as usize];
        for (ridge, _) in rim {
            let ends = &ridge[..corners];
            let long = if D == 2 {
                1.0
            } else {
                length(&std::array::from_fn::<_, D, _>(|k| at(ridge[1])[k] - at(ridge[0])[k]))
            };
            weight += long;
            (0..D).for_each(|k| middle[k] += long * ends.iter().map(|&i| at(i)[k]).sum::<f64>() / corners as f64);
        }
        if weight > 0.0 {
            middle = middle.map(|m| m / weight);
        }
        let mut cone = Vec::new();
        for (ridge, net) in rim {
            // Against the direction in which facets go along it.
            let facet: Facet<D> = std::array::from_fn(|k| match (D, k) {
                (2, 0) if *net > 0 => at(ridge[0]),
                (2, 1) if *net < 0 => at(ridge[0]),
                (2, _) | (_, 2) => middle,
                (_, 0) => at(ridge[usize::from(*net > 0)]),
                _ => at(ridge[usize::from(*net < 0)]),
            });
            cone.extend(std::iter::repeat_n(facet, net.unsigned_abs() as usize));
        }
        cone
    }
}

/// Which of the `parts` are closed bodies with normals that point inward, and no hollows in others.
fn inverted<const D: usize>(facets: &[Facet<D>], parts: &[usize], is_bounded: &[bool]) -> Vec<bool> {
    let (mut volumes, mut largest) = (vec![0.0; facets.len()], vec![(0.0, 0); facets.len()]);
    let mut origins: Vec<Option<[f64; D]>> = vec![None; facets.len()];
    for (i, facet) in facets.iter().enumerate() {
        let origin = origins[parts[i]].get_or_insert(facet[0]);
        let (n, c) = (area_vector(facet), centroid(facet));
        volumes[parts[i]] += (0..D).map(|k| n[k] * (c[k] - origin[k])).sum::<f64>();
        if length(&n) > largest[parts[i]].0 {
            largest[parts[i]] = (length(&n), i);
        }
    }
    let suspects: Vec<usize> = (0..facets.len()).filter(|&p| volumes[p] < 0.0 && !is_bounded[p]).collect();
    let mut inverted = vec![false; facets.len()];
    if suspects.is_empty() {
        return inverted;
    }
    let tree = Bvh::new((0..facets.len() as u32).collect(), &|i| Aabb::around(&facets[i as usize]));
    let winding = Winding::new(&tree, facets);
    for part in suspects {
        let facet = &facets[largest[part].1];
        let (n, c) = (area_vector(facet), centroid(facet));
        // Against the normal it is out of a hollow, and in what the hollow is in.
        let step = OFF * Aabb::around(facet).diagonal() / length(&n);
        let x = sph::array(|k| c[k] - step * n[k]);
        inverted[part] = winding.value(&tree, facets, &x) < 0.5;
    }
    inverted
}

/// Distance from a facet at which its surroundings are looked at, in its own size.
const OFF: f64 = 1e-4;

/// Disjoint sets whose members agree or disagree with each other.
struct Parity {
    parent: Vec<u32>,
    differs: Vec<bool>,
}

impl Parity {
    fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect(), differs: vec![false; count] }
    }

    /// The member that stands for the set of `i`, and whether `i` disagrees with it.
    fn find(&mut self, i: usize) -> (usize, bool) {
        let (mut root, mut differs) = (i, false);
        while self.parent[root] as usize != root {
            differs ^= self.differs[root];
            root = self.parent[root] as usize;
        }
        let (mut at, mut left) = (i, differs);
        while self.parent[at] as usize != root && at != root {
            let (next, own) = (self.parent[at] as usize, self.differs[at]);
            (self.parent[at], self.differs[at]) = (root as u32, left);
            left ^= own;
            at = next;
        }
        (root, differs)
    }

    /// What contradicts earlier statements is left aside: a surface of one side.
    fn join(&mut self, i: usize, j: usize, differ: bool) {
        let ((a, p), (b, q)) = (self.find(i), self.find(j));
        if a != b {
            let (low, high) = (a.min(b), a.max(b));
            self.parent[high] = low as u32;
            self.differs[high] = p ^ q ^ differ;
        }
    }
}
