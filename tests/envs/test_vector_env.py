"""BatchVectorEnv returns the same as Gymnasium's SyncVectorEnv, and as parallel environments.

Also with one scenario per flock: the scenarios that agree, and their snapshots.
"""

import copy
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import option_table as table
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from option_table import ACTION_MODES, EVERY_STEP, HUNTED, SEVERAL, covering, doomed, small_flock
from same import same

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import Pursue, StubbornLeaders
from flockesc_env.scenario import Learned, Topological

NAME = "flockesc_env:flockesc/FlockEscape-v1"
SLOTS = 4
MASK = np.array([True, False, True, False])

autoreset_modes = pytest.mark.parametrize("autoreset_mode", AutoresetMode)
REFUSED: list[tuple[Any, dict[str, Any], str]] = [
    (2**64 - 2, {}, "seed of the last flock"),
    ([1, 2, -1], {}, "seed[2]"),
    (None, {"reset_mask": [True] * 15}, "options['reset_mask']"),
    (None, {"reset_mask": np.ones(16, bool)}, "options['reset_mask']"),
    (None, {"reset_mask": np.arange(15) < 6}, "options['reset_mask']"),  # a part of the second flock
    (None, {"reset_mask": np.arange(15) < 5, "positions": 1}, "options['positions']"),
]
FLOCKS, AGENTS = len(SEVERAL), 5
REWARDS = {"reward": table.AGENT_REWARDS}


class Twins:
    """BatchVectorEnv and SyncVectorEnv, called with the same arguments and compared."""

    def __init__(self, autoreset_mode: AutoresetMode, **options: Any) -> None:
        options = {"scenario": small_flock(), **EVERY_STEP, **options}
        name = options.pop("name", NAME)
        self.native: Any = gymnasium.make_vec(name, SLOTS, autoreset_mode=autoreset_mode, **options)
        make = partial(gymnasium.make, name, disable_env_checker=True)
        assert type(self.native) is BatchVectorEnv
        assert self.native.metadata["autoreset_mode"] is autoreset_mode
        makers = [partial(make, **options | {"scenario": each}) for each in self.native.scenarios]
        self.sync = SyncVectorEnv(makers, autoreset_mode=autoreset_mode)
        self.sync.action_space.seed(0)
        self.ended = np.zeros(SLOTS, bool)
        self.ends = np.zeros(2, int)

    def reset(self, seed: Any = None, mask: np.ndarray | None = None, **options: Any) -> None:
        # SyncVectorEnv removes the mask from the dict that it gets.
        given = [{**options, **({} if mask is None else {"reset_mask": mask.copy()})} for _ in range(2)]
        native = self.native.reset(seed=seed, options=given[0])
        assert data_equivalence(native, self.sync.reset(seed=seed, options=given[1]), exact=True)
        assert ("reset_mask" in given[0]) == (mask is not None)
        self.ended = self.ended & (False if mask is None else ~mask)

    def step(self, steps: int = 1) -> None:
        for _ in range(steps):
            actions = self.sync.action_space.sample()
            if self.native.autoreset_mode is AutoresetMode.DISABLED and self.ended.any():
                with pytest.raises(fe.FlockescError, match=f"after the end of flock {self.ended.argmax()}'s"):
                    self.native.step(actions)
                self.reset(mask=self.ended)
            spoilt = actions.copy()
            if self.native.autoreset_mode is AutoresetMode.NEXT_STEP:  # it ignores them in a reset
                spoilt[self.ended] = 10**6 if actions.ndim == 1 else np.nan
            native = self.native.step(spoilt)
            assert data_equivalence(native, self.sync.step(actions), exact=True)
            self.ended = native[2] | native[3]
            self.ends += [native[2].sum(), native[3].sum()]


LONG: dict[str, Any] = {"scenario": small_flock(num_steps=100)}
CHASED = small_flock(predators=[Learned(max_speed=24.0)])
CAUGHT = CHASED.replace(capture_radius=12.0)
HUNTER = "flockesc_env:flockesc/Predator-v1"
DOOMED: dict[str, Any] = {"scenario": doomed(), "objective": "fraction_surviving", "num_threads": 3}
CASES: list[dict[str, Any]] = [
    *(
        {"scenario": small_flock(options.pop("dimension")), **options}
        for options in covering(**table.FLOCK, dimension=table.DIMENSIONS, count_components=(False, True))
    ),
    {"scenario": SEVERAL, "num_threads": 2, "extra_entries": ("escape_direction",), "max_range": 4.0},
    {"scenario": 2 * [CHASED, CHASED.replace(num_steps=7)], "predator_policy": Pursue()},
    *({**DOOMED, "steps_per_action": steps} for steps in (1, 3)),
    *({"name": HUNTER, "scenario": [s] * 3 + [s.replace(num_steps=7)]} for s in (CHASED, CAUGHT)),
    {"name": HUNTER, "scenario": CAUGHT, "flock_policy": StubbornLeaders(), "max_episode_steps": 6},
    {"max_episode_steps": 1, **LONG},
    {"max_episode_steps": 10, "action_mode": "range", "reward": "terminal", **LONG},
    {"max_episode_steps": 10, "action_mode": "discrete", "steps_per_action": 3, **LONG},
    {"max_episode_steps": 30, "steps_per_action": 4, **LONG},  # beyond the end
    {"max_episode_steps": 10, "scenario": doomed(num_steps=10), "count_components": True},  # at the end
    {"max_episode_steps": 11, "scenario": doomed(), "steps_per_action": 3},
]
"""Pairs of options, several scenarios, captures, and limits on the number of actions."""


