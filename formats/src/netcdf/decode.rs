//! Numbers of a variable: one record, masked, unpacked, and put into the order of the grid.
//!
//! Masked are values equal to `_FillValue` or `missing_value`, or outside `valid_min`, `valid_max` or
//! `valid_range`, all compared as stored; without `_FillValue`, the library's default fill value of the type,
//! except for bytes. Integers with the attribute `_Unsigned` = `true` are taken as unsigned before all else. Then
//! value = stored * `scale_factor` + `add_offset`, in f64. Packed and integer variables become f64; plain f32
//! stays f32.

use super::file::File;
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::limits::{MAX_EXPANSION, MAX_VARIABLE_BYTES};
use crate::model::Values;
use netcdf_reader::{NcSliceInfo, NcSliceInfoElem, NcType, NcVariable};

/// Of numbers in f64, what is read at once: it stays in the processor's cache, and in memory that has been used before.
const PART_BYTES: u64 = 1 << 17;
/// Numbers that mean a missing value, of which a file rarely has more, compared without a branch.
const FEW: usize = 4;

/// What the library puts where nothing was written (`NC_FILL_FLOAT` and its like).
fn default_fill(dtype: &NcType) -> Option<f64> {
    Some(match dtype {
        NcType::Float | NcType::Double => f64::from(9.969_21e36_f32),
        NcType::Short => -32_767.0,
        NcType::UShort => 65_535.0,
        NcType::Int => -2_147_483_647.0,
        NcType::UInt => 4_294_967_295.0,
        // In f64 like the values that it is compared with.
        NcType::Int64 => -9_223_372_036_854_775_806_i64 as f64,
        NcType::UInt64 => 18_446_744_073_709_551_614_u64 as f64,
        _ => return None,
    })
}

/// 2^bits for signed integers that the attribute `_Unsigned` declares unsigned, else 0.
fn wrap(variable: &NcVariable) -> f64 {
    let declared = variable.attribute("_Unsigned").and_then(|a| a.value.as_string());
    match variable.dtype() {
        _ if !declared.is_some_and(|text| text.trim().eq_ignore_ascii_case("true")) => 0.0,
        NcType::Byte => 256.0,
        NcType::Short => 65_536.0,
        NcType::Int => 4_294_967_296.0,
        _ => 0.0,
    }
}

fn unsigned(x: f64, wrap: f64) -> f64 {
    if x < 0.0 { x + wrap } else { x }
}

/// How stored numbers become values.
struct Packing {
    missing: Vec<f64>,
    valid: (f64, f64),
    scale: f64,
    offset: f64,
    /// Added to negative numbers: what a signed type of a file without unsigned ones is short of.
    wrap: f64,
}

impl Packing {
    fn of(variable: &NcVariable) -> Self {
        let wrap = wrap(variable);
        let numbers = |name: &str| {
            let found = variable.attribute(name).and_then(|a| a.value.as_f64_vec());
            found.unwrap_or_default().into_iter().map(|x| unsigned(x, wrap)).collect::<Vec<f64>>()
        };
        let factor = |name: &str| variable.attribute(name).and_then(|a| a.value.as_f64());
        let first = |name: &str| numbers(name).first().copied();
        let mut missing = numbers("_FillValue");
        if missing.is_empty() {
            missing.extend(default_fill(variable.dtype()).map(|x| unsigned(x, wrap)));
        }
        missing.extend(numbers("missing_value"));
        if *variable.dtype() == NcType::Float {
            // A fill value stated in f64 (1e20) means the f32 nearest to it.
            for x in &mut missing {
                *x = f64::from(*x as f32);
            }
        }
        if *variable.dtype() == NcType::Double {
            // One stated in f32 (1e20) means the decimal number as well, which in f64 is another.
            let decimal =
                |x: &f64| (x.is_finite() && f64::from(*x as f32) == *x).then(|| (*x as f32).to_string().parse().ok());
            let decimals: Vec<f64> = missing.iter().filter_map(decimal).flatten().collect();
            missing.extend(decimals.into_iter().filter(|x| !missing.contains(x)).collect::<Vec<_>>());
        }
        let range = numbers("valid_range");
        let limit = |name: &str, i: usize, open: f64| {
            let found = first(name).or_else(|| range.get(i).copied());
            found.filter(|x| !x.is_nan()).unwrap_or(open)
        };
        Self {
            missing,
            valid: (limit("valid_min", 0, f64::NEG_INFINITY), limit("valid_max", 1, f64::INFINITY)),
            scale: factor("scale_factor").unwrap_or(1.0),
            offset: factor("add_offset").unwrap_or(0.0),
            wrap,
        }
    }

    fn packed(&self) -> bool {
        self.scale != 1.0 || self.offset != 0.0
    }

    fn masked(&self, stored: f64) -> bool {
        stored.is_nan() || self.missing.contains(&stored) || stored < self.valid.0 || stored > self.valid.1
    }
}

