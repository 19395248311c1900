//! What particles carry by a scene's expressions, against the expressions at the particles.

use sph_prep::{Control, FORMATS, ParticleFile, Scene, place};
use std::f64::consts::{PI, TAU};

/// Places a scene.
fn placed(scene: &str) -> ParticleFile {
    let scene = Scene::parse(scene).unwrap();
    let scene = Scene { wvt: sph_prep::scene::WvtInput { iterations: Some(2), ..scene.wvt }, ..scene };
    place(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}")).0
}

fn refused(scene: &str) -> String {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).err().unwrap().to_string()
}

/// Rows of a column.
fn column(file: &ParticleFile, name: &str) -> Vec<Vec<f64>> {
    let table = &file.species[0].table;
    let names = || table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>();
    let column = table.column(name).unwrap_or_else(|| panic!("no '{name}' among {:?}", names()));
    let row = |i: usize| (0..column.components).map(|k| column.values.get(i * column.components + k)).collect();
    (0..table.count).map(row).collect()
}

/// The largest deviation of a column from what it should be at the coordinates.
fn deviation(file: &ParticleFile, name: &str, expected: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
    let rows = column(file, name);
    let places = column(file, "Coordinates");
    let pairs = rows.iter().zip(&places);
    pairs
        .flat_map(|(row, x)| row.iter().zip(expected(x)).map(|(a, b)| (a - b).abs()).collect::<Vec<_>>())
        .fold(0.0, f64::max)
}

const SQUARE: &str = "domain: {box: [[0, 0], [1, 1]], boundary: [periodic]}\nparticles: 400\n";
const CUBE: &str = "domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 600\n";

#[test]
fn the_vortex_of_orszag_and_tang_is_what_its_expressions_say() {
    let file = placed(&format!(
        "input: {{expression: '25/(36*pi)'}}\n{SQUARE}fields:\n  velocity: ['-sin(2*pi*y)', 'sin(2*pi*x)']\n  \
         vector_potential: ['(cos(2*pi*y)/(2*pi) + cos(4*pi*x)/(4*pi))/sqrt(4*pi)']\n  pressure: 5/(12*pi)\n"
    ));
    let v = |x: &[f64]| vec![-(TAU * x[1]).sin(), (TAU * x[0]).sin()];
    assert_eq!(deviation(&file, "Velocities", v), 0.0);
    let b = |x: &[f64]| [-(TAU * x[1]).sin(), (2.0 * TAU * x[0]).sin(), 0.0].map(|c| c / (4.0 * PI).sqrt()).to_vec();
    // Truncation: k^7 h^6 / 140 with k = 4 pi and h = 1e-3 is 3e-13 of the potential; rounding 1e-16 / h as much.
    assert!(deviation(&file, "MagneticField", b) < 1e-11);
    let u = 5.0 / (12.0 * PI) / (2.0 / 3.0) / (25.0 / (36.0 * PI));
    assert!(deviation(&file, "InternalEnergy", |_| vec![u]) < 1e-14);
}

#[test]
fn numbers_of_fields_may_carry_their_units() {
    let scene = |fields: &str| {
        format!("input: {{expression: '1'}}\nunits: si\noutput: {{units: si}}\n{CUBE}fields: {fields}\n")
    };
    let file = placed(&scene(
        "{velocity: [30 km/s, '-2*km/s', 0], v_phi: 1 km/s, axis: [0, 0, 1], pressure: 2 bar, half: '0.5*pressure', reach: [1 km, 1 m]}",
    ));
    let v = |x: &[f64]| {
        let (x, y) = (x[0] - 0.5, x[1] - 0.5);
        let ring = x.hypot(y);
        vec![3e4 - 1e3 * y / ring, -2e3 + 1e3 * x / ring, 0.0]
    };
    assert!(deviation(&file, "Velocities", v) < 1e-10);
    // 2e5 Pa; density 1 and gamma 5/3.
    assert!(deviation(&file, "Pressure", |_| vec![2e5]) < 1e-9);
    assert!(deviation(&file, "half", |_| vec![1e5]) < 1e-9);
    assert!(deviation(&file, "InternalEnergy", |_| vec![3e5]) < 1e-9);
    assert!(deviation(&file, "reach", |_| vec![1e3, 1.0]) < 1e-12);
    assert_eq!(file.species[0].table.column("reach").unwrap().dimension, sph_formats::UnitDimension::LENGTH);
    for (fields, words) in [
        ("{velocity: [30 km, 0, 0]}", &["fields.velocity", "which is a length", "expected a velocity"][..]),
        ("{temperature: 3 bar, mean_molecular_weight: 1}", &["fields.temperature", "expected a temperature"]),
        ("{reach: [1 km, 1 s]}", &["fields.reach", "expected a length"]),
    ] {
        let error = refused(&scene(fields));
        assert!(words.iter().all(|word| error.contains(word)), "{fields}: {error}");
    }
    let error = refused(&format!("input: {{expression: '1'}}\n{CUBE}fields: {{velocity: [30 km/s, 0, 0]}}\n"));
    assert!(error.contains("fields.velocity") && error.contains("units: solar"), "{error}");
}

