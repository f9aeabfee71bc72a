"""One scenario per flock: slots of agents, scenarios that do not agree, and snapshots.

Slots of flocks: ``test_vector_env.py``.
"""

from functools import partial
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from option_table import ACTION_MODES, AGENT_REWARDS, HUNTED, SEVERAL, covering, label, small_flock
from same import same

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.sb3 import vec_env
from flockesc_env.scenario import Learned, Topological

FLOCKS, AGENTS = len(SEVERAL), 5


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize(
    "options",
    covering(reward=AGENT_REWARDS, num_threads=(1, 2), steps_per_action=(1, 3), action_mode=ACTION_MODES[:2]),
    ids=label,
)
def test_slots_of_agents_equal_parallel_environments(mode: AutoresetMode, options: dict[str, Any]) -> None:
    """A caught agent keeps its slot to the end of the episode."""
    together = BatchVectorEnv(None, SEVERAL, per_agent=True, autoreset_mode=mode, **options)
    alone = [fe.parallel_env(scenario, **options) for scenario in SEVERAL]
    started = [env.reset_array(seed=5 + flock)[0] for flock, env in enumerate(alone)]
    same(together.reset(seed=5)[0], np.concatenate(started))
    together.action_space.seed(0)
    has_ended, seen = [False] * FLOCKS, set()
    for _ in range(40):
        if mode is AutoresetMode.DISABLED and any(has_ended):
            rows, _ = together.reset(options={"reset_mask": np.repeat(has_ended, AGENTS)})
            for flock in np.flatnonzero(has_ended):
                same(rows.reshape(FLOCKS, AGENTS, -1)[flock], alone[flock].reset_array()[0])
        actions = together.action_space.sample()
        *returned, infos = together.step(actions)
        for flock, env in enumerate(alone):
            slots = slice(AGENTS * flock, AGENTS * (flock + 1))
            if mode is AutoresetMode.NEXT_STEP and has_ended[flock]:
                has_ended[flock] = False
                ignored = np.zeros(AGENTS), np.zeros(AGENTS, bool), np.zeros(AGENTS, bool)
                expected = [env.reset_array()[0], *ignored]
            else:
                rows, rewards, terminations, truncations, info = env.step_array(actions[slots])
                has_ended[flock] = not env.agents
                expected = [rows, rewards, terminations & has_ended[flock], truncations & has_ended[flock]]
                seen |= {*terminations.tolist(), *truncations.tolist()} if has_ended[flock] else set()
                columns = infos
                if has_ended[flock] and mode is AutoresetMode.SAME_STEP:
                    same(np.stack(infos["final_obs"][slots]), rows)
                    expected[0], columns = env.reset_array()[0], infos["final_info"]
                same(columns["interaction_range"][slots], info["interaction_range"])
                same(columns["mean_distance"][slots], np.full(AGENTS, info["mean_distance"]))
            same([part[slots] for part in returned], expected)
    assert seen == {False, True}


@pytest.mark.parametrize(
    "make",
    [partial(BatchVectorEnv, 3), *(partial(vec_env, num_flocks=3, per_agent=each) for each in (False, True))],
)
@pytest.mark.parametrize(
    ("field", "other"),
    [
        ("num_agents", small_flock(num_agents=6)),
        ("dimension", small_flock(3)),
        ("initial_side", small_flock(initial_side=31.0)),
        ("neighbor_rule", small_flock(neighbor_rule=Topological())),
        ("predators", small_flock(predators=[Learned()])),
        ("predators", small_flock(predators=[])),
    ],
)
def test_scenarios_that_differ_too_much(make: Any, field: str, other: fe.FlockScenario) -> None:
    with pytest.raises(InputError) as raised:
        make(scenario=[SEVERAL[0], HUNTED, other], max_range=4.0)
    assert raised.value.field == f"scenario[2].{field}"


def test_snapshots_belong_to_scenarios() -> None:
    envs, other = BatchVectorEnv(FLOCKS, SEVERAL), BatchVectorEnv(FLOCKS, SEVERAL[::-1])
    envs.reset(seed=3)
    other.reset(seed=8)
    envs.step(np.zeros((FLOCKS, 1), np.float32))
    one, before = envs.get_state(1), other.get_state()
    for refused, flocks in (
        (envs.get_state(), None),
        (one, 3),
        (one, [0, 1]),
        (envs.get_state([0, 1]), [0, 1]),
    ):
        with pytest.raises(InputError, match="same scenario"):
            other.set_state(refused, flocks)
    assert other.get_state() == before
    other.set_state(one, [0, 2])  # both have the scenario HUNTED
    single = fe.FlockEscapeEnv(HUNTED)
    single.set_state(one)
    assert other.get_state(0) == other.get_state(2) == single.get_state() == one