@autoreset_modes
@pytest.mark.parametrize("options", CASES)
def test_slots_equal_environments(autoreset_mode: AutoresetMode, options: dict[str, Any]) -> None:
    """After masked resets in mid-episode, slots end at different times."""
    twins = Twins(autoreset_mode, **options)
    scenario = twins.native.scenarios[0]
    agents, dimension, predators = scenario.num_agents, scenario.dimension, len(scenario.predators)
    twins.reset(1)
    twins.step(3)
    twins.reset(mask=MASK)
    twins.step(4)
    twins.reset(seed=[None, 9, None, None], mask=~MASK)
    twins.step(31)
    start = {"initial_positions": np.arange(float(agents * dimension)).reshape(agents, dimension)}
    velocities = np.ones((predators, dimension))
    twins.reset(seed=40, mask=MASK, **start, predator_velocities=velocities, episode=4)
    twins.step(25)
    twins.reset()
    twins.step(60)
    assert twins.ends[1] or twins.ends.all()


@autoreset_modes
@pytest.mark.parametrize("per_agent", [False, True])
def test_a_limit_counts_from_the_restored_state(autoreset_mode: AutoresetMode, per_agent: bool) -> None:
    scenario = small_flock(num_steps=100, capture_radius=1.0)
    options: Any = {"per_agent": per_agent, "autoreset_mode": autoreset_mode, "max_episode_steps": 3}
    env: Any = gymnasium.make_vec(NAME, 10, scenario=scenario, copy=False, **options)
    assert env.spec.max_episode_steps == 3
    actions = np.zeros(env.action_space.shape, np.float32)
    with pytest.raises(fe.FlockescError, match=r"reset\(\)"):
        env.step(actions)
    env.reset(seed=0)
    env.step(actions)
    state = env.get_state()
    for _ in range(2):
        env.set_state(state)
        assert not env.step(actions)[3].any()
        copied = copy.deepcopy(env)
        observations, _, _, truncated, _ = env.step(actions)
        assert truncated.all()
        np.testing.assert_array_equal(copied.step(actions)[0], observations)
        if autoreset_mode is AutoresetMode.DISABLED:
            with pytest.raises(fe.FlockescError, match="after the end of flock 0's episode"):
                env.step(actions)
        else:
            assert not env.step(actions)[3].any()
    for limit in (-1, None):
        unlimited: Any = gymnasium.make_vec("flockesc/one-range-v1", max_episode_steps=limit)
        assert unlimited.spec.max_episode_steps == 60


