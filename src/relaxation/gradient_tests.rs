//! Compares the analytic gradients with finite differences of the objective, in every dimension and with every boundary, and tests what the
//! forces conserve.

use super::arrangement::Arrangement;
use super::fluid::{AlaricOptions, Fluid};
use super::objective::Objective;
use super::schedule::SolverOptions;
use crate::field::ScalarField;
use crate::seeding::{Seeding, seed};
use crate::target::Target;
use sph::domain::{Axis, Domain, Region, Wall};
use sph::kernel::KernelName;

/// Smooth, positive and without symmetry.
struct Bumpy;
impl<const D: usize> ScalarField<D> for Bumpy {
    fn value(&self, x: &[f64; D]) -> f64 {
        1.5 + (0..D).map(|k| 0.4 * (std::f64::consts::TAU * x[k] + k as f64).sin()).sum::<f64>()
    }
}

/// The same for a function of the distance from a point, which says so.
struct Hill;
impl<const D: usize> ScalarField<D> for Hill {
    fn value(&self, x: &[f64; D]) -> f64 {
        0.5 + (-4.0 * x.iter().map(|v| (v - 0.5) * (v - 0.5)).sum::<f64>()).exp()
    }

    fn center(&self) -> Option<[f64; D]> {
        Some([0.5; D])
    }
}

/// Steeper than any sum over neighbors can follow.
struct Clumps;
impl<const D: usize> ScalarField<D> for Clumps {
    fn value(&self, x: &[f64; D]) -> f64 {
        (0..D).map(|k| 2.5 * (std::f64::consts::TAU * x[k] + k as f64).sin()).sum::<f64>().exp()
    }
}

fn domains<const D: usize>() -> Vec<Domain<D>> {
    let unit = |axis| Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap();
    let half = Axis::Walls { lo: Wall::Reflecting, hi: Wall::Open };
    let mut domains = vec![
        unit(Axis::Periodic),
        unit(Axis::REFLECTING),
        unit(Axis::OPEN),
        unit(half),
        Domain::ball([0.5; D], 0.5, Wall::Reflecting).unwrap(),
        Domain::ball([0.5; D], 0.5, Wall::Open).unwrap(),
    ];
    if D == 3 {
        let cylinder = |axis, inner, wall, ends| Domain::cylinder([0.5; D], axis, [inner, 0.5], 1.0, (wall, ends));
        domains.push(cylinder(2, 0.0, Wall::Reflecting, Axis::Periodic).unwrap());
        domains.push(cylinder(0, 0.2, Wall::Open, Axis::OPEN).unwrap());
    }
    domains
}

fn target<'a, const D: usize>(domain: &'a Domain<D>, count: usize) -> Target<'a, D> {
    Target::of_equal_masses(domain, &Bumpy, count, 1.5 * domain.volume())
}

fn check_solver<const D: usize>(count: usize, density: &dyn ScalarField<D>, domains: &[Domain<D>], must_aim: bool) {
    for domain in domains {
        let mass = crate::field::total_mass(density, domain, 1e-6).unwrap().value;
        let target = Target::of_equal_masses(domain, density, count, mass);
        let positions = seed(&target, Seeding::MassBisection, 3).unwrap().positions;
        let options = SolverOptions::new(D);
        let arrangement = Arrangement::<D, f64>::new(
            KernelName::WendlandC4,
            target,
            domain.mirrored(),
            positions,
            options.kernel_neighbors,
        );
        let mut solver = Objective::new(arrangement);
        let frame = solver.frame(0.3);
        assert!(solver.aims.is_some() || !must_aim, "{D}-D {domain:?}");
        let now = solver.evaluate(&frame);
        let gradient = solver.gradient(&frame, now);
        let size = gradient.iter().flatten().fold(0.0_f64, |m, g| m.max(g.abs()));
        // Those that are held have none.
        for i in (0..count).step_by(count / 40 + 1).filter(|&i| frame.held.get(i) != Some(&true)) {
            let h = 1e-5;
            let mut energy = |k: usize, sign: f64| {
                let from = solver.arrangement.positions().clone();
                let mut moved = from.clone();
                moved[k][i] += sign * h * frame.spacing[i];
                solver.arrangement.put_back(moved);
                let energy = solver.evaluate(&frame).energy;
                solver.arrangement.put_back(from);
                energy
            };
            let difference: [f64; D] = std::array::from_fn(|k| (energy(k, 1.0) - energy(k, -1.0)) / (2.0 * h));
            let difference = solver.layers.as_ref().map_or(difference, |layers| layers.along(i, difference));
            for k in 0..D {
                let error = (difference[k] - gradient[i][k]).abs() / size;
                // The target's slope is a forward difference over 1e-6 spacings, which its curvature, a few at the bumps, puts off.
                assert!(error < 4e-6, "{D}-D {domain:?}: {difference:?} against {:?}", gradient[i]);
            }
        }
    }
}

#[test]
fn the_solvers_gradient_is_that_of_its_objective() {
    check_solver::<1>(60, &Bumpy, &domains(), false);
    check_solver::<2>(200, &Bumpy, &domains(), false);
    check_solver::<3>(300, &Bumpy, &domains(), false);
    // It has a kink where a periodic box closes.
    check_solver::<2>(200, &Hill, &domains()[1..], false);
    check_solver::<3>(300, &Hill, &domains()[1..], false);
}

#[test]
fn so_it_is_where_particles_aim_at_the_smoothed_target() {
    check_solver::<1>(60, &Clumps, &domains()[..2], true);
    check_solver::<2>(200, &Clumps, &domains()[..2], true);
    check_solver::<3>(300, &Clumps, &domains()[..2], true);
    check_solver::<2>(200, &Clumps, &domains()[4..5], true);
}

fn check_momentum<const D: usize>(count: usize) {
    let domain = &domains::<D>()[0];
    let target = target(domain, count);
    let positions = seed(&target, Seeding::Random, 5).unwrap().positions;
    let options = AlaricOptions { steps: 0, ..AlaricOptions::new(D) };
    let mut fluid = Fluid::<D, f64>::new(KernelName::WendlandC4, target, positions, &options);
    let sizes: f64 = fluid.accelerations.iter().flatten().map(|a| a.abs()).sum();
    for k in 0..D {
        let total: f64 = fluid.accelerations.iter().map(|a| a[k]).sum();
        assert!(total.abs() < 1e-13 * sizes, "{D}-D: {total} of {sizes}");
    }
    // Free motion: what pairs exchange cancels.
    let free = AlaricOptions { friction: 0.0, viscosity: false, velocity_stops: false, ..options };
    fluid.options = &free;
    let moved = (0..20).map(|_| fluid.advance()).fold(0.0, f64::max);
    assert!(moved > 0.0);
    let speeds: f64 = fluid.velocities.iter().flatten().map(|v| v.abs()).sum();
    for k in 0..D {
        let total: f64 = fluid.velocities.iter().map(|v| v[k]).sum();
        assert!(total.abs() < 1e-12 * speeds, "{D}-D: {total} of {speeds}");
    }
}

#[test]
fn the_ideal_force_conserves_momentum() {
    check_momentum::<1>(100);
    check_momentum::<2>(300);
    check_momentum::<3>(500);
}
