//! Figures as SVG text. Axes are linear or logarithmic; the viewer's own fonts are used.

use crate::error::{Error, Result};
use plotters::backend::SVGBackend;
use plotters::chart::ChartBuilder;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Text};
use plotters::series::LineSeries;
use plotters::style::{Color, RGBColor, WHITE};

/// One axis of a figure.
pub(super) struct Axis {
    pub label: &'static str,
    pub logarithmic: bool,
    /// What to show; all points by default.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    pub fn linear(label: &'static str) -> Self {
        Self { label, logarithmic: false, range: None }
    }

    pub fn logarithmic(label: &'static str) -> Self {
        Self { label, logarithmic: true, range: None }
    }

    /// Where a value lies on the axis; none for what a logarithm cannot show.
    fn place(&self, value: f64) -> Option<f64> {
        let placed = if self.logarithmic { value.log10() } else { value };
        placed.is_finite().then_some(placed)
    }

    /// The ends: whole decades, or the points with a margin.
    fn ends(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if lo > hi {
            return (0.0, 1.0);
        }
        if self.logarithmic {
            let (lo, hi) = ((lo - 0.02).floor(), (hi + 0.02).ceil());
            return (lo, hi.max(lo + 1.0));
        }
        let margin = 0.04 * (hi - lo).max(1e-9 * hi.abs()).max(f64::MIN_POSITIVE);
        (lo - margin, hi + margin)
    }

    fn text(&self, placed: f64) -> String {
        if !self.logarithmic {
            let text = format!("{placed:.4}");
            let plain = text.trim_end_matches('0').trim_end_matches('.');
            let exponent = (placed.abs() >= 1e5 || placed.abs() < 1e-3) && placed != 0.0;
            return if exponent { format!("{placed:.2e}") } else { plain.into() };
        }
        // Between the decades lines have no labels.
        if (placed - placed.round()).abs() < 1e-6 { format!("1e{}", placed.round()) } else { String::new() }
    }
}

/// Points with a name for the legend.
pub(super) struct Curve {
    pub name: String,
    pub color: RGBColor,
    /// Whether a line joins the points.
    pub joined: bool,
    /// Radius of the dots in pixels; 0 for none.
    pub dot: i32,
    pub points: Vec<(f64, f64)>,
}

/// Sizes of text, in the library's unit: 0.8 of these are pixels.
const TITLE: i32 = 19;
const LABEL: i32 = 15;

pub(super) struct Figure {
    pub title: String,
    pub size: (u32, u32),
    pub x: Axis,
    pub y: Axis,
    pub curves: Vec<Curve>,
}

/// Okabe and Ito's colors, which the color-blind tell apart, less the yellow that is hard to see on white.
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(130, 130, 130),
];

/// The color of the method in place `i`.
pub(super) fn color(i: usize) -> RGBColor {
    COLORS[i % COLORS.len()]
}

impl Figure {
    /// As an `svg` element.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn svg(&self) -> Result<String> {
        let mut text = String::new();
        self.draw(&mut text)
            .map_err(|e| Error::Numeric { stage: "report", problem: format!("figure '{}': {e}", self.title) })?;
        Ok(text)
    }

    fn draw(&self, text: &mut String) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let placed: Vec<Vec<(f64, f64)>> = self.curves.iter().map(|c| self.placed(c)).collect();
        let (x0, x1) = self.x.ends(placed.iter().flatten().map(|p| p.0));
        let (y0, y1) = self.y.ends(placed.iter().flatten().map(|p| p.1));
        let root = SVGBackend::with_string(text, self.size).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", TITLE))
            .margin(10)
            .margin_right(self.legend_width())
            .x_label_area_size(40)
            .y_label_area_size(62)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        let labels = |axis: &Axis, (a, b): (f64, f64)| {
            if axis.logarithmic { ((b - a).round() as usize + 1).clamp(2, 12) } else { 6 }
        };
        chart
            .configure_mesh()
            .x_desc(self.x.label)
            .y_desc(self.y.label)
            .x_labels(labels(&self.x, (x0, x1)))
            .y_labels(labels(&self.y, (y0, y1)))
            .max_light_lines(1)
            .label_style(("sans-serif", LABEL))
            .x_label_formatter(&|v| self.x.text(*v))
            .y_label_formatter(&|v| self.y.text(*v))
            .draw()?;
        for (curve, points) in self.curves.iter().zip(&placed) {
            let (color, dot) = (curve.color, curve.dot);
            let inside = points.iter().filter(|p| p.0 >= x0 && p.0 <= x1 && p.1 >= y0 && p.1 <= y1);
            let dots = inside.filter(|_| dot > 0).map(|p| Circle::new(*p, dot, color.filled()));
            chart.draw_series(dots)?;
            if curve.joined {
                chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?;
            }
        }
        self.legend(&root)?;
        root.present()?;
        Ok(())
    }

    /// Right of the axes, where no point is hidden.
    fn legend(&self, root: &DrawingArea<SVGBackend<'_>, Shift>) -> std::result::Result<(), Box<dyn std::error::Error>> {
        let left = self.size.0 as i32 - self.legend_width() + 8;
        for (i, curve) in self.curves.iter().enumerate() {
            let y = 40 + 18 * i as i32;
            root.draw(&PathElement::new(vec![(left, y), (left + 16, y)], curve.color.stroke_width(3)))?;
            root.draw(&Text::new(curve.name.clone(), (left + 21, y - 6), ("sans-serif", LABEL)))?;
        }
        Ok(())
    }

    fn legend_width(&self) -> i32 {
        let longest = self.curves.iter().map(|c| c.name.chars().count()).max().unwrap_or(0);
        40 + 7 * longest.min(30) as i32
    }

    fn placed(&self, curve: &Curve) -> Vec<(f64, f64)> {
        curve.points.iter().filter_map(|&(x, y)| Some((self.x.place(x)?, self.y.place(y)?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<(f64, f64)>) -> Figure {
        let curve = Curve { name: "a < b".into(), color: color(0), joined: true, dot: 3, points };
        let (x, y) = (Axis::logarithmic("x"), Axis::logarithmic("y"));
        Figure { title: "t".into(), size: (300, 200), x, y, curves: vec![curve] }
    }

    #[test]
    fn what_a_logarithm_cannot_show_is_left_out() {
        let points = vec![(1.0, 1e-3), (0.0, 1.0), (10.0, f64::NAN), (100.0, 1e-5)];
        let svg = figure(points).svg().unwrap();
        assert_eq!(svg.matches("<circle").count(), 2, "{svg}");
        assert!(svg.contains("1e-5") && svg.contains("a &lt; b") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn figures_without_points_or_with_one_are_drawn() {
        for points in [vec![], vec![(3.0, 3.0)]] {
            assert!(figure(points.clone()).svg().is_ok());
            let mut linear = figure(points);
            (linear.x, linear.y) = (Axis::linear("x"), Axis::linear("y"));
            assert!(linear.svg().is_ok());
        }
    }
}
