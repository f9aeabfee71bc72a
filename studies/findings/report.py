"""The study of learned ranges: its measurements, its figures and its report."""

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, tasks
from flockesc_env.common.stats import CONFIDENCE, Estimate, FloatArray
from flockesc_env.episodes import splits
from flockesc_env.taskset import Task
from studies.findings import controls, headlines, listening, loads, losses, styles
from studies.findings.headlines import Headline
from studies.measurements import Runner, sign
from studies.scoreboard.board import ANY_RATE, load_board
from studies.scoreboard.report import Entry, entries_of
from studies.scoreboard.statistics import difference
from studies.study import Study, template

FIGURES: Final = "figures"
OUTCOMES: Final = ("loss", "tie", "win")

BY_HAND, CHOSEN, NETWORK = "rule, numbers by hand", "rule, chosen numbers", "network"
REINFORCEMENT: Final = "reinforcement learning"
KINDS: Final = (BY_HAND, CHOSEN, NETWORK, REINFORCEMENT)


@dataclass(frozen=True)
class Row:
    """A task: its best entry of each kind, and the paired difference of what was learned to the best rule."""

    task: Task
    best: dict[str, Entry]

    @property
    def learned(self) -> Entry:
        """The better one of network and reinforcement learning."""
        return self._best_of(NETWORK, REINFORCEMENT)

    @property
    def rule(self) -> Entry:
        """The better one of the rules with numbers that a person or a search chose."""
        return self._best_of(BY_HAND, CHOSEN)

    @property
    def gain(self) -> Estimate:
        """The paired difference of the learned policies to the best rule."""
        return difference(values(self.learned), values(self.rule))

    def _best_of(self, *kinds: str) -> Entry:
        return max((self.best[kind] for kind in kinds if kind in self.best), key=lambda one: one.score.mean)


def values(entry: Entry) -> FloatArray:
    """Return the objective, shape (training seeds, flocks), the mean over the scenarios of the task."""
    names = tasks[entry.result.task].scales
    mean: FloatArray = np.mean([entry.result.values(name) for name in names], axis=0)
    return mean


def kind_of(entry: Entry) -> str:
    """Return the kind of an entry of the scoreboard, one of ``KINDS``."""
    if not entry.is_learned:
        return BY_HAND if entry.result.training is None else CHOSEN
    return REINFORCEMENT if entry.entrant.card.kind == REINFORCEMENT else NETWORK


def rows_of(entries: dict[str, list[Entry]]) -> list[Row]:
    """Return a row per task, the largest loss of what was learned first."""
    found = []
    for name, ranked in entries.items():
        best: dict[str, Entry] = {}
        for entry in ranked:
            best.setdefault(kind_of(entry), entry)
        found.append(Row(tasks[name], best))
    # Differences of scores compare tasks.
    return sorted(found, key=lambda row: row.learned.score.mean - row.rule.score.mean)


