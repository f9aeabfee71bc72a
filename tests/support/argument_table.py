"""Good, equal and bad values of every argument, by the type of its annotation.

A good value follows from the default or the type (``BY_TYPE``). ``GOOD``, ``BOUNDS`` and ``EXCEPTIONS`` have
what an annotation does not say.
"""

import dataclasses
import inspect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from os import PathLike
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest
import torch
from numpy.typing import ArrayLike
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import policies, scenario
from flockesc_env.models import Trajectory
from flockesc_env.models.order import MEASURES
from flockesc_env.policies import Architecture

DEEP: list[Any] = []
for _ in range(5000):
    DEEP = [DEEP]
CYCLE: list[Any] = []
CYCLE.append(CYCLE)

# Rejected by every kind that does not accept their type.
FOREIGN: list[Any] = [
    *(None, True, np.True_, "no such thing", "1", "\ud800", b"1", 1j, object(), {"no such name": 2}, {1.0}),
    *((), [[1.0], [1.0, 2.0]], np.array(["1"]), np.array([object()], object), np.zeros(1, "i4, f8")),
    *(np.datetime64("NaT"), len, float, 10**5000, DEEP, CYCLE, np.longdouble("1e4000"), np.zeros((1,) * 40)),
    *(np.nan, np.inf, -np.inf),
]


@dataclass(frozen=True)
class Kind:
    """An argument: a ``good`` value, equal forms (``alike``), bad values that resemble it (``near``)."""

    good: Any
    near: Iterable[Any] = ()
    alike: Iterable[Any] = ()
    accepts: tuple[type, ...] = ()
    """Types of the foreign values that this kind accepts."""

    def bad(self) -> list[Any]:
        return [*(value for value in FOREIGN if type(value) not in self.accepts), *self.near]


def number(good: float, *, is_signed: bool = False) -> Kind:
    """Return a real number, at least 0 unless it is signed; infinite only if the good one is."""
    below = [] if is_signed else [-1e-9, -1e300]
    near: list[Any] = [[good], np.array([good]), masked(np.array(good)), *below]
    if np.isinf(good):
        return Kind(good, [*near, np.nan, -np.inf], [np.float64(good)], (float,))
    alike = [np.float64(good), np.array(good, float), np.array(good, ">f8"), np.float32(good)]
    return Kind(good, near, [*alike, int(good), np.int64(good)] if good == int(good) else alike)


def integer(good: int, low: int = 1) -> Kind:
    near = [low - 1, 2**64, 0.5, 2.0, np.float64(1), [1], np.array([1]), np.int64(-1), masked(np.array(good))]
    return Kind(good, near, [np.int16(good), np.uint64(good), np.array(good, ">i4")])


def flag(good: bool) -> Kind:
    return Kind(good, [0, 1, 1.0, "True", [True], np.array([True])], [np.bool(good)], (bool, np.bool))


def seeds(good: Sequence[int]) -> Kind:
    near = [[], iter(()), 0, -1, [*good, -1], [*good, True], [*good, None], [good]]
    near += [np.array(good, float), [2**64], "01", np.array(3)]
    return Kind(
        good, near, [len(good), np.array(good), tuple(good), np.array(good, ">u8"), np.repeat(good, 2)[::2]]
    )


def floats(
    good: Any,
    *,
    is_signed: bool = True,
    any_length: bool = False,
    or_number: bool = False,
    gaps: bool = False,
) -> Kind:
    """Return an array of finite numbers, at least 0 unless they are signed; or of NaN, with ``gaps``."""
    array = np.asarray(good, np.float64)
    near = [array.astype(other) for other in (str, object, complex, bool)]
    near += [array[..., np.newaxis], array[:0]]
    if not any_length:
        near += [array[:-1], np.concatenate([array, array]), np.concatenate([array, array[:1]])]
    near += [] if or_number else [5, 0.5, np.array(1.0)]
    for entry in (*([] if gaps else [np.nan]), np.inf, -np.inf, *([] if is_signed else [-1e-9])):
        spoilt = array.copy()
        spoilt.flat[-1] = entry
        near.append(spoilt)
    return Kind(good, [*near, *unreadable(array)], forms(array))


def masked(good: Any) -> np.ma.MaskedArray[Any, Any]:
    """Return a masked array whose last entry is hidden."""
    mask = np.zeros(good.shape, bool)
    mask.flat[-1] = True
    return np.ma.masked_array(good, mask)


