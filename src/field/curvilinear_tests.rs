use super::super::grid_axis::AxisTable;
use super::super::testing::Random;
use super::super::{Period, ScalarField};
use super::*;
use crate::field::sampled::SampledDensity;
use sph_formats::Coordinates::{Cylindrical, Polar, Spherical};
use std::f64::consts::FRAC_PI_2;

/// Faces of `n` equal cells.
fn even(n: usize, lo: f64, hi: f64) -> Vec<f64> {
    (0..=n).map(|i| lo + (hi - lo) * i as f64 / n as f64).collect()
}

fn middles(faces: &[f64]) -> Vec<f64> {
    faces.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect()
}

fn grid(coordinates: Coordinates, faces: [Vec<f64>; 3], interpolation: Interpolation) -> Curvilinear {
    let (faces, is_round) = check_faces("rho", coordinates, faces).unwrap();
    let [_, azimuth] = coordinates.height_and_azimuth();
    let mut k = 0;
    let axes = faces.map(|faces| {
        let period = (k == azimuth && is_round).then_some(Period::Auto);
        k += 1;
        let centers = middles(&faces);
        AxisTable::cells("u", faces, centers, period).unwrap()
    });
    Curvilinear::new(coordinates, Grid::new(axes, interpolation))
}

/// Values of a function of the coordinates in the middles of the cells.
fn tabulated(grid: &Curvilinear, components: usize, f: &dyn Fn([f64; 3]) -> [f64; 3]) -> Values {
    let centers: Vec<Vec<f64>> = grid.grid.axes.iter().map(|a| a.points().to_vec()).collect();
    let mut values = Vec::new();
    for &w in &centers[2] {
        for &v in &centers[1] {
            values.extend(centers[0].iter().flat_map(|&u| f([u, v, w]).into_iter().take(components)));
        }
    }
    Values::F64(values)
}

fn mass<const D: usize>(sampler: Curvilinear, values: Values) -> (f64, Domain<D>) {
    let field = SampledDensity { sampler: Arc::new(sampler), values };
    let domain = field.sampler.domain::<D>().unwrap();
    (ScalarField::<D>::integral(&field, &domain).unwrap().value, domain)
}

#[test]
fn uniform_grids_have_the_mass_of_what_they_fill() {
    let wide = even(1, 0.0, 1.0);
    let cases: [(Coordinates, [Vec<f64>; 3], f64); 6] = [
        (Spherical, [even(5, 0.5, 2.0), even(4, 0.0, PI), even(6, 0.0, TAU)], 4.0 / 3.0 * PI * (8.0 - 0.125)),
        (Spherical, [even(5, 0.0, 2.0), even(4, 0.0, PI), wide.clone()], 4.0 / 3.0 * PI * 8.0),
        // Faces in single precision end a little beyond pi.
        (Spherical, [even(3, 1.0, 2.0), even(4, 0.0, 3.141_592_74), wide.clone()], 4.0 / 3.0 * PI * 7.0),
        (
            Spherical,
            [even(3, 1.0, 2.0), even(4, 1.0, 2.0), even(6, -0.5, 1.0)],
            7.0 / 3.0 * 1.5 * (1f64.cos() - 2f64.cos()),
        ),
        (Polar, [even(3, 1.0, 2.0), even(6, 0.0, TAU), even(4, -1.0, 2.0)], 9.0 * PI),
        (Cylindrical, [even(3, 0.0, 2.0), even(4, -1.0, 2.0), wide.clone()], 12.0 * PI),
    ];
    for interpolation in [Interpolation::Constant, Interpolation::Linear] {
        for (coordinates, faces, volume) in &cases {
            let sampler = grid(*coordinates, faces.clone(), interpolation);
            let values = tabulated(&sampler, 1, &|_| [3.0; 3]);
            let (mass, domain) = mass::<3>(sampler, values);
            assert!((mass / 3.0 / volume - 1.0).abs() < 1e-12, "{coordinates:?} {faces:?}: {mass}");
            assert!((domain.volume() / volume - 1.0).abs() < 1e-12, "{coordinates:?} {faces:?}: {}", domain.volume());
        }
        for (turn, share) in [(TAU, 1.0), (FRAC_PI_2, 0.25)] {
            let sampler = grid(Polar, [even(3, 1.0, 2.0), even(6, 0.0, turn), even(1, 0.0, 1.0)], interpolation);
            let values = tabulated(&sampler, 1, &|_| [3.0; 3]);
            assert!((mass::<2>(sampler, values).0 / (9.0 * PI * share) - 1.0).abs() < 1e-12);
        }
    }
}

/// Averages within cells of r^2 (1 + sin(theta)^2 cos(2 phi)): the mass is exact, whatever the grid.
#[test]
fn averages_within_cells_have_the_mass_of_the_closed_form() {
    let sampler = grid(Spherical, [even(4, 0.0, 1.5), even(3, 0.0, PI), even(5, 0.0, TAU)], Interpolation::Constant);
    let [r, theta, phi] = [even(4, 0.0, 1.5), even(3, 0.0, PI), even(5, 0.0, TAU)];
    let mut values = Vec::new();
    for p in phi.windows(2) {
        for t in theta.windows(2) {
            for a in r.windows(2) {
                let power = |n: i32| (a[1].powi(n + 1) - a[0].powi(n + 1)) / f64::from(n + 1);
                let cosine = |t: f64| -t.cos();
                let cubic = |t: f64| t.cos().powi(3) / 3.0 - t.cos();
                let around = 0.5 * ((2.0 * p[1]).sin() - (2.0 * p[0]).sin()) / (p[1] - p[0]);
                let up = (cubic(t[1]) - cubic(t[0])) / (cosine(t[1]) - cosine(t[0]));
                values.push(power(4) / power(2) * (1.0 + up * around));
            }
        }
    }
    let (mass, _) = mass::<3>(sampler, Values::F64(values));
    assert!((mass / (4.0 * PI * 1.5_f64.powi(5) / 5.0) - 1.0).abs() < 1e-12, "{mass}");
}