/// A Beltrami flow is its own curl up to a factor: A = (sin z + cos y, sin x + cos z, sin y + cos x) with waves of 2 pi.
#[test]
fn the_curl_of_a_potential_in_three_dimensions_has_all_components() {
    let file = placed(&format!(
        "input: {{expression: '1'}}\n{CUBE}fields:\n  vector_potential: ['sin(2*pi*z) + cos(2*pi*y)', 'sin(2*pi*x) + cos(2*pi*z)', \
         'sin(2*pi*y) + cos(2*pi*x)']\n"
    ));
    let b = |x: &[f64]| {
        let [x, y, z] = [x[0], x[1], x[2]].map(|v| TAU * v);
        [z.sin() + y.cos(), x.sin() + z.cos(), y.sin() + x.cos()].map(|c| TAU * c).to_vec()
    };
    assert!(deviation(&file, "MagneticField", b) < 1e-10);
}

#[test]
fn velocities_about_an_axis_add_up_and_point_the_right_way() {
    let ball = "input: {expression: '1'}\ndomain: {ball: {center: [0, 0, 0], radius: 1}}\nparticles: 300\n";
    let file = placed(&format!("{ball}fields: {{v_phi: 3*R, v_r: -r, v_z: 2, axis: [0, 0, 1]}}\n"));
    // The ball is in the middle of a box of 8.
    let v = |x: &[f64]| {
        let d = [x[0] - 4.0, x[1] - 4.0, x[2] - 4.0];
        vec![-3.0 * d[1] - d[0], 3.0 * d[0] - d[1], 2.0 - d[2]]
    };
    assert!(deviation(&file, "Velocities", v) < 1e-12);
    // About a tilted axis a rigid rotation is omega x d, and the polar way is phi x r.
    let file = placed(&format!("{ball}fields: {{v_phi: 'r*sin(theta)', axis: [0, 3, 4]}}\n"));
    let v = |x: &[f64]| {
        let (d, o) = ([x[0] - 4.0, x[1] - 4.0, x[2] - 4.0], [0.0, 0.6, 0.8]);
        vec![o[1] * d[2] - o[2] * d[1], o[2] * d[0] - o[0] * d[2], o[0] * d[1] - o[1] * d[0]]
    };
    assert!(deviation(&file, "Velocities", v) < 1e-12);
    let file = placed(&format!("{ball}fields: {{v_theta: R, v_R: z}}\n"));
    let v = |x: &[f64]| {
        let d = [x[0] - 4.0, x[1] - 4.0, x[2] - 4.0];
        let (big, r) = (d[0].hypot(d[1]), (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt());
        let across = d[2] / r + d[2] / big;
        vec![d[0] * across, d[1] * across, -big * big / r]
    };
    assert!(deviation(&file, "Velocities", v) < 1e-12);
    // Kepler's rotation has its pole in the center, where no particle is.
    let file = placed(&format!("{ball}fields: {{v_phi: sqrt(2/R)}}\n"));
    let v = |x: &[f64]| {
        let d = [x[0] - 4.0, x[1] - 4.0];
        let big = d[0].hypot(d[1]);
        let v = (2.0 / big).sqrt() / big;
        vec![-v * d[1], v * d[0], 0.0]
    };
    assert!(deviation(&file, "Velocities", v) < 1e-9);
    let file = placed("input: {expression: '1'}\ndomain: {box: [[-1], [1]]}\nparticles: 50\nfields: {v_r: 2}\n");
    assert_eq!(deviation(&file, "Velocities", |x| vec![if x[0] > 4.0 { 2.0 } else { -2.0 }]), 0.0);
    assert!(refused(&format!("{SQUARE}input: {{expression: '1'}}\nfields: {{v_theta: 1}}\n")).contains("2 dimension"));
}

#[test]
fn thermal_fields_become_energies_of_an_ideal_gas() {
    let head = format!("input: {{expression: '1 + 0.5*sin(2*pi*x)'}}\n{SQUARE}thermal: {{gamma: 1.4}}\n");
    let rho = |x: &[f64]| 1.0 + 0.5 * (TAU * x[0]).sin();
    let file = placed(&format!("{head}fields: {{entropy: 1 + y}}\n"));
    let u = |x: &[f64]| vec![(1.0 + x[1]) * rho(x).powf(0.4) / 0.4];
    assert!(deviation(&file, "InternalEnergy", u) < 1e-12);
    let file = placed(&format!("{head}fields: {{pressure: 3*rho^1.4 + extra, extra: x, u: pressure/(0.4*rho)}}\n"));
    let u = |x: &[f64]| vec![(3.0 * rho(x).powf(1.4) + x[0]) / (0.4 * rho(x))];
    assert!(deviation(&file, "InternalEnergy", u) < 1e-12);
    assert!(deviation(&file, "extra", |x| vec![x[0]]) < 1e-15);
    // k T / ((gamma - 1) mu m_H) of 1e4 K and 0.6 is 2.06e8 J/kg for gamma = 5/3; lengths in pc.
    let file = placed(
        "input: {expression: '1e-22', dimension: 3, length_unit: pc, density_unit: g/cm^3}\ndomain: {ball: {radius: 1}}\n\
         particles: 200\noutput: {units: cgs}\nfields: {temperature: 1e4, mean_molecular_weight: 0.6, velocity: [10*km/s, 0, 0]}\n",
    );
    let u = 1.5 * 1.380_649e-16 * 1e4 / (0.6 * 1.673_532_84e-24);
    assert!(deviation(&file, "InternalEnergy", |_| vec![u]) < 1e-9 * u);
    assert!(deviation(&file, "Velocities", |_| vec![1e6, 0.0, 0.0]) < 1e-6);
    assert!(deviation(&file, "Temperature", |_| vec![1e4]) < 1e-9);
}

#[test]
fn fields_stand_beside_the_columns_of_a_file_and_in_their_place() {
    let star = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");
    let scene = format!(
        "input: {{file: {star}, carry: [pressure]}}\nparticles: 800\noutput: {{units: cgs}}\n\
         fields: {{hydrogen: 0.7, material: 'if(r < 0.3*Rsun, 2, 1)', sound: sqrt(5/3*pressure/rho), v_phi: sqrt(G*Msun/Rsun^3)*R}}\n"
    );
    let file = placed(&scene);
    let (pressure, density) = (column(&file, "Pressure"), column(&file, "sound"));
    assert_eq!(deviation(&file, "hydrogen", |_| vec![0.7]), 0.0);
    let edge = file.header.box_size[0] / 2.0;
    let distance = |x: &[f64]| x.iter().map(|v| (v - edge) * (v - edge)).sum::<f64>().sqrt();
    let material = column(&file, "MaterialIDs");
    let places = column(&file, "Coordinates");
    for i in 0..places.len() {
        let inside = distance(&places[i]) < 0.3 * 6.957e10;
        assert_eq!(material[i][0], if inside { 2.0 } else { 1.0 });
        // u = P / ((gamma - 1) rho): c^2 = gamma (gamma - 1) u.
        let u = column_value(&file, "InternalEnergy", i);
        assert!((density[i][0].powi(2) / (5.0 / 3.0 * 2.0 / 3.0 * u) - 1.0).abs() < 1e-9, "{}", pressure[i][0]);
    }
    let omega = (6.674_30e-8 * 1.988_409_87e33 / 6.957e10_f64.powi(3)).sqrt();
    let v = |x: &[f64]| vec![-omega * (x[1] - edge), omega * (x[0] - edge), 0.0];
    assert!(deviation(&file, "Velocities", v) < 1e-6 * omega * 6.957e10);
    let replaced =
        placed(&format!("input: {{file: {star}, carry: []}}\nparticles: 300\nfields: {{u: 3*G*Msun/Rsun}}\n"));
    let u = column(&replaced, "InternalEnergy");
    assert!(u.iter().all(|v| (v[0] / 3.0 - 1.0).abs() < 1e-6), "in solar units: {:?}", u[0]);
}

fn column_value(file: &ParticleFile, name: &str, i: usize) -> f64 {
    file.species[0].table.column(name).unwrap().values.get(i)
}

#[test]
fn fields_that_make_no_sense_are_refused_with_their_names() {
    let head = format!("input: {{expression: '1 + x'}}\n{SQUARE}");
    for (fields, words) in [
        ("{pressure: 1, internal_energy: 1}", &["fields.", "pressure", "internal_energy", "disagrees", "gamma"][..]),
        ("{u: 1, internal_energy: 1}", &["fields.internal_energy", "fields.u", "two spellings"]),
        ("{entropy: 1, pressure: 2}", &["entropy", "pressure", "disagrees"]),
        ("{a: b, b: c2 + 1, c2: a}", &["depends on itself", "a -> b -> c2 -> a"]),
        ("{a: a + 1}", &["depends on itself", "fields.a"]),
        ("{a: ln(x - 0.5)}", &["fields.a", "inf", "finite"]),
        ("{a: furlongs}", &["fields.a", "column 1", "'furlongs'", "rho"]),
        ("{a: 3*kB}", &["fields.a", "kB", "units: solar"]),
        ("{temperature: 100}", &["mean_molecular_weight"]),
        ("{temperature: 100, mean_molecular_weight: 1}", &["kB", "units: solar"]),
        ("{velocity: [1, 2, 3]}", &["fields.velocity", "3 components", "expected 2"]),
        ("{velocity: 1}", &["fields.velocity", "1 components", "expected 2"]),
        ("{vector_potential: [1, 2]}", &["fields.vector_potential", "expected 3, or 1"]),
        ("{vector_potential: [1], magnetic_field: [1, 2]}", &["both given"]),
        ("{pressure: [1, 2]}", &["fields.pressure", "expected one"]),
        ("{pressure: x - 1}", &["fields.pressure", "below 0"]),
        ("{material: 1 + x}", &["fields.material", "whole"]),
        ("{rho: 1}", &["fields.rho", "placement itself"]),
        ("{theta: 1}", &["fields.theta", "name of a coordinate"]),
        ("{Msun: 1}", &["fields.Msun", "unit"]),
        ("{Masses: 1}", &["fields.Masses", "placement itself"]),
        ("{axis: [0, 0, 0], v_phi: 1}", &["fields.axis", "direction"]),
        ("{axis: 3}", &["fields.axis", "direction"]),
        ("{'a b': 1}", &["'a b'", "letters"]),
        ("{vx: 1, vy: 2}", &["fields.vx", "spelling of fields.v_x;", "another name"]),
        ("{v: [1, 2]}", &["fields.v", "fields.velocity"]),
        ("{v_rad: 1}", &["fields.v_rad", "fields.v_r;"]),
        ("{vphi: 1}", &["fields.vphi", "fields.v_phi"]),
        ("{vel2: 1}", &["fields.vel2", "fields.v_y"]),
        ("{Bx: 1}", &["fields.Bx", "fields.magnetic_field"]),
        ("{B: [1, 0, 0]}", &["fields.B", "fields.magnetic_field"]),
        ("{press: 1}", &["fields.press", "fields.pressure"]),
        ("{eint: 1}", &["fields.eint", "fields.internal_energy"]),
    ] {
        let error = refused(&format!("{head}fields: {fields}\n"));
        for word in words {
            assert!(error.contains(word), "{fields}: {error} lacks {word:?}");
        }
        assert!(!error.contains('\n'), "{error}");
    }
    for (turbulence, words) in [
        ("{}", &["turbulence", "one of the two"][..]),
        ("{mach: 1, rms_velocity: 1}", &["turbulence", "one of the two"]),
        ("{mach: 1}", &["turbulence.mach", "sound speed"]),
        ("{rms_velocity: 1 km}", &["turbulence.rms_velocity", "a velocity"]),
        ("{rms_velocity: 1, wavenumbers: [3, 2]}", &["turbulence.wavenumbers", "ascend"]),
        ("{rms_velocity: 1, wavenumbers: [1.1, 1.2]}", &["turbulence.wavenumbers", "no wave"]),
        ("{rms_velocity: 1, compressive: 2}", &["turbulence.compressive", "0 to 1"]),
    ] {
        let error = refused(&format!("{head}turbulence: {turbulence}\n"));
        for word in words {
            assert!(error.contains(word), "{turbulence}: {error} lacks {word:?}");
        }
    }
    let both = refused(&format!("{head}thermal: {{internal_energy: 2}}\nfields: {{pressure: 1}}\n"));
    assert!(both.contains("both given"), "{both}");
}

/// The file would have pressures that are not those of its energies. Without the pressure, or of pressures that a scene states, all is as before.
#[test]
fn an_energy_for_all_particles_that_contradicts_the_inputs_pressure_is_refused() {
    let star = |energy: &str, more: &str| {
        format!(
            "input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}{more}}}\nparticles: 100\npolish: none\nwvt: {{iterations: 0}}\n\
             thermal: {{internal_energy: {energy}}}\noutput: {{units: code}}\n"
        )
    };
    let error = refused(&star("30", ""));
    for word in ["thermal.internal_energy", "disagrees with pressure", "3.000000e1"] {
        assert!(error.contains(word), "{error} lacks {word:?}");
    }
    let file = placed(&star("30", ", carry: []"));
    assert!(file.species[0].table.column("Pressure").is_none());
    assert_eq!(column(&file, "InternalEnergy")[0], [30.0]);
    let even = "input: {expression: '2'}\ndomain: {box: [[0, 0], [1, 1]], boundary: [periodic]}\nparticles: 100\npolish: none\nfields: {pressure: 4}\n";
    let energy = column(&placed(even), "InternalEnergy")[0][0];
    assert!((energy - 3.0).abs() < 1e-14, "{energy}");
}

#[test]
fn a_scene_with_fields_prints_and_reads_back() {
    let text = format!(
        "input: {{expression: '1'}}\n{SQUARE}fields: {{velocity: [-1, '2*x'], entropy: 2.5, axis: [0, 0, 1]}}\n"
    );
    let scene = Scene::parse(&text).unwrap();
    assert_eq!(Scene::parse(&scene.to_yaml()).unwrap(), scene, "{}", scene.to_yaml());
}

/// A grid of cells whose velocity turns around in the middle: no particle gets one in between.
#[test]
fn cells_of_a_grid_keep_their_velocities_to_their_faces() {
    let folder = tempfile::tempdir().unwrap();
    let grid = folder.path().join("cells.vtk");
    let row = "-1 0 0\n-1 0 0\n1 0 0\n1 0 0\n";
    let head = "# vtk DataFile Version 3.0\ncells\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 3 1\nORIGIN 0 0 0\nSPACING 0.25 0.5 1\n";
    let ones = "1 1 1 1 1 1 1 1\n";
    let text = format!(
        "{head}CELL_DATA 8\nSCALARS density double 1\nLOOKUP_TABLE default\n{ones}VECTORS velocity double\n{row}{row}"
    );
    std::fs::write(&grid, text).unwrap();
    let file =
        placed(&format!("input: {{file: {}}}\ndomain: {{boundary: [reflecting]}}\nparticles: 300\n", grid.display()));
    assert_eq!(file.header.dimension, 2);
    assert_eq!(deviation(&file, "Velocities", |x| vec![if x[0] < 0.5 { -1.0 } else { 1.0 }, 0.0]), 0.0);
}

#[test]
fn a_temperature_of_a_file_gives_an_energy_with_a_mean_molecular_weight_and_says_so_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("star.csv");
    let row =
        |i: i32| format!("{},{},{}\n", 1e10 * f64::from(i) / 50.0, 2.0 - f64::from(i) / 40.0, 1e6 - 1e4 * f64::from(i));
    let rows: String = (1..=50).map(row).collect();
    std::fs::write(&file, format!("radius [cm],density [g/cm^3],temperature [K]\n{rows}")).unwrap();
    let scene = |fields: &str| {
        let input = serde_json::to_string(&file).unwrap();
        format!("input: {{file: {input}}}\nparticles: 200\noutput: {{units: cgs, format: swift}}\n{fields}")
    };
    let made = |fields: &str| place(&Scene::parse(&scene(fields)).unwrap(), FORMATS, &Control::default()).unwrap();
    let (_, report) = made("");
    let note =
        report.warnings.iter().find(|n| n.contains("temperature came in")).expect("a warning on the temperature");
    assert!(note.contains("fields.mean_molecular_weight"), "{note}");
    let (with, _) = made("fields: {mean_molecular_weight: 0.6}\n");
    let (energies, temperatures) = (column(&with, "InternalEnergy"), column(&with, "Temperature"));
    for (u, t) in energies.iter().zip(&temperatures) {
        let expected = 1.380649e-16 * t[0] / (2.0 / 3.0 * 0.6 * 1.673_532_838e-24);
        assert!((u[0] / expected - 1.0).abs() < 1e-3, "{u:?} in place of {expected}");
    }
}

