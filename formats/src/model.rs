//! The plain data that is exchanged between files and placement: fields as read, particles as written.
//!
//! Numbers are in the units stated by each variable or header; nothing is converted here.

use crate::layout::Layout;
pub use crate::provenance::{
    ADIABATIC_INDEX_KEY, COSMOLOGY_KEY, DISC_KEY, DOUBT_KEY, FILES_KEY, GRAVITY_KEY, ISOTHERMAL_KEY, LACKS_KEY,
    MESH_KEY, VORONOI,
};
use crate::refined::RefinedGrid;
use crate::units::{Unit, UnitDimension, UnitSystem};
use std::path::PathBuf;

/// Numbers in the precision in which the file stores them.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    F32(Vec<f32>),
    F64(Vec<f64>),
    I64(Vec<i64>),
}

impl Values {
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::I64(v) => v.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds values, in the wider of two types where they differ.
    pub(crate) fn extend(&mut self, more: &Self) {
        match (&mut *self, more) {
            (Self::F32(all), Self::F32(more)) => all.extend_from_slice(more),
            (Self::F64(all), Self::F64(more)) => all.extend_from_slice(more),
            (Self::I64(all), Self::I64(more)) => all.extend_from_slice(more),
            (all, more) => {
                let mut wide = all.to_f64();
                wide.extend((0..more.len()).map(|i| more.get(i)));
                *self = Self::F64(wide);
            }
        }
    }

    /// Value `i` as f64 (exact for f32 and for integers below 2^53).
    #[inline]
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::F32(v) => f64::from(v[i]),
            Self::F64(v) => v[i],
            Self::I64(v) => v[i] as f64,
        }
    }

    pub fn to_f64(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.get(i)).collect()
    }

    /// Smallest and largest finite value, and how many are not finite.
    pub fn range(&self) -> (f64, f64, usize) {
        match self {
            Self::F32(v) => {
                let (low, high, bad) = range(v, f32::INFINITY, f32::NEG_INFINITY);
                (low.into(), high.into(), bad)
            }
            Self::F64(v) => range(v, f64::INFINITY, f64::NEG_INFINITY),
            Self::I64(v) => {
                let limits = v.iter().min().zip(v.iter().max());
                limits.map_or((f64::INFINITY, f64::NEG_INFINITY, 0), |(low, high)| (*low as f64, *high as f64, 0))
            }
        }
    }
}

/// [`Values::range`] of floating-point numbers, in several lanes and without a branch: a field may be a large part of the
/// memory.
fn range<T: Copy + PartialOrd>(values: &[T], infinity: T, negative: T) -> (T, T, usize) {
    const LANES: usize = 16;
    let (mut low, mut high, mut bad) = ([infinity; LANES], [negative; LANES], [0_usize; LANES]);
    let (chunks, rest) = values.as_chunks::<LANES>();
    let finite = |x: T| (x > negative) & (x < infinity);
    for chunk in chunks {
        for lane in 0..LANES {
            let x = chunk[lane];
            // NaN compares as false; infinities are counted and left out.
            low[lane] = if (x < low[lane]) & (x > negative) { x } else { low[lane] };
            high[lane] = if (x > high[lane]) & (x < infinity) { x } else { high[lane] };
            bad[lane] += usize::from(!finite(x));
        }
    }
    let counted = bad.iter().sum::<usize>() + rest.iter().filter(|x| !finite(**x)).count();
    let least = |a: T, b: T| if b < a { b } else { a };
    let most = |a: T, b: T| if b > a { b } else { a };
    let rest = || rest.iter().copied().filter(|x| finite(*x));
    let low = low.into_iter().chain(rest()).fold(infinity, least);
    let high = high.into_iter().chain(rest()).fold(negative, most);
    (low, high, counted)
}

/// Where a variable lives on its geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// One value per node (radial node, grid node, mesh point, cloud point).
    Node,
    /// One value per cell: an average over the cell between nodes `i` and `i + 1`, or over a mesh cell.
    Cell,
}

