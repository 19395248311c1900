//! Grades the figures of a report one by one and writes the lines of the verdict.

use super::report::{MassReport, MaterialShare, Report, SnapshotReport};
use super::turning::carried;
use super::verdict::{Finding, Grade, Topic, ending};
use crate::field::Scatter;
use crate::input::atmosphere::Cut;
use crate::metrics::{BIAS, LedgerFigures};
use crate::relaxation::{BALANCE, Certificate, CertificateVerdict, StopReason, TRIMMING};
use sph::kernel::{KernelName, makes_pairs};

/// Net force over gravity that leaves a body almost still.
const LITTLE_FORCE: f64 = 0.01;
/// The same with which it moves.
const MUCH_FORCE: f64 = 0.1;
/// Share of internal energies whose change leaves a body as it is.
const LITTLE_HEAT: f64 = 0.01;
/// Relative differences of masses that are rounding.
const SAME_MASS: f64 = 1e-9;
/// Relative difference of all particles' mass from the input's.
const LOST_MASS: f64 = 1e-6;
/// Relative error of the total mass that is a tenth of what densities may be off by and still be good, and that which is as much.
const WELL_KNOWN: f64 = 1e-3;
const HARDLY_KNOWN: f64 = 1e-2;
/// Force noise of an interior whose profile changes within a spacing.
const UNRESOLVED: f64 = 0.5;

/// Root mean square of the noise over the median from which on a few particles make it.
const OF_FEW: f64 = 5.0;

/// Good up to the first, bad from the second on.
fn grade(value: f64, good: f64, bad: f64) -> Grade {
    match value {
        v if v <= good => Grade::Good,
        v if v < bad => Grade::Look,
        _ => Grade::Bad,
    }
}

/// On what a snapshot is good for.
fn of_snapshot(snapshot: &SnapshotReport) -> Vec<Finding> {
    let mut all = Vec::new();
    if let Some(Scatter { values, field }) = snapshot.scatter {
        let graded = grade(field, 0.01, 0.05);
        let remedy = match graded {
            Grade::Good => "",
            _ => "; more particles do not reduce this, a snapshot with less noise does",
        };
        let text = format!(
            "its densities scatter by {:.2} % about a smooth field, which is known to {:.2} % (1 % is good, 5 % is \
             much){remedy}",
            100.0 * values,
            100.0 * field
        );
        all.push(Finding::new(graded, Topic::Snapshot, text));
    }
    if let Some(change) = snapshot.conserved.as_ref().and_then(|c| c.energy_factor).map(|f| (f - 1.0).abs())
        && change > LITTLE_HEAT
    {
        let text = format!(
            "internal energies were changed by {:.1} % to keep the total energy (1 % is good): mass has moved, as it \
             does beside sharp surfaces, or motions were not resolved",
            100.0 * change
        );
        all.push(Finding::new(grade(change, LITTLE_HEAT, 0.1), Topic::Snapshot, text));
    }
    let change = |m: &&MaterialShare| (m.particles - m.snapshot).abs();
    if let Some(worst) = snapshot.materials.iter().max_by(|a, b| change(a).total_cmp(&change(b))) {
        let graded = grade(change(&worst), 0.005, 0.02);
        let remedy = match graded {
            Grade::Good => "",
            _ => {
                "; its densities are smooth across surfaces, so mass moves across them: start from the bodies' own \
                 profiles where possible"
            }
        };
        let text = format!(
            "material {} has {:.2} % of the mass, and had {:.2} % (a change of 0.5 is good, 2 is much){remedy}",
            worst.material,
            100.0 * worst.particles,
            100.0 * worst.snapshot
        );
        all.push(Finding::new(graded, Topic::Snapshot, text));
    }
    if let Some(conserved) = snapshot.conserved.as_ref().filter(|c| !c.is_energy_kept) {
        let heat = match conserved.energy_factor {
            None => "no internal energy that could absorb them",
            Some(_) => "too little internal energy to absorb them",
        };
        let text = format!(
            "the sum of kinetic and internal energy differs from that of the snapshot, which has motions that these \
             particles do not resolve, and {heat}"
        );
        all.push(Finding::new(Grade::Look, Topic::Snapshot, text));
    }
    all
}

