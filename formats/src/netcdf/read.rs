//! Reads a NetCDF file into a raw field.

use super::axes::{Axis, Role, axes_of, text, unit};
use crate::error::{FormatError, Result};
use crate::limits::{MAX_EXPANSION, MAX_VARIABLE_BYTES};
use crate::model::{Coordinates, Geometry, GridAxis, Location, RawField, Values, Variable};
use crate::registry::{FieldRequest, FileContent};
use netcdf_reader::{NcAttrValue, NcFile, NcSliceInfo, NcSliceInfoElem, NcType, NcVariable};
use std::path::Path;

const FORMAT: &str = "netcdf";

pub(super) fn read(path: &Path, request: &FieldRequest) -> Result<FileContent> {
    let bytes = std::fs::metadata(path).map_err(|e| FormatError::io(path, "read", e))?.len();
    let file =
        NcFile::open(path).map_err(|e| FormatError::input(path, FORMAT, "file", format!("no readable NetCDF: {e}")))?;
    Reader { path, file, bytes, request, notes: Vec::new() }.field().map(FileContent::Field)
}

struct Reader<'a> {
    path: &'a Path,
    file: NcFile,
    bytes: u64,
    request: &'a FieldRequest,
    notes: Vec<String>,
}

/// How the data of a variable is brought from the file's order into ours.
struct Layout {
    /// Selected record of each file axis, or `None` for all of it.
    fixed: Vec<Option<u64>>,
    /// Lengths of the axes that are kept, in the file's order.
    shape: Vec<usize>,
    /// Which kept axis runs as our axis 0 (fastest), 1, 2.
    order: Vec<usize>,
    /// Whether a kept axis descends.
    flipped: Vec<bool>,
}

