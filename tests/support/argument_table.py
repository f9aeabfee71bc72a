"""Tables of the arguments of all public callables: the kind of each, with a good value."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import gymnasium
import numpy as np
import pytest
from argument_kinds import (
    Kind,
    choice,
    count,
    file,
    flag,
    floats,
    indices,
    integer,
    number,
    part,
    seed_number,
    seeds,
    state,
    text,
)
from option_table import small_flock
from pettingzoo import AECEnv, ParallelEnv
from stable_baselines3.common.vec_env import VecEnv

import flockesc_env as fe
from flockesc_env import policies, watch
from flockesc_env.models import graph, order, records
from flockesc_env.policies import network, registry
from flockesc_env.policies import predators as predator_policies
from flockesc_env.render import draw, video
from flockesc_env.sb3 import AgentVecEnv, FlockEvalCallback, FlockVecEnv
from flockesc_env.scenario import initial, motion, neighbors, predators, randomization

FLOCK = small_flock(num_steps=24)
LINE = fe.LineScenario(num_agents=5, max_steps=24)
HUNTED = small_flock(num_steps=24, predators=(fe.Learned(),))
RUN = fe.simulate(FLOCK, 5.0, seed=1)
LINE_RUN = fe.simulate_line(LINE, 0.25, seed=1)
POINTS = np.arange(10.0).reshape(5, 2) * 2.0
SWEPT = fe.sweep(FLOCK, [0.0, 5.0], range(3))
FIXED = policies.FixedRange(5.0)
NET = network.Architecture(("time",), (2,))
CONTENDER = registry.NamedPolicy(
    "net", network.NetworkPolicy(NET, np.zeros(NET.size)), scenario=FLOCK, per_agent=True
)


@dataclass(frozen=True)
class Row:
    """A callable: ``call(**arguments)``, or with a ``subject``, ``call(subject(), **arguments)``.

    ``after`` converts the subject, or without one the result, to a value that can be compared.
    """

    call: Callable[..., Any]
    arguments: Mapping[str, Kind] = field(default_factory=dict)
    """Kinds of arguments; the others follow from the names and types in the signature."""
    subject: Callable[[], Any] | None = None
    after: Callable[[Any], Any] = lambda result: result
    others: Mapping[str, Kind] = field(default_factory=dict)
    """Arguments that are not in the signature: keys of ``options``, keyword arguments that are passed on."""
    named: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of an argument in errors, if different from its own name."""
    like: Callable[..., Any] | None = None
    """Has the signature, if ``call`` has not."""

    def __post_init__(self) -> None:
        if self.subject is None:
            kinds = implied(self.like or self.call, self.all_arguments)
            arguments = {name: kind for name, kind in kinds.items() if name not in self.others}
            object.__setattr__(self, "arguments", {**self.arguments, **arguments})

    @property
    def all_arguments(self) -> dict[str, Kind]:
        return {**self.arguments, **self.others}


def implied(call: Callable[..., Any], given: Mapping[str, Kind]) -> dict[str, Kind]:
    """Return the kinds of the parameters in a signature; a default ``None`` makes an argument optional."""
    kinds = {}
    for name, parameter in inspect.signature(call).parameters.items():
        if parameter.kind is not parameter.VAR_KEYWORD:
            kind = given.get(name) or BY_NAME.get(name) or BY_TYPE[parameter.annotation]
            kinds[name] = optional(kind) if parameter.default is None else kind
    return kinds


def write_files(folder: Path) -> None:
    fe.save_policy(CONTENDER, folder / "policy.npz")
    records.save_run(RUN, folder / "run.npz")
    (folder / "state.csv").write_text("x,y\n1,2\n3,4\n")


def optional(kind: Kind) -> Kind:
    return dataclasses.replace(kind, is_optional=True)


def play(env: Any) -> list[Any]:
    """Reset with a seed and take steps."""
    if isinstance(env, VecEnv):
        env.seed(3)
        return [env.reset(), goes_on(env)]
    return [env.reset(seed=3), goes_on(env)]


