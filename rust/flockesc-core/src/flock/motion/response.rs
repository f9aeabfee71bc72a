//! What agents do about what they hear, where that is more than to follow it at once: they may mishear it, keep
//! together and apart, act later, and head elsewhere than they mean to.

use std::collections::VecDeque;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::forces::consensus_force;
use super::noise::Noise;
use super::reynolds::{Lists, Reynolds};
use super::traits::Traits;
use super::{Force, Motion};
use crate::agents::{Agents, GROUP};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::vector::heading;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{Heard, Neighborhood};
use crate::parallel;
use crate::snapshot::{check, check_numbers};

#[derive(Debug, Clone)]
pub(crate) struct Response<const D: usize> {
    noise: Noise<D>,
    /// The neighbors' force in the step being made, by groups.
    forces: Vec<Force<D>>,
    /// The same by names in the steps before, the oldest one that still counts first.
    past: VecDeque<Vec<SVector<f64, D>>>,
    lists: Vec<Lists<D>>,
}

/// What of it outlasts a step, as plain data.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ResponseState {
    /// How far the stream of the noise has been drawn.
    drawn: u128,
    /// D entries per agent and step.
    past: Vec<Vec<f64>>,
}

impl<const D: usize> Response<D> {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            noise: Noise::new(seed),
            forces: Vec::new(),
            past: VecDeque::new(),
            lists: Vec::new(),
        }
    }

    pub(crate) fn save(&self) -> ResponseState {
        let entries = |forces: &Vec<SVector<f64, D>>| forces.iter().flatten().copied().collect();
        ResponseState {
            drawn: self.noise.drawn(),
            past: self.past.iter().map(entries).collect(),
        }
    }

    pub(crate) fn restore(state: ResponseState, config: &FlockConfig, seed: u64) -> Result<Self> {
        check(state.past.len() <= config.sensing_delay + 1, "past forces")?;
        let mut response = Self::new(seed);
        response.noise.go_on(state.drawn);
        for entries in state.past {
            check_numbers(&entries, config.num_agents * D, "past forces")?;
            let forces = entries.chunks_exact(D).map(SVector::from_column_slice);
            response.past.push_back(forces.collect());
        }
        Ok(response)
    }

    /// The neighbors' force in this step, by groups; `None` where it is the consensus force of what was just heard.
    pub(crate) fn find(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        neighborhood: &mut Neighborhood<D>,
    ) -> Option<&[Force<D>]> {
        self.noise.draw(config);
        let flocking = match &config.motion {
            Motion::Reynolds(law) => Some(law),
            Motion::Inertial(_) | Motion::Vicsek(_) => None,
        };
        if config.sensing_noise <= 0.0 && config.sensing_delay == 0 && flocking.is_none() {
            return None;
        }
        self.agree(config, agents, neighborhood);
        if let Some(law) = flocking {
            self.flock(config, law, agents, neighborhood);
        }
        if config.sensing_delay > 0 {
            self.delay(config, agents.names());
        }
        Some(&self.forces)
    }

    /// Finds the consensus forces.
    fn agree(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        neighborhood: &mut Neighborhood<D>,
    ) {
        let unit = neighborhood.scale();
        self.forces.clear();
        let mut traits = Traits::of_first(config);
        let names = agents.names().chunks(GROUP);
        for (heard, names) in neighborhood.heard_mut().iter_mut().zip(names) {
            traits.follow(config, names);
            let mut force = consensus_force(&traits, heard);
            if config.sensing_noise > 0.0 {
                self.mishear(config, &traits, names, heard, unit, &mut force);
            }
            self.forces.push(force);
        }
    }

    /// Adds the forces of separation and cohesion.
    fn flock(
        &mut self,
        config: &FlockConfig,
        law: &Reynolds,
        agents: &Agents<D>,
        neighborhood: &Neighborhood<D>,
    ) {
        let pairs = neighborhood.pairs(agents);
        let (low, high) = neighborhood.bounds();
        let extent = (0..D).fold(0.0, |most: f64, axis| most.max(high[axis] - low[axis]));
        let scale = Scale::for_registers(extent, agents.len());
        let chunks = parallel::num_chunks(self.forces.len());
        self.lists.resize_with(chunks, Lists::new);
        parallel::for_each_chunk_with(&mut self.forces, &mut self.lists, |first, forces, lists| {
            let mut traits = Traits::of_first(config);
            for (group, force) in (first..).zip(forces) {
                traits.follow(config, agents.names_of(group));
                law.add_forces(&pairs, scale, group, &traits, lists, force);
            }
        });
    }

    /// The consensus force of a mean velocity that was heard with an error.
    fn mishear(
        &self,
        config: &FlockConfig,
        traits: &Traits,
        names: &[u32],
        heard: &Heard<D>,
        unit: Scale,
        force: &mut Force<D>,
    ) {
        for (lane, &name) in names.iter().enumerate() {
            let mean = |axis: usize, _| unit.mean(heard.sum[axis][lane], heard.count[lane]);
            let believed = self
                .noise
                .believed(config, name as usize, SVector::from_fn(mean));
            let aim = heading(&believed) * traits.alignment[lane];
            for axis in 0..D {
                force[axis][lane] = aim[axis];
            }
        }
    }

    /// Keeps the forces for later, and takes those of `sensing_delay` steps ago; until then, those of t = 0.
    fn delay(&mut self, config: &FlockConfig, names: &[u32]) {
        let spare = if self.past.len() > config.sensing_delay {
            self.past.pop_front()
        } else {
            None
        };
        let mut latest = spare.unwrap_or_else(|| vec![SVector::zeros(); config.num_agents]);
        let force = |forces: &[Force<D>], place: usize| {
            SVector::from_fn(|axis, _| forces[place / GROUP][axis][place % GROUP])
        };
        for (place, &name) in names.iter().enumerate() {
            latest[name as usize] = force(&self.forces, place);
        }
        self.past.push_back(latest);
        let oldest = &self.past[0];
        for (place, &name) in names.iter().enumerate() {
            for axis in 0..D {
                self.forces[place / GROUP][axis][place % GROUP] = oldest[name as usize][axis];
            }
        }
    }

    /// Turns every heading by its error.
    pub(crate) fn err(&self, agents: &mut Agents<D>) {
        self.noise.turn(agents);
    }
}
