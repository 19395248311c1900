//! What parameter files say of scenes other than a star: gravity of pure numbers, adiabatic indices, dimensions, boxes, materials.

use super::codes::number;
use super::support::{Folder, Outcome, command, succeed};
use sph_formats::common::hdf5_read::Reader;
use sph_formats::{FieldRequest, FileContent};
use sph_prep::FORMATS;

const PROFILES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles");
/// A uniform periodic box; `SCENE` stands for what is added.
pub(super) const BOX: &str = "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [periodic]}\nparticles: 300\noutput: {units: code}\n";

/// Places a scene for a code; the report, and how its parameter files begin.
pub(super) fn place(folder: &Folder, scene: &str, (code, out): (&str, &str), more: &[&str]) -> Outcome {
    let (scene, out) = (folder.file("scene.yaml", scene), folder.path("out").join(out));
    let (scene, out) = (scene.display().to_string(), out.display().to_string());
    // Parameters are those of the scene, however the particles lie.
    let mut all =
        vec!["--scene", &scene, "--for", code, "--parameters", "--out", &out, "--iterations", "1", "--polish", "none"];
    all.extend(more);
    succeed(&all)
}

pub(super) fn profile(name: &str) -> String {
    std::fs::read_to_string(format!("{PROFILES}/{name}.yaml")).unwrap()
}

pub(super) fn text(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.path("out").join(name)).unwrap()
}

/// Lines of a Config.sh file.
pub(super) fn lines(text: &str) -> Vec<&str> {
    text.lines().filter(|line| !line.starts_with('#')).collect()
}

/// The adiabatic index that a file says.
fn read_index(folder: &Folder, name: &str) -> f64 {
    match sph_formats::read(FORMATS, &folder.path("out").join(name), None, &FieldRequest::default()).unwrap() {
        FileContent::Particles(file) => file.header.adiabatic_index(),
        FileContent::Field(_) => panic!("{name} is a field"),
    }
}

/// G is 1 where the scene's numbers have no units: a code has to be told, for it knows the constant in cgs.
#[test]
fn matter_of_pure_numbers_attracts_itself_where_the_scene_says_so() {
    let folder = Folder::new();
    let scene = profile("evrard");
    place(&folder, &scene, ("swift", "ic.hdf5"), &["-n", "300"]);
    let yml = text(&folder, "ic.yml");
    assert!(yml.contains("swift --hydro --limiter --self-gravity") && number(&yml, "G:") == 1.0, "{yml}");
    // What rests needs no adaptive gravity; what leaves an open box is deleted.
    assert!(yml.contains("MAC: geometric") && yml.contains("# particles that leave the box are deleted"), "{yml}");
    // Mass and radius are 1, less what 500 particles leave of the outermost layer: half a spacing, (4 pi/3/500)^(1/3)/2 = 0.1, or
    // more where it is thinner; and sqrt(0.8^3) = 0.72.
    assert!((7.0..=10.0).contains(&number(&yml, "time_end")), "{yml}");
    place(&folder, &scene, ("gadget4", "ic.hdf5"), &["-n", "300"]);
    assert_eq!(number(&text(&folder, "ic.param"), "GravityConstantInternal"), 1.0);
    assert!(lines(&text(&folder, "ic.Config.sh")).contains(&"SELFGRAVITY"));
    let other = "input: {profile: {polytrope: {n: 1.5, mass: 1, radius: 1}}}\nparticles: 300\nbalance: {constant: 4}\noutput: {units: code}\n";
    place(&folder, other, ("swift", "ic.hdf5"), &[]);
    assert_eq!(number(&text(&folder, "ic.yml"), "G:"), 4.0);
    // Nothing says that a density in pure numbers attracts itself.
    place(&folder, &profile("planet"), ("swift", "ic.hdf5"), &["-n", "300"]);
    let yml = text(&folder, "ic.yml");
    assert!(!yml.contains("--self-gravity") && !yml.contains("Gravity:"), "{yml}");
}

