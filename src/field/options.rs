//! Options of interpolants that a scene can set.

use super::Orientation;

/// How values between nodes are interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the cell, or of the nearest node.
    Constant,
    /// The density is linear in each cell, with slopes that keep its mean, and what is carried is constant there. Cells of grids only.
    PiecewiseLinear,
    /// Linear along each axis: through the nodes, or through the centers of cells.
    Linear,
    /// Catmull-Rom along each axis, clamped to the range of the surrounding nodes. Grids only.
    Cubic,
}

/// What a missing value (NaN) of a variable stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Missing {
    /// A density with missing values is refused; a carried variable with missing values is left out.
    #[default]
    Error,
    /// There is nothing: 0.
    Zero,
}

/// How one grid axis repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Period {
    /// From the data: between the outer edges of cells; between nodes the span if the last plane repeats
    /// the first, else the span and one more spacing.
    Auto,
    /// This length, in the file's units.
    Length(f64),
}

/// What the values at the nodes of a grid belong to, where the file gives no bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Centering {
    #[default]
    Unknown,
    /// The format says that they belong to points.
    Points,
    /// The scene says that nodes are the middles of cells.
    Cells,
    /// The scene says that they belong to nodes, of which the last of a periodic axis is the first again.
    Nodes,
}

/// Where the rows of a radial table lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Staggering {
    /// Radius, density and enclosed mass belong to points.
    Nodes,
    /// Radius and enclosed mass belong to the outer face of a zone, the density to its inside.
    OuterFaces,
    /// The same with the inner face.
    InnerFaces,
    /// The radius is that of a zone's middle, the density that of its inside; the mass ends at its outer face.
    Centers,
}

impl Staggering {
    pub const ALL: [Self; 4] = [Self::Nodes, Self::OuterFaces, Self::InnerFaces, Self::Centers];

    /// As scenes and arguments write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nodes => "nodes",
            Self::OuterFaces => "outer-faces",
            Self::InnerFaces => "inner-faces",
            Self::Centers => "centers",
        }
    }
}

/// Choices of the scene that shape an interpolant. Lengths in the file's units.
#[derive(Debug, Clone)]
pub struct FieldOptions<const D: usize> {
    /// `None`: linear between nodes, constant in cells.
    pub interpolation: Option<Interpolation>,
    /// `None`: what the reader decided.
    pub density_name: Option<String>,
    pub missing: Missing,
    /// Where the center of a radial profile is placed.
    pub center: [f64; D],
    /// Axes of a grid that repeat.
    pub periodic: [Option<Period>; D],
    pub centering: Centering,
    /// Corners of the scene's box.
    pub stated_box: Option<[[f64; D]; 2]>,
    /// Names of the variables to carry; `None`: all that can be carried.
    pub carried: Option<Vec<String>>,
    /// Where the rows of a radial table lie; `None`: where the mass that it states says, else as the reader has it.
    pub staggering: Option<Staggering>,
    /// Whether the density is the one that the mass in a radial file belongs to.
    pub has_mass: bool,
    /// Of the points of a surface.
    pub orientation: Orientation,
}

impl<const D: usize> Default for FieldOptions<D> {
    fn default() -> Self {
        Self {
            interpolation: None,
            density_name: None,
            missing: Missing::Error,
            center: [0.0; D],
            periodic: [None; D],
            centering: Centering::Unknown,
            stated_box: None,
            carried: None,
            staggering: None,
            has_mass: true,
            orientation: Orientation::default(),
        }
    }
}
