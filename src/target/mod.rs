//! The target of placement: a number density over a domain, and the mass that each particle represents.
//!
//! Inside placement lengths are in units of the domain's size and the total mass is 1, so nothing depends on
//! the units of the input.

pub(crate) mod cells;
mod components;
mod contacts;
pub(crate) mod cut;
pub(crate) mod edges;
mod layers;
mod lines;
mod locator;
pub(crate) mod mass_points;
mod materials;
pub(crate) mod matter;
pub(crate) mod partition;
mod pencils;
pub(crate) mod refinement;
mod region_map;
mod regions;
pub(crate) mod sheets;
mod thin;

use crate::field::{Enclosure, Patch, ScalarField, Stretch, stretches};
pub use materials::{MaterialState, Materials};
use matter::{Matter, Within};
pub use regions::{LeftOut, Part, Region, Regions, Selected};
use sph::domain::Domain;
use sph::geometry::distance;
pub use sph::geometry::{Positions, at};
use sph::point_mass::PointMass;
use sph::{parallel, reduce};
use std::collections::BTreeMap;

/// A pressure and the acceleration that its force is to cancel, in internal units.
pub trait Equilibrium<const D: usize>: Sync {
    /// P*(x), never negative.
    fn pressure(&self, x: &[f64; D]) -> f64;
    /// g(x); `step` is the length over which a field may be differenced.
    fn gravity(&self, x: &[f64; D], step: f64) -> [f64; D];
    /// Whether g is anything but zero.
    fn has_gravity(&self) -> bool;
    /// The center of a body that its own gravity holds, about which all depends on the distance alone: g is then what the
    /// particles attract each other with, rather than [`Self::gravity`].
    fn own_center(&self) -> Option<[f64; D]> {
        None
    }
    /// A point mass at rest in that center, whose attraction comes on top of the particles' own.
    fn point_mass(&self) -> Option<PointMass<D>> {
        None
    }
    /// Adiabatic index: P = A rho^gamma, with A held by each particle.
    fn gamma(&self) -> f64;
    /// What the body is made of, in place of an ideal gas.
    fn materials(&self) -> Option<&Materials> {
        None
    }
    /// The material at a place with its density and energy; `None` for an ideal gas.
    fn material(&self, _x: &[f64; D]) -> Option<MaterialState> {
        None
    }
}

/// How the particles' number density follows from the input.
#[derive(Clone, Copy)]
pub enum Resolution<'a, const D: usize> {
    /// n* = rho* / m: equal masses.
    EqualMass,
    /// n* given up to a factor by a field of its own: masses vary as rho* / n*.
    NumberDensity(&'a dyn ScalarField<D>),
}

/// Target of a placement.
#[derive(Clone, Copy)]
pub struct Target<'a, const D: usize> {
    pub domain: &'a Domain<D>,
    pub density: &'a dyn ScalarField<D>,
    pub resolution: Resolution<'a, D>,
    /// Number of particles N.
    pub count: usize,
    /// Integral of the density over the domain.
    pub mass: f64,
    /// Integral of the resolution's number density over the domain, in its own scale (`mass` for equal masses).
    pub resolution_integral: f64,
    /// Spacings beyond this are not resolved by any neighborhood: supports grow no further.
    pub largest_spacing: f64,
    /// Integrals of the density over its pieces ([`ScalarField::piece`]), where they are known already.
    pub pieces: Option<&'a [(u64, f64)]>,
    /// Where particles are bound to regions.
    pub part: Option<Part<'a, D>>,
}

impl<'a, const D: usize> Target<'a, D> {
    /// Particles of equal mass: `count` of them, for a density whose integral over the domain is `mass`.
    pub fn of_equal_masses(domain: &'a Domain<D>, density: &'a dyn ScalarField<D>, count: usize, mass: f64) -> Self {
        Self {
            domain,
            density,
            resolution: Resolution::EqualMass,
            count,
            mass,
            resolution_integral: mass,
            largest_spacing: f64::INFINITY,
            pieces: None,
            part: None,
        }
    }

