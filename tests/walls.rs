//! Wall particles around fluids, from the scene to the file.

use sph_formats::common::particle_names as names;
use sph_formats::{FieldRequest, FileContent, ParticleFile, Species};
use sph_prep::{Control, FORMATS, Report, Scene, WriteOptions, place, write};

fn placed(text: &str) -> (ParticleFile, Report) {
    place(&Scene::parse(text).unwrap(), FORMATS, &Control::default()).unwrap()
}

fn column(species: &Species, name: &str) -> Vec<f64> {
    species.table.column(name).unwrap_or_else(|| panic!("no column {name}")).values.to_f64()
}

fn rows<const D: usize>(species: &Species, name: &str) -> Vec<[f64; D]> {
    column(species, name).chunks_exact(D).map(|row| std::array::from_fn(|k| row[k])).collect()
}

fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

const HEAD: &str = "polish: none\noutput: {units: code}\n";

/// 400 particles in the unit square are 0.05 apart.
#[test]
fn a_tank_has_whole_layers_at_half_a_spacing_and_beyond() {
    let text = "particles: 400\ninput: {expression: '2', dimension: 2}\ndomain: {box: [[0, 0], [1, 1]], boundary: reflecting}\nwalls: {layers: 3}";
    let (file, report) = placed(&format!("{HEAD}{text}"));
    let [fluid, walls] = file.species.as_slice() else { panic!("{} kinds", file.species.len()) };
    assert_eq!((fluid.part_type, walls.part_type), (0, 5));
    // Three frames of 4 (20 + 2 k + 1) particles for k = 0, 1, 2, without those of corners that are too far away.
    let depths = column(walls, "SurfaceDistance");
    for layer in 0..3 {
        let here = depths.iter().filter(|d| (*d / 0.05 - 0.5 - f64::from(layer)).abs() < 1e-9).count();
        assert_eq!(here, 80, "layer {layer}");
    }
    assert!(depths.iter().all(|d| *d < 0.15) && walls.table.count < 80 * 3 + 4 * 9);
    assert!(report.notes.iter().any(|n| n.contains("wall particles of type 5")), "{:?}", report.notes);
    // The fluid lies within, at the place of its box in that of all.
    let (x, y) = (rows::<2>(fluid, names::COORDINATES), rows::<2>(walls, names::COORDINATES));
    assert!(x.iter().flatten().all(|v| (0.15..1.15).contains(v)));
    assert!(y.iter().flatten().all(|v| (0.0..1.3).contains(v)) && (file.header.box_size[0] - 1.3).abs() < 1e-9);
    // Normals lead to the surface, towards the fluid.
    for ((place, normal), depth) in y.iter().zip(rows::<2>(walls, "Normals")).zip(&depths) {
        let onto: [f64; 2] = std::array::from_fn(|k| place[k] + depth * normal[k]);
        let clamped = place.map(|v| v.clamp(0.15, 1.15));
        assert!(distance(&onto, &clamped) < 1e-9 && (normal[0].hypot(normal[1]) - 1.0).abs() < 1e-9);
    }
    // All are as heavy as the fluid there, to single precision, with numbers of their own.
    let masses = column(walls, names::MASSES);
    assert!(masses.iter().all(|m| (m / (2.0 / 400.0) - 1.0).abs() < 1e-6), "{}", masses[0]);
    let ids = column(walls, names::PARTICLE_IDS);
    assert!(ids.iter().enumerate().all(|(i, id)| *id == (401 + i) as f64));
}

