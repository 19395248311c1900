//! A picture with axes and a bar of colors, as SVG.

use super::axis::Axis;
use super::color::{Rgb, categorical, diverging, sequential};
use super::figure::{framed, rectangle};
use super::html::escape;
use super::image::Image;
use super::raster::View;
use crate::error::Result;
use std::fmt::Write;

/// How values become colors.
#[derive(Debug, Clone)]
pub(super) enum Scale {
    /// From dark to light, between the ends of the axis.
    Sequential(Axis, (f64, f64)),
    /// From -range to range.
    Diverging(Axis, f64),
    /// By number; the names of the numbers.
    Categories(Vec<String>),
}

impl Scale {
    /// Logarithmic over great contrasts; from `values` that count.
    pub fn sequential(label: String, values: &[f64]) -> Self {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite() && *v > 0.0).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let (Some(lo), Some(hi)) = (sorted.get(sorted.len() / 200), sorted.last()) else {
            return Self::Sequential(Axis::linear(label), (0.0, 1.0));
        };
        let axis = Axis::for_values(label, [*lo, *hi].into_iter());
        let place = |v: f64| axis.place(v).unwrap_or(0.0);
        let (from, to) = (place(*lo), place(*hi));
        // Even densities are not blown up into a pattern.
        let least = if axis.logarithmic { 0.05 } else { 0.1 * to.abs() }.max(f64::MIN_POSITIVE);
        let widen = 0.5 * (least - (to - from)).max(0.0);
        Self::Sequential(axis, (from - widen, to + widen))
    }

    /// The place of a value among the colors, from 0 to 1.
    fn place(&self, value: f64) -> f64 {
        match self {
            Self::Sequential(axis, (lo, hi)) => axis.place(value).map_or(f64::NAN, |v| (v - lo) / (hi - lo)),
            Self::Diverging(_, range) => 0.5 + 0.5 * value / range,
            Self::Categories(_) => value,
        }
    }

    fn color(&self, place: f64) -> Rgb {
        match self {
            Self::Diverging(..) => diverging(2.0 * place - 1.0),
            _ => sequential(place),
        }
    }

    /// Values, row by row from the bottom, as pixels.
    pub fn image(&self, pixels: [usize; 2], values: &[f64]) -> Image {
        let size = (pixels[0], pixels[1]);
        if let Self::Categories(names) = self {
            let rows = (0..size.1).rev().flat_map(|row| &values[row * size.0..(row + 1) * size.0]);
            let pixels = rows.map(|v| v.is_finite().then_some(*v as u8)).collect();
            return Image {
                width: size.0,
                height: size.1,
                palette: (0..names.len()).map(categorical).collect(),
                pixels,
            };
        }
        let places: Vec<f64> = values.iter().map(|v| self.place(*v)).collect();
        Image::shaded(size, &places, |t| self.color(t))
    }
}

/// An arrow from a place in the plane, in the units of the axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrow {
    pub from: [f64; 2],
    pub by: [f64; 2],
}

pub(super) struct Map<'a> {
    pub title: String,
    pub caption: String,
    pub view: &'a View,
    pub labels: [String; 2],
    /// Row by row from the bottom; what is not finite is left free.
    pub values: Vec<f64>,
    pub scale: Scale,
    pub arrows: Vec<Arrow>,
}

const WIDTH: f64 = 440.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 44.0;
/// Of the bar with its ticks and label.
const BAR: f64 = 56.0;
/// Letters of a title that is written smaller.
const LONG: usize = 46;
/// Flattest and tallest picture, in its width.
const SHAPES: (f64, f64) = (0.25, 1.25);

