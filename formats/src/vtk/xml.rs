//! XML files: `.vti`, `.vtr`, `.vts`, `.vtu`, `.vtp`, in every encoding and compression that VTK writes.
//!
//! The part behind `<AppendedData` is cut off before the XML is parsed, since raw data is no XML.

use super::dataset::{DataArray, Dataset, FORMAT, Shape, triples};
use crate::error::{FormatError, Result};
use crate::limits::MAX_EXPANSION;
use crate::model::{Cells, Values};
use base64::Engine;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

type Attributes = HashMap<String, String>;

/// More components than this are no row of one quantity; tensors have 9.
const MAX_COMPONENTS: usize = 4096;
/// The `Direction` of an image along x, y and z.
const UNTURNED: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// A `DataArray` element with the section that it stands in.
struct Element {
    section: String,
    attributes: Attributes,
    text: String,
}

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Dataset> {
    let wrong = |problem: String| FormatError::input(path, FORMAT, "xml", problem);
    let cut = find(bytes, b"<AppendedData").unwrap_or(bytes.len());
    let (head, tail) = bytes.split_at(cut);
    let head = std::str::from_utf8(head).map_err(|e| wrong(format!("is no UTF-8: {e}")))?;
    let document = parse(head).map_err(wrong)?;
    // Where data are appended, each array finds out for itself whether its bytes are there.
    if tail.is_empty() && !document.closed {
        return Err(wrong("ends before </VTKFile>; the file is cut off".into()));
    }
    if document.pieces > 1 {
        return Err(FormatError::Unsupported {
            path: path.into(),
            format: FORMAT,
            what: format!("{} pieces in one file; merge them first", document.pieces),
        });
    }
    let decoder = Decoder::new(path, &document.file, tail, bytes.len())?;
    document.dataset(path, &decoder)
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|w| w == what)
}

#[derive(Default)]
struct Document {
    kind: String,
    file: Attributes,
    grid: Attributes,
    piece: Attributes,
    pieces: usize,
    /// The file's own element has come to its end.
    closed: bool,
    arrays: Vec<Element>,
}

const SECTIONS: [&str; 8] = ["PointData", "CellData", "Points", "Cells", "Coordinates", "Verts", "Polys", "FieldData"];

fn parse(head: &str) -> std::result::Result<Document, String> {
    let mut reader = Reader::from_str(head);
    reader.config_mut().check_end_names = false;
    let mut document = Document::default();
    let mut section = String::new();
    let mut open: Option<Element> = None;
    loop {
        match reader.read_event() {
            Ok(Event::Eof) => break,
            // What is cut off behind the head ends open elements early, which is no fault of the file.
            Err(_) if document.pieces > 0 && open.is_none() => break,
            Err(e) => return Err(format!("cannot be parsed: {e}")),
            Ok(Event::Start(start)) => {
                open = element(&mut document, &mut section, &start)?.or(open);
            }
            Ok(Event::Empty(start)) => {
                if let Some(array) = element(&mut document, &mut section, &start)? {
                    document.arrays.push(array);
                }
            }
            Ok(Event::Text(text)) => {
                if let Some(array) = &mut open {
                    array.text += text.as_ref();
                }
            }
            Ok(Event::End(end)) => {
                let name = end.name();
                document.closed |= name.as_ref() == "VTKFile";
                if name.as_ref() == "DataArray" {
                    document.arrays.extend(open.take());
                } else if name.as_ref() == section {
                    section.clear();
                }
            }
            Ok(_) => {}
        }
    }
    if document.kind.is_empty() {
        return Err("has no VTKFile element with a type".into());
    }
    Ok(document)
}

