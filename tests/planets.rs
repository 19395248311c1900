//! Planets of materials with equations of state: their columns, their balance, and what contradicts it.

use sph_prep::eos::Material;
use sph_prep::scene::Scene;
use sph_prep::{Control, FORMATS, ParticleFile, Report, place, place_bodies, run_bodies};
use std::io::Write;

/// Grams.
const EARTH: f64 = 5.972_168e27;

/// Half iron and half granite by mass; in cgs, for SWIFT.
const PLANET: &str = "
input:
  profile:
    planet:
      mass: 0.5 Mearth
      surface_temperature: 1000 K
      layers: [{material: tillotson-iron, mass_fraction: 0.5}, {material: tillotson-granite}]
output: {units: cgs}
particles: 2000
";

fn run(scene: &str) -> (ParticleFile, Report) {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(scene: &str) -> String {
    place(&Scene::parse(scene).unwrap(), FORMATS, &Control::default()).err().unwrap().to_string()
}

fn column(file: &ParticleFile, name: &str) -> Vec<f64> {
    let column = file.species[0].table.column(name).unwrap_or_else(|| panic!("no '{name}'"));
    (0..column.values.len()).map(|i| column.values.get(i)).collect()
}

#[test]
fn a_planet_carries_its_materials_and_the_pressure_of_their_equations() {
    let scene = PLANET.replace("units: cgs", "units: cgs, target_density: true");
    let (file, report) = run(&format!("{scene}polish: none\nwvt: {{iterations: 3}}\n"));
    let ids = column(&file, "MaterialIDs");
    let iron = ids.iter().filter(|id| **id == 100.0).count();
    assert!(iron.abs_diff(1000) <= 1 && ids.iter().filter(|id| **id == 101.0).count() == 2000 - iron, "{iron}");
    assert!((report.mass.total_cgs.unwrap() / (0.5 * EARTH) - 1.0).abs() < 1e-4, "{:?}", report.mass.total_cgs);
    let [pressure, energy, density] = ["Pressure", "InternalEnergy", "TargetDensity"].map(|name| column(&file, name));
    for i in 0..2000 {
        let matter = Material::of_id(ids[i] as i32).unwrap().equation;
        let found = matter.pressure(density[i], energy[i]);
        // The columns are interpolated one by one.
        assert!((found - pressure[i]).abs() < 1e-4 * pressure[i] + 1e8, "{i}: {found:e} {:e}", pressure[i]);
    }
    assert!(column(&file, "Temperature").iter().all(|t| *t > 990.0));
}

/// Granite and basalt hardly differ in density: a shell of particles could reach from one into the other.
#[test]
fn layers_of_nearly_one_density_have_their_masses() {
    for (n, seeding) in [(300, "shells"), (1500, "shells"), (500, "mass-bisection")] {
        let (file, _) = run(&format!(
            "input: {{profile: {{planet: {{mass: 0.1 Mearth, surface_temperature: 300 K, layers: [
                {{material: tillotson-granite, mass_fraction: 0.6}}, {{material: tillotson-basalt}}]}}}}}}
particles: {n}\nseeding: {seeding}\npolish: none\nwvt: {{iterations: 3}}\n"
        ));
        let granite = column(&file, "MaterialIDs").iter().filter(|id| **id == 101.0).count();
        assert!(granite.abs_diff(6 * n / 10) <= 1, "{seeding}: {granite} of {n}");
    }
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn a_planet_is_balanced_by_its_equations_of_state_and_stays_still() {
    let (file, report) = run(&format!("{PLANET}target_code: 'swift:planetary,wendland-c4'\ncertify: 1\n"));
    let history = &report.stages.iter().find(|s| s.stage.name == "balance").unwrap().history;
    let [begin, end] = [history[0].force_error.unwrap(), report.balance.as_ref().unwrap().all];
    assert!(begin > 0.1 && end < 0.03, "net force over gravity from {begin} to {end}: {:?}", report.notes);
    let certificate = report.certificate.as_ref().unwrap();
    assert!(certificate.kinetic < 2e-5 && certificate.central_density_drift < 0.01, "{}", certificate.kinetic);
    assert!(certificate.states.iter().all(|s| s.virial.abs() < 0.05 && s.energy.abs() < 1e-4));
    assert!(report.notes.iter().any(|n| n.contains("Tillotson iron")), "{:?}", report.notes);
    // With the summed density the energies give, on the mean over the core, the pressure of the planet.
    let ids = column(&file, "MaterialIDs");
    let [pressure, energy, density] = ["Pressure", "InternalEnergy", "Density"].map(|name| column(&file, name));
    let core: Vec<usize> = (0..ids.len()).filter(|i| ids[*i] == 100.0).collect();
    let iron = Material::of_id(100).unwrap().equation;
    let [found, wanted] = [
        core.iter().map(|i| iron.pressure(density[*i], energy[*i])).sum::<f64>(),
        core.iter().map(|i| pressure[*i]).sum::<f64>(),
    ];
    assert!((found / wanted - 1.0).abs() < 0.1 && core.len().abs_diff(1000) <= 1, "{}", found / wanted);
}

