//! Stages run by themselves, for tests that compare them.

use sph::kernel::KernelName;
use sph::lanes::Real;
use sph_prep::relaxation::{
    ALARIC, AfcOptions, Alaric, AlaricOptions, AwayFromClosest, Control, DensitySolver, MassTrimming, Particles,
    SolverOptions, Stage, StageReport, Start, TrimOptions, Wvt, WvtOptions, relax, relax_new,
};
use sph_prep::target::{Positions, Target};

/// What a stage leaves of `positions`, and the report of its end.
fn run<const D: usize>(
    stage: &dyn Stage<D>,
    positions: Positions<D>,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    let relaxed = relax_new(stage, positions, control);
    let report = relaxed.report().clone();
    (relaxed.particles.positions, report)
}

/// WVT.
pub fn wvt<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &WvtOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    run(&Wvt { kernel, target: *target, options: *options }, positions, control)
}

/// The density solver with distances in the precision `R`.
pub fn solve_density<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &SolverOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    run(&DensitySolver::<D, R>::new(kernel, *target, *options), positions, control)
}

/// ALARIC without splitting, with distances in the precision `R`.
pub fn alaric<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    run(&Alaric::<D, R>::new(ALARIC, kernel, *target, *options, 0), positions, control)
}

/// ALARIC with splitting; a report for each number of particles.
pub fn alaric_by_splitting<const D: usize, R: Real>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    splittings: usize,
    options: &AlaricOptions,
    control: &Control<'_>,
) -> (Positions<D>, Vec<StageReport>) {
    let stage = Alaric::<D, R>::new(ALARIC, kernel, *target, *options, splittings);
    let relaxed = relax_new(&stage, positions, control);
    (relaxed.particles.positions, relaxed.reports)
}

/// Away from the closest.
pub fn away_from_closest<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: Positions<D>,
    options: &AfcOptions,
    control: &Control<'_>,
) -> (Positions<D>, StageReport) {
    run(&AwayFromClosest { kernel, target: *target, options: *options }, positions, control)
}

/// Trims `masses` at `positions`.
pub fn trim_masses<const D: usize>(
    kernel: KernelName,
    target: &Target<'_, D>,
    positions: &Positions<D>,
    masses: &mut Vec<f64>,
    options: &TrimOptions,
    control: &Control<'_>,
) -> StageReport {
    let stage = MassTrimming { kernel, target: *target, options: *options };
    let particles = Particles { positions: positions.clone(), masses: Some(masses.clone()), internal_energy: None };
    let relaxed = relax(&stage, Start::New(particles), control, &mut |_, _| {}).unwrap();
    let report = relaxed.report().clone();
    *masses = relaxed.particles.masses.unwrap();
    report
}