    /// What n* follows up to a factor.
    pub fn resolution_field(&self) -> &'a dyn ScalarField<D> {
        match self.resolution {
            Resolution::EqualMass => self.density,
            Resolution::NumberDensity(field) => field,
        }
    }

    /// Its regions; `None` where nothing separates it. Those whose densities differ by a factor of more than `contrast`, by
    /// default e^2, are bodies of their own.
    pub fn find_regions(&self, contrast: Option<f64>) -> Option<Regions<'a, D>> {
        let known = self.pieces.filter(|_| matches!(self.resolution, Resolution::EqualMass));
        Regions::new((self.resolution_field(), known), self.domain, self, contrast)
    }

    /// The same target with particles that stay in the regions in which they are.
    #[must_use]
    pub fn with_regions(&self, regions: Option<&'a Regions<'a, D>>) -> Self {
        Self { part: regions.map(|regions| Part { regions, of: Selected::All, is_one: false }), ..*self }
    }

    /// A part of the regions as a target of its own, for `count` particles; 0 elsewhere.
    #[must_use]
    pub fn selected(&self, regions: &'a Regions<'a, D>, of: Selected, count: usize) -> Self {
        let share = regions.extent(of).share;
        Self {
            count,
            mass: self.mass * share,
            resolution_integral: self.resolution_integral * share,
            part: Some(Part { regions, of, is_one: regions.selected(of).nth(1).is_none() }),
            ..*self
        }
    }

    /// The regions, where this is the target of all of them.
    pub fn regions(&self) -> Option<&'a Regions<'a, D>> {
        self.part.filter(|part| !part.is_cut()).map(|part| part.regions)
    }

    /// How the masses of its cells are found: with care where surfaces divide it.
    pub(crate) fn cell_rule(&self) -> cells::Rule {
        if self.part.is_some() { cells::Rule::Gauss } else { cells::Rule::Midpoint }
    }

    /// Whether a particle may go from one place to another as far as regions are concerned.
    pub fn keeps_region(&self, from: &[f64; D], to: &[f64; D]) -> bool {
        // A target of one region is zero elsewhere.
        self.part.filter(|part| !part.is_one).is_none_or(|part| part.regions.of(from) == part.regions.of(to))
    }

    /// n*(x), normalized to N particles in the domain; 0 where no particle belongs.
    pub fn number_density(&self, x: &[f64; D]) -> f64 {
        let value = match self.part {
            Some(part) => part.value(x),
            None => self.resolution_field().value(x),
        };
        value * (self.count as f64 / self.resolution_integral)
    }

    /// The same target for another number of particles.
    pub fn with_count(&self, count: usize) -> Self {
        Self { count, ..*self }
    }

    /// n*^(-1/d) where the target density is `number_density`, at most the largest spacing.
    pub fn spacing(&self, number_density: f64) -> f64 {
        spacing_of::<D>(number_density).min(self.largest_spacing)
    }

    /// The support radius H for `ratio` = H n*^(1/d) where the target density is `number_density`; a spacing counts as
    /// the domain's size at most.
    pub fn support(&self, number_density: f64, ratio: f64) -> f64 {
        ratio * self.spacing(number_density).min(self.domain.size())
    }

    /// Whether the spacing there follows the target, not the cap.
    pub fn spacing_follows(&self, number_density: f64) -> bool {
        self.largest_spacing == f64::INFINITY || spacing_of::<D>(number_density) < self.largest_spacing
    }

    /// grad ln n* as the field has it, else by forward differences over `step` (backward at the domain's edge); `here` is
    /// n* at `x`.
    pub fn log_slope(&self, x: &[f64; D], here: f64, step: f64) -> [f64; D] {
        if here > 0.0
            && let Some(slope) = self.resolution_field().log_slope(x)
        {
            return slope;
        }
        let rise = |way: &[f64; D], h: f64| {
            let mut y: [f64; D] = sph::array(|k| x[k] + h * way[k]);
            self.domain.wrap(&mut y);
            self.density_inside(&y).map(|density| (density - here) / (h * here))
        };
        let along = |way: &[f64; D]| {
            if here > 0.0 { rise(way, step).or_else(|| rise(way, -step)).unwrap_or(0.0) } else { 0.0 }
        };
        let Some(center) = self.center().filter(|_| D > 1) else {
            return sph::array(|k| along(&sph::array(|c| f64::from(u8::from(c == k)))));
        };
        let radius = distance(x, &center);
        // At the center itself there is no direction in which a smooth field would change.
        if !(radius > step) {
            return [0.0; D];
        }
        let outward: [f64; D] = sph::array(|k| (x[k] - center[k]) / radius);
        let slope = along(&outward);
        sph::array(|k| slope * outward[k])
    }

    /// The center of a radial n*, see [`ScalarField::center`].
    fn center(&self) -> Option<[f64; D]> {
        match &self.resolution {
            Resolution::EqualMass => self.density.center(),
            Resolution::NumberDensity(field) => field.center(),
        }
    }

    /// grad ln n* by central differences over `step` to either side, one-sided at the domain's edge.
    pub fn log_gradient(&self, x: &[f64; D], step: f64) -> [f64; D] {
        let here = self.number_density(x);
        sph::array(|k| self.log_derivative(x, here, &sph::array(|c| if c == k { 1.0 } else { 0.0 }), step))
    }

    /// The part of [`Self::log_gradient`] along the unit vector `way`; `here` is n* at `x`.
    fn log_derivative(&self, x: &[f64; D], here: f64, way: &[f64; D], step: f64) -> f64 {
        let value = |h: f64| {
            let mut y: [f64; D] = sph::array(|k| x[k] + h * way[k]);
            self.domain.wrap(&mut y);
            self.density_inside(&y).map_or((here, 0.0), |density| (density, h))
        };
        let (up, down) = (value(step), value(-step));
        let span = up.1 - down.1;
        if span > 0.0 && here > 0.0 { (up.0 - down.0) / (span * here) } else { 0.0 }
    }

    /// Whether a particle may be at `x`: in the domain and where the target is not zero.
    pub fn admits(&self, x: &[f64; D]) -> bool {
        self.domain.contains(x) && self.number_density(x) > 0.0
    }

    /// n* at every particle.
    pub fn number_densities(&self, positions: &Positions<D>) -> Vec<f64> {
        parallel::map(positions[0].len(), |i| self.number_density(&at(positions, i)))
    }

    /// rho* at every particle.
    pub fn densities(&self, positions: &Positions<D>) -> Vec<f64> {
        parallel::map(positions[0].len(), |i| self.density.value(&at(positions, i)))
    }

    /// Masses of some of the particles, where all have the same.
    pub fn equal_masses(&self, particles: usize) -> Vec<f64> {
        vec![self.mass / self.count as f64; particles]
    }

    /// Particle masses: equal, or rho*/n* scaled to the total. Their sum equals `mass` to rounding.
    pub fn masses(&self, positions: &Positions<D>) -> Vec<f64> {
        let n = positions[0].len();
        let mut masses = match &self.resolution {
            Resolution::EqualMass => vec![self.mass / n as f64; n],
            Resolution::NumberDensity(_) => parallel::map(n, |i| {
                let x = at(positions, i);
                self.density.value(&x) / self.number_density(&x)
            }),
        };
        let is_whole = self.part.is_none_or(|part| part.of == Selected::All);
        if let (Resolution::NumberDensity(_), Some(pieces), true) = (&self.resolution, self.pieces, is_whole) {
            self.hold_pieces(pieces, positions, &mut masses);
        }
        let total = reduce::sum(n, |i| masses[i]);
        let factor = self.mass / total;
        parallel::update(&mut masses, |_, m| *m *= factor);
        masses
    }

    /// Gives the particles in each piece of the density the mass that it holds. Their number follows from n*, which knows nothing of the
    /// density's jumps: layers of particles at a jump lie on this side or on that.
    fn hold_pieces(&self, pieces: &[(u64, f64)], positions: &Positions<D>, masses: &mut [f64]) {
        let of = parallel::map(masses.len(), |i| self.density.piece(&at(positions, i)));
        let mut found: BTreeMap<u64, (usize, f64)> = BTreeMap::new();
        for (piece, m) in of.iter().zip(masses.iter()) {
            let (count, mass) = found.entry(*piece).or_default();
            (*count, *mass) = (*count + 1, *mass + m);
        }
        let (held, all) = (found.values().map(|f| f.1).sum::<f64>(), pieces.iter().map(|p| p.1).sum::<f64>());
        let factors: BTreeMap<u64, f64> = pieces
            .iter()
            .filter_map(|(piece, mass)| {
                let (count, found) = *found.get(piece)?;
                let factor = mass / all * held / found;
                (count >= FEW && (1.0 / MOST_CHANGE..=MOST_CHANGE).contains(&factor)).then_some((*piece, factor))
            })
            .collect();
        parallel::update(masses, |i, m| *m *= factors.get(&of[i]).copied().unwrap_or(1.0));
    }

    /// Whether all particles have the same mass.
    pub fn has_equal_masses(&self) -> bool {
        matches!(self.resolution, Resolution::EqualMass)
    }
}

