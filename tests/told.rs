//! What a format or a code has no place for, or takes for something else: it is said, refused, or written so that it is what it was.

use crate::resample::{lattice, written};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, FileContent, ParticleTable, UnitDimension, Values};
use sph_prep::{Control, FORMATS, ParticleFile, Report, Scene, place, place_bodies, run};
use std::path::Path;

const BOX: &str = "input: {expression: '2', dimension: 3}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 64\n\
                   wvt: {iterations: 0}\npolish: none\n";

fn placed(yaml: &str) -> (ParticleFile, Report) {
    place(&Scene::parse(yaml).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}\n{yaml}"))
}

fn refusal(yaml: &str) -> String {
    run(&Scene::parse(yaml).unwrap(), FORMATS, &Control::default()).expect_err("it is refused").to_string()
}

fn gas(path: &Path) -> ParticleTable {
    match sph_formats::read(FORMATS, path, None, &Default::default()).unwrap_or_else(|e| panic!("{e}")) {
        FileContent::Particles(mut file) => file.species.swap_remove(0).table,
        FileContent::Field(_) => panic!("{} holds a field", path.display()),
    }
}

fn values(table: &ParticleTable, name: &str) -> Vec<f64> {
    table.column(name).unwrap_or_else(|| panic!("no '{name}'")).values.to_f64()
}

#[test]
fn columns_of_a_scene_that_a_format_does_not_hold_are_warned_about() {
    let scene = |file: &str| {
        format!(
            "{BOX}fields: {{magnetic_field: [0, 0, 1], hue: x, a_name_of_more_than_16: y, vector: [x, y, z]}}\noutput: {{file: {file}, format: {file}}}\n"
        )
    };
    let said = |format: &str, column: &str| {
        let (_, report) = placed(&scene(format));
        let is_told = report.warnings.iter().any(|w| w.starts_with(&format!("'{column}' is not written")));
        (is_told, report.notes.iter().any(|note| note.starts_with("the magnetic field is in")))
    };
    for column in [names::MAGNETIC_FIELD, "hue", "a_name_of_more_than_16", "vector"] {
        assert_eq!(said("gadget-binary", column), (true, false), "{column}");
        assert_eq!(said("swift", column), (false, true), "{column}");
    }
    for (column, is_lost) in
        [(names::MAGNETIC_FIELD, false), ("hue", false), ("a_name_of_more_than_16", true), ("vector", true)]
    {
        assert_eq!(said("phantom", column), (is_lost, true), "{column}");
    }
}

/// Its dumps have pure numbers in units of 1, with a constant of gravity of 1.
#[test]
fn cgs_is_refused_for_phantom() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("star.tmp");
    let star = "input: {profile: {polytrope: {n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}\nparticles: 100\npolish: none\nwvt: {iterations: 0}\n";
    let said = refusal(&format!("{star}output: {{file: '{}', format: phantom, units: cgs}}\n", path.display()));
    assert!(said.contains("output.units") && said.contains("solar"), "{said}");
    assert!(!path.exists());
}

/// P = (gamma - 1) rho_gas u, rho_gas = (1 - dust fraction) rho, as in Phantom's one fluid (Price & Laibe 2015).
#[test]
fn gas_with_dust_has_the_energy_of_its_own_pressure() {
    let (gamma, rho, pressure, dust) = (1.4_f64, 2.0_f64, 1.0_f64, 0.5_f64);
    let wanted = pressure / ((gamma - 1.0) * (1.0 - dust) * rho);
    let thermal = format!("thermal: {{gamma: {gamma}}}\n");
    let scene = |fields: &str| format!("{BOX}{thermal}fields: {{dust_fraction: {dust}, {fields}}}\n");
    let entropy = pressure / ((1.0 - dust) * rho).powf(gamma);
    for fields in [
        format!("pressure: {pressure}"),
        format!("entropy: {entropy:?}"),
        format!("pressure: {pressure}, internal_energy: {wanted:?}"),
    ] {
        let (file, _) = placed(&scene(&fields));
        let energies = values(&file.species[0].table, names::INTERNAL_ENERGY);
        assert!(energies.iter().all(|u| (u / wanted - 1.0).abs() < 1e-12), "{fields}: {} for {wanted}", energies[0]);
    }
    let parsed = Scene::parse(&scene(&format!("pressure: {pressure}, internal_energy: 1.25"))).unwrap();
    let said = place(&parsed, FORMATS, &Control::default()).err().unwrap().to_string();
    assert!(said.contains("disagrees"), "{said}");
}

