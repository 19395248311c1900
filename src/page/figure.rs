//! Figures of curves as SVG. Their colors follow the surrounding page, including a dark one, and they use the viewer's own fonts.

use super::axis::Axis;
use super::color::curve_color;
use super::html::{escape, style_of_drawing};
use std::fmt::Write;

/// How points are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    Line,
    /// Dots of this radius.
    Dots(f64),
    /// A line through dots of this radius.
    LineAndDots(f64),
    /// Steps: each point is the left end of a level, the last one the right end of the last level.
    Steps,
}

/// Points with a name for the legend.
#[derive(Debug, Clone)]
pub struct Curve {
    pub name: String,
    /// The place of its color among those of curves; none for the color of the text.
    pub color: Option<usize>,
    pub mark: Mark,
    pub dashed: bool,
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    pub fn line(name: impl Into<String>, color: Option<usize>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), color, mark: Mark::Line, dashed: false, points }
    }
}

/// An area between two values at each place, in the color of a curve.
#[derive(Debug, Clone)]
pub struct Band {
    pub name: String,
    pub color: usize,
    /// (place, lower, upper).
    pub edges: Vec<(f64, f64, f64)>,
}

#[derive(Debug, Clone)]
pub struct Figure {
    pub title: String,
    /// Below the figure; empty for none.
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    pub bands: Vec<Band>,
    pub curves: Vec<Curve>,
    /// What the shaded ranges of x are.
    pub shade_name: String,
    pub shades: Vec<(f64, f64)>,
}

const WIDTH: f64 = 440.0;
/// Of the axes.
const HEIGHT: f64 = 240.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 28.0;
/// For ticks and label below the axes.
const BOTTOM: f64 = 44.0;
/// Of a row of the legend.
const ROW: f64 = 19.0;
/// Of a letter, on average.
const LETTER: f64 = 7.0;

/// The axes of a figure on its canvas.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
}

impl Frame {
    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (u, v) = ((x - self.x.0) / (self.x.1 - self.x.0), (y - self.y.0) / (self.y.1 - self.y.0));
        (LEFT + u * (WIDTH - LEFT - RIGHT), TOP + HEIGHT * (1.0 - v))
    }
}

