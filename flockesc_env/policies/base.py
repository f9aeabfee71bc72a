"""``Policy`` (protocol of range policies), ``RowMemory`` (base of policies with a memory) and ``bind``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_policy
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.spaces import PolicySpec

Observations = NDArray[np.float32]


class Policy(Protocol):
    """Protocol of range policies: objects that turn observation rows into actions.

    Only ``act`` is required. A policy that keeps a memory between actions also has a method ``reset(rows)``,
    see ``RowMemory``; rollouts, ``bind`` and ``FlockPursuitEnv`` call it before the first action of every
    episode. A policy that chooses one range per agent has an attribute ``per_agent = True``.
    """

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return one action per observation row.

        Args:
            observations: shape (k, entries); one row per flock, or one per agent, ordered by flock.
            spec: shapes and meaning of observations and actions.

        Returns:
            Actions in the environment's action space, shape (k, 1) or, for discrete actions, (k,).
        """
        ...


class RowMemory:
    """Base class of policies with a memory per observation row.

    An object can be used in one environment at a time.
    """

    _begins: NDArray[np.bool] | None = None

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Clear the memory of the rows in which an episode begins with the next action.

        Args:
            rows: whether an episode begins in each row of the next observations, shape (k,).

        Raises:
            ArgumentError: if the number of rows changes while some episodes are running.
        """
        before = self._begins
        if rows.all() or before is None:
            self._begins = np.ones(len(rows), bool)
        elif len(rows) == len(before):
            self._begins = before | rows
        else:
            raise ArgumentError("rows", f"{len(before)} rows as before", len(rows))

    def _take_begins(self, count: int) -> NDArray[np.bool]:
        """Return whether an episode begins in each of ``count`` rows; if ``reset`` was never called, in all.

        Raises:
            ArgumentError: if the number of rows has changed.
        """
        begins = np.ones(count, bool) if self._begins is None else self._begins
        if len(begins) != count:
            raise ArgumentError("observations", f"{len(begins)} rows as before", count)
        self._begins = np.zeros(count, bool)
        return begins


def is_per_agent(policy: Any) -> bool:
    """Return whether a policy chooses one range per agent."""
    return bool(getattr(policy, "per_agent", False))


def bind(policy: Policy, env: Any) -> Callable[[Any], Any]:
    """Return a function ``act(obs)`` that returns the policy's action for ``env.step``.

    Observations can be those of the Gymnasium environments, the vector environments (Gymnasium and SB3,
    stacked) and the PettingZoo parallel environment (a dict per agent). The policy's memory of a row is reset
    when the ``time`` of its observation is 0.

    Args:
        policy: the policy.
        env: an environment of this package, which may be wrapped.

    Raises:
        ArgumentError: if ``policy`` is not a policy, or ``env`` is not an environment of this package.
    """
    as_policy(policy)
    inner = getattr(env, "unwrapped", env)
    try:
        # Gymnasium's vector environments give access to their environments' attributes through ``get_attr``.
        spec: PolicySpec = (
            inner.policy_spec if hasattr(inner, "policy_spec") else inner.get_attr("policy_spec")[0]
        )
    except (AttributeError, TypeError):
        raise ArgumentError("env", "an environment of this package", shown(env)) from None
    time = spec.layout.index("time")

    def act_on_rows(observations: Observations) -> NDArray[Any]:
        begins = observations[:, time] == 0
        if begins.any():
            reset_policy(policy, begins)
        return policy.act(observations, spec)

    def act(observation: Any) -> Any:
        if isinstance(observation, dict):
            actions = act_on_rows(np.stack(list(observation.values())))
            return dict(zip(observation, actions, strict=True))
        if observation.ndim == 1:
            return act_on_rows(observation[np.newaxis])[0]
        return act_on_rows(observation)

    return act
