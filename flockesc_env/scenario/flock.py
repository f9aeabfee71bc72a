"""Scenarios: the schema and the only defaults; as one JSON document they reach the core and records."""

from __future__ import annotations

import dataclasses
import json
import math
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal, Self, TypeVar, get_args

import numpy as np
import tomli_w

from flockesc_env import _core
from flockesc_env.common.checks import as_seed, as_text
from flockesc_env.common.errors import ArgumentError, FlockescError, ScenarioError, shown
from flockesc_env.scenario.initial import InitialHeadings, InitialPositions, RandomHeadings, Square
from flockesc_env.scenario.motion import Inertial, Motion
from flockesc_env.scenario.neighbors import Metric, NeighborRule
from flockesc_env.scenario.predators import ConstantVelocity, Learned, Predator
from flockesc_env.scenario.randomization import Distribution

EscapeForce = Literal["constant", "linear", "linear_as_printed"]

Part = Predator | NeighborRule | InitialPositions | InitialHeadings | Motion | Distribution

_T = TypeVar("_T")

_INTEGER_LIMIT = 2**63

_DEEPEST = 8
"""Lists in lists, of which no field has so many."""

_VARIANTS: dict[str, type[Part]] = {variant.kind: variant for variant in get_args(Part)}


class _Document:
    """What both scenarios share: JSON and TOML in and out, ``replace``, checks by the core."""

    def to_json(self) -> str:
        """Return the scenario as one JSON document; numbers keep every bit."""
        return json.dumps(_to_document(self, ""))

    @classmethod
    def from_json(cls, document: str) -> Self:
        """Build a scenario from a JSON document; fields that it leaves out take their defaults.

        Raises:
            ScenarioError: naming a field that is unknown, of a wrong type or out of bounds.
        """
        text = as_text(document, "document", ScenarioError)
        with _reading("JSON"):
            return _build(cls, json.loads(text, object_pairs_hook=_object), "document")

    def to_toml(self) -> str:
        """Return the scenario as TOML; numbers keep every bit, and ``None`` is the text "None"."""
        return tomli_w.dumps(_replaced(json.loads(self.to_json()), None, "None"))

    @classmethod
    def from_toml(cls, document: str) -> Self:
        """Build a scenario from TOML; fields that it leaves out take their defaults.

        Raises:
            ScenarioError: naming a field that is unknown, of a wrong type or out of bounds.
        """
        text = as_text(document, "document", ScenarioError)
        with _reading("TOML"):
            fields = _replaced(tomllib.loads(text), "None", None)
            # Through JSON, so that a date, which only TOML has, is a text of which the core names the field.
            return cls.from_json(json.dumps(fields, default=str))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises:
            ScenarioError: if a changed field is out of bounds.
            TypeError: for a field that does not exist.
        """
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]

    def _normalize(self) -> None:
        """Give equal scenarios equal values: lists become tuples, numpy and integer numbers plain ones."""
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            object.__setattr__(self, field.name, _plain(getattr(self, field.name), field.type))


@dataclass(frozen=True)
class FlockScenario(_Document):
    """The flock model (docs/model.md, "Flock"); the defaults are the paper's setting.

    Attributes:
        num_agents: number of agents n.
        dimension: dimension D of space, 2 or 3.
        num_steps: steps of an episode; its horizon is ``num_steps * time_step`` seconds.
        time_step: length dt of a step in s.
        mass: mass m in kg, one number for all agents or one per agent.
        speed: speed v0 in m/s, one number for all agents or one per agent.
        initial_side: side in m of the initial region [0, side]^D, around whose center agents start; also the
            length scale of observations.
        initial_positions: where agents start: ``Square()``, ``Disc(radius)``, ``Ring(radius, width)``,
            ``Segment(start, end)``, ``Gaussian(standard_deviation)``, ``Clusters(num_clusters, spread)`` or
            ``GivenPositions(points)``.
        initial_headings: where they head: ``RandomHeadings()``, ``AlignedHeadings(direction, spread)`` or
            ``GivenHeadings(directions)``.
        initial_plane: whether a flock in space starts in the plane z = 0, positions and headings.
        predator_range: distance rho_p in m up to which agents flee from a predator.
        repulsion_strength: strength s of the flight, one number for all agents or one per agent; 0: they do
            not flee.
        alignment_strength: weight a of the consensus with neighbors, one number for all agents or one per
            agent; 0: they follow nobody.
        motion: how forces set velocities: ``Inertial()``, ``Vicsek()`` or
            ``Reynolds(separation_strength, cohesion_strength, separation_range)``.
        angular_noise: width eta in rad of the error in the new heading, from 0 to 2 pi.
        sensing_noise: error in the mean velocity heard, over v0.
        sensing_delay: steps that pass between hearing neighbors and acting on it.
        constant_speed: whether agents keep speed v0 (step 4 of docs/model.md); ``False`` is the literal law.
        capture_radius: distance in m to the nearest predator up to which an agent is caught at the end of a
            step and leaves the flock for good; ``None``: nobody is caught.
        predators: any number of any kinds (``ConstantVelocity``, ``PurePursuit``, ``Intercept``,
            ``Wandering``, ``Encircle``, ``Herd``, ``Learned``), also none.
        neighbor_rule: who is a neighbor: ``Metric()``, ``Topological()`` or ``Voronoi()``.
        blind_angle: full angle in rad of the sector behind an agent in which it sees no neighbor, from 0 to
            2 pi.
        mutual: whether only agents that would both listen to each other are neighbors.
        frozen_graph: whether the neighbor graph of the first step stays, whatever the range.
        periodic_side: side in m of a world without border, a torus, which has no predators; ``None``: the
            open world.
        randomization: numbers that every episode draws anew from its seed, in this order: any of
            ``Uniform(field, low, high)``, ``LogUniform(field, low, high)`` and ``Choice(field, values)``, for
            other fields than ``initial_side`` and ``time_step``.

    Raises:
        ScenarioError: naming a field of a wrong type or out of bounds.
    """

    num_agents: int = 300
    dimension: int = 2
    num_steps: int = 240
    time_step: float = 0.05
    mass: float | tuple[float, ...] = 0.1
    speed: float | tuple[float, ...] = 10.0
    initial_side: float = 100.0
    initial_positions: InitialPositions = Square()  # noqa: RUF009, frozen
    initial_headings: InitialHeadings = RandomHeadings()  # noqa: RUF009, frozen
    initial_plane: bool = False
    predator_range: float = 30.0
    repulsion_strength: float | tuple[float, ...] = 10.0
    alignment_strength: float | tuple[float, ...] = 1.0
    motion: Motion = Inertial()  # noqa: RUF009, frozen
    angular_noise: float = 0.0
    sensing_noise: float = 0.0
    sensing_delay: int = 0
    constant_speed: bool = True
    capture_radius: float | None = None
    predators: tuple[Predator, ...] = (ConstantVelocity(),)
    neighbor_rule: NeighborRule = Metric()  # noqa: RUF009, frozen
    blind_angle: float = 0.0
    mutual: bool = False
    frozen_graph: bool = False
    periodic_side: float | None = None
    randomization: tuple[Distribution, ...] = ()

    def __post_init__(self) -> None:
        self._normalize()
        _core.check_flock_scenario(self.to_json())

    def drawn(self, seed: int) -> FlockScenario:
        """Return the scenario of the episode with this seed, which draws nothing any more.

        ``simulate(scenario.drawn(k), .., seed=k)`` is ``simulate(scenario, .., seed=k)``, bit for bit.

        Raises:
            ArgumentError: if ``seed`` is no integer from 0 to 2^64 - 1.
        """
        document = _core.drawn_flock_scenario(self.to_json(), as_seed(seed)) if self.randomization else None
        return self if document is None else FlockScenario.from_json(document)

    def with_learned_predators(self) -> FlockScenario:
        """Return the scenario with every predator ``Learned``, at its position and velocity.

        Raises:
            ScenarioError: if there is no predator.
        """
        if not self.predators:
            raise ScenarioError("predators", "at least one predator", "none")
        learned = (
            predator
            if isinstance(predator, Learned)
            else Learned(position=predator.position, velocity=predator.velocity)
            for predator in self.predators
        )
        return self.replace(predators=tuple(learned))


@dataclass(frozen=True)
class LineScenario(_Document):
    """The line model (docs/model.md, "Line"); the defaults are the paper's setting.

    Attributes:
        num_agents: number of agents n.
        predator_position: where the predator stands, x_p; ``None``: no predator.
        predator_range: distance rho_p below which agents flee.
        repulsion_strength: strength s of the flight.
        escape_force: ``"constant"`` (Eq. 8), ``"linear"`` (Eq. 9 as it must have been simulated) or
            ``"linear_as_printed"``.
        tolerance: largest move of any agent in one step that counts as standing still.
        max_steps: steps after which an unsteady line is given up.

    Raises:
        ScenarioError: naming a field of a wrong type or out of bounds.
    """

    num_agents: int = 100
    predator_position: float | None = 0.6
    predator_range: float = 0.2
    repulsion_strength: float = 2.0
    escape_force: EscapeForce = "linear"
    tolerance: float = 1e-12
    max_steps: int = 1000

    def __post_init__(self) -> None:
        self._normalize()
        _core.check_line_scenario(self.to_json())


Scenario = FlockScenario | LineScenario


@contextmanager
def _reading(form: str) -> Iterator[None]:
    """Name the document in what its parser refuses: also numbers of too many digits and too deep nesting."""
    try:
        yield
    except FlockescError:
        raise
    except (ValueError, RecursionError) as error:
        raise ScenarioError("document", f"valid {form}", error) from None


def as_model(value: Any) -> Scenario:
    """Return a scenario of either model.

    Raises:
        ArgumentError: for anything else.
    """
    if not isinstance(value, FlockScenario | LineScenario):
        raise ArgumentError("scenario", "a FlockScenario or a LineScenario", shown(value))
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object; of a field that is given twice nobody knows which value is meant."""
    fields: dict[str, Any] = {}
    for name, value in pairs:
        if name in fields:
            raise ValueError(f"{name!r} twice")
        fields[name] = value
    return fields


