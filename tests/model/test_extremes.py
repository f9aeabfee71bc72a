"""What must not matter under any rule, law or predator: place, direction, side, names, and when one looks."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from argument_table import MOTIONS
from option_table import DIMENSIONS, every_pair, small_flock

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.models import Trajectory

N, STEPS, RHO = 9, 6, 7.3

RULES: dict[str, dict[str, Any]] = {
    "metric": {},
    "topological": {"neighbor_rule": sc.Topological()},
    "voronoi": {"neighbor_rule": sc.Voronoi()},
    "field of view": {"blind_angle": 2.0},
    "mutual": {"mutual": True},
    "frozen": {"frozen_graph": True},
    "different agents with delay": {
        "sensing_delay": 2,
        **{
            name: tuple(np.linspace(0.5, 2.0, N) * getattr(fe.FlockScenario(), name))
            for name in ("mass", "speed", "repulsion_strength", "alignment_strength")
        },
    },
}
# By names that say what is their own; none of them draws, or prefers a side.
PREDATORS: dict[str, tuple[Any, ...]] = {
    "straight": (sc.ConstantVelocity((-3.0, -5.0), (11.0, 7.0)),),
    "nearest": (sc.PurePursuit((-3.0, -5.0), (11.0, 7.0)),),
    "centroid": (sc.PurePursuit((-3.0, -5.0), (11.0, 7.0), target="centroid"),),
    "isolated": (sc.PurePursuit((-3.0, -5.0), (11.0, 7.0), target="most_isolated"),),
    "assigned": tuple(sc.PurePursuit((x, -5.0), (1.0, 9.0), target="assigned") for x in (-4.0, 21.0)),
    "intercept": (sc.Intercept((-3.0, -5.0), (11.0, 7.0)),),
    "encircle": tuple(sc.Encircle((x, y), (1.0, 9.0)) for x, y in ((-31.0, -5.0), (40.0, 3.0), (7.0, 50.0))),
    "herd": (sc.ConstantVelocity((-3.0, -5.0), (11.0, 7.0)), sc.Herd((30.0, 41.0), (-2.0, -9.0), partner=0)),
    "attracted": (sc.Attracted((-3.0, -5.0), (11.0, 7.0)),),
    "coasting": (sc.Learned((-3.0, -5.0), (11.0, 7.0)),),
}
DRAWING = (
    sc.Wandering((0.0, 9.0), (5.0, 5.0), angular_diffusion=1.0),
    sc.PurePursuit((9.0, 0.0), confusion_rate=3.0),
)

settings = every_pair(rule=RULES, predator=PREDATORS, dimension=DIMENSIONS)
VECTORS = ("position", "velocity")


def scenarios(dimension: int, rule: str, predator: str) -> list[fe.FlockScenario]:
    """Return a flock under every law of motion; none where the rule is for the plane alone."""
    if rule == "voronoi" and dimension == 3:
        return []
    hunters = tuple(
        dataclasses.replace(p, **{name: np.resize((*getattr(p, name), 2.0), dimension) for name in VECTORS})
        for p in PREDATORS[predator]
    )
    shared = {"num_agents": N, "num_steps": STEPS, "predators": hunters, **RULES[rule]}
    return [small_flock(dimension, motion=motion, **shared) for motion in MOTIONS]


def start(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(dimension)
    return rng.uniform(0, 20, (N, dimension)), rng.normal(0, 10, (N, dimension))


def run(
    scenario: fe.FlockScenario, positions: np.ndarray, velocities: np.ndarray, rho: Any = RHO
) -> Trajectory:
    return fe.simulate(scenario, rho, seed=1, initial_positions=positions, initial_velocities=velocities)


def isometries(dimension: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return known turns, mirror images and shifts, as matrix and vector."""
    one, none = np.eye(dimension), np.zeros(dimension)
    turns = []
    for angle in (np.pi / 2, np.pi, np.pi / 3, 1.0):
        turn = one.copy()
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        turns.append((turn, none))
    mirrors = [(np.diag(signs), none) for signs in np.where(np.eye(dimension), -1.0, 1.0)]
    swap = one[[1, 0, *range(2, dimension)]]  # a circle of predators lies in the plane of these two axes
    return [*turns, *mirrors, (swap, none), (one, np.full(dimension, 64.0)), (-one, none - 17.0)]


@settings
def test_no_direction_side_or_place_is_special(rule: str, predator: str, dimension: int) -> None:
    positions, velocities = start(dimension)
    for scenario in scenarios(dimension, rule, predator):
        first = run(scenario, positions, velocities)
        for turn, shift in isometries(dimension):
            hunters = tuple(
                dataclasses.replace(p, position=turn @ p.position + shift, velocity=turn @ p.velocity)
                for p in scenario.predators
            )
            other = run(scenario.replace(predators=hunters), positions @ turn.T + shift, velocities @ turn.T)
            np.testing.assert_allclose(other.positions, first.positions @ turn.T + shift, rtol=0, atol=1e-9)
            np.testing.assert_allclose(other.velocities, first.velocities @ turn.T, rtol=0, atol=1e-9)
            expected = first.predator_positions @ turn.T + shift
            np.testing.assert_allclose(other.predator_positions, expected, rtol=0, atol=1e-9)
            np.testing.assert_array_equal(other.num_components, first.num_components)


@settings
def test_names_do_not_matter_to_the_last_bit(rule: str, predator: str, dimension: int) -> None:
    positions, velocities = start(dimension)
    own_rho = np.linspace(1.7, 13.1, N)
    order = np.random.default_rng(0).permutation(N)
    for scenario in scenarios(dimension, rule, predator):
        own = {name: value for name, value in RULES[rule].items() if isinstance(value, tuple)}
        renumbered = scenario.replace(**{name: np.array(value)[order] for name, value in own.items()})
        for rho, other_rho in ((RHO, RHO), (own_rho, own_rho[order])):
            first = run(scenario, positions, velocities, rho)
            other = run(renumbered, positions[order], velocities[order], other_rho)
            np.testing.assert_array_equal(other.positions, first.positions[:, order])
            np.testing.assert_array_equal(other.velocities, first.velocities[:, order])
            for name in ("predator_positions", "mean_distance", "min_distance", "polarization"):
                np.testing.assert_array_equal(getattr(other, name), getattr(first, name), err_msg=name)
            np.testing.assert_array_equal(other.num_components, first.num_components)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: motion.kind)
def test_when_it_is_looked_at_does_not_matter(dimension: int, motion: Any) -> None:
    """A longer record begins as a shorter one, and one action of many steps is as many actions."""
    scenario = small_flock(dimension, num_steps=40, motion=motion, angular_noise=0.5, predators=DRAWING)
    long, short = (fe.simulate(scenario.replace(num_steps=steps), RHO, seed=3) for steps in (40, 15))
    for name in ("positions", "velocities", "predator_positions", "mean_distance", "polarization"):
        np.testing.assert_array_equal(getattr(long, name)[:16], getattr(short, name), err_msg=name)
    for steps_per_action in (1, 3, 40, 1000):
        env = fe.FlockEscapeEnv(
            scenario, action_mode="discrete", range_grid=(RHO,), steps_per_action=steps_per_action
        )
        info, has_ended, seen = env.reset(seed=3)[1], False, [0]
        while not has_ended:
            *_, has_ended, info = env.step(0)
            seen.append(min(seen[-1] + steps_per_action, 40))
            assert info["mean_distance"] == long.mean_distance[seen[-1]]
        assert info["min_mean_distance"] == long.mean_distance.min()
