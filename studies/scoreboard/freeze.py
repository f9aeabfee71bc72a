"""Measures what normalizes the scores of the tasks, and writes it into the file that is then frozen.

The file says what a person decides about a task. Its numbers follow: the scales, the shortcut's score and the
controls.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w

from flockesc_env import FlockScenario
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import FloatArray, mean
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.scenario.presets import Scenario
from flockesc_env.tasks.comparison import grid_of
from flockesc_env.tasks.definition import FLOCKS
from flockesc_env.tasks.statistics import means
from flockesc_env.tasks.task import Task, tasks
from studies.measurements import Runner, chunks
from studies.playing import play_job
from studies.scoreboard import references
from studies.scoreboard.board import load_board

_SIMULATED_FLOCKS: Final = {"paper-flock": 200, "aligned-head-on": 60}
"""Number of held-out flocks for the search of clairvoyant schedules, by scenario. One takes seconds."""

_REFERENCES: Final = {
    "free headings": references.free_headings,
    "informed greedy": references.informed_greedy,
    "clairvoyant": references.clairvoyant,
}


def freeze(path: Path, names: Sequence[str], runner: Runner) -> None:
    """Measure the numbers of some tasks again, all if no name is given, and write them into the file."""
    document = tomllib.loads(path.read_text("utf-8"))
    for name in names or tasks:
        task, entry = tasks[name], document["tasks"][name]
        entry["scales"] = {scenario: _scale(task, scenario, runner) for scenario in task.scenarios}
        played = {
            one: _play(task, task.shortcut.policy, one, FLOCKS, runner).mean() for one in task.scenarios
        }
        scales = entry["scales"]
        shares = [
            (played[one] - scales[one]["zero"]) / (scales[one]["one"] - scales[one]["zero"]) for one in scales
        ]
        entry["shortcut"]["score"] = float(np.mean(shares))
        for control in entry.get("controls", ()):
            control |= _control(task, control["policy"], control["baseline"], runner)
    write_text(path, tomli_w.dumps(document))


def _scale(task: Task, scenario: str, runner: Runner) -> dict[str, Any]:
    grid, model = grid_of(task), task.scenarios[scenario]
    tuning = first_seeds(TUNING, 200 if model.num_agents > 500 else 1000)  # large flocks are slow
    jobs = {"": seed_jobs(OUTCOMES, model, grid, tuning)}
    tuned = runner.groups(jobs, f"Fixed ranges in {scenario}")[""][task.spec.name]
    best = grid[int(tuned.mean(axis=1).argmax())]
    fixed = _play(task, f"fixed:{best:.12g}", scenario, FLOCKS, runner)
    kind = _kind(task, model)
    reached = _reference(task, kind, scenario, runner)
    same_flocks = fixed[: len(reached)]
    (gain,) = means((reached - same_flocks)[np.newaxis, np.newaxis])
    found: dict[str, Any] = {
        "best_fixed_range": best,
        "zero": float(fixed.mean()),
        "one": float(reached.mean() + (fixed.mean() - same_flocks.mean())),
        "reference": kind,
    }
    if len(reached) < len(fixed):
        found["one_error"] = (gain.high - gain.mean) * math.sqrt(1 - len(reached) / len(fixed))
    return found


def _play(
    task: Task, policy: str, scenario: str, flocks: range, runner: Runner, strength: float | None = None
) -> FloatArray:
    """Return the objective of every flock, without the escape force if ``strength`` is 0."""
    model = task.scenarios[scenario]
    if strength is not None:
        model = model.replace(repulsion_strength=strength)
    jobs = {part: play_job(policy, model, task.spec.name, part) for part in chunks(flocks, 250)}
    return np.concatenate([found["objective"] for found in runner.each(jobs, policy).values()])


def _control(task: Task, policy: str, baseline: str, runner: Runner) -> dict[str, Any]:
    """Return the gain of a policy over another one, with and without the escape force."""
    gains, scenario = [], next(iter(task.scenarios))
    for strength in (None, 0.0):
        reached, other = (
            _play(task, name, scenario, FLOCKS, runner, strength) for name in (policy, baseline)
        )
        found = mean(reached - other)
        gains.append([found.mean, found.low, found.high])
    return {"gain": gains[0], "gain_without_force": gains[1]}


def _kind(task: Task, model: Scenario) -> str:
    """Return the reference of a scenario: a bound where there is one for what the task's actions set."""
    if not isinstance(model, FlockScenario):
        return "hindsight"
    if not task.per_agent:
        return "clairvoyant"
    return "free headings" if references.is_bounded(model) else "informed greedy"


def _reference(task: Task, kind: str, scenario: str, runner: Runner) -> FloatArray:
    """Return the objective of the reference on the first held-out flocks, all of them if it is fast."""
    if kind == "hindsight":
        return _hindsight(task, scenario, runner)
    flocks = FLOCKS[: _SIMULATED_FLOCKS.get(scenario, 200)] if kind == "clairvoyant" else FLOCKS
    name = f"{references.__name__}:{_REFERENCES[kind].__name__}"
    parts = chunks(flocks, 5 if kind == "clairvoyant" else 100)
    jobs = {part: Job(name, (task.name, scenario, part), 10.0) for part in parts}
    found = runner.each(jobs, f"{kind} in {scenario}")
    return np.concatenate([values["objective"] for values in found.values()])


def _hindsight(task: Task, scenario: str, runner: Runner) -> FloatArray:
    """Return the largest objective on every line, of all fixed ranges and all policies of the scoreboard."""
    jobs = {"": seed_jobs(OUTCOMES, task.scenarios[scenario], grid_of(task), FLOCKS)}
    fixed = runner.groups(jobs, "Fixed ranges on held-out lines")[""][task.spec.name]
    results = [one.results[task.name] for one in load_board() if task.name in one.results]
    best: FloatArray = np.concatenate([fixed, *(result.values(scenario) for result in results)]).max(axis=0)
    return best