/// Whether the particles stay still, where they were followed.
fn of_certificate(certificate: &Certificate, is_settled: bool) -> (Grade, String) {
    let (verdict, [unit, _]) = (certificate.verdict(), certificate.units());
    let graded = match verdict {
        CertificateVerdict::Quiet | CertificateVerdict::Flows => Grade::Good,
        CertificateVerdict::Settles | CertificateVerdict::Unknown => Grade::Look,
        CertificateVerdict::Moves => Grade::Bad,
    };
    let does = match verdict {
        CertificateVerdict::Quiet => "is quiet",
        CertificateVerdict::Unknown => "is not known",
        other => other.name(),
    };
    let remedy = match graded {
        Grade::Good => "",
        _ if verdict == CertificateVerdict::Unknown => "; it was followed too briefly; allow more time",
        _ if certificate.has_gravity && is_settled => {
            "; a longer `settle`, a kernel that prevents pairing, or more particles reduces the motion"
        }
        _ if certificate.has_gravity => {
            "; a kernel that prevents pairing, more `balance.evaluations`, or `settle` reduces the motion"
        }
        _ => "; a kernel that prevents pairing, more particles, or more `balance.evaluations` reduces the motion",
    };
    let kinetic = certificate.kinetic;
    (
        graded,
        format!("it {does}, with a kinetic energy of {kinetic:.1e} of {unit} (1e-5 is good, 1e-3 is much){remedy}"),
    )
}

/// Whether particles have the masses that were asked for; nothing where all have the same, as by default.
fn masses(report: &Report) -> Option<(Grade, String)> {
    let mass = &report.mass;
    if mass.defect.abs() > LOST_MASS {
        let text = format!(
            "the sum of particle masses exceeds the input's mass by a fraction of {:.3e} (1e-6 is good); the result is \
             not the input's body",
            mass.defect
        );
        return Some((Grade::Bad, text));
    }
    let spread = mass.largest / mass.smallest - 1.0;
    match (mass.off, spread) {
        (off, _) if off > SAME_MASS => {
            let remedy = match report.stages.iter().any(|s| s.stage == TRIMMING) {
                true => "leave out `trim_masses` to keep the requested masses",
                false => "masses of new particles are adjusted so that the density is right beside the particles kept",
            };
            let text =
                format!("masses differ by up to {:.2} % from those requested (1 % is good); {remedy}", 100.0 * off);
            Some((grade(off, 0.01, f64::INFINITY), text))
        }
        (_, spread) if spread > SAME_MASS => {
            let text = format!("the largest is {:.3} times the smallest, as `resolution` requires", 1.0 + spread);
            Some((Grade::Good, text))
        }
        _ => None,
    }
}

/// What reduces a density error. Where most of it is one common `factor`, which comes from the self-contribution of each particle to its sum, neither
/// more particles nor another arrangement do; elsewhere `more` do.
fn density_remedy(factor: Option<f64>, more: &str) -> String {
    let Some(factor) = factor else { return format!("; {more} reduce it") };
    let percent = 100.0 * factor;
    if factor.abs() > BIAS {
        return format!(
            "; {percent:+.2} % is the same everywhere, more than the self-contribution of each particle to its \
             density: some mass is where the target has none, or is missing where the target has some"
        );
    }
    format!(
        "; {percent:+.2} % is the same everywhere: the self-contribution of each particle to its density, which \
         simulation codes include as well. It causes no motion, and more `neighbors` reduce it"
    )
}

/// The factor on all densities, less 1, that is most of a density error of `mean`, where the interior, if there is one, has this common one.
fn one_factor(of_interior: Option<f64>, mean: f64) -> Option<f64> {
    let factor = 1.0 / of_interior? - 1.0;
    let is_most = (factor.abs() - mean).abs() < MOSTLY_ONE_FACTOR * mean;
    is_most.then_some(factor)
}

