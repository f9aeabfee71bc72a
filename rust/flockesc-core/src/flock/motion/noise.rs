//! What is random about the agents' motion: drawn in the order of their names, nothing where there is no noise.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

use crate::agents::{Agents, GROUP};
use crate::base::rng::{self, Stream};
use crate::base::vector::{heading, side_of, turn, unit};
use crate::flock::scenario::FlockConfig;

/// Errors of one step, by name; empty where there are none.
#[derive(Debug, Clone)]
pub(super) struct Noise<const D: usize> {
    rng: ChaCha8Rng,
    /// xi_i, unit vectors.
    sensing: Vec<SVector<f64, D>>,
    /// The angle in rad by which a new heading is wrong, and in space the direction that says toward which side.
    turns: Vec<(f64, SVector<f64, D>)>,
}

impl<const D: usize> Noise<D> {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            rng: rng::stream(seed, Stream::Motion),
            sensing: Vec::new(),
            turns: Vec::new(),
        }
    }

    /// How far the stream has been drawn.
    pub(super) fn drawn(&self) -> u128 {
        self.rng.get_word_pos()
    }

    /// Goes on from where the stream had been drawn to.
    pub(super) fn go_on(&mut self, drawn: u128) {
        self.rng.set_word_pos(drawn);
    }

    /// Draws all errors of the next step.
    pub(super) fn draw(&mut self, config: &FlockConfig) {
        self.sensing.clear();
        self.turns.clear();
        let (rng, eta) = (&mut self.rng, config.angular_noise);
        if config.sensing_noise <= 0.0 && eta <= 0.0 {
            return;
        }
        for _ in 0..config.num_agents {
            if config.sensing_noise > 0.0 {
                self.sensing.push(rng::direction(D, rng));
            }
            if eta > 0.0 {
                self.turns.push(match D {
                    2 => (rng::uniform(rng, eta) - eta / 2.0, SVector::zeros()),
                    _ => (rng::uniform(rng, eta / 2.0), rng::direction(D, rng)),
                });
            }
        }
    }

    /// What the agent of this name believes its neighbors' mean velocity to be, in m/s.
    pub(super) fn believed(
        &self,
        config: &FlockConfig,
        name: usize,
        mean: SVector<f64, D>,
    ) -> SVector<f64, D> {
        self.sensing.get(name).map_or(mean, |error| {
            mean + error * (config.sensing_noise * config.speed.of(name))
        })
    }

    /// Turns every heading by its error.
    pub(super) fn turn(&self, agents: &mut Agents<D>) {
        if self.turns.is_empty() {
            return;
        }
        let (groups, names) = agents.groups_and_names();
        for (place, &name) in names.iter().enumerate() {
            let (group, lane) = (&mut groups[place / GROUP], place % GROUP);
            let velocity = SVector::<f64, D>::from_fn(|axis, _| group.velocity[axis][lane]);
            let ahead = heading(&velocity);
            let (angle, toward) = &self.turns[name as usize];
            if let Some(side) = across(&ahead, toward) {
                let turned = turn(&ahead, &side, *angle) * group.speed[lane];
                for axis in 0..D {
                    group.velocity[axis][lane] = turned[axis];
                }
            }
        }
    }
}

/// The unit vector across `ahead`: to its left in the plane, in space on the side where `toward` points. `None` for an
/// agent at rest.
fn across<const D: usize>(
    ahead: &SVector<f64, D>,
    toward: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    match D {
        2 => unit(&SVector::from_fn(|axis, _| [-ahead[1], ahead[0]][axis])),
        _ => unit(ahead).and_then(|ahead| side_of(&ahead, toward)),
    }
}
