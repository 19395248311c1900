//! Wrong scenes and command lines, and what is said to them: what is wrong, where, and what to write instead.

use super::support::{Folder, command, faults, sph_prep};
use sph_formats::common::netcdf_classic::{ClassicFile, Data};

const STAR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/star.nc");

/// A scene's text and what the message has to hold.
pub type Wrong<'a> = (&'a str, &'a [&'a str]);

pub const SCENES: &[Wrong<'_>] = &[
    // Keys.
    ("inptu: {file: a}", &["line 1, column 1", "no key 'inptu'", "did you mean 'input'?"]),
    ("input: {fil: a}", &["no key 'fil'", "did you mean 'file'?"]),
    ("input: {file: STAR}\nparticels: 10", &["line 2", "did you mean 'particles'?"]),
    ("input: {file: STAR}\nParticles: 10", &["no key 'Particles'", "did you mean 'particles'?"]),
    ("input: {file: STAR}\nwvt: {iteration: 3}", &["did you mean 'iterations'?"]),
    ("input: {file: STAR}\noutput: {unit: si}", &["did you mean 'units'?"]),
    ("input: {file: STAR}\ndomain: {sphre: {radius: 1}}", &["no key 'sphre'", "did you mean 'sphere'?"]),
    ("input: {file: STAR}\nseed: 1\nseed: 2", &["line 3", "'seed' comes twice"]),
    ("input: {file: STAR}\n  particles: 3", &["line 2", "check its indentation"]),
    ("input: {file: STAR", &["line 1", "bracket"]),
    ("", &["input", "--in FILE"]),
    ("- input", &["expected keys with values"]),
    ("profile: {polytrope: {n: 1.5}}", &["no key 'profile'", "did you mean 'input.profile'?"]),
    ("input: {file: STAR}\ngamma: 1.4", &["line 2", "no key 'gamma'", "'thermal.gamma'"]),
    ("input: {file: STAR, particles: 10}", &["did you mean 'particles' at the top of the scene?"]),
    // Choices.
    ("input: {file: STAR}\npolish: Solver", &["did you mean 'solver'?"]),
    ("input: {file: STAR}\npolish: relax", &["'relax' is no choice", "solver, alaric"]),
    ("input: {file: STAR}\nkernel: wendland-C2", &["did you mean 'wendland-c2'?"]),
    ("input: {file: STAR}\nkernel: m4", &["expected one of cubic-spline"]),
    ("input: {file: STAR}\nseeding: mass_bisection", &["did you mean 'mass-bisection'?"]),
    ("input: {file: STAR}\ndomain: {boundary: Periodic}", &["did you mean 'periodic'?"]),
    ("input: {file: STAR}\ndomain: {boundary: [open, closed]}", &["'closed' is no choice", "reflecting"]),
    ("input: {file: STAR, interpolation: cubik}", &["did you mean 'cubic'?"]),
    ("input: {file: STAR, centering: node}", &["did you mean 'nodes'?"]),
    ("input: {file: STAR}\nunits: sloar", &["units", "did you mean 'solar'?"]),
    ("input: {file: STAR}\noutput: {units: SI}", &["output.units", "did you mean 'si'?"]),
    ("input: {file: STAR}\ntarget_code: swfit", &["did you mean 'swift'?"]),
    ("input: {file: STAR}\ntarget_code: 'swift:wendland-c7'", &["did you mean 'wendland-c"]),
    ("input: {file: STAR}\nmap: {density: rho}", &["'rho' is no role", "density, velocity"]),
    ("input: {file: STAR}\nmap: {denisty: temperature}", &["names 'denisty'", "did you mean 'density'?"]),
    // Numbers.
    ("input: {file: STAR}\nparticles: many", &["line 2", "100000, 1e5 or 100k"]),
    ("input: {file: STAR}\nparticles: 0", &["particles", "at least 1"]),
    ("input: {file: STAR}\nparticles: 1.5", &["1.5 is no count"]),
    ("input: {file: STAR}\nparticles: -5", &["-5 is no count"]),
    ("input: {file: STAR}\nparticles: 5e9", &["4294967295"]),
    ("input: {file: STAR}\nseed: -1", &["whole number, at least 0"]),
    ("input: {file: STAR}\nwvt: {step: big}", &["expected a number"]),
    ("input: {file: STAR}\nneighbors: 1", &["neighbors", "2 to 1000"]),
    ("input: {file: STAR}\nthermal: {gamma: 1}", &["thermal.gamma", "more than 1"]),
    ("input: {file: STAR}\noutput: {compression: 12}", &["output.compression", "0 to 9"]),
    ("input: {file: STAR}\noutput: {double_precision: 3}", &["true or false"]),
    ("input: {file: STAR}\nbalance: on please", &["true, false, or keys"]),
    (
        "input: {expression: '1'}\ndomain: {cylinder: {radius: 1, length: 1, axis: [1, 1, 0]}}",
        &["line 2", "expected one word"],
    ),
    (
        "input: {expression: '1'}\ndomain: {box: [[0], [1]]}\nfields: {pressure: 1, temperature: 5, mean_molecular_weight: 1}",
        &["fields.temperature", "kB and mH", "`units: solar`"],
    ),
    (
        "input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1]]}\nfields: {internal_energy: 0}\noutput: {format: swift}",
        &["fields.internal_energy", "'swift' needs"],
    ),
    // Plain numbers beside others with units, which those of the output must not explain.
    (
        "input: {expression: '1 Msun/pc^3'}\ndomain: {box: [[0, 0], ['1 pc', '1 pc']]}\nmotion: {bulk: [1, 0]}\noutput: {units: cgs}",
        &["motion.bulk[0]", "beside numbers with units"],
    ),
    (
        "input: {expression: '1 Msun/pc^3'}\ndomain: {box: [[0, 0], ['1 pc', '1 pc']]}\nfields: {pressure: 3}\noutput: {units: galactic}",
        &["fields.pressure", "beside numbers with units"],
    ),
    // Quantities.
    ("input: {file: STAR}\ndomain: {ball: {radius: 1 Rsn}}", &["domain.ball.radius", "did you mean '1 Rsun'?"]),
    ("input: {file: STAR}\ndomain: {ball: {radius: 30 km/s}}", &["which is a velocity", "expected a length", "Rsun"]),
    ("input: {file: STAR}\ndomain: {ball: {radius: big}}", &["domain.ball.radius", "'1 Rsun'"]),
    ("input: {file: STAR}\ndomain: {ball: {center: [0, 0, 0]}}", &["'radius' is missing"]),
    ("input: {file: STAR}\ndomain: {ball: {radius: 1, inner_radius: 2}}", &["inner_radius < radius"]),
    (
        "input: {file: STAR}\ndomain: {ball: {radius: 1, center: [1 km, 2]}}",
        &["domain.ball.center", "2 coordinates, expected 3"],
    ),
    ("input: {file: STAR}\nmotion: {bulk: 3}", &["expected a list"]),
    ("input: {file: STAR}\nmotion: {bulk: [1, 2 K, 3]}", &["motion.bulk[1]", "which is a temperature", "km/s"]),
    ("input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1 pc]]}", &["states no units", "units: solar"]),
    ("input: {expression: '1'}\nmotion: {bulk: [.nan, 0, 0]}", &["line 2, column 17", "is .nan", "a finite number"]),
    ("input: {expression: '1'}\ndomain: {box: [[0, 0], [1, .inf]]}", &["line 2", "is .inf", "a finite number"]),
    ("input: {expression: '1'}\nfields: {velocity: [.nan]}\ndomain: {box: [[0], [1]]}", &["line 2", "is .nan"]),
    ("input: {file: STAR, scale: .nan}", &["line 1", "is .nan", "a finite number"]),
    ("input: {file: STAR}\nparticles: .nan", &["line 2", "is .nan", "a finite number"]),
    (
        "input: {expression: '1'}\nunits: solar\ndomain: {box: [[0], [1]]}\nfields: {magnetic_field: [1 km]}",
        &["fields.magnetic_field", "which is a length", "1e-6 G"],
    ),
    ("input: {file: STAR, magnetic_field_unit: km}", &["input.magnetic_field_unit", "another quantity"]),
    // What cannot be.
    ("input: {file: STAR, expression: '1'}", &["names more than one of `file`, `expression` and `profile`"]),
    ("input: {file: absent.nc}", &["absent.nc"]),
    ("input: {expression: '1 +'}\ndomain: {box: [[0], [1]]}", &["input.expression"]),
    ("input: {expression: '1'}", &["domain with 1 to 3 coordinates"]),
    ("input: {file: STAR}\ndomain: {ball: {radius: 1}, boundary: periodic}", &["a ball cannot be; use a box"]),
    (
        "input: {file: STAR}\ndomain: {box: [[1e12, 1e12, 1e12], [2e12, 2e12, 2e12]]}",
        &["the mass within the domain is 0", "check domain and units"],
    ),
    (
        "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]]}\nwalls: {}\noutput: {format: sph-exa}",
        &["output.format", "gas alone", "walls"],
    ),
    (
        "bodies: [{input: {file: STAR}}, {point_mass: 1 Msun}]\noutput: {format: sph-exa}",
        &["output.format", "gas alone", "point_mass"],
    ),
    ("input: {file: STAR}\nparticles: 1e9\npolish: none", &["particles", "GiB of memory", "fits"]),
    ("input: {file: STAR, density: desnity}", &["desnity", "did you mean 'density'?"]),
];

