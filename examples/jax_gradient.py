"""Gradients train a network that all agents share: backpropagation through whole episodes, in JAX.

```
pip install "flockesc-env[analysis,jax]"
NPROC=1 python examples/jax_gradient.py  # one thread of XLA, which takes less processor time than more
flockesc compare runs/jax.npz --task per-agent-visible
```
"""

import time
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
import tyro

from flockesc_env import NetworkPolicy, episode_seed, save_policy, tasks
from flockesc_env.jax import FlockState, rollout, start
from flockesc_env.policies import Architecture

TASK = tasks["per-agent-visible"]
NETWORK = Architecture(TASK.policy_spec.layout.names, hidden=(8,), squash="tanh")
SOFTNESS = 1.0  # in m
LEARNING_RATE = 0.03


def objective(layers: Any, state: FlockState) -> jax.Array:
    """Return J_mean of a flock in m under a network with these weights and biases."""

    def policy(observations: jax.Array) -> jax.Array:
        (weights, biases), (last_weights, last_biases) = layers
        outputs = jnp.tanh(observations @ weights + biases) @ last_weights + last_biases
        return (jnp.tanh(outputs[:, 0]) + 1) / 2 * TASK.options["max_range"]

    return rollout(TASK.scenario, state, policy, SOFTNESS, **TASK.options).min_mean_distance[-1]


@jax.jit
def train(layers: Any, starts: FlockState, clip: float) -> tuple[Any, jax.Array]:
    """Return trained layers, and J_mean in m of all flocks; starts have two more axes, (updates, flocks).

    The gradient of each flock is clipped to the norm ``clip`` before the mean is taken.
    """
    updates, flocks = starts.num_steps.shape
    optimizer = optax.adam(optax.cosine_decay_schedule(LEARNING_RATE, updates))

    def update(carry: Any, states: FlockState) -> tuple[Any, jax.Array]:
        layers, memory = carry
        values, gradients = jax.lax.map(partial(jax.value_and_grad(objective), layers), states)
        total, _ = optax.per_example_global_norm_clip(gradients, clip)
        steps, memory = optimizer.update(jax.tree.map(lambda each: -each / flocks, total), memory)
        return (optax.apply_updates(layers, steps), memory), values

    (layers, _), values = jax.lax.scan(update, (layers, optimizer.init(layers)), starts)
    return layers, values


def draw(seed: int, updates: int, flocks: int) -> tuple[Any, FlockState]:
    """Return random layers and the flocks of all updates."""
    rng = np.random.default_rng(seed)
    layers = [(jnp.asarray(rng.normal(0, 0.5, shape)), jnp.zeros(shape[1])) for shape in NETWORK.shapes]
    states = [start(TASK.scenario, episode_seed(seed, 1 + k)) for k in range(updates * flocks)]
    return layers, jax.tree.map(lambda *e: jnp.stack(e).reshape(updates, flocks, *e[0].shape), *states)


def main(
    updates: int = 150, flocks: int = 4, seed: int = 0, clip: float = 1.0, output: Path = Path("runs/jax.npz")
) -> None:
    """Train, save the policy, and compare it with the best fixed range on 200 held-out flocks."""
    begin = time.process_time()
    layers, _ = jax.block_until_ready(train(*draw(seed, updates, flocks), clip))
    print(f"{updates * flocks} episodes in {time.process_time() - begin:.0f} s of CPU time")
    policy = NetworkPolicy(NETWORK, np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(layers)]))
    known = {"scenario": TASK.scenario, "per_agent": TASK.per_agent, **TASK.options}
    output.parent.mkdir(parents=True, exist_ok=True)
    save_policy(policy.with_options(name=f"JAX gradient, seed {seed}", **known), output)
    print(TASK.compare(output))


if __name__ == "__main__":
    tyro.cli(main)