/// Pure numbers are written as if in cgs, but what is in cgs has a constant of gravity.
#[test]
fn a_star_in_cgs_attracts_itself_with_the_constant_that_the_code_knows() {
    let folder = Folder::new();
    let scene = format!("input: {{file: '{PROFILES}/polytrope-1.5.nc'}}\nparticles: 300\noutput: {{units: cgs}}\n");
    place(&folder, &scene, ("gadget4", "ic.hdf5"), &[]);
    let param = text(&folder, "ic.param");
    assert_eq!(number(&param, "GravityConstantInternal"), 0.0);
    assert!(lines(&text(&folder, "ic.Config.sh")).contains(&"SELFGRAVITY"));
    // sqrt(R^3/(G M)) of the Sun is 1593 s; less what 300 particles leave of the surface.
    assert!((0.6..1.0).contains(&(number(&param, "TimeMax") / 15930.0)), "{param}");
}

/// Smoothing lengths that grow must leave a periodic box its three cells along the shortest edge, or SWIFT stops under way.
#[test]
fn smoothing_lengths_in_swift_grow_no_farther_than_thin_boxes_allow() {
    let folder = Folder::new();
    place(&folder, &profile("blob"), ("swift", "blob.hdf5"), &["-n", "1000"]);
    let yml = text(&folder, "blob.yml");
    // The kernel of the default build reaches 1.825742 smoothing lengths (Dehnen and Aly 2012, table 1), cells 1.1 times as far.
    let most = 0.5 / (3.0 * 1.1 * 1.825742);
    assert!((0.95 * most..most).contains(&number(&yml, "h_max:")), "{yml}");
    place(&folder, &profile("evrard"), ("swift", "ic.hdf5"), &["-n", "500"]);
    let (yml, edge) = (text(&folder, "ic.yml"), 8.0);
    assert!(number(&yml, "h_max:") > 0.05 * edge, "{yml}");
}

/// A snapshot of pure numbers does not say whether its gas attracts itself.
#[test]
fn a_snapshot_without_units_is_not_silently_run_without_gravity() {
    let folder = Folder::new();
    place(&folder, &profile("evrard"), ("swift", "ic.hdf5"), &["-n", "150"]);
    let source = folder.path("out").join("ic.hdf5").display().to_string();
    let again = folder.path("out").join("again.hdf5").display().to_string();
    let options =
        ["--in", &source, "-n", "100", "--boundary", "open", "--for", "swift", "--parameters", "--out", &again];
    let report = succeed(&options).stdout;
    let yml = text(&folder, "again.yml");
    assert!(!yml.contains("Gravity:") && yml.contains("# beware: SWIFT is started without gravity"), "{yml}");
    assert!(report.contains("SWIFT is started without gravity"), "{report}");
    assert!(report.contains("forces on a re-sampled body are not balanced"), "{report}");
}

/// The pull of the star sets the time of a disc: its own mass is a hundredth.
#[test]
fn a_disc_has_the_time_of_its_star() {
    let folder = Folder::new();
    place(&folder, &profile("protoplanetary-disc"), ("swift", "ic.hdf5"), &["-n", "500"]);
    let yml = text(&folder, "ic.yml");
    // From 2.5, where the smooth edge leaves the last of 500 particles, to 3.4, its end along a diagonal, to the 3/2.
    assert!((39.0..64.0).contains(&number(&yml, "time_end")) && yml.contains("max_physical_DM_softening"), "{yml}");
    assert_eq!(number(&yml, "G:"), 1.0);
    assert!(yml.contains("MAC: adaptive") && number(&yml, "epsilon_fmm:") == 1e-4, "{yml}");
}

/// Codes soften all point masses of a type alike.
#[test]
fn softenings_that_differ_are_told() {
    let folder = Folder::new();
    let scene = |second: &str| {
        format!(
            "bodies:\n- {{name: star, input: {{profile: {{polytrope: {{n: 3, mass: 1 Msun, radius: 1 Rsun}}}}}}, position: [0 Rsun, 0 Rsun, 0 Rsun]}}\n\
             - {{name: a, point_mass: 1 Msun, softening_radius: 2 Rsun, position: [9 Rsun, 0 Rsun, 0 Rsun]}}\n\
             - {{name: b, point_mass: 1 Msun, softening_radius: {second} Rsun, position: [0 Rsun, 9 Rsun, 0 Rsun]}}\nparticles: 300\n"
        )
    };
    for (second, is_told) in [("1", true), ("2", false)] {
        place(&folder, &scene(second), ("swift", "ic.hdf5"), &[]);
        let yml = text(&folder, "ic.yml");
        assert_eq!(yml.contains("beware: SWIFT softens all point masses with one length"), is_told, "{yml}");
    }
}

