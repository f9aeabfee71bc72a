//! `Flock`: an episode of one flock in the plane or in space.

use std::sync::Arc;

use flockesc_core::bindings::{check_predator_actions, check_ranges};
use flockesc_core::{Episode, EpisodeConfig, Error, FlockConfig, InitialState, Progress};
use wasm_bindgen::prelude::*;

/// An episode of one flock. Arrays of vectors are flat: one row of `dimension` coordinates per agent or predator.
#[wasm_bindgen]
pub struct Flock {
    episode: AnyEpisode,
    /// Number of actions of the learned predators: `dimension` per predator.
    num_predator_actions: usize,
    rewards: Vec<f64>,
}

/// An episode in two or three dimensions.
enum AnyEpisode {
    Plane(Box<Episode<2>>),
    Space(Box<Episode<3>>),
}

/// Evaluates the same expression on an episode in two or three dimensions.
macro_rules! on_episode {
    ($flock:expr, $episode:ident => $body:expr) => {
        match $flock {
            AnyEpisode::Plane($episode) => $body,
            AnyEpisode::Space($episode) => $body,
        }
    };
}

#[wasm_bindgen]
impl Flock {
    /// Starts the episode of a seed. `scenario` and `options` are the documents that Python gives to the core.
    /// Positions in m and velocities in m/s of the agents are optional. The seed draws everything else.
    ///
    /// # Errors
    /// An error that names the field, if a document is not valid, or the array, if it has the wrong length or an
    /// entry out of bounds.
    #[wasm_bindgen(constructor)]
    pub fn new(
        scenario: &str,
        options: &str,
        seed: u64,
        initial_positions: Option<Vec<f64>>,
        initial_velocities: Option<Vec<f64>>,
    ) -> Result<Self, JsError> {
        let start = InitialState {
            seed,
            positions: initial_positions,
            velocities: initial_velocities,
            ..InitialState::default()
        };
        let scenario = Arc::new(FlockConfig::from_json(scenario)?);
        let config = Arc::new(EpisodeConfig::from_json(options)?);
        config.check_scenario(&scenario)?;
        start.check(&scenario)?;
        let drawn = scenario.drawn(seed)?;
        Ok(Self {
            num_predator_actions: scenario.num_learned() * scenario.dimension,
            rewards: vec![0.0; config.view.rows(&scenario)],
            episode: match scenario.dimension {
                2 => AnyEpisode::Plane(Box::new(Episode::new(drawn, config, &start))),
                _ => AnyEpisode::Space(Box::new(Episode::new(drawn, config, &start))),
            },
        })
    }

    /// Applies one action: ranges in m, one for the flock or one per agent, and `dimension` numbers in [-1, 1]
    /// per learned predator, or none.
    ///
    /// # Errors
    /// An error that names the argument, if it has the wrong length or an entry out of bounds, or if the episode
    /// has ended.
    pub fn step(&mut self, ranges: &[f64], predator_actions: &[f64]) -> Result<(), JsError> {
        if self.has_ended() {
            return Err(JsError::new("step() called after the end of the episode"));
        }
        let rewards = &mut self.rewards;
        if ranges.len() != rewards.len() {
            let expected = format!("{} entries", rewards.len());
            return Err(Error::input("ranges", expected, ranges.len()).into());
        }
        check_ranges("ranges", ranges)?;
        check_predator_actions(predator_actions, self.num_predator_actions)?;
        Ok(on_episode!(&mut self.episode, episode => {
            episode.advance(ranges, predator_actions, rewards, &Progress::default())
        })?)
    }

    /// Rewards of the last action: one for the flock, or one per agent.
    #[wasm_bindgen(getter)]
    pub fn rewards(&self) -> Vec<f64> {
        self.rewards.clone()
    }

    /// Positions of the agents in m. A caught agent keeps the position of its capture.
    #[wasm_bindgen(getter)]
    pub fn positions(&self) -> Vec<f64> {
        on_episode!(&self.episode, episode => flat(episode.world().positions().iter()))
    }

    /// Velocities of the agents in m/s; 0 for caught agents.
    #[wasm_bindgen(getter)]
    pub fn velocities(&self) -> Vec<f64> {
        on_episode!(&self.episode, episode => flat(episode.world().velocities().iter()))
    }

    /// Positions of the predators in m, then their velocities in m/s.
    #[wasm_bindgen(getter)]
    pub fn predators(&self) -> Vec<f64> {
        on_episode!(&self.episode, episode => {
            let predators = episode.world().predators();
            let positions = predators.iter().map(|predator| &predator.position);
            flat(positions.chain(predators.iter().map(|predator| &predator.velocity)))
        })
    }

    /// Ids of the caught agents, in the order of their capture.
    #[wasm_bindgen(getter)]
    pub fn caught(&self) -> Vec<u32> {
        on_episode!(&self.episode, episode => episode.world().caught().map(|id| id as u32).collect())
    }

    /// Mean and minimum predator distance in m, and the lowest value of the objective so far.
    #[wasm_bindgen(getter)]
    pub fn distances(&self) -> Vec<f64> {
        on_episode!(&self.episode, episode => {
            let distance = episode.world().predator_distance();
            vec![distance.mean, distance.minimum, episode.objective().minimum]
        })
    }

    /// Number of weakly connected components under the ranges of the last action.
    #[wasm_bindgen(getter, js_name = "numComponents")]
    pub fn num_components(&self) -> usize {
        on_episode!(&self.episode, episode => episode.num_components())
    }

    /// Number of model steps so far.
    #[wasm_bindgen(getter)]
    pub fn steps(&self) -> usize {
        on_episode!(&self.episode, episode => episode.step_count())
    }

    /// Whether the episode has reached its horizon or all agents were caught.
    #[wasm_bindgen(getter, js_name = "hasEnded")]
    pub fn has_ended(&self) -> bool {
        on_episode!(&self.episode, episode => episode.has_ended())
    }
}

impl Flock {
    /// Writes the observation that `config` describes.
    pub(crate) fn observe_as(
        &self,
        config: &EpisodeConfig,
        out: &mut [f32],
    ) -> flockesc_core::Result<()> {
        let progress = Progress::default();
        on_episode!(&self.episode, episode => episode.observe_as(config, out, &progress))
    }
}

fn flat<'a, V: AsRef<[f64]> + 'a>(vectors: impl Iterator<Item = &'a V>) -> Vec<f64> {
    vectors.flat_map(AsRef::as_ref).copied().collect()
}
