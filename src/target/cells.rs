//! Boxes of a target: their masses, and what they are divided into.

use super::lines;
use super::matter::{Matter, Within};
use sph::domain::Domain;

/// A box with the integral of n* over it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell<const D: usize> {
    pub lo: [f64; D],
    pub hi: [f64; D],
    pub mass: f64,
    /// The axis along which lines meet the surfaces that cross it, where that is known.
    pub across: Option<u8>,
    /// Whether it is a part of a line along that axis, with the area about it: its mass counts as even.
    pub is_pencil: bool,
    /// What is known of all of it, where it was asked for when its mass was found.
    pub(super) within: Option<Within>,
}

impl<const D: usize> Cell<D> {
    pub(super) fn new(lo: [f64; D], hi: [f64; D]) -> Self {
        Self { lo, hi, mass: 0.0, across: None, is_pencil: false, within: None }
    }

    /// The center, or, where a cell reaches across the surface of a ball or shell, a point near it inside.
    pub fn point_inside(&self, domain: &Domain<D>) -> [f64; D] {
        inside(self, domain).1
    }

    pub fn center(&self) -> [f64; D] {
        sph::array(|k| 0.5 * (self.lo[k] + self.hi[k]))
    }

    pub fn volume(&self) -> f64 {
        (0..D).map(|k| self.hi[k] - self.lo[k]).product()
    }

    pub(super) fn longest(&self) -> usize {
        let edge = |k: usize| self.hi[k] - self.lo[k];
        (0..D).fold(0, |best, k| if edge(k) > edge(best) { k } else { best })
    }

    /// The axis along which the target changes most between the middle and the faces, and between these where that is known (`hidden`) or the
    /// faces show no jump; the longest of those along which it changes as much.
    pub(super) fn roughest(&self, target: &dyn Matter<D>, hidden: Option<[f64; D]>) -> usize {
        let center = self.center();
        let density = |x: &[f64; D]| target.density_inside(x).unwrap_or(0.0);
        let here = density(&center);
        let change = |k: usize| {
            let off = (0.5 - HAIR) * (self.hi[k] - self.lo[k]);
            let side = |sign: f64| {
                let mut x = center;
                x[k] += sign * off;
                (density(&x) - here).abs()
            };
            side(1.0) + side(-1.0)
        };
        let mut changes: [f64; D] = sph::array(change);
        let faces = changes.iter().fold(0.0_f64, |m, c| m.max(*c));
        if target.is_piecewise() && (hidden.is_some() || !(faces > (JUMP - 1.0) * here)) {
            let hidden = hidden.unwrap_or_else(|| self.hidden_changes(target));
            (0..D).for_each(|k| changes[k] = changes[k].max(hidden[k]));
        }
        let most = changes.iter().fold(0.0_f64, |m, c| m.max(*c));
        if !(most > 0.0) {
            return self.longest();
        }
        let edge = |k: usize| if changes[k] > 0.5 * most { self.hi[k] - self.lo[k] } else { 0.0 };
        (0..D).fold(0, |best, k| if edge(k) > edge(best) { k } else { best })
    }

    /// Whether lines say where the mass between the surfaces is that cross it.
    pub fn is_crossed_by_lines(&self) -> bool {
        self.across.is_some() && !self.is_pencil
    }

    /// The center of its mass by Gauss's rule, or by lines where surfaces cross it; its own center where these find nothing.
    pub fn center_of_mass(&self, target: &dyn Matter<D>) -> [f64; D] {
        self.mass_and_center(target).1
    }

    /// The same, with its mass by them; what it has already where they find nothing.
    pub fn mass_and_center(&self, target: &dyn Matter<D>) -> (f64, [f64; D]) {
        let (mass, moment) = match self.across {
            Some(axis) => lines::moments(target, [&self.lo, &self.hi], axis.into(), self.lines()),
            None => gauss_moments(target, &self.lo, &self.hi, DIVISIONS),
        };
        if mass > 0.0 { (mass, sph::array(|k| moment[k] / mass)) } else { (self.mass, self.center()) }
    }

    /// Its mass as points of no more than `limit` on lines through it, where surfaces cross it and so few lines do; none elsewhere.
    pub fn points_on_lines(&self, target: &dyn Matter<D>, limit: f64) -> Option<Vec<([f64; D], f64)>> {
        let axis = usize::from(self.across?);
        let lines = LINES_PER_POINT * self.mass / limit;
        if lines > MOST_LINES {
            return None;
        }
        let lines = lines::for_each_axis::<D>(lines);
        let mut points = lines::points(target, [&self.lo, &self.hi], axis, (lines, limit));
        let found: f64 = points.iter().map(|point| point.1).sum();
        points.retain(|point| point.1 > 0.0);
        points.iter_mut().for_each(|point| point.1 *= self.mass / found);
        (!points.is_empty()).then_some(points)
    }

