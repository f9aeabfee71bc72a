"""``Flock`` and thinned runs: steps, snapshots, changes between steps and extra forces equal whole runs."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from argument_table import MOTIONS
from option_table import DIMENSIONS, UNLIKE, every_pair, hunted, small_flock
from predator_reference import PACKS

import flockesc_env as fe
from flockesc_env.models import Flock, Trajectory, neighbor_pairs, rotation
from flockesc_env.watch import write_page

STATES = ("positions", "velocities", "predator_positions")
LAWS: dict[str, Any] = {motion.kind: {"motion": motion} for motion in MOTIONS}
LAWS |= {"literal": {"constant_speed": False}, "zones": {**LAWS["zones"], "sensing_noise": 0.0}}
BAD: dict[str, Callable[[Flock], Any]] = {
    "shape": lambda _: np.zeros((5, 3)),
    "finite": lambda _: np.full((5, 2), np.nan),
    "large": lambda _: np.full((5, 2), 1e21),
    "steps": lambda flock: flock.step(1.0),
    "restores": lambda flock: flock.set_state(b""),
    "moves": lambda flock: setattr(flock, "positions", flock.positions),
    "turns": lambda flock: setattr(flock, "velocities", flock.velocities),
}


def flock_of(pack: str, law: str, dimension: int, **changes: Any) -> fe.FlockScenario:
    rng = np.random.default_rng(dimension)
    starts = [(rng.normal(0, 25, dimension), rng.normal(0, 6, dimension)) for _ in range(7)]
    noisy = {**UNLIKE, "blocks_warnings": True, "capture_radius": 6.0, "num_steps": 30}
    predators = PACKS[pack](starts) if pack else ()
    return small_flock(dimension, predators=predators, **{**noisy, **LAWS[law], **changes})


def assert_at(flock: Flock, run: Trajectory, step: int) -> None:
    for name in STATES:
        np.testing.assert_array_equal(getattr(flock, name), getattr(run, name)[step], name)
    np.testing.assert_array_equal(flock.caught, run.is_caught[step])
    assert flock.time == run.times[step]


@every_pair(pack=("", *PACKS), law=LAWS, dimension=DIMENSIONS)
def test_a_continued_flock_equals_the_whole_run(pack: str, law: str, dimension: int) -> None:
    """With noise, delay, warnings, captures; after a snapshot, a copy, a force of 0, a change to the same."""
    scenario = flock_of(pack, law, dimension)
    run = fe.simulate(scenario, 12.0, seed=5)
    flock, other = Flock(scenario, seed=5), Flock(scenario, seed=6)
    flock.step(12.0, 7)
    assert_at(flock, run, 7)
    other.set_state(flock.get_state())
    pushed = Flock(scenario, seed=7, extra_force=lambda flock: np.zeros_like(flock.positions))
    pushed.set_state(flock.get_state())
    same = flock.copy()
    same.positions, same.velocities = same.positions, same.velocities
    for each in (flock.copy(), other, pushed, same):
        each.step(12.0, 9)
        each.step(np.full(5, 12.0), 14)
        assert_at(each, run, 30)
    assert_at(flock, run, 7)


@pytest.mark.parametrize("name", [name for name, it in fe.PRESETS.items() if "line" not in name])
def test_every_preset_has_steps(name: str) -> None:
    scenario = fe.PRESETS[name].scenario
    assert isinstance(scenario, fe.FlockScenario)
    flock, run = Flock(name, seed=2), fe.simulate(scenario.replace(num_steps=6), 9.0, seed=2)
    for step in range(7):
        assert_at(flock, run, step)
        flock.step(9.0)


@pytest.mark.parametrize("change", [{}, {"periodic_side": 40.0}, {"dimension": 3}])
def test_a_changed_flock_goes_on_like_a_new_one(change: dict[str, Any]) -> None:
    scenario = small_flock(**{"num_agents": 600, "predators": (), **change})
    flock, start = Flock(scenario, seed=1), Flock(scenario, seed=2)
    flock.step(5.0, 20)
    flock.positions, flock.velocities = 3 * start.positions - 50, -start.velocities
    new = Flock(scenario, positions=3 * start.positions - 50, velocities=-start.velocities)
    for _ in range(9):
        np.testing.assert_array_equal(flock.positions, new.positions)
        flock.step(5.0)
        new.step(5.0)
    np.testing.assert_array_equal(flock.velocities, new.velocities)
    pairs = neighbor_pairs(scenario, new.positions, 5.0)
    new.step(5.0)
    np.testing.assert_array_equal(new.heard, np.bincount(pairs[:, 0], minlength=600))


def test_only_the_literal_law_has_other_speeds() -> None:
    flock, literal = Flock(small_flock(), seed=1), Flock(small_flock(constant_speed=False), seed=1)
    literal.velocities = 2 * flock.velocities
    before, wrong = flock.get_state(), flock.velocities
    wrong[3] *= 1 + 1e-6
    message = r"velocities\[3\]: expected the constant speed 10 m/s, got 10.00001"
    with pytest.raises(fe.InputError, match=message):
        flock.velocities = wrong
    with pytest.raises(fe.InputError, match=message):
        Flock(small_flock(), velocities=wrong)
    assert flock.get_state() == before


def test_the_nearest_predator_catches() -> None:
    flock = Flock(hunted(), seed=4)
    caught = flock.caught
    while not flock.caught.all():
        flock.step(3.0)
        for agent in np.flatnonzero(flock.caught & ~caught):
            distances = np.linalg.norm(flock.predator_positions - flock.positions[agent], axis=1)
            assert flock.caught_by[agent] == distances.argmin()
            assert distances.min() <= 4.0
        caught = flock.caught
    before = flock.positions
    flock.positions, flock.velocities = before + 1, np.ones_like(before)
    np.testing.assert_array_equal(flock.positions, before)


def test_an_extra_force_is_added_to_that_of_the_model() -> None:
    """It is seen by the law at once, also under a delay."""
    scenario = small_flock(predators=(), alignment_strength=0.0, constant_speed=False, sensing_delay=3)
    push = np.arange(10.0).reshape(5, 2)
    flock = Flock(scenario, seed=1, extra_force=lambda flock: push * (flock.time == 0))
    before = flock.velocities
    flock.step(5.0, 2)
    np.testing.assert_allclose(flock.velocities, before + push * 0.05 / 0.1, rtol=1e-14)


@pytest.mark.parametrize("force", BAD.values(), ids=BAD)
def test_a_bad_force_is_refused_by_name(force: Callable[[Flock], Any]) -> None:
    def pushed(flock: Flock) -> Any:
        return force(flock) if flock.time else np.zeros((5, 2))

    flock, twin = (Flock(small_flock(), seed=1, extra_force=pushed) for _ in range(2))
    twin.step(5.0)
    with pytest.raises(fe.InputError, match=r"^extra_force"):
        flock.step(5.0, 3)
    assert flock.get_state() == twin.get_state()


def test_a_thinned_run_is_a_part_of_the_whole_one() -> None:
    scenario, names = hunted(num_agents=9, num_steps=25), ("positions", "velocities", "min_distance")
    run = fe.simulate(scenario, 3.0, seed=4)
    thin = fe.simulate(scenario, policy=fe.FixedRange(3.0), seed=4, every=3, record=names)
    for name in ("times", "is_caught", *names):
        np.testing.assert_array_equal(getattr(thin, name), getattr(run, name)[::3], name)
    np.testing.assert_array_equal(rotation(thin), rotation(run)[::3])
    np.testing.assert_array_equal(thin.caught_at, run.caught_at)
    assert len(thin.interaction_ranges) == len(thin.predator_actions) == 8
    assert (thin.table().columns, len(thin.agents_table())) == (["time", "min_distance"], 9 * 9)
    part = fe.simulate(scenario, 3.0, seed=4, record=["polarization"])
    np.testing.assert_array_equal(part.polarization, run.polarization)
    assert not part.positions.size
    for needs in (rotation, Trajectory.agents_table):
        with pytest.raises(fe.InputError, match="a run that has recorded positions, got one without"):
            needs(part)
    for incomplete in (part, fe.simulate(scenario, 3.0, every=5)):
        for needs in (fe.replay_run, partial(fe.save_run, path="a.npz"), partial(write_page, path="a.html")):
            with pytest.raises(fe.InputError, match="all columns in every step"):
                needs(incomplete)