/// Arguments beside an output, and what the message has to hold.
const LINES: &[(&[&str], &[&str])] = &[
    (&["--in", STAR, "--polish", "slover"], &["did you mean 'solver'?"]),
    (&["--in", STAR, "--boundary", "periodc"], &["did you mean 'periodic'?"]),
    (&["--in", STAR, "-n", "lots"], &["100000, 1e5 or 100k"]),
    (&["--in", STAR, "--for", "gadget"], &["did you mean 'gadget4'?"]),
    (&["--in", STAR, "--to", "swfit"], &["did you mean 'swift'?"]),
    (&["--in", STAR, "--map", "density"], &["--map", "NAME=ROLE"]),
    (&["--in", STAR, "--map", "density=velocty"], &["did you mean 'velocity'?"]),
    (&["--in", STAR, "--units", "solr"], &["did you mean 'solar'?"]),
    (&["--in", STAR, "--polsh", "none"], &["--polish"]),
];

#[test]
fn wrong_scenes_and_command_lines_are_told_what_to_write() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    let mut faults = Vec::new();
    let mut page = String::new();
    let mut check = |what: &str, args: &[&str], parts: &[&str]| {
        let outcome = sph_prep(args);
        page += &format!("{what}\n{}\n", outcome.stderr);
        let lacking: Vec<&&str> = parts.iter().filter(|part| !outcome.stderr.contains(**part)).collect();
        let bad = outcome.code == Some(0) || outcome.stderr.contains("panicked") || outcome.stderr.contains("<input>");
        if !lacking.is_empty() || bad {
            faults.push(format!("{what}\n{} lacks {lacking:?}", outcome.stderr));
        }
    };
    for (text, parts) in SCENES {
        let path = folder.file("wrong.yaml", text.replace("STAR", STAR)).display().to_string();
        check(text, &["--scene", &path, "--out", &out], parts);
    }
    for (arguments, parts) in LINES {
        let mut args = arguments.to_vec();
        args.extend(["--out", &out]);
        check(&arguments[2..].join(" "), &args, parts);
    }
    // The page of all messages, to be read.
    if let Ok(results) = std::env::var("SPH_PREP_MESSAGES") {
        std::fs::write(results, page).unwrap();
    }
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), SCENES.len() + LINES.len(), faults.join("\n"));
    assert!(folder.outputs().is_empty());
}

