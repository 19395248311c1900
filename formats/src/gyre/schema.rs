//! The first line of a model, by which the file is also recognized.

use crate::common::text::parse_number;

pub const NAME: &str = "gyre";

/// Columns of a row for a version number; `None` for an unknown version.
pub fn column_count(version: u32) -> Option<usize> {
    match version {
        1 | 19 | 100 | 101 => Some(19),
        120 => Some(20),
        _ => None,
    }
}

/// Version of a header line, 1 where it states none; `None` where the line is no such header.
pub fn header_version(line: &str) -> Option<u32> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    let (points, rest) = fields.split_first()?;
    points.parse::<u64>().ok()?;
    let scalars = rest.get(..3)?;
    // Mass, radius and luminosity are written as reals, which tells the line from a row of counts.
    let real = |s: &&str| s.contains(['.', 'E', 'e', 'D', 'd']) && parse_number(s).is_some();
    if !scalars.iter().all(real) {
        return None;
    }
    match rest.get(3..) {
        Some([]) => Some(1),
        Some([version]) => version.parse().ok().filter(|v| column_count(*v).is_some()),
        _ => None,
    }
}
