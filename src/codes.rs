//! Target simulation codes: the SPH sums and constants of each, as far as an initial condition depends on them.

mod contrast;
mod pairing;

pub(crate) use contrast::Contrast;

use crate::error::{Error, Result};
use sph::geometry::unit_ball_volume;
use sph::kernel::{KernelName, support_over_smoothing_length};
use sph::point_mass::Softening;
use sph_formats::units::GRAVITATIONAL_CONSTANT_CGS;
use sph_formats::{Species, UnitSystem, did_you_mean, halvings};

/// How a code says how many neighbors a particle has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Neighbors {
    /// Smoothing length (twice the kernel's standard deviation, Dehnen & Aly 2012) over the spacing.
    Eta(f64),
    /// Smoothing length over the spacing, in which kernels have their usual radius: 2, but 2.5 for the quartic and 3 for the quintic spline.
    Lengths(f64),
    /// Smoothing length over the diagonal of a cube, or square, of the spacing; kernels have their usual radius.
    Diagonals(f64),
    /// V_d n H^d itself in three dimensions; in fewer, as many as belong to the same H, which is so many smoothing lengths.
    Count { neighbors: f64, lengths: f64 },
}

impl Neighbors {
    /// The same rule with another number.
    fn with(self, number: f64) -> Self {
        match self {
            Self::Eta(_) => Self::Eta(number),
            Self::Lengths(_) => Self::Lengths(number),
            Self::Diagonals(_) => Self::Diagonals(number),
            Self::Count { lengths, .. } => Self::Count { neighbors: number, lengths },
        }
    }
}

/// A way in which a code finds forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scheme {
    pub name: &'static str,
    /// Whether its force on gas at rest is that of `relaxation::balance`, from densities and pressures with grad-h terms: nothing
    /// else can be balanced, though densities are the same.
    pub has_our_force: bool,
}

const fn ours(name: &'static str) -> Scheme {
    Scheme { name, has_our_force: true }
}

const fn other(name: &'static str) -> Scheme {
    Scheme { name, has_our_force: false }
}

/// Radius of a kernel in the smoothing lengths that it is usually written in (Price 2012, J. Comput. Phys. 231, 759).
fn usual_radius(kernel: KernelName) -> f64 {
    use KernelName::{CubicSpline, Quartic, Quintic, Sinc6, WendlandC2, WendlandC4, WendlandC6};
    match kernel {
        CubicSpline | WendlandC2 | WendlandC4 | WendlandC6 | Sinc6 => 2.0,
        Quartic => 2.5,
        Quintic => 3.0,
    }
}

/// The default build of a code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheet {
    /// As it is asked for.
    pub name: &'static str,
    pub title: &'static str,
    /// Format of its initial conditions.
    pub format: &'static str,
    pub kernel: KernelName,
    pub neighbors: Neighbors,
    /// The constant of gravity in cgs that it is compiled with.
    pub gravity: f64,
    /// Neighbors of kernels that do not have the default's.
    pub by_kernel: &'static [(KernelName, f64)],
    /// Key under which options say how many neighbors, and what it is called in the code.
    pub key: &'static str,
    pub parameter: &'static str,
    /// The default first.
    pub schemes: &'static [Scheme],
    /// How it spreads a softened point mass.
    pub softening: Softening,
    /// Whether the kernel can be chosen when the code is built.
    pub has_kernels: bool,
    /// Whether it sums over the cells of a mesh: kernel and neighbors are those that particles are placed with.
    pub is_mesh: bool,
    /// Whether a file of its format is taken to be for it.
    pub owns_format: bool,
    /// Whether `output::parameters` knows its parameter files.
    pub has_parameters: bool,
    /// Where the figures are from.
    pub reference: &'static str,
}

/// Lines of GADGET-4's Config.sh for a periodic box of which it reads the longest edge; `None` for edges that it cannot have.
pub fn long_bits(edges: &[f64]) -> Option<Vec<String>> {
    let of_axes = ["X", "Y", "Z"].into_iter().zip(halvings(edges)?);
    Some(of_axes.filter(|(_, times)| *times > 0).map(|(axis, times)| format!("LONG_{axis}_BITS={times}")).collect())
}

