//! One step of the line: consensus (Eq. 1) plus escape force (Eq. 7).

use std::sync::Arc;

use crate::config::LineConfig;
use crate::error::{Error, Result};
use crate::metrics::minimum;
use crate::rng::{self, Stream};

/// A line of agents at one moment.
#[derive(Debug, Clone)]
pub struct Line {
    config: Arc<LineConfig>,
    states: Vec<f64>,
    next: Vec<f64>,
}

impl Line {
    /// A line that starts at `states`, or, where `None`, at x(0) ~ U[0, 1]^n drawn from `seed`.
    ///
    /// # Errors
    /// [`Error::Argument`] if `states` has another length than the line or an entry is not finite.
    pub fn new(config: Arc<LineConfig>, seed: u64, states: Option<&[f64]>) -> Result<Self> {
        let states = match states {
            Some(given) => {
                check_states(given, config.num_agents)?;
                given.to_vec()
            }
            None => initial_states(config.num_agents, seed),
        };
        let next = Vec::with_capacity(states.len());
        Ok(Self {
            config,
            states,
            next,
        })
    }

    /// x(t), length n.
    #[must_use]
    pub fn states(&self) -> &[f64] {
        &self.states
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
        consensus(&self.states, range, &mut self.next);
        if let Some(predator) = self.config.predator_position {
            let LineConfig {
                escape_force,
                predator_range,
                repulsion_strength,
                ..
            } = *self.config;
            for (next, state) in self.next.iter_mut().zip(&self.states) {
                *next += escape_force.at(state - predator, predator_range, repulsion_strength);
            }
        }
        let moved = self
            .next
            .iter()
            .zip(&self.states)
            .map(|(next, state)| (next - state).abs())
            .fold(0.0, f64::max);
        std::mem::swap(&mut self.states, &mut self.next);
        Ok(moved)
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
        let distances: Vec<f64> = self.states.iter().map(|x| (x - predator).abs()).collect();
        minimum(&distances)
    }

    /// m(t), the number of connected components under `range`.
    #[must_use]
    pub fn num_components(&self, range: f64) -> usize {
        num_components(&self.states, range)
    }
}

/// x(0) ~ U[0, 1]^n.
fn initial_states(num_agents: usize, seed: u64) -> Vec<f64> {
    let mut rng = rng::stream(seed, Stream::LineState);
    (0..num_agents)
        .map(|_| rng::uniform(&mut rng, 1.0))
        .collect()
}

/// m, the number of connected components of a line: 1 + the number of gaps above `range`.
#[must_use]
pub fn num_components(states: &[f64], range: f64) -> usize {
    let mut sorted = states.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    1 + sorted.windows(2).filter(|w| w[1] - w[0] > range).count()
}

/// y_i = mean of x_j over |x_i - x_j| <= `range` (Eq. 1), summed in index order, so that agents with
/// the same neighbors get the same bits.
pub(crate) fn consensus(states: &[f64], range: f64, out: &mut Vec<f64>) {
    out.clear();
    out.extend(states.iter().map(|x| {
        let mut sum = 0.0;
        let mut count = 0.0;
        for other in states {
            if (x - other).abs() <= range {
                sum += other;
                count += 1.0;
            }
        }
        sum / count
    }));
}

fn check_states(states: &[f64], num_agents: usize) -> Result<()> {
    if states.len() != num_agents {
        return Err(Error::argument(
            "initial_state",
            format!("{num_agents} entries, one per agent"),
            states.len(),
        ));
    }
    match states.iter().position(|x| !x.is_finite()) {
        Some(i) => Err(Error::argument(
            format!("initial_state[{i}]"),
            "a finite number",
            states[i],
        )),
        None => Ok(()),
    }
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
                let low = minimum(line.states());
                (low, line.states().iter().copied().fold(low, f64::max))
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
