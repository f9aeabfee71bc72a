"""Whether a policy fits a task: what its observation may show, and which classes show nothing else."""

from collections.abc import Mapping, Sequence
from typing import Any, get_args

from flockesc_env.common.errors import InputError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import rules
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import Stored, as_flock_policy
from flockesc_env.policies.setup import Setup, setup
from flockesc_env.scenario.options import FREE
from flockesc_env.scenario.presets import Scenario

_ROW_BY_ROW = (*get_args(Stored), rules.RandomRange, rules.ScheduledRange, rules.BestCandidate)


def fitted(policy: Any, shown: PolicySpec, scenarios: Sequence[Scenario], env: Any = None) -> Setup:
    """Return how a policy plays a task that shows and allows ``shown``, and is scored in some scenarios.

    A policy without options and ``RandomRange`` take the view and the options of the task. ``FixedRange``
    also does, but keeps its range: the best fixed range may be longer than the task's ``max_range``. A rule
    that nobody trained keeps what it observes, and takes the task's ``max_range`` and ``steps_per_action``.
    Any other policy is refused if its options show more than the task does. It may see what the task shows
    and what follows from it:

    - ``per_agent``: the view is the task's. The flock view sums up the whole flock, which no agent sees.
    - ``extra_entries``: some of the task's. Agents also may have ``"closest_approach"`` if every
      scenario has one predator, because it follows from that predator's entries; ``"escape_direction"`` does
      not, because it depends on the whole flock.
    - ``objective``: the task's, which decides the entry ``running_minimum``.

    A model in ``env`` sees what its options show. docs/policies.md lists all options. The check reads
    options, not code: see ``is_checkable``.
    """
    player = as_flock_policy(policy)
    task = {name: value for name, value in vars(shown.options).items() if name not in FREE}
    is_alone = shown.per_agent and all(len(getattr(one, "predators", ())) == 1 for one in scenarios)
    if env is not None:
        entry = setup(player, per_agent=shown.per_agent, env=env)
        _check(vars(entry.options), task, is_alone)
        return entry
    player.check_known()
    if player.options is None or isinstance(player, rules.FixedRange | rules.RandomRange):
        taken = task.keys() - ({"max_range"} if isinstance(player, rules.FixedRange) else set())
    else:
        taken = {"objective"} - player.options.keys()
        if isinstance(player, rules.RangeRule) and player.scenario is None:
            taken |= {"max_range", "steps_per_action"}
        own = vars(setup(player, shown.scenario, per_agent=shown.per_agent).options)
        _check({name: value for name, value in own.items() if name not in taken}, task, is_alone)
    given = {name: task[name] for name in taken & task.keys()}
    return setup(player, shown.scenario, per_agent=shown.per_agent, **given)


def _check(own: Mapping[str, Any], task: Mapping[str, Any], is_alone: bool) -> None:
    """Refuse options beyond the task's. ``is_alone``: agents see a predator that is always the only one."""
    longest, steps = task["max_range"], task["steps_per_action"]
    if own.get("max_range", longest) > longest:
        raise InputError("max_range", f"at most {longest:g}, as in the task", own["max_range"])
    if own.get("steps_per_action", steps) < steps:
        raise InputError("steps_per_action", f"at least {steps}, as in the task", own["steps_per_action"])
    follows = ("closest_approach",) if is_alone else ()
    for name, more in (("profile_ranges", ()), ("extra_entries", follows)):
        allowed = (*(task.get(name) or ()), *more)
        chosen = own.get(name) or ()
        if not set(chosen) <= set(allowed):
            expected = f"some of {', '.join(map(str, allowed))}" if allowed else "none"
            raise InputError(name, f"{expected}, as in the task", ", ".join(map(str, chosen)))
    if "objective" in own and own["objective"] != task["objective"]:
        raise InputError("objective", f"{task['objective']!r}, as in the task", repr(own["objective"]))
    most = task.get("predator_sensing_range", 0.0)
    if own.get("predator_sensing_range", 0.0) > most:
        expected = f"at most {most:g} m, as in the task"
        raise InputError("predator_sensing_range", expected, own["predator_sensing_range"])


def is_checkable(policy: BasePolicy) -> bool:
    """Return whether a policy is of a class that computes each row's action from that row alone.

    Such a policy consists of numbers, and a memory per row. It sees what its options show. Other code gets
    the rows of all agents at once, can hold a simulator, and can recognize the held-out
    flocks. No check of options finds that.
    """
    return type(policy) in _ROW_BY_ROW
