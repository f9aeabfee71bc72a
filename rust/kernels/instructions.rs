//! Instructions of one step or observation, counted by callgrind: `python -m benchmarks instructions`.
//! A count does not depend on the load of the machine. Valgrind has no AVX-512, so the kernels run with AVX2.

#![allow(
    missing_docs,
    reason = "the macros of gungraun define items without documentation"
)]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;

use flockesc_core::{
    Batch, EpisodeConfig, ExtraEntries, FlockConfig, InitialState, Line, LineConfig, Motion,
    NeighborRule, Ranges, Reynolds, Topological, View, Voronoi, World,
};
use flocks::{flock, world};
use gungraun::{library_benchmark, library_benchmark_group, main};

mod flocks;

/// Number of steps after which the flock is measured: agents have turned, and the predator has arrived.
const BEFORE: usize = 100;
/// Number of steps that are measured. `benchmarks/instructions.py` divides by it.
const STEPS: usize = 10;
const AGENTS: usize = 300;
const RANGE: f64 = 10.0;

type Started<const D: usize> = (World<D>, f64);

fn paper(range: f64) -> Started<2> {
    advanced(flock(AGENTS, 2), range)
}

fn space(range: f64) -> Started<3> {
    advanced(flock(AGENTS, 3), range)
}

fn large(num_agents: usize) -> Started<2> {
    advanced(flock(num_agents, 2), RANGE)
}

fn boids(range: f64) -> Started<2> {
    let motion = Motion::Reynolds(Reynolds {
        separation_strength: 1.0,
        cohesion_strength: 1.0,
        separation_range: 5.0,
    });
    advanced(
        FlockConfig {
            motion,
            ..flock(AGENTS, 2)
        },
        range,
    )
}

fn blind(range: f64) -> Started<2> {
    advanced(
        FlockConfig {
            blind_angle: FRAC_PI_2,
            ..flock(AGENTS, 2)
        },
        range,
    )
}

fn voronoi(range: f64) -> Started<2> {
    ruled(NeighborRule::Voronoi(Voronoi {}), range)
}

fn nearest(count: f64) -> Started<2> {
    ruled(NeighborRule::Topological(Topological {}), count)
}

fn ruled(neighbor_rule: NeighborRule, range: f64) -> Started<2> {
    advanced(
        FlockConfig {
            neighbor_rule,
            ..flock(AGENTS, 2)
        },
        range,
    )
}

fn advanced<const D: usize>(scenario: FlockConfig, range: f64) -> Started<D> {
    let mut start = world(scenario);
    for _ in 0..BEFORE {
        #[expect(clippy::unwrap_used, reason = "only a frozen graph can be too large")]
        start.step(Ranges::Shared(range)).unwrap();
    }
    (start, range)
}

#[library_benchmark]
#[benches::range(args = [0.0, 5.0, 10.0, 20.0, 30.0, 100.0], setup = paper)]
fn step(start: Started<2>) -> World<2> {
    stepped(start)
}

#[library_benchmark]
#[benches::range(args = [0.0, 10.0, 30.0, 100.0], setup = space)]
fn step_in_space(start: Started<3>) -> World<3> {
    stepped(start)
}

#[library_benchmark]
#[benches::agents(args = [10_000, 100_000], setup = large)]
fn step_of_many(start: Started<2>) -> World<2> {
    stepped(start)
}

#[library_benchmark]
#[bench::boids(args = (10.0), setup = boids)]
#[bench::blind_angle(args = (10.0), setup = blind)]
#[bench::voronoi(args = (10.0), setup = voronoi)]
#[benches::nearest(args = [1.0, 7.0], setup = nearest)]
fn step_of_rule(start: Started<2>) -> World<2> {
    stepped(start)
}

#[library_benchmark]
#[benches::range(args = [5.0, 10.0, 20.0, 100.0], setup = paper)]
fn components((world, range): Started<2>) -> usize {
    black_box(world.num_components(Ranges::Shared(range)))
}

/// Advances by [`STEPS`] steps, because some steps take candidates of earlier ones.
fn stepped<const D: usize>((mut world, range): Started<D>) -> World<D> {
    for _ in 0..STEPS {
        #[expect(clippy::unwrap_used, reason = "only a frozen graph can be too large")]
        world.step(Ranges::Shared(black_box(range))).unwrap();
    }
    world
}

/// A batch of one flock, and the arrays of its step.
struct Rows {
    batch: Batch<2>,
    ranges: Vec<f64>,
    rewards: Vec<f64>,
    observations: Vec<f32>,
}

fn rows(name: &str) -> Rows {
    let mut config = EpisodeConfig {
        max_range: 100.0,
        ..EpisodeConfig::default()
    };
    if name.starts_with("agents") {
        config.view = View::Agent;
    }
    if name.ends_with("profile") {
        config.profile_ranges = vec![0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0];
        config.extra_entries = vec![ExtraEntries::EscapeDirection, ExtraEntries::ClosestApproach];
    }
    let mut scenario = flock(AGENTS, 2);
    scenario.num_steps = 2 * BEFORE;
    #[expect(clippy::unwrap_used, reason = "the configuration is constant")]
    let mut batch = Batch::<2>::new(scenario, config, 1, Some(1)).unwrap();
    #[expect(clippy::unwrap_used, reason = "the slot exists")]
    batch.reset(0, &InitialState::seeded(7)).unwrap();
    let (count, length) = (batch.rows(), batch.row_length());
    let mut rows = Rows {
        batch,
        ranges: vec![RANGE; count],
        rewards: vec![0.0; count],
        observations: vec![0.0; count * length],
    };
    for _ in 0..BEFORE {
        advance(&mut rows);
    }
    rows
}

#[expect(clippy::unwrap_used, reason = "the episode has not ended")]
fn advance(rows: &mut Rows) {
    rows.batch
        .step(&rows.ranges, &mut rows.rewards, &mut rows.observations)
        .unwrap();
}

#[library_benchmark]
#[bench::flock(args = ("flock"), setup = rows)]
#[bench::agents(args = ("agents"), setup = rows)]
#[bench::flock_profile(args = ("flock_profile"), setup = rows)]
#[bench::agents_profile(args = ("agents_profile"), setup = rows)]
fn batch_step(mut rows: Rows) -> Rows {
    for _ in 0..STEPS {
        advance(&mut rows);
    }
    rows
}

fn line(range: f64) -> (Line, f64) {
    #[expect(clippy::unwrap_used, reason = "the configuration is constant")]
    (
        Line::new(LineConfig::default().into(), 7, None).unwrap(),
        range,
    )
}

#[library_benchmark]
#[benches::range(args = [0.05, 0.5], setup = line)]
fn line_step((mut line, range): (Line, f64)) -> Line {
    #[expect(clippy::unwrap_used, reason = "the range is valid")]
    for _ in 0..STEPS {
        line.step(black_box(range)).unwrap();
    }
    line
}

library_benchmark_group!(
    name = counts,
    benchmarks = [
        step,
        step_in_space,
        step_of_many,
        step_of_rule,
        components,
        batch_step,
        line_step
    ]
);

main!(library_benchmark_groups = counts);
