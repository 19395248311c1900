//! Checks before a run whether it fits in the machine's memory.

use crate::error::{Error, Result};
use crate::relaxation::{BALANCE, SOLVER, StageName};
use crate::target::Target;
use crate::target::mass_points::MassPoints;
use crate::target::matter::Matter;
use std::fmt::Write;
use std::path::Path;

/// Bytes per particle at the peak of runs without a solver: 211 with WVT, 202 with bare shells (1e8 particles of `profiles/star.nc`).
const PLAIN: f64 = 220.0;
/// The same with the density solver: 285 once its history is full (6e6 particles of `profiles/star.nc`), and 24 more where two kernels take turns.
const SOLVED: f64 = 320.0;
/// The same with balance.
const BALANCED: f64 = 480.0;

/// The same of ranks among several, where measures hold particles of others, too: 432 with WVT, 571 with the solver, with two or eight ranks
/// of 1.6e6 particles in a uniform box.
const PLAIN_ON_RANKS: f64 = 440.0;
const SOLVED_ON_RANKS: f64 = 580.0;

/// Bytes of the program itself with the cells that a target is divided into: 44 MiB of a smooth box of 1000 particles.
const OWN: f64 = 44.0 * 1024.0 * 1024.0;
/// Bytes per particle of the points of mass by which a target with jumps is smoothed, in 3-D: 6.1e3 of a thin layer of 1e5 particles, 5.2e3 of one of
/// 1e4. There are a quarter of them in 2-D, and none for more particles than [`MassPoints`] allows.
const POINTS: f64 = 6.5e3;

/// Bytes that a run takes beside what it takes by particle, where `target` may have jumps.
pub fn beside<const D: usize>(target: &Target<'_, D>) -> f64 {
    let are_made = target.may_jump() && !MassPoints::are_too_many(target);
    OWN + if are_made { POINTS / 4_f64.powi(3 - D as i32) * target.count as f64 } else { 0.0 }
}

fn is_solved(stages: &[StageName]) -> bool {
    stages.iter().any(|stage| *stage == SOLVER || *stage == BALANCE)
}

/// Bytes that a rank with `count` particles takes at its peak.
pub fn needed_by_rank(count: usize, stages: &[StageName]) -> f64 {
    count as f64 * if is_solved(stages) { SOLVED_ON_RANKS } else { PLAIN_ON_RANKS }
}

/// Bytes that a run of `count` particles takes at its peak.
pub fn needed(count: usize, stages: &[StageName]) -> f64 {
    let each = if stages.contains(&BALANCE) {
        BALANCED
    } else if stages.contains(&SOLVER) {
        SOLVED
    } else {
        PLAIN
    };
    count as f64 * each
}

/// Refuses what cannot fit, with the number of particles that does.
///
/// # Errors
/// [`Error::Scene`] where more memory is needed than the machine has.
pub fn check(count: usize, stages: &[StageName]) -> Result<()> {
    check_against(count, stages, total())
}

/// [`check`] for particles that are shared by `ranks`, so many of which are `here`; other machines are taken for the same.
///
/// # Errors
/// Those of [`check`], with the memory of all machines.
pub fn check_among(count: usize, stages: &[StageName], (here, ranks): (usize, usize)) -> Result<()> {
    if ranks == 1 {
        return check(count, stages);
    }
    check_ranks(count, stages, total().map(|bytes| bytes * ranks as f64 / here.max(1) as f64))
}

/// [`check`] where one of several blocks, of so many particles with those about it, is held at a time.
///
/// # Errors
/// [`Error::Scene`] where a block takes more memory than the machine has.
pub fn check_block(count: usize, stages: &[StageName]) -> Result<()> {
    let needs = needed(count, stages);
    let Some(total) = total().filter(|total| needs > *total) else { return Ok(()) };
    let problem = format!(
        "makes blocks that take some {:.1} GiB each, more than the {:.1} GiB of this machine; use {:.0} times as many (--in-turn)",
        needs / GIB,
        total / GIB,
        (2.0 * needs / total).ceil()
    );
    Err(Error::scene("particles", problem))
}

fn check_ranks(count: usize, stages: &[StageName], total: Option<f64>) -> Result<()> {
    let needs = needed_by_rank(count, stages);
    let Some(total) = total.filter(|total| needs > *total) else { return Ok(()) };
    let fits = |stages: &[StageName]| rounded_down(total * count as f64 / needed_by_rank(count, stages));
    let solved = if is_solved(stages) { format!(", -n {} with --polish none", fits(&[])) } else { String::new() };
    let problem = format!(
        "is {count}, which takes some {:.0} GiB of memory at {:.0} bytes a particle over ranks, more than the {:.1} GiB of their machines: \
         -n {} fits{solved}, or ranks on more machines",
        needs / GIB,
        needs / count as f64,
        total / GIB,
        fits(stages)
    );
    Err(Error::scene("particles", problem))
}

