//! Scenes of several bodies: what is conserved, who is who, and what is refused.

use sph_prep::relaxation::{Event, StopReason};
use sph_prep::{BodiesReport, Control, FORMATS, ParticleFile, Scene, place_bodies};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

fn placed(scene: &str) -> (ParticleFile, BodiesReport) {
    place_bodies(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(scene: &str) -> String {
    let scene = Scene::parse(scene).unwrap();
    place_bodies(&scene, FORMATS, &Control::default()).err().unwrap().to_string()
}

/// Rows of a column, and masses.
fn rows(file: &ParticleFile, name: &str) -> Vec<Vec<f64>> {
    let table = &file.species[0].table;
    let c = table.column(name).unwrap_or_else(|| panic!("no '{name}'"));
    (0..table.count).map(|i| (0..c.components).map(|k| c.values.get(i * c.components + k)).collect()).collect()
}

/// Sum of m x over the rows of one body, or of all, over that of m.
fn mean(file: &ParticleFile, name: &str, body: Option<f64>) -> Vec<f64> {
    let (values, masses, ids) = (rows(file, name), rows(file, "Masses"), rows(file, "BodyID"));
    let (mut sum, mut total) = (vec![0.0; values[0].len()], 0.0);
    for ((v, m), id) in values.iter().zip(&masses).zip(&ids) {
        if body.is_none_or(|b| b == id[0]) {
            total += m[0];
            sum.iter_mut().zip(v).for_each(|(s, v)| *s += m[0] * v);
        }
    }
    sum.iter().map(|s| s / total).collect()
}

const STARS: &str = "bodies:\n- {name: big, input: {profile: {polytrope: {n: 1.5, mass: 2, radius: 1}}}}\n\
                     - {name: small, input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 0.5}}}}\n\
                     particles: 1500\nwvt: {iterations: 2}\nsolver: {evaluations: 3}\n";

#[test]
fn a_binary_is_on_its_orbit_about_a_center_of_mass_at_rest() {
    let (file, report) = placed(&format!("{STARS}orbit: {{semi_major_axis: 4, eccentricity: 0.25, phase: 0.3}}\n"));
    let count = |id: f64| rows(&file, "BodyID").iter().filter(|b| b[0] == id).count();
    assert_eq!([count(1.0), count(2.0)], [1000, 500]);
    let ids: Vec<f64> = rows(&file, "ParticleIDs").concat();
    assert!(ids.iter().enumerate().all(|(i, id)| *id == i as f64 + 1.0));
    assert_eq!([report.bodies[0].ids, report.bodies[1].ids], [[1, 1000], [1001, 1500]]);
    let masses = rows(&file, "Masses").concat();
    let total: f64 = masses.iter().sum();
    // The atmosphere that few particles do not resolve is cut.
    assert!((total - 3.0).abs() < 0.02 && (total / report.mass - 1.0).abs() < 1e-12, "{total}");
    assert!(masses.iter().all(|m| (m / masses[0] - 1.0).abs() < 1.5e-3));
    let middle = 0.5 * file.header.box_size[0];
    for (k, x) in mean(&file, "Coordinates", None).iter().enumerate() {
        assert!((x - middle).abs() < 1e-12 * middle, "center of mass {k}: {x}");
    }
    let momentum = mean(&file, "Velocities", None);
    assert!(momentum.iter().all(|v| v.abs() < 2e-14), "momentum {momentum:?}");
    // Energy and angular momentum of two points.
    let [a, b] = [1.0, 2.0].map(|id| (mean(&file, "Coordinates", Some(id)), mean(&file, "Velocities", Some(id))));
    let x: Vec<f64> = (0..3).map(|k| b.0[k] - a.0[k]).collect();
    let v: Vec<f64> = (0..3).map(|k| b.1[k] - a.1[k]).collect();
    let length = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let energy = 0.5 * length(&v).powi(2) - total / length(&x);
    assert!((energy / (-total / 8.0) - 1.0).abs() < 1e-9, "{energy}");
    let momentum = x[0] * v[1] - x[1] * v[0];
    assert!((momentum / (total * 4.0 * (1.0 - 0.0625)).sqrt() - 1.0).abs() < 1e-9, "{momentum}");
    assert!(x[2] == 0.0 || x[2].abs() < 1e-12);
    let period = report.orbit.unwrap().period.unwrap();
    assert!((period / (std::f64::consts::TAU * (64.0 / total).sqrt()) - 1.0).abs() < 1e-12);
    let text = report.text();
    for word in ["body big", "body small", "orbit", "center of mass", "IDs 1001 to 1500", "period"] {
        assert!(text.contains(word), "{text} lacks {word}");
    }
    assert!(report.json().contains("\"momentum\""));
}

#[test]
fn stars_that_corotate_turn_with_their_orbit() {
    let (file, report) = placed(&format!("{STARS}orbit: {{semi_major_axis: 4, corotation: true}}\n"));
    let omega = std::f64::consts::TAU / report.orbit.unwrap().period.unwrap();
    let middle = 0.5 * file.header.box_size[0];
    for (x, v) in rows(&file, "Coordinates").iter().zip(&rows(&file, "Velocities")) {
        let solid = [-omega * (x[1] - middle), omega * (x[0] - middle), 0.0];
        (0..3).for_each(|k| assert!((v[k] - solid[k]).abs() < 1e-10, "{v:?} {solid:?}"));
    }
}

#[test]
fn an_impact_touches_with_the_speed_and_angle_asked_for() {
    let orbit = "{impact_parameter: 0.7, velocity_over_escape: 1.1, distance: 5}";
    let (file, report) = placed(&format!("{STARS}orbit: {orbit}\n"));
    // Of the profiles, wherever their outermost particles are.
    let surface = |i: usize| report.bodies[i].figures.as_ref().unwrap().radius.unwrap();
    let contact = surface(0) + surface(1);
    assert!((contact - 1.5).abs() < 1e-6 && contact > report.bodies[0].radius + report.bodies[1].radius);
    let [a, b] = [1.0, 2.0].map(|id| (mean(&file, "Coordinates", Some(id)), mean(&file, "Velocities", Some(id))));
    let (x, v): (Vec<f64>, Vec<f64>) =
        ((0..3).map(|k| b.0[k] - a.0[k]).collect(), (0..3).map(|k| b.1[k] - a.1[k]).collect());
    let (r, v2) = (x[0].hypot(x[1]), v[0] * v[0] + v[1] * v[1]);
    assert!((r - 5.0).abs() < 1e-10 && v[0] < 0.0);
    let escape = (2.0 * report.mass / contact).sqrt();
    let at_contact = (v2 - 2.0 * report.mass / r + 2.0 * report.mass / contact).sqrt();
    assert!((at_contact / (1.1 * escape) - 1.0).abs() < 1e-9);
    let momentum = x[0] * v[1] - x[1] * v[0];
    assert!((momentum / (0.7 * contact * at_contact) - 1.0).abs() < 1e-9);
    assert!(report.notes.iter().any(|n| n.contains("the bodies meet")), "{:?}", report.notes);
}

#[test]
fn positions_velocities_and_spins_are_as_stated_and_materials_stay() {
    let (file, report) = placed(
        "bodies:\n\
         - {input: {expression: '1'}, domain: {ball: {center: [7, 0], radius: 1}}, position: [-2, 0], velocity: [1, 0.5], spin: [3],\n   \
            material: [{id: 5}], thermal: {internal_energy: 2}}\n\
         - {input: {expression: '2'}, domain: {box: [[0, 0], [1, 1]]}, position: [2, 1], material: [{id: 9}], thermal: {internal_energy: 1}}\n\
         particle_mass: 0.01\ndomain: {box: [[-5, -5], [5, 5]], boundary: [periodic]}\nwvt: {iterations: 2}\nsolver: {evaluations: 3}\n",
    );
    assert_eq!(file.header.dimension, 2);
    assert_eq!(file.header.box_size, [10.0, 10.0, 0.0]);
    assert_eq!(file.header.periodic, [true, true, false]);
    let masses = rows(&file, "Masses").concat();
    assert_eq!(report.bodies.iter().map(|b| b.ids[1] + 1 - b.ids[0]).collect::<Vec<_>>(), [314, 200]);
    assert!(masses.iter().all(|m| (m / 0.01 - 1.0).abs() < 1.5e-3));
    let close = |found: Vec<f64>, expected: [f64; 2]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
    };
    close(mean(&file, "Coordinates", Some(1.0)), [3.0, 5.0]);
    close(mean(&file, "Coordinates", Some(2.0)), [7.0, 6.0]);
    close(mean(&file, "Velocities", Some(1.0)), [1.0, 0.5]);
    close(mean(&file, "Velocities", Some(2.0)), [0.0, 0.0]);
    let momentum = 1.0 * report.bodies[0].mass;
    assert!((report.momentum[0] / momentum - 1.0).abs() < 1e-12);
    for (((x, v), id), m) in rows(&file, "Coordinates")
        .iter()
        .zip(rows(&file, "Velocities"))
        .zip(rows(&file, "BodyID"))
        .zip(rows(&file, "MaterialIDs"))
    {
        if id[0] == 1.0 {
            close(v, [1.0 - 3.0 * (x[1] - 5.0), 0.5 + 3.0 * (x[0] - 3.0)]);
        }
        assert_eq!(m[0], if id[0] == 1.0 { 5.0 } else { 9.0 });
    }
    let energies = rows(&file, "InternalEnergy");
    assert_eq!([energies[0][0], energies[513][0]], [2.0, 1.0]);
}

#[test]
fn units_are_the_same_whatever_the_numbers_are_written_in() {
    let scene = |mass: &str, radius: &str, axis: &str, units: &str| {
        format!(
            "{units}bodies:\n- input: {{profile: {{polytrope: {{n: 1, mass: {mass}, radius: {radius}}}}}}}\n\
             - input: {{profile: {{polytrope: {{n: 1, mass: {mass}, radius: {radius}}}}}}}\n\
             orbit: {{semi_major_axis: {axis}}}\nparticles: 400\nwvt: {{iterations: 2}}\npolish: none\noutput: {{units: solar}}\n"
        )
    };
    let (plain, _) = placed(&scene("1", "1", "5", "units: solar\n"));
    let (units, report) = placed(&scene("1 Msun", "6.957e5 km", "5 Rsun", ""));
    for name in ["Coordinates", "Velocities", "Masses", "InternalEnergy"] {
        for (a, b) in rows(&plain, name).concat().iter().zip(rows(&units, name).concat()) {
            assert!((a - b).abs() < 1e-9 * (a.abs() + 1.0), "{name}: {a} {b}");
        }
    }
    assert_eq!(report.units, "solar");
    // G is 1 in solar units: two solar masses 5 solar radii apart.
    let period = report.orbit.unwrap().period.unwrap();
    assert!((period / (std::f64::consts::TAU * (125.0 / report.mass).sqrt()) - 1.0).abs() < 1e-9);
    // The same body twice is placed once.
    let [a, b] = [&report.bodies[0].report["seconds"], &report.bodies[1].report["seconds"]];
    assert!(a.is_number() && a == b);
}

/// Balls of an expression touch at the sum of their radii, however many particles they have; what part of its ball is vacuum ends where its particles do.
#[test]
fn contact_does_not_depend_on_the_number_of_particles() {
    let touch = |count: usize, density: &str| {
        let ball =
            format!("{{input: {{expression: '{density}'}}, domain: {{ball: {{center: [0, 0, 0], radius: 1}}}}}}");
        let (_, report) = placed(&format!(
            "bodies:\n- {ball}\n- {ball}\nparticles: {count}\npolish: none\nwvt: {{iterations: 2}}\norbit: {{impact_parameter: 0, velocity_at_contact: 9, distance: 5}}\n"
        ));
        let meet = report.notes.iter().find_map(|n| n.split("they touch at ").nth(1)).unwrap().to_owned();
        meet.parse::<f64>().unwrap()
    };
    assert_eq!([60, 400].map(|count| touch(count, "1 + 0.1*x")), [2.0; 2]);
    assert!(touch(100, "if(r < 0.5, 1, 0)") < 1.01);
}

#[test]
fn halos_wider_than_a_periodic_box_are_told() {
    let text = "bodies:\n- {input: {profile: {hernquist: {mass: 1, scale_radius: 1, outer_radius: 10}}}, collisionless: true, particles: 300}\n\
                - {point_mass: 1, type: 5, position: [1, 0, 0]}\ndomain: {box: [[-2, -2, -2], [2, 2, 2]], boundary: periodic}\noutput: {units: code}\n";
    let (_, report) = placed(text);
    assert!(
        report.warnings.iter().any(|w| w.contains("body 1 is wider than the periodic box")),
        "{:?}",
        report.warnings
    );
    let (_, report) = placed(&text.replace('2', "12"));
    assert!(!report.warnings.iter().any(|w| w.contains("wider")), "{:?}", report.warnings);
}

#[test]
fn scenes_that_cannot_be_get_one_clear_line() {
    let ball = |extra: &str| {
        format!("{{input: {{expression: '1'}}, domain: {{ball: {{center: [0, 0, 0], radius: 1}}}}{extra}}}")
    };
    let two = |a: &str, b: &str, rest: &str| {
        format!("bodies:\n- {}\n- {}\nparticles: 200\nwvt: {{iterations: 1}}\npolish: none\n{rest}", ball(a), ball(b))
    };
    for (scene, words) in [
        (two("", ", position: [0.5, 0, 0]", ""), &["bodies[1]", "and 2 overlap", "move them apart"][..]),
        (two("", "", "orbit: {semi_major_axis: 1.5}\n"), &["orbit.semi_major_axis", "too small"]),
        (
            two("", "", "orbit: {impact_parameter: 0.5, velocity_over_escape: 1, distance: 1.5}\n"),
            &["orbit.distance", "too small"],
        ),
        (
            two("", "", "orbit: {impact_parameter: 0.5, distance: 5}\n"),
            &["orbit", "velocity_at_contact", "expected one"],
        ),
        (two("", "", "orbit: {semi_major_axis: 5, impact_parameter: 0.5}\n"), &["orbit", "both"]),
        (two("", "", "orbit: {}\n"), &["orbit", "neither"]),
        (two("", "", "orbit: {semi_major_axis: 5, eccentricity: 1}\n"), &["orbit.eccentricity", "less than 1"]),
        (two("", ", position: [9, 0, 0]", "orbit: {semi_major_axis: 5}\n"), &["bodies[2]", "orbit settles"]),
        (two("", ", position: [1e300, 0, 0]", ""), &["bodies[1].position", "nearer"]),
        (two("", ", position: [9, 0]", ""), &["bodies[2].position", "2 components", "expected 3"]),
        (two("", ", position: [9, 0, 0], spin: [1]", ""), &["bodies[2].spin", "1 components", "expected 3"]),
        (two("", ", position: [9, 0, 1 kg]", ""), &["bodies[2].position[2]", "a mass", "a length"]),
        (two("", ", position: [9, 0, 0], material: [{id: 3}]", ""), &["bodies[1]", "MaterialIDs", "body 2 has"]),
        (
            two("", ", position: [9, 0, 0], thermal: {internal_energy: 3}", ""),
            &["bodies[1]", "InternalEnergy", "body 2 has"],
        ),
        (two("", ", position: [9, 0, 0], fields: {a: b}", ""), &["bodies[2].fields.a", "unknown name"]),
        (two("", ", position: [9, 0, 0]", "particle_mass: 1\n"), &["particle_mass", "particles", "both"]),
        (
            two("", ", position: [9, 0, 0]", "domain: {box: [[-2, -2, -2], [2, 2, 2]]}\n"),
            &["bodies[2]", "out of the box"],
        ),
        (
            two("", ", position: [9, 0, 0]", "domain: {box: [[-5, -5, -5], [5, 5, 5]], boundary: periodic}\n"),
            &["bodies[2]", "on axis 0, out of the periodic box"],
        ),
        (two("", ", position: [9, 0, 0]", "input: {expression: '1'}\n"), &["input", "beside `bodies`"]),
        (two("", ", input: {file: nothing.nc}", ""), &["line"]),
        (
            "bodies:\n- {input: {expression: '1'}, domain: {box: [[0], [1]], boundary: [periodic]}}\n".into(),
            &["bodies[1].domain.boundary", "periodic"],
        ),
        ("bodies:\n- {name: moon}\n".into(), &["bodies[moon].input", "neither"]),
        ("orbit: {semi_major_axis: 3}\ninput: {expression: '1', dimension: 3}\n".into(), &["orbit", "bodies"]),
        (
            format!(
                "bodies:\n- {}\n- {{input: {{expression: '1'}}, domain: {{ball: {{center: [0, 0], radius: 1}}}}}}\n",
                ball("")
            ),
            &["bodies[2]", "2-D", "3-D"],
        ),
        (
            format!("bodies:\n- {}\n- {{input: {{profile: {{white-dwarf: {{mass: 1 Msun}}}}}}}}\n", ball("")),
            &["bodies[1].input", "no units", "length_unit"],
        ),
    ] {
        let error = match Scene::parse(&scene) {
            Ok(scene) => place_bodies(&scene, FORMATS, &Control::default()).err().unwrap().to_string(),
            Err(error) => error.to_string(),
        };
        for word in words {
            assert!(error.contains(word), "{scene}\n{error} lacks {word:?}");
        }
    }
    assert!(refused("bodies: []\ninput: {expression: '1', dimension: 1}\n").contains("none"));
}

#[test]
fn a_star_goes_around_a_point() {
    let scene = "bodies:\n- {name: hole, point_mass: 10, type: 5}\n\
                 - {name: star, input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}}\n\
                 orbit: {semi_major_axis: 9}\nparticles: 500\nwvt: {iterations: 2}\npolish: none\n";
    let (file, report) = placed(scene);
    assert_eq!(file.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(0, 500), (5, 1)]);
    let hole = &file.species[1].table;
    let value = |name: &str, k: usize| hole.column(name).unwrap().values.get(k);
    assert_eq!([value("Masses", 0), value("ParticleIDs", 0), value("BodyID", 0)], [10.0, 1.0, 1.0]);
    assert_eq!(rows(&file, "ParticleIDs")[0], [2.0]);
    // The center of mass of both is at rest in the middle.
    let (x, v) = (mean(&file, "Coordinates", None), mean(&file, "Velocities", None));
    let gas = report.bodies[1].mass;
    let middle = 0.5 * file.header.box_size[0];
    for k in 0..3 {
        assert!((gas * (x[k] - middle) + 10.0 * (value("Coordinates", k) - middle)).abs() < 1e-10);
        assert!((gas * v[k] + 10.0 * value("Velocities", k)).abs() < 1e-12);
    }
    let speed = (v[1] - value("Velocities", 1)).abs();
    assert!((speed / ((10.0 + gas) / 9.0).sqrt() - 1.0).abs() < 1e-9, "{speed}");
    assert!(report.text().contains("body hole: a point"), "{}", report.text());
    for (points, words) in [
        ("- {point_mass: 10}\n- {point_mass: 1}\n", &["bodies", "points all"][..]),
        ("- {point_mass: -10}\n", &["bodies[1].point_mass", "-10", "more than 0"]),
        ("- {point_mass: 10 km}\n", &["bodies[1].point_mass", "a length", "a mass"]),
        ("- {point_mass: 10, type: 0}\n", &["bodies[1].type", "1 to 5"]),
        ("- {point_mass: 10, spin: [0, 0, 1]}\n", &["bodies[1].point_mass", "leave the rest out"]),
        (
            "- {input: {expression: '1', dimension: 3}, domain: {ball: {radius: 1}}, type: 1}\n",
            &["bodies[1].type", "gas has type 0"],
        ),
    ] {
        let error = refused(&format!("bodies:\n{points}"));
        for word in words {
            assert!(error.contains(word), "{points}: {error} lacks {word:?}");
        }
    }
}

