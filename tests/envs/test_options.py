"""Options as keyword arguments: names, errors and the options that each environment accepts."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, get_type_hints

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import (
    AgentVectorEnv,
    FlockEscapeEnv,
    FlockParallelEnv,
    FlockPursuitEnv,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    PurePursuit,
    Topological,
    env,
    parallel_env,
    preset,
    raw_env,
    record,
    rollout,
)
from flockesc_env.common.errors import ArgumentError, OptionError, ScenarioError
from flockesc_env.episodes.options import EnvOptions, EnvOptionsDict, LineOptions, LineOptionsDict
from flockesc_env.policies import FixedRange
from flockesc_env.policies.predators import Pursue
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
    "rollout of a line": lambda **options: rollout(LineScenario(), FixedRange(0.1), [0], **options),
}


@pytest.mark.parametrize(
    ("keywords", "options"), [(EnvOptionsDict, EnvOptions), (LineOptionsDict, LineOptions)]
)
def test_keywords_are_the_fields_of_the_dataclass(keywords: type, options: type) -> None:
    assert get_type_hints(keywords) == get_type_hints(options)
    assert set(keywords.__annotations__) == {field.name for field in dataclasses.fields(options)}
    assert not keywords.__required_keys__


@pytest.mark.parametrize("interface", [*FLOCKS, *LINES])
def test_a_wrong_option_is_named(interface: str) -> None:
    make = (FLOCKS | LINES)[interface]
    with pytest.raises(OptionError, match="did you mean reward") as caught:
        make(rewards="terminal")
    assert caught.value.field == "rewards"
    model = "LineScenario" if interface in LINES else "FlockScenario"
    with pytest.raises(OptionError, match=rf"pass scenario={model}\(num_agents=\.\.\.\)") as caught:
        make(num_agents=3)
    assert caught.value.field == "num_agents"
    with pytest.raises(OptionError, match="known: ") as caught:
        make(xyz=3)


@pytest.mark.parametrize("interface", ["FlockEscapeEnv", "FlockVectorEnv", "FlockVecEnv", "rollout"])
def test_individual_rewards_need_a_range_per_agent(interface: str) -> None:
    with pytest.raises(OptionError) as caught:
        FLOCKS[interface](reward="individual_distance")
    assert caught.value.field == "reward"


@pytest.mark.parametrize("interface", FLOCKS)
def test_environments_need_a_predator(interface: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FLOCKS[interface](small_flock(predators=()))
    assert caught.value.field == "predators"


def test_the_environment_of_a_line_needs_a_predator() -> None:
    with pytest.raises(ScenarioError) as caught:
        LineEscapeEnv(LineScenario(predator_position=None))
    assert caught.value.field == "predator_position"


@pytest.mark.parametrize("interface", FLOCKS)
def test_a_topological_rule_needs_the_largest_number_of_neighbors(interface: str) -> None:
    scenario = small_flock(neighbor_rule=Topological())
    with pytest.raises(OptionError, match="number of neighbors") as caught:
        FLOCKS[interface](scenario)
    assert caught.value.field == "max_range"
    FLOCKS[interface](scenario, max_range=7)


def test_a_preset_with_a_topological_rule() -> None:
    environment = FlockEscapeEnv(preset("topological"), max_range=7)
    environment.reset(seed=0)
    assert environment.step(np.ones(1, np.float32))[-1]["interaction_range"] == 7


@pytest.mark.parametrize("interface", [name for name in FLOCKS if name != "FlockPursuitEnv"])
def test_a_predator_policy_never_replaces_predators(interface: str) -> None:
    scenario = small_flock(predators=(PurePursuit(),))
    with pytest.raises(
        ArgumentError, match=r"with_learned_predators\(\) makes one, got PurePursuit"
    ) as caught:
        FLOCKS[interface](scenario, predator_policy=Pursue())
    assert caught.value.field == "predator_policy"
    FLOCKS[interface](scenario.with_learned_predators(), predator_policy=Pursue())
