//! Neighbor forces beyond plain alignment: sensing noise, cohesion and separation, delay, and angular noise.

use std::collections::VecDeque;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::forces::{Force, Neighbors, ParameterColumns, consensus_force};
use crate::agents::{Agents, GROUP};
use crate::base::rng::{self, Stream};
use crate::base::vector::{heading, side_of, turn, unit};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{Neighborhood, OffsetBuffers};
use crate::parallel;

/// The neighbor forces of one step, with random streams and delayed forces.
#[derive(Debug, Clone)]
pub(crate) struct Response<const D: usize> {
    noise: Noise<D>,
    /// The neighbor forces in the current step, one entry per group.
    forces: Vec<Force<D>>,
    /// The neighbor forces of past steps, by id, oldest first.
    past: VecDeque<Vec<SVector<f64, D>>>,
    buffers: Vec<OffsetBuffers<D>>,
}

/// The serialized form of a [`Response`].
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ResponseState<const D: usize> {
    /// Position in the random stream of the noise.
    stream_position: u128,
    past: VecDeque<Vec<SVector<f64, D>>>,
}

impl<const D: usize> Response<D> {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            noise: Noise::new(seed),
            forces: Vec::new(),
            past: VecDeque::new(),
            buffers: Vec::new(),
        }
    }

    pub(crate) fn save(&self) -> ResponseState<D> {
        ResponseState {
            stream_position: self.noise.rng.get_word_pos(),
            past: self.past.clone(),
        }
    }

    pub(crate) fn restore(state: ResponseState<D>, seed: u64) -> Self {
        let mut response = Self::new(seed);
        response.noise.rng.set_word_pos(state.stream_position);
        response.past = state.past;
        response
    }

    /// Computes the neighbor forces of this step, one entry per group, and adds `extra`, D entries per id or none.
    /// Returns `None` if they are the consensus forces of the current sums.
    pub(crate) fn neighbor_forces(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        neighborhood: &mut Neighborhood<D>,
        extra: &[f64],
    ) -> Option<&[Force<D>]> {
        // Before the early return, because angular noise is drawn under the plain law too.
        self.noise.draw(config);
        let is_plain = config.sensing_noise <= 0.0 && config.sensing_delay == 0 && extra.is_empty();
        if is_plain && !config.motion.needs().pairs {
            return None;
        }
        self.consensus(config, agents, neighborhood);
        if config.motion.needs().pairs {
            self.add_pair_forces(config, agents, neighborhood);
        }
        if config.sensing_delay > 0 {
            self.delay(config, agents.ids());
        }
        let rows = extra.as_chunks::<D>().0;
        for (place, &id) in agents.ids().iter().enumerate().take(rows.len()) {
            for axis in 0..D {
                self.forces[place / GROUP][axis][place % GROUP] += rows[id as usize][axis];
            }
        }
        Some(&self.forces)
    }

    /// Computes the consensus forces.
    fn consensus(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        neighborhood: &mut Neighborhood<D>,
    ) {
        let unit = neighborhood.scale();
        self.forces.clear();
        let mut columns = ParameterColumns::of_first(config);
        let ids = agents.ids().chunks(GROUP);
        for (sums, ids) in neighborhood.sums_mut().iter_mut().zip(ids) {
            columns.load(config, ids);
            let mut force = consensus_force(&columns, sums);
            if config.sensing_noise > 0.0 {
                // Replaces the forces by the ones that follow from mean velocities with errors.
                for (lane, &id) in ids.iter().enumerate() {
                    let mean = |axis: usize, _| unit.mean(sums.sum[axis][lane], sums.count[lane]);
                    let mean = SVector::from_fn(mean);
                    let sensed = self.noise.sensed(config, id as usize, mean);
                    let aim = heading(&sensed) * columns.alignment[lane];
                    for axis in 0..D {
                        force[axis][lane] = aim[axis];
                    }
                }
            }
            self.forces.push(force);
        }
    }

    /// Adds the forces between pairs of neighbors.
    fn add_pair_forces(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        neighborhood: &Neighborhood<D>,
    ) {
        let neighbors = Neighbors::new(agents, neighborhood);
        let chunks = parallel::num_chunks(self.forces.len());
        self.buffers.resize_with(chunks, OffsetBuffers::default);
        let buffers = &mut self.buffers;
        parallel::for_each_chunk_with(&mut self.forces, buffers, |first, forces, buffers| {
            let mut columns = ParameterColumns::of_first(config);
            for (group, force) in (first..).zip(forces) {
                columns.load(config, agents.ids_of(group));
                let motion = &config.motion;
                motion.add_pair_forces(&neighbors, group, &columns, buffers, force);
            }
            buffers.trim();
        });
    }

    /// Stores the forces and replaces them by the forces of `sensing_delay` steps ago. The first steps use
    /// the forces of t = 0.
    fn delay(&mut self, config: &FlockConfig, ids: &[u32]) {
        // NOTE: The first steps keep the forces of t = 0 at the front; later the oldest ones make room for the latest.
        let recycled = if self.past.len() > config.sensing_delay {
            self.past.pop_front()
        } else {
            None
        };
        let mut latest = recycled.unwrap_or_else(|| vec![SVector::zeros(); config.num_agents]);
        let force = |forces: &[Force<D>], place: usize| {
            SVector::from_fn(|axis, _| forces[place / GROUP][axis][place % GROUP])
        };
        for (place, &id) in ids.iter().enumerate() {
            latest[id as usize] = force(&self.forces, place);
        }
        self.past.push_back(latest);
        let oldest = &self.past[0];
        for (place, &id) in ids.iter().enumerate() {
            for axis in 0..D {
                self.forces[place / GROUP][axis][place % GROUP] = oldest[id as usize][axis];
            }
        }
    }

    /// Turns every heading by its angular noise.
    pub(crate) fn apply_angular_noise(&self, agents: &mut Agents<D>) {
        let turns = &self.noise.turns;
        if turns.is_empty() {
            return;
        }
        let (groups, ids) = agents.groups_and_ids();
        for (place, &id) in ids.iter().enumerate() {
            let (group, lane) = (&mut groups[place / GROUP], place % GROUP);
            let velocity = SVector::<f64, D>::from_fn(|axis, _| group.velocity[axis][lane]);
            let ahead = heading(&velocity);
            let (angle, toward) = &turns[id as usize];
            if let Some(side) = across(&ahead, toward) {
                let turned = turn(&ahead, &side, *angle) * group.speed[lane];
                for axis in 0..D {
                    group.velocity[axis][lane] = turned[axis];
                }
            }
        }
    }
}

