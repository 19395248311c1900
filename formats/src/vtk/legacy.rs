//! Legacy `.vtk` files, ASCII and binary (big-endian), versions 1.0 to 5.1.
//!
//! A cursor over the bytes reads words and, behind each keyword, as many numbers as its counts say; counts are
//! checked against what is left of the file first.

use super::dataset::{DataArray, Dataset, Shape, triples};
use super::decode::numbers;
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::model::{Cells, Values};
use std::path::Path;

type Outcome<T> = std::result::Result<T, String>;

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
}

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Dataset> {
    let mut cursor = Cursor { bytes, at: 0, binary: false };
    dataset(&mut cursor).map_err(|problem| FormatError::input(path, NAME, format!("byte {}", cursor.at), problem))
}

impl Cursor<'_> {
    fn line(&mut self) -> String {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (end + 1).min(rest.len());
        String::from_utf8_lossy(&rest[..end]).trim().to_owned()
    }

    /// The block behind `METADATA`, which an empty line ends.
    fn skip_metadata(&mut self) {
        self.line();
        while !self.line().is_empty() {}
    }

    /// The next word, or nothing at the end of the file.
    fn word(&mut self) -> Option<String> {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        let rest = self.bytes.get(self.at..)?;
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += end;
        (end > 0).then(|| String::from_utf8_lossy(&rest[..end]).into_owned())
    }

    fn need(&mut self, what: &str) -> Outcome<String> {
        self.word().ok_or_else(|| format!("the file ends where {what} is expected"))
    }

    fn count(&mut self, what: &str) -> Outcome<usize> {
        let word = self.need(what)?;
        word.parse().map_err(|_| format!("'{word}' stands where {what} is expected"))
    }

    fn number(&mut self, what: &str) -> Outcome<f64> {
        let word = self.need(what)?;
        word.parse().map_err(|_| format!("'{word}' stands where {what} is expected"))
    }

    /// `count` numbers of a VTK type, from text or from binary behind the line's end.
    fn numbers(&mut self, kind: &str, count: usize) -> Outcome<Values> {
        let left = self.bytes.len() - self.at.min(self.bytes.len());
        if self.binary {
            self.line();
            // VTK stores its own index type as 32 bits in these files, whatever it is in memory.
            let kind = if kind == "vtkIdType" { "int" } else { kind };
            let width = match kind {
                "char" | "unsigned_char" => 1,
                "short" | "unsigned_short" => 2,
                "float" | "int" | "unsigned_int" => 4,
                "double" | "long" | "unsigned_long" | "vtktypeint64" => 8,
                other => return Err(format!("numbers of type '{other}' are not supported")),
            };
            let size = count.checked_mul(width).filter(|s| *s <= left);
            let size = size.ok_or_else(|| format!("{count} numbers are declared, more than is left of the file"))?;
            let data = self.bytes.get(self.at..self.at + size).ok_or("the file is cut off in binary data")?;
            self.at += size;
            return numbers(kind, data, true);
        }
        if count > left {
            return Err(format!("{count} numbers are declared, more than is left of the file"));
        }
        let values = (0..count).map(|_| self.number("a number")).collect::<Outcome<Vec<f64>>>()?;
        Ok(if kind == "float" { Values::F32(values.iter().map(|&v| v as f32).collect()) } else { Values::F64(values) })
    }

    fn indices(&mut self, kind: &str, count: usize) -> Outcome<Vec<usize>> {
        let values = self.numbers(kind, count)?;
        (0..values.len())
            .map(|i| match values.get(i) {
                v if (0.0..1e15).contains(&v) => Ok(v as usize),
                v => Err(format!("index {v} is negative or absurd")),
            })
            .collect()
    }
}

fn dataset(c: &mut Cursor<'_>) -> Outcome<Dataset> {
    let version = c.line();
    let modern = version.rsplit(' ').next().and_then(|v| v.parse::<f64>().ok()).is_some_and(|v| v >= 5.0);
    c.line();
    c.binary = match c.need("ASCII or BINARY")?.to_ascii_uppercase().as_str() {
        "BINARY" => true,
        "ASCII" => false,
        other => return Err(format!("'{other}' stands where ASCII or BINARY is expected")),
    };
    let mut grid = Grid { modern, ..Grid::default() };
    let mut data = (Vec::new(), Vec::new());
    // 0: none yet, 1: points, 2: cells; with the count of values.
    let mut attribute = (0, 0);
    while let Some(word) = c.word() {
        let keyword = word.to_ascii_uppercase();
        match keyword.as_str() {
            "DATASET" => grid.kind = c.need("a dataset type")?.to_ascii_uppercase(),
            "POINT_DATA" => attribute = (1, c.count("a count")?),
            "CELL_DATA" => attribute = (2, c.count("a count")?),
            "METADATA" => c.skip_metadata(),
            _ if attribute.0 == 0 => grid.keyword(c, &keyword)?,
            _ => {
                let target = if attribute.0 == 1 { &mut data.0 } else { &mut data.1 };
                values(c, &keyword, attribute.1, target)?;
            }
        }
    }
    Ok(Dataset { shape: grid.shape()?, point_data: data.0, cell_data: data.1 })
}

