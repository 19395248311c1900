//! Small files of every format: what our writers make, and what they cannot make, by hand.

use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FORMATS, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values, WriteOptions,
    write,
};
use std::path::Path;

/// The seeds of the reader called `format`; files are made below `folder`.
pub fn of(format: &str, folder: &Path) -> Vec<Vec<u8>> {
    let mut seeds = match format {
        "vtk" => {
            [written(folder, "vtk", &["vtu", "vtp", "vtk"]), texts(&[IMAGE, RECTILINEAR, STRUCTURED, LEGACY, LEGACY_5])]
                .concat()
        }
        "table" => [written(folder, "table", &["csv"]), texts(&[RADIAL, CLOUD, GRID, FRACTIONS])].concat(),
        "mesa" => texts(&[MESA]),
        "obj" => texts(&[OBJ, OBJ_LINES]),
        "ply" => vec![PLY.into(), ply_binary("little"), ply_binary("big")],
        "stl" => vec![STL.into(), stl_binary()],
        "gyre" => texts(&[GYRE]),
        "fgong" => texts(&[FGONG]),
        "kepler" => texts(&[KEPLER]),
        "wdec" => vec![wdec()],
        // The first of its files; the others are damaged one by one in `amrex.rs`.
        "amrex" => texts(&[PLOTFILE]),
        // The same of `ramses.rs`.
        "ramses" => texts(&[RAMSES]),
        "gadget-binary" => {
            [written(folder, "gadget-binary", &["gadget"]), written(folder, "gadget-binary-1", &["gadget1"])].concat()
        }
        "gadget" => ["swift", "gadget", "gizmo", "arepo"].iter().flat_map(|f| written(folder, f, &["hdf5"])).collect(),
        "numpy" => {
            [written(folder, "numpy", &["npz"]), vec![npy("<f4", "(2, 3)", 24), npy(">i8", "(4,)", 32)]].concat()
        }
        "phantom" => [written(folder, "phantom", &["hdf5"]), sinks(folder)].concat(),
        "dualsphysics" => [written(folder, "dualsphysics", &["bi4"]), walls(folder)].concat(),
        other => written(folder, other, &["hdf5"]),
    };
    #[cfg(feature = "image")]
    if format == "image" {
        seeds.extend(images(folder));
    }
    #[cfg(feature = "hdf5-layer")]
    if ["grid-hdf5", "gyre-hdf5", "netcdf", "gadget", "sph-exa"].contains(&format) {
        seeds.extend(hdf5::all(folder));
    }
    if format == "netcdf" {
        seeds.extend(classic(folder));
    }
    assert!(!seeds.is_empty(), "there are no seeds for '{format}'");
    seeds
}

fn texts(texts: &[&str]) -> Vec<Vec<u8>> {
    texts.iter().map(|t| t.as_bytes().to_vec()).collect()
}

fn particles(dimension: usize, equal_masses: bool) -> ParticleFile {
    let n = 6;
    let column = |name: &str, components: usize, values: Values, dimension| Column {
        name: name.into(),
        components,
        values,
        dimension,
    };
    let numbers = |count: usize| Values::F64((0..count).map(|i| 0.1 + 0.05 * i as f64).collect());
    let columns = vec![
        column(names::COORDINATES, dimension, numbers(n * dimension), UnitDimension::LENGTH),
        column(names::VELOCITIES, dimension, numbers(n * dimension), UnitDimension::VELOCITY),
        column(
            names::MASSES,
            1,
            if equal_masses { Values::F64(vec![0.1; n]) } else { numbers(n) },
            UnitDimension::MASS,
        ),
        column(names::DENSITY, 1, numbers(n), UnitDimension::mass_density(dimension)),
        column(names::SUPPORT_RADIUS, 1, numbers(n), UnitDimension::LENGTH),
        column(names::INTERNAL_ENERGY, 1, numbers(n), UnitDimension::SPECIFIC_ENERGY),
        column(names::PARTICLE_IDS, 1, Values::I64((1..=n as i64).collect()), UnitDimension::NONE),
    ];
    ParticleFile {
        header: RunHeader {
            dimension,
            box_size: std::array::from_fn(|k| if k < dimension { 3.0 } else { 0.0 }),
            box_corner: None,
            periodic: std::array::from_fn(|k| k < dimension),
            units: UnitSystem::cgs(),
            time: 0.5,
            kernel: "Wendland C4".into(),
            kernel_neighbors: 60.0,
            provenance: vec![("Scene".into(), "a: 1".into())],
            layouts: Vec::new(),
        },
        species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }],
    }
}

