//! Bodies from their physics, as far as the particles: masses, densities and pressures against closed forms.

use sph_prep::{Control, FORMATS, ParticleFile, Report, Scene, place, place_bodies};
use std::f64::consts::PI;

fn placed(scene: &str) -> (ParticleFile, Report) {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(scene: &str) -> String {
    let scene = Scene::parse(scene).unwrap();
    place(&scene, FORMATS, &Control::default()).err().unwrap().to_string()
}

/// Distances from the middle of the box, and a column.
fn by_radius(file: &ParticleFile, name: &str) -> Vec<(f64, f64)> {
    let table = &file.species[0].table;
    let (x, c) = (table.column("Coordinates").unwrap(), table.column(name).unwrap());
    let d = x.components;
    let radius = |i: usize| {
        (0..d).map(|k| (x.values.get(i * d + k) - 0.5 * file.header.box_size[k]).powi(2)).sum::<f64>().sqrt()
    };
    (0..table.count).map(|i| (radius(i), c.values.get(i))).collect()
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found:e}, expected {expected:e}");
}

/// P = K rho^2 with K = 2 G R^2 / pi and rho = rho_c sin(x)/x, rho_c = pi M / (4 R^3).
#[test]
fn the_pressure_of_a_polytrope_is_its_closed_form_at_the_particles() {
    let (file, report) = placed(
        "input: {profile: {polytrope: {n: 1, mass: 2, radius: 3}}, atmosphere: keep}\nparticles: 2000\nwvt: {iterations: 2}\n\
         solver: {evaluations: 2}\n",
    );
    near(report.mass.total, 2.0, 1e-6, "mass");
    let center = PI * 2.0 / (4.0 * 27.0);
    for (r, pressure) in by_radius(&file, "Pressure") {
        let x = PI * r / 3.0;
        let rho = center * x.sin() / x;
        let expected = 18.0 / PI * rho * rho;
        assert!((pressure - expected).abs() < 1e-4 * 18.0 / PI * center * center, "{r}: {pressure} {expected}");
    }
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn a_star_by_its_physics_is_the_one_of_the_file_and_is_balanced_for_a_code() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/polytrope-1.5.nc");
    // Of 2000 particles ten are in the middle, where the factor that holds gravity is known to 6 %.
    let rest = "particles: 4000\ntarget_code: swift\noutput: {units: cgs}\n";
    let (own, report) =
        placed(&format!("input: {{profile: {{polytrope: {{n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}}}}\n{rest}"));
    let (_, of_file) = placed(&format!("input: {{file: {file}}}\n{rest}"));
    near(report.mass.total, of_file.mass.total, 1e-5, "mass");
    let [a, b] = [&report, &of_file].map(|r| r.balance.as_ref().unwrap().all);
    assert!(a < 1.2 * b, "net force {a}, of the file's {b}");
    let energies = by_radius(&own, "InternalEnergy");
    // u_c = 1.5 P_c / rho_c = 1.5 0.77014 / (5.99071 3 / 4 pi) G M / R.
    let expected = 1.5 * 0.770_14 / (5.990_71 * 3.0 / (4.0 * PI)) * 6.674_3e-8 * 1.988_41e33 / 6.957e10;
    let (_, center) = energies.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    near(center, expected, 0.05, "the energy of the particle in the middle");
}

