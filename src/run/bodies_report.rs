//! The report of a scene of several bodies, for people or as JSON.

use super::grading::verdict_on_all;
use super::memory;
use super::orbit::Relative;
use super::report::{Report, write_certificates};
use super::verdict::{Finding, Grade, Topic, write_verdict};
use crate::output::origin::NOTE;
use crate::output::particle_file::MOVED;
use crate::relaxation::{Certificate, StopReason};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// Everything that a run says of a scene of bodies, in the output's units.
#[derive(Debug, Clone, Serialize)]
pub struct BodiesReport {
    pub output: String,
    pub units: String,
    pub dimension: usize,
    pub particles: usize,
    pub mass: f64,
    /// Of the body that came off worst.
    pub stop: StopReason,
    /// In the scene's coordinates.
    pub center_of_mass: [f64; 3],
    pub momentum: [f64; 3],
    pub orbit: Option<OrbitFigures>,
    pub bodies: Vec<BodyReport>,
    /// How motion fell while it was damped, and what became of the whole from there.
    pub settled: Option<Certificate>,
    pub certificate: Option<Certificate>,
    /// What is probably not meant of all bodies together; each has those of its own.
    pub warnings: Vec<String>,
    /// On those that turn.
    #[serde(skip)]
    pub turning: Vec<Finding>,
    /// The closest pair after bodies have settled, if they did, in spacings there, and the kernel of the code.
    #[serde(skip)]
    pub settled_pair: Option<(f64, &'static str)>,
    /// On all bodies together; each has one of its own.
    pub verdict: Vec<Finding>,
    pub notes: Vec<String>,
    pub seconds: f64,
    /// The most bytes of memory that the process has had at once, where the system tells.
    pub peak_memory: Option<f64>,
}

/// The orbit of two bodies as points.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct OrbitFigures {
    pub distance: f64,
    pub speed: f64,
    pub pericenter: f64,
    /// Of an ellipse.
    pub period: Option<f64>,
}

/// One body.
#[derive(Debug, Clone, Serialize)]
pub struct BodyReport {
    pub name: String,
    /// First and last.
    pub ids: [usize; 2],
    pub mass: f64,
    pub particle_mass: f64,
    /// Distance of the outermost particle from the center of mass.
    pub radius: f64,
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    pub spin: [f64; 3],
    /// None of a point.
    pub figures: Option<BodyFigures>,
    /// How it was placed by itself: the whole report.
    pub report: serde_json::Value,
    /// Whether it was taken from the cache.
    pub cached: bool,
}

/// A line of the verdict on a body by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyFinding {
    pub grade: Grade,
    pub topic: String,
    pub text: String,
}

impl BodyReport {
    /// The verdict on the body by itself, as its own report has it; nothing of a point.
    pub fn findings(&self) -> Vec<BodyFinding> {
        let text = |value: &serde_json::Value| value.as_str().unwrap_or("").to_owned();
        let finding = |f: &serde_json::Value| BodyFinding {
            grade: match f["grade"].as_str() {
                Some("good") => Grade::Good,
                Some("look") => Grade::Look,
                _ => Grade::Bad,
            },
            topic: text(&f["topic"]),
            text: text(&f["text"]),
        };
        self.report["verdict"].as_array().map_or_else(Vec::new, |all| all.iter().map(finding).collect())
    }
}

/// What the text says of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyFigures {
    pub input: String,
    pub stop: StopReason,
    /// See [`Report::radius`].
    #[serde(default)]
    pub radius: Option<f64>,
    /// Of the density, with the mass as it is stated.
    pub epsilon: f64,
    pub mean_error: f64,
    /// Share of a random set's.
    pub force_noise: f64,
    /// Share of gravity, where the body is balanced.
    pub net_force: Option<f64>,
    /// d times the integral of the pressure, in the output's unit of energy, where a pressure is known.
    pub support: Option<f64>,
    /// Found and wanted particles of a region that is off, as [`Report::misplaced`] has it.
    pub misplaced: Option<(f64, f64)>,
    pub warnings: Vec<String>,
    pub notes: Vec<String>,
}

impl BodyFigures {
    /// Of a body by itself; notes on where it lies are taken from the report: among others it is moved again.
    pub fn new(report: &mut Report) -> Self {
        report.notes.retain(|note| !is_of_place(note));
        let error = report.density_error.stated();
        Self {
            input: report.input.clone(),
            stop: report.stop,
            radius: report.radius,
            epsilon: error.epsilon,
            mean_error: error.mean,
            force_noise: report.noise.all,
            support: report.support,
            net_force: report.balance.as_ref().map(|b| b.all),
            misplaced: report.misplaced().map(|r| (r.found, r.wanted)),
            warnings: report.warnings.clone(),
            notes: report.notes.clone(),
        }
    }
}

/// Whether a note says where a body by itself lies.
fn is_of_place(note: &str) -> bool {
    [MOVED, NOTE].iter().any(|start| note.starts_with(start))
}

