//! Resets of a batch. New episodes are built outside of the batch, so that a failed or cancelled reset
//! changes nothing.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::episode::options::EpisodeConfig;
use crate::episode::slot::Slot;
use crate::flock::InitialState;
use crate::parallel::{Pool, Progress, dispatch};

/// Cost of drawing and sorting an agent, in units of the cost of its step.
const RESET_COST: usize = 16;

/// How one slot is reset.
#[derive(Debug, Clone)]
pub struct SlotReset {
    /// Index of the slot.
    pub slot: usize,
    /// A seed starts a new schedule; `None` continues the slot's schedule.
    pub seed: Option<u64>,
    /// The number of the episode in the schedule; `None` is the next one.
    pub episode: Option<u64>,
    /// The arrays of the initial state. Their seed is ignored.
    pub start: Arc<InitialState>,
}

/// The new slots of a reset, before they replace the slots of the batch.
#[derive(Debug)]
pub struct Reset<const D: usize> {
    config: Arc<EpisodeConfig>,
    slots: BTreeMap<usize, (Slot<D>, Arc<InitialState>)>,
    pool: Pool,
}

impl<const D: usize> Reset<D> {
    /// Starts the episodes of the new slots.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if `progress` was cancelled.
    pub fn build(mut self, progress: &Progress) -> Result<Self> {
        let config = &self.config;
        let built = dispatch(self.pool, self.slots.values_mut(), |(slot, start)| {
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

    /// Starts new episodes in several slots, given as pairs (slot, seed), from the same `start`; see
    /// [`SlotReset`].
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
        let start = Arc::new(start.clone());
        let resets = resets.iter().map(|&(slot, seed)| SlotReset {
            slot,
            seed,
            episode,
            start: start.clone(),
        });
        let reset = self.prepare_reset(resets)?;
        self.commit(reset.build(&Progress::default())?);
        Ok(())
    }

    /// Checks how several slots are reset and returns a [`Reset`] to build and then to commit.
    ///
    /// # Errors
    /// As [`Self::reset_many`].
    #[doc(hidden)]
    pub fn prepare_reset(&self, resets: impl Iterator<Item = SlotReset>) -> Result<Reset<D>> {
        let mut new_slots = BTreeMap::new();
        for SlotReset {
            slot,
            seed,
            episode,
            start,
        } in resets
        {
            let Some(old) = self.slots.get(slot) else {
                let expected = format!("an integer below {}", self.slots.len());
                return Err(Error::argument("slot", expected, slot));
            };
            start.check(old.scenario())?;
            let mut new = old.without_episode();
            if let Some(seed) = seed {
                new.seed(seed);
            }
            if let Some(episode) = episode {
                new.set_next_episode(episode);
            }
            new_slots.insert(slot, (new, start));
        }
        Ok(Reset {
            config: self.config.clone(),
            pool: self.pool(new_slots.len())?,
            slots: new_slots,
        })
    }

    /// Replaces slots of the batch by the new slots of a reset.
    #[doc(hidden)]
    pub fn commit(&mut self, reset: Reset<D>) {
        for (index, (slot, _)) in reset.slots {
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