/// Below absolute zero there is nothing, whether a scene says so or a file.
#[test]
fn negative_temperatures_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("star.csv");
    std::fs::write(&path, "r,rho,temperature\n0,1,-5\n1,0.5,-5\n").unwrap();
    let of_file = refused(&format!("input: {{file: '{}'}}\nunits: cgs\nparticles: 20\npolish: none\n", path.display()));
    assert!(of_file.contains("Temperature") && of_file.contains("absolute zero"), "{of_file}");
    let of_scene = refused(
        "input: {expression: '1'}\ndomain: {box: [[0], [1]], boundary: [periodic]}\nparticles: 20\npolish: none\n\
         units: cgs\nfields: {temperature: '-1', mean_molecular_weight: 0.6}\n",
    );
    assert!(of_scene.contains("fields.temperature") && of_scene.contains("below 0"), "{of_scene}");
}

/// Linear fields at the nodes of a grid of a VTK file, over the unit box of `d` dimensions.
fn linear_grid(folder: &std::path::Path, d: usize) -> std::path::PathBuf {
    let (counts, nodes): (Vec<usize>, usize) =
        ((0..3).map(|k| if k < d { 5 } else { 1 }).collect(), 5_usize.pow(d as u32));
    let place = |i: usize| -> [f64; 3] { std::array::from_fn(|k| (i / 5_usize.pow(k as u32) % 5) as f64 / 4.0) };
    let rows = |f: &dyn Fn([f64; 3]) -> String| (0..nodes).map(|i| f(place(i))).collect::<Vec<_>>().join("\n");
    let text = format!(
        "# vtk DataFile Version 3.0\nnodes\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS {} {} {}\nORIGIN 0 0 0\nSPACING 0.25 0.25 0.25\nPOINT_DATA {nodes}\n\
         SCALARS heat double 1\nLOOKUP_TABLE default\n{}\nSCALARS tracer double 1\nLOOKUP_TABLE default\n{}\nVECTORS velocity double\n{}\n",
        counts[0],
        counts[1],
        counts[2],
        rows(&|x| format!("{}", 1.0 + x[0])),
        rows(&|x| format!("{}", 2.0 - x[d - 1])),
        rows(&|x| format!("{} {} {}", x[0] - 1.0, 2.0 * x[d - 1], x[0])),
    );
    let path = folder.join(format!("fields-{d}.vtk"));
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn fields_may_be_those_of_files_in_every_dimension() {
    let folder = tempfile::tempdir().unwrap();
    for d in 1..=3 {
        let path = linear_grid(folder.path(), d);
        let list = |v: &str| vec![v; d].join(", ");
        let file = placed(&format!(
            "input: {{expression: '1 + x'}}\ndomain: {{box: [[{}], [{}]], boundary: [reflecting]}}\nparticles: {}\noutput: {{box_factor: 1}}\nfields:\n  velocity: {{file: {path}}}\n  \
             internal_energy: {{file: {path}, variable: heat}}\n  half: internal_energy/2\n  tracer: {{file: {path}, variable: tracer}}\n  v_x: {{file: {path}, variable: tracer}}\n",
            list("0"),
            list("1"),
            20 * d.pow(3),
            path = path.display()
        ));
        let v = |x: &[f64]| {
            let whole = [x[0] - 1.0 + 2.0 - x[d - 1], if d > 1 { 2.0 * x[d - 1] } else { 0.0 }, x[0]];
            whole[..d].to_vec()
        };
        assert!(deviation(&file, "Velocities", v) < 1e-12, "{d}-D");
        assert!(deviation(&file, "InternalEnergy", |x| vec![1.0 + x[0]]) < 1e-12);
        assert!(deviation(&file, "half", |x| vec![0.5 + 0.5 * x[0]]) < 1e-12);
        assert!(deviation(&file, "tracer", |x| vec![2.0 - x[d - 1]]) < 1e-12);
    }
}

/// Numbers of cells hold throughout them, so that jumps stay sharp, unless the scene says otherwise.
#[test]
fn fields_of_cells_are_steps_or_interpolated_as_the_scene_says() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vtk");
    let scene = |d: usize, more: &str| {
        let list = |v: &str| vec![v; d].join(", ");
        let text = format!(
            "input: {{expression: '1'}}\ndomain: {{box: [[{}], [{}]]}}\nparticles: {}\noutput: {{box_factor: 1}}\npolish: none\n\
             fields: {{q: {{file: '{}', variable: q{more}}}}}\n",
            list("0"),
            list("1"),
            20 * d.pow(3),
            path.display()
        );
        place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default())
    };
    for d in 1..=3 {
        let (cells, faces) = (8_usize.pow(d as u32), |k: usize| if k < d { 9 } else { 1 });
        // 3 x + 1 in the middles of cells.
        let values: String = (0..cells).map(|i| format!("{}\n", 3.0 * ((i % 8) as f64 + 0.5) / 8.0 + 1.0)).collect();
        let text = format!(
            "# vtk DataFile Version 3.0\ncells\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS {} {} {}\nORIGIN 0 0 0\nSPACING 0.125 0.125 0.125\n\
             CELL_DATA {cells}\nSCALARS q double 1\nLOOKUP_TABLE default\n{values}",
            faces(0),
            faces(1),
            faces(2)
        );
        std::fs::write(&path, text).unwrap();
        let step = |x: &[f64]| vec![3.0 * ((8.0 * x[0]).floor().min(7.0) + 0.5) / 8.0 + 1.0];
        // Beyond the middles of the outermost cells their values count.
        let line = |x: &[f64]| vec![3.0 * x[0].clamp(1.0 / 16.0, 15.0 / 16.0) + 1.0];
        let of = |more: &str| scene(d, more).unwrap_or_else(|e| panic!("{e}")).0;
        assert!(deviation(&of(""), "q", step) < 1e-12, "{d}-D");
        assert!(deviation(&of(", interpolation: nearest"), "q", step) < 1e-12, "{d}-D");
        assert!(deviation(&of(", interpolation: linear"), "q", line) < 1e-12, "{d}-D");
    }
    // It is for grids, and some of it for cells.
    let path = linear_grid(folder.path(), 2);
    let nodes = format!(
        "input: {{expression: '1'}}\ndomain: {{box: [[0, 0], [1, 1]]}}\nparticles: 50\nfields: {{q: {{file: '{}', variable: heat, interpolation: piecewise-linear}}}}\n",
        path.display()
    );
    let error = place(&Scene::parse(&nodes).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string();
    assert!(error.contains("fields.q.interpolation"), "{error}");
    let table = folder.path().join("T.csv");
    std::fs::write(&table, "radius,q\n0,1\n1,2\n2,3\n").unwrap();
    let star = format!(
        "input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}\nparticles: 50\npolish: none\nfields: {{q: {{file: '{}', interpolation: linear}}}}\n",
        table.display()
    );
    let (_, report) = place(&Scene::parse(&star).unwrap(), FORMATS, &Control::default()).unwrap();
    assert!(report.notes.iter().any(|n| n.starts_with("fields.q.interpolation is for grids")), "{:?}", report.notes);
}

