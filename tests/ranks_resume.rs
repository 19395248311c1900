//! Checkpoints of several ranks: whatever ends a run, it goes on from the last, with as many ranks to the bit, or with others.

use crate::cases::first;
use crate::cli::support::Folder;
use crate::in_turn::few;
use crate::ranks::{CLOUD, GAUSSIAN, UNIFORM, on};
use sph::exchange::{Exchange, together};
use sph_formats::FORMATS;
use sph_prep::relaxation::{Event, StopReason};
use sph_prep::run::ranks::run_on_ranks;
use sph_prep::{Control, Error, Report, Scene};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// Where a run is to end: after an iteration of a stage.
type Place = (&'static str, usize);

struct Work {
    folder: Folder,
    scene: Scene,
}

impl Work {
    fn new(text: &str) -> Self {
        let folder = Folder::new();
        let text = format!("{text}wvt: {{iterations: 12}}\nsolver: {{evaluations: 30}}\n");
        let mut scene = Scene::parse(&text.replace("particles: 8000", "particles: 1500")).unwrap();
        scene.output.file = Some(folder.path("out/ic.hdf5"));
        scene.output.double_precision = true;
        scene.checkpoint.file = Some(folder.path("kept/run"));
        ["out", "kept"].iter().for_each(|name| std::fs::create_dir_all(folder.path(name)).unwrap());
        Self { folder, scene }
    }

    fn kept(&self) -> Vec<PathBuf> {
        let mut all: Vec<PathBuf> =
            std::fs::read_dir(self.folder.path("kept")).unwrap().map(|entry| entry.unwrap().path()).collect();
        all.sort();
        all
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(self.folder.path("out/ic.hdf5")).unwrap()
    }

    fn resumed(&self) -> Self {
        let mut scene = self.scene.clone();
        scene.checkpoint.resume = scene.checkpoint.file.clone();
        Self { folder: Folder::new(), scene }
    }

    /// Runs on so many ranks; one of them is interrupted at a place if there is one.
    fn run(&self, ranks: usize, interrupt: Option<(usize, Place)>) -> Vec<sph_prep::Result<Report>> {
        on(ranks, |exchange| {
            let interrupted = AtomicBool::new(false);
            let observer = |event: Event| {
                if interrupt.is_some_and(|(rank, place)| rank == exchange.rank() && has_come(event, place)) {
                    interrupted.store(true, Relaxed);
                }
            };
            let control = Control { interrupted: &interrupted, observer: &observer, ..Control::default() };
            run_on_ranks(&self.scene, FORMATS, &control, exchange)
        })
    }

    /// Runs on so many ranks, of which one ends all at a place.
    fn killed(&self, ranks: usize, (lost, place): (usize, Place)) {
        let ended = together(ranks, 1, |exchange: &dyn Exchange| {
            let observer = |event: Event| assert!(exchange.rank() != lost || !has_come(event, place), "lost");
            let control = Control { observer: &observer, ..Control::default() };
            run_on_ranks(&self.scene, FORMATS, &control, exchange).map(|_| ())
        });
        assert!(ended.unwrap_err().contains("lost"));
        assert!(!self.folder.path("out/ic.hdf5").exists());
    }
}

fn has_come(event: Event, (name, at): Place) -> bool {
    matches!(event, Event::Iteration { stage, iteration, .. } if stage.name == name && iteration >= at)
}

#[test]
fn ranks_go_on_to_the_bit_where_they_were_interrupted() {
    for text in [UNIFORM, GAUSSIAN] {
        let mut work = Work::new(&few(text));
        work.run(3, None).into_iter().for_each(|report| drop(report.unwrap()));
        let expected = work.bytes();
        assert!(work.kept().is_empty(), "a finished run leaves no checkpoint: {:?}", work.kept());
        std::fs::remove_file(work.folder.path("out/ic.hdf5")).unwrap();
        for (lost, place) in [(0, ("wvt", 0)), (2, ("wvt", 5)), (1, ("solver", 9)), (0, ("solver", 20))] {
            for ended in work.run(3, Some((lost, place))) {
                let error = ended.unwrap_err();
                assert!(matches!(error, Error::InterruptedKept(_)), "{place:?}: {error}");
            }
            assert_eq!(work.kept().len(), 4, "{:?}", work.kept());
            work.scene.checkpoint.resume = work.scene.checkpoint.file.clone();
        }
        work.run(3, None).into_iter().for_each(|report| drop(report.unwrap()));
        assert!(work.bytes() == expected, "other bytes than without an interrupt");
        assert!(work.kept().is_empty(), "{:?}", work.kept());
    }
}

/// A rank that dies at any place leaves a whole checkpoint, from which a run goes on to the bytes of one in which none died: where bodies are
/// relaxed by themselves, from the start of the stage.
#[test]
fn ranks_go_on_to_the_bit_where_one_died() {
    let all =
        [(GAUSSIAN, 0, ("solver", 7)), (CLOUD, 2, ("wvt", 2)), (UNIFORM, 1, ("wvt", 4)), (CLOUD, 0, ("solver", 11))];
    for (text, lost, place) in first(2, all) {
        let mut work = Work::new(&few(text));
        work.run(3, None).into_iter().for_each(|report| drop(report.unwrap()));
        let expected = work.bytes();
        std::fs::remove_file(work.folder.path("out/ic.hdf5")).unwrap();
        // At every step.
        work.scene.checkpoint.minutes = 0.0;
        work.killed(3, (lost, place));
        // One more may be begun.
        assert!((4..=7).contains(&work.kept().len()), "{:?}", work.kept());
        work.scene.checkpoint.resume = work.scene.checkpoint.file.clone();
        work.run(3, None).into_iter().for_each(|report| drop(report.unwrap()));
        assert!(work.bytes() == expected, "{place:?}: other bytes than if none had died");
        let left: Vec<_> = work.kept();
        assert!(left.len() <= 3 && left.iter().all(|path| !path.ends_with("run")), "{left:?}");
    }
}

#[test]
fn another_number_of_ranks_goes_on_with_the_particles() {
    let stops = [(UNIFORM, ("wvt", 7), (3, 2)), (GAUSSIAN, ("solver", 15), (2, 1)), (CLOUD, ("solver", 15), (1, 4))];
    for (text, place, (earlier, later)) in stops {
        let mut whole = Work::new(&few(text));
        whole.scene.checkpoint.file = None;
        let whole = whole.run(3, None).remove(0).unwrap();
        let work = Work::new(&few(text));
        work.run(earlier, Some((0, place))).into_iter().for_each(|ended| drop(ended.unwrap_err()));
        let resumed = work.resumed();
        let report = resumed.run(later, None).remove(0).unwrap();
        assert_eq!(report.particles, whole.particles);
        assert_eq!(report.stages.len(), 2, "{:?}", report.stages);
        let [now, then] = [&report, &whole].map(|r| r.density_error.stated().mean);
        assert!(now < 1.3 * then + 1e-3, "{place:?}, {earlier} to {later} ranks: {now:e}, {then:e} in one run");
        let regions = report.ledger.regions.iter();
        regions.for_each(|r| assert!((r.found - r.wanted).abs() < 1.0, "{earlier} to {later} ranks: {r:?}"));
    }
}

#[test]
fn what_time_cuts_short_is_kept() {
    for text in [UNIFORM, CLOUD] {
        let mut work = Work::new(&few(text));
        work.scene.output.on_interrupt = sph_prep::scene::OnInterrupt::Write;
        let report = work.run(3, Some((1, ("solver", 10)))).remove(0).unwrap();
        assert_eq!(report.stop, StopReason::Interrupted);
        assert!(report.notes.iter().any(|note| note.contains("--resume")), "{:?}", report.notes);
        assert_eq!(work.kept().len(), 4, "{:?}", work.kept());
        let report = work.resumed().run(3, None).remove(0).unwrap();
        assert!(!report.stop.is_cut());
    }
}

/// Where the place for checkpoints is lost, an interrupt says so, on one rank and on several.
#[test]
fn what_could_not_be_kept_is_told() {
    for ranks in [1, 3] {
        let work = Work::new(&few(UNIFORM));
        let ended = on(ranks, |exchange| {
            let interrupted = AtomicBool::new(false);
            let observer = |event: Event| {
                if exchange.rank() == 0 && has_come(event, ("wvt", 5)) {
                    drop(std::fs::remove_dir_all(work.folder.path("kept")));
                    interrupted.store(true, Relaxed);
                }
            };
            let control = Control { interrupted: &interrupted, observer: &observer, ..Control::default() };
            match ranks {
                1 => sph_prep::run(&work.scene, FORMATS, &control),
                _ => run_on_ranks(&work.scene, FORMATS, &control, exchange),
            }
        });
        for ended in ended {
            let error = ended.unwrap_err();
            assert!(matches!(&error, Error::InterruptedUnkept(told) if !told.contains("--resume")), "{error}");
        }
    }
}

/// One rank that goes on from the parts of several leaves none of them behind.
#[test]
fn parts_are_removed_by_a_run_without_ranks() {
    let work = Work::new(&few(UNIFORM));
    work.run(3, Some((0, ("wvt", 3)))).into_iter().for_each(|ended| drop(ended.unwrap_err()));
    let resumed = work.resumed();
    resumed.run(1, Some((0, ("solver", 3)))).into_iter().for_each(|ended| drop(ended.unwrap_err()));
    assert_eq!(work.kept(), [work.folder.path("kept/run")]);
}

/// Damaged, missing and foreign parts are named, and so is a checkpoint of another run; the ranks all end.
#[test]
fn parts_that_do_not_belong_are_refused() {
    let work = Work::new(&few(UNIFORM));
    work.run(3, Some((0, ("wvt", 3)))).into_iter().for_each(|ended| drop(ended.unwrap_err()));
    let kept = work.kept();
    let original: Vec<Vec<u8>> = kept.iter().map(|path| std::fs::read(path).unwrap()).collect();
    let spoil: [(usize, &dyn Fn(&[u8]) -> Option<Vec<u8>>, &str); 6] = [
        (0, &|b| Some(b[..b.len() - 1].to_vec()), "cut off or damaged"),
        (0, &|b| Some(b[..9].to_vec()), "cut off"),
        (2, &|_| None, "cannot be read"),
        (3, &|b| Some(b[..b.len() / 2].to_vec()), "cut off or damaged"),
        (1, &|b| Some([&b[..12], &[1; 8], &b[20..]].concat()), "belongs to another checkpoint"),
        (2, &|_| Some(Vec::new()), "belongs to another checkpoint"),
    ];
    for (file, spoiled, words) in spoil {
        match spoiled(&original[file]) {
            Some(bytes) => std::fs::write(&kept[file], bytes).unwrap(),
            None => std::fs::remove_file(&kept[file]).unwrap(),
        }
        for ranks in [3, 2] {
            let errors: Vec<String> =
                work.resumed().run(ranks, None).into_iter().map(|ended| ended.unwrap_err().to_string()).collect();
            assert!(errors.iter().all(|e| e.contains(words)), "{words}: {errors:?}");
        }
        std::fs::write(&kept[file], &original[file]).unwrap();
    }
    let mut other = work.resumed();
    other.scene.seed = 99;
    let error = other.run(3, None).remove(0).unwrap_err().to_string();
    assert!(error.contains("another run") && error.contains("seed"), "{error}");
}
