//! Particles of another run as a field: about each particle a polynomial of second degree, fitted to the values around it; between particles their
//! mean with Shepard's weights (Renka 1988, ACM Trans. Math. Softw. 14, 139, doi 10.1145/45054.45055).
//!
//! The values of particles are noisy. How far around a particle the fit reaches is decided by the data: the
//! intervals in which fits of growing reach have the value at the particle must meet (Goldenshluger & Nemirovski 1997, Math. Methods
//! Stat. 6, 135; Katkovnik 1999, IEEE Trans. Signal Process. 47, 2567), so that it is long in a smooth region and short at a jump. Noise is what the
//! shortest fit leaves, in the median of a particle's surroundings.
//!
//! Scalars that are positive everywhere are fitted in their logarithm. Values never leave the range of those of the
//! particles. Fits do not reach from one material into another.

use super::categorical::{MAX_KINDS, kinds};
use super::cloud::{nearer, weigh};
use super::listed::{ALIKE, Listed};
use super::local_fit::{Design, MOST_TERMS, monomials, terms};
use super::local_mass::{self, Lumps};
use super::outer_layer::{self, Balance, Portion};
use super::outline::{Ends, Outline};
use super::sampled::Outside;
use super::series::{Place, Series, components};
use super::{CarriedField, CarriedInfo, Enclosure, Patch, ScalarField};
use crate::error::Result;
use serde::Serialize;
use sph::domain::{Axis, Domain};
use sph::geometry::distance;
use sph::parallel;
use sph_formats::Variable;
use std::ops::Range;
use std::sync::Arc;

/// Points of the shortest fit for each of its terms, and how often they are doubled.
const POINTS_PER_TERM: usize = 3;
const REACHES: usize = 4;
/// Half width of an interval in standard deviations.
const INTERVAL: f64 = 1.0;
/// Differences for a slope, in the distance of the farthest particle with a weight: half of the digits.
const SLOPE_STEP: f64 = 1e-7;
/// Changes of densities until the field has the particles' mass.
const PASSES: usize = 3;
/// Particles whose noise is taken for that of one.
const SURROUNDINGS: usize = 16;

/// What is known of values that particles are samples of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scatter {
    /// Standard deviation of the particles' values about the field, relative; the median over the particles.
    pub values: f64,
    /// What it leaves in the field.
    pub field: f64,
}

/// The particles with their polynomials.
struct Fitted<const D: usize> {
    particles: Arc<Listed<D>>,
    domain: Domain<D>,
    /// Where they end, where that is known of all of them together.
    ends: Option<Ends<D>>,
    /// The mean offset of the particles about each one that tell where the surface is; none where that is known of all of them together.
    list_middle: Vec<[f64; D]>,
    /// Unit of each particle's offsets.
    scales: Vec<f64>,
    /// Place of each particle's material among them; empty where there is but one.
    materials: Vec<usize>,
    /// Coefficients: a row for each particle.
    rows: Vec<f64>,
    width: usize,
}

/// The density, what else particles carry, and the scatter of the densities, where they are positive everywhere.
pub(crate) struct FromParticles<const D: usize> {
    pub(crate) density: Box<dyn ScalarField<D>>,
    pub(crate) carried: Vec<Box<dyn CarriedField<D>>>,
    pub(crate) scatter: Option<Scatter>,
    /// What the particles fill.
    pub(crate) domain: Domain<D>,
    /// How the mass of the densities and that of the particles go together.
    pub(crate) balance: Balance,
    /// The mean change of densities, by mass, with which mass stays where the particles have it; `None` where none is needed.
    pub(crate) moved: Option<f64>,
}

