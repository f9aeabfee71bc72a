//! Criterion benchmarks of steps of the two models and of a batch: `cargo bench --package flockesc-kernels`.
//! `make bench` compares with other programs.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput};
use flockesc_core::{Batch, EpisodeConfig, InitialState, Line, LineConfig, Ranges, Result, World};
use flocks::{EPISODE, flock, world};

mod flocks;

fn main() -> Result<()> {
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    shared_range(&mut criterion);
    range_per_agent(&mut criterion);
    three_dimensions(&mut criterion);
    line(&mut criterion)?;
    batch(&mut criterion)?;
    criterion.final_summary();
    Ok(())
}

fn shared_range(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("flock step, shared range");
    for (num_agents, steps) in [(300, EPISODE), (10_000, 24)] {
        let start = world::<2>(flock(num_agents, 2));
        group.throughput(Throughput::Elements((num_agents * steps) as u64));
        for range in [0.0, 10.0, 30.0, 100.0] {
            let id = BenchmarkId::new(format!("n = {num_agents}, {steps} steps"), range);
            group.bench_function(id, |bencher| {
                bencher.iter_batched(
                    || start.clone(),
                    |world| run(world, steps, Ranges::Shared(range)),
                    BatchSize::LargeInput,
                );
            });
        }
    }
}

fn range_per_agent(criterion: &mut Criterion) {
    let start = world::<2>(flock(300, 2));
    let ranges: Vec<f64> = (0..300).map(|agent| f64::from(agent % 21)).collect();
    let mut group = criterion.benchmark_group("flock step, range per agent");
    group.throughput(Throughput::Elements((ranges.len() * EPISODE) as u64));
    group.bench_function("n = 300, 240 steps, 0 to 20 m", |bencher| {
        bencher.iter_batched(
            || start.clone(),
            |world| run(world, EPISODE, Ranges::PerAgent(&ranges)),
            BatchSize::LargeInput,
        );
    });
}

fn three_dimensions(criterion: &mut Criterion) {
    let start = world::<3>(flock(300, 3));
    let mut group = criterion.benchmark_group("flock step, D = 3");
    group.throughput(Throughput::Elements((300 * EPISODE) as u64));
    for range in [0.0, 10.0, 30.0, 100.0] {
        group.bench_function(BenchmarkId::new("n = 300, 240 steps", range), |bencher| {
            bencher.iter_batched(
                || start.clone(),
                |world| run(world, EPISODE, Ranges::Shared(range)),
                BatchSize::LargeInput,
            );
        });
    }
}

/// Runs a line until its steady state; throughput is in steps.
fn line(criterion: &mut Criterion) -> Result<()> {
    let config = Arc::new(LineConfig::default());
    let start = Line::new(config, 7, None)?;
    let mut group = criterion.benchmark_group("line until its steady state, n = 100");
    for range in [0.05, 0.1, 0.5] {
        let steps = run_to_steady_state(start.clone(), range)?;
        group.throughput(Throughput::Elements(steps));
        group.bench_function(BenchmarkId::from_parameter(range), |bencher| {
            bencher.iter_batched(
                || start.clone(),
                |line| black_box(run_to_steady_state(line, range)),
                BatchSize::SmallInput,
            );
        });
    }
    Ok(())
}

fn batch(criterion: &mut Criterion) -> Result<()> {
    const FLOCKS: usize = 64;
    let episode = EpisodeConfig::default();
    let mut start = Batch::<2>::new(flock(300, 2), episode, FLOCKS, Some(1))?;
    for slot in 0..FLOCKS {
        start.reset(slot, &InitialState::seeded(slot as u64))?;
    }
    let ranges = [10.0; FLOCKS];
    let mut rewards = [0.0; FLOCKS];
    let mut observations = vec![0.0; FLOCKS * start.row_length()];
    let mut group = criterion.benchmark_group("batch step, 64 flocks, n = 300");
    group.throughput(Throughput::Elements((FLOCKS * EPISODE) as u64));
    group.bench_function("240 steps, 10 m, rewards and observations", |bencher| {
        bencher.iter_batched_ref(
            || start.clone(),
            |batch| {
                (0..EPISODE).try_for_each(|_| batch.step(&ranges, &mut rewards, &mut observations))
            },
            BatchSize::PerIteration,
        );
    });
    Ok(())
}

fn run<const D: usize>(mut world: World<D>, steps: usize, ranges: Ranges<'_>) -> World<D> {
    for _ in 0..steps {
        #[expect(clippy::unwrap_used, reason = "only a frozen graph can be too large")]
        world.step(ranges).unwrap();
    }
    world
}

/// Runs a line until its steady state and returns the number of steps.
fn run_to_steady_state(mut line: Line, range: f64) -> Result<u64> {
    for step in 1..=1000 {
        let moved = line.step(range)?;
        if line.is_steady(moved) {
            return Ok(step);
        }
    }
    Ok(1000)
}
