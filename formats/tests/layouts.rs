//! How a file is laid out, as readers say it beside its particles.

use sph_formats::{FORMATS, FieldRequest, FileContent};

/// Names and lengths are those of the file, whatever is made of them.
#[test]
fn a_layout_is_told_as_the_file_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ic.hdf5");
    let file = rust_hdf5::H5File::create(&path).unwrap();
    let header = file.create_group("Header").unwrap();
    header.set_attr_array_numeric("NumPart_ThisFile", &[2_u32, 0, 0]).unwrap();
    header.set_attr_array_numeric("BoxSize", &[1.0, 2.0, 3.0]).unwrap();
    header.set_attr_string("RunName", "a text").unwrap();
    let units = file.create_group("Units").unwrap();
    units.set_attr_array_numeric("Unit length in cgs (U_L)", &[2.0]).unwrap();
    let group = file.create_group("PartType0").unwrap();
    let put = |name: &str, shape: &[usize]| {
        let count = shape.iter().product();
        group.new_dataset::<f64>().shape(shape).create(name).unwrap().write_raw(&vec![0.5; count]).unwrap();
    };
    put("Coordinates", &[2, 3]);
    put("InternalEnergies", &[2]);
    put("Masses", &[2, 1]);
    file.close().unwrap();
    let read = sph_formats::read(FORMATS, &path, None, &FieldRequest::default()).unwrap();
    let FileContent::Particles(particles) = read else { panic!("a field") };
    let [layout] = particles.header.layouts.as_slice() else { panic!("{:?}", particles.header.layouts) };
    assert_eq!(layout.of_header("NumPart_ThisFile"), Some([2.0, 0.0, 0.0].as_slice()));
    assert_eq!(layout.of_header("BoxSize"), Some([1.0, 2.0, 3.0].as_slice()));
    assert_eq!((layout.of_header("RunName"), layout.of_header("Time")), (None, None));
    assert_eq!(layout.units, Some(vec![("Unit length in cgs (U_L)".to_owned(), vec![2.0])]));
    let mut found: Vec<_> = layout
        .datasets
        .iter()
        .map(|d| (d.part_type, d.name.as_str(), d.meaning.as_str(), d.shape.as_slice()))
        .collect();
    found.sort_unstable();
    let expected: [(u8, &str, &str, &[u64]); 3] = [
        (0, "Coordinates", "Coordinates", &[2, 3]),
        (0, "InternalEnergies", "InternalEnergy", &[2]),
        (0, "Masses", "Masses", &[2, 1]),
    ];
    assert_eq!(found, expected);
}