impl Figure {
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, curves: Vec<Curve>) -> Self {
        let (title, caption, shade_name) = (title.into(), String::new(), String::new());
        Self { title, caption, x, y, bands: Vec::new(), curves, shade_name, shades: Vec::new() }
    }

    /// As a `figure` element of a page.
    pub fn html(&self) -> String {
        framed(&self.svg(), &self.caption)
    }

    /// As an SVG file of its own.
    pub fn file(&self) -> String {
        self.svg().replacen('>', &format!(">{}", style_of_drawing()), 1) + "\n"
    }

    fn svg(&self) -> String {
        let places = |f: fn(&(f64, f64)) -> f64| self.curves.iter().flat_map(|c| &c.points).map(f);
        let xs = places(|p| p.0).chain(self.bands.iter().flat_map(|b| &b.edges).map(|e| e.0));
        let ys = places(|p| p.1).chain(self.bands.iter().flat_map(|b| &b.edges).flat_map(|e| [e.1, e.2]));
        let frame = Frame {
            x: self.x.ends(xs.filter_map(|v| self.x.place(v))),
            y: self.y.ends(ys.filter_map(|v| self.y.place(v))),
        };
        let legend = self.legend();
        let height = TOP + HEIGHT + BOTTOM + ROW * legend.1 as f64;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\">\
             <title>{0}</title>\n<text class=\"title\" x=\"{LEFT}\" y=\"18\">{0}</text>\n",
            escape(&self.title)
        );
        for shade in &self.shades {
            let (Some(a), Some(b)) = (self.x.place(shade.0), self.x.place(shade.1)) else { continue };
            let (a, b) = (a.clamp(frame.x.0, frame.x.1), b.clamp(frame.x.0, frame.x.1));
            let (from, to) = (frame.place((a, frame.y.1)), frame.place((b, frame.y.0)));
            let _ = writeln!(out, "<rect class=\"shade\" {}/>", rectangle(from, to));
        }
        out += &axes(&frame, (&self.x, &self.y));
        self.bands.iter().for_each(|band| out += &self.band(&frame, band));
        self.curves.iter().for_each(|curve| out += &self.curve(&frame, curve));
        out + &legend.0 + "</svg>\n"
    }

    fn placed(&self, frame: &Frame, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let (x, y) = (self.x.place(x)?, self.y.place(y)?);
        // What is beyond the axes is drawn at their edge, where a line shows that it leaves.
        Some(frame.place((x.clamp(frame.x.0, frame.x.1), y.clamp(frame.y.0, frame.y.1))))
    }

    fn band(&self, frame: &Frame, band: &Band) -> String {
        // A logarithm has no place for 0: the band then ends at the lower edge of the figure.
        let end = |x: f64, y: f64| self.placed(frame, (x, y)).or(Some((self.placed(frame, (x, 1.0))?.0, TOP + HEIGHT)));
        let upper = band.edges.iter().filter_map(|&(x, _, hi)| end(x, hi));
        let lower = band.edges.iter().rev().filter_map(|&(x, lo, _)| end(x, lo));
        let points: Vec<String> = upper.chain(lower).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        format!(
            "<polygon points=\"{}\" style=\"fill:{}\" opacity=\".25\"/>\n",
            points.join(" "),
            curve_color(band.color)
        )
    }

    fn curve(&self, frame: &Frame, curve: &Curve) -> String {
        let color = curve.color.map_or_else(|| "var(--ink)".into(), curve_color);
        let points = match curve.mark {
            Mark::Steps => steps(&curve.points),
            _ => curve.points.clone(),
        };
        let placed: Vec<(f64, f64)> = points.iter().filter_map(|p| self.placed(frame, *p)).collect();
        let mut out = String::new();
        if !matches!(curve.mark, Mark::Dots(_)) && placed.len() > 1 {
            let line: Vec<String> = placed.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let dash = if curve.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
            let _ = writeln!(
                out,
                "<polyline points=\"{}\" style=\"stroke:{color}\" fill=\"none\" stroke-width=\"2\" stroke-linejoin=\"round\"{dash}/>",
                line.join(" ")
            );
        }
        if let Mark::Dots(radius) | Mark::LineAndDots(radius) = curve.mark {
            let _ = write!(out, "<g style=\"fill:{color}\">");
            for (x, y) in &placed {
                let _ = write!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>");
            }
            out += "</g>\n";
        }
        out
    }

    /// Below the axes, where no point is hidden; with how many rows it takes.
    fn legend(&self) -> (String, usize) {
        let mut entries: Vec<(String, &str)> = Vec::new();
        for curve in self.curves.iter().filter(|c| !c.name.is_empty()) {
            let color = curve.color.map_or_else(|| "var(--ink)".into(), curve_color);
            let dash = if curve.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
            let key = match curve.mark {
                Mark::Dots(_) => format!("<circle cx=\"10\" cy=\"-4\" r=\"4\" style=\"fill:{color}\"/>"),
                _ => format!(
                    "<line x1=\"0\" x2=\"20\" y1=\"-4\" y2=\"-4\" style=\"stroke:{color}\" stroke-width=\"3\"{dash}/>"
                ),
            };
            entries.push((key, &curve.name));
        }
        for band in self.bands.iter().filter(|b| !b.name.is_empty()) {
            let color = curve_color(band.color);
            let key = format!("<rect width=\"20\" height=\"11\" y=\"-10\" style=\"fill:{color}\" opacity=\".25\"/>");
            entries.push((key, &band.name));
        }
        if !self.shades.is_empty() {
            entries.push(("<rect class=\"shade\" width=\"20\" height=\"11\" y=\"-10\"/>".into(), &self.shade_name));
        }
        if entries.len() == 1 && self.shades.is_empty() && self.bands.is_empty() {
            return (String::new(), 0);
        }
        let (mut out, mut rows, mut x) = (String::new(), usize::from(!entries.is_empty()), 8.0);
        for (key, name) in entries {
            let width = 44.0 + LETTER * name.chars().count() as f64;
            if x > 8.0 && x + width > WIDTH {
                (rows, x) = (rows + 1, 8.0);
            }
            let y = TOP + HEIGHT + BOTTOM + ROW * rows as f64 - 5.0;
            let text = escape(name);
            let _ = writeln!(out, "<g transform=\"translate({x:.0} {y:.0})\">{key}<text x=\"26\">{text}</text></g>");
            x += width;
        }
        (out, rows)
    }
}

