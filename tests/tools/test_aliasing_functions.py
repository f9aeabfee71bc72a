"""Aliasing: changing arguments and results of functions changes nothing inside; scenarios are values."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from option_table import small_flock
from spoiling import spoil

import flockesc_env
from flockesc_env import FlockScenario, LineScenario
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.models import graph
from flockesc_env.policies import RandomRange, ScheduledRange, registry
from flockesc_env.policies.network import Architecture, NetworkPolicy

SCENARIO = small_flock()
LEARNED = flockesc_env.preset("learned-predator").replace(num_agents=5, num_steps=10, initial_side=30.0)
LINE = LineScenario(num_agents=5, max_steps=10)
POSITIONS = np.random.default_rng(0).uniform(0, 30, (5, 2))

FUNCTIONS: dict[str, tuple[Callable[..., Any], Callable[[], dict[str, Any]]]] = {
    "simulate": (
        flockesc_env.simulate,
        lambda: {
            "scenario": LEARNED,
            "schedule": np.full((10, 5), 7.0),
            "seed": 1,
            "initial_positions": POSITIONS.copy(),
            "initial_velocities": POSITIONS - POSITIONS.mean(axis=0),
            "predator_actions": np.zeros((10, 1, 2)),
        },
    ),
    "simulate_line": (
        flockesc_env.simulate_line,
        lambda: {
            "scenario": LINE,
            "interaction_range": 0.1,
            "initial_state": np.linspace(0, 1, 5),
            "seed": 0,
        },
    ),
    "sweep": (
        flockesc_env.sweep,
        lambda: {"scenario": SCENARIO, "interaction_ranges": np.array([0.0, 5.0]), "seeds": [1, 2]},
    ),
    "rollout": (
        flockesc_env.rollout,
        lambda: {"policy": RandomRange(0), "seeds": [1, 2], "scenario": SCENARIO, "range_grid": [1.0, 2.0]},
    ),
    "rollout_line": (
        flockesc_env.rollout,
        lambda: {"policy": ScheduledRange([0.1] * 10), "seeds": [1, 2], "scenario": LINE},
    ),
    "record": (flockesc_env.record, lambda: {"policy": RandomRange(0), "seed": 1, "scenario": SCENARIO}),
    "component_labels": (
        graph.component_labels,
        lambda: {"scenario": None, "positions": POSITIONS.copy(), "interaction_range": np.full(5, 9.0)},
    ),
    "neighbor_pairs": (
        graph.neighbor_pairs,
        lambda: {"scenario": None, "positions": POSITIONS.tolist(), "interaction_range": [9.0] * 5},
    ),
    "laplacian": (graph.laplacian, lambda: {"states": np.linspace(0, 1, 5), "interaction_range": 0.3}),
    "perron_matrix": (
        graph.perron_matrix,
        lambda: {"states": np.linspace(0, 1, 5), "interaction_range": 0.3},
    ),
    "built_in": (registry.built_in, lambda: {"name": "stubborn-witnesses"}),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions(name: str) -> None:
    function, arguments = FUNCTIONS[name]
    first, again = arguments(), arguments()
    result = function(**first)
    kept = copy.deepcopy(plain(result))
    spoil(first)
    np.testing.assert_equal(plain(result), kept)
    spoil(result)
    np.testing.assert_equal(plain(function(**again)), kept)


def plain(value: Any) -> Any:
    """Convert a result for ``assert_equal``: dataclasses to dicts, policies to their type."""
    if dataclasses.is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return type(value) if hasattr(value, "act") else value


GIVEN: dict[str, tuple[Callable[[Any], Any], Any, Callable[[Any], Any]]] = {
    "speeds": (lambda v: small_flock(speed=v), np.full(5, 3.0), FlockScenario.to_json),
    "predators": (
        lambda v: small_flock(predators=v),
        [flockesc_env.PurePursuit(), flockesc_env.Wandering()],
        FlockScenario.to_json,
    ),
    "a predator's position": (
        lambda v: small_flock(predators=(flockesc_env.PurePursuit(position=v),)),
        [1.0, 2.0],
        FlockScenario.to_json,
    ),
    "given positions": (
        lambda v: small_flock(initial_positions=flockesc_env.GivenPositions(v)),
        POSITIONS.tolist(),
        FlockScenario.to_json,
    ),
    "choices": (
        lambda v: small_flock(randomization=[flockesc_env.Choice("angular_noise", v)]),
        [0.0, 1.0],
        FlockScenario.to_json,
    ),
    "a grid of ranges": (
        lambda v: EnvOptions(action_mode="discrete", range_grid=v),
        np.array([1.0, 2.0]),
        lambda options: options.range_grid,
    ),
    "a schedule": (ScheduledRange, np.arange(10.0), lambda policy: policy.schedule.tolist()),
    "a network's numbers": (
        lambda v: NetworkPolicy(Architecture(("time",), ()), v),
        np.ones(2, np.float32),
        lambda policy: policy.parameters.tolist(),
    ),
}


@pytest.mark.parametrize("name", GIVEN)
def test_arguments_are_copied(name: str) -> None:
    make, value, show = GIVEN[name]
    made = make(value := copy.deepcopy(value))
    before = show(made)
    spoil(value)
    assert show(made) == before
    assert show(made) == show(make(copy.deepcopy(GIVEN[name][1])))


@pytest.mark.parametrize("value", [SCENARIO, LEARNED, LINE, EnvOptions(range_grid=[1.0])], ids=repr)
def test_scenarios_and_options_are_values(value: Any) -> None:
    hash(value)  # only numbers, texts and tuples
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(value, dataclasses.fields(value)[0].name, 1)


def test_presets_are_fixed() -> None:
    with pytest.raises(TypeError):
        flockesc_env.PRESETS["paper-flock"] = None  # type: ignore[index]