def unreadable(good: Any) -> list[Any]:
    """Return numbers that are hidden, also in rows or without a hidden one, or that NumPy cannot read."""
    numbers = torch.tensor(good)
    tensors = [numbers.clone().requires_grad_(), numbers.bfloat16(), numbers.to("meta"), numbers.to_sparse()]
    return [masked(good), [*masked(good)], np.ma.masked_array(good), *tensors]


def forms(good: Any) -> list[Any]:
    """Return the numbers of an array, all exact in float32, in other types and memory layouts."""
    wide = np.repeat(np.repeat(good, 2, axis=0), 3, axis=-1)
    frozen = good.copy()
    frozen.flags.writeable = False
    unaligned = np.frombuffer(b"\0" + good.tobytes(), np.uint8)[1:].view(np.float64).reshape(good.shape)
    strided = wide[::2, ..., ::3] if good.ndim > 1 else np.repeat(good, 3)[::3]
    types = [good.astype(kind) for kind in (np.float32, np.longdouble, ">f8")]
    if (good == good.astype(np.int64)).all():
        types += [good.astype(int).tolist(), good.astype(">i4")]
    layouts = [np.asfortranarray(good), strided, good[::-1].copy()[::-1], frozen, unaligned]
    return [good.tolist(), memoryview(good), *types, *layouts]


def choice(good: str) -> Kind:
    near = ["", f"{good} ", good.upper(), [good], np.array([good] * 2), 0]
    return Kind(good, near, [np.str_(good)])


def text(good: str) -> Kind:
    return Kind(good, [0, [good]], accepts=(str,))


def file(good: str) -> Kind:
    return Kind(good, [0, [good], f"a\0b{Path(good).suffix}"], [Path(good)], accepts=(str,))


def part(good: Any, *confusing: Any, accepts: tuple[type, ...] = ()) -> Kind:
    """Return an object of the package, and objects that resemble it."""
    return Kind(good, [0, type(good), [good], *confusing], accepts=accepts)


def entries(good: tuple[Any, ...], *, accepts: tuple[type, ...] = (tuple,)) -> Kind:
    """Return a tuple of names, integers or parts."""
    near = [(value,) for value in (None, 0, 2.0, -1, True, scenario.Disc())]
    return Kind(good, [0, good[0] if good else "no tuple", *near], accepts=accepts)


FLOCK = small_flock()
LINE = fe.LineScenario(num_agents=5, max_steps=10)
RUN = fe.simulate(FLOCK, 5.0, seed=1)
POINTS = np.arange(1.0, 11.0).reshape(5, 2) * 2.0
PER_AGENT = np.arange(1.0, 6.0)
NET = Architecture(("time",), (2,))
NAMED = fe.NetworkPolicy(NET, np.zeros(NET.size)).with_options(name="net", per_agent=True, scenario=FLOCK)


class Model:
    """The interface of a stable-baselines3 model."""

    def predict(self, observations: Any, *, deterministic: bool) -> tuple[Any, None]:
        return np.zeros((len(observations), 1)), None


BY_TYPE: dict[Any, tuple[Callable[..., Kind], Any]] = {
    float | tuple[float, ...]: (floats, PER_AGENT),
    get_args(ArrayLike)[0]: (floats, POINTS),
    Sequence[float]: (floats, [0.25, 0.5]),
    tuple[float, ...]: (floats, (1.0, 2.0)),
    tuple[tuple[float, ...], ...]: (floats, tuple(map(tuple, POINTS.tolist()))),
    tuple[int, ...]: (entries, (2,)),
    tuple[str, ...]: (entries, ("time",)),
    bool: (flag, True),
    fe.FlockScenario: (part, FLOCK),
    fe.LineScenario: (part, LINE),
    Trajectory: (part, RUN),
    Architecture: (part, NET),
    policies.Policy: (part, fe.FixedRange(5.0)),
    policies.BasePolicy: (part, NAMED),
    float: (number, 2.0),
    Path: (file, "made.npz"),
    PathLike[str]: (file, "policy.npz"),
    str: (text, "a text"),
    Iterable[int]: (seeds, [0, 1]),
    int: (integer, 2),
}
"""Kind and good value of annotations; of a union the first that is here. A ``Literal`` is a choice."""
CONFUSING = (FLOCK, LINE, scenario.Disc(), scenario.RandomHeadings(), scenario.Metric())
ANY_LENGTH = {"range_grid", "values", "states", "positions", "schedule"}

