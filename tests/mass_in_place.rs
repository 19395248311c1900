//! The mass of every region is where it belongs, in named scenes and in scenes drawn at random: expressions with jumps,
//! layers, holes and vacuum, in boxes of one to three dimensions. Whatever comes, each region must have the particles that
//! are due to it, by a count of its own, the end must not be worse than the seeding, and a refusal must say why.

use crate::cases::first;
use crate::random::named_scenes;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use sph_formats::common::particle_names as names;
use sph_prep::{Control, FORMATS, Report, Scene, place};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// A shape whose inside has another density than what it is put into.
enum Shape {
    /// Center and radius.
    Ball([f64; 3], f64),
    /// Normal and offset.
    HalfSpace([f64; 3], f64),
    /// Axis, middle and half thickness.
    Layer(usize, f64, f64),
}

impl Shape {
    fn draw(rng: &mut Xoshiro256PlusPlus, d: usize) -> Self {
        let mut place = || std::array::from_fn(|k| if k < d { 0.2 + 0.6 * rng.random::<f64>() } else { 0.0 });
        let center: [f64; 3] = place();
        match rng.random_range(0..3) {
            0 => Self::Ball(center, 0.08 + 0.25 * rng.random::<f64>()),
            1 => {
                let n: [f64; 3] = std::array::from_fn(|k| if k < d { rng.random::<f64>() - 0.3 } else { 0.0 });
                Self::HalfSpace(n, (0..3).map(|k| n[k] * center[k]).sum())
            }
            _ => Self::Layer(rng.random_range(0..d), center[0], 10_f64.powf(-2.5 + 2.0 * rng.random::<f64>())),
        }
    }

    fn contains(&self, x: &[f64; 3]) -> bool {
        match self {
            Self::Ball(c, r) => (0..3).map(|k| (x[k] - c[k]).powi(2)).sum::<f64>() < r * r,
            Self::HalfSpace(n, offset) => (0..3).map(|k| n[k] * x[k]).sum::<f64>() < *offset,
            Self::Layer(axis, middle, half) => (x[*axis] - middle).abs() < *half,
        }
    }

    fn condition(&self, d: usize) -> String {
        let names = ["x", "y", "z"];
        let sum = |terms: Vec<String>| terms.join(" + ");
        match self {
            Self::Ball(c, r) => {
                let terms = (0..d).map(|k| format!("({} - {:?})^2", names[k], c[k])).collect();
                format!("{} < {:?}", sum(terms), r * r)
            }
            Self::HalfSpace(n, offset) => {
                format!("{} < {offset:?}", sum((0..d).map(|k| format!("{:?}*{}", n[k], names[k])).collect()))
            }
            Self::Layer(axis, middle, half) => format!("abs({} - {middle:?}) < {half:?}", names[*axis]),
        }
    }
}

struct Drawn {
    yaml: String,
    d: usize,
    shapes: Vec<(Shape, f64)>,
    background: f64,
    count: usize,
}

impl Drawn {
    fn new(number: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(number);
        let d = [1, 2, 2, 3][rng.random_range(0..4)];
        let shapes: Vec<(Shape, f64)> = (0..rng.random_range(1..4))
            .map(|_| (Shape::draw(&mut rng, d), 10_f64.powf(4.0 * rng.random::<f64>() - 1.0)))
            .collect();
        let background = [1.0, 1.0, 1e-10, 0.0][rng.random_range(0..4)];
        let count = 30 + (570.0 * rng.random::<f64>().powi(2)) as usize;
        let boundary = ["periodic", "reflecting", "open"][rng.random_range(0..3)];
        let expression = shapes.iter().rev().fold(format!("{background:?}"), |inner, (shape, density)| {
            format!("if({}, {density:?}, {inner})", shape.condition(d))
        });
        let corner = |v: &str| vec![v; d].join(", ");
        let yaml = format!(
            "input: {{expression: '{expression}'}}\ndomain: {{box: [[{}], [{}]], boundary: [{}]}}\nparticles: {count}\nseed: {number}\n",
            corner("0"),
            corner("1"),
            corner(boundary)
        );
        Self { yaml, d, shapes, background, count }
    }

    /// The shape that `x` is in first.
    fn region(&self, x: &[f64; 3]) -> usize {
        self.shapes.iter().position(|(shape, _)| shape.contains(x)).unwrap_or(self.shapes.len())
    }

