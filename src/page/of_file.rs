//! The page of a particle file from any program.

use super::axis::rounded;
use super::html::{Page, escape, list, table};
use super::portrait::Portrait;
use super::sections::{histograms, pictures, profiles};
use super::statistics::quantile;
use crate::error::Result;
use sph_formats::ParticleFile;
use std::fmt::Write;

/// The page; `name` is the file's, `command` what was called.
///
/// # Errors
/// A file without particles, or with values that are none.
pub fn page_of_file(file: &ParticleFile, name: &str, command: &str) -> Result<String> {
    let portrait = Portrait::new(file, None)?;
    let header = &file.header;
    let mut page = Page::new(name);
    page.add(&lead(&portrait));
    page.section("Pictures", &pictures(&portrait)?);
    page.section("Profile", &profiles(&portrait));
    page.section("Histograms", &histograms(&portrait));
    page.section("Columns", &columns(file));
    let edges: Vec<String> = header.box_size[..portrait.dimension].iter().map(|e| format!("{e:e}")).collect();
    let mut rows = vec![
        vec!["units".into(), portrait.labels.system.clone()],
        vec!["box".into(), format!("[{}] {}", edges.join(", "), portrait.labels.length)],
        vec!["time".into(), format!("{:e} of the file's units", header.time)],
    ];
    let scene = header.provenance.iter().find(|(key, _)| key == "Scene");
    rows.extend(header.provenance.iter().filter(|(key, _)| key != "Scene").map(|(k, v)| vec![k.clone(), v.clone()]));
    rows.push(vec!["page".into(), format!("sph-prep {}", env!("CARGO_PKG_VERSION"))]);
    rows.push(vec!["command".into(), command.into()]);
    page.section("File", &table("", &[], &rows));
    if let Some((_, scene)) = scene {
        page.section("Scene", &format!("<pre>{}</pre>\n", escape(scene)));
    }
    Ok(page.finish())
}

/// What can be said of particles whose target nobody states.
fn lead(portrait: &Portrait) -> String {
    let sorted = |values: &[f64]| {
        let mut values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    };
    let (noise, near) = (sorted(&portrait.detail.noise), sorted(&portrait.detail.nearest));
    let mut lines = Vec::new();
    if let Some(median) = quantile(&noise, 0.5) {
        lines.push(format!(
            "Force noise: {} % of a random set's in the median (below 10 % is quiet, 100 % is random).",
            rounded(100.0 * median)
        ));
    }
    if let (Some(closest), Some(median)) = (near.first(), quantile(&near, 0.5)) {
        lines.push(format!(
            "Closest pair: {} mean spacings apart; the median particle's nearest neighbor is at {}.",
            rounded(*closest),
            rounded(median)
        ));
    }
    let errors = sorted(&(0..portrait.count()).filter_map(|i| Some(portrait.error(i)?.abs())).collect::<Vec<_>>());
    lines.push(match quantile(&errors, 0.5) {
        Some(median) => format!("Density against the file's own target: off by {} % in the median.", rounded(100.0 * median)),
        None => "The file does not say which density was wanted, so that there is no error to show (output.target_density writes it).".into(),
    });
    lines.extend(portrait.notes.iter().map(|n| format!("Note: {n}.")));
    let mut out = String::from("<div class=\"lead\">\n");
    let _ = write!(out, "<p>{} particles in {}-D</p>\n{}</div>\n", portrait.count(), portrait.dimension, list(lines));
    out
}

/// What each column holds.
fn columns(file: &ParticleFile) -> String {
    let mut rows = Vec::new();
    for species in &file.species {
        for column in &species.table.columns {
            let (lo, hi, bad) = column.values.range();
            let unit = file.header.units.symbol(column.dimension);
            rows.push(vec![
                format!("{} (type {})", column.name, species.part_type),
                species.table.count.to_string(),
                format!("{lo:.4e}"),
                format!("{hi:.4e}"),
                if unit.is_empty() { "1".into() } else { unit },
                if bad > 0 { format!("{bad} are no numbers") } else { String::new() },
            ]);
        }
    }
    table("numbers", &["column", "particles", "least", "largest", "unit", ""], &rows)
}
