//! Lattices of exactly N points: every particle alike in periodic boxes, planes parallel to walls elsewhere.

use crate::seeding::{Density, error, target, unit_box};
use sph::domain::{Axis, Domain, Region};
use sph::exchange::Alone;
use sph::kernel::{KernelName, support_over_spacing};
use sph_prep::metrics::{DensityError, Measured, NoiseFigures};
use sph_prep::seeding::{Seeding, seed};
use sph_prep::target::{Positions, at};

const LATTICES: [Seeding; 4] =
    [Seeding::Cubic, Seeding::CubicClosePacked, Seeding::HexagonalClosePacked, Seeding::BodyCenteredCubic];

fn uniform_density<const D: usize>(counts: [usize; 4]) {
    let domain = unit_box::<D>(Axis::Periodic);
    let density = Density(|_: &[f64; D]| 1.0);
    for (lattice, count) in LATTICES.into_iter().zip(counts) {
        let target = target(&domain, &density, count);
        let x = seed(&target, lattice, 0).unwrap().positions;
        let e = error(&target, &x, [12.0, 30.0, 100.0][D - 1]);
        // All sites are alike: densities differ by the rounding of f32 sums alone.
        assert!(e.all_refitted.max < 1e-4, "{lattice:?} {D}-D: {:?}", e.all_refitted);
        // What is left is the kernel's own bias at this neighbor number.
        assert!((e.refit_all - 1.0).abs() < 0.02, "{lattice:?} {D}-D: {}", e.refit_all);
    }
}

#[test]
fn lattices_in_periodic_boxes_have_one_density() {
    // Counts that the lattices have: squares and cubes, cells of 2 and of 4 sites.
    uniform_density::<1>([100, 100, 101, 100]);
    uniform_density::<2>([400, 440, 440, 440]);
    uniform_density::<3>([1728, 2048, 1440, 2000]);
}

fn box_of<const D: usize>(edges: [f64; D], axis: Axis) -> Domain<D> {
    Domain::new([0.0; D], edges, [axis; D], Region::Box).unwrap()
}

/// Vectors from particle `i` to all others and their images within `reach`.
fn surroundings<const D: usize>(domain: &Domain<D>, x: &Positions<D>, i: usize, reach: f64) -> Vec<[f64; D]> {
    let extent = domain.extent();
    let copies: [i64; D] = extent.map(|e| (reach / e).ceil() as i64 + 1);
    let here = at(x, i);
    let mut found = Vec::new();
    for j in 0..x[0].len() {
        let there = at(x, j);
        let mut image = copies.map(|c| -c);
        loop {
            let d: [f64; D] = std::array::from_fn(|k| there[k] - here[k] + image[k] as f64 * extent[k]);
            let r2 = d.iter().map(|v| v * v).sum::<f64>();
            if r2 > 0.0 && r2 < reach * reach {
                found.push(d);
            }
            let Some(k) = (0..D).find(|&k| image[k] < copies[k]) else { break };
            image[k] += 1;
            for before in 0..k {
                image[before] = -copies[before];
            }
        }
    }
    found
}

/// Whether all particles have neighbors at the same distances, and, where every site is a center of inversion, no force between
/// neighbors is left; both to rounding.
fn every_particle_is_alike<const D: usize>(lattice: Seeding, edges: [f64; D], count: usize) {
    let domain = box_of(edges, Axis::Periodic);
    let value = 1.0 / domain.volume();
    let density = Density(move |_: &[f64; D]| value);
    let x = seed(&target(&domain, &density, count), lattice, 0).unwrap().positions;
    assert!(x.iter().all(|x| x.len() == count));
    let case = format!("{lattice:?} {edges:?} N = {count}");
    let reach = 2.3 * (domain.volume() / count as f64).powf(1.0 / D as f64);
    let weight = |r2: f64| (1.0 - r2 / (reach * reach)).powi(4);
    let length2 = |d: &[f64; D]| d.iter().map(|v| v * v).sum::<f64>();
    let (mut first, mut all): (Option<f64>, Option<Vec<f64>>) = (None, None);
    for i in (0..count).step_by(count.div_ceil(40)) {
        let around = surroundings(&domain, &x, i, reach);
        let sum: f64 = around.iter().map(|d| weight(length2(d))).sum();
        assert!((sum - *first.get_or_insert(sum)).abs() <= 1e-9 * (1.0 + sum), "{case}: density");
        let mut distances: Vec<f64> = around.iter().map(|d| length2(d).sqrt()).filter(|r| *r < 0.9 * reach).collect();
        distances.sort_by(f64::total_cmp);
        let all = all.get_or_insert_with(|| distances.clone());
        // One at the very end may be on either side of it.
        for (a, b) in distances.iter().zip(all.iter()) {
            assert!((a - b).abs() < 1e-9 * reach, "{case}: {a} {b}");
        }
        if lattice != Seeding::HexagonalClosePacked || D < 3 {
            for k in 0..D {
                let force: f64 = around.iter().map(|d| weight(length2(d)) * d[k]).sum();
                assert!(force.abs() < 1e-9 * reach * (1.0 + sum), "{case}: {force}");
            }
        }
    }
}