/// What the keywords before the data say.
#[derive(Default)]
struct Grid {
    modern: bool,
    kind: String,
    dimensions: [usize; 3],
    origin: [f64; 3],
    spacing: Option<[f64; 3]>,
    axes: [Vec<f64>; 3],
    points: Vec<[f64; 3]>,
    cells: Cells,
}

impl Grid {
    fn keyword(&mut self, c: &mut Cursor<'_>, keyword: &str) -> Outcome<()> {
        match keyword {
            "DIMENSIONS" => {
                for d in &mut self.dimensions {
                    *d = c.count("a dimension")?;
                }
                let nodes = self.dimensions.iter().try_fold(1_usize, |n, &d| n.checked_mul(d));
                // Each cell takes a byte at least.
                let most = c.bytes.len().saturating_mul(8);
                if nodes.is_none_or(|n| n == 0 || n > most) {
                    return Err(format!(
                        "DIMENSIONS are {:?}, expected 1 to {most} nodes in a file of {} bytes",
                        self.dimensions,
                        c.bytes.len()
                    ));
                }
            }
            "ORIGIN" => {
                for v in &mut self.origin {
                    *v = c.number("an origin")?;
                }
            }
            "SPACING" | "ASPECT_RATIO" => {
                let mut spacing = [0.0; 3];
                for v in &mut spacing {
                    *v = c.number("a spacing")?;
                }
                self.spacing = Some(spacing);
            }
            "X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES" => {
                let (n, kind) = (c.count("a count")?, c.need("a type")?);
                let axis = usize::from(keyword.as_bytes()[0] - b'X');
                self.axes[axis] = c.numbers(&kind, n)?.to_f64();
            }
            "POINTS" => {
                let (n, kind) = (c.count("a count")?, c.need("a type")?);
                self.points = triples(&c.numbers(&kind, n.saturating_mul(3))?);
            }
            "CELLS" => self.cells = cell_list(c, self.modern, &[])?,
            "CELL_TYPES" => {
                let n = c.count("a count")?;
                let types = c.indices("int", n)?.into_iter();
                let kind = |t: usize| u8::try_from(t).map_err(|_| format!("cell type {t} is none of VTK's"));
                self.cells.types = types.map(kind).collect::<Outcome<_>>()?;
            }
            "VERTICES" => drop(cell_list(c, self.modern, &[])?),
            "POLYGONS" => self.cells = cell_list(c, self.modern, &[(3, 5), (4, 9)])?,
            "LINES" => drop(cell_list(c, self.modern, &[])?),
            "FIELD" => fields(c, &mut Vec::new())?,
            other => return Err(format!("'{other}' is not supported")),
        }
        Ok(())
    }

    fn shape(self) -> Outcome<Shape> {
        let Self { kind, dimensions, origin, spacing, axes, points, mut cells, .. } = self;
        match kind.as_str() {
            "STRUCTURED_POINTS" => {
                let spacing = spacing.unwrap_or([1.0; 3]);
                if dimensions.contains(&0) {
                    return Err("DIMENSIONS are missing".into());
                }
                Ok(Shape::Axes(std::array::from_fn(|k| {
                    (0..dimensions[k]).map(|i| origin[k] + spacing[k] * i as f64).collect()
                })))
            }
            "RECTILINEAR_GRID" => Ok(Shape::Axes(axes)),
            "STRUCTURED_GRID" => {
                let nodes: usize = dimensions.iter().product();
                if nodes != points.len() {
                    return Err(format!("{} points stand for dimensions {dimensions:?}", points.len()));
                }
                Ok(Shape::Structured { dimensions, points })
            }
            "UNSTRUCTURED_GRID" | "POLYDATA" => {
                if cells.offsets.is_empty() {
                    cells.offsets.push(0);
                }
                Ok(Shape::Cells { points, cells })
            }
            other => Err(format!("dataset '{other}' is not supported")),
        }
    }
}

