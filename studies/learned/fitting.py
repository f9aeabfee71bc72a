"""Whether a policy fits a setting: what its observation may show, and which classes show nothing else."""

from __future__ import annotations

import dataclasses
from typing import Any, get_args

from flockesc_env import ArgumentError, EnvOptions, FlockScenario, LineOptions, NamedPolicy, Policy
from flockesc_env.policies import (
    BestCandidate,
    BestNextHeading,
    FixedRange,
    ListenWhileFleeing,
    RandomRange,
    ScheduledRange,
    StubbornLeaders,
)
from flockesc_env.policies.files import Stored
from training.config import Setting

FREE = (
    *("action_mode", "min_range", "max_range", "range_grid", "steps_per_action"),
    *("reward", "count_components"),
)
"""Options that a policy chooses itself. Those of the first line decide which ranges it sets, and when; the
reward and the number of components are not in the observation."""

_ROW_BY_ROW = (
    *get_args(Stored),
    BestCandidate,
    BestNextHeading,
    FixedRange,
    ListenWhileFleeing,
    RandomRange,
    ScheduledRange,
    StubbornLeaders,
)


def check_fits(entry: NamedPolicy, setting: Setting) -> None:
    """Refuse a policy for another problem, or one whose options show more than the setting does.

    The setting's own options say what it shows. A policy may see that and what follows from it:

    - ``per_agent``: the view is the setting's. The flock view sums up the whole flock, which no agent sees.
    - ``predator_sensing_range``: at most the setting's.
    - ``profile_ranges``: some of the setting's candidates.
    - ``extra_entries``: some of the setting's. Agents also may have ``"closest_approach"`` if there is one
      predator, because it follows from that predator's entries; ``"escape_direction"`` does not, because it
      depends on the whole flock.
    - ``objective``: the setting's, which decides the entry ``running_minimum``.

    ``FREE`` lists the other options. Memory is free, because settings say what is observed and not what is
    remembered. A policy trained in another scenario of the same model fits: it plays in the setting's.

    The check reads options, not code: see ``is_checkable``. No check finds out on which flocks the numbers of
    a policy were chosen.
    """
    model = setting.model
    if entry.scenario is not None and type(entry.scenario) is not type(model):
        raise ArgumentError("scenario", f"a {type(model).__name__}", type(entry.scenario).__name__)
    per_agent = setting.per_agent and not setting.is_line
    if entry.per_agent is not per_agent:
        raise ArgumentError("per_agent", f"{per_agent}, as in the setting", entry.per_agent)
    options: Any = LineOptions if setting.is_line else EnvOptions
    names = [field.name for field in dataclasses.fields(options)]
    unknown = sorted(set(entry.options) - set(names))
    if unknown:
        raise ArgumentError("options", f"some of {', '.join(names)}", ", ".join(unknown))
    chosen, shown = options(**entry.options), options(**setting.env_options())
    _check_some("profile_ranges", chosen.profile_ranges or (), shown.profile_ranges or ())
    if not isinstance(model, FlockScenario):
        return
    follows = ("closest_approach",) if per_agent and len(model.predators) == 1 else ()
    _check_some("extra_entries", chosen.extra_entries, (*shown.extra_entries, *follows))
    if "objective" in entry.options and chosen.objective != shown.objective:
        raise ArgumentError("objective", f"{shown.objective!r}, as in the setting", repr(chosen.objective))
    if shown.predator_sensing_range is not None:
        sensing, most = chosen.predator_sensing_range, model.predator_range
        if sensing is None or (sensing != "predator_range" and float(sensing) > most):
            expected = f"at most the setting's, 'predator_range' or {most:g} m"
            raise ArgumentError("predator_sensing_range", expected, sensing)


def _check_some(name: str, chosen: tuple[Any, ...], shown: tuple[Any, ...]) -> None:
    """Refuse entries that are not among those of the setting."""
    more = [entry for entry in chosen if entry not in shown]
    if more:
        allowed = f"some of {', '.join(map(str, shown))}" if shown else "none"
        raise ArgumentError(name, f"{allowed}, as in the setting", ", ".join(map(str, chosen)))


def is_checkable(policy: Policy) -> bool:
    """Return whether a policy is of a class that computes each row's action from that row alone.

    Such a policy consists of numbers, and a memory per row. It sees what its options show. Other code gets
    the rows of all agents at once, can hold a simulator or a ``Planner``, and can recognize the held-out
    flocks. No check of options finds that.
    """
    return type(policy) in _ROW_BY_ROW
