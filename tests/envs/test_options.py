"""Options and arguments that contradict each other: every interface names what it refuses."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable
from typing import Any, get_type_hints

import gymnasium
import numpy as np
import pytest
from envs import adapters
from option_table import small_flock
from stable_baselines3.common.vec_env import VecMonitor

import flockesc_env as fe
from flockesc_env.common.errors import ArgumentError, OptionError, ScenarioError
from flockesc_env.episodes.options import EnvOptionsDict, LineOptionsDict
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCKS: dict[str, Callable[..., Any]] = {
    "FlockEscapeEnv": fe.FlockEscapeEnv,
    "FlockPursuitEnv": fe.FlockPursuitEnv,
    "FlockParallelEnv": fe.FlockParallelEnv,
    "parallel_env": fe.parallel_env,
    "env": fe.env,
    "raw_env": fe.raw_env,
    "FlockVectorEnv": lambda scenario=None, **options: fe.FlockVectorEnv(2, scenario, **options),
    "AgentVectorEnv": lambda scenario=None, **options: fe.AgentVectorEnv(None, scenario, **options),
    "FlockVecEnv": lambda scenario=None, **options: FlockVecEnv(2, scenario, **options),
    "AgentVecEnv": lambda scenario=None, **options: AgentVecEnv(2, scenario, **options),
    "rollout": lambda scenario=None, **options: fe.rollout(scenario, fe.FixedRange(1.0), [0], **options),
    "record": lambda scenario=None, **options: fe.record(scenario, fe.FixedRange(1.0), 0, **options),
}
LINES: dict[str, Callable[..., Any]] = {
    "LineEscapeEnv": fe.LineEscapeEnv,
    "rollout of a line": lambda scenario="paper-line", **options: fe.rollout(
        scenario, fe.FixedRange(0.1), [0], **options
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
    (small_flock(neighbor_rule=fe.Topological()), {}, OptionError, "max_range", "number of neighbors"),
]
OF_A_LINE: list[Refusal] = [
    *EVERYWHERE,
    (None, {"num_agents": 3}, OptionError, "num_agents", r"pass scenario=LineScenario\(num_agents=\.\.\.\)"),
    (fe.LineScenario(predator_position=None), {}, ScenarioError, "predator_position", "expected"),
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
    scenario, policy = small_flock(predators=(fe.PurePursuit(),)), {"predator_policy": fe.Pursue()}
    words = r"with_learned_predators\(\) makes one, got PurePursuit"
    assert_refused(FLOCKS[interface], (scenario, policy, ArgumentError, "predator_policy", words))
    FLOCKS[interface](scenario.with_learned_predators(), **policy)


@pytest.mark.parametrize(
    ("keywords", "options"), [(EnvOptionsDict, fe.EnvOptions), (LineOptionsDict, fe.LineOptions)]
)
def test_keywords_are_the_fields_of_the_dataclass(keywords: type, options: type) -> None:
    assert get_type_hints(keywords) == get_type_hints(options)
    assert set(keywords.__annotations__) == {field.name for field in dataclasses.fields(options)}
    assert not keywords.__required_keys__


@adapters()
def test_settings_are_not_assigned_after_creation(make: Callable[[], Any]) -> None:
    env = make().unwrapped
    names = [*vars(env.options), "scenario", "options", "policy_spec", "num_envs"]
    for each in (env, copy.deepcopy(env)):
        before = {name: getattr(each, name, None) for name in names}
        for name in [*names, "render_mode"]:
            with pytest.raises(OptionError, match=f"^{name}: expected no assignment after creation"):
                setattr(each, name, "another")
        assert {name: getattr(each, name, None) for name in names} == before
        each.note = 7  # other names are free
        each.note += 1
        assert each.note == 8


def test_settings_are_not_assigned_through_wrappers() -> None:
    alone = gymnasium.make("flockesc/FlockEscape-v0", scenario=small_flock())
    several = gymnasium.make_vec("flockesc/LineEscape-v0", num_envs=2)
    slots = AgentVecEnv(1, small_flock())
    for name in ("scenario", "max_range"):
        for call in (alone.set_wrapper_attr, several.set_attr, slots.set_attr, VecMonitor(slots).set_attr):
            with pytest.raises(OptionError, match=f"{name}: .*environment with {name}=.."):
                call(name, None)
    alone.set_wrapper_attr("note", 7)
    assert alone.get_wrapper_attr("note") == 7


def test_a_subclass_can_replace_its_spaces() -> None:
    class Doubled(fe.FlockEscapeEnv):
        def __init__(self) -> None:
            super().__init__(small_flock())
            self.action_space = gymnasium.spaces.Box(-2.0, 2.0, (1,))
            self.factor = 0.5

        def step(self, action: Any) -> Any:
            return super().step(self.factor * action)

    env = Doubled()
    env.reset(seed=0)
    env.step(np.float32([2.0]))
    env.factor = 0.25
    with pytest.raises(OptionError, match=r"action_space: .* \(create a new environment\)"):
        env.action_space = gymnasium.spaces.Box(-4.0, 4.0, (1,))


FLOCK, LINE = small_flock(), fe.LineScenario(num_agents=5, max_steps=10)
NAN = np.nan
POSITIONS = np.zeros((5, 2))
SPOILT = POSITIONS.copy()
SPOILT[3, 1] = np.inf


def refusal(call: Callable[[], Any]) -> ArgumentError:
    """Return the error that a call raises, after checking that it has the package's form."""
    with pytest.raises(ArgumentError) as caught:
        call()
    error = caught.value
    assert isinstance(error, fe.FlockescError)
    assert isinstance(error, ValueError)
    assert str(error) == f"{error.field}: expected {error.expected}, got {error.given}"
    return error


