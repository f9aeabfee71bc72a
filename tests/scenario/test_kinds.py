"""The core, the Python classes and the docs have the same parts, fields, defaults and observation entries."""

import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, get_args

import pytest
from argument_table import PARTS, SLOTS
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import _core
from flockesc_env.scenario import objectives, options, parts, predators
from flockesc_env.scenario.line import EscapeForce

FAMILIES: dict[str, Any] = {
    "predators": predators.Predator,
    "neighbor_rules": parts.NeighborRule,
    "motions": parts.Motion,
    "initial_positions": parts.InitialPositions,
    "initial_headings": parts.InitialHeadings,
    "distributions": parts.Distribution,
    "targets": predators.Target,
    "extra_entries": options.ExtraEntries,
    "objectives": objectives.Objective,
    "rewards": options.Reward,
    "escape_forces": EscapeForce,
    "line_rewards": options.LineReward,
}
"""Unions of classes, and literals."""
UNKNOWN = "no_such_name"


@pytest.mark.parametrize("family", sorted(_core.kinds().keys() - {"views"}))
def test_python_has_every_part(family: str) -> None:
    members = get_args(FAMILIES[family])
    classes = [member for member in members if isinstance(member, type)]
    assert {getattr(member, "kind", member) for member in members} == set(_core.kinds()[family])
    assert {cls.__name__ for cls in classes} <= set(fe.scenario.__all__)


def test_the_defaults_of_both_languages_are_equal() -> None:
    assert json.loads(fe.FlockScenario().to_json()) == json.loads(_core.check_flock_scenario("{}"))
    assert json.loads(fe.LineScenario().to_json()) == json.loads(_core.check_line_scenario("{}"))
    assert set(options.VIEWS.values()) == set(_core.kinds()["views"])
    assert list(fe.FlockScenario.objectives) == _core.kinds()["objectives"]


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
    docs = (Path(__file__).parents[2] / "docs" / "model.md").read_text("utf-8")
    section = docs.partition(f"\n### {view} view\n")[2].partition("\n##")[0]
    rows = re.findall(r"^\| `(\w+)` \| \[(-?\d), (\d)\] \|", section, re.MULTILINE)
    documented = [(name, float(low), float(high)) for name, low, high in rows]
    assert documented == entries(3)
    assert [row for row in documented if not row[0].endswith("_up")] == entries(2)


def check_options(document: str) -> None:
    actions = fe.FlockEscapeEnv(small_flock()).policy_spec.actions.core
    _core.FlockBatch([small_flock().to_json()], [0], document, actions, 1, False, 0)


DOCUMENTS: dict[str, tuple[Callable[[str], Any], str]] = {
    "flock": (_core.check_flock_scenario, fe.FlockScenario().to_json()),
    "line": (_core.check_line_scenario, fe.LineScenario().to_json()),
    "options": (check_options, fe.EnvOptions().to_core()),
    "options of lines": (
        lambda document: _core.LineEpisode(fe.LineScenario().to_json(), document, 0),
        fe.LineOptions().to_core(),
    ),
}
SLOT_OF = {part.kind: (slot, part) for slot, part in (case.values for case in PARTS)}
for kind, (slot, part) in SLOT_OF.items():
    text = small_flock(**{slot: SLOTS[slot][0](part)}).to_json()
    DOCUMENTS[kind] = (_core.check_flock_scenario, text)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_fields(name: str) -> None:
    """The core's error about an unknown field lists the fields of Python."""
    check, text = DOCUMENTS[name]
    check(text)
    fields = document = json.loads(text)
    if name in SLOT_OF:
        written = document[SLOT_OF[name][0]]
        ((kind, fields),) = (written[-1] if isinstance(written, list) else written).items()
        assert kind == name
    known = set(fields)
    fields[UNKNOWN] = 1
    with pytest.raises(fe.FlockescError, match=UNKNOWN) as caught:
        check(json.dumps(document))
    assert set(re.findall(r"`(\w+)`", caught.value.expected)) == known
