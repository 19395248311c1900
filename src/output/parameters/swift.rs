//! SWIFT's parameter file.

use super::facts::{END, Facts, LARGEST_SMOOTHING, LARGEST_STEP, SNAPSHOT};
use crate::codes::{AS_PLANETARY, CELL_OVER_REACH, LEAST_CELLS};
use crate::input::particles::is_zero;
use sph::kernel::{KernelName, support_over_smoothing_length};
use sph_formats::common::particle_names as names;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Adiabatic indices that SWIFT can be configured with (configure.ac), as its option has them.
const ADIABATIC_INDICES: [(f64, &str); 4] = [(5.0 / 3.0, "5/3"), (7.0 / 5.0, "7/5"), (4.0 / 3.0, "4/3"), (2.0, "2")];
/// Gas with an index below is meant to be isothermal.
const ISOTHERMAL: f64 = 1.01;
/// Specific energies that differ by less are one temperature: they are stored in single precision.
const SAME_ENERGY: f64 = 1e-5;
/// Of the widest smoothing length with which SWIFT has enough cells.
const WITHIN: f64 = 0.99;
/// Cells along the longest edge, unless thin boxes ask for more.
const CELLS: f64 = 16.0;

/// What the build makes of the gas.
enum Gas {
    /// The option for the adiabatic index; none for the default.
    Ideal(Option<&'static str>),
    /// Of one temperature; the internal energy with which (gamma - 1) rho u is the pressure in a build for 5/3.
    Isothermal(f64),
    /// No build has this index.
    Unknown,
}

/// Beside a box that is not periodic.
const LEAVES: &str = "  # particles that leave the box are deleted: output.box_factor makes it larger
";
/// When the tree's cells count as a whole. Particles on different time steps attract each other by sums that do not cancel.
const OF_WHAT_MOVES: &str = "  MAC: adaptive
  # keeps momenta 20 times as well as geometric with 0.5, in a fifth more time
  epsilon_fmm: 0.0001
";
const OF_WHAT_RESTS: &str = "  MAC: geometric
  # theta_cr 0.7 takes two thirds to four fifths of the time; a star at rest stays as still
  epsilon_fmm: 0.001
";

impl Facts<'_> {
    pub(super) fn swift(&self) -> String {
        let u = &self.file.header.units;
        let gravity = if self.gravity.is_some() { " --self-gravity" } else { "" };
        let stars = if self.has(4) { " --stars" } else { "" };
        // Without it, particles that a shock reaches keep their long time steps, and energy is not conserved.
        let limiter = if AS_PLANETARY.contains(&self.code.scheme.name) { "" } else { " --limiter" };
        let command = format!("swift --hydro{limiter}{stars}{gravity} --threads=N {}.yml", self.stem);
        let mut text = self.head("#", &format!("{command}, {}", self.swift_build()));
        let end = END * self.time;
        let periodic = i32::from(self.file.header.periodic.contains(&true));
        let _ = write!(
            text,
            "InternalUnitSystem:
  UnitMass_in_cgs: {:e}
  UnitLength_in_cgs: {:e}
  UnitVelocity_in_cgs: {:e}
  UnitCurrent_in_cgs: 1
  UnitTemp_in_cgs: {:e}
TimeIntegration:
  time_begin: 0
  time_end: {end:e}
  dt_min: {:e}
  dt_max: {:e}
Snapshots:
  basename: {}_snap
  time_first: 0
  delta_time: {:e}
Statistics:
  delta_time: {:e}
  time_first: 0
Scheduler:
  max_top_level_cells: {}
InitialConditions:
  file_name: {}
  periodic: {periodic}
{}SPH:
  resolution_eta: {}
  CFL_condition: 0.2
  h_max: {:e}
",
            u.mass,
            u.length,
            u.length / u.time,
            u.temperature,
            1e-10 * end,
            LARGEST_STEP * self.time,
            self.stem,
            SNAPSHOT * self.time,
            0.1 * SNAPSHOT * self.time,
            self.swift_cells(),
            self.name,
            if periodic == 0 { LEAVES } else { "" },
            self.code.setting(),
            self.swift_largest_smoothing(),
        );
        self.swift_gravity(&mut text);
        text += &self.swift_materials();
        if let Gas::Isothermal(energy) = self.swift_gas() {
            let _ = writeln!(text, "EoS:\n  isothermal_internal_energy: {energy:e}");
        }
        text
    }

