//! The page of a run of several bodies: the verdict of each, and images of all together.

use super::bodies_report::{BodiesReport, BodyFinding, BodyReport};
use super::page::{explanations, forward, lead_of, side_by_side};
use super::verdict::{Grade, Topic};
use crate::error::Result;
use crate::page::{Page, Portrait, Side, escape, histograms, list, pictures, profiles, table};
use crate::scene::Scene;
use sph_formats::ParticleFile;

/// The page; `command` is what was called, empty where no program was.
///
/// # Errors
/// Values that cannot be drawn.
pub fn page(scene: &Scene, file: &ParticleFile, report: &BodiesReport, command: &str) -> Result<String> {
    let mut portrait = Portrait::new(file, None)?;
    // Distances from a center between them say nothing.
    portrait.side = Side::Axis;
    let mut page = Page::new(&format!("{} bodies \u{2192} {}", report.bodies.len(), report.output));
    report.bodies.iter().for_each(|body| page.add(&lead(body)));
    page.section("Pictures", &pictures(&portrait)?);
    page.section("Profile", &profiles(&portrait));
    page.section("Histograms", &histograms(&portrait));
    page.section("Forward in time", &side_by_side(&forward(report.settled.as_ref(), report.certificate.as_ref())));
    page.section("Report", &format!("<pre>{}</pre>\n", escape(&report.text())));
    page.section("Notes", &list(report.warnings.iter().chain(&report.notes).cloned().collect::<Vec<_>>()));
    page.section("Scene", &format!("<pre>{}</pre>\n", escape(&scene.to_yaml())));
    let mut rows = vec![
        vec!["units of the output".into(), portrait.labels.system.clone()],
        vec!["program".into(), format!("sph-prep {}", env!("CARGO_PKG_VERSION"))],
    ];
    if !command.is_empty() {
        rows.push(vec!["command".into(), command.into()]);
    }
    page.section("Units and versions", &table("", &[], &rows));
    page.section("What the numbers mean", &explanations());
    Ok(page.finish())
}

/// The verdict on one body by itself, as its own report has it.
fn lead(body: &BodyReport) -> String {
    let lines: Vec<(Grade, String, Option<Topic>)> = body
        .findings()
        .into_iter()
        .map(|BodyFinding { grade, topic: name, text }| {
            let topic = Topic::ALL.into_iter().find(|t| t.name() == name);
            (grade, format!("{name}: {text}"), topic)
        })
        .collect();
    let worst = lines.iter().map(|l| l.0).max().unwrap_or(Grade::Good);
    let headline = match body.figures {
        Some(_) => format!("{}: {}", body.name, worst.summary()),
        None => format!("{}: a point", body.name),
    };
    lead_of(worst, &headline, lines.into_iter().map(|(grade, text, topic)| (grade.mark(), grade, text, topic)))
}
