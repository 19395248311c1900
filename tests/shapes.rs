//! Domains of surfaces and of primitives put together, from the scene to the particles.

use crate::cases::first;
use sph_formats::ParticleFile;
use sph_formats::common::particle_names as names;
use sph_prep::{Control, FORMATS, Report, Scene, place};
use std::f64::consts::{PI, TAU};
use std::path::Path;

type Triangle = [[f32; 3]; 3];

/// A lumpy body: a sphere whose radius depends on the direction.
fn lumpy(n: usize) -> Vec<Triangle> {
    let at = |i: usize, j: usize| {
        let (s, c) = (TAU * (i % (2 * n)) as f64 / (2 * n) as f64).sin_cos();
        let (ring, z) =
            if j == 0 || j == n { (0.0, 1.0 - 2.0 * (j / n) as f64) } else { (PI * j as f64 / n as f64).sin_cos() };
        let (x, y) = (ring * c, ring * s);
        let radius = 1.0 + 0.2 * x * y + 0.15 * z * z + 0.1 * (3.0 * x).sin();
        [x, y, 0.8 * z].map(|v| (radius * v) as f32)
    };
    let cells = (0..2 * n).flat_map(|i| (0..n).map(move |j| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, c, b], [a, d, c]]
        })
        .collect()
}

fn write_stl(path: &Path, triangles: &[Triangle]) {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    std::fs::write(path, bytes).unwrap();
}

/// By the divergence theorem.
fn volume(triangles: &[Triangle]) -> f64 {
    let of = |t: &Triangle| {
        let [a, b, c] = t.map(|p| p.map(f64::from));
        (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]))
            / 6.0
    };
    triangles.iter().map(of).sum()
}

fn placed(text: &str) -> (ParticleFile, Report) {
    let scene = Scene::parse(text).unwrap();
    place(&scene, FORMATS, &Control::default()).unwrap()
}

fn refused(text: &str) -> String {
    let scene = Scene::parse(text).map_err(|e| e.to_string());
    match scene {
        Err(e) => e,
        Ok(scene) => place(&scene, FORMATS, &Control::default()).map(|_| ()).unwrap_err().to_string(),
    }
}

fn column(file: &ParticleFile, name: &str) -> Vec<f64> {
    file.species[0].table.column(name).unwrap().values.to_f64()
}

fn total(file: &ParticleFile) -> f64 {
    column(file, names::MASSES).iter().sum()
}

/// Positions in the scene's coordinates: the middle of the output's box is that of the domain.
fn places<const D: usize>(file: &ParticleFile, middle: [f64; D]) -> Vec<[f64; D]> {
    let own = file.header.box_size;
    let x = column(file, names::COORDINATES);
    x.chunks_exact(D).map(|p| std::array::from_fn(|k| p[k] - 0.5 * own[k] + middle[k])).collect()
}

#[test]
fn a_surface_of_a_file_is_filled_with_its_mass() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.stl");
    let triangles = lumpy(20);
    write_stl(&path, &triangles);
    let base = format!(
        "particles: 120\npolish: none\nwvt: {{iterations: 0}}\noutput: {{units: code}}\ninput: {{file: '{}', ",
        path.display()
    );
    let expected = volume(&triangles);
    let (file, report) = placed(&format!("{base} density: '2000'}}"));
    assert!((total(&file) / (2000.0 * expected) - 1.0).abs() < 1e-6, "{}", total(&file));
    assert!(report.notes.iter().any(|n| n.contains("volume of the surface")), "{:?}", report.notes);
    // Scaled and turned it has the same volume times the factors.
    let (file, _) = placed(&format!("{base} density: 3, scale: [2, 1, 0.5], rotate: [90, 0, 45]}}"));
    assert!((total(&file) / (3.0 * expected) - 1.0).abs() < 1e-6, "{}", total(&file));
    // A mirrored one is no other.
    let (file, _) = placed(&format!("{base} density: 3, scale: [-1, 1, 1]}}"));
    assert!((total(&file) / (3.0 * expected) - 1.0).abs() < 1e-6, "{}", total(&file));
    // The same as part of a domain, with a density that varies: of x^2 the mean over the body.
    let by_hand: f64 = triangles
        .iter()
        .map(|t| {
            // Of a tetrahedron with the origin: V / 10 times the sum of all products of the corners' x.
            let [a, b, c] = t.map(|p| f64::from(p[0]));
            volume(std::slice::from_ref(t)) / 10.0 * (a * a + b * b + c * c + a * b + b * c + c * a)
        })
        .sum();
    let text = format!(
        "particles: 120\npolish: none\nwvt: {{iterations: 0}}\noutput: {{units: code}}\ninput: {{expression: 'x^2', dimension: 3}}\ndomain: {{surface: {{file: '{}'}}}}",
        path.display()
    );
    let (file, _) = placed(&text);
    assert!((total(&file) / by_hand - 1.0).abs() < 1e-4, "{} {by_hand}", total(&file));
}

