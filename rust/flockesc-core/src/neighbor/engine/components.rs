//! Connected components of the neighbor graph, by union-find.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, GROUP, LEAF};
use crate::neighbor::engine::pairs::{Choice, Pairs};

/// Weakly connected components: a disjoint-set forest of places.
pub(crate) struct Components {
    parents: Vec<u32>,
    count: usize,
    /// Whether all agents of a leaf are known to be in one component.
    are_joined: Vec<bool>,
}

impl Components {
    /// Returns the components of a graph.
    pub(crate) fn of<const D: usize>(pairs: &Pairs<'_, D>) -> Self {
        let num_agents = pairs.agents.len();
        let mut components = Self {
            parents: (0..num_agents as u32).collect(),
            count: num_agents,
            are_joined: vec![false; num_agents.div_ceil(LEAF)],
        };
        match pairs.choice {
            Choice::All => Arch::new().dispatch(Connect {
                pairs,
                components: &mut components,
            }),
            Choice::Listed(..) | Choice::Frozen(..) => {
                for group in 0..pairs.agents.groups.len() {
                    pairs.visit(group, &mut Vec::new(), |lane, place| {
                        components.union(group * GROUP + lane, place);
                    });
                }
            }
        }
        components
    }

    /// Returns the number of components.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Returns the label of every agent's component in the order of ids. A label is the lowest id in the component.
    pub(crate) fn labels<const D: usize>(mut self, agents: &Agents<D>) -> Vec<u32> {
        let mut lowest = vec![u32::MAX; agents.len()];
        for (place, &id) in agents.ids().iter().enumerate() {
            let root = self.find(place);
            lowest[root] = lowest[root].min(id);
        }
        let mut labels = vec![0; agents.num_agents()];
        for (place, &id) in agents.ids().iter().enumerate() {
            labels[id as usize] = lowest[self.find(place)];
        }
        labels
    }

    /// Returns whether all agents of two leaves are in one component.
    #[inline(always)]
    fn are_connected(&mut self, one: usize, other: usize) -> bool {
        self.is_joined(one)
            && self.is_joined(other)
            && self.find(one * LEAF) == self.find(other * LEAF)
    }

    /// Returns whether all agents of a leaf are in one component.
    #[inline(always)]
    fn is_joined(&mut self, leaf: usize) -> bool {
        if !self.are_joined[leaf] {
            let (first, end) = (leaf * LEAF, self.parents.len().min((leaf + 1) * LEAF));
            let root = self.find(first);
            self.are_joined[leaf] = (first..end).all(|place| self.find(place) == root);
        }
        self.are_joined[leaf]
    }

    #[inline(always)]
    fn find(&mut self, place: usize) -> usize {
        let mut place = place as u32;
        loop {
            let parent = self.parents[place as usize];
            if parent == place {
                return place as usize;
            }
            let next = self.parents[parent as usize];
            self.parents[place as usize] = next;
            place = next;
        }
    }

    #[inline(always)]
    fn union(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            self.parents[a.max(b)] = a.min(b) as u32;
            self.count -= 1;
        }
    }
}

/// Joins all pairs of neighbors. Pairs of leaves are skipped as soon as all their agents are connected.
struct Connect<'a, 'b, const D: usize> {
    pairs: &'a Pairs<'b, D>,
    components: &'a mut Components,
}

/// The leaves with which a pass over all leaves joins a leaf.
enum Pass {
    Own,
    Next,
    Near,
}

impl<const D: usize> WithSimd for Connect<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { pairs, components } = self;
        let num_agents = pairs.agents.len();
        let num_leaves = num_agents.div_ceil(LEAF);
        let mut leaves = Vec::new();
        // Leaves with themselves and with the next one first, because most agents are connected then.
        for pass in [Pass::Own, Pass::Next, Pass::Near] {
            for leaf in 0..num_leaves {
                if components.count == 1 {
                    return;
                }
                leaves.clear();
                match pass {
                    Pass::Own => leaves.push(leaf as u32),
                    Pass::Next => leaves.extend((leaf + 1 < num_leaves).then_some(leaf as u32 + 1)),
                    Pass::Near => pairs.list_near(leaf, &mut leaves),
                }
                for other in leaves.iter().map(|&other| other as usize) {
                    for own in leaf * LEAF..num_agents.min((leaf + 1) * LEAF) {
                        if components.are_connected(leaf, other) {
                            break;
                        }
                        pairs.visit_leaf(simd, own, other, &mut |own, other| {
                            components.union(own, other);
                        });
                    }
                }
            }
        }
    }
}
