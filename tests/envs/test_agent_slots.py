"""AgentVectorEnv returns the same as the PettingZoo environments of its flocks."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from captured_flocks import doomed
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from option_table import ACTION_MODES, INDIVIDUAL_REWARDS, every_pair, small_flock

from flockesc_env import AgentVectorEnv, ArgumentError, FlockScenario, ResetNeededError, parallel_env

NAME = "flockesc_env:flockesc/FlockAgents-v0"
FLOCKS, AGENTS = 3, 5
SLOTS = FLOCKS * AGENTS
SCENARIOS = {"without capture": small_flock(), "with capture": doomed(num_agents=AGENTS)}

autoreset_modes = pytest.mark.parametrize("autoreset_mode", AutoresetMode)
scenarios = pytest.mark.parametrize("scenario", SCENARIOS.values(), ids=SCENARIOS)


class Flock:
    """One PettingZoo environment, played as Gymnasium's autoreset modes want it, as rows over its agents."""

    def __init__(self, scenario: FlockScenario, **options: Any) -> None:
        self.env = parallel_env(scenario, **options)
        self.must_reset = False

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> dict[str, Any]:
        rows, _ = self.env.reset_array(seed, options)
        self.must_reset = False
        return self._result(rows, np.zeros(AGENTS), np.zeros(AGENTS, bool), np.zeros(AGENTS, bool))

    def step(self, actions: np.ndarray, mode: AutoresetMode) -> tuple[dict[str, Any], dict[str, Any] | None]:
        """Return the result, and the last one of an episode that ended if another has been started."""
        if self.must_reset and mode is AutoresetMode.NEXT_STEP:
            return self.reset(), None
        rows, rewards, caught, truncations, _ = self.env.step_array(actions)
        self.must_reset = not self.env.agents
        assert not self.must_reset or (caught | truncations).all()
        ended = np.full(AGENTS, self.must_reset)
        result = self._result(rows, rewards, ended & caught, ended & ~caught)
        if self.must_reset and mode is AutoresetMode.SAME_STEP:
            first = self.reset()
            return {**result, "observation": first["observation"], "info": first["info"]}, result
        return result, None

    def _result(self, rows: Any, rewards: Any, terminations: Any, truncations: Any) -> dict[str, Any]:
        flock = self.env.flock
        metrics = self.env._batch.metrics()
        info = {name: np.repeat(value, AGENTS) for name, value in metrics.items()}
        info["interaction_range"] = flock.interaction_range
        if self.env.scenario.capture_radius is not None:
            info["active"] = ~flock.caught
        return {
            "observation": rows,
            "reward": rewards,
            "termination": terminations,
            "truncation": truncations,
            "info": info,
        }


def joined(parts: list[dict[str, Any]]) -> tuple[Any, ...]:
    """Return the result of a vector environment from those of its flocks."""
    arrays = [np.concatenate([part[key] for part in parts]) for key in list(parts[0])[:-1]]
    infos: dict[str, Any] = {}
    for name in parts[0]["info"]:
        infos[name] = np.concatenate([part["info"][name] for part in parts])
        infos[f"_{name}"] = np.ones(SLOTS, bool)
    return (*arrays, infos)


