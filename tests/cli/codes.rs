//! Runs for a named code: what it sets, and the parameter files beside the output.

use super::support::{Folder, faults, sph_prep, succeed};
use sph_formats::common::hdf5_read::Reader;

const STAR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/polytrope-1.5.nc");

/// The number after a key.
pub(super) fn number(text: &str, key: &str) -> f64 {
    let line = text.lines().find(|l| l.trim_start().starts_with(key)).unwrap_or_else(|| panic!("no {key}"));
    line.trim_start()[key.len()..]
        .trim_start_matches([' ', ':', '='])
        .split_whitespace()
        .next()
        .unwrap()
        .parse()
        .unwrap()
}

#[test]
fn parameter_files_say_what_the_codes_need() {
    let folder = Folder::new();
    let read = |name: &str| std::fs::read_to_string(folder.path("out").join(name)).unwrap();
    let start = |code: &str, out: &str| {
        let out = folder.path("out").join(out).display().to_string();
        succeed(&["--in", STAR, "-n", "500", "--for", code, "--parameters", "--out", &out, "--quiet"]);
    };
    start("swift", "ic.hdf5");
    let yml = read("ic.yml");
    assert!(yml.contains("file_name: ic.hdf5") && yml.contains("periodic: 0") && yml.contains("diffusion_beta: 0"));
    assert_eq!(number(&yml, "resolution_eta"), 1.2348);
    // In solar units G = 1, M = 1, R = 1 less an atmosphere that so few particles do not resolve: ten dynamical times.
    let end = number(&yml, "time_end");
    assert!(end > 5.0 && end < 10.1, "{end}");
    assert!((number(&yml, "dt_max") / end - 0.005).abs() < 1e-6);
    let softening = number(&yml, "max_physical_baryon_softening");
    assert!(softening > 0.01 && softening < 0.2, "{softening}");
    start("gadget4:neighbors=50", "g.hdf5");
    let param = read("g.param");
    assert_eq!(number(&param, "DesNumNgb"), 50.0);
    assert!(param.contains("InitCondFile g\n") && read("g.Config.sh").contains("SELFGRAVITY\n"));
    start("gizmo:scheme=density-sph,wendland-c2,neighbors=60", "z.hdf5");
    let (params, config) = (read("z.params"), read("z.Config.sh"));
    assert_eq!((number(&params, "DesNumNgb"), number(&params, "GravityConstantInternal")), (60.0, 0.0));
    // Types 0 to 5 have one softening each, as there is no point mass.
    assert_eq!(params.matches(&format!("MaxPhys {:e}\n", number(&params, "SofteningGas "))).count(), 6, "{params}");
    assert!((number(&params, "TimeMax") / end - 1.0).abs() < 0.1, "{params}");
    let lines: Vec<&str> = config.lines().filter(|line| !line.starts_with('#')).collect();
    let gamma = format!("EOS_GAMMA=({})", 5.0 / 3.0);
    let expected = [
        "HYDRO_DENSITY_SPH",
        "KERNEL_FUNCTION=6",
        &gamma,
        "ADAPTIVE_GRAVSOFT_FORGAS",
        "SPH_DISABLE_PM_CONDUCTIVITY",
        "INPUT_POSITIONS_IN_DOUBLE",
    ];
    assert_eq!(lines, expected);
    start("phantom", "star_00000.tmp");
    let options = read("star.in");
    assert_eq!(number(&options, "hfact"), 1.2);
    assert!(options.contains("star_00000.tmp") && options.contains("ieos"));
    start("sph-exa:scheme=std", "s.h5");
    let command = read("s.sh");
    assert!(
        command.starts_with("#!/bin/sh\n# s.h5 for SPH-EXA (std) with sinc^6, ng0 100: 100.0 neighbors"),
        "{command}"
    );
    let line = command.lines().last().unwrap();
    let after = |flag: &str| line.split_whitespace().skip_while(|word| *word != flag).nth(1).unwrap();
    assert_eq!((after("--init"), after("--prop")), ("'s.h5'", "std"));
    // What the writer takes for the code's kernel is what the target code places for.
    let path = folder.path("out/s.h5");
    let written = Reader::open(&path, "sph-exa").unwrap();
    assert_eq!(written.group_attributes("Step#0").unwrap().number("ng0"), Some(100.0));
    // Not an integer, which would be a number of steps.
    assert!(after("-s").contains('e') && (after("-s").parse::<f64>().unwrap() / end - 1.0).abs() < 0.1, "{line}");
}

