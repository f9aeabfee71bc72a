"""Policies that set interaction ranges: one protocol, usable in every environment and in rollouts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray, as_flag, as_floats, as_policy, as_seed
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.spaces import PolicySpec

Observations = NDArray[np.float32]


class Policy(Protocol):
    """Anything that turns observation rows into actions."""

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Choose an action per row.

        Args:
            observations: shape (k, entries); one row per flock or, flock after flock, one per agent.
            spec: what rows and actions mean in the environment at hand.

        Returns:
            Actions of the environment's own space, stacked: shape (k, 1) or, where discrete, (k,).
        """
        ...


def bind(policy: Policy, env: Any) -> Callable[[Any], Any]:
    """Return ``act(obs)`` for one environment: its observations in, actions that its ``step`` takes out.

    Works with the Gymnasium environments (one observation), their vector environments and those of SB3
    (stacked observations) and the PettingZoo parallel environment (a dict per agent). ``env`` may be wrapped.

    Raises:
        ArgumentError: if one of them is something else.
    """
    as_policy(policy)
    inner = getattr(env, "unwrapped", env)
    try:
        # A Gymnasium vector environment knows its environments' attributes only through ``get_attr``.
        spec: PolicySpec = (
            inner.policy_spec if hasattr(inner, "policy_spec") else inner.get_attr("policy_spec")[0]
        )
    except (AttributeError, TypeError):
        raise ArgumentError("env", "an environment of this package", shown(env)) from None

    def act(observation: Any) -> Any:
        if isinstance(observation, dict):
            actions = policy.act(np.stack(list(observation.values())), spec)
            return dict(zip(observation, actions, strict=True))
        if observation.ndim == 1:
            return policy.act(observation[np.newaxis], spec)[0]
        return policy.act(observation, spec)

    return act


class FixedRange:
    """Always the same range: what the paper's grid search chooses among.

    Args:
        interaction_range: rho in m.

    Raises:
        ArgumentError: for anything but a number of at least 0.
    """

    def __init__(self, interaction_range: float) -> None:
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Choose the range for every row."""
        return spec.actions.from_ranges(np.full(len(observations), self.interaction_range))


class RandomRange:
    """Ranges drawn uniformly from all that an action can set, anew for every row and call.

    Args:
        seed: seed of the draws; ``None``: one from the operating system.

    Raises:
        ArgumentError: for a seed that is none.
    """

    def __init__(self, seed: int | None = None) -> None:
        self._rng = np.random.default_rng(None if seed is None else as_seed(seed))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Draw a range for every row."""
        actions = spec.actions
        return actions.from_ranges(self._rng.uniform(actions.min_range, actions.max_range, len(observations)))


class ScheduledRange:
    """Ranges that depend on the time alone.

    Args:
        schedule: rho in m for every step of the episode: (T,), one for all, or (T, n), one per agent. Where
            an action holds for several steps, the entry of its first step counts.
    """

    def __init__(self, schedule: ArrayLike) -> None:
        self.schedule = as_floats(schedule, "schedule", least=0.0)
        if self.schedule.ndim not in {1, 2} or not self.schedule.size:
            raise ArgumentError("schedule", "shape (T,) or (T, n)", f"shape {self.schedule.shape}")

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Look up the range of every row.

        Raises:
            ArgumentError: if the schedule fits neither the episode's steps nor the rows.
        """
        if len(self.schedule) != spec.num_steps:
            raise ArgumentError("schedule", f"{spec.num_steps} steps", len(self.schedule))
        time = observations[:, spec.layout.index("time")].astype(np.float64)
        steps = np.minimum(np.rint(time * spec.num_steps).astype(int), spec.num_steps - 1)
        if self.schedule.ndim == 1:
            return spec.actions.from_ranges(self.schedule[steps])
        agents = self.schedule.shape[1]
        if not spec.per_agent or agents != spec.num_agents or len(observations) % agents:
            raise ArgumentError(
                "schedule", "a row of every agent at once for shape (T, n)", len(observations)
            )
        return spec.actions.from_ranges(self.schedule[steps, np.arange(len(steps)) % agents])


class StubbornLeaders:
    """The rule of thumb: whoever already heads away from the predator stops listening; others listen.

    rho_i = 0 if the cosine of the own heading with the direction away from the predator exceeds
    ``min_cosine``, else ``interaction_range``. An agent that senses no predator listens. Needs one
    observation per agent.

    Args:
        min_cosine: cosine above which an agent stops listening.
        interaction_range: rho in m of those who listen.
    """

    def __init__(self, min_cosine: float = 0.8, interaction_range: float = 10.0) -> None:
        self.min_cosine = float(as_floats(min_cosine, "min_cosine", ()))
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Choose who listens.

        Raises:
            ArgumentError: if rows are flocks instead of agents.
        """
        # Directions are in the agent's own frame, whose first axis is its heading.
        cosine_away = -observations[:, spec.layout.index("predator_direction_ahead")]
        ranges: FloatArray = np.where(cosine_away > self.min_cosine, 0.0, self.interaction_range)
        return spec.actions.from_ranges(ranges)


