"""Gains at equal load: policies beside the fixed ranges under which agents hear as many others."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final

import msgspec
import numpy as np
from matplotlib.figure import Figure

from flockesc_env import tasks
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays
from flockesc_env.policies import rollout
from flockesc_env.policies.setup import setup
from flockesc_env.render.palette import LIGHT
from flockesc_env.taskset.results import is_file
from studies.measurements import Runner, policy_of, share_of, split
from studies.scoreboard.board import BOARD
from studies.scoreboard.report import Entry
from studies.scoreboard.statistics import difference, means
from studies.study import document
from studies.style import letter, subplots

LOADS_FILE: Final = "loads.json"
FLOCKS: Final = 200
TASKS: Final = tuple(name for name, task in tasks.items() if task.per_agent and len(task.scales) == 1)
"""Tasks in which agents set their own ranges, scored in the scenario of the training."""


class Load(msgspec.Struct, frozen=True):
    """The mean objective, the agents heard per agent and step, and paired gains of a learner and a rule.

    ``over_rule`` is the learner's gain at equal load minus that of the rule. ``curve`` has the mean load and
    objective under every fixed range.
    """

    learner: str
    rule: str
    objective: dict[str, float]
    heard: dict[str, float]
    over_fixed: Estimate
    at_equal_load: dict[str, Estimate]
    over_rule: Estimate
    curve: dict[str, list[float]]


def play(policies: tuple[str | bytes, ...], task: str, flocks: range) -> Arrays:
    """Return ``objective`` and ``heard``, shape (policies, flocks), under policies or fixed ranges."""
    scenario, runs = tasks[task].scenario, []
    for policy in map(policy_of, policies):
        is_fixed = policy.name.startswith("fixed:")  # also above the task's largest range
        entry = setup(policy, scenario) if is_fixed else replace(tasks[task].setup(policy), scenario=scenario)
        runs.append(rollout.play(entry, flocks))
    columns = {"objective": tasks[task].spec.name, "heard": "mean_heard"}
    return {name: np.array([run[column] for run in runs]) for name, column in columns.items()}


def at_equal_load(played: Arrays, fixed: Arrays) -> FloatArray:
    """Return the objective minus that of fixed ranges with equal mean load, interpolated flock by flock."""
    loads, load = fixed["heard"].mean(axis=1), played["heard"].mean(axis=1)
    above = loads.searchsorted(load).clip(1, len(loads) - 1)
    share = ((load - loads[above - 1]) / (loads[above] - loads[above - 1]))[:, np.newaxis]
    low, high = fixed["objective"][above - 1], fixed["objective"][above]
    gain: FloatArray = played["objective"] - (1 - share) * low - share * high
    return gain


def measure(pairs: Iterable[tuple[Entry, Entry]], scale: float, runner: Runner, output: Path) -> None:
    """Play learners and rules (every training seed) and fixed ranges on the same flocks."""
    flocks, jobs, written = share_of(HELD_OUT, FLOCKS, scale), {}, {}
    entries = {learner.result.task: (learner, rule) for learner, rule in pairs}
    for name, (learned, chosen) in entries.items():
        policies: dict[str, list[str | bytes]] = {
            "fixed": [f"fixed:{one:g}" for one in tasks[name].scenario.search_ranges],
            "rule": _policies_of(chosen),
            "learner": _policies_of(learned),
        }
        for kind, every in policies.items():
            jobs[name, kind] = split(
                play, tuple(every), name, flocks=flocks, size=50, seconds=len(every) / 200
            )
    found = runner.run(jobs, "Loads")
    for name, (learned, chosen) in entries.items():
        fixed, rule, learner = (found[name, kind] for kind in ("fixed", "rule", "learner"))
        place = tasks[name].scenario.search_ranges.index(tasks[name].best_fixed_range)
        best = {column: values[[place]] for column, values in fixed.items()}
        kinds = {"fixed": best, "rule": rule, "learner": learner}
        gains = {"rule": at_equal_load(rule, fixed), "learner": at_equal_load(learner, fixed)}
        written[name] = Load(
            learner=learned.result.learner,
            rule=chosen.result.learner,
            objective={kind: float(one["objective"].mean()) for kind, one in kinds.items()},
            heard={kind: float(one["heard"].mean()) for kind, one in kinds.items()},
            over_fixed=difference(learner["objective"], best["objective"]),
            at_equal_load={kind: means(gain[np.newaxis])[0] for kind, gain in gains.items()},
            over_rule=difference(gains["learner"], gains["rule"]),
            curve={column: values.mean(axis=1).tolist() for column, values in fixed.items()},
        )
    write_text(output / LOADS_FILE, document(written))


def _policies_of(entry: Entry) -> list[str | bytes]:
    """Return the contents of the policy files of an entry, or the name of its rule."""
    policies = [one.policy for one in entry.result.policies]
    return [(BOARD / entry.entrant.name / one).read_bytes() if is_file(one) else one for one in policies]


def loads(output: Path) -> dict[str, Load]:
    """Read the loads by task, those first in which the learner gains least against the rule."""
    found = msgspec.json.decode((output / LOADS_FILE).read_bytes(), type=dict[str, Load])
    return dict(sorted(found.items(), key=lambda item: item[1].over_rule.mean))


def figure(found: dict[str, Load]) -> Figure:
    """Draw the objective against the agents heard: fixed ranges as a curve, learner and rule as points."""
    figure, grid = subplots(7.2, 3, 3, sharex=True)
    colors = {"fixed": LIGHT.fixed, "rule": LIGHT.others[0], "learner": LIGHT.learned}
    for place, (axes, (name, load)) in enumerate(zip(grid.flat, found.items(), strict=False)):
        axes.plot(load.curve["heard"], load.curve["objective"], color=LIGHT.fixed, label="one fixed range")
        for kind, marker in {"fixed": "o", "rule": "s", "learner": "D"}.items():
            title = "best fixed range" if kind == "fixed" else kind
            at = load.heard[kind], load.objective[kind]
            axes.plot(*at, marker, color=colors[kind], ms=6, label=title)
        axes.set_xscale("symlog", linthresh=1, linscale=0.5)
        axes.set_xticks([0, 1, 10, 100], ["0", "1", "10", "100"])
        axes.set_xlim(-0.2, 400)
        axes.margins(y=0.15)
        axes.set_ylabel(tasks[name].spec.with_unit(tasks[name].spec.symbol))
        letter(axes, place, name)
    for axes in grid[-1]:
        axes.set_xlabel("agents heard per agent and step")
    figure.legend(*grid.flat[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
    return figure
