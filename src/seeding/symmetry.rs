//! Detects the symmetry of a target by sampling, which decides how a uniform pattern can be mapped to it.

use super::name::Seeding;
use super::{kronecker, methods};
use crate::error::{Error, Result};
use crate::target::matter::Matter;
use crate::target::{Selected, Target};
use sph::domain::{Domain, Region, Round};
use sph::geometry::distance;
use sph::kernel::{KernelName, support_over_smoothing_length, support_over_spacing};
use sph::parallel;

/// Symmetry of a number density within its domain.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Symmetry<const D: usize> {
    /// The same everywhere.
    Uniform,
    /// A product of functions of one coordinate each, in a box; plane-parallel where all but one are constant.
    /// The functions are those along the lines through `through`.
    Separable { through: [f64; D] },
    /// A function of the distance from the center of a ball or shell.
    Radial { center: [f64; D], inner: f64, outer: f64 },
    /// In a cylinder, a product of a function of the distance from its axis and one of the coordinate along it. The
    /// functions are those at the height and the distance of `through`.
    Cylindrical { round: Round<D>, axis: usize, through: [f64; D] },
}

/// Points at which symmetry is tested.
const SAMPLES: usize = 4096;
/// Points about each region, and how many regions are looked at.
const SAMPLES_OF_REGION: usize = 256;
const MOST_REGIONS: usize = 64;
/// One of so many of them tells a share as well.
const COARSER: usize = 4;
/// What is next to nothing, in particles, and halvings of a way to an edge: what ends there is seen a thousandth of the way before it.
const LEAST_PARTICLES: f64 = 1e-3;
const HALVINGS: usize = 10;
/// A target is uniform if its samples agree to this fraction.
const UNIFORM: f64 = 1e-9;
/// Deviation from a symmetry, as a fraction of the value, that interpolation of data explains ...
const ALIKE: f64 = 1e-3;
/// ... beside this fraction of the largest value.
const NEGLIGIBLE: f64 = 1e-6;

/// Whether the domain is all of its bounding box; an interval in one dimension is.
pub(super) fn fills_box<const D: usize>(domain: &Domain<D>) -> bool {
    match &domain.region {
        Region::Box => true,
        Region::Ball { inner_radius, .. } => D == 1 && *inner_radius == 0.0,
        Region::Cylinder { .. } | Region::Hull(..) => false,
    }
}

/// Points spread evenly over the part of the domain between two corners (more finely where the domain fills little of it), so many at most.
fn spread<const D: usize>(domain: &Domain<D>, (lo, hi): ([f64; D], [f64; D]), most: usize) -> Vec<[f64; D]> {
    let generator = kronecker::generator::<D>();
    (0..32 * most)
        .map(|i| kronecker::point(&generator, i))
        .map(|u| sph::array(|k| lo[k] + u[k] * (hi[k] - lo[k])))
        .filter(|x| domain.contains(x))
        .take(most)
        .collect()
}

/// Points spread evenly over all of the domain.
fn samples<const D: usize>(domain: &Domain<D>) -> Vec<[f64; D]> {
    spread(domain, (domain.lo, domain.hi), SAMPLES)
}

/// Points spread evenly over the target, and some about each of its regions, which may be small.
fn samples_of<const D: usize>(target: &Target<'_, D>) -> Vec<[f64; D]> {
    let mut points = spread(target.domain, target.bounds(), SAMPLES);
    for region in target
        .regions()
        .into_iter()
        .flat_map(|regions| (0..regions.number().min(MOST_REGIONS)).map(|i| regions.extent(Selected::Region(i))))
    {
        points.extend(spread(target.domain, (region.lo, region.hi), SAMPLES_OF_REGION));
    }
    points
}

