//! What parameter files say of the file that they stand beside: what is in it, what kind it is, what its code cannot bear.

use super::parameters::{BOX, lines, place, profile, text};
use super::support::{Folder, command};
use sph_formats::{FieldRequest, FileContent};
use sph_prep::FORMATS;

/// What the check says of a file for GADGET-4.
fn check(path: &str) -> String {
    String::from_utf8(command().args(["check", path, "--for", "gadget4"]).output().unwrap().stdout).unwrap()
}

/// What a build does not read it warns about, and what one with a magnetic field does not find stops it.
#[test]
fn phantom_is_told_what_its_build_reads() {
    let folder = Folder::new();
    let own = format!("{BOX}thermal: {{internal_energy: 1}}\n");
    let magnetic = format!("{own}fields: {{magnetic_field: [1, 0, 0]}}\n");
    let keys = |scene: &str, more: &[&str]| -> Vec<String> {
        place(&folder, scene, ("phantom", "ic_00000.tmp"), &[&["-n", "300"], more].concat());
        let text = text(&folder, "ic.in");
        let key =
            |line: &str| line.split_once('=').filter(|_| !line.starts_with('#')).map(|(key, _)| key.trim().to_owned());
        text.lines().filter_map(key).collect()
    };
    let has = |keys: &[String], key: &str| keys.iter().any(|k| k == key);
    let (plain, field) = (keys(&own, &[]), keys(&magnetic, &[]));
    for (key, of_plain, of_field) in
        [("alphaB", false, true), ("psidecayfac", false, true), ("alphau", true, true), ("irealvisc", true, true)]
    {
        assert_eq!((has(&plain, key), has(&field, key)), (of_plain, of_field), "{key}");
    }
    let disc = "bodies:\n- {name: star, point_mass: 1, accretion_radius: 0.05}\n\
        - {name: disc, input: {profile: {disc: {mass: 1e-6, inner_radius: 0.5, outer_radius: 3, aspect_ratio: 0.1}}}}\n\
        particles: 300\npolish: none\nwvt: {iterations: 0}\noutput: {units: code}\n";
    let isothermal = keys(disc, &[]);
    assert!(has(&isothermal, "disc_viscosity") && has(&isothermal, "ieos"));
    for key in ["alphau", "ipdv_heating", "ishock_heating", "icooling", "irealvisc", "shearparam", "bulkvisc"] {
        assert!(!has(&isothermal, key), "{key}");
    }
}

/// Phantom's gravity of particles of different masses is wrong, and GADGET-4 finds no neighbors of a particle that outweighs them.
#[test]
fn masses_that_a_code_cannot_bear_are_told() {
    let folder = Folder::new();
    let cloud = |halo: usize| {
        format!(
            "bodies:\n- {{name: gas, input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 4}}}}}}, particles: 300}}\n\
             - {{name: halo, collisionless: {{type: 1}}, input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 4}}}}}}, particles: {halo}}}\n\
             particles: 600\npolish: none\nwvt: {{iterations: 0}}\noutput: {{units: code}}\n"
        )
    };
    for (halo, is_told) in [(300, false), (100, true)] {
        let report = place(&folder, &cloud(halo), ("phantom", "ic_00000.tmp"), &[]).stdout;
        assert_eq!(report.contains("give all bodies particles of one mass"), is_told, "{report}");
        assert_eq!(text(&folder, "ic.in").contains("beware: Phantom softens the attraction"), is_told);
    }
    let two = "bodies:\n- {name: a, input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}, particles: 300, position: [0, 0, 0]}\n\
        - {name: b, input: {profile: {polytrope: {n: 1.5, mass: 1e-3, radius: 0.5}}}, particles: 300, position: [5, 0, 0]}\n\
        particles: 600\npolish: none\nwvt: {iterations: 0}\noutput: {units: code}\n";
    let heavy = two.replace("particles: 300, position: [0", "particles: 40, position: [0");
    for (scene, is_heavy) in [(two, false), (heavy.as_str(), true)] {
        place(&folder, scene, ("gadget4", "ic.hdf5"), &[]);
        let ic = folder.path("out").join("ic.hdf5").display().to_string();
        let found = check(&ic);
        assert_eq!(found.contains("so that it may stop at the first step"), is_heavy, "{found}");
        assert_eq!(text(&folder, "ic.param").contains("it may stop at the first step"), is_heavy);
    }
}