/// Known codes.
pub const SHEETS: &[Sheet] = &[
    Sheet {
        name: "swift",
        title: "SWIFT",
        format: "swift",
        kernel: KernelName::CubicSpline,
        neighbors: Neighbors::Eta(1.2348),
        gravity: 6.674_30e-8,
        by_kernel: &[],
        key: "eta",
        parameter: "SPH:resolution_eta",
        schemes: &[
            ours("sphenix"),
            ours("minimal"),
            ours("planetary"),
            other("gasoline"),
            other("pressure-entropy"),
            other("pressure-energy"),
            other("remix"),
        ],
        softening: Softening::WendlandC2,
        has_kernels: true,
        is_mesh: false,
        owns_format: true,
        has_parameters: true,
        reference: "SWIFT 2026.04: configure --with-kernel, examples' resolution_eta, src/physical_constants_cgs.h",
    },
    Sheet {
        name: "gadget4",
        title: "GADGET-4",
        format: "gadget",
        kernel: KernelName::CubicSpline,
        neighbors: Neighbors::Count { neighbors: 64.0, lengths: 1.0 },
        gravity: 6.6738e-8,
        by_kernel: &[],
        key: "neighbors",
        parameter: "DesNumNgb",
        schemes: &[ours("density-entropy"), other("pressure-entropy")],
        softening: Softening::CubicSpline,
        has_kernels: true,
        is_mesh: false,
        owns_format: true,
        has_parameters: true,
        reference: "GADGET-4 226f62e: Config.sh CUBIC_SPLINE_KERNEL, DesNumNgb of its examples, src/data/constants.h",
    },
    Sheet {
        name: "gadget2",
        title: "GADGET-2",
        format: "gadget-binary",
        kernel: KernelName::CubicSpline,
        neighbors: Neighbors::Count { neighbors: 50.0, lengths: 1.0 },
        gravity: 6.672e-8,
        by_kernel: &[],
        key: "neighbors",
        parameter: "DesNumNgb",
        schemes: &[ours("density-entropy")],
        softening: Softening::CubicSpline,
        has_kernels: false,
        is_mesh: false,
        owns_format: true,
        has_parameters: false,
        reference: "GADGET-2.0.7: parameterfiles' DesNumNgb, allvars.h",
    },
    Sheet {
        name: "gizmo",
        title: "GIZMO",
        format: "gizmo",
        kernel: KernelName::CubicSpline,
        neighbors: Neighbors::Count { neighbors: 32.0, lengths: 1.0 },
        gravity: 6.672e-8,
        by_kernel: &[],
        key: "neighbors",
        parameter: "DesNumNgb",
        schemes: &[other("mfm"), other("mfv"), ours("density-sph"), other("pressure-sph")],
        softening: Softening::CubicSpline,
        has_kernels: true,
        is_mesh: false,
        owns_format: true,
        has_parameters: true,
        reference: "GIZMO's public version: kernel.h (KERNEL_FUNCTION 3), users' guide (DesNumNgb 32 for it), allvars.h",
    },
    Sheet {
        name: "phantom",
        title: "Phantom",
        format: "phantom",
        kernel: KernelName::CubicSpline,
        neighbors: Neighbors::Lengths(1.2),
        gravity: 6.672_041e-8,
        by_kernel: &[
            (KernelName::Quartic, 1.1),
            (KernelName::Quintic, 1.0),
            (KernelName::WendlandC2, 1.3),
            (KernelName::WendlandC4, 1.5),
            (KernelName::WendlandC6, 1.6),
        ],
        key: "hfact",
        parameter: "hfact",
        schemes: &[ours("density-energy")],
        softening: Softening::CubicSpline,
        has_kernels: true,
        is_mesh: false,
        owns_format: true,
        has_parameters: true,
        reference: "Phantom v2026.0.1: kernel_*.f90 (hfact_default, radkern), physcon.f90",
    },
    Sheet {
        name: "sph-exa",
        title: "SPH-EXA",
        format: "sph-exa",
        kernel: KernelName::Sinc6,
        neighbors: Neighbors::Count { neighbors: 100.0, lengths: 2.0 },
        // That of the file, which is ours.
        gravity: GRAVITATIONAL_CONSTANT_CGS,
        by_kernel: &[],
        key: "ng0",
        parameter: "ng0",
        schemes: &[other("ve"), other("std")],
        softening: Softening::CubicSpline,
        has_kernels: false,
        is_mesh: false,
        owns_format: true,
        has_parameters: true,
        reference: "SPH-EXA b458f57: sph/particles_data.hpp (kernelChoice, sincIndex, ng0), sph_kernel_tables.hpp, update_h.hpp",
    },
    Sheet {
        name: "arepo",
        title: "AREPO",
        format: "arepo",
        kernel: KernelName::WendlandC4,
        neighbors: Neighbors::Count { neighbors: 64.0, lengths: 1.0 },
        gravity: 6.6738e-8,
        by_kernel: &[],
        key: "",
        parameter: "",
        schemes: &[other("finite-volume")],
        softening: Softening::CubicSpline,
        has_kernels: false,
        is_mesh: true,
        owns_format: false,
        has_parameters: true,
        reference: "AREPO's public version (Weinberger et al. 2020, ApJS 248, 32): src/main/allvars.h",
    },
    Sheet {
        name: "pysph",
        title: "PySPH",
        format: "numpy",
        kernel: KernelName::CubicSpline,
        neighbors: Neighbors::Lengths(1.3),
        // It has none of its own.
        gravity: GRAVITATIONAL_CONSTANT_CGS,
        by_kernel: &[],
        key: "hdx",
        parameter: "hdx",
        schemes: &[other("wcsph"), other("gas-dynamics")],
        softening: Softening::CubicSpline,
        has_kernels: true,
        is_mesh: false,
        owns_format: false,
        has_parameters: true,
        reference: "PySPH 1.0b2: base/kernels.py (radius_scale), sph/scheme.py (WCSPHScheme), hdx of examples/dam_break_2d.py",
    },
    Sheet {
        name: "dualsphysics",
        title: "DualSPHysics",
        format: "dualsphysics",
        kernel: KernelName::WendlandC2,
        neighbors: Neighbors::Diagonals(1.0),
        // It has none of its own.
        gravity: GRAVITATIONAL_CONSTANT_CGS,
        by_kernel: &[],
        key: "coefh",
        parameter: "coefh",
        schemes: &[other("dbc")],
        softening: Softening::CubicSpline,
        has_kernels: true,
        is_mesh: false,
        owns_format: true,
        has_parameters: true,
        reference: "DualSPHysics 5.4 (ef3721a): JSph.cpp (Kernel), JCaseCtes.cpp (ComputeFinalH), coefh of examples/main/01_DamBreak",
    },
];

