//! Assembles particles from named arrays, for formats that contain nothing else: tables, NumPy archives, NetCDF variables, VTK points.
//!
//! Units: the header's where it states them, else those of the coordinates, masses and velocities (or energies), else
//! pure numbers. Arrays in other units than these are converted; arrays without one are taken for what their name means.

use crate::common::facts::Facts;
use crate::model::{Column, ParticleFile, ParticleTable, RunHeader, Species, Values};
use crate::particle_names as names;
use crate::units::{Unit, UnitDimension, UnitSystem};

/// One array of a file, a row per particle.
#[derive(Debug, Clone)]
pub struct Named {
    pub name: String,
    pub components: usize,
    pub values: Values,
    /// `None` where the file states none.
    pub unit: Option<Unit>,
}

/// Location and problem.
type Problem = (String, String);

/// Names of the axes, alone (coordinates) and behind a `v` (velocities).
const AXES: [&str; 3] = ["x", "y", "z"];

/// Whether arrays of these names are particles: positions and masses.
pub fn are_particles<'a>(found: impl Iterator<Item = &'a str> + Clone) -> bool {
    let has = |wanted: &str| found.clone().any(|n| names::standard(n) == Some(wanted));
    let x = found.clone().any(|n| n.eq_ignore_ascii_case("x"));
    (x || has(names::COORDINATES)) && has(names::MASSES)
}

/// Assembles `count` particles.
///
/// # Errors
/// Where arrays contradict each other: two of one meaning, wrong lengths, no coordinates.
pub fn particles(count: usize, arrays: Vec<Named>, facts: Facts) -> Result<ParticleFile, Problem> {
    for a in &arrays {
        if a.components == 0 || a.components.checked_mul(count) != Some(a.values.len()) {
            let problem = format!("has {} values for {count} particles", a.values.len());
            return Err((format!("array '{}'", a.name), problem));
        }
    }
    let mut arrays = renamed(count, arrays)?;
    let position = arrays.iter().find(|a| a.name == names::COORDINATES);
    let components = position.map(|a| a.components).ok_or_else(|| {
        ("coordinates".to_owned(), "there are none; expected x, y, z or an array Coordinates".to_owned())
    })?;
    let dimension = facts.dimension.unwrap_or(components).min(components);
    if !(1..=3).contains(&components) {
        return Err(("coordinates".into(), format!("have {components} components, expected 1 to 3")));
    }
    for a in &mut arrays {
        let vector = matches!(a.name.as_str(), names::COORDINATES | names::VELOCITIES);
        if vector && a.components < dimension {
            let problem = format!("has {} components, expected {dimension}", a.components);
            return Err((format!("array '{}'", a.name), problem));
        }
        if vector && a.components > dimension {
            a.values = first_components(&a.values, a.components, dimension);
            a.components = dimension;
        }
    }
    let units = facts.units.unwrap_or_else(|| stated_units(&arrays));
    let types = arrays.iter().position(|a| a.name == names::PARTICLE_TYPE).map(|i| arrays.remove(i).values);
    let columns: Vec<Column> = arrays.into_iter().map(|a| column(a, &units, dimension)).collect();
    let box_size = facts.box_size.unwrap_or_default();
    Ok(ParticleFile {
        header: RunHeader {
            dimension,
            box_size: std::array::from_fn(|k| if k < dimension { box_size[k] } else { 0.0 }),
            box_corner: facts.box_corner,
            periodic: facts.periodic.unwrap_or_default(),
            units,
            time: facts.time.unwrap_or(0.0),
            kernel: facts.kernel,
            kernel_neighbors: facts.kernel_neighbors,
            provenance: facts.provenance,
            layouts: Vec::new(),
        },
        species: split(count, columns, types.as_ref())?,
    })
}

/// Joins components and gives arrays their standard names.
fn renamed(count: usize, mut arrays: Vec<Named>) -> Result<Vec<Named>, Problem> {
    let mut joined = Vec::new();
    for (prefixes, name) in
        [(&["", "pos_", "pos"][..], names::COORDINATES), (&["v", "v_", "vel_", "velocity_"][..], names::VELOCITIES)]
    {
        let part = |arrays: &[Named], axis: &str| {
            let is = |a: &Named| prefixes.iter().any(|p| a.name.eq_ignore_ascii_case(&format!("{p}{axis}")));
            arrays.iter().position(|a| a.components == 1 && is(a))
        };
        let mut parts = Vec::new();
        for axis in AXES {
            match part(&arrays, axis) {
                Some(i) => parts.push(arrays.remove(i)),
                None => break,
            }
        }
        joined.extend(join(count, name, &parts));
    }
    for mut a in arrays {
        a.name = names::standard(&a.name).map_or(a.name, str::to_owned);
        if matches!(a.name.as_str(), names::PARTICLE_IDS | names::MATERIAL_IDS | names::PARTICLE_TYPE) {
            a.values = whole(a.values);
        }
        joined.push(a);
    }
    for (i, a) in joined.iter().enumerate() {
        if joined.iter().take(i).any(|b| b.name == a.name) {
            return Err((format!("array '{}'", a.name), "two arrays mean the same; remove one".into()));
        }
    }
    Ok(joined)
}