    /// Whether its mass is that of the density in its middle, to this part of it.
    pub fn is_even(&self, target: &dyn Matter<D>, part: f64) -> bool {
        let middle = target.density_inside(&self.center()).unwrap_or(0.0) * self.volume();
        (middle - self.mass).abs() <= part * self.mass
    }

    /// Halves across the longest edge, which share its mass as the densities in their middles are; none where both are zero.
    pub fn shared_halves(&self, target: &dyn Matter<D>) -> Option<[Self; 2]> {
        self.shared_along(self.longest(), target).0
    }

    /// The same along an axis, with what their mass would be by these densities.
    fn shared_along(&self, axis: usize, target: &dyn Matter<D>) -> (Option<[Self; 2]>, f64) {
        let mut halves = self.boxes_along(axis);
        let [left, right] = sph::array(|k| target.density_inside(&halves[k].center()).unwrap_or(0.0));
        let whole = left + right;
        halves[0].mass *= left / whole;
        halves[1].mass *= right / whole;
        ((whole > 0.0).then_some(halves), 0.5 * whole * self.volume())
    }

    /// Halves across the longest edge, with masses anew from the target.
    pub fn halves(&self, target: &dyn Matter<D>, rule: Rule) -> [Self; 2] {
        self.halves_along(self.longest(), target, rule)
    }

    /// Halves along an axis that, across a surface, share what they had: that is known better than the masses of halves.
    pub(super) fn halves_sharing(&self, axis: usize, target: &dyn Matter<D>, rule: Rule) -> [Self; 2] {
        if self.is_pencil {
            return self.boxes_along(axis).map(|half| Self { mass: 0.5 * self.mass, ..half });
        }
        let halves = self.halves_along(axis, target, rule);
        let both = halves[0].mass + halves[1].mass;
        if rule == Rule::Midpoint || !target.may_jump() || !(both > 0.0) {
            return halves;
        }
        halves.map(|half| Self { mass: self.mass / both * half.mass, ..half })
    }

    /// Halves along an axis, with masses anew from the target.
    pub(super) fn halves_along(&self, axis: usize, target: &dyn Matter<D>, rule: Rule) -> [Self; 2] {
        if rule == Rule::Shared && !self.may_end(target) {
            let (halves, mass) = self.shared_along(axis, target);
            if let Some(halves) = halves.filter(|_| (mass - self.mass).abs() <= TOLD * self.mass) {
                return halves;
            }
        }
        self.boxes_along(axis).map(|half| half.weighed(target, rule))
    }

    /// What lies before and behind a plane, without masses.
    pub(super) fn cut_at(&self, axis: usize, plane: f64) -> Vec<Self> {
        if !(plane > self.lo[axis] && plane < self.hi[axis]) {
            return vec![*self];
        }
        let (mut before, mut behind) = (*self, *self);
        before.hi[axis] = plane;
        behind.lo[axis] = plane;
        vec![before, behind]
    }

    /// Halves along an axis, with the mass of the whole.
    pub(super) fn boxes_along(&self, axis: usize) -> [Self; 2] {
        let middle = self.center()[axis];
        let (mut left, mut right) = (*self, *self);
        left.hi[axis] = middle;
        right.lo[axis] = middle;
        [left, right]
    }

    /// Whether the target may be discontinuous in it.
    fn may_end(&self, target: &dyn Matter<D>) -> bool {
        !target.is_smooth() || self.is_cut_by_region(target.domain())
    }

    /// Whether the curved surface of a domain may go through it.
    pub fn is_cut_by_region(&self, domain: &Domain<D>) -> bool {
        let diagonal = (0..D).map(|k| (self.hi[k] - self.lo[k]).powi(2)).sum::<f64>().sqrt();
        domain.region.is_surface_within(&self.center(), 0.5 * diagonal)
    }

    /// With its mass from the target.
    pub(super) fn weighed(mut self, target: &dyn Matter<D>, rule: Rule) -> Self {
        if let Some(mass) = target.mass_within(&self.lo, &self.hi) {
            return Self { mass, across: None, within: None, ..self };
        }
        (self.across, self.within) = (self.across.filter(|_| rule != Rule::Midpoint), None);
        if rule != Rule::Midpoint && target.may_jump() {
            self.within = target.within(&self.lo, &self.hi);
            self.across = self.axis_across(target);
        }
        self.mass = match (rule, self.across) {
            (Rule::Midpoint, _) => midpoint_mass(&self, target),
            (_, Some(axis)) => self.mass_by_lines(target, axis.into()),
            (_, None) => gauss_mass(target, &self.lo, &self.hi, DIVISIONS),
        };
        self
    }

