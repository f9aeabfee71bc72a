"""``Policy`` (protocol of range policies), ``bind``, and base classes of policies.

``RowMemory`` is for policies with a memory, ``StoredPolicy`` for those that files contain.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import fields
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_policy
from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.options import UNOBSERVED, EnvOptions, LineOptions
from flockesc_env.episodes.predators import PredatorPolicySpec, reset_policy
from flockesc_env.episodes.spaces import PolicySpec

Observations = NDArray[np.float32]


class Policy(Protocol):
    """Protocol of range policies: objects that turn observation rows into actions.

    Only ``act`` is required. A policy that keeps a memory between actions also has a method ``reset(rows)``,
    see ``RowMemory``; rollouts, ``bind`` and ``PredatorEnv`` call it before the first action of every
    episode, ``PredatorEnv`` also after ``set_state``. A policy that chooses one range per agent has an
    attribute ``per_agent = True``.
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

    ``act`` reads the memory at its start (``_begin``, ``_recall``) and replaces it at its end
    (``_remember``), so that an exception on the way leaves it unchanged. An object can be used in one
    environment at a time.
    """

    _begins: NDArray[np.bool] | None = None
    _memory: tuple[Any, ...] = ()

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Clear the memory of the rows in which an episode begins with the next action.

        Args:
            rows: whether an episode begins in each row of the next observations, shape (k,).

        Raises:
            InputError: if the number of rows changes while some episodes are running.
        """
        before = self._begins
        if rows.all() or before is None:
            self._begins = np.ones(len(rows), bool)
        elif len(rows) == len(before):
            self._begins = before | rows
        else:
            raise InputError("rows", f"{len(before)} rows as before", len(rows))

    def _begin(self, count: int) -> NDArray[np.bool]:
        """Return whether an episode begins in each of ``count`` rows; if ``reset`` was never called, in all.

        Raises:
            InputError: if the number of rows has changed.
        """
        begins = np.ones(count, bool) if self._begins is None else self._begins
        if len(begins) != count:
            raise InputError("observations", f"{len(begins)} rows as before", count)
        return begins

    def _recall(self, begins: NDArray[np.bool], *blank: Any) -> list[NDArray[Any]]:
        """Return a copy of the memory: one array per entry of ``blank``, which rows in ``begins`` have."""
        if begins.all():
            return [np.repeat([entry], len(begins), axis=0) for entry in blank]
        memory = [array.copy() for array in self._memory]
        for array, entry in zip(memory, blank, strict=True):
            array[begins] = entry
        return memory

    def _remember(self, count: int, *memory: Any) -> None:
        """Replace the memory of ``count`` rows, whose episodes have begun."""
        self._memory, self._begins = memory, np.zeros(count, bool)


class StoredPolicy:
    """Base class of policies that know the options with which they were saved.

    Attributes:
        options: options of the environment for which the policy was saved; ``None``: the policy was not read
            from a file and plays with any options.
        per_agent: True: the policy needs one observation per agent. False: one per flock. ``None``: any.
    """

    options: EnvOptions | LineOptions | None = None
    per_agent: bool | None = None

    def with_options(self, options: EnvOptions | LineOptions, *, per_agent: bool) -> Self:
        """Return a copy that knows these options and, unless its class decides, this view."""
        policy = copy(self)
        policy.options = options
        if type(self).per_agent is None:
            policy.per_agent = per_agent
        return policy

    def check(self, options: EnvOptions | LineOptions, *, per_agent: bool) -> None:
        """Check that an environment has the view and the options of this policy; see ``check_options``.

        Raises:
            InputError: if the view or an option differs.
        """
        if self.per_agent is not None and per_agent != self.per_agent:
            rows = "agent" if self.per_agent else "flock"
            expected = f"{self.per_agent}, because the policy needs one observation per {rows}"
            raise InputError("per_agent", expected, per_agent)
        if self.options is not None:
            check_options(self.options, options, "saved (use **load_policy(path).options)")


def check_options(known: EnvOptions | LineOptions, options: EnvOptions | LineOptions, origin: str) -> None:
    """Check that an environment has the options with which a policy was ``origin``: trained or saved.

    The options in ``UNOBSERVED`` may differ.

    Raises:
        InputError: if an option differs.
    """
    for field in fields(known):
        expected, given = (getattr(each, field.name, None) for each in (known, options))
        if expected != given and field.name not in UNOBSERVED:
            expected = f"{expected!r}, with which the policy was {origin}"
            raise InputError(field.name, expected, shown(given))


