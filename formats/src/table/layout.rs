//! The layout of a table: which line names the columns, and what separates them.

use crate::common::text::{Text, parse_number};
use crate::error::Result;
use crate::registry::plain_name;
use crate::units::{Unit, UnitDimension};

/// What stands between two fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    White,
    Tab,
    Comma,
    Semicolon,
}

impl Delimiter {
    /// Of a row of numbers.
    fn of(row: &str) -> Self {
        if row.contains(';') {
            Self::Semicolon
        } else if row.contains(',') {
            Self::Comma
        } else {
            Self::White
        }
    }

    /// The fields of a line, trimmed. Fields in double quotes may hold the delimiter.
    pub fn split(self, line: &str) -> Vec<&str> {
        let separator = match self {
            Self::White => return line.split_whitespace().collect(),
            Self::Tab => '\t',
            Self::Comma => ',',
            Self::Semicolon => ';',
        };
        let mut quoted = false;
        let fields = line.trim_end_matches(['\r', '\n']).split(|c: char| {
            quoted ^= c == '"';
            c == separator && !quoted
        });
        let mut fields: Vec<_> = fields.map(|f| f.trim().trim_matches('"').trim()).collect();
        // A delimiter at the end of each line opens no further column.
        if fields.len() > 1 && fields.last() == Some(&"") {
            fields.pop();
        }
        fields
    }
}

/// A number of a row in which commas stand for decimal points: between digits, in fields that something else parts.
fn decimal_comma(row: &str) -> Option<&str> {
    let fields: Vec<&str> = match row.contains(';') {
        true => row.split(';').map(str::trim).filter(|field| !field.is_empty()).collect(),
        false => row.split_whitespace().collect(),
    };
    let is_one = |field: &str| {
        let Some((whole, rest)) = field.split_once(',') else { return false };
        let [last, first] = [whole.bytes().last(), rest.bytes().next()];
        let is_between = last.is_some_and(|c| c.is_ascii_digit()) && first.is_some_and(|c| c.is_ascii_digit());
        is_between && parse_number(&field.replacen(',', ".", 1)).is_some()
    };
    let is_number = |field: &&str| is_one(field) || parse_number(field).is_some();
    let are_all = (fields.len() > 1 || row.contains(';')) && fields.iter().all(is_number);
    fields.iter().copied().find(|field| are_all && is_one(field))
}

/// Name and unit of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading {
    /// As in the file, unit and all.
    pub column: String,
    pub name: String,
    pub unit: Option<String>,
}

/// Everything about a table but its numbers.
#[derive(Debug)]
pub struct Layout {
    pub delimiter: Delimiter,
    pub headings: Vec<Heading>,
    /// Lines before the numbers that name nothing, without their comment sign.
    pub comments: Vec<String>,
    /// Line of the first row of numbers.
    pub first_row: usize,
}

/// The text behind the sign of a comment line.
pub fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    ["#", "!", "%", "//"].iter().find_map(|sign| line.strip_prefix(sign)).map(|rest| rest.trim_start_matches('#'))
}

/// Whether a line is a row of numbers: no comment, and its first field is a number.
pub fn is_row(line: &str) -> bool {
    if comment(line).is_some() {
        return false;
    }
    let mut fields = line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|f| !f.is_empty());
    fields.next().is_some_and(|f| parse_number(f.trim_matches('"')).is_some())
}

