//! Total energies become internal ones, and momenta velocities, in every container, against closed forms.

use super::{
    check, columns, density, energy, field_x, field_y, field_z, grid, nodes, pressure, run, velocity_x, velocity_y,
    velocity_z, written,
};
use crate::grids::{CONTAINERS, Field, Variables};

fn squared(a: Field, b: Field, c: Field, x: [f64; 3]) -> f64 {
    a(x).powi(2) + b(x).powi(2) + c(x).powi(2)
}

fn kinetic(x: [f64; 3]) -> f64 {
    0.5 * squared(velocity_x, velocity_y, velocity_z, x)
}

fn total(x: [f64; 3]) -> f64 {
    energy(x) + kinetic(x)
}

fn total_density(x: [f64; 3]) -> f64 {
    density(x) * total(x)
}

fn with_field(x: [f64; 3]) -> f64 {
    total_density(x) + 0.5 * squared(field_x, field_y, field_z, x)
}

fn internal_density(x: [f64; 3]) -> f64 {
    density(x) * energy(x)
}

fn momentum_x(x: [f64; 3]) -> f64 {
    density(x) * velocity_x(x)
}

fn momentum_y(x: [f64; 3]) -> f64 {
    density(x) * velocity_y(x)
}

fn momentum_z(x: [f64; 3]) -> f64 {
    density(x) * velocity_z(x)
}

const VELOCITY: [(&str, Field); 3] = [("velx", velocity_x), ("vely", velocity_y), ("velz", velocity_z)];
const FIELD: [(&str, Field); 3] = [("Bcc1", field_x), ("Bcc2", field_y), ("Bcc3", field_z)];
const MOMENTUM: [(&str, Field); 3] = [("mom1", momentum_x), ("mom2", momentum_y), ("mom3", momentum_z)];

#[test]
fn what_else_is_in_an_energy_comes_off_in_every_container() {
    let folder = tempfile::tempdir().unwrap();
    // What is reduced at the values of the file is linear in between.
    let cases: [(&str, Vec<(&str, Field)>); 6] = [
        ("FLASH", [&[("dens", density as Field), ("ener", total)][..], &VELOCITY].concat()),
        ("Castro, total", [&[("dens", density as Field), ("rho_E", total_density)][..], &VELOCITY].concat()),
        ("Castro, internal", [&[("dens", density as Field), ("rho_e", internal_density)][..], &VELOCITY].concat()),
        ("Athena++, conserved", [&[("dens", density as Field), ("Etot", total_density)][..], &MOMENTUM].concat()),
        ("Athena++, magnetized", [&[("dens", density as Field), ("Etot", with_field)][..], &MOMENTUM, &FIELD].concat()),
        ("magnetized", [&[("dens", density as Field), ("Etot", with_field)][..], &VELOCITY, &FIELD].concat()),
    ];
    for container in CONTAINERS {
        for (name, variables) in &cases {
            (container.write)(&folder.path().join(container.file), &grid(container), variables);
            let (file, report) = run(folder.path(), (container.file, "dens"), "");
            let label = format!("{name} in {}", container.file);
            check(&file, container, columns::INTERNAL_ENERGY, &[energy], &label);
            check(&file, container, columns::VELOCITIES, &[velocity_x, velocity_y, velocity_z], &label);
            assert!(report.warnings.is_empty(), "{label}: {:?}", report.warnings);
            let own = report.variables.iter().find(|v| v.written_as.as_deref() == Some("InternalEnergy")).unwrap();
            assert!(own.note.as_ref().is_some_and(|n| n.contains("came off")), "{label}: {own:?}");
            assert_eq!(own.name, variables[1].0, "{label}");
            assert!(report.variables.iter().all(|v| v.written_as.is_some()), "{label}: {:?}", report.variables);
        }
    }
}

