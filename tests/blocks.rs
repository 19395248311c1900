//! Particles that are made block by block: seeds that are those of a whole run whatever the blocks are, and boxes repeated
//! and mapped to a target.

#![cfg(all(feature = "gadget", feature = "swift", feature = "cli"))]

use crate::cases::first;
use crate::cli::support::{Folder, sph_prep};
use crate::seeding::{Density, target, unit_box};
use sph::domain::{Axis, Domain, Wall};
use sph::geometry::distance;
use sph::kernel::{KernelName, default_kernel_neighbors, support_over_spacing};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, FORMATS, FieldRequest, FileContent, ParticleFile, ParticleStream, Values, read};
use sph_prep::field::{AnalyticField, ScalarField};
use sph_prep::metrics::{Measured, Patches};
use sph_prep::run::replicate::Repeated;
use sph_prep::seeding::{Blockwise, Seeding, blocks, seed, seed_block};
use sph_prep::target::{Surroundings, Target, at};
use sph_prep::{Control, Scene, place};
use std::collections::BTreeSet;
use std::path::Path;

/// The same seeds for any blocks, which are where they say.
fn blocks_make_up_the_whole<const D: usize>(target: &Target<'_, D>) {
    let whole = seed(target, Seeding::MassBisection, 11).unwrap().positions;
    for count in first(2, [3, 8, 1, 2]) {
        let all = blocks(target, count).unwrap();
        assert_eq!(all.len(), count);
        let mut next = 0;
        for block in &all {
            assert_eq!(block.particles.start, next, "{count} blocks");
            next = block.particles.end;
            assert!(block.particles.len().abs_diff(target.count / count) <= 1);
            let own = seed_block(target, 11, block.particles.clone()).unwrap();
            for k in 0..D {
                let there = &whole[k][block.particles.clone()];
                assert!(own[k].iter().zip(there).all(|(a, b)| a.to_bits() == b.to_bits()), "{count} blocks, axis {k}");
            }
            // Seeds are jittered by a tenth of a spacing along each axis.
            for i in 0..own[0].len() {
                let x = at(&own, i);
                let slack = 0.11 * target.spacing(target.number_density(&x)) * (D as f64).sqrt();
                let near = |corners: &[[f64; D]; 2]| {
                    let nearest = std::array::from_fn(|k| x[k].clamp(corners[0][k], corners[1][k]));
                    let away = target.domain.displacement(&x, &nearest);
                    away.iter().map(|v| v * v).sum::<f64>().sqrt() <= slack
                };
                assert!(block.boxes.iter().any(near), "{count} blocks: {x:?} is in none of {:?}", block.boxes);
            }
        }
        assert_eq!(next, target.count);
    }
    // Any numbers do, and any ranges, not those of blocks alone.
    let some = [0, 7, 8, 8, target.count / 2, target.count - 1];
    let found = Blockwise::new(target, Seeding::MassBisection, 11).unwrap().each(&some).unwrap();
    assert!(found == some.map(|i| at(&whole, i)), "{found:?}");
    for range in [0..1, 5..600, target.count - 1..target.count, 40..40] {
        let own = seed_block(target, 11, range.clone()).unwrap();
        assert!((0..D).all(|k| own[k] == whole[k][range.clone()]), "{range:?}");
    }
}

fn in_dimension<const D: usize>() {
    let gaussian = |x: &[f64; D]| 1.0 + 99.0 * (-30.0 * distance(x, &[0.5; D]).powi(2)).exp();
    for axis in [Axis::Periodic, Axis::OPEN] {
        let domain = unit_box::<D>(axis);
        blocks_make_up_the_whole(&target(&domain, &Density(|_: &[f64; D]| 1.0), 1000));
        let field = Density(gaussian);
        let integral = (0..4096).map(|i| field.value(&point(i))).sum::<f64>() / 4096.0;
        blocks_make_up_the_whole(&Target { resolution_integral: integral, ..target(&domain, &field, 1500) });
    }
    // A polytrope.
    let ball = Domain::ball([0.0; D], 0.5, Wall::Open).unwrap();
    let star = Density(|x: &[f64; D]| {
        let r = 2.0 * std::f64::consts::PI * distance(x, &[0.0; D]);
        if r > 0.0 { (r.sin() / r).max(0.0) } else { 1.0 }
    });
    blocks_make_up_the_whole(&target(&ball, &star, 1200));
}

