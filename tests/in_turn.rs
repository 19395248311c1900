//! Runs block by block: what they leave is what the particles have when all are looked at together, is no worse at the seams than elsewhere, and does not
//! depend on breaks or threads.

use crate::cases::first;
use crate::cli::support::Folder;
use crate::ranks::{CLOUD, GAUSSIAN, UNIFORM};
use sph_formats::{FORMATS, FieldRequest, FileContent};
use sph_prep::metrics::Measured;
use sph_prep::relaxation::{Event, StopReason};
use sph_prep::run::in_turn::{InTurn, InTurnReport, run_in_turn};
use sph_prep::{Control, Error, Scene};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

const STAR: &str = "input: {profile: {polytrope: {n: 1.5, mass: 1 Msun, radius: 1 Rsun}}}\nparticles: 8000\n";
const WAVE: &str =
    "input: {expression: '1 + 0.5*sin(2*pi*x)'}\ndomain: {box: [[0], [1]], boundary: [periodic]}\nparticles: 6000\n";
const WALLS: &str = "input: {expression: '2 + x - y'}\ndomain: {box: [[0, 0], [1, 1]], boundary: [reflecting, open]}\nparticles: 6000\n";

/// With as many particles as it takes to see whether runs end alike.
pub fn few(text: &str) -> String {
    text.replace("particles: 8000", "particles: 4000")
}

struct Work {
    folder: Folder,
    scene: Scene,
}

impl Work {
    fn new(text: &str) -> Self {
        let folder = Folder::new();
        let mut scene = Scene::parse(text).unwrap();
        scene.output.file = Some(folder.path("out/ic.hdf5"));
        scene.output.double_precision = true;
        Self { folder, scene }
    }

    fn run(&self, blocks: usize, control: &Control<'_>) -> sph_prep::Result<InTurnReport> {
        run_in_turn(&self.scene, FORMATS, control, InTurn { blocks, folder: &self.folder.path("blocks") })
    }