#[test]
fn the_constant_of_gravity_is_no_gauss() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.hdf5");
    let scene = |field: &str| {
        format!(
            "units: galactic\n{BOX}fields: {{magnetic_field: ['{field}', 0, 0]}}\noutput: {{file: '{}'}}\n",
            path.display()
        )
    };
    let said = refusal(&scene("1e-6*G*sin(x)"));
    assert!(said.contains("gauss") && said.contains("gravity"), "{said}");
    let field = |text: &str| values(&placed(&scene(text)).0.species[0].table, names::MAGNETIC_FIELD)[0];
    assert!((field("1e-6 G") / field("1e-6*gauss") - 1.0).abs() < 1e-12);
}

/// A table's enclosed mass is not that of particles, and its `h` not their smoothing length.
#[test]
fn what_is_carried_is_not_taken_for_what_placement_makes() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("star.csv");
    let rows = (1..=40).map(|i| {
        let r = f64::from(i) / 40.0;
        let mass = 4.0 * std::f64::consts::PI * (r.powi(3) / 3.0 - 0.225 * r.powi(4));
        format!("{r},{},{mass},{}\n", 1.0 - 0.9 * r, 0.7 - 0.1 * r)
    });
    std::fs::write(&table, format!("radius,Density,Mass,h\n{}", rows.collect::<String>())).unwrap();
    for (name, format) in [
        ("o.npz", "numpy"),
        ("o.csv", "table"),
        ("o.vtu", "vtk"),
        ("o.nc", "netcdf"),
        ("o.hdf5", "swift"),
        ("o.tmp", "phantom"),
    ] {
        let path = folder.path().join(name);
        let scene = format!(
            "input: {{file: '{}'}}\nparticles: 100\nthermal: {{internal_energy: 1}}\npolish: none\nwvt: {{iterations: 0}}\noutput: {{file: '{}', format: {format}}}\n",
            table.display(),
            path.display()
        );
        let report =
            run(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let read = gas(&path);
        let masses = values(&read, names::MASSES);
        assert!((masses.iter().sum::<f64>() / report.mass.total - 1.0).abs() < 1e-6, "{name}");
        assert!(values(&read, "MassOfInput").iter().any(|m| *m > 0.5), "{name}");
        let h = if name == "o.tmp" { "hOfInput" } else { "h" };
        assert!(values(&read, h).iter().all(|h| (0.6..=0.7).contains(h)), "{name}");
    }
}

#[test]
fn walls_of_particles_are_said_to_be_none_for_codes_that_have_none() {
    let scene = |code: &str| {
        let own = BOX.replace("[periodic]", "reflecting");
        format!("{own}fields: {{pressure: 1}}\nwalls: {{layers: 1}}\ntarget_code: {code}\n")
    };
    let is_said = |code: &str| placed(&scene(code)).1.warnings.iter().any(|w| w.contains("no walls of particles"));
    assert_eq!(["swift", "gadget4", "gizmo", "pysph"].map(is_said), [true, true, true, false]);
}

