//! Particle columns other than positions and masses: carried variables of the input, imposed motion, internal energy.

use crate::error::{Error, Result};
use crate::field::CarriedField;
use crate::target::{Positions, at};
use sph::domain::Domain;
use sph::parallel;
use sph_formats::common::particle_names as names;
use sph_formats::{Column, UnitDimension, UnitSystem, Values};

/// Where the internal energy of the particles comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum EnergySource {
    /// Those that the balance of pressure and gravity left.
    Balanced,
    Carried,
    /// u = P / ((gamma - 1) rho*), rho* that of the gas alone where it has dust.
    Pressure {
        has_dust: bool,
    },
    Given,
    /// Nothing thermal is known, but the output cannot do without: the square of one unit of velocity.
    Placeholder,
    NotWritten,
}

/// Gives columns whose names readers take for those of others, as `Mass` beside `Masses`, the names of [`names::apart`].
pub fn set_apart(columns: &mut [Column]) {
    let all: Vec<String> = columns.iter().map(|c| c.name.clone()).collect();
    for column in columns {
        let meant = names::standard(&column.name).filter(|meant| *meant != column.name);
        if meant.is_some_and(|meant| all.iter().any(|name| name == meant)) {
            column.name = names::apart(&column.name);
        }
    }
}

/// Evaluates one carried variable on all particles, in the output's units.
pub fn column<const D: usize>(field: &dyn CarriedField<D>, positions: &Positions<D>, units: &UnitSystem) -> Column {
    let info = field.info();
    // Numbers without a unit are in the output's. Particles in fewer dimensions are rods and sheets in space.
    let stated = info.unit.as_ref().map_or_else(|| names::meaning(&info.name, 3), |u| u.dimension);
    let factor = info.unit.as_ref().map_or(1.0, |u| u.to_cgs / units.to_cgs(stated));
    let mut values = vec![0.0; info.components * positions[0].len()];
    parallel::update_rows(&mut values, info.components, |i, out| {
        field.evaluate(&at(positions, i), out);
        out.iter_mut().for_each(|v| *v *= factor);
    });
    Column { name: info.name.clone(), components: info.components, values: Values::F64(values), dimension: stated }
}

/// Refuses carried values that are no numbers, and parts that are none: expressions may have such where nobody looked before.
///
/// # Errors
/// The first column with one.
pub fn check_finite(columns: &[Column]) -> Result<()> {
    for column in columns {
        let Values::F64(values) = &column.values else { continue };
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            let (particle, value) = (i / column.components.max(1), values[i]);
            let problem = format!("is {value} at particle {particle}, expected a finite number at each");
            return Err(Error::field(&column.name, problem));
        }
        if let Some(i) = values.iter().position(|v| column.name == names::TEMPERATURE && *v < 0.0) {
            let problem = format!("is {} at particle {i}, expected one above absolute zero", values[i]);
            return Err(Error::field(&column.name, problem));
        }
        if let Some(i) = values.iter().position(|v| column.name == names::DUST_FRACTION && !(0.0..1.0).contains(v)) {
            let problem =
                format!("is {} at particle {i}, expected a part of the mass, from 0 to less than 1", values[i]);
            return Err(Error::field(&column.name, problem));
        }
    }
    Ok(())
}

/// Velocities that the scene sets, in the units of the columns.
pub struct SetMotion {
    pub bulk: Vec<f64>,
    pub rotation: Vec<f64>,
}

/// What is known of the internal energy beside columns, in the units of the columns.
pub struct KnownEnergy {
    /// One at each particle, over all others.
    pub balanced: Option<Vec<f64>>,
    /// The same at all.
    pub given: Option<f64>,
    /// With which a pressure becomes an energy.
    pub gamma: f64,
}

/// Material numbers by distance from the center; `layers` go from the center outward, with their outer radii in the units
/// of `positions`.
pub fn materials<const D: usize>(positions: &Positions<D>, center: &[f64; D], layers: &[(i32, Option<f64>)]) -> Column {
    let material = |i: usize| {
        let x = at(positions, i);
        let r = (0..D).map(|k| (x[k] - center[k]).powi(2)).sum::<f64>().sqrt();
        let layer = layers.iter().find(|(_, radius)| radius.is_none_or(|outer| r < outer)).or(layers.last());
        layer.map_or(0, |(id, _)| i64::from(*id))
    };
    let values = Values::I64(parallel::map(positions[0].len(), material));
    Column { name: names::MATERIAL_IDS.into(), components: 1, values, dimension: UnitDimension::NONE }
}

/// Carried velocities, which are taken out of `columns`, plus the scene's motion. `None` where everything is at rest.
///
/// # Errors
/// Motion with the wrong number of components.
pub fn velocities<const D: usize>(
    columns: &mut Vec<Column>,
    positions: &Positions<D>,
    domain: &Domain<D>,
    motion: &SetMotion,
) -> Result<Option<Vec<f64>>> {
    let carried = columns.iter().position(|c| c.name == names::VELOCITIES && c.components == D);
    let carried = carried.map(|i| columns.remove(i).values.to_f64());
    let mut moving = carried.is_some();
    let mut v = carried.unwrap_or_else(|| vec![0.0; positions[0].len() * D]);
    moving |= add_motion(&mut v, positions, domain, motion)?;
    Ok(moving.then_some(v))
}

