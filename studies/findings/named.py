"""Numbers of the prose on the page of results, by the names of settings, policies and files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from flockesc_env import FlockScenario
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.tasks.statistics import difference
from studies.findings.best_ranges import best_ranges
from studies.findings.dispersal import DISPERSAL_FILE, dispersal_figures
from studies.findings.fear import FEAR_FILE, FEAR_FLOCKS, fear_figures
from studies.findings.information import CANDIDATES, INFORMATION_FILE, SENSING
from studies.findings.listening import LISTENING_FILE
from studies.findings.names import FREE_HEADINGS
from studies.findings.one_agent import AGENT_FILE
from studies.findings.summary import Summary
from studies.tables import values_by

_VISIBLE = "per-agent-visible"

_AHEAD = 30.0
"""Angle in degrees between heading and escape direction below which the page says that an agent escapes."""


def numbers(summaries: Sequence[Summary], results: Path) -> dict[str, Any]:
    """Return the numbers of the page's prose by name; ``None`` where nothing was measured."""
    read: dict[str, tuple[Callable[[Path], Any], str]] = {
        "candidate_gains": (candidate_gains, INFORMATION_FILE),
        "arrivals": (arrivals, AGENT_FILE),
        "silence": (silence, f"{_VISIBLE}/{LISTENING_FILE}"),
        "dispersal": (dispersal_figures, DISPERSAL_FILE),
        "fear": (fear_figures, FEAR_FILE),
    }
    files = {name: (take, results / file) for name, (take, file) in read.items()}
    shared = [summary.study for summary in summaries if summary.study.setting == "shared"]
    return {
        **{name: take(file) if file.is_file() else None for name, (take, file) in files.items()},
        "named": Named(summaries),
        "largest_turn": largest_turn,
        "free_headings": FREE_HEADINGS,
        "fear_flocks": FEAR_FLOCKS,
        "best_ranges": best_ranges(results.parent, shared[0]) if shared else None,
    }


class Named:
    """Numbers of policies, each by its setting and its name."""

    def __init__(self, summaries: Sequence[Summary]) -> None:
        self._by_name = {summary.study.setting: summary for summary in summaries}

    def has(self, *settings: str) -> bool:
        """Return whether all of these settings were run."""
        return set(settings) <= self._by_name.keys()

    def objective(self, setting: str, policy: str) -> str:
        """Return the mean objective of a policy with its unit."""
        summary = self._by_name[setting]
        return f"{self._flocks(setting, policy).mean():.1f}{summary.study.unit}"

    def gain(
        self, setting: str, policy: str, over: str, in_setting: str | None = None, sign: str = "+"
    ) -> str:
        """Return the paired difference of two policies in m, with its interval over flocks and seeds."""
        other = self._values(in_setting or setting, over)
        return f"{difference(self._values(setting, policy), other):{sign}.2f} m"

    def best_learner(self, setting: str) -> str:
        """Return the name of the learner that was best on tuning flocks."""
        return self._by_name[setting].study.best_learner

    def bound(self, setting: str) -> Bound:
        """Return the bound that holds for any choice of headings."""
        return Bound(self._flocks(setting, FREE_HEADINGS))

    def _flocks(self, setting: str, policy: str) -> FloatArray:
        """Return the objective of a policy or reference, mean over training seeds, shape (flocks,)."""
        values: FloatArray = self._values(setting, policy).mean(axis=0)
        return values

    def _values(self, setting: str, policy: str) -> FloatArray:
        """Return the objective of a policy or reference, shape (training seeds, flocks)."""
        study = self._by_name[setting].study
        if policy in study.reference_names:
            return study.reference(policy)[0][np.newaxis]
        return study.values(policy)


class Bound:
    """A bound for each flock: mean and highest in m, and the share of flocks above the mean."""

    def __init__(self, flocks: FloatArray) -> None:
        self.mean, self.highest = float(flocks.mean()), float(flocks.max())
        self.above = float((flocks > self.mean).mean())


def largest_turn(neighbors: int, scenario: FlockScenario | None = None) -> float:
    """Return the angle in degrees by which the consensus force can turn an agent in one step, at most.

    With the force a v0 u along a unit vector u, steps 3 and 4 of the model turn the heading h to that of
    h + k u, where k = a dt / m. For k < 1 the angle is at most arcsin(k), reached if u is 90 degrees +
    arcsin(k) off h. An agent also hears itself: with one neighbor u is less than 90 degrees off h, and the
    angle is less than arctan(k). With two neighbors every u is possible.
    """
    model = FlockScenario() if scenario is None else scenario
    assert isinstance(model.mass, float)  # noqa: S101, see above
    assert isinstance(model.alignment_strength, float)  # noqa: S101, see above
    k = model.alignment_strength * model.time_step / model.mass
    if neighbors == 1:
        return float(np.degrees(np.arctan(k)))
    return float(np.degrees(np.arcsin(k))) if k < 1 else 180.0


def candidate_gains(file: Path, counts: Sequence[int] = (4, max(CANDIDATES))) -> dict[str, list[Estimate]]:
    """Return the paired gains of numbers of candidate ranges over the best fixed range, by sensing range."""
    values = values_by(pl.read_parquet(file), "sensing", "candidates")
    return {name: [mean(values[name, count] - values[name, 0]) for count in counts] for name in SENSING}


def arrivals(file: Path) -> dict[str, float]:
    """Return the time in s after which the agent of the figure first heads its way, by policy."""
    with np.load(file, allow_pickle=False) as source:
        return {
            name: float(source[f"{name}_times"][(source[f"{name}_own"] < _AHEAD).argmax()])
            for name in ("blind", "informed")
        }


def silence(file: Path) -> tuple[float, float]:
    """Return what a file of ``measure_listening`` says about who listens, of agents that see the predator.

    Returns:
        Mean range in m of agents that head more than 120 degrees off the direction away from the predator,
        over the cells of the figure; share of all actions by which agents listen to nobody.
    """
    with np.load(file, allow_pickle=False) as source:
        toward = source["range_by_place"][source["cosines"][1:] <= -0.5 + 1e-9]
        return float(np.nanmean(toward)), float(source["silent"].mean())
