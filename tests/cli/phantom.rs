//! What Phantom's dumps and parameter files say of discs, and of times.

use super::codes::number;
use super::parameters::{place, text};
use super::support::{Folder, command};

/// The records of a Fortran file.
fn records(bytes: &[u8]) -> Vec<&[u8]> {
    let mut records = Vec::new();
    let mut rest = bytes;
    while let Some((length, more)) = rest.split_first_chunk::<4>() {
        let length = u32::from_le_bytes(*length) as usize;
        records.push(&more[..length]);
        rest = &more[length + 4..];
    }
    records
}

/// The numbers of one kind in the header of a dump, by their names, which begin with `first`.
fn numbers_of_dump(bytes: &[u8], first: &str) -> Vec<(String, f64)> {
    let records = records(bytes);
    let at = records.iter().position(|r| r.starts_with(format!("{first:<16}").as_bytes())).unwrap();
    let names = records[at].chunks(16).map(|name| String::from_utf8(name.to_vec()).unwrap().trim().to_owned());
    names.zip(records[at + 1].chunks(8).map(|v| f64::from_le_bytes(v.try_into().unwrap()))).collect()
}

/// A number of the default kind in the header of a dump, of 4 bytes each.
fn integer_of_dump(bytes: &[u8], name: &str) -> Option<f64> {
    let records = records(bytes);
    let at = records.iter().position(|r| r.starts_with(b"nparttot        "))?;
    let place = records[at].chunks(16).position(|tag| tag == format!("{name:<16}").as_bytes())?;
    let number = records[at + 1].chunks(4).nth(place)?;
    Some(f64::from(i32::from_le_bytes(number.try_into().unwrap())))
}

/// A disc about one star keeps the temperature of the distance from it, in dump, parameter file and build; one whose temperature is no power of
/// the radius is adiabatic.
#[test]
fn phantom_keeps_the_temperatures_of_a_disc() {
    let folder = Folder::new();
    let disc = |ratio: &str, gamma: &str| {
        format!(
            "bodies:\n- {{point_mass: 1 Msun, accretion_radius: 0.1 au}}\n- input: {{profile: {{disc: {{mass: 1e-3 Msun, inner_radius: 1 au, outer_radius: 5 au, aspect_ratio: {ratio}, \
             self_gravity: false}}}}}}\nparticles: 900\npolish: none\nwvt: {{iterations: 0}}\noutput: {{units: solar}}\nthermal: {{gamma: {gamma}}}\n"
        )
    };
    for gamma in ["1.4", "1.6666666666666667"] {
        place(&folder, &disc("0.06*(R/au)^0.25", gamma), ("phantom", "ic_00000.tmp"), &[]);
        let options = text(&folder, "ic.in");
        assert!(options.contains("SETUP=empty ISOTHERMAL=yes\n"), "{options}");
        assert!(number(&options, "ieos =") == 6.0 && !options.contains("tree_accuracy"), "{options}");
        let bytes = std::fs::read(folder.path("out/ic_00000.tmp")).unwrap();
        let header = numbers_of_dump(&bytes, "time");
        let of = |name: &str| header.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no '{name}'")).1;
        assert_eq!(of("gamma"), 1.0);
        // c = 0.06 v_Kepler (R/au)^0.25, so that c^2 falls as R^-0.5. With G = 1 and lengths of the Sun's radius.
        let au: f64 = 1.495_978_707e11 / 6.957e8;
        assert!((of("qfacdisc") / 0.25 - 1.0).abs() < 5e-3, "{}", of("qfacdisc"));
        let expected = 0.06_f64.powi(2) / au * au.powf(2.0 * of("qfacdisc"));
        assert!((of("RK2") / (1.5 * expected) - 1.0).abs() < 5e-3, "{} for {}", of("RK2") / 1.5, expected);
        // Read back, the gas has its pressure.
        let outcome = command()
            .args(["check", &folder.path("out/ic_00000.tmp").display().to_string(), "--for", "phantom"])
            .output()
            .unwrap();
        assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stdout));
    }
    place(&folder, &disc("0.06 + 0.01*R/au", "1.4"), ("phantom", "ic_00000.tmp"), &[]);
    assert_eq!(number(&text(&folder, "ic.in"), "ieos ="), 2.0);
    let bytes = std::fs::read(folder.path("out/ic_00000.tmp")).unwrap();
    assert!(numbers_of_dump(&bytes, "time").contains(&("gamma".into(), 1.4)));
}

