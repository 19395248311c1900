//! The report of a run that processes blocks in turn.

use super::measure::{BlockFigures, SetFigures};
use crate::input::atmosphere::Cut;
use crate::relaxation::StopReason;
use crate::run::memory;
use crate::run::plan::Plan;
use crate::run::report::{MassReport, Timing, write_errors, write_in_place, write_remarks};
use crate::run::variables::{VariableReport, write_variables};
use crate::run::verdict::Finding;
use serde::Serialize;
use std::fmt::Write;

/// One pass over all blocks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pass {
    pub stage: &'static str,
    /// Mean deviation from the target where it is resolved, the mass re-fitted in each block, before and after; of the blocks that this run
    /// has gone through itself.
    pub before: f64,
    pub after: f64,
    /// Blocks that were left as they were since the stage made them no better.
    pub left: usize,
    /// Particles of the largest block, with those about it.
    pub largest: usize,
    pub seconds: f64,
}

/// What a pass has done to a block.
pub(super) struct Done {
    pub own: usize,
    /// Particles, with those about the block.
    pub held: usize,
    pub before: f64,
    pub after: f64,
    pub is_better: bool,
}

impl Pass {
    pub(super) fn new(stage: &'static str) -> Self {
        Self { stage, before: 0.0, after: 0.0, left: 0, largest: 0, seconds: 0.0 }
    }

    /// Takes up a block, with deviations added up over its particles; returns how many these are.
    pub(super) fn take(&mut self, done: &Done) -> f64 {
        let own = done.own as f64;
        self.before += done.before * own;
        self.after += done.after * own;
        self.left += usize::from(!done.is_better);
        self.largest = self.largest.max(done.held);
        own
    }
}

/// Everything that is known of a run in turn when it ends.
#[derive(Debug, Clone, Serialize)]
pub struct InTurnReport {
    pub input: String,
    pub output: String,
    pub format: &'static str,
    pub dimension: usize,
    pub particles: usize,
    pub blocks: usize,
    pub seed: u64,
    pub kernel: &'static str,
    pub kernel_neighbors: f64,
    pub mass: MassReport,
    pub stop: StopReason,
    /// epsilon that was asked for.
    pub tolerance: Option<f64>,
    pub passes: Vec<Pass>,
    pub plan: Plan,
    /// What the variables of the input are taken for, and where they are written.
    pub variables: Vec<VariableReport>,
    pub figures: BlockFigures,
    /// What was cut of an atmosphere.
    pub atmosphere: Option<Cut>,
    pub timing: Vec<Timing>,
    pub seconds: f64,
    /// The most bytes of memory that the process has had at once, where the system tells.
    pub peak_memory: Option<f64>,
    pub warnings: Vec<String>,
    /// What is good, what to look at.
    pub verdict: Vec<Finding>,
    pub notes: Vec<String>,
}

impl InTurnReport {
    /// As JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"))
    }

    /// As text for a terminal.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.write(&mut out).expect("writing to a string cannot fail");
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{} -> {} ({})", self.input, self.output, self.format)?;
        if self.stop == StopReason::TimeLimit {
            writeln!(out, "  UNCONVERGED      time limit: this is the state so far")?;
        }
        writeln!(
            out,
            "  particles        {} in {}-D, in {} blocks, {}, {:.1} kernel neighbors, seed {}",
            self.particles, self.dimension, self.blocks, self.kernel, self.kernel_neighbors, self.seed
        )?;
        self.mass.write(out)?;
        self.write_figures(out)?;
        for Pass { stage, before, after, left, largest, seconds } in &self.passes {
            let unused = if *left > 0 { format!(", {left} blocks left as they were") } else { String::new() };
            let (before, after) = (100.0 * before, 100.0 * after);
            writeln!(
                out,
                "  {stage:<16} {before:.3} % to {after:.3} % on average in {seconds:.1} s, {largest} particles at once{unused}"
            )?;
        }
        writeln!(out, "  time             {:.2} s", self.seconds)?;
        for t in &self.timing {
            writeln!(out, "    {:<14} {:>8.2} s", t.step, t.seconds)?;
        }
        memory::write_peak(out, self.peak_memory, self.particles)?;
        write_variables(out, &self.variables)?;
        write_remarks(out, (&self.warnings, &self.notes), &self.plan, &self.verdict)
    }

    fn write_figures(&self, out: &mut String) -> std::fmt::Result {
        let BlockFigures { interior, smoothed, ledger, seams, closest_pair, .. } = &self.figures;
        write_in_place(out, ledger)?;
        let rows = |of: &SetFigures, names: [&'static str; 2]| [(names[0], of.as_given), (names[1], of.refitted)];
        let mut all = vec![("all, against smoothed target", smoothed.as_given)];
        all.extend(rows(&self.figures.all, ["all, mass as given", "all, mass re-fitted"]));
        let names = ["interior, mass as given", "interior, mass re-fitted"];
        all.extend(interior.iter().flat_map(|interior| rows(interior, names)));
        write_errors(out, &all)?;
        if let Some([near, rest]) = seams.map(|means| means.map(|mean| 100.0 * mean)) {
            writeln!(
                out,
                "  seams            mean |e| {near:.3} % within a support radius of another block, {rest:.3} % elsewhere"
            )?;
        }
        writeln!(out, "  closest pair     {closest_pair:.2} spacings apart")
    }
}
