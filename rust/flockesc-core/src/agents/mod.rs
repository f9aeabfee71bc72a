//! Where the agents stand in memory: in groups, column by column, so that agents that are near each other in the
//! world are near each other in memory and a vector register holds one coordinate of a whole tile.

mod arrange;
mod centroid;
mod layout;
mod per_agent;
mod state;

use nalgebra::SVector;

use arrange::{Agent, split};
pub(crate) use centroid::centroid;
pub(crate) use layout::{Column, FAN, GROUP, Group, TILE, is_large, reduce};
pub use per_agent::PerAgent;
pub(crate) use state::AgentsState;

/// An agent that has left the flock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Caught<const D: usize> {
    pub(crate) name: u32,
    /// Where it was caught, in m.
    pub(crate) position: [f64; D],
}

/// All agents of a flock. A *place* is where an agent stands in memory, its *name* is the index that users know.
/// Agents that were caught have no place, but keep their names.
#[derive(Debug, Clone)]
pub(crate) struct Agents<const D: usize> {
    /// At least one, also of a flock of which nobody is left.
    pub(crate) groups: Vec<Group<D>>,
    /// Name of the agent in every place.
    names: Vec<u32>,
    /// Those that have left, in the order of the steps that caught them.
    caught: Vec<Caught<D>>,
    scratch: Vec<Agent<D>>,
}

impl<const D: usize> Agents<D> {
    pub(crate) fn new(positions: &[SVector<f64, D>], velocities: &[SVector<f64, D>]) -> Self {
        let mut agents = Self {
            groups: vec![Group::EMPTY; positions.len().div_ceil(GROUP)],
            names: vec![0; positions.len()],
            caught: Vec::new(),
            scratch: Vec::with_capacity(positions.len()),
        };
        let given = positions.iter().zip(velocities).zip(0..);
        agents.scratch.extend(given.map(|((r, v), name)| Agent {
            position: (*r).into(),
            velocity: (*v).into(),
            speed: v.norm(),
            distance: f64::INFINITY,
            name,
        }));
        agents.settle();
        agents
    }

    /// Number of agents in the flock, those that were caught left out.
    pub(crate) fn len(&self) -> usize {
        self.names.len()
    }

    /// Number of agents that there were at t = 0; names are below it.
    pub(crate) fn num_names(&self) -> usize {
        self.names.len() + self.caught.len()
    }

    /// The agents that have left.
    pub(crate) fn caught(&self) -> &[Caught<D>] {
        &self.caught
    }

    /// Names of the agents of a group, in the order of places.
    pub(crate) fn names_of(&self, group: usize) -> &[u32] {
        &self.names[group * GROUP..self.len().min((group + 1) * GROUP)]
    }

    /// The groups and the names of the agents in their places, for changes to the groups.
    pub(crate) fn groups_and_names(&mut self) -> (&mut [Group<D>], &[u32]) {
        (&mut self.groups, &self.names)
    }

    /// Names of all agents, in the order of places.
    pub(crate) fn names(&self) -> &[u32] {
        &self.names
    }

    /// Name of the agent in a place.
    pub(crate) fn name(&self, place: usize) -> usize {
        self.names[place] as usize
    }

    /// Name, position and velocity of the agent in a place.
    pub(crate) fn at(&self, place: usize) -> (usize, SVector<f64, D>, SVector<f64, D>) {
        let (group, lane) = (&self.groups[place / GROUP], place % GROUP);
        (
            self.name(place),
            SVector::from_fn(|axis, _| group.position[axis][lane]),
            SVector::from_fn(|axis, _| group.velocity[axis][lane]),
        )
    }

    /// The same of every agent, in the order of places.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, SVector<f64, D>, SVector<f64, D>)> {
        (0..self.len()).map(|place| self.at(place))
    }

    /// The vectors in some columns, in the order of names; 0 for agents that were caught.
    pub(crate) fn by_name(
        &self,
        columns: impl Fn(&Group<D>) -> &[Column<f64>; D],
    ) -> Vec<SVector<f64, D>> {
        let mut vectors = vec![SVector::zeros(); self.num_names()];
        for (index, group) in self.groups.iter().enumerate() {
            let columns = columns(group);
            for (lane, &name) in self.names_of(index).iter().enumerate() {
                vectors[name as usize] = SVector::from_fn(|axis, _| columns[axis][lane]);
            }
        }
        vectors
    }

    /// Takes away whatever a step has left where there is no agent.
    pub(crate) fn clear_empty_places(&mut self) {
        let whole = GROUP * (self.groups.len() - 1);
        let filled = self.len() - whole;
        if let Some(last) = self.groups.last_mut() {
            for column in &mut last.velocity {
                column[filled..].fill(0.0);
            }
        }
    }

    /// Puts agents that have left [0, `side`) along an axis back in on the other side.
    pub(crate) fn wrap(&mut self, side: f64) {
        for column in self.groups.iter_mut().flat_map(|group| &mut group.position) {
            for coordinate in column {
                let wrapped = coordinate.rem_euclid(side);
                // Of a tiny negative number the remainder rounds up to the side itself.
                *coordinate = if wrapped < side {
                    wrapped
                } else {
                    wrapped - side
                };
            }
        }
    }

    /// Takes the agents whose nearest predator is at most `radius` m away out of the flock. The others close up in
    /// their order; `moved` is told from which place to which.
    pub(crate) fn catch(&mut self, radius: f64, mut moved: impl FnMut(usize, usize)) {
        let mut kept = 0;
        for place in 0..self.len() {
            let agent = self.agent(place);
            if agent.distance <= radius {
                self.caught.push(Caught {
                    name: agent.name,
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
        self.names.truncate(kept);
        self.groups.truncate(kept.div_ceil(GROUP).max(1));
        let whole = GROUP * (self.groups.len() - 1);
        if let Some(last) = self.groups.last_mut() {
            last.empty_from(kept - whole);
        }
    }

    /// Gives every agent a new place, such that the agents of every tile, group and node are close together.
    pub(crate) fn arrange(&mut self) {
        self.scratch.clear();
        for place in 0..self.len() {
            self.scratch.push(self.agent(place));
        }
        self.settle();
    }

    fn settle(&mut self) {
        split(&mut self.scratch);
        for place in 0..self.scratch.len() {
            self.put(place, self.scratch[place]);
        }
    }

    fn agent(&self, place: usize) -> Agent<D> {
        let (group, lane) = (&self.groups[place / GROUP], place % GROUP);
        Agent {
            position: std::array::from_fn(|axis| group.position[axis][lane]),
            velocity: std::array::from_fn(|axis| group.velocity[axis][lane]),
            speed: group.speed[lane],
            distance: group.distance[lane],
            name: self.names[place],
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
        self.names[place] = agent.name;
    }
}
