//! Density error and force noise of the solver against evaluations and time, in a periodic cube, and what an
//! evaluation costs beside a density pass.
//!
//! `cargo bench --bench solver [-- N [EVALUATIONS [QUIETNESS]]]`

use sph::domain::{Axis, Domain, Region};
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph::neighbors::{Reach, Sources, Tree};
use sph::sums::density;
use sph_prep::field::ScalarField;
use sph_prep::metrics::{DensityError, Measured, NoiseFigures};
use sph_prep::relaxation::{Control, DensitySolver, SolverOptions, Wvt, WvtOptions, relax_new};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, Target};
use std::f64::consts::TAU;
use std::time::Instant;

struct Density(fn(&[f64; 3]) -> f64);

impl ScalarField<3> for Density {
    fn value(&self, x: &[f64; 3]) -> f64 {
        (self.0)(x)
    }
}

fn report(name: &str, target: &Target<'_, 3>, positions: &Positions<3>, evaluations: usize, start: Instant) {
    let seconds = start.elapsed().as_secs_f64();
    let neighbors = default_kernel_neighbors(3);
    let masses = target.masses(positions);
    let ratio = support_over_spacing(3, neighbors);
    let guess: Vec<f64> = target.number_densities(positions).iter().map(|&n| ratio * target.spacing(n)).collect();
    let measured = Measured::new(KernelName::WendlandC4, target.domain, positions, &masses, &guess, neighbors);
    let error = DensityError::new(&measured, &target.densities(positions), None).all_refitted;
    let noise = NoiseFigures::new(KernelName::WendlandC4, &measured, target.domain, &masses, neighbors).all;
    let closest = measured.neighbors(target.domain, neighbors).closest_pair;
    println!(
        "  {name:<26} {evaluations:>5} {seconds:>8.1} s   {:>9.2e}   {:>7.3} %   {closest:.2}",
        error.epsilon,
        100.0 * noise
    );
}

const PASSES: u32 = 40;

/// Seconds of one pass for density and its gradient at the target's support radii, the mean of many as for
/// evaluations.
fn density_pass(target: &Target<'_, 3>, positions: &Positions<3>) -> f64 {
    let ratio = support_over_spacing(3, default_kernel_neighbors(3));
    let tree = Tree::build(positions);
    let support: Vec<f64> = target.number_densities(positions).iter().map(|&n| ratio * target.spacing(n)).collect();
    let support = tree.to_tree_order(&support);
    let sources = [Sources::<3, 0>::new(&tree, &support, [], Reach::Target)];
    let start = Instant::now();
    for _ in 0..PASSES {
        std::hint::black_box(density::<3, 0, f32>(KernelName::WendlandC4, target.domain, &sources));
    }
    start.elapsed().as_secs_f64() / f64::from(PASSES)
}

fn scene(name: &str, density: fn(&[f64; 3]) -> f64, count: usize, evaluations: usize, quietness: f64) {
    println!("{name}: evaluations, time, epsilon (re-fitted), noise over that of a random set, closest pair");
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let field = Density(density);
    let side = 64;
    let mean = (0..side * side * side)
        .map(|i| density(&[i % side, i / side % side, i / side / side].map(|c| (c as f64 + 0.5) / side as f64)))
        .sum::<f64>()
        / f64::from(side as u32).powi(3);
    let target = Target::of_equal_masses(&domain, &field, count, mean);
    let (kernel, control) = (KernelName::WendlandC4, Control::default());
    let wvt = |iterations| Wvt { kernel, target, options: WvtOptions { iterations, ..WvtOptions::new(3) } };
    let start = Instant::now();
    let seeds = seed(&target, Seeding::MassBisection, 0).unwrap().positions;
    report("seed: mass bisection", &target, &seeds, 0, start);
    let start = Instant::now();
    let long = relax_new(&wvt(60), seeds.clone(), &control).particles.positions;
    report("WVT", &target, &long, 61, start);
    let start = Instant::now();
    let few = relax_new(&wvt(5), seeds, &control).particles.positions;
    let options = SolverOptions { evaluations: evaluations - 6, quietness, ..SolverOptions::new(3) };
    let solver = DensitySolver::<3>::new(kernel, target, options);
    let relaxed = relax_new(&solver, few, &control);
    let (solved, stage) = (&relaxed.particles.positions, relaxed.report());
    report("5 WVT + solver", &target, solved, evaluations, start);
    let made = stage.history.last().map_or(1, |h| h.iteration);
    let step = stage.seconds / made as f64;
    let evaluation = solver.time_evaluation(solved.clone(), PASSES);
    let pass = density_pass(&target, solved);
    println!(
        "  one evaluation with its gradient takes {:.2} density passes ({:.1} ms), with direction and step {:.2}",
        evaluation / pass,
        1e3 * pass,
        step / pass
    );
    let trace: Vec<String> =
        stage.history.iter().step_by(8).map(|h| format!("{}:{:.1e}", h.iteration, h.epsilon)).collect();
    println!("  {}", trace.join(" "));
}

fn main() {
    let given: Vec<f64> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let count = given.first().map_or(100_000, |&n| n as usize);
    let evaluations = given.get(1).map_or(100, |&n| n as usize);
    let quietness = given.get(2).copied().unwrap_or(0.5);
    scene("uniform", |_| 1.0, count, evaluations, quietness);
    scene("1 + 0.5 sin cos", |x| 1.0 + 0.5 * (TAU * x[0]).sin() * (TAU * x[1]).cos(), count, evaluations, quietness);
    let gaussian = |x: &[f64; 3]| {
        let r2: f64 = x.iter().map(|v| (v - 0.5).powi(2)).sum();
        0.01 + 0.99 * (-r2 / 0.02).exp()
    };
    scene("100:1 Gaussian", gaussian, count, evaluations, quietness);
}
