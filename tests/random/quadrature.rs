//! The masses of a density's regions, and of both sides of planes, by a quadrature that knows nothing of the program's:
//! three Gauss points along each axis of boxes, the worst of which is halved again and again.

use super::density::Density;
use super::domain::Domain;
use super::draw::{Draw, Point};
use std::collections::{BTreeSet, BinaryHeap};

/// What is known of the mass.
pub struct Masses {
    d: usize,
    pub total: f64,
    /// Of `total`, what it is known to.
    pub error: f64,
    pub regions: Vec<f64>,
    cells: Vec<Cell>,
}

struct Cell {
    lo: Point,
    hi: Point,
    regions: Vec<f64>,
    /// Along which the density varies most.
    axis: usize,
    /// Where a jump or the domain's end goes through it, what that makes of its mass.
    jump: f64,
    error: f64,
}

impl Cell {
    fn mass(&self) -> f64 {
        self.regions.iter().sum()
    }
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cell {}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cell {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.error.total_cmp(&other.error)
    }
}

/// Gauss-Legendre on [0, 1].
const NODES: [f64; 3] = [0.112_701_665_379_258_3, 0.5, 0.887_298_334_620_741_7];
const WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
/// Halvings, at most: some hundred thousand points.
const HALVINGS: usize = 10_000;
/// Share of the mass to which it is enough to know it: a tenth of a particle of some thousand.
const ENOUGH: f64 = 2e-5;

/// Share of a box, cut in two by a face, that points miss: half of the distance of two of them.
const MISSED: f64 = 0.15;

/// Distance of the points in corners, of a box's edge.
const INSET: f64 = 1e-3;

/// A box with its masses.
fn cell(density: &Density, domain: &Domain, lo: Point, hi: Point) -> Cell {
    let d = density.d;
    let volume: f64 = (0..d).map(|k| hi[k] - lo[k]).product();
    let mut regions = vec![0.0; density.regions()];
    let mut slabs = [[0.0; 3]; 3];
    let (mut least, mut most, mut kinds) = (f64::INFINITY, 0.0_f64, BTreeSet::new());
    for index in 0..3_usize.pow(d as u32) {
        let place: [usize; 3] = std::array::from_fn(|k| if k < d { index / 3_usize.pow(k as u32) % 3 } else { 0 });
        let x = std::array::from_fn(|k| if k < d { lo[k] + NODES[place[k]] * (hi[k] - lo[k]) } else { 0.0 });
        let region = domain.contains(&x, 0.0).then(|| density.region(&x));
        let value = region.map_or(0.0, |region| density.matter(region).value(&x, d));
        (least, most) = (least.min(value), most.max(value));
        kinds.insert(region);
        let Some(region) = region else { continue };
        regions[region] += volume * (0..d).map(|k| WEIGHTS[place[k]]).product::<f64>() * value;
        (0..d).for_each(|k| slabs[k][place[k]] += value);
    }
    // Slivers next to a corner, where a curved face touches a plane one.
    for corner in 0..1_usize << d {
        let u = |k: usize| if corner >> k & 1 == 1 { 1.0 - INSET } else { INSET };
        let x = std::array::from_fn(|k| if k < d { lo[k] + u(k) * (hi[k] - lo[k]) } else { 0.0 });
        let region = domain.contains(&x, 0.0).then(|| density.region(&x));
        let value = region.map_or(0.0, |region| density.matter(region).value(&x, d));
        (least, most) = (least.min(value), most.max(value));
        kinds.insert(region);
    }
    let change = |k: usize| {
        let [a, b, c] = slabs[k];
        // Where nothing varies, the longest edge.
        (a - b).abs() + (b - c).abs() + 1e-3 * (a + b + c) * (hi[k] - lo[k]) / domain.edge(k)
    };
    let axis = (0..d).max_by(|&i, &j| change(i).total_cmp(&change(j))).unwrap_or(0);
    // Points next to a face that goes through are on one side of it or the other by chance.
    let jump = if kinds.len() > 1 { MISSED * volume * (most - least) } else { 0.0 };
    Cell { lo, hi, regions, axis, jump, error: 0.0 }
}

/// Points along each axis of a box with a jump.
const SCATTERED: [usize; 3] = [64, 10, 4];

/// A box with a jump anew, by a random point in each of its even parts: what a rule makes of boxes of the same kind adds up,
/// what these do wrong cancels. Returns the standard error.
fn scatter(density: &Density, domain: &Domain, c: &mut Cell, number: u64) -> f64 {
    let (d, m) = (density.d, SCATTERED[density.d - 1]);
    let draw = &mut Draw::new(number);
    let volume: f64 = (0..d).map(|k| c.hi[k] - c.lo[k]).product();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    let points = m.pow(d as u32);
    c.regions.iter_mut().for_each(|r| *r = 0.0);
    for index in 0..points {
        let mut at = |k: usize| ((index / m.pow(k as u32) % m) as f64 + draw.between(0.0, 1.0)) / m as f64;
        let x = std::array::from_fn(|k| if k < d { c.lo[k] + at(k) * (c.hi[k] - c.lo[k]) } else { 0.0 });
        let region = domain.contains(&x, 0.0).then(|| density.region(&x));
        let value = region.map_or(0.0, |region| density.matter(region).value(&x, d));
        (least, most) = (least.min(value), most.max(value));
        region.into_iter().for_each(|region| c.regions[region] += volume / points as f64 * value);
    }
    // Parts that a face goes through are on one side of it or the other.
    let cut = (m.pow(d as u32 - 1) as f64).sqrt();
    0.5 * cut * volume / points as f64 * (most - least)
}