#[test]
fn models_come_with_their_masses_in_every_dimension_that_they_have() {
    for (profile, d, mass) in [
        ("polytrope: {n: 3, mass: 5, radius: 2}", 3, 5.0),
        ("polytrope: {n: 1, mass: 5, radius: 2}", 2, 5.0),
        ("polytrope: {n: 0.5, mass: 5, radius: 2}", 1, 5.0),
        ("bonnor-ebert: {mass: 5, radius: 2}", 3, 5.0),
        ("isothermal: {mass: 5, radius: 2, sound_speed: 2}", 3, 5.0),
        ("plummer: {mass: 5, scale_radius: 1, outer_radius: 8}", 3, 5.0),
        ("hernquist: {mass: 5, scale_radius: 1, outer_radius: 8}", 3, 5.0),
        ("nfw: {mass: 5, scale_radius: 1, outer_radius: 8}", 3, 5.0),
        ("king: {mass: 5, core_radius: 1, tidal_radius: 8}", 3, 5.0),
        ("king-1966: {mass: 5, tidal_radius: 8, w0: 6}", 3, 5.0),
        ("hydrostatic: {mass: 5, outer_radius: 2, sound_speed: 2 + r}", 3, 5.0),
        ("beta-model: {mass: 5, core_radius: 1, outer_radius: 8}", 3, 5.0),
        ("evrard: {mass: 5, radius: 2}", 3, 5.0),
        ("power-law: {mass: 5, radius: 2, slope: 2}", 3, 5.0),
        ("power-law: {mass: 5, radius: 2, slope: 0.5}", 1, 5.0),
        ("toy-star: {mass: 5, radius: 2, k: 1}", 2, 5.0),
        ("toy-star: {mass: 5, radius: 2, k: 1}", 1, 5.0),
    ] {
        let (file, report) = placed(&format!(
            "input: {{profile: {{{profile}}}, dimension: {d}, atmosphere: keep}}\nparticles: 200\nwvt: {{iterations: 2}}\npolish: none\n"
        ));
        near(report.mass.total, mass, 1e-5, &format!("{profile} in {d}-D"));
        assert_eq!(file.header.dimension, d);
        let energies = by_radius(&file, "InternalEnergy");
        assert!(energies.iter().all(|(_, u)| *u >= 0.0 && u.is_finite()), "{profile}");
    }
}

/// A third of the critical temperature's dwarf: 0.6 solar masses of carbon and oxygen are 0.0125 solar radii, by tables of cold
/// ideal electrons (Chandrasekhar 1939, table 25, between 1/y_0^2 = 0.4 and 0.5).
#[test]
fn white_dwarfs_are_in_units() {
    let (_, report) = placed(
        "input: {profile: {white-dwarf: {mass: 0.6 Msun}}, atmosphere: keep}\nparticles: 300\nwvt: {iterations: 2}\npolish: none\n",
    );
    near(report.mass.total_cgs.unwrap(), 0.6 * 1.988_41e33, 1e-4, "mass");
}

#[test]
fn bodies_that_cannot_be_are_refused_with_their_keys() {
    for (profile, words) in [
        ("polytrope: {n: 5, mass: 1, radius: 1}", &["polytrope.n", "plummer"][..]),
        ("polytrope: {n: 1, mass: -1, radius: 1}", &["polytrope.mass", "-1", "positive"]),
        ("polytrope: {n: 1, mass: 1, radius: 0}", &["polytrope.radius", "positive"]),
        ("polytrope: {n: 1, mass: 1 km, radius: 1}", &["polytrope.mass", "length"]),
        ("polytrope: {n: 1, mass: 1e300, radius: 1e-300}", &["polytrope"]),
        ("polytrope: {n: 1, mass: 1 Msun, radius: 1}", &["polytrope.radius", "units: solar"]),
        ("bonnor-ebert: {mass: 1, radius: 1, xi: 1e300}", &["bonnor-ebert.xi", "1e300"]),
        ("power-law: {mass: 1, radius: 1, slope: 3}", &["power-law.slope", "3"]),
        ("king-1966: {mass: 1, tidal_radius: 1, w0: 30}", &["king-1966.w0", "30", "20"]),
        ("hydrostatic: {mass: 1, outer_radius: 1}", &["hydrostatic.sound_speed", "missing", "`n`"]),
        (
            "hydrostatic: {mass: 1, outer_radius: 1, n: 1.5, self_gravity: false}",
            &["nothing that holds it", "gravity_of"],
        ),
        ("hydrostatic: {mass: 1, outer_radius: 1, n: 7}", &["hydrostatic.n", "does not end"]),
        ("hydrostatic: {mass: 9, outer_radius: 1, sound_speed: 1}", &["hydrostatic.mass", "2.79", "hotter"]),
        ("hydrostatic: {mass: 1, outer_radius: 1, sound_speed: 1 - r}", &["sound_speed", "positive"]),
        ("isothermal: {mass: 5, radius: 2, sound_speed: 0.1}", &["sound_speed", "too low"]),
        ("white-dwarf: {mass: 1.6 Msun}", &["white-dwarf.mass", "Chandrasekhar"]),
        ("white-dwarf: {mass: 0.6 Msun, nucleons_per_electron: .nan}", &["nucleons_per_electron", "NaN"]),
    ] {
        let error = refused(&format!("input: {{profile: {{{profile}}}}}\nparticles: 100\n"));
        for word in words {
            assert!(error.contains(word), "{profile}: {error} lacks {word:?}");
        }
    }
    let flat = refused("input: {profile: {plummer: {mass: 1, scale_radius: 1, outer_radius: 5}}, dimension: 2}\n");
    assert!(flat.contains("input.dimension") && flat.contains("3 dimensions"), "{flat}");
    let both = refused("input: {file: a, profile: {evrard: {mass: 1, radius: 1}}}\n");
    assert!(both.contains("more than one"), "{both}");
    let unknown = Scene::parse("input: {profile: {polytrop: {n: 1}}}\n").unwrap_err().to_string();
    assert!(unknown.contains("polytrop") && unknown.contains("line 1"), "{unknown}");
}