#[test]
fn another_orbit_of_the_same_bodies_takes_them_from_the_cache() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("kept");
    let scene =
        |axis: f64, rest: &str| format!("{STARS}cache: {}\norbit: {{semi_major_axis: {axis}}}\n{rest}", kept.display());
    let (first, report) = placed(&scene(4.0, ""));
    assert!(report.bodies.iter().all(|b| !b.cached));
    let (again, report) = placed(&scene(4.0, ""));
    assert!(report.bodies.iter().all(|b| b.cached) && report.text().contains("from the cache"));
    assert!(report.bodies[0].report["density_error"].is_object());
    let (wide, report) = placed(&scene(6.0, ""));
    assert!(report.bodies.iter().all(|b| b.cached) && (report.orbit.unwrap().distance - 6.0).abs() < 1e-12);
    for name in ["Coordinates", "Velocities", "Masses", "InternalEnergy", "SupportRadius"] {
        assert_eq!(rows(&first, name), rows(&again, name), "{name}");
    }
    assert_ne!(rows(&first, "Coordinates"), rows(&wide, "Coordinates"));
    assert_eq!(rows(&first, "InternalEnergy"), rows(&wide, "InternalEnergy"));
    // Another seed is another body, and a damaged file is made anew.
    assert!(placed(&scene(4.0, "seed: 7\n")).1.bodies.iter().all(|b| !b.cached));
    for entry in std::fs::read_dir(&kept).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&path, bytes).unwrap();
    }
    let (mended, report) = placed(&scene(4.0, ""));
    assert!(report.bodies.iter().all(|b| !b.cached));
    assert_eq!(rows(&first, "Coordinates"), rows(&mended, "Coordinates"));
    assert!(
        refused(&format!("input: {{expression: '1', dimension: 1}}\ncache: {}\n", kept.display())).contains("cache")
    );
}