/// The random errors of one step, by id. They are drawn only if the scenario has noise.
#[derive(Debug, Clone)]
struct Noise<const D: usize> {
    rng: ChaCha8Rng,
    /// Unit vectors xi_i of the sensing noise.
    sensing: Vec<SVector<f64, D>>,
    /// Errors of the new headings: an angle in rad and, for D = 3, a direction to turn toward.
    turns: Vec<(f64, SVector<f64, D>)>,
}

impl<const D: usize> Noise<D> {
    fn new(seed: u64) -> Self {
        Self {
            rng: rng::stream(seed, Stream::Motion),
            sensing: Vec::new(),
            turns: Vec::new(),
        }
    }

    /// Draws the errors of the next step in the order of ids.
    fn draw(&mut self, config: &FlockConfig) {
        self.sensing.clear();
        self.turns.clear();
        let (rng, eta) = (&mut self.rng, config.angular_noise);
        if config.sensing_noise <= 0.0 && eta <= 0.0 {
            return;
        }
        for _ in 0..config.num_agents {
            if config.sensing_noise > 0.0 {
                self.sensing.push(rng::direction(D, rng));
            }
            if eta > 0.0 {
                self.turns.push(match D {
                    2 => (rng::uniform(rng, eta) - eta / 2.0, SVector::zeros()),
                    _ => (rng::uniform(rng, eta / 2.0), rng::direction(D, rng)),
                });
            }
        }
    }

    /// Returns the neighbors' mean velocity in m/s with the sensing error of agent `id`.
    fn sensed(&self, config: &FlockConfig, id: usize, mean: SVector<f64, D>) -> SVector<f64, D> {
        self.sensing.get(id).map_or(mean, |error| {
            mean + error * (config.sensing_noise * config.speed.of(id))
        })
    }
}

/// Returns the unit vector perpendicular to `ahead`: to its left in the plane, and to the side of `toward`
/// for D = 3. `None` for an agent at rest.
fn across<const D: usize>(
    ahead: &SVector<f64, D>,
    toward: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    match D {
        2 => unit(&SVector::from_fn(|axis, _| [-ahead[1], ahead[0]][axis])),
        _ => unit(ahead).and_then(|ahead| side_of(&ahead, toward)),
    }
}
