//! The report of a run: one data structure, printed as text or as JSON.

use crate::field::{MassEstimate, Scatter};
use crate::input::atmosphere::Cut;
use crate::input::particles::{OfSnapshot, material_shares};
use crate::metrics::{
    BalanceFigures, BondOrder, DensityError, ErrorFigures, IN_PLACE, LedgerFigures, NeighborFigures, NoiseFigures,
    RegionFigures,
};
use crate::output::conservation::Conserved;
use crate::output::frame::Factors;
use crate::relaxation::{Certificate, SETTLING, StageReport, StopReason};
use crate::run::duration::{self, Expected};
use crate::run::memory;
use crate::run::plan::Plan;
use crate::run::settling::Settling;
use crate::run::turning::Turning;
use crate::run::variables::{VariableReport, write_variables};
use crate::run::verdict::{Finding, ending, worst, write_verdict};
use serde::Serialize;
use sph::exchange::{Alone, Exchange};
use sph::reduce;
use sph_formats::ParticleTable;
use sph_formats::common::particle_names as names;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Everything that a run says of its result.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    pub input: String,
    pub output: String,
    pub format: &'static str,
    pub dimension: usize,
    pub particles: usize,
    pub seed: u64,
    pub kernel: &'static str,
    pub mass: MassReport,
    pub stop: StopReason,
    /// The epsilon that was asked for.
    pub tolerance: Option<f64>,
    pub density_error: DensityError,
    /// Where the mass is, against where it should be.
    pub ledger: LedgerFigures,
    pub noise: NoiseFigures,
    /// Whether neighbors lie in preferred directions, as in a crystal; none in one dimension.
    pub order: Option<BondOrder>,
    /// How well pressure cancels gravity, where both are known.
    pub balance: Option<BalanceFigures>,
    /// What became of the body when it was followed forward.
    pub certificate: Option<Certificate>,
    /// Of gas that moves where its pressure is known: twice its kinetic energy over what the pressure holds, which would be 1 where motion alone holds
    /// a body.
    pub motion: Option<f64>,
    /// Of gas whose pressure is known: d times the integral of the pressure, in the output's unit of energy, which is -W of a body at rest.
    #[serde(skip)]
    pub(crate) support: Option<f64>,
    /// Of a round body that its own gravity holds and the scene turns.
    pub turning: Option<Turning>,
    /// How motion fell before that while it was damped, where the scene asks for it.
    pub settled: Option<Certificate>,
    /// Of a snapshot that is refined: by how much the summed densities of the new particles are off on average.
    pub renewed: Option<f64>,
    pub neighbors: NeighborFigures,
    pub stages: Vec<StageReport>,
    /// What stages were expected to take.
    pub expected: Vec<Expected>,
    pub timing: Vec<Timing>,
    pub seconds: f64,
    /// The most bytes of memory that the process has had at once, where the system tells.
    pub peak_memory: Option<f64>,
    pub plan: Plan,
    /// What the variables of the input are taken for, and where they are written.
    pub variables: Vec<VariableReport>,
    /// Of a round body, to its surface, in the unit of length of the output.
    #[serde(skip)]
    pub radius: Option<f64>,
    /// Whether a force that is not the particles' own holds the pressure, by the balance.
    #[serde(skip)]
    pub(crate) in_field: bool,
    /// What was cut of an atmosphere that particles cannot resolve.
    pub atmosphere: Option<Cut>,
    /// What is known of the snapshot that the input is, and kept of it.
    pub snapshot: Option<SnapshotReport>,
    /// What may be wrong, with the remedy.
    pub warnings: Vec<String>,
    /// What is good, what to look at.
    pub verdict: Vec<Finding>,
    pub notes: Vec<String>,
    /// What pictures show beside the file, where the scene asks for some; too many numbers for the JSON.
    #[cfg(feature = "plots")]
    #[serde(skip)]
    pub seen: Option<crate::page::Seen>,
}

/// Of particles that were the input.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SnapshotReport {
    /// Of their densities about the field that they are samples of, where all are positive.
    pub scatter: Option<Scatter>,
    /// Totals that the new particles have from them.
    pub conserved: Option<Conserved>,
    /// What each material has of the mass, where there is more than one.
    pub materials: Vec<MaterialShare>,
}

/// Shares of the mass of one material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MaterialShare {
    pub material: i64,
    /// Of the particles that were the input.
    pub snapshot: f64,
    /// Of the new ones.
    pub particles: f64,
}