/// A surface is part of a body, though the scene only names its file.
#[test]
fn a_body_is_made_anew_when_the_file_of_its_surface_has_changed() {
    let folder = tempfile::tempdir().unwrap();
    let surface = folder.path().join("rock.obj");
    let scene = format!(
        "bodies:\n  - {{input: {{expression: '1', dimension: 3}}, domain: {{surface: {{file: {}}}}}, particles: 100, polish: none}}\ncache: {}\n",
        surface.display(),
        folder.path().join("kept").display()
    );
    let of_edge = |edge: f64| {
        let corners = [[0.0; 3], [edge, 0.0, 0.0], [0.0, edge, 0.0], [0.0, 0.0, edge]];
        let corners: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
        std::fs::write(&surface, corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n").unwrap();
        let (file, report) = placed(&scene);
        (rows(&file, "Masses").concat().iter().sum::<f64>(), report.bodies[0].cached)
    };
    let (small, large) = (of_edge(1.0), of_edge(2.0));
    // Volumes of surfaces are found along lines, to some 2e-7.
    assert!((small.0 * 6.0 - 1.0).abs() < 1e-6 && (large.0 * 6.0 / 8.0 - 1.0).abs() < 1e-6, "{small:?} {large:?}");
    assert!(!small.1 && !large.1 && of_edge(2.0).1);
}

#[test]
fn a_scene_of_bodies_prints_and_reads_back() {
    let text = format!("{STARS}orbit: {{semi_major_axis: 4 Rsun, corotation: true}}\n");
    let scene = Scene::parse(&text).unwrap();
    assert_eq!(Scene::parse(&scene.to_yaml()).unwrap(), scene, "{}", scene.to_yaml());
}

/// A ball on one side of a box turns: positions about the center of mass, its own velocities and magnetic fields; the velocity of the
/// whole and its spin do not.
#[test]
fn a_body_is_turned_with_its_vectors() {
    let scene = |turn: &str| {
        placed(&format!(
            "bodies:\n- input: {{expression: '1 + x'}}\n  domain: {{box: [[0, 0, 0], [1, 2, 3]]}}\n  fields: {{velocity: [1 + y, 2, 3], magnetic_field: [x, 0.5, 0], tag: x}}\n  \
             thermal: {{internal_energy: 2}}\n  velocity: [5, 6, 7]\n  spin: [0, 0, 2]\n  {turn}particles: 300\nwvt: {{iterations: 1}}\nsolver: {{evaluations: 1}}\n\
             domain: {{box: [[-5, -5, -5], [5, 5, 5]]}}\n"
        ))
        .0
    };
    let (upright, turned) = (scene("\n"), scene("orientation: [90, 0, 30]\n"));
    // About x by a right angle: y to z, z to -y; then about z.
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let turn = |v: &[f64]| [cos * v[0] + sin * v[2], sin * v[0] - cos * v[2], v[1]];
    let spin = |x: &[f64; 3]| [-2.0 * x[1], 2.0 * x[0], 0.0];
    let all = |name: &str| rows(&upright, name).into_iter().zip(rows(&turned, name));
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() < 1e-12, "{a} {b}"));
    for ((x, y), (v, w)) in all("Coordinates").zip(all("Velocities")) {
        let from: [f64; 3] = std::array::from_fn(|k| x[k] - 5.0);
        let to = turn(&from);
        near(&[y[0] - 5.0, y[1] - 5.0, y[2] - 5.0], &to);
        let (before, after) = (spin(&from), spin(&to));
        let own: [f64; 3] = std::array::from_fn(|k| v[k] - before[k] - [5.0, 6.0, 7.0][k]);
        let expected = turn(&own);
        near(&w, &std::array::from_fn::<f64, 3, _>(|k| expected[k] + after[k] + [5.0, 6.0, 7.0][k]));
    }
    all("MagneticField").for_each(|(b, c)| near(&c, &turn(&b)));
    all("tag").for_each(|(a, b)| assert_eq!(a, b));
    for (turn, part) in [
        ("orientation: [1, 2]\n", "three angles"),
        ("orientation: 30\n", "three angles"),
        ("orientation: [0, .nan, 0]\n", "three angles"),
    ] {
        let error = refused(&format!(
            "bodies:\n- input: {{expression: '1'}}\n  domain: {{box: [[0, 0, 0], [1, 1, 1]]}}\n  {turn}particles: 50\n"
        ));
        assert!(error.contains("bodies[1].orientation") && error.contains(part), "{error}");
    }
}

