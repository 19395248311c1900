//! Colors: color maps by formula in Oklch (B. Ottosson 2020, "A perceptual color space for image processing"), in which lightness is perceived
//! lightness, so that color-blind readers can tell colors apart, also in gray; and the palette of Okabe and Ito for curves.

/// Red, green and blue.
pub type Rgb = [u8; 3];

/// How many colors curves take in turn.
pub const CURVES: usize = 7;

/// Okabe and Ito's colors, less the yellow that is hard to see on white, as CSS variables of a page.
pub(super) const LIGHT: [&str; CURVES] = ["#0072b2", "#d55e00", "#009e73", "#b8548f", "#b97a00", "#3a9bd9", "#777777"];
/// The same hues for a dark page.
pub(super) const DARK: [&str; CURVES] = ["#56b4e9", "#ff8a3d", "#2fc49a", "#e79cc8", "#f0b429", "#a5d8f7", "#a8a8a8"];

/// The color of curve `i` as CSS.
pub(super) fn curve_color(i: usize) -> String {
    format!("var(--c{})", i % CURVES)
}

/// From 0 (dark violet) to 1 (light yellow), each step as much lighter as the one before.
pub(super) fn sequential(t: f64) -> Rgb {
    let t = t.clamp(0.0, 1.0);
    from_oklch(0.22 + 0.73 * t, 0.15, 295.0 - 190.0 * t)
}

/// From -1 (blue) through 0 (nearly white) to 1 (orange).
pub(super) fn diverging(t: f64) -> Rgb {
    let strength = t.clamp(-1.0, 1.0).abs();
    from_oklch(0.97 - 0.45 * strength, 0.17 * strength, if t < 0.0 { 250.0 } else { 47.0 })
}

/// The color of material `i`: Okabe and Ito's as they are, since areas are seen on any ground.
pub(super) fn categorical(i: usize) -> Rgb {
    const COLORS: [Rgb; 8] = [
        [230, 159, 0],
        [0, 114, 178],
        [0, 158, 115],
        [204, 121, 167],
        [86, 180, 233],
        [213, 94, 0],
        [240, 228, 66],
        [120, 120, 120],
    ];
    COLORS[i.min(COLORS.len() - 1)]
}

/// How many materials have a color of their own; the rest share one more.
pub(super) const MATERIALS: usize = 7;

/// The color with this lightness and hue (in degrees), with as much of `chroma` as a screen can show.
fn from_oklch(lightness: f64, chroma: f64, hue: f64) -> Rgb {
    let (sin, cos) = hue.to_radians().sin_cos();
    let at = |c: f64| linear_srgb([lightness, c * cos, c * sin]);
    let fits = |rgb: [f64; 3]| rgb.iter().all(|v| (-1e-4..=1.0001).contains(v));
    let (mut inside, mut outside) = (0.0, chroma);
    if fits(at(chroma)) {
        inside = chroma;
    } else {
        for _ in 0..20 {
            let middle = 0.5 * (inside + outside);
            if fits(at(middle)) { inside = middle } else { outside = middle }
        }
    }
    at(inside).map(|v| (255.0 * encoded(v.clamp(0.0, 1.0))).round() as u8)
}

/// Oklab to linear sRGB, with the matrices of the source above.
fn linear_srgb([l, a, b]: [f64; 3]) -> [f64; 3] {
    let l_ = (l + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m_ = (l - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s_ = (l - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l_ - 3.307_711_591_3 * m_ + 0.230_969_929_2 * s_,
        -1.268_438_004_6 * l_ + 2.609_757_401_1 * m_ - 0.341_319_396_5 * s_,
        -0.004_196_086_3 * l_ - 0.703_418_614_7 * m_ + 1.707_614_701_0 * s_,
    ]
}

/// IEC 61966-2-1.
fn encoded(v: f64) -> f64 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance, as the eye weighs the three.
    fn luminance(rgb: Rgb) -> f64 {
        let linear = |v: u8| {
            let v = f64::from(v) / 255.0;
            if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(rgb[0]) + 0.7152 * linear(rgb[1]) + 0.0722 * linear(rgb[2])
    }

    #[test]
    fn the_map_grows_lighter_at_every_step_and_the_other_to_its_middle() {
        let steps: Vec<f64> = (0..=32).map(|i| luminance(sequential(f64::from(i) / 32.0))).collect();
        assert!(steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
        assert!(steps[0] < 0.03 && steps[32] > 0.7, "{steps:?}");
        for side in [-1.0, 1.0] {
            let steps: Vec<f64> = (0..=16).map(|i| luminance(diverging(side * f64::from(i) / 16.0))).collect();
            assert!(steps.windows(2).all(|w| w[1] < w[0]), "{steps:?}");
        }
        let [low, high] = [diverging(-1.0), diverging(1.0)];
        assert!(low[2] > 150 && low[0] < 80 && high[0] > 150 && high[2] < 80, "{low:?} {high:?}");
    }
}
