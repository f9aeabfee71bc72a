"""Arguments of functions and resets that are refused by name, without a trace in what runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import (
    ConstantVelocity,
    FlockEscapeEnv,
    FlockescError,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    PurePursuit,
    env,
    parallel_env,
    rollout,
    simulate,
    simulate_line,
    sweep,
)
from flockesc_env.errors import ArgumentError
from flockesc_env.policies import FixedRange, ScheduledRange, StubbornLeaders
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCK, LINE = small_flock(), LineScenario(num_agents=5, max_steps=10)
NAN = np.nan
POSITIONS = np.zeros((5, 2))
SPOILT = POSITIONS.copy()
SPOILT[3, 1] = np.inf


def refusal(call: Callable[[], Any]) -> ArgumentError:
    """Return what a call raises, which must read like the package's other errors."""
    with pytest.raises(ArgumentError) as caught:
        call()
    error = caught.value
    assert isinstance(error, FlockescError)
    assert isinstance(error, ValueError)
    assert str(error) == f"{error.field}: expected {error.expected}, got {error.given}"
    return error


SIMULATE: list[tuple[Any, dict[str, Any], str]] = [
    (-1.0, {}, "interaction_range"),
    (NAN, {}, "interaction_range"),
    (np.inf, {}, "interaction_range"),
    ("5", {}, "interaction_range"),
    (None, {}, "interaction_range"),
    (True, {}, "interaction_range"),
    (1j, {}, "interaction_range"),
    ([], {}, "interaction_range"),
    ([1.0, 2.0], {}, "interaction_range"),
    ([1.0, [2.0]], {}, "interaction_range"),
    ([1, 1, 1, 1, -1], {}, "interaction_range[4]"),
    ([1, 1, NAN, 1, 1], {}, "interaction_range[2]"),
    (np.ones((5, 10)), {}, "interaction_range"),
    (np.ones((10, 4)), {}, "interaction_range"),
    (np.ones((10, 5, 1)), {}, "interaction_range"),
    (1.0, {"initial_positions": POSITIONS[:4]}, "initial_positions"),
    (1.0, {"initial_positions": POSITIONS.T}, "initial_positions"),
    (1.0, {"initial_positions": POSITIONS.ravel()}, "initial_positions"),
    (1.0, {"initial_positions": SPOILT}, "initial_positions[3, 1]"),
    (1.0, {"initial_velocities": np.zeros((5, 3))}, "initial_velocities"),
    (1.0, {"initial_velocities": SPOILT}, "initial_velocities[3, 1]"),
    (1.0, {"initial_velocities": POSITIONS.astype(str)}, "initial_velocities"),
    (1.0, {"initial_velocities": POSITIONS.astype(complex)}, "initial_velocities"),
]


@pytest.mark.parametrize(("rho", "arguments", "field"), SIMULATE)
def test_simulate(rho: Any, arguments: dict[str, Any], field: str) -> None:
    assert refusal(lambda: simulate(FLOCK, rho, seed=0, **arguments)).field.startswith(field)


def test_schedule_or_range_per_agent() -> None:
    """Where n = T one axis could mean either; with both written out it cannot."""
    scenario = small_flock(num_agents=6, num_steps=6)
    values = np.arange(6) * 10.0
    error = refusal(lambda: simulate(scenario, values, seed=0))
    assert error.field == "interaction_range"
    assert "(1, 6)" in error.expected
    assert "(6, 1)" in error.expected
    own, scheduled = simulate(scenario, values[None], seed=0), simulate(scenario, values[:, None], seed=0)
    assert own.num_components[0] < 6  # the scheduled range starts at 0
    assert scheduled.num_components[0] == 6
    square = np.tile(values, (6, 1))
    np.testing.assert_array_equal(simulate(scenario, square, seed=0).positions, own.positions)
    lonely = small_flock(num_agents=1, num_steps=1)
    np.testing.assert_array_equal(
        simulate(lonely, [3.0], seed=0).positions, simulate(lonely, 3.0, seed=0).positions
    )


@pytest.mark.parametrize(
    ("rho", "arguments", "field"),
    [
        (-0.1, {}, "interaction_range"),
        (NAN, {}, "interaction_range"),
        ("0.1", {}, "interaction_range"),
        ([0.1], {}, "interaction_range"),
        (0.1, {"initial_state": [0.0] * 4}, "initial_state"),
        (0.1, {"initial_state": [[0.0] * 5]}, "initial_state"),
        (0.1, {"initial_state": [0.0, 0.0, NAN, 0.0, 0.0]}, "initial_state[2]"),
        (0.1, {"initial_state": ["a"] * 5}, "initial_state"),
    ],
)
def test_simulate_line(rho: Any, arguments: dict[str, Any], field: str) -> None:
    assert refusal(lambda: simulate_line(LINE, rho, seed=0, **arguments)).field == field


@pytest.mark.parametrize("scenario", [FLOCK, LINE], ids=["flock", "line"])
@pytest.mark.parametrize(
    ("ranges", "seeds", "options", "field"),
    [
        ([], [0], {}, "interaction_ranges"),
        (1.0, [0], {}, "interaction_ranges"),
        ([[1.0]], [0], {}, "interaction_ranges"),
        ([1.0, -1.0], [0], {}, "interaction_ranges[1]"),
        ([1.0, NAN], [0], {}, "interaction_ranges[1]"),
        ([1.0, np.inf], [0], {}, "interaction_ranges[1]"),
        (["1"], [0], {}, "interaction_ranges"),
        ([1.0], [], {}, "seeds"),
        ([1.0], [0, -1], {}, "seeds[1]"),
        ([1.0], [0.5], {}, "seeds[0]"),
        ([1.0], [2**64], {}, "seeds[0]"),
        ([1.0], ["0"], {}, "seeds[0]"),
        ([1.0], [0], {"num_threads": 0}, "num_threads"),
        ([1.0], [0], {"num_threads": -1}, "num_threads"),
        ([1.0], [0], {"num_threads": 1.5}, "num_threads"),
        ([1.0], [0], {"num_threads": 10**6}, "num_threads"),
    ],
)
def test_sweep(scenario: Any, ranges: Any, seeds: Any, options: dict[str, Any], field: str) -> None:
    assert refusal(lambda: sweep(scenario, ranges, seeds, **options)).field == field


