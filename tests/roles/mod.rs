//! What variables are taken for: the spellings of every community in every container of grids, against a cloud that is
//! known in closed form.
//!
//! The cloud expands as v = H x, rotates about the z axis, and is magnetized: all its fields are linear in space, so that
//! interpolation between nodes, or between the middles of cells, is exact.

mod curvilinear;
mod energies;
mod names;
mod sphere;

use crate::grids::{CONTAINERS, Container, Field, Grid, Variables, archive, npy};
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use sph_formats::common::particle_names as columns;
use sph_formats::{FORMATS, ParticleFile};
use sph_prep::relaxation::Control;
use sph_prep::{Report, Scene, place};

/// Numbers along the axes are all different, so that exchanged axes are seen.
fn grid(container: &Container) -> Grid {
    let has_cells = container.states_cells;
    Grid { counts: [6, 5, 7], low: [-1.0, -0.5, 1.0], high: [1.0, 1.5, 4.0], has_cells }
}

fn density(x: [f64; 3]) -> f64 {
    3.0 + 0.2 * x[0] - 0.1 * x[1] + 0.3 * x[2]
}

fn velocity_x(x: [f64; 3]) -> f64 {
    0.5 * x[0] - 2.0 * x[1]
}

fn velocity_y(x: [f64; 3]) -> f64 {
    0.5 * x[1] + 2.0 * x[0]
}

fn velocity_z(x: [f64; 3]) -> f64 {
    0.5 * x[2]
}

fn field_x(x: [f64; 3]) -> f64 {
    1.0 + x[1]
}

fn field_y(x: [f64; 3]) -> f64 {
    -x[2]
}

fn field_z(x: [f64; 3]) -> f64 {
    4.0 * x[0]
}

fn energy(x: [f64; 3]) -> f64 {
    7.0 + x[0] + x[1]
}

fn pressure(x: [f64; 3]) -> f64 {
    9.0 - x[0] + x[2]
}

fn temperature(x: [f64; 3]) -> f64 {
    1e4 * (5.0 + x[1])
}

fn helium(x: [f64; 3]) -> f64 {
    0.25 + 0.01 * x[2]
}

