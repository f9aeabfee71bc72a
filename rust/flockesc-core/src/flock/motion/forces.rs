//! The forces of step 2, consensus (Eq. 11) and escape, and the parameters of the agents, column by column.

use crate::agents::{Agents, Column, GROUP, Group, PerAgent, corners};
use crate::base::exact::{Scale, to_float};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{NeighborSums, Neighborhood, Pairs};

/// Forces on the agents of a group.
pub(super) type Force<const D: usize> = [Column<f64>; D];

/// The neighbor graph and sums of one step, for forces between pairs of neighbors.
pub(super) struct Neighbors<'a, const D: usize> {
    pub(super) agents: &'a Agents<D>,
    pub(super) pairs: Pairs<'a, D>,
    pub(super) sums: &'a [NeighborSums<D>],
    /// Fixed-point scale of sums of offsets between agents, in m.
    pub(super) scale: Scale,
}

impl<'a, const D: usize> Neighbors<'a, D> {
    pub(super) fn new(agents: &'a Agents<D>, neighborhood: &'a Neighborhood<D>) -> Self {
        let (low, high) = corners(&agents.groups);
        let extent = (0..D).fold(0.0, |most: f64, axis| most.max(high[axis] - low[axis]));
        Self {
            agents,
            pairs: neighborhood.pairs(agents),
            sums: neighborhood.sums(),
            scale: Scale::for_registers(extent, agents.len()),
        }
    }
}

/// Returns the consensus force a v0 <v>_i / ||<v>_i|| (Eq. 11), or 0 if the sum of the neighbors' velocities
/// is exactly 0. Stores the norms of the sums in `sums`.
#[inline(always)]
pub(super) fn consensus_force<const D: usize>(
    columns: &ParameterColumns,
    sums: &mut NeighborSums<D>,
) -> Force<D> {
    let mut force = [[0.0; GROUP]; D];
    for lane in 0..GROUP {
        let sum: [f64; D] = std::array::from_fn(|axis| to_float(sums.sum[axis][lane]));
        let norm = squared_norm(&sum).sqrt();
        let factor = if norm > 0.0 {
            columns.alignment[lane] / norm
        } else {
            0.0
        };
        sums.norm[lane] = norm;
        for axis in 0..D {
            force[axis][lane] = sum[axis] * factor;
        }
    }
    force
}

/// The escape force s (r_i - r_p) / ||r_i - r_p|| (step 2).
pub(super) struct EscapeForce {
    /// The predator range rho_p in m.
    range: f64,
    /// Whether the force is divided by the distance.
    decays: bool,
}

impl EscapeForce {
    pub(super) fn of(config: &FlockConfig) -> Self {
        Self {
            range: config.predator_range,
            decays: config.motion.needs().decaying_escape,
        }
    }

    /// Adds the force from a predator to agents with a `distance` to it above 0 and up to the range.
    #[inline(always)]
    pub(super) fn add<const D: usize>(
        &self,
        columns: &ParameterColumns,
        group: &Group<D>,
        predator: &[f64; D],
        distance: &Column<f64>,
        force: &mut Force<D>,
    ) {
        for lane in 0..GROUP {
            let is_felt = distance[lane] <= self.range && distance[lane] > SHORTEST;
            let factor = if is_felt {
                columns.repulsion[lane] / distance[lane]
            } else {
                0.0
            };
            let factor = if self.decays && is_felt {
                factor / distance[lane]
            } else {
                factor
            };
            for axis in 0..D {
                force[axis][lane] += (group.position[axis][lane] - predator[axis]) * factor;
            }
        }
    }
}

/// Per-agent parameters of one group.
pub(super) struct ParameterColumns {
    /// dt / m in s/kg.
    pub(super) gain: Column<f64>,
    /// v0 in m/s.
    pub(super) speed: Column<f64>,
    /// a v0, the norm of the consensus force.
    pub(super) alignment: Column<f64>,
    /// s, the norm of the escape force.
    pub(super) repulsion: Column<f64>,
    /// Whether any parameter differs between agents.
    is_mixed: bool,
}

impl ParameterColumns {
    /// Fills all lanes with the parameters of agent 0.
    #[inline(always)]
    pub(super) fn of_first(config: &FlockConfig) -> Self {
        let fields = [
            &config.mass,
            &config.speed,
            &config.alignment_strength,
            &config.repulsion_strength,
        ];
        let speed = config.speed.of(0);
        Self {
            gain: [config.time_step / config.mass.of(0); GROUP],
            speed: [speed; GROUP],
            alignment: [config.alignment_strength.of(0) * speed; GROUP],
            repulsion: [config.repulsion_strength.of(0); GROUP],
            is_mixed: fields
                .iter()
                .any(|field| matches!(field, PerAgent::Each(_))),
        }
    }

    /// Loads the parameters of the agents with these `ids`, if parameters differ between agents.
    #[inline(always)]
    pub(super) fn load(&mut self, config: &FlockConfig, ids: &[u32]) {
        if !self.is_mixed {
            return;
        }
        config.mass.gather(ids, &mut self.gain);
        config.speed.gather(ids, &mut self.speed);
        config.alignment_strength.gather(ids, &mut self.alignment);
        config.repulsion_strength.gather(ids, &mut self.repulsion);
        for lane in 0..ids.len() {
            self.gain[lane] = config.time_step / self.gain[lane];
            self.alignment[lane] *= self.speed[lane];
        }
    }
}
