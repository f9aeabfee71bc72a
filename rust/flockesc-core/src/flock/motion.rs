//! Forces and motion of some groups of agents, in the order of docs/model.md: steps 2 to 4, and the distances after them.

use multiversion::multiversion;

use crate::agents::{Column, GROUP, Group};
use crate::config::FlockConfig;
use crate::metrics::{Distances, squared_norm};
use crate::neighbor::Heard;

/// Where the predators are before and after a step, in m.
pub(super) struct Predators<'a, const D: usize> {
    pub(super) before: &'a [[f64; D]],
    pub(super) after: &'a [[f64; D]],
}

/// Advances agents by one step under what they heard, and measures how far the predators are then.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn advance<const D: usize>(
    config: &FlockConfig,
    predators: &Predators<'_, D>,
    heard: &[Heard<D>],
    groups: &mut [Group<D>],
    distances: &mut [Distances],
) {
    for ((group, heard), distances) in groups.iter_mut().zip(heard).zip(distances) {
        let mut force = consensus_force(config, heard);
        for predator in predators.before {
            add_escape_force(config, group, predator, &mut force);
        }
        integrate(config, &force, group);
        *distances = Distances::of(group, predators.after);
    }
}

/// v0 <v>_i / ||<v>_i|| (Eq. 11), the direction of the sum; 0 where that is exactly 0.
#[inline(always)]
fn consensus_force<const D: usize>(config: &FlockConfig, heard: &Heard<D>) -> [Column<f64>; D] {
    let mut force = [[0.0; GROUP]; D];
    for lane in 0..GROUP {
        let sum: [f64; D] = std::array::from_fn(|axis| heard.sum[axis][lane] as f64);
        let norm = squared_norm(&sum).sqrt();
        let factor = if norm > 0.0 { config.speed / norm } else { 0.0 };
        for axis in 0..D {
            force[axis][lane] = sum[axis] * factor;
        }
    }
    force
}

/// s (r_i - r_p) / ||r_i - r_p|| where that distance is at most rho_p; 0 where it is 0.
#[inline(always)]
fn add_escape_force<const D: usize>(
    config: &FlockConfig,
    group: &Group<D>,
    predator: &[f64; D],
    force: &mut [Column<f64>; D],
) {
    for lane in 0..GROUP {
        let offset: [f64; D] =
            std::array::from_fn(|axis| group.position[axis][lane] - predator[axis]);
        let distance = squared_norm(&offset).sqrt();
        let is_felt = distance <= config.predator_range && distance > 0.0;
        let factor = if is_felt {
            config.repulsion_strength / distance
        } else {
            0.0
        };
        for axis in 0..D {
            force[axis][lane] += offset[axis] * factor;
        }
    }
}

/// r += dt v with the old velocity, v += (dt / m) f, then back to speed v0 (the old v where the new one is exactly 0).
#[inline(always)]
fn integrate<const D: usize>(config: &FlockConfig, force: &[Column<f64>; D], group: &mut Group<D>) {
    let FlockConfig {
        time_step,
        mass,
        speed,
        constant_speed,
        ..
    } = *config;
    for lane in 0..GROUP {
        let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
        let pushed: [f64; D] =
            std::array::from_fn(|axis| velocity[axis] + force[axis][lane] * (time_step / mass));
        let norm = squared_norm(&pushed).sqrt();
        let factor = if constant_speed { speed / norm } else { 1.0 };
        let is_moving = norm > 0.0;
        for axis in 0..D {
            group.position[axis][lane] += velocity[axis] * time_step;
            group.velocity[axis][lane] = if is_moving || !constant_speed {
                pushed[axis] * factor
            } else {
                velocity[axis]
            };
        }
    }
}
