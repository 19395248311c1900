//! Regions of a target: what discontinuities and vacuum separate.
//!
//! A field that knows its pieces ([`ScalarField::piece`]) is looked at in cells that are fine where it changes. Neighboring
//! cells of one piece belong together, and so do pieces between which the field is continuous. What is left apart are
//! regions, each with its share of the particles, which no stage may move to another. Neighbors whose densities do not
//! differ by much make a body: sums over particles reach across from one to the other.

use super::cells::{Cell, Rule};
use super::components::Components;
use super::locator::{Locator, beside, next, ways};
use super::matter::Matter;
use super::partition::partition;
use super::thin;
use crate::field::{Aabb, ScalarField, piece_masses};
use sph::domain::Domain;
use sph::parallel;
use std::collections::{BTreeMap, BTreeSet};

/// Regions of a target, by number.
pub struct Regions<'a, const D: usize> {
    field: &'a dyn ScalarField<D>,
    domain: &'a Domain<D>,
    /// What each piece number belongs to.
    pieces: Vec<(u64, usize)>,
    classes: Vec<Class<D>>,
    regions: Vec<Region<D>>,
    /// The body of each region.
    bodies: Vec<usize>,
    left_out: Option<LeftOut>,
}

/// What has some of the density, and is worth so little of it that no particle is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Of the particles.
    pub share: f64,
    /// Of the domain's volume, about.
    pub volume: f64,
}

/// Regions that particles are bound to.
#[derive(Clone, Copy)]
pub struct Part<'a, const D: usize> {
    pub regions: &'a Regions<'a, D>,
    pub of: Selected,
    /// Whether that is a single one.
    pub is_one: bool,
}

/// Which of the regions a target has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selected {
    All,
    Region(usize),
    Body(usize),
}

impl<const D: usize> Part<'_, D> {
    /// Whether it is not all of the target.
    pub fn is_cut(&self) -> bool {
        self.of != Selected::All
    }

    /// The field at `x` where that is in the part; 0 elsewhere.
    pub fn value(&self, x: &[f64; D]) -> f64 {
        let (field, domain) = (self.regions.field, self.regions.domain);
        if self.of == Selected::All {
            return field.value(x);
        }
        let x = domain.wrapped(x);
        if !domain.contains(&x) {
            return 0.0;
        }
        let (value, piece) = field.value_and_piece(&x);
        if value > 0.0 && self.has(self.regions.of_piece(&x, piece)) { value } else { 0.0 }
    }

    /// Whether it is there at `x`.
    pub fn holds(&self, x: &[f64; D]) -> bool {
        self.of == Selected::All || self.has(self.regions.of(x))
    }

    /// Whether what lies in a piece is in the part, where [`Regions::are_pieces`].
    pub(super) fn has_piece(&self, piece: u64) -> bool {
        matches!(self.regions.class_of(piece), Class::One(region) if self.has(Some(*region)))
    }

    fn has(&self, region: Option<usize>) -> bool {
        match self.of {
            Selected::All => true,
            Selected::Region(one) => region == Some(one),
            Selected::Body(body) => region.is_some_and(|region| self.regions.body_of(region) == body),
        }
    }
}

/// A region: its share of the particles, and a box around it.
#[derive(Debug, Clone, Copy)]
pub struct Region<const D: usize> {
    pub share: f64,
    pub lo: [f64; D],
    pub hi: [f64; D],
}

/// Pieces between which the field is continuous.
enum Class<const D: usize> {
    /// None of the particles.
    Empty,
    One(usize),
    /// Apart from each other, from a region on.
    Several(usize, Box<Components<D>>),
}

/// The piece number of cells outside of the domain.
const OUTSIDE: u64 = u64::MAX;
/// Change of ln n* across an interface from which on it separates regions.
const JUMP: f64 = 0.2;
/// Change of ln n* across an interface up to which the two sides are one body, where nothing else is said.
const APART: f64 = 2.0;
/// A region that should have fewer particles has none.
const LEAST_PARTICLES: f64 = 0.5;
/// Regions beyond this number are not told apart.
const MOST_REGIONS: usize = 4096;
/// Pairs of cells by which the change across an interface is judged.
const PAIRS: usize = 1000;
/// Points along each edge of a cell that an interface divides.
const SAMPLES: usize = 4;
/// To which the masses of pieces are found.
const MASS_TOLERANCE: f64 = 1e-6;
/// Halvings that lead to an interface.
const HALVINGS: usize = 40;

