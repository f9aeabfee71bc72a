"""Table of the arguments of constructors and methods of environments (see ``argument_table``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from argument_kinds import Choice, Count, Flag, Floats, Indices, Kind, Part, Seed, State
from argument_table import (
    ENV,
    ENV_OPTIONS,
    FIXED,
    FLOCK,
    HUNTED,
    LINE,
    LINE_OPTIONS,
    RENDER,
    SCENARIO,
    START,
    Row,
    goes_on,
    play,
    reset,
    started,
)

import flockesc_env as fe
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

PURSUIT = {key: kind for key, kind in ENV.items() if key != "predator_policy"}
INFOS = {"infos": Choice("end")}
PARALLEL = ENV | INFOS | {"state": Choice("flock_view")}
SLOTS = INFOS | {"num_flocks": Count(2)}
VECTOR = {
    "num_envs": Count(2),
    "autoreset_mode": Choice("SameStep"),
    "copy": Flag(True),
    "max_episode_steps": Count(24, True, low=24),
}
CONSTRUCTORS = {
    "FlockEscapeEnv": Row(fe.FlockEscapeEnv, ENV, after=play, others=ENV_OPTIONS),
    "FlockPursuitEnv": Row(
        fe.FlockPursuitEnv,
        PURSUIT | {"flock_policy": Part(FIXED, True), "per_agent": Flag(False)},
        after=play,
        others=ENV_OPTIONS,
    ),
    "FlockParallelEnv": Row(fe.FlockParallelEnv, PARALLEL, after=play, others=ENV_OPTIONS),
    "parallel_env": Row(fe.parallel_env, {"scenario": SCENARIO}, after=play, others=PARALLEL | ENV_OPTIONS),
    "env": Row(fe.env, {"scenario": SCENARIO}, after=play, others=PARALLEL | ENV_OPTIONS),
    "raw_env": Row(fe.raw_env, {"scenario": SCENARIO}, after=play, others=PARALLEL | ENV_OPTIONS),
    "FlockVectorEnv": Row(fe.FlockVectorEnv, ENV | VECTOR, after=play, others=ENV_OPTIONS),
    "AgentVectorEnv": Row(
        fe.AgentVectorEnv, ENV | VECTOR | {"num_envs": Count(10, True)}, after=play, others=ENV_OPTIONS
    ),
    "LineEscapeEnv": Row(
        fe.LineEscapeEnv,
        {"scenario": Part(LINE, True, confusing=(FLOCK,)), **RENDER},
        after=play,
        others=LINE_OPTIONS,
    ),
    "sb3.FlockVecEnv": Row(FlockVecEnv, ENV | SLOTS, after=play, others=ENV_OPTIONS),
    "sb3.AgentVecEnv": Row(AgentVecEnv, ENV | SLOTS, after=play, others=ENV_OPTIONS),
}


def _step(env: Any, **arguments: Any) -> Any:
    return env.step(**arguments)


def _set_state(env: Any, **arguments: Any) -> Any:
    return env.set_state(**arguments)


def _of_flocks(name: str, subject: Callable[[], Any]) -> dict[str, Row]:
    """Snapshots of some flocks of a batch."""
    flocks = Indices(1, True, size=2)
    return {
        f"{name}.get_state": Row(
            lambda env, **arguments: env.get_state(**arguments), {"flocks": flocks}, subject, goes_on
        ),
        f"{name}.set_state": Row(
            _set_state, {"state": State(subject().get_state(1)), "flocks": flocks}, subject, goes_on
        ),
    }


def _methods(
    name: str,
    make: Callable[[], Any],
    actions: dict[str, Kind],
    options: dict[str, Kind],
    told: str = "action",
) -> dict[str, Row]:
    subject = started(make)
    # PettingZoo requires that unknown options are ignored.
    given = Part({}, True, accepts=("dict",)) if name == "FlockParallelEnv" else Part({}, True)
    return {
        f"{name}.reset": Row(
            reset, {"seed": Seed(4, True), "options": given}, subject, goes_on, others=options
        ),
        f"{name}.step": Row(_step, actions, subject, goes_on, named=dict.fromkeys(actions, (told,))),
        f"{name}.set_state": Row(_set_state, {"state": State(subject().get_state())}, subject, goes_on),
    }


ONE, MANY = Floats([0.25]), Floats(np.full((2, 1), 0.25))
LINE_START: dict[str, Kind] = {
    "initial_state": Floats([0.0, 0.25, 0.5, 0.75, 1.0], True),
    "episode": Seed(2, True),
}
METHODS = {
    **_methods("FlockEscapeEnv", lambda: fe.FlockEscapeEnv(FLOCK), {"action": ONE}, START),
    **_methods("FlockPursuitEnv", lambda: fe.FlockPursuitEnv(FLOCK), {"action": Floats([0.5, 0.5])}, START),
    **_methods("LineEscapeEnv", lambda: fe.LineEscapeEnv(LINE), {"action": ONE}, LINE_START),
    **_methods("FlockVectorEnv", lambda: fe.FlockVectorEnv(2, FLOCK), {"actions": MANY}, START),
    **_methods(
        "AgentVectorEnv",
        lambda: fe.AgentVectorEnv(10, FLOCK),
        {"actions": Floats(np.full((10, 1), 0.25))},
        START,
    ),
    **_methods(
        "FlockParallelEnv",
        lambda: fe.FlockParallelEnv(FLOCK),
        {"actions": Part({f"agent_{i}": [0.25] for i in range(5)})},
        START,
    ),
    "FlockParallelEnv.reset_array": Row(
        lambda env, **arguments: env.reset_array(**arguments),
        {"seed": Seed(4, True), "options": Part({}, True, accepts=("dict",))},
        started(lambda: fe.FlockParallelEnv(FLOCK)),
        goes_on,
    ),
    "FlockParallelEnv.step_array": Row(
        lambda env, **arguments: env.step_array(**arguments),
        {"actions": Floats(np.full((5, 1), 0.25)), "predator_actions": Floats([[0.5, 0.5]])},
        started(lambda: fe.FlockParallelEnv(HUNTED)),
        goes_on,
        named={"actions": ("action",)},
    ),
}
METHODS |= _of_flocks("FlockVectorEnv", started(lambda: fe.FlockVectorEnv(2, FLOCK)))
METHODS |= _of_flocks("AgentVectorEnv", started(lambda: fe.AgentVectorEnv(10, FLOCK)))
for _name, _class in {"FlockVecEnv": FlockVecEnv, "AgentVecEnv": AgentVecEnv}.items():
    _subject = started(lambda make=_class: make(2, FLOCK))  # type: ignore[misc]
    _count = 2 if _class is FlockVecEnv else 10
    METHODS[f"sb3.{_name}.step"] = Row(
        _step,
        {"actions": Floats(np.full((_count, 1), 0.25))},
        _subject,
        goes_on,
        named={"actions": ("action",)},
    )
    METHODS |= _of_flocks(f"sb3.{_name}", _subject)
    METHODS[f"sb3.{_name}.seed"] = Row(
        lambda env, **arguments: env.seed(**arguments), {"seed": Seed(3, True)}, _subject, goes_on
    )
