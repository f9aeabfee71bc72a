//! Steps of a batch.

use std::sync::Arc;

use strum::{EnumString, VariantNames};

use super::Batch;
use crate::base::check::length;
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::episode::Episode;
use crate::episode::slot::Slot;
use crate::flock::{InitialState, check_predator_actions, check_ranges};
use crate::parallel::{Progress, dispatch};

/// How a step treats a slot whose episode has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, EnumString, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum AtEnd {
    /// The step returns an error.
    Refuse,
    /// The slot starts its next episode instead of a step, with a reward of 0.
    Restart,
    /// The slot stays unchanged, with a reward of 0.
    Stay,
}

/// A pair of neighbors while a graph is frozen: in a list of pairs and in the list of an agent.
type Frozen = ((u32, u32), u32);

impl<const D: usize> Batch<D> {
    /// Applies one action to every slot and writes rewards and observations. Learned predators fly
    /// straight on.
    ///
    /// `ranges` in m and `rewards` have `rows()` entries per flock, `observations` has
    /// `row_length()` entries per range.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset or its episode has ended; [`Error::Input`]
    /// if a range is negative or not finite, or if an array has the wrong length; [`Error::Memory`] for a graph that the
    /// step freezes. The batch is then unchanged.
    pub fn step(
        &mut self,
        ranges: &[f64],
        rewards: &mut [f64],
        observations: &mut [f32],
    ) -> Result<()> {
        let progress = Progress::default();
        let action = (ranges, &[][..]);
        self.step_measured(
            action,
            AtEnd::Refuse,
            rewards,
            observations,
            &progress,
            |_| (),
        )
        .map(drop)
    }

    /// Steps as [`Self::step`] does and returns `measure(episode)` of every slot.
    ///
    /// `predator_actions` are the actions of the learned predators: flock after flock, D entries in
    /// [-1, 1] for each predator. If they are empty, learned predators fly straight on.
    ///
    /// # Errors
    /// As [`Self::step`]; [`Error::Input`] as in [`Self::reset_many`]; [`Error::Interrupted`] if `progress` was
    /// cancelled. All episodes are then unusable until a reset.
    #[doc(hidden)]
    pub fn step_measured<T: Send>(
        &mut self,
        (ranges, predator_actions): (&[f64], &[f64]),
        at_end: AtEnd,
        rewards: &mut [f64],
        observations: &mut [f32],
        progress: &Progress,
        measure: impl Fn(&Episode<D>) -> T + Send + Sync,
    ) -> Result<Vec<T>> {
        self.check_step(ranges, at_end, rewards.len(), observations.len())?;
        let num_entries = self.num_flocks() * self.num_learned() * D;
        check_predator_actions(predator_actions, num_entries)?;
        let entries_per_flock = predator_actions.len() / self.num_flocks();
        let rows = self.rows();
        let size = rows * self.row_length;
        let pool = self.pool(self.num_flocks())?;
        let config = &self.config;
        let work = self
            .slots
            .iter_mut()
            .enumerate()
            .zip(ranges.chunks_exact(rows))
            .zip(rewards.chunks_exact_mut(rows))
            .zip(observations.chunks_exact_mut(size));
        let measured = dispatch(pool, work, |((((index, slot), ranges), rewards), out)| {
            let first = index * entries_per_flock;
            let predator_actions = &predator_actions[first..first + entries_per_flock];
            let slot = Arc::make_mut(slot);
            let has_advanced = slot.advance(ranges, predator_actions, rewards, progress)?;
            if !has_advanced && at_end == AtEnd::Restart {
                slot.start(config, &InitialState::default())?;
            }
            let Some(episode) = &slot.episode else {
                return Ok(None);
            };
            episode.observe(out, progress)?;
            Ok(Some(measure(episode)))
        });
        let measured: Result<Vec<Option<T>>> = measured.into_iter().collect();
        Ok(measured?.into_iter().flatten().collect())
    }

    fn check_step(
        &mut self,
        ranges: &[f64],
        at_end: AtEnd,
        rewards: usize,
        observations: usize,
    ) -> Result<()> {
        let rows = self.num_flocks() * self.rows();
        length("interaction_range", ranges.len(), rows, "entries", "")?;
        length("rewards", rewards, rows, "entries", "")?;
        let num_entries = rows * self.row_length;
        length("observations", observations, num_entries, "entries", "")?;
        self.check_episodes(at_end)?;
        check_ranges("interaction_range", ranges)?;
        if at_end == AtEnd::Restart {
            let has_ended = |slot: &Slot<D>| slot.episode.as_ref().is_some_and(Episode::has_ended);
            let ended = (0..self.num_flocks()).filter(|&slot| has_ended(&self.slots[slot]));
            self.draw_next(ended.collect())?;
        }
        let mut num_pairs = 0;
        for (slot, ranges) in ranges.chunks_exact(self.rows()).enumerate() {
            if self.slots[slot].scenario.frozen_graph {
                num_pairs += self.episode(slot)?.pairs_to_freeze(ranges)?;
            }
        }
        memory::probe::<Frozen>("interaction_range", num_pairs)
    }

    /// Draws the scenarios of the next episodes of `slots`, so that their reset after a step does not fail.
    ///
    /// # Errors
    /// [`Error::Input`] if a drawn number is out of bounds.
    #[doc(hidden)]
    pub fn draw_next(&mut self, slots: Vec<usize>) -> Result<()> {
        for slot in slots {
            let slot = &mut self.slots[slot];
            if !slot.scenario.randomization.is_empty() {
                Arc::make_mut(slot).draw_next()?;
            }
        }
        Ok(())
    }

    /// Checks that every slot has an episode and, under [`AtEnd::Refuse`], that none has ended.
    ///
    /// # Errors
    /// [`Error::Episode`] for the first slot that needs a reset.
    #[doc(hidden)]
    pub fn check_episodes(&self, at_end: AtEnd) -> Result<()> {
        for (index, slot) in self.slots.iter().enumerate() {
            let Some(episode) = &slot.episode else {
                let message = format!("step() called before reset(): flock {index} has no episode");
                return Err(Error::episode(message));
            };
            if episode.has_ended() && at_end == AtEnd::Refuse {
                let message =
                    format!("step() called after the end of flock {index}'s episode; call reset()");
                return Err(Error::episode(message));
            }
        }
        Ok(())
    }
}