    fn density(&self, region: usize) -> f64 {
        self.shapes.get(region).map_or(self.background, |(_, density)| *density)
    }

    /// Share of the mass in each shape, by points of a sequence of low discrepancy.
    fn shares(&self) -> Vec<f64> {
        let steps = match self.d {
            1 => [0.618_033_988_749_895, 0.0, 0.0],
            2 => [0.754_877_666_246_693, 0.569_840_290_998_053, 0.0],
            _ => [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_970],
        };
        let mut mass = vec![0.0; self.shapes.len() + 1];
        for i in 0..SAMPLES {
            let x = steps.map(|s| (0.5 + s * i as f64).fract());
            let x = std::array::from_fn(|k| if k < self.d { x[k] } else { 0.0 });
            let region = self.region(&x);
            mass[region] += self.density(region);
        }
        let total: f64 = mass.iter().sum();
        mass.iter().map(|m| m / total).collect()
    }
}

const SAMPLES: usize = 400_000;

fn run(yaml: &str) -> Result<(Vec<[f64; 3]>, Report), String> {
    let scene = Scene::parse(yaml).map_err(|e| e.to_string())?;
    let (file, report) = place(&scene, FORMATS, &Control::default()).map_err(|e| e.to_string())?;
    let (d, edges) = (file.header.dimension, file.header.box_size);
    let values = file.species[0].table.column(names::COORDINATES).expect("particles have coordinates").values.to_f64();
    // In a larger box the unit cube is in the middle.
    let place = |x: &[f64]| std::array::from_fn(|k| if k < d { x[k] - 0.5 * (edges[k] - 1.0) } else { 0.0 });
    let positions = values.chunks(d).map(place).collect();
    Ok((positions, report))
}

/// What is wrong with the outcome of a scene; empty where nothing is.
fn faults(drawn: &Drawn) -> Vec<String> {
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        (run(&drawn.yaml), run(&format!("{}wvt: {{iterations: 0}}\npolish: none\n", drawn.yaml)))
    }));
    let mut faults = Vec::new();
    let (end, seeded) = match outcome {
        Err(_) => return vec!["a panic".into()],
        Ok((Err(refusal), _)) => {
            let is_plain = refusal.len() > 20 && !refusal.contains("internal");
            return if is_plain { faults } else { vec![format!("refused with '{refusal}'")] };
        }
        Ok((Ok(end), seeded)) => (end, seeded),
    };
    let (positions, report) = end;
    if positions.len() != drawn.count {
        faults.push(format!("{} particles in place of {}", positions.len(), drawn.count));
    }
    let shares = drawn.shares();
    for (region, share) in shares.iter().enumerate() {
        let found = positions.iter().filter(|x| drawn.region(x) == region).count() as f64;
        let wanted = share * drawn.count as f64;
        // Samples know a thin layer to some percent.
        let known = 3.0 * drawn.count as f64 * (share / SAMPLES as f64).sqrt();
        let pieces = shares.len() as f64;
        if (found - wanted).abs() > pieces + 0.002 * wanted + known {
            faults.push(format!("region {region} has {found} of {wanted:.2} particles"));
        }
    }
    if report.ledger.regions.iter().any(|r| !r.is_kept(2e-3)) {
        faults.push(format!("the ledger says {:?}", report.ledger.regions));
    }
    if let Ok((_, seeded)) = seeded {
        let mean = |r: &Report| r.density_error.smoothed.map_or(0.0, |e| e.mean);
        if mean(&report) > 1.5 * mean(&seeded) + 0.03 {
            faults.push(format!("mean error {:.4} after {:.4} of the seeding", mean(&report), mean(&seeded)));
        }
        let (now, before) = (report.neighbors.closest_pair, seeded.neighbors.closest_pair);
        if now < 0.45 * before && now < 0.4 {
            faults.push(format!("closest pair {now:.2} after {before:.2} of the seeding"));
        }
    }
    if start.elapsed().as_secs() > 60 {
        faults.push(format!("{:.0} s", start.elapsed().as_secs_f64()));
    }
    faults
}