fn run(folder: &std::path::Path, (file, density): (&str, &str), more: &str) -> (ParticleFile, Report) {
    let path = folder.join(file);
    let scene = format!(
        "input: {{file: '{}', interpolation: linear, density: {density}}}\nparticles: 24\npolish: none\nwvt: {{iterations: 0}}\n{more}",
        path.display()
    );
    let mut scene = Scene::parse(&scene).unwrap();
    scene.output.box_factor = 1.0;
    place(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// Places of the particles as the input has them, where interpolation is exact.
fn places(file: &ParticleFile, container: &Container) -> Vec<(usize, [f64; 3])> {
    let x = file.species[0].table.column(columns::COORDINATES).unwrap().values.to_f64();
    let Grid { counts, low, high, has_cells } = grid(container);
    let half: [f64; 3] =
        std::array::from_fn(|k| if has_cells { 0.5 * (high[k] - low[k]) / counts[k] as f64 } else { 0.0 });
    let shift: [f64; 3] = std::array::from_fn(|k| 0.5 * (file.header.box_size[k] - (high[k] - low[k])) - low[k]);
    let all = x.chunks(3).enumerate().map(|(i, p)| (i, std::array::from_fn(|k| p[k] - shift[k])));
    // Beyond the middles of the outermost cells values are constant.
    all.filter(|(_, x): &(usize, [f64; 3])| (0..3).all(|k| x[k] > low[k] + half[k] && x[k] < high[k] - half[k]))
        .collect()
}

/// Every particle of a column has the value of the closed form.
fn check(file: &ParticleFile, container: &Container, column: &str, expected: &[Field], label: &str) {
    let found = file.species[0].table.column(column);
    let found = found.unwrap_or_else(|| panic!("{label}: no column {column}"));
    assert_eq!(found.components, expected.len(), "{label}, {column}");
    let places = places(file, container);
    assert!(places.len() > 4, "{label}: {} particles to compare", places.len());
    for (i, x) in places {
        for (k, f) in expected.iter().enumerate() {
            let value = found.values.get(i * expected.len() + k);
            let tolerance = 1e-9 * (1.0 + f(x).abs());
            assert!((value - f(x)).abs() < tolerance, "{label}, {column}[{k}] at {x:?}: {value}, expected {}", f(x));
        }
    }
}

#[test]
fn every_spelling_arrives() {
    spellings_arrive(|container, community| (container + community) % 4 == 0);
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn every_spelling_arrives_through_every_container() {
    spellings_arrive(|_, _| true);
}

/// Those of the communities whose numbers go with those of the containers.
fn spellings_arrive(is_tried: fn(usize, usize) -> bool) {
    let folder = tempfile::tempdir().unwrap();
    for (i, container) in CONTAINERS.iter().enumerate() {
        let communities = names::COMMUNITIES.iter().enumerate();
        for (_, community) in communities.filter(|(j, _)| is_tried(i, *j)) {
            let variables: Vec<(&str, Field)> = community.variables();
            (container.write)(&folder.path().join(container.file), &grid(container), &variables);
            let (file, report) = run(folder.path(), (container.file, community.density), "");
            let label = format!("{} in {}", community.name, container.file);
            check(&file, container, columns::VELOCITIES, &[velocity_x, velocity_y, velocity_z], &label);
            if community.field.is_some() {
                check(&file, container, columns::MAGNETIC_FIELD, &[field_x, field_y, field_z], &label);
            }
            for (name, column, f) in [
                (community.energy, columns::INTERNAL_ENERGY, energy as Field),
                (community.pressure, columns::PRESSURE, pressure),
                (community.temperature, columns::TEMPERATURE, temperature),
                (community.helium, community.helium.unwrap_or(""), helium),
            ] {
                if name.is_some() {
                    check(&file, container, column, &[f], &label);
                }
            }
            assert!(report.warnings.is_empty(), "{label}: {:?}", report.warnings);
            // Nothing is left under a name that says nothing.
            for v in &report.variables {
                assert!(v.role.is_some() && v.written_as.is_some(), "{label}: {v:?}");
            }
        }
    }
}

fn nodes() -> &'static Container {
    &CONTAINERS[0]
}

fn written(variables: &Variables<'_>, more: &str) -> (ParticleFile, Report) {
    let folder = tempfile::tempdir().unwrap();
    (nodes().write)(&folder.path().join(nodes().file), &grid(nodes()), variables);
    run(folder.path(), (nodes().file, "rho"), more)
}

#[test]
fn u_alone_is_an_energy_and_in_company_a_velocity() {
    let (file, _) = written(&[("rho", density), ("u", energy)], "");
    check(&file, nodes(), columns::INTERNAL_ENERGY, &[energy], "u alone");
    assert!(file.species[0].table.column(columns::VELOCITIES).is_none());
    let all: &Variables<'_> = &[("rho", density), ("u", velocity_x), ("v", velocity_y), ("w", velocity_z)];
    let (file, _) = written(all, "");
    check(&file, nodes(), columns::VELOCITIES, &[velocity_x, velocity_y, velocity_z], "u, v, w");
    assert!(file.species[0].table.column(columns::INTERNAL_ENERGY).is_none());
}

/// OpenFOAM's name for it, and everybody's.
#[test]
fn a_vector_named_by_a_letter_is_a_velocity() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["U", "v", "gas_velocity"] {
        let path = folder.path().join("vector.vtk");
        let text = format!(
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 3\nORIGIN 0 0 0\nSPACING 1 1 1\nCELL_DATA 8\n\
             SCALARS rho float 1\nLOOKUP_TABLE default\n{}\nVECTORS {name} float\n{}\n",
            "1 ".repeat(8),
            "1 2 3 ".repeat(8)
        );
        std::fs::write(&path, text).unwrap();
        let (file, _) = run(folder.path(), ("vector.vtk", "rho"), "");
        let velocities = file.species[0].table.column(columns::VELOCITIES).unwrap_or_else(|| panic!("{name}"));
        assert!(velocities.values.to_f64().chunks(3).all(|v| v == [1.0, 2.0, 3.0]), "{name}");
    }
}

#[test]
fn a_map_overrules_names() {
    let variables: &Variables<'_> = &[
        ("rho", density),
        ("a", velocity_x),
        ("b", velocity_y),
        ("c", velocity_z),
        ("vx", temperature),
        ("e", energy),
    ];
    let map = "map: {a: velocity-x, b: velocity-y, c: velocity-z, vx: temperature, e: internal-energy}";
    let (file, report) = written(variables, map);
    check(&file, nodes(), columns::VELOCITIES, &[velocity_x, velocity_y, velocity_z], "map");
    check(&file, nodes(), columns::TEMPERATURE, &[temperature], "map");
    check(&file, nodes(), columns::INTERNAL_ENERGY, &[energy], "map");
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    assert!(file.species[0].table.column("vx").is_none());
}