/// Schemes with equations of state by material.
pub(crate) const AS_PLANETARY: [&str; 2] = ["planetary", "remix"];

/// SWIFT's top-level cells are this much wider than the reach of the widest kernel (`space_stretch` in src/space.h), and so many of them
/// lie along the shortest edge of a periodic box at least.
pub(crate) const CELL_OVER_REACH: f64 = 1.1;
pub(crate) const LEAST_CELLS: f64 = 3.0;

/// A code with its build's options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetCode {
    pub sheet: &'static Sheet,
    pub kernel: KernelName,
    pub neighbors: Neighbors,
    pub scheme: Scheme,
}

impl TargetCode {
    /// What the code is built with for particles in `d` dimensions, fewer than three; empty where one build does for all, none where there is no such build.
    pub(crate) fn dimension_option(&self, d: usize) -> Option<String> {
        Some(match (self.sheet.name, d) {
            ("swift", _) => format!("--with-hydro-dimension={d}"),
            ("gizmo", _) => format!("BOX_SPATIAL_DIMENSION={d}"),
            ("gadget2" | "gadget4" | "arepo", 2) => "TWODIMS".into(),
            ("gadget4" | "arepo", 1) => "ONEDIMS".into(),
            ("pysph", _) | ("dualsphysics", 2) => String::new(),
            _ => return None,
        })
    }