impl<'a, const D: usize> Regions<'a, D> {
    /// The regions of `target`, whose density follows `field`, with the masses of its pieces, where they are known; `None` where nothing separates
    /// it, or too much. Those whose densities differ by less than the factor `contrast` are one body.
    pub(super) fn new(
        (field, known): (&'a dyn ScalarField<D>, Option<&[(u64, f64)]>),
        domain: &'a Domain<D>,
        target: &dyn Matter<D>,
        contrast: Option<f64>,
    ) -> Option<Self> {
        if !field.is_piecewise() {
            return None;
        }
        let cells = partition(target, Rule::Midpoint).ok()?;
        let places = parallel::map(cells.len(), |i| cells[i].point_inside(domain));
        let piece = |x: &[f64; D]| if domain.contains(x) { field.piece(x) } else { OUTSIDE };
        let pieces = parallel::map(cells.len(), |i| piece(&places[i]));
        let locator = Locator::new(domain, &cells);
        let beside = parallel::map(cells.len(), |i| beside(domain, &locator, &cells[i]));
        let apart = contrast.map_or(APART, f64::ln);
        let real = cells.len();
        let found = || piece_masses(field, domain, MASS_TOLERANCE);
        let masses = known.map(<[_]>::to_vec).or_else(|| Some(found()?.iter().map(|p| (p.0, p.1.value)).collect()));
        let mut map = Map {
            field,
            domain,
            cells,
            pieces,
            places,
            beside,
            links: Vec::new(),
            real,
            apart_from: BTreeSet::new(),
            apart,
            masses,
        };
        map.look_for_thin_pieces(&locator, target);
        let map = map;
        let of_piece = map.classes();
        let number = of_piece.values().max().map_or(0, |m| m + 1);
        if of_piece
            .iter()
            .filter(|(piece, _)| **piece != OUTSIDE)
            .map(|(_, class)| class)
            .collect::<BTreeSet<_>>()
            .len()
            < 2
        {
            return None;
        }
        let components = map.components(&of_piece);
        let shares = map.shares(&of_piece, &components, target);
        Self::assemble(map, of_piece, number, &components, &shares, target.count())
    }

    fn assemble(
        map: Map<'a, D>,
        pieces: BTreeMap<u64, usize>,
        number: usize,
        components: &[usize],
        shares: &BTreeMap<usize, f64>,
        count: usize,
    ) -> Option<Self> {
        let least = LEAST_PARTICLES / count as f64;
        let class_of = |i: usize| pieces[&map.pieces[i]];
        let (mut regions, mut classes) = (Vec::new(), Vec::new());
        let mut left_out = LeftOut { share: 0.0, volume: 0.0 };
        for class in 0..number {
            let parts: Vec<(usize, f64)> = shares
                .iter()
                .filter(|(component, _)| class_of(**component) == class)
                .map(|(component, share)| (*component, *share))
                .collect();
            let whole: f64 = parts.iter().map(|p| p.1).sum();
            let mut kept: Vec<usize> = parts.iter().filter(|p| p.1 >= least).map(|p| p.0).collect();
            if kept.is_empty() && whole >= least {
                kept.push(parts.iter().fold(parts[0], |best, p| if p.1 > best.1 { *p } else { best }).0);
            }
            if kept.is_empty() && whole > 0.0 {
                let own = (0..map.real).filter(|&i| class_of(i) == class).map(|i| map.cells[i].volume());
                left_out.share += whole;
                left_out.volume += (own.sum::<f64>() / map.domain.volume()).min(1.0);
            }
            let known: f64 = parts.iter().filter(|p| kept.contains(&p.0)).map(|p| p.1).sum();
            let first = regions.len();
            for component in &kept {
                let cells = (0..components.len()).filter(|&i| components[i] == *component).map(|i| &map.cells[i]);
                let (lo, hi) = bounds(cells);
                // What is too small to be a region of its own counts with those of its class.
                regions.push(Region { share: shares[component] * whole / known, lo, hi });
            }
            classes.push(match kept.len() {
                0 => Class::Empty,
                1 => Class::One(first),
                _ => {
                    let place = |i: usize| kept.iter().position(|k| *k == components[i]).map(|k| (i, k));
                    let members: Vec<(usize, usize)> = (0..components.len()).filter_map(place).collect();
                    let centers: Vec<[f64; D]> = members.iter().map(|m| map.center(m.0)).collect();
                    let parts = members.iter().map(|m| m.1).collect();
                    let boxes = regions[first..].iter().map(|r| Aabb { lo: r.lo, hi: r.hi }).collect();
                    Class::Several(first, Box::new(Components::new(&centers, parts, boxes)?))
                }
            });
        }
        let total: f64 = regions.iter().map(|r: &Region<D>| r.share).sum();
        regions.iter_mut().for_each(|r| r.share /= total);
        let fits = !regions.is_empty() && regions.len() <= MOST_REGIONS;
        let bodies = (0..regions.len()).collect();
        let mut all = fits.then_some(Self {
            field: map.field,
            domain: map.domain,
            pieces: pieces.into_iter().collect(),
            classes,
            regions,
            bodies,
            left_out: (left_out.share > 0.0).then_some(left_out),
        })?;
        all.bodies = all.joined(&map);
        Some(all)
    }

    /// The body of each region: those with an interface across which the density changes little are one.
    fn joined(&self, map: &Map<'a, D>) -> Vec<usize> {
        let of = parallel::map(map.cells.len(), |i| match map.pieces[i] {
            OUTSIDE => None,
            _ => self.of(&map.places[i]),
        });
        let mut jumps: BTreeMap<(usize, usize), (usize, f64)> = BTreeMap::new();
        for i in 0..map.cells.len() {
            for j in map.neighbors(i) {
                let (Some(a), Some(b)) = (of[i], of[j]) else { continue };
                let (pairs, jump) = jumps.entry((a.min(b), a.max(b))).or_insert((0, 0.0));
                if a != b && *pairs < PAIRS {
                    *pairs += 1;
                    *jump = jump.max(map.jump(i, j));
                }
            }
        }
        let mut groups = Groups::new(self.regions.len());
        jumps.iter().filter(|(_, (_, jump))| *jump < map.apart).for_each(|((a, b), _)| groups.join(*a, *b));
        let mut order = BTreeMap::new();
        (0..self.regions.len())
            .map(|region| {
                let next = order.len();
                *order.entry(groups.find(region)).or_insert(next)
            })
            .collect()
    }

    /// How many there are, one at least.
    pub fn number(&self) -> usize {
        self.regions.len()
    }

    pub fn get(&self, region: usize) -> &Region<D> {
        &self.regions[region]
    }

    /// What of the target no particle is placed in.
    pub fn left_out(&self) -> Option<LeftOut> {
        self.left_out
    }

    /// The body that a region belongs to.
    pub fn body_of(&self, region: usize) -> usize {
        self.bodies[region]
    }

    /// The numbers of the regions that are selected.
    pub fn selected(&self, of: Selected) -> impl Iterator<Item = usize> + '_ {
        (0..self.number()).filter(move |&region| match of {
            Selected::All => true,
            Selected::Region(one) => region == one,
            Selected::Body(body) => self.bodies[region] == body,
        })
    }

