//! Estimates a run over ranks from a model: particles, memory, time and messages of a rank, and the size of the file.
//!
//! A rank's part of N particles over R ranks is taken for a cube of n = N/R particles in the middle of others, so that it sees all
//! within a support radius H of its outermost particles: (n^(1/d) + 2 H/s - 1)^d - n for a spacing s. Parts at the edge of an open domain see
//! fewer. Each step of WVT, and each evaluation of the density solver, sends their places and two numbers for each, where its particles are to
//! every rank, and a few totals to every rank. What that takes in reality was measured with up to 8 ranks, and is in the constants;
//! `tests/ranks.rs` compares.

use super::duration::{self, Cost, Expected, rounded};
use super::forecast::slowness;
use super::memory;
use super::ranks::{RANKS, refuse, refuse_few};
use super::streamed::Read;
use crate::error::Result;
use crate::input::internal_units::Prepared;
use crate::relaxation::SOLVER;
use crate::scene::{DEFAULT_PARTICLES, Scene};
use serde::Serialize;
use sph::kernel::support_over_spacing;
use sph_formats::FormatSpec;
use std::fmt::Write;

/// A run over ranks that is planned.
#[derive(Debug, Clone, Serialize)]
pub struct RankForecast {
    pub input: String,
    pub dimension: usize,
    pub particles: usize,
    pub ranks: usize,
    /// Of each rank.
    pub threads: usize,
    pub particles_of_a_rank: usize,
    /// Of other ranks that one in the middle sees.
    pub seen_of_others: usize,
    /// Bytes of a rank at its peak.
    pub memory: f64,
    pub stages: Vec<StageForecast>,
    /// Bytes of the file before it is compressed.
    pub file: f64,
    /// Seconds that the first rank takes to write it.
    pub seconds_to_write: f64,
    pub assumptions: Vec<String>,
}

/// A stage of such a run.
#[derive(Debug, Clone, Serialize)]
pub struct StageForecast {
    pub stage: &'static str,
    /// Steps of WVT or evaluations of the density solver, at most.
    pub steps: usize,
    /// Of a step on this machine's cores, of which the last part is for messages.
    pub seconds_of_a_step: f64,
    pub seconds_of_messages: f64,
    pub messages_of_a_step: usize,
    pub bytes_of_a_step: f64,
}

/// Particles that are given to a rank over those of the cube: boxes are coarser than what they hold, but cubes have corners. 1.0 to 1.2 for
/// 1000 to 27 000 particles of a rank.
const GIVEN: f64 = 1.1;
/// Numbers of a box that tells where particles are, beside two for each axis, and how many boxes there are.
const OF_A_BOX: usize = 1;
const BOXES: f64 = 64.0;
/// What all ranks are told in a step of WVT, by as many messages as the number of ranks has binary digits: where particles are, five totals, and
/// the reason to stop. In an evaluation of the solver products of its history are added, and how long steps are.
const TOTALS: usize = 7;
const TOTALS_OF_SOLVER: usize = 13;
/// Ranks that share a face, an edge or a corner with one in the middle.
const BESIDE: [usize; 3] = [2, 8, 26];
/// Messages of a step to each of these: places, and what goes with them.
const SWAPS: usize = 2;
/// What a network is taken to do: seconds for a message, and bytes a second for a rank.
const LATENCY: f64 = 2e-6;
const BANDWIDTH: f64 = 1e9;
/// Bytes a second of one writer.
const WRITER: f64 = 2e8;
/// Bytes that a particle of another rank takes where it is seen.
const OF_ANOTHER: f64 = 150.0;

/// Foresees a run of `scene` over so many ranks, each with so many threads.
///
/// # Errors
/// Those of [`run_on_ranks`](super::ranks::run_on_ranks) up to the seeding.
pub fn forecast_on_ranks(
    scene: &Scene,
    formats: &[FormatSpec],
    (ranks, threads): (usize, usize),
) -> Result<RankForecast> {
    refuse(scene)?;
    let read = Read::new(scene, formats)?;
    match read.dimension {
        1 => in_dimension::<1>(scene, formats, read, (ranks, threads)),
        2 => in_dimension::<2>(scene, formats, read, (ranks, threads)),
        _ => in_dimension::<3>(scene, formats, read, (ranks, threads)),
    }
}