fn point<const D: usize>(i: usize) -> [f64; D] {
    std::array::from_fn(|k| (0.5 + i as f64 * [0.754_877_666, 0.569_840_296, 0.682_327_803][k]).fract())
}

#[test]
fn seeds_of_blocks_are_those_of_the_whole_to_the_bit() {
    in_dimension::<1>();
    in_dimension::<2>();
    in_dimension::<3>();
}

/// Any blocks of shells are those of the whole, of one body and of two with a gap between them.
fn shells_of_blocks_are_those_of_the_whole<const D: usize>() {
    let ball = Domain::ball([0.0; D], 0.5, Wall::Open).unwrap();
    let star = Density(|x: &[f64; D]| (1.0 - 4.0 * distance(x, &[0.0; D]).powi(2)).max(0.0));
    let two = AnalyticField::<D>::new("density", "if(r < 0.2, 3, if(r > 0.3, 1, 0))", [0.0; D]).unwrap();
    let one_body = target(&ball, &star, 2000);
    let two_bodies = target(&ball, &two, 2000);
    let regions = two_bodies.find_regions(None);
    assert_eq!(regions.as_ref().map(|r| r.counts(2000).len()), Some(2));
    for target in [one_body, two_bodies.with_regions(regions.as_ref())] {
        let able = if D == 3 { &[Seeding::Shells, Seeding::EqualAreaShells][..] } else { &[Seeding::Shells] };
        for &seeding in able {
            let whole = seed(&target, seeding, 5).unwrap().positions;
            let blocks = Blockwise::new(&target, seeding, 5).unwrap();
            for size in [1, 7, 333, 1999, 2000] {
                let mut first = 0;
                while first < 2000 {
                    let range = first..(first + size).min(2000);
                    let own = blocks.positions(range.clone()).unwrap();
                    let alike = (0..D).all(|k| own[k] == whole[k][range.clone()]);
                    assert!(alike, "{D}-D, {seeding:?}: {range:?}");
                    first = range.end;
                }
            }
        }
    }
}

#[test]
fn shells_are_made_block_by_block() {
    shells_of_blocks_are_those_of_the_whole::<2>();
    shells_of_blocks_are_those_of_the_whole::<3>();
}

/// What is measured about some places is what all particles have there, and nothing near them is missed.
fn patches_are_those_of_the_whole<const D: usize>(target: &Target<'_, D>, seeding: Seeding) {
    let kernel = KernelName::WendlandC4;
    let neighbors = default_kernel_neighbors(D);
    let all = seed(target, seeding, 5).unwrap().positions;
    let blocks = Blockwise::new(target, seeding, 5).unwrap();
    let masses = target.masses(&all);
    let ratio = support_over_spacing(D, neighbors);
    let guess: Vec<f64> = target.number_densities(&all).iter().map(|n| target.support(*n, ratio)).collect();
    let whole = Measured::new(kernel, target.domain, &all, &masses, &guess, neighbors);
    let away = |x: &[f64; D], y: &[f64; D]| target.domain.displacement(x, y).iter().map(|d| d * d).sum::<f64>().sqrt();
    let mut patches = Patches::new(kernel, neighbors);
    let (mut off, mut count) = (0.0, 0);
    for number in [0, 7, target.count / 3, target.count / 2, target.count - 1] {
        let x = at(&all, number);
        for reach in [0.01, 0.13, 0.6] {
            let near = blocks.near(&[Surroundings { x, reach }]).unwrap().remove(0);
            let given: BTreeSet<[u64; D]> = (0..near[0].len()).map(|i| at(&near, i).map(f64::to_bits)).collect();
            assert_eq!(given.len(), near[0].len(), "none is given twice");
            let is_given = |i: &usize| given.contains(&at(&all, *i).map(f64::to_bits));
            let missed = (0..target.count).find(|i| away(&x, &at(&all, *i)) <= reach && !is_given(i));
            assert_eq!(missed, None, "{D}-D, {seeding:?}: about {number}, within {reach}");
        }
        patches.add(target, &[x], |asked| blocks.near(asked)).unwrap();
        let own = target.support(target.number_density(&x), ratio);
        for i in (0..target.count).filter(|i| away(&x, &at(&all, *i)) <= own) {
            off += (whole.sums[i].weighted / target.density.value(&at(&all, i)) - 1.0).abs();
            count += 1;
        }
    }
    let found = patches.figures().unwrap();
    assert_eq!((found.places, found.all.particles), (5, count), "{D}-D, {seeding:?}");
    let mean = off / count as f64;
    assert!((found.all.mean / mean - 1.0).abs() < 1e-4, "{D}-D, {seeding:?}: {} in place of {mean}", found.all.mean);
}

