//! Planets against WoMa, closed forms and each other.

use super::planet::{Boundary, Layer, Planet};
use super::table::Table;
use crate::eos::{Barotropic, EquationOfState, Material};
use crate::scene::ThermalState;
use std::f64::consts::PI;

/// WoMa's constant of gravity, in cgs.
const GRAVITY: f64 = 6.674_08e-8;

fn layer(id: i32, state: ThermalState, end: Boundary) -> Layer {
    Layer { material: Material::of_id(id).unwrap(), state, end }
}

/// Iron to 3200 km and granite to 6400 km, 10 kbar and 1000 K at the surface.
fn iron_and_granite(state: ThermalState) -> Planet {
    Planet {
        layers: vec![layer(100, state, Boundary::Radius(3.2e8)), layer(101, state, Boundary::Unknown)],
        mass: None,
        radius: Some(6.4e8),
        surface_pressure: 1e10,
        surface_temperature: 1000.0,
        gravity: GRAVITY,
    }
}

/// 4 pi int rho r^2 dr, exact for densities linear in r between rows.
fn mass(table: &Table) -> f64 {
    let shell = |i: usize| {
        let (a, b) = (table.radii[i], table.radii[i + 1]);
        let (p, q) = (table.density[i], table.density[i + 1]);
        let middle = 0.5 * (a + b);
        4.0 * PI * (b - a) / 6.0 * (p * a * a + 2.0 * (p + q) * middle * middle + q * b * b)
    };
    (0..table.radii.len() - 1).map(shell).sum()
}

/// M (g), and density and pressure at 1600 and 4800 km, of WoMa with 10 000 and 20 000 steps, whose error is of first order, extrapolated.
#[test]
fn planets_are_those_of_woma() {
    for (state, expected) in [
        (ThermalState::Isothermal, [6.512_882e27, 15.352_943, 4.207_033_4e12, 5.426_775, 7.563_033e11]),
        (ThermalState::Power(0.5), [6.352_770e27, 15.069_913, 4.026_826_4e12, 5.273_094, 7.184_320_3e11]),
    ] {
        let table = iron_and_granite(state).table().unwrap();
        let (pressure, near) = (table.pressure.as_ref().unwrap(), |r: f64| {
            table.radii.iter().position(|own| (own / r - 1.0).abs() < 1e-9).unwrap()
        });
        let (core, mantle) = (near(1.6e8), near(4.8e8));
        let found = [mass(&table), table.density[core], pressure[core], table.density[mantle], pressure[mantle]];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-4, "{state:?}: {found:e}, WoMa {expected:e}");
        }
        let ids = table.material.as_ref().unwrap();
        let core = table.radii.iter().zip(ids).filter(|(_, id)| **id == 100.0).map(|(r, _)| *r).fold(0.0, f64::max);
        assert_eq!((core, table.radii[table.radii.len() - 1]), (3.2e8, 6.4e8));
        assert_eq!(table.radii.iter().filter(|r| **r == 3.2e8).count(), 2, "a jump in density");
    }
}

/// rho = rho_c sin x / x with x = r sqrt(2 pi G / K), and P = K rho^2: cut where x = 2.
#[test]
fn a_polytrope_of_index_1_is_its_closed_form() {
    let (constant, center) = (2e11, 8.0);
    let scale = (constant / (2.0 * PI * GRAVITY)).sqrt();
    let density = |r: f64| if r > 0.0 { center * (r / scale).sin() / (r / scale) } else { center };
    let outer = 2.0 * scale;
    let law = Barotropic::Polytrope { constant, gamma: 2.0 }.checked().unwrap();
    let material = Material { id: None, equation: EquationOfState::Barotropic(law) };
    let planet = Planet {
        layers: vec![Layer { material, state: ThermalState::Adiabatic, end: Boundary::Unknown }],
        mass: None,
        radius: Some(outer),
        surface_pressure: constant * density(outer).powi(2),
        surface_temperature: 0.0,
        gravity: GRAVITY,
    };
    let table = planet.table().unwrap();
    let energies = table.internal_energy.as_ref().unwrap();
    for (i, (r, rho)) in table.radii.iter().zip(&table.density).enumerate() {
        // Within the innermost step the density is taken as constant.
        assert!((rho / density(*r) - 1.0).abs() < 1e-7, "{r:e}: {rho} {}", density(*r));
        // u = K rho^(gamma - 1) / (gamma - 1).
        assert!((energies[i] / (constant * rho) - 1.0).abs() < 1e-12, "{r:e}: {}", energies[i]);
    }
    let x: f64 = 2.0;
    let expected = 4.0 * PI * center * scale.powi(3) * (x.sin() - x * x.cos());
    assert!((mass(&table) / expected - 1.0).abs() < 1e-5, "{}", mass(&table) / expected);
    assert!(table.temperature.is_none() && table.material.is_none());
}

