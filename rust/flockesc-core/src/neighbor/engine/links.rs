//! `Links`: the reaches and neighbor lists that a rule computes in every step.

use crate::agents::{Agents, GROUP};
use crate::neighbor::engine::lists::{Lists, NO_PLACE};
use crate::neighbor::engine::pairs::{Choice, Pairs};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::options::NeighborOptions;
use crate::neighbor::ranges::{Ranges, Reaches};
use crate::neighbor::rules::rule::{Criterion, RuleInput, RuleOutput};

/// The reach of every agent, and its neighbor list if the rule has lists.
#[derive(Debug, Clone, Default)]
pub(crate) struct Links {
    output: RuleOutput,
    /// Places of all agents by id; empty without lists.
    places: Vec<u32>,
    /// Whether the lists are the frozen graph of the first step.
    is_frozen: bool,
}

impl Links {
    /// Computes reaches and lists for the agents' current positions.
    pub(crate) fn update<const D: usize>(
        &mut self,
        options: &NeighborOptions,
        agents: &Agents<D>,
        tree: &Tree<D>,
        ranges: Ranges<'_>,
    ) {
        if self.is_frozen {
            self.places = places(agents);
            return;
        }
        let criterion = options.rule.criterion();
        // PERF: The kernel squares interaction ranges by itself; only iterations over pairs need a column of them.
        if criterion == Criterion::Range && options.is_by_reach() && !options.needs_pairs {
            return;
        }
        let input = RuleInput {
            distances: options.distances(agents),
            tree,
            ranges,
        };
        options.rule.apply(&input, &mut self.output);
        if criterion == Criterion::List {
            self.places = places(agents);
        }
    }

    /// Returns the reach of every agent, if neighbors are determined by distances and fields of view.
    pub(crate) fn reaches<'a>(
        &'a self,
        options: &NeighborOptions,
        ranges: Ranges<'a>,
    ) -> Option<Reaches<'a>> {
        options
            .is_by_view()
            .then_some(match options.rule.criterion() {
                Criterion::Range => Reaches::Ranges(ranges),
                Criterion::Reach | Criterion::List => Reaches::Squares(&self.output.squares),
            })
    }

    /// Returns the neighbor graph of the last update.
    pub(crate) fn pairs<'a, const D: usize>(
        &'a self,
        options: &'a NeighborOptions,
        agents: &'a Agents<D>,
        tree: &'a Tree<D>,
    ) -> Pairs<'a, D> {
        let (lists, places) = (&self.output.lists, &self.places);
        Pairs {
            agents,
            tree,
            options,
            squares: &self.output.squares,
            choice: match options.rule.criterion() {
                _ if self.is_frozen => Choice::Frozen(lists, places),
                Criterion::List => Choice::Listed(lists, places),
                Criterion::Range | Criterion::Reach => Choice::All,
            },
        }
    }

    /// Returns whether the graph is frozen, which is the case after the first step of a scenario with
    /// `frozen_graph`.
    pub(crate) fn is_frozen(&self) -> bool {
        self.is_frozen
    }

    /// Returns the frozen graph, if there is one.
    pub(crate) fn frozen(&self) -> Option<&Lists> {
        self.is_frozen.then_some(&self.output.lists)
    }

    /// Freezes the graph `lists`.
    pub(crate) fn freeze<const D: usize>(&mut self, lists: Lists, agents: &Agents<D>) {
        self.output.lists = lists;
        self.places = places(agents);
        self.is_frozen = true;
    }

    /// Returns the mean reach of a sample of the agents, in m.
    pub(crate) fn typical_reach(&self, options: &NeighborOptions, ranges: Ranges<'_>) -> f64 {
        options.rule.typical_reach(ranges, &self.output)
    }
}

/// Returns the places of all agents by id; [`NO_PLACE`] for caught agents.
fn places<const D: usize>(agents: &Agents<D>) -> Vec<u32> {
    let mut places = vec![NO_PLACE; agents.num_agents()];
    for group in 0..agents.groups.len() {
        for (place, &id) in (group * GROUP..).zip(agents.ids_of(group)) {
            places[id as usize] = place as u32;
        }
    }
    places
}