#[test]
fn particles_of_a_lattice_in_a_periodic_box_are_all_alike_for_any_number_of_them() {
    for lattice in LATTICES {
        for count in [1, 2, 3, 5, 17, 64, 97, 200, 509] {
            for edges in [[1.0, 1.0, 1.0], [1.0, 3.0, 0.2], [1.0, 0.37, 0.61]] {
                every_particle_is_alike(lattice, edges, count);
            }
            every_particle_is_alike(lattice, [1.0, 1.0], count);
            every_particle_is_alike(lattice, [0.3, 2.0], count);
            every_particle_is_alike(lattice, [0.7], count);
        }
    }
}

/// As runs measure it: f32 sums over 64 neighbors.
#[test]
fn lattices_of_a_prime_number_of_particles_have_one_density_and_no_force() {
    let domain = box_of([1.0, 3.0, 0.2], Axis::Periodic);
    let density = Density(|_: &[f64; 3]| 1.0 / 0.6);
    let count = 10_007;
    let target = target(&domain, &density, count);
    let masses = vec![1.0 / count as f64; count];
    for lattice in LATTICES {
        let seeded = seed(&target, lattice, 0).unwrap();
        let support = support_over_spacing(3, 64.0) * target.spacing(count as f64 / 0.6);
        let x = &seeded.positions;
        let measured = Measured::new(KernelName::WendlandC4, &domain, x, &masses, &vec![support; count], 64.0);
        let error = DensityError::new(&measured, &target.densities(x), None).all_refitted;
        let noise = NoiseFigures::new(KernelName::WendlandC4, &measured, &domain, &masses, 64.0).all;
        assert!(error.max < 1e-4 && noise < 1e-4, "{lattice:?}: {error:?} {noise}");
        let said = seeded.notes.join("; ");
        assert!(said.contains("so that exactly 10007 points fit the periodic box"), "{said}");
        assert_eq!(said.contains("ABCABC"), lattice == Seeding::HexagonalClosePacked, "{said}");
    }
}

#[test]
fn the_scale_of_a_box_changes_nothing_about_its_lattice() {
    for lattice in LATTICES {
        let of = |scale: f64| {
            let domain = box_of([scale, 3.0 * scale, 0.5 * scale], Axis::Periodic);
            let value = 1.0 / domain.volume();
            let density = Density(move |_: &[f64; 3]| value);
            let x = seed(&target(&domain, &density, 997), lattice, 0).unwrap().positions;
            x.map(|axis| axis.iter().map(|v| v / scale).collect::<Vec<_>>())
        };
        // A power of two changes no digit.
        assert!(of(1.0) == of(2.0_f64.powi(40)), "{lattice:?}");
        let far = of(1.3e27);
        for (a, b) in of(1.0).iter().flatten().zip(far.iter().flatten()) {
            assert!((a - b).abs() < 1e-12, "{lattice:?}: {a} {b}");
        }
    }
}