/// A drawing with a line below it.
pub(super) fn framed(svg: &str, caption: &str) -> String {
    let caption =
        if caption.is_empty() { String::new() } else { format!("<figcaption>{}</figcaption>\n", escape(caption)) };
    format!("<figure>\n{svg}{caption}</figure>\n")
}

fn steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(2 * points.len());
    for &(x, y) in points {
        if let Some(&(_, before)) = out.last() {
            out.push((x, before));
        }
        out.push((x, y));
    }
    out
}

/// Attributes of the rectangle between two corners.
pub(super) fn rectangle((x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> String {
    format!("x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{:.1}\" height=\"{:.1}\"", (x1 - x0).max(0.0), (y1 - y0).max(0.0))
}

/// Grid, ticks, labels and frame.
fn axes(frame: &Frame, (x, y): (&Axis, &Axis)) -> String {
    let mut out = String::new();
    let bottom = TOP + HEIGHT;
    for (value, text) in x.ticks(frame.x, 6) {
        let (px, _) = frame.place((value, frame.y.0));
        let _ = writeln!(
            out,
            "<path class=\"grid\" d=\"M{px:.1} {TOP}V{bottom}\"/><text x=\"{px:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 17.0,
            escape(&text)
        );
    }
    for (value, text) in y.ticks(frame.y, 6) {
        let (_, py) = frame.place((frame.x.0, value));
        let _ = writeln!(
            out,
            "<path class=\"grid\" d=\"M{LEFT} {py:.1}H{}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            WIDTH - RIGHT,
            LEFT - 5.0,
            py + 4.0,
            escape(&text)
        );
    }
    let _ = writeln!(
        out,
        "<rect class=\"frame\" {}/><text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
         <text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        rectangle((LEFT, TOP), (WIDTH - RIGHT, bottom)),
        0.5 * (LEFT + WIDTH - RIGHT),
        bottom + 36.0,
        escape(&x.label),
        0.5 * (TOP + bottom),
        escape(&y.label)
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<(f64, f64)>) -> Figure {
        let curve = Curve { mark: Mark::LineAndDots(3.0), ..Curve::line("a < b", Some(0), points) };
        Figure::new("t", Axis::logarithmic("x [cm]"), Axis::logarithmic("y [s]"), vec![curve.clone(), curve])
    }

    #[test]
    fn what_a_logarithm_cannot_show_is_left_out() {
        let points = vec![(1.0, 1e-3), (0.0, 1.0), (10.0, f64::NAN), (100.0, 1e-5)];
        let svg = figure(points).file();
        assert_eq!(svg.matches("r=\"3\"").count(), 2 * 2, "{svg}");
        assert!(svg.contains("10\u{207b}\u{2076}") && svg.contains("a &lt; b") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn figures_without_points_or_with_one_are_drawn() {
        for points in [vec![], vec![(3.0, 3.0)], vec![(1e300, 1e-300)], vec![(f64::INFINITY, f64::NAN)]] {
            let mut all = figure(points);
            for linear in [false, true] {
                if linear {
                    (all.x, all.y) = (Axis::linear("x"), Axis::linear("y"));
                }
                let svg = all.html();
                assert!(svg.contains("x [cm]") || linear);
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
    }
}
