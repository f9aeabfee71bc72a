//! Snapshots of a batch's slots.

use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::episode::slot::SlotState;
use crate::snapshot::{Fingerprint, decode, encode};

impl<const D: usize> Batch<D> {
    /// Returns a snapshot of `slots`: their episodes with the random streams, and their schedules of seeds.
    ///
    /// # Errors
    /// [`Error::Input`] if a slot does not exist.
    pub fn save(&self, slots: &[usize]) -> Result<Vec<u8>> {
        let states: Vec<SlotState<D>> = slots
            .iter()
            .map(|slot| self.slots.get(*slot).map(|slot| slot.save()))
            .collect::<Option<_>>()
            .ok_or_else(|| self.no_such_slot(slots))?;
        encode(self.fingerprint(slots), &states)
    }

    /// Restores `slots` from a snapshot by [`Self::save`] of any batch with the same options. The snapshot has as
    /// many slots with the same scenarios in the same order, or one slot that is copied to all.
    ///
    /// # Errors
    /// [`Error::Input`] if a slot does not exist, or if the bytes are damaged or have another version,
    /// scenarios, options or number of slots. The batch is then unchanged.
    pub fn restore(&mut self, slots: &[usize], state: &[u8]) -> Result<()> {
        if slots.iter().any(|slot| *slot >= self.slots.len()) {
            return Err(self.no_such_slot(slots));
        }
        let states: Vec<SlotState<D>> = decode(self.fingerprint(slots), state)?;
        if states.len() != slots.len() && states.len() != 1 {
            let expected = format!("a state of 1 or {} flocks", slots.len());
            return Err(Error::input("state", expected, states.len()));
        }
        let mut restored = states
            .into_iter()
            .zip(slots)
            .map(|(state, slot)| self.slots[*slot].restored(state, &self.config))
            .collect::<Result<Vec<_>>>()?;
        if let [only] = restored.as_slice() {
            restored = vec![only.clone(); slots.len()];
        }
        for (slot, restored) in slots.iter().zip(restored) {
            self.slots[*slot] = Arc::new(restored);
        }
        Ok(())
    }

    /// Returns the fingerprint of `slots`, which exist: that of their scenario, or of all scenarios in order.
    fn fingerprint(&self, slots: &[usize]) -> Fingerprint {
        let all: Vec<_> = slots
            .iter()
            .map(|slot| self.slots[*slot].fingerprint)
            .collect();
        match all.first() {
            Some(first) if all.iter().all(|other| other == first) => *first,
            _ => Fingerprint::of(&all),
        }
    }

    fn no_such_slot(&self, slots: &[usize]) -> Error {
        let expected = format!("integers below {}", self.slots.len());
        Error::input("slots", expected, format!("{slots:?}"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{batch, scenarios, step};
    use super::*;
    use crate::flock::InitialState;

    fn running() -> Batch<2> {
        let mut running = batch(2, 1);
        for slot in 0..2 {
            running
                .reset(slot, &InitialState::seeded(slot as u64))
                .expect("a slot");
        }
        step(&mut running, 4.0).expect("steps left");
        running
    }

    #[test]
    fn a_snapshot_of_one_slot_restores_several() {
        let (source, mut other) = (running(), batch(3, 2));
        let good = source.save(&[1]).expect("a slot");
        other.restore(&[0, 1, 2], &good).expect("a state of one");
        for slot in 0..3 {
            assert_eq!(other.save(&[slot]).expect("a slot"), good);
        }
        assert!(other.restore(&[3], &good).is_err());
        assert!(other.save(&[3]).is_err());
        let both = source.save(&[0, 1]).expect("slots");
        assert!(other.restore(&[0, 1, 2], &both).is_err());
    }

    #[test]
    fn snapshots_belong_to_the_scenarios_of_their_slots() {
        let [first, second, _] = scenarios();
        let of = |scenarios: &[_]| {
            let config = running().config.as_ref().clone();
            Batch::<2>::with_scenarios(scenarios, config, Some(1)).expect("scenarios of one shape")
        };
        let mut mixed = of(&[first.clone(), second.clone(), first.clone()]);
        for slot in 0..3 {
            let start = InitialState::seeded(slot as u64);
            mixed.reset(slot, &start).expect("a slot");
        }
        let all = mixed.save(&[0, 1, 2]).expect("slots");
        let mut same = of(&[first.clone(), second.clone(), first.clone()]);
        same.restore(&[0, 1, 2], &all).expect("the same scenarios");
        assert_eq!(same.save(&[0, 1, 2]), Ok(all.clone()));
        let (pair, one) = (mixed.save(&[0, 1]), mixed.save(&[1]));
        let (pair, one) = (pair.expect("slots"), one.expect("a slot"));
        for refused in [
            same.restore(&[1, 0], &pair),
            same.restore(&[0, 2], &pair),
            same.restore(&[0, 1], &one),
            same.restore(&[0], &one),
            of(&[first.clone(), first.clone(), first.clone()]).restore(&[0, 1, 2], &all),
            of(&[second.clone(), first.clone(), first]).restore(&[0, 1, 2], &all),
        ] {
            let error = refused.expect_err("other scenarios").to_string();
            assert!(error.contains("same scenario"), "{error}");
        }
        assert_eq!(same.save(&[0, 1, 2]), Ok(all));
        same.restore(&[2, 1], &pair).expect("the same scenarios");
        of(&[second.clone(), second])
            .restore(&[0, 1], &one)
            .expect("its scenario");
    }

    #[test]
    fn errors_name_another_version() {
        let mut running = running();
        let mut bytes = running.save(&[0]).expect("a slot");
        bytes[4] += 1;
        let error = running.restore(&[0], &bytes).expect_err("another version");
        assert_eq!(
            error.to_string(),
            "state: expected version 6, got version 7"
        );
    }
}
