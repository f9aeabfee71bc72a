"""Options as keyword arguments: every interface names what it refuses."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, get_type_hints

import pytest
from option_table import small_flock

from flockesc_env import (
    AgentVectorEnv,
    EnvOptions,
    FixedRange,
    FlockEscapeEnv,
    FlockParallelEnv,
    FlockPursuitEnv,
    FlockVectorEnv,
    LineEscapeEnv,
    LineOptions,
    LineScenario,
    PurePursuit,
    Pursue,
    Topological,
    env,
    parallel_env,
    raw_env,
    record,
    rollout,
)
from flockesc_env.common.errors import ArgumentError, OptionError, ScenarioError
from flockesc_env.episodes.options import EnvOptionsDict, LineOptionsDict
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCKS: dict[str, Callable[..., Any]] = {
    "FlockEscapeEnv": FlockEscapeEnv,
    "FlockPursuitEnv": FlockPursuitEnv,
    "FlockParallelEnv": FlockParallelEnv,
    "parallel_env": parallel_env,
    "env": env,
    "raw_env": raw_env,
    "FlockVectorEnv": lambda scenario=None, **options: FlockVectorEnv(2, scenario, **options),
    "AgentVectorEnv": lambda scenario=None, **options: AgentVectorEnv(None, scenario, **options),
    "FlockVecEnv": lambda scenario=None, **options: FlockVecEnv(2, scenario, **options),
    "AgentVecEnv": lambda scenario=None, **options: AgentVecEnv(2, scenario, **options),
    "rollout": lambda scenario=None, **options: rollout(scenario, FixedRange(1.0), [0], **options),
    "record": lambda scenario=None, **options: record(scenario, FixedRange(1.0), 0, **options),
}
LINES: dict[str, Callable[..., Any]] = {
    "LineEscapeEnv": LineEscapeEnv,
    "rollout of a line": lambda scenario="paper-line", **options: rollout(
        scenario, FixedRange(0.1), [0], **options
    ),
}
Refusal = tuple[Any, dict[str, Any], type[Exception], str, str]
EVERYWHERE: list[Refusal] = [
    (None, {"rewards": "terminal"}, OptionError, "rewards", "did you mean reward"),
    (None, {"xyz": 3}, OptionError, "xyz", "known: "),
]
REFUSED: list[Refusal] = [
    *EVERYWHERE,
    (None, {"num_agents": 3}, OptionError, "num_agents", r"pass scenario=FlockScenario\(num_agents=\.\.\.\)"),
    (small_flock(predators=()), {}, ScenarioError, "predators", "expected"),
    (small_flock(neighbor_rule=Topological()), {}, OptionError, "max_range", "number of neighbors"),
]
OF_A_LINE: list[Refusal] = [
    *EVERYWHERE,
    (None, {"num_agents": 3}, OptionError, "num_agents", r"pass scenario=LineScenario\(num_agents=\.\.\.\)"),
    (LineScenario(predator_position=None), {}, ScenarioError, "predator_position", "expected"),
]


def assert_refused(make: Callable[..., Any], refusal: Refusal) -> None:
    scenario, options, error, field, words = refusal
    given = () if scenario is None else (scenario,)
    with pytest.raises(error, match=words) as caught:
        make(*given, **options)
    assert caught.value.field == field  # type: ignore[attr-defined]


@pytest.mark.parametrize("interface", [*FLOCKS, *LINES])
def test_what_does_not_fit_is_named(interface: str) -> None:
    for refusal in REFUSED if interface in FLOCKS else OF_A_LINE:
        assert_refused((FLOCKS | LINES)[interface], refusal)


@pytest.mark.parametrize("interface", ["FlockEscapeEnv", "FlockVectorEnv", "FlockVecEnv", "rollout"])
def test_individual_rewards_need_a_range_per_agent(interface: str) -> None:
    assert_refused(
        FLOCKS[interface], (None, {"reward": "individual_distance"}, OptionError, "reward", "expected")
    )


@pytest.mark.parametrize("interface", [name for name in FLOCKS if name != "FlockPursuitEnv"])
def test_a_predator_policy_never_replaces_predators(interface: str) -> None:
    scenario, policy = small_flock(predators=(PurePursuit(),)), {"predator_policy": Pursue()}
    words = r"with_learned_predators\(\) makes one, got PurePursuit"
    assert_refused(FLOCKS[interface], (scenario, policy, ArgumentError, "predator_policy", words))
    FLOCKS[interface](scenario.with_learned_predators(), **policy)


@pytest.mark.parametrize(
    ("keywords", "options"), [(EnvOptionsDict, EnvOptions), (LineOptionsDict, LineOptions)]
)
def test_keywords_are_the_fields_of_the_dataclass(keywords: type, options: type) -> None:
    assert get_type_hints(keywords) == get_type_hints(options)
    assert set(keywords.__annotations__) == {field.name for field in dataclasses.fields(options)}
    assert not keywords.__required_keys__
