"""Predators against the NumPy model over many steps, and textbook results."""

from typing import Any

import numpy as np
import pytest
import reference
from option_table import DIMENSIONS, every_pair, small_flock
from predator_reference import PACKS, path_position

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.models import Trajectory


def test_every_strategy_is_in_a_pack() -> None:
    starts = [((0.0, float(k)), (1.0, 0.0)) for k in range(7)]
    kinds = {predator.kind for pack in PACKS.values() for predator in pack(starts)}
    assert kinds == set(fe._core.kinds()["predators"])


@every_pair(pack=PACKS, dimension=DIMENSIONS, agents=(1, 3, 30), radius=(None, 4.0))
def test_packs_follow_the_numpy_model(pack: str, dimension: int, agents: int, radius: float | None) -> None:
    """Agents flee from the first of 60 steps on.

    Rounding errors are about 1e-12 m and grow to 1e-7 m if a predator passes close to its target.
    """
    rng = np.random.default_rng(agents + dimension)
    starts = [(rng.normal(0, 25, dimension), rng.normal(0, 6, dimension)) for _ in range(7)]
    fields = {"num_agents": agents, "num_steps": 60, "initial_side": 100.0, "capture_radius": radius}
    start = {
        "initial_positions": rng.normal(0, 20, (agents, dimension)),
        "initial_velocities": rng.normal(0, 6, (agents, dimension)),
    }
    run = fe.simulate(small_flock(dimension, predators=PACKS[pack](starts), **fields), 7.3, seed=5, **start)
    reference.assert_follows(run, np.full((60, agents), 7.3), rtol=0, atol=1e-6)


@pytest.mark.parametrize("interval", [None, 0.013])
def test_rounding_errors_of_a_path_do_not_accumulate(interval: float | None) -> None:
    points = np.cumsum(np.random.default_rng(2).normal(0, 5, (20, 2)), axis=0)
    path = sc.PrescribedPath(points, interval=interval)  # type: ignore[arg-type]
    scenario = small_flock(num_agents=1, num_steps=100_000, time_step=0.007, predators=(path,))
    expected = path_position(path, 100_000, 0.007)
    final = fe.simulate(scenario, 5.0, seed=1).predator_positions[-1, 0]
    np.testing.assert_allclose(final, expected, rtol=1e-13, atol=0)


@pytest.mark.parametrize("name", ["predator_positions", "predator_velocities"])
def test_a_start_that_contradicts_a_path_is_refused(name: str) -> None:
    path = sc.PrescribedPath(((0.0, 0.0), (1.0, 2.0)))
    env = fe.FlockEscapeEnv(small_flock(predators=(sc.PurePursuit(), path)))
    with pytest.raises(fe.InputError, match=r"predators\[1\] has a prescribed path") as caught:
        env.reset(options={name: np.zeros((2, 2))})
    assert caught.value.field == name


DISTANCE = 20.0  # m, from the predator's start to the path of the target
PREY_SPEED, HUNTER_SPEED = 5.0, 10.0
NO_LIMIT = 1e9


def chase(predator: Any, time_step: float, seconds: float) -> Trajectory:
    """Simulate the pursuit of one agent that does not flee and flies up along x = DISTANCE."""
    scenario = fe.FlockScenario(
        num_agents=1,
        num_steps=round(seconds / time_step),
        time_step=time_step,
        speed=PREY_SPEED,
        predator_range=0.0,
        predators=(predator,),
    )
    start = {"initial_positions": [[DISTANCE, 0.0]], "initial_velocities": [[0.0, PREY_SPEED]]}
    return fe.simulate(scenario, 0.0, **start)


def radiodrome(x: np.ndarray) -> np.ndarray:
    """Return y(x) of the pursuit curve for a target on a straight course (Bouguer 1732)."""
    k, left = PREY_SPEED / HUNTER_SPEED, 1 - x / DISTANCE
    return DISTANCE * k / (1 - k**2) + (DISTANCE - x) / 2 * (left**k / (1 + k) - left**-k / (1 - k))


def test_pure_pursuit_flies_the_radiodrome() -> None:
    """The error is of first order in dt: half the step gives half the error."""
    errors = []
    for time_step in (2e-3, 1e-3):
        hunter = sc.PurePursuit((0.0, 0.0), (HUNTER_SPEED, 0.0), max_turn_rate=NO_LIMIT)
        path = chase(hunter, time_step, 2.2).predator_positions[:, 0]
        assert 0.9 * DISTANCE < path[-1, 0] < DISTANCE
        errors.append(np.abs(path[:, 1] - radiodrome(path[:, 0])).max())
    assert errors[1] < 0.01
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.05)


def sight_angles(run: Trajectory) -> np.ndarray:
    """Return the direction of the line of sight in rad, until the distance is 1 m."""
    offset = run.positions[:, 0] - run.predator_positions[:, 0]
    is_far = np.logical_and.accumulate(np.linalg.norm(offset, axis=1) > 1)
    return np.arctan2(offset[is_far, 1], offset[is_far, 0])


@pytest.mark.parametrize("constant", [3.0, 4.0, 5.0])
def test_intercept_ends_on_a_collision_course(constant: float) -> None:
    """The rate of the bearing falls as (time to go)^(N - 2). Pure pursuit ends behind the target."""
    start = {"position": (0.0, 0.0), "velocity": (HUNTER_SPEED, 0.0), "max_turn_rate": NO_LIMIT}
    intercept = sight_angles(chase(sc.Intercept(**start, navigation_constant=constant), 1e-3, 4.0))
    pursuit = sight_angles(chase(sc.PurePursuit(**start), 1e-3, 4.0))
    assert len(intercept) < len(pursuit)
    rates = np.diff(intercept)
    assert rates[-1] < 2 * (1 / DISTANCE) ** (constant - 2) * rates[0]
    assert pursuit[-1] > 3 / 8 * np.pi  # the predator is behind the target
    assert intercept[-1] < np.pi / 6