/// The fields of particles: of `density`, and of `others`, whose values must be finite. With the particles' `masses` the density has these
/// within what the particles fill.
///
/// # Errors
/// Those of a cloud: too many points, or points that span no volume.
pub(crate) fn from_particles<const D: usize>(
    density: &Variable,
    others: Vec<Variable>,
    (points, masses): (&[[f64; D]], Option<&[f64]>),
    domain: &Domain<D>,
) -> Result<FromParticles<D>> {
    let mut fitted = Fitted::at(&density.name, points, domain)?;
    let mut numbers = others;
    let named = numbers.iter().position(|v| kinds(v).is_some()).map(|i| numbers.remove(i));
    let materials = named.and_then(|v| Some((kinds(&v)?, v)));
    if let Some((kinds, variable)) = materials.as_ref().filter(|(kinds, _)| kinds.len() > 1) {
        let kind = |i: usize| kinds.iter().position(|k| *k == variable.values.get(i)).unwrap_or(0);
        fitted.materials = (0..points.len()).map(kind).collect();
    }
    let mut series: Vec<Series> = Vec::new();
    for variable in std::iter::once(density).chain(&numbers) {
        let first = series.last().map_or(0, |s| s.place.first + s.place.components * terms(D));
        let (stride, n) = (variable.components, variable.values.len() / variable.components);
        let components = if stride > 1 { D } else { 1 };
        let values = (0..n).flat_map(|i| (0..components).map(move |c| variable.values.get(i * stride + c))).collect();
        series.push(Series::new(values, components, first));
    }
    fitted.width = series.last().map_or(0, |s| s.place.first + s.place.components * terms(D));
    let noise = fitted.noise(&series);
    let columns = components(&series);
    let (balance, depths) = match masses {
        Some(masses) => fitted.balance(&series[0], (&noise, columns), masses)?,
        None => (Balance::Unknown, Vec::new()),
    };
    if let Balance::Kept(factors) = balance {
        series[0].change(|i| factors.log_at(depths[i]));
    }
    let moved = match (masses, &balance) {
        (Some(masses), Balance::Kept(_) | Balance::Unknown) => {
            fitted.keep_mass(&mut series[0], (&noise, columns), (masses, &depths))?
        }
        _ => None,
    };
    let left = fitted.fit(&series, (&noise, columns));
    let scatter = series[0].place.is_log.then(|| Scatter {
        values: median(noise.chunks(columns).map(|row| row[0].sqrt()).collect()),
        field: median(left),
    });
    let domain = fitted.ends.as_ref().map_or_else(|| Ok(domain.clone()), Ends::domain)?;
    let fitted = Arc::new(fitted);
    let mut places = series.into_iter().map(|s| s.place);
    let field = |place: Place, variable: &Variable| FittedField {
        fitted: Arc::clone(&fitted),
        info: CarriedInfo { name: variable.name.clone(), unit: variable.unit.clone(), components: place.components },
        place,
    };
    let density: Box<dyn ScalarField<D>> = match places.next() {
        Some(place) => Box::new(field(place, density)),
        None => return Err(crate::error::Error::field(&density.name, "has no values")),
    };
    let mut carried: Vec<Box<dyn CarriedField<D>>> = Vec::new();
    for (place, variable) in places.zip(&numbers) {
        carried.push(Box::new(field(place, variable)));
    }
    if let Some((kinds, variable)) = materials {
        let info = CarriedInfo { name: variable.name, unit: None, components: 1 };
        carried.push(Box::new(MaterialField { fitted, info, kinds }));
    }
    Ok(FromParticles { density, carried, scatter, domain, balance, moved })
}

impl<const D: usize> Fitted<D> {
    /// Particles of a mean, those by which the surface is found, and those of a list.
    const MEANT: usize = 2 * (D + 1);
    const ABOUT: usize = 3 * Self::MEANT;
    const LISTED: usize = 4 * Self::MEANT;