fn check(numbers: std::ops::Range<u64>) {
    let wrong: Vec<String> = numbers
        .map(Drawn::new)
        .filter_map(|drawn| {
            let faults = faults(&drawn);
            (!faults.is_empty()).then(|| format!("{}{}\n", drawn.yaml, faults.join("\n")))
        })
        .collect();
    assert!(wrong.is_empty(), "{} scenes went wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn random_scenes_keep_their_mass_where_it_belongs() {
    check(0..16);
}

/// The scenes that `SPH_PREP_SCENES` names, or all; some minutes for each hundred.
#[test]
#[ignore = "an hour or two"]
fn many_random_scenes_keep_their_mass_where_it_belongs() {
    check(named_scenes(16..5200));
}

/// Mean error against the target as the kernel sees it, and the closest pair.
fn figures(report: &Report) -> (f64, f64) {
    (report.density_error.smoothed.unwrap().mean, report.neighbors.closest_pair)
}

/// A core of a hundredth of the radius with most of the mass, and an envelope 14 decades below.
#[test]
fn a_steep_star_is_no_worse_than_its_shells() {
    for count in [500, 2000] {
        let scene = format!(
            "input: {{expression: '(1 + (r/0.003)^2)^-6 + 2.6e-9*(max(1 - r, 0)^1.5 + 1e-6)/(r + 0.02)'}}\n\
             domain: {{ball: {{center: [0, 0, 0], radius: 1}}}}\nparticles: {count}\nseeding: equal-area-shells\n"
        );
        let (_, seeded) = run(&format!("{scene}wvt: {{iterations: 0}}\npolish: none\n")).unwrap();
        let (_, end) = run(&scene).unwrap();
        let ((now, pair), (before, first_pair)) = (figures(&end), figures(&seeded));
        assert!(now < 1.2 * before + 0.01, "{count}: mean error {now} after {before}");
        assert!(pair > 0.5 * first_pair, "{count}: pair {pair} after {first_pair}");
        assert!(end.ledger.largest_deviation() < 0.05, "{:?}", end.ledger);
    }
}

/// A cloud of 1000:1 keeps its mass, and so do its surroundings, whose density is right.
#[test]
fn a_cloud_and_its_surroundings_have_their_mass_and_density() {
    let scene = "input: {expression: 'if((x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2 < 0.01, 1000, 1)'}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 4000\n";
    let (positions, report) = run(scene).unwrap();
    let from_middle = |x: &[f64; 3]| (0..3).map(|k| (x[k] - 0.5).powi(2)).sum::<f64>().sqrt();
    let outside = positions.iter().filter(|x| from_middle(x) > 0.1).count() as f64;
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    let wanted = 4000.0 * (1.0 - ball) / (1.0 - ball + 1000.0 * ball);
    assert!((outside - wanted).abs() <= 1.0 + 1e-3 * wanted, "{outside} of {wanted:.1}");
    let interior = report.density_error.interior_refitted.unwrap();
    assert!(interior.mean < 0.01, "{interior:?}");
    assert!(report.ledger.in_place > 0.8, "{:?}", report.ledger);
    assert!(report.neighbors.closest_pair > 0.25, "{:?}", report.neighbors);
}

/// A peak narrower than the cells that are looked at first, on a floor that hides it from them: nearly all of the mass is in it.
#[test]
fn a_narrow_peak_on_a_floor_is_found() {
    let center = [0.37, 0.61, 0.2];
    let scene = "input: {expression: '1e-12 + exp(-((x - 0.37)^2 + (y - 0.61)^2 + (z - 0.2)^2)/1e-6)'}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 500\npolish: none\n";
    let (positions, report) = run(scene).unwrap();
    let mut from: Vec<f64> =
        positions.iter().map(|x| (0..3).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>().sqrt()).collect();
    from.sort_by(f64::total_cmp);
    // The median of a Gaussian with r^2/s^2 in the exponent is 1.088 s.
    assert!((from[250] / 1.088e-3 - 1.0).abs() < 0.1, "{} {:?}", from[250], report.ledger);
}

/// Where masses vary, layers of particles at a jump of the density lie on this side or on that: what each side holds is right all the same.
#[test]
fn each_side_of_a_jump_has_its_mass_where_masses_vary() {
    for (scene, share) in [
        ("if((x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2 < 0.04, 1000, 1)", 4.0 / 3.0 * std::f64::consts::PI * 0.008),
        ("if(x < 0.5, 1000, 1)", 0.5),
    ] {
        let text = format!(
            "input: {{expression: '{scene}'}}\ndomain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}}\nparticles: 700\n\
             resolution: {{spacing: '1'}}\npolish: none\noutput: {{double_precision: true}}\n"
        );
        let (file, _) = place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap();
        let column = |name: &str| file.species[0].table.column(name).unwrap().values.to_f64();
        let (x, m) = (column(names::COORDINATES), column(names::MASSES));
        let is_dense = |x: &[f64]| match share {
            0.5 => x[0] < 0.5,
            _ => x.iter().map(|v| (v - 0.5).powi(2)).sum::<f64>() < 0.04,
        };
        let light: f64 = x.chunks(3).zip(&m).filter(|(x, _)| !is_dense(x)).map(|(_, m)| m).sum();
        assert!((light / (1.0 - share) - 1.0).abs() < 1e-6, "{scene}: {light} of {}", 1.0 - share);
    }
}

/// A table whose density falls within a ten-millionth of its radius, and no two radii are equal.
#[test]
fn a_narrow_step_of_a_table_is_a_jump() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("step.csv");
    std::fs::write(&path, "r,density\n0,10\n0.3,10\n0.3000001,1\n1,1\n").unwrap();
    let text = format!("input: {{file: '{}'}}\nparticles: 2000\noutput: {{units: code}}\n", path.display());
    let (file, report) = place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap();
    let x = file.species[0].table.column(names::COORDINATES).unwrap().values.to_f64();
    let middle = 0.5 * file.header.box_size[0];
    let core = x.chunks(3).filter(|x| x.iter().map(|v| (v - middle).powi(2)).sum::<f64>().sqrt() < 0.3).count() as f64;
    let wanted = 2000.0 * 0.27 / (0.27 + 1.0 - 0.027);
    assert!((core - wanted).abs() <= 1.0, "{core} of {wanted}");
    assert!(report.notes.iter().any(|note| note.contains("taken as a jump")), "{:?}", report.notes);
}