#[test]
fn an_output_that_is_there_is_replaced_with_a_word_or_refused() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    let args = ["--in", STAR, "--out", &out, "-n", "100", "--polish", "none", "--iterations", "1"];
    assert!(!super::support::succeed(&args).stdout.contains("was replaced"));
    assert!(super::support::succeed(&args).stdout.contains("an older '"));
    let before = std::fs::read(&out).unwrap();
    let refused = command().args(args).arg("--no-clobber").output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let text = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(text.contains("is there already") && text.contains("--no-clobber"), "{text}");
    assert!(std::fs::read(&out).unwrap() == before);
}

#[test]
fn doubts_come_as_warnings_with_the_remedy() {
    let folder = Folder::new();
    let warned = |scene: &str, part: &str| {
        let text = scene.replace("STAR", STAR)
            + "\nparticles: 300\npolish: none\nwvt: {iterations: 1}\nthermal: {internal_energy: 1}";
        let path = folder.file("doubt.yaml", text).display().to_string();
        let outcome =
            sph_prep(&["--scene", &path, "--out", &folder.path("out/ic.hdf5").display().to_string(), "--json"]);
        assert_eq!(outcome.code, Some(0), "{scene}: {outcome:?}");
        let report: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
        let warnings = report["warnings"].to_string();
        assert!(warnings.contains(part), "{scene}: {warnings}");
        assert!(outcome.stderr.contains("warning: ") && outcome.stderr.contains(part), "{outcome:?}");
        assert!(report["verdict"].to_string().contains("warnings"), "{report}");
    };
    warned("input: {file: STAR, carry: []}\ndomain: {boundary: periodic}", "it is treated as open");
    warned("input: {file: STAR, carry: []}\ndomain: {ball: {radius: 1e9}}", "of the input's mass");
    warned("input: {expression: '1'}\ndomain: {cylinder: {radius: 1, length: 0.05}}", "spacings thick along z");
    warned(
        "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 0.01]], boundary: periodic}",
        "neighbors of themselves",
    );
    let slip =
        "input: {expression: '1'}\ndomain: {box: [[0, 0], [1, 1]]}\nfields: {velocty: [1, 0], v_ph: x, color: x}";
    warned(slip, "fields.velocty is written as a column of that name; did you mean 'velocity'?");
    warned(slip, "fields.v_ph is written as a column of that name; did you mean 'v_phi'?");
    warned(
        "input: {expression: 'exp(-(z/0.01)^2)'}\ndomain: {box: [[0, 0, -0.2], [1, 1, 0.2]], boundary: [periodic, periodic, open]}",
        "two spacings thick along z",
    );
}