class Twins:
    """AgentVectorEnv and one PettingZoo environment per flock, called alike and compared."""

    def __init__(self, scenario: FlockScenario, mode: AutoresetMode, **options: Any) -> None:
        self.env = AgentVectorEnv(SLOTS, scenario, autoreset_mode=mode, num_threads=2, **options)
        self.flocks = [Flock(scenario, **options) for _ in range(FLOCKS)]
        self.env.action_space.seed(0)
        self.ends = np.zeros(2, int)

    def reset(self, seed: int, **options: Any) -> None:
        seeds = [seed + flock for flock in range(FLOCKS)]
        observations, infos = self.env.reset(seed=seed, options=options)
        parts = [flock.reset(own, options) for flock, own in zip(self.flocks, seeds, strict=True)]
        expected = joined(parts)
        assert data_equivalence((observations, infos), (expected[0], expected[-1]), exact=True)

    def step(self, steps: int) -> None:
        mode = self.env.autoreset_mode
        for _ in range(steps):
            ended = np.repeat([flock.must_reset for flock in self.flocks], AGENTS)
            if mode is AutoresetMode.DISABLED and ended.any():
                _, infos = self.env.reset(options={"reset_mask": ended})
                np.testing.assert_array_equal(infos["_mean_distance"], ended)
                for flock in self.flocks:
                    if flock.must_reset:
                        flock.reset()
            actions = self.env.action_space.sample()
            pairs = [
                flock.step(actions[AGENTS * i : AGENTS * (i + 1)], mode)
                for i, flock in enumerate(self.flocks)
            ]
            result, expected = self.env.step(actions), joined([now for now, _ in pairs])
            final = {name: result[4].pop(name) for name in list(result[4]) if "final" in name}
            assert data_equivalence(result, expected, exact=True)
            self.ends += [result[2].sum(), result[3].sum()]
            self._check_final(final, [last for _, last in pairs])

    def _check_final(self, final: dict[str, Any], last: list[dict[str, Any] | None]) -> None:
        mask = np.repeat([each is not None for each in last], AGENTS)
        assert bool(final) == mask.any()
        if final:
            np.testing.assert_array_equal(final["_final_obs"], mask)
            np.testing.assert_array_equal(final["_final_info"], mask)
            ended = [each for each in last if each is not None]
            rows = np.concatenate([each["observation"] for each in ended])
            np.testing.assert_array_equal(np.stack(list(final["final_obs"][mask])), rows)
            for name in ended[0]["info"]:
                column = np.concatenate([each["info"][name] for each in ended])
                np.testing.assert_array_equal(final["final_info"][name][mask], column)


@autoreset_modes
@scenarios
@pytest.mark.parametrize("steps_per_action", [1, 3])
def test_equals_the_pettingzoo_environments(
    scenario: FlockScenario, autoreset_mode: AutoresetMode, steps_per_action: int
) -> None:
    """Flocks with capture end at different times, by truncation and by termination."""
    twins = Twins(scenario, autoreset_mode, reward="individual_distance", steps_per_action=steps_per_action)
    for seed in (7, 2**40):
        twins.reset(seed)
        twins.step(60)
    assert twins.ends[1]
    assert bool(twins.ends[0]) == (scenario.capture_radius is not None)


@every_pair(action_mode=ACTION_MODES, reward=("running_minimum", *INDIVIDUAL_REWARDS))
def test_options(action_mode: str, reward: str) -> None:
    twins = Twins(SCENARIOS["with capture"], AutoresetMode.SAME_STEP, action_mode=action_mode, reward=reward)
    twins.reset(1, initial_positions=np.arange(10.0).reshape(AGENTS, 2))
    twins.step(30)


def test_a_mask_contains_whole_flocks() -> None:
    env = AgentVectorEnv(SLOTS, small_flock())
    mask = np.arange(SLOTS) < AGENTS
    with pytest.raises(ResetNeededError, match="reset_mask"):
        env.reset(options={"reset_mask": mask})
    env.reset(seed=0)
    env.reset(seed=0, options={"reset_mask": mask})
    mask[AGENTS] = True
    with pytest.raises(ArgumentError, match=r"options\['reset_mask'\]: expected equal entries"):
        env.reset(options={"reset_mask": mask})


def test_make_vec() -> None:
    env = gymnasium.make_vec(NAME, num_envs=SLOTS, scenario=small_flock(), autoreset_mode="SameStep")
    assert type(env) is AgentVectorEnv
    assert env.num_envs == SLOTS
    assert env.observation_space.contains(env.reset(seed=2)[0])
    np.testing.assert_array_equal(gymnasium.make_vec(env.spec).reset(seed=2)[0], env.reset(seed=2)[0])
    assert AgentVectorEnv().num_envs == 300
    for count in (1, 301):
        with pytest.raises(ArgumentError, match=r"num_envs: expected a multiple of .*num_agents = 300"):
            gymnasium.make_vec(NAME, num_envs=count)
    with pytest.raises(gymnasium.error.Error, match="entry_point is not specified"):
        gymnasium.make(NAME)