/// One named quantity of a field file.
#[derive(Debug, Clone)]
pub struct Variable {
    pub name: String,
    /// CF `standard_name`, `long_name` or another hint at the meaning.
    pub description: Option<String>,
    /// `None` where the file does not state one.
    pub unit: Option<Unit>,
    pub location: Location,
    /// Interleaved components: 1 for a scalar, 2 or 3 for a vector.
    pub components: usize,
    /// `components * count` values; masked entries are NaN.
    pub values: Values,
}

/// Meaning of a grid's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// x, y, z.
    Cartesian,
    /// Longitude (degrees), latitude (degrees), radius, in this order of axes.
    Geographic,
    /// Radius r, colatitude theta and azimuth phi (radians).
    Spherical,
    /// Distance R from the z axis, azimuth phi (radians) and z.
    Polar,
    /// Distance R from the z axis, z and azimuth phi (radians).
    Cylindrical,
}

impl Coordinates {
    /// Whether the grid is one of cells along r, theta, phi or R, phi, z: always three axes, all of them with bounds. One cell along
    /// the azimuth stands for symmetry about the axis, one along z for a plane. Vectors have their components along the directions of
    /// the axes at each place, in the order of the axes.
    pub fn is_curvilinear(self) -> bool {
        matches!(self, Self::Spherical | Self::Polar | Self::Cylindrical)
    }

    /// Which axis is theta or z, and which is phi, of curvilinear coordinates; the first one is the radius.
    pub fn height_and_azimuth(self) -> [usize; 2] {
        match self {
            Self::Polar => [2, 1],
            _ => [1, 2],
        }
    }
}

/// One axis of a rectilinear grid.
#[derive(Debug, Clone)]
pub struct GridAxis {
    pub name: String,
    /// Strictly ascending node positions; along the radius of layered planets an equal pair marks a jump. Readers flip descending axes together with the data.
    pub nodes: Vec<f64>,
    pub unit: Option<Unit>,
    /// Cell boundaries (`nodes.len() + 1`) where values are known to be cell averages around the nodes
    /// (CF bounds); `None` for point values.
    pub bounds: Option<Vec<f64>>,
}

/// Unstructured cells. Node orders are VTK's.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    /// VTK cell type numbers: 3 line, 5 triangle, 9 quad, 10 tetrahedron, 12 hexahedron, 13 wedge, 14 pyramid.
    pub types: Vec<u8>,
    /// `connectivity[offsets[c] .. offsets[c + 1]]` are the points of cell `c`; length `types.len() + 1`.
    pub offsets: Vec<usize>,
    pub connectivity: Vec<usize>,
}

/// The points at which a field is known.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// Spherically symmetric profile: radii ascending from the center, at least two. An equal pair of
    /// neighboring radii marks a jump. `Cell` variables have one value less than there are nodes.
    Radial { nodes: Vec<f64>, unit: Option<Unit> },
    /// Rectilinear grid of 1 to 3 axes. The first axis runs fastest: index = i + nx (j + ny k). `Cell`
    /// variables have one value less per axis.
    Grid { coordinates: Coordinates, axes: Vec<GridAxis> },
    /// Cells of several sizes along x, y, z. All variables belong to cells.
    Refined(RefinedGrid),
    /// Unstructured or curvilinear mesh in 2 or 3 dimensions (2: z is constant), in VTK cell types.
    Mesh { dimension: usize, points: Vec<[f64; 3]>, unit: Option<Unit>, cells: Cells },
    /// Bare points (`dimension` 1 to 3; unused components are zero).
    Cloud { dimension: usize, points: Vec<[f64; 3]>, unit: Option<Unit> },
    /// The surface of a body without anything inside: triangles in 3 dimensions, line segments in 2. `facets` names
    /// `dimension` points for each, counterclockwise as seen from outside.
    Surface { dimension: usize, points: Vec<[f64; 3]>, unit: Option<Unit>, facets: Vec<u32> },
}

