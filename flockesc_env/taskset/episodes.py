"""``record_episodes``: data sets of the episodes of a task, as Parquet files."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from copy import copy
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flockesc_env.common.errors import InputError, errors_at
from flockesc_env.common.extras import data_frame, require
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.episodes.options import UNOBSERVED
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.episodes.splits import refuse_held_out
from flockesc_env.policies.base import BasePolicy
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.taskset.fitting import fitted
from flockesc_env.taskset.scoring import LoadedPolicy, Report
from flockesc_env.taskset.task import Task


def environment(task: Task, **options: Any) -> Any:
    """Return the environment of a task's training; with one range per agent it is a batch of one flock."""
    if task.per_agent and isinstance(task.scenario, FlockScenario):
        options = {**task.options, **options}
        return BatchVectorEnv(scenario=task.scenario, per_agent=True, autoreset_mode="Disabled", **options)
    return task.env(**options)


def record_episodes(
    policies: Sequence[LoadedPolicy],
    task: Task,
    seeds: Sequence[int],
    output: Path,
    report: Report = lambda _: None,
) -> None:
    """Record a data set in a new or empty folder, which gets its files once all of them are complete.

    Actions are float32 from -1 to 1; rewards are changes of the objective. The options in policies.parquet
    are those of ``environment``, as JSON. ``report`` gets each policy's text before it plays. Needs polars.

    Raises:
        InputError: if a policy does not fit the task, names agree, a seed is held out, or files exist.
    """
    require("analysis", ["polars"])
    import polars as pl

    refuse_held_out(seeds)
    if output.exists() and not (output.is_dir() and not any(output.iterdir())):
        raise InputError("output", "a new or empty folder", repr(str(output)))
    stems = (Path(each.spec).stem if each.sha256 else each.policy.name for each in policies)
    names = [re.sub(r"[^A-Za-z0-9_]+", "-", stem) for stem in stems]
    if len({"episodes", "policies", *names}) < 2 + len(names):
        raise InputError("policies", "different names, not episodes or policies", ", ".join(names))
    entries = []
    for policy in policies:
        with errors_at(f"{policy.spec}: "):
            entries.append(copy(fitted(policy.policy, task)))
        own = {name: value for name, value in (entries[-1].options or {}).items() if name not in UNOBSERVED}
        entries[-1].options = {**task.options, **own}  # those of the environment in which it plays
    output.mkdir(parents=True, exist_ok=True)
    ends, facts = [], []
    with TemporaryDirectory(dir=output) as folder, TemporaryDirectory(dir=output) as scratch:
        for name, policy, entry in zip(names, policies, entries, strict=True):
            report(policy.spec)
            own = dict(entry.options or {})
            spec = environment(task, **own).policy_spec
            env = environment(task, **{**own, "action_mode": "normalized"})
            parts = []
            for start in range(0, len(seeds), 10):  # the rows of a flock take up to some ten MB
                played = [_play(name, entry, spec, env, task, seed) for seed in seeds[start : start + 10]]
                parts.append(Path(scratch, f"{name}-{start}.parquet"))
                pl.concat(rows for rows, _ in played).write_parquet(parts[-1])
                ends += [end for _, end in played]
            pl.scan_parquet(parts).sink_parquet(Path(folder, f"{name}.parquet"))
            shown = json.dumps({name: value for name, value in own.items() if value != math.inf})
            facts.append((name, shown, policy.sha256, list(spec.layout.names)))
        columns = ["policy", "seed", "steps", "objective", "last_observation"]
        rows = pl.DataFrame(ends, columns, orient="row").cast({"last_observation": pl.List(pl.Float32)})
        rows.write_parquet(Path(folder, "episodes.parquet"))
        columns = ["policy", "options", "sha256", "entries"]
        pl.DataFrame(facts, columns, orient="row").write_parquet(Path(folder, "policies.parquet"))
        for file in Path(folder).iterdir():
            file.rename(output / file.name)


def _play(name: str, policy: BasePolicy, spec: Any, env: Any, task: Task, seed: int) -> tuple[Any, Any]:
    """Play an episode; return the table of its actions, and its row in the table of episodes."""
    observation, _ = env.reset(seed=seed)
    reset_policy(policy, np.ones(spec.rows, bool))
    steps: list[tuple[Any, ...]] = []
    while not steps or not (steps[-1][-2] | steps[-1][-1]).all():  # terminated or truncated
        seen = np.atleast_2d(observation)
        ranges = spec.actions.to_ranges(policy.act(seen, spec), spec.rows)
        action = env.policy_spec.actions.from_ranges(ranges).astype(np.float32)
        observation, *results, info = env.step(action if task.per_agent else action[0])
        ranges = env.policy_spec.actions.to_ranges(action, spec.rows).astype(np.float32)
        steps.append((seen, action[:, 0], ranges, *map(np.atleast_1d, results)))
    step, agent = np.indices((len(steps), spec.rows), np.int32).reshape(2, -1)
    rows: dict[str, Any] = {"policy": [name] * len(step), "seed": np.full(len(step), seed), "step": step}
    rows |= {"agent": agent} if task.per_agent else {}
    columns = ("observation", "action", "range", "reward", "terminated", "truncated")
    rows |= zip(columns, map(np.concatenate, zip(*steps, strict=True)), strict=True)
    objective = float(np.atleast_1d(info[task.spec.name])[0])
    return data_frame(rows), (name, seed, len(steps), objective, np.ravel(observation).tolist())