#[test]
fn seeds_are_measured_in_patches() {
    fn in_dimension<const D: usize>() {
        let gaussian = Density(|x: &[f64; D]| 1.0 + 9.0 * (-30.0 * distance(x, &[0.5; D]).powi(2)).exp());
        for axis in [Axis::Periodic, Axis::OPEN] {
            let domain = unit_box::<D>(axis);
            patches_are_those_of_the_whole(&target(&domain, &gaussian, 1000), Seeding::MassBisection);
        }
        if D == 1 {
            return;
        }
        let ball = Domain::ball([0.1; D], 0.5, Wall::Open).unwrap();
        let star = Density(|x: &[f64; D]| 1.1 - 4.0 * distance(x, &[0.1; D]).powi(2));
        patches_are_those_of_the_whole(&target(&ball, &star, 1500), Seeding::Shells);
        if D == 3 {
            patches_are_those_of_the_whole(&target(&ball, &star, 1500), Seeding::EqualAreaShells);
        }
    }
    in_dimension::<1>();
    in_dimension::<2>();
    in_dimension::<3>();
}

/// Files of parts are those of a run with the same seeding; what goes otherwise is refused.
#[test]
fn seeds_on_shells_are_written_in_parts() {
    let folder = Folder::new();
    let scene = folder.file("star.yaml", STAR).display().to_string();
    let path = |name: &str| folder.path(name).display().to_string();
    let common = ["-n", "3000", "--seeding", "equal-area-shells", "--to", "gadget"];
    let seeds = ["seed", "--scene", &scene, "--out", &path("parts.h5"), "--files", "2"];
    let whole = ["--scene", &scene, "--out", &path("whole.h5"), "--iterations", "0", "--polish", "none"];
    for args in [&seeds[..], &whole[..]] {
        let outcome = sph_prep(&[args, &common[..]].concat());
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        let tells = [
            "the seeding is equal-area-shells",
            "off the target as the kernel sees it",
            "closest pair there",
            "s in all",
        ];
        let told = tells.iter().all(|words| outcome.stdout.contains(words));
        assert!(told || args[0] != "seed", "{}", outcome.stdout);
    }
    let [parts, whole] = ["parts.h5", "whole.h5"].map(|name| positions::<3>(&particles(&folder.path(name))));
    let key = |x: &[Vec<f64>; 3], i: usize| [x[0][i], x[1][i], x[2][i]].map(f64::to_bits);
    let [mut a, mut b] = [&parts, &whole].map(|x| (0..3000).map(|i| key(x, i)).collect::<Vec<_>>());
    a.sort_unstable();
    b.sort_unstable();
    assert!(a == b);
    let alone = sph_prep(&["seed", "--scene", &scene, "-n", "1", "--dry-run"]);
    assert!(alone.stdout.contains("density at 1 particles") && !alone.stdout.contains("inf"), "{}", alone.stdout);
    let outcome = sph_prep(&["seed", "--scene", &scene, "--out", &path("no.h5"), "--seeding", "glass"]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("mass-bisection, shells"), "{}", outcome.stderr);
}