#[test]
fn a_point_within_a_star_is_told() {
    let scene = |x: f64| {
        format!(
            "bodies:\n- {{name: star, input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}}}\n\
             - {{name: hole, point_mass: 1, position: [{x}, 0, 0]}}\nparticles: 200\npolish: none\nwvt: {{iterations: 0}}\n"
        )
    };
    let is_told = |x: f64| {
        let (_, report) = place_bodies(&Scene::parse(&scene(x)).unwrap(), FORMATS, &Control::default()).unwrap();
        report.notes.iter().any(|note| note.contains("hole is within body star"))
    };
    assert_eq!([0.0, 0.5, 1.5].map(is_told), [false, true, false]);
}

/// Its particles' center of mass is off by noise, which would be a kick along every orbit.
#[test]
fn a_disc_turns_about_its_star() {
    let scene = "bodies:\n- {name: star, point_mass: 1}\n\
                 - {name: disc, input: {profile: {disc: {mass: 1e-6, inner_radius: 0.5, outer_radius: 3, aspect_ratio: 0.1}}}}\n\
                 particles: 1000\npolish: none\nwvt: {iterations: 0}\noutput: {units: code}\n";
    let (file, _) = place_bodies(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap();
    let of = |part_type: u8, name: &str| {
        let species = file.species.iter().find(|s| s.part_type == part_type && s.table.count > 0).unwrap();
        values(&species.table, name)
    };
    let star = of(1, names::COORDINATES);
    let (places, velocities) = (of(0, names::COORDINATES), of(0, names::VELOCITIES));
    for (x, v) in places.chunks(3).zip(velocities.chunks(3)) {
        let [dx, dy] = [x[0] - star[0], x[1] - star[1]];
        let (outwards, around) = (dx * v[0] + dy * v[1], dx * v[1] - dy * v[0]);
        // Places within a box of a dozen radii, to rounding.
        assert!(outwards.abs() < 1e-12 * around.abs(), "{x:?} {v:?}: {outwards:e} of {around:e}");
    }
}

/// A code has one adiabatic index for all gas.
#[test]
fn bodies_of_different_gases_are_warned_about() {
    let scene = |first: &str, beside: &str| {
        format!(
            "bodies:\n- {{input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}, position: [-2, 0, 0], thermal: {{gamma: {first}}}}}\n\
             - {{input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}, position: [2, 0, 0]}}\nparticles: 300\npolish: none\nwvt: {{iterations: 0}}\n{beside}"
        )
    };
    let told = |first: &str, beside: &str| {
        let (_, report) =
            place_bodies(&Scene::parse(&scene(first, beside)).unwrap(), FORMATS, &Control::default()).unwrap();
        assert!(report.warnings.iter().all(|w| report.text().contains(w.as_str())));
        report.warnings.iter().any(|w| w.contains("adiabatic indices 1.4000, 1.6667"))
    };
    assert!(told("1.4", ""));
    assert!(!told("1.4", "thermal: {gamma: 1.4}\n"));
    assert!(!told("1.6666666666666667", ""));
    assert!(!told("1.6667", ""));
}

/// Names that readers of a format have a use for of their own.
#[test]
fn fields_by_names_that_formats_use_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    for (name, format) in
        [("o.npz", "numpy"), ("o.csv", "table"), ("o.vtu", "vtk"), ("o.nc", "netcdf"), ("o.hdf5", "swift")]
    {
        let path = folder.path().join(name);
        let scene = format!(
            "{BOX}fields: {{header: 2, Radius: 3, metallicity: 0.02}}\nthermal: {{internal_energy: 1}}\noutput: {{file: '{}', format: {format}}}\n",
            path.display()
        );
        run(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let read = gas(&path);
        let header = if format == "numpy" { "headerOfInput" } else { "header" };
        for (column, value) in [(header, 2.0), ("Radius", 3.0), (names::METALLICITY, 0.02)] {
            assert!(values(&read, column).iter().all(|v| (v - value).abs() < 1e-6), "{name}: {column}");
        }
    }
}

#[test]
fn points_at_one_place_are_refused() {
    let points = "bodies:\n- {name: a, point_mass: 1}\n- {name: b, point_mass: 1}\n- {name: star, input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}, position: [9, 0, 0]}\n\
                  particles: 100\npolish: none\nwvt: {iterations: 0}\n";
    let error = place_bodies(&Scene::parse(points).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string();
    assert!(error.contains("bodies[a]") && error.contains("and b are points at one place"), "{error}");
}

/// No particle would be there, and others would carry the mass.
#[test]
fn a_resolution_that_forgets_part_of_the_mass_is_refused() {
    let cube = "domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\n";
    for (input, domain, resolution) in [
        ("{expression: '1'}", cube, "if(x < 0.5, 1, 1e-4)"),
        ("{expression: '1'}", cube, "if(x < 0.5, 1, 0)"),
        ("{expression: '1'}", cube, "exp(-20*x)"),
        ("{profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}", "", "if(r < 0.3, 1e-4, 1)"),
    ] {
        let scene =
            format!("input: {input}\n{domain}particles: 1000\nresolution: {{number_density: '{resolution}'}}\n");
        let error = place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string();
        assert!(
            error.contains("scene, resolution: has spacings larger than the whole domain"),
            "{resolution}: {error}"
        );
    }
    let coarse = format!(
        "input: {{expression: '1'}}\n{cube}particles: 500\npolish: none\nwvt: {{iterations: 0}}\nresolution: {{number_density: 'if(x < 0.5, 1, 0.05)'}}\n"
    );
    placed(&coarse);
}

#[test]
fn a_density_that_is_not_periodic_is_told_in_a_periodic_box() {
    let told = |expression: &str, boundary: &str| {
        let scene = format!(
            "input: {{expression: '{expression}'}}\ndomain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: {boundary}}}\nparticles: 300\npolish: none\n\
             wvt: {{iterations: 0}}\n"
        );
        let (_, report) = place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
        report.warnings.iter().any(|w| w.contains("periodic along z, but the density is not"))
    };
    assert!(told("1 + 2*z", "[periodic]") && !told("1 + 2*z", "[periodic, periodic, open]"));
    assert!(!told("2 + sin(2*pi*z) + cos(2*pi*x)", "[periodic]"));
    // Steep, but nowhere else as steep; and fields whose own jumps are as large, of which one lies in the face.
    assert!(told("exp(-z/0.1)", "[periodic]"));
    assert!(!told("if(z < 0.3, 10, 1)", "[periodic]"));
    assert!(!told("if(sin(4*pi*z) > 0, 10, 1)", "[periodic]"));
    let resolution = |spacing: &str, boundary: &str| {
        let scene = format!(
            "input: {{expression: '1', dimension: 2}}\ndomain: {{box: [[0, 0], [1, 1]], boundary: {boundary}}}\nparticles: 300\npolish: none\n\
             wvt: {{iterations: 0}}\nresolution: {{spacing: '{spacing}'}}\n"
        );
        let (_, report) = place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
        report
            .warnings
            .iter()
            .any(|w| w.contains("periodic along x, but the resolution is not") && w.contains("4.000 times"))
    };
    assert!(resolution("1 + x", "[periodic]") && !resolution("1 + x", "[reflecting]"));
    assert!(!resolution("2 + sin(2*pi*x)", "[periodic]"));
}

/// What the code computes with, where there is gas.
#[test]
fn fields_that_are_not_periodic_are_told_in_a_periodic_box() {
    let told = |boundary: &str, rest: &str| -> Vec<String> {
        let scene = format!(
            "input: {{expression: '1'}}\ndomain: {{box: [[0, 0, 0], [1, 1, 1]], boundary: {boundary}}}\nparticles: 300\npolish: none\n\
             wvt: {{iterations: 0}}\n{rest}\n"
        );
        let (_, report) = placed(&scene);
        report.warnings.into_iter().filter(|w| w.contains("is periodic along")).collect()
    };
    let one = |rest: &str, part: &str| {
        let found = told("periodic", rest);
        assert!(found.len() == 1 && found[0].contains(part), "{rest}: {found:?}");
        assert_eq!(told("open", rest), [""; 0], "{rest}");
    };
    one("fields: {pressure: '1 + x'}", "along x, but 'Pressure' is not: in the median it differs by 1.000e0");
    one("fields: {pressure: 1, velocity: [0, 'z - 0.5', 0]}", "along z, but 'Velocities'");
    one("fields: {internal_energy: '100*exp(-y/0.2)'}", "along y, but 'InternalEnergy'");
    one("fields: {pressure: 1, magnetic_field: ['y^2', 0, 0]}", "along y, but 'MagneticField");
    one("motion: {rotation: [0, 0, 1]}", "turns a box that is periodic along x");
    for rest in [
        "fields: {pressure: '2 + sin(2*pi*x)', velocity: ['cos(4*pi*y)', 0, 0]}",
        // Jumps of their own, a uniform field of a potential that grows, and a column that no code knows.
        "fields: {pressure: 1, velocity: ['if(abs(y - 0.5) < 0.25, 1, -1)', 0, 0]}",
        "fields: {pressure: 'if(x < 0.5, 1, 0.1)'}",
        "fields: {pressure: 1, vector_potential: [0, 0, x]}",
        "fields: {hue: x}",
        "motion: {bulk: [1, 0, 0]}",
    ] {
        assert_eq!(told("periodic", rest), [""; 0], "{rest}");
    }
    // Along the axis it turns about nothing jumps.
    assert_eq!(told("[open, open, periodic]", "motion: {rotation: [0, 0, 1]}"), [""; 0]);
    assert_eq!(told("[open, open, periodic]", "motion: {rotation: [1, 0, 0]}").len(), 1);
}

/// The file starts at time 0, whatever the snapshot's is.
#[test]
fn particles_that_form_after_the_start_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let told = |births: [f64; 2], name: &str, time: f64| {
        let mut file = lattice(true);
        file.header.time = time;
        let column = |name: &str, components: usize, values: Vec<f64>, dimension| {
            Column::new(name, components, Values::F64(values), dimension)
        };
        let columns = vec![
            column(names::COORDINATES, 3, vec![0.1, 0.2, 0.3, 0.5, 0.5, 0.5], UnitDimension::LENGTH),
            column(names::MASSES, 1, vec![1e-3; 2], UnitDimension::MASS),
            column(name, 1, births.to_vec(), UnitDimension::NONE),
        ];
        file.species.push(sph_formats::Species { part_type: 4, table: ParticleTable { count: 2, columns } });
        let path = written(folder.path(), "stars.hdf5", &file);
        let scene =
            format!("input: {{file: '{}'}}\nparticles: 100\npolish: none\nwvt: {{iterations: 0}}\n", path.display());
        let (_, report) = placed(&scene);
        report.warnings.into_iter().find(|w| w.contains("would form after the start"))
    };
    let found = told([0.2, 0.6], "StellarFormationTime", 0.7).unwrap();
    assert!(found.contains("of type 4") && found.contains("up to 6.0") && found.contains("7.000000e-1"), "{found}");
    assert!(told([0.2, 0.6], "BirthTimes", 0.7).is_some());
    for (births, name, time) in
        [([-2.0, -0.1], "BirthTimes", 0.7), ([0.2, 0.6], "Metals", 0.7), ([0.2, 0.6], "BirthTimes", 0.0)]
    {
        assert_eq!(told(births, name, time), None, "{births:?} {name} {time}");
    }
}

/// What fills a periodic box ends at its faces where it is one body among others, unless a medium goes on about it.
#[test]
fn a_snapshot_that_fills_a_periodic_box_is_one_piece_as_a_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), "box.hdf5", &lattice(true));
    let told = |input: &str| {
        let scene = format!(
            "bodies:\n- {{name: cloud, input: {{file: '{}'{input}}}}}\n- {{point_mass: 1, position: [100, 0, 0]}}\noutput: {{units: code}}\n",
            path.display()
        );
        let (_, report) = place_bodies(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
        report.warnings.iter().any(|w| w.contains("body cloud fills a periodic box"))
    };
    assert!(told(", keep_particles: true") && told(""));
    let star = "input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}\nparticles: 100\npolish: none\nwvt: {iterations: 0}\n";
    let (mut star, _) = placed(star);
    star.header.periodic = [true; 3];
    let path = written(folder.path(), "star.hdf5", &star);
    let scene = format!("bodies:\n- {{name: cloud, input: {{file: '{}'}}}}\noutput: {{units: code}}\n", path.display());
    let (_, report) = place_bodies(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
    assert!(report.warnings.iter().all(|w| !w.contains("fills a periodic box")), "{:?}", report.warnings);
}

#[test]
fn sinks_without_a_radius_are_refused_before_anything_is_placed() {
    let star = "bodies:\n- {point_mass: 1}\n- {input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}, position: [5, 0, 0]}\n\
                particles: 1000000000\ntarget_code: phantom\n";
    let error = place_bodies(&Scene::parse(star).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string();
    assert!(error.contains("accretion_radius: is missing"), "{error}");
}

/// The verdict of each body is that of before.
#[test]
fn pairs_that_settling_makes_are_in_the_verdict_on_all_bodies() {
    let star = "{input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}, position: ";
    let scene = format!(
        "bodies:\n- {star}[-2, 0, 0]}}\n- {star}[2, 0, 0]}}\nparticles: 100\npolish: none\nwvt: {{iterations: 0}}\n"
    );
    let (_, mut report) = place_bodies(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
    assert!(!report.text().contains("after settling"));
    for (apart, mark) in [(0.1, "BAD    pairs"), (0.4, "LOOK   pairs"), (0.7, "good   pairs")] {
        report.settled_pair = Some((apart, "cubic spline"));
        report.judge();
        let text = report.text();
        assert!(
            text.contains(&format!("{mark}          after settling the closest are {apart:.3} spacings apart")),
            "{text}"
        );
    }
}

/// Whether the balance is used or not, and not those of the input's own pressure, which is not written beside them.
#[test]
fn particles_have_the_energies_of_the_equation_of_state_that_is_stated() {
    let star = |more: &str| {
        let text = format!(
            "input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}\nparticles: 300\npolish: none\noutput: {{units: code}}\n\
             balance: {{equation_of_state: {{isothermal: {{sound_speed: 2}}}}{more}}}\n"
        );
        let (file, report) = placed(&text);
        let table = &file.species[0].table;
        assert!(table.column(names::PRESSURE).is_none(), "{more}");
        let is_told =
            report.notes.iter().any(|note| note.contains("balance.equation_of_state at the target's density"));
        (values(table, names::INTERNAL_ENERGY), is_told)
    };
    // u = c^2/(gamma - 1); the star's own are below 0.8.
    let (energy, is_told) = star("");
    assert!(energy.iter().all(|u| (u / 6.0 - 1.0).abs() < 1e-6) && is_told, "{energy:?}");
    // Those of summed densities, which are some percent off.
    let (energy, is_told) = star(", evaluations: 0");
    let mean = energy.iter().sum::<f64>() / energy.len() as f64;
    assert!((mean / 6.0 - 1.0).abs() < 0.1 && !is_told, "{mean}");
}

#[test]
fn snapshots_are_not_turned_or_scaled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("snapshot.npz");
    let (file, _) = placed(&format!("{BOX}thermal: {{internal_energy: 1}}\n"));
    sph_prep::write(FORMATS, &path, Some("numpy"), &file, sph_prep::WriteOptions::default()).unwrap();
    for (key, value) in [("rotate", "[0, 0, 30]"), ("scale", "2")] {
        let scene = format!("input: {{file: '{}', {key}: {value}}}\nparticles: 50\n", path.display());
        let error = place(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap_err().to_string();
        assert!(error.contains(&format!("input.{key}")) && error.contains("leave it out"), "{error}");
    }
}

/// Whether parameter files are asked for or not.
#[test]
fn what_a_code_does_not_do_is_told_of_every_file_for_it() {
    let told = |scene: &str, code: &str, parts: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let mut scene =
            Scene::parse(&format!("{scene}target_code: {code}\nwvt: {{iterations: 0}}\npolish: none\n")).unwrap();
        scene.output.file = Some(folder.path().join("ic.hdf5"));
        let report = run(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
        for part in parts {
            assert!(report.notes.iter().any(|note| note.contains(part)), "{code} lacks '{part}': {:#?}", report.notes);
        }
        assert_eq!(
            report.notes.iter().any(|note| note.contains("gravity_of")),
            scene.bodies.is_empty() && !scene.gravity_of.is_empty()
        );
    };
    let gas = "input: {expression: '1', dimension: 3}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [BOUNDARY]}\nparticles: 512\n";
    let fields = "fields: {pressure: 1, dust_fraction: 0.1, magnetic_field: [0.5, 0, 0]}\n";
    // P = (gamma - 1) rho u with all of rho in place of the gas alone.
    let of_dust = "up to 1.111 times the scene's";
    for code in ["swift", "gadget4"] {
        told(&(gas.replace("BOUNDARY", "periodic") + fields), code, &["no magnetic fields", of_dust]);
    }
    told(&gas.replace("BOUNDARY", "reflecting"), "swift", &["no reflecting walls"]);
    told(
        "input: {profile: {hydrostatic: {mass: 0.1, outer_radius: 1, n: 1.5}}}\ngravity_of: [{point_mass: 1, softening_radius: 0.5}]\n\
         particles: 300\n",
        "swift",
        &["does not receive the gravity of what `gravity_of` names"],
    );
    told(
        "input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}, dimension: 2}\nparticles: 300\n",
        "gadget4",
        &["a body that its own gravity holds in 2-D disperses"],
    );
}

#[test]
fn options_for_inputs_of_another_kind_are_told() {
    let told = |input: &str| {
        let (_, report) = placed(&format!("input: {input}\nparticles: 64\nwvt: {{iterations: 0}}\npolish: none\n"));
        report.notes.into_iter().find(|note| note.contains("nothing: the input is"))
    };
    let star = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");
    let said = told(&format!("{{file: '{star}', centering: cells, interpolation: linear}}")).unwrap();
    assert!(
        said.starts_with("input.interpolation, input.centering change nothing: the input is a radial table"),
        "{said}"
    );
    assert_eq!(told(&format!("{{file: '{star}', staggering: nodes}}")), None);
    let snapshot = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/rotating-star.hdf5");
    let said = told(&format!("{{file: '{snapshot}', staggering: nodes}}")).unwrap();
    assert!(said.starts_with("input.staggering changes nothing: the input is a snapshot"), "{said}");
}

/// A sphere of gas that a medium holds in the profile has none about it in the code.
#[test]
fn a_pressure_at_the_surface_of_a_body_in_a_vacuum_is_told() {
    let told = |profile: &str| {
        let (_, report) =
            placed(&format!("input: {{profile: {{{profile}}}}}\nparticles: 300\nbalance: {{evaluations: 1}}\n"));
        report.notes.iter().find(|note| note.starts_with("the pressure at the surface is")).cloned()
    };
    // P = c^2 rho, and rho falls to 0.6 of the central density for GM/(c^2 R) = 1.
    let said = told("isothermal: {mass: 1, radius: 1, sound_speed: 1}").unwrap();
    let share: f64 = said.split(' ').nth(6).unwrap().parse().unwrap();
    assert!((55.0..65.0).contains(&share), "{said}");
    assert_eq!(told("polytrope: {n: 1.5, mass: 1, radius: 1}"), None);
}

/// Balance, certificate and parameter files reckon with that of the scene.
#[test]
fn another_gamma_than_the_scenes_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = lattice(true);
    let table = &mut file.species[0].table;
    let rho = table.column(names::DENSITY).unwrap().values.to_f64();
    // P = (gamma - 1) rho u with u = 1.5 and gamma = 1.4.
    let pressure = Values::F64(rho.iter().map(|rho| 0.4 * 1.5 * rho).collect());
    table.columns.push(Column::new(names::PRESSURE, 1, pressure, UnitDimension::PRESSURE));
    let input = written(folder.path(), "diatomic.npz", &file);
    for (gamma, is_told) in
        [("", true), ("thermal: {gamma: 1.4}\n", false), ("input: {carry: [InternalEnergy]}\n", false)]
    {
        let mut scene =
            Scene::parse(&format!("particles: 1000\npolish: none\nwvt: {{iterations: 0}}\n{gamma}")).unwrap();
        scene.input.file = Some(input.clone());
        let (_, report) = place(&scene, FORMATS, &Control::default()).unwrap();
        let told = report.warnings.iter().any(|w| w.contains("gamma is 1.4") && w.contains("`thermal: {gamma: 1.4"));
        assert_eq!(told, is_told, "{gamma}: {:?}", report.warnings);
    }
}

/// The velocity of a medium that its fields give it, and where a body lies that is one of several.
#[test]
fn what_moves_is_told_and_no_place_that_is_not_its_own() {
    let star = "{name: star, input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}, particles: 300, position: [3, 3, 3]}";
    let scene = format!(
        "bodies: [{star}]\nambient: {{density: 0.01, match: spacing, fields: {{velocity: [2, 0, 0], internal_energy: 1}}}}\n\
         domain: {{box: [[0, 0, 0], [6, 6, 6]], boundary: periodic}}\nwvt: {{iterations: 0}}\npolish: none\n"
    );
    let (_, report) = place_bodies(&Scene::parse(&scene).unwrap(), FORMATS, &Control::default()).unwrap();
    let [star, medium] = report.bodies.as_slice() else { panic!("{:?}", report.bodies) };
    assert_eq!(star.velocity, [0.0; 3]);
    assert!((medium.velocity[0] - 2.0).abs() < 1e-12 && medium.velocity[1] == 0.0, "{:?}", medium.velocity);
    let json: serde_json::Value = serde_json::from_str(&report.json()).unwrap();
    let notes = json["bodies"][0]["report"]["notes"].as_array().unwrap();
    assert!(!notes.is_empty() && notes.iter().all(|note| !note.as_str().unwrap().starts_with("the origin is")));
}

/// Along open axes alone is the box larger than the body.
#[test]
fn the_box_of_a_body_that_is_moved_has_all_its_edges() {
    let edges = |boundary: &str| {
        let (file, report) = placed(&format!(
            "input: {{expression: '1'}}\ndomain: {{box: [[0, 0, 0], [1, 2, 1]], boundary: {boundary}}}\nparticles: 500\n\
             wvt: {{iterations: 0}}\npolish: none\n"
        ));
        let note = report.notes.iter().find(|note| note.starts_with("the body is moved to the middle")).cloned();
        (file.header.box_size, note)
    };
    let (size, note) = edges("[periodic, open, open]");
    assert!(size[1] == size[2] && size[0] != size[1], "{size:?}");
    let said = note.unwrap();
    let all: Vec<f64> = said.split(['x', ' ']).filter_map(|word| word.parse().ok()).collect();
    assert_eq!(all[..3], size, "{said}");
    let (size, note) = edges("open");
    assert!(note.unwrap().contains(&format!("a box of edge {:.6e} (", size[0])));
}