#[test]
fn components_about_the_origin_are_turned() {
    fn radius(x: [f64; 3]) -> f64 {
        x.iter().map(|c| c * c).sum::<f64>().sqrt()
    }
    // Expansion and rotation of the cloud in spherical components.
    fn v_r(x: [f64; 3]) -> f64 {
        0.5 * radius(x)
    }
    fn v_phi(x: [f64; 3]) -> f64 {
        2.0 * x[0].hypot(x[1])
    }
    let variables: &Variables<'_> = &[("rho", density), ("v_r", v_r), ("v_theta", |_| 0.0), ("v_phi", v_phi)];
    let (file, _) = written(variables, "map: {v_r: velocity-r, v_theta: velocity-theta, v_phi: velocity-phi}");
    check(&file, nodes(), columns::VELOCITIES, &[velocity_x, velocity_y, velocity_z], "spherical");
    // Without the map their center is a guess, which is not made.
    let (file, report) = written(variables, "");
    assert!(file.species[0].table.column(columns::VELOCITIES).is_none());
    let warned = |name: &str| report.warnings.iter().any(|w| w.contains(name) && w.contains("--map"));
    assert!(["v_r", "v_theta", "v_phi"].into_iter().all(warned), "{:?}", report.warnings);
}

/// PLUTO's VTK files of curved grids have their corners in x, y and z, and components along r, theta and phi.
#[test]
fn numbered_components_on_a_mesh_are_not_guessed() {
    let folder = tempfile::tempdir().unwrap();
    let corners: String = (0..27).map(|i| format!("{} {} {}\n", i % 3, i / 3 % 3, i / 9)).collect();
    let mut text = format!(
        "# vtk DataFile Version 3.0\nPLUTO\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS 3 3 3\nPOINTS 27 double\n{corners}CELL_DATA 8\n"
    );
    for (name, value) in [("rho", 1), ("vx1", 2), ("vx2", 3), ("vx3", 4)] {
        text += &format!("SCALARS {name} double 1\nLOOKUP_TABLE default\n{}", format!("{value}\n").repeat(8));
    }
    std::fs::write(folder.path().join("data.vtk"), text).unwrap();
    let scene = |more: &str| {
        let text = format!(
            "input: {{file: '{}/data.vtk', density: rho}}\nparticles: 20\npolish: none\nwvt: {{iterations: 0}}\n{more}",
            folder.path().display()
        );
        place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap()
    };
    let (file, report) = scene("");
    assert!(file.species[0].table.column(columns::VELOCITIES).is_none());
    assert!(report.warnings.iter().any(|w| w.contains("'vx1'") && w.contains("--map vx1=velocity-x")), "{report:?}");
    let (file, _) = scene("map: {vx1: velocity-x, vx2: velocity-y, vx3: velocity-z}");
    let v = file.species[0].table.column(columns::VELOCITIES).unwrap();
    assert_eq!([v.values.get(0), v.values.get(1), v.values.get(2)], [2.0, 3.0, 4.0]);
}

#[test]
fn names_alike_that_are_not_taken_are_warned_of() {
    let (file, report) = written(
        &[
            ("rho", density),
            ("mom1", velocity_x),
            ("Etot", energy),
            ("vx", velocity_x),
            ("vel1", velocity_y),
            ("ener", energy),
        ],
        "",
    );
    for part in [
        "'mom1' looks like a momentum",
        "'Etot' looks like an energy per volume",
        "'vx' has no velocity-y nor velocity-z beside it",
        "'vel1' is named like a velocity x, but 'vx' is taken for it",
        "'ener' is internal and kinetic energy together",
    ] {
        assert!(report.warnings.iter().any(|w| w.contains(part)), "{part}: {:?}", report.warnings);
    }
    assert!(report.text().contains("WARNING") && report.json().contains("mom1"));
    let moved = |x: [f64; 3]| velocity_x(x);
    check(&file, nodes(), columns::VELOCITIES, &[moved, |_| 0.0, |_| 0.0], "vx alone");
    assert!(report.text().contains("vx -> Velocities (velocity-x)"), "{}", report.text());
}

