"""Run a policy, given as an object, a name or a file: episodes of many seeds, or one recorded run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Unpack, cast, overload

from flockesc_env.common.checks import as_callback, as_count, as_flag, as_policy, as_seed, as_seeds
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.options import EnvOptionsDict, LineOptionsDict, env_options, line_options
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.base import Policy, is_per_agent
from flockesc_env.policies.files import find_policy
from flockesc_env.policies.playing import Episodes, play_flocks, record_flock
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.policies.rollout_line import LineEpisodes, play_lines
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_model, as_scenario

AnyPolicy = Policy | NamedPolicy | str
"""A policy, one with its options, the name of a built-in one, or a file of ``save_policy``."""

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
    progress: Callable[[int, int], None] | None = None,
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
    progress: Callable[[int, int], None] | None = None,
    **options: Unpack[LineOptionsDict],
) -> LineEpisodes: ...
@overload
def rollout(
    scenario: str | None, policy: AnyPolicy, seeds: Iterable[int], **arguments: Any
) -> Any: ...  # the model is known once the name is looked up
def rollout(
    scenario: FlockScenario | LineScenario | str | None,
    policy: AnyPolicy,
    seeds: Iterable[int],
    *,
    per_agent: bool | None = None,
    batch_size: int | None = None,
    num_threads: int | None = None,
    predator_policy: PredatorPolicy | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> Episodes | LineEpisodes:
    """Run a policy on the flock or line of every seed, to the end of the episode.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs. ``None``:
            the scenario that a policy from a file was trained in, otherwise the paper's flock.
        policy: sets the ranges. The options of a named policy or a policy file are used unless given here.
        seeds: seed k is the flock of ``env.reset(seed=k)``.
        per_agent: whether the policy sets one range per agent, or one per flock; ``None``: what the policy
            says, for example True for ``StubbornLeaders``.
        batch_size: flocks stepped together, default 64, or lines, default 256. Only a policy that draws at
            random depends on it. The core plays a ``NetworkPolicy`` without batches.
        num_threads: threads over which flocks are spread; ``None``: one per core. Lines take one, except
            under a ``NetworkPolicy``.
        predator_policy: controls the learned predators, for example ``Pursue()`` or a trained ``SB3Policy``;
            in a scenario without any, all predators become ``Learned``. ``None``: they fly straight on.
        progress: called with (finished episodes, all episodes).
        **options: see ``EnvOptions`` or, for a line, ``LineOptions``.

    Returns:
        ``Episodes`` or, for a line, ``LineEpisodes``.

    Raises:
        ArgumentError: naming the argument of a wrong type or value.
        ScenarioError: for an option out of bounds, or a line without predator.
    """
    entry = _named(policy, per_agent)
    model = _scenario(scenario, entry)
    checked, progress = as_seeds(seeds), as_callback(progress)
    size = _LINE_BATCH_SIZE if isinstance(model, LineScenario) else _BATCH_SIZE
    size = size if batch_size is None else as_count(batch_size, "batch_size")
    chosen = {**entry.options, **options}
    if isinstance(model, LineScenario):
        for name, value in (("per_agent", per_agent or None), ("predator_policy", predator_policy)):
            if value is not None:
                raise ArgumentError(name, "None for a line", shown(value))
        checked_options = line_options(cast("LineOptionsDict", chosen))
        return play_lines(
            entry.policy,
            checked,
            model,
            checked_options,
            batch_size=size,
            num_threads=num_threads,
            progress=progress,
        )
    return play_flocks(
        entry.policy,
        checked,
        model,
        env_options(model, cast("EnvOptionsDict", chosen)),
        per_agent=entry.per_agent,
        batch_size=size,
        num_threads=num_threads,
        predator_policy=predator_policy,
        progress=progress,
    )


def record(
    scenario: FlockScenario | str | None,
    policy: AnyPolicy,
    seed: int,
    *,
    per_agent: bool | None = None,
    predator_policy: PredatorPolicy | None = None,
    **options: Unpack[EnvOptionsDict],
) -> Trajectory:
    """Run a policy on one flock and return all of it, as ``simulate`` does under the ranges it chose.

    Args:
        scenario: as in ``rollout``, but no line.
        policy: as in ``rollout``.
        seed: seed of the flock.
        per_agent: as in ``rollout``.
        predator_policy: as in ``rollout``.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: naming the argument of a wrong type or value.
        OptionError: for an option that is unknown, missing or out of bounds.
    """
    entry = _named(policy, per_agent)
    chosen: Any = entry.scenario if scenario is None else scenario
    model = as_scenario(chosen, FlockScenario)
    flock_options = env_options(model, cast("EnvOptionsDict", {**entry.options, **options}))
    return record_flock(
        entry.policy,
        as_seed(seed),
        model,
        flock_options,
        per_agent=entry.per_agent,
        predator_policy=predator_policy,
    )


def _named(policy: AnyPolicy, per_agent: bool | None) -> NamedPolicy:
    """Return the policy with the view that it acts on."""
    found = find_policy(policy, "policy") if isinstance(policy, str) else policy
    if not isinstance(found, NamedPolicy):
        as_policy(found)
        found = NamedPolicy(type(found).__name__, found, per_agent=is_per_agent(found))
    if per_agent is None:
        return found
    view = as_flag(per_agent, "per_agent")
    return NamedPolicy(found.name, found.policy, view, found.options, found.scenario)


def _scenario(
    scenario: FlockScenario | LineScenario | str | None, entry: NamedPolicy
) -> FlockScenario | LineScenario:
    if scenario is None:
        return entry.scenario or FlockScenario()
    return as_model(scenario)