const STAR: &str = "input: {expression: 'max(1 - r*r, 0) + 0.01'}
domain: {ball: {center: [0, 0, 0], radius: 1}}
thermal: {internal_energy: 1}
seed: 3
";

fn particles(path: &Path) -> ParticleFile {
    match read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(p) => p,
        FileContent::Field(_) => panic!("a field"),
    }
}

fn positions<const D: usize>(file: &ParticleFile) -> [Vec<f64>; D] {
    let x = &file.species[0].table.column(names::COORDINATES).unwrap().values;
    std::array::from_fn(|k| (0..x.len() / D).map(|i| x.get(i * D + k)).collect())
}

#[test]
fn parts_by_processes_of_their_own_are_the_files_of_one_and_the_seeds_of_a_run() {
    let folder = Folder::new();
    let scene = folder.file("star.yaml", STAR);
    let run = |args: &[&str]| {
        let outcome = sph_prep(args);
        assert_eq!(outcome.code, Some(0), "{args:?}: {}", outcome.stderr);
        outcome.stdout
    };
    let path = |name: &str| folder.path(name).display().to_string();
    let scene = scene.display().to_string();
    let common = ["seed", "--scene", &scene, "-n", "2000", "--files", "3", "--seeding", "mass-bisection"];
    let with = |more: &[&str]| -> Vec<String> { common.iter().chain(more).map(|s| (*s).to_owned()).collect() };
    let call = |more: &[&str]| {
        let args = with(more);
        run(&args.iter().map(String::as_str).collect::<Vec<_>>())
    };
    call(&["--out", &path("out/all.h5"), "--to", "gadget"]);
    for part in ["2", "0", "1"] {
        call(&["--out", &path("out/own.h5"), "--to", "gadget", "--part", part, "--threads", "1"]);
        let bytes = |name: &str| std::fs::read(folder.path(&format!("out/{name}.{part}.h5"))).unwrap();
        assert!(bytes("all") == bytes("own"), "part {part}");
    }
    let outcome = sph_prep(&with(&["--out", &path("out/own.h5"), "--to", "gadget", "--part", "3"]));
    assert!(outcome.code != Some(0) && outcome.stderr.contains("no part 3 of 3"), "{}", outcome.stderr);

    let plain = path("out/plain.h5");
    run(&[
        "--scene",
        &scene,
        "-n",
        "2000",
        "--iterations",
        "0",
        "--polish",
        "none",
        "--out",
        &plain,
        "--quiet",
        "--to",
        "gadget",
        "--seeding",
        "mass-bisection",
    ]);
    let sorted = |name: &str| {
        let file = particles(&folder.path(name));
        let [x, y, z] = positions::<3>(&file);
        let mut all: Vec<[u64; 3]> = (0..x.len()).map(|i| [x[i], y[i], z[i]].map(f64::to_bits)).collect();
        all.sort_unstable();
        (all, file)
    };
    let ((parts, in_parts), (plain, in_one)) = (sorted("out/own.h5"), sorted("out/plain.h5"));
    assert!(parts == plain, "the same places");
    assert_eq!((in_parts.header.box_size, parts.len()), (in_one.header.box_size, 2000));
    let ids = in_parts.species[0].table.column(names::PARTICLE_IDS).unwrap().values.clone();
    assert_eq!(ids, Values::I64((1..=2000).collect()));
    let mass = |f: &ParticleFile| f.species[0].table.column(names::MASSES).unwrap().values.to_f64().iter().sum::<f64>();
    assert!((mass(&in_parts) / mass(&in_one) - 1.0).abs() < 1e-6);
}