/// Whether none of `values` is masked; false where each has to be looked at.
fn clean(packing: &Packing, values: &[f32]) -> bool {
    let mut missing = [f64::NAN; FEW];
    for (i, x) in packing.missing.iter().enumerate() {
        match missing.get_mut(i) {
            Some(place) => *place = *x,
            None => return false,
        }
    }
    let (low, high) = packing.valid;
    let fine = |x: f64| (x >= low) & (x <= high) & missing.iter().fold(true, |fine, m| fine & (x != *m));
    values.iter().fold(true, |all, x| all & fine(f64::from(*x)))
}

/// The numbers of an `ndarray` array in C order: taken over where they lie so, since a field may be a large part
/// of the memory. A macro, because the reader does not export the type of its arrays.
macro_rules! owned {
    ($array:expr) => {{
        let array = $array;
        let count = array.len();
        if array.is_standard_layout() {
            let (mut values, offset) = array.into_raw_vec_and_offset();
            values.drain(..offset.unwrap_or(0).min(values.len()));
            values.truncate(count);
            values
        } else {
            array.iter().copied().collect::<Vec<_>>()
        }
    }};
}

/// Values in the file's order, masked ones NaN, and how many those are.
pub struct Decoded {
    pub values: Values,
    pub masked: usize,
}

/// Whether the reader can make numbers of this type.
pub fn is_numeric(dtype: &NcType) -> bool {
    matches!(
        dtype,
        NcType::Byte
            | NcType::UByte
            | NcType::Short
            | NcType::UShort
            | NcType::Int
            | NcType::UInt
            | NcType::Int64
            | NcType::UInt64
            | NcType::Float
            | NcType::Double
    )
}

/// Reads a variable; `fixed` gives the index along each dimension that is not read as a whole.
///
/// # Errors
/// [`FormatError::Limit`] where the declared size cannot be, [`FormatError::Input`].
pub fn read(file: &File, variable: &NcVariable, fixed: &[Option<u64>]) -> Result<Decoded> {
    check_size(file, variable, fixed)?;
    let selections = selections(file, variable, fixed);
    let packing = Packing::of(variable);
    let name = variable.name();
    let fail = |e| file.damaged(&format!("variable '{name}'"), e);
    let mut masked = 0;
    let values = if *variable.dtype() == NcType::Float && !packing.packed() {
        let values = joined(&selections, |part| {
            let mut values = owned!(file.nc.read_variable_slice::<f32>(name, part).map_err(fail)?);
            if clean(&packing, &values) {
                return Ok(values);
            }
            for x in values.iter_mut().filter(|x| packing.masked(f64::from(**x))) {
                *x = f32::NAN;
                masked += 1;
            }
            Ok(values)
        });
        Values::F32(values?)
    } else {
        let values = joined(&selections, |part| {
            let mut values = owned!(file.nc.read_variable_slice_as_f64(name, part).map_err(fail)?);
            for x in &mut values {
                *x = unsigned(*x, packing.wrap);
                if packing.masked(*x) {
                    *x = f64::NAN;
                    masked += 1;
                } else {
                    *x = *x * packing.scale + packing.offset;
                }
            }
            Ok(values)
        });
        Values::F64(values?)
    };
    Ok(Decoded { values, masked })
}

/// The part of a variable to read, in pieces of about [`PART_BYTES`] that follow each other in the file, so that the bytes of a
/// large field are not all in memory beside its numbers; in one part where the file may be compressed, since a part could
/// begin within a chunk.
fn selections(file: &File, variable: &NcVariable, fixed: &[Option<u64>]) -> Vec<NcSliceInfo> {
    let select = |start, end| NcSliceInfoElem::Slice { start, end, step: 1 };
    let every = |index: &Option<u64>| index.map_or_else(|| select(0, u64::MAX), NcSliceInfoElem::Index);
    let mut parts = vec![NcSliceInfo { selections: fixed.iter().map(every).collect() }];
    if !file.is_classic() {
        return parts;
    }
    let lengths: Vec<u64> =
        variable.shape().iter().zip(fixed).map(|(&n, index)| if index.is_some() { 1 } else { n }).collect();
    for axis in (0..fixed.len()).filter(|&axis| fixed[axis].is_none()) {
        let row = lengths[axis + 1..].iter().fold(8u64, |bytes, &n| bytes.saturating_mul(n));
        let (length, step) = (lengths[axis], (PART_BYTES / row.max(1)).max(1));
        if step < length {
            let starts = || (0..length).step_by(usize::try_from(step).unwrap_or(usize::MAX));
            let cut = |part: &NcSliceInfo, start: u64| {
                let mut part = part.clone();
                part.selections[axis] = select(start, length.min(start.saturating_add(step)));
                part
            };
            parts = parts.iter().flat_map(|part| starts().map(move |start| cut(part, start))).collect();
        }
        if step > 1 {
            break;
        }
    }
    parts
}

/// The parts of a variable one after the other.
fn joined<T>(parts: &[NcSliceInfo], mut read: impl FnMut(&NcSliceInfo) -> Result<Vec<T>>) -> Result<Vec<T>> {
    let mut values = match parts {
        [whole] => return read(whole),
        _ => Vec::new(),
    };
    for (i, part) in parts.iter().enumerate() {
        let more = read(part)?;
        if i == 0 {
            values.reserve_exact(more.len() * parts.len());
        }
        values.extend(more);
    }
    Ok(values)
}

