//! Reader of FGONG models.

use super::schema::{COMMON, HEADER_LINES, NAME, PER_LINE, Sizes, further};
use crate::common::columns::{Candidate, select};
use crate::common::fixed_width::Lines;
use crate::common::points::{self, Series};
use crate::common::text::Text;
use crate::error::Result;
use crate::model::{Location, RawField};
use crate::registry::{FieldRequest, FileContent};
use std::path::Path;

const RADIUS: usize = 0;
/// ln(m / M).
const LOG_MASS: usize = 1;
const DENSITY: usize = 4;
/// Global numbers worth telling: name and number.
const GLOBALS: [(&str, usize); 6] = [
    ("mass (g)", 0),
    ("photospheric radius (cm)", 1),
    ("luminosity (erg/s)", 2),
    ("age (yr)", 12),
    ("effective temperature (K)", 13),
    ("gravitational constant (cgs)", 14),
];

/// A model as written.
struct Model {
    title: Vec<String>,
    sizes: Sizes,
    globals: Vec<f64>,
    /// Line of the first global number.
    first: usize,
    /// By point, then by variable.
    values: Vec<f64>,
    /// Whether the first point is at the surface.
    is_inward: bool,
}

/// Reads a model.
///
/// # Errors
/// [`crate::FormatError::Input`] with line and column where it is damaged, incomplete or no star; [`crate::FormatError::Io`].
pub fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let text = Text::read(path, NAME)?;
    let model = Model::parse(&text)?;
    let nodes = model.column(RADIUS);
    let mass = model.mass(&text)?;
    let enclosed: Vec<f64> = model.column(LOG_MASS).into_iter().map(|q| mass * q.exp()).collect();
    let density = model.column(DENSITY);
    let place = |variable: usize| {
        let model = &model;
        move |point: usize| model.place(point, variable)
    };
    points::check(
        &text,
        &Series { values: &nodes, place: &place(RADIUS) },
        &Series { values: &enclosed, place: &place(LOG_MASS) },
        &Series { values: &density, place: &place(DENSITY) },
    )?;

    let mut notes =
        vec![format!("FGONG model, version {}: all variables belong to the same radii", model.sizes.version)];
    notes.extend(points::jumps_note(&nodes));
    notes.extend(points::mass_note(&nodes, &enclosed, &density));
    let node = |name: &str, unit: &str, values| Candidate::new(name, name, Some(unit), Location::Node, values);
    let mut candidates = vec![node("enclosed_mass", "g", enclosed)];
    candidates.extend(model.candidates(&mut notes));
    let selected = select(&text, request, candidates, Some("density".into()))?;
    Ok(FileContent::Field(RawField::stellar((path, NAME), nodes, selected, model.metadata(), notes)))
}

impl Model {
    fn parse(text: &Text) -> Result<Self> {
        let mut lines = Lines::new(text);
        let mut title = Vec::new();
        for _ in 0..HEADER_LINES {
            title.push(lines.next("the four lines of text")?.trim().to_owned());
        }
        let line = lines.next("the sizes of the model")?;
        let Some(sizes) = Sizes::parse(line) else {
            let shown: String = line.trim().chars().take(60).collect();
            let problem = format!(
                "found '{shown}', expected the numbers of points, global numbers (3 or more) and variables (5 or more), and the version"
            );
            return Err(lines.error(problem));
        };
        if sizes.points < 2 {
            return Err(lines.error(format!("states {} points, expected at least 2", sizes.points)));
        }
        lines.check_size(lines.line, sizes.points, sizes.variables)?;
        let (mut globals, mut values) = (Vec::new(), Vec::new());
        let first = lines.line + 1;
        lines.numbers(sizes.globals, PER_LINE, "all global numbers", &mut globals)?;
        for point in 0..sizes.points {
            let what = format!("all of the {} points that it states (this is number {})", sizes.points, point + 1);
            lines.numbers(sizes.variables, PER_LINE, &what, &mut values)?;
        }
        lines.check_end("the last point")?;
        title.retain(|line| !line.is_empty());
        let radius = |point: usize| values.get(point * sizes.variables + RADIUS);
        let is_inward = radius(0) > radius(sizes.points - 1);
        Ok(Self { title, sizes, globals, first, values, is_inward })
    }

    /// The star's mass.
    fn mass(&self, text: &Text) -> Result<f64> {
        let mass = self.globals.first().copied().unwrap_or_default();
        if mass.is_finite() && mass > 0.0 {
            return Ok(mass);
        }
        let problem = format!("the star's mass is {mass:e} g, expected a positive one");
        Err(text.error(format!("line {}, column '1'", self.first), problem))
    }

    /// A variable from the center outwards; empty where there is none of this number.
    fn column(&self, variable: usize) -> Vec<f64> {
        let all = self.values.iter().skip(variable).step_by(self.sizes.variables).copied();
        let mut column: Vec<f64> = if variable < self.sizes.variables { all.collect() } else { Vec::new() };
        if self.is_inward {
            column.reverse();
        }
        column
    }

    /// Line and column of a value; points are counted from the center.
    fn place(&self, point: usize, variable: usize) -> String {
        let point = if self.is_inward { self.sizes.points - 1 - point } else { point };
        let lines = |numbers: usize| numbers.div_ceil(PER_LINE);
        let before = self.first + lines(self.sizes.globals) + point * lines(self.sizes.variables);
        format!("line {}, column '{}'", before + variable / PER_LINE, variable % PER_LINE + 1)
    }

    /// Every variable that means something on particles and is there.
    fn candidates(&self, notes: &mut Vec<String>) -> Vec<Candidate> {
        let mut known = COMMON.to_vec();
        match further(self.sizes.version) {
            Some(more) => known.extend(more),
            None => notes.push(format!(
                "version {} is not known: only the first 14 variables are read, which are the same in all versions",
                self.sizes.version
            )),
        }
        let (mut found, mut absent) = (Vec::new(), Vec::new());
        for (name, unit, variable) in known.into_iter().filter(|(_, _, variable)| *variable < self.sizes.variables) {
            let values = self.column(variable);
            if variable != DENSITY && values.iter().all(|v| *v == 0.0) {
                absent.push(name);
            } else {
                found.push(Candidate::new(name, name, Some(unit), Location::Node, values));
            }
        }
        if !absent.is_empty() {
            notes.push(format!("0 everywhere, which means that the code does not have it: {}", absent.join(", ")));
        }
        found
    }

    fn metadata(&self) -> Vec<(String, String)> {
        let title = self.title.iter().map(|line| ("title".to_owned(), line.clone()));
        let stated = GLOBALS.iter().filter_map(|(name, i)| Some((*name, *self.globals.get(*i)?)));
        let stated = stated.filter(|(_, value)| *value != 0.0);
        let stated = stated.map(|(name, value)| (name.to_owned(), format!("{value:e}")));
        title.chain(stated).chain([("version".to_owned(), self.sizes.version.to_string())]).collect()
    }
}
