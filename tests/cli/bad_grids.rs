//! Binary inputs that are wrong: NetCDF, VTK, and HDF5 particle files.

use super::support::{Bad, Folder, bad, refuse_all, succeed};
use sph_formats::common::netcdf_classic::{ClassicFile, Data};

/// A NetCDF profile or line of these numbers.
fn netcdf(axis: &str, nodes: &[f64], density: &[f64]) -> Vec<u8> {
    let folder = Folder::new();
    let path = folder.path("x.nc");
    let mut file = ClassicFile::new();
    let dimension = file.dimension(axis, nodes.len());
    file.variable(axis, &[dimension], Data::F64(nodes), &[("units", "cm".into())]);
    file.variable("density", &[dimension], Data::F64(density), &[("units", "g cm-3".into())]);
    file.write(&path).unwrap();
    std::fs::read(path).unwrap()
}

/// `content` with the first `from` replaced by `to`, of the same length.
fn patched(content: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let at = content.windows(from.len()).position(|w| w == from).expect("the bytes to replace are there");
    let mut content = content.to_vec();
    content[at..at + to.len()].copy_from_slice(to);
    content
}

#[test]
fn netcdf_files_are_refused_by_variable() {
    let (r, rho) = ([0.0, 0.5, 1.0], [3.0, 2.0, 1.0]);
    let good = netcdf("radius", &r, &rho);
    // The length of the dimension follows its padded name.
    let absurd = patched(&good, b"radius\0\0\0\0\0\x03", b"radius\0\0\x7f\xff\xff\xf0");
    refuse_all(&[
        bad("absent.nc", good.clone(), &["--density", "rho_gas"], &["'rho_gas'", "density"]),
        bad("nan.nc", netcdf("radius", &r, &[3.0, f64::NAN, 1.0]), &[], &["density"]),
        bad("negative.nc", netcdf("radius", &r, &[3.0, -2.0, 1.0]), &[], &["density", "-2"]),
        bad("zero.nc", netcdf("radius", &r, &[0.0; 3]), &[], &["density"]),
        bad("turning.nc", netcdf("radius", &[0.0, 0.7, 0.5], &rho), &[], &["radius"]),
        bad("turning_x.nc", netcdf("x", &[0.0, 0.7, 0.5], &rho), &[], &["'x'"]),
        bad("nan_axis.nc", netcdf("x", &[0.0, f64::NAN, 0.5], &rho), &[], &["'x'"]),
        bad("one_node.nc", netcdf("x", &[0.0], &[1.0]), &[], &["x"]),
        bad("cut.nc", &good[..good.len() - 20], &[], &["netcdf"]),
        bad("cut_header.nc", &good[..30], &[], &["netcdf"]),
        bad("magic_only.nc", &good[..4], &[], &["netcdf"]),
        bad("absurd.nc", absurd, &[], &["netcdf", "radius"]),
        bad("other.nc", "# r density\n0 2\n1 1\n", &["--format", "netcdf"], &["netcdf"]),
        bad("empty.nc", "", &[], &["empty"]),
    ]);
}

/// Legacy ASCII VTK: a line of three points along x.
fn legacy(data: &str) -> String {
    format!("# vtk DataFile Version 3.0\nx\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 3 1 1\n{data}")
}

const AXES: &str = "X_COORDINATES 3 double\n0 0.5 1\nY_COORDINATES 1 double\n0\nZ_COORDINATES 1 double\n0\n";

fn scalars(numbers: &str) -> String {
    legacy(&format!("{AXES}POINT_DATA 3\nSCALARS density double 1\nLOOKUP_TABLE default\n{numbers}"))
}

#[test]
fn legacy_vtk_files_are_refused_by_array() {
    let good = scalars("3 2 1\n");
    let image = |size: &str| {
        format!(
            "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS {size} {size} {size}\n\
             ORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 8\nSCALARS density double 1\nLOOKUP_TABLE default\n"
        )
    };
    refuse_all(&[
        bad("absent.vtk", good.clone(), &["--density", "rho_gas"], &["'rho_gas'", "density"]),
        bad("nan.vtk", scalars("3 nan 1\n"), &[], &["density"]),
        bad("negative.vtk", scalars("3 -2 1\n"), &[], &["density", "-2"]),
        bad("zero.vtk", scalars("0 0 0\n"), &[], &["density"]),
        bad("word.vtk", scalars("3 two 1\n"), &[], &["two"]),
        bad("turning.vtk", good.replace("0 0.5 1", "0 0.5 0.2"), &[], &["'x'"]),
        bad("cut.vtk", scalars("3 2"), &[], &["density"]),
        bad("cut_header.vtk", &good[..60], &[], &["vtk"]),
        bad("absurd.vtk", image("99999999999"), &[], &["vtk"]),
        bad("absurd_product.vtk", image("4000000000"), &[], &["vtk"]),
        bad("count.vtk", good.replace("POINT_DATA 3", "POINT_DATA 999999999999"), &[], &["vtk"]),
        bad("unknown.vtk", legacy("FACES 3\n"), &[], &["vtk"]),
        bad("other.vtk", "# r density\n0 2\n1 1\n", &["--format", "vtk"], &["vtk"]),
        bad("empty.vtk", "", &[], &["empty"]),
    ]);
}