/// An interrupt within the first of two bodies leaves both, as far as they have come, if that is asked for; else nothing.
#[test]
fn an_interrupt_within_a_body_leaves_all_of_them_if_asked_to() {
    for (output, is_written) in [("output: {on_interrupt: write}\n", true), ("", false)] {
        let scene =
            Scene::parse(&format!("{STARS}orbit: {{semi_major_axis: 4}}\nseeding: random\npolish: solver\n{output}"))
                .unwrap();
        let interrupted = AtomicBool::new(false);
        let observer = |event: Event| {
            if matches!(event, Event::Iteration { .. }) {
                interrupted.store(true, Relaxed);
            }
        };
        let control = Control { interrupted: &interrupted, observer: &observer, ..Control::default() };
        match place_bodies(&scene, FORMATS, &control) {
            Ok((file, report)) => {
                assert!(is_written && report.stop == StopReason::Interrupted);
                assert_eq!((file.species[0].table.count, report.bodies.len()), (1500, 2));
            }
            Err(error) => assert!(!is_written && error.to_string().contains("interrupted"), "{error}"),
        }
    }
}

#[test]
fn a_single_particle_has_a_box() {
    let (file, _) = placed("bodies: [{input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}, particles: 1}]\n");
    let edge = file.header.box_size[0];
    assert!(edge > 0.0 && rows(&file, "Coordinates")[0].iter().all(|x| *x > 0.0 && *x < edge), "{edge}");
}