@pytest.mark.parametrize("autoreset_mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_copy_false_reuses_two_arrays(autoreset_mode: AutoresetMode) -> None:
    """Also if the caller locks them. New arrays share no memory with earlier ones."""
    fresh, reusing = (
        BatchVectorEnv(SLOTS, small_flock(), autoreset_mode=autoreset_mode, copy=keep)
        for keep in (True, False)
    )
    reusing.reset(seed=0)
    kept, paid, reused = [fresh.reset(seed=0)[0]], [], ()
    fresh.action_space.seed(0)
    for _ in range(25):
        actions = fresh.action_space.sample()
        expected, returned = fresh.step(actions), reusing.step(actions)
        assert data_equivalence(returned, expected, exact=True)
        for array, earlier in zip(expected[:2], (kept, paid), strict=True):
            assert not any(np.shares_memory(array, other) for other in earlier)
            earlier.append(array)
        reused = reused or returned[:2]
        assert all(map(np.shares_memory, returned, reused))
        returned[0].flags.writeable = returned[1].flags.writeable = False
    masked = [env.reset(options={"reset_mask": MASK.copy()}) for env in (fresh, reusing)]
    assert data_equivalence(*masked, exact=True)


def test_refused_resets_leave_no_trace() -> None:
    env, twin = (BatchVectorEnv(15, small_flock(), per_agent=True) for _ in range(2))
    with pytest.raises(fe.FlockescError, match="reset_mask that leaves slots out"):
        env.reset(options={"reset_mask": np.arange(15) < 5})
    for each in (env, twin):
        each.reset(seed=6)
        each.reset(seed=7, options={"reset_mask": np.arange(15) < 5})
    for seed, options, field in REFUSED:
        with pytest.raises(fe.InputError, check=lambda error, field=field: error.field == field):
            env.reset(seed=seed, options=options)
    actions = np.zeros((15, 1), np.float32)
    assert data_equivalence(env.step(actions), twin.step(actions), exact=True)
    assert data_equivalence(env.reset(), twin.reset(), exact=True)


@autoreset_modes
@pytest.mark.parametrize(
    "options",
    covering(**REWARDS, num_threads=(1, 2), steps_per_action=(1, 3), action_mode=ACTION_MODES[:2]),
    ids=table.label,
)
def test_slots_of_agents_equal_parallel_environments(
    autoreset_mode: AutoresetMode, options: dict[str, Any]
) -> None:
    """A caught agent keeps its slot to the end of the episode."""
    together = BatchVectorEnv(None, SEVERAL, per_agent=True, autoreset_mode=autoreset_mode, **options)
    alone = [fe.parallel_env(scenario, **options) for scenario in SEVERAL]
    started = [env.reset_array(seed=5 + flock)[0] for flock, env in enumerate(alone)]
    same(together.reset(seed=5)[0], np.concatenate(started))
    together.action_space.seed(0)
    has_ended, seen = [False] * FLOCKS, set()
    for _ in range(40):
        if autoreset_mode is AutoresetMode.DISABLED and any(has_ended):
            rows, _ = together.reset(options={"reset_mask": np.repeat(has_ended, AGENTS)})
            for flock in np.flatnonzero(has_ended):
                same(rows.reshape(FLOCKS, AGENTS, -1)[flock], alone[flock].reset_array()[0])
        actions = together.action_space.sample()
        *returned, infos = together.step(actions)
        for flock, env in enumerate(alone):
            slots = slice(AGENTS * flock, AGENTS * (flock + 1))
            if autoreset_mode is AutoresetMode.NEXT_STEP and has_ended[flock]:
                has_ended[flock] = False
                ignored = np.zeros(AGENTS), np.zeros(AGENTS, bool), np.zeros(AGENTS, bool)
                expected = [env.reset_array()[0], *ignored]
            else:
                rows, rewards, terminations, truncations, info = env.step_array(actions[slots])
                has_ended[flock] = not env.agents
                expected = [rows, rewards, terminations & has_ended[flock], truncations & has_ended[flock]]
                seen |= {*terminations.tolist(), *truncations.tolist()} if has_ended[flock] else set()
                columns = infos
                if has_ended[flock] and autoreset_mode is AutoresetMode.SAME_STEP:
                    same(np.stack(infos["final_obs"][slots]), rows)
                    expected[0], columns = env.reset_array()[0], infos["final_info"]
                same(columns["interaction_range"][slots], info["interaction_range"])
                same(columns["mean_distance"][slots], np.full(AGENTS, info["mean_distance"]))
            same([part[slots] for part in returned], expected)
    assert seen == {False, True}


@pytest.mark.parametrize(
    ("field", "other"),
    [
        ("num_agents", small_flock(num_agents=6)),
        ("dimension", small_flock(3)),
        ("initial_side", small_flock(initial_side=31.0)),
        ("range_unit", small_flock(neighbor_rule=Topological())),
        ("predators", small_flock(predators=[Learned()])),
        ("predators", small_flock(predators=[])),
    ],
)
def test_scenarios_that_differ_too_much(field: str, other: fe.FlockScenario) -> None:
    with pytest.raises(fe.InputError, check=lambda error: error.field == f"scenario[2].{field}"):
        BatchVectorEnv(3, [SEVERAL[0], HUNTED, other], max_range=4.0)


def test_snapshots_belong_to_scenarios() -> None:
    envs, other = BatchVectorEnv(FLOCKS, SEVERAL), BatchVectorEnv(FLOCKS, SEVERAL[::-1])
    envs.reset(seed=3)
    other.reset(seed=8)
    envs.step(np.zeros((FLOCKS, 1), np.float32))
    one, two, before = envs.get_state(1), envs.get_state([0, 1]), other.get_state()
    for refused, flocks in ((envs.get_state(), None), (one, 3), (one, [0, 1]), (two, [0, 1])):
        with pytest.raises(fe.InputError, match="same scenario"):
            other.set_state(refused, flocks)
    assert other.get_state() == before
    other.set_state(one, [0, 2])  # both have the scenario HUNTED
    single = fe.FlockEscapeEnv(HUNTED)
    single.set_state(one)
    assert other.get_state(0) == other.get_state(2) == single.get_state() == one
