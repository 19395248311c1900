//! The panel of pictures as SVG: blue where the density is too low, red where too high; up to 5 % in the left half
//! of each picture, up to 1 % in the right half, as in the paper.

use crate::setups::{Measure, PIXELS};
use std::fmt::Write;

const CELL: usize = 3;
const GAP: usize = 26;
const COLUMNS: usize = 4;

/// From blue through white to red.
fn color(value: f64, range: f64) -> String {
    let t = (value / range).clamp(-1.0, 1.0);
    let (strong, weak) = (255.0, 255.0 * (1.0 - t.abs()));
    let (r, b) = if t > 0.0 { (strong, weak) } else { (weak, strong) };
    format!("#{:02x}{:02x}{:02x}", r as u8, weak as u8, b as u8)
}

pub fn panel(found: &[(&'static str, Result<Measure, String>)]) -> String {
    let edge = PIXELS * CELL;
    let step = edge + GAP;
    let rows = found.len().div_ceil(COLUMNS);
    let (width, height) = (COLUMNS * step + GAP, rows * step + GAP);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" shape-rendering=\"crispEdges\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (i, (name, measured)) in found.iter().enumerate() {
        let (x, y) = (GAP / 2 + i % COLUMNS * step, GAP + i / COLUMNS * step);
        writeln!(out, "<text x=\"{x}\" y=\"{}\" font-family=\"sans-serif\" font-size=\"13\">{name}</text>", y - 6)
            .unwrap();
        let Ok(m) = measured else { continue };
        for row in 0..PIXELS {
            let mut column = 0;
            while column < PIXELS {
                let shade = |c: usize| color(m.pixels[row * PIXELS + c], if 2 * c < PIXELS { 0.05 } else { 0.01 });
                let (first, fill) = (column, shade(column));
                while column < PIXELS && shade(column) == fill {
                    column += 1;
                }
                // The first row is at the bottom, where y is lowest.
                writeln!(
                    out,
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{CELL}\" fill=\"{fill}\"/>",
                    x + first * CELL,
                    y + (PIXELS - 1 - row) * CELL,
                    (column - first) * CELL
                )
                .unwrap();
            }
        }
    }
    out + "</svg>\n"
}