def _plain(value: Any, annotation: Any = None, depth: int = 0) -> Any:
    if isinstance(value, Part):
        parts = {f.name: _plain(getattr(value, f.name), f.type) for f in dataclasses.fields(value)}
        return type(value)(**parts)
    if isinstance(value, memoryview):
        value = np.asarray(value)
    if isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "biufU":
        value = np.float64(value).tolist() if value.dtype.kind == "f" else value.tolist()
    of_numbers = "float" in str(annotation)
    if isinstance(value, list | tuple):
        if depth > _DEEPEST:
            return list(value)  # which the document then refuses by its field
        return tuple(_plain(entry, "float" if of_numbers else None, depth + 1) for entry in value)
    if isinstance(value, int) and not isinstance(value, bool) and of_numbers:
        # What is too large for a float stays an integer, which the document then refuses by its field.
        return float(value) if abs(value) < _INTEGER_LIMIT else value
    return value


def _replaced(value: Any, old: Any, new: Any) -> Any:
    """Return a document of lists and objects with another value in every place of one."""
    if isinstance(value, dict):
        return {name: _replaced(entry, old, new) for name, entry in value.items()}
    if isinstance(value, list):
        return [_replaced(entry, old, new) for entry in value]
    return new if value == old else value


def _to_document(value: Any, path: str) -> Any:
    if isinstance(value, Part):
        return {value.kind: _fields(value, f"{path}.{value.kind}.")}
    if isinstance(value, _Document):
        return _fields(value, "")
    if isinstance(value, tuple):
        return [_to_document(entry, f"{path}[{index}]") for index, entry in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        raise ScenarioError(path, "a finite number", value)
    if isinstance(value, int) and abs(value) >= _INTEGER_LIMIT:
        raise ScenarioError(path, "an integer of at most 63 bits", value)
    if isinstance(value, str) and not value.isascii():
        raise ScenarioError(path, "a word of the schema", shown(value))
    if value is not None and not isinstance(value, bool | int | float | str):
        raise ScenarioError(path, "a number, a text or a scenario part", shown(value))
    return value


def _fields(value: Any, prefix: str) -> dict[str, Any]:
    fields = dataclasses.fields(value)
    return {field.name: _to_document(getattr(value, field.name), prefix + field.name) for field in fields}


def _build(cls: type[_T], fields: Any, path: str) -> _T:
    """Make an instance from a JSON object whose keys are some of its fields; the core judges the values."""
    if not isinstance(fields, dict):
        raise ScenarioError(path, "a JSON object", shown(fields))
    known = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    for name in fields:
        if name not in known:
            where = name if path == "document" else f"{path}.{name}"
            raise ScenarioError(where, f"one of {', '.join(known)}", "an unknown field")
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if field.default is dataclasses.MISSING and field.name not in fields:
            raise ScenarioError(f"{path}.{field.name}", "a value", "none")
    return cls(**{name: _from_document(value, name) for name, value in fields.items()})


def _from_document(value: Any, path: str) -> Any:
    """Turn ``{kind: fields}`` into the variant that it names, also inside of lists."""
    if isinstance(value, list):
        return tuple(_from_document(entry, f"{path}[{index}]") for index, entry in enumerate(value))
    if isinstance(value, dict):
        kind = next(iter(value), "")
        if len(value) != 1 or kind not in _VARIANTS:
            raise ScenarioError(path, f"one of {', '.join(_VARIANTS)}", ", ".join(map(repr, value)))
        return _build(_VARIANTS[kind], value[kind], f"{path}.{kind}")
    return value