impl SnapshotReport {
    /// On what was a snapshot, and what gas it has become.
    pub(crate) fn new(source: &OfSnapshot, gas: &ParticleTable, conserved: Option<Conserved>) -> Self {
        let columns = gas.column(names::MATERIAL_IDS).zip(gas.column(names::MASSES));
        let found = columns.map(|(id, mass)| material_shares(&id.values, &mass.values.to_f64())).unwrap_or_default();
        let of = |shares: &BTreeMap<i64, f64>, id: i64| shares.get(&id).copied().unwrap_or(0.0);
        let share = |&material: &i64| MaterialShare {
            material,
            snapshot: of(&source.materials, material),
            particles: of(&found, material),
        };
        // A material may be lost, and is then the one that matters; fields of the scene may make others.
        let all = source.materials.keys().chain(found.keys()).collect::<BTreeSet<_>>();
        let is_told = source.materials.len() > 1 && !found.is_empty();
        let materials = all.into_iter().filter(|_| is_told).map(share).collect();
        Self { scatter: source.scatter, conserved, materials }
    }
}

/// Masses in the output's units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MassReport {
    pub total: f64,
    /// Relative error of the quadrature of the input's mass.
    pub quadrature_error: f64,
    pub smallest: f64,
    pub largest: f64,
    /// (sum of the particles' masses - total) / total.
    pub defect: f64,
    /// Largest relative difference of a particle's mass from that which was asked for: the same for all, or by the resolution.
    pub off: f64,
    /// In grams, where the units are known.
    pub total_cgs: Option<f64>,
}

impl MassReport {
    /// Of `masses` in internal units, of which `asked` were asked for; `grams` are those of a unit of the output.
    pub(crate) fn new(masses: &[f64], asked: &[f64], mass: &MassEstimate, factors: (&Factors, Option<f64>)) -> Self {
        Self::among(&Alone, masses, asked, mass, factors)
    }

    /// [`Self::new`] of particles that are over several ranks.
    pub(crate) fn among(
        exchange: &dyn Exchange,
        masses: &[f64],
        asked: &[f64],
        mass: &MassEstimate,
        (factors, grams): (&Factors, Option<f64>),
    ) -> Self {
        let total = mass.value * factors.input_mass;
        let summed = exchange.sum(reduce::sum(masses.len(), |i| masses[i] * factors.mass));
        let fold = |f: fn(f64, f64) -> f64, start: f64| masses.iter().fold(start, |m, &v| f(m, v)) * factors.mass;
        Self {
            total,
            quadrature_error: mass.error / mass.value,
            smallest: -exchange.max(-fold(f64::min, f64::INFINITY)),
            largest: exchange.max(fold(f64::max, 0.0)),
            defect: (summed - total) / total,
            off: exchange
                .max(masses.iter().zip(asked).fold(0.0, |off, (m, asked)| f64::max(off, (m / asked - 1.0).abs()))),
            total_cgs: grams.map(|grams| total * grams),
        }
    }

    /// Of so many particles of one mass in internal units.
    pub(crate) fn of_equal(
        (each, count): (f64, usize),
        mass: &MassEstimate,
        (factors, grams): (&Factors, Option<f64>),
    ) -> Self {
        let (total, one) = (mass.value * factors.input_mass, each * factors.mass);
        Self {
            total,
            quadrature_error: mass.error / mass.value,
            smallest: one,
            largest: one,
            defect: (one * count as f64 - total) / total,
            off: 0.0,
            total_cgs: grams.map(|grams| total * grams),
        }
    }

    pub(super) fn write(&self, out: &mut String) -> std::fmt::Result {
        let grams = self.total_cgs.map(|g| format!(" = {g:.6e} g")).unwrap_or_default();
        writeln!(
            out,
            "  mass             {:.12e}{grams}; input known to {:.1e}, sum of particle masses differs by {:.1e}",
            self.total,
            self.quadrature_error,
            self.defect.abs()
        )?;
        match self.smallest == self.largest {
            true => writeln!(out, "  particle mass    {:.6e}, equal", self.smallest),
            false => writeln!(out, "  particle masses  {:.4e} to {:.4e}", self.smallest, self.largest),
        }
    }
}

/// Wall time of one step of the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timing {
    pub step: &'static str,
    pub seconds: f64,
    /// epsilon (re-fitted, at the target's support radii) when the step ended, where it has one.
    pub epsilon: Option<f64>,
}

/// A region may be off by this share of its particles.
const REGION_SHARE: f64 = 1e-3;

