"""Good, equal and bad values of all arguments of all public callables.

The kind of an argument follows from its annotation (``BY_TYPE``). ``BY_NAME`` and ``OF`` have what an
annotation does not say: bounds, shapes, valid names.
"""

import dataclasses
import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest
import torch
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import policies, sb3, scenario
from flockesc_env.models import Flock, Trajectory, component_labels, neighbor_pairs
from flockesc_env.policies import Architecture
from flockesc_env.render import video

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
    is_optional: bool = False

    def bad(self) -> list[Any]:
        accepted = (*self.accepts, *([type(None)] if self.is_optional else []))
        return [*(value for value in FOREIGN if type(value) not in accepted), *self.near]


def number(good: float, low: float = 0.0, high: float = np.inf, *, is_above: bool = False) -> Kind:
    """Return a real number from ``low`` (exclusive if ``is_above``) to ``high``."""
    near: list[Any] = [[good], np.array([good]), masked(np.array(good)), *([low] if is_above else [])]
    near += [low - 1e-9 * max(1, abs(low)), -1e300] if np.isfinite(low) else []
    near += [high * (1 + 1e-9), 1e300] if np.isfinite(high) else []
    alike = [np.float64(good), np.array(good, float), np.array(good, ">f8"), np.float32(good)]
    return Kind(good, near, [*alike, int(good), np.int64(good)] if good == int(good) else alike)


def integer(good: int, low: int = 0, high: int = 2**63 - 1) -> Kind:
    near = [
        low - 1,
        high + 1,
        0.5,
        2.0,
        np.float64(1),
        [1],
        np.array([1]),
        np.int64(-1),
        masked(np.array(good)),
    ]
    return Kind(good, near, [np.int16(good), np.uint64(good), np.array(good, ">i4")])


count = partial(integer, low=1)
seed = partial(integer, high=2**64 - 1)
any_number = partial(number, low=-np.inf)
positive = partial(number, is_above=True)


def seeds(good: list[int]) -> Kind:
    near = [[], iter(()), 0, -1, [*good, -1], [*good, True], [*good, None], [good]]
    near += [np.array(good, float), [2**64], "01", np.array(3)]
    return Kind(
        good, near, [len(good), np.array(good), tuple(good), np.array(good, ">u8"), np.repeat(good, 2)[::2]]
    )


def floats(good: Any, low: float = -np.inf, *, any_length: bool = False, or_number: bool = False) -> Kind:
    """Return an array of finite numbers of at least ``low``."""
    array = np.asarray(good, np.float64)
    near = [array.astype(other) for other in (str, object, complex, bool)]
    near += [array[..., np.newaxis], array[:0]]
    if not any_length:
        near += [array[:-1], np.concatenate([array, array]), np.concatenate([array, array[:1]])]
    near += [] if or_number else [5, 0.5, np.array(1.0)]
    for entry in (np.nan, np.inf, -np.inf, *([low - 1e-9] if np.isfinite(low) else [])):
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


def parts(good: Any, *confusing: Any) -> Kind:
    return part(good, *confusing, accepts=(tuple,))


FLOCK = small_flock()
LINE = fe.LineScenario(num_agents=5, max_steps=10)
HUNTED = small_flock(predators=(scenario.Learned(),))
RUN, LINE_RUN = fe.simulate(FLOCK, 5.0, seed=1), fe.simulate_line(LINE, 0.25, seed=1)
POINTS = np.arange(10.0).reshape(5, 2) * 2.0
NET = Architecture(("time",), (2,))
NAMED = fe.NetworkPolicy(NET, np.zeros(NET.size)).with_options(name="net", per_agent=True, scenario=FLOCK)
PER_AGENT = floats(np.arange(1.0, 6.0), 0.0, or_number=True)
POINT = floats([1.0, 2.0])
GRID = floats([0.25, 0.5], 0.0, any_length=True)
ANGLE = number(1.0, high=2 * np.pi)


class Model:
    """The interface of a stable-baselines3 model."""

    def predict(self, observations: Any, *, deterministic: bool) -> tuple[Any, None]:
        return np.zeros((len(observations), 1)), None


