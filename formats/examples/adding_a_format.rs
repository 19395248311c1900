//! A format of a host's own: XYZ, the text that molecular viewers (VMD, OVITO, Jmol) read. The first line is the number of
//! particles, the second a comment, then one line each: a symbol, x, y and z. It goes to [`sph_formats::registry`] in the
//! host's own list, next to formats of the crate.

use sph_formats::common::particle_names as names;
use sph_formats::registry::{Capabilities, FieldRequest, FileContent, FormatSpec, Match, WriteOptions, detect};
use sph_formats::{Column, FormatError, ParticleFile, ParticleTable, Result, RunHeader, Species, UnitDimension};
use sph_formats::{UnitSystem, Values};
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::Path;

/// The data sheet: everything that detection, the command line and the conformance tests need to know.
pub const XYZ: FormatSpec = FormatSpec {
    name: "xyz",
    summary: "XYZ text of molecular viewers: positions only",
    extensions: &["xyz"],
    feature: "host",
    reference: "https://openbabel.org/docs/FileFormats/XYZ_cartesian_coordinates_format.html",
    capabilities: Capabilities { read_particles: true, write_particles: true, dimensions: &[3], ..Capabilities::NONE },
    // Text has no signature: the extension decides.
    sniff: |_| Match::No,
    read: Some(read),
    write: Some(write),
    stream: None,
};

fn write(path: &Path, file: &ParticleFile, _: WriteOptions) -> Result<()> {
    let io = |e| FormatError::io(path, "write", e);
    let refuse = |problem: &str| FormatError::Output { path: path.into(), format: XYZ.name, problem: problem.into() };
    let count: usize = file.species.iter().map(|s| s.table.count).sum();
    let mut out = BufWriter::new(std::fs::File::create(path).map_err(io)?);
    writeln!(out, "{count}\nt = {:e}", file.header.time).map_err(io)?;
    for species in &file.species {
        let found = species.table.column(names::COORDINATES).filter(|c| c.components == 3);
        let x = &found.ok_or_else(|| refuse("positions are not in three dimensions"))?.values;
        for i in (0..x.len()).step_by(3) {
            writeln!(out, "H {:e} {:e} {:e}", x.get(i), x.get(i + 1), x.get(i + 2)).map_err(io)?;
        }
    }
    out.flush().map_err(io)
}

fn read(path: &Path, _: &FieldRequest) -> Result<FileContent> {
    let wrong = |line: usize, problem: &str| FormatError::input(path, XYZ.name, format!("line {}", line + 1), problem);
    let file = std::fs::File::open(path).map_err(|e| FormatError::io(path, "open", e))?;
    let lines: std::io::Result<Vec<String>> = BufReader::new(file).lines().collect();
    let lines = lines.map_err(|e| FormatError::io(path, "read", e))?;
    let count: Option<usize> = lines.first().and_then(|l| l.trim().parse().ok());
    // Nothing is allocated by a number of the file: it only has to agree with the lines there are.
    let count = count.filter(|n| n.checked_add(2).is_some_and(|n| n <= lines.len()));
    let count = count.ok_or_else(|| wrong(0, "expected the number of particles, each on a line of its own"))?;
    let mut positions = Vec::new();
    for (number, line) in lines.iter().enumerate().skip(2).take(count) {
        let point: Vec<f64> = line.split_whitespace().skip(1).take(3).filter_map(|v| v.parse().ok()).collect();
        if point.len() != 3 || !point.iter().all(|x| x.is_finite()) {
            return Err(wrong(number, "expected a symbol and three finite numbers"));
        }
        positions.extend(point);
    }
    let name = names::COORDINATES.to_owned();
    let column = Column { name, components: 3, values: Values::F64(positions), dimension: UnitDimension::LENGTH };
    let header = RunHeader {
        dimension: 3,
        box_size: [0.0; 3],
        box_corner: None,
        periodic: [false; 3],
        units: UnitSystem::CODE,
        time: 0.0,
        kernel: String::new(),
        kernel_neighbors: 0.0,
        provenance: vec![],
        layouts: Vec::new(),
    };
    let species = vec![Species { part_type: 0, table: ParticleTable { count, columns: vec![column] } }];
    Ok(FileContent::Particles(ParticleFile { header, species }))
}

pub fn main() -> Result<()> {
    let formats = [XYZ, sph_formats::vtk::SPEC];
    let folder = std::env::temp_dir();
    let path = folder.join(format!("adding-a-format-{}.xyz", std::process::id()));
    std::fs::write(&path, "2\nwater, without its oxygen\nH 0.5 0 0.25\nH -0.5 0 0.25\n")
        .map_err(|e| FormatError::io(&path, "write", e))?;
    println!("{} is {}", path.display(), detect(&formats, &path, None)?.name);
    let FileContent::Particles(water) = sph_formats::read(&formats, &path, None, &FieldRequest::default())? else {
        unreachable!("xyz holds particles")
    };
    sph_formats::write(&formats, &path, None, &water, WriteOptions::default())?;
    std::fs::remove_file(&path).map_err(|e| FormatError::io(&path, "remove", e))
}
