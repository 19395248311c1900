//! The panel of pictures as SVG: blue where the density is too low, red where too high; up to 5 % in the left half
//! of each picture, up to 1 % in the right half, as in the paper. Each picture is a small PNG within the page.

use super::setups::{Measure, PIXELS};
use std::fmt::Write;

/// Edge of a pixel on the page.
const CELL: usize = 3;
const GAP: usize = 26;
const COLUMNS: usize = 4;
/// Shades to either side of white: few, so that the files stay small.
const SHADES: i32 = 12;

/// Blue through white to red, three bytes each.
fn palette() -> Vec<u8> {
    (-SHADES..=SHADES)
        .flat_map(|shade| {
            let weak = (255 * (SHADES - shade.abs()) / SHADES) as u8;
            if shade > 0 { [255, weak, weak] } else { [weak, weak, 255] }
        })
        .collect()
}

/// Place of a deviation in the palette.
fn shade(value: f64, range: f64) -> u8 {
    (f64::from(SHADES) * (1.0 + (value / range).clamp(-1.0, 1.0))).round() as u8
}

fn picture(measure: &Measure) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, PIXELS as u32, PIXELS as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette());
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    // The first row of the measure is at the bottom, where y is lowest.
    let indices: Vec<u8> = (0..PIXELS * PIXELS)
        .map(|i| {
            let (row, column) = (PIXELS - 1 - i / PIXELS, i % PIXELS);
            shade(measure.pixels[row * PIXELS + column], if 2 * column < PIXELS { 0.05 } else { 0.01 })
        })
        .collect();
    encoder.write_header().unwrap().write_image_data(&indices).unwrap();
    out
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = (0..3).fold(0_usize, |bits, i| bits << 8 | usize::from(chunk.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            out.push(if i <= chunk.len() { char::from(DIGITS[bits >> (18 - 6 * i) & 63]) } else { '=' });
        }
    }
    out
}

pub fn panel(found: &[(&'static str, Result<Measure, String>)]) -> String {
    let edge = PIXELS * CELL;
    let step = edge + GAP;
    let rows = found.len().div_ceil(COLUMNS);
    let (width, height) = (COLUMNS * step + GAP, rows * step + GAP);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (i, (name, measured)) in found.iter().enumerate() {
        let (x, y) = (GAP / 2 + i % COLUMNS * step, GAP + i / COLUMNS * step);
        writeln!(out, "<text x=\"{x}\" y=\"{}\" font-family=\"sans-serif\" font-size=\"13\">{name}</text>", y - 6)
            .unwrap();
        let Ok(m) = measured else { continue };
        writeln!(
            out,
            "<image x=\"{x}\" y=\"{y}\" width=\"{edge}\" height=\"{edge}\" style=\"image-rendering:pixelated\" \
             href=\"data:image/png;base64,{}\"/>",
            base64(&picture(m))
        )
        .unwrap();
    }
    out + "</svg>\n"
}

#[test]
fn base64_is_that_of_the_standard() {
    // RFC 4648, sec. 10.
    for (text, code) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(base64(text.as_bytes()), code);
    }
}
