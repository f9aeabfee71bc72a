"""The best fixed range of every preset: the rule of the findings, the results, their figure and page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env.cli.output import note
from flockesc_env.common.stats import Estimate, FloatArray, argmax, mean
from flockesc_env.jobs import Arrays
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.models import records
from flockesc_env.scenario import PRESETS, ConstantVelocity, FlockScenario
from studies.measurements import Runner, means
from studies.paper.plan import PAPER_OBJECTIVES
from studies.robustness import Grid, attacked_presets, grid_of
from studies.study import Results, Study, template
from studies.style import ROW, caption, draw_forest, subplots

TIME_STEPS: Final = (0.1, 0.05, 0.025, 0.0125)  # s
DURATION: Final = 12.0  # s, of the paper's flock
ENDS: Final = (0.0, 100.0)  # m; the ranges that 10 m is compared with
OBJECTIVES = {spec.symbol: spec.name for spec in PAPER_OBJECTIVES}  # symbol and column of every objective


def _misses_the_center(scenario: FlockScenario) -> bool:
    """Whether a predator flies straight past the center, by a quarter of the region's side or more."""
    for predator in scenario.predators:
        if isinstance(predator, ConstantVelocity):
            to_center = scenario.initial_side / 2 - np.array(predator.position)[:2]
            velocity = np.array(predator.velocity)[:2]
            across = abs(np.linalg.det([velocity, to_center]))  # distance times speed
            if across > 0 and across >= scenario.initial_side / 4 * np.linalg.norm(velocity):
                return True
    return False


_BLIND = ("constant_velocity", "wandering", "prescribed_path")
_LAWS = ("motion", "angular_noise", "sensing_noise", "sensing_delay", "alignment_strength")
QUESTIONS: Final[dict[str, Callable[[FlockScenario], bool]]] = {
    "the paper's own scenario": lambda flock: flock == FlockScenario(),
    "an attack on the edge": _misses_the_center,
    "predators that catch agents": lambda flock: flock.capture_radius is not None,
    "predators that cooperate": lambda flock: any(
        each.kind in {"encircle", "herd"} or getattr(each, "target", None) == "assigned"
        for each in flock.predators
    ),
    "several predators on their own": lambda flock: len(flock.predators) > 1,
    "a predator that steers": lambda flock: any(each.kind not in _BLIND for each in flock.predators),
    "other neighbor rules": lambda flock: (
        flock.neighbor_rule.kind != "metric" or flock.blind_angle > 0 or flock.mutual
    ),
    "other laws of motion, noise, delay, unlike agents": lambda flock: any(
        getattr(flock, field) != getattr(FlockScenario(), field) for field in _LAWS
    ),
    "controls: a frozen graph, no flight": lambda flock: flock.frozen_graph or flock.repulsion_strength == 0,
    "parameters drawn for every episode": lambda flock: bool(flock.randomization),
    "other flocks and predators": lambda _: True,
}
"""Questions about the paper's finding; a preset answers the first one that is true of its scenario."""


class Finding(StrEnum):
    """Whether the best fixed range is interior, or over which ends of the grid it has no gain."""

    INTERIOR = "interior"
    LIKE_ZERO = "no gain over 0"
    LIKE_LONGEST = "no gain over the longest"
    LIKE_BOTH = "no gain over either end"


class Gains:
    """What the best action of a grid gains over both ends, paired flock by flock."""

    gain_over_zero: Estimate
    gain_over_longest: Estimate

    @property
    def finding(self) -> Finding:
        """The finding by the rule on the page: a gain counts if its interval lies above 0."""
        if self.gain_over_zero.low > 0:
            return Finding.INTERIOR if self.gain_over_longest.low > 0 else Finding.LIKE_LONGEST
        return Finding.LIKE_ZERO if self.gain_over_longest.low > 0 else Finding.LIKE_BOTH


@dataclass(frozen=True)
class Choice(Gains):
    """The best action of a grid, chosen on the first half of the flocks and measured on the second.

    ``value`` is the objective under it.
    """

    best: Estimate
    index: int
    value: Estimate
    gain_over_zero: Estimate
    gain_over_longest: Estimate


def choose(actions: tuple[float, ...], values: FloatArray) -> Choice:
    """Choose the best action of a grid; ``values`` holds the objective, shape (actions, flocks)."""
    half = values.shape[1] // 2
    measured = values[:, half:]
    best = argmax(np.array(actions), values[:, :half])
    at = actions.index(best.mean)
    over_zero, over_longest = (mean(measured[at] - measured[end]) for end in (0, -1))
    return Choice(best, at, mean(measured[at]), over_zero, over_longest)


@dataclass(frozen=True)
class Outcome(Gains):
    """The best fixed range for one objective; lengths in m, ranges in the grid's unit.

    ``best`` is chosen on the first half of the flocks. Everything else is measured on the second half: both
    objectives at that range, the objective at both ends of the grid and the gains over them, and the
    objective at every range.
    """

    best: Estimate
    min_mean_distance: Estimate
    min_min_distance: Estimate
    at_zero: Estimate
    at_longest: Estimate
    gain_over_zero: Estimate
    gain_over_longest: Estimate
    curve: tuple[Estimate, ...]