#[test]
fn the_adiabatic_index_goes_to_each_code() {
    let folder = Folder::new();
    let scene = format!("{BOX}thermal: {{gamma: 1.4}}\nfields: {{pressure: 1}}\n");
    place(&folder, &scene, ("swift", "ic.hdf5"), &[]);
    let yml = text(&folder, "ic.yml");
    assert!(yml.contains("ic.yml, configured with --with-adiabatic-index=7/5\n"), "{yml}");
    // Sound crosses the box ten times in 10/sqrt(1.4); u = 1/0.4 is rounded to single precision.
    assert!((number(&yml, "time_end") * 1.4_f64.sqrt() / 10.0 - 1.0).abs() < 1e-6);
    place(&folder, &scene, ("gadget4", "ic.hdf5"), &[]);
    let config = text(&folder, "ic.Config.sh");
    assert_eq!(lines(&config), ["NTYPES=6", "DOUBLEPRECISION=1", "CUBIC_SPLINE_KERNEL", "PERIODIC", "GAMMA=1.4"]);
    place(&folder, &scene, ("gizmo", "ic.hdf5"), &[]);
    let config = text(&folder, "ic.Config.sh");
    let box_alone = ["SELFGRAVITY_OFF", "BOX_PERIODIC", "INPUT_POSITIONS_IN_DOUBLE"];
    assert_eq!(lines(&config)[..3], ["HYDRO_MESHLESS_FINITE_MASS", "KERNEL_FUNCTION=3", "EOS_GAMMA=(1.4)"]);
    assert_eq!(lines(&config)[3..], box_alone);
    // One edge is stated, and the others over it.
    let long = scene.replace("[1, 1, 1]", "[1, 2, 0.5]");
    place(&folder, &long, ("gizmo", "ic.hdf5"), &[]);
    let config = text(&folder, "ic.Config.sh");
    assert_eq!(lines(&config)[4..7], ["BOX_PERIODIC", "BOX_LONG_Y=2", "BOX_LONG_Z=0.5"]);
    assert_eq!(number(&text(&folder, "ic.params"), "BoxSize"), 1.0);
    // The file's are in gauss.
    let magnetic =
        long.replace("{units: code}", "{units: solar}").replace("fields: {", "fields: {magnetic_field: [1, 0, 0], ");
    place(&folder, &magnetic, ("gizmo", "ic.hdf5"), &[]);
    assert_eq!(number(&text(&folder, "ic.params"), "UnitMagneticField_in_gauss"), 1.0);
    assert!(lines(&text(&folder, "ic.Config.sh")).contains(&"MAGNETIC"));
    place(&folder, &scene, ("phantom", "ic_00000.tmp"), &[]);
    assert_eq!(read_index(&folder, "ic_00000.tmp"), 1.4);
    place(&folder, &scene, ("sph-exa", "ic.h5"), &[]);
    let step = Reader::open(&folder.path("out/ic.h5"), "sph-exa").unwrap().group_attributes("Step#0").unwrap();
    assert_eq!(step.number("gamma"), Some(1.4));
    assert_eq!(read_index(&folder, "ic.h5"), 1.4);
}