/// Particles in a piece from which on their masses are made up to what it holds, and by which factor at most.
const FEW: usize = 8;
const MOST_CHANGE: f64 = 1.5;
/// How well ends of parts along a line are placed, as a share of it: masses of cells are known to no more.
const PLACED: f64 = 1e-5;
/// Distance from the ends of a line at which its inside begins, as a share of it.
const INSET: f64 = 1e-11;

impl<const D: usize> Matter<D> for Target<'_, D> {
    fn domain(&self) -> &Domain<D> {
        self.domain
    }

    fn bounds(&self) -> ([f64; D], [f64; D]) {
        match self.part {
            Some(part) if part.is_cut() => {
                let Region { lo, hi, .. } = part.regions.extent(part.of);
                (lo, hi)
            }
            _ => (self.domain.lo, self.domain.hi),
        }
    }

    fn count(&self) -> usize {
        self.count
    }

    fn number_density(&self, x: &[f64; D]) -> f64 {
        self.number_density(x)
    }

    /// A part of the target is looked for no more: it is known where it is.
    fn is_piecewise(&self) -> bool {
        self.may_jump() && self.part.is_none()
    }

    fn may_jump(&self) -> bool {
        self.resolution_field().is_piecewise()
    }

    fn is_cut(&self) -> bool {
        self.part.is_some_and(|part| part.is_cut())
    }

    fn is_smooth(&self) -> bool {
        !self.may_jump() && !self.is_cut()
    }

    /// Of a part as well, which has no more than the field: where others are denser the bound is wide.
    fn within(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<Within> {
        let Enclosure { most, is_continuous, .. } = self.resolution_field().enclosure(&Patch::of_box(*lo, *hi))?;
        Some(Within { most: most * self.count as f64 / self.resolution_integral, is_continuous })
    }

    fn part(&self, x: &[f64; D]) -> u64 {
        self.resolution_field().trace(x).part
    }

    fn parts_along(&self, x: &[f64; D], axis: usize, [lo, hi]: [f64; 2]) -> Option<Vec<Stretch>> {
        let field = self.resolution_field();
        let place = |t: f64| sph::array(|k| if k == axis { t } else { x[k] });
        // A surface may lie in a face.
        let inset = INSET * (hi - lo);
        stretches(&|t| field.trace(&place(t)), [lo + inset, hi - inset], PLACED * (hi - lo))
    }

    fn mass_within(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<f64> {
        // Most fields know nothing of boxes, and say so at once.
        let part = self.part.filter(|part| part.is_cut());
        let has = |piece| part.is_none_or(|part| part.has_piece(piece));
        let integral = self.resolution_field().integral_of_box(lo, hi, &has)?;
        let (middle, reach) = (sph::array(|k| 0.5 * (lo[k] + hi[k])), 0.5 * distance(lo, hi));
        let is_inside = self.domain.contains(&middle) && !self.domain.region.is_surface_within(&middle, reach);
        let is_known = is_inside && part.is_none_or(|part| part.regions.are_pieces());
        is_known.then_some(integral * (self.count as f64 / self.resolution_integral))
    }

    /// Of regions; a part of them is bounded by itself.
    fn planes(&self, axis: usize) -> Vec<f64> {
        let Some(regions) = self.regions() else { return Vec::new() };
        let most = THIN * self.domain.extent()[axis];
        let extents = regions.each().iter().map(|r| (r.lo[axis], r.hi[axis]));
        let thin = extents.filter(|(lo, hi)| hi - lo < most);
        thin.take(MOST_THIN).flat_map(|(lo, hi)| [lo, hi]).collect()
    }

    /// None outside of the domain, or of the region that this is the target of.
    fn density_inside(&self, x: &[f64; D]) -> Option<f64> {
        let density = self.domain.contains(x).then(|| self.number_density(x))?;
        (density > 0.0 || !self.is_cut()).then_some(density)
    }
}

/// All that is within a distance of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings<const D: usize> {
    pub x: [f64; D],
    pub reach: f64,
}

