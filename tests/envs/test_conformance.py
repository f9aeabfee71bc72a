"""Official test suites of Gymnasium, PettingZoo and stable-baselines3, over all pairs of options."""

import warnings
from types import SimpleNamespace
from typing import Any

import gymnasium
import option_table as table
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from pettingzoo import test as suites
from stable_baselines3.common.env_checker import check_env as check_sb3

import flockesc_env
from flockesc_env import FlockScenario, LineScenario, flockesc_v1
from flockesc_env.scenario import Learned

FLOCK_ID = "flockesc_env:flockesc/FlockEscape-v1"
LINE_ID = "flockesc_env:flockesc/LineEscape-v1"

Options = dict[str, Any]

# PettingZoo's suites pass options={"options": 1}.
pytestmark = pytest.mark.filterwarnings("ignore:reset\\(\\) ignores unknown options:UserWarning")

flock_options = table.every_option(table.FLOCK)
agent_options = table.every_option(table.AGENTS)
line_options = pytest.mark.parametrize("options", table.covering(**table.LINE), ids=table.label)


def check_single(name: str, scenario: FlockScenario | LineScenario, options: Options) -> None:
    with warnings.catch_warnings():
        if options.get("action_mode") == "range":  # the checkers advise against other spaces than [-1, 1]
            warnings.filterwarnings("ignore", ".*symmetric and normalized.*")
        # A window waits for a person: tests/tools/test_render_environments.py checks rendering.
        check_gymnasium(gymnasium.make(name, scenario=scenario, **options).unwrapped, skip_render_check=True)
        check_sb3(gymnasium.make(name, scenario=scenario, **options))


@flock_options
def test_flock(options: Options, dimension: int) -> None:
    check_single(FLOCK_ID, table.small_flock(dimension), options)


@line_options
def test_line(options: Options) -> None:
    check_single(LINE_ID, LineScenario(num_agents=5, max_steps=10), options)


@pytest.mark.parametrize("name", [FLOCK_ID, LINE_ID])
def test_gymnasium_defaults(name: str) -> None:
    """``gymnasium.make`` without arguments gives the task one-range."""
    check_gymnasium(gymnasium.make(name).unwrapped)


def check_agents(scenario: FlockScenario, num_cycles: int = 30, **options: Any) -> None:
    suites.parallel_api_test(flockesc_env.parallel_env(scenario, **options), num_cycles=num_cycles)
    suites.api_test(flockesc_v1.env(scenario, **options), num_cycles=num_cycles)
    suites.parallel_seed_test(lambda: flockesc_env.parallel_env(scenario, **options), num_cycles=num_cycles)
    suites.seed_test(lambda: flockesc_v1.env(scenario, **options), num_cycles=num_cycles)


@agent_options
def test_agents(options: Options, dimension: int) -> None:
    check_agents(table.small_flock(dimension), **options)


# The observation of a caught agent is zero.
@pytest.mark.filterwarnings("ignore:Observation numpy array is all zeros:UserWarning")
@table.every_pair(dimension=table.DIMENSIONS, objective=table.OBJECTIVES, capture_radius=(0.0, 4.0, 1e6))
def test_captures(dimension: int, objective: str, capture_radius: float) -> None:
    scenario = table.hunted(dimension, capture_radius=capture_radius)
    check_single(FLOCK_ID, scenario, {"objective": objective, **table.EVERY_STEP})
    check_agents(scenario, 60, objective=objective, **table.EVERY_STEP)


# Agents and predators have different observation spaces, which the suite advises against.
@pytest.mark.filterwarnings(
    "ignore:Observation numpy array is all zeros:UserWarning",
    "ignore:Agents have different observation space sizes:UserWarning",
    "ignore:Observations are different shapes:UserWarning",
)
@pytest.mark.parametrize("dimension", table.DIMENSIONS)
@pytest.mark.parametrize(
    "options", [{}, {"per_agent": True, "reward": "individual_distance", "steps_per_action": 3}]
)
def test_learned_predators(dimension: int, options: dict[str, Any]) -> None:
    check_gymnasium(flockesc_env.PredatorEnv(table.small_flock(dimension), **options), skip_render_check=True)
    check_sb3(flockesc_env.PredatorEnv(table.small_flock(dimension), **options))
    hunters = (Learned((10.0, 10.0), (5.0, 0.0)), Learned((20.0, 20.0), (0.0, -5.0)))
    captured = table.small_flock(dimension, num_agents=12, predators=hunters, capture_radius=12.0)
    suites.parallel_api_test(flockesc_env.parallel_env(captured), num_cycles=30)
    suites.api_test(flockesc_v1.env(captured), num_cycles=30)


# Positions and velocities have no bounds.
@pytest.mark.filterwarnings("ignore:.*state space value is -?infinity:UserWarning")
@agent_options
def test_state(options: Options, dimension: int) -> None:
    scenario = table.small_flock(dimension)
    env = flockesc_v1.env(scenario, **options)
    suites.state_test(env, flockesc_env.parallel_env(scenario, **options))


@table.every_option(table.AGENTS | {"steps_per_action": (1,)})
def test_max_cycles(options: Options, dimension: int) -> None:
    """A cycle is one action of every agent, which here holds for one model step."""

    def scenario(max_cycles: int) -> flockesc_env.FlockScenario:
        return table.small_flock(dimension, num_steps=max_cycles)

    module = SimpleNamespace(
        parallel_env=lambda max_cycles: flockesc_env.parallel_env(scenario(max_cycles), **options),
        env=lambda max_cycles: flockesc_v1.env(scenario(max_cycles), **options),
    )
    suites.max_cycles_test(module)