BY_TYPE: dict[Any, Kind] = {
    float | tuple[float, ...]: PER_AGENT,
    bool: Kind(True, [0, 1, 1.0, "True", [True], np.array([True])], [np.True_], (bool, np.bool)),
    fe.FlockScenario: part(FLOCK, LINE, scenario.Disc()),
    fe.LineScenario: part(LINE, FLOCK),
    Trajectory: part(RUN, FLOCK),
    fe.RenderOptions: part(fe.RenderOptions(size=160)),
    Architecture: part(NET),
    policies.Policy: part(fe.FixedRange(5.0)),
    float: number(2.0),
    Path: file("made.npz"),
    str: text("a text"),
    Iterable[int]: seeds([0, 1]),
    int: count(2),
    tuple[float, ...]: POINT,
}
"""The kinds of annotations; of a union the first that is here. A ``Literal`` is a choice."""

BY_NAME: dict[str, Kind] = {
    **{name: seed(3) for name in ("seed", "episode")},
    **{name: count(10) for name in ("num_agents", "num_steps", "max_steps", "num_envs")},
    **{name: integer(1) for name in ("sensing_delay", "memory", "step")},
    **{name: positive(8.0) for name in ("time_step", "initial_side", "radius", "interval")},
    **{name: any_number(0.5) for name in ("min_cosine", "predator_position")},
    **dict.fromkeys(("angular_noise", "blind_angle"), ANGLE),
    **dict.fromkeys(("range_grid", "profile_ranges", "interaction_ranges", "values"), GRID),
    **{name: floats(POINTS) for name in ("initial_positions", "initial_velocities", "points", "velocities")},
    "periodic_side": positive(100.0),
    "partner": integer(0),
    "caught": Kind([False] * 4 + [True], [[True], [0] * 5, masked(np.ones(5, bool))], [np.arange(5) > 3]),
    "aim": any_number(5.0),
    "direction": POINT,
    "directions": floats(POINTS + 1.0),
    "dimension": integer(2, low=2, high=3),
    "skip": integer(2, high=10),
    "every": integer(2, low=1, high=10),
    "record": part(["polarization"], ("speed",), (1,), np.array(["polarization"]), accepts=(tuple,)),
    "num_threads": count(1),
    "max_range": positive(0.5),
    "predator_sensing_range": Kind(2.0, [-1.0, np.nan, -np.inf, [2.0]], [2, np.array(2.0)], (float,)),
    "min_range": number(0.25),
    "action_mode": choice("normalized"),
    "max_speed": number(40.0),
    "size": count(160, low=160),
    "max_episode_steps": Kind(7, [0, -2, 2.0, [7]], [np.int16(7)]),
    "max_angle": number(1.0, high=np.pi),
    "exponent": number(3.0, high=10.0),
    "low": any_number(2.0),
    "high": number(4.0, low=2.0),
    "initial_state": floats([0.0, 0.25, 0.5, 0.75, 1.0]),
    "parameters": floats(np.arange(NET.size) * 1.0),
    "states": floats([0.0, 0.25, 1.0], any_length=True),
    "positions": floats(POINTS, any_length=True),
    "order_parameter": Kind([0.5, 0.25], ([0.5, np.nan], np.array(["1"])), accepts=(np.ndarray,)),
    "axis": Kind(0, (1, -2, (0, 0), 0.5), accepts=(tuple,)),
    "objective": choice("min_mean_distance"),
    "target": choice("nearest"),
    "render_mode": choice("rgb_array"),
    "autoreset_mode": choice("SameStep"),
    "field": choice("speed"),
    "recorded": part(RUN, LINE_RUN),
    "again": part(RUN, LINE_RUN),
    "runs": part([("a", RUN)], [("a", 1)], [(1, RUN)], [RUN], [("a",)]),
    "predator_policy": part(None),  # the scenarios of the table have no learned predator
    "model": part(Model()),
    "policy": part(fe.FixedRange(5.0)),
    "vec_normalize": part(None),
    "env": part(fe.FlockEscapeEnv(FLOCK)),
    "progress": Kind(None, accepts=(type(len), type, bool, np.bool)),
    "extra_entries": parts(("closest_approach",), ("closest",), "closest_approach"),
    "agents": part((0, 2), (-1,), (0.5,), ((0,),), "ab"),
    "inputs": part(("time",), (1,), "time"),
    "hidden": parts((2,), (0,), (2.0,), (-1,), (True,)),
    "candidate_inputs": parts((), (1,), "range"),
    "ranges": parts((), ("far",), (-1.0,), 3.0),
    "initial_headings": part(scenario.RandomHeadings(), scenario.Disc(), scenario.Metric()),
    "motion": part(scenario.Reynolds(), scenario.Metric()),
    "predators": parts((), (scenario.Disc(),), scenario.PurePursuit(), (None,), (5,)),
    "neighbor_rule": part(scenario.Metric(), scenario.Disc(), scenario.PurePursuit()),
    "randomization": parts((), (scenario.Disc(),), (5,), scenario.Metric()),
}
ALIASES = {
    "name": ("scenario", "policy"),
    "policy": ("interaction_range",),
    "values": ("speed",),
    "recorded": ("again",),
    "again": ("recorded",),
    "actions": ("action",),
}
"""Other names of an argument in errors."""