def is_per_agent(policy: Any) -> bool:
    """Return whether a policy chooses one range per agent."""
    return bool(getattr(policy, "per_agent", False))


def normalizer_of(env: Any) -> Any:
    """Return the ``VecNormalize`` among the wrappers of an environment that normalizes observations, or None.

    Attributes are looked up in ``__dict__``, because wrappers also have those of the inner environment.
    """
    while env is not None and not getattr(env, "__dict__", {}).get("norm_obs"):
        env = getattr(env, "__dict__", {}).get("venv")
    return env


def _check_wrappers(env: Any, spec: PolicySpec | PredatorPolicySpec) -> None:
    for name, expected in (
        ("observation_space", spec.layout.space()),
        ("action_space", (spec.actions if isinstance(spec, PolicySpec) else spec).space()),
    ):
        space = getattr(env, f"single_{name}", None) or getattr(env, name)
        found = space(env.possible_agents[0]) if callable(space) else space
        is_clipped = name == "action_space" and bool(np.isinf(getattr(found, "low", 0.0)).all())
        if found != expected and not is_clipped:
            raise InputError(f"env.{name}", "that of env.unwrapped, which no wrapper changes", found)
    if normalizer_of(env) is not None:
        raise InputError("env", "observations that no VecNormalize changes", shown(env))


def bind(policy: Policy, env: Any) -> Callable[[Any], Any]:
    """Return a function ``act(obs)`` that returns the policy's action for ``env.step``.

    Observations can be those of the Gymnasium environments, the vector environments (Gymnasium and SB3,
    stacked) and the PettingZoo parallel environment (a dict per agent). The memory of a flock's rows is reset
    when the ``time`` of all their observations is 0. In the parallel environment the policy gets a row per
    agent of the flock, zeros for caught agents. Only the agents in ``env.agents`` get an action. Predators
    that are agents fly straight on.

    Args:
        policy: the policy.
        env: an environment of this package. Wrappers may change neither observations nor actions, except for
            ``ClipAction``.

    Raises:
        InputError: if ``policy`` is not a policy; if ``env`` is not an environment of this package; if a
            wrapper changes a space of ``env`` or normalizes its observations; or if the policy was read from
            a file and an option of the environment differs from the file's.
    """
    as_policy(policy)
    inner = getattr(env, "unwrapped", env)
    try:
        # Gymnasium's vector environments give access to their environments' attributes through ``get_attr``.
        spec: PolicySpec = (
            inner.policy_spec if hasattr(inner, "policy_spec") else inner.get_attr("policy_spec")[0]
        )
    except (AttributeError, TypeError):
        raise InputError("env", "an environment of this package", shown(env)) from None
    _check_wrappers(env, spec)
    if isinstance(policy, StoredPolicy):
        policy.check(spec.options, per_agent=spec.per_agent)
    time = spec.layout.index("time")
    rows_per_flock = spec.num_agents if is_per_agent(spec) else 1

    def act_on_rows(observations: Observations) -> NDArray[Any]:
        if len(observations) % rows_per_flock:
            raise InputError("observations", f"{rows_per_flock} rows per flock", len(observations))
        has_begun = (observations[:, time] == 0).reshape(-1, rows_per_flock).all(axis=1)
        if has_begun.any():
            reset_policy(policy, np.repeat(has_begun, rows_per_flock))
        return policy.act(observations, spec)

    def act_on_agents(observations: dict[str, Observations]) -> dict[str, Any]:
        for agent in inner.agents:
            if agent not in observations:
                raise InputError("observations", f"one of {agent!r}", "none")
        flock = inner.possible_agents[: spec.num_agents]
        caught = np.zeros(len(spec.layout.names), np.float32)
        actions = act_on_rows(np.stack([observations.get(agent, caught) for agent in flock]))
        straight_on = np.zeros(inner.predator_policy_spec.dimension, np.float32)
        named = dict(zip(flock, actions, strict=True))
        return {agent: named.get(agent, straight_on) for agent in inner.agents}

    def act(observation: Any) -> Any:
        if isinstance(observation, dict):
            return act_on_agents(observation)
        if observation.ndim == 1:
            return act_on_rows(observation[np.newaxis])[0]
        return act_on_rows(observation)

    return act
