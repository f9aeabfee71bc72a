"""How far the flock in JAX is from the core, how large its gradients are, and how fast both are on one core.

``taskset -c 0 python examples/jax_accuracy.py > results/jax/results.json``
"""

import json
import time
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax_gradient as example
import numpy as np

from flockesc_env import FlockScenario, __version__, simulate, sweep
from flockesc_env.jax import init, rollout, step

jax.config.update("jax_enable_x64", True)
PAPER, RHO, SEEDS = FlockScenario(), 12.0, range(1_000_000, 1_000_100)
play = partial(rollout, PAPER, policy=lambda _: RHO)
count = jax.jit(partial(jax.lax.map, lambda flock: step(PAPER, init(PAPER, *flock), RHO).num_heard))


def accuracy(dtype: str) -> dict[str, float]:
    """Return differences to the core over whole episodes, and those of the neighbors in its states."""
    one, lengths, objectives, flips = jax.jit(play), [], [], []
    for run in (simulate(PAPER, RHO, seed=seed) for seed in SEEDS):
        r, v = run.positions.astype(dtype), run.velocities.astype(dtype)
        states = one(init(PAPER, r[0], v[0]))
        lengths.append(float(np.abs(states.positions - run.positions[1:]).max()))
        objectives.append(float(np.abs(states.min_mean_distance[-1] - run.mean_distance.min())))
        flips.append(float(np.abs(count((r, v)) - count((run.positions, run.velocities))).mean()))
    names = (
        "largest position difference, m",
        "largest |dJ|, m",
        "mean |dJ|, m",
        "flips per 10^6 agent-steps",
    )
    values = max(lengths), max(objectives), np.mean(objectives).item(), 1e6 * np.mean(flips).item()
    return dict(zip(names, values, strict=True))


def norms(softness: float, straight_through: bool, layers: Any, states: Any) -> list[float]:
    """Return smallest, median and largest norm of the gradients of flocks under an untrained network."""
    example.SOFTNESS, example.rollout = softness, partial(rollout, straight_through=straight_through)
    gradients = jax.jit(partial(jax.lax.map, partial(jax.grad(example.objective), layers)))(states)
    squares = [(leaf.reshape(len(leaf), -1) ** 2).sum(axis=1) for leaf in jax.tree.leaves(gradients)]
    return np.quantile(np.sqrt(sum(squares)), [0, 0.5, 1]).tolist()


def speed(run: Any, states: Any = None) -> int:
    """Return flock-steps of 20 flocks per second of processor time: the best of 3 calls after a first one."""
    times = [time.process_time()]
    for _ in range(4):
        jax.block_until_ready(run(states))
        times.append(time.process_time())
    return round(20 * PAPER.num_steps / np.diff(times)[1:].min())


layers, starts = example.draw(0, 5, 20)
double = jax.tree.map(lambda each: each[0], starts)
layers, starts = jax.tree.map(lambda e: e.astype(np.float32) if e.dtype == float else e, (layers, starts))
single, flocks = (
    jax.tree.map(lambda e: e[0], starts),
    jax.tree.map(lambda e: e.reshape(100, *e.shape[2:]), starts),
)
gradients = partial(jax.lax.map, partial(jax.value_and_grad(example.objective), layers))
results = {
    "command": "taskset -c 0 python examples/jax_accuracy.py",
    "versions": {"flockesc-env": __version__, "jax": jax.__version__, "numpy": np.__version__},
    "processor": Path("/proc/cpuinfo").read_text().split("model name")[1].split("\n")[0].strip("\t :"),
    "seeds": [SEEDS[0], SEEDS[-1]],
    "accuracy": {dtype: accuracy(dtype) for dtype in ("float64", "float32")},
    "flock-steps per second on one core": {
        "core": speed(lambda _: sweep(PAPER, [RHO], range(20), num_threads=1)),
        "float64, lax.map": speed(jax.jit(partial(jax.lax.map, play)), double),
        "float32, lax.map": speed(jax.jit(partial(jax.lax.map, play)), single),
        "float32, vmap": speed(jax.jit(jax.vmap(play)), single),
        "float32, lax.map, with gradients": speed(jax.jit(gradients), single),
        "one GPU": "not measured",
    },
    "norms of gradients, smallest, median, largest": {
        f"softness {softness} m{', straight-through' * through}": norms(softness, through, layers, flocks)
        for softness, through in ((1.0, False), (4.0, False), (1.0, True))
    },
}
print(json.dumps(results, indent=1))
