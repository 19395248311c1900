//! The rule that defines one dataset of a particle file.

use crate::common::quantity::Quantity;

/// Where the numbers of a dataset come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// The column of this name.
    Column(&'static str),
    /// The column of this name, or zeros.
    ColumnOrZeros(&'static str),
    /// The column of this name, or 1, 2, 3 ... through all species.
    ColumnOrCount(&'static str),
    /// h = eta (m / rho)^(1/D), from Masses and Density; where there is no Density, eta times the spacing that belongs to
    /// SupportRadius and the header's neighbor number.
    Spacing { eta: f64 },
}

impl Source {
    pub(crate) fn column(self) -> Option<&'static str> {
        match self {
            Self::Column(name) | Self::ColumnOrZeros(name) | Self::ColumnOrCount(name) => Some(name),
            Self::Spacing { .. } => None,
        }
    }
}

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Storage {
    Double,
    /// f32, or f64 with [`crate::WriteOptions::double_precision`].
    Float,
    Id,
    Int,
    /// 64 bits, of columns with numbers that 32 do not hold.
    Long,
}

/// Which particles must have a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    All,
    Gas,
    Optional,
}

/// One dataset of a particle group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    pub name: &'static str,
    pub source: Source,
    pub storage: Storage,
    pub unit: Quantity,
    /// 3: vectors are padded with zeros.
    pub components: usize,
    pub need: Need,
}
