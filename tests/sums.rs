//! The core against simpler code: neighbor sums against all pairs, figures against plain formulas, and equal
//! bytes for any number of threads.

use crate::support::wvt;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use sph::domain::{Axis, Domain, Region, Wall};
use sph::kernel::{Kernel, KernelName, WendlandC4, evaluate};
use sph::neighbors::{Reach, Sources, Tree, brute_force};
use sph::sums::{Actors, Search, density, scatter_gradient, solve_support_radii};
use sph_prep::field::ScalarField;
use sph_prep::metrics::{DensityError, Measured, NoiseFigures};
use sph_prep::relaxation::{Control, WvtOptions};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, Resolution, Target, at};
use std::sync::atomic::AtomicBool;

fn random<const D: usize>(n: usize) -> Positions<D> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    // Cubed, so that spacings differ by large factors.
    std::array::from_fn(|_| (0..n).map(|_| rng.random::<f64>().powi(3)).collect())
}

fn domains<const D: usize>() -> Vec<Domain<D>> {
    let half = Axis::Walls { lo: Wall::Reflecting, hi: Wall::Open };
    [Axis::Periodic, Axis::REFLECTING, Axis::OPEN, half]
        .into_iter()
        .map(|axis| Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap())
        .collect()
}

fn compare_with_all_pairs<const D: usize>(n: usize, support_range: (f64, f64)) {
    let x = random::<D>(n);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let support: Vec<f64> =
        (0..n).map(|_| support_range.0 + (support_range.1 - support_range.0) * rng.random::<f64>()).collect();
    let weight: Vec<f64> = (0..n).map(|_| 0.5 + rng.random::<f64>()).collect();
    for domain in domains::<D>() {
        let tree = Tree::build(&x);
        let (h, w) = (tree.to_tree_order(&support), tree.to_tree_order(&weight));
        let sources = [Sources::new(&tree, &h, [w.as_slice()], Reach::Target)];
        let narrow = density::<D, 1, f32>(KernelName::WendlandC4, &domain, &sources);
        let wide = density::<D, 1, f64>(KernelName::WendlandC4, &domain, &sources);
        let actors = [Actors { tree: &tree, support: &h, strength: &w, silent: false }];
        let seen = scatter_gradient::<D, f64>(KernelName::WendlandC4, &domain, &actors);
        for (k, &i) in tree.order().iter().enumerate() {
            let i = i as usize;
            let norm = |h: f64| WendlandC4::SIGMA[D - 1] / h.powi(D as i32);
            let (mut number, mut mass, mut gradient, mut scattered) = (0.0, 0.0, [0.0; D], [0.0; D]);
            let (mut number_slope, mut mass_slope) = (0.0, 0.0);
            brute_force::for_each_within(&domain, &x, &at(&x, i), support_range.1, |d, j| {
                let r = d.iter().map(|v| v * v).sum::<f64>().sqrt();
                let (own, slope) = evaluate::<_, D>(WendlandC4, r / support[i]);
                let other = evaluate::<_, D>(WendlandC4, r / support[j]).1;
                number += norm(support[i]) * own;
                mass += weight[j] * norm(support[i]) * own;
                let by_support = norm(support[i]) * ((r / support[i]).powi(2) * slope - D as f64 * own);
                number_slope += by_support;
                mass_slope += weight[j] * by_support;
                for a in 0..D {
                    let (hi, hj) = (support[i], support[j]);
                    gradient[a] += weight[j] * norm(hi) * slope / (hi * hi) * d[a];
                    scattered[a] += weight[j] * norm(hj) * other / (hj * hj) * d[a];
                }
            });
            let scale = mass / support[i];
            // f32 positions resolve 6e-8 of the reach; sums of some hundred terms stay within a few 1e-6.
            for (got, tolerance) in [(&narrow[k], 5e-6), (&wide[k], 1e-12)] {
                assert!((got.number_density / number - 1.0).abs() < tolerance, "{D}-D {domain:?}");
                assert!((got.weighted / mass - 1.0).abs() < tolerance, "{D}-D {domain:?}");
                assert!((got.slope - number_slope).abs() < 20.0 * tolerance * number, "{D}-D {domain:?}");
                assert!((got.weighted_slope - mass_slope).abs() < 20.0 * tolerance * mass, "{D}-D {domain:?}");
                for a in 0..D {
                    assert!((got.gradient[a] - gradient[a]).abs() < 20.0 * tolerance * scale, "{D}-D {domain:?}");
                }
            }
            let size = scattered.iter().fold(scale, |m: f64, f| m.max(f.abs()));
            for a in 0..D {
                assert!((seen[k].0[a] - scattered[a]).abs() < 1e-11 * size, "{D}-D {domain:?}");
            }
        }
    }
}

