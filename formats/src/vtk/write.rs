//! Particles as vertex cells, in XML (`.vtu`, `.vtp`) or legacy binary (`.vtk`).

use crate::common::flatten::flatten;
use crate::error::{FormatError, Result};
use crate::model::{Column, ParticleFile, ParticleTable, Values};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use base64::Engine;
use base64::write::EncoderWriter;
use flate2::{Compress, Compression, FlushCompress, Status};
use std::borrow::Cow;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Bytes of an uncompressed block, VTK's own default.
const BLOCK: usize = 32_768;

/// One array of the file: values made on demand, so that no copy of the data exists.
struct Array<'a> {
    name: String,
    kind: Kind,
    components: usize,
    count: usize,
    value: Box<dyn Fn(usize, usize) -> f64 + 'a>,
    /// The same numbers one after the other where they are whole: not all of these are in an f64.
    whole: Option<&'a [i64]>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    F32,
    F64,
    I64,
    U8,
}

impl Kind {
    fn xml(self) -> &'static str {
        match self {
            Self::F32 => "Float32",
            Self::F64 => "Float64",
            Self::I64 => "Int64",
            Self::U8 => "UInt8",
        }
    }

    fn legacy(self) -> &'static str {
        match self {
            Self::F32 => "float",
            Self::F64 => "double",
            Self::I64 => "long",
            Self::U8 => "unsigned_char",
        }
    }

    fn width(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 | Self::I64 => 8,
            Self::U8 => 1,
        }
    }
}

impl Array<'_> {
    fn bytes(&self) -> usize {
        self.count * self.components * self.kind.width()
    }

    fn append(&self, flat: usize, big_endian: bool, out: &mut Vec<u8>) {
        let v = (self.value)(flat / self.components, flat % self.components);
        match (self.kind, big_endian) {
            (Kind::F32, false) => out.extend((v as f32).to_le_bytes()),
            (Kind::F32, true) => out.extend((v as f32).to_be_bytes()),
            (Kind::F64, false) => out.extend(v.to_le_bytes()),
            (Kind::F64, true) => out.extend(v.to_be_bytes()),
            (Kind::I64, _) => {
                let whole = self.whole.map_or(v as i64, |whole| whole[flat]);
                out.extend(if big_endian { whole.to_be_bytes() } else { whole.to_le_bytes() });
            }
            (Kind::U8, _) => out.push(v as u8),
        }
    }

    /// Bytes of block `b`, of at most [`BLOCK`] bytes.
    fn block(&self, b: usize, out: &mut Vec<u8>) {
        out.clear();
        let per_block = BLOCK / self.kind.width();
        let total = self.count * self.components;
        (b * per_block..((b + 1) * per_block).min(total)).for_each(|i| self.append(i, false, out));
    }
}

/// All particles, with a column `ParticleType` where there are several kinds, and NaN where one lacks a column.
fn one_table(file: &ParticleFile) -> std::result::Result<Cow<'_, ParticleTable>, String> {
    if let [species] = file.species.as_slice()
        && species.part_type == 0
    {
        return Ok(Cow::Borrowed(&species.table));
    }
    let (count, arrays) = flatten(file)?;
    let columns = arrays.iter().map(|a| Column {
        name: a.name.clone(),
        components: a.components,
        values: if a.integers { Values::I64(a.whole().collect()) } else { Values::F64(a.floats().collect()) },
        dimension: a.dimension,
    });
    Ok(Cow::Owned(ParticleTable { count, columns: columns.collect() }))
}

