"""Measures what normalizes the scores of the tasks, and writes it into the file that is then frozen.

The file says what a person decides about a task. The rest follows: the scales, the shortcut and the numbers
of the controls. ``ANY_RATE`` gets the scores that rules reach with their own options, ``BEST_FIXED`` what the
best fixed range reaches on every flock.
"""

import json
import math
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
import tomli_w

from flockesc_env import FlockScenario
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import FloatArray, mean
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.scenario.presets import Scenario
from flockesc_env.taskset.task import FLOCKS, Task, read_tasks, tasks
from studies.measurements import Runner, play_jobs, split
from studies.scoreboard import references
from studies.scoreboard.board import ANY_RATE, BEST_FIXED, BOARD, CHOOSING, CONTROLLING, column_of, rules_of
from studies.study import document

_SIMULATED_FLOCKS: Final = {"paper-flock": 200, "startled": 60, "varied": 60}
"""Number of held-out flocks for the search of clairvoyant schedules, by scenario. One takes seconds."""


def freeze(path: Path, names: Sequence[str], runner: Runner) -> None:
    """Measure the numbers of some tasks again, all if no name is given, and write them into the file."""
    frozen, rates = tomllib.loads(path.read_text("utf-8")), json.loads(ANY_RATE.read_text("utf-8"))
    for name in names or tasks:
        task, entry = tasks[name], frozen["tasks"][name]
        entry["scales"] = {scenario: _scale(task, scenario, runner) for scenario in task.scenarios}
        player = _Player(read_tasks(tomli_w.dumps(frozen))[name], runner)
        entry["shortcut"] = player.shortcut()
        rates[name] = {rule: player.score(rule, own=True) for rule in rules_of(task)}
        for control in entry.get("controls", ()):
            control |= player.control(control["policy"], control["baseline"])
    text = tomli_w.dumps(frozen)
    write_text(path, text)
    write_best_fixed(read_tasks(text).values(), runner)
    write_text(ANY_RATE, document({name: rates[name] for name in tasks if name in rates}))


def write_best_fixed(measured: Iterable[Task], runner: Runner) -> None:
    """Play the best fixed range on the held-out flocks of every scenario and objective."""
    jobs: dict[str, list[Job]] = {}
    for task in measured:
        for name, scale in task.scales.items():
            grid = (scale.best_fixed_range,)
            jobs[column_of(task, name)] = seed_jobs(OUTCOMES, task.scenarios[name], grid, FLOCKS)
    played = runner.run(jobs, "Best fixed ranges")
    write_table(pl.DataFrame({key: found[key.split()[1]][0] for key, found in played.items()}), BEST_FIXED)


@dataclass(frozen=True)
class _Player:
    """Plays policies on a task."""

    task: Task
    runner: Runner

    def play(self, policy: str, model: Scenario, flocks: range, *, own: bool = False) -> FloatArray:
        """Return the objective of every flock with the options of the task, or the policy's own ones."""
        entry = self.task.setup(policy)
        options = {} if own else {"per_agent": entry.per_agent, **vars(entry.options)}
        jobs = play_jobs(policy, model, self.task.spec.name, flocks, **options)
        return self.runner.join(jobs, policy)["objective"]

    def score(self, policy: str, *, own: bool = False) -> float:
        """Return the mean score of a policy on the held-out flocks."""
        models = self.task.scenarios.items()
        played = {name: self.play(policy, model, FLOCKS, own=own) for name, model in models}
        return float(self.task.normalize(played).mean())

    def shortcut(self) -> dict[str, Any]:
        """Return the untrained policy that is best on tuning flocks, and its score on held-out ones."""
        fixed = [f"fixed:{scale.best_fixed_range:.12g}" for scale in self.task.scales.values()]
        reached = {
            policy: np.mean([self.play(policy, model, CHOOSING) for model in self.task.scenarios.values()])
            for policy in dict.fromkeys((*rules_of(self.task), "random", *fixed))
        }
        best = max(reached, key=lambda policy: reached[policy])
        return {"policy": best, "score": round(self.score(best), 12) + 0.0}

    def control(self, policy: str, baseline: str) -> dict[str, Any]:
        """Return the gain of a policy over another one, with and without warnings."""
        found, (model,) = {}, self.task.scenarios.values()
        for name, changes in {"gain": {}, "gain_blocked": {"blocks_warnings": True}}.items():
            changed = model.replace(**changes)
            gain = self.play(policy, changed, CONTROLLING) - self.play(baseline, changed, CONTROLLING)
            found[name] = astuple(mean(gain))
        return found


def _scale(task: Task, scenario: str, runner: Runner) -> dict[str, Any]:
    """Return the scale of a scenario: the best fixed range, scores 0 and 1 and what reaches score 1."""
    grid, model = task.scenario.search_ranges, task.scenarios[scenario]
    tuning = first_seeds(TUNING, 200 if model.num_agents > 500 else 1000)  # large flocks are slow
    jobs = seed_jobs(OUTCOMES, model, grid, tuning)
    tuned = runner.join(jobs, f"Fixed ranges in {scenario}")[task.spec.name]
    best = grid[int(tuned.mean(axis=1).argmax())]
    fixed = _Player(task, runner).play(f"fixed:{best:.12g}", model, FLOCKS)
    kind = _kind(task, model)
    reached = _reference(task, kind, scenario, runner)
    same_flocks = fixed[: len(reached)]
    found: dict[str, Any] = {
        "best_fixed_range": best,
        "zero": float(fixed.mean()),
        "one": float(reached.mean() + (fixed.mean() - same_flocks.mean())),
        "reference": kind,
    }
    if len(reached) < len(fixed):
        gain = mean(reached - same_flocks)
        found["one_error"] = (gain.high - gain.mean) * math.sqrt(1 - len(reached) / len(fixed))
    return found


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
    function = getattr(references, kind.replace(" ", "_"))
    size = 5 if kind == "clairvoyant" else 100
    jobs = split(function, task.name, scenario, flocks=flocks, size=size, seconds=0.1)
    return runner.join(jobs, f"{kind} in {scenario}")["objective"]


def _hindsight(task: Task, scenario: str, runner: Runner) -> FloatArray:
    """Return the largest objective on every line, of all fixed ranges and all policies of the scoreboard."""
    model = task.scenarios[scenario]
    jobs = seed_jobs(OUTCOMES, model, model.search_ranges, FLOCKS)
    fixed = runner.join(jobs, "Fixed ranges on held-out lines")[task.spec.name]
    files = sorted(BOARD.glob(f"*/policies/{task.name}-*.npz"))
    plays = {file: play_jobs(file.read_bytes(), model, task.spec.name, FLOCKS) for file in files}
    learned = [found["objective"] for found in runner.run(plays, "Policies of the scoreboard").values()]
    drawn = _Player(task, runner).play("random", model, FLOCKS)
    best: FloatArray = np.max([*fixed, *learned, drawn], axis=0)
    return best
