//! GADGET-4's parameter file, and the lines of its Config.sh.

use super::facts::{END, Facts, LARGEST_STEP, SNAPSHOT};
use crate::codes::long_bits;
use sph_formats::model::ADIABATIC_INDEX;
use std::fmt::Write as _;

impl Facts<'_> {
    pub(super) fn gadget4(&self) -> String {
        let header = &self.file.header;
        let u = &header.units;
        let end = END * self.time;
        let mut text =
            self.head("%", &format!("mpirun -np N Gadget4 {}.param, built with {}.Config.sh", self.stem, self.stem));
        let longest = self.edges().iter().copied().fold(0.0, f64::max);
        let box_size = if header.periodic.contains(&true) { longest } else { 0.0 };
        let _ = write!(
            text,
            "InitCondFile {}
OutputDir ./{}_output
SnapshotFileBase snapshot
OutputListFilename none
ICFormat {}
SnapFormat 3
TimeLimitCPU 86400
CpuTimeBetRestartFile 7200
MaxMemSize 2000
TimeBegin 0
TimeMax {end:e}
ComovingIntegrationOn 0
Omega0 0
OmegaLambda 0
OmegaBaryon 0
HubbleParam 1
Hubble 0
BoxSize {box_size:e}
OutputListOn 0
TimeBetSnapshot {:e}
TimeOfFirstSnapshot 0
TimeBetStatistics {:e}
NumFilesPerSnapshot 1
MaxFilesWithConcurrentIO 1
ErrTolIntAccuracy 0.025
CourantFac 0.15
MaxSizeTimestep {:e}
MinSizeTimestep 0
TypeOfOpeningCriterion 1
ErrTolTheta 0.5
ErrTolThetaMax 0.9
ErrTolForceAcc 0.0025
TopNodeFactor 2.5
ActivePartFracForNewDomainDecomp 0.01
DesNumNgb {}
MaxNumNgbDeviation 0.1
UnitLength_in_cm {:e}
UnitMass_in_g {:e}
UnitVelocity_in_cm_per_s {:e}
GravityConstantInternal {}
ArtBulkViscConst 1
MinEgySpec 0
InitGasTemp 0
",
            self.told_name(),
            self.stem,
            self.container,
            SNAPSHOT * self.time,
            0.1 * SNAPSHOT * self.time,
            LARGEST_STEP * self.time,
            self.code.setting_in(header.dimension),
            u.length,
            u.mass,
            u.length / u.time,
            // 0 stands for the constant that it is compiled with, in the file's units.
            self.gravity.and_then(|g| g.stated).unwrap_or(0.0),
        );
        text += &self.softenings("Class");
        text
    }

    pub(super) fn gadget4_config(&self) -> String {
        let mut text = self.head("#", &format!("make CONFIG={}.Config.sh", self.stem));
        text += "NTYPES=6\nDOUBLEPRECISION=1\n";
        text += if self.container == 3 { "" } else { "GADGET2_HEADER\n" };
        text += match self.code.kernel {
            sph::kernel::KernelName::WendlandC2 => "WENDLAND_C2_KERNEL\n",
            sph::kernel::KernelName::WendlandC4 => "WENDLAND_C4_KERNEL\n",
            sph::kernel::KernelName::WendlandC6 => "WENDLAND_C6_KERNEL\n",
            _ => "CUBIC_SPLINE_KERNEL\n",
        };
        if self.code.scheme.name == "pressure-entropy" {
            text += "PRESSURE_ENTROPY_SPH\n";
        }
        text += if self.gravity.is_some() { "SELFGRAVITY\n" } else { "" };
        if self.file.header.periodic.contains(&true) {
            text += "PERIODIC\n";
            text.extend(long_bits(self.edges()).unwrap_or_default().into_iter().map(|line| line + "\n"));
        }
        text.extend(self.dimension_option().map(|option| option + "\n"));
        if self.gamma() != ADIABATIC_INDEX {
            let _ = writeln!(text, "GAMMA={}", self.gamma());
        }
        text
    }
}
