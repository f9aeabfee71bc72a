"""The study of learned ranges: its measurements, its figures and its page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario
from flockesc_env.common.stats import CONFIDENCE, Estimate, FloatArray
from flockesc_env.episodes.splits import FLOCKS_PER_RUN, HELD_OUT, TRAINING, TUNING
from flockesc_env.tasks import Task, tasks
from flockesc_env.tasks.statistics import difference
from studies.findings import ablation, fear, headlines, listening, losses, one_agent, video
from studies.findings.headlines import Headline
from studies.measurements import Runner
from studies.pages import path_from, render
from studies.scoreboard.board import load_board
from studies.scoreboard.page import Entry, entries_of
from studies.study import Study

FIGURES: Final = "figures"
LARGEST: Final = 10
"""Losses in the table of the largest."""

RULE, SEARCHED, NETWORK, REINFORCEMENT = KINDS = (
    "untrained rule",
    "searched rule",
    "network",
    "reinforcement learning",
)


@dataclass(frozen=True)
class Row:
    """A task: its best entry of each kind, and the paired difference of what was learned to the rule."""

    task: Task
    best: dict[str, Entry]

    @property
    def learned(self) -> Entry:
        """The better one of network and reinforcement learning."""
        found = [self.best[kind] for kind in (NETWORK, REINFORCEMENT) if kind in self.best]
        return max(found, key=lambda entry: entry.row.score.mean)

    @property
    def gain(self) -> Estimate:
        """The paired difference of the learned policies to the untrained rule."""
        return difference(values(self.learned), values(self.best[RULE]))

    @property
    def score_gain(self) -> float:
        """The same as a difference of scores, which compares tasks."""
        return self.learned.row.score.mean - self.best[RULE].row.score.mean

    @property
    def fixed(self) -> str:
        """The mean objective of the best fixed range."""
        return self.shown(float(np.mean([scale.zero for scale in self.task.scales.values()])))

    def shown(self, number: float | Estimate, sign: str = "") -> str:
        """Return a number, or an estimate with its interval, with the digits of the objective."""
        return f"{number:{sign}.{self.task.spec.digits}f}"

    def cell(self, kind: str) -> str:
        """Return the mean objective of the best entry of a kind."""
        if kind not in self.best:
            return "-"
        name = f" `{self.best[kind].result.learner}`" if kind == RULE else ""
        return f"{self.shown(float(values(self.best[kind]).mean()))}{name}"


def values(entry: Entry) -> FloatArray:
    """Return the objective, shape (training seeds, flocks), the mean over the scenarios of the task."""
    names = tasks[entry.result.task].scales
    mean: FloatArray = np.mean([entry.result.values(name) for name in names], axis=0)
    return mean


def kind_of(entry: Entry) -> str:
    """Return the kind of an entry of the scoreboard, one of ``KINDS``."""
    if entry.result.training is None:
        return RULE
    if not entry.is_learned:
        return SEARCHED
    return REINFORCEMENT if entry.entrant.card.kind == REINFORCEMENT else NETWORK


def rows_of(entries: dict[str, list[Entry]]) -> list[Row]:
    """Return a row per task, the largest loss of what was learned first."""
    found = []
    for name, ranked in entries.items():
        best: dict[str, Entry] = {}
        for entry in ranked:
            best.setdefault(kind_of(entry), entry)
        found.append(Row(tasks[name], best))
    return sorted(found, key=lambda row: row.score_gain)


def outcome(gain: Estimate) -> str:
    """Return "loss", "win", or "tie" if the interval includes 0."""
    return "loss" if gain.high < 0 else "win" if gain.low > 0 else "tie"


def plus_minus(gain: Estimate) -> str:
    """Return a gain with half the width of its interval."""
    return f"{round(gain.mean, 1) + 0.0:+.1f} ± {(gain.high - gain.low) / 2:.1f}"


@dataclass(frozen=True)
class Findings:
    """The results in a folder, with the scoreboard."""

    output: Path
    headlines: Sequence[Headline]
    entries: dict[str, list[Entry]]

    @classmethod
    def load(cls, output: Path) -> Findings:
        """Read the results."""
        return cls(output, headlines.load(output), entries_of(load_board()))

    def gain(self, task: str, learner: str, over: str) -> str:
        """Return the paired difference in m of two entries of the scoreboard."""
        found = {entry.result.learner: values(entry) for entry in self.entries[task]}
        return f"{difference(found[learner], found[over]):+.2f} m"


def measure(scale: float, runner: Runner, output: Path) -> None:
    """Measure everything; ``scale`` is the share of the flocks that play."""
    chosen = headlines.measure(headlines.EXPLAINED, scale, runner, output)
    ablation.measure(chosen, scale, runner, output)
    listening.measure(chosen, scale, runner, output)
    one_agent.measure(chosen, runner, output)
    fear.measure(chosen, scale, runner, output)
    losses.measure(chosen, scale, runner, output)
    video.write(chosen, output)


def figures(results: Findings) -> dict[str, Figure]:
    """Draw the figures of the measurements that have a file."""
    drawn = {
        name: listening.figure(results.output / f"{name}.npz", by_place=name == "per-agent-visible")
        for name in listening.WATCHED
    }
    drawn["one_agent"] = one_agent.figure(results.output / one_agent.FILE)
    return {f"{FIGURES}/{name}": figure for name, figure in drawn.items()}


def markdown_page(results: Findings, output: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``."""
    rows = rows_of(results.entries)
    starts, transfer = (losses.gains(output / file) for file in (losses.STARTS_FILE, losses.TRANSFER_FILE))
    every = {**starts, **transfer}
    lost = sorted(
        (key for key in every if outcome(every[key][0]) == "loss"), key=lambda key: every[key][0].mean
    )
    longest = {one.task.name: float(one.entry.options["max_range"]) for one in results.headlines}
    return render(
        "findings/findings.md",
        rows=rows,
        kinds=KINDS,
        outcomes={
            kind: [row.task.name for row in rows if outcome(row.gain) == kind]
            for kind in ("loss", "tie", "win")
        },
        random=[row.task.name for row in rows if row.best[RULE].result.learner == "random"],
        tasks=tasks,
        results=results,
        pictures=path_from(page, output / FIGURES),
        starts=_pivot(starts),
        start_tasks=list(dict.fromkeys(task for task, _ in starts)),
        random_polarization=math.sqrt(math.pi / (4 * FlockScenario().num_agents)),
        every=every,
        lost=lost,
        largest=lost[:LARGEST],
        longest=longest,
        names={one.task.name: one.name for one in results.headlines},
        out_of_reach=sum(every[task, name][1] > longest[task] for task, name in lost),
        counts=_counts(transfer),
        unit_of=losses.unit_of,
        plus_minus=plus_minus,
        largest_turn=one_agent.largest_turn,
        arrivals=one_agent.arrivals(output / one_agent.FILE),
        silence=listening.silence(output / "per-agent-visible.npz"),
        fear=fear.estimates(output),
        ablation=ablation.changes(output),
        groups=list(ablation.GROUPS),
        flocks={
            "listening": listening.FLOCKS,
            "fear": fear.FLOCKS,
            "ablation": ablation.FLOCKS,
            "tuning": headlines.TUNING_FLOCKS,
        },
        film=video.FILE,
        confidence=CONFIDENCE,
        seeds={"tuning": TUNING, "held_out": HELD_OUT, "training": TRAINING},
        flocks_per_run=FLOCKS_PER_RUN,
    )


def _pivot(
    found: dict[tuple[str, str], tuple[Estimate, float]],
) -> dict[str, tuple[dict[str, Estimate], float]]:
    """Return the gains by task, and the best fixed range, of every scenario."""
    by_scenario: dict[str, tuple[dict[str, Estimate], float]] = {}
    for (task, name), (gain, best) in found.items():
        by_scenario.setdefault(name, ({}, best))[0][task] = gain
    return by_scenario


def _counts(found: dict[tuple[str, str], tuple[Estimate, float]]) -> dict[str, dict[str, Any]]:
    """Return the numbers of losses, ties and wins by task, most losses first, and where it cannot run."""
    every = dict.fromkeys(name for _, name in found)
    counts = {}
    for task in dict.fromkeys(task for task, _ in found):
        kinds = [outcome(gain) for (own, _), (gain, _) in found.items() if own == task]
        missing = [name for name in every if (task, name) not in found]
        counts[task] = {kind: kinds.count(kind) for kind in ("loss", "tie", "win")} | {"missing": missing}
    return dict(sorted(counts.items(), key=lambda item: -item[1]["loss"]))


FINDINGS: Final = Study(
    measure=measure,
    load=Findings.load,
    figures=figures,
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
)
