//! Storage of the agents: positions and velocities as columns of groups, sorted so that agents that are close
//! in space are close in memory.

mod layout;
mod per_agent;
mod state;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

pub(crate) use layout::{Column, FANOUT, GROUP, Group, LEAF, centroid, corners, is_large, reduce};
use layout::{Key, order, place_of};
pub use per_agent::PerAgent;
pub(crate) use state::AgentsState;

/// A caught agent.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Caught<const D: usize> {
    pub(crate) id: u32,
    /// Position in m at its capture.
    pub(crate) position: SVector<f64, D>,
}

/// All agents of a flock. An agent's *place* is its index in memory and changes with every sort. Its *id* is
/// its index in the public interface and never changes. Caught agents have an id but no place.
#[derive(Debug, Clone)]
pub(crate) struct Agents<const D: usize> {
    /// At least one group, even if all agents were caught.
    pub(crate) groups: Vec<Group<D>>,
    /// Ids of the agents, in the order of places.
    ids: Vec<u32>,
    /// The caught agents, in the order of their capture.
    caught: Vec<Caught<D>>,
    /// Whether a predator has reached an agent, by id; empty in scenarios that do not ask for it.
    reached: Vec<bool>,
    /// Buffers of the sort.
    keys: Vec<Key>,
    spare: (Vec<Group<D>>, Vec<u32>),
}

/// All data of one agent.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Agent<const D: usize> {
    pub(crate) id: u32,
    /// r in m.
    pub(crate) position: SVector<f64, D>,
    /// v in m/s.
    pub(crate) velocity: SVector<f64, D>,
    /// ||v|| in m/s, as the last step computed it. It may differ from the norm of `velocity` by rounding.
    speed: f64,
    /// Distance to the nearest predator in m; recomputed after a restore.
    #[serde(skip)]
    distance: f64,
}

impl<const D: usize> Agents<D> {
    pub(crate) fn new(positions: &[SVector<f64, D>], velocities: &[SVector<f64, D>]) -> Self {
        let mut agents = Self::unsorted(positions.len());
        for (id, (position, velocity)) in positions.iter().zip(velocities).enumerate() {
            let agent = Agent {
                id: id as u32,
                position: *position,
                velocity: *velocity,
                speed: velocity.norm(),
                distance: f64::INFINITY,
            };
            agents.put(id, agent);
        }
        agents.arrange();
        agents
    }

    /// Creates room for agents, at least one group.
    fn unsorted(num_agents: usize) -> Self {
        Self {
            groups: vec![Group::EMPTY; num_agents.div_ceil(GROUP).max(1)],
            ids: vec![0; num_agents],
            caught: Vec::new(),
            reached: Vec::new(),
            keys: Vec::new(),
            spare: (Vec::new(), Vec::new()),
        }
    }

    /// Returns the number of agents that were not caught.
    pub(crate) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Returns the number of agents at t = 0, caught agents included.
    pub(crate) fn num_agents(&self) -> usize {
        self.ids.len() + self.caught.len()
    }

    /// Returns the caught agents.
    pub(crate) fn caught(&self) -> &[Caught<D>] {
        &self.caught
    }

    /// Returns the ids of a group's agents, in the order of places.
    pub(crate) fn ids_of(&self, group: usize) -> &[u32] {
        &self.ids[group * GROUP..self.len().min((group + 1) * GROUP)]
    }

    /// Returns the groups as mutable and the ids of all agents, in the order of places.
    pub(crate) fn groups_and_ids(&mut self) -> (&mut [Group<D>], &[u32]) {
        (&mut self.groups, &self.ids)
    }

    /// Returns the ids of all agents, in the order of places.
    pub(crate) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Returns the id of the agent at `place`.
    pub(crate) fn id(&self, place: usize) -> usize {
        self.ids[place] as usize
    }

    /// Returns the position in m of the agent at `place`.
    #[inline(always)]
    pub(crate) fn position(&self, place: usize) -> [f64; D] {
        let position = &self.groups[place / GROUP].position;
        std::array::from_fn(|axis| position[axis][place % GROUP])
    }

    /// Returns the velocity of the agent at `place` in fixed point, in the unit of the tree.
    #[inline(always)]
    pub(crate) fn fixed_velocity(&self, place: usize) -> [i64; D] {
        let velocity = &self.groups[place / GROUP].fixed_velocity;
        std::array::from_fn(|axis| velocity[axis][place % GROUP])
    }

