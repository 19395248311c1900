//! What a format can hold.

use crate::magnetic::MagneticUnit;
use crate::model::RunHeader;

/// What a format can hold, whether or not it is in this build.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Capabilities {
    pub read_field: bool,
    pub read_particles: bool,
    pub write_particles: bool,
    /// Columns without which the writer refuses gas particles, in addition to coordinates, masses, density and support radius,
    /// which every placement has.
    pub requires: &'static [&'static str],
    /// Geometries that a field may have: any of `radial`, `grid`, `mesh`, `cloud`.
    pub geometries: &'static [&'static str],
    /// Space dimensions of particles and grids.
    pub dimensions: &'static [usize],
    /// All particles of a type must have one mass.
    pub equal_masses: bool,
    /// Columns besides those that every placement has.
    pub columns: Columns,
    /// The box has one edge.
    pub cubic_box: bool,
    /// Edges of the box are the longest one over 1, 2, 4 and so on.
    pub halved_box: bool,
    /// The box is periodic along all axes or none.
    pub alike_axes: bool,
    /// Particles other than gas are refused.
    pub gas_alone: bool,
    /// The point of a body in vacuum that is at the origin unless another is asked for.
    pub origin: Origin,
    /// Where coordinates have to count from the box's lower corner.
    pub corner: FixedCorner,
    /// What its code takes a magnetic field in.
    pub magnetic: MagneticUnit,
}

/// How often the longest of some edges is halved to become each of them; `None` where there is one that it does not become.
pub fn halvings(edges: &[f64]) -> Option<Vec<u32>> {
    let longest = edges.iter().copied().fold(0.0, f64::max);
    let of = |edge: f64| {
        let times = (longest / edge).log2().round();
        let is_half = (0.0..=MOST_HALVINGS).contains(&times) && (edge * times.exp2() / longest - 1.0).abs() < 1e-9;
        is_half.then_some(times as u32)
    };
    edges.iter().map(|edge| of(*edge)).collect()
}

/// Halvings of an edge, at most: GADGET-4 has 32 binary digits for all of it.
const MOST_HALVINGS: f64 = 16.0;

/// A point of a body in vacuum.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Origin {
    /// The lower corner of the box in whose middle the body is.
    #[default]
    Corner,
    CenterOfMass,
}

/// Where coordinates have to count from the box's lower corner.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FixedCorner {
    /// The file says where the box is, or its code does not care.
    #[default]
    Nowhere,
    /// Along periodic axes, of which the file states the edge alone.
    Periodic,
    /// Along all axes.
    Everywhere,
}

impl FixedCorner {
    /// The lower corner of a file's box where a format has another.
    pub fn misses(self, header: &RunHeader) -> Option<[f64; 3]> {
        let is_fixed = match self {
            Self::Nowhere => false,
            Self::Periodic => header.periodic.contains(&true),
            Self::Everywhere => true,
        };
        header.box_corner.filter(|corner| is_fixed && *corner != [0.0; 3])
    }
}

impl Capabilities {
    /// Those of a format that neither reads nor writes, for data sheets to begin with.
    pub const NONE: Self = Self {
        read_field: false,
        read_particles: false,
        write_particles: false,
        requires: &[],
        geometries: &[],
        dimensions: &[],
        equal_masses: false,
        columns: Columns::Any,
        cubic_box: false,
        halved_box: false,
        alike_axes: false,
        gas_alone: false,
        origin: Origin::Corner,
        corner: FixedCorner::Nowhere,
        magnetic: MagneticUnit::HeavisideLorentz,
    };

    /// Those of a format that only fields are read from.
    pub(crate) const fn of_fields(geometries: &'static [&'static str], dimensions: &'static [usize]) -> Self {
        Self { read_field: true, geometries, dimensions, ..Self::NONE }
    }
}

/// Which columns of particles a format holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Columns {
    #[default]
    Any,
    /// These, and the placement's own.
    Only(&'static [&'static str]),
    /// Scalars of names of at most so many ASCII characters, and these vectors.
    Scalars { longest_name: usize, vectors: &'static [&'static str] },
}

impl Columns {
    /// Why a column would be lost; `None` where it is kept.
    pub fn loses(&self, name: &str, components: usize) -> Option<String> {
        match self {
            Self::Any => None,
            Self::Only(names) if names.contains(&name) => None,
            Self::Only(_) => Some("the format has no place for it".into()),
            Self::Scalars { vectors, .. } if vectors.contains(&name) => None,
            Self::Scalars { vectors, .. } if components > 1 => {
                Some(format!("the format holds no vectors but {}", vectors.join(" and ")))
            }
            Self::Scalars { longest_name, .. } if name.len() > *longest_name || !name.is_ascii() => {
                Some(format!("the format holds names of at most {longest_name} ASCII characters"))
            }
            Self::Scalars { .. } => None,
        }
    }
}