/// What AREPO refuses, or ends with: gravity whose boundaries disagree, a vacuum.
#[test]
fn arepo_is_built_for_the_box_and_its_walls() {
    let folder = Folder::new();
    let configured = |scene: &str, more: &[&str]| {
        let report = place(&folder, scene, ("arepo", "ic.hdf5"), more).stdout;
        let config = text(&folder, "ic.Config.sh");
        (report, lines(&config).iter().map(|l| (*l).to_owned()).collect::<Vec<_>>(), text(&folder, "ic.param"))
    };
    let mesh = "REGULARIZE_MESH_CM_DRIFT REGULARIZE_MESH_CM_DRIFT_USE_SOUNDSPEED REGULARIZE_MESH_FACE_ANGLE \
                TREE_BASED_TIMESTEPS DOUBLEPRECISION=1 READ_COORDINATES_IN_DOUBLE HAVE_HDF5";
    let scene = format!("{BOX}thermal: {{gamma: 1.4}}\nfields: {{pressure: 1}}\n");
    let (report, config, param) = configured(&scene.replace("[1, 1, 1]", "[1, 2, 0.5]"), &[]);
    assert_eq!(config.join(" "), format!("LONG_Y=2 LONG_Z=0.5 GAMMA=1.4 {mesh}"));
    assert_eq!((number(&param, "BoxSize"), number(&param, "PeriodicBoundariesOn")), (1.0, 1.0));
    assert!(!report.contains("vacuum"), "{report}");
    let (_, config, _) = configured(&scene.replace("periodic", "reflecting"), &[]);
    let walls = "REFLECTIVE_X=1 REFLECTIVE_Y=1 REFLECTIVE_Z=1";
    assert_eq!(config.join(" "), format!("{walls} GAMMA=1.4 {mesh}"));
    let star = format!("input: {{file: '{PROFILES}/polytrope-1.5.nc'}}\nparticles: 300\n");
    let (report, config, param) = configured(&star, &[]);
    assert!(config.join(" ").contains("REFLECTIVE_Z=2 SELFGRAVITY GRAVITY_NOT_PERIODIC EVALPOTENTIAL"), "{config:?}");
    assert_eq!(number(&param, "PeriodicBoundariesOn"), 0.0);
    assert!(report.contains("no mesh with a vacuum") && param.contains("% beware: AREPO's cells"), "{report}");
    // In two dimensions it makes its mesh, and mirrors where the scene has no walls.
    let (report, config, _) = configured(&profile("tank"), &["-n", "300"]);
    assert!(config.join(" ").starts_with("TWODIMS REFLECTIVE_X=1 REFLECTIVE_Y=1"), "{config:?}");
    assert!(report.contains("cells at its surface") && report.contains("not at walls within it"), "{report}");
    let magnetic = "fields: {pressure: 1, magnetic_field: [1, 0, 0]}\n";
    let (_, config, _) = configured(&format!("{BOX}{magnetic}"), &[]);
    assert!(config.join(" ").starts_with("MHD MHD_POWELL RIEMANN_HLLD"), "{config:?}");
}

/// PySPH is told in Python: the gravity of a liquid is that which its pressures are in balance with.
#[test]
fn pysph_gets_a_script() {
    let folder = Folder::new();
    let scene = format!("{BOX}thermal: {{gamma: 1.4}}\nfields: {{pressure: 1}}\n");
    let report = place(&folder, &scene, ("pysph:scheme=gas-dynamics", "ic.npz"), &[]).stdout;
    let script = text(&folder, "ic.py");
    for part in [
        "GasDScheme(fluids=[\"fluid\"], solids=[], dim=DIMENSION, gamma=GAMMA, kernel_factor=HDX",
        "GAMMA = 1.4\nHDX = 1.3\n",
        "KERNEL = CubicSpline(dim=DIMENSION)\nDATA = np.load(\"ic.npz\")",
        "DomainManager(xmin=0.0, xmax=1e0, periodic_in_x=True, ymin=0.0, ymax=1e0, periodic_in_y=True, zmin=0.0",
        "has_ghosts=True",
    ] {
        assert!(script.contains(part), "{part}: {script}");
    }
    assert!(!report.contains("beware") && !script.contains("beware"), "{report}");
    // The balance of the dam is of none of its schemes.
    let dam = profile("dam").replace("particles: 5000", "particles: 800").replace("balance: {gravity: field}\n", "");
    // A uniform pressure is in balance without gravity.
    place(&folder, &scene, ("pysph", "ic.npz"), &[]);
    assert!(text(&folder, "ic.py").contains("gx=0e0, gy=0e0, gz=0e0"));
    place(&folder, &dam, ("pysph", "ic.npz"), &[]);
    let script = text(&folder, "ic.py");
    assert!(
        script.contains("GAMMA = 7\n") && script.contains("particles(\"fluid\", 0), particles(\"walls\", 5)"),
        "{script}"
    );
    let sound: f64 =
        script.lines().find_map(|l| l.strip_prefix("RHO0, C0 = ")?.split_once(", ")?.1.parse().ok()).unwrap();
    // The density is summed.
    let after = |key: &str| -> f64 {
        let (_, rest) = script.split_once(key).unwrap();
        rest.split([',', ')']).next().unwrap().parse().unwrap()
    };
    assert!((after("gy=") / -9.81 - 1.0).abs() < 5e-3 && after("gx=").abs() < 1e-3, "{script}");
    assert!(
        (sound / 10.0 / (2.0 * 9.81 * 2.0_f64).sqrt() - 1.0).abs() < 0.05 && !script.contains("mirror"),
        "{script}"
    );
    let star = format!("input: {{file: '{PROFILES}/polytrope-1.5.nc'}}\nparticles: 300\n");
    let report = place(&folder, &star, ("pysph:scheme=gas-dynamics", "ic.npz"), &[]).stdout;
    assert!(report.contains("no gravity of the particles"), "{report}");
    let report = place(&folder, BOX, ("pysph:scheme=gas-dynamics", "ic.npz"), &[]).stdout;
    assert!(report.contains("takes internal energies, and the file has none"), "{report}");
}