/// Takes note of an element; returns it if it is a data array.
fn element(
    document: &mut Document,
    section: &mut String,
    start: &BytesStart<'_>,
) -> std::result::Result<Option<Element>, String> {
    let name = start.name().as_ref().to_owned();
    let mut attributes = Attributes::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|e| format!("has a broken attribute: {e}"))?;
        let key = attribute.key.as_ref().to_owned();
        attributes.insert(key, attribute.value.into_owned());
    }
    match name.as_str() {
        "VTKFile" => {
            document.kind = attributes.get("type").cloned().unwrap_or_default();
            document.file = attributes;
        }
        "Piece" => {
            document.pieces += 1;
            document.piece = attributes;
        }
        "DataArray" => return Ok(Some(Element { section: section.clone(), attributes, text: String::new() })),
        _ if name == document.kind => document.grid = attributes,
        _ if SECTIONS.contains(&name.as_str()) => *section = name,
        _ => {}
    }
    Ok(None)
}

impl Document {
    fn dataset(&self, path: &Path, decoder: &Decoder<'_>) -> Result<Dataset> {
        let wrong = |location: &str, problem: &str| FormatError::input(path, FORMAT, location, problem);
        let point_data = self.section("PointData", decoder)?;
        let cell_data = self.section("CellData", decoder)?;
        let points = || -> Result<Vec<[f64; 3]>> {
            let found = self.section("Points", decoder)?;
            let array = found.first().ok_or_else(|| wrong("Points", "are missing"))?;
            Ok(triples(&array.values))
        };
        let shape = match self.kind.as_str() {
            "ImageData" => self.image(path, decoder.file_bytes)?,
            "RectilinearGrid" => {
                let found = self.section("Coordinates", decoder)?;
                let [x, y, z] = found.as_slice() else {
                    return Err(wrong("Coordinates", "are not three arrays"));
                };
                Shape::Axes([x.values.to_f64(), y.values.to_f64(), z.values.to_f64()])
            }
            "StructuredGrid" => {
                let points = points()?;
                let dimensions = self.extent(path)?.map(|(_, span)| span + 1);
                if dimensions.iter().try_fold(1_usize, |n, &d| n.checked_mul(d)) != Some(points.len()) {
                    return Err(wrong("Points", "are not as many as the extent says"));
                }
                Shape::Structured { dimensions, points }
            }
            "UnstructuredGrid" => Shape::Cells { points: points()?, cells: self.cells("Cells", decoder, path)? },
            "PolyData" => Shape::Cells { points: points()?, cells: self.poly_cells(decoder, path)? },
            other => {
                return Err(FormatError::Unsupported {
                    path: path.into(),
                    format: FORMAT,
                    what: format!("data of type '{other}'"),
                });
            }
        };
        Ok(Dataset { shape, point_data, cell_data })
    }

    fn section(&self, name: &str, decoder: &Decoder<'_>) -> Result<Vec<DataArray>> {
        let numeric = |e: &&Element| e.attributes.get("type").is_none_or(|t| t != "String");
        self.arrays.iter().filter(|e| e.section == name).filter(numeric).map(|e| decoder.array(e)).collect()
    }

    /// First node along each axis, and how many intervals follow it.
    fn extent(&self, path: &Path) -> Result<[(i64, usize); 3]> {
        let text = self.piece.get("Extent").or(self.grid.get("WholeExtent")).map_or("", String::as_str);
        let numbers: Option<Vec<i64>> = text.split_whitespace().map(|t| t.parse().ok()).collect();
        let numbers = numbers.unwrap_or_default();
        let valid = numbers.len() == 6 && (0..3).all(|k| numbers[2 * k] <= numbers[2 * k + 1]);
        let span = |k: usize| numbers[2 * k + 1].checked_sub(numbers[2 * k]).and_then(|n| usize::try_from(n).ok());
        if !valid || (0..3).any(|k| span(k).is_none_or(|n| n > 1 << 32)) {
            return Err(FormatError::input(
                path,
                FORMAT,
                "Extent",
                format!("is '{text}', expected six ascending integers"),
            ));
        }
        Ok(std::array::from_fn(|k| (numbers[2 * k], span(k).unwrap_or(0))))
    }