/// Cells as `n p1 ... pn` (to 4.2), or as offsets and connectivity (from 5.0). `types` names the cell type of
/// each number of corners, where the list itself implies it.
fn cell_list(c: &mut Cursor<'_>, modern: bool, types: &[(usize, u8)]) -> Outcome<Cells> {
    let (first, second) = (c.count("a count")?, c.count("a size")?);
    let mut cells = Cells { offsets: vec![0], ..Cells::default() };
    if modern {
        for section in 0..2 {
            let word = c.need("OFFSETS or CONNECTIVITY")?;
            let kind = c.need("a type")?;
            match (section, word.to_ascii_uppercase().as_str()) {
                (0, "OFFSETS") => cells.offsets = c.indices(&kind, first)?,
                (1, "CONNECTIVITY") => cells.connectivity = c.indices(&kind, second)?,
                _ => return Err(format!("'{word}' stands where OFFSETS or CONNECTIVITY is expected")),
            }
        }
    } else {
        let flat = c.indices("int", second)?;
        let mut at = 0;
        for _ in 0..first {
            let n = *flat.get(at).ok_or("the cell list ends early")?;
            let corners = n.checked_add(at + 1).and_then(|end| flat.get(at + 1..end));
            cells.connectivity.extend_from_slice(corners.ok_or("the cell list ends early")?);
            cells.offsets.push(cells.connectivity.len());
            at += n + 1;
        }
    }
    if !types.is_empty() {
        let corners = cells.offsets.windows(2).map(|w| w[1].saturating_sub(w[0]));
        cells.types = corners.map(|n| types.iter().find(|t| t.0 == n).map_or(7, |t| t.1)).collect();
    }
    Ok(cells)
}

/// A name as VTK writes it into legacy files, with `%` and two digits for what is no letter or digit there (`vtkDataWriter::EncodeString`).
fn decoded(name: &str) -> String {
    let (mut bytes, mut rest) = (Vec::with_capacity(name.len()), name.as_bytes());
    while let [first, after @ ..] = rest {
        let digits = after.get(..2).and_then(|d| std::str::from_utf8(d).ok()).filter(|_| *first == b'%');
        match digits.and_then(|d| u8::from_str_radix(d, 16).ok()) {
            Some(byte) => (bytes.push(byte), rest = &after[2..]),
            None => (bytes.push(*first), rest = after),
        };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One attribute of points or cells.
fn values(c: &mut Cursor<'_>, keyword: &str, count: usize, out: &mut Vec<DataArray>) -> Outcome<()> {
    let mut simple = |c: &mut Cursor<'_>, components: usize, keep: bool| -> Outcome<()> {
        let (name, kind) = (c.need("a name")?, c.need("a type")?);
        let values = of_array(&name, c.numbers(&kind, count.saturating_mul(components)))?;
        if keep {
            out.push(DataArray { name: decoded(&name), components, values });
        }
        Ok(())
    };
    match keyword {
        "SCALARS" => {
            let rest = c.line();
            let mut words = rest.split_whitespace();
            let (Some(name), Some(kind)) = (words.next(), words.next()) else {
                return Err("SCALARS has no name and type".into());
            };
            let components = words.next().map_or(Ok(1), |w| {
                let number = w.parse().ok().filter(|n| (1..=4_usize).contains(n));
                number.ok_or_else(|| format!("SCALARS '{name}' have '{w}' components, expected 1 to 4"))
            })?;
            // The table's name may be left out.
            let before = c.at;
            if !c.word().is_some_and(|w| w.eq_ignore_ascii_case("LOOKUP_TABLE")) {
                c.at = before;
                return Err("SCALARS without LOOKUP_TABLE are not supported".into());
            }
            c.word();
            let values = of_array(name, c.numbers(kind, count.saturating_mul(components)))?;
            out.push(DataArray { name: decoded(name), components, values });
        }
        "VECTORS" | "NORMALS" => simple(c, 3, true)?,
        "TENSORS" => simple(c, 9, false)?,
        "FIELD" => fields(c, out)?,
        "LOOKUP_TABLE" => {
            c.need("a name")?;
            let size = c.count("a size")?;
            let kind = if c.binary { "unsigned_char" } else { "float" };
            c.numbers(kind, size.saturating_mul(4))?;
        }
        other => return Err(format!("'{other}' is not supported")),
    }
    Ok(())
}

/// Says in which array something is wrong.
fn of_array(name: &str, values: Outcome<Values>) -> Outcome<Values> {
    values.map_err(|problem| format!("array '{name}': {problem}"))
}

fn fields(c: &mut Cursor<'_>, out: &mut Vec<DataArray>) -> Outcome<()> {
    c.need("a name")?;
    let arrays = c.count("a number of arrays")?;
    for _ in 0..arrays {
        let mut name = c.need("a name")?;
        while name == "METADATA" {
            c.skip_metadata();
            name = c.need("a name")?;
        }
        let (components, tuples) = (c.count("components")?, c.count("tuples")?);
        let kind = c.need("a type")?;
        let values = of_array(&name, c.numbers(&kind, components.saturating_mul(tuples)))?;
        out.push(DataArray { name: decoded(&name), components, values });
    }
    Ok(())
}