#[test]
fn domains_that_take_forever_or_have_no_digits_left_are_refused_before_the_work() {
    let folder = Folder::new();
    let refused = |domain: &str, parts: &[&str]| {
        let text =
            format!("input: {{expression: '1'}}\ndomain: {domain}\nparticles: 500\nthermal: {{internal_energy: 1}}");
        let scene = folder.file("domain.yaml", text).display().to_string();
        let out = folder.path("out/ic.hdf5").display().to_string();
        assert_eq!(faults(&sph_prep(&["--scene", &scene, "--out", &out]), &folder, 2, parts), Vec::<String>::new());
    };
    refused(
        "{box: [[0, 0, 0], [1, 1, 1e-12]], boundary: periodic}",
        &["domain.box", "thick along z", "fewer dimensions"],
    );
    refused("{box: [[0, 0], [1e-9, 1]], boundary: periodic}", &["domain.box", "thick along x", "images"]);
    refused("{box: [[1e15, 0, 0], [1000000000000001, 1, 1]]}", &["domain.box", "away from the origin", "nearer"]);
}

/// A name says what a file is, to people and programs.
#[test]
fn a_name_that_belongs_to_files_of_another_kind_is_refused() {
    let folder = Folder::new();
    let run = |code: &str, name: &str| {
        let out = folder.path("out").join(name).display().to_string();
        sph_prep(&["--in", STAR, "-n", "100", "--polish", "none", "--for", code, "--out", &out])
    };
    for (code, name, better) in [
        ("gadget2", "a.hdf5", "a.gadget"),
        ("phantom", "a.hdf5", "a.phantom"),
        ("pysph", "a.h5", "a.npz"),
        ("dualsphysics", "a.h5", "a.bi4"),
        ("swift", "a.gadget", "a.hdf5"),
        ("gadget4", "a.phantom", "a.h5"),
    ] {
        let faults = faults(&run(code, name), &folder, 2, &["output.file", better, "--to"]);
        assert_eq!(faults, Vec::<String>::new(), "{code} {name}");
    }
    for (code, name) in [("gadget4", "a.hdf5"), ("gizmo", "a.h5"), ("phantom", "dump_00000.tmp"), ("swift", "a.vtu")] {
        assert_eq!(run(code, name).code, Some(0), "{code} {name}");
    }
}

