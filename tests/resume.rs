//! Interrupted runs: what they leave, and that going on from a checkpoint gives the bytes of a run that was never
//! interrupted, for any stage and number of threads.

use sph_prep::Error;
use sph_prep::relaxation::{Control, Event, StopReason};
use sph_prep::run::pipeline;
use sph_prep::run::report::Report;
use sph_prep::scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A folder with a scene for it.
struct Work {
    folder: TempDir,
    scene: Scene,
}

const DISC: &str = "input: {expression: '1 + 0.5*x'}\ndomain: {ball: {center: [0, 0], radius: 1}, boundary: [reflecting]}\n\
    particles: 300\nseed: 4\nseeding: random\n";
const BOX: &str = "input: {expression: '2 + sin(2*pi*x)', dimension: 3}\ndomain: {box: [[0,0,0],[1,1,1]], boundary: [periodic]}\n\
    particles: 200\n";

impl Work {
    fn new(scene: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = Scene::parse(scene).unwrap();
        scene.output.file = Some(folder.path().join("ic.vtu"));
        scene.checkpoint.file = Some(folder.path().join("run.checkpoint"));
        Self { folder, scene }
    }

    fn output(&self) -> PathBuf {
        self.folder.path().join("ic.vtu")
    }

    fn checkpoint(&self) -> PathBuf {
        self.folder.path().join("run.checkpoint")
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(self.output()).unwrap()
    }

    /// Runs, interrupted after an iteration of a stage if there is one.
    fn run(&self, threads: usize, after: Option<(&str, usize)>) -> sph_prep::Result<Report> {
        let interrupted = AtomicBool::new(false);
        let observer = |event: Event| {
            if after.is_some_and(|place| has_come(event, place)) {
                interrupted.store(true, Ordering::Relaxed);
            }
        };
        let control = Control { deadline: None, interrupted: &interrupted, observer: &observer };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| pipeline::run(&self.scene, sph_formats::FORMATS, &control))
    }
}

/// Whether the iteration of the stage has been reached.
fn has_come(event: Event, (name, at): (&str, usize)) -> bool {
    matches!(event, Event::Iteration { stage, iteration, .. } if stage.name == name && iteration >= at)
}