#[test]
fn units_of_energy_and_velocity_may_differ() {
    // A profile in cgs whose energies are in J/kg: 1 J/kg is 1e4 erg/g.
    let folder = tempfile::tempdir().unwrap();
    let row = |r: f64| {
        format!("{r:e},{:e},{:e},{:e}\n", 2.0 - r / 1e9, 1e5 * r / 1e9, (3e11 + 0.5e10 * (r / 1e9).powi(2)) * 1e-4)
    };
    let rows: String = (0..40).map(|i| row(1e9 * f64::from(i) / 39.0)).collect();
    let text = format!("r [cm],rho [g/cm3],v_r [cm/s],ener [J/kg]\n{rows}");
    std::fs::write(folder.path().join("star.csv"), text).unwrap();
    let (file, report) = run(folder.path(), ("star.csv", "rho"), "output: {units: cgs}\n");
    let u = file.species[0].table.column(columns::INTERNAL_ENERGY).unwrap_or_else(|| panic!("{}", report.text()));
    assert!((0..u.values.len()).all(|i| (u.values.get(i) / 3e11 - 1.0).abs() < 1e-3), "{:?}", u.values.range());
}

#[test]
fn an_energy_that_cannot_be_reduced_is_said_to_be_so() {
    let velocity: &Variables<'_> = &VELOCITY;
    for (variables, parts) in [
        (
            vec![("rho", density as Field), ("ener", total)],
            ["'ener' is internal and kinetic", "there is no velocity", "--map ener=none"],
        ),
        (
            [
                &[("rho", density as Field), ("ener", pressure)][..],
                &[("velx", |_| 10.0), ("vely", |_| 0.0), ("velz", |_| 0.0)],
            ]
            .concat(),
            [
                "'ener' is internal and kinetic",
                "it is negative at 210 of 210 positions",
                "map the internal energy, a pressure",
            ],
        ),
        (
            [&[("rho", density as Field), ("Etot", total)][..], &velocity[..2]].concat(),
            ["'Etot' looks like an energy per volume", "no velocity-z", "--map Etot=none"],
        ),
    ] {
        let (file, report) = written(&variables, "");
        assert!(file.species[0].table.column(columns::INTERNAL_ENERGY).is_none(), "{}", variables[1].0);
        let name = variables[1].0;
        let warned = report.warnings.iter().find(|w| w.contains(&format!("'{name}' "))).unwrap();
        parts.iter().for_each(|part| assert!(warned.contains(part), "{part}: {warned}"));
    }
    // What the file has needs no reduction, and a map overrules.
    let both: Vec<(&str, Field)> =
        [&[("rho", density as Field), ("eint", energy), ("ener", total)][..], velocity].concat();
    let (file, report) = written(&both, "");
    check(&file, nodes(), columns::INTERNAL_ENERGY, &[energy], "eint");
    assert!(report.warnings.is_empty() && report.text().contains("not needed: 'eint' is the internal energy"));
    let alone: Vec<(&str, Field)> = [&[("rho", density as Field), ("e", total)][..], velocity].concat();
    let (file, _) = written(&alone, "map: {e: total-energy}");
    check(&file, nodes(), columns::INTERNAL_ENERGY, &[energy], "mapped");
}

#[test]
fn inspect_shows_what_a_run_does() {
    let folder = tempfile::tempdir().unwrap();
    let variables = [&[("dens", density as Field), ("Etot", total_density)][..], &MOMENTUM].concat();
    let container = nodes();
    (container.write)(&folder.path().join(container.file), &grid(container), &variables);
    let mut command = assert_cmd::Command::cargo_bin("sph-prep").unwrap();
    let output = command.arg("inspect").arg(folder.path().join(container.file)).args(["--density", "dens"]).output();
    let text = String::from_utf8(output.unwrap().stdout).unwrap();
    for part in
        ["'mom1' is a momentum, and was divided by the density", "written as Velocities", "written as InternalEnergy"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("warning"), "{text}");
}
