"""``rollout`` and ``simulate``: run a policy on many seeds, or once with the whole trajectory."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any, overload

from numpy.typing import ArrayLike

from flockesc_env.common.checks import as_array, as_count, as_seed, as_seeds
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.progress import Progress, reporting
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.episodes.starts import fresh_seed
from flockesc_env.models.simulate import LineTrajectory, Trajectory, run_flock, simulate_line
from flockesc_env.policies.base import BasePolicy, Policy
from flockesc_env.policies.playing import Episodes, LineEpisodes, play, record_run
from flockesc_env.policies.rules import FixedRange, ScheduledRange
from flockesc_env.policies.setup import refuse, setup
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import Scenario, as_model

AnyPolicy = Policy | BasePolicy | str | Any
"""A policy, its name or path, or a model of stable-baselines3."""


@overload
def rollout(
    scenario: FlockScenario, policy: AnyPolicy, seeds: int | Iterable[int], **options: Any
) -> Episodes: ...
@overload
def rollout(
    scenario: LineScenario, policy: AnyPolicy, seeds: int | Iterable[int], **options: Any
) -> LineEpisodes: ...
@overload
def rollout(*arguments: Any, **options: Any) -> Any: ...  # the type depends on the scenario of the policy
def rollout(
    scenario: Any = None,
    policy: AnyPolicy = None,
    seeds: int | Iterable[int] | None = None,
    *,
    per_agent: bool | None = None,
    batch_size: int | None = None,
    num_threads: int | None = None,
    predator_policy: PredatorPolicy | None = None,
    progress: Progress | bool | None = None,
    **options: Any,
) -> Episodes | LineEpisodes:
    """Run a policy on the flock or line of every seed, to the end of the episode.

    ``rollout(policy, seeds)`` uses the scenario of the policy, or the paper's flock if it has none.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs.
        policy: sets the ranges: a policy, its name or path (``load_policy``), or a model of
            stable-baselines3. The options that it knows are used unless given here.
        seeds: seeds of the flocks, or their number n for the seeds 0 to n - 1; ``env.reset(seed=k)`` starts
            the same flock.
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
        InputError: if an argument has the wrong type or value, an option is unknown or out of bounds, the
            scenario has no predator, or the policy cannot play in it.
        MemoryError: for the seeds and outcomes.

    Examples:
        >>> rollout("paper-flock", "stubborn-leaders", seeds=3).min_mean_distance.round(2)
        array([84.65, 87.7 , 91.85])
    """
    if seeds is None:
        scenario, policy, seeds = None, scenario, policy
    elif policy is None:
        scenario, policy = None, scenario
    checked = as_seeds(seeds)
    size = None if batch_size is None else as_count(batch_size, "batch_size")
    given: Any = {"per_agent": per_agent, "predator_policy": predator_policy, "num_threads": num_threads}
    playing = setup(policy, scenario, **given, **options)
    with reporting(progress, "Rollout", len(checked)) as callback:
        columns = play(playing, checked, batch_size=size, progress=callback)
    return (LineEpisodes if isinstance(playing.scenario, LineScenario) else Episodes).of(checked, columns)


@overload
def simulate(
    scenario: FlockScenario, interaction_range: ArrayLike | None = None, **options: Any
) -> Trajectory: ...
@overload
def simulate(
    scenario: LineScenario, interaction_range: float | None = None, **options: Any
) -> LineTrajectory: ...
@overload
def simulate(
    scenario: str | None = None, *arguments: Any, **options: Any
) -> Any: ...  # the type depends on the preset
def simulate(
    scenario: Scenario | str | None = None,
    interaction_range: Any = None,
    *,
    policy: AnyPolicy = None,
    seed: int | None = None,
    initial_positions: ArrayLike | None = None,
    initial_velocities: ArrayLike | None = None,
    per_agent: bool | None = None,
    predator_policy: PredatorPolicy | None = None,
    num_threads: int | None = None,
    every: int = 1,
    record: Sequence[str] | None = None,
    **options: Any,
) -> Trajectory | LineTrajectory:
    """Run a flock for ``scenario.num_steps`` steps, or a line until its steady state.

    A line has a fixed range: only ``interaction_range`` or a ``FixedRange``, and ``seed``, can be given.
    ``simulate_line`` also takes an initial state.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs. ``None``:
            the scenario of the policy, or the paper's flock if it has none.
        interaction_range: rho in m, a scalar or one per agent, shape (n,). Give this or ``policy``.
        policy: sets the ranges; see ``rollout``. The ranges of a ``ScheduledRange`` apply to every step.
        seed: seed of the initial state, the predators, noise and randomized fields. ``env.reset(seed=seed)``
            starts the same flock. ``None``: a random seed from the operating system. ``models.Flock``
            continues a run: with the same seed, ``simulate`` would draw the same noise again.
        initial_positions: r(0) in m, shape (n, D); ``None``: drawn from the seed.
        initial_velocities: v(0) in m/s, shape (n, D); ``None``: drawn from the seed. With constant speed an
            agent has speed v0 from its first step on.
        per_agent: see ``rollout``.
        predator_policy: see ``rollout``.
        num_threads: number of threads for a large flock; ``None``: one per core. Results do not depend on it.
        every: number of steps between two recorded times.
        record: names of the recorded columns of ``Trajectory``, such as ``["polarization"]``; ``None``: all,
            of which positions and velocities take the memory.
        **options: options of the policy's environment, see ``EnvOptions``.

    Returns:
        ``Trajectory`` or, for a line, ``LineTrajectory``.

    Raises:
        InputError: if an argument has the wrong type or shape, or is negative or not finite; if the scenario
            draws a number that is out of bounds, or the policy cannot play in it.
        MemoryError: for the run.

    Examples:
        >>> run = simulate("paper-flock", 10.0, seed=7)
        >>> round(float(run.mean_distance.min()), 2)
        77.31
        >>> run.positions.shape
        (241, 300, 2)
        >>> simulate(policy="stubborn-leaders", seed=7).interaction_ranges.shape
        (240, 300)
    """
    if (interaction_range is None) == (policy is None):
        given = "neither" if policy is None else "both"
        raise InputError("interaction_range", "either interaction_range or policy", given)
    start: dict[str, Any] = {"initial_positions": initial_positions, "initial_velocities": initial_velocities}
    recording: dict[str, Any] = {"every": every, "record": record}
    steering: dict[str, Any] = {"per_agent": per_agent, "predator_policy": predator_policy}
    steering = {name: value for name, value in steering.items() if value is not None} | options
    ranges, model = interaction_range, FlockScenario() if scenario is None else as_model(scenario)
    if policy is not None:
        playing = setup(policy, scenario, num_threads=num_threads, **steering)
        player, model = playing.policy, playing.scenario
        if isinstance(player, FixedRange):
            ranges = player.interaction_range
        elif isinstance(model, LineScenario):
            raise InputError("policy", "a FixedRange for a line", player.name)
        elif isinstance(player, ScheduledRange):
            player.check_length(model.num_steps)
            ranges = player.schedule if player.per_agent else player.schedule[:, None]
        if ranges is None or (steering and isinstance(model, FlockScenario)):
            return record_run(playing, fresh_seed() if seed is None else as_seed(seed), start, **recording)
    elif isinstance(ranges, str | os.PathLike) or hasattr(ranges, "act"):
        raise InputError("interaction_range", "ranges in m (policy=.. takes a policy)", shown(ranges))
    if isinstance(model, LineScenario):
        refuse({**start, **steering, "num_threads": num_threads, "record": record}, "None for a line")
        as_count(every, "every", most=1)
        return simulate_line(model, ranges, seed=seed)
    if policy is None:
        for name, value in steering.items():
            raise InputError(name, "a policy beside it", shown(value))
        if (array := as_array(ranges, "interaction_range")).ndim > 1:
            expected = f"a scalar or shape ({model.num_agents},) (policy=ScheduledRange(..): one per step)"
            raise InputError("interaction_range", expected, f"shape {array.shape}")
    return run_flock(model, ranges, seed=seed, num_threads=num_threads, **start, **recording)
