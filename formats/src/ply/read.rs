//! Points and faces of a file.

use super::header::{Element, Encoding, Header, Number, Role, parse};
use super::schema::NAME;
use crate::common::surface::Surface;
use crate::common::text::parse_number;
use crate::error::{FormatError, Result};
use crate::limits::Budget;
use crate::registry::{FieldRequest, FileContent};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest header, in bytes.
const MAX_HEADER: u64 = 1 << 20;
/// Longest number as text.
const MAX_WORD: usize = 64;
/// Memory of a point or a triangle, at most.
const BYTES_IN_MEMORY: u64 = 24;

/// Reads a surface.
///
/// # Errors
/// A header that is not understood, more rows than the file can hold, a truncated file, points that are no numbers.
pub fn read(path: &Path, _: &FieldRequest) -> Result<FileContent> {
    let file = File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let length = file.metadata().map_err(|e| FormatError::io(path, "read", e))?.len();
    let mut file = BufReader::with_capacity(1 << 16, file);
    let mut surface = Surface::new(path, NAME);
    let (lines, header_bytes) = header_lines(&mut file, &surface)?;
    let Header { encoding, elements, comments } =
        parse(&lines).map_err(|(line, problem)| surface.error(format!("line {line}"), problem))?;
    surface.metadata.extend(comments.into_iter().take(20).map(|c| ("comment".into(), c)));
    check_sizes(&surface, &elements, encoding, length - header_bytes.min(length))?;
    let mut numbers = Numbers { file, encoding, path, location: String::new() };
    for element in &elements {
        numbers.location = format!("element '{}'", element.name);
        rows(&mut numbers, element, &mut surface)?;
    }
    surface.check_count("faces", surface.triangles.len() as u64 / 3)?;
    surface.finish()
}

fn header_lines(file: &mut impl BufRead, surface: &Surface<'_>) -> Result<(Vec<String>, u64)> {
    let (mut lines, mut bytes) = (Vec::new(), 0);
    loop {
        let mut line = Vec::new();
        let read = file.take(MAX_HEADER).read_until(b'\n', &mut line);
        bytes += read.map_err(|e| FormatError::io(surface.path, "read", e))? as u64;
        if line.is_empty() || bytes > MAX_HEADER {
            return Err(surface.error("header", "has no line `end_header`; the file is truncated or not a PLY file"));
        }
        let line = String::from_utf8_lossy(&line).trim_end().to_owned();
        if line == "end_header" {
            break;
        }
        lines.push(line);
    }
    match lines.first().map(String::as_str) {
        Some("ply") => Ok((lines, bytes)),
        _ => Err(surface.error("line 1", "is not `ply`; the file is of another format")),
    }
}

/// Refuses rows that do not fit into the `left` bytes behind the header.
fn check_sizes(surface: &Surface<'_>, elements: &[Element], encoding: Encoding, left: u64) -> Result<()> {
    let budget = Budget::new(left);
    let mut needed = 0_u64;
    for element in elements.iter().filter(|e| e.count > 0) {
        let location = format!("element '{}'", element.name);
        if element.properties.is_empty() {
            return Err(surface.error(location, format!("has {} rows without a property", element.count)));
        }
        // The last number of a text needs nothing behind it.
        needed = needed.saturating_add(element.count.saturating_mul(element.least_bytes(encoding)));
        if needed > left.saturating_add(1) {
            return Err(FormatError::Limit {
                path: surface.path.into(),
                format: NAME,
                location,
                declared: format!("{} rows", element.count),
                allowed: format!("the {left} bytes behind the header hold"),
            });
        }
        surface.check_count(&location, element.count)?;
        budget.take(surface.path, NAME, &location, element.count.saturating_mul(BYTES_IN_MEMORY))?;
    }
    let vertex = elements.iter().find(|e| e.name == "vertex");
    let has = |axis: usize| vertex.is_some_and(|v| v.properties.iter().any(|p| p.role == Role::Coordinate(axis)));
    if !(has(0) && has(1) && has(2)) {
        return Err(surface.error("header", "has no element 'vertex' with the properties x, y and z"));
    }
    Ok(())
}

