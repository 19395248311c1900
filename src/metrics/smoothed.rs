//! The target as the kernel sees it: rho_s(x) = int W(|x - y|, H) rho*(y) d^d y.
//!
//! This is what the summed density of a perfect arrangement with this resolution would be: at surfaces, cusps, jumps and
//! thin layers it differs from the target however particles lie, and what the summed density deviates from it is the
//! arrangement's own fault. Beyond open faces there is vacuum; reflecting ones mirror the target.
//!
//! The integral is a product of rules for the distance and the direction, refined where two of them disagree. About a
//! radial target the rule for directions needs only the angle to the radius. Where rules do not agree, or agree on what they have
//! missed, the target's points of mass are summed in their place ([`crate::target::mass_points`]).

use super::ledger::Ledger;
use crate::field::quadrature::rule;
use crate::target::matter::Matter;
use crate::target::{Positions, Target, at};
use nalgebra::{DMatrix, SymmetricEigen};
use sph::domain::{Axis, Region, Wall};
use sph::geometry::distance;
use sph::kernel::{KernelName, evaluate, with_kernel};
use sph::neighbors::Groups;
use sph::parallel;
use std::f64::consts::{PI, TAU};

/// Disagreement of two rules, as a fraction, that is let pass.
const AGREEMENT: f64 = 1e-3;

/// Offsets in units of the support radius with weights that add up to 1.
type Rule<const D: usize> = Vec<([f64; D], f64)>;

/// Particles for which the smoothed target is looked for.
pub(crate) struct Looking<'a, const D: usize> {
    pub positions: &'a Positions<D>,
    pub support: &'a [f64],
    /// Which of them are close together, and the target's mass densities at all of them.
    pub together: Option<(&'a Groups, &'a [f64])>,
}

