//! The report's end in words: what is good, what to look at, and what to do about it. Every line has its threshold.

use crate::relaxation::StopReason;
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
            Self::Look => "usable; look at what is marked",
            Self::Bad => "do not use it before what is marked is seen to",
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

/// One line of the verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    pub grade: Grade,
    pub topic: &'static str,
    pub text: String,
}

/// Where the figures are explained.
const PAGE: &str = "README.md#what-the-numbers-mean";

/// The verdict as lines of a report.
///
/// # Errors
/// Those of `out`.
pub fn write_verdict(out: &mut String, findings: &[Finding]) -> std::fmt::Result {
    writeln!(out, "  verdict          {} ({PAGE})", worst(findings).summary())?;
    for Finding { grade, topic, text } in findings {
        writeln!(out, "    {:<6} {topic:<14} {text}", grade.mark())?;
    }
    Ok(())
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
