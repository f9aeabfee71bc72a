//! Resets of a batch. New episodes are built beside the running ones, so that a failed or cancelled reset
//! changes nothing.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::flock::{InitialState, probe_flocks};
use crate::parallel::{Progress, dispatch};

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

impl<const D: usize> Batch<D> {
    /// Starts a new episode in `slot` and the schedule of seeds that begins with `start.seed`.
    ///
    /// # Errors
    /// [`Error::Input`] if `slot` does not exist or `start` does not fit its scenario.
    pub fn reset(&mut self, slot: usize, start: &InitialState) -> Result<()> {
        let reset = SlotReset {
            slot,
            seed: Some(start.seed),
            episode: None,
            start: Arc::new(start.clone()),
        };
        self.reset_many(vec![reset], &Progress::default())
    }

    /// Starts new episodes in several slots.
    ///
    /// # Errors
    /// [`Error::Input`] if a slot does not exist or a start does not fit its scenario, or if a new episode draws a
    /// number that is out of bounds; [`Error::Memory`]; [`Error::Interrupted`] if `progress` was cancelled. The batch
    /// is then unchanged.
    pub fn reset_many(&mut self, resets: Vec<SlotReset>, progress: &Progress) -> Result<()> {
        let mut new_slots = BTreeMap::new();
        for reset in resets {
            let Some(old) = self.slots.get(reset.slot) else {
                let expected = format!("an integer below {}", self.slots.len());
                return Err(Error::input("slot", expected, reset.slot));
            };
            reset.start.check(&old.scenario)?;
            let mut new = old.without_episode();
            if let Some(seed) = reset.seed {
                new.schedule.restart(seed);
            }
            if let Some(episode) = reset.episode {
                new.schedule.next = episode;
            }
            new.draw_next()?;
            new_slots.insert(reset.slot, (new, reset.start));
        }
        // The old flocks stay until the new ones are complete.
        probe_flocks(self.scenario(), new_slots.len())?;
        let pool = self.pool(new_slots.len())?;
        let started = dispatch(pool, new_slots.values_mut(), |(slot, start)| {
            progress.check()?;
            slot.start(&self.config, start)
        });
        started.into_iter().collect::<Result<()>>()?;
        for (index, (slot, _)) in new_slots {
            self.slots[index] = Arc::new(slot);
        }
        Ok(())
    }

    /// Estimates the cost of a reset of `slots` slots and of their observations, in the unit of
    /// [`Self::work`].
    #[doc(hidden)]
    pub fn work_of_reset(&self, slots: usize) -> usize {
        let start = RESET_COST.saturating_mul(self.scenario().num_agents);
        slots.saturating_mul(start.saturating_add(self.observation_work))
    }
}