    fn image(&self, path: &Path, file_bytes: usize) -> Result<Shape> {
        let triple = |key: &str, default: f64| -> Result<[f64; 3]> {
            let Some(text) = self.grid.get(key) else { return Ok([default; 3]) };
            let numbers: Option<Vec<f64>> = text.split_whitespace().map(|v| v.parse().ok()).collect();
            numbers
                .and_then(|n| n.try_into().ok())
                .ok_or_else(|| FormatError::input(path, FORMAT, key, format!("is '{text}', expected three numbers")))
        };
        let (origin, spacing) = (triple("Origin", 0.0)?, triple("Spacing", 1.0)?);
        let turned =
            self.grid.get("Direction").is_some_and(|t| t.split_whitespace().map(str::parse).ne(UNTURNED.map(Ok)));
        if turned {
            return Err(FormatError::Unsupported {
                path: path.into(),
                format: FORMAT,
                what: "an image that is turned (Direction); resample it to its axes first".into(),
            });
        }
        let extent = self.extent(path)?;
        // Each cell takes a byte at least, or its share of what decompression can make of one.
        let most = file_bytes.saturating_mul(MAX_EXPANSION as usize).saturating_mul(8);
        let nodes = extent.iter().try_fold(1_usize, |n, e| n.checked_mul(e.1 + 1));
        if nodes.is_none_or(|n| n > most) {
            return Err(FormatError::Limit {
                path: path.into(),
                format: FORMAT,
                location: "Extent".into(),
                declared: format!("{:?} nodes", extent.map(|e| e.1 + 1)),
                allowed: format!("the {most} that a file of {file_bytes} bytes can hold"),
            });
        }
        Ok(Shape::Axes(std::array::from_fn(|k| {
            let (start, span) = extent[k];
            (0..=span).map(|i| origin[k] + spacing[k] * (start as f64 + i as f64)).collect()
        })))
    }

    fn cells(&self, section: &str, decoder: &Decoder<'_>, path: &Path) -> Result<Cells> {
        let arrays = self.section(section, decoder)?;
        let get = |name: &str| arrays.iter().find(|a| a.name == name).map(|a| &a.values);
        let wrong = |problem: &str| FormatError::input(path, FORMAT, section, problem);
        let (Some(connectivity), Some(ends)) = (get("connectivity"), get("offsets")) else {
            return Err(wrong("lack 'connectivity' or 'offsets'"));
        };
        let index =
            |v: f64| if (0.0..1e15).contains(&v) { Ok(v as usize) } else { Err(wrong("have a negative index")) };
        let mut offsets = vec![0];
        for i in 0..ends.len() {
            offsets.push(index(ends.get(i))?);
        }
        let connectivity = (0..connectivity.len()).map(|i| index(connectivity.get(i))).collect::<Result<Vec<_>>>()?;
        let kind = |v: f64| match v as u8 {
            kind if f64::from(kind) == v => Ok(kind),
            _ => Err(wrong(&format!("have a cell of type {v}, which is none of VTK's"))),
        };
        let types = get("types").map_or(Ok(Vec::new()), |t| (0..t.len()).map(|i| kind(t.get(i))).collect())?;
        Ok(Cells { types, offsets, connectivity })
    }

    /// Triangles and quadrilaterals, or vertices where there are no polygons.
    fn poly_cells(&self, decoder: &Decoder<'_>, path: &Path) -> Result<Cells> {
        let polygons = self.arrays.iter().any(|e| e.section == "Polys");
        let mut cells = if polygons { self.cells("Polys", decoder, path)? } else { Cells::default() };
        if cells.offsets.len() < 2 {
            return Ok(Cells { offsets: vec![0], ..Cells::default() });
        }
        cells.types = cells
            .offsets
            .windows(2)
            .map(|w| match w[1].saturating_sub(w[0]) {
                3 => 5,
                4 => 9,
                _ => 7,
            })
            .collect();
        Ok(cells)
    }
}

