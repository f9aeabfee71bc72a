"""``simulate``: run a policy, or fixed ranges, once and return the whole trajectory."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from flockesc_env.common.checks import FloatArray, as_array, as_count
from flockesc_env.common.errors import InputError, shown
from flockesc_env.models.simulate import LineTrajectory, Trajectory, run_flock, seed_or_fresh, simulate_line
from flockesc_env.policies.base import AnyPolicy
from flockesc_env.policies.rollout import episode_steps, flock_batch
from flockesc_env.policies.rules import FixedRange, ScheduledRange
from flockesc_env.policies.setup import Setup, refuse, setup
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import Scenario, as_model


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
    predator_policy: AnyPolicy = None,
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
        record: names of the columns of ``Trajectory`` to record, such as ``["polarization"]``. ``None``: all.
            Positions and velocities take most of the memory.
        **options: options of the policy's environment, see ``EnvOptions``.

    Raises:
        InputError: if the scenario draws a number that is out of bounds, or the policy cannot play in it.
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
    if policy is None:
        if isinstance(interaction_range, str | os.PathLike) or hasattr(interaction_range, "act"):
            given = shown(interaction_range)
            raise InputError("interaction_range", "ranges in m (policy=.. takes a policy)", given)
        model, ranges = FlockScenario() if scenario is None else as_model(scenario), interaction_range
        if isinstance(model, FlockScenario):
            for name, value in steering.items():
                raise InputError(name, "a policy beside it", shown(value))
            if (array := as_array(ranges, "interaction_range")).ndim > 1:
                expected = (
                    f"a scalar or shape ({model.num_agents},) (policy=ScheduledRange(..): one per step)"
                )
                raise InputError("interaction_range", expected, f"shape {array.shape}")
    else:
        entry = setup(policy, scenario, num_threads=num_threads, **steering)
        model, ranges = entry.scenario, _fixed_ranges(entry)
        if ranges is None or (steering and isinstance(model, FlockScenario)):
            return _record(entry, seed_or_fresh(seed), start, recording)
    if isinstance(model, LineScenario):
        refuse({**start, **steering, "num_threads": num_threads, "record": record}, "None for a line")
        as_count(every, "every", most=1)
        return simulate_line(model, ranges, seed=seed)
    return run_flock(model, ranges, seed=seed, num_threads=num_threads, **start, **recording)


def _fixed_ranges(entry: Setup) -> Any:
    """Return the ranges of a policy that does not observe the flock, for ``run_flock``; else ``None``."""
    policy, scenario = entry.policy, entry.scenario
    if isinstance(policy, FixedRange):
        return policy.interaction_range
    if isinstance(scenario, LineScenario):
        raise InputError("policy", "a FixedRange for a line", policy.name)
    if isinstance(policy, ScheduledRange):
        policy.check_length(scenario.num_steps)
        return policy.schedule if policy.per_agent else policy.schedule[:, None]
    return None


def _record(entry: Setup, seed: int, start: Mapping[str, Any], recording: Mapping[str, Any]) -> Trajectory:
    """Run a policy on one flock and return the trajectory; ``start`` holds given initial states."""
    scenario = cast("FlockScenario", entry.scenario)
    batch, ranges, hunts = flock_batch(entry, 1), [], []
    for chosen, _ in episode_steps(batch, entry.policy, [seed], [start]):
        ranges.append(chosen)
        hunts.append(batch.hunt)

    def per_step(actions: list[Any]) -> FloatArray:
        held = np.repeat(np.array(actions), entry.options.steps_per_action, axis=0)[: scenario.num_steps]
        rest = scenario.num_steps - len(held)  # after the last agent was caught
        return np.concatenate([held, np.repeat(held[-1:], rest, axis=0)])

    predator_actions = None if entry.predator_policy is None else per_step(hunts)
    arguments: Any = {**start, **recording, "seed": seed, "num_threads": entry.num_threads}
    return run_flock(scenario, per_step(ranges), predator_actions=predator_actions, **arguments)
