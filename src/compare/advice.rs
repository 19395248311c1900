//! Recommends a method, with the reasons.

use super::comparison::{Comparison, MethodRun, State};
use std::fmt::Write;

/// Mean errors within this factor of the least count as the same, and so do noises: which is faster decides.
const SAME_ERROR: f64 = 1.5;
const SAME_NOISE: f64 = 1.25;
/// Mean errors below this count as the same, too: a tenth of what a verdict calls good. More digits are not worth more noise.
const FINE_ERROR: f64 = 1e-3;

/// Share of the mass that may be elsewhere than with the method that has most of it in place, and mean error of all particles up to which a
/// density is good.
const ELSEWHERE: f64 = 0.05;
const GOOD_ERROR: f64 = 0.01;

/// A set with more noise in its forces is no better than random points: it is chosen only where all are such.
const UNRESOLVED: f64 = 0.5;

/// A run with its last state.
type Result<'a> = (&'a MethodRun, &'a State);

/// In a sentence or two, from the runs with the most particles: of the methods that have the mass in place as well as any (but for 5 %), and all
/// particles within 1.5 times the least error from the smoothed target, or 1 %, those whose mean error is within 1.5 times the least, or below 0.1 %,
/// those whose force noise is within 1.25 times the least of them, and of these the fastest; none with more than half of a random set's noise
/// where there is another. `None` where fewer than two ran.
pub fn advice(comparison: &Comparison) -> Option<String> {
    let most = comparison.runs.iter().map(|r| r.particles).max()?;
    let all: Vec<Result<'_>> =
        comparison.runs.iter().filter(|r| r.particles == most).filter_map(|r| Some((r, r.last()?))).collect();
    if all.len() < 2 {
        return None;
    }
    let error = |r: &Result<'_>| r.1.shown_error().mean;
    let noise = |r: &Result<'_>| r.1.shown_noise();
    let (all, wrong) = parted(all);
    let resolved: Vec<Result<'_>> = all.iter().copied().filter(|r| !(noise(r) > UNRESOLVED)).collect();
    let usable = if resolved.is_empty() { &all } else { &resolved };
    let near = SAME_ERROR * least(usable, error);
    let exact: Vec<Result<'_>> = usable.iter().copied().filter(|r| error(r) <= near.max(FINE_ERROR)).collect();
    let bound = SAME_NOISE * least(&exact, noise);
    let quiet = exact.iter().copied().filter(|r| noise(r) <= bound);
    let chosen = quiet.min_by(|a, b| a.0.seconds.total_cmp(&b.0.seconds))?;
    let (run, state) = chosen;
    let mut out = format!(
        "Take {}: with {most} particles its density is off by {:.3} % on average, {}, and its force noise is {:.2} % of a random set's, in {:.2} s.",
        run.method,
        100.0 * error(&chosen),
        match error(&chosen) {
            e if e <= least(&all, error) && wrong.is_empty() => "the least of all",
            e if e <= least(&all, error) => "the least of those that are right everywhere",
            e if e <= SAME_ERROR * least(&all, error) && wrong.is_empty() => "about the least of all",
            e if e <= SAME_ERROR * least(&all, error) => "about the least of those that are right everywhere",
            e if e <= FINE_ERROR => "as good as exact",
            _ => "the least of those that are quieter than random points by half",
        },
        100.0 * state.shown_noise(),
        run.seconds
    );
    let others = || all.iter().filter(|r| r.0.method != run.method);
    if let Some(fast) =
        others().min_by(|a, b| a.0.seconds.total_cmp(&b.0.seconds)).filter(|f| f.0.seconds < run.seconds)
    {
        let _ = write!(
            out,
            " {} is faster ({:.2} s) and off by {:.3} %.",
            fast.0.method,
            fast.0.seconds,
            100.0 * error(fast)
        );
    }
    let close = others().min_by(|a, b| error(a).total_cmp(&error(b))).filter(|_| error(&chosen) > near);
    if let Some(close) = close {
        let _ = write!(
            out,
            " {} is closer ({:.3} %), with {:.2} % of noise.",
            close.0.method,
            100.0 * error(close),
            100.0 * noise(close)
        );
    }
    let calm = others().min_by(|a, b| noise(a).total_cmp(&noise(b))).filter(|c| SAME_NOISE * noise(c) < noise(&chosen));
    if let Some(calm) = calm {
        let _ = write!(
            out,
            " {} is quieter ({:.2} %) and off by {:.3} %.",
            calm.0.method,
            100.0 * noise(calm),
            100.0 * error(calm)
        );
    }
    if !wrong.is_empty() {
        let each = |r: &Result<'_>| {
            format!(
                "{} ({:.0} % of the mass in place, all particles off by {:.2} %)",
                r.0.method,
                100.0 * r.1.in_place,
                100.0 * r.1.overall_error()
            )
        };
        let _ = write!(
            out,
            " These are not right everywhere, with mass elsewhere or particles whose density is farther off: {}.",
            wrong.iter().map(each).collect::<Vec<_>>().join(", ")
        );
    }
    Some(out)
}

/// Those whose body is the target's, as far as any method has it, and those that have the mass elsewhere, or a density that is far off where
/// the figures of the interior do not look.
fn parted(all: Vec<Result<'_>>) -> (Vec<Result<'_>>, Vec<Result<'_>>) {
    let most_in_place = -least(&all, |r| -r.1.in_place);
    let least_error = least(&all, |r| r.1.overall_error());
    let is_right = |r: &Result<'_>| {
        r.1.in_place >= most_in_place - ELSEWHERE && r.1.overall_error() <= (SAME_ERROR * least_error).max(GOOD_ERROR)
    };
    let (right, wrong): (Vec<_>, Vec<_>) = all.iter().copied().partition(is_right);
    if right.is_empty() { (all, Vec::new()) } else { (right, wrong) }
}

/// The least of what is finite.
fn least(set: &[Result<'_>], value: impl Fn(&Result<'_>) -> f64) -> f64 {
    set.iter().map(value).filter(|v| v.is_finite()).fold(f64::INFINITY, f64::min)
}
