//! Connected components of the neighbor graph, by union-find and the tree.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, TILE};
use crate::neighbor::engine::pairs::Pairs;
use crate::neighbor::engine::reach::{Reach, bits, squared_norm};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Reaches;

/// Returns the weakly connected components, from all pairs of neighbors.
pub(in crate::neighbor) fn connect_pairs<const D: usize>(pairs: &Pairs<'_, D>) -> Forest {
    let mut forest = Forest::new(pairs.agents, pairs.tree);
    let mut tiles = Vec::new();
    for group in 0..pairs.agents.groups.len() {
        pairs.visit(group, &mut tiles, |lane, place| {
            forest.union(group * GROUP + lane, place);
        });
    }
    forest
}

/// Returns the weakly connected components if neighbors are determined by distances alone.
pub(in crate::neighbor) fn connect<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    reaches: Reaches<'_>,
) -> Forest {
    let mut forest = Forest::new(agents, tree);
    Arch::new().dispatch(Connect {
        agents,
        tree,
        reaches,
        forest: &mut forest,
    });
    forest
}

/// A disjoint-set forest of places.
pub(in crate::neighbor) struct Forest {
    parents: Vec<u32>,
    count: usize,
    /// For every block of the tree one bit per child: whether all agents of the child are known to be in one
    /// set.
    united: Vec<Vec<u8>>,
}

impl Forest {
    /// Creates one set per agent.
    fn new<const D: usize>(agents: &Agents<D>, tree: &Tree<D>) -> Self {
        Self {
            parents: (0..agents.len() as u32).collect(),
            count: agents.len(),
            united: tree
                .levels
                .iter()
                .map(|level| vec![0; level.len()])
                .collect(),
        }
    }

    /// Returns the number of sets.
    pub(in crate::neighbor) fn count(&self) -> usize {
        self.count
    }

    /// Returns the label of every agent's set in the order of ids. A label is the lowest id in the set.
    pub(in crate::neighbor) fn labels<const D: usize>(mut self, agents: &Agents<D>) -> Vec<u32> {
        let ids = || (0..agents.groups.len()).flat_map(|group| agents.ids_of(group));
        let mut lowest = vec![u32::MAX; agents.len()];
        for (place, &id) in ids().enumerate() {
            let root = self.find(place);
            lowest[root] = lowest[root].min(id);
        }
        let mut labels = vec![0; agents.num_agents()];
        for (place, &id) in ids().enumerate() {
            labels[id as usize] = lowest[self.find(place)];
        }
        labels
    }

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

    fn union(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            self.parents[a.max(b)] = a.min(b) as u32;
            self.count -= 1;
        }
    }

    /// Merges the sets of the places in `first..last` with the set of `place`.
    fn union_all(&mut self, first: usize, last: usize, place: usize) {
        for other in first..last {
            self.union(other, place);
        }
    }
}

struct Connect<'a, const D: usize> {
    agents: &'a Agents<D>,
    tree: &'a Tree<D>,
    reaches: Reaches<'a>,
    forest: &'a mut Forest,
}

