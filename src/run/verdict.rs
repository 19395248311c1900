//! The verdict at the end of a report: which figures are good, which need attention, and what to do about them. Every line states its
//! threshold.

use crate::relaxation::StopReason;
use crate::scene::Scene;
use serde::Serialize;
use std::fmt::Write;

/// How a figure is to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    Good,
    Look,
    Bad,
}

impl Grade {
    /// What a result is good for whose worst figure has this grade.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Look => "usable; look at the marked lines",
            Self::Bad => "do not use it until the marked lines are resolved",
        }
    }

    /// In front of a figure.
    pub fn mark(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Look => "LOOK",
            Self::Bad => "BAD",
        }
    }
}

/// The worst grade of a verdict.
pub fn worst(findings: &[Finding]) -> Grade {
    findings.iter().map(|f| f.grade).max().unwrap_or(Grade::Good)
}

/// What a line is about. Each has a section of its own in the manual's page on numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    MassInPlace,
    Density,
    Pairs,
    ForceNoise,
    Balance,
    Certificate,
    Masses,
    TotalMass,
    Atmosphere,
    Snapshot,
    End,
    Code,
    Warnings,
}

impl Topic {
    pub const ALL: [Self; 13] = [
        Self::MassInPlace,
        Self::Density,
        Self::Pairs,
        Self::ForceNoise,
        Self::Balance,
        Self::Certificate,
        Self::Masses,
        Self::TotalMass,
        Self::Atmosphere,
        Self::Snapshot,
        Self::End,
        Self::Code,
        Self::Warnings,
    ];

    /// As reports call it; the heading of its section.
    pub fn name(self) -> &'static str {
        match self {
            Self::MassInPlace => "mass in place",
            Self::Density => "density",
            Self::Pairs => "pairs",
            Self::ForceNoise => "force noise",
            Self::Balance => "balance",
            Self::Certificate => "certificate",
            Self::Masses => "masses",
            Self::TotalMass => "total mass",
            Self::Atmosphere => "atmosphere",
            Self::Snapshot => "snapshot",
            Self::End => "end",
            Self::Code => "code",
            Self::Warnings => "warnings",
        }
    }

    /// The name of its section within the page.
    pub fn anchor(self) -> String {
        self.name().replace(' ', "-")
    }
}

impl Serialize for Topic {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// One line of the verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    pub grade: Grade,
    pub topic: Topic,
    pub text: String,
    /// The section of the manual that explains it, in the repository.
    pub link: String,
}

impl Finding {
    pub fn new(grade: Grade, topic: Topic, text: String) -> Self {
        Self { grade, topic, text, link: format!("{FOLDER}{MANUAL}#{}", topic.anchor()) }
    }
}

/// The command that explains the figures.
const HELP: &str = "sph-prep help numbers";
/// The manual's page on them, which it prints.
#[cfg(any(feature = "cli", feature = "plots", test))]
pub(crate) const EXPLANATIONS: &str = include_str!("../../docs/src/numbers.md");
/// What the page is called, and where it is.
const MANUAL: &str = "numbers.md";
const FOLDER: &str = "docs/src/";

/// The verdict as lines of a report.
///
/// # Errors
/// Those of `out`.
pub fn write_verdict(out: &mut String, worst: Grade, findings: &[Finding]) -> std::fmt::Result {
    writeln!(out, "  verdict          {} ({HELP})", worst.summary())?;
    for Finding { grade, topic, text, .. } in findings {
        writeln!(out, "    {:<6} {:<14} {text} [{MANUAL}#{}]", grade.mark(), topic.name(), topic.anchor())?;
    }
    Ok(())
}

/// The report's measured error decides whether a tolerance was met, not the error that stages watch.
pub(super) fn as_measured(scene: &Scene, stop: StopReason, epsilon: f64) -> StopReason {
    let Some(tolerance) = scene.tolerance.filter(|_| stop != StopReason::Interrupted) else { return stop };
    match (epsilon <= tolerance, stop) {
        (true, _) => StopReason::ToleranceReached,
        (false, StopReason::ToleranceReached) => StopReason::ToleranceMissed,
        (false, _) => stop,
    }
}

/// Why a stage ended, in words.
pub fn ending(stop: StopReason) -> &'static str {
    match stop {
        StopReason::ToleranceReached => "tolerance reached",
        StopReason::ToleranceMissed => "tolerance missed",
        StopReason::Stagnated => "done, nothing left to gain",
        StopReason::IterationLimit => "done, with all its iterations",
        StopReason::TimeLimit => "ended by the time limit (TimeLimit)",
        StopReason::Interrupted => "interrupted",
        StopReason::NotNeeded => "not needed",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_links_to_a_section_that_is_there() {
        let sections: Vec<String> =
            EXPLANATIONS.lines().filter_map(|l| Some(l.strip_prefix("## ")?.to_lowercase())).collect();
        for topic in Topic::ALL {
            assert!(sections.iter().any(|s| s == topic.name()), "{topic:?}");
            let finding = Finding::new(Grade::Good, topic, "text".into());
            let link = finding.link.clone();
            let link = link.split_once('#').unwrap();
            assert_eq!(link.0, "docs/src/numbers.md");
            assert!(link.1.chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{link:?}");
            let mut out = String::new();
            write_verdict(&mut out, Grade::Good, &[finding]).unwrap();
            assert!(out.lines().nth(1).unwrap().ends_with(&format!("[numbers.md#{}]", link.1)), "{out}");
        }
    }
}