    /// Options of `configure`, as far as the file depends on them.
    fn swift_build(&self) -> String {
        let scheme = self.code.scheme.name;
        let mut options = Vec::new();
        if scheme != self.code.sheet.schemes[0].name {
            options.push(format!("--with-hydro={scheme}"));
        }
        if AS_PLANETARY.contains(&scheme) {
            options.push("--with-equation-of-state=planetary".into());
        } else {
            match self.swift_gas() {
                Gas::Ideal(Some(index)) => options.push(format!("--with-adiabatic-index={index}")),
                Gas::Isothermal(_) => options.push("--with-equation-of-state=isothermal-gas".into()),
                Gas::Ideal(None) | Gas::Unknown => {}
            }
        }
        let kernel = match self.code.kernel {
            KernelName::Quartic => Some("quartic-spline"),
            KernelName::Quintic => Some("quintic-spline"),
            KernelName::WendlandC2 => Some("wendland-C2"),
            KernelName::WendlandC4 => Some("wendland-C4"),
            KernelName::WendlandC6 => Some("wendland-C6"),
            KernelName::CubicSpline | KernelName::Sinc6 => None,
        };
        options.extend(kernel.map(|kernel| format!("--with-kernel={kernel}")));
        // Its loops by hand for vector units know two kernels (kernel_hydro.h), and stop the build with others.
        if kernel.is_some_and(|kernel| kernel != "wendland-C2") {
            options.push("--disable-hand-vec".into());
        }
        options.extend(self.dimension_option());
        match options.is_empty() {
            true => "as it is built by default".into(),
            false => format!("configured with {}", options.join(" ")),
        }
    }

    fn has(&self, part_type: u8) -> bool {
        self.file.species.iter().any(|s| s.part_type == part_type && s.table.count > 0)
    }

    fn swift_gas(&self) -> Gas {
        let gamma = self.gamma();
        match ADIABATIC_INDICES.iter().position(|(index, _)| (index - gamma).abs() < 1e-6) {
            Some(0) => return Gas::Ideal(None),
            Some(which) => return Gas::Ideal(Some(ADIABATIC_INDICES[which].1)),
            None => {}
        }
        let energies = self.gas.column(names::INTERNAL_ENERGY).map(|c| c.values.range());
        match energies {
            Some((least, most, 0)) if gamma < ISOTHERMAL && least > 0.0 && most - least < SAME_ENERGY * most => {
                Gas::Isothermal((gamma - 1.0) * most / (ADIABATIC_INDICES[0].0 - 1.0))
            }
            _ => Gas::Unknown,
        }
    }