    /// The number of bodies.
    pub fn bodies(&self) -> usize {
        self.bodies.iter().max().map_or(0, |last| last + 1)
    }

    /// The box around what is selected, and its share of the particles.
    pub fn extent(&self, of: Selected) -> Region<D> {
        let all = Region { share: 0.0, lo: [f64::INFINITY; D], hi: [f64::NEG_INFINITY; D] };
        self.selected(of).map(|region| self.regions[region]).fold(all, |all, one| Region {
            share: all.share + one.share,
            lo: sph::array(|k| all.lo[k].min(one.lo[k])),
            hi: sph::array(|k| all.hi[k].max(one.hi[k])),
        })
    }

    /// All of them.
    pub fn each(&self) -> &[Region<D>] {
        &self.regions
    }

    /// The region that `x` is in; `None` where no particle belongs.
    pub fn of(&self, x: &[f64; D]) -> Option<usize> {
        let x = self.domain.wrapped(x);
        if !self.domain.contains(&x) {
            return None;
        }
        self.of_piece(&x, self.field.piece(&x))
    }

    /// Whether each piece lies in one region as a whole.
    pub(super) fn are_pieces(&self) -> bool {
        !self.classes.iter().any(|class| matches!(class, Class::Several(..)))
    }

    /// The same at a point of the domain that lies in `piece`.
    fn of_piece(&self, x: &[f64; D], piece: u64) -> Option<usize> {
        match self.class_of(piece) {
            Class::Empty => None,
            Class::One(region) => Some(*region),
            Class::Several(first, parts) => Some(first + parts.of(x)),
        }
    }

