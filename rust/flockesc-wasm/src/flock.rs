//! `Flock`: an episode of one flock in the plane or in space.

use std::sync::Arc;

use flockesc_core::bindings::{check_predator_actions, check_ranges};
use flockesc_core::{Episode, EpisodeConfig, Error, FlockConfig, InitialState, Progress};
use wasm_bindgen::prelude::*;

/// An episode of one flock. Arrays of vectors are flat: one row of `dimension` coordinates per agent or predator.
#[wasm_bindgen]
pub struct Flock {
    episode: Box<dyn Play>,
    scenario: Arc<FlockConfig>,
    config: Arc<EpisodeConfig>,
    rewards: Vec<f64>,
}

#[wasm_bindgen]
impl Flock {
    /// Starts the episode of a seed. `scenario` and `options` are the documents that Python gives to the core.
    ///
    /// # Errors
    /// An error that names the field, if a document is not valid.
    #[wasm_bindgen(constructor)]
    pub fn new(scenario: &str, options: &str, seed: u64) -> Result<Self, JsError> {
        Self::start(scenario, options, &InitialState::seeded(seed))
    }

    /// Starts an episode from positions in m and velocities in m/s. The seed draws all other random numbers.
    ///
    /// # Errors
    /// As the constructor, or an error that names the array, if it has the wrong length or an entry out of bounds.
    #[wasm_bindgen(js_name = startedAt)]
    pub fn started_at(
        scenario: &str,
        options: &str,
        seed: u64,
        initial_positions: Vec<f64>,
        initial_velocities: Vec<f64>,
    ) -> Result<Self, JsError> {
        let start = InitialState {
            seed,
            positions: Some(initial_positions),
            velocities: Some(initial_velocities),
            ..InitialState::default()
        };
        Self::start(scenario, options, &start)
    }

