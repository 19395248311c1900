//! Exit codes.

use super::args::RunArgs;
use crate::relaxation::StopReason;
use crate::run::bodies_report::BodiesReport;
use crate::run::report::Report;
use crate::run::verdict::{Finding, Grade, ending};
use crate::scene::Scene;

pub const SUCCESS: u8 = 0;
pub const FAILURE: u8 = 1;
pub const USAGE: u8 = 2;
/// What was written is not what was asked for: the tolerance was not reached, a region has not its mass, an interrupt was to leave the best state, or
/// the verdict marks a figure as bad and that is to count.
pub const NOT_CONVERGED: u8 = 3;

/// In what the file that a run has written is not what was asked for.
pub struct Shortcomings {
    /// Why it counts as not converged.
    lines: Vec<String>,
    /// What the verdict marks as bad.
    bad: Vec<String>,
}

impl Shortcomings {
    /// Of a run by itself.
    pub fn of(scene: &Scene, report: &Report) -> Self {
        let region = report.misplaced().map(|region| ("the target", (region.found, region.wanted)));
        Self::new(scene, report.stop, region.map(misplaced), bad(&report.verdict))
    }

    /// Of a run block by block.
    pub fn of_blocks(scene: &Scene, stop: StopReason, verdict: &[Finding]) -> Self {
        Self::new(scene, stop, None, bad(verdict))
    }

    pub fn of_bodies(scene: &Scene, report: &BodiesReport) -> Self {
        let region = report.misplaced().map(|(body, region)| (format!("body {body}"), region));
        let region = region.as_ref().map(|(body, region)| misplaced((body, *region)));
        let bad = report.bodies.iter().flat_map(|body| {
            let bad = body.findings().into_iter().filter(|finding| finding.grade == Grade::Bad);
            bad.map(|finding| format!("{} of body {}", finding.topic, body.name))
        });
        let own = report.verdict.iter().filter(|finding| finding.grade == Grade::Bad);
        let own = own.map(|finding| finding.topic.name().to_owned());
        Self::new(scene, report.stop, region, own.chain(bad).collect())
    }

    fn new(scene: &Scene, stop: StopReason, misplaced: Option<String>, bad: Vec<String>) -> Self {
        let mut lines = Vec::from_iter(misplaced);
        if stop == StopReason::Interrupted {
            lines.push("not converged: interrupted; the best state so far was written".to_owned());
        } else if scene.tolerance.is_some() && stop != StopReason::ToleranceReached {
            let why = ending(stop);
            lines.push(format!("not converged: the tolerance was not reached ({why}); the best state was written"));
        }
        Self { lines, bad }
    }

    /// The exit code for them; what is bad counts if that is asked for.
    pub fn code(&self, is_strict: bool) -> u8 {
        let is_short = !self.lines.is_empty() || is_strict && !self.bad.is_empty();
        if is_short { NOT_CONVERGED } else { SUCCESS }
    }

    /// The same, told on standard error; of what is bad only where the report has not said so.
    pub fn told(&self, args: &RunArgs) -> u8 {
        if !self.bad.is_empty() && (args.quiet || args.json || args.strict) {
            eprintln!("bad: {} (sph-prep help numbers); it was written", self.bad.join(", "));
        }
        self.lines.iter().for_each(|line| eprintln!("{line}"));
        self.code(args.strict)
    }
}

fn misplaced((of, (found, wanted)): (&str, (f64, f64))) -> String {
    format!("mass misplaced: a region of {of} has {found:.0} of its {wanted:.1} particles; it was written")
}

fn bad(verdict: &[Finding]) -> Vec<String> {
    let bad = verdict.iter().filter(|finding| finding.grade == Grade::Bad);
    bad.map(|finding| finding.topic.name().to_owned()).collect()
}