/// A layer a thousandth of the box thick, which holds three quarters of the mass: wherever it is, whether a face of cells is near or all places that
/// are looked at first miss it, and whether it is in place is known.
#[test]
fn a_thin_layer_is_seen_and_has_its_mass() {
    for middle in first(1, [0.617, 0.3, 0.5]) {
        let scene = format!(
            "input: {{expression: 'if(abs(z - {middle}) < 0.0005, 3000, 1)'}}\n\
             domain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}}\nparticles: 1200\n"
        );
        let (positions, report) = run(&scene).unwrap();
        assert!((report.mass.total - 3.999).abs() < 1e-6, "{middle}: {:?}", report.mass);
        let within = positions.iter().filter(|x| (x[2] - middle).abs() < 0.0005).count() as f64;
        assert!((within - 1200.0 * 3.0 / 3.999).abs() <= 1.0, "{middle}: {within}");
        assert!(report.ledger.in_place > 0.9, "{middle}: {:?}", report.ledger);
        let smoothed = report.density_error.smoothed.unwrap();
        assert!(smoothed.mean < 0.05, "{middle}: {smoothed:?}");
    }
}

/// The same at an angle: the layer has its mass all along.
#[test]
fn a_thin_layer_at_an_angle_has_its_mass_all_along() {
    for (tilt, offset) in first(1, [(0.37, 0.63), (1.0, 0.9)]) {
        let scene = format!(
            "input: {{expression: '1 + if(abs(x + {tilt}*y - {offset}) < 0.0005, 5000, 0)'}}\n\
             domain: {{box: [[0, 0], [1, 1]], boundary: [reflecting]}}\nparticles: 4000\nwvt: {{iterations: 0}}\npolish: none\n"
        );
        let (positions, report) = run(&scene).unwrap();
        let within = positions.iter().filter(|x| (x[0] + tilt * x[1] - offset).abs() < 0.0005);
        let (mut found, extent) = ([0.0; 8], (offset / tilt).min(1.0));
        within.for_each(|x| found[((x[1] / extent * 8.0) as usize).min(7)] += 1.0);
        let mean = found.iter().sum::<f64>() / 8.0;
        assert!(found.iter().all(|n| (n / mean - 1.0).abs() < 0.015), "{tilt} {offset}: {found:?}");
        // Boxes have 250 particles: three are 1 %.
        assert!(report.ledger.in_place > 0.8, "{tilt} {offset}: {:?}", report.ledger);
    }
}