class StubbornWitnesses:
    """The rule where the predator is seen only nearby: wait, hear of it, and listen no more once it was seen.

    Until ``patience`` has passed, and once agent i has sensed the predator for the rest of the episode,
    rho_i = 0. Else rho_i = ``first_range`` at its first action after the wait, and ``interaction_range`` from
    then on. Needs one observation per agent, and all agents at every action: it remembers who has seen the
    predator until an episode begins. Made for one step per action.

    Args:
        patience: share of the episode during which nobody listens: before the predator comes, agents would
            only agree on some direction.
        first_range: rho in m of the first action after that, by which news travels far at once.
        interaction_range: rho in m of those who go on listening.

    Several rules, with arguments of shape (k,), share the rows in equal, consecutive parts.
    """

    def __init__(
        self, patience: ArrayLike = 0.125, first_range: ArrayLike = 60.0, interaction_range: ArrayLike = 17.0
    ) -> None:
        given = {"patience": patience, "first_range": first_range, "interaction_range": interaction_range}
        columns = [as_floats(value, name, least=0.0) for name, value in given.items()]
        shape = columns[0].shape
        for name, column in zip(given, columns, strict=True):
            if column.shape != shape or column.ndim > 1:
                raise ArgumentError(name, "a number, or as many as for the other arguments", column.shape)
        self.parameters: FloatArray = np.stack(columns, axis=-1)
        self._has_seen = self._has_heard = np.zeros(0, bool)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Choose who listens.

        Raises:
            ArgumentError: if rows are flocks instead of agents, or appear or vanish within an episode.
        """
        spec.layout.index("predator_direction_ahead")  # an entry of agents only
        time = observations[:, spec.layout.index("time")]
        begins = time == 0
        if begins.all():
            self._has_seen = self._has_heard = np.zeros(len(observations), bool)
        if len(self._has_seen) != len(observations):
            raise ArgumentError("observations", f"{len(self._has_seen)} rows as before", len(observations))
        rules = np.atleast_2d(self.parameters)
        if len(observations) % len(rules):
            raise ArgumentError("observations", f"rows in {len(rules)} equal parts", len(observations))
        patience, first, later = np.repeat(rules, len(observations) // len(rules), axis=0).T
        is_seen = observations[:, spec.layout.index("predator_sensed")] > 0
        self._has_seen = (self._has_seen & ~begins) | is_seen
        heard = self._has_heard & ~begins
        waits = time < patience
        ranges = np.where(waits | self._has_seen, 0.0, np.where(heard, later, first))
        self._has_heard = heard | ~waits
        return spec.actions.from_ranges(ranges)


class SB3Policy:
    """A model trained with stable-baselines3, or anything with its ``predict``.

    The environment must have the options that the model was trained with.

    Args:
        model: the model.
        deterministic: whether to take the mode of the action distribution instead of a sample.
    """

    def __init__(self, model: Any, *, deterministic: bool = True) -> None:
        if isinstance(model, type) or not callable(getattr(model, "predict", None)):
            raise ArgumentError("model", "a model, which has a method predict", shown(model))
        self.model = model
        self.deterministic = as_flag(deterministic, "deterministic")

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:  # noqa: ARG002, the protocol
        """Ask the model for an action per row."""
        actions: NDArray[Any]
        actions, _ = self.model.predict(observations, deterministic=self.deterministic)
        return actions