def goes_on(env: Any) -> list[Any]:
    """Take 10 steps and, after a reset, 10 more."""
    seen = []
    for step in range(20):
        seen.append(env.reset() if step == 10 or getattr(env, "agents", True) == [] else None)
        if isinstance(env, AECEnv):
            for name in env.agents:
                seen += [env.last(), env.step(np.full(env.action_space(name).shape, -0.75, np.float32))]
        elif isinstance(env, ParallelEnv):
            seen.append(env.step({name: np.full(env.action_space(name).shape, -0.75) for name in env.agents}))
        elif isinstance(env, VecEnv):
            seen.append(env.step(np.full((env.num_envs, 1), -0.75)))
        else:
            seen.append(env.step(np.full(env.action_space.shape, -0.75)))
            if isinstance(env, gymnasium.Env) and (seen[-1][2] or seen[-1][3]):
                seen.append(env.reset())
    return seen


def started(make: Callable[[], Any]) -> Callable[[], Any]:
    def subject() -> Any:
        env = make()
        play(env)
        return env

    return subject


ACTION_OPTIONS: dict[str, Kind] = {
    "action_mode": choice("range"),
    "min_range": number(0.25, low=0.0),
    "max_range": number(0.5, low=0.0, is_above=True),
    "range_grid": floats([0.25, 0.5], True, low=0.0, is_any_length=True),
    "steps_per_action": count(2),
}
ENV_OPTIONS = ACTION_OPTIONS | {
    "objective": choice("mean"),
    "reward": choice("terminal"),
    "predator_sensing_range": number(30.0, True, low=0.0),
    "count_components": flag(True),
    "profile_ranges": floats([0.25, 0.5], True, low=0.0, is_any_length=True),
    "extra_entries": part(
        ("closest_approach",), accepts=("nothing",), confusing=(("closest",), "closest_approach")
    ),
}
LINE_OPTIONS = ACTION_OPTIONS | {"reward": choice("terminal")}
SCENARIO = part(FLOCK, True, confusing=(LINE, fe.Disc()))
START = {
    "initial_positions": floats(POINTS, True),
    "initial_velocities": floats(POINTS, True),
    "predator_positions": floats(POINTS[:1], True),
    "predator_velocities": floats(POINTS[:1], True),
    "episode": seed_number(2, True),
}


def reset(env: Any, seed: Any = None, options: Any = None, **entries: Any) -> Any:
    return env.reset(seed=seed, options={**options, **entries} if entries else options)


MOMENT = {
    "positions": floats(POINTS, is_any_length=True),
    "interaction_range": floats(np.full(5, 4.0), low=0.0, is_scalar_fine=True),
    "velocities": floats(POINTS),
}
LINE_MOMENT = {
    "states": floats([0.0, 0.25, 1.0], is_any_length=True),
    "interaction_range": number(0.5, low=0.0),
}
A_RUN = part(RUN, confusing=(FLOCK,))
LEAST_0 = number(2.0, low=0.0)
BY_NAME: dict[str, Kind] = {
    "scenario": SCENARIO,
    "seed": seed_number(3),
    "seeds": seeds([0, 1]),
    "policy": part(FIXED),
    "objective": choice("mean"),
    "name": text("a run"),
    "runs": part([("a", RUN)], confusing=([("a", 1)], [(1, RUN)], [RUN], [("a",)])),
    "trajectory": A_RUN,
    "num_threads": count(1),
    "batch_size": count(2),
    "predator_policy": part(None),  # the scenarios of the table have no learned predator
    "progress": Kind(None, accepts=("function", "class", "bool")),
    "render_mode": choice("rgb_array"),
    "render_options": part(fe.RenderOptions()),
    "num_envs": count(2),
    "num_flocks": count(2),
    "autoreset_mode": choice("SameStep"),
    "max_episode_steps": count(24, low=24),
    "infos": choice("end"),
    "state": choice("flock_view"),
    "per_agent": flag(True),
    "initial_positions": floats(POINTS),
    "initial_velocities": floats(POINTS),
    "position": floats([1.0, 2.0], True),
    "velocity": floats([1.0, 2.0], True),
    "max_speed": number(40.0, True, low=np.hypot(1.0, 2.0)),
    "field": choice("speed"),
}
BY_TYPE: dict[str, Kind] = {"float": LEAST_0, "bool": flag(True), "str": text("a text")}