/// SWIFT is built for four indices; what is next to 1 at one temperature is isothermal: P = (5/3 - 1) rho u = rho.
#[test]
fn swift_runs_isothermal_gas_and_says_which_it_cannot() {
    let folder = Folder::new();
    let scene = format!("{BOX}thermal: {{gamma: 1.001}}\nfields: {{pressure: 1}}\n");
    place(&folder, &scene, ("swift", "ic.hdf5"), &[]);
    let yml = text(&folder, "ic.yml");
    assert!(yml.contains("configured with --with-equation-of-state=isothermal-gas\n"), "{yml}");
    assert!((number(&yml, "isothermal_internal_energy") - 1.5).abs() < 1e-5, "{yml}");
    for scene in [
        scene.replace("pressure: 1", "pressure: 1 + 0.1*x"),
        format!("{BOX}thermal: {{gamma: 1.3}}\nfields: {{pressure: 1}}\n"),
    ] {
        let report = place(&folder, &scene, ("swift", "ic.hdf5"), &[]).stdout;
        assert!(report.contains("no build of SWIFT has the adiabatic index 1."), "{report}");
        assert!(text(&folder, "ic.yml").contains("# beware: no build of SWIFT"));
    }
}

#[test]
fn fewer_dimensions_are_said_and_an_open_box_is_not_periodic() {
    let folder = Folder::new();
    let scene = profile("disc-2d");
    place(&folder, &scene, ("gadget4", "ic.hdf5"), &["-n", "500"]);
    assert_eq!(
        lines(&text(&folder, "ic.Config.sh")),
        ["NTYPES=6", "DOUBLEPRECISION=1", "CUBIC_SPLINE_KERNEL", "TWODIMS"]
    );
    let param = text(&folder, "ic.param");
    assert_eq!(number(&param, "BoxSize"), 0.0);
    // As many in the circle of the radius within which 64 are in a sphere.
    let expected = std::f64::consts::PI * (48.0 / std::f64::consts::PI).powf(2.0 / 3.0);
    assert_eq!(number(&param, "DesNumNgb"), expected.round(), "GADGET-4 reads whole numbers: {param}");
    place(&folder, &scene, ("swift", "ic.hdf5"), &["-n", "500"]);
    assert!(text(&folder, "ic.yml").contains("ic.yml, configured with --with-hydro-dimension=2\n"));
    place(&folder, &profile("sine-1d"), ("gadget4", "ic.hdf5"), &["-n", "100"]);
    assert!(lines(&text(&folder, "ic.Config.sh")).ends_with(&["PERIODIC", "ONEDIMS"]));
}

