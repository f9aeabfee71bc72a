"""What flying apart is worth: agents that leave the flock before they see the predator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from flockesc_env import FlockScenario, Trajectory, built_in, record, rollout, simulate
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.jobs import Arrays, Job
from studies.measurements import Runner, chunks

DISPERSAL_FILE = "dispersal.parquet"
DISPERSAL_FLOCKS = 200
STARTS = (0.0, 1.0, 2.0)
"""Times in s at which agents start to fly straight out of the flock."""

_SECONDS = 0.1


def measure_dispersal(results: Path, runner: Runner) -> Path:
    """Measure what flying apart is worth on held-out flocks; return the file of the table."""
    flocks = first_seeds(HELD_OUT, DISPERSAL_FLOCKS)
    jobs = [Job(f"{__name__}:dispersal", (part,), len(part) * _SECONDS) for part in chunks(flocks, 50)]
    columns = runner.groups({"": jobs}, "Flying apart")[""]
    write_table(pl.DataFrame({"seed": flocks, **columns}), results / DISPERSAL_FILE)
    return results / DISPERSAL_FILE


def dispersal(flocks: range) -> Arrays:
    """Return one value per flock, by name.

    - ``witnesses``: J_mean in m of the rule ``stubborn-witnesses``; ``unseen``: of the same rule if no agent
      ever sees the predator;
    - ``outward_0``, ``outward_1``, ..: J_mean in m of agents that fly straight on, and from that second on
      straight away from the center of the flock;
    - ``cosine``: mean cosine between heading and way out of the center after 1 s of the rule ``spread-out``.
    """
    witnesses, spread = built_in("stubborn-witnesses"), built_in("spread-out")
    blind: dict[str, Any] = {**witnesses.options, "predator_sensing_range": 1e-9}
    scenario = FlockScenario()
    found = {
        "witnesses": rollout(scenario, witnesses, flocks).min_mean_distance,
        "unseen": rollout(scenario, witnesses.policy, flocks, per_agent=True, **blind).min_mean_distance,
        "cosine": np.array([_outward_cosine(record(scenario, spread, flock)) for flock in flocks]),
    }
    runs = [simulate(scenario, 0.0, seed=flock) for flock in flocks]
    for start in STARTS:
        found[f"outward_{start:g}"] = np.array([_fly_outward(run, start) for run in runs])
    return found


def _outward_cosine(run: Trajectory, time: float = 1.0) -> float:
    step = round(time / run.scenario.time_step)
    headings = run.velocities[step] / np.linalg.norm(run.velocities[step], axis=1, keepdims=True)
    return float((headings * _outward(run.positions[step])).sum(axis=1).mean())


def _fly_outward(run: Trajectory, start: float) -> float:
    """Return J_mean in m of agents that turn outward at a time and do not see the predator."""
    positions, velocities, times = run.positions[0], run.velocities[0], run.times
    turned = positions + start * velocities
    speed = np.linalg.norm(velocities, axis=1, keepdims=True)
    before = np.minimum(times, start)[:, np.newaxis, np.newaxis]
    after = np.maximum(times - start, 0.0)[:, np.newaxis, np.newaxis]
    paths = positions + before * velocities + after * speed * _outward(turned)
    distances = np.linalg.norm(paths - run.predator_positions, axis=2)
    return float(distances.mean(axis=1).min())


def _outward(positions: FloatArray) -> NDArray[np.float64]:
    """Return the unit vectors from the center of the flock to its agents, shape (n, D)."""
    offsets = positions - positions.mean(axis=0)
    unit: NDArray[np.float64] = offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
    return unit


def dispersal_figures(file: Path) -> dict[str, Estimate]:
    """Return the mean over flocks of every column of the table, with its interval."""
    table = pl.read_parquet(file).drop("seed")
    return {name: mean(table[name].to_numpy()) for name in table.columns}
