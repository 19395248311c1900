//! The names of the hydro variables: those of the descriptor or, if there is none, RAMSES' default order.

use super::schema::NAME;
use crate::common::text::Text;
use crate::error::Result;
use std::path::Path;

const FILE: &str = "hydro_file_descriptor.txt";
/// Magnetic runs have as many variables or more: three velocities and six faces' fields beside density and pressure.
const LEAST_MAGNETIC: usize = 11;

/// Names of `count` variables, with a note where they are not those of a file.
///
/// # Errors
/// [`crate::FormatError::Input`] where the descriptor beside `info` names other numbers of variables, or a variable twice.
pub fn names(info: &Path, dimension: usize, count: usize) -> Result<(Vec<String>, Option<String>)> {
    let path = info.with_file_name(FILE);
    if !path.is_file() {
        let (names, what) = by_order(dimension, count);
        return Ok((names, Some(format!("there is no {FILE}: {what}"))));
    }
    let text = Text::read(&path, NAME)?;
    let mut names: Vec<String> = Vec::new();
    for (line, content) in text.lines() {
        let Some((number, name)) = entry(content) else { continue };
        if number != names.len() + 1 {
            let problem = format!("names variable {number} after {} others, expected {}", names.len(), names.len() + 1);
            return Err(text.line_error(line, problem));
        }
        if names.contains(&name) {
            return Err(text.line_error(line, format!("names '{name}' twice")));
        }
        names.push(name);
    }
    if names.len() != count {
        let problem = format!("names {} variables, but the hydro files have {count}", names.len());
        return Err(text.error("content", problem));
    }
    Ok((names, None))
}

/// Number and name in a line of either style: `variable # 1: density` or ` 1, density, d`.
fn entry(line: &str) -> Option<(usize, String)> {
    let (number, name) = match line.trim_start().strip_prefix("variable #") {
        Some(rest) => rest.split_once(':')?,
        None => {
            let (number, rest) = line.split_once(',')?;
            (number, rest.split(',').next()?)
        }
    };
    Some((number.trim().parse().ok()?, name.trim().to_owned()))
}

/// The order of hydro runs, as far as it is sure, and what that is in words.
fn by_order(dimension: usize, count: usize) -> (Vec<String>, &'static str) {
    let is_hydro = count < LEAST_MAGNETIC;
    let velocities = if is_hydro || dimension == 3 { dimension } else { 0 };
    let name = |i: usize| match i {
        0 => "density".to_owned(),
        i if i <= velocities => format!("velocity_{}", ["x", "y", "z"][i - 1]),
        i if is_hydro && i == dimension + 1 => "pressure".to_owned(),
        i if is_hydro => format!("scalar_{:02}", i - dimension - 2),
        i => format!("variable_{}", i + 1),
    };
    let what = match is_hydro {
        true => "the variables are taken for those of a hydro run, in their order",
        false => "a run of so many variables may be magnetic or not, so that only those that both share have names",
    };
    ((0..count).map(name).collect(), what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_either_style() {
        assert_eq!(entry("variable # 2: velocity_x"), Some((2, "velocity_x".into())));
        assert_eq!(entry("variable #12: passive_scalar_1"), Some((12, "passive_scalar_1".into())));
        assert_eq!(entry("  3, B_x_left, d"), Some((3, "B_x_left".into())));
        for line in ["nvar        =          6", "# version:  1", "# ivar, variable_name, variable_type", ""] {
            assert_eq!(entry(line), None, "{line}");
        }
    }

    #[test]
    fn the_order_names_what_is_sure() {
        assert_eq!(by_order(1, 3).0, ["density", "velocity_x", "pressure"]);
        assert_eq!(by_order(2, 5).0, ["density", "velocity_x", "velocity_y", "pressure", "scalar_00"]);
        assert_eq!(by_order(3, 11).0[3..5], ["velocity_z", "variable_5"]);
        assert_eq!(by_order(2, 11).0[..2], ["density", "variable_2"]);
    }
}
