"""One scenario per flock: slots equal environments of one flock; scenarios that do not agree are rejected."""

import pickle
from functools import partial
from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from option_table import AGENT_REWARDS, FLOCK_REWARDS, UNLIKE, covering, label, small_flock
from same import plain, same

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import Pursue
from flockesc_env.sb3 import vec_env
from flockesc_env.scenario import Learned, PurePursuit, Topological, Uniform, Voronoi

HUNTED = small_flock(
    num_steps=7,
    capture_radius=6.0,
    predators=[
        PurePursuit((0.0, 0.0), (20.0, 20.0), max_turn_rate=6.0),
        PurePursuit((30.0, 30.0), (-9.0, 0.0)),
    ],
)
DRAWN = small_flock(
    num_steps=16, randomization=[Uniform("predator_range", 5.0, 25.0)], neighbor_rule=Voronoi()
)
SCENARIOS = [small_flock(**UNLIKE), HUNTED, DRAWN, HUNTED]
FLOCKS, AGENTS = len(SCENARIOS), 5

Slots = list[Any]
"""What an environment returned to each slot."""


def gymnasium_slots(infos: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """Return the info of each slot. A scenario without captures has no mask; all its agents are active."""
    slots: list[dict[str, Any]] = [{} for _ in range(count)]
    for name, column in infos.items():
        if not name.startswith("_"):
            column = gymnasium_slots(column, count) if isinstance(column, dict) else column
            for slot in np.flatnonzero(infos[f"_{name}"]):
                slots[slot][name] = column[slot]
    for info in slots:
        if "interaction_range" in info:
            info.setdefault("active", True)
    return slots


class Gymnasium:
    """A vector environment of Gymnasium. In mode ``DISABLED`` it is reset after the end of an episode."""

    def __init__(
        self, per_agent: bool, mode: AutoresetMode, scenarios: list[fe.FlockScenario], **options: Any
    ) -> None:
        count = len(scenarios) * (AGENTS if per_agent else 1)
        self.env = BatchVectorEnv(count, scenarios, per_agent=per_agent, autoreset_mode=mode, **options)
        self.rows = count // len(scenarios)

    def reset(self, seed: int) -> Slots:
        observations, infos = self.env.reset(seed=seed)
        return list(zip(observations, gymnasium_slots(infos, len(observations)), strict=True))

    def step(self, actions: np.ndarray) -> Slots:
        *returned, infos = self.env.step(actions)
        count = len(actions)
        slots = [list(row) for row in zip(*returned, gymnasium_slots(infos, count), strict=True)]
        flocks = (returned[2] | returned[3]).reshape(-1, self.rows).any(axis=1)
        if self.env.autoreset_mode is AutoresetMode.DISABLED and flocks.any():
            mask = np.repeat(flocks, self.rows)
            observations, infos = self.env.reset(options={"reset_mask": mask})
            began = gymnasium_slots(infos, count)
            for slot in np.flatnonzero(mask):
                slots[slot] += [observations[slot], began[slot]]
        return slots


OPTIONS: dict[str, tuple[Any, ...]] = {
    "per_agent": (False, True),
    "reward": AGENT_REWARDS,
    "num_threads": (1, 2),
    "steps_per_action": (1, 3),
    "extra_entries": ((), ("escape_direction",)),
}


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("options", covering(**OPTIONS), ids=label)
def test_slots_equal_environments_of_one_flock(mode: AutoresetMode, options: dict[str, Any]) -> None:
    options = dict(options)
    per_agent, reward = options.pop("per_agent"), options.pop("reward")
    reward = reward if per_agent or reward in FLOCK_REWARDS else "team"
    make = partial(Gymnasium, per_agent, mode, reward=reward, count_components=True, **options)
    together, alone = make(scenarios=SCENARIOS), [make(scenarios=[scenario]) for scenario in SCENARIOS]
    rng = np.random.default_rng(0)
    rows = AGENTS if per_agent else 1
    returned = together.reset(5)
    for flock, env in enumerate(alone):
        same(env.reset(5 + flock), returned[flock * rows : (flock + 1) * rows])
    for _ in range(40):
        actions = rng.uniform(-1, 1, (FLOCKS * rows, 1)).astype(np.float32)
        returned = together.step(actions)
        for flock, env in enumerate(alone):
            slots = slice(flock * rows, (flock + 1) * rows)
            same(env.step(actions[slots]), returned[slots])


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
        make(scenario=[SCENARIOS[0], HUNTED, other], max_range=4.0)
    assert raised.value.field == f"scenario[2].{field}"


def test_snapshots_belong_to_scenarios() -> None:
    envs, other = BatchVectorEnv(FLOCKS, SCENARIOS), BatchVectorEnv(FLOCKS, SCENARIOS[::-1])
    envs.reset(seed=3)
    other.reset(seed=8)
    actions = np.zeros((FLOCKS, 1), np.float32)
    envs.step(actions)
    state, one = envs.get_state(), envs.get_state(1)
    before = other.get_state()
    for refused, flocks in ((state, None), (one, 3), (one, [0, 1]), (envs.get_state([0, 1]), [0, 1])):
        with pytest.raises(InputError, match="same scenario"):
            other.set_state(refused, flocks)
    assert other.get_state() == before
    other.set_state(one, [0, 2])  # both have the scenario HUNTED
    single = fe.FlockEscapeEnv(HUNTED)
    single.set_state(one)
    assert other.get_state(0) == other.get_state(2) == single.get_state() == one
    twin = BatchVectorEnv(FLOCKS, list(SCENARIOS), num_threads=2)
    twin.set_state(state)
    copy = pickle.loads(pickle.dumps(envs))  # noqa: S301
    for _ in range(20):
        expected = plain(envs.step(actions))
        assert plain(twin.step(actions)) == plain(copy.step(actions)) == expected


def test_predator_policies() -> None:
    scenarios = [small_flock(predators=[Learned(max_speed=speed)]) for speed in (12.0, 24.0)]
    options = {"action_mode": "range", "predator_policy": Pursue(), "autoreset_mode": "SameStep"}
    together = BatchVectorEnv(2, scenarios, **options)
    alone = [BatchVectorEnv(1, scenario, **options) for scenario in scenarios]
    together.reset(seed=1)
    for seed, env in enumerate(alone, 1):
        env.reset(seed=seed)
    for _ in range(25):
        observations, rewards, *_ = together.step(np.full((2, 1), 5.0, np.float32))
        steps = [env.step(np.full((1, 1), 5.0, np.float32)) for env in alone]
        same(observations, np.concatenate([step[0] for step in steps]))
        same(rewards, np.concatenate([step[1] for step in steps]))