/// The two halves of a box, each with half of what they change of it.
fn halves(density: &Density, domain: &Domain, whole: &Cell) -> [Cell; 2] {
    let k = whole.axis;
    let middle = 0.5 * (whole.lo[k] + whole.hi[k]);
    let (mut left, mut right) = (whole.hi, whole.lo);
    (left[k], right[k]) = (middle, middle);
    let mut parts = [cell(density, domain, whole.lo, left), cell(density, domain, right, whole.hi)];
    let change = |r: usize| (parts[0].regions[r] + parts[1].regions[r] - whole.regions[r]).abs();
    let error = 0.5 * (0..whole.regions.len()).map(change).sum::<f64>();
    for part in &mut parts {
        // Points next to a pole say little of what is nearer.
        let is_unknown = density.has_pole_within(&part.lo, &part.hi);
        part.error = error.max(part.jump).max(if is_unknown { part.mass() } else { 0.0 });
    }
    parts
}

/// Faces of the first boxes along an axis.
fn faces(density: &Density, domain: &Domain, axis: usize) -> Vec<f64> {
    let (lo, hi) = (domain.lo[axis], domain.hi[axis]);
    // Between the points of boxes so small no band of the scenes is lost.
    let even = [256, 64, 6][density.d - 1];
    let mut all: Vec<f64> = (0..=even).map(|i| lo + (hi - lo) * i as f64 / even as f64).collect();
    all.extend(density.faces(axis).into_iter().chain(domain.faces(axis)).filter(|v| (lo..hi).contains(v)));
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| *a - *b < 1e-9 * (hi - lo));
    all
}

impl Masses {
    pub fn new(density: &Density, domain: &Domain) -> Self {
        let d = density.d;
        let along: Vec<Vec<f64>> = (0..d).map(|k| faces(density, domain, k)).collect();
        let number: usize = along.iter().map(|f| f.len() - 1).product();
        let mut heap = BinaryHeap::new();
        for index in 0..number {
            let mut rest = index;
            let (mut lo, mut hi) = ([0.0; 3], [0.0; 3]);
            for k in 0..d {
                let i = rest % (along[k].len() - 1);
                rest /= along[k].len() - 1;
                (lo[k], hi[k]) = (along[k][i], along[k][i + 1]);
            }
            heap.extend(halves(density, domain, &cell(density, domain, lo, hi)));
        }
        let total = |heap: &BinaryHeap<Cell>| heap.iter().map(Cell::mass).sum::<f64>();
        for i in 0..HALVINGS {
            let Some(worst) = heap.pop() else { break };
            heap.extend(halves(density, domain, &worst));
            if i % 1024 == 0 && known(&heap) < ENOUGH * total(&heap) {
                break;
            }
        }
        let mut cells = heap.into_vec();
        let mut squares = 0.0;
        for (i, c) in cells.iter_mut().enumerate().filter(|(_, c)| c.jump > 0.0) {
            squares += scatter(density, domain, c, i as u64).powi(2);
        }
        let regions = (0..density.regions()).map(|r| cells.iter().map(|c| c.regions[r]).sum()).collect();
        let total = cells.iter().map(Cell::mass).sum();
        let error = cells.iter().filter(|c| c.jump == 0.0).map(|c| c.error).sum::<f64>() + 3.0 * squares.sqrt();
        Self { d, total, error, regions, cells }
    }

    /// A plane across `axis` with about this share of the mass below it.
    pub fn plane(&self, axis: usize, share: f64) -> f64 {
        let mut order: Vec<&Cell> = self.cells.iter().collect();
        order.sort_by(|a, b| (a.lo[axis] + a.hi[axis]).total_cmp(&(b.lo[axis] + b.hi[axis])));
        let mut below = 0.0;
        for c in order {
            below += c.mass();
            if below >= share * self.total {
                return 0.5 * (c.lo[axis] + c.hi[axis]);
            }
        }
        unreachable!("the shares add up to 1")
    }

    /// Share of the mass below a plane, and what it is known to.
    pub fn below(&self, axis: usize, plane: f64) -> (f64, f64) {
        let (mut below, mut squares) = (0.0, 0.0);
        for c in &self.cells {
            let share = ((plane - c.lo[axis]) / (c.hi[axis] - c.lo[axis])).clamp(0.0, 1.0);
            below += share * c.mass();
            if share > 0.0 && share < 1.0 {
                squares += c.mass().powi(2);
            }
        }
        (below / self.total, squares.sqrt() / self.total + self.error / self.total)
    }

    pub fn dimension(&self) -> usize {
        self.d
    }
}

/// Errors of boxes are of either sign.
fn known_of<'a>(cells: impl Iterator<Item = &'a Cell>) -> f64 {
    cells.map(|c| c.error.powi(2)).sum::<f64>().sqrt()
}

fn known(heap: &BinaryHeap<Cell>) -> f64 {
    known_of(heap.iter())
}
