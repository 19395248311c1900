use super::super::testing::Random;
use super::*;
use sph::domain::{Axis, Region};
use sph_formats::{Location, Values};
use std::f64::consts::TAU;

fn variable(name: &str, components: usize, values: Vec<f64>) -> Variable {
    let values = Values::F64(values);
    Variable { name: name.into(), description: None, unit: None, location: Location::Node, components, values }
}

/// About `side` to the power of D points that keep apart, in the unit box.
fn points<const D: usize>(side: usize, random: &mut Random) -> Vec<[f64; D]> {
    let place = |mut i: usize| {
        sph::array(|_| {
            let k = i % side;
            i /= side;
            k as f64
        })
    };
    let jittered = |p: [f64; D], random: &mut Random| p.map(|k| (k + 0.5 + 0.6 * (random.unit() - 0.5)) / side as f64);
    (0..side.pow(D as u32)).map(|i| jittered(place(i), random)).collect()
}

fn unit_box<const D: usize>(axis: Axis) -> Domain<D> {
    Domain::new([0.0; D], [1.0; D], [axis; D], Region::Box).unwrap()
}

fn wave<const D: usize>(x: &[f64; D]) -> f64 {
    1.0 + 0.3 * (TAU * x[0]).sin() + if D > 1 { 0.2 * (TAU * x[D - 1]).cos() } else { 0.0 }
}

/// Root mean square of the relative error at random places, off the edges of an open box.
fn error<const D: usize>(field: &dyn ScalarField<D>, margin: f64) -> f64 {
    let mut random = Random::new(8);
    let square = |_| {
        let x = random.point::<D>().map(|v| margin + (1.0 - 2.0 * margin) * v);
        (field.value(&x) / wave(&x) - 1.0).powi(2)
    };
    ((0..2000).map(square).sum::<f64>() / 2000.0).sqrt()
}

fn of_wave<const D: usize>(side: usize, axis: Axis, noise: f64) -> FromParticles<D> {
    let mut random = Random::new(5);
    let points = points::<D>(side, &mut random);
    // Uniform with the standard deviation `noise`.
    let noisy = |p: &[f64; D]| wave(p) * (1.0 + noise * 12_f64.sqrt() * (random.unit() - 0.5));
    let density = variable("rho", 1, points.iter().map(noisy).collect());
    from_particles(&density, Vec::new(), (&points, None), &unit_box(axis)).unwrap()
}

fn noise_is_told_from_the_field<const D: usize>(side: usize, share: f64, exact: f64) {
    for (axis, margin) in [(Axis::Periodic, 0.0), (Axis::OPEN, 0.05)] {
        let noisy = of_wave::<D>(side, axis, 0.03);
        let found = noisy.scatter.unwrap();
        assert!((found.values / 0.03 - 1.0).abs() < 0.15, "{D}-D: {found:?}");
        let off = error(noisy.density.as_ref(), margin);
        assert!(off < share * 0.03, "{D}-D, {axis:?}: {off}");
        // What is said to be left is what is left, but for a factor.
        assert!(found.field < 0.03 * share && off < 2.0 * found.field, "{D}-D: {off} of {found:?}");
        let quiet = of_wave::<D>(side, axis, 0.0);
        let off = error(quiet.density.as_ref(), margin);
        assert!(off < exact, "{D}-D, {axis:?}: {off}");
    }
}

#[test]
fn noise_is_told_from_the_field_in_every_dimension() {
    noise_is_told_from_the_field::<1>(400, 0.45, 1e-4);
    noise_is_told_from_the_field::<2>(50, 0.5, 2e-3);
    noise_is_told_from_the_field::<3>(20, 0.6, 1e-2);
}

/// The mean by Shepard's weights, which these fits are in place of, is flat about each particle.
#[test]
fn smooth_fields_are_met_better_than_by_means() {
    let mut random = Random::new(5);
    let points = points::<3>(20, &mut random);
    let cloud = crate::field::cloud::Cloud::new("rho", &points, Some(&unit_box(Axis::Periodic))).unwrap();
    let mean = super::super::sampled::SampledDensity {
        sampler: Arc::new(cloud),
        values: Values::F64(points.iter().map(wave).collect()),
    };
    let fitted = of_wave::<3>(20, Axis::Periodic, 0.0);
    let (of_fits, of_means) = (error(fitted.density.as_ref(), 0.0), error(&mean, 0.0));
    assert!(of_fits < 0.5 * of_means, "{of_fits} against {of_means}");
}

