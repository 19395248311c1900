//! The comparison of setup methods of Diehl et al. 2015 (PASA 32, e048, sec. 6.1 and 6.2, Figs. 10 and 11): the
//! summed density on a plane, the noise of the pressure force and the directions of neighbors, for every method.
//!
//! `cargo test --release --test panel -- --ignored --nocapture` prints the tables with 8000 particles; with
//! SPH_PREP_RESULTS=profiles/results it writes methods.md and the panels as SVG there. `cargo test --test panel` checks
//! the ranking with 1728 particles.

mod draw;
mod setups;

use setups::{Measure, SETUPS, Sphere, Uniform, measure};
use std::fmt::Write;

const HEAD: &str =
    "| method | max % | rms % | noise, of random % | Q4 | Q6 | random Q |\n|---|---|---|---|---|---|---|\n";

fn rows(found: &[(&'static str, Result<Measure, String>)]) -> String {
    let mut out = String::from(HEAD);
    for (name, measured) in found {
        match measured {
            Ok(m) => writeln!(
                out,
                "| {name} | {:.3} | {:.3} | {:.2} | {:.3} | {:.3} | {:.3} |",
                100.0 * m.max,
                100.0 * m.rms,
                100.0 * m.noise,
                m.order.q4,
                m.order.q6,
                m.order.random
            ),
            Err(why) => writeln!(out, "| {name} | refused: {why} | | | | | |"),
        }
        .unwrap();
    }
    out
}

/// Lattices: no noise, and directions.
const LATTICES: [&str; 3] = ["cubic", "cubic-close-packed", "hexagonal-close-packed"];

#[test]
fn lattices_have_directions_glasses_have_none_and_ours_is_best() {
    let found: Vec<_> = SETUPS.iter().map(|s| (s.name, measure(s, &Uniform, 1728))).collect();
    println!("{}", rows(&found));
    let of = |name: &str| found.iter().find(|(n, _)| *n == name).and_then(|(_, m)| m.as_ref().ok()).unwrap();
    for lattice in LATTICES {
        let m = of(lattice);
        // 1728 is 12^3: the simple cubic lattice fits, the others leave sites empty.
        assert!(m.order.largest() > 0.3, "{lattice}: {:?}", m.order);
    }
    assert!(of("cubic").noise < 1e-4, "{}", of("cubic").noise);
    for irregular in ["random", "glass", "WVT", "ours"] {
        let order = of(irregular).order;
        assert!(order.largest() < 8.0 * order.random, "{irregular}: {order:?}");
    }
    let ours = of("ours");
    for (name, m) in found.iter().filter(|(name, _)| !LATTICES.contains(name) && !name.starts_with("ours")) {
        if let Ok(m) = m {
            assert!(ours.rms < m.rms && ours.noise < 1.5 * m.noise, "{name}: {} {}", m.rms, m.noise);
        }
    }
}

#[test]
#[ignore = "long: 8000 particles by every method"]
fn the_papers_comparison() {
    let mut page = String::from(
        "# Setup methods compared\n\nMade by `SPH_PREP_RESULTS=profiles/results cargo test --release --test panel -- --ignored --nocapture`.\n\
         8000 particles. Deviation of the summed density on a plane (cubic spline, 128 neighbors, masses as given; over the\n\
         interior of the sphere); root mean square of the force of a constant pressure over that of random points (64\n\
         neighbors); bond-orientational order, which for directions that are all alike is `random Q`.\n",
    );
    for (title, file, found) in [
        ("Uniform cube (Fig. 10)", "methods-uniform.svg", SETUPS.map(|s| (s.name, measure(&s, &Uniform, 8000)))),
        (
            "Sphere with spacing r^(2/3) (Fig. 11)",
            "methods-sphere.svg",
            SETUPS.map(|s| (s.name, measure(&s, &Sphere, 8000))),
        ),
    ] {
        write!(page, "\n## {title}\n\n![panel]({file})\n\n{}", rows(&found)).unwrap();
        if let Some(folder) = std::env::var_os("SPH_PREP_RESULTS") {
            let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(folder.join(file), draw::panel(&found)).unwrap();
            std::fs::write(folder.join("methods.md"), &page).unwrap();
        }
    }
    println!("{page}");
}
