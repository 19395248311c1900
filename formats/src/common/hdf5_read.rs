//! Reads attributes and numeric datasets of HDF5 files through `hdf5-reader`, with sizes checked first.

use crate::error::{FormatError, Result};
use crate::limits::{Budget, MAX_VARIABLE_BYTES};
use crate::model::Values;
use hdf5_reader::{
    Attribute, CompoundField, Dataset, Datatype, H5Type, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem, StringSize,
};
use std::path::Path;

/// Values of a contiguous dataset that are read at once.
const BLOCK: usize = 1 << 18;

/// An open file and what its errors should say.
pub struct Reader<'p> {
    file: Hdf5File,
    path: &'p Path,
    format: &'static str,
    budget: Budget,
}

/// A member of a record.
#[derive(Debug, Clone, PartialEq)]
pub enum Member {
    Number(f64),
    /// Without its padding.
    Text(String),
}

/// What a dataset holds, before its numbers are read.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    pub rows: usize,
    pub columns: usize,
}

impl<'p> Reader<'p> {
    /// Opens `path`.
    ///
    /// # Errors
    /// [`FormatError::Io`], or [`FormatError::Input`] where it is not a whole HDF5 file.
    pub fn open(path: &'p Path, format: &'static str) -> Result<Self> {
        let metadata = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
        let cap = usize::try_from(MAX_VARIABLE_BYTES).unwrap_or(usize::MAX);
        let options = OpenOptions::default().with_max_read_bytes(cap);
        let file = Hdf5File::open_with_options(path, options).map_err(|e| input(path, format, "superblock", e))?;
        Ok(Self { file, path, format, budget: Budget::new(metadata.len()) })
    }