fn join(count: usize, name: &str, parts: &[Named]) -> Option<Named> {
    let first = parts.first()?;
    // Components in different units are brought to that of the first.
    let factor = |p: &Named| match (&p.unit, &first.unit) {
        (Some(own), Some(unit)) if own.dimension == unit.dimension => ratio(own.to_cgs, unit.to_cgs),
        _ => 1.0,
    };
    let factors: Vec<f64> = parts.iter().map(factor).collect();
    let rows = || (0..count).flat_map(|i| parts.iter().zip(&factors).map(move |(p, f)| p.values.get(i) * f));
    let single = parts.iter().all(|p| matches!(p.values, Values::F32(_)));
    let values = if single { Values::F32(rows().map(|v| v as f32).collect()) } else { Values::F64(rows().collect()) };
    Some(Named { name: name.into(), components: parts.len(), values, unit: first.unit.clone() })
}

/// Integers where all values are whole and exact.
fn whole(values: Values) -> Values {
    let exact = |v: f64| v.fract() == 0.0 && v.abs() <= 9_007_199_254_740_992.0;
    match &values {
        Values::I64(_) => values,
        v if (0..v.len()).all(|i| exact(v.get(i))) => Values::I64((0..v.len()).map(|i| v.get(i) as i64).collect()),
        _ => values,
    }
}

fn first_components(values: &Values, from: usize, to: usize) -> Values {
    fn take<T: Copy>(v: &[T], from: usize, to: usize) -> Vec<T> {
        v.chunks_exact(from).flat_map(|row| row.iter().take(to).copied()).collect()
    }
    match values {
        Values::F32(v) => Values::F32(take(v, from, to)),
        Values::F64(v) => Values::F64(take(v, from, to)),
        Values::I64(v) => Values::I64(take(v, from, to)),
    }
}

/// 1 where two factors agree but for rounding, so that numbers stay as they are.
fn ratio(a: f64, b: f64) -> f64 {
    let r = a / b;
    if (r - 1.0).abs() < 1e-12 || !r.is_finite() { 1.0 } else { r }
}

fn stated_units(arrays: &[Named]) -> UnitSystem {
    let stated = |name: &str, dimension: UnitDimension| {
        let unit = arrays.iter().find(|a| a.name == name)?.unit.as_ref()?;
        (unit.dimension == dimension).then_some(unit.to_cgs)
    };
    let length = stated(names::COORDINATES, UnitDimension::LENGTH).unwrap_or(1.0);
    let mass = stated(names::MASSES, UnitDimension::MASS).unwrap_or(1.0);
    let energy = stated(names::INTERNAL_ENERGY, UnitDimension::SPECIFIC_ENERGY).map(f64::sqrt);
    let velocity = stated(names::VELOCITIES, UnitDimension::VELOCITY).or(energy);
    UnitSystem { length, mass, time: velocity.map_or(1.0, |v| length / v), temperature: 1.0 }
}

fn column(a: Named, units: &UnitSystem, dimension: usize) -> Column {
    let Some(unit) = &a.unit else {
        let dimension = names::meaning(&a.name, dimension);
        return Column { name: a.name, components: a.components, values: a.values, dimension };
    };
    let factor = ratio(unit.to_cgs, units.to_cgs(unit.dimension));
    let values = match a.values {
        values if factor == 1.0 => values,
        values => Values::F64((0..values.len()).map(|i| values.get(i) * factor).collect()),
    };
    Column { name: a.name, components: a.components, values, dimension: unit.dimension }
}

/// One species per type, without the columns that it has no numbers in.
fn split(count: usize, columns: Vec<Column>, types: Option<&Values>) -> Result<Vec<Species>, Problem> {
    let Some(types) = types else {
        return Ok(vec![Species { part_type: 0, table: ParticleTable { count, columns } }]);
    };
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); 6];
    for i in 0..count {
        let t = types.get(i);
        let slot = if t.fract() == 0.0 && t >= 0.0 { rows.get_mut(t as usize) } else { None };
        match slot {
            Some(slot) => slot.push(i),
            None => {
                return Err((
                    format!("array '{}'", names::PARTICLE_TYPE),
                    format!("value {i} is {t}, expected 0 to 5"),
                ));
            }
        }
    }
    let mut species = Vec::new();
    for (t, rows) in rows.iter().enumerate().filter(|(_, rows)| !rows.is_empty()) {
        let all_missing = |c: &Column| (0..c.values.len()).all(|i| c.values.get(i).is_nan());
        let columns = columns.iter().map(|c| Column { values: selected(c, rows), ..c.clone() });
        let table = ParticleTable { count: rows.len(), columns: columns.filter(|c| !all_missing(c)).collect() };
        species.push(Species { part_type: t as u8, table });
    }
    Ok(species)
}

fn selected(c: &Column, rows: &[usize]) -> Values {
    let flat = || rows.iter().flat_map(|&i| (0..c.components).map(move |k| i * c.components + k));
    let values = match &c.values {
        Values::F32(v) => Values::F32(flat().filter_map(|i| v.get(i).copied()).collect()),
        Values::F64(v) => Values::F64(flat().filter_map(|i| v.get(i).copied()).collect()),
        Values::I64(v) => Values::I64(flat().filter_map(|i| v.get(i).copied()).collect()),
    };
    if matches!(c.name.as_str(), names::PARTICLE_IDS | names::MATERIAL_IDS) { whole(values) } else { values }
}