/// The symmetry of the target.
///
/// # Errors
/// A target that is not positive at any sample, or has none of the symmetries.
pub(super) fn detect<const D: usize>(target: &Target<'_, D>, method: &str) -> Result<Symmetry<D>> {
    let points = samples_of(target);
    let values: Vec<f64> = points.iter().map(|x| target.number_density(x)).collect();
    let (mut least, mut most, mut densest) = (f64::INFINITY, 0.0, None);
    for (x, &v) in points.iter().zip(&values) {
        least = least.min(v);
        if v > most {
            (most, densest) = (v, Some(*x));
        }
    }
    let Some(densest) = densest else {
        return Err(Error::Numeric {
            stage: "seed",
            problem: format!(
                "the target is zero at all {} samples of the domain, and '{method}' does not find where it is; use {}",
                points.len(),
                methods::for_any_target(method)
            ),
        });
    };
    if most - least <= UNIFORM * most {
        return Ok(Symmetry::Uniform);
    }
    let (symmetry, needed, expected) = if fills_box(target.domain) {
        let expected: Vec<f64> = points.iter().map(|x| product(target, &densest, x)).collect();
        (Symmetry::Separable { through: densest }, "a product of functions of one coordinate each", expected)
    } else if let Region::Ball { center, inner_radius, radius, .. } = &target.domain.region {
        let shell = Symmetry::Radial { center: *center, inner: *inner_radius, outer: *radius };
        let expected = points.iter().map(|x| spherical_mean(target, center, distance(center, x))).collect();
        (shell, "a function of the radius alone", expected)
    } else if let Some((round, axis)) = target.domain.region.round().and_then(|round| Some((round, round.axis?))) {
        let tube = Symmetry::Cylindrical { round, axis, through: densest };
        let (middle, height) = (round.distance(&densest), densest[axis]);
        let at = |r: f64, z: f64| ring_mean(target, &round, r, z);
        let expected = |x: &[f64; D]| at(round.distance(x), height) * at(middle, x[axis]) / at(middle, height);
        (
            tube,
            "a function of the distance from the axis times one of the height",
            points.iter().map(expected).collect(),
        )
    } else {
        return Err(refusal(
            method,
            "uniform, since the domain is an irregular region",
            (most - least) / most,
            &densest,
        ));
    };
    let mut worst = (0.0, 0.0, densest);
    for ((x, &value), &expected) in points.iter().zip(&values).zip(&expected) {
        let difference = (value - expected).abs();
        let excess = difference - ALIKE * value.max(expected) - NEGLIGIBLE * most;
        if excess > worst.0 {
            worst = (excess, difference / value.max(expected), *x);
        }
    }
    if worst.0 > 0.0 { Err(refusal(method, needed, worst.1, &worst.2)) } else { Ok(symmetry) }
}

/// The share of the domain, by samples, that is within a support radius of a discontinuity of the target, with
/// `neighbors` kernel neighbors.
pub fn discontinuity_share<const D: usize>(target: &Target<'_, D>, neighbors: f64) -> f64 {
    let ratio = support_over_spacing(D, neighbors);
    let samples: Vec<[f64; D]> = samples(target.domain).into_iter().step_by(COARSER).collect();
    let near = |i: usize| {
        let here = target.number_density(&samples[i]);
        let support = target.support(here, ratio);
        !is_next_to_nothing(target, here)
            && !(target.sharpness(&samples[i], here, support) < 1.0)
            && target.is_discontinuous_near(&samples[i], support)
    };
    parallel::count(samples.len(), near) as f64 / samples.len().max(1) as f64
}

/// Whether all of the domain would have less than a thousandth of a particle with this number density: where what falls off becomes less than numbers can
/// be is no edge.
fn is_next_to_nothing<const D: usize>(target: &Target<'_, D>, number_density: f64) -> bool {
    !(number_density * target.domain.volume() > LEAST_PARTICLES)
}

/// Whether the target has an edge on the way from `inside` it to `outside`, where it is nothing.
fn has_edge<const D: usize>(target: &Target<'_, D>, inside: [f64; D], outside: [f64; D]) -> bool {
    let (mut inside, mut outside) = (inside, outside);
    for _ in 0..HALVINGS {
        let middle = sph::array(|k| 0.5 * (inside[k] + outside[k]));
        if target.number_density(&middle) > 0.0 { inside = middle } else { outside = middle }
    }
    !is_next_to_nothing(target, target.number_density(&inside))
}

