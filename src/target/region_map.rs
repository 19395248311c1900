//! The arrangement of the pieces of a target: the cells in which they occur, which of them belong together, and the number of particles of each.

use super::cells::{Cell, Rule};
use super::locator::{Locator, beside, next, ways};
use super::matter::Matter;
use super::partition::partition;
use super::thin;
use crate::field::{ScalarField, piece_masses};
use crate::roots::bisect;
use sph::domain::Domain;
use sph::parallel;
use std::collections::{BTreeMap, BTreeSet};

/// The piece number of cells outside of the domain.
pub(super) const OUTSIDE: u64 = u64::MAX;
/// Change of ln n* across an interface from which on it separates regions.
const JUMP: f64 = 0.2;
/// Change of ln n* across an interface up to which the two sides are one body, where nothing else is said.
const APART: f64 = 2.0;
/// The same where some regions are bodies by themselves: nothing beyond a body's surface tells then what sums about jumps within it lack. A factor of 1.4.
const APART_BESIDE: f64 = 0.336;
/// A region that should have fewer particles has none.
pub(super) const LEAST_PARTICLES: f64 = 0.5;
/// Pairs of cells by which the change across an interface is judged.
pub(super) const PAIRS: usize = 1000;
/// Points along each edge of a cell that an interface divides.
const SAMPLES: usize = 4;
/// To which the masses of pieces are found.
const MASS_TOLERANCE: f64 = 1e-6;
/// Halvings that lead to an interface.
const HALVINGS: usize = 40;

/// Cells with the pieces at their middles, and once more those with some of a thin piece, for that piece.
pub(super) struct Map<'a, const D: usize> {
    pub(super) field: &'a dyn ScalarField<D>,
    pub(super) domain: &'a Domain<D>,
    pub(super) cells: Vec<Cell<D>>,
    pub(super) pieces: Vec<u64>,
    /// A place of the piece in each cell, where there is one.
    pub(super) places: Vec<[f64; D]>,
    /// The cells next to each; those of thin pieces are next to what else is there.
    beside: Vec<[[Option<u32>; 2]; D]>,
    /// Cells of thin pieces next to each other.
    links: Vec<(usize, usize)>,
    /// The cells before those of thin pieces.
    pub(super) real: usize,
    /// Cells and the thin pieces for which there are others.
    apart_from: BTreeSet<(usize, u64)>,
    /// Change of ln n* up to which two regions are one body.
    pub(super) apart: f64,
    /// The same in a target with regions that are.
    pub(super) apart_beside: f64,
    /// The integral over each piece, where these are known.
    masses: Option<Vec<(u64, f64)>>,
}

