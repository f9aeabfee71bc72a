"""Captures in every interface: all play the same episode and continue without the caught agents."""

from typing import Any

import numpy as np
import option_table as table
import pytest
import reference
from envs import draw
from gymnasium.utils.env_checker import data_equivalence

import flockesc_env as fe
from flockesc_env.scenario import Learned

SEEDS = range(12)
dimensions = pytest.mark.parametrize("dimension", table.DIMENSIONS)


def play_array(scenario: fe.FlockScenario, seed: int, **options: Any) -> list[tuple[Any, ...]]:
    """Return the results of every `step_array` under a range of 3 m."""
    env = fe.parallel_env(scenario, action_mode="range", **options)
    env.reset_array(seed=seed)
    actions = np.full((scenario.num_agents, 1), 3.0)
    steps = []
    while env.agents:
        steps.append(env.step_array(actions))
    return steps


@pytest.mark.parametrize("scenario", [table.hunted(2), table.hunted(2).with_learned_predators()])
def test_infos_at_the_end_only(scenario: fe.FlockScenario) -> None:
    """Agents that go on share a new empty dict; the infos of the others are the same as otherwise."""
    full, sparse = (fe.parallel_env(scenario, infos=infos, **table.EVERY_STEP) for infos in ("all", "end"))
    full.reset(seed=SEEDS[0])
    sparse.reset(seed=SEEDS[0])
    num_full = 0
    while sparse.agents:
        agents = sparse.agents
        actions = {agent: np.zeros(full.action_space(agent).shape, np.float32) for agent in agents}
        *expected, all_infos = full.step(actions)
        *given, infos = sparse.step(actions)
        assert data_equivalence(given, expected)
        assert list(infos) == agents
        _, _, terminations, truncations = given
        for agent, info in infos.items():
            has_ended = terminations[agent] or truncations[agent]
            assert info == (all_infos[agent] if has_ended else {})
            num_full += has_ended
        ended = [agent for agent in agents if terminations[agent] or truncations[agent]]
        assert len({id(infos[agent]) for agent in ended}) == len(ended)
        for info in infos.values():
            info["written"] = True  # does not show in later steps
    assert num_full == len(sparse.possible_agents)


@dimensions
@pytest.mark.parametrize("objective", table.OBJECTIVES)
@pytest.mark.parametrize("reward", ["team", *table.INDIVIDUAL_REWARDS])
def test_dicts_and_arrays_play_one_episode(dimension: int, objective: str, reward: str) -> None:
    scenario = table.hunted(dimension)
    options = {**table.EVERY_STEP, "objective": objective, "reward": reward, "steps_per_action": 2}
    env = fe.parallel_env(scenario, action_mode="range", **options)
    env.reset(seed=4)
    alive = np.ones(scenario.num_agents, bool)
    was_any_caught = False
    for rows, rewards, terminations, truncations, info in play_array(scenario, 4, **options):
        acting = [agent for agent, is_alive in zip(env.possible_agents, alive, strict=True) if is_alive]
        assert env.agents == acting
        result = env.step({agent: np.array([3.0], np.float32) for agent in acting})
        expected = [rows[alive], rewards[alive], terminations[alive], truncations[alive]]
        for got, wanted in zip(result, expected, strict=False):
            assert list(got) == acting
            np.testing.assert_array_equal(list(got.values()), wanted)
        assert not rows[terminations].any()
        assert not rewards[~alive].any()
        assert terminations[~alive].all()
        assert not (terminations & truncations).any()
        for agent, own in result[4].items():
            assert own["fraction_surviving"] == info["fraction_surviving"] == np.mean(~terminations), agent
        np.testing.assert_array_equal(info["interaction_range"][~alive], 0.0)
        was_any_caught |= 0 < terminations.sum() < len(terminations)
        alive = ~terminations
    assert env.agents == []
    assert was_any_caught


def test_arrays_ignore_actions_of_caught_agents() -> None:
    scenario = table.hunted()
    first, second = (fe.parallel_env(scenario, **table.EVERY_STEP) for _ in range(2))
    first.reset_array(seed=4)
    second.reset_array(seed=4)
    caught = np.zeros(9, bool)
    while first.agents:
        actions = np.zeros((9, 1), np.float32)
        result = first.step_array(actions)
        actions[caught] = np.nan
        assert data_equivalence(result, second.step_array(actions), exact=True)
        caught = result[2]
    assert caught.any()