#[test]
fn a_mapping_that_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    (nodes().write)(
        &folder.path().join("grid.nc"),
        &grid(nodes()),
        &[("rho", density), ("vx", velocity_x), ("vy", velocity_y)],
    );
    for (map, parts) in [
        ("{vxx: velocity-x}", &["'vxx'", "did you mean 'vx'"][..]),
        ("{vx: velocity-y, vy: velocity-y}", &["both 'vx' and 'vy'"]),
        ("{vx: density}", &["'vx'", "input.density is 'rho'"]),
    ] {
        let text = format!("input: {{file: '{}/grid.nc', density: rho}}\nmap: {map}", folder.path().display());
        let error = place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string();
        for part in parts.iter().chain(&["scene, map"]) {
            assert!(error.contains(part), "{map}: {error}");
        }
    }
    let error = Scene::parse("map: {a: velocty}").unwrap_err().to_string();
    assert!(error.contains("did you mean 'velocity'") && error.contains("line 1"), "{error}");
}

/// A profile of 2 - r that expands as 3 r, in a table, a NetCDF file or an archive of NumPy.
fn write_profile(path: &std::path::Path, name: &str) {
    let radii: Vec<f64> = (0..20).map(|i| i as f64 / 19.0).collect();
    let (rho, v): (Vec<f64>, Vec<f64>) = radii.iter().map(|r| (2.0 - r, 3.0 * r)).unzip();
    match path.extension().unwrap().to_str().unwrap() {
        "nc" => {
            let mut file = ClassicFile::new();
            let r = file.dimension("radius", 20);
            for (name, values) in [("radius", &radii), ("rho", &rho), (name, &v)] {
                file.variable(name, &[r], Data::F64(values), &[]);
            }
            file.write(path).unwrap();
        }
        "npz" => {
            let all = [("r", &radii), ("rho", &rho), (name, &v)];
            archive(path, all.into_iter().map(|(name, values)| (name, npy("(20,)", values))));
        }
        _ => {
            let rows: String = (0..20).map(|i| format!("{} {} {}\n", radii[i], rho[i], v[i])).collect();
            std::fs::write(path, format!("# r rho {name}\n{rows}")).unwrap();
        }
    }
}

#[test]
fn a_radial_velocity_of_a_profile_points_outward() {
    let folder = tempfile::tempdir().unwrap();
    for container in ["star.txt", "star.nc", "star.npz"] {
        for name in ["v_r", "vr", "velocity", "v", "vel1", "u_r", "radial_velocity"] {
            write_profile(&folder.path().join(container), name);
            let (file, report) = run(folder.path(), (container, "rho"), "");
            let label = format!("{name} in {container}");
            let table = &file.species[0].table;
            let (x, v) = (table.column(columns::COORDINATES).unwrap(), table.column(columns::VELOCITIES));
            let v = v.unwrap_or_else(|| panic!("{label}: no velocities"));
            let middle = 0.5 * file.header.box_size[0];
            for i in 0..3 * table.count {
                let expected = 3.0 * (x.values.get(i) - middle);
                assert!((v.values.get(i) - expected).abs() < 1e-9, "{label}: {} and {expected}", v.values.get(i));
            }
            assert!(table.column(name).is_none() && report.warnings.is_empty(), "{label}: {:?}", report.warnings);
        }
    }
}

/// The last index of an array is that of components.
#[test]
fn vectors_of_an_archive_arrive_whole() {
    let folder = tempfile::tempdir().unwrap();
    let container = CONTAINERS.iter().find(|c| c.file == "grid.npz").unwrap();
    let grid = grid(container);
    let shape = grid.counts.map(|n| n.to_string()).join(", ");
    let lines = ["x", "y", "z"].into_iter().enumerate().map(|(k, name)| {
        let nodes = grid.line(k);
        (name, npy(&format!("({},)", nodes.len()), &nodes))
    });
    let rho = ("rho", npy(&format!("({shape})"), &grid.values(density)));
    let all = |fields: [Field; 3]| {
        let data: Vec<f64> = fields.into_iter().flat_map(|f| grid.values(f)).collect();
        npy(&format!("({shape}, 3)"), &data)
    };
    let vectors = [("vel", all([velocity_x, velocity_y, velocity_z])), ("B", all([field_x, field_y, field_z]))];
    archive(&folder.path().join(container.file), lines.chain([rho]).chain(vectors));
    let (file, report) = run(folder.path(), (container.file, "rho"), "");
    check(&file, container, columns::VELOCITIES, &[velocity_x, velocity_y, velocity_z], "vel");
    check(&file, container, columns::MAGNETIC_FIELD, &[field_x, field_y, field_z], "B");
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
}

