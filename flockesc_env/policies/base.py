"""``Policy`` (protocol of range policies), ``bind``, and base classes of policies.

``BasePolicy`` is the base of this package's policies, ``RowMemory`` that of policies with a memory.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from copy import copy
from os import PathLike
from typing import Any, Literal, Protocol, Self

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_flag, as_text
from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.predators import PredatorPolicySpec, reset_policy
from flockesc_env.episodes.spaces import PolicySpec, policy_spec
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import UNOBSERVED, EnvOptions, LineOptions
from flockesc_env.scenario.presets import Scenario, as_model

Observations = NDArray[np.float32]

Side = Literal["flock", "predator"]
"""Whose observations and actions a policy, or an environment, has."""


class Policy(Protocol):
    """Protocol of policies: objects that turn observation rows into actions, ranges or those of predators.

    Only ``act`` is required. A policy that keeps a memory between actions also has a method ``reset(rows)``,
    see ``RowMemory``; rollouts, ``bind`` and ``PredatorEnv`` call it before the first action of every
    episode, ``PredatorEnv`` also after ``set_state``. A policy that chooses one range per agent has an
    attribute ``per_agent = True``.
    """

    def act(self, observations: Observations, spec: Any) -> NDArray[Any]:
        """Return one action per observation row.

        Args:
            observations: shape (k, entries); one row per flock, per agent or per ``Learned`` predator,
                ordered by flock.
            spec: shapes and meaning of observations and actions: a ``PolicySpec``, or for predators a
                ``PredatorPolicySpec``.

        Returns:
            Actions in the environment's action space, shape (k, 1) or, for discrete actions, (k,). For
            predators in [-1, 1], shape (k, D).
        """
        ...


AnyPolicy = Policy | str | PathLike[str] | Any
"""A policy, its name or path, or a model of stable-baselines3."""


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
            rows: whether an episode begins in each row of the next observations, shape (k,). Their number
                must not change while some episodes are running.
        """
        before = self._begins
        if rows.all() or before is None:
            self._begins = np.ones(len(rows), bool)
        elif len(rows) == len(before):
            self._begins = before | rows
        else:
            raise InputError("rows", f"{len(before)} rows as before", len(rows))

    def _begin(self, count: int) -> NDArray[np.bool]:
        """Return whether an episode begins in each of ``count`` rows: in all without a ``reset``."""
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


