"""Flags that commands share: model and scenario, seeds, JSON, progress, threads."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

from tyro.conf import DisallowNone, arg
from tyro.constructors import (
    ConstructorRegistry,
    PrimitiveConstructorSpec,
    PrimitiveTypeInfo,
    StructConstructorSpec,
    StructFieldSpec,
    StructTypeInfo,
)

from flockesc_env.cli.parts import part_rule
from flockesc_env.common.errors import ArgumentError, ScenarioError
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.initial_files import read_initial_state
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import PRESETS, Scenario, as_scenario, preset

MODELS: dict[str, type[Scenario]] = {"flock": FlockScenario, "line": LineScenario}
_DEFAULT_MODEL = "flock"


def optional(help_: str, default: str, metavar: str | None = None) -> tuple[Any, ...]:
    """Return the annotations of a flag that may be left out: its help and what then happens."""
    return DisallowNone, arg(help=help_, help_behavior_hint=f"(default: {default})", metavar=metavar)


def switch(help_: str) -> Any:
    """Return the annotation of a flag without a value."""
    return arg(help=help_, help_behavior_hint="(default: off)")


Json = Annotated[bool, switch("print one JSON document on stdout, and nothing else there")]
Progress = Annotated[bool, switch("show the progress bar even where stderr is no terminal")]
Threads = Annotated[
    int | None, *optional("threads of the engine; results do not depend on it", "one per core")
]


@dataclasses.dataclass(frozen=True)
class ScenarioFlags:
    """The model and the fields of its scenario as they were given; ``build`` has them checked."""

    model: str
    fields: dict[str, Any]

    def build(self) -> Scenario:
        """Return the scenario.

        Raises:
            ScenarioError: naming a field that is out of bounds.
        """
        return MODELS[self.model](**self.fields)


def registry(argv: Sequence[str]) -> ConstructorRegistry:
    """Return how tyro makes scenarios, their parts and seeds from flags.

    Model, scenario and initial state are looked up beforehand: they decide which flags there are, and their
    defaults.

    Raises:
        OSError: if the scenario's or the initial state's file cannot be read.
        RecordError: if the file of the initial state does not hold one.
        ScenarioError: for a name that is no preset's, or naming a field of the file that is unknown, of a
            wrong type or out of bounds.
    """
    first = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    first.add_argument("--model", nargs="?")
    first.add_argument("--scenario", nargs="?")
    first.add_argument("--initial-state", nargs="?")
    known, _ = first.parse_known_args(argv)
    default = _default(known.model, known.scenario)
    if known.initial_state is not None:
        default = _started(default, Path(known.initial_state))

    rules = ConstructorRegistry()
    rules.primitive_rule(part_rule)
    rules.primitive_rule(_seeds_rule)

    @rules.struct_rule
    def scenario_rule(info: StructTypeInfo) -> StructConstructorSpec | None:
        return _scenario_spec(default) if info.type is ScenarioFlags else None

    return rules


def _default(model: str | None, name: str | None) -> Scenario:
    """Return the scenario that flags change; a preset brings its own model."""
    # tyro refuses an unknown model with its own words.
    cls = MODELS.get(model or _DEFAULT_MODEL, MODELS[_DEFAULT_MODEL])
    if name is None:
        return cls()
    if name in PRESETS:
        return as_scenario(name, cls) if model in MODELS else preset(name)
    path = Path(name)
    if not path.suffix and not path.exists():
        raise ScenarioError("scenario", f"a file or one of {', '.join(PRESETS)}", repr(name))
    return _read(cls, path)


def _read(cls: type[Scenario], path: Path) -> Scenario:
    try:
        text = path.read_text(encoding="utf-8")
        return cls.from_toml(text) if path.suffix == ".toml" else cls.from_json(text)
    except UnicodeDecodeError as error:
        raise ScenarioError(str(path), "TOML or JSON", error) from None
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error.field}", error.expected, error.given) from None


def _started(scenario: Scenario, path: Path) -> Scenario:
    """Return a flock that starts as a file says."""
    if isinstance(scenario, LineScenario):
        raise ArgumentError("initial_state", "none for a line", repr(str(path)))
    return scenario.replace(**read_initial_state(path))


def _scenario_spec(default: Scenario) -> StructConstructorSpec:
    """Return the flags of one model; the scenario's own class would check the fields one call too early."""
    cls = type(default)
    model = next(name for name, known in MODELS.items() if known is cls)
    hints = get_type_hints(cls)
    given = dataclasses.make_dataclass(
        cls.__name__,
        [
            (f.name, hints[f.name], dataclasses.field(default=getattr(default, f.name)))
            for f in dataclasses.fields(cls)
        ],
        namespace={"__doc__": (cls.__doc__ or "").replace("``", "")},
        frozen=True,
    )
    models: Any = Annotated[
        Literal["flock", "line"],
        arg(help="the flock in the plane or in space, or the line, whose flags --model line --help lists"),
    ]
    origin: Any = Annotated[
        str | None,
        *optional(
            "a preset (flockesc presets lists them), or a TOML or JSON file with fields; flags override it",
            "the paper's scenario",
            metavar="NAME|FILE",
        ),
    ]
    state: Any = Annotated[
        str | None,
        *optional(
            "initial positions and, if given, headings of a flock: a .csv, .npy or .npz file",
            "the scenario's",
            metavar="FILE",
        ),
    ]
    fields: Any = Annotated[given, arg(name="")]
    return StructConstructorSpec(
        instantiate=lambda model, scenario, initial_state, fields: ScenarioFlags(  # noqa: ARG005
            model, dict(vars(fields))
        ),
        fields=(
            StructFieldSpec("model", models, model),
            StructFieldSpec("scenario", origin, None),
            StructFieldSpec("initial_state", state, None),
            StructFieldSpec("fields", fields, given()),
        ),
    )


def _seeds_rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Spell a range of seeds as ``START:STOP``."""
    if info.type is not range:
        return None

    def parse(words: list[str]) -> range:
        try:
            start, stop = map(int, words[0].split(":"))
        except ValueError:
            raise ValueError(f"expected START:STOP, two integers, got {words[0]!r}") from None
        return range(start, stop)

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="START:STOP",
        instance_from_str=parse,
        is_instance=lambda value: isinstance(value, range),
        str_from_instance=lambda value: [f"{value.start}:{value.stop}"],
    )
