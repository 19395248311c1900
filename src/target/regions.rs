//! Regions of a target, which discontinuities and vacuum separate.
//!
//! A field that knows its pieces ([`ScalarField::piece`]) is looked at in cells that are fine where it changes. Neighboring
//! cells of one piece belong together, and so do pieces between which the field is continuous. What is left apart are
//! regions, each with its share of the particles, which no stage may move to another. Neighbors whose densities do not
//! differ by much make a body: sums over particles reach across from one to the other.

use super::cells::Cell;
use super::components::Components;
use super::matter::Matter;
use super::region_map::{Groups, LEAST_PARTICLES, Map, OUTSIDE, PAIRS};
use crate::field::{Aabb, ScalarField};
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

/// Regions beyond this number are not told apart.
const MOST_REGIONS: usize = 4096;

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
        let map = Map::new((field, known), domain, target, contrast)?;
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
        let is_any_apart = jumps.values().any(|(_, jump)| *jump >= map.apart);
        let apart = if is_any_apart { map.apart_beside } else { map.apart };
        let (mut alike, unlike): (Vec<_>, Vec<_>) =
            jumps.into_iter().map(|(pair, (_, jump))| (pair, jump)).partition(|(_, jump)| *jump < apart);
        alike.sort_by(|x, y| x.1.total_cmp(&y.1).then(x.0.cmp(&y.0)));
        let mut groups = Groups::new(self.regions.len());
        for ((a, b), _) in alike {
            // Those that touch and differ by more stay apart, be there others between them in density.
            let ends = [groups.find(a), groups.find(b)];
            let is_between = |of: [usize; 2]| of == ends || of == [ends[1], ends[0]];
            if !unlike.iter().any(|((a, b), _)| is_between([groups.find(*a), groups.find(*b)])) {
                groups.join(a, b);
            }
        }
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

#[cfg(test)]
#[path = "regions_tests.rs"]
mod tests;
