//! `sph-prep plot`: pictures of a particle file.

use super::args::PlotArgs;
#[cfg(feature = "plots")]
use crate::error::Error;
use crate::error::Result;
use sph_formats::FormatSpec;

/// Draws the file; returns what to print.
///
/// # Errors
/// A file that cannot be read or holds no particles, or an output that is neither a page nor a picture.
#[cfg(feature = "plots")]
pub fn run(formats: &[FormatSpec], args: &PlotArgs, command: &str) -> Result<String> {
    use super::files::particles;
    use crate::run::destination::refuse_replacing;

    let output = args.output.clone().unwrap_or_else(|| args.file.with_extension("html"));
    let extension = output.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !["html", "htm", "png"].contains(&extension.as_str()) {
        let problem = format!("is '{}', expected a page (.html) or a picture (.png)", output.display());
        return Err(Error::scene("--out", problem));
    }
    refuse_replacing("--out", &output, &args.file)?;
    sph_formats::output::probe(&output)?;
    let name = args.file.display().to_string();
    let progress = super::progress::Progress::new(false);
    progress.begin("read");
    let file = particles(formats, &args.file, args.format.as_deref())?;
    progress.begin("draw");
    let bytes = match extension.as_str() {
        "png" => crate::page::picture(&crate::page::Portrait::new(&file, None)?)?,
        _ => crate::page::page_of_file(&file, &name, command)?.into_bytes(),
    };
    crate::page::write(&output, &bytes)?;
    Ok(format!("wrote {}\n", super::written::listed(&[output])))
}

/// Says which feature is missing.
///
/// # Errors
/// Always.
#[cfg(not(feature = "plots"))]
pub fn run(_: &[FormatSpec], _: &PlotArgs, _: &str) -> Result<String> {
    Err(crate::error::Error::scene("plot", "this build draws no pictures; build it with the feature 'plots'"))
}
