//! Pixels as PNG.

use super::color::Rgb;
use crate::error::{Error, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// An image of at most 255 colors, row by row from the top; `None` is transparent.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Image {
    pub width: usize,
    pub height: usize,
    pub palette: Vec<Rgb>,
    pub pixels: Vec<Option<u8>>,
}

/// Shades of a map of colors.
const SHADES: usize = 255;

impl Image {
    /// From values of 0 to 1, those that are not finite transparent, row by row from the bottom, with `color` for each.
    pub fn shaded((width, height): (usize, usize), values: &[f64], color: impl Fn(f64) -> Rgb) -> Self {
        let palette = (0..SHADES).map(|i| color(i as f64 / (SHADES - 1) as f64)).collect();
        let shade = |v: f64| v.is_finite().then(|| ((SHADES - 1) as f64 * v.clamp(0.0, 1.0)).round() as u8);
        let rows = (0..height).rev().flat_map(|row| &values[row * width..(row + 1) * width]);
        Self { width, height, palette, pixels: rows.map(|v| shade(*v)).collect() }
    }

    /// As a PNG file, with lines of text for programs that show them.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn png(&self, texts: &[(&str, String)]) -> Result<Vec<u8>> {
        self.encoded(texts)
            .map_err(|e| Error::Numeric { stage: "picture", problem: format!("it cannot be encoded: {e}") })
    }

    fn encoded(&self, texts: &[(&str, String)]) -> std::result::Result<Vec<u8>, png::EncodingError> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.width as u32, self.height as u32);
        let clear = self.palette.len() as u8;
        let mut palette = self.palette.concat();
        palette.extend([0; 3]);
        let mut opacity = vec![255; self.palette.len()];
        opacity.push(0);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(palette);
        encoder.set_trns(opacity);
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(png::Filter::NoFilter);
        for (key, text) in texts {
            encoder.add_itxt_chunk((*key).to_owned(), text.clone())?;
        }
        let mut writer = encoder.write_header()?;
        let indices: Vec<u8> = self.pixels.iter().map(|p| p.unwrap_or(clear)).collect();
        writer.write_image_data(&indices)?;
        writer.finish()?;
        Ok(out)
    }

    /// As an address that holds the image itself.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn data_uri(&self) -> Result<String> {
        Ok(format!("data:image/png;base64,{}", STANDARD.encode(self.png(&[])?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::color::sequential;

    #[test]
    fn what_is_encoded_is_decoded() {
        let values = [0.0, f64::NAN, 1.0, 0.5, 2.0, -1.0];
        let image = Image::shaded((3, 2), &values, sequential);
        let png = image.png(&[("Title", "\u{3c1} of <a>".into())]).unwrap();
        let mut decoder = png::Decoder::new(std::io::Cursor::new(&png));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!((reader.info().width, reader.info().height), (3, 2));
        // The first row of the values is at the bottom.
        assert_eq!(&pixels[4..7], &sequential(1.0));
        assert_eq!(&pixels[12..15], &sequential(0.0));
        assert_eq!(pixels[12 + 7], 0, "not transparent");
        assert_eq!(reader.info().utf8_text[0].get_text().unwrap(), "\u{3c1} of <a>");
    }
}