#[test]
fn a_dry_run_counts_and_hashes_alike_for_any_number_of_threads_and_beyond_32_bits() {
    let folder = Folder::new();
    let scene = folder.file("star.yaml", STAR);
    let scene = scene.display().to_string();
    let hash = |threads: &str, n: &str| {
        let outcome = sph_prep(&["seed", "--scene", &scene, "-n", n, "--dry-run", "--threads", threads]);
        assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
        let lines: Vec<&str> = outcome.stdout.lines().filter(|line| !line.ends_with(" s in all")).collect();
        lines.join("\n")
    };
    let (one, two) = (hash("1", "3000"), hash("2", "3000"));
    assert!(one == two && one.contains("3000 particles were made"), "{one} {two}");
    assert!(hash("2", "3001") != one.replace("3000", "3001"));
    // One of so many files that each has a handful of 2^33 particles; none but it is made.
    let out = folder.path("out/ic.h5").display().to_string();
    let many = (1_u64 << 33).to_string();
    let args = ["seed", "--scene", &scene, "-n", &many, "--files", "800000", "--part", "799999", "--out", &out];
    let outcome = sph_prep(&[&args[..], &["--to", "gadget"]].concat());
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let path = folder.path("out/ic.799999.h5");
    let file = sph_formats::common::hdf5_read::Reader::open(&path, "test").unwrap();
    let total = file.group_attributes("Header").unwrap().numbers("NumPart_Total").unwrap()[0];
    let ids = file.numbers("PartType0/ParticleIDs").unwrap().unwrap().1;
    assert_eq!(total, (1_u64 << 33) as f64);
    let Values::I64(ids) = ids else { panic!("no integers") };
    assert_eq!(ids.last(), Some(&(1_i64 << 33)));
    assert!(ids.len() > 10_000 && ids.windows(2).all(|w| w[1] == w[0] + 1));
}

/// A relaxed uniform periodic box.
fn tile<const D: usize>(n: usize) -> ParticleFile {
    let ends = ["[[0], [1]]", "[[0, 0], [1, 1]]", "[[0, 0, 0], [1, 1, 1]]"][D - 1];
    let scene = format!(
        "input: {{expression: '1'}}\ndomain: {{box: {ends}, boundary: [periodic]}}\nparticles: {n}\nthermal: {{internal_energy: 2}}\noutput: {{format: gadget}}\n"
    );
    place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap().0
}

fn copies_keep_the_arrangement<const D: usize>(n: usize, times: &[usize]) {
    let tile = tile::<D>(n);
    let own = tile.species[0].table.clone();
    let repeated = Repeated::new(tile, times).unwrap();
    let count = n * times.iter().product::<usize>();
    assert_eq!(repeated.counts(), [count, 0, 0, 0, 0, 0]);
    let all = repeated.rows(0, 0..count, &|_| true).unwrap();
    // Rows in any blocks are the same.
    for rows in [0..1, n - 1..n + 2, count / 3..count / 2, count - 1..count] {
        let some = repeated.rows(0, rows.clone(), &|_| true).unwrap();
        for (a, b) in some.columns.iter().zip(&all.columns) {
            for (i, row) in rows.clone().enumerate() {
                for c in 0..a.components {
                    assert_eq!(a.values.get(i * a.components + c), b.values.get(row * b.components + c), "{}", a.name);
                }
            }
        }
    }
    let Values::I64(mut ids) = all.column(names::PARTICLE_IDS).unwrap().values.clone() else { panic!("no integers") };
    ids.sort_unstable();
    assert_eq!(ids, (1..=count as i64).collect::<Vec<_>>());
    // What the copies sum is what the box sums: seams are no seams.
    let hi: [f64; D] = std::array::from_fn(|k| times[k] as f64);
    let domain = Domain::new([0.0; D], hi, [Axis::Periodic; D], sph::domain::Region::Box).unwrap();
    let header = repeated.header();
    let positions = std::array::from_fn(|k| {
        (0..count).map(|i| all.column(names::COORDINATES).unwrap().values.get(i * D + k)).collect()
    });
    assert_eq!(header.box_size[..D], hi);
    let (kernel, neighbors) = (Scene::default().kernel(), Scene::default().kernel_neighbors(D));
    let guess = vec![own.column(names::SUPPORT_RADIUS).unwrap().values.get(0); count];
    let measured = Measured::new(kernel, &domain, &positions, &vec![1.0 / n as f64; count], &guess, neighbors);
    let stated = own.column(names::DENSITY).unwrap();
    for i in 0..count {
        let (found, expected) = (measured.sums[i].weighted, stated.values.get(i % n));
        // Sums are in f32.
        assert!((found / expected - 1.0).abs() < 1e-4, "{i} of {times:?}: {found} {expected}");
    }
}