impl Report {
    /// As JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"))
    }

    /// The region that is farthest off, if its particles are not those that belong there, to a thousandth or one particle.
    pub fn misplaced(&self) -> Option<&RegionFigures> {
        self.ledger.worst_region().filter(|region| !region.is_kept(REGION_SHARE))
    }

    /// What comes before everything else: a word in capitals, and what happened.
    pub fn alarms(&self) -> Vec<(&'static str, String)> {
        let mut out = Vec::new();
        match self.stop {
            StopReason::Interrupted => out.push(("UNCONVERGED", "interrupted: this is the best state so far".into())),
            StopReason::TimeLimit => out.push(("UNCONVERGED", "time limit: this is the best state so far".into())),
            _ => {}
        }
        if let Some(region) = self.misplaced() {
            let (found, wanted) = (region.found, region.wanted);
            out.push(("MISPLACED", format!("a region of the target has {found:.0} of its {wanted:.1} particles")));
        }
        out
    }

    /// The density error over each set of particles.
    pub fn error_rows(&self) -> Vec<(&'static str, ErrorFigures)> {
        let e = &self.density_error;
        let rows = [
            ("all, against smoothed target", e.smoothed),
            ("the kernel's own smoothing", e.kernel_limit),
            ("all, mass as given", Some(e.all)),
            ("all, mass re-fitted", Some(e.all_refitted)),
            ("interior, mass as given", e.interior),
            ("interior, mass re-fitted", e.interior_refitted),
            ("surfaces and jumps apart", e.edge_refitted),
        ];
        rows.into_iter().filter_map(|(name, figures)| Some((name, figures?))).collect()
    }

    /// As text for a terminal.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.write_text(&mut out).expect("writing to a string cannot fail");
        out
    }

    /// The headline: whether the mass is where it should be.
    fn write_ledger(&self, out: &mut String) -> std::fmt::Result {
        write_in_place(out, &self.ledger)?;
        if let Some(worst) = self.ledger.worst_region() {
            writeln!(
                out,
                "  regions          {} apart; the one that is farthest off has {:.1} of {:.1} particles{}",
                self.ledger.regions.len(),
                worst.found,
                worst.wanted,
                self.ledger
                    .largest_shift()
                    .map_or_else(String::new, |shift| format!("; centers are up to {shift:.2} spacings off"))
            )?;
        }
        Ok(())
    }

    /// Whether it is a crystal.
    fn write_order(&self, out: &mut String) -> std::fmt::Result {
        let Some(order) = &self.order else { return Ok(()) };
        writeln!(
            out,
            "  bond order       Q4 {:.3}, Q6 {:.3}; random directions {:.3}, {}",
            order.q4,
            order.q6,
            order.random,
            BondOrder::yardsticks(self.dimension)
        )
    }

    /// What the particles came to after they were placed.
    pub(super) fn add_settling(&mut self, settling: Settling) {
        let Settling { damped, free, closest_pair, seconds, stop, notes } = settling;
        self.settled = damped;
        self.neighbors.closest_pair = closest_pair.unwrap_or(self.neighbors.closest_pair);
        self.certificate = free;
        self.stop = stop.unwrap_or(self.stop);
        self.notes.extend(notes);
        self.timing.push(Timing { step: SETTLING.name, seconds, epsilon: None });
        // It is of the places before.
        #[cfg(feature = "plots")]
        {
            self.seen = None;
        }
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{} -> {} ({})", self.input, self.output, self.format)?;
        for (alarm, text) in self.alarms() {
            writeln!(out, "  {alarm:<16} {text}")?;
        }
        writeln!(
            out,
            "  particles        {} in {}-D, {}, {:.1} kernel neighbors, seed {}",
            self.particles, self.dimension, self.kernel, self.neighbors.kernel_neighbors, self.seed
        )?;
        self.mass.write(out)?;
        write_certificates(out, self.settled.as_ref(), self.certificate.as_ref())?;
        self.write_ledger(out)?;
        write_errors(out, &self.error_rows())?;
        let inside = self.noise.interior.map(|n| format!(", interior {:.2} %", 100.0 * n)).unwrap_or_default();
        let noise = [self.noise.all, self.noise.median].map(|share| 100.0 * share);
        writeln!(out, "  force noise      {:.2} % of a random set's, median {:.2} %{inside}", noise[0], noise[1])?;
        if let Some(parts) = self.noise.parts {
            writeln!(
                out,
                "                   of the interior's, {:.2} % vary slowly over a support radius, {:.2} % from particle to particle",
                100.0 * parts.systematic,
                100.0 * parts.scatter
            )?;
        }
        self.write_order(out)?;
        if let Some(balance) = &self.balance {
            let inside = balance.interior.map(|b| format!(", interior {:.2} %", 100.0 * b)).unwrap_or_default();
            writeln!(
                out,
                "  force balance    net force is {:.2} % of gravity on average{inside}",
                100.0 * balance.all
            )?;
        }
        writeln!(out, "  neighbors        {}", self.neighbors.describe())?;
        for stage in &self.stages {
            writeln!(
                out,
                "  {:<16} {} after {} iterations, best is {}",
                stage.stage.name,
                ending(stage.stop),
                stage.history.last().map_or(0, |p| p.iteration),
                stage.best_iteration
            )?;
        }
        let is_expected = |t: &&Timing| self.expected.iter().any(|e| e.step == t.step);
        let taken: f64 = self.timing.iter().filter(is_expected).map(|t| t.seconds).sum();
        let stages = match duration::total(&self.expected) {
            0.0 => String::new(),
            expected => {
                format!(" ({taken:.2} s in stages, which were expected to take {})", duration::rounded(expected))
            }
        };
        writeln!(out, "  time             {:.2} s{stages}", self.seconds)?;
        for t in &self.timing {
            let epsilon = t.epsilon.map(|e| format!("  epsilon {e:.2e}")).unwrap_or_default();
            writeln!(out, "    {:<14} {:>8.2} s{epsilon}", t.step, t.seconds)?;
        }
        memory::write_peak(out, self.peak_memory, self.particles)?;
        write_variables(out, &self.variables)?;
        write_remarks(out, (&self.warnings, &self.notes), &self.plan, &self.verdict)
    }
}

