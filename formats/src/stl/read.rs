//! Triangles of a file.

use super::schema::{HEADER_BYTES, NAME, RECORD_BYTES, declared, is_text};
use crate::common::surface::Surface;
use crate::common::text::Text;
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::registry::{FieldRequest, FileContent};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Memory of a triangle once read: three points and their numbers.
const BYTES_IN_MEMORY: u64 = 3 * 24 + 12;

/// Reads a surface.
///
/// # Errors
/// A file that is neither kind of STL, is truncated, or has corners that are no numbers.
pub fn read(path: &Path, _: &FieldRequest) -> Result<FileContent> {
    let io = |e| FormatError::io(path, "read", e);
    let mut file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let length = file.metadata().map_err(io)?.len();
    let mut head = Vec::new();
    file.by_ref().take(HEADER_BYTES as u64).read_to_end(&mut head).map_err(io)?;
    let count = declared(&head).map_or(0, u64::from);
    let whole =
        (HEADER_BYTES + RECORD_BYTES) as u64 <= length && HEADER_BYTES as u64 + RECORD_BYTES as u64 * count == length;
    let is_ascii = head.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace());
    if !whole && (is_text(&head) || (is_ascii && head.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))))
    {
        return text(path);
    }
    let mut surface = Surface::new(path, NAME);
    let found = length.saturating_sub(HEADER_BYTES as u64) / RECORD_BYTES as u64;
    if head.len() < HEADER_BYTES || count == 0 {
        let problem = format!("has {length} bytes and {count} triangles, expected a header of 84 bytes and triangles");
        return Err(surface.error("header", problem));
    }
    if count > found {
        return Err(FormatError::Limit {
            path: path.into(),
            format: NAME,
            location: "header".into(),
            declared: format!("{count} triangles"),
            allowed: format!("the {found} that a file of {length} bytes can hold"),
        });
    }
    surface.check_count("header", count)?;
    Budget::new(length).take(path, NAME, "triangles", count * BYTES_IN_MEMORY)?;
    if !whole {
        let extra = length - HEADER_BYTES as u64 - RECORD_BYTES as u64 * count;
        surface.notes.push(format!("{extra} bytes behind the last triangle were left out"));
    }
    binary(BufReader::with_capacity(1 << 16, file), count as usize, surface)
}

fn binary(mut file: impl Read, count: usize, mut surface: Surface<'_>) -> Result<FileContent> {
    surface.points.reserve_exact(3 * count);
    let mut record = [0; RECORD_BYTES];
    for _ in 0..count {
        file.read_exact(&mut record).map_err(|e| FormatError::io(surface.path, "read", e))?;
        let mut numbers = record.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).skip(3);
        for _ in 0..3 {
            surface.points.push(std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN)));
        }
    }
    surface.triangles = (0..3 * count as u32).collect();
    surface.finish()
}

fn text(path: &Path) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let mut surface = Surface::new(path, NAME);
    // Of the triangle under way; none between two.
    let mut corners: Option<usize> = None;
    let (mut last, mut is_open) = (0, false);
    for (number, line) in text.lines() {
        last = number;
        let mut words = line.split_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("solid") => is_open = true,
            Some("endsolid") => is_open = false,
            Some("facet") if corners.is_none() => corners = Some(0),
            Some("vertex") => {
                let Some(seen) = corners.as_mut() else {
                    return Err(text.line_error(number, "has a vertex outside of a facet"));
                };
                *seen += 1;
                let mut point = [0.0; 3];
                for (coordinate, axis) in point.iter_mut().zip(["x", "y", "z"]) {
                    *coordinate = text.number(number, axis, words.next().unwrap_or(""))?;
                }
                surface.points.push(point);
            }
            Some("endfacet") => match corners.take() {
                Some(3) => {}
                seen => {
                    let problem = format!("ends a facet with {} vertices, expected 3", seen.unwrap_or(0));
                    return Err(text.line_error(number, problem));
                }
            },
            Some("outer" | "endloop" | "color") => {}
            word => {
                let problem = format!("begins with '{}', expected facet, vertex or the like", word.unwrap_or(""));
                return Err(text.line_error(number, problem));
            }
        }
    }
    if corners.is_some() || is_open {
        return Err(text.line_error(last, "is the last, without an endsolid; the file is truncated"));
    }
    surface.check_count("content", surface.points.len() as u64 / 3)?;
    surface.triangles = (0..surface.points.len() as u32).collect();
    surface.finish()
}
