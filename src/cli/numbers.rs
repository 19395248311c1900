//! The explanations of a verdict's figures, from the manual's page: `sph-prep help numbers`.

use crate::error::{Error, Result};
use crate::run::verdict::EXPLANATIONS;
use crate::scene::reference::wrapped;
use sph_formats::did_you_mean;

/// The section of that name, as `force-noise`, or all where it is empty.
///
/// # Errors
/// A name that the page does not have, with those that it has.
pub fn help(name: &str) -> Result<String> {
    if name.is_empty() {
        return Ok(plain(EXPLANATIONS));
    }
    let sections = EXPLANATIONS.split("\n## ").skip(1).map(|section| (anchor(section), section));
    let sections: Vec<(String, &str)> = sections.collect();
    sections.iter().find(|(known, _)| known == name).map(|(_, section)| plain(section)).ok_or_else(|| {
        let known = || sections.iter().map(|(known, _)| known.as_str());
        let all = known().collect::<Vec<_>>().join(", ");
        Error::scene("help", format!("knows no figure '{name}'{}; there are {all}", did_you_mean(name, known())))
    })
}

/// By which a section is linked to.
fn anchor(section: &str) -> String {
    section.lines().next().unwrap_or("").to_lowercase().replace(' ', "-")
}

/// Paragraphs in lines that fit, without the marks of headings and of bold words.
fn plain(text: &str) -> String {
    let blocks = text.trim().split("\n\n").map(|block| block.trim_start_matches('#').replace("**", ""));
    blocks.map(|block| wrapped(&block, "")).collect::<Vec<_>>().join("\n")
}
