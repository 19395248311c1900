//! Collisionless bodies: that they are in equilibrium, alone and with gas, and what is refused.

use sph_formats::ParticleTable;
use sph_prep::{BodiesReport, Control, FORMATS, ParticleFile, Scene, place, place_bodies};
use std::f64::consts::PI;

fn column(table: &ParticleTable, name: &str) -> Vec<Vec<f64>> {
    let c = table.column(name).unwrap_or_else(|| panic!("no '{name}'"));
    (0..table.count).map(|i| (0..c.components).map(|k| c.values.get(i * c.components + k)).collect()).collect()
}

fn length(v: &[f64]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Distances from the middle of the box, velocities away from it, and the squares of those across.
fn parted(table: &ParticleTable, middle: [f64; 3]) -> Vec<[f64; 3]> {
    let rows = column(table, "Coordinates").into_iter().zip(column(table, "Velocities"));
    rows.map(|(x, v)| {
        let x: Vec<f64> = (0..3).map(|k| x[k] - middle[k]).collect();
        let r = length(&x);
        let out = (0..3).map(|k| v[k] * x[k]).sum::<f64>() / r;
        [r, out, length(&v).powi(2) - out * out]
    })
    .collect()
}

fn single(scene: &str) -> (ParticleFile, sph_prep::Report) {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn both(scene: &str) -> (ParticleFile, BodiesReport) {
    place_bodies(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(scene: &str) -> String {
    let scene = Scene::parse(scene).unwrap();
    let error = match scene.bodies.is_empty() {
        true => place(&scene, FORMATS, &Control::default()).err(),
        false => place_bodies(&scene, FORMATS, &Control::default()).err(),
    };
    error.unwrap_or_else(|| panic!("{} is accepted", scene.to_yaml())).to_string()
}

const QUICK: &str = "wvt: {iterations: 2}\npolish: none\noutput: {units: code}\n";

/// 2 K = |W| within the scatter of n draws: <v^2> has a relative standard deviation below sqrt(2/(3 n)) for such speeds, here 0.8 %;
/// the edge at 60 scale radii takes 2.4 (a/R)^2 of it.
#[test]
fn a_sphere_of_hernquist_is_in_virial_equilibrium_and_isotropic() {
    for velocities in ["eddington", "jeans"] {
        let n = 5000;
        let (file, report) = single(&format!(
            "input: {{profile: {{hernquist: {{mass: 1, scale_radius: 1, outer_radius: 60}}}}}}\n\
             collisionless: {{type: 4, velocities: {velocities}}}\nparticles: {n}\n{QUICK}"
        ));
        let [species] = file.species.as_slice() else { panic!("{} types", file.species.len()) };
        assert_eq!((species.part_type, species.table.count), (4, n));
        for lacking in ["InternalEnergy", "Pressure", "Temperature"] {
            assert!(species.table.column(lacking).is_none(), "{lacking}");
        }
        let mean: Vec<f64> =
            (0..3).map(|k| column(&species.table, "Velocities").iter().map(|v| v[k]).sum::<f64>() / n as f64).collect();
        assert!(length(&mean) < 1e-15, "{mean:?}");
        let middle = [0.5 * file.header.box_size[0]; 3];
        let rows = parted(&species.table, middle);
        let share = (60.0_f64 / 61.0).powi(2);
        let kinetic: f64 = rows.iter().map(|[_, out, across]| out * out + across).sum::<f64>() / n as f64;
        let virial: f64 = rows.iter().map(|[r, ..]| r / (1.0 + r).powi(2) / share).sum::<f64>() / n as f64;
        assert!((kinetic / virial - 1.0).abs() < 0.03, "{velocities}: {}", kinetic / virial);
        // sigma_t = sigma_r in shells: two components across, one along, each known to sqrt(2/n) at most.
        for (lo, hi) in [(0.1, 0.5), (0.5, 1.5), (1.5, 4.0), (4.0, 20.0)] {
            let shell: Vec<&[f64; 3]> = rows.iter().filter(|[r, ..]| (lo..hi).contains(r)).collect();
            let out: f64 = shell.iter().map(|row| row[1] * row[1]).sum();
            let across: f64 = shell.iter().map(|row| 0.5 * row[2]).sum();
            let slack = 4.0 * (3.0 / shell.len() as f64).sqrt();
            assert!((across / out - 1.0).abs() < slack, "{velocities}, {lo} to {hi}: {}", across / out);
        }
        let text = report.text();
        for word in ["collisionless", "the body's own mass alone", "2 K/|W|"] {
            assert!(text.contains(word), "{text} lacks {word}");
        }
    }
}

#[test]
fn velocities_are_the_same_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let scene = format!(
            "input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 20}}}}}}\ncollisionless: true\nparticles: 1500\n{QUICK}"
        );
        column(&pool.install(|| single(&scene)).0.species[0].table, "Velocities")
    };
    let bits = |rows: Vec<Vec<f64>>| rows.concat().into_iter().map(f64::to_bits).collect::<Vec<_>>();
    assert_eq!(bits(run(1)), bits(run(3)));
}

/// A density that is stated by an expression, and its domain, is as good as a profile.
#[test]
fn an_expression_of_the_radius_has_velocities_and_others_have_none() {
    let scene = |expression: &str, velocities: &str| {
        format!(
            "input: {{expression: '{expression}', dimension: 3}}\ndomain: {{ball: {{radius: 20}}}}\n\
             collisionless: {{velocities: {velocities}}}\nparticles: 4000\n{QUICK}"
        )
    };
    let (file, _) = single(&scene("(1 + r^2)^-2.5", "eddington"));
    let rows = parted(&file.species[0].table, [0.5 * file.header.box_size[0]; 3]);
    let square: f64 = rows.iter().map(|[_, out, across]| out * out + across).sum::<f64>() / rows.len() as f64;
    // G = 1, M = 4 pi/3, a = 1: <v^2> = (3 pi/32) M, to 2 standard deviations of sqrt(2/(3 n)) and the cut at 20.
    let exact = 3.0 * PI / 32.0 * 4.0 * PI / 3.0;
    assert!((square / exact - 1.0).abs() < 0.03, "{square} {exact}");
    let error = refused(&scene("exp(-x^2 - 2*y^2 - z^2)", "eddington"));
    assert!(error.contains("collisionless.velocities") && error.contains("velocities: none"), "{error}");
    let (file, _) = single(&scene("exp(-x^2 - 2*y^2 - z^2)", "none"));
    assert!(file.species[0].table.column("Velocities").is_none());
}

/// King's density over its central one (1962, equation 27), and masses of it and of the halo, for the scene's numbers in kpc.
fn king(r: f64) -> f64 {
    let at = |r: f64| {
        let z = ((1.0 + r * r) / 101.0_f64).sqrt().min(1.0);
        (z.acos() / z - (1.0 - z * z).sqrt()) / (z * z)
    };
    at(r)
}

fn simpson(a: f64, b: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    let n = 400;
    let h = (b - a) / f64::from(n);
    let weight = |i: i32| {
        if i == 0 || i == n {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=n).map(|i| weight(i) * f(a + h * f64::from(i))).sum::<f64>() * h / 3.0
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn a_cloud_and_its_halo_hold_each_other() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/cloud-in-halo.yaml");
    let scene = Scene { particles: Some(10_000), ..Scene::load(&path).unwrap() };
    let (file, report) = place_bodies(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    let kinds: Vec<u8> = file.species.iter().map(|s| s.part_type).collect();
    assert_eq!(kinds, [0, 1]);
    let [gas, halo] = [&file.species[0].table, &file.species[1].table];
    assert!((gas.count as f64 / 2000.0 - 1.0).abs() < 0.02 && halo.count > 7500, "{} {}", gas.count, halo.count);
    // Galactic units: 1e10 Msun, kpc, km/s; G = 43007.1 in them.
    let gravity = 43_007.1;
    let (cloud, dark) = (0.1, 0.4);
    let whole = simpson(0.0, 10.0, &|r| r * r * king(r));
    let mass = |r: f64| cloud * simpson(0.0, r.min(10.0), &|s| s * s * king(s)) / whole;
    let total = |r: f64| mass(r) + dark * (r / (r + 4.0)).powi(2) / (60.0_f64 / 64.0).powi(2);
    let middle = |table: &ParticleTable| -> [f64; 3] {
        let rows = column(table, "Coordinates");
        std::array::from_fn(|k| rows.iter().map(|x| x[k]).sum::<f64>() / rows.len() as f64)
    };
    let center = middle(gas);
    // Their centers of mass are one.
    assert!(length(&(0..3).map(|k| center[k] - middle(halo)[k]).collect::<Vec<_>>()) < 1e-6);
    // (gamma - 1) u = P/rho, with P the weight of the gas in both.
    let held = |r: f64| simpson(r, 10.0, &|s| king(s) * gravity * total(s) / (s * s)) / king(r);
    for (x, u) in column(gas, "Coordinates").iter().zip(column(gas, "InternalEnergy")).step_by(40) {
        let r = length(&(0..3).map(|k| x[k] - center[k]).collect::<Vec<_>>());
        if !(0.3..8.0).contains(&r) {
            continue;
        }
        // The center of mass is the center to some 1e-3 of a scale radius, and the law of the temperature is as steep as 1/r.
        assert!((u[0] * 2.0 / 3.0 / held(r) - 1.0).abs() < 0.02, "{r}: {} {}", u[0] * 2.0 / 3.0, held(r));
    }
    // Dispersion of the halo in shells against Jeans's equation in both, within the scatter of counting.
    let density = |r: f64| 1.0 / (r * (r + 4.0).powi(3));
    // The tail that f goes on with beyond the cut carries a weight, too: r^-3.8 in the potential of all.
    let beyond = density(60.0) * gravity * total(60.0) / (60.0 * 4.8);
    let sigma = |r: f64| {
        let inner = simpson(r.ln(), 60.0_f64.ln(), &|t| density(t.exp()) * gravity * total(t.exp()) / t.exp());
        (inner + beyond) / density(r)
    };
    let rows = parted(halo, center);
    for (lo, hi) in [(0.5, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0), (8.0, 20.0), (20.0, 50.0)] {
        let shell: Vec<&[f64; 3]> = rows.iter().filter(|[r, ..]| (lo..hi).contains(r)).collect();
        let found: f64 = shell.iter().map(|[_, out, across]| out * out + across).sum();
        let wanted: f64 = shell.iter().map(|[r, ..]| 3.0 * sigma(*r)).sum();
        let slack = 4.0 * (2.0 / (3.0 * shell.len() as f64)).sqrt() + 5e-3;
        assert!((found / wanted - 1.0).abs() < slack, "{lo} to {hi}: {} of {}", found / wanted, shell.len());
    }
    let text = report.text();
    assert!(text.contains("hydrostatic in its own gravity and that of gravity_of"), "{text}");
    assert!(text.contains("one other body"), "{text}");
    assert!(report.momentum.iter().all(|p| p.abs() < 1e-12 * 100.0), "{:?}", report.momentum);
}

/// Gas feels the particles of a halo that a file has as it feels the halo's law: to the Poisson noise of what is within.
#[test]
fn gas_is_held_by_the_particles_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("halo.hdf5");
    let halo = "profile: {hernquist: {mass: 10, scale_radius: 4, outer_radius: 80}}";
    let mut made =
        Scene::parse(&format!("input: {{{halo}}}\ncollisionless: {{type: 1}}\nparticles: 20000\n{QUICK}")).unwrap();
    made.output.file = Some(path.clone());
    sph_prep::run(&made, FORMATS, &Control::default()).unwrap();
    let gas = |rest: &str| {
        single(&format!(
            "input: {{profile: {{king: {{mass: 1, core_radius: 1, tidal_radius: 10}}}}}}\nparticles: 500\n{QUICK}{rest}"
        ))
    };
    let energies = |file: &ParticleFile| column(&file.species[0].table, "InternalEnergy").concat();
    let (by_law, _) = gas(&format!("gravity_of: [{{input: {{{halo}}}}}]\n"));
    let (by_particles, report) = gas(&format!("gravity_of: [{{input: {{file: '{}'}}}}]\n", path.display()));
    let (alone, _) = gas("");
    let mut off = 0.0_f64;
    for ((law, found), alone) in energies(&by_law).iter().zip(energies(&by_particles)).zip(energies(&alone)) {
        assert!(*law > 1.5 * alone, "{law} {alone}");
        off = off.max((found / law - 1.0).abs());
    }
    assert!(off < 0.03, "{off}");
    let told = report.notes.iter().find(|note| note.contains("the mean over spheres of its 20000 particles"));
    assert!(told.is_some_and(|note| note.contains("10.01")), "{:?}", report.notes);
}

/// Stars about a black hole: Jeans's dispersion is larger by what the hole holds.
#[test]
fn a_point_mass_in_the_center_counts() {
    let scene = |profile: &str| {
        format!(
            "bodies:\n- input: {{profile: {{{profile}: {{mass: 1, scale_radius: 1, outer_radius: 30}}}}}}\n  collisionless: {{type: 4}}\n\
             - {{point_mass: 1, type: 5}}\nparticles: 2500\n{QUICK}"
        )
    };
    let (file, _) = both(&scene("hernquist"));
    let stars = &file.species[0].table;
    assert_eq!(file.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(4, 2500), (5, 1)]);
    let hole = &column(&file.species[1].table, "Coordinates")[0];
    let rows = parted(stars, [hole[0], hole[1], hole[2]]);
    let shell: Vec<&[f64; 3]> = rows.iter().filter(|[r, ..]| (0.3..1.0).contains(r)).collect();
    let found: f64 = shell.iter().map(|[_, out, across]| out * out + across).sum();
    let law = |r: f64| 1.0 / (r * (1.0 + r).powi(3));
    let pull = |r: f64| (31.0 / 30.0_f64).powi(2) / (1.0 + r).powi(2) + r.powi(-2);
    let sigma = |r: f64| simpson(r.ln(), 30.0_f64.ln(), &|t| t.exp() * law(t.exp()) * pull(t.exp())) / law(r);
    let wanted: f64 = shell.iter().map(|[r, ..]| 3.0 * sigma(*r)).sum();
    assert!(
        (found / wanted - 1.0).abs() < 4.0 * (2.0 / (3.0 * shell.len() as f64)).sqrt() + 0.01,
        "{}",
        found / wanted
    );
    // About a point mass only densities that rise to the center have an isotropic f (Tremaine et al. 1994, AJ 107, 634).
    let error = refused(&scene("plummer"));
    assert!(error.contains("bodies[1].collisionless.velocities") && error.contains("negative"), "{error}");
}

#[test]
fn what_makes_no_sense_is_refused_by_key() {
    let sphere = "input: {profile: {plummer: {mass: 1, scale_radius: 1, outer_radius: 9}}}\nparticles: 300\n";
    let more = |rest: &str| refused(&format!("{sphere}{rest}"));
    for (rest, words) in [
        ("collisionless: {type: 0}\n", &["collisionless.type", "1 to 5"][..]),
        ("collisionless: true\nbalance: true\n", &["balance", "collisionless"]),
        (
            "collisionless: true\ntarget_code: swift\noutput: {units: code, parameters: true}\n",
            &["output.parameters", "gas"],
        ),
        ("collisionless: true\nthermal: {internal_energy: 1}\n", &["thermal.internal_energy"]),
        ("collisionless: true\nwalls: {layers: 2}\n", &["walls"]),
        ("collisionless: true\noutput: {file: a.h5, format: sph-exa}\n", &["output.format", "collisionless"]),
        ("gravity_of: [{point_mass: -1}]\n", &["gravity_of[0].point_mass"]),
        ("gravity_of: [{softening_radius: 1}]\n", &["gravity_of[0].softening_radius", "point_mass"]),
        (
            "gravity_of: [{input: {profile: {nfw: {mass: 1, scale_radius: 0, outer_radius: 1}}}}]\n",
            &["gravity_of[0].input"],
        ),
        ("gravity_of: [{}]\n", &["gravity_of[0].input"]),
        (
            "gravity_of: [{input: {profile: {nfw: {mass: 1 Msun, scale_radius: 1 kpc, outer_radius: 9 kpc}}}}]\n",
            &["gravity_of[0]", "units"],
        ),
    ] {
        let error = more(rest);
        assert!(words.iter().all(|word| error.contains(word)), "{rest}: {error}");
    }
    let ball = "input: {expression: '1', dimension: 3}\ndomain: {ball: {radius: 1}}\nparticles: 300\n";
    let error = refused(&format!("{ball}collisionless: true\n"));
    assert!(error.contains("collisionless.velocities") && error.contains("jeans"), "{error}");
    let error =
        refused(&format!("bodies:\n- {{point_mass: 1}}\n- {}", sphere.replace('\n', "\n  ") + "collisionless: true\n"));
    assert!(error.contains("bodies[1].type") && error.contains("black hole"), "{error}");
}

/// A file of nothing else says of what type they are, too.
#[test]
fn a_file_without_gas_tells_the_type() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.hdf5", "b.vtu", "c.npz", "d.csv"] {
        let path = folder.path().join(name);
        let scene = format!(
            "input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 9}}}}}}\ncollisionless: {{type: 4}}\nparticles: 200\n\
             output: {{units: code, file: {}}}\npolish: none\n",
            path.display()
        );
        sph_prep::run(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default())
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let sph_formats::FileContent::Particles(file) =
            sph_formats::read(FORMATS, &path, None, &sph_formats::FieldRequest::default()).unwrap()
        else {
            panic!("{name} is a field")
        };
        assert_eq!(file.species.iter().map(|s| (s.part_type, s.table.count)).collect::<Vec<_>>(), [(4, 200)], "{name}");
    }
}