    /// Returns all agents, in the order of places.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Agent<D>> {
        (0..self.len()).map(|place| self.agent(place))
    }

    /// Returns the vectors stored in the given columns, in the order of ids; 0 for caught agents.
    pub(crate) fn by_id(
        &self,
        columns: impl Fn(&Group<D>) -> &[Column<f64>; D],
    ) -> Vec<SVector<f64, D>> {
        let mut vectors = vec![SVector::zeros(); self.num_agents()];
        for (index, group) in self.groups.iter().enumerate() {
            let columns = columns(group);
            for (lane, &id) in self.ids_of(index).iter().enumerate() {
                vectors[id as usize] = SVector::from_fn(|axis, _| columns[axis][lane]);
            }
        }
        vectors
    }

    /// Clears the lanes without an agent, after a step has written to all lanes or agents were caught.
    pub(crate) fn clear_empty_places(&mut self) {
        let filled = self.len() - GROUP * (self.groups.len() - 1);
        if let Some(last) = self.groups.last_mut() {
            last.empty_from(filled);
        }
    }

    /// Wraps coordinates into [0, `side`).
    pub(crate) fn wrap(&mut self, side: f64) {
        for column in self.groups.iter_mut().flat_map(|group| &mut group.position) {
            for coordinate in column {
                let wrapped = coordinate.rem_euclid(side);
                // For a tiny negative coordinate the remainder rounds up to `side`.
                *coordinate = if wrapped < side {
                    wrapped
                } else {
                    wrapped - side
                };
            }
        }
    }

    /// Removes the agents whose nearest predator is at most `radius` m away. The other agents keep their
    /// order and fill the gaps. Calls `moved(old place, new place)` for every agent that moves.
    pub(crate) fn catch(&mut self, radius: f64, mut moved: impl FnMut(usize, usize)) {
        let mut kept = 0;
        for place in 0..self.len() {
            let agent = self.agent(place);
            if agent.distance <= radius {
                self.caught.push(Caught {
                    id: agent.id,
                    position: agent.position,
                });
            } else {
                if kept < place {
                    self.put(kept, agent);
                    moved(place, kept);
                }
                kept += 1;
            }
        }
        self.ids.truncate(kept);
        self.groups.truncate(kept.div_ceil(GROUP).max(1));
        self.clear_empty_places();
    }

    /// Marks the agents whose nearest predator is at most `range` m away as reached.
    pub(crate) fn mark_reached(&mut self, range: f64) {
        self.reached.resize(self.num_agents(), false);
        for place in 0..self.len() {
            let distance = self.groups[place / GROUP].distance[place % GROUP];
            self.reached[self.ids[place] as usize] |= distance <= range;
        }
    }

    /// Returns whether a predator has reached the agent at `place`.
    pub(crate) fn is_reached(&self, place: usize) -> bool {
        self.reached
            .get(self.id(place))
            .is_some_and(|reached| *reached)
    }

    /// Sorts the agents by position, so that the agents of every leaf, group and node are close together.
    pub(crate) fn arrange(&mut self) {
        // PERF: Only keys are sorted. Agents are then copied once, into buffers that change places with the old ones.
        order(&self.groups, self.len(), &mut self.keys);
        let (groups, ids) = &mut self.spare;
        groups.resize(self.groups.len(), Group::EMPTY);
        ids.clear();
        for (group, keys) in groups.iter_mut().zip(self.keys.chunks(GROUP)) {
            for (lane, &key) in keys.iter().enumerate() {
                let place = place_of(key);
                let (old, from) = (&self.groups[place / GROUP], place % GROUP);
                for axis in 0..D {
                    group.position[axis][lane] = old.position[axis][from];
                    group.velocity[axis][lane] = old.velocity[axis][from];
                }
                group.speed[lane] = old.speed[from];
                group.distance[lane] = old.distance[from];
                ids.push(self.ids[place]);
            }
            group.empty_from(keys.len());
        }
        std::mem::swap(&mut self.groups, groups);
        std::mem::swap(&mut self.ids, ids);
    }

    /// Returns the agent at `place`.
    pub(crate) fn agent(&self, place: usize) -> Agent<D> {
        let (group, lane) = (&self.groups[place / GROUP], place % GROUP);
        Agent {
            id: self.ids[place],
            position: SVector::from_fn(|axis, _| group.position[axis][lane]),
            velocity: SVector::from_fn(|axis, _| group.velocity[axis][lane]),
            speed: group.speed[lane],
            distance: group.distance[lane],
        }
    }

    /// Sets the positions or the velocities of all agents that are not caught, one row per id.
    pub(crate) fn set(&mut self, rows: &[[f64; D]], are_velocities: bool) {
        for place in 0..self.len() {
            let mut agent = self.agent(place);
            let row = SVector::from(rows[self.id(place)]);
            if !are_velocities {
                agent.position = row;
            } else if agent.velocity != row {
                (agent.velocity, agent.speed) = (row, row.norm());
            }
            self.put(place, agent);
        }
    }

    fn put(&mut self, place: usize, agent: Agent<D>) {
        let (group, lane) = (&mut self.groups[place / GROUP], place % GROUP);
        for axis in 0..D {
            group.position[axis][lane] = agent.position[axis];
            group.velocity[axis][lane] = agent.velocity[axis];
        }
        group.speed[lane] = agent.speed;
        group.distance[lane] = agent.distance;
        self.ids[place] = agent.id;
    }
}
