"""Arguments of the commands evaluate and compare.

This module imports no heavy library, so that ``python -m training`` starts fast.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flockesc_env.episodes.objectives import Objective


@dataclass(frozen=True, kw_only=True)
class EvaluateArgs:
    """Arguments of ``evaluate``.

    Attributes:
        policy: name of a built-in policy (see ``flockesc simulate --help``), a policy
            file, the folder of a run, module:function, or a model of stable-baselines3
            with its task, as PPO:model.zip.
        task: task of the benchmark in which a model of stable-baselines3 was trained.
        flocks: number of held-out flocks.
        output: Parquet file for a table with one row per flock; default: no file.
        num_threads: number of threads; default: one per core.
    """

    policy: str
    task: str | None = None
    flocks: int = 200
    output: Path | None = None
    num_threads: int | None = None


@dataclass(frozen=True, kw_only=True)
class CompareArgs:
    """Arguments of ``compare``.

    Attributes:
        policies: names of built-in policies (see ``flockesc simulate --help``), policy
            files, folders of runs, module:function, or models of stable-baselines3 with
            their task, as PPO:model.zip.
        task: task of the benchmark in which models of stable-baselines3 were trained.
        output: folder for the tables, the recorded runs and the figures.
        objective: what is compared; see ``EnvOptions``.
        flocks: number of held-out flocks for the comparison.
        tuning_flocks: number of other flocks, on which the best fixed range is chosen.
        max_range: largest range of the grid in m.
        grid_size: number of ranges in the grid, from 0 to ``max_range``. A second grid lies between the
            neighbors of its best range, at a fifth of the distance.
        num_threads: number of threads; default: one per core.
    """

    policies: tuple[str, ...]
    task: str | None = None
    output: Path = Path("runs/comparison")
    objective: Objective = "mean"
    flocks: int = 200
    tuning_flocks: int = 400
    max_range: float = 100.0
    grid_size: int = 11
    num_threads: int | None = None