/// The energy of a cold planet is the work of its compression: du = P/rho^2 drho from node to node, whatever its thermal state is said to be.
#[test]
fn the_energy_of_a_barotropic_planet_is_that_of_its_compression() {
    let law = Barotropic::Murnaghan { density: 5.0, bulk_modulus: 1e12, exponent: 4.0 }.checked().unwrap();
    for state in [ThermalState::Adiabatic, ThermalState::Isothermal] {
        let material = Material { id: None, equation: EquationOfState::Barotropic(law) };
        let planet = Planet {
            layers: vec![Layer { material, state, end: Boundary::Unknown }],
            mass: None,
            radius: Some(6.4e8),
            surface_pressure: 0.0,
            surface_temperature: 0.0,
            gravity: GRAVITY,
        };
        let table = planet.table().unwrap();
        let (rho, u, p) = (&table.density, table.internal_energy.as_ref().unwrap(), table.pressure.as_ref().unwrap());
        // By the trapezoidal rule in 1/rho.
        let work = |i: usize| 0.5 * (p[i] + p[i + 1]) * (1.0 / rho[i + 1] - 1.0 / rho[i]);
        let all: f64 = (0..rho.len() - 1).map(work).sum();
        assert!(u[rho.len() - 1] == 0.0 && (u[0] / all - 1.0).abs() < 1e-4, "{} {all}", u[0]);
        assert!(u.windows(2).all(|pair| pair[0] > pair[1]));
    }
}

/// A gas goes on to no pressure at any radius.
#[test]
fn a_planet_of_gas_alone_asks_for_its_surface_pressure() {
    let law = Barotropic::Polytrope { constant: 2e11, gamma: 2.0 }.checked().unwrap();
    let material = Material { id: None, equation: EquationOfState::Barotropic(law) };
    let planet = Planet {
        layers: vec![Layer { material, state: ThermalState::Adiabatic, end: Boundary::Unknown }],
        mass: None,
        radius: Some(1e9),
        surface_pressure: 0.0,
        surface_temperature: 0.0,
        gravity: GRAVITY,
    };
    let error = planet.table().err().unwrap().to_string();
    assert!(error.contains("surface_pressure: is 0") && error.contains("state the pressure"), "{error}");
}

