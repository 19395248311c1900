//! Numerical health: how far ALARIC's time step is from the one that breaks it, what its integrator conserves, how
//! well the solver's equations are conditioned, what single precision costs, and the order at which the error falls
//! with N.

use crate::support::{alaric, solve_density, wvt};
use sph::domain::{Axis, Domain, Region};
use sph::kernel::{Kernel, KernelName, WendlandC4, default_kernel_neighbors, evaluate, support_over_spacing};
use sph::lanes::Real;
use sph_prep::field::ScalarField;
use sph_prep::metrics::{DensityError, Measured};
use sph_prep::relaxation::{AlaricOptions, Control, Drift, SolverOptions, WvtOptions, conservation};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, Target, at};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::sync::atomic::AtomicBool;

static NEVER: AtomicBool = AtomicBool::new(false);
const KERNEL: KernelName = KernelName::WendlandC4;

/// 1 + 0.5 sin along x over a periodic unit box.
struct Wave;

impl<const D: usize> ScalarField<D> for Wave {
    fn value(&self, x: &[f64; D]) -> f64 {
        1.0 + 0.5 * (TAU * x[0]).sin()
    }
}

/// 1 over a periodic unit box.
struct One;

impl<const D: usize> ScalarField<D> for One {
    fn value(&self, _: &[f64; D]) -> f64 {
        1.0
    }
}

fn with_target<const D: usize, T>(
    count: usize,
    run: impl FnOnce(&Target<'_, D>, Positions<D>, &Control<'_>) -> T,
) -> T {
    with_density(&Wave, count, run)
}

fn with_density<const D: usize, T>(
    density: &dyn ScalarField<D>,
    count: usize,
    run: impl FnOnce(&Target<'_, D>, Positions<D>, &Control<'_>) -> T,
) -> T {
    let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
    let target = Target::of_equal_masses(&domain, density, count, 1.0);
    let control = Control { deadline: None, interrupted: &NEVER, observer: &|_| {} };
    let start = seed(&target, Seeding::MassBisection, 1).unwrap().positions;
    let options = WvtOptions { iterations: 10, ..WvtOptions::new(D) };
    let start = wvt(KERNEL, &target, start, &options, &control).0;
    run(&target, start, &control)
}

/// First and last epsilon of 300 steps of ALARIC with this Courant number.
fn with_courant(courant: f64) -> (f64, f64) {
    with_target::<2, _>(1500, |target, start, control| {
        let options =
            AlaricOptions { courant, steps: 300, rate_tolerance: 0.0, tolerance: 0.0, ..AlaricOptions::new(2) };
        let history = alaric::<2, f32>(KERNEL, target, start, &options, control).1.history;
        (history[0].epsilon, history[history.len() - 1].epsilon)
    })
}

/// What the solver leaves after this many evaluations.
fn solve<const D: usize, R: Real>(
    target: &Target<'_, D>,
    start: Positions<D>,
    evaluations: usize,
    control: &Control<'_>,
) -> Positions<D> {
    let options = SolverOptions { evaluations, ..SolverOptions::new(D) };
    solve_density::<D, R>(KERNEL, target, start, &options, control).0
}

/// Mean density error.
fn mean_error<const D: usize>(target: &Target<'_, D>, x: &Positions<D>) -> f64 {
    let neighbors = default_kernel_neighbors(D);
    let ratio = support_over_spacing(D, neighbors);
    let guess: Vec<f64> = target.number_densities(x).iter().map(|&n| ratio * target.spacing(n)).collect();
    let measured = Measured::new(KERNEL, target.domain, x, &target.masses(x), &guess, neighbors);
    DensityError::new(&measured, &target.densities(x), None).all_refitted.mean
}

fn solved<const D: usize, R: Real>(count: usize, evaluations: usize) -> f64 {
    with_target::<D, _>(count, |target, start, control| {
        mean_error(target, &solve::<D, R>(target, start, evaluations, control))
    })
}

