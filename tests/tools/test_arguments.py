"""Every argument of every public callable: bad values are refused by name, equal values have equal outcomes.

A refused value leaves no trace: the environment goes on like one that was never asked.
"""

from __future__ import annotations

import copy
import dataclasses
import inspect
import shutil
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from argument_table import (
    CONSTRUCTORS,
    FLOCK,
    FUNCTIONS,
    HUNTED,
    LINE,
    METHODS,
    POLICIES,
    RESULTS,
    SCENARIOS,
    Row,
    write_files,
)
from same import plain, same, spoil

import flockesc_env as fe
from flockesc_env import jobs, policies, sb3, watch
from flockesc_env.common.errors import FlockescError
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.notebook import Replay

ROWS = FUNCTIONS | CONSTRUCTORS | METHODS | SCENARIOS | POLICIES | RESULTS
rows = pytest.mark.parametrize("row", ROWS.values(), ids=ROWS)
MODULES: dict[str, ModuleType] = {"sb3": sb3, "watch": watch}

# Classes that only this package constructs.
MADE_HERE = {
    *("Trajectory", "LineTrajectory", "SweepResult", "FlockSweepResult", "LineSweepResult", "ScanResult"),
    *("Episodes", "LineEpisodes", "RecordedRun", "PolicySpec"),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("files")
    write_files(folder)
    return folder


@pytest.fixture(autouse=True)
def _files(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)


def called(row: Row, subject: Any, **changes: Any) -> Any:
    given = {name: kind.good for name, kind in row.arguments.items()} | changes
    return row.call(**given) if subject is None else row.call(subject, **given)


def complaint(row: Row, subject: Any, name: str, value: Any) -> str | None:
    """Return what is wrong with how a value is refused."""
    try:
        called(row, subject, **{name: value})
    except FlockescError as error:
        is_named = any(known in error.field for known in row.named.get(name, (name,)))
        is_told = str(error) == f"{error.field}: expected {error.expected}, got {error.given}"
        return None if is_named and is_told and len(str(error)) < 1500 else f"{error!r:.200}"
    except BaseException as error:  # a panic is no Exception
        return f"{type(error).__name__} {error!s:.200}"
    return "accepted"


@rows
def test_refused(row: Row) -> None:
    """Every bad value of every argument; then the subject goes on like one that was never asked."""
    subject, twin = (row.subject(), row.subject()) if row.subject else (None, None)
    complaints = {
        (name, label): complaint(row, subject, name, value)
        for name, kind in row.all_arguments.items()
        for label, value in kind.bad().items()
    }
    assert not {case: text for case, text in complaints.items() if text}
    if row.subject:
        same(row.after(subject), row.after(twin))


@rows
def test_taken(row: Row) -> None:
    """Every form of a good value that means the same has the same outcome to the bit."""
    if row.subject is None:
        expected = row.after(called(row, None))
    for name in row.arguments if row.subject is None else row.all_arguments:
        kind = row.all_arguments[name]
        if row.subject is None:
            # Options that are handed on mean the same everywhere.
            for value in (kind.good, *kind.alike.values()):
                same(row.after(called(row, None, **{name: value})), expected)
            continue
        twin = row.subject()
        told, end = called(row, twin, **{name: kind.good}), row.after(twin)
        for value in (kind.good, *kind.alike.values()):
            subject = row.subject()
            same(called(row, subject, **{name: value}), told)
            same(row.after(subject), end)


COPIED = FUNCTIONS | SCENARIOS | {name: row for name, row in POLICIES.items() if name != "NamedPolicy"}
"""A ``NamedPolicy`` is a record of what it is given."""


@pytest.mark.parametrize("row", COPIED.values(), ids=COPIED)
def test_changes_by_the_caller_change_nothing(row: Row) -> None:
    """Arguments are copied, and results belong to the caller."""
    given = {name: kind.good for name, kind in row.arguments.items()}
    taken = copy.deepcopy(given)
    made = row.call(**taken)
    before = plain(copy.deepcopy(row.after(made)))
    spoil(taken)
    assert plain(row.after(made)) == before
    spoil(row.after(made))
    assert plain(row.after(row.call(**copy.deepcopy(given)))) == before


@pytest.mark.parametrize("value", [FLOCK, HUNTED, LINE, EnvOptions(range_grid=[1.0])], ids=repr)
def test_scenarios_and_options_are_values(value: Any) -> None:
    hash(value)  # only numbers, texts and tuples
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(value, dataclasses.fields(value)[0].name, 1)


def _members(module: ModuleType) -> list[str]:
    names = getattr(module, "__all__", None) or [
        name for name, member in vars(module).items() if getattr(member, "__module__", "") == module.__name__
    ]
    return [name for name in names if not name.startswith("_")]


def _public() -> dict[str, Any]:
    found = {name: getattr(fe, name) for name in _members(fe)}
    modules = MODULES | {name: found for name, found in found.items() if isinstance(found, ModuleType)}
    for name, module in modules.items():
        found |= {f"{name}.{member}": getattr(module, member) for member in _members(module)}
    return {
        name: member
        for name, member in found.items()
        if callable(member)
        and not getattr(member, "_is_protocol", False)
        and not (isinstance(member, type) and issubclass(member, Exception))
        and inspect.isroutine(member) | isinstance(member, type)
    }


def test_every_public_argument_is_in_the_table() -> None:
    missing = {}
    by_call = {row.call: row for row in ROWS.values()}
    for name, member in _public().items():
        if name in MADE_HERE:
            continue
        row = ROWS.get(name) or by_call.get(member)
        parameters = inspect.signature(member).parameters.values()
        wanted = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
        if row is None or not wanted <= set(row.all_arguments):
            missing[name] = wanted - set(row.all_arguments if row else ())
    assert not missing


LEAGUE = FLOCK.replace(predators=(fe.PurePursuit(), fe.PurePursuit((40.0, 20.0), (-3.0, 1.0))))
HEAVY = FLOCK.replace(randomization=(fe.Uniform("mass", 1.0, 2.0),))
CONTRADICTIONS: list[tuple[Callable[[], Any], str]] = [
    (lambda: fe.approach((1.0, 2.0, 3.0), dimension=2), "aim"),
    (lambda: fe.approach(direction=(0.0, 0.0)), "direction"),
    (lambda: fe.approach("edge", direction=(0.0, 0.0, 1.0), dimension=3), "direction"),
    (lambda: fe.preset("Pursuit"), "scenario"),
    (lambda: fe.FlockEscapeEnv(HEAVY.replace(predators=())), "predators"),
    (lambda: fe.FlockEscapeEnv(action_mode="range", max_range=1e39), "max_range"),
    (lambda: fe.FlockPursuitEnv(LEAGUE), "predators"),
    (lambda: fe.FlockPursuitEnv(predator_policy=fe.FlyStraight()), "predator_policy"),
    (lambda: fe.FlockPursuitEnv(reward="individual_distance"), "reward"),
    (lambda: fe.FlockEscapeEnv(profile_ranges=[0.0, 5.0]), "profile_ranges"),
    (lambda: fe.LineEscapeEnv(profile_ranges=[0.0, 0.5]), "profile_ranges"),  # type: ignore[call-arg]
    (lambda: fe.rollout(FLOCK, fe.StubbornLeaders(), [0], per_agent=False), "per_agent"),
    (lambda: fe.rollout(FLOCK, policies.ListenWhileFleeing(), [0], per_agent=True), "per_agent"),
    (lambda: fe.rollout(FLOCK, policies.BestCandidate("escape_cosine"), [0]), "profile_ranges"),
    (lambda: fe.rollout(FLOCK, fe.FixedRange(100.5), [0]), "interaction_range"),
    (lambda: fe.rollout(FLOCK, fe.ScheduledRange(np.ones((24, 4))), [0], per_agent=True), "schedule"),
    (lambda: fe.rollout(FLOCK, policies.Planner(FLOCK), [0]), "policy"),
    (lambda: fe.rollout(LINE, fe.FixedRange(0.1), [0], per_agent=True), "per_agent"),
    (lambda: fe.rollout(LINE, fe.FixedRange(0.1), [0], predator_policy=fe.FlyStraight()), "predator_policy"),
    (lambda: fe.neighbor_pairs(fe.FlockScenario(blind_angle=1.0), np.zeros((4, 2)), 1.0), "velocities"),
    (lambda: fe.built_in("fixed:nan"), "policies"),
    (lambda: jobs.find_backend("ray2"), "backend"),
    (lambda: jobs.run_jobs(lambda number: {}, [(1,)], cache="cache"), "function"),
    (lambda: jobs.Job("m:f", (object(),), engine="").key, "arguments"),
    (lambda: jobs.Job("m:f", ({1, 2},), engine="").key, "arguments"),
    (lambda: Replay([("run", fe.simulate(FLOCK, 1.0, seed=0))], height=0), "height"),
]


@pytest.mark.parametrize(("call", "field"), CONTRADICTIONS)
def test_contradictions(call: Callable[[], Any], field: str) -> None:
    """Arguments that are good by themselves."""
    with pytest.raises(FlockescError) as caught:
        call()
    assert caught.value.field == field
