"""``Setup``: a policy with the scenario and the options with which it plays, decided once by ``setup``."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from typing import Any

from flockesc_env.common.checks import as_flag
from flockesc_env.common.errors import InputError, errors_at, shown
from flockesc_env.episodes.spaces import policy_spec
from flockesc_env.policies.base import AnyPolicy, BasePolicy, check_origins, normalizer_of
from flockesc_env.policies.registry import as_flock_policy, as_predator_policy
from flockesc_env.policies.sb3 import SB3Policy, space_error
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import VIEWS, EnvOptions, LineOptions
from flockesc_env.scenario.presets import PRESETS, Scenario, as_model


@dataclass(frozen=True, eq=False)
class Setup:
    """A policy and everything that decides how it plays.

    Attributes:
        policy: the policy, which sets the ranges.
        scenario: the scenario in which it plays.
        options: options of the environment.
        per_agent: whether the policy sets one range per agent. False: one per flock, or per line.
        predator_policy: controls the ``Learned`` predators; ``None``: they fly straight on.
        num_threads: number of threads for flocks; ``None``: one per core.
        env: the vector environment of stable-baselines3 in which a model plays, with its wrappers.
    """

    policy: BasePolicy
    scenario: Scenario
    options: EnvOptions | LineOptions
    per_agent: bool
    predator_policy: BasePolicy | None = None
    num_threads: int | None = None
    env: Any = None


def setup(
    policy: Any,
    scenario: Any = None,
    *,
    per_agent: bool | None = None,
    predator_policy: AnyPolicy = None,
    num_threads: int | None = None,
    env: Any = None,
    **options: Any,
) -> Setup:
    """Return how a policy plays in a scenario; ``rollout`` describes the arguments.

    With an ``env``, everything is that of the flocks behind its wrappers. Without ``predator_policy``, a
    policy plays against the opponent of its training if the scenario has ``Learned`` predators.

    Options come from the caller, the policy, and the defaults of its class and of the environment, in this
    order. A model of stable-baselines3 has those of its environment, or those that ``RangePolicy`` and
    ``ScorerPolicy`` store. A caller may change the options of a rule, but not those with which a policy was
    trained: ``with_options`` does that. A model that knows none is refused, unless the caller gives some.
    Every disagreement, for example with the policy's view or with ``env``, raises ``InputError``.
    """
    if env is not None:
        given: dict[str, Any] = {"per_agent": per_agent, "predator_policy": predator_policy}
        return _setup_in(env, policy, scenario, given, num_threads, options)
    if isinstance(policy, FlockScenario | LineScenario) or (isinstance(policy, str) and policy in PRESETS):
        expected = "a policy beside the scenario, as rollout('paper-flock', 'stubborn-leaders', seeds=2)"
        raise InputError("policy", expected, f"the scenario {shown(policy)}")
    player = as_flock_policy(policy)
    model = (player.scenario or FlockScenario()) if scenario is None else as_model(scenario)
    if player.scenario is not None and player.scenario.model != model.model:
        other = f"{player.name!r}, a policy for a {player.scenario.model}"
        raise InputError("policy", f"a policy for a {model.model}", other)
    if isinstance(model, LineScenario):
        refuse({"per_agent": per_agent or None, "predator_policy": predator_policy}, "None for a line")
    if not options or player.options is not None:
        player.check_known()
    chosen = model.env_options(player.all_options(model, **options))
    if player.scenario is not None and player.options is not None:
        origins = {"the policy, which was trained with it": player.options}
        origins["the caller"] = {name: getattr(chosen, name) for name in options}
        line = "policy" if player is policy else "as_policy(policy)"
        check_origins(origins, f"; to change it, type {line}.with_options(NAME=VALUE)")
    view = player.per_agent if per_agent is None else as_flag(per_agent, "per_agent")
    if view is None:
        view = _observes_agents(player, model, chosen)
    if player.options is not None:
        player = copy(player)
        player.options = {**vars(chosen)}
    player.check(chosen, per_agent=view)
    hunter = None if predator_policy is None else as_predator_policy(predator_policy)
    if hunter is None and isinstance(model, FlockScenario) and model.num_learned:
        hunter = opponent_of(player, as_predator_policy)
    return Setup(player, model, chosen, view, hunter, num_threads)


def opponent_of(policy: BasePolicy, read: Callable[[Any], BasePolicy]) -> BasePolicy | None:
    """Return ``read`` of the name of the policy against which another one was trained, or ``None``."""
    with errors_at(f"{policy.name}, trained against {policy.opponent!r}: "):
        return None if policy.opponent is None else read(policy.opponent)


def _setup_in(
    env: Any, policy: Any, scenario: Any, given: dict[str, Any], threads: int | None, options: dict[str, Any]
) -> Setup:
    """Return how a model of stable-baselines3 plays in a vector environment, through its wrappers."""
    inner, player = flocks_of(env), as_flock_policy(policy)
    if not isinstance(player, SB3Policy):
        raise InputError("policy", "a model of stable-baselines3 beside env", shown(policy))
    model, view = inner.scenario, inner.policy_spec.per_agent
    fixed = {"scenario": model, "per_agent": view, "predator_policy": inner.predator_policy}
    for name, value in {"scenario": scenario and as_model(scenario), **given}.items():
        if value is not None and value not in (fixed[name], getattr(fixed[name], "policy", None)):
            raise InputError(name, f"that of env, {shown(fixed[name])}", shown(value))
    chosen = vars(model.env_options(options))
    check_origins({"env": vars(inner.options), "the caller": {name: chosen[name] for name in options}})
    for name in ("observation_space", "action_space"):
        trained, found = getattr(player.model, name, None), getattr(env, name)
        if trained is not None and trained != found:
            raise InputError(f"env.{name}", f"{trained}, that of the model", found)
    own = getattr(player.model, "env", None)
    if own is not None and (normalizer_of(own) is None) != (normalizer_of(env) is None):
        raise InputError("env", "a VecNormalize if and only if the model's environment has one", shown(env))
    return Setup(player, model, inner.options, view, inner.predator_policy, threads, env)


def flocks_of(env: Any, argument: str = "env") -> Any:
    """Return the flocks of one scenario behind the wrappers of an environment of ``sb3.vec_env``."""
    inner: Any = getattr(env, "unwrapped", None)
    plays = not isinstance(env, type) and hasattr(type(inner), "play_episodes")
    if plays and inner.flock_policy is not None:
        expected = "an environment with side='flock' (predator_policy=model plays a predator's model)"
        raise InputError(argument, expected, "side='predator'")
    if not plays:
        raise InputError(argument, "flocks of sb3.vec_env, or a wrapper around them", shown(env))
    if len({*inner.scenarios}) > 1:
        raise InputError(f"{argument}.scenarios", "the same scenario for all flocks", len({*inner.scenarios}))
    return inner


def _observes_agents(policy: BasePolicy, scenario: Scenario, options: EnvOptions | LineOptions) -> bool:
    """Return whether the observation space of a policy without a view is that of an agent."""
    trained = policy.observation_space
    if trained is None or isinstance(scenario, LineScenario):
        return False
    specs = {name: policy_spec(scenario, options, per_agent=is_agent) for is_agent, name in VIEWS.items()}
    spaces = {name: spec.layout.space() for name, spec in specs.items()}
    if trained not in spaces.values():
        raise space_error(trained, spaces)
    return trained == spaces["agent"]


def refuse(given: dict[str, Any], expected: str) -> None:
    """Raise ``InputError`` for the first of some arguments that is not ``None``."""
    for name, value in given.items():
        if value is not None:
            raise InputError(name, expected, shown(value))