/// A layer at an angle that is all but a surface: the mean of what a particle stands for is beside it by rounding, the particle is not.
#[test]
fn particles_are_on_a_layer_that_is_all_but_a_surface() {
    let scene = "input: {expression: '1e-3 + if(abs(x + 0.37*y - 0.21*z - 0.4) < 1e-9, 1e9, 0)', dimension: 3}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 500\nwvt: {iterations: 0}\npolish: none\n";
    let (positions, report) = run(scene).unwrap();
    let on_it = |x: &&[f64; 3]| (x[0] + 0.37 * x[1] - 0.21 * x[2] - 0.4).abs() < 1e-9;
    assert_eq!(positions.len(), 500);
    // One part in 2000 of the mass is beside it.
    assert!(positions.iter().filter(on_it).count() >= 499);
    assert!(report.ledger.levels.last().is_none_or(|level| level.largest_deviation < 0.05), "{:?}", report.ledger);
}

/// A layer far thinner than the cells in which it is looked for is one region, as is each of its sides, and has its mass all along.
#[test]
fn a_thin_layer_at_an_angle_in_space_is_one_region() {
    let scene = "input: {expression: '1 + if(abs(x + y + z - 1.3) < 0.001, 2000, 0)', dimension: 3}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [reflecting]}\nparticles: 3000\nwvt: {iterations: 0}\npolish: none\n";
    let (positions, report) = run(scene).unwrap();
    let (off, regions) = (report.ledger.levels.last().unwrap().rms_deviation, &report.ledger.regions);
    assert!(regions.len() == 3 && regions.iter().all(|r| r.is_kept(0.0)), "{regions:?}");
    // Boxes have 190 particles. The largest of 16 deviations is 2.9 to 5.3 % for 2500 to 4000 of them, this one 1.4 to 1.9 %.
    assert!(off < 0.02, "{:?}", report.ledger);
    // By the symmetry of the layer each axis has as many particles below a half.
    let within: Vec<_> = positions.iter().filter(|x| (x[0] + x[1] + x[2] - 1.3).abs() < 0.001).collect();
    let below = [0, 1, 2].map(|k| within.iter().filter(|x| x[k] < 0.5).count() as f64 / within.len() as f64);
    // Of the triangle that the cube leaves of the plane.
    let area = |side: f64| 0.5 * side * side;
    let cut = (area(0.8) - area(0.3)) / (area(1.3) - 3.0 * area(0.3));
    assert!(below.iter().all(|share| (share - (1.0 - cut)).abs() < 0.02), "{below:?} {cut}");
}

/// Beyond the periodic face is the thin side: volumes of the dense side's particles do not reach into it.
#[test]
fn a_jump_at_an_angle_that_meets_a_periodic_face_has_its_mass_in_place() {
    let scene = "input: {expression: 'if(x + 0.7*y - 0.4*z > 0.6, 100, 1)'}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic, open, reflecting]}\nparticles: 3000\n";
    let (_, report) = run(scene).unwrap();
    // Boxes have 187 particles: two are 1 %. Volumes that reached across left 37 % in place.
    assert!(report.ledger.in_place > 0.75 && report.neighbors.closest_pair > 0.5, "{:?}", report.ledger);
    let off = report.ledger.levels.iter().map(|level| level.largest_deviation).fold(0.0, f64::max);
    assert!(off < 0.015, "{:?}", report.ledger);
    assert!(report.ledger.regions.iter().all(|r| r.is_kept(0.0)), "{:?}", report.ledger);
}

/// Particles of a torus in near-vacuum stay in it, and are as even as those of a box.
#[test]
fn a_torus_in_near_vacuum_is_as_good_as_any_body() {
    let scene = "input: {expression: 'if((sqrt(x^2 + y^2) - 0.6)^2 + z^2 < 0.04, 1, 1e-10)'}\n\
        domain: {box: [[-1, -1, -1], [1, 1, 1]]}\nparticles: 3000\n";
    let (_, report) = run(scene).unwrap();
    let interior = report.density_error.interior_refitted.unwrap();
    assert!(interior.mean < 3e-3 && report.neighbors.closest_pair > 0.6, "{interior:?} {:?}", report.neighbors);
    assert!(report.ledger.regions.iter().all(|r| r.is_kept(0.0)), "{:?}", report.ledger);
}