#[test]
fn a_repeated_box_sums_what_the_box_does() {
    copies_keep_the_arrangement::<1>(64, &[5]);
    copies_keep_the_arrangement::<2>(256, &[3, 2]);
    copies_keep_the_arrangement::<3>(512, &[2, 1, 3]);
}

/// Writes a relaxed box, repeats it onto a scene and reads the result.
fn replicated(tile: &ParticleFile, times: &str, scene: &str, more: &[&str]) -> Result<(ParticleFile, String), String> {
    let folder = Folder::new();
    let (boxed, scene) = (folder.path("box.h5"), folder.file("target.yaml", scene));
    sph_prep::write(
        FORMATS,
        &boxed,
        Some("gadget"),
        tile,
        sph_prep::WriteOptions { compression: 0, double_precision: true },
    )
    .unwrap();
    let out = folder.path("out/ic.h5");
    let [boxed, scene, path] = [&boxed, &scene, &out].map(|p| p.display().to_string());
    let args = ["replicate", &boxed, "--times", times, "--scene", &scene, "--out", &path, "--to", "gadget", "--double"];
    let outcome = sph_prep(&[&args[..], more].concat());
    if outcome.code != Some(0) {
        assert_eq!(folder.outputs().len(), 0);
        return Err(outcome.stderr);
    }
    Ok((particles(&out), outcome.stdout))
}

#[test]
fn copies_mapped_to_a_star_have_its_mass_within_every_radius() {
    let (star, told) = replicated(&tile::<3>(500), "4,4,4", STAR, &["--files", "3"]).unwrap();
    let [x, y, z] = positions::<3>(&star);
    let n = x.len();
    assert!(told.contains("of 32000 particles are in the domain"), "{told}");
    // A ball within its cube.
    assert!((n as f64 / 32_000.0 / (std::f64::consts::PI / 6.0) - 1.0).abs() < 0.01, "{n}");
    let middle = 0.5 * star.header.box_size[0];
    let radius: Vec<f64> = (0..n).map(|i| distance(&[x[i], y[i], z[i]], &[middle; 3])).collect();
    let masses = star.species[0].table.column(names::MASSES).unwrap().values.to_f64();
    let enclosed = |r: f64| 4.0 * std::f64::consts::PI * (r.powi(3) * 1.01 / 3.0 - r.powi(5) / 5.0);
    assert!((masses.iter().sum::<f64>() / enclosed(1.0) - 1.0).abs() < 1e-5);
    for r in [0.3, 0.5, 0.7, 0.9, 0.97] {
        let inside: f64 = (0..n).filter(|&i| radius[i] < r).map(|i| masses[i]).sum();
        // Within a shell as thick as a tenth of the spacing, as for any even arrangement.
        let shell = 0.1 * (4.0 / n as f64).cbrt() * 3.0 / r;
        assert!((inside / enclosed(r) - 1.0).abs() < shell, "{r}: {} within {shell}", inside / enclosed(r) - 1.0);
    }
    let density = star.species[0].table.column(names::DENSITY).unwrap();
    for i in (0..n).step_by(97) {
        let expected = (1.0 - radius[i] * radius[i]).max(0.0) + 0.01;
        assert!((density.values.get(i) / expected - 1.0).abs() < 1e-3, "{} at {}", density.values.get(i), radius[i]);
    }
}