impl<const D: usize> WithSimd for Connect<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            agents,
            tree,
            reaches,
            forest,
        } = self;
        let mut squared = [0.0; GROUP];
        let mut nodes = Vec::new();
        for group in 0..agents.groups.len() {
            let ids = agents.ids_of(group);
            reaches.square(group, ids, &mut squared);
            for (tile, ids) in ids.chunks(TILE).enumerate() {
                let lanes = tile * TILE..tile * TILE + ids.len();
                let reach = Reach::new(
                    tree.levels[0][group].bounds_of(tile),
                    reaches,
                    &squared[lanes.clone()],
                );
                let own = Tile {
                    first: group * GROUP + lanes.start,
                    last: group * GROUP + lanes.end,
                    group,
                    tile,
                };
                nodes.push((tree.levels.len() - 1, 0));
                while let Some((level, index)) = nodes.pop() {
                    let (mut inside, mut across) = reach.classify(simd, &tree.levels[level][index]);
                    // The agents of a node have consecutive places.
                    let width = TILE * FANOUT.pow(level as u32);
                    let places = |child: usize| {
                        let first = (index * FANOUT + child) * width;
                        (first, agents.len().min(first + width))
                    };
                    while inside != 0 {
                        let child = inside.trailing_zeros() as usize;
                        inside &= inside - 1;
                        own.unite_with_node(forest, level, index, child, places(child));
                    }
                    while across != 0 {
                        let child = across.trailing_zeros() as usize;
                        across &= across - 1;
                        let (first, last) = places(child);
                        let is_later = last > own.first;
                        let is_needed = is_later || !reaches.are_equal();
                        let is_united = forest.united[level][index] & 1 << child != 0;
                        if !is_needed || (is_united && own.are_united_with(forest, first)) {
                            continue;
                        }
                        if level > 0 {
                            nodes.push((level - 1, index * FANOUT + child));
                        } else {
                            own.unite_in_reach(simd, agents, &squared, forest, first, last);
                        }
                    }
                }
            }
        }
    }
}

/// A tile and the places `first..last` of its agents.
struct Tile {
    first: usize,
    last: usize,
    group: usize,
    tile: usize,
}

impl Tile {
    fn are_united(&self, forest: &Forest) -> bool {
        forest.united[0][self.group] & 1 << self.tile != 0
    }

    fn are_united_with(&self, forest: &mut Forest, place: usize) -> bool {
        self.are_united(forest) && forest.find(self.first) == forest.find(place)
    }

    /// Merges the sets of the tile and a node. All agents of the node must be within reach of all agents of
    /// the tile.
    fn unite_with_node(
        &self,
        forest: &mut Forest,
        level: usize,
        index: usize,
        child: usize,
        (first, last): (usize, usize),
    ) {
        if forest.united[level][index] & 1 << child == 0 {
            forest.union_all(first, last, first);
            forest.united[level][index] |= 1 << child;
        }
        if !self.are_united(forest) {
            forest.union_all(self.first, self.last, self.first);
            forest.united[0][self.group] |= 1 << self.tile;
        }
        forest.union(self.first, first);
    }

    /// Merges the sets of agents in this tile and in the places `first..last` of another tile that are within
    /// reach.
    #[inline(always)]
    fn unite_in_reach<S: Simd, const D: usize>(
        &self,
        simd: S,
        agents: &Agents<D>,
        squared: &Column<f64>,
        forest: &mut Forest,
        first: usize,
        last: usize,
    ) {
        let positions = &agents.groups[self.group].position;
        let others = &agents.groups[first / GROUP].position;
        for place in first..last {
            if self.are_united_with(forest, place) {
                continue;
            }
            let lanes = self.tile * TILE..(self.tile + 1) * TILE;
            for (register, start) in lanes.step_by(S::F64_LANES).enumerate() {
                let load = |column: &Column<f64>| {
                    S::as_simd_f64s(&column[start..start + S::F64_LANES]).0[0]
                };
                let mut offset = [simd.splat_f64s(0.0); D];
                for axis in 0..D {
                    let other = simd.splat_f64s(others[axis][place % GROUP]);
                    offset[axis] = simd.sub_f64s(load(&positions[axis]), other);
                }
                let distance = squared_norm(simd, offset);
                let mut near = bits(simd, simd.less_than_or_equal_f64s(distance, load(squared)));
                while near != 0 {
                    let lane = register * S::F64_LANES + near.trailing_zeros() as usize;
                    near &= near - 1;
                    forest.union(self.first + lane, place);
                }
            }
        }
        let root = forest.find(self.first);
        if (self.first..self.last).all(|place| forest.find(place) == root) {
            forest.united[0][self.group] |= 1 << self.tile;
        }
    }
}