    /// By as many lines as for the mass that it was thought to have, or by more, if it has more.
    fn mass_by_lines(&self, target: &dyn Matter<D>, axis: usize) -> f64 {
        let by = |lines: usize| lines::moments(target, [&self.lo, &self.hi], axis, lines).0;
        let lines = self.lines();
        let found = Self { mass: by(lines), ..*self };
        if found.lines() > lines { by(found.lines()) } else { found.mass }
    }

    /// The axis along which lines meet the surfaces that cross it: what they met in what it is a part of, as long as there may be any.
    fn axis_across(&self, target: &dyn Matter<D>) -> Option<u8> {
        if self.within.is_none_or(|within| within.is_continuous) {
            return None;
        }
        self.across.or_else(|| self.most_crossed(target).map(|axis| axis as u8))
    }

    /// The axis along which most surfaces lie between corners, or, where none does, lines meet the most; none if they meet none.
    fn most_crossed(&self, target: &dyn Matter<D>) -> Option<usize> {
        let parts: Vec<u64> = self.corners().map(|x| target.part(&x)).collect();
        let crossed: [usize; D] = sph::array(|k| (0..parts.len()).filter(|i| parts[*i] != parts[i ^ 1 << k]).count());
        // Of those that meet as many the longest: they are seen best along it.
        let order = |k: usize| (crossed[k], self.hi[k] - self.lo[k]);
        let best = (1..D).fold(0, |best, k| if order(k) > order(best) { k } else { best });
        if crossed[best] > 0 { Some(best) } else { lines::most_crossed(target, [&self.lo, &self.hi]) }
    }

    /// Lines across each axis by which its mass is known: well enough for that of a particle, with what it has or that of which it is a part.
    fn lines(&self) -> usize {
        let lines = LINES.iter().find(|(most, _)| self.mass <= *most).map_or(MANY_LINES, |(_, lines)| *lines);
        // In a plane they cost little.
        if D < 3 { 2 * lines } else { lines }
    }
}

impl<const D: usize> Cell<D> {
    /// Largest change of the density between the middle and places on the line through it along each axis: a thin layer may
    /// hide between the middle and the faces.
    pub(super) fn hidden_changes(&self, target: &dyn Matter<D>) -> [f64; D] {
        let center = self.center();
        let density = |x: &[f64; D]| target.density_inside(x).unwrap_or(0.0);
        let here = density(&center);
        let change = |axis: usize, i: usize| {
            let mut x = center;
            x[axis] = self.lo[axis] + (i as f64 + 0.5) / LOOKS as f64 * (self.hi[axis] - self.lo[axis]);
            (density(&x) - here).abs()
        };
        sph::array(|axis| (0..LOOKS).fold(0.0, |most: f64, i| most.max(change(axis, i))))
    }

    /// Its corners, a hair inside, so that one that cells share is judged by both sides of a discontinuity.
    pub(super) fn corners(&self) -> impl Iterator<Item = [f64; D]> + '_ {
        (0..1_usize << D).map(|corner| {
            sph::array(|k| {
                let (a, b) = (self.lo[k], self.hi[k]);
                let (near, far) = if corner >> k & 1 == 0 { (a, b) } else { (b, a) };
                near + HAIR * (far - near)
            })
        })
    }

    /// Whether densities in the middle and the corners differ as across a surface, where no line says more.
    pub(super) fn is_crossed(&self, target: &dyn Matter<D>) -> bool {
        if self.across.is_some() {
            return false;
        }
        let density = |x: &[f64; D]| target.density_inside(x).unwrap_or(0.0);
        let middle = density(&self.center());
        let (least, most) =
            self.corners().map(|x| density(&x)).fold((middle, middle), |(a, b), v| (a.min(v), b.max(v)));
        most > JUMP * least || (self.mass > 0.0) != (most > 0.0)
    }

    /// The sum of the masses of its parts by Gauss's rule, when it is halved so often along each axis.
    pub(super) fn mass_of_parts(&self, target: &dyn Matter<D>, halvings: u32) -> f64 {
        let parts = 1_usize << halvings;
        let edge = |k: usize, i: usize| self.lo[k] + (self.hi[k] - self.lo[k]) * i as f64 / parts as f64;
        let of = |part: usize| {
            let place = |k: usize| part >> (k as u32 * halvings) & (parts - 1);
            let (lo, hi) = (sph::array(|k| edge(k, place(k))), sph::array(|k| edge(k, place(k) + 1)));
            gauss_mass(target, &lo, &hi, DIVISIONS)
        };
        (0..1_usize << (D as u32 * halvings)).map(of).sum()
    }
}

/// Places along a line at which a layer is looked for.
const LOOKS: usize = 16;

/// How far inside of a cell its faces are looked at, in edges: a discontinuity at a face is on one side of it.
const HAIR: f64 = 1e-6;