/// Splitting that does not come to rest leaves pairs where seeds of as many particles have none.
#[test]
fn particles_from_splitting_are_no_worse_than_seeds_of_as_many() {
    for (corner, expression) in [("[[0], [1]]", "1 + 0.97*sin(2*pi*x)"), ("[[0, 0], [1, 1]]", "1 + 30*exp(-80*r^2)")] {
        let scene = format!(
            "input: {{expression: '{expression}'}}\ndomain: {{box: {corner}, boundary: [reflecting]}}\nparticles: 450\nneighbors: 9\n\
             kernel: cubic-spline\n"
        );
        let (_, seeded) = run(&format!("{scene}wvt: {{iterations: 0}}\npolish: none\n")).unwrap();
        let (_, end) = run(&format!("{scene}polish: alaric\nalaric: {{steps: 10, splittings: 3}}\n")).unwrap();
        let ((now, pair), (before, first_pair)) = (figures(&end), figures(&seeded));
        assert!(now < 1.2 * before + 0.01, "{corner}: mean error {now} after {before}");
        assert!(pair > 0.45 * first_pair, "{corner}: pair {pair} after {first_pair}");
    }
}

/// The solver leaves what the surface of a ball looks like to the shells, and makes the rest right: a percent within becomes a tenth of one.
#[test]
fn a_uniform_ball_keeps_what_the_solver_makes_of_it() {
    let scene = "input: {expression: '1'}\ndomain: {ball: {center: [0, 0, 0], radius: 1}}\nparticles: 2000\n";
    let (_, report) = run(scene).unwrap();
    let interior = report.density_error.interior_refitted.unwrap();
    assert!(interior.mean < 2e-3, "{interior:?} {:?}", report.notes);
}

/// A dense cloud in a medium of a handful of particles: their uneven pushes on the cloud say nothing of how it lies.
#[test]
fn a_cloud_in_a_medium_of_few_particles_is_relaxed() {
    let scene = "input: {expression: 'if((x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2 < 0.01, 1e5, 1)'}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 2000\n";
    let (_, report) = run(scene).unwrap();
    let interior = report.density_error.interior_refitted.unwrap();
    assert!(interior.mean < 2e-3 && report.neighbors.closest_pair > 0.6, "{interior:?} {:?}", report.neighbors);
    assert!(report.ledger.in_place > 0.9, "{:?}", report.ledger);
}

/// Distance to the nearest other particle over (area/N)^(1/2) of those in a layer about z = 1/2 of a periodic unit box.
fn evenness_of_layer(positions: &[[f64; 3]], half: f64) -> Vec<f64> {
    let layer: Vec<&[f64; 3]> = positions.iter().filter(|x| (x[2] - 0.5).abs() < half).collect();
    let apart = |a: f64, b: f64| (a - b).abs().min(1.0 - (a - b).abs());
    let nearest = |i: usize| {
        let to = |j: usize| (apart(layer[i][0], layer[j][0]).powi(2) + apart(layer[i][1], layer[j][1]).powi(2)).sqrt();
        (0..layer.len()).filter(|&j| j != i).map(to).fold(f64::INFINITY, f64::min)
    };
    (0..layer.len()).map(|i| nearest(i) * (layer.len() as f64).sqrt()).collect()
}

/// A layer thinner than a spacing is a sheet: particles lie evenly in it (a hexagonal lattice: 1.07), the medium about it has its density,
/// and no measure misses it.
#[test]
fn a_layer_thinner_than_a_spacing_is_an_even_sheet() {
    let scene = "input: {expression: 'if(abs(z - 0.5) < 0.0005, 3000, 1)'}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 2000\n";
    let (positions, report) = run(scene).unwrap();
    let apart = evenness_of_layer(&positions, 0.0005);
    let closest = apart.iter().fold(f64::INFINITY, |m, a| m.min(*a));
    assert!(closest > 0.6, "{closest}");
    assert!(report.neighbors.closest_pair > 0.5, "{:?}", report.neighbors);
    let smoothed = report.density_error.smoothed.unwrap();
    assert!(smoothed.mean < 0.05, "{smoothed:?}");
}