impl OrbitFigures {
    pub fn new(relative: &Relative) -> Self {
        let period = std::f64::consts::TAU / relative.mean_motion;
        Self {
            distance: relative.position[0].hypot(relative.position[1]),
            speed: relative.velocity[0].hypot(relative.velocity[1]),
            pericenter: relative.pericenter,
            period: period.is_finite().then_some(period),
        }
    }
}

impl BodiesReport {
    /// As JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"))
    }

    /// Comes to the verdict on all bodies together, by what is known now.
    pub fn judge(&mut self) {
        self.verdict = verdict_on_all(self.settled_pair, &self.turning, &self.warnings);
    }

    /// The worst grade of all bodies, each by itself and together.
    pub fn worst(&self) -> Grade {
        let own = self.verdict.iter().map(|finding| finding.grade);
        let of_bodies = self.bodies.iter().flat_map(BodyReport::findings).map(|finding| finding.grade);
        own.chain(of_bodies).max().unwrap_or(Grade::Good)
    }

    /// The first body with a region that is off, with how many particles that has and should have.
    pub fn misplaced(&self) -> Option<(&str, (f64, f64))> {
        self.bodies.iter().find_map(|b| Some((b.name.as_str(), b.figures.as_ref()?.misplaced?)))
    }

    /// As text for a terminal.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.write_text(&mut out).expect("writing to a string cannot fail");
        out
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        let d = self.dimension;
        writeln!(out, "{} bodies -> {}", self.bodies.len(), self.output)?;
        match self.stop {
            StopReason::Interrupted => writeln!(out, "  UNCONVERGED      interrupted: this is the best state so far")?,
            StopReason::TimeLimit => writeln!(out, "  UNCONVERGED      time limit: this is the best state so far")?,
            _ => {}
        }
        writeln!(
            out,
            "  particles        {} in {d}-D, mass {:.12e} in {} units",
            self.particles, self.mass, self.units
        )?;
        writeln!(
            out,
            "  center of mass   {}, momentum {}",
            vector(&self.center_of_mass[..d]),
            vector(&self.momentum[..d])
        )?;
        if let Some(orbit) = &self.orbit {
            let period = orbit.period.map(|p| format!(", period {p:.6e}")).unwrap_or_default();
            writeln!(
                out,
                "  orbit            {:.6e} apart at the speed {:.6e}, pericenter {:.6e}{period}",
                orbit.distance, orbit.speed, orbit.pericenter
            )?;
        }
        for body in &self.bodies {
            self.write_body(out, body)?;
        }
        write_certificates(out, self.settled.as_ref(), self.certificate.as_ref())?;
        writeln!(out, "  time             {:.2} s", self.seconds)?;
        memory::write_peak(out, self.peak_memory, self.particles)?;
        for warning in &self.warnings {
            writeln!(out, "  WARNING          {warning}")?;
        }
        for note in &self.notes {
            writeln!(out, "  note             {note}")?;
        }
        write_verdict(out, self.worst(), &self.verdict)
    }

    fn write_body(&self, out: &mut String, body: &BodyReport) -> std::fmt::Result {
        let d = self.dimension;
        let cached = if body.cached { " (from the cache)" } else { "" };
        writeln!(out, "  body {}: {}{cached}", body.name, body.figures.as_ref().map_or("a point", |f| &f.input))?;
        let [first, last] = body.ids;
        writeln!(
            out,
            "    particles      {} (IDs {first} to {last}) of {:.6e}, mass {:.6e}, radius {:.6e}",
            last + 1 - first,
            body.particle_mass,
            body.mass,
            body.radius
        )?;
        writeln!(out, "    center         {}, velocity {}", vector(&body.position[..d]), vector(&body.velocity[..d]))?;
        if body.spin.iter().any(|s| *s != 0.0) {
            writeln!(out, "    spin           {}", vector(&body.spin))?;
        }
        let Some(figures) = &body.figures else { return Ok(()) };
        writeln!(
            out,
            "    density error  epsilon {:.3e}, mean {:.3} %; force noise {:.2} % of a random set's",
            figures.epsilon,
            100.0 * figures.mean_error,
            100.0 * figures.force_noise
        )?;
        if let Some(net) = figures.net_force {
            writeln!(out, "    force balance  net force is {:.2} % of gravity on average", 100.0 * net)?;
        }
        let certificate = Topic::Certificate.name();
        let is_told = |f: &&BodyFinding| f.grade > Grade::Good || f.topic == certificate;
        for BodyFinding { grade, topic, text } in body.findings().iter().filter(is_told) {
            writeln!(out, "    {:<6} {topic:<14} {text}", grade.mark())?;
        }
        for warning in &figures.warnings {
            writeln!(out, "    warning        {warning}")?;
        }
        for note in &figures.notes {
            writeln!(out, "    note           {note}")?;
        }
        Ok(())
    }
}

fn vector(components: &[f64]) -> String {
    let all: Vec<String> = components.iter().map(|v| format!("{v:.6e}")).collect();
    format!("[{}]", all.join(", "))
}
