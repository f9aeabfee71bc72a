"""Table of the arguments of public functions: the kind of each, with a good value."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from argument_kinds import (
    Call,
    Choice,
    Count,
    File,
    Flag,
    Floats,
    Index,
    Kind,
    Number,
    Part,
    Seed,
    Seeds,
    Text,
)
from option_table import small_flock
from pettingzoo import AECEnv, ParallelEnv
from stable_baselines3.common.vec_env import VecEnv

import flockesc_env as fe
from flockesc_env import policies
from flockesc_env.models import graph, records
from flockesc_env.policies import network, registry

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
    "action_mode": Choice("range"),
    "min_range": Number(0.25, low=0.0),
    "max_range": Number(0.5, low=0.0, is_above=True),
    "range_grid": Floats([0.25, 0.5], True, low=0.0, is_any_length=True),
    "steps_per_action": Count(2),
}
ENV_OPTIONS = ACTION_OPTIONS | {
    "objective": Choice("mean"),
    "reward": Choice("terminal"),
    "predator_sensing_range": Number(30.0, True, low=0.0),
    "count_components": Flag(True),
    "profile_ranges": Floats([0.25, 0.5], True, low=0.0, is_any_length=True),
    "extra_entries": Part(
        ("closest_approach",), accepts=("nothing",), confusing=(("closest",), "closest_approach")
    ),
}
LINE_OPTIONS = ACTION_OPTIONS | {
    "reward": Choice("terminal"),
    "profile_ranges": Floats([0.25, 0.5], True, low=0.0, is_any_length=True),
}
SCENARIO = Part(FLOCK, True, confusing=(LINE, fe.Disc()))
START = {
    "initial_positions": Floats(POINTS, True),
    "initial_velocities": Floats(POINTS, True),
    "predator_positions": Floats(POINTS[:1], True),
    "predator_velocities": Floats(POINTS[:1], True),
    "episode": Seed(2, True),
}


def reset(env: Any, seed: Any = None, options: Any = None, **entries: Any) -> Any:
    return env.reset(seed=seed, options={**options, **entries} if entries else options)


MOMENT = {
    "positions": Floats(POINTS, is_any_length=True),
    "interaction_range": Floats(np.full(5, 4.0), low=0.0, is_scalar_fine=True),
    "velocities": Floats(POINTS),
}
LINE_MOMENT = {
    "states": Floats([0.0, 0.25, 1.0], is_any_length=True),
    "interaction_range": Number(0.5, low=0.0),
}
A_RUN = Part(RUN, confusing=(FLOCK,))
LEAST_0 = Number(2.0, low=0.0)
BY_NAME: dict[str, Kind] = {
    "scenario": SCENARIO,
    "seed": Seed(3),
    "seeds": Seeds([0, 1]),
    "policy": Part(FIXED),
    "objective": Choice("mean"),
    "name": Text("a run"),
    "runs": Part([("a", RUN)], confusing=([("a", 1)], [(1, RUN)], [RUN], [("a",)])),
    "trajectory": A_RUN,
    "num_threads": Count(1),
    "batch_size": Count(2),
    "predator_policy": Part(None),  # the scenarios of the table have no learned predator
    "progress": Call(None, accepts=("function", "class", "bool")),
    "render_mode": Choice("rgb_array"),
    "render_options": Part(fe.RenderOptions()),
    "num_envs": Count(2),
    "num_flocks": Count(2),
    "autoreset_mode": Choice("SameStep"),
    "max_episode_steps": Count(24, low=24),
    "infos": Choice("end"),
    "state": Choice("flock_view"),
    "per_agent": Flag(True),
    "initial_positions": Floats(POINTS),
    "initial_velocities": Floats(POINTS),
    "position": Floats([1.0, 2.0], True),
    "velocity": Floats([1.0, 2.0], True),
    "max_speed": Number(40.0, True, low=np.hypot(1.0, 2.0)),
    "field": Choice("speed"),
}
BY_TYPE: dict[str, Kind] = {"float": LEAST_0, "bool": Flag(True), "str": Text("a text")}

FUNCTIONS: dict[str, Row] = {
    "approach": Row(
        fe.approach,
        {
            "aim": Number(5.0),
            "distance": Number(50.0, low=0.0),
            "speed": Number(10.0, low=0.0),
            "direction": Floats([1.0, 2.0]),
            "initial_side": Number(100.0, low=0.0),
            "dimension": Index(2, high=3),
        },
    ),
    "episode_seed": Row(fe.episode_seed, {"episode": Seed(2)}),
    "preset": Row(fe.preset, {"name": Choice("pursuit")}, named={"name": ("scenario",)}),
    "simulate": Row(
        fe.simulate,
        {
            "scenario": Part(HUNTED, confusing=(fe.Disc(),)),
            "interaction_range": Floats(np.full(5, 4.0), low=0.0, is_scalar_fine=True),
            "predator_actions": Floats(np.full((24, 1, 2), 0.5)),
        },
        others={"schedule": optional(Floats(np.full((24, 1), 4.0), low=0.0))},
        named={"schedule": ("schedule", "interaction_range")},
    ),
    "simulate_line": Row(
        fe.simulate_line,
        {
            "scenario": Part(LINE, True, confusing=(FLOCK,)),
            "interaction_range": Number(0.25, low=0.0),
            "initial_state": Floats([0.0, 0.25, 0.5, 0.75, 1.0]),
        },
    ),
    "sweep": Row(
        fe.sweep,
        {
            "scenario": Part(FLOCK, confusing=(fe.Disc(),)),
            "interaction_ranges": Floats([0.0, 4.0], low=0.0, is_any_length=True),
        },
    ),
    "rollout": Row(fe.rollout, {"scenario": Part(FLOCK, True, confusing=(fe.Disc(),))}, others=ENV_OPTIONS),
    "rollout of lines": Row(
        lambda **arguments: fe.rollout(**arguments),
        {
            "scenario": Part(LINE, True, confusing=(fe.Disc(),)),
            "policy": Part(policies.FixedRange(0.25)),
            "seeds": Seeds([0, 1]),
            "batch_size": optional(Count(2)),
            "progress": optional(BY_NAME["progress"]),
        },
        others=LINE_OPTIONS,
    ),
    "record": Row(fe.record, others=ENV_OPTIONS),
    "load_policy": Row(
        fe.load_policy, {"path": File("policy.npz")}, after=lambda made: made.policy.parameters
    ),
    "save_policy": Row(
        fe.save_policy, {"policy": Part(CONTENDER, confusing=(FIXED,)), "path": File("made.npz")}
    ),
    "read_initial_state": Row(fe.read_initial_state, {"path": File("state.csv")}),
    "save_run": Row(records.save_run, {"path": File("made.npz")}),
    "load_run": Row(records.load_run, {"path": File("run.npz")}),
    "replay_run": Row(records.replay_run),
    "run_differences": Row(
        records.run_differences,
        {"recorded": Part(RUN, confusing=(LINE_RUN,)), "again": Part(RUN, confusing=(LINE_RUN,))},
        named={"recorded": ("recorded", "again")},
    ),
    "component_labels": Row(graph.component_labels, MOMENT),
    "neighbor_pairs": Row(graph.neighbor_pairs, MOMENT),
    "perron_matrix": Row(graph.perron_matrix, LINE_MOMENT),
    "laplacian": Row(graph.laplacian, LINE_MOMENT),
    "built_in": Row(
        registry.built_in,
        {"name": Choice("random"), "argument": Text("policies")},
        after=lambda made: (made.name, made.options, made.per_agent),
        named={"name": ("policies",)},
    ),
}


def used(result: Any) -> None:
    """Run a scenario that a call has returned."""
    if isinstance(result, fe.FlockScenario) and result.num_agents < 10:
        fe.simulate(result, 5.0, seed=1)
    elif isinstance(result, fe.LineScenario) and result.num_agents < 10:
        fe.simulate_line(result, 0.25, seed=1)