/// A scene for each stage, and an iteration of it in the midst of its work.
fn every_stage() -> Vec<(String, (&'static str, usize))> {
    let star = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/polytrope-1.5.nc");
    let star = format!("input: {{file: '{}'}}\nparticles: 400\n", star.display());
    vec![
        (format!("{DISC}polish: none\nwvt: {{iterations: 20}}\n"), ("wvt", 7)),
        (format!("{DISC}polish: solver\nwvt: {{iterations: 3}}\nsolver: {{evaluations: 40}}\n"), ("solver", 20)),
        (
            format!("{DISC}polish: alaric\nwvt: {{iterations: 3}}\nalaric: {{steps: 40, splittings: 1}}\n"),
            ("alaric", 20),
        ),
        (
            format!("{DISC}polish: damped-relaxation\nwvt: {{iterations: 3}}\nalaric: {{steps: 40}}\n"),
            ("damped-relaxation", 20),
        ),
        (format!("{DISC}polish: afc\nafc: {{steps: 30}}\n"), ("afc", 12)),
        (format!("{star}solver: {{evaluations: 10}}\nbalance: {{evaluations: 40}}\n"), ("balance", 18)),
        (format!("{BOX}polish: none\ntrim_masses: 0.05\n"), ("trim", 1)),
    ]
}

/// Interrupts at each of the places with one number of threads, goes on with another, and compares.
fn goes_on(scene: &str, places: &[(&str, usize)]) {
    let mut work = Work::new(scene);
    let whole = work.run(1, None).unwrap();
    let expected = work.bytes();
    assert!(!work.checkpoint().exists(), "a finished run leaves no checkpoint");
    for (threads, then) in [(1, 5), (5, 2)] {
        std::fs::remove_file(work.output()).unwrap();
        work.scene.checkpoint.resume = None;
        for &(stage, iteration) in places {
            let error = work.run(threads, Some((stage, iteration))).unwrap_err();
            assert!(matches!(error, Error::InterruptedKept(_)), "{stage} {iteration}: {error}");
            assert!(error.to_string().contains("--resume") && !work.output().exists(), "{error}");
            // The next interrupt comes to a run that has gone on from this one.
            work.scene.checkpoint.resume = Some(work.checkpoint());
        }
        let resumed = work.run(then, None).unwrap();
        assert!(work.bytes() == expected, "other bytes after {places:?} with {threads} and {then} threads");
        let steps = |r: &Report| -> Vec<(usize, u64)> {
            r.stages.iter().flat_map(|s| &s.history).map(|p| (p.iteration, p.epsilon.to_bits())).collect()
        };
        assert_eq!(steps(&resumed), steps(&whole), "the report tells another story");
    }
}

#[test]
fn wvt_goes_on() {
    goes_on(&format!("{DISC}polish: none\nwvt: {{iterations: 30}}"), &[("wvt", 0), ("wvt", 3), ("wvt", 17)]);
    goes_on(&format!("{BOX}polish: none\nwvt: {{iterations: 20, weight: inverse-square, bias: plain}}"), &[("wvt", 7)]);
}

#[test]
fn the_solver_goes_on() {
    let scene = "polish: solver\nwvt: {iterations: 3}\nsolver: {evaluations: 40}\n";
    goes_on(&format!("{DISC}{scene}"), &[("wvt", 1), ("solver", 9), ("solver", 20), ("solver", 33)]);
    goes_on(&format!("{BOX}{scene}"), &[("solver", 12)]);
}

/// Bodies apart, one after the other: the first and the second of each stage are interrupted.
#[test]
fn bodies_that_are_relaxed_one_by_one_go_on() {
    let scene = "input: {expression: 'if((x - 0.4)^2 + y^2 < 0.04, 50, if(x < 0.9, 1, 0))'}\n\
        domain: {box: [[0, -0.5], [1, 0.5]], boundary: [reflecting, periodic]}\nparticles: 400\n\
        polish: solver\nwvt: {iterations: 12}\nsolver: {evaluations: 30}\n";
    goes_on(scene, &[("wvt", 4), ("wvt", 17), ("solver", 9), ("solver", 40)]);
}

#[test]
fn the_solver_with_another_kernel_to_come_to_rest_goes_on() {
    let scene = format!("{BOX}kernel: cubic-spline\nsolver: {{evaluations: 40}}\n");
    goes_on(&scene, &[("solver", 12), ("solver", 32)]);
}

#[test]
fn alaric_goes_on() {
    let scene = "polish: alaric\nwvt: {iterations: 3}\n";
    goes_on(&format!("{DISC}{scene}alaric: {{steps: 50, splittings: 1}}"), &[("alaric", 5), ("alaric", 44)]);
    goes_on(&format!("{BOX}{scene}alaric: {{steps: 50, viscosity: false}}"), &[("alaric", 21), ("alaric", 37)]);
}

#[test]
fn afc_goes_on() {
    goes_on(&format!("{DISC}polish: afc\nafc: {{steps: 40}}"), &[("afc", 0), ("afc", 5), ("afc", 26)]);
}

#[test]
fn an_interrupt_after_splitting_goes_on_too() {
    // The observer counts steps of both stages: the coarse one has converged by then.
    let scene = "polish: alaric\nwvt: {iterations: 0}\nalaric: {steps: 40, splittings: 2, rate_tolerance: 1e3}\n";
    let mut work = Work::new(&format!("{DISC}{scene}"));
    work.run(2, None).unwrap();
    let expected = work.bytes();
    let seen = std::sync::atomic::AtomicUsize::new(0);
    let interrupted = AtomicBool::new(false);
    let observer = |event: Event| {
        if matches!(event, Event::Iteration { iteration: 1, .. }) && seen.fetch_add(1, Ordering::Relaxed) == 2 {
            interrupted.store(true, Ordering::Relaxed);
        }
    };
    let control = Control { deadline: None, interrupted: &interrupted, observer: &observer };
    assert!(pipeline::run(&work.scene, sph_formats::FORMATS, &control).is_err());
    work.scene.checkpoint.resume = Some(work.checkpoint());
    work.run(1, None).unwrap();
    assert!(work.bytes() == expected);
}

#[test]
fn balance_goes_on() {
    let (scene, _) = &every_stage()[5];
    goes_on(scene, &[("balance", 3), ("balance", 14), ("balance", 33)]);
    // Newton's method from the start, in the middle of its first step and of its second.
    let newton = scene.replace("evaluations: 40", "evaluations: 70");
    goes_on(&format!("{newton}kernel: cubic-spline\nneighbors: 60\n"), &[("balance", 7), ("balance", 55)]);
}

#[test]
fn mass_trimming_goes_on() {
    let (scene, _) = &every_stage()[6];
    goes_on(scene, &[("trim", 0), ("trim", 5)]);
}

#[test]
fn an_interrupt_after_the_last_stage_keeps_what_it_left() {
    let mut work = Work::new(&format!("{DISC}polish: none\nwvt: {{iterations: 8}}"));
    work.run(1, None).unwrap();
    let expected = work.bytes();
    std::fs::remove_file(work.output()).unwrap();
    let error = work.run(1, Some(("wvt", 8))).unwrap_err();
    assert!(matches!(error, Error::InterruptedKept(_)) && !work.output().exists(), "{error}");
    work.scene.checkpoint.resume = Some(work.checkpoint());
    let report = work.run(1, None).unwrap();
    assert!(work.bytes() == expected && report.stages.len() == 1);
}

/// Whichever stage the clock cuts short (the one named, unless the machine is slow), the run goes on to the same bytes.
#[test]
fn a_time_limit_in_any_stage_leaves_a_result_and_a_checkpoint() {
    for (scene, place) in every_stage() {
        let mut work = Work::new(&scene);
        work.run(2, None).unwrap();
        let expected = work.bytes();
        let deadline = Instant::now() + Duration::from_millis(500);
        let observer = |event: Event| {
            if has_come(event, place) {
                std::thread::sleep(deadline.saturating_duration_since(Instant::now()));
            }
        };
        let control = Control { deadline: Some(deadline), observer: &observer, ..Control::default() };
        let report = pipeline::run(&work.scene, sph_formats::FORMATS, &control).unwrap();
        assert_eq!(report.stop, StopReason::TimeLimit, "{place:?}");
        assert!(report.text().contains("UNCONVERGED") && report.text().contains("--resume"), "{}", report.text());
        assert!(work.checkpoint().exists() && work.output().exists(), "{place:?}");
        work.scene.checkpoint.resume = Some(work.checkpoint());
        work.run(2, None).unwrap();
        assert!(work.bytes() == expected, "{place:?}");
    }
}

#[test]
fn without_any_time_the_seeding_is_what_comes_out() {
    let mut work = Work::new(&format!("{DISC}polish: solver\nwvt: {{iterations: 10}}"));
    let control = Control { deadline: Some(Instant::now()), ..Control::default() };
    let report = pipeline::run(&work.scene, sph_formats::FORMATS, &control).unwrap();
    assert_eq!((report.stop, report.stages.len()), (StopReason::TimeLimit, 1));
    assert!(report.plan.left_out.iter().any(|l| l.what == "density solver" && l.why.contains("time was up")));
    let cut = work.bytes();
    work.scene.checkpoint.resume = Some(work.checkpoint());
    work.run(2, None).unwrap();
    assert!(work.bytes() != cut);
}

#[test]
fn an_interrupt_in_any_stage_writes_the_best_state_if_asked_to() {
    for (scene, place) in every_stage() {
        let mut work = Work::new(&scene);
        work.scene.checkpoint = Default::default();
        let error = work.run(2, Some(place)).unwrap_err();
        assert!(matches!(error, Error::Interrupted) && !work.output().exists(), "{error}");
        work.scene.output.on_interrupt = sph_prep::scene::OnInterrupt::Write;
        let report = work.run(2, Some(place)).unwrap();
        assert_eq!(report.stop, StopReason::Interrupted, "{place:?}");
        assert!(report.text().contains("UNCONVERGED"), "{}", report.text());
        assert!(report.text().contains("interrupted") && work.output().exists());
        // The best state of those that a stage watches at each iteration, not the last one.
        let last = report.stages.last().unwrap();
        let lowest = last.history.iter().map(|p| p.epsilon).fold(f64::INFINITY, f64::min);
        assert!(!["wvt", "afc", "trim"].contains(&place.0) || last.epsilon() == Some(lowest), "{place:?}");
        assert_eq!(last.stage.name, place.0);
    }
}

#[test]
fn checkpoints_of_other_runs_are_refused() {
    let mut work = Work::new(&format!("{DISC}polish: none\nwvt: {{iterations: 10}}"));
    work.run(1, Some(("wvt", 3))).unwrap_err();
    work.scene.checkpoint.resume = Some(work.checkpoint());
    work.scene.checkpoint.file = None;
    let refused = |work: &Work, word: &str| {
        let error = work.run(1, None).unwrap_err().to_string();
        let path = work.checkpoint().display().to_string();
        assert!(error.contains(word) && error.contains(&path) && !work.output().exists(), "{error}");
    };
    let same = work.scene.clone();
    work.scene.particles = Some(301);
    refused(&work, "'300', this one's '301'");
    work.scene = same.clone();
    work.scene.wvt.step = 0.3;
    refused(&work, "step: 0.3");
    work.scene = same.clone();
    work.scene.input.expression = Some("1 + 0.5*y".into());
    refused(&work, "1 + 0.5*y");
    work.scene = same;
    work.run(1, None).unwrap();
}

#[test]
fn damaged_checkpoints_are_refused() {
    let mut work = Work::new(&format!("{DISC}polish: solver\nwvt: {{iterations: 2}}\nsolver: {{evaluations: 20}}"));
    work.run(1, Some(("solver", 12))).unwrap_err();
    let whole = std::fs::read(work.checkpoint()).unwrap();
    work.scene.checkpoint.resume = Some(work.checkpoint());
    work.scene.checkpoint.file = None;
    let refused = |bytes: &[u8]| {
        std::fs::write(work.checkpoint(), bytes).unwrap();
        let error = work.run(1, None).unwrap_err();
        assert!(matches!(error, Error::Checkpoint { .. }), "{error}");
        assert!(!work.output().exists());
    };
    for length in [0, 1, 8, 12, 19, 20, 21, 100, whole.len() / 2, whole.len() - 1] {
        refused(&whole[..length]);
    }
    refused(b"# vtk DataFile Version 3.0\nnot a checkpoint at all\n");
    // Past the checksum: every prefix of the content, and sizes that nothing can hold.
    for length in (20..whole.len()).step_by(whole.len() / 25) {
        refused(&sealed(&whole[..length]));
    }
    for at in (20..whole.len().min(4000)).step_by(151) {
        let mut bytes = whole.clone();
        bytes[at..at + 5].fill(0xff);
        std::fs::write(work.checkpoint(), sealed(&bytes)).unwrap();
        // It may still be a state, if not the one that was written; there is no panic and no huge allocation.
        let _ = work.run(1, None);
        let _ = std::fs::remove_file(work.output());
    }
    std::fs::remove_file(work.checkpoint()).unwrap();
    let error = work.run(1, None).unwrap_err().to_string();
    assert!(error.contains("run.checkpoint") && error.contains("read"), "{error}");
}

/// With the checksum that belongs to the content (FNV-1a, 64 bits).
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let hash =
        bytes[20..].iter().fold(0xcbf2_9ce4_8422_2325, |h: u64, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    let mut out = bytes.to_vec();
    out[12..20].copy_from_slice(&hash.to_le_bytes());
    out
}

#[cfg(unix)]
#[test]
fn a_process_killed_in_any_stage_leaves_a_checkpoint_that_goes_on_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let mut resumed = 0;
    for (i, (scene, _)) in every_stage().into_iter().enumerate() {
        let path = folder.path().join(format!("{i}.yaml"));
        std::fs::write(&path, format!("{scene}checkpoint: {{minutes: 0}}\n")).unwrap();
        resumed += killed_and_resumed(folder.path(), &path);
    }
    assert!(resumed >= every_stage().len(), "only {resumed} attempts left a checkpoint");
}

