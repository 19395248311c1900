//! Dust beside gas: as particles of its own, and as a fraction that gas carries.

use sph_formats::{FieldRequest, FileContent, ParticleTable};
use sph_prep::{Control, FORMATS, ParticleFile, Scene, place, place_bodies, run};

fn column(table: &ParticleTable, name: &str) -> Vec<Vec<f64>> {
    let c = table.column(name).unwrap_or_else(|| panic!("no '{name}'"));
    (0..table.count).map(|i| (0..c.components).map(|k| c.values.get(i * c.components + k)).collect()).collect()
}

fn mass(table: &ParticleTable) -> f64 {
    column(table, "Masses").concat().iter().sum()
}

fn read(path: &std::path::Path) -> ParticleFile {
    match sph_formats::read(FORMATS, path, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file,
        FileContent::Field(_) => panic!("{} is a field", path.display()),
    }
}

fn refused(scene: &str) -> String {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).err().unwrap().to_string()
}

/// Gaussians of 1.25 scale heights at both edges of the disc, which begin at three of these widths: at 0.8 and 1.875.
fn edge(r: f64) -> f64 {
    let of = |depth: f64, width: f64| (-0.5 * (3.0 - depth / width).max(0.0).powi(2)).exp();
    of(r - 0.5, 1.25 * 0.08) * of(3.0 - r, 1.25 * 0.3)
}