/// The target's mass density smoothed by `kernel` with the particles' support radii. About those in the `interior`
/// the target is smooth, so that two rules of few points tell enough; where a target of pieces hides a thin layer from rules,
/// `ledger` knows of it, and the particle is taken out of the interior.
pub(crate) fn smoothed_densities<const D: usize>(
    kernel: KernelName,
    (target, ledger): (&Target<'_, D>, Option<&Ledger<D>>),
    looking: &Looking<'_, D>,
    interior: &mut [bool],
) -> Vec<f64> {
    let Looking { positions, support, .. } = *looking;
    let center = radial_center(target);
    let ledger = ledger.filter(|ledger| center.is_none() && !ledger.has_too_many_points(target));
    let rules: Vec<Rule<D>> = match center {
        Some(_) => RADIAL_LEVELS.iter().map(|&(radii, angles)| about_an_axis(kernel, radii, angles)).collect(),
        // Points of mass are better than the last.
        None => (0..LEVELS - usize::from(ledger.is_some())).map(|level| in_all_directions(kernel, level)).collect(),
    };
    let found = by_rules(target, (&rules, center), looking, interior);
    let mut smoothed: Vec<f64> = found.iter().map(|f| f.0).collect();
    // Near an edge alone, rules that agree have missed nothing.
    let may_hide = target.resolution_field().is_piecewise() || target.density.is_piecewise();
    let inside = &*interior;
    let is_looked_at = |i: usize| {
        let is_sharp = |x: &[f64; D]| target.sharpness(x, target.number_density(x), support[i]) >= 1.0;
        may_hide || !inside[i] && (!found[i].1 || is_sharp(&at(positions, i)))
    };
    if let Some(ledger) = ledger {
        let wanted = |i: usize| target.density.value(&at(positions, i));
        let looked = parallel::map(support.len(), |i| if is_looked_at(i) { support[i] } else { 0.0 });
        if looked.iter().all(|h| *h == 0.0) {
            return smoothed;
        }
        let Some(points) = ledger.points(target) else { return smoothed };
        let sums = points.mass_densities(kernel, target.domain, (positions, &looked), target.mass);
        for i in (0..sums.len()).filter(|&i| looked[i] > 0.0 && sums[i] > 0.0) {
            let (by_rules, agreed) = found[i];
            if !agreed || (by_rules / sums[i] - 1.0).abs() > TRUST {
                smoothed[i] = sums[i];
            }
            interior[i] &= (by_rules / sums[i] - 1.0).abs() < HIDDEN;
            // A kernel may reach over a jump with its rim alone, and what is denser beyond counts all the same.
            interior[i] &= !may_hide || (sums[i] / wanted(i) - 1.0).abs() < BEYOND;
        }
    }
    smoothed
}

/// The smoothed density by rules, and whether two of them agree.
fn by_rules<const D: usize>(
    target: &Target<'_, D>,
    (rules, center): (&[Rule<D>], Option<[f64; D]>),
    looking: &Looking<'_, D>,
    interior: &[bool],
) -> Vec<(f64, bool)> {
    let Looking { positions, support, together } = *looking;
    let look = |x: &[f64; D], support: f64, first: usize| {
        let frame = center.map(|c| frame(x, &c));
        let by = |rule: &Rule<D>| -> f64 {
            let value = |(offset, weight): &([f64; D], f64)| {
                let u = frame.as_ref().map_or(*offset, |f| turned(f, offset));
                weight * continued(target, sph::array(|k| x[k] + support * u[k]))
            };
            rule.iter().map(value).sum()
        };
        let mut last = by(&rules[first]);
        for rule in &rules[first + 1..] {
            let next = by(rule);
            if (next - last).abs() <= AGREEMENT * next {
                return (next, true);
            }
            last = next;
        }
        (last, false)
    };
    let look_from = |i: usize| look(&at(positions, i), support[i], if interior[i] { 0 } else { WITH_CARE });
    // The interior is where the resolution's field is smooth, which is the density's own for equal masses alone.
    let are_alike = target.has_equal_masses() && target.is_smooth();
    let Some((groups, density)) = together.filter(|_| are_alike) else {
        return parallel::map(support.len(), look_from);
    };
    // From the middle of some, what the kernel changes, over H^2.
    let change = |members: &[u32]| {
        let (count, members) = (members.len() as f64, || members.iter().map(|&i| i as usize));
        if count < 2.0 || members().any(|i| !interior[i]) {
            return None;
        }
        let middle = sph::array(|k| members().map(|i| positions[k][i]).sum::<f64>() / count);
        let reach = members().map(|i| support[i]).sum::<f64>() / count;
        if members().any(|i| distance(&middle, &at(positions, i)) > reach) {
            return None;
        }
        let here = target.density.value(&middle);
        let (seen, agreed) = look(&middle, reach, 0);
        let change = seen / here - 1.0;
        (agreed && change.abs() <= SLIGHT).then_some(change / (reach * reach))
    };
    let changes = parallel::map(groups.len(), |group| change(groups.members(group)));
    let mut of_particles = vec![None; support.len()];
    for (group, change) in changes.into_iter().enumerate().filter(|(_, change)| change.is_some()) {
        groups.members(group).iter().for_each(|&i| of_particles[i as usize] = change);
    }
    parallel::map(support.len(), |i| match of_particles[i] {
        Some(change) => (density[i] * (1.0 + change * support[i] * support[i]), true),
        None => look_from(i),
    })
}

/// What the kernel may change, as a fraction, where particles that are near each other need but one look: they differ by a part of it.
const SLIGHT: f64 = 1e-3;

/// What points of mass and rules may differ by where rules agree among themselves; beyond it, rules have missed something.
const TRUST: f64 = 0.03;
/// What they may differ by where nothing is hidden from a look along some lines.
const HIDDEN: f64 = 0.1;
/// By how much the smoothed density of a place is off the target where no jump counts in its sum.
const BEYOND: f64 = 0.02;

/// The center of a target that is radial with its domain, in two dimensions or three.
fn radial_center<const D: usize>(target: &Target<'_, D>) -> Option<[f64; D]> {
    let center = target.density.center().filter(|_| D > 1)?;
    match &target.domain.region {
        Region::Ball { center: middle, .. } => {
            (distance(middle, &center) <= 1e-9 * target.domain.size()).then_some(center)
        }
        _ => None,
    }
}

/// rho* at `x`, through periodic faces and reflecting walls; 0 in vacuum.
fn continued<const D: usize>(target: &Target<'_, D>, mut x: [f64; D]) -> f64 {
    let domain = target.domain;
    domain.wrap(&mut x);
    for k in (0..D).filter(|&k| domain.has_faces(k)) {
        if let Axis::Walls { lo, hi } = domain.axes[k] {
            if x[k] < domain.lo[k] && lo == Wall::Reflecting {
                x[k] = 2.0 * domain.lo[k] - x[k];
            } else if x[k] > domain.hi[k] && hi == Wall::Reflecting {
                x[k] = 2.0 * domain.hi[k] - x[k];
            }
        }
    }
    if domain.region.wall() == Some(Wall::Reflecting)
        && !domain.region.contains(&x)
        && let Some(image) = domain.region.mirror(&x)
    {
        x = image;
    }
    if domain.contains(&x) { target.density.value(&x) } else { 0.0 }
}

/// Unit vectors outward from `center` at `x`, and across.
fn frame<const D: usize>(x: &[f64; D], center: &[f64; D]) -> [[f64; D]; 2] {
    let radius = distance(x, center);
    let axis = |k: usize| sph::array(|c| f64::from(u8::from(c == k)));
    if !(radius > 0.0) {
        return [axis(0), axis(1)];
    }
    let outward: [f64; D] = sph::array(|k| (x[k] - center[k]) / radius);
    // Across: the axis that is farthest from outward, less its part along it.
    let least = (0..D).fold(0, |best, k| if outward[k].abs() < outward[best].abs() { k } else { best });
    let across: [f64; D] = sph::array(|k| f64::from(u8::from(k == least)) - outward[least] * outward[k]);
    let length = across.iter().map(|v| v * v).sum::<f64>().sqrt();
    [outward, across.map(|v| v / length)]
}

fn turned<const D: usize>(frame: &[[f64; D]; 2], offset: &[f64; D]) -> [f64; D] {
    sph::array(|k| offset[0] * frame[0][k] + offset[1] * frame[1][k])
}

/// Distances with weights of the kernel's mass: the rule that is exact for the most powers of a distance if there are few,
/// else Gauss-Legendre in panels.
fn radii<const D: usize>(kernel: KernelName, count: usize) -> Vec<(f64, f64)> {
    if count <= FEW {
        return few_radii::<D>(kernel, count);
    }
    let order = count.min(16);
    let panels = count / order;
    let shape = |q: f64| with_kernel!(kernel, kernel => evaluate::<_, D>(kernel, q).0) * q.powi(D as i32 - 1);
    let node = |p: usize, (t, w): (f64, f64)| {
        let q = (p as f64 + t) / panels as f64;
        (q, w * shape(q))
    };
    let all: Vec<(f64, f64)> = (0..panels).flat_map(|p| rule(order).iter().map(move |&g| node(p, g))).collect();
    let total: f64 = all.iter().map(|a| a.1).sum();
    all.into_iter().map(|(q, w)| (q, w / total)).collect()
}

/// Radii of a rule made for the kernel, at most.
const FEW: usize = 4;

/// The Gauss rule for W(q) q^(d-1) (Golub and Welsch 1969), from the three-term recurrence by Stieltjes' sums over a fine rule.
fn few_radii<const D: usize>(kernel: KernelName, count: usize) -> Vec<(f64, f64)> {
    let fine = radii::<D>(kernel, FINE);
    let (mut now, mut before) = (vec![1.0; fine.len()], vec![0.0; fine.len()]);
    let (mut jacobi, mut norm, mut beta) = (DMatrix::zeros(count, count), 1.0, 0.0);
    for n in 0..count {
        let alpha = fine.iter().zip(&now).map(|((q, w), p)| w * q * p * p).sum::<f64>() / norm;
        jacobi[(n, n)] = alpha;
        let step = |i: usize| (fine[i].0 - alpha) * now[i] - beta * before[i];
        let next: Vec<f64> = (0..fine.len()).map(step).collect();
        let length: f64 = fine.iter().zip(&next).map(|((_, w), p)| w * p * p).sum();
        (before, now) = (now, next);
        (beta, norm) = (length / norm, length);
        if n + 1 < count {
            (jacobi[(n, n + 1)], jacobi[(n + 1, n)]) = (beta.sqrt(), beta.sqrt());
        }
    }
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(jacobi);
    (0..count).map(|k| (eigenvalues[k], eigenvectors[(0, k)].powi(2))).collect()
}

/// Radii of the rule from which those for few radii are made.
const FINE: usize = 64;

/// Numbers of radii and angles of the rules about a radial target.
const RADIAL_LEVELS: [(usize, usize); 7] = [(2, 3), (3, 5), (6, 8), (12, 16), (16, 32), (32, 64), (64, 128)];

/// Offsets (outward, across) for a target that does not change around the outward direction.
fn about_an_axis<const D: usize>(kernel: KernelName, count: usize, angles: usize) -> Rule<D> {
    let polar: Vec<(f64, f64, f64)> = match D {
        2 => (0..angles)
            .map(|a| (PI * (a as f64 + 0.5) / angles as f64).sin_cos())
            .map(|(sin, cos)| (cos, sin, 1.0 / angles as f64))
            .collect(),
        _ => {
            let order = angles.min(16);
            let panels = angles / order;
            let cosine = |p: usize, t: f64| 2.0 * (p as f64 + t) / panels as f64 - 1.0;
            let nodes =
                (0..panels).flat_map(|p| rule(order).iter().map(move |&(t, w)| (cosine(p, t), w / panels as f64)));
            nodes.map(|(mu, w)| (mu, (1.0 - mu * mu).max(0.0).sqrt(), w)).collect()
        }
    };
    let at = |q: f64, along: f64, across: f64| sph::array(|k| q * [along, across, 0.0][k]);
    let radii = radii::<D>(kernel, count);
    radii.iter().flat_map(|&(q, w)| polar.iter().map(move |&(a, b, v)| (at(q, a, b), w * v))).collect()
}

/// The first rule whose points lie close enough together to find something thin.
const WITH_CARE: usize = 2;

/// Rules without symmetry.
const LEVELS: usize = 5;

fn in_all_directions<const D: usize>(kernel: KernelName, level: usize) -> Rule<D> {
    let directions: Vec<([f64; 3], f64)> = match D {
        1 => vec![([1.0, 0.0, 0.0], 0.5), ([-1.0, 0.0, 0.0], 0.5)],
        2 => {
            let count: u32 = [5, 8, 12, 24, 64][level];
            let unit = |a: u32| (TAU * (f64::from(a) + 0.5) / f64::from(count)).sin_cos();
            (0..count).map(unit).map(|(s, c)| ([c, s, 0.0], 1.0 / f64::from(count))).collect()
        }
        _ => match level {
            0 => lebedev(&[1.0 / 6.0, 0.0, 0.0]),
            1 | 2 => lebedev(&[1.0 / 15.0, 0.0, 3.0 / 40.0]),
            3 => lebedev(&[1.0 / 21.0, 4.0 / 105.0, 9.0 / 280.0]),
            _ => product_of_angles(8, 16),
        },
    };
    let count = if D == 1 { [2, 3, 8, 16, 128][level] } else { [2, 3, 6, 8, 8][level] };
    let at = |q: f64, u: &[f64; 3]| sph::array(|k| q * u[k]);
    let radii = radii::<D>(kernel, count);
    radii.iter().flat_map(|&(q, w)| directions.iter().map(move |(u, v)| (at(q, u), w * v))).collect()
}

/// Lebedev's rules of degree 3, 5 and 7 (1976): weights of the directions to the faces, edges and corners of a cube.
fn lebedev(weights: &[f64; 3]) -> Vec<([f64; 3], f64)> {
    let digit = |code: usize, k: u32| (code / 3_usize.pow(k) % 3) as f64 - 1.0;
    let steps = (0..27).map(|code| [digit(code, 0), digit(code, 1), digit(code, 2)]);
    let weighed = steps.filter_map(|step| {
        let size: f64 = step.iter().map(|s| s * s).sum();
        let weight = *weights.get((size as usize).checked_sub(1)?)?;
        (weight > 0.0).then(|| (step.map(|s| s / size.sqrt()), weight))
    });
    weighed.collect()
}

fn product_of_angles(polar: usize, azimuths: usize) -> Vec<([f64; 3], f64)> {
    let ring = |(t, w): (f64, f64)| {
        let z = 2.0 * t - 1.0;
        let across = (1.0 - z * z).max(0.0).sqrt();
        (0..azimuths).map(move |a| {
            let (sin, cos) = (TAU * (a as f64 + 0.5) / azimuths as f64).sin_cos();
            ([across * cos, across * sin, z], w / azimuths as f64)
        })
    };
    rule(polar).iter().flat_map(|&node| ring(node)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{AnalyticField, ScalarField, total_mass};
    use crate::random::{Purpose, keyed};
    use crate::target::Resolution;
    use rand::RngExt;
    use sph::domain::Domain;
    use sph::neighbors::Tree;

    fn target_of<'a, const D: usize>(domain: &'a Domain<D>, density: &'a dyn ScalarField<D>) -> Target<'a, D> {
        let (resolution, mass) = (Resolution::EqualMass, total_mass(density, domain, 1e-6).unwrap().value);
        Target {
            domain,
            density,
            resolution,
            count: 16_000,
            mass,
            resolution_integral: mass,
            largest_spacing: f64::INFINITY,
            pieces: None,
            part: None,
        }
    }

    fn alone<'a, const D: usize>(positions: &'a Positions<D>, support: &'a [f64]) -> Looking<'a, D> {
        Looking { positions, support, together: None }
    }

    fn smoothed<const D: usize>(text: &str, domain: &Domain<D>, x: [f64; D], support: f64) -> f64 {
        let density = AnalyticField::<D>::new("density", text, [0.0; D]).unwrap();
        let target = target_of(domain, &density);
        let by = |ledger: Option<&Ledger<D>>| {
            smoothed_densities(
                KernelName::WendlandC4,
                (&target, ledger),
                &alone(&x.map(|v| vec![v]), &[support]),
                &mut [false],
            )[0]
        };
        let (rules, points) = (by(None), by(Some(&Ledger::new(&target))));
        assert!((points / rules - 1.0).abs() < 0.01, "{text}: {points} by points, {rules} by rules");
        rules
    }

    /// Smoothing of exp(x) is a factor; of a step in the middle, the mean; of r^2, r^2 plus the kernel's second moment.
    #[test]
    fn closed_forms_are_met() {
        fn check<const D: usize>() {
            let cube = Domain::new([-1.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
            let one = smoothed("exp(x)", &cube, [0.0; D], 0.5);
            let other = smoothed("exp(x)", &cube, [0.3; D], 0.5);
            assert!((other / one / 0.3_f64.exp() - 1.0).abs() < 1e-6, "{D}-D: {one} {other}");
            let step = smoothed("if(x < 0.2, 3, 1)", &cube, [0.2; D], 0.5);
            assert!((step - 2.0).abs() < 0.01, "{D}-D: {step}");
            let ball = Domain::ball([0.0; D], 2.0, Wall::Open).unwrap();
            let mut x = [0.0; D];
            x[0] = 0.7;
            let shift = smoothed("1 + r^2", &ball, x, 0.5) - 1.49;
            let center = smoothed("1 + r^2", &ball, [0.0; D], 0.5) - 1.0;
            assert!((shift - center).abs() < 1e-5 && center > 0.01, "{D}-D: {shift} {center}");
            // Radial or not, it is the same integral.
            let apart = smoothed("1 + r^2 + 0*x", &ball, x, 0.5) - 1.49;
            assert!((apart - shift).abs() < 1e-4, "{D}-D: {apart} {shift}");
        }
        check::<1>();
        check::<2>();
        check::<3>();
    }

    /// With n radii it integrates q^(2n-1), as the fine rule does.
    #[test]
    fn rules_of_few_radii_are_exact_for_powers() {
        fn check<const D: usize>() {
            for kernel in [KernelName::CubicSpline, KernelName::WendlandC4] {
                let fine = radii::<D>(kernel, FINE);
                for count in 1..=FEW {
                    let few = radii::<D>(kernel, count);
                    assert!(few.len() == count && few.iter().all(|&(q, w)| q > 0.0 && q < 1.0 && w > 0.0));
                    for power in 0..2 * count as i32 {
                        let moment = |rule: &[(f64, f64)]| rule.iter().map(|(q, w)| w * q.powi(power)).sum::<f64>();
                        assert!((moment(&few) / moment(&fine) - 1.0).abs() < 1e-12, "{D}-D {count} {power}");
                    }
                }
            }
        }
        check::<1>();
        check::<2>();
        check::<3>();
    }

    /// Where the target is smooth, few points agree with many.
    #[test]
    fn the_interior_takes_few_points() {
        let cube = Domain::new([-1.0; 3], [1.0; 3], [Axis::OPEN; 3], Region::Box).unwrap();
        let field = AnalyticField::<3>::new("density", "exp(x) + y^4 + z^3*x", [0.0; 3]).unwrap();
        let target = target_of(&cube, &field);
        let at = [vec![0.3], vec![-0.2], vec![0.4]];
        let by =
            |inside| smoothed_densities(KernelName::WendlandC4, (&target, None), &alone(&at, &[0.3]), &mut [inside])[0];
        assert!((by(true) / by(false) - 1.0).abs() < 1e-4);
    }

    /// Where few looks are enough, they say what one from each particle says.
    #[test]
    fn particles_that_are_close_together_see_what_each_sees_alone() {
        fn check<const D: usize>(text: &str, count: usize) {
            let cube = Domain::new([-1.0; D], [1.0; D], [Axis::OPEN; D], Region::Box).unwrap();
            let field = AnalyticField::<D>::new("density", text, [0.0; D]).unwrap();
            let target = target_of(&cube, &field);
            let mut rng = keyed(0, Purpose::Measure, 7);
            let positions: Positions<D> =
                std::array::from_fn(|_| (0..count).map(|_| 1.8 * rng.random::<f64>() - 0.9).collect());
            let support = vec![2.5 * 2.0 * (count as f64).powf(-1.0 / D as f64); count];
            let ratio = 2.5 * (16_000.0 / count as f64).powf(1.0 / D as f64);
            let groups = Groups::new(&Tree::build(&positions), 8);
            let mut interior = vec![false; count];
            let mut alike = 0;
            for group in 0..groups.len() {
                let members: Vec<usize> = groups.members(group).iter().map(|&i| i as usize).collect();
                let places: Vec<[f64; D]> = members.iter().map(|&i| at(&positions, i)).collect();
                let together = target.are_resolved_at(&places, ratio);
                for (bit, (&i, x)) in members.iter().zip(&places).enumerate() {
                    interior[i] = target.is_resolved_at(x, ratio);
                    alike += usize::from(interior[i] == (together >> bit & 1 == 1));
                }
            }
            assert_eq!(alike, count, "{D}-D {text}: resolved");
            let density = target.densities(&positions);
            let see = |together| {
                let looking = Looking { positions: &positions, support: &support, together };
                smoothed_densities(KernelName::WendlandC4, (&target, None), &looking, &mut interior.clone())
            };
            let (alone, together) = (see(None), see(Some((&groups, density.as_slice()))));
            let off = alone.iter().zip(&together).map(|(a, b)| (b / a - 1.0).abs());
            let (worst, same) = off.fold((0.0_f64, 0), |(m, s), e| (m.max(e), s + usize::from(e == 0.0)));
            assert!(worst < 1e-3 && same < 9 * count / 10, "{D}-D {text}: {worst}, {same} alike");
        }
        check::<1>("1 + 0.3*x + 0.1*sin(3*x)", 400);
        check::<2>("exp(0.5*x*y)", 3000);
        check::<3>("1 + 0.1*sin(2*x) + 0.2*y*z", 8000);
    }

    /// A density that jumps where the resolution does not is looked at from every particle.
    #[test]
    fn the_density_may_jump_where_the_resolution_is_even() {
        const COUNT: usize = 400;
        let line = Domain::new([-1.0], [1.0], [Axis::Periodic], Region::Box).unwrap();
        let field = |text| AnalyticField::<1>::new("density", text, [0.0]).unwrap();
        let (density, even) = (field("if(x < 0, 1, 3)"), field("1"));
        let target = Target { resolution: Resolution::NumberDensity(&even), ..target_of(&line, &density) };
        let spacing = 2.0 / COUNT as f64;
        let positions = [(0..COUNT).map(|i| (i as f64 + 0.5) * spacing - 1.0).collect::<Vec<f64>>()];
        let groups = Groups::new(&Tree::build(&positions), 8);
        let wanted = target.densities(&positions);
        let support = [2.8 * spacing; COUNT];
        let looking = Looking { positions: &positions, support: &support, together: Some((&groups, &wanted)) };
        let seen = smoothed_densities(KernelName::WendlandC4, (&target, None), &looking, &mut [true; COUNT]);
        for i in [0, COUNT / 2 - 1, COUNT / 2, COUNT - 1] {
            assert!((seen[i] / wanted[i] - 1.0).abs() > 0.05, "{i}: {} for {}", seen[i], wanted[i]);
        }
    }

    #[test]
    fn faces_are_vacuum_mirrors_or_seams() {
        let at_face = |axis: Axis, text: &str| {
            let cube = Domain::new([0.0; 3], [1.0; 3], [axis; 3], Region::Box).unwrap();
            smoothed(text, &cube, [0.0, 0.5, 0.5], 0.2)
        };
        assert!((at_face(Axis::OPEN, "2") - 1.0).abs() < 0.02, "{}", at_face(Axis::OPEN, "2"));
        assert!((at_face(Axis::REFLECTING, "2") - 2.0).abs() < 1e-9);
        assert!((at_face(Axis::Periodic, "2 + sin(2*pi*x)") - 2.0).abs() < 1e-9);
        let ball = |wall: Wall| Domain::ball([0.0; 3], 1.0, wall).unwrap();
        assert!((smoothed("2", &ball(Wall::Reflecting), [1.0, 0.0, 0.0], 0.2) - 2.0).abs() < 1e-9);
        let open = smoothed("2", &ball(Wall::Open), [1.0, 0.0, 0.0], 0.02);
        assert!((open - 1.0).abs() < 0.02, "{open}");
    }
}
