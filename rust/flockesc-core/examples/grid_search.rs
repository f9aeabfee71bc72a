//! The paper's grid search: 100 interaction ranges on the same 40 flocks.

use std::sync::Arc;

use flockesc_core::{FlockConfig, Objective, Progress, Result, sweep_flock};

fn main() -> Result<()> {
    let ranges: Vec<f64> = (1..=100).map(f64::from).collect();
    let seeds: Vec<u64> = (0..40).collect();
    let flock = Arc::new(FlockConfig::default());
    let outcomes = sweep_flock(&flock, &ranges, &seeds, None, &Progress::default())?;
    for (range, flocks) in ranges.iter().zip(outcomes.chunks(seeds.len())) {
        let values = flocks
            .iter()
            .map(|flock| flock.objectives[Objective::MinMeanDistance as usize]);
        let sum: f64 = values.sum();
        println!("{range} m: J_mean = {:.2} m", sum / seeds.len() as f64);
    }
    Ok(())
}
