//! Changes of a world between steps, and what it says about the last step.

use nalgebra::SVector;

use super::World;
use crate::agents::GROUP;
use crate::base::vector::norm;

impl<const D: usize> World<D> {
    /// Sets the positions in m, or the velocities in m/s, of all agents that are not caught, D entries per id.
    pub(crate) fn set(&mut self, vectors: &[f64], are_velocities: bool) {
        let (rows, (groups, ids)) = (vectors.as_chunks().0, self.agents.groups_and_ids());
        for (place, &id) in ids.iter().enumerate() {
            let (group, lane, row) = (&mut groups[place / GROUP], place % GROUP, rows[id as usize]);
            let columns = if are_velocities {
                &mut group.velocity
            } else {
                &mut group.position
            };
            // The speed of the last step may differ from the norm by rounding. It stays with the velocity.
            let is_new = row != columns.each_ref().map(|column| column[lane]);
            columns
                .iter_mut()
                .zip(row)
                .for_each(|(column, entry)| column[lane] = entry);
            if are_velocities && is_new {
                group.speed[lane] = norm(&row);
            }
        }
        if let Some(side) = self.config.periodic_side {
            self.agents.wrap(side);
        }
        self.measure();
        self.neighborhood.refresh_changed(&mut self.agents);
    }

    /// Returns the number of other agents that each agent heard in the last step, in the order of ids.
    pub fn heard(&self) -> Vec<i64> {
        let mut heard = vec![0; self.agents.num_agents()];
        for (place, &id) in self.agents.ids().iter().enumerate() {
            heard[id as usize] = self.neighborhood.sums()[place / GROUP].count[place % GROUP] - 1;
        }
        heard
    }

    /// Returns the ids of the caught agents, in the order of their capture, and the predator that is now nearest.
    pub(crate) fn captures(&self) -> impl DoubleEndedIterator<Item = (usize, i64)> {
        self.agents.caught().iter().map(|agent| {
            let distance = |predator: &[f64; D]| (SVector::from(*predator) - agent.position).norm();
            let nearest = (0..).zip(self.after.iter().map(distance));
            let nearest = nearest.min_by(|a, b| a.1.total_cmp(&b.1));
            (agent.id as usize, nearest.map_or(-1, |(index, _)| index))
        })
    }
}
