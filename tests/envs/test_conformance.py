"""Official test suites of Gymnasium, PettingZoo and stable-baselines3, over all pairs of options."""

import warnings
from functools import partial
from types import SimpleNamespace
from typing import Any

import gymnasium
import option_table as table
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from pettingzoo import test as suites
from stable_baselines3.common.env_checker import check_env as check_sb3

from flockesc_env import FlockScenario, LineScenario, PredatorEnv, flockesc_v1, parallel_env
from flockesc_env.scenario import Learned

FLOCK_ID = "flockesc_env:flockesc/FlockEscape-v1"
LINE_ID = "flockesc_env:flockesc/LineEscape-v1"
pytestmark = pytest.mark.filterwarnings(
    # PettingZoo's suites pass options={"options": 1}.
    "ignore:reset\\(\\) ignores unknown options:UserWarning",
    # Positions and velocities have no bounds.
    "ignore:.*state space value is -?infinity:UserWarning",
    # The observation of a caught agent is zero.
    "ignore:Observation numpy array is all zeros:UserWarning",
    # Agents and predators have different observation spaces, which the suite advises against.
    "ignore:Agents have different observation space sizes:UserWarning",
    "ignore:Observations are different shapes:UserWarning",
    # The only flock is called `flock`.
    "ignore:We recommend agents to be named in the format:UserWarning",
)


def every_option(**values: tuple[Any, ...]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("options", table.covering(**values), ids=table.label)


def check_single(name: str, scenario: FlockScenario | LineScenario, options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        if options.get("action_mode") == "range":  # the checkers advise against other spaces than [-1, 1]
            warnings.filterwarnings("ignore", ".*symmetric and normalized.*")
        # A window waits for a person: tests/tools/test_render_environments.py checks rendering.
        check_gymnasium(gymnasium.make(name, scenario=scenario, **options).unwrapped, skip_render_check=True)
        check_sb3(gymnasium.make(name, scenario=scenario, **options))


def check_agents(scenario: FlockScenario, **options: Any) -> None:
    def in_parallel(max_cycles: int = scenario.num_steps, **changes: Any) -> Any:
        return parallel_env(scenario.replace(num_steps=max_cycles), **options | changes)

    def in_turn(max_cycles: int = scenario.num_steps, **changes: Any) -> Any:
        return flockesc_v1.env(scenario.replace(num_steps=max_cycles), **options | changes)

    num_cycles = 2 * scenario.num_steps
    suites.parallel_api_test(in_parallel(), num_cycles=num_cycles)
    suites.api_test(in_turn(), num_cycles=num_cycles)
    suites.parallel_seed_test(in_parallel, num_cycles=num_cycles)
    suites.seed_test(in_turn, num_cycles=num_cycles)
    suites.state_test(in_turn(), in_parallel())
    if scenario.capture_radius is None:
        # A cycle is one action of every agent, which here holds for one model step.
        together, apart = (partial(make, steps_per_action=1) for make in (in_parallel, in_turn))
        suites.max_cycles_test(SimpleNamespace(parallel_env=together, env=apart))


@every_option(**table.FLOCK, dimension=table.DIMENSIONS)
def test_flock(options: dict[str, Any]) -> None:
    options = dict(options)
    scenario = table.small_flock(options.pop("dimension"))
    check_single(FLOCK_ID, scenario, options)
    check_agents(scenario, per_agent=False, **options)


@every_option(**table.LINE)
def test_line(options: dict[str, Any]) -> None:
    check_single(LINE_ID, LineScenario(num_agents=5, max_steps=10), options)


@every_option(**table.AGENTS, dimension=table.DIMENSIONS)
def test_agents(options: dict[str, Any]) -> None:
    options = dict(options)
    check_agents(table.small_flock(options.pop("dimension")), **options)


@table.every_pair(dimension=table.DIMENSIONS, objective=table.OBJECTIVES, capture_radius=(0.0, 4.0, 1e6))
def test_captures(dimension: int, objective: str, capture_radius: float) -> None:
    scenario = table.hunted(dimension, capture_radius=capture_radius)
    check_single(FLOCK_ID, scenario, {"objective": objective, **table.EVERY_STEP})
    for per_agent in (True, False):
        check_agents(scenario, objective=objective, per_agent=per_agent, **table.EVERY_STEP)


@pytest.mark.parametrize("dimension", table.DIMENSIONS)
@pytest.mark.parametrize(
    "options", [{}, {"per_agent": True, "reward": "individual_distance", "steps_per_action": 3}]
)
def test_learned_predators(dimension: int, options: dict[str, Any]) -> None:
    check_gymnasium(PredatorEnv(table.small_flock(dimension), **options), skip_render_check=True)
    check_sb3(PredatorEnv(table.small_flock(dimension), **options))
    hunters = (Learned((10.0, 10.0), (5.0, 0.0)), Learned((20.0, 20.0), (0.0, -5.0)))
    scenario = table.small_flock(dimension, num_agents=12, predators=hunters, capture_radius=12.0)
    check_agents(scenario, per_agent=options.get("per_agent", False))