impl Reader<'_> {
    fn wrong(&self, location: impl Into<String>, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, FORMAT, location, problem)
    }

    fn field(mut self) -> Result<RawField> {
        let variables = self.file.variables().map_err(|e| self.wrong("header", e.to_string()))?.to_vec();
        let candidates: Vec<&NcVariable> = variables.iter().filter(|v| is_data(v, &variables)).collect();
        let density = self.density(&candidates)?;
        let reference = match density {
            Some(v) => v,
            None => *candidates
                .iter()
                .max_by_key(|v| v.dimensions.len())
                .ok_or_else(|| self.wrong("variables", "there are none with numbers over at least one axis"))?,
        };
        let axes = axes_of(&self.file, reference).map_err(|(name, e)| self.wrong(format!("variable '{name}'"), e))?;
        let (layout, kept) = self.layout(&axes)?;
        let geometry = self.geometry(kept, &layout)?;
        let mut read = Vec::new();
        let mut aside = Vec::new();
        for v in candidates {
            let same = v.dimensions.iter().map(|d| &d.name).eq(reference.dimensions.iter().map(|d| &d.name));
            let is_reference = v.name == reference.name;
            let wanted = self.request.carry.as_ref().is_none_or(|names| names.contains(&v.name));
            if same && (is_reference || wanted) {
                read.push(self.variable(v, &layout)?);
            } else if !same {
                aside.push(v.name.as_str());
            }
        }
        if !aside.is_empty() {
            self.notes.push(format!(
                "variables on other axes than '{}' are left aside: {}",
                reference.name,
                aside.join(", ")
            ));
        }
        let attributes = self.file.global_attributes().map(<[_]>::to_vec).unwrap_or_default();
        Ok(RawField {
            path: self.path.into(),
            format: FORMAT,
            geometry,
            variables: read,
            density: density.map(|v| v.name.clone()),
            metadata: attributes.iter().filter_map(|a| a.value.as_string().map(|v| (a.name.clone(), v))).collect(),
            notes: self.notes,
        })
    }

    /// The variable that is the density, where that can be told.
    fn density<'v>(&mut self, candidates: &[&'v NcVariable]) -> Result<Option<&'v NcVariable>> {
        if let Some(name) = &self.request.density {
            return candidates.iter().find(|v| v.name == *name).copied().map(Some).ok_or_else(|| {
                let known: Vec<_> = candidates.iter().map(|v| v.name.as_str()).collect();
                self.wrong(format!("variable '{name}'"), format!("is not in the file; it has {}", known.join(", ")))
            });
        }
        const NAMES: [&str; 5] = ["density", "rho", "dens", "mass_density", "rho_gas"];
        if let Some(v) = candidates.iter().find(|v| NAMES.contains(&v.name.to_ascii_lowercase().as_str())) {
            return Ok(Some(v));
        }
        let described = |v: &&&NcVariable| {
            ["standard_name", "long_name", "display_name"]
                .iter()
                .any(|a| text(v, a).is_some_and(|t| t.to_ascii_lowercase().contains("density")))
        };
        let by_text: Vec<_> = candidates.iter().filter(described).collect();
        match (by_text.as_slice(), candidates) {
            ([one], _) => Ok(Some(**one)),
            (_, [one]) => {
                self.notes.push(format!("'{}' is taken for the density, being the only variable", one.name));
                Ok(Some(*one))
            }
            _ => Ok(None),
        }
    }

    /// Cuts the time axis, drops axes of length 1 and finds the order of the others.
    fn layout(&mut self, axes: &[Axis]) -> Result<(Layout, Vec<Axis>)> {
        let mut fixed = vec![None; axes.len()];
        let mut kept: Vec<Axis> = Vec::new();
        for (slot, axis) in fixed.iter_mut().zip(axes) {
            if axis.nodes.is_empty() {
                return Err(self.wrong(format!("axis '{}'", axis.name), "is empty"));
            }
            if axis.role == Role::Time {
                *slot = Some(self.record(axis)?);
            } else if axis.nodes.len() == 1 {
                *slot = Some(0);
                self.notes.push(format!("axis '{}' has one node and is dropped", axis.name));
            } else {
                kept.push(axis.clone());
            }
        }
        if kept.is_empty() || kept.len() > 3 {
            return Err(self.wrong("axes", format!("{} of them have more than one node, expected 1 to 3", kept.len())));
        }
        let order = self.order(&kept)?;
        let radial = kept.len() == 1 && kept[0].role == Role::Radius;
        let mut flipped = Vec::new();
        for axis in &mut kept {
            flipped.push(self.ascend(axis, radial)?);
        }
        let shape = kept.iter().map(|a| a.nodes.len()).collect();
        let ours = order.iter().map(|&k| kept[k].clone()).collect();
        Ok((Layout { fixed, shape, order, flipped }, ours))
    }

    /// The record of a time axis.
    fn record(&mut self, axis: &Axis) -> Result<u64> {
        let first = axis.nodes[0];
        let last = axis.nodes[axis.nodes.len() - 1];
        let Some(time) = self.request.time else {
            return if axis.nodes.len() == 1 {
                Ok(0)
            } else {
                Err(self.wrong(
                    format!("axis '{}'", axis.name),
                    format!("has {} records from {first} to {last}; choose one with --time", axis.nodes.len()),
                ))
            };
        };
        let distance = |i: &usize| (axis.nodes[*i] - time).abs();
        let nearest = (0..axis.nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        self.notes.push(format!(
            "record {nearest} of {} is read, {} = {} (asked for {time})",
            axis.nodes.len(),
            axis.name,
            axis.nodes[nearest]
        ));
        Ok(nearest as u64)
    }

    /// Which kept axis is our first (x, longitude, radius), second and third.
    fn order(&self, kept: &[Axis]) -> Result<Vec<usize>> {
        use Role::{Latitude, Longitude, Radius, Unknown, Vertical, X, Y, Z};
        let roles: Vec<Role> = kept.iter().map(|a| a.role).collect();
        let has = |r: Role| roles.contains(&r);
        if has(Longitude) || has(Latitude) {
            let wanted = [Longitude, Latitude, Radius];
            if roles.len() == 3 && wanted.iter().all(|&r| has(r)) {
                return Ok(wanted.iter().filter_map(|w| roles.iter().position(|r| r == w)).collect());
            }
            let vertical = kept.iter().find(|a| a.role == Vertical || a.role == Z);
            let why = match vertical {
                Some(axis) => format!(
                    "axis '{}' is a depth or height on a globe whose radius the file does not state; give the vertical as a radius",
                    axis.name
                ),
                None => "a field over longitude and latitude alone lies on a surface and fills no volume".into(),
            };
            return Err(FormatError::Unsupported { path: self.path.into(), format: FORMAT, what: why });
        }
        if has(Radius) && roles.len() > 1 {
            return Err(FormatError::Unsupported {
                path: self.path.into(),
                format: FORMAT,
                what: "a radius together with other axes than longitude and latitude".into(),
            });
        }
        // Named axes in their order; an unnamed one takes the place that its position in the file suggests.
        let rank = |k: &usize| match kept[*k].role {
            X => 0,
            Y => 1,
            Z | Vertical => 2,
            Unknown | _ => kept.len() - 1 - k,
        };
        let mut order: Vec<usize> = (0..kept.len()).rev().collect();
        order.sort_by_key(rank);
        Ok(order)
    }

    /// Turns a descending axis round. A radius may repeat (a jump), other axes may not.
    fn ascend(&self, axis: &mut Axis, radial: bool) -> Result<bool> {
        let nodes = &mut axis.nodes;
        let location = || format!("axis '{}'", axis.name);
        if let Some(i) = nodes.iter().position(|v| !v.is_finite()) {
            return Err(self.wrong(location(), format!("value {i} is missing or not finite")));
        }
        let flip = nodes[0] > nodes[nodes.len() - 1];
        if flip {
            nodes.reverse();
        }
        let bad = |w: &[f64]| if radial { w[0] > w[1] } else { w[0] >= w[1] };
        if let Some(i) = nodes.windows(2).position(bad) {
            let index = if flip { nodes.len() - 1 - i } else { i + 1 };
            return Err(self.wrong(
                location(),
                format!("is not strictly monotonic at index {index}: {} beside {}", nodes[i], nodes[i + 1]),
            ));
        }
        Ok(flip)
    }

    fn geometry(&mut self, mut axes: Vec<Axis>, layout: &Layout) -> Result<Geometry> {
        let unnamed: Vec<_> = axes.iter().filter(|a| a.indexed).map(|a| a.name.clone()).collect();
        if !unnamed.is_empty() {
            self.notes.push(format!("no coordinates for {}: indices 0, 1, 2 ... are taken", unnamed.join(", ")));
        }
        if let [axis] = axes.as_slice() {
            if axis.role == Role::Radius {
                let axis = axes.remove(0);
                return Ok(Geometry::Radial { nodes: axis.nodes, unit: axis.unit });
            }
        }
        let globe = axes.iter().any(|a| a.role == Role::Longitude);
        let mut out = Vec::new();
        for (axis, &k) in axes.into_iter().zip(&layout.order) {
            let bounds = match &axis.bounds {
                Some(name) => self.bounds(name, axis.nodes.len(), layout.flipped[k]),
                None => None,
            };
            out.push(GridAxis { name: axis.name, nodes: axis.nodes, unit: axis.unit, bounds });
        }
        let coordinates = if globe { Coordinates::Geographic } else { Coordinates::Cartesian };
        Ok(Geometry::Grid { coordinates, axes: out })
    }

    /// Cell edges from a CF bounds variable of shape (n, 2), where they join without gaps.
    fn bounds(&mut self, name: &str, n: usize, flipped: bool) -> Option<Vec<f64>> {
        let pairs: Vec<f64> = self.file.read_variable_unpacked_masked(name).ok()?.into_iter().collect();
        if pairs.len() != 2 * n {
            return None;
        }
        let mut cells: Vec<(f64, f64)> = pairs.chunks(2).map(|p| (p[0].min(p[1]), p[0].max(p[1]))).collect();
        if flipped {
            cells.reverse();
        }
        let scale = cells.last()?.1 - cells.first()?.0;
        let joined = cells.windows(2).all(|w| (w[0].1 - w[1].0).abs() <= 1e-6 * scale.abs());
        if !joined {
            self.notes.push(format!("bounds '{name}' leave gaps or overlap and are not used"));
            return None;
        }
        let mut edges: Vec<f64> = cells.iter().map(|c| c.0).collect();
        edges.push(cells.last()?.1);
        Some(edges)
    }

    fn variable(&mut self, v: &NcVariable, layout: &Layout) -> Result<Variable> {
        let count: u64 = layout.shape.iter().map(|&n| n as u64).product();
        let width = v.dtype.size().unwrap_or(8) as u64;
        let declared = count.saturating_mul(width.max(4));
        if declared > MAX_VARIABLE_BYTES || declared > self.bytes.saturating_mul(MAX_EXPANSION) {
            return Err(FormatError::Limit {
                path: self.path.into(),
                format: FORMAT,
                location: format!("variable '{}'", v.name),
                declared: format!("{declared} bytes"),
                allowed: format!("a file of {} bytes can hold", self.bytes),
            });
        }
        let selections = layout
            .fixed
            .iter()
            .map(|f| match f {
                Some(i) => NcSliceInfoElem::Index(*i),
                None => NcSliceInfoElem::Slice { start: 0, end: u64::MAX, step: 1 },
            })
            .collect();
        let selection = NcSliceInfo { selections };
        let broken =
            |e: netcdf_reader::Error| self.wrong(format!("variable '{}'", v.name), format!("cannot be read: {e}"));
        let packed = v.attribute("scale_factor").is_some() || v.attribute("add_offset").is_some();
        let values = if v.dtype == NcType::Float && !packed {
            let mut raw: Vec<f32> =
                self.file.read_variable_slice::<f32>(&v.name, &selection).map_err(broken)?.into_iter().collect();
            mask(&mut raw, v);
            Values::F32(layout.arrange(raw))
        } else {
            let raw: Vec<f64> = self
                .file
                .read_variable_slice_unpacked_masked(&v.name, &selection)
                .map_err(broken)?
                .into_iter()
                .collect();
            Values::F64(layout.arrange(raw))
        };
        let missing = values.range().2;
        if missing > 0 {
            self.notes.push(format!("'{}' has {missing} of {count} values missing", v.name));
        }
        let description = ["long_name", "standard_name", "display_name"].iter().find_map(|a| text(v, a));
        Ok(Variable {
            name: v.name.clone(),
            description,
            unit: unit(v),
            location: Location::Node,
            components: 1,
            values,
        })
    }
}