    /// The error of this file at a place.
    pub fn input(&self, location: impl Into<String>, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, self.format, location, problem)
    }

    /// Names of the root's groups.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn groups(&self) -> Result<Vec<String>> {
        let root = self.file.root_group();
        root.and_then(|g| g.member_names())
            .map(|names| names.0)
            .map_err(|e| input(self.path, self.format, "group '/'", e))
    }

    /// Names of a group's datasets; `/` is the root.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn datasets(&self, group: &str) -> Result<Vec<String>> {
        let opened = if group == "/" { self.file.root_group() } else { self.file.group(group) };
        opened.and_then(|g| g.member_names()).map(|names| names.1).map_err(|e| self.at_group(group, e))
    }

    /// The attributes of a group; none where there is no such group.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn group_attributes(&self, group: &str) -> Result<Attributes> {
        if !self.groups()?.iter().any(|g| g == group) {
            return Ok(Attributes(Vec::new()));
        }
        let opened = self.file.group(group);
        opened.and_then(|g| g.attributes()).map(Attributes).map_err(|e| self.at_group(group, e))
    }

    /// The attributes of the root.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn root_attributes(&self) -> Result<Attributes> {
        let root = self.file.root_group();
        root.and_then(|g| g.attributes()).map(Attributes).map_err(|e| self.at_group("/", e))
    }

    /// The attributes of a dataset.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn dataset_attributes(&self, path: &str) -> Result<Attributes> {
        let dataset = self.file.dataset(path);
        dataset.map(|d| Attributes(d.attributes())).map_err(|e| self.at_dataset(path, e))
    }

    /// Reads a numeric dataset of one or two dimensions in the precision of the file; `None` where it is of
    /// another type or shape. u64 numbers above 2^63 are refused.
    ///
    /// # Errors
    /// [`FormatError::Input`], or [`FormatError::Limit`] where the declared size cannot be.
    pub fn numbers(&self, path: &str) -> Result<Option<(Shape, Values)>> {
        let dataset = self.file.dataset(path).map_err(|e| self.at_dataset(path, e))?;
        let shape = match *dataset.shape() {
            [rows] => [rows, 1],
            [rows, columns] => [rows, columns],
            _ => return Ok(None),
        };
        let [rows, columns] = shape.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        Ok(self.values(path, &dataset)?.map(|values| (Shape { rows, columns }, values)))
    }

    /// The shape of a dataset.
    ///
    /// # Errors
    /// [`FormatError::Input`].
    pub fn shape(&self, path: &str) -> Result<Vec<u64>> {
        self.file.dataset(path).map(|d| d.shape().to_vec()).map_err(|e| self.at_dataset(path, e))
    }

    /// Reads a numeric dataset of any shape, the last index fastest; `None` where it is of another type.
    ///
    /// # Errors
    /// As [`Self::numbers`].
    pub fn array(&self, path: &str) -> Result<Option<(Vec<usize>, Values)>> {
        let dataset = self.file.dataset(path).map_err(|e| self.at_dataset(path, e))?;
        let shape = dataset.shape().iter().map(|&n| usize::try_from(n).unwrap_or(usize::MAX)).collect();
        Ok(self.values(path, &dataset)?.map(|values| (shape, values)))
    }

    /// The records of a dataset of compounds: names and values of members that are numbers or texts of a fixed length. None where
    /// it is of another type.
    ///
    /// # Errors
    /// As [`Self::numbers`].
    pub fn records(&self, path: &str) -> Result<Vec<Vec<(String, Member)>>> {
        let dataset = self.file.dataset(path).map_err(|e| self.at_dataset(path, e))?;
        let Datatype::Compound { size, fields } = dataset.dtype() else { return Ok(Vec::new()) };
        let count = dataset.shape().iter().try_fold(1_u64, |n, &d| n.checked_mul(d)).unwrap_or(u64::MAX);
        self.budget.take(self.path, self.format, &format!("dataset '{path}'"), count.saturating_mul((*size).into()))?;
        let bytes = dataset.read_native_bytes().map_err(|e| self.at_dataset(path, e))?;
        let member = |record: &[u8], field: &CompoundField| {
            let own = record.get(field.byte_offset as usize..).unwrap_or_default();
            member(own, &field.datatype).map(|value| (field.name.clone(), value))
        };
        let records = bytes.chunks_exact((*size as usize).max(1));
        Ok(records.map(|record| fields.iter().filter_map(|field| member(record, field)).collect()).collect())
    }

    /// The texts of a dataset without their padding; `None` where it is of another type.
    ///
    /// # Errors
    /// As [`Self::numbers`].
    pub fn texts(&self, path: &str) -> Result<Option<Vec<String>>> {
        let dataset = self.file.dataset(path).map_err(|e| self.at_dataset(path, e))?;
        let width = match dataset.dtype() {
            Datatype::String { size: StringSize::Fixed(width), .. } => u64::from(*width),
            _ => return Ok(None),
        };
        let count = dataset.shape().iter().try_fold(1_u64, |n, &d| n.checked_mul(d)).unwrap_or(u64::MAX);
        let bytes = count.saturating_mul(width.saturating_add(size_of::<String>() as u64));
        self.budget.take(self.path, self.format, &format!("dataset '{path}'"), bytes)?;
        let texts = dataset.read_strings().map_err(|e| self.at_dataset(path, e))?;
        Ok(Some(texts.iter().map(|text| text.trim_end_matches(['\0', ' ']).to_owned()).collect()))
    }

    fn values(&self, path: &str, dataset: &Dataset) -> Result<Option<Values>> {
        let width = match dataset.dtype() {
            Datatype::FloatingPoint { size, .. } => u64::from(*size),
            // As stored and as i64.
            Datatype::FixedPoint { size, .. } => u64::from(*size) + 8,
            _ => return Ok(None),
        };
        let count = dataset.shape().iter().try_fold(1_u64, |n, &d| n.checked_mul(d)).unwrap_or(u64::MAX);
        let bytes = count.saturating_mul(width);
        self.budget.take(self.path, self.format, &format!("dataset '{path}'"), bytes)?;
        let Ok(count) = usize::try_from(count) else { return Ok(None) };
        Ok(Some(match dataset.dtype() {
            Datatype::FloatingPoint { size: 4, .. } => Values::F32(self.read(path, dataset, count)?),
            Datatype::FloatingPoint { size: 8, .. } => Values::F64(self.read(path, dataset, count)?),
            Datatype::FixedPoint { size, signed, .. } => Values::I64(match (size, signed) {
                (1, true) => widen::<i8>(self.read(path, dataset, count)?),
                (1, false) => widen::<u8>(self.read(path, dataset, count)?),
                (2, true) => widen::<i16>(self.read(path, dataset, count)?),
                (2, false) => widen::<u16>(self.read(path, dataset, count)?),
                (4, true) => widen::<i32>(self.read(path, dataset, count)?),
                (4, false) => widen::<u32>(self.read(path, dataset, count)?),
                (8, true) => self.read(path, dataset, count)?,
                (8, false) => self.signed(path, self.read(path, dataset, count)?)?,
                _ => return Ok(None),
            }),
            _ => return Ok(None),
        }))
    }

    fn read<T: H5Type + Default + Copy>(&self, path: &str, dataset: &Dataset, count: usize) -> Result<Vec<T>> {
        let (rows, row) = match *dataset.shape() {
            [rows] => (rows, 1),
            [rows, columns] => (rows, columns),
            _ => (0, 0),
        };
        if dataset.chunks().is_none() && count > BLOCK && (1..=BLOCK as u64).contains(&row) {
            return self.blocks(path, dataset, rows, row);
        }
        let mut values = vec![T::default(); count];
        dataset.read_into(&mut values).map_err(|e| self.at_dataset(path, e))?;
        Ok(values)
    }

    /// Reads a contiguous dataset in parts, since the library holds each part twice.
    fn blocks<T: H5Type + Copy>(&self, path: &str, dataset: &Dataset, rows: u64, row: u64) -> Result<Vec<T>> {
        let mut values = Vec::with_capacity((rows * row) as usize);
        let step = BLOCK as u64 / row;
        for start in (0..rows).step_by(step as usize) {
            let part = SliceInfoElem::Slice { start, end: rows.min(start + step), step: 1 };
            let whole = SliceInfoElem::Slice { start: 0, end: row, step: 1 };
            let selections = [part, whole].into_iter().take(dataset.ndim()).collect();
            let read = dataset.read_slice::<T>(&SliceInfo { selections }).map_err(|e| self.at_dataset(path, e))?;
            match read.as_slice() {
                Some(slice) => values.extend_from_slice(slice),
                None => values.extend(read.iter().copied()),
            }
        }
        Ok(values)
    }

    fn signed(&self, path: &str, values: Vec<u64>) -> Result<Vec<i64>> {
        let convert = |(i, x): (usize, u64)| {
            i64::try_from(x).map_err(|_| {
                self.input(format!("dataset '{path}'"), format!("value {i} is {x}, expected at most 2^63 - 1"))
            })
        };
        values.into_iter().enumerate().map(convert).collect()
    }

    fn at_group(&self, group: &str, e: hdf5_reader::error::Error) -> FormatError {
        input(self.path, self.format, &format!("group '{group}'"), e)
    }

    fn at_dataset(&self, dataset: &str, e: hdf5_reader::error::Error) -> FormatError {
        input(self.path, self.format, &format!("dataset '{dataset}'"), e)
    }
}