impl Geometry {
    /// How many values a scalar at `location` has.
    pub fn count(&self, location: Location) -> usize {
        match (self, location) {
            (Self::Radial { nodes, .. }, Location::Node) => nodes.len(),
            (Self::Radial { nodes, .. }, Location::Cell) => nodes.len().saturating_sub(1),
            (Self::Grid { axes, .. }, Location::Node) => axes.iter().map(|a| a.nodes.len()).product(),
            (Self::Grid { axes, .. }, Location::Cell) => {
                axes.iter().map(|a| a.nodes.len().saturating_sub(1).max(1)).product()
            }
            (Self::Refined(grid), Location::Cell) => grid.cell_count(),
            (Self::Refined(_), Location::Node) => 0,
            (Self::Mesh { points, .. } | Self::Cloud { points, .. } | Self::Surface { points, .. }, Location::Node) => {
                points.len()
            }
            (Self::Surface { dimension, facets, .. }, Location::Cell) => facets.len() / dimension,
            (Self::Mesh { cells, .. }, Location::Cell) => cells.types.len(),
            (Self::Cloud { .. }, Location::Cell) => 0,
        }
    }

    /// One or two words for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Radial { .. } => "radial profile",
            Self::Grid { .. } => "grid",
            Self::Refined(_) => "refined grid",
            Self::Mesh { .. } => "mesh",
            Self::Cloud { .. } => "point cloud",
            Self::Surface { .. } => "surface",
        }
    }
}

/// A field file as read.
#[derive(Debug, Clone)]
pub struct RawField {
    pub path: PathBuf,
    /// [`crate::FormatSpec::name`] of the reader.
    pub format: &'static str,
    pub geometry: Geometry,
    pub variables: Vec<Variable>,
    /// Name of the variable that is the mass density, where the format itself or `--density` says so, or a
    /// name, standard name or unit leaves no doubt. `None`: undecided.
    pub density: Option<String>,
    /// Scalars of the file's header (star mass, model number, title ...), as text.
    pub metadata: Vec<(String, String)>,
    /// What the reader decided or left out, one sentence each, for the run report.
    pub notes: Vec<String>,
}

impl RawField {
    /// A stellar model: variables by the distance from its center in cm, with the one that is the density, of a file of a `format`.
    #[cfg(any(feature = "fgong", feature = "gyre", feature = "kepler", feature = "mesa", feature = "wdec"))]
    pub(crate) fn stellar(
        (path, format): (&std::path::Path, &'static str),
        nodes: Vec<f64>,
        (variables, density): (Vec<Variable>, Option<String>),
        metadata: Vec<(String, String)>,
        notes: Vec<String>,
    ) -> Self {
        let geometry = Geometry::Radial { nodes, unit: Unit::parse("cm") };
        Self { path: path.into(), format, geometry, variables, density, metadata, notes }
    }

    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|v| v.name == name)
    }
}

/// One column of a particle table.
#[derive(Debug, Clone)]
pub struct Column {
    /// A name of [`crate::particle_names`] (`Coordinates`, `Velocities`, `Masses`, ...) or the carried variable's own.
    pub name: String,
    pub components: usize,
    pub values: Values,
    /// Physical dimension; the numbers are in the header's unit system.
    pub dimension: UnitDimension,
}

impl Column {
    pub fn new(name: &str, components: usize, values: Values, dimension: UnitDimension) -> Self {
        Self { name: name.into(), components, values, dimension }
    }
}

/// Particles of one kind, column by column.
#[derive(Debug, Clone, Default)]
pub struct ParticleTable {
    pub count: usize,
    pub columns: Vec<Column>,
}