/// SWIFT asks for three cells along each edge, and for as many times more along the longest as that is longer.
#[test]
fn thin_boxes_have_cells_enough_or_are_said_to_be_too_coarse() {
    let folder = Folder::new();
    let scene = BOX.replace("[1, 1, 1]", "[1, 0.1, 0.1]") + "thermal: {internal_energy: 1}\n";
    let report = place(&folder, &scene, ("swift", "ic.hdf5"), &["-n", "1000"]).stdout;
    let yml = text(&folder, "ic.yml");
    assert_eq!(number(&yml, "max_top_level_cells"), 30.0);
    // 48 neighbors reach (48/(4 pi/3)/1000 * 0.01)^(1/3) = 0.0486, and three cells 1.1 times as wide have to go into 0.1: 1000 (0.160/0.1)^3 = 4120
    // particles; kernels at even places differ by a few percent.
    let more = report.split(" the shortest of which is 1.000e-1; use ").nth(1).unwrap_or_else(|| panic!("{report}"));
    let more: f64 = more.split_whitespace().next().unwrap().parse().unwrap();
    assert!((3700.0..4700.0).contains(&more), "{more}");
    // The check sees it, too, and what is said helps.
    let ic = folder.path("out/ic.hdf5").display().to_string();
    let checked = command().args(["check", &ic, "--for", "swift"]).output().unwrap();
    assert!(String::from_utf8(checked.stdout).unwrap().contains("ERROR    smoothing lengths"));
    let enough = format!("{:.0}", 1.1 * more);
    let report = place(&folder, &scene, ("swift", "ic.hdf5"), &["-n", &enough]).stdout;
    assert!(!report.contains("particles or more"), "{report}");
    let checked = command().args(["check", &ic, "--for", "swift"]).output().unwrap();
    assert!(!String::from_utf8(checked.stdout).unwrap().contains("ERROR"));
}

/// Nothing is dropped silently: what a code does not know is said in the report and in its parameter file.
#[test]
fn what_a_code_does_not_know_is_said() {
    let folder = Folder::new();
    let materials = format!("{BOX}thermal: {{internal_energy: 1}}\nmaterial: [{{id: 400}}]\n");
    let mixed = BOX.replace("[periodic]", "[periodic, periodic, reflecting]") + "thermal: {internal_energy: 1}\n";
    let walls = BOX.replace("[periodic]", "reflecting") + "thermal: {internal_energy: 1}\n";
    let magnetic = format!("{BOX}thermal: {{internal_energy: 1}}\nfields: {{magnetic_field: [1, 0, 0]}}\n");
    let field = BOX.replace("[periodic]", "reflecting")
        + "fields: {pressure: 2 - z}\nbalance: {gravity: field, evaluations: 3}\n";
    let by_default = BOX.replace("[periodic]", "reflecting") + "fields: {pressure: 2 - z}\nbalance: {evaluations: 3}\n";
    let even = BOX.replace("[periodic]", "reflecting") + "fields: {pressure: '2'}\nbalance: {evaluations: 3}\n";
    let report = place(&folder, &even, ("swift", "ic.hdf5"), &[]).stdout;
    assert!(!report.contains("does not receive the external force"), "{report}");
    let dust = format!("{BOX}thermal: {{internal_energy: 1}}\ndust: {{ratio: 0.01}}\n");
    for (scene, code, part) in [
        (
            &materials,
            "swift",
            "treats the materials of the file as an ideal gas, whose pressure differs: --for swift:scheme=planetary",
        ),
        (&materials, "gadget4", "treats the materials of the file as an ideal gas"),
        (&mixed, "swift", "SWIFT is periodic along all axes or none"),
        (&walls, "gadget4", "GADGET-4 has no reflecting walls"),
        (&magnetic, "gadget4", "has no magnetic fields"),
        (&magnetic, "sph-exa", "has no magnetic fields"),
        (&field, "swift", "SWIFT does not receive the external force that balances the pressure"),
        (&by_default, "swift", "SWIFT does not receive the external force that balances the pressure"),
        (&dust, "gizmo", "GIZMO computes drag on dust only if it is built with GRAIN_FLUID"),
    ] {
        let report = place(&folder, scene, (code, "ic.hdf5"), &[]).stdout;
        let name = match code {
            "swift" => "ic.yml",
            "sph-exa" => "ic.sh",
            "gizmo" => "ic.params",
            _ => "ic.param",
        };
        let file = text(&folder, name);
        assert!(report.contains(part) && file.contains(part), "{part}: {report}");
    }
    let report = place(&folder, &materials, ("swift:planetary", "ic.hdf5"), &[]).stdout;
    assert!(!report.contains("ideal gas, whose"), "{report}");
    let yml = text(&folder, "ic.yml");
    assert!(yml.contains("configured with --with-hydro=planetary --with-equation-of-state=planetary\n"), "{yml}");
    assert!(yml.contains("swift --hydro --threads=N ic.yml,"), "{yml}");
    for (kernel, options) in [
        ("wendland-c2", "--with-kernel=wendland-C2\n"),
        ("wendland-c4,eta=1.1239", "--with-kernel=wendland-C4 --disable-hand-vec\n"),
    ] {
        place(&folder, &profile("uniform-3d"), (&format!("swift:{kernel}"), "kernel.hdf5"), &["-n", "300"]);
        let yml = text(&folder, "kernel.yml");
        assert!(
            yml.contains(&format!("swift --hydro --limiter --threads=N kernel.yml, configured with {options}")),
            "{yml}"
        );
    }
    // Tables that the code reads, under the numbers that it has for them.
    for (id, name, words) in [
        (100, "Til_iron", None),
        (401, "ANEOS_iron", Some("SWIFT reads the table of material 401")),
        (902, "custom_2", Some("SWIFT reads the table of material 902")),
        (734, "material 734", Some("no material of SWIFT has the number 734")),
    ] {
        let numbered = format!("{BOX}thermal: {{internal_energy: 1}}\nmaterial: [{{id: {id}}}]\n");
        let report = place(&folder, &numbered, ("swift:planetary", "ic.hdf5"), &[]).stdout;
        let yml = text(&folder, "ic.yml");
        assert!(yml.contains(name), "{yml}");
        match words {
            Some(words) => assert!(report.contains(words), "{report}"),
            None => {
                assert!(!report.contains("of SWIFT has the number") && !report.contains("reads the table"), "{report}")
            }
        }
        assert_eq!(yml.contains(&format!("planetary_{name}_table_file")), matches!(id, 401 | 902), "{yml}");
    }
}