    /// Particles without values.
    fn at(name: &str, points: &[[f64; D]], domain: &Domain<D>) -> Result<Self> {
        let particles = Arc::new(Listed::new(name, points, domain, Self::LISTED)?);
        let middle = |i: usize| {
            let about = particles.list_of(i).get(..Self::ABOUT)?;
            let mut middle = [0.0; D];
            for &j in about {
                let offset = domain.displacement(&particles.points()[i], &particles.points()[j as usize]);
                (0..D).for_each(|k| middle[k] += offset[k] / Self::ABOUT as f64);
            }
            Some(middle)
        };
        let ends = Outline::of(name, &particles, domain)?;
        let alone = if ends.is_none() { points.len() } else { 0 };
        Ok(Self {
            ends,
            domain: domain.clone(),
            list_middle: parallel::map(alone, middle).into_iter().flatten().collect(),
            particles,
            scales: Vec::new(),
            materials: Vec::new(),
            rows: Vec::new(),
            width: 0,
        })
    }

    /// How the density of `series`, the first of all, and the particles' masses go together, and how many spacings each of them is from where
    /// they end; unknown where that is. The density alone is fitted for it.
    ///
    /// # Errors
    /// None, as there is a box about what they fill.
    fn balance(&mut self, series: &Series, noise: (&[f64], usize), masses: &[f64]) -> Result<(Balance, Vec<f64>)> {
        if self.ends.is_none() || !series.place.is_log {
            return Ok((Balance::Unknown, Vec::new()));
        }
        self.fit(std::slice::from_ref(series), noise);
        let Some(ends) = &self.ends else { return Ok((Balance::Unknown, Vec::new())) };
        let spacing = |i: usize| (masses[i] / series.at(i, 0).exp()).powf(1.0 / D as f64);
        let depths = parallel::map(self.particles.len(), |i| {
            ends.distance(self.point(i), outer_layer::DEEP * spacing(i)) / spacing(i)
        });
        let particles: Vec<Portion> =
            masses.iter().zip(&depths).map(|(&mass, &depth)| Portion { mass, depth }).collect();
        let field = outer_layer::portions(ends, masses.len(), |x| {
            let found = self.weights(x, Outside::Reject)?;
            let near = found.first()?.0;
            Some((self.blend(&series.place, 0, &found, x).exp(), spacing(near)))
        })?;
        Ok((Balance::new(&particles, &field), depths))
    }

    /// Changes densities until the field has the mass of particles that are well within what they fill where these have it, if it has it elsewhere; by how
    /// much on average. `depths` are those from where particles end; none where that is not known.
    ///
    /// # Errors
    /// None, as there is a box about what they fill.
    fn keep_mass(
        &mut self,
        series: &mut Series,
        noise: (&[f64], usize),
        (masses, depths): (&[f64], &[f64]),
    ) -> Result<Option<f64>> {
        let is_endless = self.domain.axes.iter().all(|axis| *axis == Axis::Periodic);
        // Of few neighbors, as there are in fewer dimensions, sums are too noisy to tell.
        if D < 3 || !series.place.is_log || depths.is_empty() && !is_endless {
            return Ok(None);
        }
        let n = self.particles.len();
        let within: Vec<f64> = (0..n).map(|i| depths.get(i).map_or(1.0, |depth| outer_layer::deep(*depth))).collect();
        let domain = self.ends.as_ref().map_or_else(|| Ok(self.domain.clone()), Ends::domain)?;
        let mut changed = vec![0.0; n];
        for _ in 0..PASSES {
            self.fit(std::slice::from_ref(series), noise);
            let found = |x: &[f64; D]| {
                let found = self.weights(x, Outside::Reject)?;
                Some((self.blend(&series.place, 0, &found, x).exp(), found.first()?.0))
            };
            let Some(lumps) = Lumps::new((&self.particles, &domain), found) else { break };
            let is_alike = |i: usize, j: usize| self.materials.is_empty() || self.materials[i] == self.materials[j];
            let lacking = lumps.lacking((&self.particles, &domain), masses, is_alike);
            if !lumps.are_of(masses) || !local_mass::is_elsewhere(&lacking, masses, &within) {
                break;
            }
            series.change(|i| within[i] * lacking[i]);
            (0..n).for_each(|i| changed[i] += within[i] * lacking[i]);
        }
        let total: f64 = masses.iter().sum();
        let mean = (0..n).map(|i| masses[i] * changed[i].abs()).sum::<f64>() / total;
        Ok((mean > 0.0).then_some(mean))
    }