/// Plain and compressed, in 2-D and 3-D; nothing where the format has no writer.
fn written(folder: &Path, format: &str, extensions: &[&str]) -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    let Some(spec) = FORMATS.iter().find(|f| f.name == format && f.write.is_some()) else {
        return seeds;
    };
    let can = spec.capabilities;
    for extension in extensions {
        for (dimension, compression) in [(3, 0), (2, 4)].into_iter().filter(|(d, _)| can.dimensions.contains(d)) {
            let path = folder.join(format!("seed.{extension}"));
            let options = WriteOptions { compression, double_precision: dimension == 2 };
            write(FORMATS, &path, Some(format), &particles(dimension, can.equal_masses), options).unwrap();
            seeds.push(std::fs::read(&path).unwrap());
        }
    }
    seeds
}

/// A dump with sinks beside gas; nothing where the format is left out.
fn sinks(folder: &Path) -> Vec<Vec<u8>> {
    if !FORMATS.iter().any(|f| f.name == "phantom" && f.write.is_some()) {
        return Vec::new();
    }
    let mut file = particles(3, true);
    let gas = &file.species[0].table;
    let of_point = |c: &&Column| [names::COORDINATES, names::VELOCITIES, names::MASSES].contains(&c.name.as_str());
    let mut columns: Vec<Column> = gas.columns.iter().filter(of_point).cloned().collect();
    let radii = Column { name: names::SOFTENING_RADIUS.into(), dimension: UnitDimension::LENGTH, ..columns[2].clone() };
    columns.push(radii);
    let table = ParticleTable { count: gas.count, columns };
    file.species.push(Species { part_type: 1, table });
    let path = folder.join("sinks.phantom");
    write(FORMATS, &path, Some("phantom"), &file, WriteOptions::default()).unwrap();
    vec![std::fs::read(&path).unwrap()]
}

/// Fluid on walls that know their surface, in two dimensions; nothing where the format is left out.
fn walls(folder: &Path) -> Vec<Vec<u8>> {
    if !FORMATS.iter().any(|f| f.name == "dualsphysics" && f.write.is_some()) {
        return Vec::new();
    }
    let mut file = particles(2, true);
    let fluid = &mut file.species[0].table;
    let (places, density) = (fluid.columns[0].clone(), fluid.columns[3].clone());
    let pressure = Column { name: names::PRESSURE.into(), dimension: UnitDimension::PRESSURE, ..density.clone() };
    fluid.columns.push(pressure);
    let normals = Column { name: "Normals".into(), dimension: UnitDimension::NONE, ..places.clone() };
    let distances = Column { name: "SurfaceDistance".into(), dimension: UnitDimension::LENGTH, ..density.clone() };
    let columns = vec![places, fluid.columns[2].clone(), density, normals, distances];
    let table = ParticleTable { count: fluid.count, columns };
    file.species.push(Species { part_type: 5, table });
    let path = folder.join("walls.bi4");
    write(FORMATS, &path, Some("dualsphysics"), &file, WriteOptions::default()).unwrap();
    vec![std::fs::read(&path).unwrap()]
}

/// A tetrahedron.
const OBJ: &str =
    "# a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\no b\nf 1/2/3 3 2\nf 1 2 \\\n 4\nf -4 -1 -2\nf 2//1 3//1 4//1\n";
const OBJ_LINES: &str = "v 0 0 2\nv 1 0 2\nv 0 1 2\nl 1 2 3 1\ncurv 0 1\n";
const PLY: &str = "ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n\
                   element face 1\nproperty list uchar int vertex_indices\nelement tristrips 1\nproperty list int int vertex_index\nend_header\n\
                   0 0 0 1\n1 0 0 2\n0 1 0 3\n3 0 1 2\n5 0 1 2 -1 0\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