/// SWIFT's planetary schemes stop without the materials' numbers; others take them for nothing.
#[test]
fn the_check_knows_who_reads_materials() {
    let folder = Folder::new();
    let own = format!("{BOX}thermal: {{internal_energy: 1}}\n");
    let check = |code: &str| {
        let ic = folder.path("out/ic.hdf5").display().to_string();
        String::from_utf8(command().args(["check", &ic, "--for", code]).output().unwrap().stdout).unwrap()
    };
    place(&folder, &own, ("swift", "ic.hdf5"), &[]);
    assert!(check("swift:planetary").contains("ERROR    MaterialIDs: is missing"), "{}", check("swift:planetary"));
    assert!(!check("swift").contains("MaterialIDs"));
    place(&folder, &format!("{own}material: [{{id: 400}}]\n"), ("swift", "ic.hdf5"), &[]);
    assert!(check("swift").contains("WARNING  MaterialIDs: "), "{}", check("swift"));
    assert!(!check("swift:planetary").contains("  MaterialIDs: "));
}

/// Phantom is built for what is in the dump.
#[test]
fn phantoms_build_is_named() {
    let folder = Folder::new();
    let own = format!("{BOX}thermal: {{internal_energy: 1}}\n");
    let dust = format!("{own}fields: {{dust_fraction: 0.01}}\n");
    let magnetic = format!("{own}fields: {{magnetic_field: [1, 0, 0]}}\n");
    for (scene, code, build) in [
        (&own, "phantom", "SETUP=empty PERIODIC=yes IND_TIMESTEPS=no"),
        (&own, "phantom:wendland-c4", "SETUP=empty PERIODIC=yes IND_TIMESTEPS=no KERNEL=WendlandC4"),
        (&dust, "phantom", "SETUP=empty PERIODIC=yes IND_TIMESTEPS=no DUST=yes"),
        (&magnetic, "phantom", "SETUP=empty PERIODIC=yes IND_TIMESTEPS=no MHD=yes"),
        (&profile("evrard"), "phantom", "SETUP=star"),
    ] {
        place(&folder, scene, (code, "ic_00000.tmp"), &["-n", "500"]);
        let line = format!("# run it by: phantom ic.in, built by make {build}\n");
        assert!(text(&folder, "ic.in").contains(&line), "{line}");
    }
}