    /// The particles of the mean at `x`, and their distances, ascending; `None` where `x` is outside and `outside` says so.
    fn meant(&self, x: &[f64; D], outside: Outside) -> Option<Vec<(usize, f64)>> {
        let is_within = |nearest: &(usize, f64)| !self.is_beyond(x, nearest.0);
        // It is looked for first: where there is nothing, nobody else need be.
        let near = match (&self.ends, outside) {
            (_, Outside::Clamp) => self.particles.near(x),
            (Some(ends), Outside::Reject) => ends.near(x, &self.particles)?,
            (None, Outside::Reject) => self.particles.held(x).filter(is_within)?,
        };
        let all = |most: f64| self.particles.nearest_about(x, Self::MEANT, most);
        Some(self.listed(x, near.0, near.1).unwrap_or_else(all))
    }

    /// Whether `x` is farther out than half a spacing beyond the particles about `near`, but for D - 1 that stand out. Within the particles there are
    /// always some on the far side.
    fn is_beyond(&self, x: &[f64; D], near: usize) -> bool {
        let Some(list) = self.particles.list_of(near).get(..Self::ABOUT) else { return false };
        let back = self.domain.displacement(x, self.point(near));
        let inward: [f64; D] = sph::array(|k| self.list_middle[near][k] + back[k]);
        let length = inward.iter().map(|v| v * v).sum::<f64>().sqrt();
        let height = |&i: &u32| {
            let offset = self.domain.displacement(x, self.point(i as usize));
            (0..D).map(|k| offset[k] * inward[k]).sum::<f64>() / length
        };
        let spacing = self.particles.distance(list[1] as usize, self.point(near));
        length > 0.0 && list.iter().filter(|i| height(i) <= 0.5 * spacing).nth(D - 1).is_none()
    }

    /// The particles of the mean from the list of `near`, which is so far from `x`: a search among all takes longer.
    ///
    /// # Errors
    /// How far they reach at most, where the list does not reach far enough to be sure.
    fn listed(&self, x: &[f64; D], near: usize, distance: f64) -> std::result::Result<Vec<(usize, f64)>, f64> {
        let mut found: Vec<(usize, f64)> = Vec::with_capacity(Self::MEANT + 1);
        for (i, span) in self.particles.spanned_list_of(near) {
            let next = (i, self.particles.distance(i, x));
            if let Some(last) = found.get(Self::MEANT - 1) {
                // Those that follow in the list are farther from its middle, so that `x` is no nearer to them either.
                if span >= last.1 + distance {
                    break;
                }
                if nearer(&next, last).is_ge() {
                    continue;
                }
                found.pop();
            }
            found.insert(found.partition_point(|f| nearer(f, &next).is_lt()), next);
        }
        let most = found.get(Self::MEANT - 1).map_or(f64::INFINITY, |last| last.1);
        if most + distance <= self.particles.reach(near) { Ok(found) } else { Err(most) }
    }

    fn point(&self, i: usize) -> &[f64; D] {
        &self.particles.points()[i]
    }

    /// Of the particles `nearest` to particle `i` the first `n` and one that says how far they reach: those of its material.
    fn around(&self, i: usize, nearest: &[(usize, f64)], n: usize) -> (Vec<usize>, f64) {
        let found = &nearest[..nearest.len().min(n + 1)];
        let is_own = |j: usize| self.materials.is_empty() || self.materials[j] == self.materials[i];
        (found.iter().map(|f| f.0).filter(|&j| is_own(j)).collect(), found.last().map_or(0.0, |f| f.1))
    }