/// A table by radius in its own units, about the center of a body in others.
#[test]
fn a_table_by_radius_is_about_the_center_of_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("T.csv");
    let rows: String =
        (0..=40).map(|i| format!("{},{}\n", 7e10 * f64::from(i) / 40.0, 1e7 - 2e5 * f64::from(i))).collect();
    std::fs::write(&table, format!("radius [cm],temperature [K]\n{rows}")).unwrap();
    let scene = |fields: &str| {
        format!(
            "input: {{expression: 'if(r < 1, 1 - r, 0)'}}\nunits: solar\ndomain: {{ball: {{center: [3, 4, 5], radius: 1}}}}\nparticles: 500\noutput: {{units: solar}}\n\
             fields: {fields}\n",
        )
    };
    let of_table = |more: &str| format!("{{file: {}{more}}}", table.display());
    let (found, report) = place(
        &Scene::parse(&scene(&format!("{{temperature: {}, mean_molecular_weight: 0.6}}", of_table("")))).unwrap(),
        FORMATS,
        &Control::default(),
    )
    .unwrap();
    assert_eq!(report.warnings, Vec::<String>::new());
    let center =
        column(&found, "Coordinates").iter().fold([0.0; 3], |sum, x| std::array::from_fn(|k| sum[k] + x[k] / 500.0));
    let off = deviation(&found, "Temperature", |x| {
        let r = (0..3).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>().sqrt();
        vec![1e7 - 8e6 * r * 6.957e10 / 7e10]
    });
    // The center of mass is not quite that of the ball.
    assert!(off < 5e4, "{off}");
    for (fields, words) in [
        (
            format!("{{temperature: {}}}", of_table(", variable: T")),
            &["fields.temperature", "no variable 'T'", "'temperature'"][..],
        ),
        (
            format!("{{pressure: {}}}", of_table(", variable: temperature")),
            &["fields.pressure", "is in K", "another quantity"],
        ),
        (
            format!("{{velocity: {}}}", of_table(", variable: temperature, unit: km/s")),
            &["fields.velocity", "has 1 components, expected 3"],
        ),
        (format!("{{velocity: {}}}", of_table(", unit: parsnip")), &["fields.velocity.unit", "'parsnip'"]),
        (format!("{{velocity: {}}}", of_table(", variable: []")), &["fields.velocity.variable", "names none"]),
    ] {
        let error = refused(&scene(&fields));
        assert!(words.iter().all(|word| error.contains(word)), "{fields}: {error}");
    }
    let error = Scene::parse(&scene("{temperature: {file: T.csv, colum: T}}")).unwrap_err().to_string();
    assert!(error.contains("{file: F, variable: V}"), "{error}");
}

