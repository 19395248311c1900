//! AREPO's parameter file, and the lines of its Config.sh, for its public version (Weinberger, Springel & Pakmor 2020, ApJS 248, 32).

use super::facts::{END, Facts, LARGEST_STEP, SNAPSHOT};
use sph_formats::common::particle_names as names;
use sph_formats::model::ADIABATIC_INDEX;
use std::fmt::Write as _;

/// Part of the box that gas fills, below which the rest is vacuum.
const FILLED: f64 = 0.7;

impl Facts<'_> {
    pub(super) fn arepo(&self) -> String {
        let header = &self.file.header;
        let u = &header.units;
        let edge = header.box_size[0];
        let mut text =
            self.head("%", &format!("mpirun -np N Arepo {}.param, built with {}.Config.sh", self.stem, self.stem));
        let _ = write!(
            text,
            "InitCondFile {}
OutputDir ./{}_output
SnapshotFileBase snapshot
OutputListFilename none
OutputListOn 0
ICFormat {}
SnapFormat 3
NumFilesPerSnapshot 1
NumFilesWrittenInParallel 1
TimeLimitCPU 86400
CpuTimeBetRestartFile 7200
ResubmitOn 0
ResubmitCommand none
MaxMemSize 2000
ComovingIntegrationOn 0
Omega0 0
OmegaBaryon 0
OmegaLambda 0
HubbleParam 1
PeriodicBoundariesOn {}
BoxSize {edge:e}
TimeBegin 0
TimeMax {:e}
TimeBetSnapshot {:e}
TimeOfFirstSnapshot 0
TimeBetStatistics {:e}
MaxSizeTimestep {:e}
MinSizeTimestep 0
TypeOfTimestepCriterion 0
CourantFac 0.3
ErrTolIntAccuracy 0.012
TypeOfOpeningCriterion 1
ErrTolTheta 0.7
ErrTolForceAcc 0.0025
MultipleDomains 8
TopNodeFactor 2.5
ActivePartFracForNewDomainDecomp 0.01
DesNumNgb 64
MaxNumNgbDeviation 4
UnitLength_in_cm {:e}
UnitMass_in_g {:e}
UnitVelocity_in_cm_per_s {:e}
GravityConstantInternal {}
GasSoftFactor 2.5
InitGasTemp 0
MinGasTemp 0
MinEgySpec 0
MinimumDensityOnStartUp 0
LimitUBelowThisDensity 0
LimitUBelowCertainDensityToThisValue 0
CoolingOn 0
StarformationOn 0
CellShapingSpeed 0.5
CellMaxAngleFactor 2.25
",
            self.told_name(),
            self.stem,
            self.container,
            // Of gravity: the boundaries of the gas are compiled in.
            i32::from(self.gravity.is_none()),
            END * self.time,
            SNAPSHOT * self.time,
            0.1 * SNAPSHOT * self.time,
            LARGEST_STEP * self.time,
            u.length,
            u.mass,
            u.length / u.time,
            // 0 stands for the constant that it is compiled with, in the file's units.
            self.gravity.and_then(|g| g.stated).unwrap_or(0.0),
        );
        text += &self.softenings("Type");
        text
    }

    pub(super) fn arepo_config(&self) -> String {
        let header = &self.file.header;
        let mut text = self.head("#", &format!("make CONFIG={}.Config.sh", self.stem));
        text.extend(self.dimension_option().map(|option| option + "\n"));
        let axes = ["X", "Y", "Z"].into_iter().zip(self.edges()).zip(header.periodic);
        for ((axis, edge), is_periodic) in axes {
            if *edge != header.box_size[0] {
                let _ = writeln!(text, "LONG_{axis}={}", edge / header.box_size[0]);
            }
            // 1 mirrors, and through 2 gas flows out.
            if !is_periodic {
                let _ = writeln!(text, "REFLECTIVE_{axis}={}", if self.reflects { 1 } else { 2 });
            }
        }
        if self.gamma() != ADIABATIC_INDEX {
            let _ = writeln!(text, "GAMMA={}", self.gamma());
        }
        text += if self.gravity.is_some() { "SELFGRAVITY\nGRAVITY_NOT_PERIODIC\nEVALPOTENTIAL\n" } else { "" };
        let is_magnetic = self.gas.column(names::MAGNETIC_FIELD).is_some();
        text += if is_magnetic { "MHD\nMHD_POWELL\nRIEMANN_HLLD\n" } else { "" };
        text += "REGULARIZE_MESH_CM_DRIFT\nREGULARIZE_MESH_CM_DRIFT_USE_SOUNDSPEED\nREGULARIZE_MESH_FACE_ANGLE\n";
        // In one dimension it ends at its first step with the tree of signals.
        text += if header.dimension == 1 { "FORCE_EQUAL_TIMESTEPS\n" } else { "TREE_BASED_TIMESTEPS\n" };
        text += "DOUBLEPRECISION=1\nREAD_COORDINATES_IN_DOUBLE\nHAVE_HDF5\n";
        let particles: usize = self.file.species.iter().map(|s| s.table.count).sum();
        text += if u32::try_from(particles).is_err() { "LONGIDS\n" } else { "" };
        text
    }

    /// Cells fill the box, whatever there is in it, and mirrors are its faces. In two dimensions there is a mesh with a vacuum in it.
    pub(super) fn arepo_doubt(&self) -> Option<String> {
        let values = |name: &str| self.gas.column(name).map(|c| &c.values);
        let (masses, densities) = (values(names::MASSES)?, values(names::DENSITY)?);
        let filled: f64 = (0..self.gas.count).map(|i| masses.get(i) / densities.get(i)).sum();
        let part = self.stands_for * filled / self.edges().iter().product::<f64>();
        let comes_of_it = match self.file.header.dimension {
            3 => "there is no mesh with a vacuum in it, and AREPO ends at its first steps",
            _ => "cells at its surface take in the rest, into which the gas spreads",
        };
        let mirrors =
            if self.reflects { ", and it mirrors at the faces of the box, not at walls within it" } else { "" };
        (part < FILLED).then(|| {
            format!(
                "AREPO's cells fill the box, but gas {:.1} % of it alone: {comes_of_it}{mirrors}; a medium fills it, as `ambient: {{density: ..., match: \
                 spacing}}` beside `bodies` does",
                100.0 * part
            )
        })
    }
}
