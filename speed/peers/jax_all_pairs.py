"""Peers in JAX: all pairs on the CPU, compiled, in float64 and float32.

``lax.map`` runs one flock after another. On a CPU that is faster than ``vmap``, whose arrays of pairs of many
flocks exceed the cache. Vectors have the shape (2, n), because a product of (2, n) and (n, n) is faster than
one of (n, n) and (n, 2).
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from speed.measure import cores
from speed.peers import Flocks, Model, Outcome, Peer

jax.config.update("jax_platforms", "cpu")
jax.config.update("jax_enable_x64", True)
with cores(1):  # as many threads as cores: threads that share a core take three times as long
    jax.devices()

Pair = tuple[jax.Array, jax.Array]
State = tuple[jax.Array, jax.Array, jax.Array, jax.Array]
"""Positions and velocities, shape (2, n), position of the predator, (2, 1), smallest mean distance."""


def _scaled(vectors: jax.Array, length: jax.Array) -> jax.Array:
    norms = jnp.sqrt((vectors**2).sum(axis=0))
    return vectors * (length / jnp.where(norms > 0, norms, jnp.inf))


def _mean_distance(r: jax.Array, predator: jax.Array) -> jax.Array:
    return jnp.sqrt(((r - predator) ** 2).sum(axis=0)).mean()


def _step(model: Model, interaction_range: jax.Array, state: State) -> State:
    r, v, predator, minimum = state
    squared = sum((x[:, None] - x) ** 2 for x in r)
    near = (squared <= interaction_range**2).astype(r.dtype)
    force = _scaled(v @ near, model.speed)  # the sum has the same direction as the mean
    offsets = r - predator
    felt = (offsets**2).sum(axis=0) <= model.predator_range**2
    force += jnp.where(felt, _scaled(offsets, model.repulsion_strength), 0.0)
    r = r + model.time_step * v
    v = _scaled(v + (model.time_step / model.mass) * force, model.speed)
    predator = predator + model.time_step * jnp.stack(model.predator_velocity)[:, None]
    return r, v, predator, jnp.minimum(minimum, _mean_distance(r, predator))


@partial(jax.jit, static_argnames="dtype")
def _run(model: Model, flocks: Pair, rho: jax.Array, steps: int, dtype: type) -> Pair:
    model, flocks, rho = jax.tree.map(lambda entry: jnp.asarray(entry, dtype), (model, flocks, rho))

    def one(flock: Pair) -> Pair:
        r, v = (vectors.T for vectors in flock)
        predator = jnp.stack(model.predator_position)[:, None]
        step = partial(_step, model, rho)
        start = (r, v, predator, _mean_distance(r, predator))
        r, _, _, minimum = jax.lax.fori_loop(0, steps, lambda _, state: step(state), start)
        return r.T, minimum

    return jax.lax.map(one, flocks)


def _peer(name: str, dtype: type) -> Peer:
    def run(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
        start = (flocks.positions, flocks.velocities)
        positions, minimum = _run(flocks.model, start, interaction_range, steps, dtype)
        return Outcome(np.asarray(positions), np.asarray(minimum))

    return Peer(name, run, flocks_at_once=64, is_single=dtype is np.float32, largest=10_000)


PEERS = (_peer("JAX, all pairs", np.float64), _peer("JAX, all pairs, float32", np.float32))