impl ParticleTable {
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name == name)
    }

    /// Numbers of materials, where they name more than the ideal gas, which is 0.
    pub fn materials(&self) -> Option<&Column> {
        self.column(crate::particle_names::MATERIAL_IDS).filter(|c| c.values.range() != (0.0, 0.0, 0))
    }

    /// Whether the particles are point masses: softened or accreting ones.
    pub fn is_of_points(&self) -> bool {
        use crate::particle_names::{ACCRETION_RADIUS, SOFTENING_RADIUS};
        [SOFTENING_RADIUS, ACCRETION_RADIUS].iter().any(|name| self.column(name).is_some())
    }

    /// Which body each particle is of, from 0 on without gaps; nothing where the file does not say it.
    pub fn bodies(&self) -> Vec<usize> {
        let Some(column) = self.column(crate::particle_names::BODY_ID) else { return Vec::new() };
        let numbers: Vec<i64> = (0..self.count).map(|i| column.values.get(i) as i64).collect();
        let mut known = numbers.clone();
        known.sort_unstable();
        known.dedup();
        numbers.iter().map(|number| known.partition_point(|k| k < number)).collect()
    }

    /// (m/rho)^(1/d) where it is least; `None` without masses or densities.
    pub fn smallest_spacing(&self, dimension: usize) -> Option<f64> {
        use crate::particle_names::{DENSITY, MASSES};
        let (mass, density) = (&self.column(MASSES)?.values, &self.column(DENSITY)?.values);
        let spacing = |i: usize| (mass.get(i) / density.get(i)).powf(1.0 / dimension as f64);
        Some((0..self.count).map(spacing).fold(f64::INFINITY, f64::min))
    }
}

/// Length by which gravity is softened (Plummer-equivalent) in the smallest spacing of the gas: pressure and gravity are then
/// resolved alike (Bate & Burkert 1997), and a balance assumes it.
pub const SOFTENING_OVER_SPACING: f64 = 0.5;

/// Particles of one GADGET-style type.
#[derive(Debug, Clone)]
pub struct Species {
    /// 0 gas, 1 dark matter, 2 to 5 others.
    pub part_type: u8,
    pub table: ParticleTable,
}

/// What a particle file says of itself.
#[derive(Debug, Clone)]
pub struct RunHeader {
    /// 1, 2 or 3. Coordinates have this many components; writers pad with zeros where their format wants three.
    pub dimension: usize,
    /// Edge lengths of the box; unused axes are 0.
    pub box_size: [f64; 3],
    /// Lower corner of the box in the coordinates of the file, where that was chosen. `None`: coordinates count from the corner,
    /// and a writer may put the box where its code wants it.
    pub box_corner: Option<[f64; 3]>,
    pub periodic: [bool; 3],
    pub units: UnitSystem,
    pub time: f64,
    /// Kernel of the placement, e.g. `Wendland C4`, and its neighbor number V_d n H^d.
    pub kernel: String,
    pub kernel_neighbors: f64,
    /// Key and value pairs that allow the file to be made again: version, scene, seed, stop reason.
    pub provenance: Vec<(String, String)>,
    /// How the files are laid out that it is from, where codes start from such; readers alone fill it, and nothing writes it.
    pub layouts: Vec<Layout>,
}

/// The key of a field's metadata that says that a grid has no axes of its own: what it has is the box from 0 to 1 along each.
pub const WITHOUT_AXES: &str = "without axes";

/// The key of a field's metadata under which the adiabatic index of the run is that wrote it.
pub const FIELD_ADIABATIC_INDEX: &str = "adiabatic index";

/// Of gas of which nothing is said, as in the default builds of codes.
pub const ADIABATIC_INDEX: f64 = 5.0 / 3.0;

impl RunHeader {
    /// The adiabatic index of the gas, more than 1.
    pub fn adiabatic_index(&self) -> f64 {
        let stated = self.provenance.iter().find(|(key, _)| key == ADIABATIC_INDEX_KEY);
        let number = stated.and_then(|(_, text)| text.trim().parse::<f64>().ok());
        number.filter(|gamma| gamma.is_finite() && *gamma > 1.0).unwrap_or(ADIABATIC_INDEX)
    }
}