    /// Top-level cells along the longest edge: at least three must lie along the shortest one.
    fn swift_cells(&self) -> f64 {
        let edges = self.edges();
        let (least, most) = edges.iter().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), &e| (a.min(e), b.max(e)));
        let needed = (LEAST_CELLS * most / least).ceil();
        if needed.is_finite() { needed.max(CELLS) } else { CELLS }
    }

    /// As wide as the box allows, and wider than the widest of the file, beyond which densities would be wrong: SWIFT makes its cells anew where
    /// smoothing lengths grow, and stops where a periodic box has too few of them.
    fn swift_largest_smoothing(&self) -> f64 {
        let edges = self.edges().iter();
        let reach = support_over_smoothing_length(self.code.kernel, self.file.header.dimension);
        let widest = self.gas.column(names::SUPPORT_RADIUS).map_or(0.0, |c| c.values.range().1) / reach;
        let largest = (LARGEST_SMOOTHING * edges.clone().copied().fold(0.0, f64::max)).max(GROWTH * widest);
        if !self.file.header.periodic.contains(&true) {
            return largest;
        }
        let shortest = edges.copied().fold(f64::INFINITY, f64::min);
        largest.min(WITHIN * shortest / (LEAST_CELLS * CELL_OVER_REACH * reach))
    }

    fn swift_gravity(&self, text: &mut String) {
        let Some(constant) = self.gravity else { return };
        if self.code.scheme.name == "sphenix" {
            *text += "  # A body at rest has steep gradients of energy at its surface, which artificial conduction would smooth:
  # it raises the entropy there by nearly a half in a dynamical time. Leave these out where mixing matters.
  diffusion_beta: 0
  diffusion_alpha: 0
  diffusion_alpha_max: 0
  diffusion_alpha_min: 0
";
        }
        let _ = write!(
            text,
            "Gravity:
  eta: 0.025
{}  theta_cr: 0.5
  use_tree_below_softening: 1
  max_physical_baryon_softening: {:e}
",
            if self.moves() { OF_WHAT_MOVES } else { OF_WHAT_RESTS },
            self.softening
        );
        if self.has(1) {
            let own = self.point.filter(|p| p.0 == 1).map_or(self.softening, |(_, length)| length);
            let _ = writeln!(text, "  max_physical_DM_softening: {own:e}");
        }
        if let Some(stated) = constant.stated {
            let _ = writeln!(text, "PhysicalConstants:\n  G: {stated:e}");
        }
    }

    /// Whether something is on its way, or has a core about which it can be.
    fn moves(&self) -> bool {
        self.file.species.len() > 1 || self.gas.column(names::VELOCITIES).is_some_and(|v| !is_zero(&v.values))
    }

    /// Numbers of the materials that occur; none for schemes that know none.
    fn materials(&self) -> BTreeSet<i64> {
        if !AS_PLANETARY.contains(&self.code.scheme.name) {
            return BTreeSet::new();
        }
        let tables = self.file.species.iter().filter(|s| s.part_type == 0).map(|s| &s.table);
        let ids = tables
            .filter_map(|t| t.column(names::MATERIAL_IDS))
            .flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i)));
        ids.map(|id| id as i64).collect()
    }

    /// Equations of state of the materials that occur.
    fn swift_materials(&self) -> String {
        let ids = self.materials();
        if ids.is_empty() {
            return String::new();
        }
        let mut text = "EoS:\n".to_owned();
        for id in ids {
            match swift_material(id) {
                Some((name, table)) => {
                    let _ = writeln!(text, "  planetary_use_{name}: 1");
                    if let Some(table) = table {
                        let _ = writeln!(text, "  planetary_{name}_table_file: ./{table}  # where the table is");
                    }
                }
                None => {
                    let _ = writeln!(
                        text,
                        "  # material {id} occurs: switch its equation of state on here, with its table"
                    );
                }
            }
        }
        text
    }

    /// What SWIFT would take for something else.
    pub(super) fn swift_doubts(&self) -> Vec<String> {
        let mut doubts = Vec::new();
        if let (Gas::Unknown, false) = (self.swift_gas(), AS_PLANETARY.contains(&self.code.scheme.name)) {
            doubts.push(format!(
                "no build of SWIFT has the adiabatic index {}: it would run with 5/3; set thermal.gamma to 5/3, 7/5, 4/3 or 2",
                self.gamma()
            ));
        }
        let to_provide = |id: i64| {
            let (name, table) = swift_material(id)?;
            Some(format!(
                "SWIFT reads the table of material {id} from EoS:planetary_{name}_table_file, here ./{}: put it there, or change the path",
                table?
            ))
        };
        doubts.extend(self.materials().into_iter().filter_map(to_provide));
        doubts.extend(self.file.species.iter().filter_map(|species| self.code.unread(species)));
        doubts
    }

    /// What SWIFT would stop at.
    pub(super) fn swift_stops(&self) -> Vec<String> {
        let unknown = self.materials().into_iter().filter(|id| swift_material(*id).is_none()).map(|id| {
            format!(
                "no material of SWIFT has the number {id}: it stops, or computes nonsense; give the layer the `id` of one, 900 to 909 for your own tables"
            )
        });
        self.swift_thin_box().into_iter().chain(unknown).collect()
    }

    /// A periodic box that is too thin for the kernels.
    fn swift_thin_box(&self) -> Option<String> {
        let (reach, least, enough) = self.too_few(CELL_OVER_REACH * LEAST_CELLS)?;
        Some(format!(
            "SWIFT stops at this file: its cells, {CELL_OVER_REACH} times as wide as the reach of the kernels, {reach:.3e}, are to be {LEAST_CELLS} at least along \
             each edge of a periodic box, the shortest of which is {least:.3e}; use {enough:.0} particles or more"
        ))
    }
}

/// Smoothing lengths may grow by this from the widest of the file.
const GROWTH: f64 = 1.5;

/// What SWIFT calls the material of a number, with the table that it reads for it (`equation_of_state.h`, `eos_setup.h` of its planetary
/// equations of state).
fn swift_material(id: i64) -> Option<(String, Option<String>)> {
    let (name, table) = match id {
        0 => ("idg_def", None),
        100 => ("Til_iron", None),
        101 => ("Til_granite", None),
        102 => ("Til_water", None),
        103 => ("Til_basalt", None),
        104 => ("Til_ice", None),
        200 => ("HM80_HHe", Some("HM80_HHe.txt")),
        201 => ("HM80_ice", Some("HM80_ice.txt")),
        202 => ("HM80_rock", Some("HM80_rock.txt")),
        300 => ("SESAME_iron", Some("SESAME_iron_2140.txt")),
        301 => ("SESAME_basalt", Some("SESAME_basalt_7530.txt")),
        302 => ("SESAME_water", Some("SESAME_water_7154.txt")),
        303 => ("SS08_water", Some("SS08_water.txt")),
        400 => ("ANEOS_forsterite", Some("ANEOS_forsterite_S19.txt")),
        401 => ("ANEOS_iron", Some("ANEOS_iron_S20.txt")),
        402 => ("ANEOS_Fe85Si15", Some("ANEOS_Fe85Si15_S20.txt")),
        900..=909 => {
            let name = format!("custom_{}", id - 900);
            let table = format!("{name}.txt");
            return Some((name, Some(table)));
        }
        _ => return None,
    };
    Some((name.into(), table.map(Into::into)))
}