fn input(path: &Path, format: &'static str, location: &str, e: hdf5_reader::error::Error) -> FormatError {
    match e {
        hdf5_reader::error::Error::Io(e) => FormatError::io(path, "read", e),
        hdf5_reader::error::Error::UnsupportedFilter(filter) => FormatError::Unsupported {
            path: path.into(),
            format,
            what: format!("compression of {location} by {filter}; copy the file with h5repack -f NONE"),
        },
        other => {
            FormatError::input(path, format, location, format!("{other}; the file is damaged, incomplete or not HDF5"))
        }
    }
}

/// The first value in `bytes`, which are in this machine's order.
fn member(bytes: &[u8], datatype: &Datatype) -> Option<Member> {
    fn of<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
        bytes.get(..N)?.try_into().ok()
    }
    Some(Member::Number(match datatype {
        Datatype::FloatingPoint { size: 4, .. } => f32::from_ne_bytes(of(bytes)?).into(),
        Datatype::FloatingPoint { size: 8, .. } => f64::from_ne_bytes(of(bytes)?),
        Datatype::FixedPoint { size: 1, .. } => f64::from(*bytes.first()?),
        Datatype::FixedPoint { size: 4, .. } => i32::from_ne_bytes(of(bytes)?).into(),
        Datatype::FixedPoint { size: 8, .. } => i64::from_ne_bytes(of(bytes)?) as f64,
        Datatype::String { size: StringSize::Fixed(width), .. } => {
            let text = String::from_utf8_lossy(bytes.get(..*width as usize)?).into_owned();
            let text = text.split('\0').next().unwrap_or_default().trim_end().to_owned();
            return Some(Member::Text(text));
        }
        _ => return None,
    }))
}

fn widen<T: Into<i64>>(values: Vec<T>) -> Vec<i64> {
    values.into_iter().map(Into::into).collect()
}

/// Attributes of a group or dataset.
pub struct Attributes(Vec<Attribute>);

impl Attributes {
    fn find(&self, name: &str) -> Option<&Attribute> {
        self.0.iter().find(|a| a.name == name)
    }

    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|a| a.name.as_str())
    }

    /// All numbers of an attribute, scalar or not, of any numeric type.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let a = self.find(name)?;
        let floats = |v: Vec<f32>| v.into_iter().map(f64::from).collect();
        let numbers = match &a.datatype {
            Datatype::FloatingPoint { size: 4, .. } => floats(a.read_1d().ok()?),
            Datatype::FloatingPoint { size: 8, .. } => a.read_1d().ok()?,
            Datatype::FixedPoint { size, signed, .. } => match (size, signed) {
                (1, true) => cast::<i8>(a.read_1d().ok()?, f64::from),
                (1, false) => cast::<u8>(a.read_1d().ok()?, f64::from),
                (2, true) => cast::<i16>(a.read_1d().ok()?, f64::from),
                (2, false) => cast::<u16>(a.read_1d().ok()?, f64::from),
                (4, true) => cast::<i32>(a.read_1d().ok()?, f64::from),
                (4, false) => cast::<u32>(a.read_1d().ok()?, f64::from),
                (8, true) => cast::<i64>(a.read_1d().ok()?, |x| x as f64),
                (8, false) => cast::<u64>(a.read_1d().ok()?, |x| x as f64),
                _ => return None,
            },
            _ => return None,
        };
        Some(numbers)
    }

    /// The first number of an attribute.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers(name)?.first().copied()
    }

    /// All texts of an attribute without their padding.
    pub fn texts(&self, name: &str) -> Option<Vec<String>> {
        let texts = self.find(name)?.read_strings().ok()?;
        Some(texts.iter().map(|t| t.trim_end_matches(['\0', ' ']).to_owned()).collect())
    }

    /// A text without its padding; a line's end belongs to it.
    pub fn text(&self, name: &str) -> Option<String> {
        let text = self.find(name)?.read_string().ok()?;
        Some(text.trim_end_matches(['\0', ' ']).to_owned())
    }
}

fn cast<T>(values: Vec<T>, to: impl Fn(T) -> f64) -> Vec<f64> {
    values.into_iter().map(to).collect()
}