/// Stars are read with an option; other types that only attract are left out.
#[test]
fn swift_is_told_of_stars_and_not_given_what_it_leaves_out() {
    let folder = Folder::new();
    let scene = |part_type: u8| {
        format!(
            "bodies:\n- {{input: {{profile: {{polytrope: {{n: 1.5, mass: 1, radius: 1}}}}}}, particles: 200}}\n\
             - {{input: {{profile: {{plummer: {{mass: 1, scale_radius: 1, outer_radius: 5}}}}}}, particles: 200, collisionless: {{type: {part_type}}}}}\n\
             output: {{units: code}}\n"
        )
    };
    for (part_type, run, is_said) in [
        (1, "--hydro --limiter --self-gravity", false),
        (4, "--hydro --limiter --stars --self-gravity", false),
        (3, "--hydro --limiter --self-gravity", true),
    ] {
        let report = place(&folder, &scene(part_type), ("swift", "ic.hdf5"), &[]).stdout;
        let yml = text(&folder, "ic.yml");
        assert!(yml.contains(&format!("run it by: swift {run} --threads")), "{yml}");
        let said = "SWIFT takes the 200 particles of type 3 for sinks";
        assert_eq!((report.contains(said), yml.contains(said)), (is_said, is_said), "{report}");
        let ic = folder.path("out/ic.hdf5").display().to_string();
        let checked = command().args(["check", &ic, "--for", "swift"]).output().unwrap();
        assert_eq!(String::from_utf8(checked.stdout).unwrap().contains("WARNING  types: "), is_said);
    }
}

/// A star in a periodic box: no parameter file has gravity there.
#[test]
fn gravity_that_is_left_out_is_said() {
    let folder = Folder::new();
    let scene = profile("star-in-wind");
    let said = "SWIFT is started without gravity, since the box is periodic";
    let report = place(&folder, &scene, ("swift", "ic.hdf5"), &["-n", "500"]).stdout;
    assert!(report.contains(said) && text(&folder, "ic.yml").contains(said), "{report}");
    let gas = format!("{BOX}thermal: {{internal_energy: 1}}\n");
    let report = place(&folder, &gas, ("swift", "ic.hdf5"), &[]).stdout;
    assert!(!report.contains("without gravity"), "{report}");
}

/// Densities of particles whose smoothing lengths reach the largest that SWIFT is told would be wrong from the first step on.
#[test]
fn no_smoothing_length_of_a_file_is_beyond_the_largest_that_swift_is_told() {
    let folder = Folder::new();
    place(&folder, &profile("walls-3d"), ("swift", "ic.hdf5"), &["-n", "3000"]);
    let path = folder.path("out/ic.hdf5");
    let (_, lengths) = Reader::open(&path, "swift").unwrap().numbers("PartType0/SmoothingLength").unwrap().unwrap();
    let (widest, largest) = (lengths.range().1, number(&text(&folder, "ic.yml"), "h_max"));
    assert!(widest > 0.1 && largest > widest, "{largest} in the parameter file, {widest} in the file");
}

/// Cold gas moves by itself: at the speed of sound it would take ten thousand times as long.
#[test]
fn the_end_is_that_of_what_moves_or_sounds() {
    let folder = Folder::new();
    let end = |fields: &str| {
        place(&folder, &format!("{BOX}fields: {{{fields}}}\n"), ("swift", "ic.hdf5"), &[]);
        number(&text(&folder, "ic.yml"), "time_end")
    };
    // Ten crossings: c^2 = gamma (gamma - 1) u; a sine has half of its amplitude squared.
    let sound = 10.0 / (10.0 / 9.0_f64).sqrt();
    assert!((end("internal_energy: 1") / sound - 1.0).abs() < 0.01);
    let moving = end("internal_energy: 1e-8, velocity: ['sin(2*pi*x)', 0, 0]");
    assert!((moving / (10.0 * 2.0_f64.sqrt()) - 1.0).abs() < 0.05, "{moving}");
    // A common velocity takes nothing anywhere.
    let together = end("internal_energy: 1, velocity: [100, 0, 0]");
    assert!((together / sound - 1.0).abs() < 0.01, "{together}");
}

/// SWIFT ends where light particles lie beside heavy ones by thousands; GADGET goes on.
#[test]
fn masses_that_differ_by_far_are_bad_where_the_code_ends() {
    let folder = Folder::new();
    let scene = BOX.to_owned() + "resolution: {spacing: 'if(x < 0.5, 1, 0.09)'}\n";
    let said = |code: &str| place(&folder, &scene, (code, "ic.hdf5"), &["-n", "6000"]).stdout;
    let swift = said("swift");
    assert!(swift.contains("SWIFT crashes or hangs") && swift.contains("BAD    code"), "{swift}");
    assert!(swift.contains("`particle_mass`") && !swift.contains("or use more of them"), "{swift}");
    assert!(said("gadget4").contains("LOOK   code"));
}