OF: dict[Any, dict[str, Kind]] = {
    fe.FlockScenario: {
        "initial_positions": part(scenario.Disc(), scenario.RandomHeadings(), scenario.Metric()),
        "num_agents": count(5),
    },
    fe.simulate: {"scenario": part(HUNTED, scenario.Disc()), "interaction_range": PER_AGENT},
    Flock: {
        "scenario": part(FLOCK, LINE, scenario.Disc()),
        "velocities": floats(np.tile([6.0, 8.0], (5, 1))),
        "extra_force": Kind(None, accepts=(type(len), type)),
    },
    fe.simulate_line: {"scenario": Kind(LINE, [FLOCK, 0, [LINE]], is_optional=True)},
    scenario.approach: {"initial_side": number(8.0)},
    scenario.Encircle: {"radius": number(8.0)},
    **{call: {"scenario": part(FLOCK, scenario.Disc())} for call in (fe.sweep, fe.rollout, sb3.vec_env)},
    fe.scan: {"scenario": Kind(FLOCK, [LINE, 0, scenario.Disc()], is_optional=True)},
    video.write_video: {"path": file("made.mp4")},
    scenario.preset: {"name": choice("pursuit")},
    **{call: {"interaction_range": PER_AGENT} for call in (neighbor_pairs, component_labels)},
    fe.load_policy: {"policy": file("policy.npz")},
    fe.save_policy: {"policy": part(NAMED, fe.FixedRange(5.0))},
    fe.load_run: {"path": file("run.npz")},
    fe.ScheduledRange: {"schedule": floats(np.full((10, 5), 4.0), 0.0, any_length=True)},
    scenario.PrescribedPath: {"positions": floats([[1.0, 2.0], [3.0, 5.0]], any_length=True)},
    scenario.Ring: {"width": number(4.0, high=16.0)},
    scenario.RandomApproach: {"predator": integer(0)},
    scenario.LogUniform: {"low": positive(2.0)},
    scenario.Choice: {"values": floats([0.25, 0.5], any_length=True)},  # the drawn number is checked at reset
}
"""Kinds of the arguments of one callable."""


def kinds(call: Any) -> tuple[dict[str, Kind], dict[str, Kind]]:
    """Return the kinds of a callable's parameters, and of the keywords that it passes on."""
    own, passed = {}, {}
    hints = get_type_hints(call.__init__ if isinstance(call, type) else call)
    for name, parameter in inspect.signature(call).parameters.items():
        if parameter.kind is not parameter.VAR_KEYWORD:
            own[name] = _kind(call, name, hints[name], is_optional=parameter.default is None)
        else:
            options = next(iter(get_args(hints[name])), fe.EnvOptions)  # of Unpack
            passed = {each: _kind(call, each, hint) for each, hint in get_type_hints(options).items()}
    return own, passed


def _kind(call: Any, name: str, hint: Any, *, is_optional: bool = False) -> Kind:
    members = {hint, *(get_args(hint) if get_origin(hint) in (Union, UnionType) else ())}
    kind = OF.get(call, {}).get(name) or BY_NAME.get(name)
    kind = kind or next((BY_TYPE[each] for each in BY_TYPE if each in members), None)
    if kind is None:
        kind = choice(next(get_args(member)[1] for member in members if get_origin(member) is Literal))
    return dataclasses.replace(kind, is_optional=kind.is_optional or is_optional or type(None) in members)


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
