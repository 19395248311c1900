//! Reads cases and the code's outputs.

use super::binary::{Array, Item, Source};
use super::schema::{NAME, NORMALS, OWN_ITEM, SUPPORT, SURFACE_DISTANCE, UNIT, UNKNOWN_AXES, WALLS, slot};
use crate::common::assemble::{self, Named};
use crate::common::facts::Facts;
use crate::error::{FormatError, Result};
use crate::model::{Values, adiabatic_fact};
use crate::particle_names as names;
use crate::registry::{FieldRequest, FileContent};
use crate::units::{Unit, UnitDimension, UnitSystem};
use std::path::Path;

/// The code's arrays.
const OF_CODE: [&str; 7] = ["Idp", "Idpd", "Pos", "Posd", "Vel", "Rhop", "BoundNor"];

pub(super) fn read(path: &Path, _: &FieldRequest) -> Result<FileContent> {
    let (source, root) = Source::open(path)?;
    if root.number("Npiece").is_some_and(|n| n != 1.0) {
        let what = "particles in several files (Npiece), as runs on several machines write them";
        return Err(FormatError::Unsupported { path: path.into(), format: NAME, what: what.into() });
    }
    let part = root.items.iter().find(|item| item.name.starts_with("PART_"));
    let Some(part) = part.filter(|part| part.array("Idp").or(part.array("Idpd")).is_some()) else {
        return Err(
            source.error("items", "none of them has particles: an item 'PART_0000' with arrays 'Idp' and 'Posd'")
        );
    };
    let dimension = if root.number("Data2d").is_some_and(|is| is != 0.0) { 2 } else { 3 };
    let mut case = Case { source, root: &root, part, dimension, count: 0 };
    let mut named = case.arrays()?;
    let facts = case.facts();
    let units = facts.units.unwrap_or(UnitSystem::CODE);
    for array in &mut named {
        array.unit = case.unit(&array.name, &units);
    }
    let file = assemble::particles(case.count, named, facts);
    file.map(FileContent::Particles).map_err(|(at, problem)| FormatError::input(path, NAME, at, problem))
}

struct Case<'a> {
    source: Source<'a>,
    root: &'a Item,
    part: &'a Item,
    dimension: usize,
    count: usize,
}