/// What a report ends with.
pub(super) fn write_remarks(
    out: &mut String,
    (warnings, notes): (&[String], &[String]),
    plan: &Plan,
    verdict: &[Finding],
) -> std::fmt::Result {
    for warning in warnings {
        writeln!(out, "  WARNING          {warning}")?;
    }
    for note in notes {
        writeln!(out, "  note             {note}")?;
    }
    for left in &plan.left_out {
        writeln!(out, "  without          {}: {}", left.what, left.why)?;
    }
    write_verdict(out, worst(verdict), verdict)
}

/// Where the mass is.
pub(super) fn write_in_place(out: &mut String, ledger: &LedgerFigures) -> std::fmt::Result {
    let Some(smallest) = ledger.levels.last() else { return Ok(()) };
    writeln!(
        out,
        "  mass in place    {:.2} % of it, to {:.0} % in {} boxes of equal mass; largest deviation {:.2} %",
        100.0 * ledger.in_place,
        100.0 * IN_PLACE,
        smallest.boxes,
        100.0 * smallest.largest_deviation,
    )
}

/// Density errors of some sets of particles.
pub(super) fn write_errors(out: &mut String, rows: &[(&str, ErrorFigures)]) -> std::fmt::Result {
    writeln!(
        out,
        "  {:<30}{:>9}{:>10}{:>10}{:>9}{:>9}",
        "density error", "particles", "epsilon", "mean |e|", "99 %", "max |e|"
    )?;
    for (name, figures) in rows {
        let ErrorFigures { epsilon, mean, most, max, particles } = *figures;
        let [mean, most, max] = [(mean, 3), (most, 2), (max, 2)].map(|(share, digits)| percent(share, digits));
        writeln!(out, "    {name:<28} {particles:>8}{epsilon:>10.2e}{mean:>8} %{most:>7} %{max:>7} %")?;
    }
    Ok(())
}

/// A share in percent with so many digits, or in scientific notation where these would fill the column.
fn percent(share: f64, digits: usize) -> String {
    let value = 100.0 * share;
    if value.abs() < 1e3 { format!("{value:.digits$}") } else { format!(" {value:.1e}") }
}

/// Whether the particles stay still, after they were settled where they were.
pub(super) fn write_certificates(
    out: &mut String,
    settled: Option<&Certificate>,
    free: Option<&Certificate>,
) -> std::fmt::Result {
    for (name, certificate) in [("settled", settled), ("certificate", free)] {
        let lines = certificate.map(Certificate::summary).unwrap_or_default();
        for (i, line) in lines.iter().enumerate() {
            writeln!(out, "  {:<16} {line}", if i == 0 { name } else { "" })?;
        }
    }
    Ok(())
}