impl<'a, const D: usize> Map<'a, D> {
    /// Of `target`, whose density follows `field`, with the masses of its pieces, where they are known.
    pub(super) fn new(
        (field, known): (&'a dyn ScalarField<D>, Option<&[(u64, f64)]>),
        domain: &'a Domain<D>,
        target: &dyn Matter<D>,
        contrast: Option<f64>,
    ) -> Option<Self> {
        let cells = partition(target, Rule::Midpoint).ok()?;
        let places = parallel::map(cells.len(), |i| cells[i].point_inside(domain));
        let piece = |x: &[f64; D]| if domain.contains(x) { field.piece(x) } else { OUTSIDE };
        let pieces = parallel::map(cells.len(), |i| piece(&places[i]));
        let locator = Locator::new(domain, &cells);
        let beside = parallel::map(cells.len(), |i| beside(domain, &locator, &cells[i]));
        let real = cells.len();
        let found = || piece_masses(field, domain, MASS_TOLERANCE);
        let mut map = Self {
            field,
            domain,
            cells,
            pieces,
            places,
            beside,
            links: Vec::new(),
            real,
            apart_from: BTreeSet::new(),
            apart: contrast.map_or(APART, f64::ln),
            apart_beside: contrast.map_or(APART_BESIDE, f64::ln),
            masses: known.map(<[_]>::to_vec).or_else(|| Some(found()?.iter().map(|p| (p.0, p.1.value)).collect())),
        };
        map.look_for_thin_pieces(&locator, target);
        Some(map)
    }

    /// Adds a cell for each piece that is thinner than cells, wherever lines meet it, and what is next to what.
    fn look_for_thin_pieces(&mut self, locator: &Locator, target: &dyn Matter<D>) {
        let Some(masses) = &self.masses else { return };
        let mut within = BTreeMap::new();
        for i in (0..self.real).filter(|&i| self.neighbors(i).all(|j| self.pieces[j] == self.pieces[i])) {
            *within.entry(self.pieces[i]).or_default() += self.cells[i].volume() * self.field.value(&self.places[i]);
        }
        let least = LEAST_PARTICLES / target.count() as f64 * masses.iter().map(|m| m.1).sum::<f64>();
        let thin = thin::pieces(masses, &within, least);
        if thin.is_empty() {
            return;
        }
        let carriers = thin::carriers(target, &self.cells, &thin);
        let number: BTreeMap<(usize, u64), usize> =
            carriers.iter().enumerate().map(|(k, c)| ((c.cell, c.piece), self.real + k)).collect();
        for (k, carrier) in carriers.iter().enumerate() {
            let (own, cell) = (self.real + k, self.cells[carrier.cell]);
            if self.pieces[carrier.cell] == carrier.piece {
                self.links.push((own, carrier.cell));
            }
            for way in ways() {
                let beside = next(self.domain, locator, &cell, way);
                self.links.extend(beside.and_then(|j| number.get(&(j, carrier.piece))).map(|&other| (own, other)));
            }
        }
        for carrier in carriers {
            let place = u32::try_from(carrier.cell).ok();
            self.cells.push(Cell { mass: carrier.mass, ..self.cells[carrier.cell] });
            self.pieces.push(carrier.piece);
            self.places.push(carrier.place);
            self.beside.push(sph::array(|k| [place.filter(|_| k == 0), None]));
        }
        self.apart_from = number.into_keys().collect();
    }

    /// Where a cell is, as one place: in the piece, of a thin one.
    pub(super) fn center(&self, i: usize) -> [f64; D] {
        if i < self.real { self.cells[i].center() } else { self.places[i] }
    }

    pub(super) fn neighbors(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.beside[i].as_flattened().iter().flatten().map(|&j| j as usize)
    }

    /// Piece numbers with those between which the field is continuous taken together, in the order in which cells show
    /// them.
    pub(super) fn classes(&self) -> BTreeMap<u64, usize> {
        let mut numbers = BTreeMap::new();
        for piece in &self.pieces {
            let next = numbers.len();
            numbers.entry(*piece).or_insert(next);
        }
        let mut jumps: BTreeMap<(u64, u64), (usize, f64)> = BTreeMap::new();
        for i in 0..self.cells.len() {
            for j in self.neighbors(i).filter(|&j| self.pieces[j] != self.pieces[i]) {
                let (a, b) = (self.pieces[i], self.pieces[j]);
                let outside = if a == OUTSIDE || b == OUTSIDE { f64::INFINITY } else { 0.0 };
                let (pairs, jump) = jumps.entry((a.min(b), a.max(b))).or_insert((0, outside));
                if *pairs < PAIRS && outside == 0.0 {
                    *pairs += 1;
                    *jump = jump.max(self.jump(i, j));
                }
            }
        }
        let mut groups = Groups::new(numbers.len());
        let joined = jumps.iter().filter(|((a, b), (_, jump))| *jump < JUMP && !self.field.keeps_apart(*a, *b));
        joined.for_each(|((a, b), _)| groups.join(numbers[a], numbers[b]));
        let mut order = BTreeMap::new();
        let mut class = |group: usize| {
            let next = order.len();
            *order.entry(group).or_insert(next)
        };
        numbers.into_iter().map(|(piece, number)| (piece, class(groups.find(number)))).collect()
    }

    /// Change of ln n* across the interface on the way from one cell to another.
    pub(super) fn jump(&self, i: usize, j: usize) -> f64 {
        let (from, piece) = (self.center(i), self.pieces[i]);
        let way = self.domain.displacement(&from, &self.center(j));
        let at = |t: f64| self.domain.wrapped(&sph::array(|k| from[k] + t * way[k]));
        let [a, b] = bisect(|t| self.field.piece(&at(t)) == piece, [0.0, 1.0], HALVINGS);
        let (here, there) = (self.field.value(&at(a)), self.field.value(&at(b)));
        if here == there { 0.0 } else { (here / there).ln().abs() }
    }

    /// For each cell the first cell of its class that it is connected with.
    pub(super) fn components(&self, classes: &BTreeMap<u64, usize>) -> Vec<usize> {
        let class = parallel::map(self.cells.len(), |i| classes[&self.pieces[i]]);
        let mut groups = Groups::new(self.cells.len());
        for i in 0..self.cells.len() {
            self.neighbors(i).filter(|&j| class[j] == class[i]).for_each(|j| groups.join(i, j));
        }
        self.links.iter().for_each(|&(i, j)| groups.join(i, j));
        (0..self.cells.len()).map(|i| groups.find(i)).collect()
    }

    /// The share of the particles in each component.
    pub(super) fn shares(
        &self,
        classes: &BTreeMap<u64, usize>,
        components: &[usize],
        target: &dyn Matter<D>,
    ) -> BTreeMap<usize, f64> {
        let samples = parallel::map(self.cells.len(), |i| self.divided(i, classes, target));
        let mut shares: BTreeMap<usize, f64> = components.iter().map(|c| (*c, 0.0)).collect();
        let mut add = |component: usize, mass: f64| *shares.entry(component).or_default() += mass;
        for (i, parts) in samples.iter().enumerate() {
            let own = classes[&self.pieces[i]];
            for &(class, mass) in parts {
                // What no cell beside it shows, a corner, is not the cell's own: the masses of pieces have it.
                let same = || self.neighbors(i).find(|&j| classes[&self.pieces[j]] == class);
                if let Some(cell) = if class == own { Some(i) } else { same() } {
                    add(components[cell], mass);
                }
            }
        }
        self.correct(&mut shares, classes);
        let total: f64 = shares.values().sum();
        shares.values_mut().for_each(|s| *s /= total);
        shares
    }

    /// The mass in a cell by class: from its middle, or from samples where an interface divides it.
    fn divided(&self, i: usize, classes: &BTreeMap<u64, usize>, target: &dyn Matter<D>) -> Vec<(usize, f64)> {
        let cell = &self.cells[i];
        let own = classes[&self.pieces[i]];
        if i >= self.real {
            return vec![(own, cell.mass)];
        }
        // What it has of thin pieces is in cells of their own.
        let is_apart = |piece: u64| self.apart_from.contains(&(i, piece));
        let others = self.neighbors(i).any(|j| classes[&self.pieces[j]] != own);
        if !others {
            // Nor is it all that the cell has that of vacuum in its middle: what is smaller than it may be beside that.
            let is_own = !is_apart(self.pieces[i]) && target.number_density(&self.places[i]) > 0.0;
            return if is_own { vec![(own, cell.mass)] } else { Vec::new() };
        }
        let mut parts: Vec<(usize, f64)> = Vec::new();
        let number = SAMPLES.pow(D as u32);
        let weight = cell.volume() / number as f64;
        for s in 0..number {
            let t = |k: usize| ((s / SAMPLES.pow(k as u32) % SAMPLES) as f64 + 0.5) / SAMPLES as f64;
            let x: [f64; D] = sph::array(|k| cell.lo[k] + t(k) * (cell.hi[k] - cell.lo[k]));
            if !self.domain.contains(&x) {
                continue;
            }
            let piece = self.field.piece(&x);
            let Some(&class) = classes.get(&piece).filter(|_| !is_apart(piece)) else { continue };
            let mass = weight * target.number_density(&x);
            match parts.iter_mut().find(|p| p.0 == class) {
                Some(part) => part.1 += mass,
                None => parts.push((class, mass)),
            }
        }
        parts
    }

    /// Scales the masses of a class to what quadrature along its surfaces gives.
    fn correct(&self, shares: &mut BTreeMap<usize, f64>, classes: &BTreeMap<u64, usize>) {
        let Some(exact) = &self.masses else { return };
        let mut wanted: BTreeMap<usize, f64> = BTreeMap::new();
        for (piece, mass) in exact {
            if let Some(class) = classes.get(piece) {
                *wanted.entry(*class).or_default() += mass;
            }
        }
        let class_of = |component: usize| classes[&self.pieces[component]];
        let mut found: BTreeMap<usize, f64> = BTreeMap::new();
        shares.iter().for_each(|(component, share)| *found.entry(class_of(*component)).or_default() += share);
        for (component, share) in shares.iter_mut() {
            let class = class_of(*component);
            if let Some(mass) = wanted.get(&class).filter(|_| found[&class] > 0.0) {
                *share *= mass / found[&class];
            }
        }
    }
}

/// Disjoint sets.
pub(super) struct Groups(Vec<usize>);

impl Groups {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// The least member of the set that `i` is in.
    pub(super) fn find(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }
}
