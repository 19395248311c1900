//! The seeding methods as data: description, source and capabilities of each.

use super::name::Seeding;
use crate::error::{Error, Result};

/// Which targets a method can meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Targets {
    /// Any density in any domain.
    Any,
    /// Uniform ones in any domain; in a box, products of functions of one coordinate each; in a ball,
    /// functions of the radius; in a cylinder, products of functions of radius and height. Others are refused.
    Symmetric,
    /// Functions of the radius in a ball or shell (uniform ones too). Others are refused.
    Radial,
    /// Any density that vanishes nowhere; the resolution must be uniform.
    Massive,
}

impl Targets {
    /// As tables of the methods name them.
    pub fn text(self) -> &'static str {
        match self {
            Self::Any => "any",
            Self::Symmetric => {
                "uniform; separable (also along one axis) in a box, radial in a ball, by radius and height in a cylinder (stretched)"
            }
            Self::Radial => "radial in a ball",
            Self::Massive => "any without holes (masses vary)",
        }
    }
}

/// One seeding method.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    pub seeding: Seeding,
    /// As in a scene file.
    pub name: &'static str,
    /// Another name for it there; empty where it has none.
    pub short: &'static str,
    /// As the plan calls it.
    pub stage: &'static str,
    /// Dimensions for which it is made.
    pub dimensions: &'static [usize],
    pub targets: Targets,
    /// What it makes, in one sentence.
    pub summary: &'static str,
    /// What it cannot do or does badly.
    pub limits: &'static str,
    /// The publication it follows.
    pub reference: &'static str,
}

/// All methods, the default first. Each makes exactly N positions.
pub const METHODS: &[Method] = &[
    Method {
        seeding: Seeding::MassBisection,
        name: "mass-bisection",
        short: "",
        stage: "seed: mass bisection",
        dimensions: &[1, 2, 3],
        targets: Targets::Any,
        summary: "the domain is halved by mass until each part has one particle; jittered",
        limits: "neighbors are unevenly spaced until relaxed",
        reference: "k-d tree by mass; this program",
    },
    Method {
        seeding: Seeding::Random,
        name: "random",
        short: "",
        stage: "seed: random",
        dimensions: &[1, 2, 3],
        targets: Targets::Any,
        summary: "independent random positions",
        limits: "Poisson noise on all scales: needs relaxation",
        reference: "Diehl et al. 2015, PASA 32, e048, sec. 3.2.1",
    },
    Method {
        seeding: Seeding::Cubic,
        name: "cubic",
        short: "",
        stage: "seed: cubic lattice",
        dimensions: &[1, 2, 3],
        targets: Targets::Symmetric,
        summary: "square or simple cubic lattice; equidistant in 1-D",
        limits: "preferred directions; unstable under pressure; turned and strained where N does not fit the box; columns of fewer points between walls",
        reference: "Diehl et al. 2015, sec. 3.1.1; stretched: sec. 3.2.2",
    },
    Method {
        seeding: Seeding::CubicClosePacked,
        name: "cubic-close-packed",
        short: "fcc",
        stage: "seed: cubic close packing",
        dimensions: &[1, 2, 3],
        targets: Targets::Symmetric,
        summary: "face-centered cubic lattice; hexagonal in 2-D, equidistant in 1-D",
        limits: "preferred directions; turned and strained where N does not fit the box; columns of fewer points between walls",
        reference: "Diehl et al. 2015, sec. 3.1.2; stretched: sec. 3.2.2",
    },
    Method {
        seeding: Seeding::HexagonalClosePacked,
        name: "hexagonal-close-packed",
        short: "hcp",
        stage: "seed: hexagonal close packing",
        dimensions: &[1, 2, 3],
        targets: Targets::Symmetric,
        summary: "close packing in layers ABAB; hexagonal in 2-D, equidistant in 1-D",
        limits: "as cubic-close-packed; two points per cell: an odd N in a periodic box is packed in layers ABCABC",
        reference: "Diehl et al. 2015, sec. 3.1.3; stretched: sec. 3.2.2",
    },
    Method {
        seeding: Seeding::BodyCenteredCubic,
        name: "body-centered-cubic",
        short: "bcc",
        stage: "seed: body-centered cubic lattice",
        dimensions: &[1, 2, 3],
        targets: Targets::Symmetric,
        summary: "body-centered cubic lattice; hexagonal in 2-D, equidistant in 1-D",
        limits: "as cubic-close-packed; unstable under pressure where few neighbors are summed",
        reference: "sublattices of exactly N points: this program; stretched: Diehl et al. 2015, sec. 3.2.2",
    },
    Method {
        seeding: Seeding::LowDiscrepancy,
        name: "low-discrepancy",
        short: "",
        stage: "seed: low-discrepancy sequence",
        dimensions: &[1, 2, 3],
        targets: Targets::Any,
        summary: "Kronecker sequence of the generalized golden ratio, carried over by mass",
        limits: "even on large scales, pairs as close as in random sets; does not depend on the random seed",
        reference: "Roberts 2018, R_d sequence; Rosenblatt 1952, Ann. Math. Stat. 23, 470",
    },
    Method {
        seeding: Seeding::Quaquaversal,
        name: "quaquaversal",
        short: "",
        stage: "seed: quaquaversal tiling",
        dimensions: &[3],
        targets: Targets::Symmetric,
        summary: "centroids of an aperiodic tiling by prisms, without preferred directions",
        limits: "noisy: 33 % of random points with the cubic spline (30 % in the WVT paper), 57 % with Wendland C4; seams in a periodic box",
        reference: "Conway & Radin 1998, Invent. Math. 132, 179; Hansen et al. 2007, ApJ 656, 631",
    },
    Method {
        seeding: Seeding::Shells,
        name: "shells",
        short: "",
        stage: "seed: concentric shells",
        dimensions: &[2, 3],
        targets: Targets::Radial,
        summary: "shells a spacing thick, particles on a golden spiral, each shell rotated at random; rings in 2-D",
        limits: "neighboring shells do not interlock",
        reference: "Diehl et al. 2015, sec. 3.2.4; Gonzalez 2010, Math. Geosci. 42, 49",
    },
    Method {
        seeding: Seeding::EqualAreaShells,
        name: "equal-area-shells",
        short: "",
        stage: "seed: equal-area shells",
        dimensions: &[3],
        targets: Targets::Radial,
        summary: "shells a spacing thick, particles in collars of regions of equal area, rotated at random",
        limits: "neighboring shells do not interlock; no shift of the collars next to the poles",
        reference: "SEAGen: Kegerreis et al. 2019, MNRAS 487, 5029; Leopardi 2006, ETNA 25, 309",
    },
    Method {
        seeding: Seeding::Glass,
        name: "glass",
        short: "",
        stage: "seed: glass",
        dimensions: &[2, 3],
        targets: Targets::Symmetric,
        summary: "uniform periodic box relaxed by the short-range repulsion of WVT, tiled above 8192 points",
        limits: "stretching shows as wavy shells",
        reference: "after White 1994 and Diehl et al. 2015, sec. 3.1.5 and 3.2.3",
    },
    Method {
        seeding: Seeding::GravitationalGlass,
        name: "gravitational-glass",
        short: "",
        stage: "seed: gravitational glass",
        dimensions: &[2, 3],
        targets: Targets::Symmetric,
        summary: "uniform periodic box relaxed by reversed gravity (Ewald sums), tiled above 2048 points",
        limits: "takes seconds to make; stretching shows as wavy shells",
        reference: "White 1994; Diehl et al. 2015, sec. 3.1.5 and 3.2.3",
    },
    Method {
        seeding: Seeding::VariableMasses,
        name: "variable-masses",
        short: "",
        stage: "seed: lattice of variable masses",
        dimensions: &[1, 2, 3],
        targets: Targets::Massive,
        summary: "cubic lattice of one spacing everywhere, with masses rho* V; not relaxed unless asked for",
        limits: "resolution does not follow the density; preferred directions; turned and strained where N does not fit the box",
        reference: "the ALARIC paper, sec. 1.4.1",
    },
];

