"""Every entry of profiles and closest approaches against its definition in docs/model.md, in plain NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference
from hypothesis import given, settings
from observation_reference import (
    HALF_COUNT,
    Reference,
    assert_plays_as,
    flocks,
    frame,
    nearest_predator,
    random_start,
    sensing_range,
    squash,
    unit,
)
from reference import Floats, FlockState

import flockesc_env as fe
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import View
from flockesc_env.scenario.motion import Reynolds
from flockesc_env.scenario.neighbors import Topological, Voronoi

RANGES = (0.0, 9.0, 40.0)
ENTRIES = ("escape_direction", "closest_approach")
AXES = ("ahead", "left", "up")


def time_of_approach(state: FlockState, predator: int) -> float:
    offsets = state.positions - state.predator_positions[predator]
    relative = state.velocities - state.predator_velocities[predator]
    speeds = (relative**2).sum()
    return max(0.0, -(offsets * relative).sum() / speeds) if speeds > 0 else 0.0


def place_of_approach(state: FlockState, predator: int) -> Floats:
    time = time_of_approach(state, predator)
    return state.predator_positions[predator] + state.predator_velocities[predator] * time


def closest_approach(offset: Floats, relative: Floats) -> tuple[float, float]:
    """Return the smallest length of offset + relative t for t >= 0, and t."""
    speed = relative @ relative
    time = max(0.0, -(offset @ relative) / speed) if speed > 0 else 0.0
    return reference.length(offset + relative * time), time


def cosine(vector: Floats, direction: Floats) -> float:
    return float(unit(vector) @ direction)


class ProfileReference(Reference):
    """The reference of observations with all optional entries."""

    def agent_row(self, agent: int) -> dict[str, float]:
        state, scenario, options = self.state, self.scenario, self.options
        position, velocity = state.positions[agent], state.velocities[agent]
        offsets = position - state.predator_positions
        distances = np.linalg.norm(offsets, axis=1)
        sensed = np.flatnonzero(distances <= sensing_range(scenario, options))
        predator = nearest_predator(state, position)
        escape = np.zeros_like(position)
        if predator in sensed:
            escape = unit(position - place_of_approach(state, predator))
        heard = self.heard_velocities[agent]

        def approach(velocity: Floats) -> tuple[float, float]:
            found = [closest_approach(offsets[k], velocity - state.predator_velocities[k]) for k in sensed]
            distance, time = min(found, default=(0.0, 0.0))
            side = scenario.initial_side
            return squash(distance, side), squash(time, side / scenario.speed)

        def turned(aim: Floats) -> Floats:
            return unit(aim) * np.linalg.norm(velocity) if aim.any() else velocity

        candidates = [
            (state.velocities[near].mean(axis=0), near.sum() - 1)
            for near in (np.linalg.norm(state.positions - position, axis=1) <= rho for rho in RANGES)
        ]
        sight = unit(state.predator_positions[predator] - position) if predator in sensed else escape
        chase = state.predator_velocities[predator] - velocity if predator in sensed else escape
        axes = frame(velocity, [sight, heard, chase, *(mean for mean, _ in candidates)])

        def add(row: dict[str, float], name: str, vector: Floats) -> None:
            for axis, direction in zip(AXES, axes, strict=False):
                row[f"{name}_{axis}"] = direction @ vector

        row = super().agent_row(agent)
        for name in ("heard_velocity", "predator_direction", "predator_velocity"):
            vectors = {"heard_velocity": heard, "predator_velocity": chase}
            vector = vectors.get(name)
            add(row, name, sight if vector is None else vector / (np.linalg.norm(vector) + scenario.speed))
        add(row, "escape_direction", escape)
        row["heard_escape_gain"] = (cosine(heard, escape) - cosine(velocity, escape)) / 2
        row["closest_approach"], row["closest_approach_time"] = approach(velocity)
        row["heard_closest_approach"], _ = approach(turned(heard))
        for k, (mean, count) in enumerate(candidates):
            add(row, f"profile_{k}_velocity", mean / (np.linalg.norm(mean) + scenario.speed))
            row[f"profile_{k}_neighbor_count"] = squash(count, HALF_COUNT)
            row[f"profile_{k}_escape_cosine"] = cosine(mean, escape)
            row[f"profile_{k}_closest_approach"], _ = approach(turned(mean))
        return row

    def flock_view(self) -> list[dict[str, float]]:
        (row,) = super().flock_view()
        state, scenario = self.state, self.scenario
        if not len(state.positions):
            layout = FlockBatch(scenario, self.options).policy_spec.layout
            return [dict.fromkeys(layout.names, 0.0) | row]
        if not row["predator_sensed"]:
            names = ("heading_escape", "closest_mean_distance", "closest_min_distance")
            return [row | dict.fromkeys((*names, "closest_approach_time"), 0.0)]
        predators = range(len(state.predator_positions))
        places = np.array([place_of_approach(state, k) for k in predators])
        cosines, smallest = [], []
        for r, v in zip(state.positions, state.velocities, strict=True):
            nearest = places[np.linalg.norm(places - r, axis=1).argmin()]
            cosines.append(cosine(v, unit(r - nearest)))
            for k in predators:
                offset, relative = r - state.predator_positions[k], v - state.predator_velocities[k]
                smallest.append(closest_approach(offset, relative)[0])
        means = []
        for k in predators:
            time = time_of_approach(state, k)
            moved = state.positions + (state.velocities - state.predator_velocities[k]) * time
            means.append((np.linalg.norm(moved - state.predator_positions[k], axis=1).mean(), time))
        distance, time = min(means)
        side = scenario.initial_side
        row["heading_escape"] = float(np.mean(cosines))
        row["closest_mean_distance"] = squash(distance, side)
        row["closest_min_distance"] = squash(min(smallest), side)
        row["closest_approach_time"] = squash(time, side / scenario.speed)
        return [row]


@pytest.mark.parametrize("per_agent", [False, True])
@settings(max_examples=40)
@given(case=flocks())
def test_entries(
    case: tuple[fe.FlockScenario, fe.EnvOptions, np.random.Generator], *, per_agent: bool
) -> None:
    scenario, options, rng = case
    options = options.replace(profile_ranges=RANGES if per_agent else None, extra_entries=ENTRIES)
    flock = ProfileReference(scenario, options, random_start(scenario, rng))
    assert_plays_as(flock, rng, per_agent=per_agent)


@pytest.mark.parametrize(
    "changes",
    [
        {"neighbor_rule": Topological()},
        {"neighbor_rule": Voronoi()},
        {"blind_angle": 2.0},
        {"mutual": True},
        {"motion": Reynolds()},
    ],
    ids=str,
)
def test_candidates_are_what_the_agents_hear_after_they_chose_them(changes: dict[str, Any]) -> None:
    """After a step under rho_k, the heard velocity is candidate k of the observation before."""
    scenario = fe.FlockScenario(num_agents=70, **changes)
    ranges = (0.0, 3.0, 11.0, 40.0)
    options = fe.EnvOptions(action_mode="range", profile_ranges=ranges)
    batch = FlockBatch(scenario, options, num_flocks=len(ranges), view=View.AGENT)
    batch.reset(range(len(ranges)), [7] * len(ranges))
    actions = np.repeat(np.array(ranges, np.float32), 70)[:, None]
    columns = batch.policy_spec.layout.index
    for _ in range(3):
        before = batch.observe(range(len(ranges))).reshape(len(ranges), 70, -1)
        after = batch.step(actions)[0].reshape(len(ranges), 70, -1)
        for k in range(len(ranges)):
            count = after[k, :, columns("neighbor_count")]
            np.testing.assert_array_equal(before[k, :, columns(f"profile_{k}_neighbor_count")], count)
            heard = before[k][:, [columns(f"profile_{k}_velocity_{axis}") for axis in ("ahead", "left")]]
            told = after[k][:, [columns(f"heard_velocity_{axis}") for axis in ("ahead", "left")]]
            # The frame has turned; the length has not.
            lengths = np.linalg.norm(heard, axis=1), np.linalg.norm(told, axis=1)
            np.testing.assert_allclose(*lengths, atol=1e-6)


@pytest.mark.parametrize(
    ("frozen_graph", "view", "error"),
    [(True, View.AGENT, fe.ScenarioError), (False, View.FLOCK, fe.OptionError)],
)
def test_flocks_without_a_profile_are_refused(frozen_graph: bool, view: View, error: type[Exception]) -> None:
    scenario, options = fe.FlockScenario(frozen_graph=frozen_graph), fe.EnvOptions(profile_ranges=RANGES)
    with pytest.raises(error, match="profile_ranges: expected none with"):
        FlockBatch(scenario, options, view=view)
