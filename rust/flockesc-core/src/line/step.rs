//! One step of the line: consensus (Eq. 1) plus escape force (Eq. 7).

use std::sync::Arc;

use super::consensus::{Consensus, components};
use super::groups::{Group, Groups};
use crate::base::check::coordinates;
use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};
use crate::line::scenario::LineConfig;

/// A line of agents at one time.
///
/// ```
/// use std::sync::Arc;
/// use flockesc_core::{Line, LineConfig};
///
/// let mut line = Line::new(Arc::new(LineConfig::default()), 7, None)?;
/// let start = line.escape_distance();
/// let mut moved = f64::INFINITY;
/// while !line.is_steady(moved) {
///     moved = line.step(0.1)?;
/// }
/// assert!(line.escape_distance() > start);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Line {
    config: Arc<LineConfig>,
    groups: Groups,
    consensus: Consensus,
}

impl Line {
    /// The line in this state.
    pub(super) fn of_groups(config: Arc<LineConfig>, groups: Groups) -> Self {
        Self {
            consensus: Consensus::with_capacity(config.num_agents),
            config,
            groups,
        }
    }

    pub(super) fn shared_config(&self) -> &Arc<LineConfig> {
        &self.config
    }

    pub(super) fn groups(&self) -> &Groups {
        &self.groups
    }

    /// A line that starts at `states`, or, where `None`, at x(0) ~ U[0, 1]^n drawn from `seed`.
    ///
    /// # Errors
    /// [`Error::Argument`] if `states` has another length than the line or an entry is out of bounds.
    pub fn new(config: Arc<LineConfig>, seed: u64, states: Option<&[f64]>) -> Result<Self> {
        let num_agents = config.num_agents;
        let groups = match states {
            Some(given) => {
                check_states(given, num_agents)?;
                Groups::new(given)
            }
            None => Groups::new(&initial_states(num_agents, seed)),
        };
        Ok(Self::of_groups(config, groups))
    }

    /// x(t), length n.
    #[must_use]
    pub fn states(&self) -> Vec<f64> {
        let mut states = Vec::with_capacity(self.config.num_agents);
        self.append_states(&mut states);
        states
    }

    /// Appends x(t), length n.
    pub(super) fn append_states(&self, out: &mut Vec<f64>) {
        self.groups.append_states(out);
    }

    /// x(t) in rising order, length n.
    pub(super) fn sorted_states(&self) -> impl Iterator<Item = f64> {
        let groups = self.groups.sorted().iter();
        groups.flat_map(|group| std::iter::repeat_n(group.state, group.size as usize))
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &LineConfig {
        &self.config
    }

    /// Advances one step and returns max_i |x_i(t+1) - x_i(t)|.
    ///
    /// # Errors
    /// [`Error::Argument`] if `range` is negative or not finite.
    pub fn step(&mut self, range: f64) -> Result<f64> {
        check_range(range)?;
        let groups = self.groups.sorted();
        let next = self.consensus.means(groups, self.config.num_agents, range);
        if let Some(predator) = self.config.predator_position {
            let LineConfig {
                predator_range,
                repulsion_strength,
                escape_force,
                ..
            } = *self.config;
            // The groups in the predator's range are contiguous.
            let offset = |group: &Group| group.state - predator;
            let start = groups.partition_point(|group| offset(group) <= -predator_range);
            let num_chased =
                groups[start..].partition_point(|group| offset(group) < predator_range);
            let chased = groups[start..].iter().take(num_chased);
            for (next, group) in next[start..].iter_mut().zip(chased) {
                *next += escape_force.at(offset(group), predator_range, repulsion_strength);
            }
        }
        Ok(self.groups.move_to(next))
    }

    /// Whether a step that moved no agent by more than `moved` left the line in its steady state.
    #[must_use]
    pub fn is_steady(&self, moved: f64) -> bool {
        moved <= self.config.tolerance
    }

    /// d(t) = min_i |x_i - x_p|; infinite without a predator.
    #[must_use]
    pub fn escape_distance(&self) -> f64 {
        let Some(predator) = self.config.predator_position else {
            return f64::INFINITY;
        };
        let groups = self.groups.sorted().iter();
        groups
            .map(|group| (group.state - predator).abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// m(t), the number of connected components under `range`.
    #[must_use]
    pub fn num_components(&self, range: f64) -> usize {
        components(self.groups.sorted(), range).count()
    }
}

/// x(0) ~ U[0, 1]^n.
fn initial_states(num_agents: usize, seed: u64) -> Vec<f64> {
    let mut rng = rng::stream(seed, Stream::LineState);
    (0..num_agents)
        .map(|_| rng::uniform(&mut rng, 1.0))
        .collect()
}

fn check_states(states: &[f64], num_agents: usize) -> Result<()> {
    if states.len() != num_agents {
        return Err(Error::argument(
            "initial_state",
            format!("{num_agents} entries, one per agent"),
            states.len(),
        ));
    }
    coordinates(states, |i| format!("initial_state[{i}]"))
}

pub(crate) fn check_range(range: f64) -> Result<()> {
    if range.is_finite() && range >= 0.0 {
        Ok(())
    } else {
        Err(Error::argument(
            "interaction_range",
            "a finite number of at least 0",
            range,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::EscapeForce;
    use proptest::prelude::*;

    fn line(states: &[f64]) -> Line {
        let config = LineConfig {
            num_agents: states.len(),
            predator_position: None,
            predator_range: 0.2,
            repulsion_strength: 2.0,
            escape_force: EscapeForce::Linear,
            tolerance: 1e-12,
            max_steps: 1000,
        };
        Line::new(Arc::new(config), 0, Some(states)).expect("finite states")
    }

    proptest! {
        /// Lemma 1: without a predator m(t) never falls; and the hull never grows.
        #[test]
        fn components_never_merge_and_the_hull_never_grows(
            states in prop::collection::vec(0.0..1.0_f64, 1..60),
            range in 0.0..0.5_f64,
        ) {
            let mut line = line(&states);
            let hull = |line: &Line| {
                let states = line.states();
                let low = states.iter().copied().fold(f64::INFINITY, f64::min);
                (low, states.into_iter().fold(low, f64::max))
            };
            let (mut components, mut before) = (line.num_components(range), hull(&line));
            for _ in 0..30 {
                line.step(range).expect("a good range");
                let after = hull(&line);
                prop_assert!(line.num_components(range) >= components);
                // A mean of equal numbers may miss them by a rounding.
                prop_assert!(after.0 >= before.0 - 1e-15 && after.1 <= before.1 + 1e-15);
                (components, before) = (line.num_components(range), after);
            }
        }
    }

    #[test]
    fn two_agents_in_range_meet_in_one_step_and_out_of_range_never() {
        let mut near = line(&[0.0, 1.0]);
        assert_eq!(near.step(1.0), Ok(0.5));
        assert_eq!(near.states(), [0.5, 0.5]);
        let mut far = line(&[0.0, 1.0]);
        assert_eq!(far.step(0.999), Ok(0.0));
        assert_eq!(far.num_components(0.999), 2);
    }

    #[test]
    fn bad_ranges_change_nothing() {
        let mut line = line(&[0.0, 1.0]);
        for range in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(line.step(range).is_err());
        }
        assert_eq!(line.states(), [0.0, 1.0]);
    }
}