    fn class_of(&self, piece: u64) -> &Class<D> {
        let place = self.pieces.binary_search_by_key(&piece, |p| p.0);
        place.map_or(&Class::Empty, |place| &self.classes[self.pieces[place].1])
    }

    /// Whole particles for each region, `count` in all: shares rounded so that the largest remainders go up.
    pub fn counts(&self, count: usize) -> Vec<usize> {
        let wanted: Vec<f64> = self.regions.iter().map(|r| r.share * count as f64).collect();
        let mut counts: Vec<usize> = wanted.iter().map(|w| w.floor() as usize).collect();
        let mut order: Vec<usize> = (0..wanted.len()).collect();
        order.sort_by(|&a, &b| wanted[b].fract().total_cmp(&wanted[a].fract()).then(a.cmp(&b)));
        let left = count.saturating_sub(counts.iter().sum());
        order.iter().cycle().take(left).for_each(|&i| counts[i] += 1);
        counts
    }
}

fn bounds<'c, const D: usize>(cells: impl Iterator<Item = &'c Cell<D>>) -> ([f64; D], [f64; D]) {
    cells.fold(([f64::INFINITY; D], [f64::NEG_INFINITY; D]), |(lo, hi), cell| {
        (sph::array(|k| lo[k].min(cell.lo[k])), sph::array(|k| hi[k].max(cell.hi[k])))
    })
}

/// Cells with the pieces at their middles, and once more those with some of a thin piece, for that piece.
struct Map<'a, const D: usize> {
    field: &'a dyn ScalarField<D>,
    domain: &'a Domain<D>,
    cells: Vec<Cell<D>>,
    pieces: Vec<u64>,
    /// A place of the piece in each cell, where there is one.
    places: Vec<[f64; D]>,
    /// The cells next to each; those of thin pieces are next to what else is there.
    beside: Vec<[[Option<u32>; 2]; D]>,
    /// Cells of thin pieces next to each other.
    links: Vec<(usize, usize)>,
    /// The cells before those of thin pieces.
    real: usize,
    /// Cells and the thin pieces for which there are others.
    apart_from: BTreeSet<(usize, u64)>,
    /// Change of ln n* up to which two regions are one body.
    apart: f64,
    /// The integral over each piece, where these are known.
    masses: Option<Vec<(u64, f64)>>,
}

impl<const D: usize> Map<'_, D> {
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
    fn center(&self, i: usize) -> [f64; D] {
        if i < self.real { self.cells[i].center() } else { self.places[i] }
    }

    fn neighbors(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.beside[i].as_flattened().iter().flatten().map(|&j| j as usize)
    }

    /// Piece numbers with those between which the field is continuous taken together, in the order in which cells show
    /// them.
    fn classes(&self) -> BTreeMap<u64, usize> {
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
    fn jump(&self, i: usize, j: usize) -> f64 {
        let (from, piece) = (self.center(i), self.pieces[i]);
        let way = self.domain.displacement(&from, &self.center(j));
        let at = |t: f64| self.domain.wrapped(&sph::array(|k| from[k] + t * way[k]));
        let (mut a, mut b) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (a + b);
            if self.field.piece(&at(middle)) == piece { a = middle } else { b = middle }
        }
        let (here, there) = (self.field.value(&at(a)), self.field.value(&at(b)));
        if here == there { 0.0 } else { (here / there).ln().abs() }
    }

    /// For each cell the first cell of its class that it is connected with.
    fn components(&self, classes: &BTreeMap<u64, usize>) -> Vec<usize> {
        let class = parallel::map(self.cells.len(), |i| classes[&self.pieces[i]]);
        let mut groups = Groups::new(self.cells.len());
        for i in 0..self.cells.len() {
            self.neighbors(i).filter(|&j| class[j] == class[i]).for_each(|j| groups.join(i, j));
        }
        self.links.iter().for_each(|&(i, j)| groups.join(i, j));
        (0..self.cells.len()).map(|i| groups.find(i)).collect()
    }

    /// The share of the particles in each component.
    fn shares(
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
                let same = self.neighbors(i).find(|&j| classes[&self.pieces[j]] == class);
                add(components[if class == own { i } else { same.unwrap_or(i) }], mass);
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
            return if is_apart(self.pieces[i]) { Vec::new() } else { vec![(own, cell.mass)] };
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
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// The least member of the set that `i` is in.
    fn find(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
#[path = "regions_tests.rs"]
mod tests;
