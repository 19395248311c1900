//! XML files: `.vti`, `.vtr`, `.vts`, `.vtu`, `.vtp`, in every encoding and compression that VTK writes.
//!
//! The part behind `<AppendedData` is cut off before the XML is parsed, since raw data is no XML.

use super::dataset::{DataArray, Dataset, Shape, triples};
use super::decode::Decoder;
use super::element::{Attributes, Element};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::limits::MAX_EXPANSION;
use crate::model::Cells;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::path::Path;

/// The `Direction` of an image along x, y and z.
const UNTURNED: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Dataset> {
    let wrong = |problem: String| FormatError::input(path, NAME, "xml", problem);
    let cut = find(bytes, b"<AppendedData").unwrap_or(bytes.len());
    let (head, tail) = bytes.split_at(cut);
    let head = std::str::from_utf8(head).map_err(|e| wrong(format!("is not UTF-8: {e}")))?;
    let document = parse(head).map_err(wrong)?;
    // Where data are appended, each array finds out for itself whether its bytes are there.
    if tail.is_empty() && !document.closed {
        return Err(wrong("ends before </VTKFile>; the file is cut off".into()));
    }
    if document.pieces > 1 {
        return Err(FormatError::Unsupported {
            path: path.into(),
            format: NAME,
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
    // Elements within a data array (InformationKey) have texts of their own.
    let mut inner = 0_usize;
    loop {
        match reader.read_event() {
            Ok(Event::Eof) => break,
            // What is cut off behind the head ends open elements early, which is not a fault of the file.
            Err(_) if document.pieces > 0 && open.is_none() => break,
            Err(e) => return Err(format!("cannot be parsed: {e}")),
            Ok(Event::Start(_)) if open.is_some() => inner += 1,
            Ok(Event::Start(start)) => {
                open = element(&mut document, &mut section, &start)?.or(open);
            }
            Ok(Event::Empty(start)) => {
                if let Some(array) = element(&mut document, &mut section, &start)? {
                    document.arrays.push(array);
                }
            }
            Ok(Event::Text(text)) => {
                if let Some(array) = open.as_mut().filter(|_| inner == 0) {
                    array.text += text.as_ref();
                }
            }
            Ok(Event::End(end)) => {
                let name = end.name();
                document.closed |= name.as_ref() == "VTKFile";
                if inner > 0 {
                    inner -= 1;
                } else if name.as_ref() == "DataArray" {
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
        let wrong = |location: &str, problem: &str| FormatError::input(path, NAME, location, problem);
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
                    format: NAME,
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
                NAME,
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
                .ok_or_else(|| FormatError::input(path, NAME, key, format!("is '{text}', expected three numbers")))
        };
        let (origin, spacing) = (triple("Origin", 0.0)?, triple("Spacing", 1.0)?);
        let turned =
            self.grid.get("Direction").is_some_and(|t| t.split_whitespace().map(str::parse).ne(UNTURNED.map(Ok)));
        if turned {
            return Err(FormatError::Unsupported {
                path: path.into(),
                format: NAME,
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
                format: NAME,
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
        let wrong = |problem: &str| FormatError::input(path, NAME, section, problem);
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