/// GADGET's binary files are named in full, have formats of their own, and a header for which GADGET-4 has to be built.
#[test]
fn gadget_4_is_told_what_kind_of_file_it_is_given() {
    let own = format!("{BOX}thermal: {{internal_energy: 1}}\n");
    for (format, file, name, number) in [
        ("gadget", "ic.hdf5", "ic", "3"),
        ("gadget-binary", "ic.dat", "ic.dat", "2"),
        ("gadget-binary-1", "ic.dat", "ic.dat", "1"),
    ] {
        let folder = Folder::new();
        place(&folder, &own, ("gadget4", file), &["--to", format, "--files", "2"]);
        let parameters = text(&folder, "ic.param");
        assert!(lines(&parameters).contains(&format!("InitCondFile {name}").as_str()), "{parameters}");
        assert!(lines(&parameters).contains(&format!("ICFormat {number}").as_str()), "{parameters}");
        assert_eq!(lines(&text(&folder, "ic.Config.sh")).contains(&"GADGET2_HEADER"), format != "gadget");
        // The number that the code puts behind the name.
        let first = if format == "gadget" { "ic.0.hdf5" } else { "ic.dat.0" };
        assert!(folder.path("out").join(first).is_file(), "{first}");
        let ic = folder.path("out").join(first).display().to_string();
        assert!(!check(&ic).contains("does not start"));
    }
}

/// GADGET-4 has boxes with edges that are halves of the longest one, and halves of these.
#[test]
fn gadget_4_is_built_for_boxes_whose_edges_are_halves() {
    let folder = Folder::new();
    let scene = |z: f64| {
        format!(
            "input: {{expression: '1'}}\ndomain: {{box: [[0, 0, 0], [2, 1, {z}]], boundary: [periodic]}}\nthermal: {{internal_energy: 1}}\noutput: {{units: code}}\n"
        )
    };
    place(&folder, &scene(0.25), ("gadget4", "ic.hdf5"), &["-n", "2000"]);
    let config = text(&folder, "ic.Config.sh");
    let lines_of_config = lines(&config);
    assert!(lines_of_config.contains(&"LONG_Y_BITS=1") && lines_of_config.contains(&"LONG_Z_BITS=3"), "{config}");
    assert!(!config.contains("LONG_X_BITS"), "{config}");
    assert!(lines(&text(&folder, "ic.param")).contains(&"BoxSize 2e0"));
    let ic = folder.path("out").join("ic.hdf5");
    match sph_formats::read(FORMATS, &ic, None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => assert_eq!(file.header.box_size, [2.0, 1.0, 0.25]),
        FileContent::Field(_) => panic!("a field"),
    }
    let found = check(&ic.display().to_string());
    assert!(found.contains("build GADGET-4 with LONG_Y_BITS=1 LONG_Z_BITS=3"), "{found}");
    let (path, out) = (folder.file("scene.yaml", scene(0.3)), folder.path("out").join("no.hdf5"));
    let refused = command()
        .args([
            "--scene",
            &path.display().to_string(),
            "--for",
            "gadget4",
            "--out",
            &out.display().to_string(),
            "-n",
            "500",
        ])
        .output()
        .unwrap();
    let error = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && error.contains("LONG_X_BITS"), "{error}");
}

/// An attribute of the first element of a name.
fn attribute(xml: &str, element: &str, name: &str) -> f64 {
    let (_, rest) = xml.split_once(&format!("<{element} ")).unwrap_or_else(|| panic!("{element}: {xml}"));
    let (_, rest) = rest.split_once(&format!("{name}=\"")).unwrap_or_else(|| panic!("{element}: {name}"));
    rest.split('"').next().unwrap().parse().unwrap()
}