/// Steps that fit into the box are not those of the fluid, or those that are asked for: walls are as heavy as fluid in their cells.
#[test]
fn walls_whose_steps_fit_the_box_are_as_heavy_as_the_fluid() {
    for (d, ends, more, steps) in [
        (3, "[[0, 0, 0], [1, 1, 0.35]]", "particles: 350\nwalls: {layers: 2}\n", vec![0.1, 0.1, 0.35 / 3.0]),
        (2, "[[0, 0], [1, 0.3]]", "particles: 100\nwalls: {layers: 2, spacing: 0.07}\n", vec![1.0 / 14.0, 0.075]),
        (1, "[[0], [1]]", "particles: 10\nwalls: {layers: 2, spacing: 0.15}\n", vec![1.0 / 7.0]),
    ] {
        let text = format!(
            "{HEAD}{more}input: {{expression: '2', dimension: {d}}}\ndomain: {{box: {ends}, boundary: reflecting}}\n"
        );
        let (file, report) = placed(&text);
        let walls = file.species.iter().find(|s| s.part_type != 0).unwrap();
        let mass = 2.0 * steps.iter().product::<f64>();
        let masses = column(walls, names::MASSES);
        assert!(masses.iter().all(|m| (m / mass - 1.0).abs() < 1e-6), "{d}-D: {} for {mass}", masses[0]);
        let (x, size) = (column(walls, names::COORDINATES), file.header.box_size);
        for k in 0..d {
            let mut along: Vec<f64> = x.iter().skip(k).step_by(d).copied().collect();
            along.sort_by(f64::total_cmp);
            along.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            let wide = along.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
            assert!((wide / steps[k] - 1.0).abs() < 1e-6, "{d}-D along {k}: {wide}");
            assert!(
                (along[0] - 0.5 * steps[k]).abs() < 1e-9
                    && (size[k] - along[along.len() - 1] - 0.5 * steps[k]).abs() < 1e-9
            );
        }
        let told = steps.iter().map(|s| format!("{s:.6e}")).collect::<Vec<_>>().join(" x ");
        assert!(report.notes.iter().any(|n| n.contains(&format!("{told} apart"))), "{:?}", report.notes);
    }
}

#[test]
fn walls_surround_round_bodies_and_obstacles_in_space() {
    for (domain, depth) in [
        (
            "ball: {radius: 1}",
            &(|x: &[f64; 3]| x.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0) as &dyn Fn(&[f64; 3]) -> f64,
        ),
        ("difference: [{box: [[-1, -1, -1], [1, 1, 1]]}, {ball: {radius: 0.5}}]", &|x: &[f64; 3]| {
            let beyond = x.map(|v| (v.abs() - 1.0).max(0.0)).iter().map(|v| v * v).sum::<f64>().sqrt();
            if beyond > 0.0 { beyond } else { 0.5 - x.iter().map(|v| v * v).sum::<f64>().sqrt() }
        }),
        ("cylinder: {radius: 1, length: 2, axis: z}", &|x: &[f64; 3]| {
            (x[0].hypot(x[1]) - 1.0).max(0.0).hypot((x[2].abs() - 1.0).max(0.0))
        }),
    ] {
        let text = format!(
            "{HEAD}particles: 2000\ninput: {{expression: '1', dimension: 3}}\ndomain: {{{domain}, boundary: reflecting}}\nwalls: {{layers: 2, spacing: 0.1, type: 3}}"
        );
        let (file, _) = placed(&text);
        let walls = &file.species[1];
        assert_eq!(walls.part_type, 3);
        let middle = 0.5 * file.header.box_size[0];
        let (x, depths) = (rows::<3>(walls, names::COORDINATES), column(walls, "SurfaceDistance"));
        assert!(x.len() > 1000, "{domain}: {}", x.len());
        for (x, found) in x.iter().zip(&depths) {
            let expected = depth(&x.map(|v| v - middle));
            assert!(
                (found - expected).abs() < 1e-6 && *found > 0.0 && *found < 0.2,
                "{domain} {x:?}: {found} {expected}"
            );
        }
    }
}

#[test]
fn periodic_axes_have_no_walls_and_a_tank_may_be_open() {
    let text = "particles: 400\ninput: {expression: '1', dimension: 2}\ndomain: {box: [[0, 0], [1, 1]], boundary: [periodic, reflecting]}\nwalls: {layers: 1}";
    let (file, _) = placed(&format!("{HEAD}{text}"));
    assert_eq!(file.species[1].table.count, 40);
    assert!((file.header.box_size[0] - 1.0).abs() < 1e-12 && (file.header.box_size[1] - 1.1).abs() < 1e-9);
    let dam = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/dam.yaml")).unwrap();
    let (file, _) = placed(&dam.replace("particles: 5000", "particles: 800"));
    let (fluid, walls) =
        (rows::<2>(&file.species[0], names::COORDINATES), rows::<2>(&file.species[1], names::COORDINATES));
    // 0.05 apart: three layers below, and left and right of the tank of 4 by 3; none above.
    let lowest = fluid.iter().map(|x| x[1]).fold(f64::INFINITY, f64::min);
    let highest = walls.iter().map(|x| x[1]).fold(0.0, f64::max);
    assert!((lowest - 0.15 - 0.025).abs() < 0.01, "{lowest}");
    assert!((highest - 3.15 + 0.025).abs() < 1e-9, "{highest}");
    let expected = 3 * 80 + 2 * 3 * 60;
    assert!(walls.len() >= expected && walls.len() <= expected + 2 * 9, "{} {expected}", walls.len());
}