#[test]
#[ignore = "slow: .ci/full runs it"]
fn the_impact_is_one_file_with_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/impact.yaml");
    let mut scene = Scene::load(std::path::Path::new(path)).unwrap();
    scene.particles = Some(900);
    scene.output.file = Some(folder.path().join("impact.hdf5"));
    let (file, _) = place_bodies(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    let (ids, bodies, masses) = (column(&file, "MaterialIDs"), column(&file, "BodyID"), column(&file, "Masses"));
    for (body, mass) in [(1.0, 0.89), (2.0, 0.13)] {
        let own: Vec<usize> = (0..900).filter(|i| bodies[*i] == body).collect();
        let iron: f64 = own.iter().filter(|i| ids[**i] == 100.0).map(|i| masses[*i]).sum();
        let total: f64 = own.iter().map(|i| masses[*i]).sum();
        assert!((total / mass - 1.0).abs() < 2e-3, "{body}: {total}");
        assert!((iron / total - 0.3).abs() < 0.01, "{body}: {iron} of {total}");
    }
    run_bodies(&scene, FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"));
    let text = std::fs::read_to_string(folder.path().join("impact.yml")).unwrap();
    for line in ["planetary_use_Til_iron: 1", "planetary_use_Til_granite: 1", "Gravity:"] {
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn an_energy_that_contradicts_the_equation_of_state_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("planet.csv");
    let write = |energy: f64, material: i32| {
        let mut file = std::fs::File::create(&path).unwrap();
        writeln!(file, "radius [m],density [kg/m^3],internal_energy [J/kg],material_id").unwrap();
        for i in 0..=50 {
            let x = f64::from(i) / 50.0;
            writeln!(file, "{},{},{energy},{material}", 3e6 * x, 3400.0 - 700.0 * x * x).unwrap();
        }
    };
    let scene =
        format!("input: {{file: {}}}\nparticles: 1000\ntarget_code: swift:planetary\nbalance: {{}}\n", path.display());
    write(5e7, 101);
    let error = refused(&scene);
    for part in ["balance", "InternalEnergy", "Tillotson granite", "pressure"] {
        assert!(error.contains(part), "{error} lacks {part}");
    }
    write(5e5, 417);
    let error = refused(&scene);
    assert!(error.contains("417") && error.contains("Tillotson"), "{error}");
}

#[test]
fn planets_that_are_none_are_refused_by_key() {
    for (change, part) in [
        (("mass: 0.5 Mearth", "mass: 0.5 Mearth\n      radius: 1 km"), "leaves 0"),
        (("mass: 0.5 Mearth", "mass: -1 Mearth"), "planet.mass"),
        (("surface_temperature: 1000 K", "state: isothermal"), "surface_temperature"),
        (("mass_fraction: 0.5", "mass_fraction: 1.5"), "layers[0].mass_fraction"),
        (("mass_fraction: 0.5", "mass_fraction: 0.5, radius: 1 km"), "more than one"),
        (("{material: tillotson-granite}", "{material: tillotson-granite, mass: 1 Mearth}"), "outermost"),
        (("{material: tillotson-granite}", "{material: {table: {file: none.txt}}}"), "none.txt"),
        (("{material: tillotson-granite}", "{material: {murnaghan: {density: 1 kg, bulk_modulus: 1 Pa}}}"), "density"),
    ] {
        let error = refused(&PLANET.replace(change.0, change.1));
        assert!(error.contains(part), "{change:?}: {error}");
    }
    let water = "{material: {murnaghan: {density: 1 g/cm^3, bulk_modulus: 2 GPa}}}";
    let unnumbered = PLANET.replace("{material: tillotson-granite}", water);
    let error = refused(&unnumbered);
    assert!(error.contains("layers[1].id") && error.contains("number 100"), "{error}");
    // A code that looks materials up by number takes no body without.
    let alone = PLANET.replace("{material: tillotson-iron, mass_fraction: 0.5}, {material: tillotson-granite}", water);
    let error = refused(&format!("{alone}target_code: swift:planetary\n"));
    assert!(error.contains("layers[0].id") && error.contains("SWIFT"), "{error}");
    let error = Scene::parse(&PLANET.replace("tillotson-iron", "tillotson-lead")).unwrap_err().to_string();
    assert!(error.contains("tillotson-lead") && error.contains("line"), "{error}");
}