impl Seeding {
    /// The method's data sheet.
    pub fn method(self) -> &'static Method {
        // Each variant has an entry (tested).
        METHODS.iter().find(|m| m.seeding == self).unwrap_or(&METHODS[0])
    }

    /// The method of this name, or of this short one.
    pub fn by_name(name: &str) -> Option<Self> {
        METHODS.iter().find(|m| m.name == name || !m.short.is_empty() && m.short == name).map(|m| m.seeding)
    }
}

impl Method {
    /// # Errors
    /// A dimension that the method is not made for.
    pub fn check_dimension(&self, d: usize) -> Result<()> {
        if self.dimensions.contains(&d) {
            return Ok(());
        }
        let others: Vec<&str> = METHODS.iter().filter(|m| m.dimensions.contains(&d)).map(|m| m.name).collect();
        Err(Error::scene(
            "seeding",
            format!(
                "'{}' exists in {} only, the input is {d}-D; use {}",
                self.name,
                self.dimension_text(),
                others.join(", ")
            ),
        ))
    }

    /// For example `2-D 3-D`.
    pub fn dimension_text(&self) -> String {
        self.dimensions.iter().map(|d| format!("{d}-D")).collect::<Vec<_>>().join(" ")
    }
}

/// Names of the methods that take any target, without the one that failed, for error texts.
pub(super) fn for_any_target(failed: &str) -> String {
    let others = METHODS.iter().filter(|m| m.targets == Targets::Any && m.name != failed);
    others.map(|m| m.name).collect::<Vec<_>>().join(" or ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_scene_file() {
        for m in METHODS {
            let parsed: Seeding = serde_json::from_str(&format!("\"{}\"", m.name)).unwrap();
            assert_eq!(parsed, m.seeding);
            assert_eq!(m.seeding.method().name, m.name);
            assert!(m.stage.starts_with("seed: ") && !m.dimensions.is_empty());
            assert!(!m.reference.is_empty() && !m.limits.is_empty() && !m.summary.is_empty());
        }
        // What serde lists for an unknown name is every variant, and every other name of one.
        let error = serde_json::from_str::<Seeding>("\"?\"").unwrap_err().to_string();
        let names = error.split('`').skip(3).step_by(2);
        let mut listed: Vec<&str> =
            names.map(|n| serde_json::from_str::<Seeding>(&format!("\"{n}\"")).unwrap().method().name).collect();
        listed.sort_unstable();
        listed.dedup();
        assert_eq!(listed.len(), METHODS.len(), "{error}");
    }

    #[test]
    fn dimensions_that_a_method_lacks_are_refused_with_those_that_have_them() {
        let mut method = METHODS[0];
        method.dimensions = &[3];
        let error = method.check_dimension(2).unwrap_err().to_string();
        assert!(error.contains("3-D only") && error.contains("random"), "{error}");
    }

    #[test]
    fn a_method_that_failed_is_not_advised() {
        let others = for_any_target("random");
        assert!(others.contains("mass-bisection") && !others.contains("random"), "{others}");
    }
}
