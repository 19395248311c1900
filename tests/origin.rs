//! Where the result lies: `output.origin`, the defaults of formats, and what is refused.

use sph_prep::{Control, FORMATS, ParticleFile, Report, Scene, place, place_bodies};

fn placed(scene: &str) -> (ParticleFile, Report) {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{scene}\n{e}"))
}

fn refused(scene: &str) -> String {
    let scene = Scene::parse(scene).unwrap();
    place(&scene, FORMATS, &Control::default()).err().unwrap().to_string()
}

/// Coordinates of all particles of a type, interleaved.
fn coordinates(file: &ParticleFile, part_type: u8) -> Vec<f64> {
    let species = file.species.iter().find(|s| s.part_type == part_type).unwrap();
    species.table.column("Coordinates").unwrap().values.to_f64()
}

/// The center of mass of all particles.
fn center_of_mass(file: &ParticleFile) -> Vec<f64> {
    let d = file.header.dimension;
    let (mut moment, mut total) = (vec![0.0; d], 0.0);
    for species in &file.species {
        let (x, m) = (species.table.column("Coordinates").unwrap(), species.table.column("Masses").unwrap());
        for i in 0..species.table.count {
            total += m.values.get(i);
            (0..d).for_each(|k| moment[k] += m.values.get(i) * x.values.get(i * d + k));
        }
    }
    moment.iter().map(|x| x / total).collect()
}

