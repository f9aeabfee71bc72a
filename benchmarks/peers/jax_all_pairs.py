"""Peer in JAX: all pairs on the CPU in float64, vmap over flocks, compiled."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.peers.model import Flocks, Model, Outcome, Peer

jax.config.update("jax_platforms", "cpu")
jax.config.update("jax_enable_x64", True)

State = tuple[jax.Array, jax.Array, jax.Array, jax.Array]
"""Positions, velocities, position of the predator, running minimum of the mean distance."""


def _scaled(vectors: jax.Array, length: float) -> jax.Array:
    norms = jnp.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return length * vectors / jnp.where(norms > 0, norms, jnp.inf)


def _mean_distance(r: jax.Array, predator: jax.Array) -> jax.Array:
    return jnp.sqrt(((r - predator) ** 2).sum(axis=-1)).mean()


def _step(model: Model, interaction_range: jax.Array, state: State) -> State:
    r, v, predator, minimum = state
    squared = sum((r[:, None, axis] - r[None, :, axis]) ** 2 for axis in range(2))
    near = (squared <= interaction_range**2).astype(r.dtype)
    force = _scaled(near @ v, model.speed)  # the sum has the same direction as the mean
    offsets = r - predator
    felt = (offsets**2).sum(axis=-1, keepdims=True) <= model.predator_range**2
    force += jnp.where(felt, _scaled(offsets, model.repulsion_strength), 0.0)
    r = r + model.time_step * v
    v = _scaled(v + (model.time_step / model.mass) * force, model.speed)
    predator = predator + model.time_step * jnp.array(model.predator_velocity)
    return r, v, predator, jnp.minimum(minimum, _mean_distance(r, predator))


@jax.jit
def _run(
    model: Model, positions: jax.Array, velocities: jax.Array, interaction_range: jax.Array, steps: int
) -> tuple[jax.Array, jax.Array]:
    def one(r: jax.Array, v: jax.Array) -> tuple[jax.Array, jax.Array]:
        predator = jnp.array(model.predator_position)
        step = partial(_step, model, interaction_range)
        start = (r, v, predator, _mean_distance(r, predator))
        r, _, _, minimum = jax.lax.fori_loop(0, steps, lambda _, state: step(state), start)
        return r, minimum

    return jax.vmap(one)(positions, velocities)


def _run_flocks(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
    positions, minimum = _run(flocks.model, flocks.positions, flocks.velocities, interaction_range, steps)
    return Outcome(np.asarray(positions), np.asarray(minimum))


PEERS = (Peer("JAX, all pairs", _run_flocks, flocks_at_once=64),)