impl Layout {
    /// # Errors
    /// [`crate::FormatError::Input`] where there are no numbers, or no line names the columns.
    pub fn find(text: &Text) -> Result<Self> {
        let (mut above, mut row) = (Vec::new(), None);
        for (number, line) in text.lines() {
            if is_row(line) {
                row = Some((number, line));
                break;
            }
            above.push(line);
        }
        let Some((first_row, row)) = row else {
            return Err(text.error("content", "has no row of numbers"));
        };
        let mut delimiter = Delimiter::of(row);
        let mut width = delimiter.split(row).len();
        if delimiter == Delimiter::White && is_tabbed(&above, row) {
            delimiter = Delimiter::Tab;
            width = delimiter.split(row).len();
        }
        if let Some(field) = decimal_comma(row) {
            let problem = format!("has numbers with decimal commas, as '{field}'; expected decimal points");
            return Err(text.line_error(first_row, problem));
        }
        if row.split_whitespace().any(|field| comment(field).is_some()) {
            let problem =
                "has a comment behind its numbers; expected numbers alone, and comments on lines of their own";
            return Err(text.line_error(first_row, problem));
        }
        let Some((chosen, names)) = header(&above, delimiter, width, row) else {
            let problem = format!(
                "no line above names its {width} columns; put one there, such as '# r [cm]  density [g/cm^3]', \
                 with one name per column"
            );
            return Err(text.line_error(first_row, problem));
        };
        let mut headings: Vec<Heading> = names.iter().map(|name| heading(name)).collect();
        let units = above.iter().filter_map(|line| unit_line(line, delimiter, width, row)).next_back();
        for (heading, unit) in headings.iter_mut().zip(units.unwrap_or_default()) {
            if heading.unit.is_none() && !unit.is_empty() {
                heading.unit = Some(unit);
            }
        }
        let unnamed = above.iter().enumerate().filter(|(i, _)| *i != chosen);
        let comments = unnamed.filter_map(|(_, line)| comment(line)).map(|c| c.trim().to_owned());
        let comments = comments.filter(|c| !c.is_empty()).collect();
        Ok(Self { delimiter, headings, comments, first_row })
    }
}

/// Whether single tabs separate the columns of both a header line and the first row, without empty fields.
fn is_tabbed(above: &[&str], row: &str) -> bool {
    let count = |line: &str| {
        let fields = Delimiter::Tab.split(line);
        (fields.len() > 1 && fields.iter().all(|f| !f.is_empty())).then_some(fields.len())
    };
    let columns = count(row);
    columns.is_some() && above.iter().any(|line| count(line) == columns)
}

/// The line that names the columns, and the names: the last one that has as many as there are columns, but a line
/// with a coordinate and a density goes first.
fn header(above: &[&str], delimiter: Delimiter, width: usize, row: &str) -> Option<(usize, Vec<String>)> {
    let mut best = None;
    for (i, line) in above.iter().enumerate().rev() {
        let is_comment = comment(line);
        let Some(names) = names(is_comment.unwrap_or(line), delimiter, width)
            .or_else(|| slices(line, width, row).filter(|names| are_names(names)))
        else {
            continue;
        };
        if is_unit_line(&names) {
            continue;
        }
        let known = |wanted: fn(&str) -> bool| names.iter().any(|n| wanted(&plain_name(&heading(n).name)));
        if is_comment.is_none() || known(is_density) && known(is_coordinate) {
            return Some((i, names));
        }
        best = best.or(Some((i, names)));
    }
    best
}

/// The names in a header line, if it has `width` of them by any way of writing.
fn names(line: &str, delimiter: Delimiter, width: usize) -> Option<Vec<String>> {
    let owned = |fields: Vec<&str>| -> Vec<String> { fields.into_iter().map(str::to_owned).collect() };
    let ways: [fn(&str) -> Vec<&str>; 6] = [
        bracketed,
        |line| Delimiter::Tab.split(line).into_iter().filter(|f| !f.is_empty()).collect(),
        |line| Delimiter::Comma.split(line),
        |line| line.split("  ").map(str::trim).filter(|f| !f.is_empty()).collect(),
        |line| Delimiter::White.split(line),
        words_with_units,
    ];
    let by_delimiter = (delimiter != Delimiter::White).then(|| owned(delimiter.split(line)));
    let mut all = by_delimiter.into_iter().chain(ways.iter().map(|way| owned(way(line))));
    all.find(|names| names.len() == width && are_names(names))
}

fn are_names(names: &[String]) -> bool {
    names.iter().all(|n| !n.is_empty() && parse_number(n).is_none())
}

/// `[ Mass ] [ Radius ]`: a line of nothing but bracketed names.
fn bracketed(line: &str) -> Vec<&str> {
    let mut names = Vec::new();
    for part in line.split_inclusive(']') {
        match part.trim().strip_prefix('[').and_then(|p| p.strip_suffix(']')) {
            Some(name) => names.push(name.trim()),
            None if part.trim().is_empty() => {}
            None => return Vec::new(),
        }
    }
    names
}