/// A disc with its own gravity needs a build with gravity, one that feels its star alone needs one without; and far companions are no reason to let the disc
/// warm up, but gas of another kind is.
#[test]
fn phantom_keeps_the_temperatures_of_a_disc_beside_a_companion() {
    let folder = Folder::new();
    let scene = |own: bool, first: &str, last: &str| {
        format!(
            "bodies:\n{first}- {{name: star, point_mass: 1 Msun, accretion_radius: 0.1 au, position: [3 au, 0, 0], velocity: [0, 1 km/s, 0]}}\n\
             - {{name: disc, position: [3 au, 0, 0], velocity: [0, 1 km/s, 0], input: {{profile: {{disc: {{mass: 1e-3 Msun, inner_radius: 1 au, outer_radius: 5 au, \
             aspect_ratio: '0.06*(R/au)^0.25', self_gravity: {own}}}}}}}}}\n{last}particles: 900\npolish: none\nwvt: {{iterations: 0}}\noutput: {{units: solar}}\n"
        )
    };
    let companion = "- {name: companion, point_mass: 0.3 Msun, accretion_radius: 0.1 au, position: [0, 80 au, 0]}\n";
    let gas = "- {name: giant, input: {profile: {polytrope: {n: 1.5, mass: 1e-3 Msun, radius: 1 au}}}, position: [0, 80 au, 0]}\n";
    let told = "computes this file's gas as adiabatic";
    for (own, first, last, build, sink) in [
        (true, "", "", "SETUP=empty GRAVITY=yes ISOTHERMAL=yes", Some(1.0)),
        (false, "", companion, "SETUP=empty ISOTHERMAL=yes", Some(1.0)),
        (true, companion, "", "SETUP=empty GRAVITY=yes ISOTHERMAL=yes", Some(2.0)),
        (false, "", gas, "SETUP=star", None),
    ] {
        let report = place(&folder, &scene(own, first, last), ("phantom", "ic_00000.tmp"), &[]).stdout;
        let options = text(&folder, "ic.in");
        assert!(options.contains(&format!("built by make {build}\n")), "{build}: {options}");
        assert_eq!(number(&options, "ieos ="), if sink.is_some() { 6.0 } else { 2.0 }, "{build}");
        assert_eq!((report.contains(told), options.contains(told)), (sink.is_none(), sink.is_none()), "{report}");
        let bytes = std::fs::read(folder.path("out/ic_00000.tmp")).unwrap();
        assert_eq!(integer_of_dump(&bytes, "isink"), sink, "{build}");
    }
}

/// Phantom's own unit of time is that in which G is 1, whatever the file's: both ends are as many dynamical times away.
#[test]
fn phantom_ends_in_its_own_time() {
    let folder = Folder::new();
    let star = |units: &str| {
        format!(
            "input: {{profile: {{polytrope: {{n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}}}}\nparticles: 300\noutput: {{units: {units}}}\n"
        )
    };
    // Masses and lengths of the Sun, in Phantom's G: times of sqrt(R^3/(G M)), of which ten are ten but for what 300 particles leave of the surface.
    place(&folder, &star("solar"), ("phantom", "ic_00000.tmp"), &[]);
    let own = number(&text(&folder, "ic.in"), "tmax =");
    assert!((6.0..10.0).contains(&own), "{own}");
    // In kilograms and meters the time in which G is 1 is 122 400 s, in kpc, 1e10 Msun and km/s it is 4.71e6 years in place of 978e6.
    for (units, mass, length) in [("si", 1.98841e30, 6.957e8), ("galactic", 1e-10, 6.957e10 / 3.085_677_581e21)] {
        place(&folder, &star(units), ("phantom", "ic_00000.tmp"), &[]);
        let there = number(&text(&folder, "ic.in"), "tmax =") / f64::sqrt(f64::powi(length, 3) / mass);
        assert!((there / own - 1.0).abs() < 1e-3, "{units}: {there} for {own}");
    }
}