/// A pressure of 0 beside an internal energy would be another state than either says.
#[test]
fn a_pressure_that_one_body_has_is_left_out() {
    let scene = "bodies:\n- {name: a, input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}}\n\
                 - {name: b, input: {expression: '1'}, domain: {ball: {center: [0, 0, 0], radius: 0.3}}, position: [5, 0, 0], \
                 thermal: {internal_energy: 1}}\nparticles: 300\npolish: none\nwvt: {iterations: 2}\n";
    let (file, report) = placed(scene);
    assert!(file.species[0].table.column("Pressure").is_none() && rows(&file, "InternalEnergy").len() == 300);
    assert!(
        report.notes.iter().any(|note| note.contains("'Pressure' is left out") && note.contains(": b;")),
        "{:?}",
        report.notes
    );
    let error = refused(&format!("{scene}domain: {{boundary: periodic}}\n"));
    assert!(error.contains("domain.boundary") && error.contains("state `domain.box`"), "{error}");
    let error = refused(&format!("{scene}checkpoint: {{file: a.checkpoint}}\n"));
    assert!(error.contains("checkpoint") && error.contains("`cache`"), "{error}");
    let error = refused(&scene.replace("name: b", "name: a"));
    assert!(error.contains("bodies[a].name") && error.contains("another body"), "{error}");
}