    /// By how much of its own weight sheared gas is held up beside its pressure, in units of (S h/c)^2, with the shear S and the smoothing length h: by
    /// the motion into which shear brings particles, and by a viscosity that is larger where they approach. Measured in discs in Phantom (with its defaults
    /// and `disc_viscosity`); 0 where it is not known.
    pub(crate) fn support_by_shear(&self) -> f64 {
        if self.sheet.name == "phantom" { 0.026 } else { 0.0 }
    }

    /// Whether gas of discs has the temperature of its distance from the star, as the code keeps it: Phantom's `ieos = 6`.
    pub(crate) fn cools_discs_by_distance(&self) -> bool {
        self.sheet.name == "phantom"
    }

    /// What the code as it is built by default does not make of particles beside the gas, with the remedy; `None` where it takes them.
    pub(crate) fn unread(&self, species: &Species) -> Option<String> {
        let kind = match (self.sheet.name, species.part_type) {
            ("swift", 2) => "a background of heavier matter around a region of others, and stops in a run without one",
            ("swift", 3) => "sinks, and leaves them out unless it is built and run with a model of those",
            ("swift", 5) => "black holes, and leaves them out unless it is built and run with a model of those",
            _ => return None,
        };
        let Species { part_type, table } = species;
        (table.count > 0).then(|| {
            format!(
                "{} takes the {} particles of type {part_type} for {kind}: `type: 1` is for all that only attracts, 4 for stars",
                self.sheet.title, table.count
            )
        })
    }

    /// `NAME` or `NAME:OPTION,...`; an option is a kernel's or a scheme's name, or `key=value`.
    ///
    /// # Errors
    /// A name, option or value that is not known, with those that are.
    pub fn parse(text: &str) -> Result<Self> {
        let refuse = |problem: String| Error::scene("target_code", format!("is '{text}': {problem}"));
        let (name, options) = text.split_once(':').unwrap_or((text, ""));
        let known = || SHEETS.iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
        let sheet = SHEETS.iter().find(|s| s.name == name).ok_or_else(|| {
            let hint = did_you_mean(name, SHEETS.iter().map(|s| s.name));
            refuse(format!("no code of the name '{name}' is known, expected one of {}{hint}", known()))
        })?;
        let mut code = Self::of_sheet(sheet);
        let mut stated = None;
        for option in options.split(',').filter(|o| !o.is_empty()) {
            let scheme = |name: &str| sheet.schemes.iter().find(|s| s.name == name).copied();
            if sheet.is_mesh && scheme(option).is_none() && !option.starts_with("scheme=") {
                return Err(refuse(format!("'{option}' is no option: {} has a mesh, and no kernel", sheet.title)));
            }
            match option.split_once('=') {
                None if scheme(option).is_some() => code.scheme = scheme(option).unwrap_or(code.scheme),
                None => code.kernel = kernel(sheet, option).map_err(refuse)?,
                Some(("kernel", value)) => code.kernel = kernel(sheet, value).map_err(refuse)?,
                Some(("scheme", value)) => {
                    let known = sheet.schemes.iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
                    code.scheme = scheme(value).ok_or_else(|| {
                        refuse(format!("scheme '{value}' is not known here, expected one of {known}"))
                    })?;
                }
                Some((key, value)) if key == sheet.key => {
                    let number = value.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
                    let number =
                        number.ok_or_else(|| refuse(format!("{key} is '{value}', expected a positive number")))?;
                    stated = Some(number);
                }
                Some((key, _)) => {
                    let problem =
                        format!("'{key}' is no option, expected a kernel's name, {}=NUMBER or scheme=NAME", sheet.key);
                    return Err(refuse(problem));
                }
            }
        }
        let customary = || sheet.by_kernel.iter().find(|(kernel, _)| *kernel == code.kernel).map(|(_, number)| *number);
        if let Some(number) = stated.or_else(customary) {
            if number.fract() != 0.0 && code.has_whole_numbers() {
                let problem = format!(
                    "{} is {number}, but {} reads {} as a whole number and drops the rest; choose {} or {}",
                    sheet.key,
                    sheet.title,
                    sheet.parameter,
                    number.floor(),
                    number.ceil()
                );
                return Err(refuse(problem));
            }
            code.neighbors = code.neighbors.with(number);
        }
        Ok(code)
    }

