//! Resets: episodes are started apart from the batch, so that a reset that is refused or given up leaves no trace.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::episode::options::EpisodeConfig;
use crate::episode::slot::Slot;
use crate::flock::{FlockConfig, InitialState};
use crate::parallel::{Pool, Progress, dispatch};

/// Cost of drawing and arranging an agent, in steps of it.
const START: usize = 16;

/// What a reset makes of some slots, apart from their batch: given up half-made, it leaves no trace.
#[derive(Debug)]
pub struct Reset<const D: usize> {
    scenario: Arc<FlockConfig>,
    config: Arc<EpisodeConfig>,
    start: InitialState,
    slots: BTreeMap<usize, Slot<D>>,
    pool: Pool,
}

impl<const D: usize> Reset<D> {
    /// Starts the episodes.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if `progress` was cancelled.
    pub fn build(mut self, progress: &Progress) -> Result<Self> {
        let (scenario, config, start) = (&self.scenario, &self.config, &self.start);
        let built = dispatch(self.pool, self.slots.values_mut(), |slot| {
            progress.check()?;
            slot.start(scenario, config, start);
            Ok(())
        });
        built.into_iter().collect::<Result<()>>()?;
        Ok(self)
    }
}

impl<const D: usize> Batch<D> {
    /// Starts a new episode in `slot`, and the schedule of its seed.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot or `start` does not fit the scenario.
    pub fn reset(&mut self, slot: usize, start: &InitialState) -> Result<()> {
        self.reset_many(&[(slot, Some(start.seed))], None, start)
    }

    /// Starts new episodes in several slots: of the schedule of a seed of their own, or of the one that they follow. It is
    /// that of number `episode` or, where that is `None`, the next one.
    /// All take the arrays of `start`, whose seed does not count.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot or `start` does not fit the scenario. Nothing has changed
    /// then.
    pub fn reset_many(
        &mut self,
        resets: &[(usize, Option<u64>)],
        episode: Option<u64>,
        start: &InitialState,
    ) -> Result<()> {
        let reset = self.prepare_reset(resets, episode, start.clone())?;
        self.put(reset.build(&Progress::default())?);
        Ok(())
    }

    /// What [`Self::reset_many`] does, to be built apart from the batch and put into it then.
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
        start.check(&self.scenario)?;
        let slots = self.slots.len();
        if let Some((slot, _)) = resets.iter().find(|(slot, _)| *slot >= slots) {
            let expected = format!("an integer below {slots}");
            return Err(Error::argument("slot", expected, slot));
        }
        let mut fresh = BTreeMap::new();
        for &(index, seed) in resets {
            let slot = fresh
                .entry(index)
                .or_insert_with(|| self.slots[index].without_episode());
            if let Some(seed) = seed {
                slot.seed(seed);
            }
            if let Some(episode) = episode {
                slot.turn_to(episode);
            }
        }
        Ok(Reset {
            scenario: self.scenario.clone(),
            config: self.config.clone(),
            start,
            slots: fresh,
            pool: self.pool(resets.len())?,
        })
    }

    /// Puts the slots of a reset in the places of the old ones.
    #[doc(hidden)]
    pub fn put(&mut self, reset: Reset<D>) {
        for (index, slot) in reset.slots {
            self.slots[index] = slot;
        }
    }

    /// As [`Self::work`], of a reset of so many slots.
    #[doc(hidden)]
    #[must_use]
    pub fn work_of_reset(&self, slots: usize) -> usize {
        slots
            .saturating_mul(START)
            .saturating_mul(self.scenario.num_agents)
    }
}
