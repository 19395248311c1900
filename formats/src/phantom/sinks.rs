//! Sinks: point masses with an accretion radius (`h`) and a softening length (`hsoft`), in arrays of their own.
//!
//! They are the particles with a column SofteningRadius or AccretionRadius. The softened attraction is that of a point from 2 hsoft
//! on (the cubic spline's support; `ptmass.F90`).

use super::layout::{TAG, factor, shift};
use crate::common::flavor::Job;
use crate::common::fortran::{padded, record};
use crate::error::Result;
use crate::model::Species;
use crate::particle_names as names;
use crate::units::UnitDimension;
use std::io::Write;

/// Softening radius over hsoft.
pub const SOFTENING: f64 = 2.0;
/// What a sink has, in the order in which Phantom writes it.
pub const TAGS: [&str; 9] = ["x", "y", "z", "m", "h", "hsoft", "vx", "vy", "vz"];

/// Sinks in Phantom's units.
pub struct Sinks {
    pub count: usize,
    /// By tag; empty where there are none.
    pub arrays: Vec<(&'static str, Vec<f64>)>,
}

impl Sinks {
    /// # Errors
    /// Numbers that no sink can have.
    pub fn new(job: &Job, points: &[&Species]) -> Result<Self> {
        let mut arrays: Vec<(&'static str, Vec<f64>)> = TAGS.iter().map(|tag| (*tag, Vec::new())).collect();
        let mut count = 0;
        for species in points {
            count += species.table.count;
            for (tag, values) in &mut arrays {
                let own = column(job, species, tag)?;
                values.extend(own);
            }
        }
        if count == 0 {
            arrays.clear();
        }
        let value = |tag: &str, i: usize| arrays.iter().find(|a| a.0 == tag).map_or(0.0, |a| a.1[i]);
        for i in 0..count {
            if let Some((tag, values)) = arrays.iter().find(|(_, values)| !values[i].is_finite()) {
                return Err(job.refuse(format!("'{tag}' of point mass {} is {}, expected a number", i + 1, values[i])));
            }
            if !(value("m", i) > 0.0) {
                return Err(job.refuse(format!("point mass {} weighs {}, expected more than 0", i + 1, value("m", i))));
            }
            if !(value("h", i) >= 0.0 && value("hsoft", i) >= 0.0 && value("h", i).max(value("hsoft", i)) > 0.0) {
                return Err(job.refuse(format!(
                    "point mass {} has an accretion radius of {} and a softening radius of {}, of which Phantom needs one of more than 0; \
                     state accretion_radius or softening_radius",
                    i + 1,
                    value("h", i),
                    SOFTENING * value("hsoft", i)
                )));
            }
        }
        Ok(Self { count, arrays })
    }

    pub fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        for (tag, values) in &self.arrays {
            record(out, &padded::<TAG>(tag))?;
            record(out, &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())?;
        }
        Ok(())
    }
}

/// One array of a species' sinks.
fn column(job: &Job, species: &Species, tag: &str) -> Result<Vec<f64>> {
    let table = &species.table;
    let axis = |prefix: &str| ["x", "y", "z"].iter().position(|axis| tag.strip_prefix(prefix) == Some(*axis));
    let (name, component, shift, scale) = match (tag, axis(""), axis("v")) {
        (_, Some(k), _) => (names::COORDINATES, k, shift(job, k), 1.0),
        (_, _, Some(k)) => (names::VELOCITIES, k, 0.0, factor(job, UnitDimension::VELOCITY)),
        ("m", ..) => (names::MASSES, 0, 0.0, 1.0),
        ("h", ..) => (names::ACCRETION_RADIUS, 0, 0.0, 1.0),
        _ => (names::SOFTENING_RADIUS, 0, 0.0, 1.0 / SOFTENING),
    };
    let Some(found) = table.column(name) else {
        return match name {
            names::COORDINATES | names::MASSES => Err(job.refuse(format!("the point masses have no {name}"))),
            _ => Ok(vec![0.0; table.count]),
        };
    };
    if found.components <= component || found.values.len() != found.components * table.count {
        let problem = format!(
            "column '{name}' has {} values for {} point masses with {} components",
            found.values.len(),
            table.count,
            found.components
        );
        return Err(job.refuse(problem));
    }
    Ok((0..table.count).map(|i| scale * (found.values.get(i * found.components + component) + shift)).collect())
}