#[test]
fn sums_equal_those_over_all_pairs_in_every_dimension_and_boundary() {
    compare_with_all_pairs::<1>(200, (0.01, 0.3));
    compare_with_all_pairs::<2>(300, (0.05, 0.4));
    compare_with_all_pairs::<3>(300, (0.1, 0.5));
    // Wider than the box: images count more than once.
    compare_with_all_pairs::<2>(20, (0.5, 1.7));
}

#[test]
fn solved_support_radii_hold_the_neighbors_asked_for() {
    let x = random::<3>(2000);
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let tree = Tree::build(&x);
    for factor in [0.01, 1.0, 4.0] {
        let guess = vec![0.2 * factor; 2000];
        let sources = [Sources::<3, 0>::new(&tree, &guess, [], Reach::Target)];
        let solved =
            |search| solve_support_radii::<3, 0, f32>(KernelName::WendlandC4, &domain, &sources, (64.0, search), 2.0);
        let exact = solved(Search::EXACT);
        for s in &exact {
            let count = s.sums.number_density * 4.0 / 3.0 * std::f64::consts::PI * s.support.powi(3);
            assert!((count / 64.0 - 1.0).abs() < 1e-5, "{count} from a guess {factor} times off");
        }
        // The last step of a coarser search is made without sums: its error is the square of the tolerance.
        for (s, exact) in solved(Search { tolerance: 1e-3, margin: 1.02 }).iter().zip(&exact) {
            let off = s.sums.number_density / exact.sums.number_density - 1.0;
            assert!(off.abs() < 2e-5, "{off:e} from a guess {factor} times off");
            let count = s.sums.number_density * 4.0 / 3.0 * std::f64::consts::PI * s.support.powi(3);
            assert!((count / 64.0 - 1.0).abs() < 2e-6, "{count}");
        }
    }
}

struct Wave;

impl ScalarField<3> for Wave {
    fn value(&self, x: &[f64; 3]) -> f64 {
        let tau = std::f64::consts::TAU;
        1.0 + 0.5 * (tau * x[0]).sin() * (tau * x[1]).cos()
    }
}

fn place(threads: usize) -> (Positions<3>, DensityError, NoiseFigures) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
        let target = Target {
            domain: &domain,
            density: &Wave,
            resolution: Resolution::EqualMass,
            count: 5000,
            mass: 1.0,
            resolution_integral: 1.0,
            largest_spacing: 1.0,
            pieces: None,
            part: None,
        };
        let stop = AtomicBool::new(false);
        let control = Control { deadline: None, interrupted: &stop, observer: &|_| {} };
        let start = seed(&target, Seeding::MassBisection, 3).unwrap().positions;
        assert_eq!(start[0].len(), 5000);
        let options = WvtOptions { iterations: 40, ..WvtOptions::new(3) };
        let (x, report) = wvt(KernelName::WendlandC4, &target, start, &options, &control);
        let first = report.history[0].epsilon;
        let best = report.history[report.best_iteration].epsilon;
        assert!(best < 0.1 * first, "{best} after {first}");
        let masses = target.masses(&x);
        let measured = Measured::new(KernelName::WendlandC4, &domain, &x, &masses, &vec![0.15; 5000], 64.0);
        let error = DensityError::new(&measured, &target.densities(&x), None);
        let noise = NoiseFigures::new(KernelName::WendlandC4, &measured, &domain, &masses, 64.0);
        (x, error, noise)
    })
}

#[test]
fn results_have_the_same_bits_for_any_number_of_threads() {
    let one = place(1);
    assert!(one.1.all_refitted.mean < 0.02, "{:?}", one.1);
    for threads in [2, 5] {
        let other = place(threads);
        assert!(one == other, "{threads} threads differ from one");
    }
}

#[test]
fn a_lattice_has_no_noise_and_a_random_set_has_all_of_it() {
    let domain = Domain::new([0.0; 3], [1.0; 3], [Axis::Periodic; 3], Region::Box).unwrap();
    let measure = |x: &Positions<3>| {
        let n = x[0].len();
        let masses = vec![1.0 / n as f64; n];
        let measured = Measured::new(KernelName::WendlandC4, &domain, x, &masses, &vec![0.2; n], 64.0);
        NoiseFigures::new(KernelName::WendlandC4, &measured, &domain, &masses, 64.0).all
    };
    let side = 12;
    let lattice = std::array::from_fn(|k| {
        (0..side * side * side).map(|i| ((i / [1, side, side * side][k]) % side) as f64 / side as f64).collect()
    });
    assert!(measure(&lattice) < 1e-4, "{}", measure(&lattice));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let random = std::array::from_fn(|_| (0..8000).map(|_| rng.random::<f64>()).collect());
    assert!((measure(&random) - 1.0).abs() < 0.05, "{}", measure(&random));
}