def tasks_table(rows: Sequence[Row]) -> str:
    """Return the README's table of tasks as Markdown, losses first."""
    lines = [
        "| task | range per | best fixed | best rule | episodes | learned | episodes "
        "| learned minus rule, 95 % interval |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        zero = np.mean([scale.zero for scale in row.task.scales.values()])
        digits = row.task.spec.digits
        cells = [row.task.name, row.task.actor, f"{zero:.{digits}f}"]
        for entry in (row.rule, row.learned):
            cells += [f"{values(entry).mean():.{digits}f}", episodes_of(entry)]
        lines.append(f"| {' | '.join(cells)} | {row.gain:+.{digits}f} |")
    return "\n".join(lines)


def episodes_of(entry: Entry) -> str:
    """Return the number of episodes of a training run if it counted them, those on tuning flocks included."""
    training = entry.result.training
    if training is None:
        return "by hand"
    count = training.episodes + training.evaluations
    return f"{count:,}" if count else "-"


def outcome(gain: Estimate) -> str:
    """Return "loss", "win", or "tie" if the interval includes 0."""
    return OUTCOMES[1 + sign(gain)]


@dataclass(frozen=True)
class Findings:
    """The results in a folder, with the scoreboard."""

    output: Path
    headlines: Sequence[Headline]
    entries: dict[str, list[Entry]]

    @classmethod
    def load(cls, output: Path) -> Self:
        """Read the results."""
        return cls(output, headlines.load(output), entries_of(load_board()))

    def gain(self, task: str, learner: str, over: str) -> str:
        """Return the paired difference in m of two entries of the scoreboard."""
        found = {entry.result.learner: values(entry) for entry in self.entries[task]}
        return f"{difference(found[learner], found[over]):+.2f} m"


def measure(runner: Runner, output: Path, scale: float) -> None:
    """Measure everything; ``scale`` is the share of the flocks that play."""
    chosen = headlines.measure(headlines.EXPLAINED, scale, runner, output)
    controls.measure_exchanged(chosen, scale, runner, output)
    listening.measure(chosen, scale, runner, output)
    controls.measure_blocked(chosen, scale, runner, output)
    losses.measure(chosen, scale, runner, output)
    styles.measure(scale, runner, output)
    rows = rows_of(entries_of(load_board()))
    pairs = [(row.learned, row.rule) for row in rows if row.task.name in loads.TASKS]
    loads.measure(pairs, scale, runner, output)


def figures(results: Findings) -> dict[str, Figure]:
    """Draw the figures of the measurements that have a file."""
    drawn = {
        name: listening.ranges_figure(results.output / f"{name}.npz", by_place=name == "per-agent-visible")
        for name in listening.WATCHED
    }
    drawn["loads"] = loads.figure(loads.loads(results.output))
    drawn["one_agent"] = listening.one_agent_figure(results.output / listening.ONE_AGENT)
    return {f"{FIGURES}/{name}": figure for name, figure in drawn.items()}


def report(results: Findings) -> str:
    """Return the report as Markdown."""
    starts = losses.gains(results.output / losses.STARTS_FILE)
    transfer = losses.gains(results.output / losses.TRANSFER_FILE)
    every, by_task = {**starts, **transfer}, {one.task.name: one for one in results.headlines}
    lost = [key for key, gain in every.items() if outcome(gain.over_fixed) == "loss"]
    lost.sort(key=lambda key: (every[key].over_fixed.mean, key))
    rows, loaded = rows_of(results.entries), loads.loads(results.output)
    return template("findings/templates/findings.md", globals()).render(
        rows=rows,
        outcomes={kind: [row.task.name for row in rows if outcome(row.gain) == kind] for kind in OUTCOMES},
        results=results,
        confidence=CONFIDENCE,
        splits=splits,
        by_task=by_task,
        starts=starts,
        every=every,
        lost=lost,
        longer=sum(every[task, name].best_fixed_range > by_task[task].max_range for task, name in lost),
        counts=_counts(transfer),
        random_polarization=math.sqrt(math.pi / (4 * FlockScenario().num_agents)),
        any_rate=json.loads(ANY_RATE.read_text("utf-8"))["per-agent-visible-derived"],
        loaded=loaded,
        loaded_outcomes={
            k: [name for name, row in loaded.items() if outcome(row.over_rule) == k] for k in OUTCOMES
        },
    )


def _counts(found: Mapping[tuple[str, str], losses.Gain]) -> list[dict[str, Any]]:
    """Return the numbers of losses, ties and wins by task, most losses first, and where it cannot run."""
    scenarios = dict.fromkeys(scenario for _, scenario in found)
    rows = []
    for task in dict.fromkeys(task for task, _ in found):
        own = {scenario: found[task, scenario] for scenario in scenarios if (task, scenario) in found}
        outcomes = Counter(outcome(gain.over_fixed) for gain in own.values())
        missing = ", ".join(scenario for scenario in scenarios if scenario not in own)
        rows.append({"task": task, "missing": missing, **{kind: outcomes[kind] for kind in OUTCOMES}})
    return sorted(rows, key=lambda row: -row["loss"])


FINDINGS: Final = Study(measure=measure, load=Findings.load, figures=figures, report=report)