FUNCTIONS: dict[str, Row] = {
    "approach": Row(
        fe.approach,
        {
            "aim": number(5.0),
            "distance": number(50.0, low=0.0),
            "speed": number(10.0, low=0.0),
            "direction": floats([1.0, 2.0]),
            "initial_side": number(100.0, low=0.0),
            "dimension": integer(2, high=3),
        },
    ),
    "episode_seed": Row(fe.episode_seed, {"episode": seed_number(2)}),
    "preset": Row(fe.preset, {"name": choice("pursuit")}, named={"name": ("scenario",)}),
    "simulate": Row(
        fe.simulate,
        {
            "scenario": part(HUNTED, confusing=(fe.Disc(),)),
            "interaction_range": floats(np.full(5, 4.0), low=0.0, is_scalar_fine=True),
            "predator_actions": floats(np.full((24, 1, 2), 0.5)),
        },
        others={"schedule": optional(floats(np.full((24, 1), 4.0), low=0.0))},
        named={"schedule": ("schedule", "interaction_range")},
    ),
    "simulate_line": Row(
        fe.simulate_line,
        {
            "scenario": part(LINE, True, confusing=(FLOCK,)),
            "interaction_range": number(0.25, low=0.0),
            "initial_state": floats([0.0, 0.25, 0.5, 0.75, 1.0]),
        },
    ),
    "sweep": Row(
        fe.sweep,
        {
            "scenario": part(FLOCK, confusing=(fe.Disc(),)),
            "interaction_ranges": floats([0.0, 4.0], low=0.0, is_any_length=True),
        },
    ),
    "scan": Row(
        fe.scan,
        {
            "values": floats([1.0, 2.0], low=0.0, is_any_length=True),
            "interaction_range": number(4.0, low=0.0),
            "skip": integer(2, high=24),
        },
        named={"values": ("values", "speed")},
    ),
    "rotation": Row(order.rotation),
    "nearest_neighbor_distances": Row(order.nearest_neighbor_distances),
    "density": Row(order.density),
    "correlation_length": Row(order.correlation_length),
    "binder_cumulant": Row(
        order.binder_cumulant,
        {
            "order_parameter": Kind([0.5, 0.25], near=([0.5, np.nan],), accepts=("many axes",)),
            "axis": Kind(0, True, near=(1, -2, (0, 0), 0.5), accepts=("nothing",)),
        },
    ),
    "rollout": Row(fe.rollout, {"scenario": part(FLOCK, True, confusing=(fe.Disc(),))}, others=ENV_OPTIONS),
    "rollout of lines": Row(
        lambda **arguments: fe.rollout(**arguments),
        {
            "scenario": part(LINE, True, confusing=(fe.Disc(),)),
            "policy": part(policies.FixedRange(0.25)),
            "seeds": seeds([0, 1]),
            "batch_size": optional(count(2)),
            "progress": optional(BY_NAME["progress"]),
        },
        others=LINE_OPTIONS,
    ),
    "record": Row(fe.record, others=ENV_OPTIONS),
    "load_policy": Row(
        fe.load_policy, {"path": file("policy.npz")}, after=lambda made: made.policy.parameters
    ),
    "save_policy": Row(
        fe.save_policy, {"policy": part(CONTENDER, confusing=(FIXED,)), "path": file("made.npz")}
    ),
    "read_initial_state": Row(fe.read_initial_state, {"path": file("state.csv")}),
    "save_run": Row(records.save_run, {"path": file("made.npz")}),
    "load_run": Row(records.load_run, {"path": file("run.npz")}),
    "replay_run": Row(records.replay_run),
    "run_differences": Row(
        records.run_differences,
        {"recorded": part(RUN, confusing=(LINE_RUN,)), "again": part(RUN, confusing=(LINE_RUN,))},
        named={"recorded": ("recorded", "again")},
    ),
    "component_labels": Row(graph.component_labels, MOMENT),
    "neighbor_pairs": Row(graph.neighbor_pairs, MOMENT),
    "perron_matrix": Row(graph.perron_matrix, LINE_MOMENT),
    "laplacian": Row(graph.laplacian, LINE_MOMENT),
    "built_in": Row(
        registry.built_in,
        {"name": choice("random"), "argument": text("policies")},
        after=lambda made: (made.name, made.options, made.per_agent),
        named={"name": ("policies",)},
    ),
}