/// `radius [m] density [kg m-3]`: words, each with the bracket that follows it.
fn words_with_units(line: &str) -> Vec<&str> {
    let mut names = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let word = rest.find(|c: char| c.is_whitespace() || c == '[' || c == '(').unwrap_or(rest.len());
        let after = rest.get(word..).unwrap_or_default();
        let bracket = after.trim_start();
        let end = if bracket.starts_with(['[', '(']) {
            let close = bracket.find([']', ')']).map_or(bracket.len(), |i| i + 1);
            rest.len() - bracket.len() + close
        } else {
            word
        };
        let (name, next) = rest.split_at(end.max(1).min(rest.len()));
        names.push(name.trim());
        rest = next.trim_start();
    }
    names
}

/// Fixed-width fields of a line, cut where the numbers of the first row end.
fn slices(line: &str, width: usize, row: &str) -> Option<Vec<String>> {
    let mut ends = Vec::with_capacity(width);
    let mut inside = false;
    for (i, b) in row.bytes().enumerate() {
        if inside && b.is_ascii_whitespace() {
            ends.push(i);
        }
        inside = !b.is_ascii_whitespace();
    }
    if inside {
        ends.push(row.len());
    }
    if ends.len() != width || !line.is_ascii() {
        return None;
    }
    let mut start = 0;
    let mut fields = Vec::with_capacity(width);
    for end in ends {
        let field = line.get(start..end.min(line.len())).unwrap_or_default();
        // A word across the cut: this line does not keep to the columns.
        let cut = field.ends_with(|c: char| !c.is_whitespace())
            && line.get(end..).is_some_and(|rest| rest.starts_with(|c: char| !c.is_whitespace()));
        if cut {
            return None;
        }
        fields.push(comment(field).unwrap_or(field).trim().to_owned());
        start = end;
    }
    Some(fields)
}

fn is_unit_line(names: &[String]) -> bool {
    names.first().is_some_and(|n| matches!(n.to_ascii_lowercase().as_str(), "unit" | "units"))
}

/// Units of all columns, from a comment line that starts with `unit`.
fn unit_line(line: &str, delimiter: Delimiter, width: usize, row: &str) -> Option<Vec<String>> {
    let rest = comment(line)?;
    let found = slices(line, width, row).filter(|u| is_unit_line(u)).or_else(|| names(rest, delimiter, width))?;
    is_unit_line(&found).then_some(found)
}

/// Splits `density [kg/m^3]`, `radius(m)`, `radius_cm` and `m/Msun` into name and unit.
fn heading(column: &str) -> Heading {
    let plain = Heading { column: column.to_owned(), name: column.to_owned(), unit: None };
    let with = |name: &str, unit: &str| Heading {
        name: name.trim().to_owned(),
        unit: Some(unit.trim().to_owned()),
        ..plain.clone()
    };
    for (open, close, certain) in [('[', ']', true), ('(', ')', false)] {
        let Some((name, unit)) = column.trim_end().strip_suffix(close).and_then(|c| c.rsplit_once(open)) else {
            continue;
        };
        // Parentheses hold other things too, as in `log(rho)`; square brackets hold units.
        if !name.trim().is_empty() && (certain || Unit::parse(unit).is_some()) {
            return with(name, unit);
        }
    }
    let apart = ['_', '/'].into_iter().filter_map(|mark| column.split_once(mark));
    for (name, unit) in apart {
        let stated = Unit::parse(unit).filter(|_| !unit.is_empty()).map(|u| u.dimension);
        if stated.is_some() && measured_in(&plain_name(name)) == stated {
            return with(name, unit);
        }
    }
    plain
}

/// What a plain name measures, where its unit may follow without brackets.
fn measured_in(name: &str) -> Option<UnitDimension> {
    match name {
        _ if is_coordinate(name) => Some(UnitDimension::LENGTH),
        _ if is_density(name) => Some(UnitDimension::mass_density(3)),
        "m" | "mass" | "mr" | "menc" | "enclosedmass" => Some(UnitDimension::MASS),
        "p" | "pressure" | "press" | "pres" => Some(UnitDimension::PRESSURE),
        "t" | "temp" | "temperature" => Some(UnitDimension::TEMPERATURE),
        _ => None,
    }
}