/// XML VTK: an image of three points along x.
fn xml(extent: &str, array: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<ImageData WholeExtent=\"{extent}\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n\
         <Piece Extent=\"{extent}\">\n<PointData>\n{array}\n</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n"
    )
}

fn ascii(numbers: &str) -> String {
    let array = format!("<DataArray type=\"Float64\" Name=\"density\" format=\"ascii\">{numbers}</DataArray>");
    xml("0 2 0 0 0 0", &array)
}

#[test]
fn xml_vtk_files_are_refused_by_array() {
    let good = ascii("3 2 1");
    let binary = |payload: &str| {
        xml(
            "0 2 0 0 0 0",
            &format!("<DataArray type=\"Float64\" Name=\"density\" format=\"binary\">{payload}</DataArray>"),
        )
    };
    let huge = good.replace("0 2 0 0 0 0", "0 2000000000 0 2000000000 0 2000000000");
    refuse_all(&[
        bad("absent.vti", good.clone(), &["--density", "rho_gas"], &["'rho_gas'", "density"]),
        bad("nan.vti", ascii("3 nan 1"), &[], &["density"]),
        bad("negative.vti", ascii("3 -2 1"), &[], &["density", "-2"]),
        bad("zero.vti", ascii("0 0 0"), &[], &["density"]),
        bad("word.vti", ascii("3 two 1"), &[], &["density", "two"]),
        bad("few.vti", ascii("3 2"), &[], &["density", "3"]),
        bad("cut.vti", &good[..good.len() - 60], &[], &["vtk"]),
        bad("cut_header.vti", &good[..100], &[], &["vtk"]),
        bad("absurd.vti", huge, &[], &["vtk"]),
        bad("absurd_product.vti", good.replace("0 2 0 0 0 0", "0 9999999 0 9999999 0 9999999"), &[], &["vtk"]),
        // A header of 2^63 - 1 bytes.
        bad("absurd_block.vti", binary("/////////38AAAAAAAAAAA=="), &[], &["density"]),
        bad("base64.vti", binary("*?*"), &[], &["density"]),
        bad("type.vti", good.replace("Float64", "Complex"), &[], &["Complex"]),
        bad(
            "compressor.vti",
            binary("AQAAAAAAAAA=").replace("version=\"1.0\" byte", "compressor=\"x\" byte"),
            &[],
            &["vtk"],
        ),
        bad(
            "components.vti",
            good.replace("format=", "NumberOfComponents=\"9999999999999999999\" format="),
            &[],
            &["vtk"],
        ),
        bad("backwards.vti", good.replace("0 2 0 0 0 0", "2 0 0 0 0 0"), &[], &["vtk"]),
        bad("dataset.vti", good.replace("ImageData", "HyperTreeGrid"), &[], &["HyperTreeGrid"]),
        bad("empty.vti", "", &[], &["empty"]),
    ]);
}

/// Bytes of a particle file that the binary itself made.
fn particles(flavor: &str) -> Vec<u8> {
    let folder = Folder::new();
    let input = folder.file("good.txt", "# r density\n0 2\n0.5 1.5\n1 1\n").display().to_string();
    let out = folder.path("out/p.hdf5");
    let path = out.display().to_string();
    succeed(&["--in", &input, "--out", &path, "--to", flavor, "-n", "100", "--iterations", "1"]);
    std::fs::read(out).unwrap()
}

#[test]
fn damaged_particle_files_are_refused() {
    for flavor in ["swift", "gadget"] {
        let good = particles(flavor);
        let cuts: Vec<usize> = [9, 100, 600, 2000, good.len() / 2, good.len() - 1].to_vec();
        let mut cases: Vec<Bad<'_>> = cuts.iter().map(|&n| bad("cut.hdf5", &good[..n], &[], &[])).collect();
        // These carry no density: SPH codes sum it up themselves.
        cases.push(bad("no_density.hdf5", good.clone(), &["--density", "rho_gas"], &[]));
        cases.push(bad("renamed.hdf5", patched(&good, b"Coordinates", b"Coordinatez"), &[], &["damaged"]));
        cases.push(bad("gasless.hdf5", patched(&good, b"PartType0", b"PartType1"), &[], &["damaged"]));
        cases.push(bad("headless.hdf5", patched(&good, b"Header", b"Footer"), &[], &["damaged"]));
        cases.push(bad("other.hdf5", "# r density\n0 2\n1 1\n", &["--format", "swift"], &["swift"]));
        cases.push(bad("empty.hdf5", "", &[], &["empty"]));
        refuse_all(&cases);
    }
}
