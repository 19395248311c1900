//! Tables with named columns.

use super::*;
use sph_formats::{FormatError, GridAxis};

fn read_table(text: &str) -> Result<RawField> {
    read_text("table", text.as_bytes(), &FieldRequest::default())
}

fn unit_of(field: &RawField, name: &str) -> Option<f64> {
    field.variable(name).and_then(|v| v.unit.as_ref()).map(|u| u.to_cgs)
}

fn axes(field: &RawField) -> &[GridAxis] {
    match &field.geometry {
        Geometry::Grid { axes, .. } => axes,
        other => panic!("expected a grid, found a {}", other.kind()),
    }
}

#[test]
fn cells_with_outer_radii_have_their_stated_mass() {
    let Some(path) = shared("phantom/kepler_MS.data") else { return };
    let field = read_as(Some("table"), &path, &FieldRequest::default()).unwrap();
    let density = field.variable("density").unwrap();
    assert_eq!((density.location, density.values.len()), (Location::Cell, 1065));
    // Total mass of the last row.
    close(mass(&field, "density"), 1.990_527_639_487_848_6e33, 1e-6);
    let enclosed = field.variable("enclosed_mass").unwrap();
    assert_eq!((enclosed.location, enclosed.values.get(0)), (Location::Node, 0.0));
    assert!(field.notes.iter().any(|n| n.contains("text were left out")), "{:?}", field.notes);
}

#[test]
fn supergiant_in_brackets_runs_inwards_and_has_its_stated_mass() {
    let Some(path) = shared("phantom/lau22.data") else { return };
    let field = read(&path);
    assert_eq!(radii(&field).len(), 10_001);
    assert_eq!((radii(&field)[0], *radii(&field).last().unwrap()), (0.0, 4.304_036e13));
    assert_eq!(field.density.as_deref(), Some("Density"));
    assert_eq!(values(&field, "internal_energy")[0], 7.985_498e14);
    // Six digits a number, and point values of a file made from shells.
    close(mass(&field, "Density"), 1.623_010e34, 5e-3);
    assert_eq!(unit_of(&field, "Density"), None);
}

#[test]
fn polytrope_with_numbers_in_its_comments_is_read() {
    let Some(path) = shared("phantom/ns-rdensity.tab") else { return };
    let field = read(&path);
    assert_eq!((radii(&field).len(), field.density.as_deref()), (914, Some("density")));
    // Made with unit mass.
    close(mass(&field, "density"), 1.0, 1e-3);
}

#[test]
fn earth_has_its_jumps_and_the_mass_of_its_numbers() {
    let Some(path) = shared("earth/prem_burnman.txt") else { return };
    let field = read(&path);
    let r = radii(&field);
    assert_eq!((r[0], *r.last().unwrap()), (0.0, 6.371e6));
    assert_eq!(r.windows(2).filter(|w| w[0] == w[1]).count(), 12);
    let rho = values(&field, "Density");
    let core = r.windows(2).position(|w| w == [3.48e6, 3.48e6]).unwrap();
    assert!((rho[core] / 9903.0 - 1.0).abs() < 1e-3 && (rho[core + 1] / 5566.0 - 1.0).abs() < 1e-3);
    // PREM's own mass of the Earth (kg); the rows are up to 200 km apart.
    close(mass(&field, "Density"), 5.974e24, 1e-3);
    // The header errs by 1e6; the note shows it.
    assert_eq!(unit_of(&field, "Density"), Some(1e-6));
    assert!(field.notes.iter().any(|n| n.contains("mean density is 5.517e-3 g/cm^3")), "{:?}", field.notes);
}

#[test]
fn separators_and_headers_of_all_kinds_give_the_same_profile() {
    for text in [
        "r,rho,T\n0,3,9\n1,2,8\n2,1,7\n",
        "\"r\";\"rho\";\"T\"\r\n0;3;9\r\n1;2;8\r\n2;1;7\r\n",
        "r\trho\tT\n0\t3\t9\n1\t2\t8\n2\t1\t7",
        "# made by hand\n# r rho T\n\n0 3 9\n# half way\n1 2 8 # here\n2 1 7\n",
        "! r rho T\n 0.0D+0 3.0 9\n 1.0D+0 2.0 8\n 2.0D+0 1.0 7\n",
        "\u{feff}r rho T\n2 1 7\n1 2 8\n0 3 9\n",
        "r, rho, T,\n0, 3, 9,\n1, 2, 8,\n2, 1, 7,\n",
        "# r, rho, T\n# 12 14 16\n0 3 9\n1 2 8\n2 1 7\n",
        "T rho r\n9 3 0\n8 2 1\n7 1 2\n",
    ] {
        let field = read_table(text).unwrap_or_else(|e| panic!("{text}\n{e}"));
        assert_eq!(radii(&field), [0.0, 1.0, 2.0], "{text}");
        assert_eq!((values(&field, "rho"), values(&field, "T")), (vec![3.0, 2.0, 1.0], vec![9.0, 8.0, 7.0]), "{text}");
        assert_eq!(field.density.as_deref(), Some("rho"));
    }
}

