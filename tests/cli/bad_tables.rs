//! Text inputs that are wrong: tables, MESA profiles, GYRE models.

use super::support::{bad, refuse_all};

#[test]
fn tables_are_refused_by_line_and_column() {
    let far = "# r density\n".to_owned() + &"0 1\n".repeat(3);
    let utf_16: Vec<u8> = "\u{feff}# r density\n0 2\n1 1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    refuse_all(&[
        bad("absent.txt", "# r density\n0 2\n1 1\n", &["--density", "rho_gas"], &["'rho_gas'", "density"]),
        bad("nan.txt", "# r density\n0 2\n0.5 nan\n1 1\n", &[], &["density"]),
        bad("infinite.txt", "# r density\n0 2\n0.5 inf\n1 1\n", &[], &["density"]),
        bad("negative.txt", "# r density\n0 2\n0.5 -1\n1 1\n", &[], &["density", "-1"]),
        bad("negative_radius.txt", "# r density\n-1 2\n0.5 1\n1 1\n", &[], &["r", "-1"]),
        bad("turning.txt", "# r density\n0 2\n0.5 1\n0.4 1\n1 1\n", &[], &["line 4", "radius"]),
        bad("repeated.txt", far, &[], &["line 2", "radii"]),
        bad("zero.txt", "# r density\n0 0\n0.5 0\n1 0\n", &[], &["density"]),
        bad("short_row.txt", "# r density\n0 2\n0.5\n1 1\n", &[], &["line 3"]),
        bad("cut.txt", "# r density\n0 2\n0.5 1\n1", &[], &["line 4"]),
        bad("word.txt", "# r density\n0 2\n0.5 one\n1 1\n", &[], &["line 3", "one"]),
        bad("one_row.txt", "# r density\n0 2\n", &[], &[]),
        bad("no_header.txt", "0 2\n1 1\n", &[], &["names"]),
        bad("no_radius.txt", "# depth density\n0 2\n1 1\n", &[], &["radius", "depth"]),
        bad("no_density.txt", "# r Q T\n0 2 1\n1 1 1\n", &[], &["density", "--density"]),
        bad("german.csv", "r;rho\n0,0;1,0e+00\n1,5;0,5\n", &[], &["line 2", "decimal commas", "'0,0'"]),
        bad("commas.txt", "r rho\n0,01 0,99\n1 0,5\n", &[], &["line 2", "decimal commas"]),
        bad("behind.txt", "r rho\n0.0 1.0 # center\n1 0.5\n", &[], &["line 2", "comment behind"]),
        bad("empty.txt", "", &[], &["empty"]),
        bad("blank.txt", "\n\n\n", &[], &[]),
        bad("binary.txt", [0u8, 255, 1, 254].repeat(64), &["--format", "table"], &["table"]),
        bad("utf_16.txt", utf_16, &[], &["UTF-16", "save it"]),
        bad("prose.txt", "There is nothing here.\n", &[], &[]),
    ]);
}

/// A MESA profile with these rows of zone, mass, logR, logRho.
fn mesa(rows: &str) -> String {
    format!("1 2\nversion_number star_mass\n7503 1.0\n\n1 2 3 4\nzone mass logR logRho\n{rows}")
}

#[test]
fn mesa_profiles_are_refused_by_line_and_column() {
    let good = "1 1.0 0.0 -1.0\n2 0.5 -0.3 0.5\n3 0.1 -0.7 1.0\n";
    refuse_all(&[
        bad("absent.data", mesa(good), &["--density", "rho_gas"], &["'rho_gas'", "density"]),
        bad("nan.data", mesa("1 1.0 0.0 -1.0\n2 0.5 -0.3 NaN\n3 0.1 -0.7 1.0\n"), &[], &["density"]),
        bad("overflow.data", mesa("1 1.0 0.0 -1.0\n2 0.5 -0.3 999\n3 0.1 -0.7 1.0\n"), &[], &["density"]),
        bad("turning.data", mesa("1 1.0 0.0 -1.0\n2 0.5 -0.3 0.5\n3 0.1 -0.2 1.0\n"), &[], &["radius"]),
        bad("mass_grows.data", mesa("1 1.0 0.0 -1.0\n2 1.5 -0.3 0.5\n3 0.1 -0.7 1.0\n"), &[], &["mass"]),
        bad("cut.data", mesa("1 1.0 0.0 -1.0\n2 0.5 -0.3 0.5\n3 0.1 -0."), &[], &[]),
        bad("short_row.data", mesa("1 1.0 0.0 -1.0\n2 0.5 -0.3\n3 0.1 -0.7 1.0\n"), &[], &["line 8"]),
        bad("no_rows.data", mesa(""), &[], &[]),
        bad("head.data", "1 2\nversion_number star_mass\n7503 1.0\n", &["--format", "mesa"], &["mesa"]),
        bad("other.data", "# r density\n0 2\n1 1\n", &["--format", "mesa"], &["mesa", "line 1"]),
        bad("empty.data", "", &["--format", "mesa"], &["empty"]),
    ]);
}

/// A GYRE model without a version: 19 columns, index, radius, mass ratio, and so on.
fn gyre(points: &str, rows: &[(f64, f64)]) -> String {
    let mut text = format!("{points} 2e33 7e10 4e33 100\n");
    for (i, (radius, density)) in rows.iter().enumerate() {
        text += &format!("{} {radius:e} 1e33 1e33 1e16 1e6 {density:e} 0.3 1e-6 1.6 0.4 1 1 0 0 0 0 0 0\n", i + 1);
    }
    text
}

#[test]
fn gyre_models_are_refused_by_line_and_column() {
    let good = [(0.0, 100.0), (3e10, 10.0), (7e10, 0.1)];
    let mut cut = gyre("3", &good);
    cut.truncate(cut.len() - 9);
    refuse_all(&[
        bad("absent.gyre", gyre("3", &good), &["--density", "rho_gas"], &["'rho_gas'", "density"]),
        bad("nan.gyre", gyre("3", &[(0.0, 100.0), (3e10, f64::NAN), (7e10, 0.1)]), &[], &["density"]),
        bad("negative.gyre", gyre("3", &[(0.0, 100.0), (3e10, -10.0), (7e10, 0.1)]), &[], &["density", "-1"]),
        bad("turning.gyre", gyre("3", &[(0.0, 100.0), (8e10, 10.0), (7e10, 0.1)]), &[], &["line 4", "radius"]),
        bad("too_many.gyre", gyre("2", &good), &[], &["line 4"]),
        bad("too_few.gyre", gyre("4", &good), &[], &["4", "truncated"]),
        bad("absurd.gyre", gyre("999999999999999999", &good), &[], &["truncated"]),
        bad("cut.gyre", cut, &[], &["line 4"]),
        bad("other.gyre", "# r density\n0 2\n1 1\n", &["--format", "gyre"], &["gyre", "line 1"]),
        bad("version.gyre", "3 2e33 7e10 4e33 999\n", &["--format", "gyre"], &["999", "version"]),
        bad("empty.gyre", "", &["--format", "gyre"], &["empty"]),
    ]);
}
