"""Resuming: a reset can start any episode of a schedule, and the following episodes continue from there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from envs import FLOCKS, same_action, step
from option_table import small_flock
from pettingzoo import AECEnv
from stable_baselines3.common.vec_env import VecEnv

import flockesc_env as fe

STEPS = 4
COUNT = 3
SEED = 11
SCENARIO = small_flock(
    num_steps=STEPS,
    predators=(fe.Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),),
    angular_noise=0.5,
)
RHO = 25.0
ACTION = np.array([-0.5], np.float32)  # exactly RHO of [0, 100]

INTERFACES = [*FLOCKS, "line"]


def make(interface: str) -> Any:
    line = fe.LineScenario(num_agents=40, max_steps=STEPS)
    return fe.LineEscapeEnv(line) if interface == "line" else FLOCKS[interface](SCENARIO)


def begin(environment: Any, **reset: Any) -> Any:
    """Reset any environment and return its first observation."""
    if isinstance(environment, VecEnv):
        if reset.get("seed") is not None:
            environment.seed(reset["seed"])
        environment.set_options(reset.get("options"))
        return environment.reset()
    started = environment.reset(**reset)
    return environment.last()[0] if started is None else started[0]


def go_on(environment: Any) -> Any:
    """Take a step of any environment with all of its agents, and return the observation."""
    returned = step(environment, same_action(environment, ACTION))
    return environment.last()[0] if isinstance(environment, AECEnv) else returned[0]


def play(environment: Any, episodes: int, **reset: Any) -> list[list[Any]]:
    """Return the observations of consecutive episodes, the first one after a reset with these arguments."""
    seen = []
    for episode in range(episodes):
        is_reset = episode == 0 or not hasattr(environment, "num_envs")
        seen.append([begin(environment, **(reset if episode == 0 else {}))] if is_reset else [])
        # SB3 resets in the last step of an episode, a vector environment in a separate step.
        is_slow = isinstance(environment, fe.FlockVectorEnv | fe.AgentVectorEnv) and not is_reset
        seen[-1] += [go_on(environment) for _ in range(STEPS + is_slow)]
    return seen


@pytest.mark.parametrize("interface", INTERFACES)
@pytest.mark.parametrize("episode", [0, 1, 3])
def test_a_new_environment_resumes_a_schedule(interface: str, episode: int) -> None:
    undisturbed = play(make(interface), 6, seed=SEED)
    resumed = play(make(interface), 6 - episode, seed=SEED, options={"episode": episode})
    if interface.endswith("slots") and episode > 0:
        # The last step of the previous episode returned the first observation of the new one.
        np.testing.assert_equal(resumed[0].pop(0), undisturbed[episode - 1][-1])
    np.testing.assert_equal(resumed, undisturbed[episode:])


@pytest.mark.parametrize("interface", ["flock slots", "agent slots"])
def test_every_flock_has_its_own_episode_number(interface: str) -> None:
    """Flocks are in different episodes as soon as some of them lose all agents."""
    numbers = [4, 0, 2]
    environment = FLOCKS[interface](SCENARIO, num_flocks=COUNT)
    rows = environment.num_envs // COUNT
    environment.seed(SEED)
    environment.set_options([{"episode": number} for number in numbers for _ in range(rows)])
    environment.reset()
    for later in range(3):
        steps = [environment.step(np.tile(ACTION, (environment.num_envs, 1)))[-1] for _ in range(STEPS)]
        for flock, number in enumerate(numbers):
            run = fe.simulate(SCENARIO, RHO, seed=fe.episode_seed(SEED + flock, number + later))
            seen = [infos[flock * rows]["mean_distance"] for infos in steps]
            assert seen == run.mean_distance[1:].tolist()