/// A body may move by itself, as one of a snapshot does: its orbit is that of its center of mass nevertheless.
#[test]
fn an_orbit_is_that_of_centers_of_mass_of_bodies_that_moved() {
    let scene = |fields: &str| {
        format!(
            "bodies:\n- {{name: gas, input: {{profile: {{polytrope: {{n: 1.5, mass: 2, radius: 1}}}}}}, particles: 400{fields}}}\n- {{name: point, point_mass: 1}}\n\
             wvt: {{iterations: 1}}\nsolver: {{evaluations: 1}}\norbit: {{semi_major_axis: 4, eccentricity: 0.2, phase: 0.3}}\n"
        )
    };
    let (still, report) = placed(&scene(""));
    assert!(!report.notes.iter().any(|n| n.contains("had a bulk velocity")), "{:?}", report.notes);
    let (moving, report) = placed(&scene(", fields: {velocity: ['0.3 - 0.2*y', '0.2*x', '-0.7']}"));
    let told = report.notes.iter().find(|n| n.contains("'gas' had a bulk velocity")).expect("it is told");
    assert!(told.contains("-7.0000e-1"), "{told}");
    let whole = |file: &ParticleFile| mean(file, "Velocities", Some(1.0));
    for (k, (a, b)) in whole(&still).iter().zip(whole(&moving)).enumerate() {
        assert!((a - b).abs() < 1e-12, "{k}: {a} {b}");
        assert!((report.bodies[0].velocity[k] - b).abs() < 1e-12);
    }
    // Its own rotation stays.
    let spread = |file: &ParticleFile| rows(file, "Velocities").iter().map(|v| v[0]).fold(0.0, f64::max);
    assert!(spread(&moving) > spread(&still) + 0.1);
}