SIMULATE: list[tuple[Any, dict[str, Any], str]] = [
    ([1, 1, 1, 1, -1], {}, "interaction_range[4]"),
    ([1, 1, NAN, 1, 1], {}, "interaction_range[2]"),
    (np.ones((10, 5)), {}, "interaction_range"),
    (1.0, {"schedule": np.ones((10, 5))}, "interaction_range"),
    (None, {"schedule": np.ones((5, 10))}, "schedule"),
    (None, {"schedule": np.ones((10, 4))}, "schedule"),
    (None, {"schedule": np.ones((10, 5, 1))}, "schedule"),
    (None, {"schedule": np.ones(10)}, "schedule"),
    (1.0, {"initial_positions": POSITIONS.T}, "initial_positions"),
    (1.0, {"initial_positions": SPOILT}, "initial_positions[3, 1]"),
    (1.0, {"initial_positions": np.full((5, 2), 1e30)}, "initial_positions[0, 0]"),
    (1.0, {"initial_velocities": SPOILT}, "initial_velocities[3, 1]"),
]


@pytest.mark.parametrize(("rho", "arguments", "field"), SIMULATE)
def test_simulate(rho: Any, arguments: dict[str, Any], field: str) -> None:
    assert refusal(lambda: fe.simulate(FLOCK, rho, seed=0, **arguments)).field == field


def test_schedule_or_range_per_agent() -> None:
    """With as many agents as steps, the name of the argument decides which axis an array has."""
    scenario = small_flock(num_agents=6, num_steps=6)
    values = np.arange(6) * 10.0
    own = fe.simulate(scenario, values, seed=0)
    scheduled = fe.simulate(scenario, schedule=values[:, None], seed=0)
    assert own.num_components[0] < 6  # the scheduled range starts at 0
    assert scheduled.num_components[0] == 6
    square = np.tile(values, (6, 1))
    np.testing.assert_array_equal(fe.simulate(scenario, schedule=square, seed=0).positions, own.positions)
    lonely = small_flock(num_agents=1, num_steps=1)
    np.testing.assert_array_equal(
        fe.simulate(lonely, [3.0], seed=0).positions, fe.simulate(lonely, 3.0, seed=0).positions
    )
