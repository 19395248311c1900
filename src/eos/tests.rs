//! Closed forms, derivatives by differences, inverses, and pressures computed by other codes.

use super::*;

fn solids() -> Vec<EquationOfState> {
    let all = [Tillotson::iron(), Tillotson::granite(), Tillotson::basalt(), Tillotson::water(), Tillotson::ice()];
    all.map(EquationOfState::Tillotson).to_vec()
}

fn cole() -> EquationOfState {
    let law = Barotropic::Murnaghan { density: 1.0, bulk_modulus: 2.2e10, exponent: 7.0 };
    EquationOfState::Barotropic(law.checked().unwrap())
}

/// Central differences; the error of a step of 1e-5 is some 1e-10 of the second derivative, and 1e-11 of rounding.
#[test]
fn derivatives_are_those_of_the_pressure() {
    for matter in solids().into_iter().chain([cole(), EquationOfState::ideal_gas(1.4, 2.3).unwrap()]) {
        let usual = matter.usual_density();
        for x in [0.3, 0.7, 0.9, 0.97, 1.02, 1.3, 2.0, 4.0] {
            for u in [1e9, 3e10, 6e10, 1.2e11, 3e11] {
                let rho = x * usual;
                let found = matter.response(rho, u);
                let by = |dr: f64, du: f64| matter.pressure(rho * (1.0 + dr), u * (1.0 + du));
                let h = 1e-5;
                let by_density = (by(h, 0.0) - by(-h, 0.0)) / (2.0 * h * rho);
                let by_energy = (by(0.0, h) - by(0.0, -h)) / (2.0 * h * u);
                let scale = found.pressure.max(1e9);
                let close = |a: f64, b: f64, unit: f64| (a - b).abs() * unit < 2e-6 * scale.max((b * unit).abs());
                assert!(close(by_density, found.by_density, rho), "{matter:?} at {x}, {u:e}: {by_density:e} {found:?}");
                assert!(close(by_energy, found.by_energy, u), "{matter:?} at {x}, {u:e}: {by_energy:e} {found:?}");
            }
        }
    }
}

#[test]
fn inverses_lead_back() {
    for matter in solids().into_iter().chain([EquationOfState::ideal_gas(1.4, 2.3).unwrap()]) {
        for pressure in [1e8, 1e10, 1e12, 3e12] {
            for warmth in [Warmth::Energy(2e10), Warmth::Temperature(1000.0), Warmth::Energy(2e11)] {
                let rho = matter.density(pressure, warmth).unwrap();
                let u = matter.energy_with(rho, warmth);
                let error = matter.pressure(rho, u) / pressure - 1.0;
                assert!(error.abs() < 1e-9, "{} at {pressure:e} {warmth}: {error:e}", matter.name());
                if u >= matter.cold_energy(rho) {
                    let back = matter.energy(rho, pressure).unwrap();
                    let error = matter.pressure(rho, back) / pressure - 1.0;
                    assert!(error.abs() < 1e-9, "{}: {back:e} for {u:e}", matter.name());
                }
            }
        }
        let rho = 1.3 * matter.usual_density();
        let t = matter.temperature(rho, matter.energy_at(rho, 1234.0)).unwrap();
        assert!((t / 1234.0 - 1.0).abs() < 1e-9, "{}: {t}", matter.name());
    }
}

/// Along an adiabat dP/drho is the square of the sound speed, and du/drho is P/rho^2.
#[test]
fn adiabats_and_sound_speeds_agree() {
    for matter in solids().into_iter().chain([cole(), EquationOfState::ideal_gas(1.4, 2.3).unwrap()]) {
        let rho = 1.4 * matter.usual_density();
        let u = matter.cold_energy(rho) + 1e10;
        let c = matter.sound_speed(rho, u);
        let at = |x: f64| matter.pressure(rho * x, matter.adiabat([rho, u], rho * x));
        let h = 1e-4;
        let slope = (at(1.0 + h) - at(1.0 - h)) / (2.0 * h * rho);
        assert!((slope / (c * c) - 1.0).abs() < 1e-6, "{}: {slope:e} {:e}", matter.name(), c * c);
        let there = matter.adiabat([rho, u], 2.0 * rho);
        let back = matter.adiabat([2.0 * rho, there], rho);
        assert!((back / u - 1.0).abs() < 1e-6, "{}: {back:e} {u:e}", matter.name());
    }
}

/// The cold curve is the adiabat from rho_0 without heat.
#[test]
fn cold_energies_are_those_of_compression() {
    for matter in solids() {
        for x in [1.01, 1.5, 3.0, 10.0] {
            let rho = x * matter.usual_density();
            let (cold, along) = (matter.cold_energy(rho), matter.adiabat([matter.usual_density(), 0.0], rho));
            assert!((cold / along - 1.0).abs() < 1e-5, "{} at {x}: {cold:e} {along:e}", matter.name());
        }
        assert_eq!(matter.cold_energy(0.5 * matter.usual_density()), 0.0);
    }
}

