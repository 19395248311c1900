//! Code shared by the readers of surfaces: from points and facets to a field.

#[cfg(any(feature = "obj", feature = "ply"))]
use super::polygon;
use crate::error::{FormatError, Result};
use crate::model::{Geometry, RawField};
use crate::registry::FileContent;
use std::path::Path;

/// Most points, and most facets: they are counted in 32 bits.
pub const MAX_COUNT: u64 = u32::MAX as u64 / 3;

/// A surface being read.
pub struct Surface<'a> {
    pub path: &'a Path,
    pub format: &'static str,
    pub points: Vec<[f64; 3]>,
    /// Three points each.
    pub triangles: Vec<u32>,
    /// Two points each.
    pub segments: Vec<u32>,
    pub metadata: Vec<(String, String)>,
    pub notes: Vec<String>,
}

impl<'a> Surface<'a> {
    pub fn new(path: &'a Path, format: &'static str) -> Self {
        let (points, triangles, segments) = (Vec::new(), Vec::new(), Vec::new());
        Self { path, format, points, triangles, segments, metadata: Vec::new(), notes: Vec::new() }
    }

    pub fn error(&self, location: impl Into<String>, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, self.format, location, problem)
    }

    /// Refuses numbers of points or facets that 32 bits do not count.
    ///
    /// # Errors
    /// [`FormatError::Limit`].
    pub fn check_count(&self, location: &str, count: u64) -> Result<()> {
        if count <= MAX_COUNT {
            return Ok(());
        }
        Err(FormatError::Limit {
            path: self.path.into(),
            format: self.format,
            location: location.into(),
            declared: format!("{count} entries"),
            allowed: format!("{MAX_COUNT}"),
        })
    }

    /// Adds a polygon of points that are known before as triangles.
    #[cfg(any(feature = "obj", feature = "ply"))]
    pub fn add_polygon(&mut self, corners: &[u32]) {
        self.triangles.extend(polygon::triangles(&self.points, corners));
    }

    /// Triangles where there are some; else segments that lie in a plane of constant z, as a curve in two dimensions.
    ///
    /// # Errors
    /// Neither of the two.
    pub fn finish(self) -> Result<FileContent> {
        let (dimension, facets) = match (self.triangles.is_empty(), self.segments.is_empty()) {
            (false, _) => (3, &self.triangles),
            (true, false) => (2, &self.segments),
            (true, true) => return Err(self.error("content", "has no faces, expected a surface of triangles")),
        };
        if let Some(p) = facets.iter().find(|p| **p as usize >= self.points.len()) {
            let problem = format!("name point {} of {}", u64::from(*p) + 1, self.points.len());
            return Err(self.error("faces", problem));
        }
        let level = |p: &u32| self.points.get(*p as usize).map_or(0.0, |x| x[2]);
        if dimension == 2 && facets.iter().any(|p| level(p) != facets.first().map_or(0.0, level)) {
            let problem =
                "has lines that do not lie in a plane of constant z and no faces; a surface in 3-D is made of faces";
            return Err(self.error("content", problem));
        }
        let mut notes = self.notes;
        if dimension == 3 && !self.segments.is_empty() {
            notes.push(format!("{} lines beside the faces were left out", self.segments.len() / 2));
        }
        let facets = if dimension == 3 { self.triangles } else { self.segments };
        Ok(FileContent::Field(RawField {
            path: self.path.into(),
            format: self.format,
            geometry: Geometry::Surface { dimension, points: self.points, unit: None, facets },
            variables: Vec::new(),
            density: None,
            metadata: self.metadata,
            notes,
        }))
    }
}