RENDER_OPTIONS: dict[str, Kind] = {
    "size": count(160, low=160),
    "show": choice("discs"),
    "agents": part((0, 2), True, confusing=((-1,), (0.5,), ((0,),), "ab")),
    "color": choice("range"),
    "largest_range": number(20.0, low=0.0),
}


class Model:
    """The interface of a stable-baselines3 model."""

    def predict(self, observations: Any, *, deterministic: bool) -> tuple[Any, None]:
        return np.zeros((len(observations), 1)), None


PER_AGENT = floats(np.arange(1.0, 6.0), low=0.0, is_scalar_fine=True)
POINT = floats([1.0, 2.0])
FLOCK_FIELDS: dict[str, Kind] = {
    "num_agents": count(5),
    "dimension": count(2),
    "num_steps": count(24),
    "time_step": number(0.25, low=0.0, is_above=True),
    "mass": PER_AGENT,
    "speed": PER_AGENT,
    "initial_side": number(30.0, low=0.0, is_above=True),
    "initial_positions": part(fe.Disc(), confusing=(fe.RandomHeadings(), fe.Metric())),
    "initial_headings": part(fe.RandomHeadings(), confusing=(fe.Disc(), fe.Metric())),
    "repulsion_strength": PER_AGENT,
    "alignment_strength": PER_AGENT,
    "motion": part(fe.Reynolds(), confusing=(fe.Metric(),)),
    "angular_noise": number(1.0, low=0.0, high=2 * np.pi),
    "sensing_delay": count(1, low=0),
    "capture_radius": number(1.0, True, low=0.0),
    "predators": part((), accepts=("nothing",), confusing=((fe.Disc(),), fe.PurePursuit(), (None,), (5,))),
    "neighbor_rule": part(fe.Metric(), confusing=(fe.Disc(), fe.PurePursuit())),
    "blind_angle": number(1.0, low=0.0, high=2 * np.pi),
    "periodic_side": number(30.0, True, low=0.0, is_above=True),
    "randomization": part((), accepts=("nothing",), confusing=((fe.Disc(),), (5,), fe.Metric())),
}
LINE_FIELDS: dict[str, Kind] = {
    "num_agents": count(5),
    "predator_position": number(0.5, True),
    "predator_range": number(0.25, low=0.0),
    "repulsion_strength": number(2.0, low=0.0),
    "escape_force": choice("linear"),
    "max_steps": count(24),
}
RADIUS = {"radius": number(8.0, low=0.0, is_above=True)}
HIGH = number(4.0, low=2.0)
BOUNDS: dict[type[Any], dict[str, Kind]] = {
    fe.PurePursuit: {"target": choice("nearest")},
    fe.Herd: {"partner": count(0, low=0)},
    fe.PrescribedPath: {
        "positions": floats([[1.0, 2.0], [3.0, 5.0]], is_any_length=True),
        "interval": number(0.5, low=0.0, is_above=True),
    },
    fe.Learned: {"max_speed": number(15.0, low=0.0, is_above=True)},
    fe.Attracted: {"exponent": number(3.0, low=0.0, high=10.0), "max_speed": number(15.0, low=0.0)},
    fe.PreferredDistance: {"width": number(2.5, low=0.0, is_above=True)},
    fe.Disc: RADIUS,
    fe.Ring: RADIUS | {"width": number(4.0, low=0.0, high=16.0)},
    fe.Segment: {"start": POINT, "end": POINT},
    fe.Clusters: {"num_clusters": count(2)},
    fe.GivenPositions: {"points": floats(POINTS)},
    fe.AlignedHeadings: {"direction": POINT, "max_angle": number(1.0, low=0.0, high=np.pi)},
    fe.GivenHeadings: {"directions": floats(POINTS + 1.0)},
    fe.Uniform: {"low": number(2.0), "high": HIGH},
    fe.LogUniform: {"low": number(2.0, low=0.0, is_above=True), "high": HIGH},
    fe.Choice: {"values": floats([2.0, 4.0], is_any_length=True)},
}
"""Arguments of parts whose bounds do not follow from their name or type."""
SLOTS: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "predators": (lambda part: (fe.ConstantVelocity(), part), predators.Predator),
    "initial_positions": (lambda part: part, initial.InitialPositions),
    "initial_headings": (lambda part: part, initial.InitialHeadings),
    "motion": (lambda part: part, motion.Motion),
    "neighbor_rule": (lambda part: part, neighbors.NeighborRule),
    "randomization": (lambda part: (part,), randomization.Distribution),
}
"""A scenario with a part of each family, and the classes of the family."""