#[test]
fn barotropic_laws_have_their_closed_forms() {
    let law = |l: Barotropic| EquationOfState::Barotropic(l.checked().unwrap());
    let polytrope = law(Barotropic::Polytrope { constant: 3.0, gamma: 2.0 });
    assert_eq!((polytrope.pressure(5.0, 0.0), polytrope.cold_energy(5.0)), (75.0, 15.0));
    assert!((law(Barotropic::Isothermal { sound_speed: 3.0 }).pressure(5.0, 7.0) - 45.0).abs() < 1e-12);
    assert!((cole().sound_speed(1.0 + 1e-9, 0.0) / 2.2e10_f64.sqrt() - 1.0).abs() < 1e-6);
    assert!((cole().pressure(1.01, 0.0) / (2.2e10 / 7.0 * (1.01_f64.powi(7) - 1.0)) - 1.0).abs() < 1e-12);
    assert_eq!(cole().pressure(0.9, 1e9), 0.0);
    assert!(matches!(cole().temperature(1.0, 0.0), Err(EosError::NoTemperature { .. })));
    assert!(cole().energy(1.1, 1.0).is_err() && cole().energy(1.1, cole().pressure(1.1, 0.0)).is_ok());
}

#[test]
fn what_has_no_answer_is_told() {
    let granite = EquationOfState::Tillotson(Tillotson::granite());
    let error = granite.energy(4.0, 1e9).unwrap_err();
    assert!(matches!(error, EosError::TooCold { .. }) && error.to_string().contains("Tillotson granite"), "{error}");
    assert!(granite.density(f64::INFINITY, Warmth::Energy(1e9)).is_err());
    assert!(granite.density(f64::NAN, Warmth::Energy(1e9)).is_ok(), "the least pressure");
    assert!(Barotropic::Polytrope { constant: 1.0, gamma: 1.0 }.checked().is_err());
    assert!(EquationOfState::ideal_gas(0.9, 1.0).is_err());
}

/// rho (g/cm^3), u (erg/g), P (dyn/cm^2), T (K) of SI values that WoMa 1.3 computes, which SWIFT's tables are made with.
const OF_WOMA: &[(i32, f64, f64, f64, f64)] = &[
    (100, 4.68, 2e10, 0.0, 4454.343),
    (100, 7.02, 5e10, 3.893063163633e11, 11135.857),
    (100, 7.02, 3e11, 1.590226010023e12, 66815.145),
    (100, 7.41, 1e09, 0.0, 222.717),
    (100, 7.878, 1e10, 1.594117259692e11, 2225.339),
    (100, 11.7, 5e10, 1.906149289100e12, 6802.096),
    (100, 19.5, 3e11, 1.303704545455e13, 31772.620),
    (101, 1.608, 2e10, 3.912742268041e09, 2531.646),
    (101, 2.412, 5e10, 1.572038672944e11, 6329.114),
    (101, 2.412, 3e11, 6.188836079987e11, 37974.684),
    (101, 2.546, 1e09, 0.0, 126.582),
    (101, 2.7068, 1e10, 4.850892484759e10, 1265.393),
    (101, 4.02, 5e10, 4.649341463415e11, 5300.109),
    (101, 6.7, 3e11, 3.690000000000e12, 29282.286),
    (102, 0.5988, 2e10, 5.841769557184e09, 477.783),
    (102, 0.8982, 5e10, 3.349548272467e10, 1194.458),
    (102, 0.8982, 3e11, 1.931951834368e11, 7166.746),
    (102, 0.9481, 1e09, 4.491895013635e07, 23.889),
    (102, 1.00798, 1e10, 8.613350271598e09, 238.862),
    (102, 1.497, 5e10, 1.049420783133e11, 1074.346),
    (102, 2.495, 3e11, 9.213788135593e11, 5908.817),
    (103, 1.62, 2e10, 1.718384840966e08, 2531.646),
    (103, 2.43, 5e10, 2.166650599531e11, 6329.114),
    (103, 2.43, 3e11, 1.305480721862e12, 37974.684),
    (103, 2.565, 1e09, 0.0, 126.582),
    (103, 2.727, 1e10, 5.715452657983e10, 1265.192),
    (103, 4.05, 5e10, 6.038702589144e11, 4764.564),
    (103, 6.75, 3e11, 5.021603802359e12, 23911.995),
];

#[test]
fn pressures_are_those_of_woma() {
    assert!(!OF_WOMA.is_empty());
    for &(id, rho, u, pressure, temperature) in OF_WOMA {
        let matter = Material::of_id(id).unwrap().equation;
        let found = matter.pressure(rho, u);
        assert!((found - pressure).abs() <= 1e-9 * pressure + 1.0, "{id} {rho} {u:e}: {found:e} {pressure:e}");
        // Its cold curve has steps of first order.
        let t = matter.temperature(rho, u).unwrap();
        assert!((t - temperature).abs() <= 2e-3 * temperature + 3.0, "{id} {rho} {u:e}: {t} {temperature}");
    }
}
