"""Every argument of every public callable: what does not fit is refused by name, what means the same passes.

What is refused leaves no trace: an environment goes on as one that was not asked.
"""

from __future__ import annotations

import inspect
from contextlib import suppress
from types import ModuleType
from typing import Any

import pytest
from argument_environments import CONSTRUCTORS, METHODS
from argument_kinds import Kind
from argument_parts import POLICIES, RESULTS, SCENARIOS
from argument_table import FUNCTIONS, Row, used, write_files
from same import same

import flockesc_env
from flockesc_env import sb3, watch
from flockesc_env.common import stats
from flockesc_env.common.errors import FlockescError
from flockesc_env.render import video

ROWS = FUNCTIONS | CONSTRUCTORS | METHODS | SCENARIOS | POLICIES | RESULTS
CASES = [
    pytest.param(row, name, id=f"{label}-{name}") for label, row in ROWS.items() for name in row.all_arguments
]
# Options that are handed on mean the same everywhere.
TAKEN = [case for case in CASES if case.values[1] in case.values[0].arguments or case.values[0].subject]
MODULES: dict[str, ModuleType] = {"sb3": sb3, "stats": stats, "video": video, "watch": watch}

# What is called by this package alone, with what it has made.
MADE_HERE = {
    *("Trajectory", "LineTrajectory", "SweepResult", "FlockSweepResult", "LineSweepResult"),
    *("Episodes", "LineEpisodes", "RecordedRun", "stats.Estimate", "PredatorPolicySpec"),
}
# Methods that are other libraries' protocols, or that this package alone calls.
PROTOCOLS = {
    *("act", "action_space", "observation_space", "render", "close_extras"),
    *("env_is_wrapped", "env_method", "get_attr", "set_attr", "step_async"),
    *("to_core", "selected"),
}


def _arguments(case: Any) -> Kind:
    row, name = case.values
    kind: Kind = row.all_arguments[name]
    return kind


@pytest.fixture(autouse=True)
def _files(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_files()


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


@pytest.mark.parametrize(("row", "name"), CASES)
def test_refused(row: Row, name: str) -> None:
    subject, twin = (row.subject(), row.subject()) if row.subject else (None, None)
    bad = row.all_arguments[name].bad()
    complaints = {label: complaint(row, subject, name, value) for label, value in bad.items()}
    assert not {label: text for label, text in complaints.items() if text}
    if row.subject:
        same(row.after(subject), row.after(twin))


@pytest.mark.parametrize(("row", "name"), TAKEN)
def test_taken(row: Row, name: str) -> None:
    """In every form that means the same, with the same outcome to the bit."""
    kind = row.all_arguments[name]
    for form in ("plain", *kind.alike()):
        twins = [row.subject(), row.subject()] if row.subject else [None, None]
        given = [kind.good, kind.good if form == "plain" else kind.alike()[form]]
        results = [called(row, twin, **{name: value}) for twin, value in zip(twins, given, strict=True)]
        same(*(twins if row.subject else results), after=row.after)


@pytest.mark.parametrize(("row", "name"), [case for case in CASES if list(_arguments(case).extreme())])
def test_extreme(row: Row, name: str) -> None:
    """What is as large or as small as can be is refused, or harmless."""
    for value in row.all_arguments[name].extreme():
        subject = row.subject() if row.subject else None
        with suppress(FlockescError):
            result = called(row, subject, **{name: value})
            used(result)
            row.after(subject or result)


def _members(module: ModuleType) -> list[str]:
    names = getattr(module, "__all__", None) or [
        name for name, member in vars(module).items() if getattr(member, "__module__", "") == module.__name__
    ]
    return [name for name in names if not name.startswith("_")]


def _public() -> dict[str, Any]:
    found = {name: getattr(flockesc_env, name) for name in _members(flockesc_env)}
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
    for name, member in _public().items():
        if name in MADE_HERE:
            continue
        known = ROWS[name].all_arguments if name in ROWS else {}
        parameters = inspect.signature(member).parameters.values()
        wanted = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
        if name not in ROWS or not wanted <= set(known):
            missing[name] = wanted - set(known)
    assert not missing


def _methods(member: Any) -> dict[str, Any]:
    """Return the methods of a class of this package that take arguments."""
    if not isinstance(member, type):
        return {}
    static = {name: inspect.getattr_static(member, name) for name in dir(member) if not name.startswith("_")}
    functions = {name: getattr(method, "__func__", method) for name, method in static.items()}
    return {
        name: function
        for name, function in functions.items()
        if inspect.isfunction(function)
        and function.__module__.startswith("flockesc_env")
        and len(inspect.signature(function).parameters) > 1
    }


def test_every_argument_of_a_method_is_in_the_table() -> None:
    public = {name: member for name, member in _public().items() if not name.endswith("PredatorPolicySpec")}
    missing, covered = {}, set()
    for owner, member in public.items():
        for name, function in _methods(member).items():
            label = f"{owner}.{name}"
            parameters = list(inspect.signature(function).parameters.values())[1:]
            wanted = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
            if label in ROWS and wanted <= set(ROWS[label].all_arguments):
                covered.add(function)
            else:
                missing[label] = function
    assert not {
        label
        for label, function in missing.items()
        if function not in covered and label.rpartition(".")[2] not in PROTOCOLS
    }


@pytest.mark.parametrize("row", [pytest.param(ROWS[name], id=name) for name in _public() if name in ROWS])
def test_an_unknown_argument(row: Row) -> None:
    """As in any call in Python: a TypeError that names the argument."""
    with pytest.raises(TypeError, match=r"no_such_argument|takes no arguments"):
        called(row, None, no_such_argument=1)
