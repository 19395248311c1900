//! Points, faces and lines of a file.

use super::schema::{LEFT_OUT, NAME};
use crate::common::surface::Surface;
use crate::common::text::Text;
use crate::error::Result;
use crate::registry::{FieldRequest, FileContent};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads a surface.
///
/// # Errors
/// Points that are no numbers, faces of fewer than three points or of points that are not there, and a file without faces.
pub fn read(path: &Path, _: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let mut surface = Surface::new(path, NAME);
    let mut unread: BTreeMap<String, usize> = BTreeMap::new();
    let mut corners = Vec::new();
    let mut lines = text.lines();
    while let Some((number, line)) = lines.next() {
        let mut line = Cow::Borrowed(line.trim_end());
        while let Some(begun) = line.strip_suffix('\\') {
            let next = lines.next().map_or("", |(_, next)| next.trim_end());
            line = Cow::Owned([begun, " ", next].concat());
        }
        let content = line.split('#').next().unwrap_or("");
        let mut words = content.split_whitespace();
        let Some(word) = words.next() else { continue };
        match word {
            "v" => {
                let mut point = [0.0; 3];
                for (coordinate, axis) in point.iter_mut().zip(["x", "y", "z"]) {
                    *coordinate = text.number(number, axis, words.next().unwrap_or(""))?;
                }
                surface.points.push(point);
            }
            "f" | "l" => {
                corners.clear();
                for word in words {
                    let found = point_number(word, surface.points.len());
                    corners.push(found.map_err(|problem| text.line_error(number, problem))?);
                }
                let least = if word == "f" { 3 } else { 2 };
                if corners.len() < least {
                    let problem = format!("has {} points, expected at least {least}", corners.len());
                    return Err(text.line_error(number, problem));
                }
                match word {
                    "f" => surface.add_polygon(&corners),
                    _ => surface.segments.extend(corners.windows(2).flatten()),
                }
            }
            _ if LEFT_OUT.contains(&word) => {}
            _ => *unread.entry(word.chars().take(20).collect()).or_default() += 1,
        }
    }
    surface.check_count("points", surface.points.len() as u64)?;
    surface.check_count("faces", surface.triangles.len() as u64 / 3)?;
    surface.check_count("lines", surface.segments.len() as u64 / 2)?;
    surface.notes.extend(unread.iter().take(5).map(|(word, n)| format!("{n} lines of '{word}' were left out")));
    surface.finish()
}

/// The point, from 0, that a corner names.
fn point_number(word: &str, points: usize) -> std::result::Result<u32, String> {
    let number = word.split('/').next().unwrap_or("");
    let back = |n: i64| n.checked_add(i64::try_from(points).ok()?);
    let place = number.parse::<i64>().ok().and_then(|n| if n < 0 { back(n) } else { n.checked_sub(1) });
    match place.and_then(|p| u32::try_from(p).ok()) {
        // Points may be listed behind the faces; what is never listed is found in the end.
        Some(place) => Ok(place),
        None => {
            let shown: String = number.chars().take(20).collect();
            Err(format!("names point '{shown}', expected a number from 1, or from -1 to -{points}"))
        }
    }
}