/// The share of the particles, by samples, about which smoothing by `kernel` with `neighbors` changes the number density by more than
/// `most` from what it does on average: where summed densities are the target's, so many are off the places of the mass by that. 0 where
/// the target has an edge within the domain.
pub fn shifted_share<const D: usize>(target: &Target<'_, D>, kernel: KernelName, neighbors: f64, most: f64) -> f64 {
    // A kernel as three points along each axis, which have its second and, if it were a Gaussian, its fourth moment.
    let step = 0.5 * 3.0_f64.sqrt() / support_over_smoothing_length(kernel, D) * support_over_spacing(D, neighbors);
    let samples = samples(target.domain);
    let change = |x: &[f64; D]| {
        let here = target.number_density(x);
        let away = step * target.support(here, 1.0);
        let beside = |k: usize, sign: f64| {
            let mut y = *x;
            y[k] += sign * away;
            target.domain.confine(x, &mut y);
            target.number_density(&y)
        };
        let change = |k: usize| (beside(k, 1.0) + beside(k, -1.0) - 2.0 * here) / (6.0 * here);
        (here, if is_next_to_nothing(target, here) { 0.0 } else { (0..D).map(change).sum() })
    };
    let changes: Vec<(f64, f64)> = parallel::map(samples.len(), |i| change(&samples[i]));
    let densest = (0..samples.len()).fold(0, |best, i| if changes[i].0 > changes[best].0 { i } else { best });
    let is_beyond = |i: usize| changes[i].0 <= 0.0 && has_edge(target, samples[densest], samples[i]);
    if parallel::count(samples.len(), is_beyond) > 0 {
        return 0.0;
    }
    let all: f64 = changes.iter().map(|(weight, _)| weight).sum();
    let mean = changes.iter().map(|(weight, change)| weight * change).sum::<f64>() / all;
    let shifted = changes.iter().filter(|(_, change)| (change - mean).abs() > most);
    let share = shifted.map(|(weight, _)| weight).sum::<f64>() / all;
    if share.is_finite() { share } else { 0.0 }
}

/// Whether the target is a function of the radius alone in a three-dimensional ball or shell, so that concentric
/// shells can have its density.
pub fn is_radial<const D: usize>(target: &Target<'_, D>) -> bool {
    D == 3 && matches!(target.domain.region, Region::Ball { .. }) && detect(target, "shells").is_ok()
}

/// Whether the target is the same everywhere.
pub fn is_uniform<const D: usize>(target: &Target<'_, D>) -> bool {
    matches!(detect(target, "cubic"), Ok(Symmetry::Uniform))
}

fn refusal<const D: usize>(method: &str, needed: &str, deviation: f64, x: &[f64; D]) -> Error {
    // Not all that map are seedings.
    let (key, remedy) = match Seeding::by_name(method) {
        Some(_) => ("seeding", format!("use {}", methods::for_any_target(method))),
        None => ("--scene", "place particles in it by `sph-prep --scene`, without a box to repeat".into()),
    };
    Error::scene(
        key,
        format!(
            "'{method}' places particles by mapping a uniform pattern, which needs a target that is {needed}; this one deviates by {:.3} % (at {x:?} in units of the domain's size); {remedy}",
            100.0 * deviation,
        ),
    )
}

/// n* at `x` if it were the product of what it is along the lines through `through`.
fn product<const D: usize>(target: &Target<'_, D>, through: &[f64; D], x: &[f64; D]) -> f64 {
    let middle = target.number_density(through);
    (0..D).fold(middle, |value, k| value * along(target, through, k, x[k]) / middle)
}

/// n* on the line through `through` along axis `k`.
pub(super) fn along<const D: usize>(target: &Target<'_, D>, through: &[f64; D], k: usize, x: f64) -> f64 {
    let mut at = *through;
    at[k] = x;
    target.number_density(&at)
}

