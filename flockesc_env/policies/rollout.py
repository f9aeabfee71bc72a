"""``rollout`` and ``record``: run a policy on many seeds, or record one run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from typing import Any, Unpack, cast, overload

from flockesc_env.common.checks import as_count, as_flag, as_policy, as_seed, as_seeds
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.progress import Progress, reporting
from flockesc_env.episodes.options import (
    EnvOptions,
    EnvOptionsDict,
    LineOptions,
    LineOptionsDict,
    env_options,
    line_options,
)
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.base import Policy, StoredPolicy, is_per_agent
from flockesc_env.policies.files import find_policy
from flockesc_env.policies.playing import Episodes, LineEpisodes, play, record_flock, results
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_model, as_scenario

AnyPolicy = Policy | NamedPolicy | str
"""A policy, a named policy, the name of a built-in policy, or the path of a policy file."""

_BATCH_SIZE, _LINE_BATCH_SIZE = 64, 256


@overload
def rollout(
    scenario: FlockScenario,
    policy: AnyPolicy,
    seeds: Iterable[int],
    *,
    per_agent: bool | None = None,
    batch_size: int | None = None,
    num_threads: int | None = None,
    predator_policy: PredatorPolicy | None = None,
    progress: Progress | bool | None = None,
    **options: Unpack[EnvOptionsDict],
) -> Episodes: ...
@overload
def rollout(
    scenario: LineScenario,
    policy: AnyPolicy,
    seeds: Iterable[int],
    *,
    batch_size: int | None = None,
    num_threads: int | None = None,
    progress: Progress | bool | None = None,
    **options: Unpack[LineOptionsDict],
) -> LineEpisodes: ...
@overload
def rollout(
    scenario: str | None, policy: AnyPolicy, seeds: Iterable[int], **arguments: Any
) -> Any: ...  # the type depends on the preset
def rollout(
    scenario: FlockScenario | LineScenario | str | None,
    policy: AnyPolicy,
    seeds: Iterable[int],
    *,
    per_agent: bool | None = None,
    batch_size: int | None = None,
    num_threads: int | None = None,
    predator_policy: PredatorPolicy | None = None,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Episodes | LineEpisodes:
    """Run a policy on the flock or line of every seed, to the end of the episode.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs. ``None``:
            the scenario in which a policy from a file was trained, otherwise the paper's flock.
        policy: sets the ranges: a policy, a ``NamedPolicy``, the name of a built-in policy, or the path of a
            policy file. The options of a named policy or a policy file are used unless given here. The
            attribute ``policy`` of a loaded policy has the options of its file and refuses others.
        seeds: seeds of the flocks; ``env.reset(seed=k)`` starts the same flock.
        per_agent: True: the policy sets one range per agent. False: one per flock. ``None``: as the policy's
            attribute ``per_agent`` says, or the observation space of the model of an ``SB3Policy``.
        batch_size: number of episodes stepped together; ``None``: 64 flocks or 256 lines. Results depend on
            it only if the policy is random. The core plays a ``NetworkPolicy`` without batches.
        num_threads: number of threads for flocks; ``None``: one per core. Lines use one thread, except under
            a ``NetworkPolicy``.
        predator_policy: controls the ``Learned`` predators, for example ``Pursue()`` or a trained
            ``SB3Policy``. ``None``: they fly straight on.
        progress: ``True``: show a progress bar on stderr. A function: called with (finished episodes, all
            episodes) after every batch.
        **options: see ``EnvOptions`` or, for a line, ``LineOptions``.

    Returns:
        ``Episodes`` or, for a line, ``LineEpisodes``.

    Raises:
        InputError: if an argument has the wrong type or value, or if an option differs from those of the
            policy's file; if an option is unknown, missing or out of bounds; if the scenario has no predator
            or draws a number that is out of bounds, or the name is not a preset.
        MemoryError: for the seeds and outcomes.

    Examples:
        >>> rollout("paper-flock", "stubborn-leaders", seeds=range(3)).min_mean_distance.round(2)
        array([84.65, 87.7 , 91.85])
    """
    entry = _named(policy, per_agent, options)
    model = entry.scenario or FlockScenario() if scenario is None else as_model(scenario)
    checked = as_seeds(seeds)
    is_line = isinstance(model, LineScenario)
    size = _LINE_BATCH_SIZE if is_line else _BATCH_SIZE
    size = size if batch_size is None else as_count(batch_size, "batch_size")
    chosen: Any = entry.options
    if is_line:
        for name, value in (("per_agent", per_agent or None), ("predator_policy", predator_policy)):
            if value is not None:
                raise InputError(name, "None for a line", shown(value))
    checked_options = line_options(chosen) if isinstance(model, LineScenario) else env_options(model, chosen)
    with reporting(progress, "Rollout", len(checked)) as callback:
        columns = play(
            entry.policy,
            checked,
            model,
            checked_options,
            per_agent=_is_per_agent(entry, per_agent, policy, model, checked_options),
            batch_size=size,
            num_threads=num_threads,
            predator_policy=predator_policy,
            progress=callback,
        )
    return results(LineEpisodes, checked, columns) if is_line else results(Episodes, checked, columns)


def record(
    scenario: FlockScenario | str | None,
    policy: AnyPolicy,
    seed: int,
    *,
    per_agent: bool | None = None,
    predator_policy: PredatorPolicy | None = None,
    **options: Unpack[EnvOptionsDict],
) -> Trajectory:
    """Run a policy on one flock and return the trajectory.

    Args:
        scenario: the flock model's parameters, or a preset's name; ``None``: the scenario in which a policy
            from a file was trained, otherwise the paper's flock.
        policy: sets the ranges; see ``rollout``.
        seed: seed of the flock; ``env.reset(seed=seed)`` starts the same flock.
        per_agent: see ``rollout``.
        predator_policy: controls the ``Learned`` predators. ``None``: they fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        InputError: if an argument has the wrong type or value; if an option is unknown, missing or out of
            bounds.
        MemoryError: for the run.
    """
    entry = _named(policy, per_agent, options)
    chosen: Any = entry.scenario if scenario is None else scenario
    model = as_scenario(chosen, FlockScenario)
    flock_options = env_options(model, cast("EnvOptionsDict", entry.options))
    return record_flock(
        entry.policy,
        as_seed(seed),
        model,
        flock_options,
        per_agent=_is_per_agent(entry, per_agent, policy, model, flock_options),
        predator_policy=predator_policy,
    )


def _named(policy: AnyPolicy, per_agent: bool | None, options: Mapping[str, Any]) -> NamedPolicy:
    """Return the policy as a ``NamedPolicy`` with this view and, where given, these options."""
    found = find_policy(policy, "policy") if isinstance(policy, str) else policy
    if isinstance(found, NamedPolicy):
        view = found.per_agent if per_agent is None else as_flag(per_agent, "per_agent")
        return replace(found, per_agent=view, options={**found.options, **options})
    as_policy(found)
    view = is_per_agent(found) if per_agent is None else as_flag(per_agent, "per_agent")
    if not isinstance(found, StoredPolicy) or found.options is None:
        return NamedPolicy(type(found).__name__, found, view, dict(options))
    values = ((field, getattr(found.options, field.name)) for field in fields(found.options))
    own = {field.name: value for field, value in values if value != field.default}
    entry = NamedPolicy(type(found).__name__, found, view, {**own, **options})
    found.check(cast("Any", entry.policy).options, per_agent=view)
    return entry


def _is_per_agent(
    entry: NamedPolicy,
    per_agent: bool | None,
    policy: AnyPolicy,
    model: FlockScenario | LineScenario,
    options: EnvOptions | LineOptions,
) -> bool:
    """Return whether the policy sets one range per agent; a model of stable-baselines3 observes agents."""
    if per_agent is not None or not isinstance(policy, SB3Policy) or not isinstance(model, FlockScenario):
        return entry.per_agent
    return policy.is_per_agent_in(model, cast("EnvOptions", options))