#[test]
fn files_that_end_before_the_matter_are_told_and_those_elsewhere_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = linear_grid(folder.path(), 2);
    let scene = |x: f64| {
        format!(
            "input: {{expression: '1'}}\ndomain: {{box: [[{x}, 0], [{}, 1]], boundary: [reflecting]}}\nparticles: 100\npolish: none\nwvt: {{iterations: 0}}\n\
             fields: {{heat: {{file: {}, variable: heat}}}}\n",
            x + 1.0,
            path.display()
        )
    };
    let told = |x: f64| place(&Scene::parse(&scene(x)).unwrap(), FORMATS, &Control::default()).unwrap().1.warnings;
    assert!(told(0.0).iter().all(|w| !w.contains("fields.heat")));
    let warnings = told(0.5);
    let warning = warnings.iter().find(|w| w.contains("fields.heat")).unwrap_or_else(|| panic!("{warnings:?}"));
    assert!(warning.contains("% of the positions with matter are outside"), "{warning}");
    let error = refused(&scene(3.0));
    assert!(error.contains("fields.heat") && error.contains("there is no matter"), "{error}");
    // With values that are none.
    let text = std::fs::read_to_string(&path).unwrap().replacen("\n1\n", "\nnan\n", 1);
    std::fs::write(&path, text).unwrap();
    let error = refused(&scene(0.0));
    assert!(error.contains("fields.heat") && error.contains("not finite"), "{error}");
}

