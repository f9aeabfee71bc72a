//! Forces and motion of some groups of agents, in the order of docs/model.md: steps 2 to 4, and the distances after them.

use multiversion::multiversion;

use crate::agents::{Column, GROUP, Group};
use crate::config::FlockConfig;
use crate::metrics::{distances, squared_norm};
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
    groups: &mut [Group<D>],
    heard: &mut [Heard<D>],
) {
    for (group, heard) in groups.iter_mut().zip(heard) {
        let mut force = consensus_force(config, heard);
        match predators.before {
            // The nearest predator is the only one.
            [only] => add_escape_force(config, group, only, &group.distance, &mut force),
            many => {
                for predator in many {
                    let distance = distances(&group.position, &[*predator]);
                    add_escape_force(config, group, predator, &distance, &mut force);
                }
            }
        }
        integrate(config, &force, group);
        group.distance = distances(&group.position, predators.after);
    }
}

/// v0 <v>_i / ||<v>_i|| (Eq. 11), the direction of the sum; 0 where that is exactly 0.
#[inline(always)]
fn consensus_force<const D: usize>(config: &FlockConfig, heard: &mut Heard<D>) -> [Column<f64>; D] {
    let mut force = [[0.0; GROUP]; D];
    for lane in 0..GROUP {
        let sum: [f64; D] = std::array::from_fn(|axis| heard.sum[axis][lane] as f64);
        let norm = squared_norm(&sum).sqrt();
        let factor = if norm > 0.0 { config.speed / norm } else { 0.0 };
        heard.norm[lane] = norm;
        for axis in 0..D {
            force[axis][lane] = sum[axis] * factor;
        }
    }
    force
}

/// s (r_i - r_p) / ||r_i - r_p|| where that `distance` is at most rho_p; 0 where it is 0.
#[inline(always)]
fn add_escape_force<const D: usize>(
    config: &FlockConfig,
    group: &Group<D>,
    predator: &[f64; D],
    distance: &Column<f64>,
    force: &mut [Column<f64>; D],
) {
    for lane in 0..GROUP {
        let is_felt = distance[lane] <= config.predator_range && distance[lane] > 0.0;
        let factor = if is_felt {
            config.repulsion_strength / distance[lane]
        } else {
            0.0
        };
        for axis in 0..D {
            force[axis][lane] += (group.position[axis][lane] - predator[axis]) * factor;
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
        let is_kept = constant_speed && norm <= 0.0;
        let factor = if constant_speed { speed / norm } else { 1.0 };
        for axis in 0..D {
            group.position[axis][lane] += velocity[axis] * time_step;
            group.velocity[axis][lane] = if is_kept {
                velocity[axis]
            } else {
                pushed[axis] * factor
            };
        }
        let new_speed = if constant_speed { speed } else { norm };
        group.speed[lane] = if is_kept {
            group.speed[lane]
        } else {
            new_speed
        };
    }
}
