//! Connected components of the neighbor graph, by union-find.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, GROUP, TILE};
use crate::neighbor::engine::pairs::{Choice, Pairs};

/// Weakly connected components: a disjoint-set forest of places.
pub(in crate::neighbor) struct Components {
    parents: Vec<u32>,
    count: usize,
    /// Whether all agents of a tile are known to be in one component.
    are_joined: Vec<bool>,
}

impl Components {
    /// Returns the components of a graph.
    pub(in crate::neighbor) fn of<const D: usize>(pairs: &Pairs<'_, D>) -> Self {
        let num_agents = pairs.agents.len();
        let mut components = Self {
            parents: (0..num_agents as u32).collect(),
            count: num_agents,
            are_joined: vec![false; num_agents.div_ceil(TILE)],
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
    pub(in crate::neighbor) fn count(&self) -> usize {
        self.count
    }

    /// Returns the label of every agent's component in the order of ids. A label is the lowest id in the component.
    pub(in crate::neighbor) fn labels<const D: usize>(mut self, agents: &Agents<D>) -> Vec<u32> {
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

    /// Returns whether all agents of two tiles are in one component.
    #[inline(always)]
    fn are_connected(&mut self, one: usize, other: usize) -> bool {
        self.is_joined(one)
            && self.is_joined(other)
            && self.find(one * TILE) == self.find(other * TILE)
    }

    /// Returns whether all agents of a tile are in one component.
    #[inline(always)]
    fn is_joined(&mut self, tile: usize) -> bool {
        if !self.are_joined[tile] {
            let (first, end) = (tile * TILE, self.parents.len().min((tile + 1) * TILE));
            let root = self.find(first);
            self.are_joined[tile] = (first..end).all(|place| self.find(place) == root);
        }
        self.are_joined[tile]
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

/// Joins all pairs of neighbors. Pairs of tiles are skipped as soon as all their agents are connected.
struct Connect<'a, 'b, const D: usize> {
    pairs: &'a Pairs<'b, D>,
    components: &'a mut Components,
}

/// The tiles with which a pass over all tiles joins a tile.
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
        let num_tiles = num_agents.div_ceil(TILE);
        let mut tiles = Vec::new();
        // Tiles with themselves and with the next one first, because most agents are connected then.
        for pass in [Pass::Own, Pass::Next, Pass::Near] {
            for tile in 0..num_tiles {
                if components.count == 1 {
                    return;
                }
                tiles.clear();
                match pass {
                    Pass::Own => tiles.push(tile as u32),
                    Pass::Next => tiles.extend((tile + 1 < num_tiles).then_some(tile as u32 + 1)),
                    Pass::Near => pairs.list_near(tile, &mut tiles),
                }
                for other in tiles.iter().map(|&other| other as usize) {
                    for own in tile * TILE..num_agents.min((tile + 1) * TILE) {
                        if components.are_connected(tile, other) {
                            break;
                        }
                        pairs.visit_tile(simd, own, other, &mut |own, other| {
                            components.union(own, other);
                        });
                    }
                }
            }
        }
    }
}