fn in_dimension<const D: usize>(
    scene: &Scene,
    formats: &[FormatSpec],
    Read { raw, units, .. }: Read,
    (ranks, threads): (usize, usize),
) -> Result<RankForecast> {
    let particles = scene.particles.unwrap_or(DEFAULT_PARTICLES);
    refuse_few(particles, ranks)?;
    let prepared = Prepared::<D>::new(scene, formats, (raw, &units), particles)?;
    let target = prepared.target();
    let (_, plan) = RANKS.planned(scene, (&prepared, &target), ranks);
    let neighbors = scene.kernel_neighbors(D);
    let own = particles.div_ceil(ranks);
    let seen = seen_of_others::<D>(own, particles, neighbors);
    let slowness = slowness::<D>(scene.kernel(), neighbors);
    let cost = Cost { kernel_neighbors: neighbors, slowness, target: duration::of_target(&target) };
    let stage = |expected: &Expected| {
        let (steps, totals) = match expected.step == SOLVER.name {
            true => (plan.evaluations, TOTALS_OF_SOLVER),
            false => (plan.wvt_iterations, TOTALS),
        };
        let (messages, bytes) = sent::<D>(ranks, seen, totals);
        let of_messages = messages as f64 * LATENCY + bytes / BANDWIDTH;
        StageForecast {
            stage: expected.step,
            steps,
            seconds_of_a_step: expected.seconds / steps.max(1) as f64 + of_messages,
            seconds_of_messages: of_messages,
            messages_of_a_step: messages,
            bytes_of_a_step: bytes,
        }
    };
    let stages = duration::expected(&plan, scene, own, &cost, threads).iter().map(stage).collect();
    let file =
        particles as f64 * bytes_of_a_row::<D>(scene, prepared.source.carried.iter().map(|f| f.info().components));
    Ok(RankForecast {
        input: scene.input_name(),
        dimension: D,
        particles,
        ranks,
        threads,
        particles_of_a_rank: own,
        seen_of_others: seen,
        memory: memory::needed_by_rank(own, &plan.stages) + OF_ANOTHER * GIVEN * seen as f64,
        stages,
        file,
        seconds_to_write: file / WRITER,
        assumptions: vec![
            format!(
                "cores like this one, which is {slowness:.1} times as slow as the one on which the sums were \
                     measured"
            ),
            format!(
                "messages take {LATENCY:e} s and {BANDWIDTH:e} bytes a second from a rank; the first writes {WRITER:e} bytes a second"
            ),
            "parts are cubes in the middle of others; memory and messages were measured with up to 8 ranks".into(),
        ],
    })
}

/// Particles within a support radius of a cube of `own`, of `all` that there are.
fn seen_of_others<const D: usize>(own: usize, all: usize, neighbors: f64) -> usize {
    let edge = (own as f64).powf(1.0 / D as f64);
    let around = (edge + 2.0 * support_over_spacing(D, neighbors) - 1.0).powi(D as i32);
    (around as usize).min(all) - own.min(around as usize)
}

/// Messages and bytes that a rank sends in a step.
fn sent<const D: usize>(ranks: usize, seen: usize, totals: usize) -> (usize, f64) {
    let others = ranks - 1;
    let messages = totals * ranks.next_power_of_two().ilog2() as usize + SWAPS * others.min(BESIDE[D - 1]);
    let boxes = BOXES * (2 * D + OF_A_BOX) as f64 * others as f64;
    let given = GIVEN * seen as f64 * (D + 2) as f64;
    (messages, 8.0 * (boxes + given * f64::from(u8::from(others > 0))))
}

/// Coordinates and numbers of 8 bytes, velocities, mass, radius, density, energy and what is carried.
fn bytes_of_a_row<const D: usize>(scene: &Scene, carried: impl Iterator<Item = usize>) -> f64 {
    let width = if scene.output.double_precision { 8 } else { 4 };
    let columns = 3 + 4 + carried.sum::<usize>();
    (8 * 3 + 8 + width * columns) as f64
}

impl RankForecast {
    /// As JSON.
    pub fn json(&self) -> String {
        super::forecast::json(self)
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.write_text(&mut out).expect("writing to a string cannot fail");
        out
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        let gib = |bytes: f64| bytes / f64::from(1 << 30);
        writeln!(out, "plan: nothing is placed, nothing is written")?;
        writeln!(out, "  input            {} in {}-D", self.input, self.dimension)?;
        writeln!(out, "  ranks            {} with {} threads each", self.ranks, self.threads)?;
        writeln!(
            out,
            "  particles        {}, {} on each rank, which sees {} of others",
            self.particles, self.particles_of_a_rank, self.seen_of_others
        )?;
        writeln!(
            out,
            "  memory           {:.3} GiB on each rank, {:.1} GiB in all",
            gib(self.memory),
            gib(self.memory) * self.ranks as f64
        )?;
        for stage in &self.stages {
            let (title, step) = if stage.stage == SOLVER.name { ("solver", "evaluation") } else { ("WVT", "step") };
            writeln!(
                out,
                "  {title:<16} {:.3} s for each {step}, {:.3} s of it for {} messages of {:.3} MiB together from each rank; {} at most: {}",
                stage.seconds_of_a_step,
                stage.seconds_of_messages,
                stage.messages_of_a_step,
                1024.0 * gib(stage.bytes_of_a_step),
                stage.steps,
                rounded(stage.steps as f64 * stage.seconds_of_a_step)
            )?;
        }
        writeln!(
            out,
            "  file             {:.2} GiB before it is compressed, written by the first rank in {}",
            gib(self.file),
            rounded(self.seconds_to_write)
        )?;
        self.assumptions.iter().try_for_each(|a| writeln!(out, "  assumed          {a}"))
    }
}
