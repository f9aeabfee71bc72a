"""The measurements: every attacked variation of the paper's flock, on its grid of actions, in two halves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeGuard

from flockesc_env.cli.flags import scenario_named
from flockesc_env.common.errors import ArgumentError
from flockesc_env.jobs.sweeps import OUTCOMES
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.predators import Learned
from flockesc_env.scenario.presets import LITERATURE, PRESETS
from studies.measurements import Measurement

LEAST_FLOCKS: Final = 2
"""Flocks in each half, without which there is no interval."""


@dataclass(frozen=True)
class Grid:
    """The actions that are tried, in rising order from 0, no alignment at all, and their unit."""

    unit: str
    actions: tuple[float, ...]

    def __str__(self) -> str:
        return f"{', '.join(f'{action:g}' for action in self.actions)} {self.unit}"


METERS: Final = Grid("m", (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 30.0, 50.0, 100.0))
NEIGHBORS: Final = Grid("neighbors", (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 15.0, 30.0, 300.0))

GRIDS: Final[Mapping[str, Grid]] = {"topological": NEIGHBORS}
"""By the kind of the neighbor rule; an action of any other rule is a range in m."""


def grid_of(scenario: FlockScenario) -> Grid:
    """Return the grid of a scenario's neighbor rule."""
    return GRIDS.get(scenario.neighbor_rule.kind, METERS)


def attacked_presets(names: Iterable[str] | None = None) -> dict[str, FlockScenario]:
    """Return scenarios of presets or files by name; ``None``: every attacked variation of the paper's."""
    variations = {name: entry.scenario for name, entry in PRESETS.items() if name not in LITERATURE}
    known = {name: scenario for name, scenario in variations.items() if _is_attacked(scenario)}
    chosen = known if names is None else {}
    for name in names or ():
        scenario = scenario_named(name) if Path(name).suffix else known.get(name)
        if not _is_attacked(scenario):
            raise ArgumentError("presets", f"any of {', '.join(known)}, or files of such flocks", repr(name))
        chosen[name] = scenario
    if not chosen:
        raise ArgumentError("presets", f"any of {', '.join(known)}", "none")
    return chosen


def _is_attacked(scenario: object) -> TypeGuard[FlockScenario]:
    kinds = [type(each) for each in scenario.predators] if isinstance(scenario, FlockScenario) else []
    return bool(kinds) and Learned not in kinds


def measurements(scenarios: Mapping[str, FlockScenario], num_flocks: int) -> dict[str, Measurement]:
    """Return the measurements: seeds 0 to ``2 num_flocks - 1`` of every preset under every action."""
    return {
        name: Measurement(OUTCOMES, scenario, grid_of(scenario).actions, 2 * num_flocks)
        for name, scenario in scenarios.items()
    }