impl Case<'_> {
    /// A number of the header that is more than 0.
    fn positive(&self, name: &str) -> Option<f64> {
        self.root.number(name).filter(|v| v.is_finite() && *v > 0.0)
    }

    /// Scalars, or vectors along the axes that there are.
    fn numbers(&mut self, array: &Array) -> Result<(usize, Values)> {
        let slots: Vec<usize> = match array.components {
            1 => vec![0],
            _ => (0..self.dimension).map(|axis| slot(axis, self.dimension)).collect(),
        };
        Ok((slots.len(), self.source.numbers(array, &slots)?))
    }

    /// One of the code's arrays: the first of these names.
    fn needed(&mut self, wanted: &[&str], components: usize) -> Result<Values> {
        let part = self.part;
        let Some(array) = wanted.iter().find_map(|name| part.array(name)) else {
            return Err(self.source.error(&format!("array '{}'", wanted[0]), "is missing, which every file has"));
        };
        let location = format!("array '{}'", array.name);
        if array.components != components || array.kind.width() == 0 {
            let problem = format!("is of another kind, expected {components} number(s) for each particle");
            return Err(self.source.error(&location, problem));
        }
        if array.count != self.count as u64 {
            let problem = format!("has {} rows for {} particles", array.count, self.count);
            return Err(self.source.error(&location, problem));
        }
        Ok(self.numbers(array)?.1)
    }

    fn arrays(&mut self) -> Result<Vec<Named>> {
        let part = self.part;
        let ids = part.array("Idp").or(part.array("Idpd"));
        self.count = ids.map_or(0, |a| a.count as usize);
        let ids = self.needed(&["Idp", "Idpd"], 1)?;
        let walls = self.walls(&ids)?;
        let is_wall = |i: usize| ids.get(i) < walls as f64;
        let mut named = vec![
            array(names::COORDINATES, self.dimension, self.needed(&["Posd", "Pos"], 3)?),
            array(names::MASSES, 1, self.masses(&is_wall)?),
        ];
        if (0..self.count).any(is_wall) {
            let types = (0..self.count).map(|i| if is_wall(i) { i64::from(WALLS) } else { 0 }).collect();
            named.push(array(names::PARTICLE_TYPE, 1, Values::I64(types)));
        }
        named.extend(self.surface(&ids, walls)?);
        for other in part.arrays.iter().filter(|a| !OF_CODE.contains(&a.name.as_str())) {
            let is_known = named.iter().any(|n: &Named| n.name == other.name);
            if other.count == self.count as u64 && !is_known && other.kind.width() > 0 {
                let (components, values) = self.numbers(other)?;
                named.push(array(&other.name, components, values));
            }
        }
        let has = |named: &[Named], name: &str| named.iter().any(|n| names::standard(&n.name) == Some(name));
        if !has(&named, names::VELOCITIES) {
            named.push(array(names::VELOCITIES, self.dimension, self.needed(&["Vel"], 3)?));
        }
        let densities = self.needed(&["Rhop"], 1)?;
        if !has(&named, names::PRESSURE) {
            named.extend(self.pressures(&densities, &is_wall).map(|p| array(names::PRESSURE, 1, p)));
        }
        if !has(&named, names::DENSITY) {
            named.push(array(names::DENSITY, 1, densities));
        }
        if !has(&named, names::PARTICLE_IDS) {
            named.push(array(names::PARTICLE_IDS, 1, ids));
        }
        if let Some(h) = self.positive("H").filter(|_| !has(&named, names::SUPPORT_RADIUS)) {
            named.push(array(names::SUPPORT_RADIUS, 1, Values::F64(vec![SUPPORT * h; self.count])));
        }
        Ok(named)
    }

    /// What an array is measured in, where its name alone does not say it: particles of a plane are of a unit's length across it.
    fn unit(&self, name: &str, units: &UnitSystem) -> Option<Unit> {
        let own = self.own().and_then(|own| own.text(&format!("{UNIT}{name}"))).and_then(Unit::parse);
        let dimension = match names::standard(name) {
            Some(names::MASSES) => UnitDimension::new(self.dimension as i8 - 3, 1, 0, 0),
            Some(names::DENSITY) => UnitDimension::mass_density(3),
            Some(names::PRESSURE) => UnitDimension::PRESSURE,
            _ => return own,
        };
        own.or_else(|| Some(units.unit(dimension)))
    }

    fn own(&self) -> Option<&Item> {
        self.root.items.iter().find(|item| item.name == OWN_ITEM)
    }

    /// How many numbers from 0 on are of particles of walls.
    fn walls(&self, ids: &Values) -> Result<u64> {
        let count = |name: &str| self.root.number(name).filter(|n| *n >= 0.0).unwrap_or(0.0) as u64;
        let [fixed, moving, floating] = ["CaseNfixed", "CaseNmoving", "CaseNfloat"].map(count);
        let walls = fixed.saturating_add(moving).saturating_add(floating);
        if ids.range().0 < 0.0 && !ids.is_empty() {
            return Err(self.source.error("array 'Idp'", "has negative numbers"));
        }
        Ok(walls)
    }

    fn masses(&self, is_wall: &dyn Fn(usize) -> bool) -> Result<Values> {
        let fluid = self.positive("MassFluid");
        let Some(fluid) = fluid else {
            return Err(self
                .source
                .error("value 'MassFluid'", "is missing or not positive; it is the mass of a particle"));
        };
        let wall = self.positive("MassBound").unwrap_or(fluid);
        Ok(Values::F64((0..self.count).map(|i| if is_wall(i) { wall } else { fluid }).collect()))
    }

    /// By Tait's equation, where the header has its constants: of the fluid alone, as the code's own walls have none that means something.
    fn pressures(&self, densities: &Values, is_wall: &dyn Fn(usize) -> bool) -> Option<Values> {
        let [stiffness, density, gamma] = [self.positive("B")?, self.positive("Rhop0")?, self.positive("Gamma")?];
        let pressure = |i: usize| stiffness * ((densities.get(i) / density).powf(gamma) - 1.0);
        let values = (0..self.count).map(|i| if is_wall(i) { f64::NAN } else { pressure(i) });
        Some(Values::F64(values.collect()))
    }

    /// Unit normals and distances of the surface, of the walls' particles in the order of their numbers.
    fn surface(&mut self, ids: &Values, walls: u64) -> Result<Vec<Named>> {
        let part = self.part;
        let fits = |a: &&Array| a.count == walls && walls > 0 && a.components == 3;
        let Some(found) = part.array("BoundNor").filter(fits) else { return Ok(Vec::new()) };
        let (d, values) = self.numbers(found)?;
        let (mut normals, mut distances) = (Vec::with_capacity(d * self.count), Vec::with_capacity(self.count));
        for i in 0..self.count {
            let id = ids.get(i) as usize;
            let row: Vec<f64> = match (id as u64) < walls {
                true => (0..d).map(|k| values.get(d * id + k)).collect(),
                false => vec![f64::NAN; d],
            };
            let distance = row.iter().map(|v| v * v).sum::<f64>().sqrt();
            distances.push(distance);
            normals.extend(row.iter().map(|v| if distance > 0.0 { v / distance } else { *v }));
        }
        Ok(vec![array(NORMALS, d, Values::F64(normals)), array(SURFACE_DISTANCE, 1, Values::F64(distances))])
    }

    /// Ours where they are there. The code's files state no units, which are SI.
    fn facts(&self) -> Facts {
        if let Some(own) = self.own() {
            let texts = own.values.iter().filter_map(|(key, _)| Some((key.as_str(), own.text(key)?)));
            return Facts { dimension: Some(self.dimension), ..Facts::new(texts) };
        }
        let d = self.dimension;
        let axes = self.root.number("PeriMode").map_or(0, |v| v as i64);
        let axes = if axes == UNKNOWN_AXES { 0 } else { axes };
        let limits = |low: &str, high: &str| {
            let (low, high) = (self.root.triple(low)?, self.root.triple(high)?);
            let is_box = |k: usize| high[k] > low[k] && (high[k] - low[k]).is_finite();
            (0..d).all(|axis| is_box(slot(axis, d))).then_some((low, high))
        };
        let limits = limits("MapPosMin", "MapPosMax").or_else(|| limits("CasePosMin", "CasePosMax"));
        let along = |f: &dyn Fn(usize) -> f64| std::array::from_fn(|k| if k < d { f(slot(k, d)) } else { 0.0 });
        let mut provenance = Vec::new();
        provenance.extend(self.root.text("AppName").map(|name| ("Code".to_owned(), name.to_owned())));
        provenance.extend(self.positive("Gamma").and_then(adiabatic_fact));
        Facts {
            dimension: Some(d),
            box_size: limits.map(|(low, high)| along(&|k| high[k] - low[k])),
            box_corner: limits.map(|(low, _)| along(&|k| low[k])),
            periodic: Some(std::array::from_fn(|k| k < d && axes >> slot(k, d) & 1 == 1)),
            units: Some(UnitSystem::si()),
            time: self.part.number("TimeStep").filter(|t| t.is_finite()),
            provenance,
            ..Facts::default()
        }
    }
}

fn array(name: &str, components: usize, values: Values) -> Named {
    Named { name: name.into(), components, values, unit: None }
}