def test_individual_reward_is_0_for_caught_agents() -> None:
    """Also for the change until the capture, unless the minimum falls in the step of the capture."""
    late = 0
    for seed in SEEDS:
        scenario = table.hunted()
        run = fe.simulate(scenario, 3.0, seed=seed)
        steps = range(1, scenario.num_steps + 1)
        falls = [t for t in steps if run.mean_distance[t] < run.mean_distance[:t].min()]
        places = zip(run.positions, run.predator_positions, strict=True)
        own = np.stack([reference.predator_distances(*at) for at in places])
        is_caught = (run.caught_at >= 0) & (run.caught_at <= np.arange(len(own))[:, None])
        own[is_caught] = 0.0
        played = play_array(scenario, seed, reward="individual", **table.EVERY_STEP)
        for t, step in zip(steps, played, strict=False):
            before = max((fall for fall in falls if fall < t), default=0)
            expected = (
                np.where(is_caught[t - 1], 0.0, own[t] - own[before]) if t in falls else np.zeros(len(own[t]))
            )
            np.testing.assert_allclose(step[1], expected, atol=1e-9)
            late += int((is_caught[t] & ~is_caught[t - 1]).any() and t not in falls)
    assert late


@pytest.mark.parametrize("reward", table.FLOCK_REWARDS)
@pytest.mark.parametrize("steps_per_action", [1, 4])
def test_survival_rewards_the_fraction_surviving(reward: str, steps_per_action: int) -> None:
    seen = set()
    for seed in SEEDS:
        scenario = table.doomed()
        run = fe.simulate(scenario, 3.0, seed=seed)
        options: dict[str, Any] = {"reward": reward, "steps_per_action": steps_per_action}
        env = fe.FlockEscapeEnv(scenario, objective="fraction_surviving", action_mode="range", **options)
        env.reset(seed=seed)
        total, is_over, steps = 0.0, False, 0
        while not is_over:
            observation, paid, terminated, truncated, info = env.step(np.array([3.0], np.float32))
            at = env.policy_spec.layout.index("running_minimum")
            assert observation[at] == np.float32(info["fraction_surviving"])
            total, steps, is_over = total + paid, steps + 1, terminated or truncated
        left = run.fraction_surviving[-1]
        assert info["fraction_surviving"] == left
        assert (terminated, truncated) == (left == 0, left > 0)
        if left == 0:
            assert -(-run.caught_at.max() // steps_per_action) == steps
        expected = run.fraction_surviving[1:].mean() if reward == "distance" else left - 1
        assert total == pytest.approx(expected, abs=1e-12)
        seen.add(terminated)
    assert seen == {True, False}


@dimensions
@pytest.mark.parametrize("radius", [4.0, 12.0, 500.0])
def test_predators_stay_while_agents_are_caught(dimension: int, radius: float) -> None:
    """With dicts and arrays. The predators start in the middle of the flock."""
    hunters = (Learned((10.0, 10.0), (5.0, 0.0)), Learned((20.0, 20.0), (0.0, -5.0)))
    scenario = table.small_flock(dimension, num_agents=12, predators=hunters, capture_radius=radius)
    rng = np.random.default_rng(0)
    for reward in ("team", "distance", "individual_distance"):
        environment, arrays = (fe.parallel_env(scenario, reward=reward, **table.EVERY_STEP) for _ in range(2))
        environment.reset(seed=1)
        arrays.reset_array(seed=1)
        while environment.agents:
            before = environment.agents
            assert before[-2:] == ["predator_0", "predator_1"]
            actions = draw(environment, rng)
            flock = np.zeros((12, 1), np.float32)
            for agent in before[:-2]:
                flock[int(agent.removeprefix("agent_"))] = actions[agent]
            pushes = np.stack([actions[agent] for agent in before[-2:]])
            rows, together, *_, info = arrays.step_array(flock, pushes)
            observations, rewards, terminations, truncations, _ = environment.step(actions)
            alive = [int(agent.removeprefix("agent_")) for agent in before[:-2]]
            np.testing.assert_array_equal(rows[alive], [observations[agent] for agent in before[:-2]])
            np.testing.assert_array_equal(together[alive], [rewards[agent] for agent in before[:-2]])
            seen = [observations[agent] for agent in before[-2:]]
            np.testing.assert_array_equal(info["predator_observations"], seen)
            mean = np.mean(together) if reward.startswith("individual_") else together[alive[0]]
            assert rewards["predator_0"] == rewards["predator_1"] == pytest.approx(-mean, abs=1e-12)
            for name in before[-2:]:
                assert environment.observation_space(name).contains(observations[name])
            survivors = [agent for agent in before[:-2] if not terminations[agent]]
            assert terminations["predator_0"] is (not survivors)
            assert truncations["predator_0"] is (not environment.agents and bool(survivors))
            assert environment.agents in ([], [*survivors, "predator_0", "predator_1"])
    if radius == 500.0:
        assert terminations["predator_1"]