#[test]
fn lattices_that_a_box_holds_upright_are_left_so_without_a_note() {
    let domain = unit_box::<3>(Axis::Periodic);
    let density = Density(|_: &[f64; 3]| 1.0);
    for (lattice, count) in LATTICES.into_iter().zip([1000, 4 * 512, 0, 2 * 729]).filter(|(_, count)| *count > 0) {
        let seeded = seed(&target(&domain, &density, count), lattice, 0).unwrap();
        assert!(seeded.notes.is_empty(), "{lattice:?}: {:?}", seeded.notes);
        let mut heights = seeded.positions[2].clone();
        heights.sort_by(f64::total_cmp);
        heights.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        assert_eq!(heights.len(), [10, 16, 0, 18][LATTICES.iter().position(|l| *l == lattice).unwrap()]);
    }
}

/// Planes stay parallel to walls; columns take what is too many, and are quieter than sites left empty.
#[test]
fn between_walls_a_lattice_has_columns_of_one_site_less() {
    let domain = unit_box::<3>(Axis::REFLECTING);
    let density = Density(|_: &[f64; 3]| 1.0);
    let target = target(&domain, &density, 997);
    let seeded = seed(&target, Seeding::Cubic, 0).unwrap();
    assert_eq!(
        seeded.notes,
        ["the lattice has 10 x 10 x 10 cells; its 100 columns along x hold 3 sites less in all, evenly spaced in each"]
    );
    let masses = vec![1.0 / 997.0; 997];
    let noise = |x: &Positions<3>| {
        let measured = Measured::new(KernelName::WendlandC4, &domain, x, &masses, &vec![0.25; 997], 64.0);
        NoiseFigures::new(KernelName::WendlandC4, &measured, &domain, &masses, 64.0).all
    };
    let kept = noise(&seeded.positions);
    let mut holes: Positions<3> = std::array::from_fn(|_| Vec::new());
    for site in (0..1000).filter(|site| ![137, 555, 861].contains(site)) {
        for k in 0..3 {
            holes[k].push(((site / 10_usize.pow(k as u32) % 10) as f64 + 0.5) / 10.0);
        }
    }
    let left_empty = noise(&holes);
    println!("columns {kept:.4}, empty sites {left_empty:.4}");
    assert!(kept < left_empty && kept > 0.0, "{kept} {left_empty}");
}

/// Where a lattice is stretched, neighbors share the force that grad H and the kernel's bias leave; what random points feel
/// differs from one to the next.
#[test]
fn the_noise_of_a_stretched_lattice_is_systematic_and_that_of_random_points_is_not() {
    let domain = unit_box::<3>(Axis::Periodic);
    let tau = std::f64::consts::TAU;
    let wave = Density(move |x: &[f64; 3]| 1.0 + 0.5 * (tau * x[0]).sin());
    let parts = |seeding: Seeding| {
        let target = target(&domain, &wave, 8000);
        let x = seed(&target, seeding, 3).unwrap().positions;
        let masses = target.masses(&x);
        let measured = Measured::new(KernelName::WendlandC4, &domain, &x, &masses, &vec![0.12; 8000], 64.0);
        let figures = NoiseFigures::with_each(
            &Alone,
            KernelName::WendlandC4,
            (&measured, &measured.interior),
            &domain,
            &masses,
            64.0,
        )
        .0;
        let parts = figures.parts.unwrap();
        // All particles are taken, and all are in the interior.
        let whole = parts.systematic.hypot(parts.scatter);
        assert!((whole / figures.interior.unwrap() - 1.0).abs() < 1e-9, "{seeding:?}: {figures:?}");
        parts
    };
    let lattice = parts(Seeding::Cubic);
    // Of a wave of 20 spacings a mean over a support radius of 2.5 keeps most.
    assert!(lattice.systematic > 1.5 * lattice.scatter, "{lattice:?}");
    let random = parts(Seeding::Random);
    assert!(random.systematic < 0.35 * random.scatter, "{random:?}");
}

#[test]
fn short_names_are_taken_for_the_long_ones() {
    for (short, name) in [
        ("fcc", "cubic-close-packed"),
        ("hcp", "hexagonal-close-packed"),
        ("bcc", "body-centered-cubic"),
        ("cubic", "cubic"),
    ] {
        let parsed: Seeding = serde_json::from_str(&format!("\"{short}\"")).unwrap();
        assert_eq!((parsed.method().name, Seeding::by_name(short)), (name, Some(parsed)));
    }
    assert_eq!(Seeding::by_name(""), None);
}