/// An expanding and rotating cloud is linear in space: v_r = H r, v_phi = W R.
#[test]
fn components_are_turned_where_they_are_asked_for() {
    let (expansion, rotation) = (0.5, 2.0);
    let spherical = |u: [f64; 3]| [expansion * u[0], 0.0, rotation * u[0] * u[1].sin()];
    let polar = |u: [f64; 3]| [expansion * u[0], rotation * u[0], expansion * u[2]];
    let cylindrical = |u: [f64; 3]| [expansion * u[0], expansion * u[1], rotation * u[0]];
    let round = even(48, 0.0, TAU);
    type Motion<'a> = &'a dyn Fn([f64; 3]) -> [f64; 3];
    let cases: [(Coordinates, [Vec<f64>; 3], Motion); 4] = [
        (Spherical, [even(20, 0.0, 2.0), even(48, 0.0, PI), round.clone()], &spherical),
        (Spherical, [even(20, 0.0, 2.0), even(48, 0.0, PI), even(1, 0.0, 1.0)], &spherical),
        (Polar, [even(20, 0.0, 2.0), round, even(20, -2.0, 2.0)], &polar),
        (Cylindrical, [even(20, 0.0, 2.0), even(20, -2.0, 2.0), even(1, 0.0, 1.0)], &cylindrical),
    ];
    let mut random = Random::new(1);
    for (coordinates, faces, motion) in cases {
        let sampler = grid(coordinates, faces, Interpolation::Linear);
        let values = tabulated(&sampler, 3, motion);
        for i in 0..2000 {
            // Every fourth near the axis, where directions change from cell to cell.
            let size = if i % 4 == 0 { 0.04 } else { 1.0 };
            let x: [f64; 3] =
                [size * (2.0 * random.unit() - 1.0), size * (2.0 * random.unit() - 1.0), random.unit() - 0.5];
            let mut v = [0.0; 3];
            assert!(Sampler::<3>::sample(&sampler, &values, 3, &x, Outside::Reject, &mut v));
            let expected = [expansion * x[0] - rotation * x[1], expansion * x[1] + rotation * x[0], expansion * x[2]];
            // Chords of sin(theta) over a step of pi / 48: (pi / 48)^2 / 8 = 5e-4 of the rotation.
            let tolerance = if coordinates == Spherical { 6e-4 * rotation * 1.5 } else { 1e-12 };
            for k in 0..3 {
                assert!(
                    (v[k] - expected[k]).abs() < tolerance,
                    "{coordinates:?} at {x:?}: {v:?}, expected {expected:?}"
                );
            }
        }
    }
}

#[test]
fn places_beyond_the_cells_are_outside() {
    let sampler =
        grid(Spherical, [even(4, 1.0, 2.0), even(4, 1.0, 2.0), even(4, 0.0, FRAC_PI_2)], Interpolation::Linear);
    let values = tabulated(&sampler, 1, &|u| [1.0 + u[2]; 3]);
    let at = |x: [f64; 3], outside: Outside| {
        let mut v = [0.0];
        Sampler::<3>::sample(&sampler, &values, 1, &x, outside, &mut v).then_some(v[0])
    };
    assert!(at([1.0, 1.0, 0.0], Outside::Reject).is_some());
    for x in [[0.5, 0.5, 0.0], [2.0, 2.0, 0.0], [0.1, 0.1, 1.5], [1.5, -0.1, 0.0], [-1.5, 0.1, 0.0]] {
        assert_eq!(at(x, Outside::Reject), None, "{x:?}");
    }
    // The nearest end of the sector, on either side of the gap.
    let eighth = FRAC_PI_2 / 8.0;
    assert!((at([1.5, -0.5, 0.0], Outside::Clamp).unwrap() - (1.0 + eighth)).abs() < 1e-12);
    assert!((at([-1.5, 0.5, 0.0], Outside::Clamp).unwrap() - (1.0 + FRAC_PI_2 - eighth)).abs() < 1e-12);
}

#[test]
fn faces_that_are_no_coordinates_are_refused() {
    let refused = |faces: [Vec<f64>; 3]| check_faces("rho", Spherical, faces).unwrap_err().to_string();
    let text = refused([even(2, -1.0, 1.0), even(2, 0.0, PI), even(2, 0.0, TAU)]);
    assert!(text.contains("the radius starts at -1"), "{text}");
    let text = refused([even(2, 0.0, 1.0), even(2, 0.0, 180.0), even(2, 0.0, TAU)]);
    assert!(text.contains("theta runs from 0 to 180") && text.contains("radians"), "{text}");
    let text = refused([even(2, 0.0, 1.0), even(2, 0.0, PI), even(2, 0.0, 360.0)]);
    assert!(text.contains("phi runs from 0 to 360") && text.contains("2 pi"), "{text}");
}