/// On the mean deviation from the target as the kernel sees it, with the common factor of the interior.
fn density_as_seen(mean: f64, of_interior: Option<f64>, more: &str) -> (Grade, String) {
    let (mut graded, mut text) = density(mean);
    let factor = one_factor(of_interior, mean);
    if graded != Grade::Good {
        text.push_str(&density_remedy(factor, more));
    }
    if graded == Grade::Look && factor.is_some_and(|factor| factor.abs() <= BIAS) {
        graded = Grade::Good;
    }
    (graded, text)
}

/// What places mass and density better, as far as it has not been done.
fn more(report: &Report) -> &'static str {
    match report.renewed {
        Some(_) => "a finer snapshot and a wider `refine.shell`",
        None if report.plan.takes_a_solver() => "more particles or `polish: solver`",
        None => "more particles",
    }
}

/// Whether the result of the balance is another state than that which it began with.
fn changed_anything(report: &Report) -> bool {
    let mut of_balance = report.stages.iter().filter(|stage| stage.stage == BALANCE);
    of_balance.any(|stage| stage.history.first().is_none_or(|first| first.iteration != stage.best_iteration))
}

/// Whether the kernel counts more neighbors than keep particles apart.
fn is_crowded(report: &Report) -> bool {
    let neighbors = report.neighbors.kernel_neighbors;
    KernelName::titled(report.kernel).is_some_and(|kernel| makes_pairs(kernel, report.dimension, neighbors))
}

/// What the mean error and the factor on all densities may differ by, as a part of the mean error, where the factor is most of it.
const MOSTLY_ONE_FACTOR: f64 = 0.25;

/// On the share of the mass that is in place; `more` improve it.
fn mass_in_place(share: f64, more: &str) -> (Grade, String) {
    let (grade, remedy) = match share {
        v if v >= 0.95 => (Grade::Good, String::new()),
        v if v >= 0.5 => (Grade::Look, format!("; {more} improve it")),
        _ => (Grade::Bad, "; the result is not the input's body: use more particles, or another seeding".into()),
    };
    (grade, format!("{:.1} % (95 % is good){remedy}", 100.0 * share))
}

/// On the share of the mass that is in place where most particles are those of the snapshot.
fn of_few_boxes(share: f64) -> String {
    format!(
        "{:.1} % (95 % is good); most particles are the snapshot's own, and box faces cut through them; the new ones \
         are judged by density",
        100.0 * share
    )
}

/// On the mean deviation of the density.
fn density(mean: f64) -> (Grade, String) {
    (grade(mean, 0.01, 0.05), format!("{:.2} % off on average (1 % is good, 5 % is much)", 100.0 * mean))
}

/// On the closest two particles, in spacings.
fn pairs(apart: f64, kernel: &str) -> (Grade, String) {
    let graded = grade(-apart, -0.5, -0.25);
    let remedy = match graded {
        Grade::Good => "",
        _ if kernel.starts_with("Wendland") => "; fewer neighbors keep particles farther apart",
        _ => "; fewer neighbors or a Wendland kernel prevent pairing",
    };
    (graded, format!("the closest are {apart:.3} spacings apart (0.5 is good){remedy}"))
}

/// The verdict on particles of several bodies together: how close they have come while they settled, if they did, what their spins do to them, and what
/// is probably not meant.
pub fn verdict_on_all(closest_pair: Option<(f64, &str)>, turning: &[Finding], warnings: &[String]) -> Vec<Finding> {
    let of_pairs = closest_pair.map(|(apart, kernel)| {
        let (grade, text) = pairs(apart, kernel);
        Finding::new(grade, Topic::Pairs, format!("after settling {text}"))
    });
    of_pairs.into_iter().chain(turning.iter().cloned()).chain(warned(warnings)).collect()
}