#[test]
fn copies_mapped_to_layers_have_their_mass_below_every_height() {
    for (d, times, ends, n) in
        [(1, "7", "[[0], [2]]", 50), (2, "4,2", "[[0, 0], [2, 1]]", 400), (3, "2,2,4", "[[0, 0, 0], [1, 1, 2]]", 800)]
    {
        let axis = ["x", "x", "z"][d - 1];
        let scene = format!(
            "input: {{expression: 'exp(-2*{axis})'}}\ndomain: {{box: {ends}, boundary: [reflecting]}}\nthermal: {{internal_energy: 1}}\noutput: {{box_factor: 1}}\n"
        );
        let tile = match d {
            1 => tile::<1>(n),
            2 => tile::<2>(n),
            _ => tile::<3>(n),
        };
        // GADGET's box has one edge, SWIFT's three.
        let made = if d == 1 { replicated(&tile, times, &scene, &[]) } else { with_swift(&tile, times, &scene) };
        let (layers, told) = made.unwrap();
        assert!(!told.contains("stretched") && !told.contains("are in the domain"), "{told}");
        let x = &layers.species[0].table.column(names::COORDINATES).unwrap().values;
        let count = layers.species[0].table.count;
        assert_eq!(count, n * times.split(',').map(|t| t.parse::<usize>().unwrap()).product::<usize>());
        for h in [0.2, 0.5, 1.0, 1.7] {
            let below = (0..count).filter(|i| x.get(i * d + if d == 3 { 2 } else { 0 }) < h).count();
            let expected = (1.0 - (-2.0 * h).exp()) / (1.0 - (-4.0_f64).exp());
            let spacing = (n as f64).powf(-1.0 / d as f64) / if d == 1 { 7.0 } else { 4.0 };
            let share = below as f64 / count as f64;
            assert!((share - expected).abs() < 0.5 * spacing, "{d}-D below {h}: {share}, not {expected}");
        }
    }
}

fn with_swift(tile: &ParticleFile, times: &str, scene: &str) -> Result<(ParticleFile, String), String> {
    let folder = Folder::new();
    let (boxed, scene, out) = (folder.path("box.h5"), folder.file("target.yaml", scene), folder.path("out/ic.hdf5"));
    sph_prep::write(FORMATS, &boxed, Some("gadget"), tile, sph_prep::WriteOptions::default()).unwrap();
    let [boxed, scene, path] = [&boxed, &scene, &out].map(|p| p.display().to_string());
    let outcome =
        sph_prep(&["replicate", &boxed, "--times", times, "--scene", &scene, "--out", &path, "--to", "swift"]);
    if outcome.code == Some(0) { Ok((particles(&out), outcome.stdout)) } else { Err(outcome.stderr) }
}

#[test]
fn what_cannot_be_repeated_or_mapped_says_why() {
    let tile = tile::<3>(216);
    let uniform = "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nthermal: {internal_energy: 1}\n";
    let open = ParticleFile {
        header: sph_formats::RunHeader { periodic: [true, false, true], ..tile.header.clone() },
        ..tile.clone()
    };
    let told = |tile: &ParticleFile, times: &[usize]| Repeated::new(tile.clone(), times).unwrap_err().to_string();
    assert!(told(&open, &[1, 2, 1]).contains("along y, where it is not periodic"));
    assert!(Repeated::new(open, &[2, 1, 3]).is_ok());
    for times in [&[2, 2][..], &[2, 2, 0], &[], &[2, 2, 2, 2]] {
        assert!(told(&tile, times).contains("expected 3 numbers from 1 on"));
    }
    assert!(told(&tile, &[1 << 20, 1 << 20, 1]).contains("copies"));
    assert!(told(&tile, &[usize::MAX, 2, 2]).contains("copies"));
    let mut far = tile.clone();
    let x = far.species[0].table.columns.iter_mut().find(|c| c.name == names::COORDINATES).unwrap();
    let mut values = x.values.to_f64();
    values[4] = f64::NAN;
    x.values = Values::F64(values);
    assert!(told(&far, &[1, 1, 1]).contains("particle 1 has NaN"));

    let folder = Folder::new();
    let boxed = folder.path("box.h5");
    sph_prep::write(FORMATS, &boxed, Some("gadget"), &tile, sph_prep::WriteOptions::default()).unwrap();
    let before = std::fs::read(&boxed).unwrap();
    let boxed = boxed.display().to_string();
    let outcome = sph_prep(&["replicate", &boxed, "--times", "2,2,2", "--out", &boxed]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("itself"), "{}", outcome.stderr);
    assert!(std::fs::read(&boxed).unwrap() == before);

    // What is dropped is told, unless it is nothing.
    let mut moving = tile.clone();
    moving.species[0].table.columns.retain(|c| c.name != names::VELOCITIES);
    for (name, value) in [(names::VELOCITIES, 0.0), ("Dye", 0.5)] {
        let values = Values::F64(vec![value; if name == "Dye" { 216 } else { 648 }]);
        let (name, components) = (name.to_owned(), values.len() / 216);
        let like = moving.species[0].table.column(names::DENSITY).unwrap().clone();
        moving.species[0].table.columns.push(Column { name, components, values, ..like });
    }
    let (mapped, told) = replicated(&moving, "2,2,2", uniform, &[]).unwrap();
    assert!(
        told.contains("Dye") && !told.contains("Velocities,") && mapped.species[0].table.column("Dye").is_none(),
        "{told}"
    );

    let refused = |tile: &ParticleFile, scene: &str| replicated(tile, "2,2,2", scene, &[]).unwrap_err();
    let mut uneven = tile.clone();
    let rho = uneven.species[0].table.columns.iter_mut().find(|c| c.name == names::DENSITY).unwrap();
    rho.values = Values::F64((0..216).map(|i| 1.0 + f64::from(i) / 216.0).collect());
    assert!(refused(&uneven, uniform).contains("expected at most 5 %"));
    let heap = uniform.replace("'1'", "'1 + exp(-20*((x - 0.5)^2 + (y - 0.5)^2)) + x*y'");
    let told = refused(&tile, &heap);
    assert!(told.contains("a product of functions of one coordinate each") && told.contains("without a box to repeat"));
    let flat = "input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1]], boundary: [periodic]}\n";
    assert!(refused(&tile, flat).contains("is in 2 dimensions, but the box in 3"));
    let walled = format!("{uniform}walls: {{layers: 2}}\n");
    assert!(refused(&tile, &walled).contains("walls"));
}