def outcome(symbol: str, actions: tuple[float, ...], results: Arrays) -> Outcome:
    """Return the outcome for an objective; results have the shape (actions, flocks), flocks in two halves."""
    values = results[OBJECTIVES[symbol]]
    half = values.shape[1] // 2
    choice, curve = choose(actions, values), means(values[:, half:])
    return Outcome(
        best=choice.best,
        **{name: mean(results[name][choice.index, half:]) for name in OBJECTIVES.values()},
        at_zero=curve[0],
        at_longest=curve[-1],
        gain_over_zero=choice.gain_over_zero,
        gain_over_longest=choice.gain_over_longest,
        curve=curve,
    )


@dataclass(frozen=True)
class PresetResult:
    """One row: a preset, the question that it answers, its grid, and outcomes by the objectives' symbols."""

    name: str
    description: str
    question: str
    grid: Grid
    outcomes: dict[str, Outcome]


@dataclass(frozen=True)
class RobustnessResults(Results):
    """Results of the survey; ``num_flocks`` choose the ranges, and as many others measure them.

    ``time_steps`` are gains in J_mean of 10 m over ``ENDS`` in the paper's flock, all flocks, by time step.
    """

    command: str
    num_flocks: int
    presets: tuple[PresetResult, ...]
    time_steps: dict[str, tuple[Estimate, ...]]
    versions: dict[str, str]

    def by_question(self) -> dict[str, list[PresetResult]]:
        """Return the presets by the questions that they answer."""
        rows = {question: [row for row in self.presets if row.question == question] for question in QUESTIONS}
        return {question: presets for question, presets in rows.items() if presets}


def measure(runner: Runner, _: Path, num_flocks: int, names: Sequence[str] | None) -> RobustnessResults:
    """Run presets under every action on ``2 num_flocks`` seeds from 0 on.

    ``names`` are those of presets or scenario files; None: all presets that are attacked.
    """
    scenarios, seeds = attacked_presets(names), range(2 * num_flocks)
    jobs = {
        name: seed_jobs(OUTCOMES, scenario, grid_of(scenario).actions, seeds)
        for name, scenario in scenarios.items()
    }
    shortened = {
        f"{step:g}": FlockScenario(time_step=step, num_steps=round(DURATION / step)) for step in TIME_STEPS
    }
    for step, flock in shortened.items():
        jobs[step] = seed_jobs(OUTCOMES, flock, (10.0, *ENDS), seeds)
    measured = runner.run(jobs, "Measuring")
    note("measured; statistics take some seconds per preset")
    presets = []
    for name, scenario in scenarios.items():
        grid = grid_of(scenario)
        description = PRESETS[name].description if name in PRESETS else "a scenario file"
        question = next(question for question, is_so in QUESTIONS.items() if is_so(scenario))
        outcomes = {symbol: outcome(symbol, grid.actions, measured[name]) for symbol in OBJECTIVES}
        presets.append(PresetResult(name, description, question, grid, outcomes))
    chosen = "" if names is None else f" --presets {' '.join(names)}"
    command = f"python -m studies robustness --num-flocks {num_flocks}{chosen}"
    curves = {step: measured[step]["min_mean_distance"] for step in shortened}
    gains = {step: means(curve[:1] - curve[1:]) for step, curve in curves.items()}
    return RobustnessResults(command, num_flocks, tuple(presets), gains, records.versions("scipy"))


def figure(results: RobustnessResults) -> Figure:
    """Draw both gains in ``J_mean`` of every preset, side by side; presets are grouped by question."""
    groups = results.by_question()
    num_rows = len(groups) + len(results.presets)
    figure, (left, right) = subplots(ROW * (num_rows + 4), 1, 2)
    for axes, field, end in ((left, "zero", "range 0"), (right, "longest", "the longest range")):
        rows: dict[str, dict[str, Estimate]] = {question: {} for question in groups}
        for row in results.presets:
            found = row.outcomes["J_mean"]
            name = f"{row.name} ({found.best.mean:g} {row.grid.unit})"
            rows[row.question][name] = getattr(found, f"gain_over_{field}")
        draw_forest(axes, rows)
        axes.set_xlabel(f"gain over {end} (m)")
    right.set_yticklabels([])
    text = f"J_mean of the best fixed range, {results.num_flocks:,} flocks, 95 % intervals"
    caption(figure, f"{text} (filled: the interval excludes 0)")
    return figure


def report(results: RobustnessResults) -> str:
    """Return the report as Markdown."""
    grids = sorted({str(row.grid) for row in results.presets})
    return template("robustness/templates/robustness.md").render(results=results, grids=grids)


ROBUSTNESS = Study(
    measure=measure,
    load=RobustnessResults.load,
    figures=lambda results: {"robustness": figure(results)},
    report=report,
)
