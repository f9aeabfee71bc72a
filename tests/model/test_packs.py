"""Predators against the NumPy model over many steps."""

import numpy as np
import pytest
import reference
from option_table import DIMENSIONS, every_pair, small_flock
from predator_reference import PACKS, path_position

import flockesc_env as fe
from flockesc_env import scenario as sc


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