/// Boxes from corner to corner off the origin, with more mass on one side.
const BOXES: [(&str, [f64; 3], [f64; 3]); 3] = [
    ("domain: {box: [[-3], [1]]}\n", [-3.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ("domain: {box: [[-3, 2], [1, 4]]}\n", [-3.0, 2.0, 0.0], [1.0, 4.0, 0.0]),
    ("domain: {box: [[-3, 2, -7], [1, 4, -5]]}\n", [-3.0, 2.0, -7.0], [1.0, 4.0, -5.0]),
];
const SKEW: &str = "input: {expression: '5 + x'}\nparticles: 150\npolish: none\nwvt: {iterations: 3}\n";

#[test]
fn the_origin_is_the_point_that_is_asked_for() {
    for (d, (domain, lo, hi)) in BOXES.into_iter().enumerate() {
        let d = d + 1;
        let scene = |output: &str| placed(&format!("{SKEW}{domain}output: {{format: netcdf{output}}}\n"));
        let (plain, _) = scene("");
        assert_eq!(plain.header.box_corner, None);
        let (first, box_size) = (coordinates(&plain, 0), plain.header.box_size);
        // The body is in the middle of the box: its lower corner is so far from that of the box.
        let margin = |k: usize| 0.5 * (box_size[k] - (hi[k] - lo[k]));
        let mass = center_of_mass(&plain);
        let point: Vec<f64> = (0..d).map(|k| 0.25 + k as f64).collect();
        // Where the corner of the body is, in each case.
        let cases: [(String, Vec<f64>); 5] = [
            ("corner".into(), (0..d).map(margin).collect()),
            ("center".into(), (0..d).map(|k| margin(k) - 0.5 * box_size[k]).collect()),
            ("center-of-mass".into(), (0..d).map(|k| margin(k) - mass[k]).collect()),
            ("input".into(), lo[..d].to_vec()),
            (format!("{point:?}"), (0..d).map(|k| lo[k] - point[k]).collect()),
        ];
        for (name, at) in cases {
            let (file, report) = scene(&format!(", origin: {name}"));
            let corner = file.header.box_corner.unwrap();
            for (i, (x, before)) in coordinates(&file, 0).iter().zip(&first).enumerate() {
                let k = i % d;
                assert!((x - (before - margin(k) + at[k])).abs() < 1e-12, "{d}-D, {name}: {x} of {before}");
                assert!(*x >= corner[k] && *x < corner[k] + box_size[k], "{d}-D, {name}: {x}");
            }
            (0..d).for_each(|k| assert!((corner[k] + margin(k) - at[k]).abs() < 1e-12, "{d}-D, {name}: {corner:?}"));
            assert_eq!(file.header.box_size, box_size, "{name}");
            let notes = report.notes.join("\n");
            assert!(notes.contains("the origin is") && notes.contains("output.origin"), "{notes}");
        }
    }
}

#[test]
fn particles_of_a_periodic_box_stay_in_it_wherever_it_lies() {
    let scene = |origin: &str| {
        format!(
            "input: {{expression: '2 + sin(pi*x)'}}\ndomain: {{box: [[-1, -1], [1, 1]], boundary: periodic}}\nparticles: 300\n\
             wvt: {{iterations: 3}}\npolish: none\noutput: {{format: vtk{origin}}}\n"
        )
    };
    let first = coordinates(&placed(&scene("")).0, 0);
    for (origin, corner) in [("input", [-1.0, -1.0]), ("center", [-1.0, -1.0]), ("[1, 0.5]", [-2.0, -1.5])] {
        let (file, _) = placed(&scene(&format!(", origin: {origin}")));
        assert_eq!(file.header.box_corner.unwrap()[..2], corner);
        for (i, (x, before)) in coordinates(&file, 0).iter().zip(&first).enumerate() {
            assert!((x - before - corner[i % 2]).abs() < 1e-14 && (corner[i % 2]..corner[i % 2] + 2.0).contains(x));
        }
    }
}

#[test]
fn phantom_has_the_center_of_mass_at_the_origin_and_others_the_corner_of_the_box() {
    let star = |more: &str| {
        placed(&format!(
            "input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}\nfields: {{pressure: 1}}\nparticles: 200\npolish: none\n{more}"
        ))
    };
    let (file, report) = star("output: {format: phantom}\n");
    assert!(center_of_mass(&file).iter().all(|x| x.abs() < 1e-14), "{:?}", center_of_mass(&file));
    assert!(report.notes.iter().any(|n| n.contains("the origin is the center of mass")), "{:?}", report.notes);
    let (by_code, _) = star("target_code: phantom\nbalance: false\n");
    assert!(center_of_mass(&by_code).iter().all(|x| x.abs() < 1e-14));
    for format in ["swift", "gadget", "gadget-binary", "gizmo", "arepo", "vtk", "netcdf", "numpy", "table"] {
        let (file, report) = star(&format!("output: {{format: {format}}}\n"));
        assert_eq!(file.header.box_corner, None, "{format}");
        assert!(report.notes.iter().any(|n| n.contains("moved to the middle of a box")), "{format}");
    }
    // A periodic box of Phantom's has no center of mass, and is as in other formats.
    let (boxed, _) = placed(
        "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\nfields: {pressure: 1}\n\
         particles: 100\npolish: none\noutput: {format: phantom}\n",
    );
    assert_eq!(boxed.header.box_corner, None);
}

#[test]
fn a_point_mass_counts_and_walls_do_not() {
    let (file, _) = placed(
        "input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}, core: {radius: 0.3, mass: 1e-3}}\nfields: {pressure: 1}\nparticles: 400\n\
         polish: none\noutput: {format: gadget, origin: center-of-mass}\n",
    );
    assert!(file.species.len() == 2 && center_of_mass(&file).iter().all(|x| x.abs() < 1e-14));

    let (mut file, _) = placed(
        "input: {expression: '1 + x'}\ndomain: {box: [[0, 0], [1, 1]], boundary: reflecting}\nwalls: {layers: 2}\nparticles: 200\n\
         polish: none\noutput: {format: vtk, origin: center-of-mass}\n",
    );
    assert!(center_of_mass(&file).iter().any(|x| x.abs() > 1e-3));
    file.species.retain(|s| s.part_type == 0);
    assert!(center_of_mass(&file).iter().all(|x| x.abs() < 1e-14));
}

#[test]
fn several_bodies_have_one_origin() {
    let scene = |origin: &str| {
        Scene::parse(&format!(
            "bodies:\n- {{name: a, input: {{profile: {{polytrope: {{n: 1.5, mass: 2, radius: 1}}}}}}, position: [-2, 0, 0]}}\n\
             - {{name: b, input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 0.5}}}}}}, position: [3, 1, 0]}}\n\
             particles: 300\npolish: none\nwvt: {{iterations: 2}}\noutput: {{format: {origin}}}\n"
        ))
        .unwrap()
    };
    let placed = |origin: &str| place_bodies(&scene(origin), FORMATS, &Control::default()).unwrap();
    let plain = placed("vtk").0;
    assert_eq!(plain.header.box_corner, None);
    for (origin, at) in [
        ("vtk, origin: center-of-mass", [0.0, 0.0, 0.0]),
        // The center of mass of bodies of 2 at x = -2 and 1 at (3, 1), as far as cutting atmospheres leaves their masses alone.
        ("vtk, origin: input", [-1.0 / 3.0, 1.0 / 3.0, 0.0]),
        ("vtk, origin: [1, 1, 1]", [-4.0 / 3.0, -2.0 / 3.0, -1.0]),
    ] {
        let (file, report) = placed(origin);
        let center = center_of_mass(&file);
        let is_near = |k: usize| (center[k] - at[k]).abs() < if origin.contains("mass") { 1e-12 } else { 0.05 };
        assert!((0..3).all(is_near), "{origin}: {center:?}");
        let (x, before) = (coordinates(&file, 0), coordinates(&plain, 0));
        let corner = file.header.box_corner.unwrap();
        assert!(x.iter().zip(&before).enumerate().all(|(i, (x, b))| (x - b - corner[i % 3]).abs() < 1e-12));
        assert!(report.notes.iter().any(|n| n.contains("the origin of the file")), "{:?}", report.notes);
    }
    let error = place_bodies(&scene("swift, origin: input"), FORMATS, &Control::default()).err().unwrap().to_string();
    assert!(error.contains("output.origin") && error.contains("'swift'"), "{error}");
}

#[test]
fn what_makes_no_sense_is_refused_before_the_work() {
    let open = "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]]}\nparticles: 100\n";
    let periodic = "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [open, open, periodic]}\nparticles: 100\n";
    for (scene, output, parts) in [
        (
            open,
            "{format: swift, origin: center-of-mass}",
            ["is center-of-mass", "coordinates of 'swift' go from 0", "leave it out"],
        ),
        (
            open,
            "{format: arepo, origin: [0, 0, 0]}",
            ["is [0, 0, 0]", "coordinates of 'arepo' go from 0", "write another format"],
        ),
        (
            periodic,
            "{format: gadget, origin: center}",
            ["is center", "'gadget' states of a periodic box its edge alone", "corner is at 0"],
        ),
        (
            periodic,
            "{format: vtk, origin: center-of-mass}",
            ["is center-of-mass", "no center of mass", "choose center, corner"],
        ),
        (open, "{format: vtk, origin: [1, 2]}", ["is [1, 2]", "a point of 2 coordinates", "the particles have 3"]),
        (open, "{format: vtk, origin: ['1 s', 0, 0]}", ["output.origin[0]", "is '1 s'", "Rsun"]),
        (
            open,
            "{format: vtk, origin: [0, 1e300, 0]}",
            ["is 1.0e300 times", "times the size of the domain away", "name a nearer point"],
        ),
        (open, "{format: vtk, origin: []}", ["output.origin", "has 0 coordinates", "one for each"]),
    ] {
        let error = refused(&format!("{scene}output: {output}\n"));
        for part in parts.iter().chain(&["scene, output.origin"]) {
            assert!(error.contains(part), "{output}: {error}");
        }
    }
    let wrong = |text: &str| Scene::parse(&format!("output: {{origin: {text}}}")).unwrap_err().to_string();
    assert!(wrong("centre-of-mass").contains("did you mean 'center-of-mass'?"), "{}", wrong("centre-of-mass"));
    assert!(wrong("true").contains("corner, center, center-of-mass, input, or a point"), "{}", wrong("true"));
}

#[test]
fn files_that_state_their_box_keep_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = placed(&format!("{SKEW}{}output: {{format: vtk, origin: center-of-mass}}\n", BOXES[2].0));
    for (format, extension) in [("vtk", "vtu"), ("netcdf", "nc"), ("numpy", "npz"), ("table", "csv")] {
        let path = folder.path().join(format!("ic.{extension}"));
        sph_formats::write(FORMATS, &path, Some(format), &file, sph_formats::WriteOptions::default()).unwrap();
        let request = sph_formats::FieldRequest::default();
        let content = sph_formats::read(FORMATS, &path, Some(format), &request).unwrap();
        let sph_formats::FileContent::Particles(back) = content else { panic!("{format}") };
        assert_eq!(back.header.box_corner, file.header.box_corner, "{format}");
        assert!(center_of_mass(&back).iter().all(|x| x.abs() < 1e-12), "{format}");
    }
    // SPH-EXA states limits, and its reader counts from the lower ones.
    let mut energy = file.clone();
    let gas = &mut energy.species[0].table;
    let values = sph_formats::Values::F64(vec![1.0; gas.count]);
    let dimension = sph_formats::UnitDimension::SPECIFIC_ENERGY;
    gas.columns.push(sph_formats::Column { name: "InternalEnergy".into(), components: 1, values, dimension });
    for (format, extension) in [("sph-exa", "sphexa"), ("phantom", "phantom")] {
        let path = folder.path().join(format!("ic.{extension}"));
        sph_formats::write(FORMATS, &path, Some(format), &energy, sph_formats::WriteOptions::default()).unwrap();
        let content = sph_formats::read(FORMATS, &path, Some(format), &Default::default()).unwrap();
        let sph_formats::FileContent::Particles(mut back) = content else { panic!("{format}") };
        back.move_corner_to_origin();
        let mut own = energy.clone();
        own.move_corner_to_origin();
        let (x, before) = (coordinates(&back, 0), coordinates(&own, 0));
        assert!(x.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-12), "{format}");
    }
}