pub(super) fn write(path: &Path, file: &ParticleFile, options: WriteOptions) -> Result<()> {
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: "vtk", problem };
    let table = one_table(file).map_err(refuse)?;
    let table = table.as_ref();
    let positions = table.column(names::COORDINATES).ok_or_else(|| refuse("there are no Coordinates".into()))?;
    let points = array(positions, "Points", Kind::F64, 3, table.count);
    let arrays = point_data(table, options);
    for a in &arrays {
        let is_single = a.kind == Kind::F32;
        let limit = if is_single { f64::from(f32::MAX) } else { f64::MAX };
        // What is next to nothing beside the rest may become 0, but not all of a column.
        let value = |i: usize| (a.value)(i / a.components, i % a.components).abs();
        let most = (0..a.count * a.components).map(value).fold(0.0, f64::max);
        let vanishes = is_single && most > 0.0 && most < f64::from(f32::MIN_POSITIVE);
        if let Some(i) = (0..a.count * a.components).find(|&i| value(i) > limit || vanishes && value(i) > 0.0) {
            return Err(refuse(format!(
                "{} of particle {} is {:e}, {} {}; choose other units or double precision",
                a.name,
                i / a.components,
                value(i),
                if vanishes { "too little for" } else { "beyond" },
                a.kind.xml()
            )));
        }
    }
    let create = || std::fs::File::create(path).map(BufWriter::new);
    let written = match path.extension().and_then(|e| e.to_str()) {
        Some("vtu") => create().and_then(|out| xml(out, Dataset::Unstructured, &points, &arrays, file, options)),
        Some("vtp") => create().and_then(|out| xml(out, Dataset::Poly, &points, &arrays, file, options)),
        Some("vtk") => create().and_then(|out| legacy(out, &points, &arrays, file)),
        other => {
            return Err(refuse(format!(
                "particles go into .vtu, .vtp, .vtk, or .pvtu and .pvtp with pieces, not into '.{}'",
                other.unwrap_or("")
            )));
        }
    };
    written.map_err(|e| FormatError::io(path, "write", e))
}

fn point_data(table: &ParticleTable, options: WriteOptions) -> Vec<Array<'_>> {
    let mut arrays = Vec::new();
    for column in table.columns.iter().filter(|c| c.name != names::COORDINATES) {
        let kind = match &column.values {
            Values::I64(_) => Kind::I64,
            _ if options.double_precision => Kind::F64,
            _ => Kind::F32,
        };
        // VTK takes two components for no vector.
        let components = if column.components == 2 || column.name == names::VELOCITIES { 3 } else { column.components };
        arrays.push(array(column, &column.name, kind, components, table.count));
    }
    arrays
}

/// Name, type and components of the arrays that are written for each particle of a file like this.
pub(super) fn declared_arrays(
    path: &Path,
    file: &ParticleFile,
    options: WriteOptions,
) -> Result<Vec<(String, &'static str, usize)>> {
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: "vtk", problem };
    let table = one_table(file).map_err(refuse)?;
    Ok(point_data(&table, options).into_iter().map(|a| (a.name, a.kind.xml(), a.components)).collect())
}

fn array<'a>(column: &'a Column, name: &str, kind: Kind, components: usize, count: usize) -> Array<'a> {
    let given = column.components;
    Array {
        name: name.to_owned(),
        kind,
        components,
        count,
        value: Box::new(move |i, k| if k < given { column.values.get(i * given + k) } else { 0.0 }),
        whole: match &column.values {
            Values::I64(v) if given == components => Some(v),
            _ => None,
        },
    }
}

fn computed<'a>(name: &str, kind: Kind, count: usize, value: impl Fn(usize) -> f64 + 'a) -> Array<'a> {
    Array { name: name.into(), kind, components: 1, count, value: Box::new(move |i, _| value(i)), whole: None }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Dataset {
    Unstructured,
    Poly,
}