/// What a header says of a gas with an adiabatic index: nothing, where it is [`ADIABATIC_INDEX`].
pub fn adiabatic_fact(gamma: f64) -> Option<(String, String)> {
    let differs = gamma.is_finite() && gamma > 1.0 && (gamma - ADIABATIC_INDEX).abs() > 1e-9;
    differs.then(|| (ADIABATIC_INDEX_KEY.to_owned(), gamma.to_string()))
}

/// Everything that a particle writer gets and a particle reader gives.
#[derive(Debug, Clone)]
pub struct ParticleFile {
    pub header: RunHeader,
    pub species: Vec<Species>,
}

/// Where something contradicts itself, and how.
type Contradiction = (String, String);

impl RawField {
    /// Checks that counts, axes, radii and connectivity fit together.
    ///
    /// # Errors
    /// Location and problem of the first contradiction.
    pub fn validate(&self) -> Result<(), Contradiction> {
        self.geometry.validate()?;
        for v in &self.variables {
            let wanted = v.components * self.geometry.count(v.location);
            if v.components == 0 || v.values.len() != wanted {
                return Err((
                    format!("variable '{}'", v.name),
                    format!("has {} values, expected {wanted}", v.values.len()),
                ));
            }
        }
        Ok(())
    }
}

impl Geometry {
    fn validate(&self) -> Result<(), Contradiction> {
        match self {
            Self::Radial { nodes, .. } => radii(nodes),
            Self::Grid { axes, coordinates } => {
                if axes.is_empty() || axes.len() > 3 {
                    return Err(("grid".into(), format!("has {} axes, expected 1 to 3", axes.len())));
                }
                let layered = |i: usize| *coordinates == Coordinates::Geographic && i + 1 == axes.len();
                axes.iter().enumerate().try_for_each(|(i, axis)| axis.validate(layered(i)))
            }
            Self::Refined(grid) => grid.validate(),
            Self::Mesh { dimension, points, cells, .. } => {
                dimension_within(*dimension, 2)?;
                finite_points(points).and_then(|()| cells.validate(points.len()))
            }
            Self::Cloud { dimension, points, .. } => {
                dimension_within(*dimension, 1).and_then(|()| finite_points(points))
            }
            Self::Surface { dimension, points, facets, .. } => {
                dimension_within(*dimension, 2)?;
                finite_points(points)?;
                if facets.is_empty() || !facets.len().is_multiple_of(*dimension) {
                    let problem = format!("name {} points, expected {dimension} for each", facets.len());
                    return Err(("facets".into(), problem));
                }
                match facets.iter().find(|&&p| p as usize >= points.len()) {
                    Some(p) => Err(("facets".into(), format!("name point {p}, but there are {}", points.len()))),
                    None => Ok(()),
                }
            }
        }
    }
}

impl GridAxis {
    fn validate(&self, layered: bool) -> Result<(), Contradiction> {
        let location = format!("axis '{}'", self.name);
        ascending(&location, &self.nodes, !layered || self.bounds.is_some())?;
        match &self.bounds {
            Some(b) if b.len() != self.nodes.len() + 1 => {
                Err((location, format!("has {} bounds for {} cells", b.len(), self.nodes.len())))
            }
            Some(b) => ascending(&format!("{location} bounds"), b, true),
            None => Ok(()),
        }
    }
}

impl Cells {
    fn validate(&self, points: usize) -> Result<(), Contradiction> {
        let broken = |problem: String| Err(("cells".to_owned(), problem));
        if self.offsets.len() != self.types.len() + 1 || self.offsets.first() != Some(&0) {
            return broken(format!("have {} offsets for {} cells", self.offsets.len(), self.types.len()));
        }
        if self.offsets.windows(2).any(|w| w[0] > w[1]) || self.offsets.last() != Some(&self.connectivity.len()) {
            return broken("have offsets that do not ascend to the length of the connectivity".into());
        }
        match self.connectivity.iter().find(|&&p| p >= points) {
            Some(p) => broken(format!("name point {p}, but there are {points}")),
            None => Ok(()),
        }
    }
}

