//! Axes of figures: the position of a value, and the ticks and their labels.

/// One axis of a figure.
#[derive(Debug, Clone)]
pub struct Axis {
    /// What is shown, with its unit.
    pub label: String,
    pub logarithmic: bool,
    /// What to show; all points by default.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: false, range: None }
    }

    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: true, range: None }
    }

    pub fn within(self, lo: f64, hi: f64) -> Self {
        Self { range: Some((lo, hi)), ..self }
    }

    /// Logarithmic if positive `values` span more than a factor of `MOST_LINEAR`.
    pub fn for_values(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let finite = values.filter(|v| v.is_finite());
        let (lo, hi) = finite.fold((f64::INFINITY, 0.0_f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if lo > 0.0 && hi > MOST_LINEAR * lo { Self::logarithmic(label) } else { Self::linear(label) }
    }

    /// Where a value lies on the axis; none for what a logarithm cannot show.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let placed = if self.logarithmic { value.log10() } else { value };
        placed.is_finite().then_some(placed)
    }

    /// The ends, for these placed values: whole decades, or the points with a margin.
    pub(super) fn ends(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some((lo, hi)) = self.range.and_then(|(lo, hi)| Some((self.place(lo)?, self.place(hi)?)))
            && lo < hi
        {
            return (lo, hi);
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

    /// Where ticks are, about `count` of them, and what is written there.
    pub(super) fn ticks(&self, (lo, hi): (f64, f64), count: usize) -> Vec<(f64, String)> {
        if self.logarithmic && hi - lo > 1.5 {
            let every = ((hi - lo) / count as f64).ceil().max(1.0);
            let first = (lo / every - 1e-9).ceil() as i64;
            let last = (hi / every + 1e-9).floor() as i64;
            if last - first < 2 {
                return ticks_within_decades(lo, hi);
            }
            return (first..=last).map(|i| i as f64 * every).map(|p| (p, power_of_ten(p as i32))).collect();
        }
        if self.logarithmic {
            let (from, to) = (10f64.powf(lo), 10f64.powf(hi));
            return linear_ticks(from, to, count).into_iter().map(|(v, text)| (v.log10(), text)).collect();
        }
        linear_ticks(lo, hi, count)
    }
}

/// Larger contrasts are shown on a logarithmic axis.
pub(super) const MOST_LINEAR: f64 = 30.0;

/// Ticks of a logarithmic axis that has few powers of ten: with multiples of them between, some six in all.
fn ticks_within_decades(lo: f64, hi: f64) -> Vec<(f64, String)> {
    let multiples: &[f64] = if hi - lo > 2.0 { &[1.0, 3.0] } else { &[1.0, 2.0, 5.0] };
    let decades = lo.floor() as i32..=hi.floor() as i32;
    let all = decades.flat_map(|p| multiples.iter().map(move |m| (p, *m)));
    let tick = |(p, m): (i32, f64)| {
        let is_plain = (-2..4).contains(&p);
        let text = if m == 1.0 && !is_plain { power_of_ten(p) } else { rounded(m * 10f64.powi(p)) };
        (f64::from(p) + m.log10(), text)
    };
    all.map(tick).filter(|t| t.0 >= lo - 1e-9 && t.0 <= hi + 1e-9).collect()
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks(lo: f64, hi: f64, count: usize) -> Vec<(f64, String)> {
    let rough = (hi - lo) / count.max(1) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let decade = 10f64.powf(rough.log10().floor());
    let step = decade * [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * decade >= 0.999 * rough).unwrap_or(10.0);
    let (first, last) = ((lo / step - 1e-6).ceil(), (hi / step + 1e-6).floor());
    // An interval far from 0 that is narrower than its numbers' digits has no ticks to tell apart.
    if !(last - first <= 100.0) {
        return Vec::new();
    }
    let ticks = (0..=(last - first).max(0.0) as usize).map(|i| (first + i as f64) * step);
    let most = lo.abs().max(hi.abs());
    ticks.map(|v| (v, number(if v.abs() < 1e-9 * step { 0.0 } else { v }, step, most))).collect()
}

/// A tick's number with the digits that tell it from its neighbors; `most` is the largest on the axis.
fn number(value: f64, step: f64, most: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if (1e-3..1e5).contains(&most) {
        let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
        return format!("{value:.decimals$}").replace('-', "\u{2212}");
    }
    let exponent = most.log10().floor();
    let decimals = (exponent - step.log10().floor()).clamp(0.0, 6.0) as usize;
    let mantissa = value / 10f64.powf(exponent);
    let power = power_of_ten(exponent as i32);
    format!("{mantissa:.decimals$}\u{b7}{power}").replace('-', "\u{2212}")
}

/// 10 with the exponent above it.
pub(super) fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0 => "1".into(),
        1 => "10".into(),
        _ => exponent.to_string().chars().fold(String::from("10"), |text, c| text + superscript(c)),
    }
}

fn superscript(c: char) -> &'static str {
    match c {
        '-' => "\u{207b}",
        '1' => "\u{b9}",
        '2' => "\u{b2}",
        '3' => "\u{b3}",
        '4' => "\u{2074}",
        '5' => "\u{2075}",
        '6' => "\u{2076}",
        '7' => "\u{2077}",
        '8' => "\u{2078}",
        '9' => "\u{2079}",
        _ => "\u{2070}",
    }
}

