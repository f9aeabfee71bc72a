//! Slots of a batch as bytes.

use super::Batch;
use crate::error::{Error, Result};
use crate::slot::{Slot, SlotState};
use crate::state::{open, seal};

impl<const D: usize> Batch<D> {
    /// Everything about `slots` that their future depends on, as bytes: episodes with their random streams, and the
    /// seeds of those to come.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot.
    pub fn save(&self, slots: &[usize]) -> Result<Vec<u8>> {
        let states: Vec<SlotState> = slots
            .iter()
            .map(|slot| self.slots.get(*slot).map(Slot::save))
            .collect::<Option<_>>()
            .ok_or_else(|| self.no_such_slot(slots))?;
        seal(self.fingerprint, &states)
    }

    /// Makes `slots` what [`Self::save`] has saved, of this or another batch of the same scenario and configuration: as
    /// many slots, or one that all of them become.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot, or for bytes that are damaged, of another version, of something else
    /// or of another number of slots. Nothing has changed then.
    pub fn restore(&mut self, slots: &[usize], state: &[u8]) -> Result<()> {
        if slots.iter().any(|slot| *slot >= self.slots.len()) {
            return Err(self.no_such_slot(slots));
        }
        let states: Vec<SlotState> = open(self.fingerprint, state)?;
        if states.len() != slots.len() && states.len() != 1 {
            let expected = format!("one of 1 or {} flocks", slots.len());
            return Err(Error::argument("state", expected, states.len()));
        }
        let mut restored = states
            .into_iter()
            .map(|state| Slot::restore(state, &self.scenario, &self.config))
            .collect::<Result<Vec<_>>>()?;
        if let [only] = restored.as_slice() {
            restored = vec![only.clone(); slots.len()];
        }
        for (slot, restored) in slots.iter().zip(restored) {
            self.slots[*slot] = restored;
        }
        Ok(())
    }

    fn no_such_slot(&self, slots: &[usize]) -> Error {
        let expected = format!("integers below {}", self.slots.len());
        Error::argument("slots", expected, format!("{slots:?}"))
    }
}