/// Kills runs of the scene at several times; how many went on from a checkpoint, to the bytes of a whole run.
#[cfg(unix)]
fn killed_and_resumed(folder: &Path, scene: &Path) -> usize {
    use std::process::{Command, Stdio};
    let text = |path: &Path| path.display().to_string();
    let run = |output: &Path, more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sph-prep"));
        command.args(["--scene", &text(scene), "--out", &text(output), "-n", "1000", "--threads", "1"]).args(more);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let (whole, cut) = (folder.join("whole.vtu"), folder.join("cut.vtu"));
    assert!(run(&whole, &[]).status().unwrap().success());
    let mut resumed = 0;
    for attempt in 0..2_u64 {
        let checkpoint = folder.join("killed.checkpoint");
        let mut child = run(&cut, &["--checkpoint", &text(&checkpoint)]).spawn().unwrap();
        // As soon as there is one, and later each time.
        for _ in 0..5000 {
            if checkpoint.exists() || child.try_wait().unwrap().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(30 * attempt));
        child.kill().unwrap();
        child.wait().unwrap();
        if checkpoint.exists() {
            let output = run(&cut, &["--resume", &text(&checkpoint)]).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            assert!(!checkpoint.exists(), "a finished run leaves no checkpoint");
            resumed += 1;
        } else if !cut.exists() {
            continue;
        }
        assert!(std::fs::read(&whole).unwrap() == std::fs::read(&cut).unwrap(), "{}", scene.display());
        std::fs::remove_file(&cut).unwrap();
    }
    resumed
}
