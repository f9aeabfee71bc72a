//! `Pairs`: iteration over all pairs of an agent and a neighbor, for all neighbor rules.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, LEAF};
use crate::base::error::Result;
use crate::base::memory;
use crate::base::vector::larger;
use crate::neighbor::engine::distances::Distances;
use crate::neighbor::engine::lists::{Lists, NO_PLACE, Pair, RANGE};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::options::NeighborOptions;

/// The neighbor graph at one time.
#[derive(Clone, Copy)]
pub(crate) struct Pairs<'a, const D: usize> {
    pub(crate) agents: &'a Agents<D>,
    pub(crate) tree: &'a Tree<D>,
    pub(crate) options: &'a NeighborOptions,
    /// Squared reaches in m^2 of the agents, group by group.
    pub(crate) squares: &'a [Column<f64>],
    pub(crate) choice: Choice<'a>,
}

/// The agents among which neighbors are chosen.
#[derive(Clone, Copy)]
pub(crate) enum Choice<'a> {
    /// All agents. Neighbors are the ones within reach and in view.
    All,
    /// The agents in lists. Neighbors are the ones within reach and in view. The second field has the places
    /// of all agents by id.
    Listed(&'a Lists, &'a [u32]),
    /// The agents in lists; all of them are neighbors. The second field has the places of all agents by id.
    Frozen(&'a Lists, &'a [u32]),
}

impl<'a, const D: usize> Pairs<'a, D> {
    /// Calls `add(lane, place)` for every agent of a group and each of its neighbors, where `place` is the
    /// neighbor's. An agent is its own neighbor. `leaves` is a buffer.
    pub(crate) fn visit(
        &self,
        group: usize,
        leaves: &mut Vec<u32>,
        mut add: impl FnMut(usize, usize),
    ) {
        let num_agents = self.agents.ids_of(group).len();
        match self.choice {
            Choice::All => {
                for leaf in group * FANOUT..group * FANOUT + num_agents.div_ceil(LEAF) {
                    self.list_near(leaf, leaves);
                    Arch::new().dispatch(VisitNear {
                        pairs: self,
                        leaf,
                        leaves,
                        add: |place, other| add(place % GROUP, other),
                    });
                }
            }
            Choice::Listed(lists, places) | Choice::Frozen(lists, places) => {
                let is_frozen = matches!(self.choice, Choice::Frozen(..));
                for (lane, &id) in self.agents.ids_of(group).iter().enumerate() {
                    let own = group * GROUP + lane;
                    add(lane, own);
                    let others = lists.of(id as usize).iter();
                    for other in others.map(|&other| places[other as usize]) {
                        let is_neighbor = |other| is_frozen || self.is_neighbor(own, other);
                        if other != NO_PLACE
                            && is_neighbor(other as usize)
                            && !self.is_blocked(own, other as usize)
                        {
                            add(lane, other as usize);
                        }
                    }
                }
            }
        }
    }

    /// Returns the ids of all pairs of an agent and a neighbor other than itself.
    ///
    /// # Errors
    /// As [`Self::count`].
    pub(crate) fn by_id(&self) -> Result<Vec<Pair>> {
        let mut pairs = memory::vector(RANGE, self.count()?)?;
        let mut leaves = Vec::new();
        for group in 0..self.agents.groups.len() {
            self.visit(group, &mut leaves, |lane, place| {
                if place != group * GROUP + lane {
                    let id = self.agents.ids_of(group)[lane];
                    pairs.push((id, self.agents.id(place) as u32));
                }
            });
        }
        Ok(pairs)
    }

    /// Returns the number of pairs of an agent and a neighbor other than itself.
    ///
    /// # Errors
    /// [`crate::Error::Memory`] as soon as the system does not grant a list of the pairs.
    pub(crate) fn count(&self) -> Result<usize> {
        // The memory is asked for whenever the count has doubled, so that a graph without room ends after few pairs.
        let (mut count, mut checked, mut leaves) = (0, 0, Vec::new());
        for group in 0..self.agents.groups.len() {
            self.visit(group, &mut leaves, |_, _| count += 1);
            count -= self.agents.ids_of(group).len();
            if count > 2 * checked {
                memory::probe::<Pair>(RANGE, count)?;
                checked = count;
            }
        }
        Ok(count)
    }

    /// Lists the leaves that may contain neighbors of a leaf's agents.
    pub(super) fn list_near(&self, leaf: usize, leaves: &mut Vec<u32>) {
        let (group, first) = (leaf / FANOUT, leaf % FANOUT * LEAF);
        let lanes = first..self.agents.ids_of(group).len().min(first + LEAF);
        let longest = self.squares[group][lanes].iter().copied().fold(0.0, larger);
        let bounds = self.tree.levels[0][group].bounds_of(leaf % FANOUT);
        let torus = self.options.torus;
        self.tree
            .list_leaves(leaves, |node| torus.squared_gap(&bounds, node) <= longest);
    }

    /// Calls `add(own, neighbor's place)` for the neighbors of the agent at place `own` among the agents of `leaf`.
    #[inline(always)]
    pub(super) fn visit_leaf<S: Simd>(
        &self,
        simd: S,
        own: usize,
        leaf: usize,
        add: &mut impl FnMut(usize, usize),
    ) {
        let reach = self.squares[own / GROUP][own % GROUP];
        let mut near = self.distances().near(simd, own, leaf, reach);
        while near != 0 {
            let other = leaf * LEAF + near.trailing_zeros() as usize;
            near &= near - 1;
            if (!self.options.is_mutual || self.senses(other, own)) && !self.is_blocked(own, other)
            {
                add(own, other);
            }
        }
    }

    /// Returns whether `other` is a neighbor of `own`, by reach and view. Both are places.
    pub(super) fn is_neighbor(&self, own: usize, other: usize) -> bool {
        self.senses(own, other) && (!self.options.is_mutual || self.senses(other, own))
    }

    /// Returns whether `own` cannot hear `other`, because `other` could warn it.
    pub(super) fn is_blocked(&self, own: usize, other: usize) -> bool {
        let is_reached = |place: usize| self.agents.is_reached(place);
        self.options.blocks_warnings && is_reached(other) && !is_reached(own)
    }

    /// Returns whether `other` is within reach and in view of `own`.
    fn senses(&self, own: usize, other: usize) -> bool {
        self.distances().squared(own, other) <= self.squares[own / GROUP][own % GROUP]
    }

    /// Returns the distances between the agents.
    pub(super) fn distances(&self) -> Distances<'a, D> {
        self.options.distances(self.agents)
    }
}

/// Calls `add(place, neighbor's place)` for the agents of `leaf` and their neighbors among the agents of `leaves`.
struct VisitNear<'a, 'b, const D: usize, F> {
    pairs: &'a Pairs<'b, D>,
    leaf: usize,
    leaves: &'a [u32],
    add: F,
}

impl<const D: usize, F: FnMut(usize, usize)> WithSimd for VisitNear<'_, '_, D, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            pairs,
            leaf,
            leaves,
            mut add,
        } = self;
        for own in leaf * LEAF..pairs.agents.len().min((leaf + 1) * LEAF) {
            for leaf in leaves.iter().map(|&leaf| leaf as usize) {
                pairs.visit_leaf(simd, own, leaf, &mut add);
            }
        }
    }
}