/// Integers as they are, all digits kept; `None` for numbers that are not plain integers.
///
/// # Errors
/// Those of [`read`].
pub fn integers(file: &File, variable: &NcVariable) -> Result<Option<Vec<i64>>> {
    let packing = Packing::of(variable);
    if packing.packed() || packing.wrap != 0.0 {
        return Ok(None);
    }
    check_size(file, variable, &[])?;
    let name = variable.name();
    let fail = |e| file.damaged(&format!("variable '{name}'"), e);
    Ok(match variable.dtype() {
        NcType::Int64 => Some(owned!(file.nc.read_variable::<i64>(name).map_err(fail)?)),
        NcType::Int => Some(widened(owned!(file.nc.read_variable::<i32>(name).map_err(fail)?))),
        NcType::UInt => Some(widened(owned!(file.nc.read_variable::<u32>(name).map_err(fail)?))),
        NcType::Short => Some(widened(owned!(file.nc.read_variable::<i16>(name).map_err(fail)?))),
        NcType::UShort => Some(widened(owned!(file.nc.read_variable::<u16>(name).map_err(fail)?))),
        NcType::Byte => Some(widened(owned!(file.nc.read_variable::<i8>(name).map_err(fail)?))),
        NcType::UByte => Some(widened(owned!(file.nc.read_variable::<u8>(name).map_err(fail)?))),
        _ => None,
    })
}

fn widened<T: Into<i64>>(values: Vec<T>) -> Vec<i64> {
    values.into_iter().map(Into::into).collect()
}

fn check_size(file: &File, variable: &NcVariable, fixed: &[Option<u64>]) -> Result<()> {
    let width = variable.dtype().size().unwrap_or(8) as u64;
    let shape = variable.shape();
    let count = shape.iter().fold(1u64, |n, &k| n.saturating_mul(k));
    let expansion = if file.is_classic() { 1 } else { MAX_EXPANSION };
    let allowed = file.bytes.saturating_mul(expansion).min(MAX_VARIABLE_BYTES);
    if count.saturating_mul(width) > allowed || count.saturating_mul(8) > MAX_VARIABLE_BYTES {
        return Err(FormatError::Limit {
            path: file.path.into(),
            format: NAME,
            location: format!("variable '{}'", variable.name()),
            declared: format!("{shape:?} values of {width} bytes"),
            allowed: format!("the {allowed} bytes that a file of {} can hold", file.bytes),
        });
    }
    // Of what is read, memory holds the numbers as stored and, where they are packed, as f64.
    let read = shape.iter().enumerate().map(|(i, &k)| if fixed.get(i).copied().flatten().is_some() { 1 } else { k });
    let read = read.fold(1u64, |n, k| n.saturating_mul(k));
    let bytes = read.saturating_mul(if *variable.dtype() == NcType::Float { 4 } else { 8 });
    file.budget.take(file.path, NAME, &format!("variable '{}'", variable.name()), bytes)
}

/// How the file's order becomes the grid's: for each axis of the grid, fastest first, its length, its stride
/// in the file, and whether it runs backward there.
pub struct Order(pub Vec<(usize, usize, bool)>);

impl Order {
    pub fn apply(&self, values: Values) -> Values {
        match values {
            Values::F32(v) => Values::F32(self.reorder(v)),
            Values::F64(v) => Values::F64(self.reorder(v)),
            Values::I64(v) => Values::I64(self.reorder(v)),
        }
    }

    /// Files in order already are passed through. Lengths multiply to `v.len()`.
    fn reorder<T: Copy>(&self, v: Vec<T>) -> Vec<T> {
        let mut expected = 1;
        let in_order = self.0.iter().all(|&(length, stride, backward)| {
            let fits = !backward && (stride == expected || length == 1);
            expected *= length;
            fits
        });
        if in_order || v.is_empty() {
            return v;
        }
        let axis = |i: usize| self.0.get(i).copied().unwrap_or((1, 0, false));
        let at = |(length, stride, backward): (usize, usize, bool), i: usize| {
            stride * if backward { length - 1 - i } else { i }
        };
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let mut out = Vec::with_capacity(v.len());
        for k in 0..z.0 {
            for j in 0..y.0 {
                let row = at(z, k) + at(y, j);
                out.extend((0..x.0).filter_map(|i| v.get(row + at(x, i)).copied()));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_transposed_and_turned() {
        // File order (x, y) with 2 x 3 values, y descending; the grid wants x fastest and y ascending.
        let v = vec![0, 1, 2, 10, 11, 12];
        let order = Order(vec![(2, 3, false), (3, 1, true)]);
        assert_eq!(order.reorder(v), [2, 12, 1, 11, 0, 10]);
        let order = Order(vec![(3, 1, false), (2, 3, false)]);
        assert_eq!(order.reorder(vec![0, 1, 2, 3, 4, 5]), [0, 1, 2, 3, 4, 5]);
    }
}
