//! Fig. 10/11, spirals in the unit disc, and Fig. 12/13, a uniform disc by several methods.

use crate::{Density, control, target};
use sph_prep::domain::{Domain, Wall};
use sph_prep::kernel::KernelName;
use sph_prep::placement::{AlaricOptions, SolverOptions, Weight, WvtOptions, alaric, relax, solve_density};
use sph_prep::seeding::{Seeding, seed};

fn disc() -> Domain<2> {
    Domain::ball([0.0; 2], 1.0, Wall::Reflecting).unwrap()
}

/// 1/2 + 2 r^2 exp(-4 (r - 1/5)^2) sin(p (theta + ln r)); its mean is that of its constant.
fn spiral(p: f64) -> impl Fn(&[f64; 2]) -> f64 {
    move |x| {
        let r = x[0].hypot(x[1]);
        let phase = if r > 0.0 { p * (x[1].atan2(x[0]) + r.ln()) } else { 0.0 };
        0.5 + 2.0 * r * r * (-4.0 * (r - 0.2).powi(2)).exp() * phase.sin()
    }
}

/// The paper goes below 1e-4 with 10 000 particles.
#[test]
#[ignore = "a minute"]
fn spirals() {
    let domain = disc();
    for p in [1.0, 2.0, 3.0] {
        let density = Density(spiral(p));
        let target = target(&domain, &density, 10_000, 0.5 * domain.volume());
        let start = seed(&target, Seeding::MassBisection, 0).unwrap().positions;
        let few = WvtOptions { iterations: 20, ..WvtOptions::new(2) };
        let (x, wvt) = relax(KernelName::WendlandC4, &target, start, &few, &control());
        let options = AlaricOptions { steps: 1000, ..AlaricOptions::new(2) };
        let (_, report) = alaric::<2, f32>(KernelName::WendlandC4, &target, x.clone(), &options, &control());
        let (_, solved) =
            solve_density::<2, f32>(KernelName::WendlandC4, &target, x, &SolverOptions::new(2), &control());
        let epsilon = report.epsilon().unwrap();
        println!(
            "p = {p}: WVT {:.1e} in {:.1} s, ALARIC {epsilon:.1e} in {:.1} s, solver {:.1e} in {:.1} s",
            wvt.epsilon().unwrap(),
            wvt.seconds,
            report.seconds,
            solved.history.last().unwrap().epsilon,
            solved.seconds
        );
        assert!(epsilon < 1e-4, "p = {p}: {epsilon:e}");
    }
}

/// 2000 particles from one random start and from mass bisection. In the paper WVT stagnates near 1e-3 and
/// ALARIC reaches 1e-5; the WVT here, without its drift, stagnates lower.
#[test]
#[ignore = "minutes"]
fn uniform_disc() {
    let domain = disc();
    let density = Density(|_: &[f64; 2]| 1.0);
    let target = target(&domain, &density, 2000, domain.volume());
    for seeding in [Seeding::Random, Seeding::MassBisection] {
        let start = seed(&target, seeding, 0).unwrap().positions;
        let wvt = |weight: Weight| {
            let options = WvtOptions { weight, iterations: 1000, ..WvtOptions::new(2) };
            relax(KernelName::WendlandC4, &target, start.clone(), &options, &control()).1.epsilon().unwrap()
        };
        let (square, kernel) = (wvt(Weight::InverseSquare), wvt(Weight::Kernel));
        let options = AlaricOptions { rate_tolerance: 0.0, ..AlaricOptions::new(2) };
        let (_, report) = alaric::<2, f32>(KernelName::WendlandC4, &target, start.clone(), &options, &control());
        let (_, solved) =
            solve_density::<2, f32>(KernelName::WendlandC4, &target, start.clone(), &SolverOptions::new(2), &control());
        let epsilon = report.epsilon().unwrap();
        println!(
            "{seeding:?}: WVT r^-2 {square:.1e}, WVT kernel {kernel:.1e}, ALARIC {epsilon:.1e} in {:.1} s, solver {:.1e} in {:.1} s",
            report.seconds,
            solved.history.last().unwrap().epsilon,
            solved.seconds
        );
        assert!(epsilon < square.min(kernel), "{seeding:?}");
    }
}
