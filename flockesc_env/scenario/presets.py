"""Presets: the named scenarios of presets.toml, and checks of arguments that take a scenario or a name."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

from flockesc_env.common.checks import as_choice
from flockesc_env.common.errors import InputError, shown
from flockesc_env.scenario.document import from_fields, parse_document
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Scenario = FlockScenario | LineScenario

MODELS: Final[Mapping[str, type[Scenario]]] = MappingProxyType({"flock": FlockScenario, "line": LineScenario})

_T = TypeVar("_T", bound=Scenario)


@dataclass(frozen=True)
class Preset:
    """A named scenario with a line that describes it. It is built at its first use: all of them take long."""

    description: str
    model: type[Scenario]
    differences: Mapping[str, Any]  # from the model's defaults

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario."""
        return from_fields(self.model, self.differences)


def _preset(*, description: str, model: str = "flock", **differences: Any) -> Preset:
    return Preset(description, MODELS[model], differences)


_GROUPS: Final = {
    group: {name: _preset(**table) for name, table in tables.items()}
    for group, tables in parse_document(
        Path(__file__).with_suffix(".toml").read_text("utf-8"), is_toml=True
    ).items()
}
LITERATURE: Final = _GROUPS["literature"]
"""Models of other authors, which differ from the paper's flock in several respects."""

OF_TASKS: Final = _GROUPS["tasks"]
PRESETS: Final[Mapping[str, Preset]] = MappingProxyType(_GROUPS["variations"] | OF_TASKS | LITERATURE)


def preset(name: str) -> Scenario:
    """Return the scenario of a preset, a key of ``PRESETS``."""
    return PRESETS[as_choice(name, "scenario", PRESETS)].scenario


def as_model(value: Any) -> Scenario:
    """Return a scenario of either model, given as itself or the name of a preset."""
    scenario = preset(value) if isinstance(value, str) else value
    if not isinstance(scenario, FlockScenario | LineScenario):
        raise InputError("scenario", "a FlockScenario, a LineScenario or a preset's name", shown(value))
    return scenario


def as_scenario(value: _T | str | None, model: type[_T], field: str = "scenario") -> _T:
    """Return a scenario of one model, given as itself or the name of a preset; ``None``: the paper's."""
    if value is None:
        return model()
    scenario = PRESETS[as_choice(value, field, PRESETS)].scenario if isinstance(value, str) else value
    if not isinstance(scenario, model):
        known = [name for name, each in PRESETS.items() if each.model is model]
        raise InputError(field, f"a {model.__name__} or one of {', '.join(known)}", shown(value))
    return scenario
