//! The ways in which particles are made: at once, over ranks, block by block, seeded while they are written, or from copies of a box. What there is to say
//! of a scene, and how its file is judged, is the same for all of them.

use crate::cli::support::{Folder, sph_prep, succeed};
use crate::ranks::on;
use sph_prep::relaxation::StopReason;
use sph_prep::run::in_turn::{InTurn, InTurnReport, run_in_turn};
use sph_prep::run::ranks::run_on_ranks;
use sph_prep::run::verdict::{Finding, Grade};
use sph_prep::{Control, FORMATS, Report, Scene, run};

/// A scene with its folder and output there.
fn scene_in(folder: &Folder, text: &str) -> Scene {
    let mut scene = Scene::parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    scene.output.file = Some(folder.path("out/ic.hdf5"));
    scene
}

fn at_once(text: &str) -> Report {
    run(&scene_in(&Folder::new(), text), FORMATS, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn in_turn(text: &str, blocks: usize) -> InTurnReport {
    let folder = Folder::new();
    let how = InTurn { blocks, folder: &folder.path("blocks") };
    run_in_turn(&scene_in(&folder, text), FORMATS, &Control::default(), how).unwrap_or_else(|e| panic!("{e}"))
}

fn over_ranks(text: &str, ranks: usize) -> Report {
    let folder = Folder::new();
    let scene = scene_in(&folder, text);
    on(ranks, |exchange| run_on_ranks(&scene, FORMATS, &Control::default(), exchange).unwrap()).swap_remove(0)
}

fn finding<'a>(verdict: &'a [Finding], topic: &str) -> Option<&'a Finding> {
    verdict.iter().find(|finding| finding.topic.name() == topic)
}

/// Each part is in what is said.
fn says<'a>(way: &str, said: &[String], parts: impl IntoIterator<Item = &'a &'a str>) {
    for part in parts {
        assert!(said.iter().any(|text| text.contains(part)), "{way} lacks '{part}': {said:#?}");
    }
}

/// A density that jumps at a face, an option of a stage that does not run, layers that are too thin, and for a code without magnetic fields.
const DOUBTFUL: &str = "input: {expression: 'exp(x)'}\n\
    domain: {box: [[0, 0, 0], [1, 0.1, 1]], boundary: [periodic, reflecting, open]}\n\
    fields: {magnetic_field: [0.5, 0, 0], pressure: 1}\nparticles: 2000\ntarget_code: gizmo\nwvt: {iterations: 2}\nafc: {steps: 3}\npolish: none\n";

#[test]
fn every_way_says_the_same_of_a_scene() {
    let warnings = ["the box is periodic along x, but the density is not", "the domain is"];
    let notes = [
        "the options of `afc` change nothing",
        "the magnetic field is in",
        "GIZMO is periodic along all axes or none",
        "made for GIZMO",
    ];
    let text = DOUBTFUL.replace("0.1, 1]", "0.05, 1]");
    let said = |way: &str, told: &[String], noted: &[String], verdict: &[Finding]| {
        says(way, told, &warnings);
        says(way, noted, &notes);
        let of = |topic| finding(verdict, topic).map(|finding| finding.grade);
        assert_eq!([of("warnings"), of("code")], [Some(Grade::Look); 2], "{way}: {verdict:#?}");
    };
    let report = at_once(&text);
    said("at once", &report.warnings, &report.notes, &report.verdict);
    let report = over_ranks(&text, 2);
    said("over ranks", &report.warnings, &report.notes, &report.verdict);
    let report = in_turn(&text, 2);
    said("in turn", &report.warnings, &report.notes, &report.verdict);
    let folder = Folder::new();
    let (path, out) = (folder.file("scene.yaml", &text), folder.path("out/seeds.hdf5"));
    let (path, out) = (path.display().to_string(), out.display().to_string());
    let told = succeed(&["seed", "--scene", &path, "--out", &out]).stdout;
    let lines: Vec<String> = told.lines().map(str::to_owned).collect();
    says("seed", &lines, warnings.iter().chain(&notes));
    says("seed", &lines, &["what the scene says under wvt, afc changes nothing here"]);
}

/// At a file in which most of the box is empty AREPO ends.
#[test]
fn a_file_at_which_its_code_stops_is_bad() {
    let star = "input: {profile: {polytrope: {n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}\nparticles: 2000\ntarget_code: arepo\n\
                balance: false\nwvt: {iterations: 1}\npolish: none\n";
    for (way, verdict) in [("at once", at_once(star).verdict), ("in turn", in_turn(star, 2).verdict)] {
        let code = finding(&verdict, "code").unwrap_or_else(|| panic!("{way}"));
        assert!(code.grade == Grade::Bad && code.text.contains("stops"), "{way}: {code:?}");
    }
    let folder = Folder::new();
    let (path, out) = (folder.file("scene.yaml", star), folder.path("out/ic.hdf5"));
    let (path, out) = (path.display().to_string(), out.display().to_string());
    assert_eq!(sph_prep(&["--scene", &path, "--out", &out, "--strict"]).code, Some(3));
    let full = star.replace("arepo", "gizmo");
    assert_eq!(finding(&at_once(&full).verdict, "code"), None);
}