/// Whether a plain name means the mass density.
pub fn is_density(name: &str) -> bool {
    matches!(name, "density" | "rho" | "massdensity" | "gasdensity" | "celldensity" | "dens")
}

/// Whether a plain name means a radius.
pub fn is_radius(name: &str) -> bool {
    matches!(name, "r" | "radius" | "rad" | "radialcoordinate" | "radialdistance") || is_outer_radius(name)
}

/// Whether a plain name means the radius of a cell's middle (MESA's `rmid`).
pub fn is_middle_radius(name: &str) -> bool {
    matches!(name, "rmid" | "radiusmid" | "rcenter" | "midradius" | "centerradius")
}

/// Whether a plain name means the outer radius of a cell.
pub fn is_outer_radius(name: &str) -> bool {
    matches!(name, "outerradius" | "cellouterradius" | "router" | "radiusouter" | "cellradius")
}

/// The axis (0, 1, 2) that a plain name means.
pub fn cartesian_axis(name: &str) -> Option<usize> {
    let axes = [
        ["x", "xpos", "posx", "xcoord", "xcoordinate", "coordinatesx", "points0"],
        ["y", "ypos", "posy", "ycoord", "ycoordinate", "coordinatesy", "points1"],
        ["z", "zpos", "posz", "zcoord", "zcoordinate", "coordinatesz", "points2"],
    ];
    axes.iter().position(|names| names.contains(&name))
}

fn is_coordinate(name: &str) -> bool {
    is_radius(name) || is_middle_radius(name) || cartesian_axis(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(column: &str) -> (String, Option<String>) {
        let heading = heading(column);
        (heading.name, heading.unit)
    }

    #[test]
    fn units_are_split_from_names() {
        for (column, name, unit) in [
            ("density [kg/m^3]", "density", Some("kg/m^3")),
            ("Radius(m)", "Radius", Some("m")),
            ("radius_cm", "radius", Some("cm")),
            ("m/Msun", "m", Some("Msun")),
            ("rho/g cm^-3", "rho", Some("g cm^-3")),
            ("T/K", "T", Some("K")),
            ("mass_g", "mass", Some("g")),
            ("m/s", "m/s", None),
            ("P/rho", "P/rho", None),
            ("mass_fraction", "mass_fraction", None),
            ("log(rho)", "log(rho)", None),
            ("E [furlong]", "E", Some("furlong")),
            ("[m]", "[m]", None),
            ("r_s", "r_s", None),
            ("P", "P", None),
        ] {
            assert_eq!(split(column), (name.to_owned(), unit.map(str::to_owned)), "{column}");
        }
    }

    #[test]
    fn names_are_found_in_every_way_of_writing() {
        for (line, width, expected) in [
            (" r, density", 2, vec!["r", "density"]),
            ("r rho", 2, vec!["r", "rho"]),
            ("[ Mass ]  [ E_int ]", 2, vec!["Mass", "E_int"]),
            ("outer radius  cell density", 2, vec!["outer radius", "cell density"]),
            ("r [m] rho [kg m-3]", 2, vec!["r [m]", "rho [kg m-3]"]),
            ("Depth(m)\tVs(m/s)\t\tQ mu", 3, vec!["Depth(m)", "Vs(m/s)", "Q mu"]),
        ] {
            assert_eq!(
                names(line, Delimiter::White, width),
                Some(expected.into_iter().map(str::to_owned).collect()),
                "{line}"
            );
        }
        assert_eq!(names("1.0 2.0", Delimiter::White, 2), None);
        assert_eq!(names("one two three", Delimiter::White, 2), None);
    }

    #[test]
    fn quoted_and_trailing_delimiters_are_csv() {
        assert_eq!(Delimiter::Comma.split(r#""r, cm", "rho",1,"#), ["r, cm", "rho", "1"]);
        assert_eq!(Delimiter::Semicolon.split("1,5; 2 ;;3"), ["1,5", "2", "", "3"]);
    }
}