/// Header XML with offsets into the appended data, then the data. Blocks are compressed twice, first to learn
/// their sizes for the offsets and then to write them, which costs time but no memory.
fn xml(
    mut out: impl Write,
    dataset: Dataset,
    points: &Array<'_>,
    arrays: &[Array<'_>],
    file: &ParticleFile,
    options: WriteOptions,
) -> std::io::Result<()> {
    let n = points.count;
    let connectivity = computed("connectivity", Kind::I64, n, |i| i as f64);
    let offsets = computed("offsets", Kind::I64, n, |i| (i + 1) as f64);
    let types = computed("types", Kind::U8, n, |_| 1.0);
    let level = u32::from(options.compression);
    let mut at = 0;
    let mut order: Vec<(&Array<'_>, Vec<usize>)> = Vec::new();
    let mut declare = |out: &mut dyn Write, a| declare(out, a, level, &mut at, &mut order);
    let (kind, piece) = match dataset {
        Dataset::Unstructured => ("UnstructuredGrid", format!("NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\"")),
        Dataset::Poly => (
            "PolyData",
            format!(
                "NumberOfPoints=\"{n}\" NumberOfVerts=\"{n}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\""
            ),
        ),
    };
    let compressor = if level > 0 { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"{compressor}>"
    )?;
    for comment in
        super::particles::comments(&file.header, file.species.first().map_or(&[], |s| s.table.columns.as_slice()))
    {
        writeln!(out, "{comment}")?;
    }
    writeln!(out, "<{kind}>")?;
    field_data(&mut out, dataset, file)?;
    writeln!(out, "<Piece {piece}>")?;
    let scalars = if arrays.iter().any(|a| a.name == names::DENSITY) { " Scalars=\"Density\"" } else { "" };
    writeln!(out, "<PointData{scalars}>")?;
    for a in arrays {
        declare(&mut out, a)?;
    }
    writeln!(out, "</PointData><CellData></CellData><Points>")?;
    declare(&mut out, points)?;
    writeln!(out, "</Points>")?;
    let cells = if dataset == Dataset::Unstructured { "Cells" } else { "Verts" };
    writeln!(out, "<{cells}>")?;
    declare(&mut out, &connectivity)?;
    declare(&mut out, &offsets)?;
    if dataset == Dataset::Unstructured {
        declare(&mut out, &types)?;
    }
    // Offsets count from the character behind the underscore.
    write!(out, "</{cells}></Piece></{kind}>\n<AppendedData encoding=\"base64\">\n_")?;
    for (a, sizes) in &order {
        data(&mut out, a, sizes, level)?;
    }
    writeln!(out, "\n</AppendedData>\n</VTKFile>")?;
    out.flush()
}

/// Units, kernel and provenance as ParaView shows them (View, Information), apart from the comments that are read back.
/// Texts are in `.vtp` files alone: meshio 5 reads no `.vtu` that has any.
fn field_data(out: &mut impl Write, dataset: Dataset, file: &ParticleFile) -> std::io::Result<()> {
    writeln!(out, "<FieldData>")?;
    for (name, value) in numbers(file) {
        writeln!(
            out,
            "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfTuples=\"1\" format=\"ascii\">{value:e}</DataArray>"
        )?;
    }
    if dataset == Dataset::Unstructured {
        return writeln!(out, "</FieldData>");
    }
    let kernel = std::iter::once(("Kernel", file.header.kernel.as_str()));
    let provenance = file.header.provenance.iter().map(|(key, value)| (key.as_str(), value.as_str()));
    for (name, text) in kernel.chain(provenance) {
        // Texts are the codes of their bytes, with a zero at the end.
        let codes: Vec<String> = text.bytes().chain([0]).map(|byte| byte.to_string()).collect();
        writeln!(
            out,
            "<DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"1\" format=\"ascii\">{}</DataArray>",
            quick_xml::escape::escape(name),
            codes.join(" ")
        )?;
    }
    writeln!(out, "</FieldData>")
}

/// Facts of the header that are one number.
fn numbers(file: &ParticleFile) -> [(&'static str, f64); 6] {
    let u = &file.header.units;
    [
        ("TimeValue", file.header.time),
        ("UnitLength_in_cm", u.length),
        ("UnitMass_in_g", u.mass),
        ("UnitVelocity_in_cm_per_s", u.length / u.time),
        ("UnitTemperature_in_K", u.temperature),
        ("KernelNeighbors", file.header.kernel_neighbors),
    ]
}

fn declare<'a, 'b>(
    out: &mut dyn Write,
    a: &'a Array<'b>,
    level: u32,
    at: &mut usize,
    order: &mut Vec<(&'a Array<'b>, Vec<usize>)>,
) -> std::io::Result<()> {
    writeln!(
        out,
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{at}\"/>",
        a.kind.xml(),
        quick_xml::escape::escape(&a.name),
        a.components,
    )?;
    let sizes = compressed_sizes(a, level);
    *at += encoded_length(a, &sizes, level);
    order.push((a, sizes));
    Ok(())
}

fn blocks(a: &Array<'_>) -> usize {
    a.bytes().div_ceil(BLOCK)
}

/// Sizes of the deflated blocks; empty without compression.
fn compressed_sizes(a: &Array<'_>, level: u32) -> Vec<usize> {
    if level == 0 {
        return Vec::new();
    }
    let (mut plain, mut packed) = (Vec::new(), Vec::new());
    (0..blocks(a))
        .map(|b| {
            a.block(b, &mut plain);
            deflate(&plain, level, &mut packed);
            packed.len()
        })
        .collect()
}

fn deflate(plain: &[u8], level: u32, packed: &mut Vec<u8>) {
    packed.clear();
    packed.reserve(plain.len() + plain.len() / 100 + 64);
    let mut state = Compress::new(Compression::new(level), true);
    while !matches!(
        state.compress_vec(&plain[state.total_in() as usize..], packed, FlushCompress::Finish),
        Ok(Status::StreamEnd)
    ) {
        packed.reserve(BLOCK);
    }
}

fn base64_length(bytes: usize) -> usize {
    bytes.div_ceil(3) * 4
}

/// Characters of an array in the appended section: the header and the data are encoded apart where they are
/// compressed, together where not.
fn encoded_length(a: &Array<'_>, sizes: &[usize], level: u32) -> usize {
    if level == 0 {
        return base64_length(8 + a.bytes());
    }
    base64_length(8 * (3 + sizes.len())) + base64_length(sizes.iter().sum())
}

fn data(out: &mut impl Write, a: &Array<'_>, sizes: &[usize], level: u32) -> std::io::Result<()> {
    let engine = &base64::engine::general_purpose::STANDARD;
    let mut plain = Vec::new();
    if level == 0 {
        let mut encoder = EncoderWriter::new(&mut *out, engine);
        encoder.write_all(&(a.bytes() as u64).to_le_bytes())?;
        for b in 0..blocks(a) {
            a.block(b, &mut plain);
            encoder.write_all(&plain)?;
        }
        return encoder.finish().map(drop);
    }
    let last = a.bytes() % BLOCK;
    let header = [sizes.len() as u64, BLOCK as u64, last as u64];
    let bytes: Vec<u8> = header.into_iter().chain(sizes.iter().map(|&s| s as u64)).flat_map(u64::to_le_bytes).collect();
    out.write_all(engine.encode(bytes).as_bytes())?;
    let mut packed = Vec::new();
    let mut encoder = EncoderWriter::new(&mut *out, engine);
    for b in 0..blocks(a) {
        a.block(b, &mut plain);
        deflate(&plain, level, &mut packed);
        encoder.write_all(&packed)?;
    }
    encoder.finish().map(drop)
}

/// Legacy version 4.2, binary, big-endian: `vtkUnstructuredGrid` with vertex cells.
fn legacy(mut out: impl Write, points: &Array<'_>, arrays: &[Array<'_>], file: &ParticleFile) -> std::io::Result<()> {
    let n = points.count;
    let version = file.header.provenance.iter().find(|(k, _)| k == "Version").map_or("sph-prep", |(_, v)| v.as_str());
    // The title is one line of at most 255 characters.
    writeln!(out, "# vtk DataFile Version 4.2\n{}", version.lines().next().unwrap_or(""))?;
    let numbers = numbers(file);
    writeln!(out, "BINARY\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData {}", numbers.len())?;
    for (name, value) in numbers {
        writeln!(out, "{name} 1 1 double")?;
        out.write_all(&value.to_be_bytes())?;
        writeln!(out)?;
    }
    writeln!(out, "POINTS {n} double")?;
    big_endian(&mut out, points)?;
    writeln!(out, "\nCELLS {n} {}", 2 * n)?;
    for i in 0..n {
        out.write_all(&1_i32.to_be_bytes())?;
        out.write_all(&(i as i32).to_be_bytes())?;
    }
    writeln!(out, "\nCELL_TYPES {n}")?;
    for _ in 0..n {
        out.write_all(&1_i32.to_be_bytes())?;
    }
    writeln!(out, "\nPOINT_DATA {n}\nFIELD FieldData {}", arrays.len())?;
    for a in arrays {
        // Names end at white space in this format.
        let name = a.name.replace(char::is_whitespace, "_");
        writeln!(out, "{name} {} {n} {}", a.components, a.kind.legacy())?;
        big_endian(&mut out, a)?;
        writeln!(out)?;
    }
    out.flush()
}

fn big_endian(out: &mut impl Write, a: &Array<'_>) -> std::io::Result<()> {
    let mut buffer = Vec::new();
    for flat in 0..a.count * a.components {
        a.append(flat, true, &mut buffer);
        if buffer.len() >= BLOCK {
            out.write_all(&buffer)?;
            buffer.clear();
        }
    }
    out.write_all(&buffer)
}
