//! What agents do about what they hear, where that is more than to follow it at once: they may mishear it, act on it
//! later, and head elsewhere than they mean to.

use std::collections::VecDeque;

use nalgebra::SVector;

use super::Force;
use super::forces::consensus_force;
use super::noise::Noise;
use super::traits::Traits;
use crate::agents::{Agents, GROUP};
use crate::config::FlockConfig;
use crate::exact::Scale;
use crate::neighbor::Heard;
use crate::vector::heading;

#[derive(Debug, Clone)]
pub(crate) struct Response<const D: usize> {
    noise: Noise<D>,
    /// The neighbors' force in the step being made, by groups.
    forces: Vec<Force<D>>,
    /// The same by names in the steps before, the oldest one that still counts first.
    past: VecDeque<Vec<SVector<f64, D>>>,
}

impl<const D: usize> Response<D> {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            noise: Noise::new(seed),
            forces: Vec::new(),
            past: VecDeque::new(),
        }
    }

    /// The neighbors' force in this step, by groups; `None` where it is the consensus force of what was just heard.
    pub(crate) fn find(
        &mut self,
        config: &FlockConfig,
        agents: &Agents<D>,
        heard: &mut [Heard<D>],
        unit: Scale,
    ) -> Option<&[Force<D>]> {
        self.noise.draw(config);
        if config.sensing_noise <= 0.0 && config.sensing_delay == 0 {
            return None;
        }
        let names = agents.names();
        self.forces.clear();
        let mut traits = Traits::of_first(config);
        for (heard, names) in heard.iter_mut().zip(names.chunks(GROUP)) {
            traits.follow(config, names);
            let mut force = consensus_force(&traits, heard);
            if config.sensing_noise > 0.0 {
                self.mishear(config, &traits, names, heard, unit, &mut force);
            }
            self.forces.push(force);
        }
        if config.sensing_delay > 0 {
            self.delay(config, names);
        }
        Some(&self.forces)
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
        let mut latest = spare.unwrap_or_else(|| vec![SVector::zeros(); names.len()]);
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