/// Coordinates about the center of mass of a body, or of all.
fn about_center(file: &ParticleFile, body: Option<f64>) -> Vec<Vec<f64>> {
    let (center, places) = (mean(file, "Coordinates", body), rows(file, "Coordinates"));
    let ids = rows(file, "BodyID");
    let own = places.iter().zip(&ids).filter(|(_, id)| body.is_none_or(|b| b == id[0]));
    own.map(|(x, _)| x.iter().zip(&center).map(|(x, c)| x - c).collect()).collect()
}

fn differ(a: &[Vec<f64>], b: &[Vec<f64>], factor: f64) -> f64 {
    assert_eq!(a.len(), b.len());
    let off = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - factor * b).abs()).fold(0.0, f64::max);
    a.iter().zip(b).map(off).fold(0.0, f64::max)
}

/// A star that was relaxed before goes on an orbit as it is, whatever the units of the scene.
#[test]
fn a_snapshot_that_says_nothing_of_its_particles_keeps_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("star.hdf5");
    let star = format!(
        "bodies:\n- {{input: {{profile: {{polytrope: {{n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}}}}, spin: [0, 0, 1e-4 1/s]}}\nparticles: 120\n\
         wvt: {{iterations: 2}}\npolish: none\noutput: {{file: '{}', double_precision: true, units: solar}}\n",
        path.display()
    );
    let (alone, _) = placed(&star);
    sph_prep::run_bodies(&Scene::parse(&star).unwrap(), FORMATS, &Control::default()).unwrap();
    let body = format!("input: {{file: '{}'}}", path.display());
    for (units, length) in [("solar", 1.0), ("cgs", 6.957e10)] {
        let scene = format!(
            "bodies:\n- {{{body}}}\n- {{{body}, position: [5 Rsun, 0, 0], velocity: [1 km/s, 0, 0]}}\n- {{point_mass: 1 Msun, position: [0, 9 Rsun, 0]}}\n\
             output: {{units: {units}}}\n"
        );
        let (file, report) = placed(&scene);
        assert!(report.bodies.iter().take(2).all(|b| b.ids[1] - b.ids[0] == 119), "{:?}", report.bodies);
        let old = about_center(&alone, None);
        for id in [1.0, 2.0] {
            // Rounding of places within boxes that are some radii wide.
            let off = differ(&about_center(&file, Some(id)), &old, length);
            assert!(off < 1e-13 * length * 40.0, "{units}: {off}");
        }
        let energy = |file: &ParticleFile| rows(file, "InternalEnergy").concat();
        let (old, new) = (energy(&alone), energy(&file));
        let factor = new[0] / old[0];
        assert!(old.iter().zip(&new).all(|(old, new)| (new / (factor * old) - 1.0).abs() < 1e-14));
        assert_eq!(factor == 1.0, units == "solar");
        // In what it moves with, on top of what it has of its own.
        if units == "cgs" {
            let speed = |body| mean(&file, "Velocities", Some(body))[0];
            assert!(speed(1.0).abs() < 1e-6 && (speed(2.0) - 1e5).abs() < 1e-6, "{} {}", speed(1.0), speed(2.0));
            let spread = rows(&file, "Velocities").iter().map(|v| v[0].abs()).fold(0.0, f64::max);
            assert!(spread > 1e5, "a spin of 1e-4 1/s: {spread}");
        }
    }
    // A number of particles, or what places them, places them anew.
    let anew = format!("bodies:\n- {{{body}, particles: 80}}\nwvt: {{iterations: 2}}\npolish: none\n");
    assert_eq!(placed(&anew).0.species[0].table.count, 80);
    // As many as it had, where only what they carry is stated.
    let tinted = format!("bodies:\n- {{{body}, fields: {{hue: x}}}}\nwvt: {{iterations: 2}}\npolish: none\n");
    assert_eq!(placed(&tinted).0.species[0].table.count, 120);
    let kept = body.replace("}", ", keep_particles: true}");
    let said = refused(&format!("bodies:\n- {{{kept}, seeding: random}}\n"));
    assert!(said.contains("seeding") && said.contains("keep_particles: false"), "{said}");
    let said =
        refused("bodies:\n- {input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}, keep_particles: true}}\n");
    assert!(said.contains("keep_particles") && said.contains("snapshot"), "{said}");
}

