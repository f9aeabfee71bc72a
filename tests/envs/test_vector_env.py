"""BatchVectorEnv returns the same as Gymnasium's SyncVectorEnv over single environments."""

import copy
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics
from option_table import ACTION_MODES, EVERY_STEP, FLOCK_REWARDS, doomed, small_flock

from flockesc_env.common.errors import FlockescError, InputError
from flockesc_env.envs.vector import BatchVectorEnv

NAME = "flockesc_env:flockesc/FlockEscape-v1"
SLOTS = 4
START = {"initial_positions": np.arange(10.0).reshape(5, 2), "predator_velocities": np.array([[3.0, 4.0]])}
MASK = np.array([True, False, True, False])

autoreset_modes = pytest.mark.parametrize("autoreset_mode", AutoresetMode)
action_modes = pytest.mark.parametrize("action_mode", ACTION_MODES)


class Twins:
    """BatchVectorEnv and SyncVectorEnv, called with the same arguments and compared."""

    def __init__(self, autoreset_mode: AutoresetMode, **options: Any) -> None:
        options = {"scenario": small_flock(), **EVERY_STEP, **options}
        self.native = BatchVectorEnv(SLOTS, autoreset_mode=autoreset_mode, **options)
        make = partial(gymnasium.make, NAME, disable_env_checker=True, **options)
        self.sync = SyncVectorEnv([make] * SLOTS, autoreset_mode=autoreset_mode)
        self.sync.action_space.seed(0)
        self.ended = np.zeros(SLOTS, bool)
        self.ends = np.zeros(2, int)

    def reset(self, seed: Any = None, mask: np.ndarray | None = None, **options: Any) -> None:
        # SyncVectorEnv removes the mask from the dict that it gets.
        given = [{**options, **({} if mask is None else {"reset_mask": mask.copy()})} for _ in range(2)]
        native = self.native.reset(seed=seed, options=given[0])
        assert data_equivalence(native, self.sync.reset(seed=seed, options=given[1]), exact=True)
        assert ("reset_mask" in given[0]) == (mask is not None)

    def step(self, steps: int = 1) -> None:
        for _ in range(steps):
            if self.native.autoreset_mode is AutoresetMode.DISABLED and self.ended.any():
                self.reset(mask=self.ended)
            actions = self.sync.action_space.sample()
            native = self.native.step(actions)
            assert data_equivalence(native, self.sync.step(actions), exact=True)
            self.ended = native[2] | native[3]
            self.ends += [native[2].sum(), native[3].sum()]


@autoreset_modes
@action_modes
def test_episodes_of_unequal_phase(autoreset_mode: AutoresetMode, action_mode: str) -> None:
    """After masked resets in mid-episode, slots end at different times."""
    twins = Twins(autoreset_mode, action_mode=action_mode, count_components=True)
    twins.reset(1)
    twins.step(3)
    twins.reset(mask=MASK)
    twins.step(4)
    twins.reset(seed=[None, 9, None, None], mask=~MASK)
    twins.step(31)
    twins.reset(seed=40, mask=MASK, **START)
    twins.step(25)
    twins.reset()
    twins.step(12)


@autoreset_modes
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("reward", FLOCK_REWARDS)
@pytest.mark.parametrize("steps_per_action", [1, 4])
def test_options(autoreset_mode: AutoresetMode, dimension: int, reward: str, steps_per_action: int) -> None:
    twins = Twins(
        autoreset_mode, scenario=small_flock(dimension), reward=reward, steps_per_action=steps_per_action
    )
    twins.reset(0)
    twins.step(15)


LONG: dict[str, Any] = {"scenario": small_flock(num_steps=100)}
LIMITS: dict[str, dict[str, Any]] = {
    "one action": {"max_episode_steps": 1, **LONG},
    "range": {"max_episode_steps": 10, "action_mode": "range", "reward": "terminal", **LONG},
    "discrete": {"max_episode_steps": 10, "action_mode": "discrete", "steps_per_action": 3, **LONG},
    "beyond the end": {"max_episode_steps": 30, "steps_per_action": 4, **LONG},
    "at the end": {"max_episode_steps": 10, "scenario": doomed(num_steps=10), "count_components": True},
    "captures": {"max_episode_steps": 11, "scenario": doomed(), "steps_per_action": 3},
}