/// Steeper than a spacing resolves: the density is that which the kernel makes of it, and columns have their mass.
#[test]
fn an_atmosphere_has_the_density_that_a_kernel_can_show() {
    let count = 2000;
    for (spacings, error, apart) in first(2, [(1.0_f64, 0.08, 0.55), (4.0, 0.03, 0.7), (2.0, 0.08, 0.6)]) {
        let height = spacings.powf(1.5) / f64::from(count).sqrt();
        let scene = format!(
            "input: {{expression: 'exp(-z/{height})'}}\ndomain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic, periodic, reflecting]}}\n\
             particles: {count}\n"
        );
        let (positions, report) = run(&scene).unwrap();
        let smoothed = report.density_error.smoothed.unwrap();
        assert!(smoothed.mean < error, "{spacings}: {smoothed:?} {:?}", report.notes);
        assert!(report.neighbors.closest_pair > apart, "{spacings}: {:?}", report.neighbors);
        assert!(report.ledger.in_place > 0.9, "{spacings}: {:?}", report.ledger);
        // Particles lie in layers, of which the first is a third of a spacing above the floor: as much of the scale height may be missing.
        let mean = positions.iter().map(|x| x[2]).sum::<f64>() / f64::from(count) / height;
        assert!((mean - 1.0).abs() < 0.2, "{spacings}: a mean height of {mean} scale heights");
    }
}

/// A disc a hundred times as wide as thick: boxes hold their mass, however few cells its middle plane is seen by.
#[test]
fn a_thin_disc_has_its_mass_in_place() {
    let scene = "input: {expression: 'exp(-sqrt(x^2 + y^2)/0.2)/cosh(z/0.002)^2'}\n\
        domain: {box: [[-1, -1, -0.05], [1, 1, 0.05]]}\nparticles: 2000\n";
    let (positions, report) = run(scene).unwrap();
    assert!(report.ledger.largest_deviation() < 0.05, "{:?}", report.ledger);
    // Half of the mass lies within 1.678 scale lengths.
    let radius = |x: &[f64; 3]| ((x[0] - 0.5).powi(2) + (x[1] - 0.5).powi(2)).sqrt();
    let within = positions.iter().filter(|x| radius(x) < 1.678 * 0.2).count() as f64 / 2000.0;
    assert!((within - 0.5).abs() < 0.03, "{within}");
}

/// Such a medium is vacuum in the file: what is not next to nothing of it is warned about.
#[test]
fn a_region_that_no_particle_is_placed_in_is_told() {
    let told = |contrast: &str| {
        let scene = format!(
            "input: {{expression: 'if(abs(x - 1) < 0.01, {contrast}, 1)'}}\ndomain: {{box: [[0], [2]], boundary: [periodic]}}\n\
             particles: 200\nwvt: {{iterations: 0}}\npolish: none\n"
        );
        let (_, report) = place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
        let is_said = |all: &[String]| all.iter().any(|text| text.starts_with("no particle is placed in 99.0"));
        (is_said(&report.warnings), is_said(&report.notes))
    };
    // Of 200 particles 200*1.98/(1.98 + 0.02 c) belong there: 9, 0.2 and 2e-6.
    assert_eq!(told("2e3"), (false, false));
    assert_eq!(told("1e5"), (true, false));
    assert_eq!(told("1e10"), (false, true));
}

/// The middles of equal cells from -1 to 1.
fn grid(edge: usize, dimension: usize) -> impl Iterator<Item = Vec<f64>> {
    let at = move |i: usize| (i as f64 + 0.5) / edge as f64 * 2.0 - 1.0;
    (0..edge.pow(dimension as u32)).map(move |i| (0..dimension).map(|k| at(i / edge.pow(k as u32) % edge)).collect())
}

/// Cells without coordinates, as a NumPy archive.
fn cells_on_disk(folder: &std::path::Path, edge: usize, dimension: usize, value: impl Fn(&[f64]) -> f64) -> String {
    let values: Vec<f64> = grid(edge, dimension).map(|x| value(&x)).collect();
    let array = crate::grids::npy(&format!("({})", format!("{edge}, ").repeat(dimension)), &values);
    let path = folder.join("cells.npz");
    crate::grids::archive(&path, std::iter::once(("rho", array)));
    path.display().to_string()
}