/// Arrays that look like axes are not left out in silence.
#[test]
fn axes_of_an_archive_are_known_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.npz");
    let rho = npy("(4, 3)", &[1.0; 12]);
    let outcome = |arrays: &[(&str, &[f64])]| {
        let lines = arrays.iter().map(|(name, values)| (*name, npy(&format!("({},)", values.len()), values)));
        archive(&path, lines.chain([("rho", rho.clone())]));
        let scene =
            format!("input: {{file: '{}'}}\nparticles: 50\npolish: none\nwvt: {{iterations: 1}}", path.display());
        place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).map_err(|e| e.to_string())
    };
    let refused = |arrays: &[(&str, &[f64])]| outcome(arrays).map(|_| ()).unwrap_err();
    let (four, three) = ([0.5, 1.0, 1.5, 2.0], [0.0, 1.0, 2.0]);
    let text = refused(&[("a", &four), ("b", &three)]);
    assert!(text.contains("'a'") && text.contains("as if it were an axis") && text.contains("R, z"), "{text}");
    let text = refused(&[("x", &four)]);
    assert!(text.contains("positions along x only"), "{text}");
    let text = refused(&[("R", &four), ("phi", &[0.0, 3.0, std::f64::consts::TAU])]);
    assert!(text.contains("'phi'") && text.contains("the same place"), "{text}");
    // Rings from 0.25 to 2.25 of density 1, and 3 high.
    let (file, report) = outcome(&[("R", &four), ("z", &[0.0, 1.0, 2.0, 3.0])]).unwrap();
    let volume = 3.0 * std::f64::consts::PI * (2.25 * 2.25 - 0.25 * 0.25);
    assert!((report.mass.total / volume - 1.0).abs() < 1e-6, "{} and {volume}", report.mass.total);
    assert_eq!(file.header.dimension, 3);
    // An array that no axis is like is a note.
    let (_, report) = outcome(&[("times", &[3.0, 1.0, 2.0])]).unwrap();
    assert!(report.notes.iter().any(|n| n.contains("left out") && n.contains("times")), "{:?}", report.notes);
}

#[test]
fn a_column_that_the_format_cannot_hold_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    (nodes().write)(
        &folder.path().join("grid.nc"),
        &grid(nodes()),
        &[
            ("rho", density),
            ("u", energy),
            ("x_mass_fraction_He", helium),
            ("he4", helium),
            ("Bx", field_x),
            ("By", field_y),
            ("Bz", field_z),
        ],
    );
    for (output, lost, kept) in [
        ("ic.phantom", &["x_mass_fraction_He"][..], &["he4", "Bx"][..]),
        ("ic.gadget", &["x_mass_fraction_He", "he4", "Bx"], &[]),
        ("ic.vtu", &[], &["x_mass_fraction_He", "he4"]),
    ] {
        let mut scene = Scene::parse(&format!(
            "input: {{file: '{}/grid.nc', density: rho}}\nparticles: 100\npolish: none\nwvt: {{iterations: 0}}",
            folder.path().display()
        ))
        .unwrap();
        scene.output.file = Some(folder.path().join(output));
        let report = sph_prep::run(&scene, FORMATS, &Control::default()).unwrap();
        for name in lost {
            assert!(
                report.warnings.iter().any(|w| w.contains(name) && w.contains("is not written")),
                "{output}: {name}"
            );
            assert!(report.variables.iter().any(|v| v.name == *name && v.written_as.is_none()), "{output}: {name}");
        }
        let text = sph_formats::read(FORMATS, &folder.path().join(output), None, &Default::default()).unwrap();
        let sph_formats::FileContent::Particles(back) = text else { panic!("{output} holds no particles") };
        for name in kept {
            assert!(
                !report.warnings.iter().any(|w| w.contains(&format!("'{name}'")) && w.contains("not written")),
                "{name}"
            );
            let found = back.species[0]
                .table
                .columns
                .iter()
                .any(|c| c.name.starts_with(name) || c.name == columns::MAGNETIC_FIELD);
            assert!(found, "{output}: {name} is not in the file");
        }
    }
}