@pytest.mark.parametrize(
    ("seeds", "options", "field"),
    [
        ([], {}, "seeds"),
        ([0, -1], {}, "seeds[1]"),
        (["a"], {}, "seeds[0]"),
        ([0], {"batch_size": 0}, "batch_size"),
        ([0], {"batch_size": 1.5}, "batch_size"),
        ([0], {"num_threads": 0}, "num_threads"),
    ],
)
def test_rollout(seeds: Any, options: dict[str, Any], field: str) -> None:
    assert refusal(lambda: rollout(FixedRange(1.0), seeds, scenario=FLOCK, **options)).field == field


@pytest.mark.parametrize(
    ("policy", "field"),
    [
        (lambda: FixedRange(-1.0), "interaction_range"),
        (lambda: FixedRange(100.5), "interaction_range"),
        (lambda: FixedRange(NAN), "interaction_range"),
        (lambda: FixedRange("1"), "interaction_range"),
        (lambda: ScheduledRange(-np.ones(10)), "interaction_range"),
        (lambda: ScheduledRange(np.ones(9)), "schedule"),
        (lambda: ScheduledRange(np.ones((10, 5))), "schedule"),
        (lambda: ScheduledRange(5.0), "schedule"),
        (lambda: ScheduledRange(np.full(10, NAN)), "schedule[0]"),
        (lambda: StubbornLeaders(min_cosine=NAN), "min_cosine"),
        (lambda: StubbornLeaders(), "observation"),
    ],
)
def test_policies(policy: Callable[[], Any], field: str) -> None:
    """Refused when made, or by the first environment that they do not fit."""
    assert refusal(lambda: rollout(policy(), [0], scenario=FLOCK)).field == field


@pytest.mark.parametrize("make", [FlockVecEnv, AgentVecEnv])
@pytest.mark.parametrize(
    ("count", "options", "field"),
    [
        (0, {}, "num_flocks"),
        (-1, {}, "num_flocks"),
        (1.5, {}, "num_flocks"),
        (2, {"num_threads": 0}, "num_threads"),
        (2, {"num_threads": "2"}, "num_threads"),
    ],
)
def test_vector_environments(make: Any, count: Any, options: dict[str, Any], field: str) -> None:
    assert refusal(lambda: make(count, FLOCK, **options)).field == field


@pytest.mark.parametrize("num_threads", [0, -1, 1.5, "2", [2], 2**64, 10**6], ids=repr)
@pytest.mark.parametrize(
    "call",
    [
        lambda num_threads: simulate(FLOCK, 1.0, seed=0, num_threads=num_threads),
        lambda num_threads: FlockEscapeEnv(FLOCK, num_threads=num_threads),
        lambda num_threads: parallel_env(FLOCK, num_threads=num_threads),
        lambda num_threads: env(FLOCK, num_threads=num_threads),
        lambda num_threads: FlockVectorEnv(2, FLOCK, num_threads=num_threads),
        lambda num_threads: FlockVectorEnv(1, FLOCK, num_threads=num_threads),
    ],
    ids=["simulate", "flock", "parallel", "aec", "vector", "vector of one"],
)
def test_threads(call: Callable[[Any], Any], num_threads: Any) -> None:
    assert refusal(lambda: call(num_threads)).field == "num_threads"


@pytest.mark.parametrize("seed", [-1, 1.5, 2**64, "a", [1], np.float64(2.0), np.int64(-3)], ids=repr)
@pytest.mark.parametrize(
    "call",
    [
        lambda seed: FlockEscapeEnv(FLOCK).reset(seed=seed),
        lambda seed: LineEscapeEnv(LINE).reset(seed=seed),
        lambda seed: parallel_env(FLOCK).reset(seed=seed),
        lambda seed: env(FLOCK).reset(seed=seed),
        lambda seed: FlockVecEnv(2, FLOCK).seed(seed),
        lambda seed: AgentVecEnv(2, FLOCK).seed(seed),
        lambda seed: simulate(FLOCK, 1.0, seed=seed),
        lambda seed: simulate_line(LINE, 0.1, seed=seed),
    ],
    ids=["flock", "line", "parallel", "aec", "flock slots", "agent slots", "simulate", "simulate_line"],
)
def test_seeds(call: Callable[[Any], Any], seed: Any) -> None:
    assert refusal(lambda: call(seed)).field == "seed"


PREDATORS = (ConstantVelocity(), PurePursuit((1.0, 2.0)))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("predator_positions", np.zeros((1, 3))),
        ("predator_positions", np.zeros((3, 3))),
        ("predator_positions", np.zeros((2, 2))),
        ("predator_positions", np.zeros(6)),
        ("predator_velocities", [[0.0, 0.0, 0.0], [0.0, 0.0]]),
        ("predator_velocities", np.zeros((2, 4))),
        ("predator_velocities", "fast"),
    ],
)
def test_predators_of_a_reset(name: str, value: Any) -> None:
    environment = FlockEscapeEnv(small_flock(3, predators=PREDATORS))
    environment.reset(options={name: np.ones((2, 3))})
    assert refusal(lambda: environment.reset(options={name: value})).field == name