/// Two points.
fn wdec() -> Vec<u8> {
    let arrays =
        " 1.000000000000000E+00 2.000000000000000E+00\n 3.000000000000000E+00 4.000000000000000E+00\n".repeat(10);
    format!("7 8 9\n    2  =    1  +    1  6.310E-05\n{arrays}").into_bytes()
}

fn ply_binary(order: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
         property list uchar ushort vertex_indices\nend_header\n"
    );
    let mut file = header.into_bytes();
    for v in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        file.extend(if order == "big" { v.to_be_bytes() } else { v.to_le_bytes() });
    }
    file.push(3);
    for v in 0..3_u16 {
        file.extend(if order == "big" { v.to_be_bytes() } else { v.to_le_bytes() });
    }
    file
}

fn stl_binary() -> Vec<u8> {
    let mut file = vec![b' '; 80];
    file.extend(2_u32.to_le_bytes());
    for triangle in 0..2_u8 {
        file.extend([0; 12]);
        (0..9_u8).for_each(|i| file.extend(f32::from(i % 4 + triangle).to_le_bytes()));
        file.extend([0; 2]);
    }
    file
}

/// A NumPy array of zeros.
fn npy(kind: &str, shape: &str, bytes: usize) -> Vec<u8> {
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((dictionary.len() as u16).to_le_bytes());
    file.extend(dictionary.bytes());
    file.resize(file.len() + bytes, 0);
    file
}

fn classic(folder: &Path) -> Vec<Vec<u8>> {
    use sph_formats::common::netcdf_classic::{ClassicFile, Data};
    let (r, rho) = ([0.0, 1.0, 1.0, 2.0], [4.0_f32, 3.0, 2.0, 1.0]);
    let mut profile = ClassicFile::new();
    profile.attribute("title", "seed");
    let d = profile.dimension("r", 4);
    profile.variable("r", &[d], Data::F64(&r), &[("units", "km".into())]);
    profile.variable("rho", &[d], Data::F32(&rho), &[("units", "kg/m^3".into()), ("_FillValue", "x".into())]);
    let mut grid = ClassicFile::new();
    let (x, values) = ([0.0, 1.0], [1.0_f32; 8]);
    let t = grid.dimension("time", 2);
    let (dx, dy) = (grid.dimension("x", 2), grid.dimension("y", 2));
    grid.variable("time", &[t], Data::F64(&x), &[("units", "days since 2000-01-01".into())]);
    grid.variable("x", &[dx], Data::F64(&x), &[("axis", "X".into())]);
    grid.variable("y", &[dy], Data::F64(&x), &[("axis", "Y".into())]);
    grid.variable("rho", &[t, dx, dy], Data::F32(&values), &[]);
    let bytes = |file: &ClassicFile| {
        let path = folder.join("seed.nc");
        file.write(&path).unwrap();
        std::fs::read(path).unwrap()
    };
    vec![bytes(&profile), bytes(&grid)]
}

#[cfg(feature = "image")]
fn images(folder: &Path) -> Vec<Vec<u8>> {
    use tiff::encoder::{TiffEncoder, colortype};
    let mut seeds = Vec::new();
    for (color, depth, row) in [
        (png::ColorType::Grayscale, png::BitDepth::Eight, 5),
        (png::ColorType::Rgba, png::BitDepth::Sixteen, 40),
        (png::ColorType::Grayscale, png::BitDepth::Two, 2),
    ] {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 5, 4);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(&vec![0xff; 4 * row]).unwrap();
        seeds.push(bytes);
    }
    let path = folder.join("seed.tif");
    let file = || std::fs::File::create(&path).unwrap();
    let read = || std::fs::read(&path).unwrap();
    TiffEncoder::new(file()).unwrap().write_image::<colortype::Gray8>(5, 4, &[7; 20]).unwrap();
    seeds.push(read());
    TiffEncoder::new(file()).unwrap().write_image::<colortype::RGB16>(5, 4, &[7; 60]).unwrap();
    seeds.push(read());
    TiffEncoder::new_big(file()).unwrap().write_image::<colortype::Gray32Float>(5, 4, &[0.5; 20]).unwrap();
    seeds.push(read());
    let packed = TiffEncoder::new(file()).unwrap().with_compression(tiff::encoder::Compression::Lzw);
    let mut packed = packed;
    packed.write_image::<colortype::Gray16>(5, 4, &[9; 20]).unwrap();
    seeds.push(read());
    seeds
}