/// Particles that are no gas would be missing in files that are written block by block.
#[test]
fn what_is_no_gas_is_refused_where_only_gas_is_written() {
    let folder = Folder::new();
    let snapshot = {
        let (mut file, _) = sph_prep::place(
            &Scene::parse("input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 64\npolish: none\nthermal: {internal_energy: 1}\noutput: {units: code}\n").unwrap(),
            FORMATS,
            &sph_prep::Control::default(),
        )
        .unwrap();
        let halo = file.species[0].clone();
        file.species.push(sph_formats::Species { part_type: 1, ..halo });
        let path = folder.path("snapshot.hdf5");
        sph_prep::write(FORMATS, &path, Some("gadget"), &file, sph_prep::WriteOptions::default()).unwrap();
        path.display().to_string()
    };
    let refused = |text: &str, word: &str| {
        let (scene, out) = (folder.file("scene.yaml", text), folder.path("seeds.hdf5"));
        let [scene, out] = [&scene, &out].map(|p| p.display().to_string());
        let outcome = sph_prep(&["seed", "--scene", &scene, "-n", "100", "--out", &out]);
        assert!(outcome.code != Some(0) && outcome.stderr.contains(word), "{text}: {}", outcome.stderr);
    };
    let star =
        "input: {profile: {polytrope: {n: 3, mass: 1, radius: 1}}, core: {radius: 0.3, gas: constant-entropy}}\n";
    refused(star, "input.core");
    let even = "domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\n";
    refused(&format!("input: {{expression: '1', others: '{snapshot}'}}\n{even}"), "input.others");
    refused(&format!("input: {{file: '{snapshot}'}}\n"), "64 of type 1");
    let scene = folder.file(
        "balanced.yaml",
        format!("input: {{file: '{snapshot}', other_types: drop}}\ntolerance: 1e-4\npolish: solver\n"),
    );
    let [scene, out] = [scene, folder.path("seeds.hdf5")].map(|p| p.display().to_string());
    let outcome = sph_prep(&["seed", "--scene", &scene, "-n", "100", "--out", &out]);
    assert!(
        outcome.code == Some(0) && outcome.stdout.contains("under polish, tolerance changes nothing here"),
        "{outcome:?}"
    );
}
