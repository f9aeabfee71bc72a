"""Flags that commands share: the scenario, seeds, JSON, progress, threads."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import DisallowNone, UseAppendAction, arg
from tyro.constructors import PrimitiveConstructorSpec

from flockesc_env.common.errors import ArgumentError, ScenarioError, shown, shown_name
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.initial_files import read_initial_state
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import MODELS, PRESETS, Scenario, preset


def optional(help_: str, default: str, metavar: str | None = None) -> tuple[Any, ...]:
    """Return the annotations of an optional flag: its help and its default in words."""
    return DisallowNone, arg(help=help_, help_behavior_hint=f"(default: {default})", metavar=metavar)


def switch(help_: str) -> Any:
    """Return the annotation of a flag without a value."""
    return arg(help=help_, help_behavior_hint="(default: off)")


def _range(words: list[str]) -> range:
    try:
        start, stop = map(int, words[0].split(":"))
    except ValueError:
        raise ValueError(f"expected START:STOP, two integers, got {words[0]!r}") from None  # tyro shows it
    return range(start, stop)


Json = Annotated[bool, switch("print one JSON document on stdout, and nothing else there")]
Progress = Annotated[bool, switch("show the progress bar even if stderr is not a terminal")]
Threads = Annotated[
    int | None, *optional("threads of the engine; results do not depend on it", "one per core")
]
Backend = Annotated[
    str,
    arg(
        help="where jobs run: serial, processes[:N], ray[:ADDRESS] or slurm[:KEY=VALUE,..] (docs/cluster.md);"
        " results do not depend on it",
        metavar="BACKEND",
    ),
]
Seeds = Annotated[
    range,
    PrimitiveConstructorSpec(
        nargs=1,
        metavar="START:STOP",
        instance_from_str=_range,
        is_instance=lambda value: isinstance(value, range),
        str_from_instance=lambda value: [f"{value.start}:{value.stop}"],
    ),
]


@dataclasses.dataclass(frozen=True)
class ScenarioFlags:
    """The scenario: a preset or a file, with changes."""

    scenario: Annotated[
        str | None,
        *optional(
            "a preset, as flockesc presets lists them, or a file (.toml, .json) with fields of a scenario",
            "paper-flock",
            metavar="NAME|FILE",
        ),
    ] = None
    changes: Annotated[
        UseAppendAction[tuple[str, ...]],
        arg(
            name="set",
            help="change a field, for example num_agents=100, predators.0.max_turn_rate=3 or motion=vicsek;"
            " the value is JSON or a text; can be repeated",
            metavar="PATH=VALUE",
            help_behavior_hint="(default: no changes)",
        ),
    ] = ()
    initial_state: Annotated[
        Path | None,
        *optional(
            "initial positions and, if given, headings of a flock: a .csv, .npy or .npz file",
            "the scenario's",
            metavar="FILE",
        ),
    ] = None

    def build(self) -> Scenario:
        """Return the scenario.

        Raises:
            OSError: if a file cannot be read.
            RecordError: if the file of the initial state is damaged.
            ScenarioError: for an unknown preset, or naming a field that is unknown or out of bounds.
        """
        scenario: Scenario = FlockScenario() if self.scenario is None else _named(self.scenario)
        if self.initial_state is not None:
            if isinstance(scenario, LineScenario):
                raise ArgumentError("initial_state", "no file for a line", repr(str(self.initial_state)))
            scenario = scenario.replace(**read_initial_state(self.initial_state))
        return _changed(scenario, self.changes) if self.changes else scenario


def model_of(scenario: Scenario) -> str:
    """Return ``"flock"`` or ``"line"``."""
    return next(name for name, model in MODELS.items() if isinstance(scenario, model))


def _named(name: str) -> Scenario:
    """Return a preset, or the scenario in a file."""
    path = Path(name)
    if name in PRESETS:
        return preset(name)
    if not path.suffix and not path.exists():
        raise ScenarioError("scenario", f"a file or one of {', '.join(PRESETS)}", shown_name(name, PRESETS))
    try:
        text = path.read_text(encoding="utf-8")
        return _read(text, is_toml=path.suffix == ".toml")
    except UnicodeDecodeError as error:
        raise ScenarioError(str(path), "TOML or JSON", error) from None
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error.field}", error.expected, error.given) from None


def _read(text: str, *, is_toml: bool) -> Scenario:
    """Return the scenario of a document, a line's if it has a field that only lines have."""
    own = {field.name for field in dataclasses.fields(LineScenario)} - set(vars(FlockScenario()))
    is_line = re.search(rf'(^|[\s{{,"])({"|".join(own)})"?\s*[:=]', text)
    model = LineScenario if is_line else FlockScenario
    return model.from_toml(text) if is_toml else model.from_json(text)


def _changed(scenario: Scenario, changes: Sequence[str]) -> Scenario:
    """Return a scenario after some changes ``PATH=VALUE``; the schema refuses unknown names in paths."""
    document = json.loads(scenario.to_json())
    for change in changes:
        path, is_given, text = change.partition("=")
        if not is_given:
            raise ScenarioError("set", "PATH=VALUE", shown(change))
        *outer, last = path.split(".")
        node = document
        for name in outer:
            parent, key = _place(node, name, path)
            node = parent[key]
        parent, key = _place(node, last, path)
        value = _value(text)
        is_kind = isinstance(value, str) and isinstance(parent[key], dict)
        parent[key] = {value: {}} if is_kind else value
        with suppress(ScenarioError):  # later changes may complete this one
            document = json.loads(type(scenario).from_json(json.dumps(document)).to_json())
    return type(scenario).from_json(json.dumps(document))


def _place(node: Any, name: str, path: str) -> tuple[Any, Any]:
    """Return the object or list that a name in a path belongs to, and its key; kinds may be left out."""
    if isinstance(node, dict):
        if len(node) == 1 and name not in node:
            [node] = node.values()
        node.setdefault(name, None)
        return node, name
    if not isinstance(node, list):
        raise ScenarioError(path, "a path that ends before", shown(name))
    if not name.isdecimal() or int(name) >= len(node):
        raise ScenarioError(path, f"an index below {len(node)}", shown(name))
    return node, int(name)


def _value(text: str) -> Any:
    """Return the value of a change: JSON, None or else a text."""
    try:
        return None if text == "None" else json.loads(text)
    except (ValueError, RecursionError):
        return text