    fn start(scenario: &str, options: &str, start: &InitialState) -> Result<Self, JsError> {
        let scenario = Arc::new(FlockConfig::from_json(scenario)?);
        let config = Arc::new(EpisodeConfig::from_json(options)?);
        config.check_scenario(&scenario)?;
        start.check(&scenario)?;
        scenario.check_draw(start.seed)?;
        let episode: Box<dyn Play> = match scenario.dimension {
            2 => Box::new(Episode::<2>::new(scenario.clone(), config.clone(), start)),
            _ => Box::new(Episode::<3>::new(scenario.clone(), config.clone(), start)),
        };
        let rewards = vec![0.0; config.view.rows(&scenario)];
        Ok(Self {
            episode,
            scenario,
            config,
            rewards,
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
        let count = self.rewards.len();
        if ranges.len() != count {
            let expected = format!("{count} entries");
            return Err(Error::input("ranges", expected, ranges.len()).into());
        }
        check_ranges("ranges", ranges)?;
        let count = self.scenario.num_learned() * self.scenario.dimension;
        check_predator_actions(predator_actions, count)?;
        Ok(self
            .episode
            .step(ranges, predator_actions, &mut self.rewards)?)
    }

    /// Number of observation rows, ranges and rewards: 1, or one per agent.
    #[wasm_bindgen(getter)]
    pub fn rows(&self) -> usize {
        self.rewards.len()
    }

    /// Names of the entries of an observation row.
    #[wasm_bindgen(getter)]
    pub fn entries(&self) -> Vec<String> {
        let entries = self.config.entries(self.scenario.dimension).into_iter();
        entries.map(|entry| entry.name).collect()
    }

    /// Observation rows: one for the flock, or one per agent.
    ///
    /// # Errors
    /// None in a page, where nobody cancels.
    pub fn observe(&self) -> Result<Vec<f32>, JsError> {
        let length = self.rewards.len() * self.entries().len();
        Ok(self.observe_as(&self.config, length)?)
    }

    /// Rewards of the last action: one for the flock, or one per agent.
    #[wasm_bindgen(getter)]
    pub fn rewards(&self) -> Vec<f64> {
        self.rewards.clone()
    }

    /// Positions of the agents in m. A caught agent keeps the position of its capture.
    #[wasm_bindgen(getter)]
    pub fn positions(&self) -> Vec<f64> {
        self.episode.positions()
    }

    /// Velocities of the agents in m/s; 0 for caught agents.
    #[wasm_bindgen(getter)]
    pub fn velocities(&self) -> Vec<f64> {
        self.episode.velocities()
    }

    /// Positions of the predators in m, then their velocities in m/s.
    #[wasm_bindgen(getter)]
    pub fn predators(&self) -> Vec<f64> {
        self.episode.predators()
    }

    /// Ids of the caught agents, in the order of their capture.
    #[wasm_bindgen(getter)]
    pub fn caught(&self) -> Vec<u32> {
        self.episode.caught()
    }

    /// Mean and minimum predator distance in m, and the lowest value of the objective so far.
    #[wasm_bindgen(getter)]
    pub fn distances(&self) -> Vec<f64> {
        self.episode.distances().to_vec()
    }

    /// Number of weakly connected components under the ranges of the last action.
    #[wasm_bindgen(getter, js_name = "numComponents")]
    pub fn num_components(&self) -> usize {
        self.episode.num_components()
    }

    /// Number of model steps so far.
    #[wasm_bindgen(getter)]
    pub fn steps(&self) -> usize {
        self.episode.steps()
    }

    /// Whether the episode has reached its horizon or all agents were caught.
    #[wasm_bindgen(getter, js_name = "hasEnded")]
    pub fn has_ended(&self) -> bool {
        self.episode.has_ended()
    }
}

impl Flock {
    /// Returns the observation of this length that `config` describes.
    pub(crate) fn observe_as(&self, config: &EpisodeConfig, length: usize) -> Rows {
        self.episode.observe_as(config, length)
    }
}

type Rows = flockesc_core::Result<Vec<f32>>;

/// An episode in any dimension.
trait Play {
    fn step(
        &mut self,
        ranges: &[f64],
        actions: &[f64],
        rewards: &mut [f64],
    ) -> flockesc_core::Result<()>;
    fn observe_as(&self, config: &EpisodeConfig, length: usize) -> Rows;
    fn positions(&self) -> Vec<f64>;
    fn velocities(&self) -> Vec<f64>;
    fn predators(&self) -> Vec<f64>;
    fn caught(&self) -> Vec<u32>;
    fn distances(&self) -> [f64; 3];
    fn num_components(&self) -> usize;
    fn steps(&self) -> usize;
    fn has_ended(&self) -> bool;
}

impl<const D: usize> Play for Episode<D> {
    fn step(
        &mut self,
        ranges: &[f64],
        actions: &[f64],
        rewards: &mut [f64],
    ) -> flockesc_core::Result<()> {
        self.advance(ranges, actions, rewards, &Progress::default())
    }

    fn observe_as(&self, config: &EpisodeConfig, length: usize) -> Rows {
        let mut rows = vec![0.0; length];
        Episode::observe_as(self, config, &mut rows, &Progress::default())?;
        Ok(rows)
    }

    fn positions(&self) -> Vec<f64> {
        flat(self.world().positions().iter())
    }

    fn velocities(&self) -> Vec<f64> {
        flat(self.world().velocities().iter())
    }

    fn predators(&self) -> Vec<f64> {
        let predators = self.world().predators();
        let positions = predators.iter().map(|predator| &predator.position);
        flat(positions.chain(predators.iter().map(|predator| &predator.velocity)))
    }

    fn caught(&self) -> Vec<u32> {
        self.world().caught().map(|id| id as u32).collect()
    }

    fn distances(&self) -> [f64; 3] {
        let distance = self.world().predator_distance();
        [distance.mean, distance.minimum, self.objective().minimum]
    }

    fn num_components(&self) -> usize {
        Episode::num_components(self)
    }

    fn steps(&self) -> usize {
        self.step_count()
    }

    fn has_ended(&self) -> bool {
        Episode::has_ended(self)
    }
}

fn flat<'a, V: AsRef<[f64]> + 'a>(vectors: impl Iterator<Item = &'a V>) -> Vec<f64> {
    vectors.flat_map(AsRef::as_ref).copied().collect()
}
