//! Images as density maps.

use crate::support::replace;
use sph_formats::{FORMATS, FieldRequest, FileContent, Geometry, RawField, Result, Values, read};
use std::path::Path;
use tiff::encoder::{TiffEncoder, colortype};

fn attempt(path: &Path) -> Result<RawField> {
    match read(FORMATS, path, None, &FieldRequest::default())? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(_) => panic!("an image holds no particles"),
    }
}

fn densities(field: &RawField) -> &Values {
    &field.variable("density").unwrap().values
}

fn png_file(path: &Path, size: [u32; 2], color: png::ColorType, depth: png::BitDepth, data: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255, 255, 0, 0]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
}

fn tiff_file<C: colortype::ColorType>(path: &Path, size: [u32; 2], data: &[C::Inner])
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let file = std::fs::File::create(path).unwrap();
    TiffEncoder::new(file).unwrap().write_image::<C>(size[0], size[1], data).unwrap();
}

#[test]
fn the_top_row_has_the_largest_y_and_pixels_are_square() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    png_file(&path, [4, 2], png::ColorType::Grayscale, png::BitDepth::Eight, &[255, 0, 0, 51, 1, 2, 3, 4]);
    let field = attempt(&path).unwrap();
    let Geometry::Grid { axes, .. } = &field.geometry else { panic!("{:?}", field.geometry) };
    assert_eq!(axes[0].nodes, [0.125, 0.375, 0.625, 0.875]);
    assert_eq!(axes[0].bounds.as_deref(), Some([0.0, 0.25, 0.5, 0.75, 1.0].as_slice()));
    assert_eq!(axes[1].bounds.as_deref(), Some([0.0, 0.25, 0.5].as_slice()));
    let expected: Vec<f32> = [1, 2, 3, 4, 255, 0, 0, 51].iter().map(|v| *v as f32 / 255.0).collect();
    assert_eq!(*densities(&field), Values::F32(expected));
}

/// Numbers of 8 bits, times 257 in 16 bits, over 255 as floats: the same picture.
#[test]
fn the_same_picture_is_the_same_density_in_every_depth_and_format() {
    let folder = tempfile::tempdir().unwrap();
    let gray: Vec<u8> = (0..35).map(|i| i * 7).collect();
    let wide: Vec<u16> = gray.iter().map(|v| u16::from(*v) * 257).collect();
    let floats: Vec<f32> = gray.iter().map(|v| (f64::from(*v) / 255.0) as f32).collect();
    let path = |name: &str| folder.path().join(name);
    png_file(&path("a.png"), [7, 5], png::ColorType::Grayscale, png::BitDepth::Eight, &gray);
    let bytes: Vec<u8> = wide.iter().flat_map(|v| v.to_be_bytes()).collect();
    png_file(&path("b.png"), [7, 5], png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes);
    let opaque: Vec<u8> = gray.iter().flat_map(|v| [*v, 255]).collect();
    png_file(&path("c.png"), [7, 5], png::ColorType::GrayscaleAlpha, png::BitDepth::Eight, &opaque);
    tiff_file::<colortype::Gray8>(&path("d.tif"), [7, 5], &gray);
    tiff_file::<colortype::Gray16>(&path("e.tiff"), [7, 5], &wide);
    tiff_file::<colortype::Gray32Float>(&path("f.tif"), [7, 5], &floats);
    let first = attempt(&path("a.png")).unwrap();
    assert_eq!(densities(&first).get(28), 0.0);
    for name in ["b.png", "c.png", "d.tif", "e.tiff", "f.tif"] {
        let field = attempt(&path(name)).unwrap();
        assert_eq!(densities(&field), densities(&first), "{name}");
    }
    let doubles: Vec<f64> = gray.iter().map(|v| f64::from(*v) - 100.0).collect();
    tiff_file::<colortype::Gray64Float>(&path("g.tif"), [7, 5], &doubles);
    let field = attempt(&path("g.tif")).unwrap();
    assert_eq!((densities(&field).get(28), densities(&field).len()), (-100.0, 35));
    assert!(matches!(densities(&field), Values::F64(_)));
}