    fn of_sheet(sheet: &'static Sheet) -> Self {
        Self { sheet, kernel: sheet.kernel, neighbors: sheet.neighbors, scheme: sheet.schemes[0] }
    }

    /// The default build of the code that reads a format.
    pub fn of_format(format: &str) -> Option<Self> {
        SHEETS.iter().find(|s| s.format == format && s.owns_format).map(Self::of_sheet)
    }

    /// V_d n H^d in `d` dimensions.
    pub fn kernel_neighbors(&self, d: usize) -> f64 {
        let of_ratio = |ratio: f64| unit_ball_volume(d) * ratio.powi(d as i32);
        match self.neighbors {
            Neighbors::Eta(eta) => of_ratio(eta * support_over_smoothing_length(self.kernel, d)),
            Neighbors::Lengths(ratio) => of_ratio(ratio * usual_radius(self.kernel)),
            Neighbors::Diagonals(ratio) => of_ratio(ratio * (d as f64).sqrt() * usual_radius(self.kernel)),
            Neighbors::Count { neighbors, .. } if d == 3 => neighbors,
            Neighbors::Count { neighbors, .. } => {
                let count = of_ratio((neighbors / unit_ball_volume(3)).cbrt());
                if self.has_whole_numbers() { count.round().max(1.0) } else { count }
            }
        }
    }

    /// Whether its number of neighbors is an integer: what follows the point would be dropped.
    fn has_whole_numbers(&self) -> bool {
        matches!(self.sheet.name, "gadget2" | "gadget4")
    }

    /// The kernel's support radius over what the code calls smoothing length.
    pub fn support_over_length(&self, d: usize) -> f64 {
        match self.neighbors {
            Neighbors::Eta(_) => support_over_smoothing_length(self.kernel, d),
            Neighbors::Lengths(_) | Neighbors::Diagonals(_) => usual_radius(self.kernel),
            Neighbors::Count { lengths, .. } => lengths,
        }
    }

    /// What it says in the code's own parameter.
    pub fn setting(&self) -> f64 {
        match self.neighbors {
            Neighbors::Eta(v)
            | Neighbors::Lengths(v)
            | Neighbors::Diagonals(v)
            | Neighbors::Count { neighbors: v, .. } => v,
        }
    }

    /// The constant of gravity that it is compiled with, in `units`.
    pub fn gravity_in(&self, units: &UnitSystem) -> f64 {
        self.sheet.gravity * units.mass * units.time.powi(2) / units.length.powi(3)
    }

    /// What the code's own parameter says in `d` dimensions: numbers of neighbors are counted in those.
    pub fn setting_in(&self, d: usize) -> f64 {
        match self.neighbors {
            Neighbors::Count { .. } if d < 3 => self.kernel_neighbors(d),
            _ => self.setting(),
        }
    }

    /// The value of the code's parameter with which it has so many neighbors with a kernel.
    fn setting_for(&self, kernel: KernelName, d: usize, kernel_neighbors: f64) -> f64 {
        let ratio = (kernel_neighbors / unit_ball_volume(d)).powf(1.0 / d as f64);
        match self.neighbors {
            Neighbors::Eta(_) => ratio / support_over_smoothing_length(kernel, d),
            Neighbors::Lengths(_) => ratio / usual_radius(kernel),
            Neighbors::Diagonals(_) => ratio / usual_radius(kernel) / (d as f64).sqrt(),
            Neighbors::Count { .. } => unit_ball_volume(3) * ratio.powi(3),
        }
    }

