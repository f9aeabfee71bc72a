"""Whether a policy fits a task: what its observation may show, and which classes show nothing else."""

from __future__ import annotations

import dataclasses
from typing import Any, get_args

import numpy as np

from flockesc_env.common.errors import InputError
from flockesc_env.policies import rules
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import Stored
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import UNOBSERVED, EnvOptions, LineOptions
from flockesc_env.taskset.definition import TaskDefinition

FREE = ("action_mode", "min_range", "range_grid", *UNOBSERVED)
"""Options that a policy chooses itself."""

_ABOUT = ("name", "per_agent", "options", "scenario")
"""Attributes of every policy that are not its numbers."""

_ROW_BY_ROW = (
    *(*get_args(Stored), rules.FixedRange, rules.RandomRange, rules.ScheduledRange),
    *(rules.BestCandidate, rules.BestNextHeading, rules.ListenWhileFleeing, rules.StubbornLeaders),
)


def fitted(policy: BasePolicy, task: TaskDefinition) -> BasePolicy:
    """Return a policy as it plays a task, with the task's objective, after ``check_fits``.

    A policy without options and ``RandomRange`` take the view and the options of the task. ``FixedRange``
    also does, but keeps its range: the best fixed range may be longer than the task's ``max_range``. A rule
    that nobody trained keeps what it observes, and takes the task's ``max_range`` and ``steps_per_action``.
    """
    policy.check_known()
    if policy.options is None or isinstance(policy, rules.FixedRange | rules.RandomRange):
        own = policy.default_options(task.scenario) if isinstance(policy, rules.FixedRange) else {}
        return policy.with_options(per_agent=task.per_agent, **{**task.options, **own})
    check_fits(policy, task)
    taken = {"objective", *(("max_range", "steps_per_action") if _is_bound(policy) else ())}
    return policy.with_options(**{name: task.options[name] for name in taken & task.options.keys()})


def check_fits(policy: BasePolicy, task: TaskDefinition) -> None:
    """Refuse a policy for another problem, or one whose options show more than the task does.

    The task's own options say what it shows. A policy may see that and what follows from it:

    - ``per_agent``: the view is the task's. The flock view sums up the whole flock, which no agent sees.
    - ``predator_sensing_range``: at most the task's.
    - ``profile_ranges``: some of the task's candidates.
    - ``extra_entries``: some of the task's. Agents also may have ``"closest_approach"`` if every
      scenario has one predator, because it follows from that predator's entries; ``"escape_direction"`` does
      not, because it depends on the whole flock.
    - ``objective``: the task's, which decides the entry ``running_minimum``.

    It may set ranges up to the task's ``max_range``, and at most as often: its ``steps_per_action`` is at
    least the task's. ``FREE`` lists the other options. Memory is free, because tasks say what is observed and
    not what is remembered. A policy trained in another scenario of the same model fits: it plays in the
    task's.

    The check reads options, not code: see ``is_checkable``. No check finds out on which flocks the numbers of
    a policy were chosen.
    """
    model = task.scenario
    if policy.scenario is not None and type(policy.scenario) is not type(model):
        raise InputError("scenario", f"a {type(model).__name__}", type(policy.scenario).__name__)
    if policy.per_agent is not task.per_agent:
        raise InputError("per_agent", f"{task.per_agent}, as in the task", policy.per_agent)
    options: Any = EnvOptions if isinstance(model, FlockScenario) else LineOptions
    names = [field.name for field in dataclasses.fields(options)]
    own = policy.options or {}
    unknown = sorted(set(own) - set(names))
    if unknown:
        raise InputError("options", f"some of {', '.join(names)}", ", ".join(unknown))
    chosen, shown = options(**policy.all_options(model)), options(**task.options)
    if not _is_bound(policy):
        longest, steps = shown.max_range, shown.steps_per_action
        if chosen.max_range > longest:
            raise InputError("max_range", f"at most {longest:g}, as in the task", chosen.max_range)
        if chosen.steps_per_action < steps:
            expected = f"at least {steps}, as in the task"
            raise InputError("steps_per_action", expected, chosen.steps_per_action)
    if not isinstance(model, FlockScenario):
        return
    _check_some("profile_ranges", chosen.profile_ranges or (), shown.profile_ranges or ())
    played = [one for one in task.scenarios.values() if isinstance(one, FlockScenario)]
    is_alone = all(len(one.predators) == 1 for one in played)
    follows = ("closest_approach",) if task.per_agent and is_alone else ()
    _check_some("extra_entries", chosen.extra_entries, (*shown.extra_entries, *follows))
    if "objective" in own and chosen.objective != shown.objective:
        raise InputError("objective", f"{shown.objective!r}, as in the task", repr(chosen.objective))
    sensing, most = chosen.predator_sensing_range, shown.predator_sensing_range
    if sensing > most:
        raise InputError("predator_sensing_range", f"at most {most:g} m, as in the task", sensing)


def _is_bound(policy: BasePolicy) -> bool:
    """Return whether a policy is a rule that nobody trained; it plays at the task's rate and ranges."""
    return isinstance(policy, rules.RangeRule) and policy.scenario is None


def _check_some(name: str, chosen: tuple[Any, ...], shown: tuple[Any, ...]) -> None:
    """Refuse entries that are not among those of the task."""
    more = [one for one in chosen if one not in shown]
    if more:
        allowed = f"some of {', '.join(map(str, shown))}" if shown else "none"
        raise InputError(name, f"{allowed}, as in the task", ", ".join(map(str, chosen)))


def content(policy: BasePolicy, task: TaskDefinition) -> Any:
    """Return what decides the actions of a checkable policy in a task: its class, its numbers, its options.

    Names, the training scenario, and options that no action depends on do not count.
    """
    policy = fitted(policy, task)
    options: Any = EnvOptions if isinstance(task.scenario, FlockScenario) else LineOptions
    chosen = dataclasses.asdict(options(**policy.all_options(task.scenario)))
    numbers = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in vars(policy).items()
        if not name.startswith("_") and name not in _ABOUT
    }
    return type(policy), numbers, {name: chosen[name] for name in chosen if name not in UNOBSERVED}


def is_checkable(policy: BasePolicy) -> bool:
    """Return whether a policy is of a class that computes each row's action from that row alone.

    Such a policy consists of numbers, and a memory per row. It sees what its options show. Other code gets
    the rows of all agents at once, can hold a simulator, and can recognize the held-out
    flocks. No check of options finds that.
    """
    return type(policy) in _ROW_BY_ROW
