//! What is found anew in every step where ranges alone do not say who is a neighbor.

use crate::agents::{Agents, Column, GROUP};
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::pairs::{Candidates, Pairs};
use crate::neighbor::engine::sums::Scratch;
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::options::NeighborOptions;
use crate::neighbor::ranges::{Ranges, Reaches, SAMPLE};
use crate::neighbor::rules::NeighborRule;
use crate::neighbor::rules::topological::reach_nearest;
use crate::neighbor::rules::voronoi::voronoi_neighbors;
use crate::parallel;

/// The place of an agent that was caught.
pub(in crate::neighbor) const NOWHERE: u32 = u32::MAX;

/// How far agents reach, and who is listed for whom.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct Links {
    /// Squared reach in m^2 of the agents of every group; empty where ranges say it all.
    squares: Vec<Column<f64>>,
    lists: Lists,
    /// Where the agent of every name is; empty without lists.
    places: Vec<u32>,
    /// Whether the lists are the graph of the first step, which stays.
    is_frozen: bool,
}

impl Links {
    /// Brings all up to date with where the agents are.
    pub(in crate::neighbor) fn update<const D: usize>(
        &mut self,
        options: &NeighborOptions,
        agents: &Agents<D>,
        tree: &Tree<D>,
        ranges: Ranges<'_>,
        scratch: &mut [Scratch],
    ) {
        if self.is_frozen {
            self.places = places(agents);
            return;
        }
        if options.rule == (NeighborRule::Metric {}) && options.is_by_reach() && !options.visits {
            return;
        }
        self.squares.resize(agents.groups.len(), [0.0; GROUP]);
        match options.rule {
            NeighborRule::Metric {} => square(agents, ranges, &mut self.squares),
            NeighborRule::Topological {} => parallel::for_each_chunk_with(
                &mut self.squares,
                scratch,
                |first, squares, scratch| {
                    let scratch = &mut scratch.topological;
                    reach_nearest(agents, tree, options, ranges, first, squares, scratch);
                },
            ),
            NeighborRule::Voronoi {} => {
                square(agents, ranges, &mut self.squares);
                self.places = places(agents);
                self.lists = voronoi_neighbors(agents);
            }
        }
        if options.is_frozen {
            let pairs = self.pairs(options, agents, tree).by_name();
            self.freeze(Lists::new(agents.num_names(), &pairs), agents);
        }
    }

    /// How far agents reach, if that says it all.
    pub(in crate::neighbor) fn reaches<'a>(
        &'a self,
        options: &NeighborOptions,
        ranges: Ranges<'a>,
    ) -> Option<Reaches<'a>> {
        options.is_by_reach().then_some(match options.rule {
            NeighborRule::Metric {} => Reaches::Ranges(ranges),
            NeighborRule::Topological {} | NeighborRule::Voronoi {} => {
                Reaches::Squares(&self.squares)
            }
        })
    }

    /// The neighbor graph of the last update.
    pub(in crate::neighbor) fn pairs<'a, const D: usize>(
        &'a self,
        options: &'a NeighborOptions,
        agents: &'a Agents<D>,
        tree: &'a Tree<D>,
    ) -> Pairs<'a, D> {
        Pairs {
            agents,
            tree,
            options,
            squares: &self.squares,
            candidates: match options.rule {
                _ if self.is_frozen => Candidates::Frozen(&self.lists, &self.places),
                NeighborRule::Voronoi {} => Candidates::Listed(&self.lists, &self.places),
                NeighborRule::Metric {} | NeighborRule::Topological {} => Candidates::All,
            },
        }
    }

    /// Whether the graph of the first step has been found, and stays.
    pub(in crate::neighbor) fn is_frozen(&self) -> bool {
        self.is_frozen
    }

    /// The graph of the first step, if it stays and has been found.
    pub(in crate::neighbor) fn frozen(&self) -> Option<&Lists> {
        self.is_frozen.then_some(&self.lists)
    }

    /// Makes `lists` the graph that stays.
    pub(in crate::neighbor) fn freeze<const D: usize>(&mut self, lists: Lists, agents: &Agents<D>) {
        self.lists = lists;
        self.places = places(agents);
        self.is_frozen = true;
    }

    /// Mean reach over a sample of the agents, in m.
    pub(in crate::neighbor) fn typical(
        &self,
        options: &NeighborOptions,
        ranges: Ranges<'_>,
    ) -> f64 {
        match options.rule {
            NeighborRule::Metric {} | NeighborRule::Voronoi {} => ranges.typical(),
            NeighborRule::Topological {} => {
                let first = self.squares.iter().map(|squares| squares[0].sqrt());
                let sample = first.step_by(self.squares.len().div_ceil(SAMPLE).max(1));
                let (sum, count) =
                    sample.fold((0.0, 1e-300), |(sum, count), r| (sum + r, count + 1.0));
                sum / count
            }
        }
    }
}

fn square<const D: usize>(agents: &Agents<D>, ranges: Ranges<'_>, squares: &mut [Column<f64>]) {
    for (group, squares) in squares.iter_mut().enumerate() {
        ranges.square(agents.names_of(group), squares);
    }
}

/// Where the agent of every name is; [`NOWHERE`] if it was caught.
fn places<const D: usize>(agents: &Agents<D>) -> Vec<u32> {
    let mut places = vec![NOWHERE; agents.num_names()];
    for group in 0..agents.groups.len() {
        for (place, &name) in (group * GROUP..).zip(agents.names_of(group)) {
            places[name as usize] = place as u32;
        }
    }
    places
}