#[test]
fn fits_end_at_the_surface_of_a_material() {
    let mut random = Random::new(2);
    let points = points::<2>(40, &mut random);
    let is_core = |x: &[f64; 2]| x[0] < 0.5;
    let density = |x: &[f64; 2]| if is_core(x) { 10.0 + x[1] } else { 3.0 - x[0] };
    let material = variable("MaterialIDs", 1, points.iter().map(|p| if is_core(p) { 402.0 } else { 400.0 }).collect());
    let rho = variable("rho", 1, points.iter().map(density).collect());
    let found = from_particles(&rho, vec![material], (&points, None), &unit_box(Axis::OPEN)).unwrap();
    let (mut seen, mut off): (Vec<f64>, usize) = (Vec::new(), 0);
    for _ in 0..3000 {
        let x = random.point::<2>().map(|v| 0.02 + 0.96 * v);
        let mut kind = [0.0];
        found.carried[0].evaluate(&x, &mut kind);
        let value = found.density.value(&x);
        // The density is that of the material which the place is said to have, on either side of the surface.
        let expected = if kind[0] == 402.0 { 10.0 + x[1] } else { 3.0 - x[0] };
        assert!((value / expected - 1.0).abs() < 0.02, "{x:?}: {value}, {expected}");
        off += usize::from((kind[0] == 402.0) != is_core(&x));
        if !seen.contains(&kind[0]) {
            seen.push(kind[0]);
        }
    }
    // Half a spacing on either side is anybody's.
    assert!(seen.len() == 2 && off < 60, "{seen:?} {off}");
}

#[test]
fn constants_and_vectors_keep_their_values_and_bounds() {
    let mut random = Random::new(4);
    let points = points::<3>(12, &mut random);
    let n = points.len();
    let others = vec![
        variable("u", 1, vec![1.5; n]),
        variable("v", 3, points.iter().flat_map(|p| [p[1], -p[0], 0.25]).collect()),
        variable("X", 1, points.iter().map(|p| if p[0] < 0.5 { 0.0 } else { 1.0 }).collect()),
    ];
    let rho = variable("rho", 1, vec![2.0; n]);
    let found = from_particles(&rho, others, (&points, None), &unit_box(Axis::OPEN)).unwrap();
    for _ in 0..500 {
        let x = random.point::<3>().map(|v| 0.1 + 0.8 * v);
        let of = |i: usize| {
            let mut out = [0.0; 3];
            found.carried[i].evaluate(&x, &mut out);
            out
        };
        assert!((found.density.value(&x) - 2.0).abs() < 1e-12);
        assert!((of(0)[0] - 1.5).abs() < 1e-12);
        let v = of(1);
        assert!((v[0] - x[1]).abs() < 1e-9 && (v[1] + x[0]).abs() < 1e-9 && (v[2] - 0.25).abs() < 1e-12, "{v:?} {x:?}");
        assert!((0.0..=1.0).contains(&of(2)[0]));
    }
}

/// Hardly any particles, several in one place, all on a line: finite and within the range of the values.
#[test]
fn few_and_degenerate_particles_have_a_field() {
    let mut random = Random::new(6);
    for n in [2, 3, 5, 11, 40] {
        let mut points: Vec<[f64; 3]> = (0..n).map(|_| random.point()).collect();
        points[n - 1] = points[0];
        points.push([0.9, 0.8, 0.7]);
        let line: Vec<[f64; 3]> = (0..=n).map(|i| [i as f64 / n as f64; 3]).collect();
        for points in [points, line] {
            let rho = variable("rho", 1, (0..points.len()).map(|i| 1.0 + i as f64).collect());
            for axis in [Axis::OPEN, Axis::Periodic] {
                let found = from_particles(&rho, Vec::new(), (&points, None), &unit_box(axis)).unwrap();
                for _ in 0..50 {
                    let value = found.density.value(&random.point());
                    assert!(value == 0.0 || (0.999..=1.001 + n as f64).contains(&value), "{n}: {value}");
                }
            }
        }
    }
}

fn slopes_are_those_of_values<const D: usize>(side: usize) {
    let found = of_wave::<D>(side, Axis::Periodic, 0.01);
    let (mut random, h) = (Random::new(3), 1e-5 / side as f64);
    let mut off = 0;
    for _ in 0..300 {
        let x = random.point::<D>();
        let slope = found.density.log_slope(&x).unwrap();
        for k in 0..D {
            let at = |h: f64| found.density.value(&sph::array(|c| if c == k { x[c] + h } else { x[c] })).ln();
            let expected = (at(h) - at(-h)) / (2.0 * h);
            off += usize::from((slope[k] - expected).abs() > 1e-3 * (1.0 + expected.abs()));
        }
    }
    // Where the bounds of a value begin there is a kink.
    assert!(off <= 3, "{D}-D: {off}");
}

#[test]
fn slopes_are_those_of_values_in_every_dimension() {
    slopes_are_those_of_values::<1>(100);
    slopes_are_those_of_values::<2>(20);
    slopes_are_those_of_values::<3>(10);
}