/// Isothermal gas in the halo beside it, whose particles feel it in turn; and its pressure is that of its temperature.
#[test]
fn gas_of_a_temperature_is_held_by_the_halo_at_its_place() {
    let scene = Scene::parse(
        "bodies:
- {name: halo, input: {profile: {hernquist: {mass: 20, scale_radius: 1, outer_radius: 10}}}, collisionless: {}, particles: 300}
- {name: gas, input: {profile: {hydrostatic: {mass: 0.5, outer_radius: 5, sound_speed: 3}}, atmosphere: keep}, particles: 1000, polish: none}
",
    )
    .unwrap();
    let (file, report) = place_bodies(&scene, FORMATS, &Control::default()).unwrap();
    let notes = |body: usize| report.bodies[body].report["notes"].to_string();
    assert!(notes(0).contains("the gravity of profile 'hydrostatic' is felt, 0.0250 times"), "{}", notes(0));
    assert!(notes(1).contains("the gravity of profile 'hernquist' is felt, 40.0"), "{}", notes(1));
    let table = &file.species.iter().find(|s| s.part_type == 0).unwrap().table;
    let (energy, density) = (table.column("InternalEnergy").unwrap(), table.column("Density").unwrap());
    for i in 0..table.count {
        near(energy.values.get(i), 1.5 * 9.0, 1e-5, "u of c = 3");
    }
    // rho(a)/rho(b) = exp((Phi(b) - Phi(a))/c^2) in the halo alone: Phi = -G M/(r + 1) with M = 20 (11/10)^2; the gas adds to it.
    let x = table.column("Coordinates").unwrap();
    let middle: [f64; 3] =
        std::array::from_fn(|k| (0..table.count).map(|i| x.values.get(3 * i + k)).sum::<f64>() / table.count as f64);
    let radius = |i: usize| (0..3).map(|k| (x.values.get(3 * i + k) - middle[k]).powi(2)).sum::<f64>().sqrt();
    let radii: Vec<f64> = (0..table.count).map(radius).collect();
    let mean = |from: f64, to: f64| {
        let of: Vec<f64> =
            (0..table.count).filter(|i| (from..to).contains(&radii[*i])).map(|i| density.values.get(i)).collect();
        of.iter().sum::<f64>() / of.len() as f64
    };
    let fall = mean(0.3, 0.7) / mean(1.9, 2.1);
    let expected = (24.2_f64 / 9.0 * (1.0 / 1.5 - 1.0 / 3.0)).exp();
    assert!((0.9..1.2).contains(&(fall / expected)), "{fall}, in the halo alone {expected}");
}

/// What there is to know of where a gas ends is said: who cuts it has to hold it.
#[test]
fn gas_that_is_cut_says_what_has_to_hold_it() {
    let halo = "gravity_of: [{input: {profile: {hernquist: {mass: 20, scale_radius: 1, outer_radius: 10}}}}]";
    let notes = |profile: &str, beside: &str| {
        let text = format!(
            "input: {{profile: {{hydrostatic: {{{profile}}}}}, atmosphere: keep}}\n{beside}\nparticles: 200\nwvt: {{iterations: 2}}\npolish: none\n"
        );
        placed(&text).1.notes.join("\n")
    };
    assert!(notes("mass: 1, outer_radius: 1, sound_speed: 1", "").contains("the surroundings have to balance this"));
    assert!(
        notes("mass: 1e-4, outer_radius: 9, n: 1.5, sound_speed: 0.5", halo).contains("ends within its outer radius")
    );
    assert!(!notes("mass: 1, outer_radius: 1, n: 1.5", "").contains("outer radius"));
}
