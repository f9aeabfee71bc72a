"""The protocol of range policies, the memory of those that remember, and ``bind`` to an environment."""

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
    """Anything that turns observation rows into actions.

    A policy needs only ``act``. A policy that remembers something between actions also has ``reset(rows)``,
    as ``RowMemory`` does: rollouts, ``bind`` and ``FlockPursuitEnv`` call it before the first action of every
    episode. A policy that decides for single agents says so by ``per_agent = True``.
    """

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Choose an action per row.

        Args:
            observations: shape (k, entries); one row per flock or, flock after flock, one per agent.
            spec: what rows and actions mean in the environment at hand.

        Returns:
            Actions of the environment's own space, stacked: shape (k, 1) or, where discrete, (k,).
        """
        ...


class RowMemory:
    """Base of policies that remember something about every row.

    One object plays one environment at a time.
    """

    _begins: NDArray[np.bool] | None = None

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Forget some rows, whose episodes begin with the next action.

        Args:
            rows: shape (k,), one entry per row of the next observations: True where an episode begins.

        Raises:
            ArgumentError: if the number of rows changes and the episodes of some of them go on.
        """
        before = self._begins
        if rows.all() or before is None:
            self._begins = np.ones(len(rows), bool)
        elif len(rows) == len(before):
            self._begins = before | rows
        else:
            raise ArgumentError("rows", f"{len(before)} rows as before", len(rows))

    def _take_begins(self, count: int) -> NDArray[np.bool]:
        """Return in which of ``count`` rows an episode begins; without any ``reset`` in all of them.

        Raises:
            ArgumentError: if there were another number of rows before.
        """
        begins = np.ones(count, bool) if self._begins is None else self._begins
        if len(begins) != count:
            raise ArgumentError("observations", f"{len(begins)} rows as before", count)
        self._begins = np.zeros(count, bool)
        return begins


def is_per_agent(policy: Any) -> bool:
    """Return whether a policy decides for single agents."""
    return bool(getattr(policy, "per_agent", False))


def bind(policy: Policy, env: Any) -> Callable[[Any], Any]:
    """Return ``act(obs)`` for one environment: its observations in, actions that its ``step`` takes out.

    Works with the Gymnasium environments (one observation), their vector environments and those of SB3
    (stacked observations) and the PettingZoo parallel environment (a dict per agent). ``env`` may be wrapped.
    The policy's memory of a row is reset where the time of an observation is 0.

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