impl ParticleFile {
    /// Checks that all columns of a species have its length.
    ///
    /// # Errors
    /// Location and problem of the first contradiction.
    pub fn validate(&self) -> Result<(), Contradiction> {
        for species in &self.species {
            for c in &species.table.columns {
                let wanted = c.components * species.table.count;
                if c.values.len() != wanted {
                    return Err((
                        format!("column '{}'", c.name),
                        format!("has {} values, expected {wanted}", c.values.len()),
                    ));
                }
            }
        }
        Ok(())
    }
}

impl RunHeader {
    /// Takes out what the reader said under a key: it is of the file that was read, not of the particles.
    pub fn take(&mut self, key: &str) -> Vec<String> {
        let (of_key, rest) = std::mem::take(&mut self.provenance).into_iter().partition(|fact| fact.0 == key);
        self.provenance = rest;
        let of_key: Vec<(String, String)> = of_key;
        of_key.into_iter().map(|fact| fact.1).collect()
    }
}

impl ParticleFile {
    /// The first position or mass that no code could use, in words.
    pub fn meaningless(&self) -> Option<String> {
        use crate::particle_names::{COORDINATES, MASSES};
        let needed = |c: &&Column| c.name == COORDINATES || c.name == MASSES;
        for species in &self.species {
            for column in species.table.columns.iter().filter(needed) {
                let found = match &column.values {
                    Values::F32(v) => v.iter().position(|x| !x.is_finite()),
                    Values::F64(v) => v.iter().position(|x| !x.is_finite()),
                    Values::I64(_) => None,
                };
                if let Some(i) = found {
                    let particle = i / column.components.max(1);
                    let value = column.values.get(i);
                    return Some(format!(
                        "column '{}' of particle {particle} of type {} is {value}, expected a finite number",
                        column.name, species.part_type
                    ));
                }
            }
        }
        None
    }
}

fn radii(nodes: &[f64]) -> Result<(), Contradiction> {
    ascending("radius", nodes, false)?;
    match nodes {
        [first, ..] if *first < 0.0 => Err(("radius".into(), format!("value 0 is {first:e}, expected none below 0"))),
        [_] => Err(("radius".into(), "has 1 value, expected at least 2".into())),
        _ => Ok(()),
    }
}

fn dimension_within(dimension: usize, least: usize) -> Result<(), Contradiction> {
    if (least..=3).contains(&dimension) {
        return Ok(());
    }
    Err(("dimension".into(), format!("is {dimension}, expected {least} to 3")))
}

fn ascending(location: &str, values: &[f64], strictly: bool) -> Result<(), Contradiction> {
    if let Some(i) = values.iter().position(|v| !v.is_finite()) {
        return Err((location.into(), format!("value {i} is {}, expected a finite number", values[i])));
    }
    let wrong = |w: &[f64]| if strictly { w[0] >= w[1] } else { w[0] > w[1] };
    match values.windows(2).position(wrong) {
        Some(i) => Err((
            location.into(),
            format!(
                "value {} is {:e} after {:e}, expected it to ascend{}",
                i + 1,
                values[i + 1],
                values[i],
                if strictly { " strictly" } else { "" }
            ),
        )),
        None if values.is_empty() => Err((location.into(), "is empty".into())),
        None => Ok(()),
    }
}

fn finite_points(points: &[[f64; 3]]) -> Result<(), Contradiction> {
    match points.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        Some(i) => Err(("points".into(), format!("point {i} is {:?}, expected finite coordinates", points[i]))),
        None if points.is_empty() => Err(("points".into(), "are none".into())),
        None => Ok(()),
    }
}

/// Choices of a particle writer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriteOptions {
    /// Deflate level 0 to 9; 0 stores uncompressed.
    pub compression: u8,
    /// Write f64 where the flavor's default is f32.
    pub double_precision: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { compression: 4, double_precision: false }
    }
}
