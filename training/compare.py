"""Comparison of policies with the best fixed range on the same held-out flocks."""

from __future__ import annotations

import dataclasses
import json
import os
import shlex
import sys
from pathlib import Path

import numpy as np
import polars as pl

from flockesc_env import FlockScenario, FlockSweepResult, save_run, sweep
from flockesc_env.common import stats
from flockesc_env.common.array_files import write_table
from flockesc_env.common.checks import as_count
from flockesc_env.common.files import check_writable, write_text
from flockesc_env.common.progress import progress_bar
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, ObjectiveSpec
from flockesc_env.tasks import seeds
from training import plots
from training.arguments import CompareArgs
from training.evaluation import run_policy
from training.policies import is_model, named_policy, policy_argument, scenario_of
from training.versions import versions

RECORDS = ("best_fixed_range.npz", "last_policy.npz")
"""Recorded runs of one flock, for ``flockesc watch``."""

_PARTS = (("mean", ""), ("low", "_low"), ("high", "_high"))
"""Attributes of an estimate, and the ends of their columns."""

_REFINEMENT = 5
"""Distance of two ranges of the grid, divided by their distance near the best one."""


def compare(args: CompareArgs) -> pl.DataFrame:
    """Evaluate all policies on the held-out flocks; write and return the table.

    Raises:
        ArgumentError: if an argument is out of bounds or a policy is unknown.
    """
    entries = [named_policy(spec, args.task) for spec in args.policies]
    scenario = scenario_of(entries)
    spec = FLOCK_OBJECTIVES[args.objective]
    spec.check_defined_in(scenario)
    held_out = seeds.first_seeds(seeds.HELD_OUT, args.flocks)
    tuning = seeds.first_seeds(seeds.TUNING, args.tuning_flocks)
    coarse, step = np.linspace(
        0.0, args.max_range, as_count(args.grid_size, "grid_size", least=2), retstep=True
    )
    args.output.mkdir(parents=True, exist_ok=True)
    check_writable(args.output / "table.md")

    near = _sweep("Grid search on tuning flocks", scenario, coarse, tuning, args).best_range(args.objective)
    fine = near + step / _REFINEMENT * np.arange(1 - _REFINEMENT, _REFINEMENT)
    fine = fine[(fine >= 0.0) & (fine <= args.max_range)]
    best = _sweep("Finer grid search", scenario, fine, tuning, args).best_range(args.objective)
    search = _sweep("Grid search on held-out flocks", scenario, np.union1d(coarse, fine), held_out, args)
    search.to_parquet(args.output / "grid_search.parquet")
    at_best = int(np.flatnonzero(search.interaction_ranges == best)[0])
    fixed = search.values(args.objective)[at_best]
    baseline = dataclasses.replace(named_policy(f"fixed:{best}"), name=f"best fixed range ({best:g} m)")
    outcomes = {
        baseline.name: fixed,
        "hindsight oracle over fixed ranges": search.hindsight_oracle(args.objective),
    }
    for entry in entries:
        episodes = run_policy(entry, held_out, scenario=scenario, num_threads=args.num_threads)
        outcomes[entry.name] = spec.values(episodes)

    estimates = {name: _estimates(values, fixed) for name, values in outcomes.items()}
    table = pl.DataFrame(
        {"policy": name}
        | {column + end: getattr(found, part) for column, found in row.items() for part, end in _PARTS}
        for name, row in estimates.items()
    )
    text = _markdown(estimates, spec, args)
    print(text)
    write_text(args.output / "table.md", text + "\n")
    write_table(table, args.output / "table.parquet")
    by_flock = pl.DataFrame({"seed": held_out, **outcomes})
    long = by_flock.unpivot(index="seed", variable_name="policy", value_name="objective")
    write_table(long, args.output / "episodes.parquet")
    record = {
        "command": shlex.join(["python", "-m", "training", *sys.argv[1:]]),
        "args": {**dataclasses.asdict(args), "output": args.output.name},
        "versions": versions(),
    }
    write_text(args.output / "comparison.json", json.dumps(record, indent=2) + "\n")
    figures = [plots.objective_against_range(search, spec, outcomes, args.output)]
    if entries:
        last = entries[-1]
        # A typical flock: the lower median of the last policy's paired differences to the best range.
        order = np.argsort(outcomes[last.name] - fixed, kind="stable")
        flock = held_out[int(order[(len(order) - 1) // 2])]
        runs = [(entry.name, entry.record(flock, scenario)) for entry in (baseline, last)]
        for file, (name, run) in zip(RECORDS, runs, strict=True):
            save_run(run, args.output / file, name=name)
        figures += [plots.flock_over_time(runs, spec, args.output)]
        figures += [plots.flock_under_attack(runs, spec, args.output)]
    print("\nFigures:", *figures, sep="\n  ")
    if entries:
        print("\nWatch this flock in the browser:", _watch_command(args, scenario, best, flock), sep="\n  ")
    return table


def _watch_command(args: CompareArgs, scenario: FlockScenario, best: float, flock: int) -> str:
    """Return the command that shows a flock under the best fixed range and under the last policy."""
    shown = [str(args.output / file) for file in RECORDS]
    if scenario == FlockScenario() and not is_model(args.policies[-1]):
        shown = ["--policies", f"fixed:{best:g}", policy_argument(args.policies[-1]), "--seed", str(flock)]
    program = os.path.relpath(Path(sys.executable).with_name("flockesc"))
    return shlex.join([program, "watch", *shown])


def _sweep(
    title: str, scenario: FlockScenario, grid: FloatArray, flocks: range, args: CompareArgs
) -> FlockSweepResult:
    with progress_bar(title, grid.size * len(flocks)) as report:
        return sweep(scenario, grid, flocks, num_threads=args.num_threads, progress=report)


def _estimates(values: FloatArray, fixed: FloatArray) -> dict[str, stats.Estimate]:
    return {
        "objective": stats.mean(values),
        "difference": stats.mean(values - fixed),
        "improvement": stats.improvement(values, fixed),
    }


def _markdown(estimates: dict[str, dict[str, stats.Estimate]], spec: ObjectiveSpec, args: CompareArgs) -> str:
    lines = [
        f"Objective `{spec.name}`{f' in {spec.unit}' if spec.unit else ''} on {args.flocks} held-out flocks;"
        " 95 % bootstrap intervals.",
        f"Differences to the best fixed range are paired by flock. The best fixed range was chosen on"
        f" {args.tuning_flocks} other flocks.",
        "",
        "| policy | objective | difference to best fixed | probability of improvement |",
        "|---|---|---|---|",
    ]
    for place, (name, row) in enumerate(estimates.items()):
        objective, *rest = (f"{estimate:.{spec.digits}f}" for estimate in row.values())
        lines.append(f"| {' | '.join([name, objective, *(rest if place else ('-', '-'))])} |")
    return "\n".join(lines)
