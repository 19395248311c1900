//! GIZMO's parameter file, and the lines of its Config.sh.

use super::facts::{END, Facts, LARGEST_STEP, SNAPSHOT};
use sph::kernel::KernelName;
use sph_formats::common::particle_names as names;
use std::fmt::Write as _;

impl Facts<'_> {
    pub(super) fn gizmo(&self) -> String {
        let header = &self.file.header;
        let u = &header.units;
        let edge = header.box_size[0];
        let mut text =
            self.head("%", &format!("mpirun -np N GIZMO {}.params, built with {}.Config.sh", self.stem, self.stem));
        let _ = write!(
            text,
            "InitCondFile {}
OutputDir {}_output
SnapshotFileBase snapshot
RestartFile restart
ICFormat {}
SnapFormat 3
NumFilesPerSnapshot 1
NumFilesWrittenInParallel 1
TimeLimitCPU 86400
CpuTimeBetRestartFile 7200
MaxMemSize 2000
PartAllocFactor 5
BufferSize 100
ComovingIntegrationOn 0
HubbleParam 1
Omega0 0
OmegaLambda 0
OmegaBaryon 0
BoxSize {edge:e}
TimeBegin 0
TimeMax {:e}
OutputListOn 0
TimeOfFirstSnapshot 0
TimeBetSnapshot {:e}
MaxSizeTimestep {:e}
MinSizeTimestep 0
DesNumNgb {}
MinGasHsmlFractional 0
UnitLength_in_cm {:e}
UnitMass_in_g {:e}
UnitVelocity_in_cm_per_s {:e}
GravityConstantInternal {}
InitGasTemp 0
MinGasTemp 0
",
            self.told_name(),
            self.stem,
            self.container,
            END * self.time,
            SNAPSHOT * self.time,
            LARGEST_STEP * self.time,
            self.code.setting_in(header.dimension),
            u.length,
            u.mass,
            u.length / u.time,
            // 0 stands for the constant that it is compiled with, in the file's units.
            self.gravity.and_then(|g| g.stated).unwrap_or(0.0),
        );
        if self.is_magnetic() {
            // As the file's are written, see `MagneticUnit::Gauss`.
            text += "UnitMagneticField_in_gauss 1\n";
        }
        for (class, name) in ["Gas", "Halo", "Disk", "Bulge", "Stars", "Bndry"].into_iter().enumerate() {
            let own = self.point.filter(|(of_type, _)| usize::from(*of_type) == class).map_or(self.softening, |p| p.1);
            let _ = writeln!(text, "Softening{name} {own:e}\nSoftening{name}MaxPhys {own:e}");
        }
        text
    }

    pub(super) fn gizmo_config(&self) -> String {
        let header = &self.file.header;
        let mut text = self.head("#", &format!("make CONFIG={}.Config.sh", self.stem));
        text += match self.code.scheme.name {
            "mfv" => "HYDRO_MESHLESS_FINITE_VOLUME\n",
            "density-sph" => "HYDRO_DENSITY_SPH\n",
            "pressure-sph" => "HYDRO_PRESSURE_SPH\n",
            _ => "HYDRO_MESHLESS_FINITE_MASS\n",
        };
        let _ = writeln!(text, "KERNEL_FUNCTION={}", function(self.code.kernel));
        let _ = writeln!(text, "EOS_GAMMA=({})", self.gamma());
        text.extend(self.dimension_option().map(|option| option + "\n"));
        text += if self.gravity.is_some() { "ADAPTIVE_GRAVSOFT_FORGAS\n" } else { "SELFGRAVITY_OFF\n" };
        if self.gravity.is_some() && self.code.scheme.name.ends_with("-sph") {
            // Its conductivity is driven by differences of pressure, which hold a body: a star cools in the middle and falls together.
            text += "SPH_DISABLE_PM_CONDUCTIVITY\n";
        }
        if header.periodic.contains(&true) {
            text += "BOX_PERIODIC\n";
            for (axis, edge) in ["X", "Y", "Z"].into_iter().zip(self.edges()).skip(1) {
                if *edge != header.box_size[0] {
                    let _ = writeln!(text, "BOX_LONG_{axis}={}", edge / header.box_size[0]);
                }
            }
        }
        text += if self.is_magnetic() { "MAGNETIC\n" } else { "" };
        text += "INPUT_POSITIONS_IN_DOUBLE\n";
        text
    }

    fn is_magnetic(&self) -> bool {
        self.gas.column(names::MAGNETIC_FIELD).is_some()
    }
}

/// KERNEL_FUNCTION in kernel.h.
fn function(kernel: KernelName) -> u8 {
    match kernel {
        KernelName::Quartic => 4,
        KernelName::Quintic => 5,
        KernelName::WendlandC2 => 6,
        KernelName::WendlandC4 => 7,
        KernelName::WendlandC6 => 9,
        KernelName::CubicSpline | KernelName::Sinc6 => 3,
    }
}
