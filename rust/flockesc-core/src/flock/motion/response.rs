//! Neighbor forces beyond plain alignment: sensing noise, cohesion and separation, delay, and angular noise.

use std::collections::VecDeque;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::columns::ParameterColumns;
use super::forces::{Force, Neighbors, consensus_force};
use super::noise::Noise;
use crate::agents::{Agents, GROUP};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::vector::heading;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{NeighborSums, Neighborhood, OffsetBuffers};
use crate::parallel;
use crate::snapshot::{are_bounded, check};

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

    /// Returns the memory in bytes in a run of a scenario.
    pub(crate) fn bytes(config: &FlockConfig) -> usize {
        let (n, sensing_delay) = (config.num_agents, config.sensing_delay);
        let groups = n.div_ceil(GROUP).max(1);
        let needs_pairs = config.motion.needs_pairs();
        let mut bytes = Noise::<D>::bytes(config);
        if config.sensing_noise > 0.0 || sensing_delay > 0 || needs_pairs {
            bytes += 2 * groups.max(4) * size_of::<Force<D>>();
        }
        if sensing_delay > 0 {
            let past = 1 + sensing_delay.min(config.num_steps);
            bytes += past * (n * size_of::<SVector<f64, D>>() + 2 * size_of::<Vec<f64>>());
        }
        if needs_pairs {
            bytes += parallel::num_chunks(groups) * OffsetBuffers::<D>::most_bytes(n);
        }
        bytes
    }

    pub(crate) fn save(&self) -> ResponseState<D> {
        ResponseState {
            stream_position: self.noise.stream_position(),
            past: self.past.clone(),
        }
    }

    pub(crate) fn restore(
        state: ResponseState<D>,
        config: &FlockConfig,
        seed: u64,
    ) -> Result<Self> {
        let is_possible = |forces: &Vec<SVector<f64, D>>| {
            forces.len() == config.num_agents && are_bounded(forces.iter().flatten())
        };
        check(state.past.len() <= config.sensing_delay + 1, "past forces")?;
        check(state.past.iter().all(is_possible), "past forces")?;
        let mut response = Self::new(seed);
        response.noise.set_stream_position(state.stream_position);
        response.past = state.past;
        Ok(response)
    }

    /// Computes the neighbor forces of this step, one entry per group. Returns `None` if they are the
    /// consensus forces of the current sums.
    pub(crate) fn neighbor_forces(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        neighborhood: &mut Neighborhood<D>,
    ) -> Option<&[Force<D>]> {
        self.noise.draw(config);
        let is_plain = config.sensing_noise <= 0.0 && config.sensing_delay == 0;
        if is_plain && !config.motion.needs_pairs() {
            return None;
        }
        self.consensus(config, agents, neighborhood);
        if config.motion.needs_pairs() {
            self.add_pair_forces(config, agents, neighborhood);
        }
        if config.sensing_delay > 0 {
            self.delay(config, agents.ids());
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
                self.add_sensing_noise(config, &columns, ids, sums, unit, &mut force);
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

    /// Replaces consensus forces by the ones that follow from mean velocities with sensing noise.
    fn add_sensing_noise(
        &self,
        config: &FlockConfig,
        columns: &ParameterColumns,
        ids: &[u32],
        sums: &NeighborSums<D>,
        unit: Scale,
        force: &mut Force<D>,
    ) {
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

    /// Stores the forces and replaces them by the forces of `sensing_delay` steps ago. The first steps use
    /// the forces of t = 0.
    fn delay(&mut self, config: &FlockConfig, ids: &[u32]) {
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
        self.noise.turn(agents);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::vector;

    use super::*;

    #[test]
    fn past_forces_are_one_finite_force_per_agent_and_delayed_step() {
        let scenario = FlockConfig {
            num_agents: 2,
            sensing_delay: 1,
            ..FlockConfig::default()
        };
        let restored = |past: &[&[SVector<f64, 2>]]| {
            let past = past.iter().map(|forces| forces.to_vec()).collect();
            let state = ResponseState {
                stream_position: 0,
                past,
            };
            Response::restore(state, &scenario, 0)
        };
        let (force, nan) = (vector![1.0, 2.0], vector![1.0, f64::NAN]);
        assert!(restored(&[&[force, force], &[force, force]]).is_ok());
        assert!(restored(&[&[force, force], &[force]]).is_err());
        assert!(restored(&[&[force, nan]]).is_err());
        assert!(restored(&[&[force, force][..]; 3]).is_err());
    }
}