fn rows(numbers: &mut Numbers<'_, impl BufRead>, element: &Element, surface: &mut Surface<'_>) -> Result<()> {
    let is_vertex = element.name == "vertex";
    let mut corners = Vec::new();
    for row in 0..element.count {
        let mut point = [0.0; 3];
        for property in &element.properties {
            let Some(length) = property.length else {
                let value = numbers.next(property.number, row)?;
                if let Role::Coordinate(axis) = property.role
                    && let Some(coordinate) = point.get_mut(axis)
                {
                    *coordinate = value;
                }
                continue;
            };
            let length = numbers.next(length, row)?;
            if !(length >= 0.0 && length <= f64::from(u32::MAX)) {
                let problem = format!("has a list of {length} entries in row {row}");
                return Err(surface.error(&numbers.location, problem));
            }
            corners.clear();
            for _ in 0..length as u64 {
                let value = numbers.next(property.number, row)?;
                match property.role {
                    Role::Polygon | Role::Strips => corners.push(value),
                    _ => {}
                }
            }
            add_faces(surface, property.role, &corners)
                .map_err(|value| surface.error(&numbers.location, format!("names point {value} in row {row}")))?;
        }
        if is_vertex {
            surface.points.push(point);
        }
    }
    Ok(())
}

/// Polygons, or strips of triangles; what is no number of a point is returned.
fn add_faces(surface: &mut Surface<'_>, role: Role, corners: &[f64]) -> std::result::Result<(), f64> {
    let number = |v: &f64| match v.fract() == 0.0 && (0.0..f64::from(u32::MAX)).contains(v) {
        true => Ok(*v as u32),
        false => Err(*v),
    };
    match role {
        Role::Polygon => {
            let corners = corners.iter().map(number).collect::<std::result::Result<Vec<_>, _>>()?;
            surface.add_polygon(&corners);
        }
        Role::Strips => {
            for strip in corners.split(|v| *v == -1.0) {
                let strip = strip.iter().map(number).collect::<std::result::Result<Vec<_>, _>>()?;
                for (i, w) in strip.windows(3).enumerate() {
                    let [a, b, c] = [w[0], w[1], w[2]];
                    surface.triangles.extend(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
                }
            }
        }
        _ => {}
    }
    Ok(())
}

/// Numbers of a file, one after the other.
struct Numbers<'a, R> {
    file: R,
    encoding: Encoding,
    path: &'a Path,
    location: String,
}

impl<R: BufRead> Numbers<'_, R> {
    fn next(&mut self, kind: Number, row: u64) -> Result<f64> {
        if self.encoding == Encoding::Text {
            return self.next_word(row);
        }
        let mut bytes = [0; 8];
        let Some(own) = bytes.get_mut(..kind.bytes()) else { return Ok(f64::NAN) };
        match self.file.read_exact(own) {
            Ok(()) => {}
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => return Err(self.truncated(row)),
            Err(e) => return Err(FormatError::io(self.path, "read", e)),
        }
        if self.encoding == Encoding::Big {
            own.reverse();
        }
        Ok(kind.value(bytes))
    }

    fn truncated(&self, row: u64) -> FormatError {
        let problem = format!("ends in row {row}; the file is truncated");
        FormatError::input(self.path, NAME, &self.location, problem)
    }

    fn next_word(&mut self, row: u64) -> Result<f64> {
        let mut word = Vec::new();
        loop {
            let buffer = self.file.fill_buf().map_err(|e| FormatError::io(self.path, "read", e))?;
            if buffer.is_empty() {
                break;
            }
            let skipped =
                if word.is_empty() { buffer.iter().take_while(|b| b.is_ascii_whitespace()).count() } else { 0 };
            let rest = buffer.get(skipped..).unwrap_or_default();
            let taken = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
            word.extend_from_slice(rest.get(..taken.min(MAX_WORD + 1)).unwrap_or_default());
            let is_ended = taken < rest.len();
            self.file.consume(skipped + taken);
            if (is_ended && !word.is_empty()) || word.len() > MAX_WORD {
                break;
            }
        }
        if word.is_empty() {
            return Err(self.truncated(row));
        }
        let text = String::from_utf8_lossy(&word);
        parse_number(&text).filter(|_| word.len() <= MAX_WORD).ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            FormatError::input(
                self.path,
                NAME,
                &self.location,
                format!("has '{shown}' in row {row}, expected a number"),
            )
        })
    }
}