fn check_against(count: usize, stages: &[StageName], total: Option<f64>) -> Result<()> {
    let needs = needed(count, stages);
    let Some(total) = total.filter(|total| needs > *total) else { return Ok(()) };
    let fits = |stages: &[StageName]| rounded_down(total * count as f64 / needed(count, stages));
    let solved = if needed(count, stages) > needed(count, &[]) {
        format!(", or -n {} with --polish none and no balance", fits(&[]))
    } else {
        String::new()
    };
    let problem = format!(
        "is {count}, which takes some {:.0} GiB of memory at {:.0} bytes a particle, more than the {:.1} GiB that there are: -n {} fits{solved}; \
         --in-turn {:.0} holds one block at a time",
        needs / GIB,
        needs / count as f64,
        total / GIB,
        fits(stages),
        (4.0 * needs / total).ceil()
    );
    Err(Error::scene("particles", problem))
}

const GIB: f64 = (1_u64 << 30) as f64;

/// Two digits, so that it is no promise.
fn rounded_down(count: f64) -> String {
    let power = count.max(1.0).log10().floor() - 1.0;
    format!("{:e}", (count / 10_f64.powf(power)).floor() * 10_f64.powf(power))
}

/// Bytes of memory that the machine, or the container, has; `None` where the system does not tell.
pub fn total() -> Option<f64> {
    let machine = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| kib_of(&text, "MemTotal:"));
    let limits = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
    let container = limits.iter().find_map(|path| std::fs::read_to_string(Path::new(path)).ok()?.trim().parse().ok());
    match (machine, container) {
        (Some(a), Some(b)) => Some(f64::min(a, b)),
        (a, b) => a.or(b),
    }
}

/// The most bytes of memory that this process has had at once; `None` where the system does not tell.
pub fn peak() -> Option<f64> {
    std::fs::read_to_string("/proc/self/status").ok().and_then(|text| kib_of(&text, "VmHWM:"))
}

/// Appends the line on [`peak`] to a report, where it is known.
pub(super) fn write_peak(out: &mut String, peak: Option<f64>, particles: usize) -> std::fmt::Result {
    peak.map_or(Ok(()), |peak| writeln!(out, "  memory           {}", describe(peak, particles)))
}

fn describe(peak: f64, particles: usize) -> String {
    let size = if peak < GIB { format!("{:.0} MiB", 1024.0 * peak / GIB) } else { format!("{:.2} GiB", peak / GIB) };
    // What the program itself takes counts for fewer.
    let each = (particles >= MANY).then(|| format!(", {:.0} bytes a particle", peak / particles as f64));
    format!("{size} at the peak{}", each.unwrap_or_default())
}

const MANY: usize = 1_000_000;

fn kib_of(text: &str, key: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kib)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relaxation::WVT;

    #[test]
    fn what_does_not_fit_is_refused_with_what_does() {
        let check = |count, stages: &[StageName]| check_against(count, stages, Some(24.0 * GIB));
        check(100_000_000, &[WVT]).unwrap();
        check(50_000_000, &[WVT, SOLVER]).unwrap();
        let error = check(1_000_000_000, &[WVT]).unwrap_err().to_string();
        for part in ["scene, particles", "1000000000", "205 GiB", "24.0 GiB", "-n 1.1e8 fits"] {
            assert!(error.contains(part), "{error}");
        }
        let error = check(100_000_000, &[WVT, SOLVER]).unwrap_err().to_string();
        assert!(error.contains("-n 8e7 fits, or -n 1.1e8 with --polish none"), "{error}");
        check_against(1_000_000_000, &[WVT], None).unwrap();
        check_ranks(40_000_000, &[WVT, SOLVER], Some(24.0 * GIB)).unwrap();
        let error = check_ranks(1_000_000_000, &[WVT, SOLVER], Some(24.0 * GIB)).unwrap_err().to_string();
        for part in ["540 GiB", "-n 4.4e7 fits, -n 5.8e7 with --polish none, or ranks on more"] {
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn the_machines_memory_is_read() {
        assert_eq!(kib_of("MemTotal:       24576 kB\nMemFree: 1 kB\n", "MemTotal:"), Some(24576.0 * 1024.0));
        assert_eq!(kib_of("nothing", "MemTotal:"), None);
        if cfg!(target_os = "linux") {
            assert!(total().is_some_and(|bytes| bytes > 1e8));
        }
    }

    #[test]
    fn the_peak_covers_what_was_held_and_is_told_by_particle_where_there_are_many() {
        let held = vec![1_u8; 64 << 20];
        if cfg!(target_os = "linux") {
            assert!(peak().is_some_and(|bytes| bytes > held.len() as f64));
        }
        assert_eq!(describe(0.5 * GIB, 1000), "512 MiB at the peak");
        assert_eq!(describe(2.0 * GIB, 10_000_000), "2.00 GiB at the peak, 215 bytes a particle");
    }
}
