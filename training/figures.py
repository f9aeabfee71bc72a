"""``python -m training figures``: ``flockesc compare`` with figures and recorded runs."""

import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import cast

import numpy as np

from flockesc_env import FlockScenario, InputError, load_policy, save_run, simulate
from flockesc_env.common.array_files import origin, write_table
from flockesc_env.common.files import check_writable, write_text
from flockesc_env.models.records import versions
from flockesc_env.policies import BasePolicy
from flockesc_env.policies.comparison import Comparison
from flockesc_env.taskset import Task
from training import plots
from training.figure_style import save_figure

RECORDS = ("best_fixed_range.npz", "last_policy.npz")
"""Recorded runs of one flock, for ``flockesc watch``."""


def draw(task: Task, entries: Sequence[BasePolicy], output: Path, num_flocks: int) -> Comparison:
    """Compare policies on held-out flocks; print the table, write it, figures and two recorded runs.

    Raises:
        InputError: if there is no policy, one does not fit the task, or the task is a line.
    """
    if not entries or not isinstance(task.scenario, FlockScenario):
        raise InputError("policies", "policies for a flock", f"{len(entries)} for {task.name}")
    output.mkdir(parents=True, exist_ok=True)
    check_writable(output / "table.md")
    found = task.compare(*entries, num_flocks=num_flocks)
    print(found)
    found.write(output)
    write_table(found.search.table(), output / "grid_search.parquet", origin(found.search))
    record = {"command": shlex.join(["python", "-m", "training", *sys.argv[1:]]), "versions": versions()}
    write_text(output / "comparison.json", json.dumps(record, indent=2) + "\n")

    (fixed_name, fixed), last = next(iter(found.values.items())), entries[-1]
    best = load_policy(f"fixed:{task.scales[found.scenario].best_fixed_range:g}")
    # A typical flock: the lower median of the last policy's paired differences to the best range.
    order = np.argsort([*found.values.values()][-1] - fixed, kind="stable")
    flock = int(found.seeds[order[(len(order) - 1) // 2]])
    scenario = task.scenarios[found.scenario]
    shown = ((fixed_name, best), (last.name, last))
    runs = [(name, simulate(cast("FlockScenario", scenario), policy=one, seed=flock)) for name, one in shown]
    for file, (name, run) in zip(RECORDS, runs, strict=True):
        save_run(run, output / file, name=name)
    figures = [
        save_figure(found.plot(), output / "objective_against_range"),
        plots.flock_over_time(runs, task.spec, output),
        plots.flock_under_attack(runs, task.spec, output),
    ]
    print("\nFigures:", *figures, sep="\n  ")
    files = [str(output / file) for file in RECORDS]
    program = os.path.relpath(Path(sys.executable).with_name("flockesc"))
    print("\nWatch this flock in the browser:", shlex.join([program, "watch", *files]), sep="\n  ")
    return found
