"""Predators against the NumPy model over many steps, textbook results, and their expected behavior."""

import pickle
from typing import Any

import numpy as np
import pytest
import reference
from option_table import DIMENSIONS, every_pair, small_flock
from predator_reference import PACKS, path_position

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models import Trajectory

STEPS = 60

Starts = list[tuple[np.ndarray, np.ndarray]]

every_pack = pytest.mark.parametrize("pack", PACKS)
dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)


def drawn(dimension: int, seed: int, agents: int = 30) -> tuple[Starts, dict[str, np.ndarray]]:
    """Draw predators and a flock in the same region, so that agents flee from the first step on."""
    rng = np.random.default_rng(seed)
    starts = [(rng.normal(0, 25, dimension), rng.normal(0, 6, dimension)) for _ in range(7)]
    start = {
        "initial_positions": rng.normal(0, 20, (agents, dimension)),
        "initial_velocities": rng.normal(0, 6, (agents, dimension)),
    }
    return starts, start


def hunt(predators: Any, start: dict[str, np.ndarray], **changes: Any) -> Trajectory:
    agents, dimension = start["initial_positions"].shape
    fields = {"num_agents": agents, "num_steps": STEPS, "initial_side": 100.0, "predators": predators}
    return fe.simulate(small_flock(dimension, **{**fields, **changes}), 7.3, seed=5, **start)


def test_every_strategy_is_in_a_pack() -> None:
    kinds = {predator.kind for pack in PACKS.values() for predator in pack(drawn(2, 0)[0])}
    assert kinds == set(fe._core.kinds()["predators"])


@every_pair(pack=PACKS, dimension=DIMENSIONS, agents=(1, 3, 30), radius=(None, 4.0))
def test_packs_follow_the_numpy_model(pack: str, dimension: int, agents: int, radius: float | None) -> None:
    """Rounding errors are about 1e-12 m and grow to 1e-7 m if a predator passes close to its target."""
    starts, start = drawn(dimension, agents + dimension, agents)
    run = hunt(PACKS[pack](starts), start, capture_radius=radius)
    reference.assert_follows(run, np.full((STEPS, agents), 7.3), rtol=0, atol=1e-6)


def still_flock(dimension: int = 2, **changes: Any) -> fe.FlockScenario:
    """Return a flock around (0, 0) that neither flees nor moves away."""
    return small_flock(dimension, num_agents=40, num_steps=1200, speed=1e-6, predator_range=0.0, **changes)


def around_a_still_flock(*predators: Any, **changes: Any) -> np.ndarray:
    """Return the predators' positions relative to a resting flock in the last 20 s, shape (400, P, D)."""
    scenario = still_flock(predators=predators, **changes)
    positions = np.random.default_rng(0).normal(0, 20, (40, scenario.dimension))
    run = fe.simulate(scenario, 0.0, seed=0, initial_positions=positions)
    return (run.predator_positions - run.positions.mean(axis=1)[:, None])[-400:]


@dimensions
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_encirclers_spread_evenly(count: int, dimension: int) -> None:
    """They fly from one corner to their stations and circle there with a turning radius of 2.5 m."""
    pack = [sc.Encircle((-90.0 + k, -90.0), (3.0, 4.0), max_turn_rate=2.0, radius=40.0) for k in range(count)]
    around = around_a_still_flock(*pack, dimension=dimension)
    np.testing.assert_allclose(np.linalg.norm(around, axis=2), 40.0, atol=6.0)
    bearings = np.sort(np.arctan2(around[..., 1], around[..., 0]), axis=1)
    gaps = np.diff(bearings, axis=1, append=bearings[:, :1] + 2 * np.pi)
    np.testing.assert_allclose(gaps, 2 * np.pi / count, atol=0.3)
    if dimension == 3:
        np.testing.assert_allclose(around[..., 2], 0, atol=6.0)


@dimensions
def test_a_herder_ends_behind_the_flock(dimension: int) -> None:
    """It starts on its partner's side."""
    pack = [
        sc.ConstantVelocity((120.0, 50.0), (0.0, 0.0)),
        sc.Herd((120.0, 40.0), (3.0, 4.0), max_turn_rate=2.0, distance=30.0),
    ]
    around = around_a_still_flock(*pack, dimension=dimension)
    partner, herder = around[:, 0], around[:, 1]
    distances = np.linalg.norm(herder, axis=1)
    np.testing.assert_allclose(distances, 30.0, atol=6.0)
    cosines = (partner * herder).sum(axis=1) / np.linalg.norm(partner, axis=1) / distances
    assert cosines.max() < -0.95


@every_pack
@pytest.mark.parametrize("threads", [1, 3])
def test_packs_do_not_depend_on_the_batch(pack: str, threads: int) -> None:
    starts, _ = drawn(2, 2)
    scenario = fe.FlockScenario(num_agents=30, num_steps=20, predators=tuple(PACKS[pack](starts)))
    env = BatchVectorEnv(4, scenario, action_mode="range", num_threads=threads, steps_per_action=1)
    env.reset(seed=[9, 2, 7, 2])
    runs = [fe.simulate(scenario, 9.0, seed=seed) for seed in (9, 2, 7, 2)]
    for t in range(1, 20):
        env = pickle.loads(pickle.dumps(env))  # noqa: S301, our own; with the memory of every strategy
        infos = env.step(np.full((4, 1), 9.0, np.float32))[4]
        np.testing.assert_array_equal(infos["mean_distance"], [run.mean_distance[t] for run in runs])


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


def headings(run: Trajectory) -> np.ndarray:
    """Return the unit vectors along which the predators flew, shape (T, P, D)."""
    moves = np.diff(run.predator_positions, axis=0)
    return moves / np.linalg.norm(moves, axis=-1, keepdims=True)


@pytest.mark.parametrize("dimension", [2, 3])
def test_wandering_forgets_its_heading(dimension: int) -> None:
    """The mean cosine to the first heading decays as exp(-(D - 1) D_r t), equally for all directions."""
    rate, count = 0.8, 4000
    hunters = (
        sc.Wandering((0.0, 0.0, 0.0)[:dimension], (6.0, 8.0, 0.0)[:dimension], angular_diffusion=rate),
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
    hunter = sc.PurePursuit(
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