/// Whether an attribute of the file has the second of its two values; the first stands where there is none.
fn one_of(path: &Path, file: &Attributes, key: &str, values: [&str; 2]) -> Result<bool> {
    match file.get(key) {
        None => Ok(false),
        Some(value) if values.contains(&value.as_str()) => Ok(value == values[1]),
        Some(value) => {
            let problem = format!("is '{value}', expected {} or {}", values[0], values[1]);
            Err(FormatError::input(path, FORMAT, format!("attribute {key} of VTKFile"), problem))
        }
    }
}

/// How the file encodes its arrays.
struct Decoder<'a> {
    path: &'a Path,
    wide_header: bool,
    big_endian: bool,
    compressor: Option<String>,
    /// Appended data behind the underscore, and whether it is raw.
    appended: &'a [u8],
    raw: bool,
    file_bytes: usize,
}

impl<'a> Decoder<'a> {
    fn new(path: &'a Path, file: &Attributes, tail: &'a [u8], file_bytes: usize) -> Result<Self> {
        let head_end = tail.iter().position(|&b| b == b'>').map_or(tail.len(), |i| i + 1);
        let raw = String::from_utf8_lossy(&tail[..head_end]).contains("raw");
        let start = tail[head_end..].iter().position(|&b| b == b'_').map_or(tail.len(), |i| head_end + i + 1);
        Ok(Self {
            path,
            wide_header: one_of(path, file, "header_type", ["UInt32", "UInt64"])?,
            big_endian: one_of(path, file, "byte_order", ["LittleEndian", "BigEndian"])?,
            compressor: file.get("compressor").cloned(),
            appended: &tail[start..],
            raw,
            file_bytes,
        })
    }

    fn array(&self, element: &Element) -> Result<DataArray> {
        let attribute = |key: &str| element.attributes.get(key).map_or("", String::as_str);
        let name = attribute("Name").to_owned();
        let broken = |problem: String| FormatError::input(self.path, FORMAT, format!("array '{name}'"), problem);
        let components = match attribute("NumberOfComponents") {
            // VTK leaves it out for scalars.
            "" => 1,
            text => text.trim().parse().ok().filter(|n| (1..=MAX_COMPONENTS).contains(n)).ok_or_else(|| {
                broken(format!("has NumberOfComponents '{text}', expected a number from 1 to {MAX_COMPONENTS}"))
            })?,
        };
        let kind = attribute("type");
        let values = match attribute("format") {
            "ascii" => ascii(kind, &element.text).map_err(broken)?,
            "binary" => {
                let text: Vec<u8> = element.text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
                numbers(kind, &self.base64(&text).map_err(broken)?, self.big_endian).map_err(broken)?
            }
            "appended" => {
                let offset: usize = attribute("offset").parse().map_err(|_| broken("has no valid offset".into()))?;
                let data = self.appended.get(offset..).ok_or_else(|| {
                    broken(format!("starts at {offset}, behind the end of the appended data; the file is cut off"))
                })?;
                let bytes = if self.raw { self.raw(data) } else { self.base64(data) }.map_err(broken)?;
                numbers(kind, &bytes, self.big_endian).map_err(broken)?
            }
            other => return Err(broken(format!("has format '{other}', expected ascii, binary or appended"))),
        };
        if values.len() % components != 0 {
            return Err(broken(format!("has {} values, which are not whole rows of {components}", values.len())));
        }
        Ok(DataArray { name, components, values })
    }

    fn word(&self) -> usize {
        if self.wide_header { 8 } else { 4 }
    }

