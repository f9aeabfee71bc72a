//! Sensing noise and angular noise of the agents.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

use crate::agents::{Agents, GROUP};
use crate::base::rng::{self, Stream};
use crate::base::vector::{heading, side_of, turn, unit};
use crate::flock::scenario::FlockConfig;

/// The random errors of one step, by id. They are drawn only if the scenario has noise.
#[derive(Debug, Clone)]
pub(super) struct Noise<const D: usize> {
    rng: ChaCha8Rng,
    /// Unit vectors xi_i of the sensing noise.
    sensing: Vec<SVector<f64, D>>,
    /// Errors of the new headings: an angle in rad and, for D = 3, a direction to turn toward.
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

    /// Returns the position in the random stream.
    pub(super) fn stream_position(&self) -> u128 {
        self.rng.get_word_pos()
    }

    /// Sets the position in the random stream.
    pub(super) fn set_stream_position(&mut self, position: u128) {
        self.rng.set_word_pos(position);
    }

    /// Draws the errors of the next step in the order of ids.
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

    /// Returns the neighbors' mean velocity in m/s with the sensing error of agent `id`.
    pub(super) fn sensed(
        &self,
        config: &FlockConfig,
        id: usize,
        mean: SVector<f64, D>,
    ) -> SVector<f64, D> {
        self.sensing.get(id).map_or(mean, |error| {
            mean + error * (config.sensing_noise * config.speed.of(id))
        })
    }

    /// Turns every heading by its error.
    pub(super) fn turn(&self, agents: &mut Agents<D>) {
        if self.turns.is_empty() {
            return;
        }
        let (groups, ids) = agents.groups_and_ids();
        for (place, &id) in ids.iter().enumerate() {
            let (group, lane) = (&mut groups[place / GROUP], place % GROUP);
            let velocity = SVector::<f64, D>::from_fn(|axis, _| group.velocity[axis][lane]);
            let ahead = heading(&velocity);
            let (angle, toward) = &self.turns[id as usize];
            if let Some(side) = across(&ahead, toward) {
                let turned = turn(&ahead, &side, *angle) * group.speed[lane];
                for axis in 0..D {
                    group.velocity[axis][lane] = turned[axis];
                }
            }
        }
    }
}

/// Returns the unit vector perpendicular to `ahead`: to its left in the plane, and to the side of `toward`
/// for D = 3. `None` for an agent at rest.
fn across<const D: usize>(
    ahead: &SVector<f64, D>,
    toward: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    match D {
        2 => unit(&SVector::from_fn(|axis, _| [-ahead[1], ahead[0]][axis])),
        _ => unit(ahead).and_then(|ahead| side_of(&ahead, toward)),
    }
}
