//! Resets of a batch. New episodes are built outside of the batch, so that a failed or cancelled reset
//! changes nothing.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::episode::options::EpisodeConfig;
use crate::episode::slot::Slot;
use crate::flock::InitialState;
use crate::parallel::{Pool, Progress, dispatch};

/// Cost of drawing and sorting an agent, in units of the cost of its step.
const RESET_COST: usize = 16;

/// The new slots of a reset, before they replace the slots of the batch.
#[derive(Debug)]
pub struct Reset<const D: usize> {
    config: Arc<EpisodeConfig>,
    start: InitialState,
    slots: BTreeMap<usize, Slot<D>>,
    pool: Pool,
}

impl<const D: usize> Reset<D> {
    /// Starts the episodes of the new slots.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if `progress` was cancelled.
    pub fn build(mut self, progress: &Progress) -> Result<Self> {
        let (config, start) = (&self.config, &self.start);
        let built = dispatch(self.pool, self.slots.values_mut(), |slot| {
            progress.check()?;
            slot.start(config, start);
            Ok(())
        });
        built.into_iter().collect::<Result<()>>()?;
        Ok(self)
    }
}

impl<const D: usize> Batch<D> {
    /// Starts a new episode in `slot` and the schedule of seeds that begins with `start.seed`.
    ///
    /// # Errors
    /// [`Error::Argument`] if `slot` does not exist or `start` does not fit its scenario.
    pub fn reset(&mut self, slot: usize, start: &InitialState) -> Result<()> {
        self.reset_many(&[(slot, Some(start.seed))], None, start)
    }

    /// Starts new episodes in several slots, given as pairs (slot, seed).
    ///
    /// A seed starts a new schedule; `None` continues the slot's schedule. `episode` is the number of the
    /// episode in the schedule; `None` is the next one. All episodes start from the arrays of `start`, whose
    /// seed is ignored.
    ///
    /// # Errors
    /// [`Error::Argument`] if a slot does not exist or `start` does not fit the scenario of one. The batch is then
    /// unchanged.
    pub fn reset_many(
        &mut self,
        resets: &[(usize, Option<u64>)],
        episode: Option<u64>,
        start: &InitialState,
    ) -> Result<()> {
        let reset = self.prepare_reset(resets, episode, start.clone())?;
        self.commit(reset.build(&Progress::default())?);
        Ok(())
    }

    /// Checks the arguments of [`Self::reset_many`] and returns a [`Reset`] to build and then to commit.
    ///
    /// # Errors
    /// As [`Self::reset_many`].
    #[doc(hidden)]
    pub fn prepare_reset(
        &self,
        resets: &[(usize, Option<u64>)],
        episode: Option<u64>,
        start: InitialState,
    ) -> Result<Reset<D>> {
        let slots = self.slots.len();
        if let Some((slot, _)) = resets.iter().find(|(slot, _)| *slot >= slots) {
            let expected = format!("an integer below {slots}");
            return Err(Error::argument("slot", expected, slot));
        }
        let mut new_slots = BTreeMap::new();
        for &(index, seed) in resets {
            start.check(self.slots[index].scenario())?;
            let slot = new_slots
                .entry(index)
                .or_insert_with(|| self.slots[index].without_episode());
            if let Some(seed) = seed {
                slot.seed(seed);
            }
            if let Some(episode) = episode {
                slot.set_next_episode(episode);
            }
        }
        // The old flocks stay until the new ones are complete. A new one takes half before its first step.
        let share = resets.len() as u128 * self.bytes / self.slots.len() as u128;
        memory::check("slots", share / 2)?;
        Ok(Reset {
            config: self.config.clone(),
            start,
            slots: new_slots,
            pool: self.pool(resets.len())?,
        })
    }

    /// Replaces slots of the batch by the new slots of a reset.
    #[doc(hidden)]
    pub fn commit(&mut self, reset: Reset<D>) {
        for (index, slot) in reset.slots {
            self.slots[index] = slot;
        }
    }

    /// Estimates the cost of a reset of `slots` slots, in the unit of [`Self::work`].
    #[doc(hidden)]
    #[must_use]
    pub fn work_of_reset(&self, slots: usize) -> usize {
        slots
            .saturating_mul(RESET_COST)
            .saturating_mul(self.scenario().num_agents)
    }
}