/// n* at the distance `r` from a cylinder's axis and the coordinate `z` along it: the mean over a few directions.
pub(super) fn ring_mean<const D: usize>(target: &Target<'_, D>, round: &Round<D>, r: f64, z: f64) -> f64 {
    let across = (0..D).filter(|&k| round.axis != Some(k)).flat_map(|k| [(k, r), (k, -r)]);
    let values: Vec<f64> = across
        .map(|(k, offset)| {
            let mut x = round.center;
            round.axis.into_iter().for_each(|axis| x[axis] = z);
            x[k] += offset;
            target.number_density(&x)
        })
        .collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// n* at radius `r`: the mean over a few directions, which evens out what interpolation adds.
pub(super) fn spherical_mean<const D: usize>(target: &Target<'_, D>, center: &[f64; D], r: f64) -> f64 {
    let mut sum = 0.0;
    for k in 0..D {
        for sign in [-r, r] {
            let mut x = *center;
            x[k] += sign;
            sum += target.number_density(&x);
        }
    }
    sum / (2 * D) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use sph::domain::Axis;
    use sph::kernel::evaluate;
    use std::f64::consts::TAU;

    /// Against sums over the kernel itself, in an atmosphere between two walls that mirror.
    #[test]
    fn what_a_kernel_shifts_is_what_its_integral_does() {
        let (height, top) = (0.1, 0.6);
        let axes = [Axis::Periodic, Axis::Periodic, Axis::REFLECTING];
        let domain = Domain::new([0.0; 3], [1.0, 1.0, top], axes, Region::Box).unwrap();
        let field = AnalyticField::<3>::new("density", "exp(-z/0.1)", [0.0; 3]).unwrap();
        let mass = height * (1.0 - (-top / height).exp());
        let kernel = sph::kernel::WendlandC4;
        // Of the kernel, summed over planes.
        let plane = |u: f64| {
            let ring = |k: i32| {
                let q = u + (1.0 - u) * (f64::from(k) + 0.5) / 200.0;
                TAU * q * KernelName::WendlandC4.sigma(3) * evaluate::<_, 3>(kernel, q).0 * (1.0 - u) / 200.0
            };
            (0..200).map(ring).sum::<f64>()
        };
        let planes: Vec<f64> = (0..200).map(|k| plane((f64::from(k) + 0.5) / 200.0)).collect();
        for (count, most) in [(2000, 0.01), (20_000, 0.01), (20_000, 0.003)] {
            let density = |z: f64| (-z / height).exp();
            let mirrored = |z: f64| if z < 0.0 { -z } else { top - (z - top).abs() };
            let change = |z: f64| {
                let support = support_over_spacing(3, 64.0) * (density(z) * f64::from(count) / mass).cbrt().recip();
                let u = |k: usize| support * (k as f64 + 0.5) / 200.0;
                let pair = |k: usize| density(mirrored(z + u(k))) + density(mirrored(z - u(k)));
                (0..200).map(|k| planes[k] * pair(k) / 200.0).sum::<f64>() / density(z) - 1.0
            };
            let all: Vec<(f64, f64)> =
                (0..2000).map(|i| top * (f64::from(i) + 0.5) / 2000.0).map(|z| (density(z), change(z))).collect();
            let total: f64 = all.iter().map(|(w, _)| w).sum();
            let mean = all.iter().map(|(w, c)| w * c).sum::<f64>() / total;
            let expected = all.iter().filter(|(_, c)| (c - mean).abs() > most).map(|(w, _)| w).sum::<f64>() / total;
            let target = Target::of_equal_masses(&domain, &field, count as usize, mass);
            let found = shifted_share(&target, KernelName::WendlandC4, 64.0, most);
            assert!((found - expected).abs() < 0.1, "{count} {most}: {found} for {expected}");
        }
    }

    #[test]
    fn nothing_is_shifted_where_all_is_even_and_nothing_is_said_beside_vacuum() {
        fn shifted<const D: usize>(density: &str) -> f64 {
            let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
            let field = AnalyticField::<D>::new("density", density, [0.0; D]).unwrap();
            let mass = crate::field::total_mass(&field, &domain, 1e-6).unwrap().value;
            let target = Target::of_equal_masses(&domain, &field, 50_usize.pow(D as u32).min(1000), mass);
            shifted_share(&target, KernelName::CubicSpline, sph::kernel::default_kernel_neighbors(D), 1e-3)
        }
        assert_eq!((shifted::<1>("3"), shifted::<2>("3"), shifted::<3>("3")), (0.0, 0.0, 0.0));
        let wave = "exp(2*cos(2*pi*x))";
        assert!(shifted::<1>(wave) > 0.2 && shifted::<2>(wave) > 0.5 && shifted::<3>(wave) > 0.8);
        assert_eq!(shifted::<3>("max(sin(2*pi*x), 0)"), 0.0);
        // What becomes less than numbers can be has no edge.
        let tails = "exp(-((x - 0.5)/0.01)^2)";
        assert!(shifted::<1>(tails) > 0.2 && shifted::<2>(tails) > 0.5 && shifted::<3>(tails) > 0.8);
        assert_eq!(shifted::<2>("max(0.04 - (x - 0.5)^2, 0)^1.5"), 0.0);
    }
}