GOOD: dict[str, Any] = {
    "FlockScenario.num_agents": 5,
    "simulate.scenario": FLOCK.with_learned_predators(),
    "predators": (),
    "periodic_side": 100.0,
    "num_flocks": 2,
    "num_tuning": 2,
    "size": 160,
    "render_size": 160,
    "num_envs": 10,
    "min_range": 0.25,
    "max_speed": 40.0,
    "Uniform.high": 4.0,
    "LogUniform.high": 4.0,
    "initial_state": [0.0, 0.25, 0.5, 0.75, 1.0],
    "interaction_ranges": [0.25, 0.5],
    "values": [0.25, 0.5],
    "states": [0.0, 0.25, 1.0],
    "parameters": np.arange(NET.size) * 1.0,
    "PredatorNetwork.parameters": np.arange(10.0),
    "schedule": np.full((10, 5), 4.0),
    "neighbor_pairs.interaction_range": PER_AGENT,
    "component_labels.interaction_range": PER_AGENT,
    "load_run.path": "run.npz",
    "write_video.path": "made.mp4",
}
"""Where neither the default nor the type is good: by name, or by callable and name."""

SIGNED = {"min_cosine", "predator_position", "low"}
"""Numbers that may be negative."""
FROM_ZERO = {"seed", "episode", "sensing_delay", "memory", "step", "partner", "predator", "skip"}
"""Integers that may be 0."""

EXCEPTIONS: dict[str, Kind] = {
    "field": choice("speed"),
    "preset.name": choice("pursuit"),
    "render_mode": choice("rgb_array"),
    "objective": choice("min_mean_distance"),
    "aim": number(5.0, is_signed=True),
    "ranges": Kind((), [("far",), (-1.0,), 3.0], accepts=(tuple,)),
    "max_episode_steps": Kind(7, [0, -2, 2.0, [7]], [np.int16(7)]),
    "order_parameter": Kind([0.5, 0.25], ([0.5, np.nan], np.array(["1"])), accepts=(np.ndarray,)),
    "tracks": floats(POINTS, gaps=True),
    **{f"{measure}.velocities": floats(POINTS, gaps=True) for measure in MEASURES},
    "nearest_neighbor_distances.tracks": floats(POINTS, any_length=True, gaps=True),
    "rotation.side": part(None),
    "series": floats(POINTS, any_length=True),
    "scan.values": Kind(
        {"speed": [0.25, 0.5]},
        [[0.5], {"speed": [np.nan]}, {"speed": 0.5}, {"speed": [[0.5]]}, {1: [0.5]}, {"num_steps": [2, 3]}],
        [{"speed": np.array([0.25, 0.5])}],
        accepts=(dict,),
    ),
    "scan.interaction_range": floats([0.25, 0.5], is_signed=False, or_number=True),
    "measures": Kind(
        ("polarization",),
        ["polarization", (), ["order"], [None], ["polarization"] * 2],
        [["polarization"]],
        (tuple,),
    ),
    "runs": part([("a", RUN)], [("a", 1)], [(1, RUN)], [RUN], [("a",)]),
    "progress": Kind(None, accepts=(type(len), type, bool, np.bool)),
    "simulate.interaction_range": floats(PER_AGENT, is_signed=False, or_number=True),
    "compare.ranges": floats([0.25, 0.5], is_signed=False, any_length=True),
    "rollout.scenario": part(FLOCK, scenario.Disc()),
    "vec_env.scenario": part(FLOCK, scenario.Disc()),
    "record": part(["polarization"], ("speed",), (1,), np.array(["polarization"]), accepts=(tuple,)),
    "Flock.velocities": floats(np.tile([6.0, 8.0], (5, 1))),
    "extra_force": Kind(None, accepts=(type(len), type)),
    "model": part(Model()),
    "vec_normalize": part(None),
    "BatchVectorEnv.flock_policy": part(None),
    "BatchVecEnv.flock_policy": part(None),
    "compare.flock_policy": part(None),
    "predator_policy": part(None),  # the scenarios of the table have no learned predator
    "bind.policy": part(fe.FixedRange(5.0)),
    "env": part(None),  # tests/policies/test_wrapped.py has good ones
    "eval_env": part(None),
    "bind.env": part(fe.FlockEscapeEnv(FLOCK)),
}
"""Arguments whose annotation does not say what they accept."""
ALIASES = {
    "name": ("scenario", "policy"),
    "policy": ("interaction_range",),
    "values": ("speed",),
    "tracks": ("velocities",),
    "actions": ("action",),
}
"""Other names of an argument in errors."""