/// The density is judged as of one run: against what a kernel can show, not against the target itself.
#[test]
fn blocks_are_judged_as_all_at_once() {
    let star = "input: {profile: {polytrope: {n: 3, mass: 1 Msun, radius: 1 Rsun}}}\nparticles: 2000\nbalance: false\n";
    let (alone, blocks) = (at_once(star), in_turn(star, 2));
    for topic in ["mass in place", "density", "pairs", "atmosphere"] {
        let [a, b] = [&alone.verdict, &blocks.verdict].map(|verdict| finding(verdict, topic).map(|f| f.grade));
        assert!(a.is_some() && a == b, "{topic}: {a:?} at once, {b:?} in turn");
    }
    let (a, b) = (alone.density_error.smoothed.unwrap(), blocks.figures.smoothed.as_given);
    assert!(a.particles == b.particles && (b.mean / a.mean - 1.0).abs() < 0.2, "{a:?} {b:?}");
    assert!(blocks.figures.all.as_given.mean > 2.0 * b.mean && blocks.atmosphere == alone.atmosphere);
}

#[test]
fn blocks_reach_a_tolerance_or_go_on_as_long_as_they_gain() {
    let scene = |tolerance: f64| {
        format!(
            "input: {{expression: '1'}}\ndomain: {{box: [[0, 0], [1, 1]], boundary: periodic}}\nparticles: 2000\ntolerance: {tolerance}\n"
        )
    };
    let easy = in_turn(&scene(1.0), 2);
    assert!(easy.stop == StopReason::ToleranceReached && easy.figures.stated() < 1.0, "{:?}", easy.stop);
    assert_eq!(finding(&easy.verdict, "end"), None);
    let hard = in_turn(&scene(1e-20), 2);
    assert!(hard.stop != StopReason::ToleranceReached && hard.figures.stated() > 1e-20, "{:?}", hard.stop);
    let end = finding(&hard.verdict, "end").unwrap();
    assert!(end.grade == Grade::Bad && end.text.contains("the tolerance 1.00e-20"), "{end:?}");
    assert!(
        hard.figures.stated() <= easy.figures.stated() && hard.passes.len() > easy.passes.len(),
        "{:?}",
        hard.passes
    );
    let folder = Folder::new();
    let (path, out) = (folder.file("scene.yaml", scene(1.0)), folder.path("out/ic.hdf5"));
    let (path, out) = (path.display().to_string(), out.display().to_string());
    succeed(&["--scene", &path, "--out", &out, "--in-turn", "2"]);
}

/// An atmosphere is cut where as many particles as there are show it, not those of a box of which most are left out.
#[test]
fn copies_of_a_box_are_as_many_as_the_domain_holds_of_them() {
    let folder = Folder::new();
    let uniform =
        "input: {expression: '1'}\ndomain: {box: [[0, 0, 0], [1, 1, 1]], boundary: periodic}\nparticles: 512\n";
    let star = "input: {profile: {polytrope: {n: 3, mass: 1 Msun, radius: 1 Rsun}}}\nparticles: PARTICLES\n";
    let written = |name: &str, text: &str| folder.file(name, text).display().to_string();
    let of = |name: &str| folder.path(name).display().to_string();
    let tile = of("out/tile.hdf5");
    succeed(&["seed", "--scene", &written("box.yaml", uniform), "--out", &tile]);
    let scene = written("star.yaml", &star.replace("PARTICLES", "77"));
    let told =
        succeed(&["replicate", &tile, "--times", "2,2,2", "--scene", &scene, "--out", &of("out/star.hdf5")]).stdout;
    assert!(told.contains("says under particles changes nothing here"), "{told}");
    let count = told.lines().find_map(|line| line.split_once(" particles in a box")).unwrap().0;
    let cut = |text: &str| {
        let line = text.lines().find(|line| line.contains("of the mass")).unwrap_or_else(|| panic!("{text}"));
        line.trim_start_matches(|c: char| c != ':').to_owned()
    };
    let seeds = written("seeds.yaml", &star.replace("PARTICLES", count));
    let alone = succeed(&["seed", "--scene", &seeds, "--out", &of("out/seeds.hdf5")]).stdout;
    assert_eq!(cut(&told), cut(&alone), "{told}\n{alone}");
}

/// Velocities and heat of a snapshot are those of its fields at each particle, whatever other particles are made at the same time.
#[test]
fn seeds_of_a_snapshot_have_its_fields_whatever_is_made_together() {
    let folder = Folder::new();
    let snapshot = concat!(env!("CARGO_MANIFEST_DIR"), "/profiles/rotating-star.hdf5");
    let scene =
        folder.file("scene.yaml", format!("input: {{file: '{snapshot}'}}\nparticles: 60\n")).display().to_string();
    let of = |name: &str| folder.path(name).display().to_string();
    let made = |name: &str, files: &str| {
        let told = succeed(&["seed", "--scene", &scene, "--out", &of(name), "--files", files, "--to", "gadget"]).stdout;
        let content = sph_formats::read(FORMATS, &folder.path(name), None, &Default::default()).unwrap();
        let sph_formats::FileContent::Particles(mut file) = content else { panic!("particles") };
        (file.species.swap_remove(0).table, told)
    };
    let ((whole, told), (parts, _)) = (made("out/whole.hdf5", "1"), made("out/parts.hdf5", "4"));
    for name in ["Coordinates", "Velocities", "InternalEnergy"] {
        let [a, b] = [&whole, &parts].map(|table| table.column(name).unwrap().values.to_f64());
        assert!(a == b, "{name} depends on how many are made together");
    }
    assert!(told.contains("not brought to its totals") && !told.contains("kept of the snapshot"), "{told}");
}
