"""The core, the Python classes, the tables of the docs and the presets have the same parts."""

from __future__ import annotations

import json
import pkgutil
import re
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import gymnasium
import pytest
from envs import ADAPTERS

import flockesc_env
from flockesc_env import FlockScenario, LineScenario, _core, envs
from flockesc_env.envs._base import FlockEnvironment
from flockesc_env.episodes import objectives, options
from flockesc_env.scenario import initial, motion, neighbors, predators, randomization
from flockesc_env.scenario.line import EscapeForce
from flockesc_env.scenario.presets import PRESETS

DOCS = (Path(__file__).parents[2] / "docs" / "model.md").read_text("utf-8")
SECTIONS = DOCS.partition("\n## Code\n")[0]
"""The page without its table of code, which also names every part."""

CLASSES: dict[str, Any] = {
    "predators": predators.Predator,
    "neighbor_rules": neighbors.NeighborRule,
    "motions": motion.Motion,
    "initial_positions": initial.InitialPositions,
    "initial_headings": initial.InitialHeadings,
    "distributions": randomization.Distribution,
}
WORDS: dict[str, Any] = {
    "targets": predators.Target,
    "extra_entries": options.ExtraEntries,
    "objectives": objectives.Objective,
    "rewards": options.Reward,
    "escape_forces": EscapeForce,
    "line_rewards": options.LineReward,
}
FIELDS = {
    "predators": "predators",
    "neighbor_rules": "neighbor_rule",
    "motions": "motion",
    "initial_positions": "initial_positions",
    "initial_headings": "initial_headings",
    "distributions": "randomization",
}
EXCEPTIONS: dict[str, dict[str, str]] = {
    "predators": {"prescribed_path": "positions come from a user's data"},
    "initial_positions": {
        "ring": "like a disc, with a predator's path of the same length",
        "segment": "like a thin disc",
        "gaussian": "like one cluster of the preset with several",
        "given_positions": "positions come from a user's data, one row per agent",
    },
    "initial_headings": {"given_headings": "headings come from a user's data, one row per agent"},
    "distributions": {"choice": "like a uniform draw with a few values"},
}
"""Parts without a preset, and why."""


def test_every_family_is_compared() -> None:
    assert _core.kinds().keys() == {"views", *CLASSES, *WORDS}
    assert set(options.View) == set(_core.kinds()["views"])


@pytest.mark.parametrize("family", CLASSES | WORDS)
def test_python_has_every_part(family: str) -> None:
    classes = get_args(CLASSES[family]) if family in CLASSES else ()
    names = {cls.kind for cls in classes} or set(get_args(WORDS[family]))
    assert names == set(_core.kinds()[family])
    assert {cls.__name__ for cls in classes} <= set(flockesc_env.__all__)


@pytest.mark.parametrize("family", CLASSES | WORDS)
def test_the_docs_name_every_part(family: str) -> None:
    rows = re.findall(r"^\| `(\w+)", SECTIONS, re.MULTILINE)
    classes = get_args(CLASSES[family]) if family in CLASSES else ()
    assert {cls.__name__ for cls in classes} <= set(rows)
    words = _core.kinds()[family] if family in WORDS else ()
    assert not [kind for kind in words if not re.search(f'[`"]{kind}[`"]', SECTIONS)]


@pytest.mark.parametrize(
    ("view", "entries"),
    [
        *(
            (view.capitalize(), partial(_core.observation_entries, json.dumps({"view": view})))
            for view in _core.kinds()["views"]
        ),
        ("Predator", _core.predator_observation_entries),
        ("Line", lambda _: _core.line_observation_entries(1)),
    ],
)
def test_the_docs_list_the_entries_and_bounds_of_an_observation_in_order(
    view: str, entries: Callable[[int], list[tuple[str, float, float]]]
) -> None:
    """In space a row has all entries, in the plane those without "_up"."""
    section = DOCS.partition(f"\n### {view} view\n")[2].partition("\n##")[0]
    rows = re.findall(r"^\| `(\w+)` \| \[(-?\d), (\d)\] \|", section, re.MULTILINE)
    documented = [(name, float(low), float(high)) for name, low, high in rows]
    assert documented == entries(3)
    assert [row for row in documented if not row[0].endswith("_up")] == entries(2)


@pytest.mark.parametrize(
    ("family", "folder"),
    [("predators", "predator"), ("motions", "flock/motion"), ("views", "observation")],
)
def test_the_code_table_of_the_docs_has_the_file_of_every_part(family: str, folder: str) -> None:
    assert not [kind for kind in _core.kinds()[family] if f"/{folder}/{kind}.rs)" not in DOCS]


@pytest.mark.parametrize("family", FIELDS)
def test_a_preset_shows_every_part(family: str) -> None:
    scenarios = [preset.scenario for preset in PRESETS.values()]
    flocks = [json.loads(each.to_json()) for each in scenarios if isinstance(each, FlockScenario)]
    parts = [flock[FIELDS[family]] for flock in flocks]
    found = {kind for part in parts for each in (part if isinstance(part, list) else [part]) for kind in each}
    missing = set(_core.kinds()[family]) - found
    assert missing == EXCEPTIONS.get(family, {}).keys()


def test_the_defaults_of_both_languages_are_equal() -> None:
    assert json.loads(FlockScenario().to_json()) == json.loads(_core.default_flock_scenario())
    assert json.loads(LineScenario().to_json()) == json.loads(_core.default_line_scenario())


def _concrete(cls: type) -> set[type]:
    found = cls.__subclasses__()
    return set().union(*map(_concrete, found)) if found else {cls}


def test_every_adapter_is_a_row_of_the_registry() -> None:
    for module in pkgutil.iter_modules(envs.__path__, "flockesc_env.envs."):
        import_module(module.name)
    classes = {cls for cls in _concrete(FlockEnvironment) if cls.__module__.startswith("flockesc_env.")}
    made = [adapter.make() for adapter in ADAPTERS.values()]
    missing = classes - {type(getattr(env, "unwrapped", env)) for env in made}
    assert not missing
    registered = {spec.entry_point for spec in gymnasium.registry.values()}
    names = {f"{cls.__module__}:{cls.__name__}" for cls in classes if issubclass(cls, gymnasium.Env)}
    assert names <= registered