#[test]
fn the_outermost_particles_lie_half_a_spacing_within() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.stl");
    let triangles = lumpy(30);
    write_stl(&path, &triangles);
    let n = 2000;
    let (file, report) =
        placed(&format!("particles: {n}\noutput: {{units: code}}\ninput: {{file: '{}', density: 1}}", path.display()));
    assert!(report.ledger.in_place > 0.9, "{}", report.ledger.in_place);
    let corners = triangles.iter().flatten();
    let (lo, hi) = corners.fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(lo, hi), p| {
        let p = p.map(f64::from);
        (std::array::from_fn(|k| lo[k].min(p[k])), std::array::from_fn(|k| hi[k].max(p[k])))
    });
    let x = places::<3>(&file, std::array::from_fn(|k| 0.5 * (lo[k] + hi[k])));
    let spacing = (volume(&triangles) / n as f64).cbrt();
    let points = x.iter().flat_map(|x| triangles.iter().map(move |t| apart(t, x)));
    let depths: Vec<f64> = points
        .collect::<Vec<_>>()
        .chunks_exact(triangles.len())
        .map(|d| d.iter().copied().fold(f64::INFINITY, f64::min))
        .collect();
    let outermost: Vec<f64> = depths.into_iter().map(|d| d / spacing).filter(|d| *d < 0.9).collect();
    let mean = outermost.iter().sum::<f64>() / outermost.len() as f64;
    println!("{} particles of the outermost layer at {mean:.3} spacings from the surface", outermost.len());
    // A spacing is an eighth of the radius of the body, and facets' corners stand for all of them here.
    assert!((mean - 0.5).abs() < 0.1, "{mean}");
}

/// Distance of a point from a triangle that is small beside it: to corners, middles of edges and the middle.
fn apart(t: &Triangle, x: &[f64; 3]) -> f64 {
    let p = t.map(|c| c.map(f64::from));
    let between = |w: [f64; 3]| -> f64 {
        (0..3).map(|k| (w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k] - x[k]).powi(2)).sum::<f64>().sqrt()
    };
    let third = 1.0 / 3.0;
    let weights = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.5, 0.0],
        [0.5, 0.0, 0.5],
        [0.0, 0.5, 0.5],
        [third, third, third],
    ];
    weights.into_iter().map(between).fold(f64::INFINITY, f64::min)
}

#[test]
fn primitives_make_domains_in_every_dimension() {
    let head = "particles: 200\npolish: none\nwvt: {iterations: 0}\noutput: {units: code}\n";
    let ball = 4.0 / 3.0 * PI;
    let disc = PI;
    let shapes = [
        (3, "difference: [{sphere: {radius: 1}}, {box: [[0, 0, 0], [2, 2, 2]]}]", ball * 0.875),
        (3, "union: [{sphere: {radius: 1}}, {sphere: {radius: 1, center: [4, 0, 0]}}]", 2.0 * ball),
        (3, "intersection: [{ball: {radius: 1}}, {half-space: {normal: [1, 2, 3]}}]", 0.5 * ball),
        (3, "ellipsoid: {radii: [1, 2, 0.5]}", ball),
        (2, "difference: [{circle: {radius: 1}}, {rectangle: [[0, 0], [2, 2]]}]", 0.75 * disc),
        (2, "intersection: [{ellipse: {radii: [2, 1]}}, {half-plane: {normal: [0, 1]}}]", disc),
        (2, "rotate: {by: 30, shape: {box: [[0, 0], [1, 2]]}}", 2.0),
        (1, "union: [{interval: [[0], [1]]}, {interval: [[2], [2.5]]}]", 1.5),
        (3, "torus: {radius: 2, tube_radius: 0.5, axis: x}", 2.0 * PI * PI * 2.0 * 0.25),
        (
            3,
            "rotate: {by: [10, 20, 30], about: [1, 0, 0], shape: {cylinder: {radius: 1, inner_radius: 0.5, length: 2}}}",
            1.5 * PI,
        ),
    ];
    for (dimension, domain, expected) in first(8, shapes) {
        let text = format!("{head}input: {{expression: '2', dimension: {dimension}}}\ndomain: {{{domain}}}");
        let (file, _) = placed(&text);
        let mass = total(&file);
        assert!((mass / (2.0 * expected) - 1.0).abs() < 2e-5, "{domain}: {mass} {expected}");
    }
}

