//! Selects which variables of a file are read.

use crate::nearest::did_you_mean;
use crate::registry::FieldRequest;

/// Location and problem of a variable that is not there.
pub type Missing = (String, String);

/// The variables of `names` that a request wants, and the density: the requested one, else the first of `densities` that
/// there is.
///
/// # Errors
/// A requested variable that the file does not have.
pub fn wanted(
    names: &[String],
    request: &FieldRequest,
    densities: &[&str],
) -> Result<(Vec<String>, Option<String>), Missing> {
    let asked = request.density.iter().chain(request.carry.iter().flatten());
    if let Some(name) = asked.into_iter().find(|name| !names.contains(name)) {
        let hint = did_you_mean(name, names.iter().map(String::as_str));
        let problem = format!("there is no such variable; the file has {}{hint}", names.join(", "));
        return Err((format!("variable '{name}'"), problem));
    }
    let by_name = || densities.iter().find_map(|d| names.iter().find(|n| n.eq_ignore_ascii_case(d)));
    let density = request.density.clone().or_else(|| by_name().cloned());
    let is_wanted = |n: &&String| density.as_ref() == Some(*n) || request.takes(n);
    Ok((names.iter().filter(is_wanted).cloned().collect(), density))
}