class BasePolicy(ABC):
    """Base class of this package's policies: they know for which environment they were made.

    Attributes:
        name: name in tables and figures; by default that of the class.
        per_agent: True: the policy sets one range per agent. False: one per flock. ``None``: it fits both.
        options: options of the environment that the policy requires, by the names of ``EnvOptions`` or
            ``LineOptions``. With a ``scenario`` these are all that change observations or actions. ``None``:
            it plays with any.
        scenario: the scenario in which the policy was trained; ``None``: it was not trained.
        opponent: name of the policy against which it was trained, which controlled the other side; ``None``:
            it has no opponent, and ``Learned`` predators fly straight on.
        side: whose actions it chooses: ranges of a flock, or those of predators. ``None``: it is unknown.
        observation_space: the space of its observations if it has one, as models of stable-baselines3 do.
    """

    name: str = ""
    side: Side | None = "flock"
    per_agent: bool | None = None
    options: Mapping[str, Any] | None = None
    scenario: Scenario | None = None
    opponent: str | None = None
    observation_space: gymnasium.Space[Any] | None = None

    def __init_subclass__(cls) -> None:
        """Name the policy after its class, which may have another name."""
        super().__init_subclass__()
        cls.name = vars(cls).get("name", cls.__name__)

    @abstractmethod
    def act(self, observations: Observations, spec: Any) -> NDArray[Any]:
        """Return one action per observation row; see ``Policy.act``."""

    def with_options(
        self,
        *,
        name: str | None = None,
        per_agent: bool | None = None,
        scenario: Scenario | None = None,
        opponent: str | None = None,
        **options: Any,
    ) -> Self:
        """Return a copy with other attributes, unless they are ``None``, and with options beside its own.

        The options are those of ``EnvOptions`` or, for a line, ``LineOptions``. A class that needs the other
        view raises ``InputError``.
        """
        made = copy(self)
        if name is not None:
            made.name = as_text(name, "name")
            if not name.isprintable():
                raise InputError("name", "printable characters", shown(name))
        if opponent is not None:
            made.opponent = as_text(opponent, "opponent")
        if per_agent is not None:
            self._check_view(as_flag(per_agent, "per_agent"))
            vars(made)["per_agent"] = per_agent
        if scenario is not None:
            made.scenario = as_model(scenario)
        if options or self.options is not None:
            model = made.scenario or FlockScenario()
            known = model.env_options(made.all_options(model, **options))
            names = {*(self.options or {}), *options}
            if made.scenario is not None:
                names |= vars(known).keys() - set(UNOBSERVED)
            made.options = {name: value for name, value in vars(known).items() if name in names}
        return made

    def default_options(self, scenario: Scenario) -> dict[str, Any]:  # noqa: ARG002
        """Return the options of the class, which ``options`` and arguments of calls replace."""
        return {}

    def all_options(self, scenario: Scenario, **given: Any) -> dict[str, Any]:
        """Return the options that are given, those of the policy and of its class, in this order."""
        return {**self.default_options(scenario), **(self.options or {}), **given}

    def check_known(self) -> None:  # noqa: B027, only models can lack what they were trained with
        """Raise ``InputError`` if the policy was trained with options that it does not know."""

    @property
    def policy_spec(self) -> Any:
        """Observations and actions of the policy in its scenario, by default the paper's flock."""
        scenario: Any = self.scenario or FlockScenario()
        if self.side == "predator":
            return PredatorPolicySpec.of(scenario)
        options = scenario.env_options(self.all_options(scenario))
        return policy_spec(scenario, options, per_agent=bool(self.per_agent))

    def bind(self, env: Any) -> Callable[[Any], Any]:
        """Return a function from an observation of an environment to the action; see ``policies.bind``."""
        inner = getattr(env, "unwrapped", env)
        try:
            # Gymnasium's vector environments give their environments' attributes through ``get_attr``.
            has_spec = hasattr(inner, "policy_spec")
            spec: PolicySpec = inner.policy_spec if has_spec else inner.get_attr("policy_spec")[0]
        except (AttributeError, TypeError):
            raise InputError("env", "an environment of this package", shown(env)) from None
        _check_wrappers(env, spec)
        rows_per_flock = 1
        if isinstance(spec, PolicySpec):  # not that of a predator
            self.check(spec.options, per_agent=spec.per_agent)
            rows_per_flock = spec.rows

        def act(observations: Any) -> Any:
            if not isinstance(observations, dict):
                actions = self._act_on_rows(np.atleast_2d(observations), spec, rows_per_flock)
                return actions[0] if observations.ndim == 1 else actions
            for agent in inner.agents:
                if agent not in observations:
                    raise InputError("observations", f"one of {agent!r}", "none")
            flock = inner.possible_agents[: spec.rows]
            caught = np.zeros(len(spec.layout.names), np.float32)
            rows = np.stack([observations.get(agent, caught) for agent in flock])
            actions = self._act_on_rows(rows, spec, rows_per_flock)
            straight_on = np.zeros(inner.predator_policy_spec.dimension, np.float32)
            named = dict(zip(flock, actions, strict=True))
            return {agent: named.get(agent, straight_on) for agent in inner.agents}

        return act

    def predict(
        self, observation: Observations, state: Any = None, *_: Any, **__: Any
    ) -> tuple[NDArray[Any], Any]:
        """Return the action and ``state``, as models of stable-baselines3 do.

        The observation has shape (entries,) or, for k rows, (k, entries); other arguments are ignored. The
        environment must have the policy's options; ``bind`` checks that. A policy that knows none raises
        ``InputError``. A memory is cleared in rows whose observed ``time`` is 0.
        """
        if self.options is None:
            raise InputError("policy.options", "those of the environment (use bind(env))", "none")
        spec = self.policy_spec
        rows = np.atleast_2d(np.asarray(observation, np.float32))
        if rows.ndim != 2 or rows.shape[1] != len(spec.layout.names):
            raise InputError("observation", f"{len(spec.layout.names)} entries", f"shape {rows.shape}")
        actions = self._act_on_rows(rows, spec, 1)
        return (actions[0] if np.ndim(observation) == 1 else actions), state

    def _act_on_rows(self, rows: Observations, spec: Any, rows_per_flock: int) -> NDArray[Any]:
        """Return the actions, after a reset of the flocks in which the time of all rows is 0."""
        if len(rows) % rows_per_flock:
            raise InputError("observations", f"{rows_per_flock} rows per flock", len(rows))
        times = rows[:, spec.layout.index("time")].reshape(-1, rows_per_flock)
        has_begun = (times == 0).all(axis=1)
        if has_begun.any():
            reset_policy(self, np.repeat(has_begun, rows_per_flock))
        return self.act(rows, spec)

    def check(self, options: EnvOptions | LineOptions, *, per_agent: bool) -> None:
        """Raise ``InputError`` unless an environment has the view and the options of this policy."""
        self._check_view(per_agent)
        if self.options is not None:
            known = {"the policy (use **policy.options)": self.options, "the environment": vars(options)}
            check_origins(known)

    def check_spec(self, spec: Any) -> Any:  # noqa: B027, as ``check_known``
        """Raise ``InputError`` if the policy is known not to fit some predators."""

    def _check_view(self, per_agent: bool) -> None:
        """Raise ``InputError`` unless the policy fits the view."""
        if self.per_agent is not None and per_agent != self.per_agent:
            rows = "agent" if self.per_agent else "flock"
            expected = f"{self.per_agent}, because the policy needs one observation per {rows}"
            raise InputError("per_agent", expected, per_agent)


