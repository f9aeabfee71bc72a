"""Randomization: each episode draws numbers of the scenario, and a seed determines them everywhere."""

from typing import Any

import numpy as np
import pytest
from envs import play, start
from option_table import SENSING_RANGES, small_flock
from same import same

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.sb3 import vec_env

POSITION = "predators[0].constant_velocity.position[1]"
DRAWS = (
    sc.Uniform("predator_range", 5.0, 60.0),
    sc.LogUniform("mass", 0.01, 1.0),
    sc.Choice("predators[1].pure_pursuit.max_turn_rate", (0.5, 1.0, 2.0)),
    sc.Uniform(POSITION, -30.0, 30.0),
    sc.Uniform("initial_positions.ring.radius", 5.0, 20.0),
)
WIDTH = "initial_positions.ring.width"
SOMETIMES = sc.Choice(WIDTH, (2.0, 11.0))
"""The ring is wider than its diameter of 10 m in the episode of seed 1 and the second one from seed 0."""


def randomized(**changes: Any) -> fe.FlockScenario:
    fields: dict[str, Any] = {
        "predators": (sc.ConstantVelocity(), sc.PurePursuit((20.0, -20.0))),
        "initial_positions": sc.Ring(5.0, 2.0),
        "randomization": DRAWS,
    }
    return small_flock(**{**fields, **changes})


def test_the_draws_of_a_seed_never_change() -> None:
    drawn = randomized().drawn(0)
    assert drawn.predator_range == 13.540064715837513
    assert drawn.drawn(1) is drawn
    assert randomized().drawn(1) != drawn
    assert randomized().drawn(2**64 - 1) == randomized().drawn(2**64 - 1)


@pytest.mark.parametrize("seed", [0, 5, 2**40])
def test_everything_runs_and_shows_the_drawn_scenario(seed: int) -> None:
    scenario = randomized()
    drawn = scenario.drawn(seed)
    run = fe.simulate(scenario, 10.0, seed=seed)
    assert run.scenario == drawn
    for each in (scenario, drawn):
        same(fe.simulate(each, 10.0, seed=seed), run)
        same(fe.simulate(each, policy=fe.FixedRange(10.0), seed=seed, action_mode="range"), run)
        assert fe.sweep(each, [10.0], [seed]).min_mean_distance[0, 0] == run.mean_distance.min()
        episodes = fe.rollout(each, fe.FixedRange(10.0), [seed], action_mode="range")
        assert episodes.min_mean_distance[0] == run.mean_distance.min()
    for make in (fe.FlockEscapeEnv, fe.parallel_env):
        for sensing in SENSING_RANGES:
            played = []
            for each in (scenario, drawn):
                env: Any = make(scenario=each, predator_sensing_range=sensing, steps_per_action=1)
                played.append([start(env, seed), *play(env, np.random.default_rng(0), 5)])
            np.testing.assert_equal(*played)


@pytest.mark.parametrize("make", [fe.FlockEscapeEnv, fe.parallel_env])
def test_a_draw_out_of_bounds_is_refused_before_its_episode(make: Any) -> None:
    scenario = randomized(randomization=(SOMETIMES,), num_steps=1)
    env = make(scenario)
    env.reset(seed=0)
    before = env.get_state()
    with pytest.raises(fe.InputError, match="got 11, drawn by the episode with seed 1") as caught:
        env.reset(seed=1)
    assert caught.value.field == WIDTH
    for call in (
        lambda: fe.simulate(scenario, 1.0, seed=1),
        lambda: fe.sweep(scenario, [1.0], [1]),
        lambda: fe.rollout(scenario, fe.FixedRange(1.0), [1]),
        lambda: scenario.drawn(1),
    ):
        with pytest.raises(fe.InputError, match=WIDTH):
            call()
    assert env.get_state() == before


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "stable-baselines3"])
@pytest.mark.parametrize("limit", [None, 1])
def test_a_draw_out_of_bounds_is_refused_before_the_step_that_needs_it(mode: str, limit: int | None) -> None:
    scenario = randomized(randomization=(SOMETIMES,), num_steps=8 if limit else 4)
    envs: Any
    if mode == "stable-baselines3":
        envs = vec_env(scenario, 1)
        envs.seed(0)
        envs.reset()
    else:
        envs = BatchVectorEnv(1, scenario, autoreset_mode=mode, max_episode_steps=limit)
        envs.reset(seed=[0])
    if mode == "NextStep":
        envs.step(np.zeros((1, 1)))
    before = envs.get_state()
    for _ in range(2):
        with pytest.raises(fe.InputError, match=WIDTH):
            envs.step(np.zeros((1, 1)))
        assert envs.get_state() == before


def test_a_change_without_effect_is_refused() -> None:
    scenario = randomized()
    with pytest.raises(fe.InputError, match="predator_range: expected a field that randomization does not"):
        scenario.replace(predator_range=9.0)
    assert scenario.replace(predator_range=9.0, randomization=()).predator_range == 9.0


@pytest.mark.parametrize(("dimension", "initial_plane"), [(2, False), (3, False), (3, True)])
def test_predators_approach_from_everywhere(dimension: int, initial_plane: bool) -> None:
    """Starts lie at the distance from a point of the region, against the direction of flight."""
    draw = sc.RandomApproach(distance=100.0, low=10.0, high=20.0)
    scenario = fe.FlockScenario(dimension=dimension, initial_plane=initial_plane, randomization=(draw,))
    predators: list[Any] = [scenario.drawn(seed).predators[0] for seed in range(400)]
    starts, velocities = (
        np.array([getattr(predator, name) for predator in predators]) for name in ("position", "velocity")
    )
    speeds = np.linalg.norm(velocities, axis=1, keepdims=True)
    assert np.all((speeds >= 10 - 1e-9) & (speeds <= 20 + 1e-9))
    aims = starts + 100 * velocities / speeds
    axes = 2 if initial_plane else dimension
    assert np.all((aims >= -1e-9) & (aims <= 100 + 1e-9))
    assert not aims[:, axes:].any()
    assert not velocities[:, axes:].any()
    # Six standard errors of means of 400 draws.
    assert np.abs(aims[:, :axes].mean(axis=0) - 50).max() < 6 * 100 / np.sqrt(12 * 400)
    assert np.abs((velocities / speeds).mean(axis=0)).max() < 6 / np.sqrt(axes * 400)
    assert abs(np.mean(speeds < 200**0.5) - 0.5) < 6 * 0.5 / 20
