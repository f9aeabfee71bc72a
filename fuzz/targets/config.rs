//! Fuzz target for documents: every accepted document and draw can be simulated, and all resulting numbers are finite.

#![no_main]

use std::sync::Arc;

use flockesc_core::{
    EpisodeConfig, FlockConfig, InitialPositions, InitialState, Line, LineConfig,
    LineEpisodeConfig, Ranges, World,
};
use flockesc_fuzz::assert_world_is_sound;
use libfuzzer_sys::fuzz_target;

/// Largest number of agents, predators and clusters that is simulated. Documents of larger flocks are only
/// parsed.
const SMALL: usize = 400;

fuzz_target!(|bytes: &[u8]| {
    let Ok(document) = std::str::from_utf8(bytes) else {
        return;
    };
    let _ = EpisodeConfig::from_json(document);
    let _ = LineEpisodeConfig::from_json(document);
    if let Ok(config) = FlockConfig::from_json(document) {
        match config.dimension {
            2 => run_flock::<2>(config),
            _ => run_flock::<3>(config),
        }
    }
    if let Ok(config) = LineConfig::from_json(document) {
        run_line(config);
    }
});

fn run_flock<const D: usize>(config: FlockConfig) {
    let has_many_clusters = matches!(
        &config.initial_positions,
        InitialPositions::Clusters { num_clusters, .. } if *num_clusters > SMALL
    );
    if config.num_agents > SMALL || config.predators.len() > SMALL || has_many_clusters {
        return;
    }
    let Ok(config) = Arc::new(config).drawn(1) else {
        return;
    };
    let mut world = World::<D>::new(config, &InitialState::seeded(1));
    for range in [0.0, 7.0, f64::MAX] {
        world.step(Ranges::Shared(range)).expect("few agents");
        assert_world_is_sound(&world, Ranges::Shared(range));
    }
}

fn run_line(config: LineConfig) {
    if config.num_agents > SMALL {
        return;
    }
    let mut line = Line::new(Arc::new(config), 1, None).expect("a seed is a good start");
    for range in [0.0, 0.1, f64::MAX] {
        let moved = line.step(range).expect("a good range");
        assert!(moved.is_finite() && line.states().iter().all(|state| state.is_finite()));
        assert!((1..=line.config().num_agents).contains(&line.num_components(range)));
    }
}