    fn ran(&self, blocks: usize) -> InTurnReport {
        self.run(blocks, &Control::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    fn refused(&self, blocks: usize) -> String {
        self.run(blocks, &Control::default()).unwrap_err().to_string()
    }

    /// Ends when a stage of this name has come to an iteration in so many blocks.
    fn interrupted(&self, blocks: usize, (name, at, times): (&str, usize, usize)) -> Error {
        let (interrupted, seen, last) = (AtomicBool::new(false), AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
        let observer = |event: Event| {
            let Event::Iteration { stage, iteration, .. } = event else { return };
            // Some numbers are left out where a step takes several evaluations.
            let before = last.swap(iteration, Relaxed);
            let is_there = stage.name == name && iteration >= at && (before < at || before > iteration);
            if is_there && seen.fetch_add(1, Relaxed) + 1 == times {
                interrupted.store(true, Relaxed);
            }
        };
        let control = Control { interrupted: &interrupted, observer: &observer, ..Control::default() };
        self.run(blocks, &control).unwrap_err()
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(self.folder.path("out/ic.hdf5")).unwrap()
    }

    /// Columns of the file.
    fn columns(&self) -> impl Fn(&str) -> Vec<f64> {
        let path = self.folder.path("out/ic.hdf5");
        let content = sph_formats::read(FORMATS, &path, None, &FieldRequest::default()).unwrap();
        let FileContent::Particles(file) = content else { panic!("particles") };
        move |name| file.species[0].table.column(name).unwrap_or_else(|| panic!("no {name}")).values.to_f64()
    }
}

/// Against sums over all particles of the file at once, in their own units.
fn is_what_the_particles_have<const D: usize>(work: &Work, report: &InTurnReport, domain: &sph::domain::Domain<D>) {
    let columns = work.columns();
    let (x, masses, density) = (columns("Coordinates"), columns("Masses"), columns("Density"));
    let n = masses.len();
    let total: f64 = masses.iter().sum();
    assert!(n == report.particles && (total / report.mass.total - 1.0).abs() < 1e-12);
    let mut ids = columns("ParticleIDs");
    ids.sort_by(f64::total_cmp);
    assert!(ids.iter().enumerate().all(|(i, id)| *id == i as f64 + 1.0));
    let positions = std::array::from_fn(|k| x.chunks(x.len() / n).map(|row| row[k]).collect());
    let guess = vec![2.0 * (domain.volume() / n as f64).powf(1.0 / D as f64); n];
    let kernel = work.scene.kernel();
    let measured = Measured::new(kernel, domain, &positions, &masses, &guess, report.kernel_neighbors);
    for (i, (found, expected)) in density.iter().zip(&measured.sums).enumerate() {
        // On a line, single precision resolves no more of a spacing where a leaf has particles at both ends of it.
        assert!((found / expected.weighted - 1.0).abs() < 3e-4, "{i}: {found}, all together {}", expected.weighted);
    }
    let nearest = measured.nearest_over_spacing(domain).into_iter().fold(f64::INFINITY, f64::min);
    assert!((nearest / report.figures.closest_pair - 1.0).abs() < 1e-3, "{nearest} {}", report.figures.closest_pair);
}

#[test]
fn blocks_leave_what_one_run_would() {
    let scenes = [
        ("wave", WAVE, 5, 1e-3),
        ("walls", WALLS, 2, 3e-3),
        ("star", STAR, 2, 5e-3),
        ("gaussian", GAUSSIAN, 4, 3e-3),
        ("uniform", UNIFORM, 3, 2e-3),
    ];
    for (name, text, blocks, figure) in first(3, scenes) {
        let work = Work::new(text);
        let report = work.ran(blocks);
        let interior = report.figures.interior.unwrap().refitted;
        assert!(interior.mean < figure, "{name}: {:e}", interior.mean);
        assert!(report.figures.closest_pair > 0.5, "{name}: {}", report.figures.closest_pair);
        // Those at seams move with both blocks.
        let [near, rest] = report.figures.seams.unwrap();
        assert!(near < 1.35 * rest + 3e-4, "{name}: {near:e} at seams, {rest:e} elsewhere");
        assert!(report.passes.len() >= report.plan.stages.len(), "{name}: {:?}", report.passes);
        assert!(!work.folder.path("blocks").exists(), "{name}: the blocks are left");
    }
}

/// Where the target's own densities would move mass, as of one run.
#[test]
#[ignore = "slow: .ci/full runs it"]
fn blocks_have_their_mass_in_place_where_a_target_is_steep() {
    let scene = "input: {expression: '1 + 99*exp(-30*((x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2))'}\n\
                 domain: {box: [[0, 0, 0], [1, 1, 1]], boundary: [open]}\nparticles: 6000\n";
    let report = Work::new(scene).ran(3);
    assert!(report.plan.aims_at_mass && report.figures.ledger.in_place > 0.9, "{}", report.figures.ledger.in_place);
    let smoothed = report.figures.smoothed.as_given;
    assert!(smoothed.particles == 6000 && smoothed.mean < 0.02, "{smoothed:?}");
    let [near, rest] = report.figures.seams.unwrap();
    assert!(near < 1.25 * rest, "{near:e} at seams, {rest:e} elsewhere");
}

#[test]
fn figures_are_those_of_all_particles_together() {
    use sph::domain::{Axis, Domain, Region};
    let cube = |axis| Domain { lo: [0.0; 3], hi: [1.0; 3], axes: [axis; 3], region: Region::Box };
    let work = Work::new(&few(UNIFORM));
    let report = work.ran(4);
    is_what_the_particles_have::<3>(&work, &report, &cube(Axis::Periodic));
    let line = Domain { lo: [0.0], hi: [1.0], axes: [Axis::Periodic], region: Region::Box };
    let work = Work::new(WAVE);
    let report = work.ran(5);
    is_what_the_particles_have::<1>(&work, &report, &line);
}

#[test]
fn one_block_is_all_there_is() {
    let work = Work::new(&few(GAUSSIAN));
    let report = work.ran(1);
    assert!(report.figures.seams.is_none() && report.figures.interior.unwrap().refitted.mean < 2e-3);
}

/// What a layer within which the density changes by far more than particles show leaves at the seams.
const STEEP: &str = "input: {expression: '1 + 50*(0.5+0.5*tanh((x+0.5*y-0.7)/0.003))'}\n\
    domain: {box: [[0, 0], [1, 1]], boundary: reflecting}\nparticles: 20000\n";

#[test]
#[ignore = "slow: .ci/full runs it"]
fn blocks_do_not_end_with_pairs_that_they_did_not_have() {
    let report = Work::new(STEEP).ran(4);
    assert!(report.figures.closest_pair > 0.3, "{}", report.figures.closest_pair);
}

/// Interrupted in any pass, a run goes on to the bytes of one without a break, with any number of threads.
#[test]
fn breaks_and_threads_change_nothing() {
    let work = Work::new(&few(GAUSSIAN));
    work.ran(3);
    let expected = work.bytes();
    let work = Work::new(&few(GAUSSIAN));
    for place in [("wvt", 2, 2), ("wvt", 1, 2), ("solver", 4, 1), ("solver", 3, 2), ("solver", 2, 3)] {
        let error = work.interrupted(3, place);
        assert!(matches!(&error, Error::InterruptedIn(folder) if folder.is_dir()), "{place:?}: {error}");
        assert!(!work.folder.path("out/ic.hdf5").exists());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| work.ran(3));
    assert!(work.bytes() == expected, "other bytes than without a break");
}

#[test]
fn a_time_limit_leaves_what_there_is() {
    let work = Work::new(&few(UNIFORM));
    let control = Control { deadline: Some(std::time::Instant::now()), ..Control::default() };
    let report = work.run(3, &control).unwrap();
    assert!(report.stop == StopReason::TimeLimit && report.passes.is_empty(), "{:?}", report.passes);
    assert!(report.figures.all.refitted.mean > 0.01 && work.folder.path("out/ic.hdf5").exists());
    let report = work.ran(3);
    assert!(!report.stop.is_cut() && report.passes.len() >= 2 && !work.folder.path("blocks").exists());
}

/// A block that is cut short begins anew when the run goes on.
#[test]
fn a_time_limit_within_a_block_changes_nothing_in_the_end() {
    let work = Work::new(&few(GAUSSIAN));
    work.ran(3);
    let expected = work.bytes();
    let work = Work::new(&few(GAUSSIAN));
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(1);
    let observer = |event: Event| {
        if matches!(event, Event::Iteration { stage, iteration: 3.., .. } if stage.name == "solver") {
            std::thread::sleep(deadline.saturating_duration_since(std::time::Instant::now()));
        }
    };
    let control = Control { deadline: Some(deadline), observer: &observer, ..Control::default() };
    assert_eq!(work.run(3, &control).unwrap().stop, StopReason::TimeLimit);
    work.ran(3);
    assert!(work.bytes() == expected, "other bytes than without a limit");
}

#[test]
fn what_is_not_done_block_by_block_is_refused() {
    let refused = |text: &str, blocks: usize, words: &str| {
        let work = Work::new(text);
        let error = work.refused(blocks);
        assert!(error.contains(words), "{text}: {error}");
        assert!(!work.folder.path("blocks").exists() && work.folder.outputs().is_empty(), "{text}");
    };
    refused(CLOUD, 2, "has regions");
    refused(UNIFORM, 9, "too few for 9 blocks");
    refused(&format!("{UNIFORM}balance: {{}}\n"), 2, "balance: is not done block by block");
    refused(&format!("{UNIFORM}checkpoint: {{file: a}}\n"), 2, "checkpoint");
    refused(&format!("{UNIFORM}output: {{on_interrupt: write}}\n"), 2, "output.on_interrupt");
    refused(&format!("{UNIFORM}seeding: random\n"), 2, "does not go block by block; use mass-bisection");
    refused(
        "input: {expression: '1'}\ndomain: {ball: {center: [0, 0], radius: 1}, boundary: [reflecting]}\nparticles: 8000\n",
        2,
        "curved surface",
    );
}

/// Blocks of another run, or in another number, are not gone on from; damaged ones are named.
#[test]
fn blocks_of_other_runs_are_refused() {
    let mut work = Work::new(&few(GAUSSIAN));
    work.interrupted(3, ("wvt", 1, 2));
    let error = work.refused(4);
    assert!(error.contains("in 3 blocks"), "{error}");
    let path = work.folder.path("blocks/block.1");
    let whole = std::fs::read(&path).unwrap();
    for (bytes, words) in [
        (&whole[..whole.len() - 1], "cut off or damaged"),
        (&[][..], "no block"),
        (b"nothing of ours at all", "no block"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let error = work.refused(3);
        assert!(error.contains("block.1") && error.contains(words), "{words}: {error}");
    }
    // One that is gone, which there was.
    std::fs::remove_file(&path).unwrap();
    let error = work.refused(3);
    assert!(error.contains("lacks block 1") && error.contains("remove the folder"), "{error}");
    std::fs::write(&path, whole).unwrap();
    // Another run that is under way there.
    let lock = std::fs::File::open(work.folder.path("blocks/lock")).unwrap();
    lock.lock().unwrap();
    let error = work.refused(3);
    assert!(error.contains("in use by another run"), "{error}");
    lock.unlock().unwrap();
    work.scene.seed = 5;
    let error = work.refused(3);
    assert!(error.contains("another run") && error.contains("seed"), "{error}");
    work.scene.seed = 0;
    work.ran(3);
}
