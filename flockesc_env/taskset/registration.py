"""Gymnasium ids of the environments and of the tasks, such as ``flockesc/one-range-v1``."""

from typing import Any, NoReturn

import gymnasium

from flockesc_env.common.errors import InputError, shown
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.scenario.options import FREE, EnvOptionsDict
from flockesc_env.taskset.task import Task, tasks

_VECTOR = "flockesc_env.envs.vector:BatchVectorEnv"

FIXED = {"scenario", "per_agent", *EnvOptionsDict.__annotations__} - {"max_range", *FREE}
"""Arguments that a task fixes."""


def register() -> None:
    """Register all ids."""
    one = "flockesc_env.envs.gymnasium"
    gymnasium.register("flockesc/FlockEscape-v1", f"{one}:FlockEscapeEnv", vector_entry_point=_VECTOR)
    refusal, agents = f"{__name__}:no_single_env", {"per_agent": True}
    gymnasium.register("flockesc/FlockAgents-v1", refusal, vector_entry_point=_VECTOR, kwargs=agents)
    gymnasium.register(
        "flockesc/Predator-v1", f"{one}:PredatorEnv", vector_entry_point=f"{__name__}:make_predators"
    )
    gymnasium.register("flockesc/LineEscape-v1", "flockesc_env.envs.line:LineEscapeEnv")
    for task in tasks.values():
        gymnasium.register(
            task.id,
            f"{__name__}:make_task",
            vector_entry_point=f"{__name__}:make_task_vec" if task.spec.model == "flock" else None,
            max_episode_steps=task.num_actions,
            kwargs={"task": task.name},
        )


def no_single_env(**_: Any) -> NoReturn:
    """Refuse ``gymnasium.make("flockesc/FlockAgents-v1")``, which has no environment of one slot."""
    _refuse_single_env("flockesc/FlockAgents-v1", 300, "flockesc_env.parallel_env()")


def make_predators(num_envs: int | None = None, scenario: Any = None, **options: Any) -> BatchVectorEnv:
    """Return ``flockesc/Predator-v1`` for ``gymnasium.make_vec``, with one slot per predator."""
    return BatchVectorEnv(num_envs, scenario, side="predator", **options)


def make_task(task: str, **options: Any) -> gymnasium.Env[Any, Any]:
    """Return the Gymnasium environment of a task, for ``gymnasium.make``; no option may change the task."""
    chosen = _checked(task, options)
    if chosen.per_agent:
        way = f'flockesc_env.tasks["{task}"].parallel_env()'
        _refuse_single_env(chosen.id, chosen.policy_spec.num_agents, way)
    return chosen.env(**options)


def make_task_vec(task: str, num_envs: int, **options: Any) -> BatchVectorEnv:
    """Return the vector environment of a task, for ``gymnasium.make_vec``; see ``make_task``."""
    chosen: Any = _checked(task, options)
    options = {"reward": chosen.reward, **chosen.options, **options}
    return BatchVectorEnv(num_envs, chosen.scenario, per_agent=chosen.per_agent, **options)


def _checked(name: str, options: dict[str, Any]) -> Task:
    """Return a task after a check that no option changes it."""
    task = tasks[name]
    for option in options.keys() & FIXED:
        kind = "LineEscape" if task.spec.model == "line" else "FlockEscape"
        way = f'gymnasium.make("flockesc/{kind}-v1", {option}=..)'
        if task.per_agent:
            way = f'gymnasium.make_vec("flockesc/FlockAgents-v1", {option}=..)'
        expected = f"no argument, because the task {name} fixes it ({way} accepts one)"
        raise InputError(option, expected, shown(options[option]))
    return task


def _refuse_single_env(name: str, num_agents: int, way: str) -> NoReturn:
    call = f'gymnasium.make_vec("{name}", num_envs={num_agents} * flocks)'
    raise InputError("id", f"one range per flock; for one per agent, call {call} or {way}", name)
