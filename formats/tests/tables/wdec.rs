//! Models of the White Dwarf Evolution Code.

use super::*;

/// Points of a small model: not a multiple of four, so that the last line of an array is short.
const POINTS: usize = 402;

/// Array `i` (from 1) at a fraction of the radius.
fn value(i: usize, x: f64) -> f64 {
    match i {
        1 => x * STAR_RADIUS,
        2 => enclosed(x),
        4 => 1e7 * (1.1 - x),
        5 => sinc(x),
        6 => 1e22 * sinc(x).powi(2),
        7 => 0.0,
        17 => 0.25,
        _ => -(i as f64),
    }
}

/// A polytrope of index 1 from near the center, which is missing, to the surface.
fn model() -> String {
    let mut text = format!("  41  4.8722E+08 23.247\n  {POINTS}  =   100  +   {}  6.310E-05\n", POINTS - 100);
    for array in 1..=20 {
        let all: Vec<f64> = (1..=POINTS).map(|i| value(array, i as f64 / POINTS as f64)).collect();
        let line = |four: &[f64]| four.iter().map(|v| fortran(*v, 22, 15, 2)).collect::<String>() + "\n";
        all.chunks(4).for_each(|four| text += &line(four));
    }
    text
}

#[test]
fn a_polytrope_comes_back() {
    let field = read_text("wdec", model().as_bytes(), &FieldRequest::default()).unwrap();
    assert_eq!((field.density.as_deref(), radii(&field).len()), (Some("density"), POINTS));
    let (rho, m) = (values(&field, "density"), values(&field, "enclosed_mass"));
    for i in 0..POINTS - 1 {
        let x = (i + 1) as f64 / POINTS as f64;
        // Sixteen digits.
        close(radii(&field)[i], x * STAR_RADIUS, 1e-15);
        close(rho[i], sinc(x), 1e-15);
        close(m[i], enclosed(x), 1e-15);
    }
    // Straight lines over r^3 miss a part of (1/402)^2 of the order of 1; the ball within the first point is not theirs.
    close(mass(&field, "density"), star_mass(), 3e-5);
    assert!(field.variables.iter().all(|v| v.location == Location::Node));
    assert_eq!((values(&field, "y_mass_fraction_He")[5], values(&field, "opacity")[5]), (0.25, -18.0));
    assert_eq!((values(&field, "nabla")[5], values(&field, "nabla_ad")[5]), (-15.0, -16.0));
    assert!(field.variable("energy_generation").is_none());
    assert!(field.notes.iter().any(|n| n.contains("left out: energy_generation")), "{:?}", field.notes);
    assert!(field.metadata[0].1.starts_with("41  4.8722E+08"));
}

#[test]
fn faults_are_named_with_line_and_column() {
    let good = model();
    let lines: Vec<&str> = good.lines().collect();
    let (arrays, rows) = (lines.len() - 2, (lines.len() - 2) / 20);
    assert_eq!((arrays % 20, rows), (0, POINTS.div_ceil(4)));
    let with = |line: usize, column: usize, field: &str| {
        let mut own: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        own[line - 1].replace_range(22 * (column - 1)..22 * column, &format!("{field:>22}"));
        own.join("\n") + "\n"
    };
    let density = 3 + 4 * rows;
    for (text, expected) in [
        (with(density + 1, 2, "NaN"), format!("line {}, column '2': the density is NaN", density + 1)),
        (with(density, 3, "-1.0"), format!("line {density}, column '3': the density is -1e0")),
        (with(4, 1, "1.0E+00"), "line 4, column '1': the radius is 1e0".into()),
        (with(4 + rows, 1, "1.0E+00"), format!("line {}, column '1': the enclosed mass shrinks", 4 + rows)),
        (with(9, 4, "1.0x"), "line 9, column '4': found '1.0x'".into()),
        (good.replace("402  =   100  +   302", "403  =   100  +   303"), "expected".into()),
        (good.replace("402  =   100", "402  =   101"), "line 2: found '402  =   101".into()),
        (
            good.replace("402  =   100  +   302", "4000000000  =   4000000000  +   0"),
            "line 2: states 4000000000".into(),
        ),
        (good.replace("402  =   100  +   302", "1  =   0  +   1"), "line 2: states 1 points".into()),
        (good.clone() + " 1.0\n", format!("line {}: follows the last array", lines.len() + 1)),
        (lines[..lines.len() - 1].join("\n") + "\n", "ends before all 402 values of array 20 of 20".into()),
        (good[..good.len() - 5].to_owned(), "no line end".into()),
    ] {
        let error = error_of("wdec", &text);
        assert!(error.contains(&expected), "{error}\nlacks {expected}");
    }
}

#[test]
fn damage_never_panics() {
    let text = "7 8\n 3 = 1 + 2\n".to_owned()
        + &" 1.000000000000000E+00 2.000000000000000E+00 3.000000000000000E+00\n".repeat(20);
    assert!(read_text("wdec", text.as_bytes(), &FieldRequest::default()).is_ok());
    survives_damage("wdec", text.as_bytes(), 7, true);
}
