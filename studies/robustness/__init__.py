"""The best fixed range in attacked variations of the paper's flock: the list of these, and their grids."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from flockesc_env.cli.flags import scenario_named
from flockesc_env.common.errors import InputError
from flockesc_env.scenario import PRESETS, FlockScenario, Learned
from flockesc_env.scenario.presets import LITERATURE, OF_TASKS


@dataclass(frozen=True)
class Grid:
    """The actions that are tried, in rising order from 0, no alignment at all, and their unit."""

    unit: str
    actions: tuple[float, ...]

    def __str__(self) -> str:
        return f"{', '.join(f'{action:g}' for action in self.actions)} {self.unit}"


METERS: Final = Grid("m", (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 30.0, 50.0, 100.0))
NEIGHBORS: Final = Grid("neighbors", (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 15.0, 30.0, 300.0))


def grid_of(scenario: FlockScenario) -> Grid:
    """Return the grid of a scenario: under the topological rule an action is a number of neighbors."""
    return NEIGHBORS if scenario.neighbor_rule.kind == "topological" else METERS


def attacked_presets(names: Iterable[str] | None = None) -> dict[str, FlockScenario]:
    """Return scenarios of presets or files by name; ``None``: every attacked variation of the paper's."""
    # No variations: presets of tasks (size, start) and of the literature (many fields).
    known = {
        name: entry.scenario
        for name, entry in PRESETS.items()
        if name not in LITERATURE | OF_TASKS and _is_attacked(entry.scenario)
    }
    chosen: dict[str, Any] = known if names is None else {}
    for name in names or ():
        chosen[name] = scenario_named(name) if Path(name).suffix else known.get(name)
        if not _is_attacked(chosen[name]):
            raise InputError("presets", f"any of {', '.join(known)}, or files of such flocks", repr(name))
    if not chosen:
        raise InputError("presets", f"any of {', '.join(known)}", "none")
    return chosen


def _is_attacked(scenario: object) -> bool:
    kinds = [type(each) for each in scenario.predators] if isinstance(scenario, FlockScenario) else []
    return bool(kinds) and Learned not in kinds