/// Distance of a region's particles from it as a whole, in spacings.
const LITTLE_SHIFT: f64 = 0.1;
const MUCH_SHIFT: f64 = 0.3;

/// On how well the mass of the input is known, where that is not well enough.
fn total_mass(known: f64) -> Option<(Grade, String)> {
    let text = format!(
        "known to {known:.1e} (1e-3 is good, 1e-2 is much), as are the particle masses; bound the density at poles, \
         for instance by max(r, 1e-3), and leave out structure that is finer than the particle spacing"
    );
    (!(known <= WELL_KNOWN)).then(|| (grade(known, WELL_KNOWN, HARDLY_KNOWN), text))
}

/// What is known of particles that were placed block by block.
pub struct Few<'a> {
    pub ledger: &'a LedgerFigures,
    /// Mean deviation from the target as the kernel sees it, and the common factor on the densities of the interior, if there is one.
    pub mean: f64,
    pub of_interior: Option<f64>,
    /// The figure that a tolerance bounds.
    pub epsilon: f64,
    pub closest_pair: f64,
    pub kernel: &'a str,
    pub mass: &'a MassReport,
    pub atmosphere: Option<Cut>,
    pub stop: StopReason,
    pub tolerance: Option<f64>,
    pub warnings: &'a [String],
}

/// The verdict on particles of which no more is known than this.
pub fn verdict_on_few(few: &Few<'_>) -> Vec<Finding> {
    let more = "more particles";
    let in_place = (!few.ledger.levels.is_empty()).then(|| mass_in_place(few.ledger.in_place, more));
    let of = |topic: Topic| move |(grade, text): (Grade, String)| Finding::new(grade, topic, text);
    let all = [
        in_place.map(of(Topic::MassInPlace)),
        Some(density_as_seen(few.mean, few.of_interior, more)).map(of(Topic::Density)),
        Some(pairs(few.closest_pair, few.kernel)).map(of(Topic::Pairs)),
        total_mass(few.mass.quadrature_error).map(of(Topic::TotalMass)),
        few.atmosphere.as_ref().map(atmosphere).map(of(Topic::Atmosphere)),
        end(few.stop, few.tolerance, few.epsilon).map(of(Topic::End)),
        warned(few.warnings),
    ];
    all.into_iter().flatten().collect()
}

/// On what was cut of an atmosphere.
fn atmosphere(cut: &Cut) -> (Grade, String) {
    let text = format!(
        "{:.2e} of the mass, beyond {:.4} of the radius, is left out (1e-3 is good); more particles reach \
         farther out, and `input.atmosphere: keep` cuts nothing",
        cut.share, cut.radius
    );
    (grade(cut.share, 1e-3, 0.05), text)
}

/// On how it ended, where that was not with all that was asked for; `reached` is the epsilon that was measured.
fn end(stop: StopReason, tolerance: Option<f64>, reached: f64) -> Option<(Grade, String)> {
    match stop {
        StopReason::Interrupted | StopReason::TimeLimit => {
            Some((Grade::Look, "it stopped early; a longer run converges further".into()))
        }
        StopReason::ToleranceReached => None,
        stop => tolerance.map(|tolerance| {
            let text =
                format!("epsilon is {reached:.2e} as measured, the tolerance {tolerance:.2e} ({})", ending(stop));
            (Grade::Bad, text)
        }),
    }
}