/// Files of each kind read back with the type, the velocities and no energies.
#[test]
fn files_have_the_particles_as_their_type() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.hdf5", "b.swift.hdf5", "c.vtu", "d.npz"] {
        let path = folder.path().join(name);
        let scene = format!(
            "bodies:\n- input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 9}}}}}}\n  collisionless: true\n\
             - input: {{profile: {{king: {{mass: 1, core_radius: 1, tidal_radius: 5}}}}}}\n\
             particles: 600\nwvt: {{iterations: 1}}\npolish: none\noutput: {{units: code, file: {}}}\n",
            path.display()
        );
        sph_prep::run_bodies(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default())
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let file = match sph_formats::read(FORMATS, &path, None, &sph_formats::FieldRequest::default()).unwrap() {
            sph_formats::FileContent::Particles(file) => file,
            sph_formats::FileContent::Field(_) => panic!("{name} is a field"),
        };
        let kinds: Vec<(u8, usize)> = file.species.iter().map(|s| (s.part_type, s.table.count)).collect();
        assert_eq!(kinds, [(0, 300), (1, 300)], "{name}");
        let speeds: f64 = column(&file.species[1].table, "Velocities").iter().map(|v| length(v)).sum();
        assert!(speeds > 1.0, "{name}");
    }
}