    /// Header words at the start of `bytes`.
    fn words(&self, bytes: &[u8], count: usize) -> std::result::Result<Vec<usize>, String> {
        let size = self.word();
        let head = bytes.get(..count * size).ok_or("is cut off in its header")?;
        head.chunks_exact(size)
            .map(|chunk| {
                let mut wide = [0_u8; 8];
                if self.big_endian {
                    wide[8 - size..].copy_from_slice(chunk);
                    usize::try_from(u64::from_be_bytes(wide))
                } else {
                    wide[..size].copy_from_slice(chunk);
                    usize::try_from(u64::from_le_bytes(wide))
                }
                .map_err(|_| "declares an absurd size".to_owned())
            })
            .collect()
    }

    /// Raw appended data: header words, then bytes.
    fn raw(&self, data: &[u8]) -> std::result::Result<Vec<u8>, String> {
        if self.compressor.is_none() {
            let length = self.words(data, 1)?[0];
            let bytes = data.get(self.word()..).and_then(|d| d.get(..length)).ok_or("is cut off")?;
            return Ok(bytes.to_vec());
        }
        let (header, sizes) = self.block_header(&|count| self.words(data, count))?;
        let start = (3 + sizes.len()) * self.word();
        self.decompress(&header, &sizes, data.get(start..).ok_or("is cut off")?)
    }

    /// Base64: header and data are one stream uncompressed, two streams compressed.
    fn base64(&self, text: &[u8]) -> std::result::Result<Vec<u8>, String> {
        let characters = |bytes: usize| bytes.div_ceil(3) * 4;
        let decode = |from: usize, bytes: usize| -> std::result::Result<Vec<u8>, String> {
            let end = from.checked_add(characters(bytes)).ok_or("declares an absurd size")?;
            let part = text.get(from..end).ok_or("is cut off")?;
            base64::engine::general_purpose::STANDARD.decode(part).map_err(|e| format!("is no valid base64: {e}"))
        };
        let word = self.word();
        if self.compressor.is_none() {
            let length = self.words(&decode(0, word)?, 1)?[0];
            if length > self.file_bytes {
                return Err(format!("declares {length} bytes, more than the file has"));
            }
            let all = decode(0, word + length)?;
            return all.get(word..word + length).map(<[u8]>::to_vec).ok_or_else(|| "is cut off".into());
        }
        let (header, sizes) = self.block_header(&|count| self.words(&decode(0, count * word)?, count))?;
        let start = characters((3 + sizes.len()) * word);
        self.decompress(&header, &sizes, &decode(start, sizes.iter().sum())?)
    }

    /// Number of blocks, block size and last size; then the compressed sizes.
    fn block_header(
        &self,
        words: &dyn Fn(usize) -> std::result::Result<Vec<usize>, String>,
    ) -> std::result::Result<([usize; 3], Vec<usize>), String> {
        let first = words(1)?[0];
        if first == 0 {
            return Ok(([0; 3], Vec::new()));
        }
        let limit = self.file_bytes.saturating_mul(MAX_EXPANSION as usize);
        let head = words(3)?;
        if first > self.file_bytes || head[1].saturating_mul(first) > limit {
            return Err(format!("declares {first} blocks of {} bytes, more than the file can hold", head[1]));
        }
        let all = words(3 + first)?;
        let sizes = all[3..].to_vec();
        if sizes.iter().try_fold(0_usize, |n, &s| n.checked_add(s)).is_none_or(|n| n > self.file_bytes) {
            return Err("declares blocks larger than the file".into());
        }
        Ok(([head[0], head[1], head[2]], sizes))
    }