/// Cells in vacuum, alone and thin, have less than a particle each, and vacuum beside them has none of what they have.
#[test]
fn a_body_on_a_grid_that_ends_in_thin_cells_is_placed() {
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let parabola = |x: &[f64]| (1.0 - square(x) / 0.36).max(0.0);
    let is_island = |x: &[f64]| x.iter().all(|x| ((x.abs() - 0.75) * 28.0).abs() < 1.0);
    let islands = |x: &[f64]| if square(x) < 0.36 { 1.0 } else { 1e-4 * f64::from(is_island(x)) };
    let folder = tempfile::tempdir().unwrap();
    for dimension in 1..=3 {
        let bodies = [("parabola", 40, &parabola as &dyn Fn(&[f64]) -> f64), ("islands", 28, &islands)];
        for (name, edge, value) in bodies {
            let path = cells_on_disk(folder.path(), edge, dimension, value);
            let yaml = format!("input: {{file: '{path}'}}\nparticles: 2000\npolish: none\nwvt: {{iterations: 0}}");
            let (positions, report) = run(&yaml).unwrap_or_else(|e| panic!("{name} in {dimension}-D: {e}"));
            assert_eq!(positions.len(), 2000, "{name} in {dimension}-D");
            // Seeds that nothing relaxes: whole particles on either side of cuts through cells.
            let largest = report.ledger.levels.iter().map(|l| l.largest_deviation).fold(0.0, f64::max);
            assert!(largest < 0.02, "{name} in {dimension}-D: {:?}", report.ledger);
            // By a count of its own: the cells of a box in the middle have what the particles in it have.
            let width = 2.0 * (edge * 3 / 20) as f64 / edge as f64;
            let is_inside = |x: &[f64]| x.iter().all(|x| x.abs() < width);
            let masses = grid(edge, dimension).map(|x| (is_inside(&x), value(&x)));
            let [all, inside] = masses.fold([0.0; 2], |[a, b], (is, m)| [a + m, if is { b + m } else { b }]);
            let found = positions
                .iter()
                .filter(|x| is_inside(&x[..dimension].iter().map(|x| 2.0 * x - 1.0).collect::<Vec<_>>()));
            let share = found.count() as f64 / 2000.0;
            assert!((share - inside / all).abs() < 0.015, "{name} in {dimension}-D: {share} {}", inside / all);
        }
    }
}

/// A layer a spacing thick on an open floor is no end of a body that sums cannot see: left as it was seeded, its closest pair was 0.2 spacings apart, and its
/// densities were off by a quarter.
#[test]
fn a_layer_on_an_open_floor_is_relaxed() {
    let scene = "input: {expression: 'exp(-z/0.01)', dimension: 3}\n\
                 domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic, periodic, open]}\nparticles: 2000\n";
    let (_, report) = run(scene).unwrap();
    assert!(report.neighbors.closest_pair > 0.5, "{}", report.neighbors.closest_pair);
    let error = report.density_error.smoothed.unwrap().mean;
    assert!(error < 0.15 && report.ledger.in_place > 0.95, "{error} {}", report.ledger.in_place);
}

/// A blob whose edge few particles show: its densities are off by what the kernel smooths, its mass is not. 2.5 % of it were too much, and a fifth of the
/// boxes in place.
#[test]
fn a_blob_keeps_its_mass_where_its_edge_is_smoothed() {
    let scene = "input: {expression: '1+99*exp(-((x-0.5)^2+(y-0.5)^2+(z-0.5)^2)/0.01)'}\n\
        domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\nparticles: 10000\n";
    let (positions, report) = run(scene).unwrap();
    assert!(report.ledger.in_place > 0.9, "{:?}", report.ledger);
    let inside = positions.iter().filter(|x| x.iter().map(|v| (v - 0.5).powi(2)).sum::<f64>() < 0.04).count() as f64;
    // The integral of 1 + 99 exp(-r^2/0.01) up to 0.2 by parts, over that of the box.
    let (blob, pi) = (99.0 * 1e-3 * std::f64::consts::PI.powf(1.5), std::f64::consts::PI);
    let within = blob * 0.995_322_265 - 99.0 * 2.0 * pi * 0.01 * 0.2 * (-4.0_f64).exp() + 4.0 / 3.0 * pi * 0.008;
    let wanted = 10_000.0 * within / (1.0 + blob);
    assert!((inside / wanted - 1.0).abs() < 0.012, "{inside} of {wanted}");
}

/// Spacings that grow twentyfold from the middle of a box: boxes are cut where few particles are, of which parts belong to both sides.
#[test]
fn the_mass_of_a_stratified_box_is_where_its_seeds_have_it() {
    let scene = "input: {expression: '(0.02+abs(x/8-0.5))^(-3)', dimension: 3}\ndomain: {box: [[0, 0, 0], [8, 1, 1]], boundary: periodic}\n\
        particles: 2000\nseeding: mass-bisection\nwvt: {iterations: 0}\npolish: none\n";
    let off = run(scene).unwrap().1.ledger.largest_deviation();
    assert!(off < 0.015, "{off}");
}