SLOT_ROWS = [
    Row(
        lambda slot=slot, place=place, kind=kind, **given: FLOCK.replace(**{slot: place(kind(**given))}),
        BOUNDS.get(kind, {}),
        named={name: (f"{kind.kind}.{name}",) for name in inspect.signature(kind).parameters},
        like=kind,
    )
    for slot, (place, family) in SLOTS.items()
    for kind in get_args(family)
]
"""A scenario checks its parts."""

PARTS = [
    pytest.param(
        slot, row.like(**{name: given.good for name, given in row.arguments.items()}), id=row.like.kind
    )
    for slot, (_, family) in SLOTS.items()
    for row in SLOT_ROWS
    if row.like in get_args(family)
]
"""Slot and part, one entry per kind of part."""

SCENARIOS: dict[str, Row] = {
    "FlockScenario": Row(fe.FlockScenario, FLOCK_FIELDS),
    "LineScenario": Row(fe.LineScenario, LINE_FIELDS),
    **{row.like.__name__: row for row in SLOT_ROWS},
    "FlockScenario.from_json": Row(fe.FlockScenario.from_json, {"document": text(FLOCK.to_json())}),
    "FlockScenario.from_toml": Row(fe.FlockScenario.from_toml, {"document": text(FLOCK.to_toml())}),
    "EnvOptions": Row(fe.EnvOptions, ENV_OPTIONS),
    "LineOptions": Row(fe.LineOptions, LINE_OPTIONS),
    "RenderOptions": Row(fe.RenderOptions, RENDER_OPTIONS),
}
THRESHOLDS = tuple(inspect.signature(policies.StubbornWitnesses).parameters)
POLICIES: dict[str, Row] = {
    **{
        rule.__name__: Row(rule, arguments, after=vars)
        for rule, arguments in {
            policies.FixedRange: {},
            policies.ScheduledRange: {"schedule": floats(np.full((24, 5), 4.0), low=0.0, is_any_length=True)},
            policies.StubbornLeaders: {"min_cosine": number(0.5)},
            policies.ListenWhileFleeing: {"min_cosine": number(0.1)},
            policies.ListenWhileThreatened: {},
            policies.WinStayLoseShift: {"criterion": choice("escape_direction")},
            policies.BestNextHeading: {},
            policies.BestCandidate: {"entry": text("escape_cosine")},
            predator_policies.FlyStraight: {},
            predator_policies.Pursue: {"target": choice("nearest")},
        }.items()
    },
    "StubbornWitnesses": Row(
        policies.StubbornWitnesses, after=vars, named=dict.fromkeys(THRESHOLDS, THRESHOLDS)
    ),
    "RandomRange": Row(policies.RandomRange, after=lambda made: made._rng.bit_generator.state),
    "SB3Policy": Row(
        policies.SB3Policy, {"model": part(Model()), "vec_normalize": part(None)}, after=lambda _: None
    ),
    "bind": Row(policies.bind, {"env": part(fe.FlockEscapeEnv(FLOCK))}, after=lambda _: None),
    "Architecture": Row(
        network.Architecture,
        {
            "inputs": part(("time",), confusing=((1,), "time")),
            "hidden": part((2,), accepts=("nothing",), confusing=((0,), (2.0,), (-1,), (True,))),
            "memory": count(1, low=0),
            "squash": choice("tanh"),
            "candidate_inputs": part((), accepts=("nothing",), confusing=((1,), "range")),
            "ranges": part((), accepts=("nothing",), confusing=(("far",), (-1.0,), 3.0)),
        },
    ),
    "NetworkPolicy": Row(
        network.NetworkPolicy,
        {"architecture": part(NET), "parameters": floats(np.arange(NET.size) * 1.0)},
        after=lambda made: made.parameters,
    ),
    "NamedPolicy": Row(
        registry.NamedPolicy,
        {"options": part({}, accepts=("dict",)), "scenario": part(FLOCK, True, confusing=(fe.Disc(),))},
    ),
}
RESULTS: dict[str, Row] = {
    "FlockSweepResult.best_range": Row(SWEPT.best_range),
    "watch.write_page": Row(watch.write_page, {"path": file("made.html")}),
    "video.write_video": Row(
        video.write_video,
        {
            "path": file("made.mp4"),
            "options": part(fe.RenderOptions(size=160)),
            "fps": count(4),
            "speed": number(4.0, low=0.0, is_above=True),
            "objective": choice("minimum"),
            "progress": Kind(None, accepts=("function", "class")),
        },
    ),
    "render.draw": Row(
        draw,
        {
            "run": A_RUN,
            "step": count(3, low=0),
            "options": part(fe.RenderOptions()),
            "title": text("a run"),
            "objective": choice("survival"),
        },
    ),
}

