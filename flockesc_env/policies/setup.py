"""``Setup``: a policy with the scenario and the options with which it plays, decided once by ``setup``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flockesc_env.common.checks import as_flag, as_predator_policy
from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import as_flock_policy
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import EnvOptions, LineOptions
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
    """

    policy: BasePolicy
    scenario: Scenario
    options: EnvOptions | LineOptions
    per_agent: bool
    predator_policy: PredatorPolicy | None = None
    num_threads: int | None = None


def setup(
    policy: Any,
    scenario: Any = None,
    *,
    per_agent: bool | None = None,
    predator_policy: PredatorPolicy | None = None,
    num_threads: int | None = None,
    **options: Any,
) -> Setup:
    """Return how a policy plays in a scenario; ``rollout`` describes the arguments.

    Options come from the caller, the policy, and the defaults of its class and of the environment, in this
    order. A model of stable-baselines3 knows those of its environment, or those that ``RangePolicy`` and
    ``ScorerPolicy`` store. A model that knows none is refused, unless the caller gives some.

    Raises:
        InputError: if an argument has the wrong type or value, an option is unknown or out of bounds, or
            the policy needs another model or another view, or does not know its options.
    """
    if isinstance(policy, FlockScenario | LineScenario) or (isinstance(policy, str) and policy in PRESETS):
        expected = "a policy beside the scenario, as rollout('paper-flock', 'stubborn-leaders', seeds=2)"
        raise InputError("policy", expected, f"the scenario {shown(policy)}")
    player = as_flock_policy(policy)
    model = (player.scenario or FlockScenario()) if scenario is None else as_model(scenario)
    if player.scenario is not None and type(player.scenario) is not type(model):
        kinds = ["a line" if isinstance(one, LineScenario) else "a flock" for one in (model, player.scenario)]
        raise InputError("policy", f"a policy for {kinds[0]}", f"{player.name!r}, a policy for {kinds[1]}")
    if isinstance(model, LineScenario):
        refuse({"per_agent": per_agent or None, "predator_policy": predator_policy}, "None for a line")
    if predator_policy is not None:
        as_predator_policy(predator_policy)
    if not options:
        player.check_known()
    chosen = model.env_options({**player.all_options(model), **options})
    view = player.per_agent if per_agent is None else as_flag(per_agent, "per_agent")
    if view is None:
        view = player.is_per_agent_in(model, chosen)
    if player.options is not None:
        player = player.with_options(per_agent=view, **options)
    return Setup(player, model, chosen, view, predator_policy, num_threads)


def refuse(given: dict[str, Any], expected: str) -> None:
    """Raise ``InputError`` for the first of some arguments that is not ``None``."""
    for name, value in given.items():
        if value is not None:
            raise InputError(name, expected, shown(value))