impl Map<'_> {
    /// As a `figure` element of a page.
    ///
    /// # Errors
    /// A picture that cannot be encoded.
    pub fn html(&self) -> Result<String> {
        let view = self.view;
        let inner = WIDTH - LEFT - RIGHT;
        let shape = (view.hi[1] - view.lo[1]) / (view.hi[0] - view.lo[0]);
        let to_scale = (SHAPES.0..=SHAPES.1).contains(&shape) || !shape.is_finite();
        let mut width = inner;
        let mut height = inner * shape.clamp(SHAPES.0, SHAPES.1);
        if shape > SHAPES.1 && shape < 4.0 * SHAPES.1 {
            // Tall ones are kept to scale by making them narrower.
            width = height / shape;
        }
        let to_scale = to_scale || width < inner;
        if !height.is_finite() {
            height = inner;
        }
        let (bottom, right) = (TOP + height, LEFT + width);
        let total = bottom + BOTTOM + BAR;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {total:.0}\" role=\"img\">\
             <title>{0}</title>\n<text class=\"title\"{1} x=\"{LEFT}\" y=\"18\">{0}</text>\n",
            escape(&self.title),
            // As long as the line it stands on.
            if self.title.chars().count() > LONG { " style=\"font-size:11px\"" } else { "" }
        );
        let _ = writeln!(
            out,
            "<image {} preserveAspectRatio=\"none\" href=\"{}\"/>",
            rectangle((LEFT, TOP), (right, bottom)),
            self.scale.image(view.pixels, &self.values).data_uri()?
        );
        let place = |x: [f64; 2]| {
            let share = |i: usize| (x[i] - view.lo[i]) / (view.hi[i] - view.lo[i]);
            (LEFT + share(0) * width, bottom - share(1) * height)
        };
        for arrow in &self.arrows {
            out += &drawn(place(arrow.from), place([arrow.from[0] + arrow.by[0], arrow.from[1] + arrow.by[1]]));
        }
        let ticks = |i: usize, room: f64| {
            Axis::linear("").ticks((view.lo[i], view.hi[i]), (room / 70.0).clamp(2.0, 5.0) as usize)
        };
        for (value, text) in ticks(0, width) {
            let (x, _) = place([value, view.lo[1]]);
            let _ = writeln!(
                out,
                "<path class=\"frame\" d=\"M{x:.1} {bottom:.1}v4\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 17.0,
                escape(&text)
            );
        }
        for (value, text) in ticks(1, height) {
            let (_, y) = place([view.lo[0], value]);
            let _ = writeln!(
                out,
                "<path class=\"frame\" d=\"M{LEFT} {y:.1}h-4\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 6.0,
                y + 4.0,
                escape(&text)
            );
        }
        let _ = writeln!(
            out,
            "<rect class=\"frame\" {}/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            rectangle((LEFT, TOP), (right, bottom)),
            0.5 * (LEFT + right),
            bottom + 36.0,
            escape(&self.labels[0]),
            0.5 * (TOP + bottom),
            escape(&self.labels[1])
        );
        out += &self.bar(bottom + BOTTOM)?;
        let caption = match (to_scale, self.caption.as_str()) {
            (true, caption) => caption.to_owned(),
            (false, "") => "Not to scale.".into(),
            (false, caption) => format!("{caption} Not to scale."),
        };
        Ok(framed(&(out + "</svg>\n"), &caption))
    }

    /// The colors with their values, or the categories with their names.
    fn bar(&self, top: f64) -> Result<String> {
        let mut out = String::new();
        let (axis, (lo, hi)) = match &self.scale {
            Scale::Sequential(axis, ends) => (axis, *ends),
            Scale::Diverging(axis, range) => (axis, (-range, *range)),
            Scale::Categories(names) => {
                let step = (WIDTH - LEFT) / 4.0;
                for (i, name) in names.iter().enumerate() {
                    let (x, y) = (LEFT + step * (i % 4) as f64, top + 14.0 + 19.0 * (i / 4) as f64);
                    let [r, g, b] = categorical(i);
                    let _ = writeln!(
                        out,
                        "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"12\" height=\"12\" fill=\"#{r:02x}{g:02x}{b:02x}\"/><text x=\"{:.1}\" y=\"{y:.1}\">{}</text>",
                        y - 10.0,
                        x + 17.0,
                        escape(name)
                    );
                }
                return Ok(out);
            }
        };
        let shades: Vec<f64> = (0..256).map(|i| f64::from(i) / 255.0).collect();
        let strip = Image::shaded((256, 1), &shades, |t| self.scale.color(t)).data_uri()?;
        let (from, to) = (LEFT, WIDTH - RIGHT - 20.0);
        let _ = writeln!(
            out,
            "<image {0} preserveAspectRatio=\"none\" href=\"{strip}\"/><rect class=\"frame\" {0}/>",
            rectangle((from, top), (to, top + 12.0))
        );
        for (value, text) in axis.ticks((lo, hi), 5) {
            let x = from + (value - lo) / (hi - lo) * (to - from);
            let _ = writeln!(
                out,
                "<path class=\"frame\" d=\"M{x:.1} {:.1}v4\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                top + 12.0,
                top + 29.0,
                escape(&text)
            );
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            0.5 * (from + to),
            top + 48.0,
            escape(&axis.label)
        );
        Ok(out)
    }
}

/// An arrow that is seen on light and on dark.
fn drawn((x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> String {
    let (dx, dy) = (x1 - x0, y1 - y0);
    let length = dx.hypot(dy);
    if !(length > 0.5) {
        return String::new();
    }
    let (ux, uy) = (dx / length, dy / length);
    let head = (0.4 * length).clamp(2.0, 6.0);
    let side = |s: f64| (x1 - head * (ux - 0.5 * s * uy), y1 - head * (uy + 0.5 * s * ux));
    let (a, b) = (side(1.0), side(-1.0));
    let path = format!("M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}M{:.1} {:.1}L{x1:.1} {y1:.1}L{:.1} {:.1}", a.0, a.1, b.0, b.1);
    format!(
        "<path d=\"{path}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"3.2\" opacity=\".75\"/><path d=\"{path}\" fill=\"none\" stroke=\"#000\" stroke-width=\"1.3\"/>\n"
    )
}