    /// The equations of the fit about particle `i` to the `n` nearest ones of those that are `nearest`.
    fn design(&self, i: usize, nearest: &[(usize, f64)], n: usize) -> Option<(Vec<usize>, f64, Design)> {
        let (found, reach) = self.around(i, nearest, n);
        let offset = |&j: &usize| self.domain.displacement(self.point(i), self.point(j)).map(|d| d / reach);
        let offsets: Vec<[f64; D]> = found.iter().map(offset).collect();
        Some((found, reach, Design::new(&offsets)?)).filter(|_| reach > 0.0)
    }

    /// Variances of the values of each particle's surroundings: a row of all components for each particle.
    fn noise(&self, series: &[Series]) -> Vec<f64> {
        let columns = components(series);
        let mut own = vec![0.0; columns * self.particles.len()];
        parallel::update_rows(&mut own, columns, |i, out| {
            let n = POINTS_PER_TERM * terms(D);
            let Some((found, _, design)) = self.design(i, &self.particles.about(i, n + 1), n) else { return };
            let components = series.iter().flat_map(|s| (0..s.place.components).map(move |c| (s, c)));
            for (out, (series, c)) in out.iter_mut().zip(components) {
                *out = design.fit(|j| series.at(found[j], c)).variance.unwrap_or(0.0);
            }
        });
        let mut around = vec![0.0; own.len()];
        parallel::update_rows(&mut around, columns, |i, out| {
            let (found, _) = self.around(i, &self.particles.about(i, SURROUNDINGS + 1), SURROUNDINGS);
            for (c, out) in out.iter_mut().enumerate() {
                *out = median(found.iter().map(|&j| own[j * columns + c]).collect());
            }
        });
        around
    }

    /// Makes the polynomials; returns the standard deviation that is left in the first series at each particle.
    fn fit(&mut self, series: &[Series], (noise, columns): (&[f64], usize)) -> Vec<f64> {
        let found = parallel::map(self.particles.len(), |i| {
            let mut coefficients = vec![0.0; self.width];
            let (scale, left) = self.fit_one(i, series, &noise[i * columns..(i + 1) * columns], &mut coefficients);
            (coefficients, scale, left)
        });
        let left = found.iter().map(|f| f.2).collect();
        self.scales = found.iter().map(|f| f.1).collect();
        self.rows = Vec::with_capacity(self.width * found.len());
        found.into_iter().for_each(|f| self.rows.extend(f.0));
        left
    }

    /// The polynomials about particle `i`. Returns the unit of offsets, and what noise leaves in the first series.
    fn fit_one(&self, i: usize, series: &[Series], noise: &[f64], out: &mut [f64]) -> (f64, f64) {
        let mut tries: Vec<Try> = Vec::new();
        let mut first = 0;
        for s in series {
            tries.push(Try::new(s, i, &noise[first..first + s.place.components]));
            first += s.place.components;
        }
        let (mut scale, shortest) = (None, POINTS_PER_TERM * terms(D));
        let mut nearest = self.particles.about(i, shortest + 1);
        for reach in 0..REACHES {
            let n = shortest << reach;
            if reach > 0 && n >= self.particles.len() || tries.iter().all(|t| t.is_settled) {
                break;
            }
            if reach == 1 {
                nearest = self.particles.about(i, (shortest << (REACHES - 1)) + 1);
            }
            let Some((found, distance, design)) = self.design(i, &nearest, n) else { continue };
            let unit = *scale.get_or_insert(distance);
            for (t, s) in tries.iter_mut().zip(series).filter(|(t, _)| !t.is_settled) {
                t.offer::<D>(s, &found, &design, unit / distance);
            }
        }
        for (t, s) in tries.iter().zip(series) {
            for (c, coefficients) in t.coefficients.iter().enumerate() {
                let at = s.place.first + c * terms(D);
                out[at..at + terms(D)].copy_from_slice(&coefficients[..terms(D)]);
            }
        }
        (scale.unwrap_or(1.0), tries[0].left)
    }

    /// Particles about `x` of the material there, with weights that sum to 1.
    fn weights(&self, x: &[f64; D], outside: Outside) -> Option<Vec<(usize, f64)>> {
        let mut found = self.meant(x, outside)?;
        self.weigh(&mut found);
        Some(found)
    }