@autoreset_modes
@pytest.mark.parametrize("options", LIMITS.values(), ids=LIMITS)
def test_a_limit_is_that_of_gymnasium(autoreset_mode: AutoresetMode, options: dict[str, Any]) -> None:
    twins = Twins(autoreset_mode, num_threads=3, **options)
    twins.reset(1)
    twins.step(4)
    twins.reset(mask=MASK)  # from here on, slots end at different times
    twins.step(60)
    assert twins.ends.sum() >= SLOTS * (2 if options["max_episode_steps"] > 12 else 4)


@autoreset_modes
@pytest.mark.parametrize("per_agent", [False, True])
def test_a_limit_counts_from_the_restored_state(autoreset_mode: AutoresetMode, per_agent: bool) -> None:
    scenario = small_flock(num_steps=100, capture_radius=1.0)
    options: Any = {"per_agent": per_agent, "autoreset_mode": autoreset_mode, "max_episode_steps": 3}
    env: Any = gymnasium.make_vec(NAME, 10, scenario=scenario, copy=False, **options)
    assert env.spec.max_episode_steps == 3
    actions = np.zeros(env.action_space.shape, np.float32)
    with pytest.raises(FlockescError, match=r"reset\(\)"):
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
            with pytest.raises(FlockescError, match="after the end of flock 0's episode"):
                env.step(actions)
        else:
            assert not env.step(actions)[3].any()
    for limit in (-1, None):
        unlimited: Any = gymnasium.make_vec("flockesc/one-range-v1", max_episode_steps=limit)
        assert unlimited.spec.max_episode_steps == 60


@autoreset_modes
@pytest.mark.parametrize("steps_per_action", [1, 3])
def test_captures(autoreset_mode: AutoresetMode, steps_per_action: int) -> None:
    """Some flocks lose all agents and terminate; the others are truncated."""
    options = {"scenario": doomed(), "objective": "fraction_surviving", "steps_per_action": steps_per_action}
    twins = Twins(autoreset_mode, num_threads=3, **options)
    twins.reset(3)
    twins.step(120)
    assert twins.ends.all()


@pytest.mark.skipif(
    gymnasium.__version__ in {"1.2.0", "1.2.1"},
    reason="there DictInfoToList cannot read what Gymnasium's own RecordEpisodeStatistics writes",
)
@autoreset_modes
def test_wrappers_of_gymnasium_see_no_difference(autoreset_mode: AutoresetMode) -> None:
    twins = Twins(autoreset_mode)
    native, sync = (
        DictInfoToList(RecordEpisodeStatistics(env, stats_key="stats")) for env in (twins.native, twins.sync)
    )
    assert data_equivalence(native.reset(seed=1), sync.reset(seed=1), exact=True)
    recorded = 0
    for _ in range(10 if autoreset_mode is AutoresetMode.DISABLED else 25):
        actions = sync.action_space.sample()
        result, expected = native.step(actions), sync.step(actions)
        for info in (*result[4], *expected[4]):
            if "stats" in info:
                recorded += 1
                del info["stats"]["t"]  # the time that it took
        assert data_equivalence(result, expected, exact=True)
    assert recorded >= 2 * SLOTS


@pytest.mark.parametrize("mode", [*AutoresetMode, "NextStep", "SameStep", "Disabled"])
def test_make_vec(mode: Any) -> None:
    options = {"scenario": small_flock(), "autoreset_mode": mode, "num_threads": 1, "reward": "distance"}
    env = gymnasium.make_vec(NAME, num_envs=3, vectorization_mode="vector_entry_point", **options)
    assert type(env) is BatchVectorEnv
    assert env.metadata["autoreset_mode"] is AutoresetMode(mode)
    assert env.options.reward == "distance"
    assert env.spec is not None
    observations, _ = env.reset(seed=2)
    assert env.observation_space.contains(observations)
    again = gymnasium.make_vec(env.spec)
    np.testing.assert_array_equal(again.reset(seed=2)[0], observations)
    env.close()
    env.close()
    assert env.closed
    assert type(gymnasium.make_vec(NAME)) is BatchVectorEnv  # the default


def play(env: VectorEnv[Any, Any, Any], keep: Any = copy.deepcopy) -> list[Any]:
    """Return ``keep`` of everything that an environment returns."""
    env.action_space.seed(0)
    results = [keep(env.reset(seed=0))]
    results += [keep(env.step(env.action_space.sample())) for _ in range(25)]
    return [*results, keep(env.reset(options={"reset_mask": MASK.copy()}))]