/// The particles of a mean are those that a search among all finds, in the same order.
#[test]
fn lists_find_the_nearest_particles() {
    let mut random = Random::new(5);
    let points = points::<3>(12, &mut random);
    for axis in [Axis::Periodic, Axis::OPEN] {
        let fitted = Fitted::at("rho", &points, &unit_box(axis)).unwrap();
        let mut sure = 0;
        for _ in 0..2000 {
            let x = random.point();
            let (near, distance) = fitted.particles.near(&x);
            let Ok(found) = fitted.listed(&x, near, distance) else { continue };
            sure += 1;
            let all: Vec<usize> =
                fitted.particles.nearest_about(&x, found.len(), f64::INFINITY).iter().map(|f| f.0).collect();
            assert_eq!(found.iter().map(|f| f.0).collect::<Vec<usize>>(), all, "{x:?}");
        }
        // Beside periodic faces the list is that of a particle on the same side.
        assert!(sure > 1000, "{axis:?}: {sure}");
    }
}

/// A ball of particles ends half a spacing beyond the outermost, and has no holes.
fn matter_ends_half_a_spacing_beyond<const D: usize>(side: usize) {
    let (mut random, spacing) = (Random::new(3), 1.0 / side as f64);
    let radius = |p: &[f64; D]| p.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt();
    let ball: Vec<[f64; D]> = points::<D>(side, &mut random).into_iter().filter(|p| radius(p) < 0.4).collect();
    let rho = variable("rho", 1, vec![1.0; ball.len()]);
    let found = from_particles(&rho, Vec::new(), (&ball, None), &unit_box(Axis::OPEN)).unwrap();
    let (mut within, count) = (0, 20_000);
    for _ in 0..count {
        let x = random.point::<D>();
        let is_matter = found.density.value(&x) > 0.0;
        assert!(is_matter || radius(&x) > 0.4 - spacing, "{D}-D: a hole at {x:?}");
        assert!(!is_matter || radius(&x) < 0.4 + spacing, "{D}-D: matter at {x:?}");
        within += usize::from(is_matter);
    }
    // The volume is that of as many cells as there are particles.
    let volume = within as f64 / f64::from(count) * (side as f64).powi(D as i32) / ball.len() as f64;
    assert!((volume - 1.0).abs() < 0.1, "{D}-D: {volume}");
}

#[test]
fn matter_ends_half_a_spacing_beyond_the_particles() {
    matter_ends_half_a_spacing_beyond::<1>(100);
    matter_ends_half_a_spacing_beyond::<2>(50);
    matter_ends_half_a_spacing_beyond::<3>(24);
}

/// A ball of particles of one mass, whose densities are smoothed at its surface as sums over neighbors smooth them, and 3 % too large everywhere.
fn mass_stays_where_the_particles_are<const D: usize>(side: usize) {
    let (mut random, spacing) = (Random::new(3), 1.0 / side as f64);
    let radius = |p: &[f64; D]| p.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt();
    let ball: Vec<[f64; D]> = points::<D>(side, &mut random).into_iter().filter(|p| radius(p) < 0.4).collect();
    let smoothed =
        |p: &[f64; D]| 1.03 * (1.0 - 0.45 * (1.0 - (0.4 - radius(p)) / (2.0 * spacing)).clamp(0.0, 1.0).powi(2));
    let rho = variable("rho", 1, ball.iter().map(smoothed).collect());
    let masses = vec![spacing.powi(D as i32); ball.len()];
    let of = |masses| from_particles(&rho, Vec::new(), (&ball, masses), &unit_box(Axis::OPEN)).unwrap();
    let (as_given, kept) = (of(None), of(Some(&masses)));
    assert_eq!(as_given.balance, Balance::Unknown);
    assert!(matches!(kept.balance, Balance::Kept(_)), "{:?}", kept.balance);
    let total: f64 = masses.iter().sum();
    let middle = |found: &FromParticles<D>| found.density.value(&[0.5; D]);
    let count = 40_000;
    let places: Vec<[f64; D]> = (0..count).map(|_| random.point::<D>()).collect();
    let held = |found: &FromParticles<D>| {
        places.iter().map(|x| found.density.value(x)).sum::<f64>() / f64::from(count) / total
    };
    assert!((middle(&as_given) / 1.03 - 1.0).abs() < 1e-3);
    assert!((middle(&kept) - 1.0).abs() < 0.01, "{D}-D: {:?}", kept.balance);
    let now = held(&kept);
    assert!((now - 1.0).abs() < 0.015, "{D}-D: {now} of the mass");
}

#[test]
fn mass_stays_where_particles_are_although_their_sums_smooth_the_surface() {
    mass_stays_where_the_particles_are::<1>(200);
    mass_stays_where_the_particles_are::<2>(50);
}