    fn decompress(&self, header: &[usize; 3], sizes: &[usize], data: &[u8]) -> std::result::Result<Vec<u8>, String> {
        let compressor = self.compressor.as_deref().unwrap_or("");
        let mut out = Vec::new();
        let mut at = 0;
        for (b, &size) in sizes.iter().enumerate() {
            let last = b + 1 == sizes.len() && header[2] > 0;
            let expected = if last { header[2] } else { header[1] };
            let packed = data.get(at..at + size).ok_or("is cut off")?;
            at += size;
            let before = out.len();
            let result = match compressor {
                "vtkZLibDataCompressor" => flate2::read::ZlibDecoder::new(packed)
                    .take(expected as u64 + 1)
                    .read_to_end(&mut out)
                    .map(drop)
                    .map_err(|e| e.to_string()),
                "vtkLZ4DataCompressor" => lz4_flex::block::decompress(packed, expected)
                    .map(|block| out.extend_from_slice(&block))
                    .map_err(|e| e.to_string()),
                "vtkLZMADataCompressor" => lzma(packed, expected, &mut out),
                other => Err(format!("compressor '{other}' is not known")),
            };
            result.map_err(|e| format!("block {b} cannot be decompressed: {e}"))?;
            if out.len() - before != expected {
                return Err(format!("block {b} has {} bytes, expected {expected}", out.len() - before));
            }
        }
        Ok(out)
    }
}

/// Decompresses into a buffer that refuses to grow beyond what is expected.
fn lzma(packed: &[u8], expected: usize, out: &mut Vec<u8>) -> std::result::Result<(), String> {
    struct Capped<'a> {
        out: &'a mut Vec<u8>,
        left: usize,
    }
    impl std::io::Write for Capped<'_> {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if bytes.len() > self.left {
                return Err(std::io::Error::other("more data than declared"));
            }
            self.left -= bytes.len();
            self.out.extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut input = packed;
    lzma_rs::xz_decompress(&mut input, &mut Capped { out, left: expected }).map_err(|e| format!("{e:?}"))
}

fn ascii(kind: &str, text: &str) -> std::result::Result<Values, String> {
    // Text is read as f64 whatever its type, but a type that is none is a sign of damage.
    numbers(kind, &[], false)?;
    let numbers = text
        .split_whitespace()
        .map(|t| t.parse::<f64>().map_err(|_| format!("has '{t}' where a number is expected")))
        .collect::<std::result::Result<Vec<_>, _>>()?;
    Ok(if kind == "Float32" { Values::F32(numbers.iter().map(|&v| v as f32).collect()) } else { Values::F64(numbers) })
}

/// Numbers of a VTK type from bytes. Whole numbers become f64: they index or count.
pub(super) fn numbers(kind: &str, bytes: &[u8], big_endian: bool) -> std::result::Result<Values, String> {
    macro_rules! all {
        ($t:ty, $wrap:expr) => {{
            let size = std::mem::size_of::<$t>();
            if bytes.len() % size != 0 {
                return Err(format!("has {} bytes, which are not whole numbers of type {kind}", bytes.len()));
            }
            let one = |chunk: &[u8]| {
                let mut raw = [0_u8; std::mem::size_of::<$t>()];
                raw.copy_from_slice(chunk);
                if big_endian { <$t>::from_be_bytes(raw) } else { <$t>::from_le_bytes(raw) }
            };
            $wrap(bytes.chunks_exact(size).map(one))
        }};
    }
    Ok(match kind {
        "Float32" | "float" => all!(f32, |i| Values::F32(Iterator::collect(i))),
        "Float64" | "double" => all!(f64, |i| Values::F64(Iterator::collect(i))),
        "Int8" | "char" => all!(i8, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "UInt8" | "unsigned_char" | "bit" => all!(u8, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "Int16" | "short" => all!(i16, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "UInt16" | "unsigned_short" => all!(u16, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "Int32" | "int" => all!(i32, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "UInt32" | "unsigned_int" => all!(u32, |i| Values::F64(Iterator::map(i, f64::from).collect())),
        "Int64" | "long" | "vtktypeint64" => {
            all!(i64, |i| Values::F64(Iterator::map(i, |v: i64| v as f64).collect()))
        }
        "UInt64" | "unsigned_long" => all!(u64, |i| Values::F64(Iterator::map(i, |v: u64| v as f64).collect())),
        other => return Err(format!("has type '{other}', which is not known")),
    })
}