#[test]
fn every_format_with_types_keeps_walls_and_tables_tell_them_apart() {
    let text = "particles: 100\ninput: {expression: '1', dimension: 3}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: reflecting}\nwalls: {layers: 1}\nthermal: {internal_energy: 1}";
    let (file, _) = placed(&format!("{HEAD}{text}"));
    let folder = tempfile::tempdir().unwrap();
    let count = file.species[1].table.count;
    assert!(count > 100);
    for (name, format) in [
        ("a.hdf5", "swift"),
        ("b.hdf5", "gadget"),
        ("c.npz", "numpy"),
        ("g.bi4", "dualsphysics"),
        ("d.vtu", "vtk"),
        ("e.vtp", "vtk"),
        ("f.vtk", "vtk"),
    ] {
        let path = folder.path().join(name);
        write(FORMATS, &path, Some(format), &file, WriteOptions::default()).unwrap();
        let back = match sph_formats::read(FORMATS, &path, None, &FieldRequest::default()).unwrap() {
            FileContent::Particles(back) => back,
            FileContent::Field(_) => panic!("{name} holds a field"),
        };
        let found: usize = match back.species.as_slice() {
            [gas, walls] => {
                assert_eq!((gas.table.count, walls.part_type), (100, 5), "{name}");
                let normals = walls.table.column("Normals").map(|c| c.values.to_f64()).unwrap();
                assert!(
                    normals.chunks_exact(3).all(|n| (n.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-5),
                    "{name}"
                );
                walls.table.count
            }
            [all] => column(all, "ParticleType").iter().filter(|t| **t == 5.0).count(),
            _ => panic!("{name} holds {} kinds", back.species.len()),
        };
        assert_eq!(found, count, "{name}");
    }
}

/// A tank that is larger than the fluid holds it; one elsewhere, or all around at a distance, does not.
#[test]
fn walls_that_hold_nothing_are_doubted() {
    let fluid = "input: {expression: '1', dimension: 2}\nparticles: 100\ndomain: {box: [[0, 0], [1, 1]]}\n";
    for (around, is_told) in [("[[0, 0], [5, 2]]", false), ("[[3, 3], [5, 5]]", true), ("[[-2, -2], [3, 3]]", true)] {
        let (_, report) = placed(&format!("{HEAD}{fluid}walls: {{around: {{box: {around}}}}}\n"));
        let told = report.warnings.iter().any(|w| w.contains("do not confine it"));
        assert_eq!(told, is_told, "{around}: {:?}", report.warnings);
    }
}

#[test]
fn walls_that_cannot_be_are_refused_by_key() {
    let fluid = "input: {expression: '1', dimension: 2}\nparticles: 100\ndomain: {box: [[0, 0], [1, 1]]}\n";
    for (walls, part) in [
        ("{layers: 0}", "walls.layers"),
        ("{type: 0}", "walls.type"),
        ("{spacing: 1e-9}", "walls.spacing"),
        ("{spacing: -1}", "walls.spacing"),
        ("{around: {box: [[0, 0], [0.5, 1]]}}", "in the fluid's domain"),
        ("{around: {box: [[0, 0, 0], [1, 1, 1]]}}", "has 3 coordinates, expected 2"),
        ("{around: {half-plane: {normal: [0, 1]}}}", "no end along"),
        ("{without: {box: [[-1, -1], [2, 2]]}}", "`without` leaves all of them out"),
        ("{layer: 1}", "layer"),
    ] {
        let text = format!("{HEAD}{fluid}walls: {walls}");
        let error = match Scene::parse(&text) {
            Err(error) => error.to_string(),
            Ok(scene) => place(&scene, FORMATS, &Control::default()).map(|_| ()).unwrap_err().to_string(),
        };
        assert!(error.contains(part), "{walls}: {error}");
    }
    let periodic = format!("{HEAD}{}walls: {{layers: 2}}\n", fluid.replace("1]]}", "1]], boundary: periodic}"));
    let error =
        place(&Scene::parse(&periodic).unwrap(), FORMATS, &Control::default()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("no axis of the domain has faces"), "{error}");
}