/// A number in prose: three digits, with a power of ten where it is large or small.
pub(super) fn rounded(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !value.is_finite() || (1e-2..1e4).contains(&size) {
        let decimals = if size == 0.0 { 0 } else { (2.0 - size.log10().floor()).clamp(0.0, 4.0) as usize };
        let text = format!("{value:.decimals$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text };
    }
    let exponent = size.log10().floor();
    let mantissa = format!("{:.2}", value / 10f64.powf(exponent));
    format!("{}\u{b7}{}", mantissa.trim_end_matches('0').trim_end_matches('.'), power_of_ten(exponent as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis, ends: (f64, f64)) -> Vec<String> {
        axis.ticks(ends, 5).into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round_and_written_with_the_digits_they_need() {
        let linear = Axis::linear("x");
        assert_eq!(
            texts(&linear, (0.0, 1.0)),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"].map(|t| t.replace("0.0", "0"))
        );
        assert_eq!(texts(&linear, (-3.0e10, 3.0e10))[0], "\u{2212}2\u{b7}10\u{b9}\u{2070}");
        assert_eq!(texts(&Axis::logarithmic("y"), (-6.0, -1.0))[0], "10\u{207b}\u{2076}");
        assert_eq!(texts(&Axis::logarithmic("y"), (0.0, 1.0)), ["2", "4", "6", "8", "10"]);
        assert_eq!(texts(&Axis::logarithmic("y"), (-0.6, 0.95)), ["0.5", "1", "2", "5"]);
        assert_eq!(texts(&Axis::logarithmic("y"), (-7.2, -4.9)).len(), 3);
        assert_eq!(
            texts(&Axis::logarithmic("y"), (-7.2, -5.1))[..2],
            ["10\u{207b}\u{2077}", "3\u{b7}10\u{207b}\u{2077}"]
        );
        assert_eq!(rounded(0.012_345), "0.0123");
        assert_eq!(rounded(1.5e-7), "1.5\u{b7}10\u{207b}\u{2077}");
        assert_eq!(rounded(1234.0), "1234");
    }

    #[test]
    fn axes_of_nothing_or_of_one_value_have_ends() {
        for axis in [Axis::linear("x"), Axis::logarithmic("x")] {
            for values in [vec![], vec![3.0], vec![1e300], vec![0.0]] {
                let (lo, hi) = axis.ends(values.into_iter().filter_map(|v| axis.place(v)));
                assert!(lo < hi, "{lo} {hi}");
                assert!(axis.ticks((lo, hi), 6).len() < 110);
            }
        }
    }
}