def kinds(call: Any) -> tuple[dict[str, Kind], dict[str, Kind]]:
    """Return the kinds of a callable's parameters, and of the keywords that it passes on."""
    own, passed = {}, {}
    hints = get_type_hints(call.__init__ if isinstance(call, type) else call)
    for name, parameter in inspect.signature(call).parameters.items():
        if parameter.kind is not parameter.VAR_KEYWORD:
            own[name] = _kind(call, name, hints[name], parameter.default)
        else:
            options = get_type_hints(next(iter(get_args(hints[name])), fe.EnvOptions))  # of Unpack
            owner = fe.EnvOptions if "objective" in options else fe.LineOptions
            defaults = {each: getattr(owner, each, None) for each in options}
            passed = {each: _kind(call, each, hint, defaults[each]) for each, hint in options.items()}
    return own, passed


def _kind(call: Any, name: str, hint: Any, default: Any) -> Kind:
    members = {hint, *(get_args(hint) if get_origin(hint) in (Union, UnionType) else ())}
    keys = (f"{call.__name__}.{name}", name)
    kind = next((EXCEPTIONS[key] for key in keys if key in EXCEPTIONS), None)
    kind = kind or _by_type(keys, members, default)
    if default is None or type(None) in members or name == "scenario":
        return dataclasses.replace(kind, accepts=(*kind.accepts, type(None)))
    return kind


def _by_type(keys: tuple[str, str], members: set[Any], default: Any) -> Kind:
    name = keys[1]
    own = None if default is inspect.Parameter.empty else default
    literal = next((get_args(each) for each in members if get_origin(each) is Literal), None)
    if literal or isinstance(own, Enum):
        return choice(own.value if isinstance(own, Enum) else own or literal[0])
    make, good = next((BY_TYPE[each] for each in BY_TYPE if each in members), (part, own))
    if make is number and own is not None:
        good = float(np.float32(0.75 * own or 0.5))  # not the default
    elif make in (integer, entries) and own is not None:
        good = own
    good = next((GOOD[key] for key in keys if key in GOOD), good)
    if make is floats:
        any_length = name in ANY_LENGTH or "ranges" in name
        is_range = "range" in name or keys[0] == "ScheduledRange.schedule"
        or_number = float in members or name == "interaction_range"
        is_signed = not (is_range or or_number)
        return floats(good, is_signed=is_signed, any_length=any_length, or_number=or_number)
    if isinstance(own, tuple) or make is entries:
        return entries(good, accepts=() if own is None else (tuple,))
    if make is part:
        return part(good, *(each for each in CONFUSING if type(each) not in members))
    if make is number:
        return number(good, is_signed=name in SIGNED)
    return integer(good, 0 if name in FROM_ZERO else 1) if make is integer else make(good)


SLOTS: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "predators": (lambda part: (scenario.ConstantVelocity(), part), scenario.predators.Predator),
    "initial_positions": (lambda part: part, scenario.parts.InitialPositions),
    "initial_headings": (lambda part: part, scenario.parts.InitialHeadings),
    "motion": (lambda part: part, scenario.parts.Motion),
    "neighbor_rule": (lambda part: part, scenario.parts.NeighborRule),
    "randomization": (lambda part: (part,), scenario.parts.Distribution),
}
"""A scenario with a part of each family, and the classes of the family."""
SLOT_OF = {kind: slot for slot, (_, family) in SLOTS.items() for kind in get_args(family)}
PARTS = [
    pytest.param(slot, kind(**{name: each.good for name, each in kinds(kind)[0].items()}), id=kind.kind)
    for kind, slot in SLOT_OF.items()
]
"""Slot and part, one entry per kind of part."""
MOTIONS = [part for slot, part in (case.values for case in PARTS) if slot == "motion"]
