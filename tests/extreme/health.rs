//! Numerical health: how far ALARIC's time step is from the one that breaks it, what single precision costs, and
//! the order at which the error falls with N.

use sph_prep::domain::{Axis, Domain, Region};
use sph_prep::field::ScalarField;
use sph_prep::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph_prep::metrics::{DensityError, Measured};
use sph_prep::neighbors::lanes::Real;
use sph_prep::placement::{AlaricOptions, Control, SolverOptions, WvtOptions, alaric, relax, solve_density};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, Resolution, Target};
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

fn with_target<const D: usize, T>(
    count: usize,
    run: impl FnOnce(&Target<'_, D>, Positions<D>, &Control<'_>) -> T,
) -> T {
    let domain = Domain::new([0.0; D], [1.0; D], [Axis::Periodic; D], Region::Box).unwrap();
    let target = Target {
        domain: &domain,
        density: &Wave,
        resolution: Resolution::EqualMass,
        count,
        mass: 1.0,
        resolution_integral: 1.0,
        largest_spacing: f64::INFINITY,
    };
    let control = Control { deadline: None, interrupted: &NEVER, observer: &|_, _, _, _| {} };
    let start = seed(&target, Seeding::MassBisection, 1).unwrap().positions;
    let options = WvtOptions { iterations: 10, ..WvtOptions::new(D) };
    let start = relax(KERNEL, &target, start, &options, &control).0;
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

fn solved<const D: usize, R: Real>(count: usize, evaluations: usize) -> f64 {
    with_target::<D, _>(count, |target, start, control| {
        let options = SolverOptions { evaluations, ..SolverOptions::new(D) };
        let (x, _) = solve_density::<D, R>(KERNEL, target, start, &options, control);
        let neighbors = default_kernel_neighbors(D);
        let ratio = support_over_spacing(D, neighbors);
        let guess: Vec<f64> = target.number_densities(&x).iter().map(|&n| ratio * target.spacing(n)).collect();
        let measured = Measured::new(KERNEL, target.domain, &x, &target.masses(&x), &guess, neighbors);
        DensityError::new(&measured, &target.densities(&x)).all_refitted.mean
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
