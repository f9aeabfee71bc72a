"""Table of the arguments of constructors and methods of environments (see ``argument_table``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from argument_kinds import Count, Flag, Floats, Indices, Kind, Part, Seed, State
from argument_table import (
    ENV_OPTIONS,
    FIXED,
    FLOCK,
    HUNTED,
    LINE,
    LINE_OPTIONS,
    START,
    Row,
    goes_on,
    play,
    reset,
    started,
)

import flockesc_env as fe
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

PARALLEL = Row(fe.FlockParallelEnv, after=play, others=ENV_OPTIONS)
FACTORY = {"after": play, "others": {**PARALLEL.arguments, **ENV_OPTIONS}}
CONSTRUCTORS: dict[str, Row] = {
    "FlockEscapeEnv": Row(fe.FlockEscapeEnv, after=play, others=ENV_OPTIONS),
    "FlockPursuitEnv": Row(
        fe.FlockPursuitEnv,
        {"flock_policy": Part(FIXED), "per_agent": Flag(False)},
        after=play,
        others=ENV_OPTIONS,
    ),
    "FlockParallelEnv": PARALLEL,
    "parallel_env": Row(fe.parallel_env, **FACTORY),
    "env": Row(fe.env, **FACTORY),
    "raw_env": Row(fe.raw_env, **FACTORY),
    "FlockVectorEnv": Row(fe.FlockVectorEnv, after=play, others=ENV_OPTIONS),
    "AgentVectorEnv": Row(fe.AgentVectorEnv, {"num_envs": Count(10)}, after=play, others=ENV_OPTIONS),
    "LineEscapeEnv": Row(
        fe.LineEscapeEnv,
        {"scenario": Part(LINE, True, confusing=(FLOCK,))},
        after=play,
        others=LINE_OPTIONS,
    ),
    "sb3.FlockVecEnv": Row(FlockVecEnv, after=play, others=ENV_OPTIONS),
    "sb3.AgentVecEnv": Row(AgentVecEnv, after=play, others=ENV_OPTIONS),
}


def _method(name: str) -> Callable[..., Any]:
    return lambda env, **arguments: getattr(env, name)(**arguments)


def _rows(
    name: str, make: Callable[[], Any], actions: dict[str, Kind], options: dict[str, Kind] | None
) -> dict[str, Row]:
    """Return the rows of an environment's methods; without ``options``, of stable-baselines3."""
    subject, flocks = started(make), Indices(1, True, size=2)
    if "Vec" in name:
        states = {"state": State(subject().get_state(1)), "flocks": flocks}
        methods: dict[str, dict[str, Kind]] = {"get_state": {"flocks": flocks}, "set_state": states}
    else:
        methods = {"set_state": {"state": State(subject().get_state())}}
    if options is None:
        methods["seed"] = {"seed": Seed(3, True)}
    rows = {method: Row(_method(method), kinds, subject, goes_on) for method, kinds in methods.items()}
    rows["step"] = Row(_method("step"), actions, subject, goes_on, named=dict.fromkeys(actions, ("action",)))
    if options is not None:
        # PettingZoo requires that unknown options are ignored.
        given = Part({}, True, accepts=("dict",) if name == "FlockParallelEnv" else ())
        kinds = {"seed": Seed(4, True), "options": given}
        rows["reset"] = Row(reset, kinds, subject, goes_on, others=options)
    return {f"{name}.{method}": row for method, row in rows.items()}


ONE = {"action": Floats([0.25])}
MANY = {count: {"actions": Floats(np.full((count, 1), 0.25))} for count in (2, 5, 10)}
DICT = {"actions": Part({f"agent_{i}": [0.25] for i in range(5)})}
LINE_START: dict[str, Kind] = {
    "initial_state": Floats([0.0, 0.25, 0.5, 0.75, 1.0], True),
    "episode": Seed(2, True),
}
METHODS = {
    **_rows("FlockEscapeEnv", lambda: fe.FlockEscapeEnv(FLOCK), ONE, START),
    **_rows("FlockPursuitEnv", lambda: fe.FlockPursuitEnv(FLOCK), {"action": Floats([0.5, 0.5])}, START),
    **_rows("LineEscapeEnv", lambda: fe.LineEscapeEnv(LINE), ONE, LINE_START),
    **_rows("FlockVectorEnv", lambda: fe.FlockVectorEnv(2, FLOCK), MANY[2], START),
    **_rows("AgentVectorEnv", lambda: fe.AgentVectorEnv(10, FLOCK), MANY[10], START),
    **_rows("FlockParallelEnv", lambda: fe.FlockParallelEnv(FLOCK), DICT, START),
    **_rows("sb3.FlockVecEnv", lambda: FlockVecEnv(2, FLOCK), MANY[2], None),
    **_rows("sb3.AgentVecEnv", lambda: AgentVecEnv(2, FLOCK), MANY[10], None),
    "FlockParallelEnv.reset_array": Row(
        _method("reset_array"),
        {"seed": Seed(4, True), "options": Part({}, True, accepts=("dict",))},
        started(lambda: fe.FlockParallelEnv(FLOCK)),
        goes_on,
    ),
    "FlockParallelEnv.step_array": Row(
        _method("step_array"),
        {**MANY[5], "predator_actions": Floats([[0.5, 0.5]])},
        started(lambda: fe.FlockParallelEnv(HUNTED)),
        goes_on,
        named={"actions": ("action",)},
    ),
}