    /// In one line: what it sums with.
    pub fn describe(&self, d: usize) -> String {
        let Sheet { title, parameter, .. } = self.sheet;
        let (kernel, count) = (self.kernel.title(), self.kernel_neighbors(d));
        if self.sheet.is_mesh {
            return format!("{title} ({}), which has no kernel", self.scheme.name);
        }
        // Numbers of neighbors in fewer dimensions are roots of those that were asked for.
        let setting = if d < 3 { (1e4 * self.setting_in(d)).round() / 1e4 } else { self.setting() };
        format!("{title} ({}) with {kernel}, {parameter} {setting}: {count:.1} neighbors", self.scheme.name)
    }

    /// The kernel and the neighbors with which files for it are looked at: its own, where it has any.
    pub fn sums(&self, d: usize) -> String {
        match self.sheet.is_mesh {
            true => format!("{} with {:.1} neighbors", self.kernel.title(), self.kernel_neighbors(d)),
            false => self.describe(d),
        }
    }

    /// Whether it reads files and their headers as GADGET does.
    pub fn is_of_gadgets_kin(&self) -> bool {
        ["gadget2", "gadget4", "gizmo", "arepo"].contains(&self.sheet.name)
    }

    /// Why its forces cannot be balanced; `None` where they can.
    pub fn unknown_force(&self) -> Option<String> {
        let schemes = self.sheet.schemes.iter().filter(|s| s.has_our_force).map(|s| s.name).collect::<Vec<_>>();
        let others =
            if schemes.is_empty() { String::new() } else { format!(", which are those of its {}", schemes.join(", ")) };
        (!self.scheme.has_our_force).then(|| {
            format!(
                "the forces of {} with {} are not those that are balanced here{others}",
                self.sheet.title, self.scheme.name
            )
        })
    }

    /// What to change where particles were placed with another kernel or number of neighbors; `None` where they agree.
    pub fn mismatch(&self, kernel: KernelName, d: usize, kernel_neighbors: f64) -> Option<String> {
        let off = kernel_neighbors / self.kernel_neighbors(d) - 1.0;
        if kernel == self.kernel && off.abs() < 0.01 {
            return None;
        }
        let Sheet { name, parameter, .. } = self.sheet;
        let setting = self.setting_for(kernel, d, kernel_neighbors);
        let build = match (kernel == self.kernel, self.sheet.has_kernels) {
            (true, _) => format!("set {parameter} to {setting:.4}"),
            (_, true) => format!("build it with {} and set {parameter} to {setting:.4}", kernel.title()),
            (_, false) => "it has no other kernel".to_owned(),
        };
        Some(format!(
            "particles are placed for {} with {kernel_neighbors:.1} neighbors, but the default build is {}: --for {name} places them for it, or {build}",
            kernel.title(),
            self.describe(d),
        ))
    }
}

fn kernel(sheet: &Sheet, name: &str) -> std::result::Result<KernelName, String> {
    let known = KernelName::ALL.iter().map(|k| k.name()).collect::<Vec<_>>().join(", ");
    let found = KernelName::ALL.into_iter().find(|k| k.name() == name);
    let found = found.ok_or_else(|| {
        let hint = did_you_mean(name, KernelName::ALL.iter().map(|k| k.name()));
        format!("'{name}' is no kernel, expected one of {known}{hint}")
    })?;
    if sheet.name == "dualsphysics" && ![KernelName::WendlandC2, KernelName::CubicSpline].contains(&found) {
        return Err(format!("{} has no kernel but Wendland C2 and cubic spline", sheet.title));
    }
    if found != sheet.kernel && !sheet.has_kernels {
        return Err(format!("{} has no kernel but {}", sheet.title, sheet.kernel.title()));
    }
    Ok(found)
}

#[cfg(test)]
#[path = "codes_tests.rs"]
mod tests;