def check_origins(origins: Mapping[str, Mapping[str, Any]], advice: str = "") -> None:
    """Raise ``InputError`` if options of two origins, given by name, disagree.

    Options that change neither observations nor actions may differ (``UNOBSERVED``). ``advice`` ends the
    message, with NAME and VALUE instead of the option of the second origin.
    """
    (first, known), (second, others) = origins.items()
    for name in known:
        if name not in UNOBSERVED and known[name] != others.get(name, known[name]):
            given = repr(others[name])
            line = advice.replace("NAME", name).replace("VALUE", given)
            raise InputError(name, f"{known[name]!r} from {first}", f"{given} from {second}{line}")


def normalizer_of(env: Any) -> Any:
    """Return the ``VecNormalize`` among the wrappers of an environment that normalizes observations, or None.

    Attributes are looked up in ``__dict__``, because wrappers also have those of the inner environment.
    """
    while env is not None and not getattr(env, "__dict__", {}).get("norm_obs"):
        env = getattr(env, "__dict__", {}).get("venv")
    return env


def _check_wrappers(env: Any, spec: PolicySpec | PredatorPolicySpec) -> None:
    for name, expected in (("observation_space", spec.layout.space()), ("action_space", spec.space())):
        space = getattr(env, f"single_{name}", None) or getattr(env, name)
        found = space(env.possible_agents[0]) if callable(space) else space
        is_clipped = name == "action_space" and bool(np.isinf(getattr(found, "low", 0.0)).all())
        if found != expected and not is_clipped:
            raise InputError(f"env.{name}", "that of env.unwrapped, which no wrapper changes", found)
    if normalizer_of(env) is not None:
        raise InputError("env", "observations that no VecNormalize changes", shown(env))