#[test]
fn units_come_from_brackets_suffixes_and_unit_lines() {
    for text in [
        "radius [km],density [kg/m^3]\n0,1\n1,1\n",
        "radius(km)  density(kg/m^3)\n0 1\n1 1\n",
        "# radius [km] density [kg m-3]\n0 1\n1 1\n",
        "radius_km density\n0 1\n1 1\n",
    ] {
        let field = read_table(text).unwrap();
        let Geometry::Radial { unit: Some(unit), .. } = &field.geometry else { panic!("no unit: {text}") };
        assert_eq!(unit.to_cgs, 1e5, "{text}");
        assert_eq!(unit_of(&field, "density"), (!text.contains("_km")).then_some(1e-3), "{text}");
    }
    let field = read_table("r rho S [kb/baryon]\n0 1 2\n1 1 2\n").unwrap_or_else(|e| panic!("{e}"));
    assert!(field.notes.iter().any(|n| n.contains("'kb/baryon'")), "{:?}", field.notes);
    let error = read_table("r [s] rho\n0 1\n1 1\n").unwrap_err();
    assert!(matches!(error, FormatError::Unsupported { .. }), "{error}");
}

#[test]
fn outer_radii_make_cells() {
    let field = read_table("outer radius [cm]  cell density  outer mass  outer spin\n1 3 5 7\n2 1 6 8\n").unwrap();
    assert_eq!(radii(&field), [0.0, 1.0, 2.0]);
    assert_eq!((field.density.as_deref(), values(&field, "density")), (Some("density"), vec![3.0, 1.0]));
    assert_eq!(values(&field, "enclosed_mass"), [0.0, 5.0, 6.0]);
    assert_eq!(values(&field, "outer spin"), [7.0, 7.0, 8.0]);
    assert!(error_of("table", "outer radius,rho\n1,3\n1,2\n").contains("leaves no volume"));
}

#[test]
fn equal_radii_are_jumps_and_rows_between_them_go() {
    let field = read_table("r rho\n0 9\n1 8\n1 7\n1 6\n2 5\n").unwrap();
    assert_eq!((radii(&field).to_vec(), values(&field, "rho")), (vec![0.0, 1.0, 1.0, 2.0], vec![9.0, 8.0, 6.0, 5.0]));
}

#[test]
fn points_that_fill_a_grid_are_one_in_any_order() {
    let mut rows = Vec::new();
    for (i, x) in [0.0, 1.0, 4.0].iter().enumerate() {
        for (j, y) in [-1.0, 2.0].iter().enumerate() {
            rows.push(format!("{x},{y},{}", 10 * j + i));
        }
    }
    rows.swap(0, 4);
    let field = read_table(&format!("x [m],y [m],density\n{}\n", rows.join("\n"))).unwrap();
    assert_eq!(
        axes(&field).iter().map(|a| a.nodes.clone()).collect::<Vec<_>>(),
        [vec![0.0, 1.0, 4.0], vec![-1.0, 2.0]]
    );
    assert_eq!(values(&field, "density"), [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]);
    assert_eq!(axes(&field)[1].unit.as_ref().map(|u| u.to_cgs), Some(100.0));

    rows.pop();
    let field = read_table(&format!("x,y,density\n{}\n", rows.join("\n"))).unwrap();
    assert!(matches!(&field.geometry, Geometry::Cloud { dimension: 2, points, .. } if points.len() == 5));
}

#[test]
fn lines_planes_and_clouds_have_their_dimension() {
    let line = read_table("x rho\n3 1\n1 2\n2 3\n").unwrap();
    assert_eq!((axes(&line)[0].nodes.clone(), values(&line, "rho")), (vec![1.0, 2.0, 3.0], vec![2.0, 3.0, 1.0]));
    let plane = read_table("x y z rho\n0 0 0 1\n1 0 0 2\n0 1 0 3\n1 1 0 4\n").unwrap();
    assert_eq!(axes(&plane).len(), 2);
    let cloud = read_table("Points:0,Points:1,Points:2,rho\n0,0,0,1\n1,0,3,2\n0,1,5,3\n").unwrap();
    assert!(matches!(cloud.geometry, Geometry::Cloud { dimension: 3, .. }));
    assert!(error_of("table", "x y rho\n1 1 1\n1 1 2\n").contains("span a line, plane or space"));
    assert!(error_of("table", "x z rho\n1 1 1\n1 2 2\n").contains("the columns are x, z, rho"));
}