/// Numbers without units are in those of the scene; a format of one mass refuses particles of several.
#[test]
fn a_snapshot_that_keeps_its_particles_is_what_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pair.hdf5");
    let star = |mass: f64, x: f64| {
        format!(
            "- {{input: {{profile: {{polytrope: {{n: 1.5, mass: {mass}, radius: 1}}}}}}, particles: 100, position: [{x}, 0, 0], velocity: [0, {x}, 0]}}\n"
        )
    };
    let pair = format!(
        "bodies:\n{}{}wvt: {{iterations: 2}}\npolish: none\noutput: {{file: '{}', units: code, double_precision: true}}\n",
        star(1.0, 0.0),
        star(2.0, 3.0),
        path.display()
    );
    sph_prep::run_bodies(&Scene::parse(&pair).unwrap(), FORMATS, &Control::default()).unwrap();
    let scene =
        format!("units: solar\nbodies:\n- {{input: {{file: '{}'}}}}\noutput: {{units: solar}}\n", path.display());
    let (file, report) = placed(&scene);
    let total: f64 = rows(&file, "Masses").concat().iter().sum();
    assert!((total - 3.0).abs() < 0.05, "{total}");
    let reach = about_center(&file, None).iter().map(|x| x[0].abs()).fold(0.0, f64::max);
    assert!((1.5..4.0).contains(&reach), "{reach}");
    assert!(report.notes.iter().any(|note| note.contains("has a bulk velocity")), "{:?}", report.notes);
    let dump = folder.path().join("pair.tmp");
    let into = scene.replace("{units: solar}\n", &format!("{{file: '{}', format: phantom}}\n", dump.display()));
    let said = sph_prep::run_bodies(&Scene::parse(&into).unwrap(), FORMATS, &Control::default());
    let said = said.expect_err("one mass").to_string();
    assert!(said.contains("one mass") && said.contains("`particles`") && !dump.exists(), "{said}");
}