/// How the mass of a cell is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// From its middle: enough for what relaxation evens out.
    Midpoint,
    /// By Gauss's rule of two points along each edge, finer where the target jumps or ends: for what is to be right.
    Gauss,
    /// The same, but where the densities in the middles of two halves say what their mass is together, they share it by these: for cells that
    /// are halved many times.
    Shared,
}

/// What part of a mass two densities may miss that it is shared by.
const TOLD: f64 = 0.01;

/// Divisions of a cell across which the target jumps.
const DIVISIONS: usize = 1;
/// Ratio of densities within a cell that is divided, and of those that do not jump: Gauss's rule has an exponential's mass to 1 % up to there.
const JUMP: f64 = 1.5;
const STEEP: f64 = 4.0;

fn gauss_mass<const D: usize>(target: &dyn Matter<D>, lo: &[f64; D], hi: &[f64; D], divisions: usize) -> f64 {
    gauss_moments(target, lo, hi, divisions).0
}

/// The mass of a box, and its sum of mass times place.
fn gauss_moments<const D: usize>(
    target: &dyn Matter<D>,
    lo: &[f64; D],
    hi: &[f64; D],
    divisions: usize,
) -> (f64, [f64; D]) {
    let node = 0.5 * (1.0 - 3_f64.sqrt().recip());
    let side = |corner: usize, k: usize| corner >> k & 1 == 0;
    let (mut least, mut most, mut sum, mut moment) = (f64::INFINITY, 0.0_f64, 0.0, [0.0; D]);
    for corner in 0..1_usize << D {
        let t = |k: usize| if side(corner, k) { node } else { 1.0 - node };
        let x: [f64; D] = sph::array(|k| lo[k] + t(k) * (hi[k] - lo[k]));
        let density = target.density_inside(&x).unwrap_or(0.0);
        (least, most, sum) = (least.min(density), most.max(density), sum + density);
        (0..D).for_each(|k| moment[k] += density * x[k]);
    }
    let ratio = if target.may_jump() { JUMP } else { STEEP };
    if divisions == 0 || most <= ratio * least {
        let weight = (0..D).map(|k| hi[k] - lo[k]).product::<f64>() / (1_usize << D) as f64;
        return (sum * weight, sph::array(|k| moment[k] * weight));
    }
    let (mut mass, mut moment) = (0.0, [0.0; D]);
    for corner in 0..1_usize << D {
        let middle = |k: usize| 0.5 * (lo[k] + hi[k]);
        let lo = sph::array(|k| if side(corner, k) { lo[k] } else { middle(k) });
        let hi = sph::array(|k| if side(corner, k) { middle(k) } else { hi[k] });
        let part = gauss_moments(target, &lo, &hi, divisions - 1);
        mass += part.0;
        (0..D).for_each(|k| moment[k] += part.1[k]);
    }
    (mass, moment)
}

/// Midpoint rule, with the part of the cell that lies inside a curved surface.
fn midpoint_mass<const D: usize>(cell: &Cell<D>, target: &dyn Matter<D>) -> f64 {
    let (fraction, point) = inside(cell, target.domain());
    if fraction > 0.0 { fraction * cell.volume() * target.number_density(&point) } else { 0.0 }
}

/// Fraction of the cell inside the region (first order in the distance to the surface of a ball or cylinder), and a
/// point inside at which to take its density.
fn inside<const D: usize>(cell: &Cell<D>, domain: &Domain<D>) -> (f64, [f64; D]) {
    let x = cell.center();
    let Some(round) = domain.region.round() else {
        return (f64::from(u8::from(domain.contains(&x))), x);
    };
    let (r, offset) = (round.distance(&x), round.offset(&x));
    let half: f64 = if r > 0.0 {
        (0..D).map(|k| 0.5 * (cell.hi[k] - cell.lo[k]) * (offset[k] / r).abs()).sum()
    } else {
        0.5 * (cell.hi[0] - cell.lo[0])
    };
    let part = |depth: f64| (0.5 + 0.5 * depth / half).clamp(0.0, 1.0);
    let fraction = part(round.radius - r) * if round.inner_radius > 0.0 { part(r - round.inner_radius) } else { 1.0 };
    let clamped = r.max(round.inner_radius * (1.0 + 1e-9)).min(round.radius * (1.0 - 1e-9));
    let point = if r > 0.0 { round.scaled(&x, clamped / r) } else { x };
    (fraction, point)
}

/// Lines across each axis for cells with so many particles, at most, and for all others.
const LINES: [(f64, usize); 2] = [(0.25, 2), (1.0, 4)];
const MANY_LINES: usize = 8;
/// Lines by which a cell is divided into points, for each of these and at most.
const LINES_PER_POINT: f64 = 2.0;
const MOST_LINES: f64 = 256.0;