#[cfg(feature = "hdf5-layer")]
mod hdf5 {
    use rust_hdf5::H5File;
    use std::path::Path;

    /// Athena++, PLUTO, GSM and POLY in small.
    pub fn all(folder: &Path) -> Vec<Vec<u8>> {
        let path = folder.join("seed.h5");
        let makers: [fn(&H5File); 7] = [athena, refined, flash, pluto, star, polytrope, chunked];
        let made = makers.iter().map(|make| {
            let file = H5File::create(&path).unwrap();
            make(&file);
            file.close().unwrap();
            std::fs::read(&path).unwrap()
        });
        made.collect()
    }

    fn numbers(file: &H5File, name: &str, shape: &[usize]) {
        let values: Vec<f32> = (0..shape.iter().product()).map(|i| i as f32).collect();
        file.new_dataset::<f32>().shape(shape).create(name).unwrap().write_raw(&values).unwrap();
    }

    fn athena(file: &H5File) {
        let root = file.root_group();
        root.set_attr_string("Coordinates", "cartesian").unwrap();
        root.set_attr_array_numeric("RootGridSize", &[4_i32, 2, 1]).unwrap();
        root.set_attr_array_numeric("MeshBlockSize", &[2_i32, 2, 1]).unwrap();
        root.set_attr_numeric("MaxLevel", &0_i32).unwrap();
        root.set_attr_string_array("DatasetNames", &["prim"]).unwrap();
        root.set_attr_array_numeric("NumVariables", &[1_i32]).unwrap();
        root.set_attr_string_array("VariableNames", &["rho"]).unwrap();
        let places = file.new_dataset::<i64>().shape([2, 3]).create("LogicalLocations").unwrap();
        places.write_raw(&[0_i64, 0, 0, 1, 0, 0]).unwrap();
        let faces = file.new_dataset::<f32>().shape([2, 3]).create("x1f").unwrap();
        faces.write_raw(&[0.0_f32, 1.0, 2.0, 2.0, 3.0, 4.0]).unwrap();
        let faces = file.new_dataset::<f32>().shape([2, 3]).create("x2f").unwrap();
        faces.write_raw(&[0.0_f32, 1.0, 2.0, 0.0, 1.0, 2.0]).unwrap();
        file.new_dataset::<f32>().shape([2, 2]).create("x3f").unwrap().write_raw(&[0.0_f32, 1.0, 0.0, 1.0]).unwrap();
        numbers(file, "prim", &[1, 2, 1, 2, 2]);
    }

    /// A block, and two of half its width.
    fn refined(file: &H5File) {
        let root = file.root_group();
        root.set_attr_string("Coordinates", "cartesian").unwrap();
        root.set_attr_array_numeric("RootGridSize", &[4_i32, 1, 1]).unwrap();
        root.set_attr_array_numeric("MeshBlockSize", &[2_i32, 1, 1]).unwrap();
        root.set_attr_numeric("MaxLevel", &1_i32).unwrap();
        root.set_attr_string_array("DatasetNames", &["prim"]).unwrap();
        root.set_attr_array_numeric("NumVariables", &[1_i32]).unwrap();
        root.set_attr_string_array("VariableNames", &["rho"]).unwrap();
        file.new_dataset::<i32>().shape([3]).create("Levels").unwrap().write_raw(&[0_i32, 1, 1]).unwrap();
        let places = file.new_dataset::<i64>().shape([3, 3]).create("LogicalLocations").unwrap();
        places.write_raw(&[0_i64, 0, 0, 2, 0, 0, 3, 0, 0]).unwrap();
        let faces = file.new_dataset::<f32>().shape([3, 3]).create("x1f").unwrap();
        faces.write_raw(&[0.0_f32, 1.0, 2.0, 2.0, 2.5, 3.0, 3.0, 3.5, 4.0]).unwrap();
        numbers(file, "prim", &[1, 3, 1, 1, 2]);
    }