/// Mean error as solved, and with the coordinates rounded to single precision, as files hold them by default.
fn written<const D: usize>(count: usize) -> (f64, f64) {
    with_target::<D, _>(count, |target, start, control| {
        let x = solve::<D, f32>(target, start, 60, control);
        let rounded = x.clone().map(|axis| axis.into_iter().map(|v| f64::from(v as f32)).collect());
        (mean_error(target, &x), mean_error(target, &rounded))
    })
}

/// Drifts without friction, viscosity and stops, at a fraction of the default time step, over the same time.
fn drifts<const D: usize, R: Real>(count: usize, factor: f64) -> Drift {
    with_density::<D, _>(&One, count, |target, start, control| {
        let default = AlaricOptions::new(D);
        let steps = (200.0 / factor) as usize;
        let options = AlaricOptions { courant: factor * default.courant, steps, ..default };
        conservation::<D, R>(KERNEL, target, start, &options, control)
    })
}

/// Largest and smallest singular value of dq_i/dx_j, positions in spacings, where the solver ends on a uniform
/// target; the smallest but for what the periodic box makes zero.
fn singular_values<const D: usize>(count: usize) -> (f64, f64) {
    with_density::<D, _>(&One, count, |target, start, control| {
        let x = solve::<D, f64>(target, start, 60, control);
        let ratio = support_over_spacing(D, default_kernel_neighbors(D));
        let spacing = (count as f64).powf(-1.0 / D as f64);
        let support = ratio * spacing;
        let mut jacobian = nalgebra::DMatrix::<f64>::zeros(count, D * count);
        // q = W/n* summed; its slope by a particle's place, over the spacing, in units of the support radius.
        let norm = WendlandC4::SIGMA[D - 1] / (ratio.powi(D as i32) * ratio * ratio * spacing);
        for (i, j) in (0..count).flat_map(|i| (0..count).map(move |j| (i, j))).filter(|(i, j)| i != j) {
            let d = target.domain.displacement(&at(&x, j), &at(&x, i));
            let q = d.iter().map(|v| v * v).sum::<f64>().sqrt() / support;
            let strength = norm * evaluate::<_, D>(WendlandC4, q).1;
            for k in 0..D {
                jacobian[(i, D * j + k)] += strength * d[k];
                jacobian[(i, D * i + k)] -= strength * d[k];
            }
        }
        let mut values: Vec<f64> = jacobian.singular_values().iter().copied().collect();
        values.sort_by(|a, b| b.total_cmp(a));
        // q cannot all rise at once to first order where they are equal: one value is next to zero.
        (values[0], values[count - 2])
    })
}