/// Whether a variable holds data: numbers over axes, and neither coordinates nor their bounds.
fn is_data(v: &NcVariable, all: &[NcVariable]) -> bool {
    let numeric = !matches!(v.dtype, NcType::Char | NcType::String) && v.dtype.is_primitive();
    let coordinate = v.dimensions.len() == 1 && v.dimensions[0].name == v.name;
    let bounds = all.iter().any(|c| text(c, "bounds").is_some_and(|b| b == v.name));
    numeric && !coordinate && !bounds && !v.dimensions.is_empty()
}

/// Missing values of unpacked f32 data become NaN.
fn mask(values: &mut [f32], v: &NcVariable) {
    /// What the library fills floats with where nothing is said (`NC_FILL_FLOAT`).
    const DEFAULT_FILL: f32 = 9.969_21e36;
    let number = |name: &str| v.attribute(name).and_then(|a| numbers(&a.value));
    let mut fills: Vec<f32> =
        ["_FillValue", "missing_value"].iter().filter_map(|name| number(name)).flatten().map(|f| f as f32).collect();
    if v.attribute("_FillValue").is_none() {
        fills.push(DEFAULT_FILL);
    }
    let range = number("valid_range").filter(|r| r.len() == 2);
    let lo = number("valid_min").and_then(|n| n.first().copied()).or(range.as_ref().map(|r| r[0]));
    let hi = number("valid_max").and_then(|n| n.first().copied()).or(range.as_ref().map(|r| r[1]));
    for x in values {
        let wide = f64::from(*x);
        if fills.contains(x) || lo.is_some_and(|l| wide < l) || hi.is_some_and(|h| wide > h) {
            *x = f32::NAN;
        }
    }
}

fn numbers(value: &NcAttrValue) -> Option<Vec<f64>> {
    value.as_f64_vec()
}

impl Layout {
    /// From the file's order (last kept axis fastest) into ours (first axis fastest, ascending).
    fn arrange<T: Copy>(&self, raw: Vec<T>) -> Vec<T> {
        let n = self.shape.len();
        let in_order = self.order.iter().copied().eq((0..n).rev());
        if in_order && !self.flipped.contains(&true) {
            return raw;
        }
        let mut strides = vec![1_usize; n];
        for k in (0..n.saturating_sub(1)).rev() {
            strides[k] = strides[k + 1] * self.shape[k + 1];
        }
        let mut out = Vec::with_capacity(raw.len());
        let mut index = vec![0_usize; n];
        for _ in 0..raw.len() {
            let at: usize = self
                .order
                .iter()
                .zip(&index)
                .map(|(&k, &i)| strides[k] * if self.flipped[k] { self.shape[k] - 1 - i } else { i })
                .sum();
            out.push(raw[at]);
            for (slot, &k) in index.iter_mut().zip(&self.order) {
                *slot += 1;
                if *slot < self.shape[k] {
                    break;
                }
                *slot = 0;
            }
        }
        out
    }
}
