"""Predators against textbook results, and the limits that every strategy keeps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flockesc_env as fe

DISTANCE = 20.0  # m, from the predator's start to the path of the target
PREY_SPEED, HUNTER_SPEED = 5.0, 10.0
NO_LIMIT = 1e9


def chase(predator: Any, time_step: float, seconds: float) -> fe.Trajectory:
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
        hunter = fe.PurePursuit((0.0, 0.0), (HUNTER_SPEED, 0.0), max_turn_rate=NO_LIMIT)
        path = chase(hunter, time_step, 2.2).predator_positions[:, 0]
        assert 0.9 * DISTANCE < path[-1, 0] < DISTANCE
        errors.append(np.abs(path[:, 1] - radiodrome(path[:, 0])).max())
    assert errors[1] < 0.01
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.05)


def sight_angles(run: fe.Trajectory) -> np.ndarray:
    """Return the direction of the line of sight in rad, until the distance is 1 m."""
    offset = run.positions[:, 0] - run.predator_positions[:, 0]
    is_far = np.logical_and.accumulate(np.linalg.norm(offset, axis=1) > 1)
    return np.arctan2(offset[is_far, 1], offset[is_far, 0])


@pytest.mark.parametrize("constant", [3.0, 4.0, 5.0])
def test_intercept_ends_on_a_collision_course(constant: float) -> None:
    """The rate of the bearing falls as (time to go)^(N - 2). Pure pursuit ends behind the target."""
    start = {"position": (0.0, 0.0), "velocity": (HUNTER_SPEED, 0.0), "max_turn_rate": NO_LIMIT}
    intercept = sight_angles(chase(fe.Intercept(**start, navigation_constant=constant), 1e-3, 4.0))
    pursuit = sight_angles(chase(fe.PurePursuit(**start), 1e-3, 4.0))
    assert len(intercept) < len(pursuit)
    rates = np.diff(intercept)
    assert rates[-1] < 2 * (1 / DISTANCE) ** (constant - 2) * rates[0]
    assert pursuit[-1] > 3 / 8 * np.pi  # the predator is behind the target
    assert intercept[-1] < np.pi / 6


def headings(run: fe.Trajectory) -> np.ndarray:
    """Return the unit vectors along which the predators flew, shape (T, P, D)."""
    moves = np.diff(run.predator_positions, axis=0)
    return moves / np.linalg.norm(moves, axis=-1, keepdims=True)


@pytest.mark.parametrize("dimension", [2, 3])
def test_wandering_forgets_its_heading(dimension: int) -> None:
    """The mean cosine to the first heading decays as exp(-(D - 1) D_r t), equally for all directions."""
    rate, count = 0.8, 4000
    hunters = (
        fe.Wandering((0.0, 0.0, 0.0)[:dimension], (6.0, 8.0, 0.0)[:dimension], angular_diffusion=rate),
    ) * count
    scenario = fe.FlockScenario(num_agents=1, dimension=dimension, num_steps=41, predators=hunters)
    run = fe.simulate(scenario, 0.0, seed=2)
    flown = headings(run)
    times = np.arange(41) * scenario.time_step
    cosines = (flown @ flown[0, 0]).mean(axis=1)
    np.testing.assert_allclose(cosines, np.exp(-(dimension - 1) * rate * times), atol=4 / np.sqrt(2 * count))
    aside = flown[20] - (flown[20] @ flown[0, 0])[:, None] * flown[0, 0]
    np.testing.assert_allclose(aside.mean(axis=0), 0, atol=4 / np.sqrt(2 * count))
    speeds = np.linalg.norm(np.diff(run.predator_positions, axis=0), axis=-1) / scenario.time_step
    np.testing.assert_allclose(speeds, 10.0, rtol=1e-11)


RING = 10.0 * np.array([[np.cos(angle), np.sin(angle)] for angle in 2 * np.pi * np.arange(5) / 5])
FAR = np.array([[0.0, 40.0]])


def targets(confusion_rate: float, positions: np.ndarray, steps: int, sight: float = 30.0) -> np.ndarray:
    """Return the target of each step of a predator in the middle of a nearly resting flock."""
    hunter = fe.PurePursuit(
        (0.1, 0.0), (1e-6, 0.0), max_turn_rate=NO_LIMIT, confusion_rate=confusion_rate, sight=sight
    )
    scenario = fe.FlockScenario(
        num_agents=len(positions), num_steps=steps, speed=1e-6, predator_range=0.0, predators=(hunter,)
    )
    start = {"initial_positions": positions, "initial_velocities": np.full(positions.shape, 1e-7)}
    flown = headings(fe.simulate(scenario, 0.0, seed=4, **start))[1:, 0]
    sights = positions - np.array([0.1, 0.0])
    return np.argmax(flown @ (sights / np.linalg.norm(sights, axis=1)[:, None]).T, axis=1)


def test_a_confused_predator_chooses_uniformly_among_the_agents_in_sight() -> None:
    steps = 5000
    chosen = np.bincount(targets(1e9, np.vstack([FAR, RING]), steps), minlength=6)
    assert chosen[0] == 0  # out of sight
    np.testing.assert_allclose(chosen[1:] / steps, 1 / 5, atol=4 * np.sqrt(0.16 / steps))


@pytest.mark.parametrize(("rate", "count"), [(0.5, 5), (2.0, 5), (2.0, 2)])
def test_confusion_grows_with_the_agents_in_sight(rate: float, count: int) -> None:
    """A step changes the target with probability (1 - exp(-rate (k - 1) dt)) (k - 1) / k."""
    steps = 5000
    after = targets(rate, RING[:count], steps)
    share = (np.diff(after) != 0).mean()
    expected = (1 - np.exp(-rate * (count - 1) * 0.05)) * (count - 1) / count
    assert share == pytest.approx(expected, abs=4 * np.sqrt(expected / steps))