/// A scene often has the name of its output.
#[test]
fn a_parameter_file_replaces_its_like_and_nothing_else() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    let scene = folder.file("ic.yml", format!("input: {{file: '{STAR}'}}\nparticles: 200\n"));
    let name = scene.display().to_string();
    let arguments = ["--scene", &name, "--for", "swift", "--parameters", "--out", &out, "--quiet"];
    let words = ["output.parameters", "would replace", "ic.yml", "another output"];
    assert_eq!(faults(&sph_prep(&arguments), &folder, 2, &words), Vec::<String>::new());
    assert!(std::fs::read_to_string(&scene).unwrap().starts_with("input:") && !folder.path("ic.hdf5").exists());
    std::fs::rename(&scene, folder.path("scene.yaml")).unwrap();
    let name = folder.path("scene.yaml").display().to_string();
    let arguments = ["--scene", &name, "--for", "swift", "--parameters", "--out", &out, "--quiet"];
    succeed(&arguments);
    succeed(&arguments);
    // Of the same stem, and with what is there to be left alone.
    let other = folder.path("ic.h5").display().to_string();
    let beside = ["--scene", &name, "--for", "swift", "--parameters", "--out", &other, "--quiet"];
    let words = ["output.parameters", "ic.yml", "that of another file", "ic.hdf5"];
    assert_eq!(faults(&sph_prep(&beside), &folder, 2, &words), Vec::<String>::new());
    std::fs::remove_file(folder.path("ic.hdf5")).unwrap();
    let kept = [arguments.as_slice(), &["--no-clobber"]].concat();
    assert_eq!(faults(&sph_prep(&kept), &folder, 2, &["output.parameters", "--no-clobber"]), Vec::<String>::new());
    assert!(!folder.path("ic.h5").exists() && !folder.path("ic.hdf5").exists());
}

#[test]
fn codes_that_are_not_known_are_refused_at_once() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    for (arguments, parts) in [
        (vec!["--for", "swfit"], vec!["target_code", "'swfit'", "swift"]),
        (vec!["--for", "swift:eta=-1"], vec!["eta is '-1'"]),
        (vec!["--parameters"], vec!["output.parameters", "--for"]),
        (
            vec!["--for", "gadget2", "--to", "gadget", "--parameters"],
            vec!["output.parameters", "swift, gadget4, gizmo, phantom"],
        ),
    ] {
        let mut all = vec!["--in", STAR, "-n", "200", "--out", &out];
        all.extend(arguments);
        assert_eq!(faults(&sph_prep(&all), &folder, 2, &parts), Vec::<String>::new(), "{all:?}");
    }
}

/// GIZMO's own method has other forces: what it sums is set, and nothing is balanced for it.
#[test]
fn a_code_of_other_forces_is_not_balanced_for() {
    let folder = Folder::new();
    let out = folder.path("ic.hdf5").display().to_string();
    let text = succeed(&["--in", STAR, "-n", "1000", "--for", "gizmo", "--out", &out]).stdout;
    for part in ["GIZMO (mfm) with cubic spline, DesNumNgb 32", "balance of pressure", "the forces of GIZMO with mfm"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // The remedy is not what cannot be.
    let line = text.lines().find(|l| l.contains("net force of") && l.contains("is much")).unwrap();
    assert!(line.contains("it is not balanced: target_code") && !line.contains("--for"), "{line}");
    let arguments = ["--in", STAR, "-n", "1000", "--for", "gizmo", "--balance", "--out", &out];
    let words = ["balance", "cannot go with target_code", "mfm", "density-sph"];
    assert_eq!(faults(&sph_prep(&arguments), &folder, 2, &words), Vec::<String>::new());
}
