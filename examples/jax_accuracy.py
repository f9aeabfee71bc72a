"""How far the flock in JAX is from the core, how large gradients are, and how fast both are on one core.

``taskset -c 0 python -m examples.jax_accuracy > results/jax/accuracy.json``
"""

import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from flockesc_env import FlockScenario, simulate, sweep
from flockesc_env.jax import init, rollout, start, step
from training.gradient import GradientRounds
from training.run import Run

jax.config.update("jax_enable_x64", True)
PAPER, RHO, SEEDS = FlockScenario(), 12.0, range(1_000_000, 1_000_100)
play = partial(rollout, PAPER, policy=lambda _: RHO)
heard = jax.jit(partial(jax.lax.map, lambda flock: step(PAPER, init(PAPER, *flock), RHO).num_heard))


def accuracy(dtype: str) -> dict[str, float]:
    """Return differences to the core over whole episodes, and those of the neighbors in its states."""
    one, lengths, objectives, flips = jax.jit(play), [], [], []
    for run in (simulate(PAPER, RHO, seed=seed) for seed in SEEDS):
        r, v = run.positions.astype(dtype), run.velocities.astype(dtype)
        states = one(init(PAPER, r[0], v[0]))
        lengths.append(np.abs(states.positions - run.positions[1:]).max())
        objectives.append(np.abs(states.min_mean_distance[-1] - run.mean_distance.min()))
        flips.append(np.abs(heard((r, v)) - heard((run.positions, run.velocities))).mean())
    found = {"largest position difference, m": max(lengths), "largest |dJ|, m": max(objectives)}
    found |= {"mean |dJ|, m": np.mean(objectives), "flips per 10^6 agent-steps": 1e6 * np.mean(flips)}
    return {name: float(f"{value:.2g}") for name, value in found.items()}


def speed(run: Callable[[Any], Any], flocks: Any = None) -> int:
    """Return flock-steps of 20 flocks per second of processor time: the best of 3 calls after a first one."""
    times = [time.process_time()]
    for _ in range(4):
        jax.block_until_ready(run(flocks))
        times.append(time.process_time())
    return round(20 * PAPER.num_steps / np.diff(times)[1:].min())


rounds = GradientRounds(Run.of("per-agent-visible", "gradient", 0, Path("runs/unused")))
double = jax.tree.map(lambda *each: jnp.stack(each), *[start(PAPER, seed) for seed in range(20)])
single = jax.tree.map(lambda e: e.astype(np.float32) if e.dtype == float else e, double)
gradients = jax.jit(partial(jax.lax.map, partial(jax.value_and_grad(rounds.objective), rounds.layers)))
leaves = [np.asarray(leaf).reshape(20, -1) for leaf in jax.tree.leaves(gradients(single)[1])]
norms = np.linalg.norm(np.concatenate(leaves, axis=1), axis=1)
speeds = {
    "core": speed(lambda _: sweep(PAPER, [RHO], range(20), num_threads=1)),
    "float64, lax.map": speed(jax.jit(partial(jax.lax.map, play)), double),
    "float32, lax.map": speed(jax.jit(partial(jax.lax.map, play)), single),
    "float32, vmap": speed(jax.jit(jax.vmap(play)), single),
    "float32, lax.map, with gradients": speed(gradients, single),
}
results = {
    "command": "taskset -c 0 python -m examples.jax_accuracy",
    "jax": jax.__version__,
    "seeds": [SEEDS[0], SEEDS[-1]],
    "accuracy": {dtype: accuracy(dtype) for dtype in ("float64", "float32")},
    "flock-steps per second on one core": speeds,
    "norms of 20 gradients, smallest to largest": np.sort(norms.astype(float)).round(1).tolist(),
}
print(json.dumps(results, indent=1))