/// The verdict on a report.
pub fn verdict(report: &Report) -> Vec<Finding> {
    let mut all = Vec::new();
    let mut say = |grade, topic: Topic, text: String| all.push(Finding::new(grade, topic, text));
    let is_balanced = report.plan.stages.contains(&BALANCE);
    let net_force = report.balance.as_ref().map(|balance| balance.interior.unwrap_or(balance.all));
    if !report.ledger.levels.is_empty() {
        let (mut grade, mut text) = mass_in_place(report.ledger.in_place, more(report));
        if report.renewed.is_some() && grade == Grade::Bad {
            (grade, text) = (Grade::Look, of_few_boxes(report.ledger.in_place));
        }
        if grade != Grade::Good && report.balance.is_some() && is_crowded(report) {
            text.push_str(
                "; this kernel has the pairing instability and moved mass during the balance; use fewer neighbors (see \
                 the note)",
            );
        }
        say(grade, Topic::MassInPlace, text);
    }
    if let Some(shift) = report.ledger.largest_shift().filter(|shift| *shift > LITTLE_SHIFT) {
        let text = format!(
            "the particles of a region are shifted by {shift:.2} spacings from their region ({LITTLE_SHIFT} is good, \
             {MUCH_SHIFT} is much): they have gathered on one side; more particles keep them in place"
        );
        say(grade(shift, LITTLE_SHIFT, MUCH_SHIFT), Topic::MassInPlace, text);
    }
    let error = report.density_error.smoothed.unwrap_or(report.density_error.all);
    let of_interior = report.density_error.interior.map(|_| report.density_error.refit_interior);
    let (graded, text) = density_as_seen(error.mean, of_interior, more(report));
    say(graded, Topic::Density, text);
    if let Some(off) = report.renewed {
        let (graded, mut text) = density(off);
        if graded != Grade::Good {
            text.push_str("; a wider `refine.shell`, over more of the coarser particles' spacings, reduces it");
        }
        say(graded, Topic::Density, format!("of the new particles: {text}"));
    }
    if report.particles > 1 {
        let (mut grade, mut text) = pairs(report.neighbors.closest_pair, report.kernel);
        if grade == Grade::Bad && (report.particles as f64) < report.neighbors.kernel_neighbors {
            (grade, text) = (
                Grade::Look,
                format!(
                    "the closest are {:.3} of the spacings apart that sums say, which mean nothing of {} particles, fewer than a kernel has neighbors; \
                     more particles",
                    report.neighbors.closest_pair, report.particles
                ),
            );
        }
        // A pair counts as one particle, which the forces bear: they say whether it moves.
        if let Some(net) = net_force.filter(|net| grade == Grade::Bad && is_balanced && *net < MUCH_FORCE) {
            let why = match is_crowded(report) {
                true => "with so many neighbors the kernel pairs particles in the code as well, and",
                false => "all the same",
            };
            (grade, text) =
                (Grade::Look, format!("{text}; {why} the forces are balanced to {:.1} % of gravity", 100.0 * net));
        }
        say(grade, Topic::Pairs, text);
    }
    if report.noise.interior.is_none() && report.ledger.regions.len() > 1 {
        let text = format!(
            "{:.1} % of a random set's in the median, and every particle is within reach of a discontinuity; the \
             discontinuity causes these forces in any arrangement of equal masses; a `resolution` with the same \
             spacing on both sides reduces them",
            100.0 * report.noise.median
        );
        say(grade(report.noise.median, 0.05, f64::INFINITY), Topic::ForceNoise, text);
    }
    if let Some((noise, mean)) = report.noise.interior_median.zip(report.noise.interior) {
        // The noise under a constant pressure says little about particles that are at rest under their own pressure.
        let is_at_rest = is_balanced && net_force.is_some_and(|net| net <= LITTLE_FORCE);
        let graded = grade(noise, if is_at_rest { UNRESOLVED } else { 0.05 }, UNRESOLVED);
        let remedy = match graded {
            Grade::Good if is_at_rest && noise > 0.05 => "; the forces of the body's own pressure are balanced",
            Grade::Good => "",
            Grade::Look if report.renewed.is_some() => {
                "; most of it is that of the snapshot's own particles, which stay"
            }
            Grade::Look => "; `--quietness 0.9` or more particles reduce the noise",
            Grade::Bad => "; the profile changes within a spacing there: too few particles to resolve it",
        };
        let of_few = if mean > OF_FEW * noise {
            format!(
                " (root mean square {:.0} %: a few particles, for example around a core, dominate it)",
                100.0 * mean
            )
        } else {
            String::new()
        };
        let text = format!(
            "{:.1} % of a random set's in the median of the interior (5 % is good, 50 % is unresolved){of_few}{remedy}",
            100.0 * noise
        );
        say(graded, Topic::ForceNoise, text);
    }
    if let Some(net) = net_force {
        let moves = report.motion.filter(|motion| *motion > LITTLE_FORCE && report.settled.is_none());
        let own = grade(net, LITTLE_FORCE, MUCH_FORCE);
        let graded = if moves.is_some() { own.max(Grade::Look) } else { own };
        let at_rest = moves.map_or_else(String::new, |motion| {
            format!("; this is the force at rest; its motion carries {}", carried(motion))
        });
        let remedy = match (own, report.plan.why_unbalanced()) {
            (Grade::Good, _) => String::new(),
            (_, Some(why)) => format!("; it is not balanced: {why}"),
            _ if is_balanced && !changed_anything(report) => {
                "; the balance made the density worse and was not used (see the notes): where the center is denser than \
                 the particles can resolve, as in a giant, replace it by `input.core`; a surface with a pressure needs a medium about it (`ambient`)"
                    .into()
            }
            _ if is_balanced => "; more particles, or a kernel that prevents pairing, reduce it".into(),
            _ if report.plan.is_balance_unasked() => "; `--balance`, or `--for CODE`, keeps it at rest".into(),
            _ => "; it was not balanced: there was not enough time, or there were too few particles".into(),
        };
        say(
            graded,
            Topic::Balance,
            format!("net force of {:.1} % of gravity (1 % is good, 10 % is much){remedy}{at_rest}", 100.0 * net),
        );
    }
    if let Some(text) = report.turning.and_then(|turning| turning.flies_apart()) {
        say(Grade::Bad, Topic::Balance, format!("it {text}"));
    }
    if let Some(why) = report.plan.why_unbalanced().filter(|_| report.plan.is_contradicted) {
        say(Grade::Bad, Topic::Balance, format!("it is not balanced and will move when the simulation starts: {why}"));
    }
    if let Some((grade, text)) = report.certificate.as_ref().map(|c| of_certificate(c, report.settled.is_some())) {
        say(grade, Topic::Certificate, text);
    }
    if let Some((grade, text)) = masses(report) {
        say(grade, Topic::Masses, text);
    }
    if let Some((grade, text)) = total_mass(report.mass.quadrature_error) {
        say(grade, Topic::TotalMass, text);
    }
    if let Some((grade, text)) = report.atmosphere.as_ref().map(atmosphere) {
        say(grade, Topic::Atmosphere, text);
    }
    all.extend(report.snapshot.iter().flat_map(of_snapshot));
    let reached = report.density_error.stated().epsilon;
    let of_end = end(report.stop, report.tolerance, reached);
    all.extend(of_end.map(|(grade, text)| Finding::new(grade, Topic::End, text)));
    all.extend(warned(&report.warnings));
    all
}

/// On what the code that a file is for will not make of it as the scene means it: how many things it stops at, and with how many it goes on.
pub fn of_code(stops: usize, others: usize) -> Option<Finding> {
    let see = |count: usize| {
        if count == 1 { "the note on it says what it is".into() } else { format!("{count} notes say what they are") }
    };
    match (stops, others) {
        (0, 0) => None,
        (0, _) => Some(Finding::new(
            Grade::Look,
            Topic::Code,
            format!("it does not do all that the scene means; {}", see(others)),
        )),
        _ => Some(Finding::new(
            Grade::Bad,
            Topic::Code,
            format!("it stops at this file, or soon after its start; {}", see(stops + others)),
        )),
    }
}

fn warned(warnings: &[String]) -> Option<Finding> {
    let text = format!("{}, above", warnings.len());
    (!warnings.is_empty()).then(|| Finding::new(Grade::Look, Topic::Warnings, text))
}