/// Cold water without a pressure is a vapor, of which no radius is full.
#[test]
fn a_planet_that_no_radius_holds_asks_for_a_surface_pressure() {
    let planet = |surface_pressure: f64| Planet {
        layers: vec![
            layer(100, ThermalState::Adiabatic, Boundary::Fraction(0.3)),
            layer(103, ThermalState::Adiabatic, Boundary::Fraction(0.9)),
            layer(102, ThermalState::Adiabatic, Boundary::Unknown),
        ],
        mass: Some(6e27),
        radius: None,
        surface_pressure,
        surface_temperature: 250.0,
        gravity: GRAVITY,
    };
    let error = planet(0.0).table().err().unwrap().to_string();
    for part in ["no radius holds its mass", "Tillotson", "250 K", "surface_pressure, such as 1 bar"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert!(planet(1e6).table().is_ok());
}

/// Each of mass, radius and boundary follows from the other two.
#[test]
fn what_is_left_open_follows_from_the_rest() {
    let whole = iron_and_granite(ThermalState::Adiabatic);
    let table = whole.table().unwrap();
    let total = mass(&table);
    let by_mass = Planet { mass: Some(total), radius: None, ..whole.clone() };
    let found = by_mass.table().unwrap();
    assert!((found.radii[found.radii.len() - 1] / 6.4e8 - 1.0).abs() < 1e-6);
    let mut open = Planet { mass: Some(total), ..whole.clone() };
    open.layers[0].end = Boundary::Unknown;
    let found = open.table().unwrap();
    let core = found.radii.windows(2).find(|w| w[0] == w[1]).unwrap()[0];
    assert!((core / 3.2e8 - 1.0).abs() < 1e-5, "{core:e}");
    // By the mass of the core, and by its share.
    let inner = found.radii.iter().position(|r| *r == core).unwrap();
    let cut = |t: &Table| Table {
        radii: t.radii[..=inner].to_vec(),
        density: t.density[..=inner].to_vec(),
        ..Table::default()
    };
    let of_core = mass(&cut(&found));
    // A surface without pressure is where the material begins to part.
    for state in [ThermalState::Adiabatic, ThermalState::Isothermal] {
        let bare = Planet { surface_pressure: 0.0, ..iron_and_granite(state) }.table().unwrap();
        let surface = bare.density[bare.density.len() - 1];
        let pressed = mass(&iron_and_granite(state).table().unwrap());
        assert!((mass(&bare) / pressed - 1.0).abs() < 0.02 && (2.0..2.68).contains(&surface), "{surface}");
        assert_eq!(bare.pressure.unwrap().last(), Some(&0.0));
    }
    for end in [Boundary::Mass(of_core), Boundary::Fraction(of_core / total)] {
        let mut planet = Planet { mass: Some(total), radius: None, ..whole.clone() };
        planet.layers[0].end = end;
        let found = planet.table().unwrap();
        let core = found.radii.windows(2).find(|w| w[0] == w[1]).unwrap()[0];
        assert!((core / 3.2e8 - 1.0).abs() < 1e-5, "{end:?}: {core:e}");
    }
}

/// du = P/rho^2 drho from row to row, and T continuous between the layers.
#[test]
fn adiabatic_layers_exchange_no_heat() {
    let table = iron_and_granite(ThermalState::Adiabatic).table().unwrap();
    let (u, t) = (table.internal_energy.unwrap(), table.temperature.unwrap());
    let ids = table.material.unwrap();
    let jump = table.radii.windows(2).position(|w| w[0] == w[1]).unwrap();
    assert!((t[jump] / t[jump + 1] - 1.0).abs() < 1e-9 && (u[jump] - u[jump + 1]).abs() > 1e9);
    for range in [1..jump, jump + 1..u.len() - 1] {
        let equation = Material::of_id(ids[range.start] as i32).unwrap().equation;
        let (first, last) = (range.start, range.end);
        let along = equation.adiabat([table.density[first], u[first]], table.density[last]);
        assert!((along - u[last]).abs() < 1e-6 * u[first], "{along:e} {:e}", u[last]);
    }
    assert!(t[1] > 1.2 * t[u.len() - 1], "it is hotter inside: {} {}", t[1], t[u.len() - 1]);
}

#[test]
fn what_makes_no_planet_is_refused() {
    let good = iron_and_granite(ThermalState::Isothermal);
    let mut open = good.clone();
    open.layers[0].end = Boundary::Unknown;
    let mut outside = good.clone();
    outside.layers[0].end = Boundary::Radius(7e8);
    for (planet, part) in [
        (Planet { layers: Vec::new(), ..good.clone() }, "no layers"),
        (Planet { mass: Some(6e27), ..good.clone() }, "leaves 0"),
        (open, "leaves 2"),
        (outside, "reaches beyond"),
        (Planet { radius: None, mass: Some(1e26), ..good.clone() }, "planet"),
        (Planet { radius: None, mass: Some(1e300), ..good.clone() }, "no "),
    ] {
        let error = planet.table().err().unwrap().to_string();
        assert!(error.contains(part), "{error}");
    }
    let mut small = Planet { mass: Some(6e27), radius: Some(1e8), ..good };
    small.layers[0].end = Boundary::Unknown;
    let error = small.table().err().unwrap().to_string();
    assert!(error.contains("planet.radius") && error.contains("expected"), "{error}");
}

/// Water of Tillotson at 300 K boils without a pressure about it: what the steps of the integration make of that is not the stated mass.
#[test]
fn vapors_are_told_and_refused_where_the_rows_miss_their_mass() {
    let layers = vec![
        layer(101, ThermalState::Adiabatic, Boundary::Fraction(0.95)),
        layer(102, ThermalState::Adiabatic, Boundary::Unknown),
    ];
    let boiling = Planet {
        layers,
        mass: Some(5.97e27),
        radius: None,
        surface_pressure: 0.0,
        surface_temperature: 300.0,
        ..iron_and_granite(ThermalState::Adiabatic)
    };
    let error = boiling.table().err().unwrap().to_string();
    assert!(error.contains("times the mass") && error.contains("layers[1] is a vapor at its top"), "{error}");
    let frozen = Planet { surface_temperature: 90.0, ..boiling };
    let table = frozen.table().unwrap();
    assert!(table.notes.is_empty() && table.misses(5.97e27).is_none(), "{:?}", table.notes);
}