PARALLEL = Row(fe.FlockParallelEnv, after=play, others=ENV_OPTIONS)
FACTORY = {"after": play, "others": {**PARALLEL.arguments, **ENV_OPTIONS}}
CONSTRUCTORS: dict[str, Row] = {
    "FlockEscapeEnv": Row(fe.FlockEscapeEnv, after=play, others=ENV_OPTIONS),
    "FlockPursuitEnv": Row(
        fe.FlockPursuitEnv,
        {"flock_policy": part(FIXED), "per_agent": flag(False)},
        after=play,
        others=ENV_OPTIONS,
    ),
    "FlockParallelEnv": PARALLEL,
    "parallel_env": Row(fe.parallel_env, **FACTORY),
    "env": Row(fe.env, **FACTORY),
    "raw_env": Row(fe.raw_env, **FACTORY),
    "FlockVectorEnv": Row(fe.FlockVectorEnv, after=play, others=ENV_OPTIONS),
    "AgentVectorEnv": Row(fe.AgentVectorEnv, {"num_envs": count(10)}, after=play, others=ENV_OPTIONS),
    "LineEscapeEnv": Row(
        fe.LineEscapeEnv,
        {"scenario": part(LINE, True, confusing=(FLOCK,))},
        after=play,
        others=LINE_OPTIONS,
    ),
    "sb3.FlockVecEnv": Row(FlockVecEnv, after=play, others=ENV_OPTIONS),
    "sb3.AgentVecEnv": Row(AgentVecEnv, after=play, others=ENV_OPTIONS),
    "sb3.FlockEvalCallback": Row(
        FlockEvalCallback,
        {"eval_freq": count(5), "best_model_save_path": file("best")},
        after=lambda made: [made.eval_freq, made.num_flocks, made.best_model_save_path],
    ),
}