    /// Turns distances into weights of those of the material that weighs most.
    fn weigh(&self, found: &mut Vec<(usize, f64)>) {
        weigh(found, self.particles.len() <= Self::MEANT);
        let Some(material) = self.material(found) else { return };
        found.retain(|f| self.materials[f.0] == material);
        let sum: f64 = found.iter().map(|f| f.1).sum();
        found.iter_mut().for_each(|f| f.1 /= sum);
    }

    /// The slope of the scalar at `place` about `x`, as it is fitted, and its value, from one search of particles: a little
    /// farther on they are the same, but for those without weight.
    fn slope(&self, place: &Place, x: &[f64; D]) -> Option<(f64, [f64; D])> {
        let around = self.meant(x, Outside::Reject)?;
        let step = SLOPE_STEP * around.last()?.1;
        let value = |x: &[f64; D]| {
            let mut found: Vec<(usize, f64)> =
                around.iter().map(|&(i, _)| (i, self.particles.distance(i, x))).collect();
            found.sort_unstable_by(nearer);
            self.weigh(&mut found);
            self.blend(place, 0, &found, x)
        };
        let here = value(x);
        let along = |k: usize| {
            let mut y = *x;
            y[k] += step;
            (value(&y) - here) / step
        };
        Some((here, sph::array(along)))
    }

    /// That of the largest weight; `None` where there is but one.
    fn material(&self, found: &[(usize, f64)]) -> Option<usize> {
        let mut weights = [0.0; MAX_KINDS];
        for (i, w) in found {
            weights[*self.materials.get(*i)?] += w;
        }
        // Of equal weights the first.
        (0..MAX_KINDS).rev().max_by(|&a, &b| weights[a].total_cmp(&weights[b]))
    }

    /// Component `c` of the variable at `place` about `x`, as it is fitted.
    fn blend(&self, place: &Place, c: usize, found: &[(usize, f64)], x: &[f64; D]) -> f64 {
        let (mut sum, mut lo, mut hi) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
        for &(i, w) in found {
            let offset = self.domain.displacement(self.point(i), x).map(|d| d / self.scales[i]);
            let row = &self.rows[i * self.width + place.first + c * terms(D)..][..terms(D)];
            sum += w * row.iter().zip(monomials(&offset)).map(|(c, m)| c * m).sum::<f64>();
            (lo, hi) = (lo.min(row[0]), hi.max(row[0]));
        }
        // A polynomial is not trusted farther from the values around than they are from each other.
        let margin = 0.5 * (hi - lo);
        let (least, most) = place.ranges[c];
        sum.clamp((lo - margin).max(least), (hi + margin).min(most).max((lo - margin).max(least)))
    }
}

/// The best polynomials of a variable about one particle so far.
struct Try {
    coefficients: Vec<[f64; MOST_TERMS]>,
    /// Standard deviations of the components, and where their intervals meet.
    noise: Vec<f64>,
    intervals: Vec<Range<f64>>,
    /// Standard deviation that is left in the first component.
    left: f64,
    /// Whether longer fits are of no use.
    is_settled: bool,
    /// Whether no fit has been taken.
    is_raw: bool,
}

impl Try {
    /// The value of the particle itself.
    fn new(series: &Series, i: usize, variance: &[f64]) -> Self {
        let mut coefficients = vec![[0.0; MOST_TERMS]; series.place.components];
        let noise: Vec<f64> = variance.iter().map(|v| v.sqrt()).collect();
        let mut intervals = Vec::new();
        for (c, row) in coefficients.iter_mut().enumerate() {
            row[0] = series.at(i, c);
            intervals.push(row[0] - INTERVAL * noise[c]..row[0] + INTERVAL * noise[c]);
        }
        Self { left: noise[0], coefficients, noise, intervals, is_settled: false, is_raw: true }
    }