#[test]
fn colors_become_their_luminance() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let colors = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    png_file(&path("a.png"), [4, 1], png::ColorType::Rgb, png::BitDepth::Eight, &colors);
    tiff_file::<colortype::RGB8>(&path("a.tif"), [4, 1], &colors);
    // Two bits a pixel: black, white, red, black.
    png_file(&path("i.png"), [4, 1], png::ColorType::Indexed, png::BitDepth::Two, &[0b0001_1000]);
    let field = attempt(&path("a.png")).unwrap();
    let expected = [0.2126, 0.7152, 0.0722, 1.0];
    for (i, weight) in expected.iter().enumerate() {
        assert!((densities(&field).get(i) - weight).abs() < 1e-7, "{i}");
    }
    assert!(matches!(&field.geometry, Geometry::Grid { axes, .. } if axes.len() == 1));
    assert_eq!(densities(&attempt(&path("a.tif")).unwrap()), densities(&field));
    let palette = attempt(&path("i.png")).unwrap();
    let found: Vec<f64> = (0..4).map(|i| densities(&palette).get(i)).collect();
    assert!((found[2] - 0.2126).abs() < 1e-7 && found[..2] == [0.0, 1.0] && found[3] == 0.0, "{found:?}");
}

#[test]
fn what_is_no_density_is_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let refusal = |name: &str| attempt(&path(name)).unwrap_err().to_string();
    png_file(&path("a.png"), [2, 1], png::ColorType::GrayscaleAlpha, png::BitDepth::Eight, &[9, 255, 9, 254]);
    assert!(refusal("a.png").contains("transparent in places; flatten it"));
    tiff_file::<colortype::CMYK8>(&path("c.tif"), [1, 2], &[0; 8]);
    assert!(refusal("c.tif").contains("CMYK"), "{}", refusal("c.tif"));
    png_file(&path("one.png"), [1, 1], png::ColorType::Grayscale, png::BitDepth::Eight, &[9]);
    assert!(refusal("one.png").contains("has 1 x 1 pixels, expected more than one"));
    let request = FieldRequest { density: Some("rho".into()), ..FieldRequest::default() };
    let error = read(FORMATS, &path("one.png"), None, &request).unwrap_err().to_string();
    assert!(error.contains("has no variable 'rho'"), "{error}");
}

#[test]
fn damage_and_absurd_sizes_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let gray: Vec<u8> = (0..200).collect();
    png_file(&path("a.png"), [20, 10], png::ColorType::Grayscale, png::BitDepth::Eight, &gray);
    tiff_file::<colortype::Gray8>(&path("a.tif"), [20, 10], &gray);
    for name in ["a.png", "a.tif"] {
        let whole = std::fs::read(path(name)).unwrap();
        let damaged = path(&format!("damaged-{name}"));
        let mut refused = 0;
        for end in 1..whole.len() {
            replace(&damaged, &whole[..end]);
            refused += usize::from(attempt(&damaged).is_err());
        }
        assert!(refused + 13 > whole.len(), "{name}: {refused} of {} prefixes refused", whole.len());
        for at in 8..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (at % 8);
            replace(&damaged, &bytes);
            let result = attempt(&damaged);
            assert!(name == "a.tif" || result.is_err(), "PNG has checksums, but byte {at} may be anything");
        }
    }
    // A picture of 2^31 pixels each way.
    let mut bytes = std::fs::read(path("a.png")).unwrap();
    bytes[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let crc = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(path("huge.png"), &bytes).unwrap();
    let error = attempt(&path("huge.png")).unwrap_err().to_string();
    assert!(error.contains("image: declares more memory, more than the"), "{error}");
}

/// CRC-32 of PNG (annex D of its specification).
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, b| {
        (0..8).fold(crc ^ u32::from(*b), |c, _| if c & 1 == 0 { c >> 1 } else { c >> 1 ^ 0xedb8_8320 })
    })
}