fn add_motion<const D: usize>(
    v: &mut [f64],
    positions: &Positions<D>,
    domain: &Domain<D>,
    motion: &SetMotion,
) -> Result<bool> {
    let bulk = components::<D>("motion.bulk", &motion.bulk, D)?;
    let about = match D {
        3 => 3,
        2 => 1,
        _ if motion.rotation.is_empty() => 0,
        _ => return Err(Error::scene("motion.rotation", "means nothing in 1-D")),
    };
    let rotation = components::<3>("motion.rotation", &motion.rotation, about)?;
    let omega = if D == 3 { rotation } else { [0.0, 0.0, rotation[0]] };
    let middle = domain.center();
    parallel::update_rows(v, D, |i, v| {
        let x = at(positions, i);
        let d: [f64; 3] = sph::array(|k| if k < D { x[k] - middle[k] } else { 0.0 });
        let swirl =
            [omega[1] * d[2] - omega[2] * d[1], omega[2] * d[0] - omega[0] * d[2], omega[0] * d[1] - omega[1] * d[0]];
        (0..D).for_each(|k| v[k] += bulk[k] + swirl[k]);
    });
    Ok(motion.bulk.iter().chain(&motion.rotation).any(|&c| c != 0.0))
}

fn components<const N: usize>(key: &str, given: &[f64], expected: usize) -> Result<[f64; N]> {
    if !given.is_empty() && given.len() != expected {
        return Err(Error::scene(key, format!("has {} components, expected {expected}", given.len())));
    }
    if given.iter().any(|v| !v.is_finite()) {
        return Err(Error::scene(key, "has a component that is not finite"));
    }
    Ok(sph::array(|k| given.get(k).copied().unwrap_or(0.0)))
}

/// Adds the internal energy where it is not carried: from a carried pressure, as given, or as a placeholder
/// where the format insists (`required`). `density` is rho* in the output's units.
///
/// # Errors
/// A carried pressure without which there is no energy: not positive.
pub fn internal_energy(
    columns: &mut Vec<Column>,
    density: &[f64],
    known: KnownEnergy,
    required: bool,
) -> Result<EnergySource> {
    let push = |columns: &mut Vec<Column>, values: Vec<f64>| {
        columns.push(Column {
            name: names::INTERNAL_ENERGY.into(),
            components: 1,
            values: Values::F64(values),
            dimension: UnitDimension::SPECIFIC_ENERGY,
        });
    };
    if let Some(u) = known.balanced {
        columns.retain(|c| c.name != names::INTERNAL_ENERGY);
        push(columns, u);
        return Ok(EnergySource::Balanced);
    }
    if let Some(u) = known.given {
        columns.retain(|c| c.name != names::INTERNAL_ENERGY);
        push(columns, vec![u; density.len()]);
        return Ok(EnergySource::Given);
    }
    if columns.iter().any(|c| c.name == names::INTERNAL_ENERGY && c.components == 1) {
        return Ok(EnergySource::Carried);
    }
    if let Some(pressure) = columns.iter().find(|c| c.name == names::PRESSURE && c.components == 1) {
        let cold = (0..density.len()).filter(|&i| !(pressure.values.get(i) > 0.0)).count();
        if cold > 0 && required {
            return Err(Error::field(
                names::PRESSURE,
                format!(
                    "is zero or negative at {cold} of {} particles, which then have no internal energy; \
                     leave the pressure out with input.carry, and set thermal.internal_energy",
                    density.len()
                ),
            ));
        }
        let dust = columns.iter().find(|c| c.name == names::DUST_FRACTION && c.components == 1);
        let gas = |i: usize| dust.map_or(1.0, |dust| 1.0 - dust.values.get(i));
        let of = |(i, rho): (usize, &f64)| pressure.values.get(i) / ((known.gamma - 1.0) * gas(i) * rho);
        let (u, has_dust) = (density.iter().enumerate().map(of).collect(), dust.is_some());
        push(columns, u);
        return Ok(EnergySource::Pressure { has_dust });
    }
    if required {
        push(columns, vec![1.0; density.len()]);
        return Ok(EnergySource::Placeholder);
    }
    Ok(EnergySource::NotWritten)
}

/// A gas is ideal where pressures and energies are in one proportion, but for so much.
const SAME_GAS: f64 = 0.02;

/// What gamma pressures and energies of an ideal gas have that both are carried, where it is not `gamma`. `density` is as above.
pub fn other_gamma(columns: &[Column], density: &[f64], gamma: f64) -> Option<f64> {
    let scalar = |name: &str| columns.iter().find(|c| c.name == name && c.components == 1);
    let (pressure, energy) = (scalar(names::PRESSURE)?, scalar(names::INTERNAL_ENERGY)?);
    if scalar(names::DUST_FRACTION).is_some() || scalar(names::MATERIAL_IDS).is_some() {
        return None;
    }
    let share = |i: usize| pressure.values.get(i) / (density[i] * energy.values.get(i));
    let mut shares: Vec<f64> = (0..density.len()).map(share).collect();
    shares.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| shares.get((share * (shares.len() as f64 - 1.0)) as usize).copied();
    let (low, median, high) = (at(0.05)?, at(0.5)?, at(0.95)?);
    let is_ideal = median > 0.0 && high - low <= SAME_GAS * median;
    (is_ideal && (median / (gamma - 1.0) - 1.0).abs() > SAME_GAS).then_some(median + 1.0)
}