/// The report, and what is not as it should be.
pub fn report() -> (String, Vec<String>) {
    let (mut out, mut wrong) = (String::new(), Vec::new());
    let default = AlaricOptions::new(2).courant;
    out += "\n## Time step of ALARIC\n\n2-D wave, 1500 particles, 300 steps.\n\n| Courant number | over the default | epsilon before | after |\n|---|---|---|---|\n";
    let mut unstable = f64::INFINITY;
    for factor in [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0] {
        let (before, after) = with_courant(factor * default);
        writeln!(out, "| {:.3} | {factor} | {before:.1e} | {after:.1e} |", factor * default).unwrap();
        if !(after < before) {
            unstable = unstable.min(factor);
        }
    }
    writeln!(out, "\nThe first that raises the error is {unstable} times the default.").unwrap();
    if unstable <= 1.0 {
        wrong.push("ALARIC's default time step is unstable".into());
    }
    out += "\n## What ALARIC's integrator conserves\n\nUniform target, without friction, viscosity and velocity stops, the same \
            time at every step. Energy: largest change over\nthe largest kinetic energy; momentum: largest net momentum over the \
            sum of all particles'.\n\n| | step over the default | crossings | energy f64 | energy f32 | momentum f64 | momentum f32 |\n\
            |---|---|---|---|---|---|---|\n";
    for (name, double, single) in [
        ("1-D, 300", drifts::<1, f64> as fn(usize, f64) -> Drift, drifts::<1, f32> as fn(usize, f64) -> Drift),
        ("2-D, 1500", drifts::<2, f64>, drifts::<2, f32>),
        ("3-D, 3000", drifts::<3, f64>, drifts::<3, f32>),
    ] {
        let count = name[5..].parse().unwrap();
        for factor in [1.0, 0.5, 0.25] {
            let (a, b) = (double(count, factor), single(count, factor));
            writeln!(
                out,
                "| {name} | {factor} | {:.2} | {:.1e} | {:.1e} | {:.1e} | {:.1e} |",
                a.time, a.energy, b.energy, a.momentum, b.momentum
            )
            .unwrap();
            if !(a.energy < 0.1 && b.energy < 0.1 && a.momentum < 1e-6 && b.momentum < 1e-2) {
                wrong.push(format!("{name} at {factor} of the step: {a:?} {b:?}"));
            }
        }
    }
    out += "\n## Conditioning of the solver\n\nSingular values of the density's response to displacements, both relative \
            (density over target, displacement over spacing),\nwhere the solver ends on a uniform target.\n\n\
            | | N | largest | smallest | condition |\n|---|---|---|---|---|\n";
    for (name, values, counts) in [
        // An even number of points on a line has a wave of two spacings, which moves no density at all.
        ("1-D", singular_values::<1> as fn(usize) -> (f64, f64), [51, 201]),
        ("2-D", singular_values::<2>, [100, 400]),
        ("3-D", singular_values::<3>, [216, 512]),
    ] {
        for count in counts {
            let (largest, smallest) = values(count);
            writeln!(out, "| {name} | {count} | {largest:.2e} | {smallest:.1e} | {:.1e} |", largest / smallest)
                .unwrap();
        }
    }
    out += "\n## Single and double precision of the solver\n\nMean error after 60 evaluations, 3000 particles.\n\n| | f32 | f64 |\n|---|---|---|\n";
    for (name, single, double) in [
        ("2-D", solved::<2, f32>(3000, 60), solved::<2, f64>(3000, 60)),
        ("3-D", solved::<3, f32>(3000, 60), solved::<3, f64>(3000, 60)),
    ] {
        writeln!(out, "| {name} | {single:.2e} | {double:.2e} |").unwrap();
        if single > 2.0 * double {
            wrong.push(format!("{name}: single precision {single:e}, double {double:e}"));
        }
    }
    out += "\nThe same as solved in f32, and with coordinates rounded to f32 as files hold them by default.\n\n| | as solved | rounded |\n|---|---|---|\n";
    for (name, (solved, rounded)) in [("2-D", written::<2>(3000)), ("3-D", written::<3>(3000))] {
        writeln!(out, "| {name} | {solved:.3e} | {rounded:.3e} |").unwrap();
        if rounded > 1.1 * solved {
            wrong.push(format!("{name}: rounding raises the error from {solved:e} to {rounded:e}"));
        }
    }
    out += "\n## Error against N\n\nMean error of the solver on the wave; order is the slope against the spacing.\n\n| | N | mean error | order |\n|---|---|---|---|\n";
    for (name, d, solve) in [
        ("1-D", 1.0, solved::<1, f32> as fn(usize, usize) -> f64),
        ("2-D", 2.0, solved::<2, f32>),
        ("3-D", 3.0, solved::<3, f32>),
    ] {
        let mut before: Option<(f64, f64)> = None;
        for count in [500_usize, 2000, 8000] {
            let (error, spacing) = (solve(count, 60), (count as f64).powf(-1.0 / d));
            let order =
                before.map_or("-".into(), |(e, s): (f64, f64)| format!("{:.1}", (e / error).ln() / (s / spacing).ln()));
            writeln!(out, "| {name} | {count} | {error:.2e} | {order} |").unwrap();
            before = Some((error, spacing));
        }
    }
    (out, wrong)
}