#[test]
fn faults_are_named_with_line_column_and_text() {
    for (text, expected) in [
        ("r rho\n0 1\n1 x\n", "line 3, column 'rho': found 'x', expected a number"),
        ("r rho\n0 1\n1 2 3\n", "line 3: has 3 columns, the header names 2"),
        ("r,rho\n0,1\n1,\n", "line 3: has 1 columns, the header names 2"),
        ("r,rho,T\n0,1,2\n1,,2\n", "line 3, column 'rho': the field is empty"),
        ("r rho\n0 1\n2 2\n1 3\n", "line 4, column 'r': radii 1e0 and 2e0 are out of order"),
        ("r rho\n-1 1\n2 2\n", "line 2, column 'r': the radius is -1e0"),
        ("r rho\nnan 1\n2 2\n", "line 2, column 'r': the radius is NaN"),
        ("r rho\n1 1\n1 2\n", "all radii are 1e0"),
        ("r rho\n1 1\n", "line 2, column 'r': there is one radius"),
        ("0 1\n1 2\n", "line 1: no line above names its 2 columns"),
        ("r rho\n", "has no row of numbers"),
        ("a b\n1 2\n2 3\n", "coordinates: expected a radius"),
        ("r rho rho\n0 1 2\n1 2 3\n", "column 'rho': names two columns"),
        ("x rho\n0 1\ninf 2\n", "line 3, column 'x': expected a finite coordinate"),
        ("r rho\n0 1\n1 ****\n", "too wide for its Fortran format"),
        ("r id\n0 a\n1 7\n", "found the number '7' in a column that begins with a text"),
        ("r\0rho\n0 1\n", "holds zero bytes"),
        ("r rho\n0.0 1.00\n1.0 2.00\n2.0 3.0", "line 4: the last line has 7 characters and no line end"),
        ("\n \n", "content: is empty"),
    ] {
        let error = error_of("table", text);
        assert!(error.contains(expected), "{text}\n{error}\n{expected}");
        assert!(error.starts_with("table file '"), "{error}");
    }
}

#[test]
fn values_that_are_no_density_are_left_to_placement() {
    let field = read_table("r rho\n0 NaN\n1 -2\n2 inf\n").unwrap();
    let rho = values(&field, "rho");
    assert!(rho[0].is_nan() && rho[1] == -2.0 && rho[2] == f64::INFINITY);
}

#[test]
fn a_density_is_chosen_or_left_open() {
    let text = "r [cm],a [g/cc],b\n0,1,2\n1,3,4\n";
    assert_eq!(read_table(text).unwrap().density, None);
    for name in ["a", "a [g/cc]"] {
        let request = FieldRequest { density: Some(name.into()), carry: Some(vec![]), ..FieldRequest::default() };
        let field = read_text("table", text.as_bytes(), &request).unwrap();
        assert_eq!((field.density.as_deref(), field.variables.len()), (Some(name), 1));
        assert_eq!(values(&field, name), [1.0, 3.0]);
    }
    let request = FieldRequest { density: Some("c".into()), ..FieldRequest::default() };
    let error = read_text("table", text.as_bytes(), &request).unwrap_err().to_string();
    assert!(error.contains("variable 'c': there is no such column; the file has a, b"), "{error}");
    assert_eq!(read_table("r,density,rho\n0,1,2\n1,3,4\n").unwrap().density, None);
}

#[test]
fn damage_never_panics() {
    for text in ["x [m],y [m],density\n0,0,1\n1,0,2\n0,1,3\n1,1,4\n", "# r [cm]  rho é\n 0.0 1.0\n 1.0 2.0\n 2.0 3.0\n"]
    {
        survives_damage("table", text.as_bytes(), 1, false);
    }
    for name in ["phantom/kepler_MS.data", "earth/prem_burnman.txt", "phantom/ns-rdensity.tab"] {
        let Some(path) = shared(name) else { continue };
        let content = std::fs::read(path).unwrap();
        survives_damage("table", &content[..content.len().min(20_000)], 100, false);
    }
}

#[test]
fn mass_fractions_beside_a_radius_are_no_coordinates() {
    let star = |radius: &str, names: &str, rows: &str| {
        read_table(&format!("{radius},rho,{names},mass\n{rows}")).map_err(|e| e.to_string())
    };
    let rows = "0.1,5,0.34,0.64,0.02,0.1\n0.2,4,0.5,0.48,0.02,0.5\n0.3,1,0.7,0.28,0.02,1\n";
    for radius in ["r", "radius", "Radius [cm]", "rmid", "R"] {
        let field = star(radius, "X,Y,Z", rows).unwrap();
        assert_eq!(radii(&field), [0.1, 0.2, 0.3], "{radius}");
        assert_eq!(values(&field, "Y"), [0.64, 0.48, 0.28]);
    }
    // Helium alone beside hydrogen: what is left to 1 has no column.
    let two = "r,rho,X,Y\n0,5,0.34,0.64\n1,4,0.5,0.48\n";
    assert_eq!(radii(&read_table(two).unwrap()), [0.0, 1.0]);
    // Points with their distances from the origin stay points.
    let cloud = "x,y,z,r,rho\n3,4,0,5,1\n0,3,4,5,2\n1,0,0,1,3\n";
    assert!(matches!(read_table(cloud).unwrap().geometry, Geometry::Cloud { dimension: 3, .. }));
    // Neither.
    let error = read_table("x,y,z,r,rho\n3,4,0,0.1,1\n0,3,4,0.2,2\n1,0,0,0.1,3\n").unwrap_err().to_string();
    assert!(error.contains("'r' and x, y, z") && error.contains("rename"), "{error}");
}