impl<const D: usize> Surroundings<D> {
    /// Whether what is so far `away` belongs to them.
    pub fn holds(&self, away: &[f64; D]) -> bool {
        away.iter().map(|d| d * d).sum::<f64>() <= self.reach * self.reach
    }
}

/// Share of the domain's extent below which a region across an axis may be missed by places that are looked at, and how many such are
/// taken care of.
const THIN: f64 = 1.0 / 16.0;
const MOST_THIN: usize = 8;

/// n^(-1/d); roots are faster than powers.
fn spacing_of<const D: usize>(number_density: f64) -> f64 {
    match D {
        1 => 1.0 / number_density,
        2 => 1.0 / number_density.sqrt(),
        _ => inverse_cube_root(number_density),
    }
}

/// x^(-1/3) of a positive normal number to a few units in the last place, without a division: a third of the time that the
/// library's root takes, of which every evaluation needs one per particle.
#[inline]
fn inverse_cube_root(x: f64) -> f64 {
    if !(f64::MIN_POSITIVE..=f64::MAX).contains(&x) {
        return 1.0 / x.cbrt();
    }
    // A third of the exponent, and a mantissa that is right to 3.5 %; each step squares the error.
    let mut root = f64::from_bits(GUESS - x.to_bits() / 3);
    for _ in 0..4 {
        root *= (4.0 - x * root * root * root) * (1.0 / 3.0);
    }
    root
}

/// 4/3 of the bits of 1, less what makes the first guess of the inverse cube root least wrong.
const GUESS: u64 = 0x553e_f0ff_289d_d796;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_cube_roots_are_right_at_every_scale() {
        for i in -3070..3080 {
            let x = 1.234_567 * 10_f64.powf(0.1 * f64::from(i));
            let error = inverse_cube_root(x) * x.cbrt() - 1.0;
            assert!(error.abs() < 1e-15, "{x:e}: {error:e}");
        }
        assert_eq!(inverse_cube_root(0.0), f64::INFINITY);
        assert_eq!(inverse_cube_root(f64::INFINITY), 0.0);
        assert!((inverse_cube_root(5e-324) * 5e-324_f64.cbrt() - 1.0).abs() < 1e-15);
        assert!(inverse_cube_root(f64::NAN).is_nan());
    }
}