def _method(name: str) -> Callable[..., Any]:
    return lambda env, **arguments: getattr(env, name)(**arguments)


def _rows(
    name: str, make: Callable[[], Any], actions: dict[str, Kind], options: dict[str, Kind] | None
) -> dict[str, Row]:
    """Return the rows of an environment's methods; without ``options``, of stable-baselines3."""
    subject, flocks = started(make), indices(1, size=2)
    if "Vec" in name:
        states = {"state": state(subject().get_state(1)), "flocks": flocks}
        methods: dict[str, dict[str, Kind]] = {"get_state": {"flocks": flocks}, "set_state": states}
    else:
        methods = {"set_state": {"state": state(subject().get_state())}}
    if options is None:
        methods["seed"] = {"seed": seed_number(3, True)}
    rows = {method: Row(_method(method), kinds, subject, goes_on) for method, kinds in methods.items()}
    rows["step"] = Row(_method("step"), actions, subject, goes_on, named=dict.fromkeys(actions, ("action",)))
    if options is not None:
        # PettingZoo requires that unknown options are ignored.
        given = part({}, True, accepts=("dict",) if name == "FlockParallelEnv" else ())
        kinds = {"seed": seed_number(4, True), "options": given}
        rows["reset"] = Row(reset, kinds, subject, goes_on, others=options)
    return {f"{name}.{method}": row for method, row in rows.items()}


ONE = {"action": floats([0.25])}
MANY = {count: {"actions": floats(np.full((count, 1), 0.25))} for count in (2, 5, 10)}
DICT = {"actions": part({f"agent_{i}": [0.25] for i in range(5)})}
LINE_START: dict[str, Kind] = {
    "initial_state": floats([0.0, 0.25, 0.5, 0.75, 1.0], True),
    "episode": seed_number(2, True),
}
METHODS = {
    **_rows("FlockEscapeEnv", lambda: fe.FlockEscapeEnv(FLOCK), ONE, START),
    **_rows("FlockPursuitEnv", lambda: fe.FlockPursuitEnv(FLOCK), {"action": floats([0.5, 0.5])}, START),
    **_rows("LineEscapeEnv", lambda: fe.LineEscapeEnv(LINE), ONE, LINE_START),
    **_rows("FlockVectorEnv", lambda: fe.FlockVectorEnv(2, FLOCK), MANY[2], START),
    **_rows("AgentVectorEnv", lambda: fe.AgentVectorEnv(10, FLOCK), MANY[10], START),
    **_rows("FlockParallelEnv", lambda: fe.FlockParallelEnv(FLOCK), DICT, START),
    **_rows("sb3.FlockVecEnv", lambda: FlockVecEnv(2, FLOCK), MANY[2], None),
    **_rows("sb3.AgentVecEnv", lambda: AgentVecEnv(2, FLOCK), MANY[10], None),
    "FlockParallelEnv.reset_array": Row(
        _method("reset_array"),
        {"seed": seed_number(4, True), "options": part({}, True, accepts=("dict",))},
        started(lambda: fe.FlockParallelEnv(FLOCK)),
        goes_on,
    ),
    "FlockParallelEnv.step_array": Row(
        _method("step_array"),
        {**MANY[5], "predator_actions": floats([[0.5, 0.5]])},
        started(lambda: fe.FlockParallelEnv(HUNTED)),
        goes_on,
        named={"actions": ("action",)},
    ),
}
