"""Scenarios of environments with many flocks: one for all flocks, or one per flock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from flockesc_env.common.errors import InputError
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

Scenarios = FlockScenario | str | Sequence[FlockScenario | str]
"""A scenario or a preset's name, for all flocks; or a list with one entry per flock."""

_ALIKE: Final[dict[str, Callable[[FlockScenario], Any]]] = {
    "initial_side": lambda scenario: scenario.initial_side,
    "neighbor_rule": lambda scenario: f"a rule whose ranges are in {scenario.neighbor_rule.unit}",
}
"""Fields that give observations and actions their meaning. The core compares those that determine shapes."""


def as_scenarios(given: Scenarios | None) -> FlockScenario | list[FlockScenario]:
    """Return the scenario of all flocks or, if a list was given, one scenario per flock."""
    if isinstance(given, str) or not isinstance(given, Sequence):
        return as_scenario(given, FlockScenario)
    if not given:
        raise InputError("scenario", "one scenario per flock", "an empty list")
    scenarios = []
    for flock, one in enumerate(given):
        try:
            scenarios.append(as_scenario(one, FlockScenario))
        except InputError as error:
            raise InputError(f"scenario[{flock}]", error.expected, error.given) from None
    return scenarios


def distinct_scenarios(
    given: FlockScenario | Sequence[FlockScenario], num_flocks: int
) -> tuple[list[FlockScenario], list[int]]:
    """Return the different scenarios in order, and the index of each flock's scenario."""
    if isinstance(given, FlockScenario):
        return [given], [0] * num_flocks
    if len(given) != num_flocks:
        raise InputError("scenario", f"a list of {num_flocks}, one scenario per flock", len(given))
    for flock, scenario in enumerate(given):
        for name, value_of in _ALIKE.items():
            expected, value = value_of(given[0]), value_of(scenario)
            if value != expected:
                raise InputError(f"scenario[{flock}].{name}", f"{expected}, as in scenario[0]", value)
    documents = [scenario.to_json() for scenario in given]
    distinct = dict(zip(documents, given, strict=True))
    indices = {document: index for index, document in enumerate(distinct)}
    return list(distinct.values()), [indices[document] for document in documents]