    /// Takes the fit of `design` if its intervals meet the earlier ones; `ratio` turns its offsets into those of the
    /// particle's unit.
    fn offer<const D: usize>(&mut self, series: &Series, found: &[usize], design: &Design, ratio: f64) {
        let of_degree = |t: usize| {
            if t == 0 {
                1.0
            } else if t <= D {
                ratio
            } else {
                ratio * ratio
            }
        };
        let fit = |c: usize| design.fit(|j| series.at(found[j], c)).coefficients;
        let scaled = |fit: [f64; MOST_TERMS]| sph::array(|t| fit[t] * of_degree(t));
        let fits: Vec<[f64; MOST_TERMS]> = (0..self.coefficients.len()).map(|c| scaled(fit(c))).collect();
        let left = design.variance.sqrt();
        let mut met = self.intervals.clone();
        for (c, interval) in met.iter_mut().enumerate() {
            let half = INTERVAL * self.noise[c] * left;
            interval.start = interval.start.max(fits[c][0] - half);
            interval.end = interval.end.min(fits[c][0] + half);
        }
        if met.iter().all(|m| m.start <= m.end) {
            (self.intervals, self.coefficients, self.is_raw) = (met, fits, false);
            self.left = self.noise[0] * left;
        } else {
            if self.is_raw {
                // Through the particle's own value, with the slopes of the fit.
                for (own, fit) in self.coefficients.iter_mut().zip(&fits) {
                    own[1..].copy_from_slice(&fit[1..]);
                }
            }
            self.is_settled = true;
        }
    }
}

/// A variable of the particles.
struct FittedField<const D: usize> {
    fitted: Arc<Fitted<D>>,
    info: CarriedInfo,
    place: Place,
}

impl<const D: usize> FittedField<D> {
    fn component(&self, c: usize, found: &[(usize, f64)], x: &[f64; D]) -> f64 {
        let value = self.fitted.blend(&self.place, c, found, x);
        if self.place.is_log { value.exp() } else { value }
    }
}

impl<const D: usize> ScalarField<D> for FittedField<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.fitted.weights(x, Outside::Reject).map_or(0.0, |found| self.component(0, &found, x).max(0.0))
    }

    fn enclosure(&self, patch: &Patch<D>) -> Option<Enclosure> {
        let middle = sph::array(|k| 0.5 * (patch.lo[k] + patch.hi[k]));
        let reach = 0.5 * distance(&patch.lo, &patch.hi);
        if self.fitted.particles.is_bare_within(&middle, reach) {
            return Some(Enclosure::new(0.0, 0.0, true));
        }
        let most = self.place.ranges[0].1;
        // Matter ends between the particles.
        Some(Enclosure::new(0.0, ALIKE * if self.place.is_log { most.exp() } else { most.max(0.0) }, false))
    }

    fn log_slope(&self, x: &[f64; D]) -> Option<[f64; D]> {
        let (value, slope) = self.fitted.slope(&self.place, x)?;
        Some(if self.place.is_log { slope } else { slope.map(|s| s / value) })
            .filter(|s| s.iter().all(|s| s.is_finite()))
    }
}

impl<const D: usize> CarriedField<D> for FittedField<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let Some(found) = self.fitted.weights(x, Outside::Clamp) else { return };
        for (c, out) in out.iter_mut().enumerate().take(self.place.components) {
            *out = self.component(c, &found, x);
        }
    }
}

/// The material of the particles around.
struct MaterialField<const D: usize> {
    fitted: Arc<Fitted<D>>,
    info: CarriedInfo,
    kinds: Vec<f64>,
}

impl<const D: usize> CarriedField<D> for MaterialField<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        let found = self.fitted.weights(x, Outside::Clamp).unwrap_or_default();
        let kind = found.first().and_then(|f| self.fitted.materials.get(f.0)).copied().unwrap_or(0);
        out[0] = self.kinds.get(kind).copied().unwrap_or(0.0);
    }
}

/// 0 of none.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    match values.is_empty() {
        true => 0.0,
        false => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

#[cfg(test)]
#[path = "fitted_tests.rs"]
mod tests;