    /// A block that is divided, and its halves.
    fn flash(file: &H5File) {
        file.new_dataset::<i32>().shape([3]).create("refine level").unwrap().write_raw(&[1_i32, 2, 2]).unwrap();
        file.new_dataset::<i32>().shape([3]).create("node type").unwrap().write_raw(&[2_i32, 1, 1]).unwrap();
        let ends = file.new_dataset::<f64>().shape([3, 1, 2]).create("bounding box").unwrap();
        ends.write_raw(&[0.0, 2.0, 0.0, 1.0, 1.0, 2.0]).unwrap();
        numbers(file, "dens", &[3, 1, 1, 2]);
    }

    fn pluto(file: &H5File) {
        let vars = file.create_group("Timestep_1").unwrap().create_group("vars").unwrap();
        vars.new_dataset::<f64>().shape([2, 2]).create("rho").unwrap().write_raw(&[1.0; 4]).unwrap();
        let nodes = file.create_group("node_coords").unwrap();
        // Below 0, so that they are no radii.
        let x = [-1.0_f32, 1.0, 2.0, -1.0, 1.0, 2.0, -1.0, 1.0, 2.0];
        let y = [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        nodes.new_dataset::<f32>().shape([3, 3]).create("X").unwrap().write_raw(&x).unwrap();
        nodes.new_dataset::<f32>().shape([3, 3]).create("Y").unwrap().write_raw(&y).unwrap();
    }

    fn star(file: &H5File) {
        file.root_group().set_attr_array_numeric("M_star", &[1e33]).unwrap();
        file.root_group().set_attr_array_numeric("R_star", &[1e11]).unwrap();
        ["r", "rho", "w", "p"].iter().for_each(|name| numbers(file, name, &[5]));
    }

    fn polytrope(file: &H5File) {
        file.root_group().set_attr_array_numeric("n_poly", &[3.0]).unwrap();
        numbers(file, "z", &[4]);
        let theta = file.new_dataset::<f64>().shape([4]).create("theta").unwrap();
        theta.write_raw(&[1.0, 0.9, 0.5, 0.0]).unwrap();
        numbers(file, "dtheta", &[4]);
    }

    fn chunked(file: &H5File) {
        let builder = file.new_dataset::<f64>().shape([40]).chunk(&[16]).shuffle_deflate(6);
        builder.create("rho").unwrap().write_slice(&[0], &[40], &[2.5; 40]).unwrap();
        numbers(file, "r", &[40]);
    }
}

const IMAGE: &str = r#"<?xml version="1.0"?>
<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian" header_type="UInt32">
<ImageData WholeExtent="0 2 0 1 0 0" Origin="1 2 3" Spacing="0.5 -1 1"><Piece Extent="0 2 0 1 0 0">
<PointData><DataArray type="Float64" Name="rho" format="ascii">0 1 2 10 11 12</DataArray></PointData>
<CellData><DataArray type="Float32" Name="c" NumberOfComponents="1" format="binary">CAAAAAAAoEAAAMBA</DataArray></CellData>
</Piece></ImageData></VTKFile>"#;

const RECTILINEAR: &str = r#"<VTKFile type="RectilinearGrid" byte_order="BigEndian"><RectilinearGrid WholeExtent="0 1 0 1 0 0">
<Piece Extent="0 1 0 1 0 0"><Coordinates><DataArray type="Float32" format="ascii">0 1</DataArray>
<DataArray type="Float32" format="ascii">0 2</DataArray><DataArray type="Float32" format="ascii">0</DataArray></Coordinates>
<PointData><DataArray type="Int32" Name="rho" format="appended" offset="0"/></PointData></Piece></RectilinearGrid>
<AppendedData encoding="base64">_AAAAEAAAAAEAAAACAAAAAwAAAAQ=</AppendedData></VTKFile>"#;

const STRUCTURED: &str = r#"<VTKFile type="StructuredGrid"><StructuredGrid WholeExtent="0 1 0 1 0 0"><Piece Extent="0 1 0 1 0 0">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 1 1 0</DataArray></Points>
<PointData><DataArray type="Float32" Name="rho" format="ascii">1 2 3 4</DataArray></PointData></Piece></StructuredGrid></VTKFile>"#;

const LEGACY: &str = "# vtk DataFile Version 3.0\none cell\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n\
0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS density double 1\n\
LOOKUP_TABLE default\n1 2 3 4\nCELL_DATA 1\nFIELD FieldData 1\nq 1 1 int\n7\n";

const LEGACY_5: &str = "# vtk DataFile Version 5.1\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n\
METADATA\nINFORMATION 0\n\nPOLYGONS 2 3\nOFFSETS vtktypeint64\n0 3\nCONNECTIVITY vtktypeint64\n0 1 2\nCELL_DATA 1\n\
SCALARS rho float\nLOOKUP_TABLE default\n7\n";

const RADIAL: &str = "# a star\n# r [cm]  density [g/cm^3]\n0 10\n1 5 # middle\n1 4\n2,0\n";
const CLOUD: &str = "x;y;z;rho\n0;0;0;1\n1;2;3;4\n5;1;2;3\n";
const GRID: &str = "x,y,\"rho\"\n0,0,1\n0,1,2\n1,0,3\n1,1,4\n";
const FRACTIONS: &str = "outer radius\tX\tY\tZ\trho\n3\t0.7\t0.28\t0.02\t1\n2\t0.6\t0.38\t0.02\t5\n";
const MESA: &str = " 1 2 3\n model_number num_zones star_age\n 7 3 1.0E+9\n\n 1 2 3 4 5\n zone mass logR logRho logT\n\
 1 1.0 0.5 0.0 3.0\n 2 0.5 0.3 1.0 4.0\n 3 0.2 0.1 2.0 5.0\n";
const PLOTFILE: &str = "HyperCLaw-V1.1\n1\ndensity\n1\n0.5\n1\n0 \n1 \n2 \n((0) (3) (0)) ((0) (7) (0)) \n0 0 \n0.25 \n0.125 \n\
0\n0\n0 1 0.5\n0\n0 1\nLevel_0/Cell\n1 1 0.5\n0\n0.5 1\nLevel_1/Cell\n";
const GYRE: &str = "2 1.0E33 1.0E10 1.0E33 100\n\
1 0.0 0.0 0 1 1 100.0 1 1 1 1 1 1 1 1 1 1 1 1\n2 1.0E10 1.0E33 0 1 1 1.0 1 1 1 1 1 1 1 1 1 1 1 1\n";
const FGONG: &str = "a\n\n\n\n         2         6         5      1300\n\
 2.000000000E+33 7.000000000E+10 4.000000000E+33 2.000000000E-02-7.000000000E-01\n 2.000000000E+00\n\
 7.000000000E+10-0.000000000E+00 1.000000000E+03 1.000000000E+02 1.000000000E-07\n\
 0.000000000E+00-2.000000000+101 1.000000000E+07 1.000000000E+17 1.000000000E+02\n";
const KEPLER: &str = "VERSION 1\n  grid  cell outer total mass  cell outer radius  cell mass  cell density  stability  h1\n\
# unit g cm g/cm**3\n   1:  2.0E+30  1.0E+09  1.0E+30  5.0E+05  rad  ---\n   2:  3.0E+30  2.0E+09  1.0E+30  1.0E+01  rad  0.7\n\
wind: 1.0\n";
const RAMSES: &str = "ncpu        =          1\nndim        =          1\nlevelmin    =          1\nlevelmax    =          2\n\
boxlen      =  0.1000E+01\ntime        =  0.0000E+00\nunit_l      =  0.3000E+19\nunit_d      =  0.1000E-23\nunit_t      =  0.3000E+14\n";