/// A parameter of a case.
fn parameter(xml: &str, key: &str) -> f64 {
    attribute(xml, &format!("parameter key=\"{key}\""), "value")
}

/// The blocks of a case are those of its file; gravity is that which its pressures are in balance with, and along z.
#[test]
fn dualsphysics_gets_a_case() {
    let folder = Folder::new();
    let dam = profile("dam").replace("particles: 5000", "particles: 800").replace("balance: {gravity: field}\n", "");
    let report = place(&folder, &dam, ("dualsphysics", "dam.bi4"), &[]).stdout;
    let xml = text(&folder, "dam.xml");
    assert!(xml.starts_with("<!-- dam.bi4 for DualSPHysics") && xml.matches("-->").count() == 1, "{xml}");
    assert!(!report.contains("beware") && !xml.contains("beware"), "{report}");
    let file = match sph_formats::read(FORMATS, &folder.path("out/dam.bi4"), None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file,
        FileContent::Field(_) => panic!("a field"),
    };
    let count = |t: u8| file.species.iter().find(|s| s.part_type == t).unwrap().table.count as f64;
    let of_particles = ["np", "nb", "nbf"].map(|name| attribute(&xml, "particles", name));
    assert_eq!(of_particles, [count(0) + count(5), count(5), count(5)]);
    assert_eq!((attribute(&xml, "fixed", "begin"), attribute(&xml, "fixed", "count")), (0.0, count(5)));
    assert_eq!((attribute(&xml, "fluid", "begin"), attribute(&xml, "fluid", "count")), (count(5), 800.0));
    let constant = |name: &str| attribute(&xml, name, "value");
    assert!(xml.contains("<data2d value=\"true\" />"), "{xml}");
    assert_eq!(["x", "y"].map(|axis| attribute(&xml, "gravity", axis)), [0.0; 2]);
    assert!((attribute(&xml, "gravity", "z") / -9.81 - 1.0).abs() < 1e-9, "{xml}");
    // 2 by 1 of density 1 in 800 particles.
    assert_eq!((constant("rhop0"), constant("gamma"), constant("massfluid")), (1.0, 7.0, 2.0 / 800.0));
    assert!((constant("dp") - 0.05).abs() < 1e-12 && constant("massbound") > 0.0);
    // coefh = 1; support radii of the fluid differ by little.
    assert!((constant("h") / (0.05 * 2.0_f64.sqrt()) - 1.0).abs() < 0.05, "{xml}");
    // c = 20 sqrt(g H), where H is 2 less one spacing.
    let sound = (constant("b") * 7.0).sqrt();
    assert!((sound / (20.0 * (9.81 * 1.95_f64).sqrt()) - 1.0).abs() < 0.02, "{sound}");
    assert_eq!((parameter(&xml, "Kernel"), parameter(&xml, "DensityDT"), parameter(&xml, "Boundary")), (2.0, 2.0, 1.0));
    assert!((parameter(&xml, "RhopOutMin"), parameter(&xml, "RhopOutMax")) == (0.7, 1.3));
    assert!((parameter(&xml, "TimeMax") / parameter(&xml, "TimeOut") - 10.0).abs() < 1e-9);
    assert!(xml.contains("<posmax x=\"default\" y=\"default\" z=\"default + 50%\" />"), "{xml}");
    assert!(xml.contains("<posmin x=\"default\" y=\"default\" z=\"default\" />"), "{xml}");
    // A box without pressures or walls floats, and its axes are periodic.
    let report = place(&folder, BOX, ("dualsphysics:cubic-spline", "box.bi4"), &[]).stdout;
    let xml = text(&folder, "box.xml");
    assert!(report.contains("begins without pressure and without gravity") && xml.contains("beware"), "{report}");
    assert!(xml.contains("XPeriodicIncZ") && xml.contains("ZPeriodicIncX") && !xml.contains("<fixed "), "{xml}");
    assert_eq!((parameter(&xml, "Kernel"), parameter(&xml, "DensityDT")), (1.0, 1.0));
}