#[test]
fn a_box_that_the_format_cannot_hold_is_refused_before_the_work() {
    let folder = Folder::new();
    for format in ["gadget", "gadget-binary"] {
        let scene = folder.file(
            "box.yaml",
            "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 3]], boundary: periodic}\nparticles: 2M\nthermal: {internal_energy: 1}",
        );
        let start = std::time::Instant::now();
        let outcome = sph_prep(&[
            "--scene",
            &scene.display().to_string(),
            "--out",
            &folder.path("out/ic.hdf5").display().to_string(),
            "--to",
            format,
        ]);
        assert_eq!(outcome.code, Some(2), "{outcome:?}");
        assert!(
            outcome.stderr.contains("edges are 1.000000e0, 1.000000e0, 3.000000e0") && outcome.stderr.contains("swift"),
            "{outcome:?}"
        );
        assert!(start.elapsed().as_secs_f64() < 20.0, "it took {:?}", start.elapsed());
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

fn xz(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    lzma_rs::xz_compress(&mut std::io::BufReader::new(bytes), &mut out).unwrap();
    out
}

fn zstandard(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

#[test]
fn packed_inputs_are_read() {
    let folder = Folder::new();
    let mut star = ClassicFile::new();
    let (r, rho) = ([0.0, 0.5, 1.0], [2.0, 1.5, 0.5]);
    let axis = star.dimension("r", 3);
    star.variable("r", &[axis], Data::F64(&r), &[]);
    star.variable("density", &[axis], Data::F64(&rho), &[]);
    star.write(&folder.path("star.nc")).unwrap();
    folder.file("star.txt", "# r density\n0 2\n0.5 1.5\n1 0.5\n");
    let run = |name: &str| {
        let (input, out) = (folder.path(name).display().to_string(), folder.path("out/ic.vtu").display().to_string());
        sph_prep(&["--in", &input, "--out", &out, "-n", "50", "--iterations", "1", "--polish", "none", "--json"])
    };
    let mass = |name: &str| -> f64 {
        let outcome = run(name);
        assert_eq!(outcome.code, Some(0), "{name}: {outcome:?}");
        serde_json::from_str::<serde_json::Value>(&outcome.stdout).unwrap()["mass"]["total"].as_f64().unwrap()
    };
    for inner in ["star.nc", "star.txt"] {
        let (bytes, expected) = (std::fs::read(folder.path(inner)).unwrap(), mass(inner));
        for (extension, packed) in [("gz", gzip(&bytes)), ("xz", xz(&bytes)), ("zst", zstandard(&bytes))] {
            let name = format!("{inner}.{extension}");
            folder.file(&name, &packed);
            assert_eq!(mass(&name), expected, "{name}");
            // Damaged streams are refused by their own name.
            folder.file(&name, &packed[..packed.len() / 2]);
            let outcome = run(&name);
            assert!(outcome.code == Some(1) && outcome.stderr.contains(&name), "{name}: {outcome:?}");
            assert!(!outcome.stderr.contains("panicked"), "{outcome:?}");
        }
    }
    // A stream that bursts is stopped.
    folder.file("star.txt.gz", gzip(&vec![b'0'; 40 << 20]));
    let outcome = run("star.txt.gz");
    assert!(outcome.code == Some(1), "{outcome:?}");
}

#[test]
fn the_report_ends_with_a_verdict() {
    let folder = Folder::new();
    let out = folder.path("out/ic.hdf5").display().to_string();
    let args = ["--in", STAR, "--out", &out, "-n", "2000", "--polish", "none", "--iterations", "5"];
    let text = super::support::succeed(&args).stdout;
    let verdict = text.split("  verdict          ").nth(1).unwrap_or_else(|| panic!("{text}"));
    for part in [
        "(sph-prep help numbers)",
        "mass in place",
        "(95 % is good)",
        "density",
        "(1 % is good, 5 % is much)",
        "pairs",
        "force noise",
        "atmosphere",
        "[numbers.md#mass-in-place]",
        "[numbers.md#force-noise]",
    ] {
        assert!(verdict.contains(part), "{part}: {verdict}");
    }
    assert!(!text.contains("Stagnated") && !text.contains("left out  "), "{text}");
    assert!(text.contains("without          periodic images"), "{text}");
}

/// Waves that are thousands of times as short as particles are apart.
#[test]
fn a_mass_that_is_hardly_known_is_in_the_verdict() {
    let verdict = |expression: &str| {
        let folder = Folder::new();
        let text = format!(
            "input: {{expression: '{expression}'}}\ndomain: {{box: [[0, 0], [1, 1]]}}\nparticles: 60\npolish: none\n"
        );
        let scene = folder.file("scene.yaml", text).display().to_string();
        let out = folder.path("ic.hdf5").display().to_string();
        let printed = super::support::succeed(&["--scene", &scene, "--out", &out, "--json"]).stdout;
        let report: serde_json::Value = serde_json::from_str(&printed).unwrap();
        let known = report["mass"]["quadrature_error"].as_f64().unwrap();
        let lines = report["verdict"].as_array().unwrap();
        (known, lines.iter().find(|line| line["topic"] == "total mass").cloned())
    };
    let (known, line) = verdict("1 + 0.9*sin(1e5*x*y)");
    let line = line.unwrap_or_else(|| panic!("{known}"));
    assert!(known > 1e-2 && line["grade"] == "bad", "{line}");
    let text = line["text"].as_str().unwrap();
    assert!(text.contains("1e-3 is good") && text.contains("max(r, 1e-3)"), "{text}");
    assert!(line["link"].as_str().unwrap().ends_with("numbers.md#total-mass"), "{line}");
    let (known, line) = verdict("1 + 0.9*sin(2*x*y)");
    assert!(known < 1e-3 && line.is_none(), "{known} {line:?}");
}

/// Formats are recognized by what files begin with, and read after that; a pipe gives its beginning once, or waits for somebody who writes.
#[cfg(unix)]
#[test]
fn pipes_are_refused_at_once() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.txt");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let pipe = pipe.display().to_string();
    let outcome = sph_prep(&["--in", &pipe, "--out", &folder.path("out/ic.hdf5").display().to_string()]);
    assert!(faults(&outcome, &folder, 1, &["pipe.txt", "it is a pipe", "save its contents"]).is_empty(), "{outcome:?}");
    let outcome = sph_prep(&["inspect", &pipe]);
    assert!(outcome.stderr.contains("it is a pipe"), "{outcome:?}");
}

/// A link to a place on another disk, where nothing is yet, is followed as one to a file is.
#[cfg(unix)]
#[test]
fn links_to_what_is_not_there_yet_are_followed() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("scratch")).unwrap();
    let link = folder.path("ic.hdf5");
    std::os::unix::fs::symlink("scratch/ic.hdf5", &link).unwrap();
    let out = link.display().to_string();
    let args = ["--in", STAR, "--out", &out, "-n", "100", "--polish", "none", "--iterations", "0"];
    let refused = command().args(args).arg("--no-clobber").output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    super::support::succeed(&args);
    assert!(link.is_symlink() && folder.path("scratch/ic.hdf5").is_file());
    let own = folder.path("own.hdf5");
    std::os::unix::fs::symlink("own.hdf5", &own).unwrap();
    let outcome = sph_prep(&["--in", STAR, "--out", &own.display().to_string(), "-n", "100"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("symbolic link"), "{outcome:?}");
}
