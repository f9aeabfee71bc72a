"""AgentVectorEnv returns the same as the PettingZoo environments of its flocks."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from captured_flocks import doomed
from option_table import small_flock

from flockesc_env import AgentVectorEnv, ArgumentError, ResetNeededError

NAME = "flockesc_env:flockesc/FlockAgents-v0"
FLOCKS, AGENTS = 3, 5
SLOTS = FLOCKS * AGENTS
SCENARIOS = {"without capture": small_flock(), "with capture": doomed(num_agents=AGENTS)}

scenarios = pytest.mark.parametrize("scenario", SCENARIOS.values(), ids=SCENARIOS)


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