@pytest.mark.parametrize("autoreset_mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_copy_false_reuses_two_arrays(autoreset_mode: AutoresetMode) -> None:
    """Unless the user locked them."""

    def lock(result: Any) -> Any:
        kept = copy.deepcopy(result)
        for array in result[:2]:
            if isinstance(array, np.ndarray):
                array.flags.writeable = False
        return kept

    fresh, reusing = (
        BatchVectorEnv(SLOTS, small_flock(), autoreset_mode=autoreset_mode, copy=keep)
        for keep in (True, False)
    )
    expected = play(fresh, keep=lambda result: result)
    assert data_equivalence(play(reusing), expected, exact=True)
    # New arrays share no memory with earlier ones; with copy=False the two arrays are reused.
    observations = [result[0] for result in expected]
    rewards = [result[1] for result in expected[1:-1]]
    for arrays in (observations, rewards):
        assert not any(np.shares_memory(a, b) for i, a in enumerate(arrays) for b in arrays[:i])
    returned = play(reusing, keep=lambda result: result)
    assert all(np.shares_memory(result[0], returned[0][0]) for result in returned)
    assert all(np.shares_memory(result[1], returned[1][1]) for result in returned[1:-1])
    for index in (2, 3):
        assert len({id(result[index]) for result in returned[1:-1]}) == 25
    assert data_equivalence(play(reusing, keep=lock), expected, exact=True)


@action_modes
@pytest.mark.parametrize("limited", [{}, {"max_episode_steps": 10, **LONG}], ids=["end", "limit"])
def test_actions_of_slots_that_are_reset_are_ignored(action_mode: str, limited: dict[str, Any]) -> None:
    twins = Twins(AutoresetMode.NEXT_STEP, action_mode=action_mode, **limited)
    twins.reset(0)
    twins.step(4)
    twins.reset(mask=MASK)
    twins.step(6)
    assert twins.ended.tolist() == [False, True, False, True]
    actions = twins.sync.action_space.sample()
    spoilt = actions.copy()
    spoilt[1::2] = 10**6 if action_mode == "discrete" else np.nan
    bad = spoilt.copy()
    bad[2] = bad[1]
    for refused, field in ((bad, "action[2]"), (spoilt[1:], "action"), (spoilt.astype(object), "action")):
        with pytest.raises(InputError) as caught:
            twins.native.step(refused)
        assert caught.value.field == field
    assert data_equivalence(twins.native.step(spoilt), twins.sync.step(actions), exact=True)
    twins.step(20)


def test_ended_slots_are_not_stepped_without_autoreset() -> None:
    twins = Twins(AutoresetMode.DISABLED)
    twins.reset(0)
    twins.step(4)
    twins.reset(mask=MASK)
    twins.step(6)
    with pytest.raises(FlockescError, match="flock 1"):
        twins.native.step(twins.sync.action_space.sample())
    twins.step(20)


@pytest.mark.parametrize(
    ("seed", "options", "field"),
    [
        (2**64 - SLOTS + 1, {}, "seed of the last flock"),
        ([1, 2, 3, -1], {}, "seed[3]"),
        (None, {"reset_mask": [True] * SLOTS}, "options['reset_mask']"),
        (None, {"reset_mask": np.ones(SLOTS + 1, bool)}, "options['reset_mask']"),
        (None, {"reset_mask": MASK, "positions": 1}, "options['positions']"),
    ],
)
def test_refused_resets_leave_no_trace(seed: Any, options: dict[str, Any], field: str) -> None:
    env, twin = (BatchVectorEnv(SLOTS, small_flock()) for _ in range(2))
    for each in (env, twin):
        each.reset(seed=6)
    with pytest.raises(InputError) as caught:
        env.reset(seed=seed, options=options)
    assert caught.value.field == field
    actions = np.zeros((SLOTS, 1), np.float32)
    assert data_equivalence(env.step(actions), twin.step(actions), exact=True)
    assert data_equivalence(env.reset(), twin.reset(), exact=True)


def test_a_mask_contains_whole_flocks() -> None:
    num_agents = small_flock().num_agents
    env = BatchVectorEnv(3 * num_agents, small_flock(), per_agent=True)
    mask = np.arange(3 * num_agents) < num_agents
    with pytest.raises(FlockescError, match="reset_mask"):
        env.reset(options={"reset_mask": mask})
    env.reset(seed=0)
    env.reset(seed=0, options={"reset_mask": mask})
    mask[num_agents] = True
    with pytest.raises(InputError, match=r"options\['reset_mask'\]: expected equal entries"):
        env.reset(options={"reset_mask": mask})