#[test]
fn no_particle_is_where_something_was_taken_away() {
    let text = "particles: 3000\noutput: {units: code}\ninput: {expression: '1 + x^2', dimension: 2}\n\
                domain: {difference: [{circle: {radius: 1}}, {rectangle: [[0.2, -0.1], [2, 0.4]]}]}";
    let (file, report) = placed(text);
    assert!(report.ledger.in_place > 0.9, "{}", report.ledger.in_place);
    for x in places::<2>(&file, [0.0; 2]) {
        assert!(x[0].hypot(x[1]) < 1.0 + 1e-6, "{x:?}");
        assert!(!(x[0] > 0.2 + 1e-6 && x[1] > -0.1 + 1e-6 && x[1] < 0.4 - 1e-6), "{x:?}");
    }
}

#[test]
fn what_makes_no_domain_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.stl");
    write_stl(&path, &lumpy(8));
    let file = path.display();
    for (text, part) in [
        (format!("input: {{file: '{file}'}}"), "no density inside"),
        (format!("input: {{file: '{file}', density: 'rho'}}"), "input.density"),
        (format!("input: {{file: '{file}', density: -1}}"), "negative"),
        (format!("input: {{file: '{file}', density: 1, scale: [0]}}"), "input.scale"),
        (format!("input: {{file: '{file}', density: 1, rotate: [1, 2]}}"), "input.rotate"),
        (format!("input: {{file: '{file}', density: 1, scale: 1e200}}"), "expected coordinates below"),
        (format!("input: {{file: '{file}', density: 1}}\ndomain: {{ball: {{radius: 1}}}}"), "domain.surface"),
        (format!("input: {{file: '{file}', density: 1, dimension: 2}}"), "input.dimension"),
        ("input: {expression: '1', scale: 2, dimension: 2}\ndomain: {ball: {radius: 1}}".into(), "input.scale"),
        ("input: {expression: '1', density: rho, dimension: 2}\ndomain: {ball: {radius: 1}}".into(), "input.density"),
        ("input: {expression: '1', format: mesa, dimension: 2}\ndomain: {ball: {radius: 1}}".into(), "input.format"),
        ("input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}, time: 3}".into(), "input.time"),
        ("input: {expression: '1', dimension: 3}\ndomain: {intersection: [{ball: {radius: 1}}, {ball: {radius: 1, center: [3, 0, 0]}}]}".into(), "empty"),
        ("input: {expression: '1', dimension: 3}\ndomain: {difference: [{ball: {radius: 1}}, {ball: {radius: 2}}]}".into(), "nothing is left"),
        ("input: {expression: '1', dimension: 3}\ndomain: {union: [{half-space: {normal: [1, 0, 0]}}]}".into(), "no end along"),
        ("input: {expression: '1', dimension: 3}\ndomain: {union: []}".into(), "has no shapes"),
        ("input: {expression: '1', dimension: 2}\ndomain: {torus: {radius: 1, tube_radius: 0.5}}".into(), "3 dimensions"),
        ("input: {expression: '1', dimension: 3}\ndomain: {torus: {radius: 1, tube_radius: 2}}".into(), "tube_radius"),
        ("input: {expression: '1', dimension: 3}\ndomain: {ellipsoid: {radii: [1, 1]}}".into(), "has 2 coordinates, expected 3"),
        ("input: {expression: '1', dimension: 3}\ndomain: {difference: [{ball: {radius: 1}}]}".into(), "fewer than two"),
    ] {
        let error = refused(&text);
        assert!(error.contains(part), "{text}\n{error}");
    }
}