/// Wherever a scene names them.
#[test]
fn paths_of_field_files_are_relative_to_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.yaml");
    let fields = |name: &str| format!("fields: {{a: {{file: {name}.npz}}}}");
    let text = format!(
        "bodies:\n- {{input: {{expression: '1', dimension: 3}}, {}, dust: {{ratio: 0.1, {}}}}}\nambient: {{density: 1, {}}}\ndust: {{ratio: 0.1, {}}}\n{}\n",
        fields("body"),
        fields("grains"),
        fields("medium"),
        fields("dust"),
        fields("whole")
    );
    std::fs::write(&path, text).unwrap();
    let yaml = Scene::load(&path).unwrap().to_yaml();
    for name in ["body", "grains", "medium", "dust", "whole"] {
        let whole = folder.path().join(format!("{name}.npz"));
        assert!(yaml.contains(&whole.display().to_string()), "{name}: {yaml}");
    }
}

/// Particles of a periodic box are a field that goes on across its faces, where the scene's box is the same, in units of its own; in another box what is
/// beyond it is told. Values ended at the faces.
#[test]
fn fields_of_a_periodic_snapshot_are_periodic() {
    fn check<const D: usize>(count: usize) {
        let (corner, folder) = (|v: &str| vec![v; D].join(", "), tempfile::tempdir().unwrap());
        let scene = |edge: &str, q: &str| {
            let text = format!(
                "input: {{expression: '1'}}\nunits: cgs\ndomain: {{box: [[{}], [{}]], boundary: periodic}}\nparticles: {count}\n\
                 polish: none\nthermal: {{internal_energy: 1}}\nfields: {{q: {q}}}\n",
                corner("0"),
                corner(edge)
            );
            place(&Scene::parse(&text).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{text}: {e}"))
        };
        let path = folder.path().join("periodic.npz");
        let (file, _) = scene("100", "'sin(2*pi*x/100)'");
        sph_prep::write(FORMATS, &path, Some("numpy"), &file, sph_prep::WriteOptions::default()).unwrap();
        let of_file = format!("{{file: '{}', variable: q}}", path.display());
        let (file, report) = scene("1 m", &of_file);
        assert!(report.warnings.is_empty(), "{D}-D: {:?}", report.warnings);
        let off = deviation(&file, "q", |x| vec![(TAU * x[0] / 100.0).sin()]);
        assert!(off < 0.02, "{D}-D: {off}");
        let (_, report) = scene("2 m", &of_file);
        assert!(report.warnings.iter().any(|w| w.contains("are outside")), "{D}-D: {:?}", report.warnings);
    }
    check::<1>(50);
    check::<2>(900);
    check::<3>(4000);
}