/// Midpoint rule over R and z within the disc, from one radius to another.
fn within(from: f64, to: f64, f: &dyn Fn(f64, f64) -> f64) -> f64 {
    let n = 400;
    let (dr, dz) = ((to - from) / f64::from(n), 3.0 / f64::from(n));
    let at = |i: i32, j: i32| (from + (f64::from(i) + 0.5) * dr, -1.5 + (f64::from(j) + 0.5) * dz);
    let all = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    all.map(|(i, j)| at(i, j)).map(|(r, z)| std::f64::consts::TAU * r * f(r, z) * dr * dz).sum()
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn a_dusty_disc_has_the_dust_that_it_states() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/dusty-disc.yaml");
    let mut scene = Scene { particles: Some(4000), ..Scene::load(&path).unwrap() };
    scene.bodies[1].dust.as_mut().unwrap().particles = Some(16_000);
    let (file, report) = place_bodies(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    let kinds: Vec<(u8, usize)> = file.species.iter().map(|s| (s.part_type, s.table.count)).collect();
    assert_eq!(kinds, [(0, 4000), (1, 1), (2, 16_000)]);
    let [gas, star, dust] = [0, 1, 2].map(|i| &file.species[i].table);
    let density = |r: f64, z: f64| edge(r) / (r * r) * (100.0 * (r / r.hypot(z) - 1.0)).exp();
    let ratio = |r: f64, z: f64| 0.0141 * (-50.0 * z * z / (r * r)).exp();
    let of_dust = |r: f64, z: f64| density(r, z) * ratio(r, z);
    let wanted = within(0.5, 3.0, &of_dust) / within(0.5, 3.0, &density);
    // Quadrature of both masses is better than 1e-4, the midpoint rule here than 1e-5; the gas's own gravity, which is not in the density above,
    // makes it thinner by 4 pi G rho/(2 Omega^2), a fifth of a percent.
    assert!((mass(dust) / mass(gas) / wanted - 1.0).abs() < 3e-3, "{} {wanted}", mass(dust) / mass(gas));
    // The surface density by rings: a particle more or less at each edge of a row of about sqrt(n) of them.
    let origin = column(star, "Coordinates").concat();
    let places: Vec<Vec<f64>> =
        column(dust, "Coordinates").iter().map(|x| (0..3).map(|k| x[k] - origin[k]).collect()).collect();
    let share = mass(dust) / dust.count as f64;
    let whole = mass(gas) / within(0.5, 3.0, &density);
    for (from, to) in [(0.5, 0.9), (0.9, 1.3), (1.3, 1.7), (1.7, 2.1), (2.1, 3.0)] {
        let found = places.iter().filter(|x| (from..to).contains(&x[0].hypot(x[1]))).count() as f64;
        let wanted = whole * within(from, to, &of_dust) / share;
        assert!((found - wanted).abs() < 2.0 * wanted.sqrt(), "{from} to {to}: {found} {wanted}");
    }
    // <z^2/R^2> is 0.005 of the stated density. The mass is brought to its place, but for what a solver leaves that counts densities little beside
    // even distances: particles are 0.05 apart, and a third of the square of that is 0.17 of the whole.
    let height = places.iter().map(|x| x[2].powi(2) / (x[0].powi(2) + x[1].powi(2))).sum::<f64>() / places.len() as f64;
    assert!((0.87..1.05).contains(&(height / 0.005)), "{height}");
    // Without pressure: v^2/R = R/r^3, by itself.
    for (x, v) in places.iter().zip(column(dust, "Velocities")) {
        let (big, r) = (x[0].hypot(x[1]), x[0].hypot(x[1]).hypot(x[2]));
        let speed = (x[0] * v[1] - x[1] * v[0]) / big;
        assert!((speed / (big / r.powf(1.5)) - 1.0).abs() < 0.02, "{x:?} {v:?}");
    }
    assert!(dust.column("InternalEnergy").is_none() && gas.column("InternalEnergy").is_some());
    assert!(report.text().contains("of the gas's"), "{}", report.text());
}

const BOX: &str = "polish: none\ninput: {expression: '2 + sin(2*pi*x)'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\n\
                   thermal: {internal_energy: 1}\nparticles: 1000\nwvt: {iterations: 2}\nsolver: {evaluations: 2}\n";

#[test]
fn codes_get_dust_as_they_have_it_or_say_that_they_have_none() {
    let folder = tempfile::tempdir().unwrap();
    let disc = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/dusty-disc.yaml");
    let mut disc =
        Scene { particles: Some(1000), polish: Some(sph_prep::scene::Polish::None), ..Scene::load(&disc).unwrap() };
    disc.output.file = Some(folder.path().join("disc.phantom"));
    disc.output.format = Some("phantom".into());
    sph_prep::run_bodies(&disc, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    let counts: Vec<usize> = read(&folder.path().join("disc.phantom")).species.iter().map(|s| s.table.count).collect();
    assert_eq!(counts.iter().sum::<usize>(), 1201, "{counts:?}");
    for (name, kind) in [("a.phantom", 2), ("b.gizmo.hdf5", 3), ("c.vtu", 2)] {
        let path = folder.path().join(name);
        let format = if name == "a.phantom" {
            ", format: phantom"
        } else if kind == 3 {
            ", format: gizmo"
        } else {
            ""
        };
        let scene =
            format!("{BOX}dust: {{ratio: 0.01, particles: 300}}\noutput: {{file: {}{format}}}\n", path.display());
        run(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let file = read(&path);
        let kinds: Vec<(u8, usize)> = file.species.iter().map(|s| (s.part_type, s.table.count)).collect();
        assert_eq!(kinds, [(0, 1000), (kind, 300)], "{name}");
        let ratio = mass(&file.species[1].table) / mass(&file.species[0].table);
        // Masses of f32 files.
        assert!((ratio / 0.01 - 1.0).abs() < 1e-5, "{name}: {ratio}");
    }
    let bytes = std::fs::read(folder.path().join("a.phantom")).unwrap();
    let tags = |tag: &str| bytes.windows(tag.len()).any(|w| w == tag.as_bytes());
    assert!(tags("ndustlarge") && tags("itype"));
    for format in ["swift", "gadget", "arepo"] {
        let error = refused(&format!("{BOX}dust: {{ratio: 0.01}}\noutput: {{format: {format}}}\n"));
        assert!(error.contains("dust_fraction") && error.contains("dust.type"), "{format}: {error}");
    }
    let stated = format!("{BOX}dust: {{ratio: 0.01, type: 4}}\noutput: {{format: swift}}\n");
    let (file, _) = place(&Scene::parse(&stated).unwrap(), FORMATS, &Control::default()).unwrap();
    assert_eq!(file.species[1].part_type, 4);
}

#[test]
fn gas_carries_a_fraction_of_dust() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.phantom");
    let scene = format!(
        "{BOX}fields: {{dust_fraction: 0.01 + 0.005*y}}\noutput: {{file: {}, format: phantom}}\n",
        path.display()
    );
    run(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.windows(16).any(|w| w == b"dustfrac        "));
    let file = read(&path);
    let table = &file.species[0].table;
    let name =
        table.columns.iter().find(|c| c.name.eq_ignore_ascii_case("dustfrac") || c.name == "DustFraction").unwrap();
    let corner = file.header.box_corner.unwrap_or_default();
    for (i, x) in column(table, "Coordinates").iter().enumerate() {
        let y = (x[1] - corner[1]).rem_euclid(1.0);
        let off = (name.values.get(i) - 0.01 - 0.005 * y).abs();
        assert!(off < 1e-8 || y < 1e-6, "{x:?}: {}", name.values.get(i));
    }
    let error = refused(&format!("{BOX}fields: {{dust_fraction: 0.5 + x}}\n"));
    assert!(error.contains("DustFraction") && error.contains("0 to less than 1"), "{error}");
}

#[test]
fn dust_that_makes_no_sense_is_refused_by_key() {
    for (rest, words) in [
        ("dust: {ratio: 0}\n", &["dust.ratio", "positive"][..]),
        ("dust: {ratio: '-0.01'}\n", &["dust.ratio", "negative"][..]),
        ("dust: {ratio: '0.01*what'}\n", &["dust.ratio", "what"][..]),
        ("dust: {ratio: '1/(r - r)'}\n", &["dust.ratio", "finite"][..]),
        ("dust: {ratio: 0.01, particles: 0}\n", &["dust.particles"]),
        ("dust: {ratio: 0.01, type: 6}\n", &["dust.type", "1 to 5"]),
        ("dust: {ratio: x - 0.5}\n", &["dust.ratio", "negative"]),
        ("dust: {ratio: 0.01*(}\n", &["dust.ratio", "0.01*("]),
        ("dust: {ratio: 0.01}\nwalls: {layers: 1}\n", &["dust", "walls"]),
        ("dust: {ratio: 0.01}\nturbulence: {rms_velocity: 1}\n", &["dust", "turbulence"]),
        ("dust: {ratio: 0.01}\ncollisionless: {velocities: none}\nthermal: {gamma: 1.4}\n", &["collisionless"]),
    ] {
        let base = if rest.contains("gamma") { BOX.replace("thermal: {internal_energy: 1}\n", "") } else { BOX.into() };
        let error = refused(&format!("{base}{rest}"));
        assert!(words.iter().all(|word| error.contains(word)), "{rest}: {error}");
    }
}
