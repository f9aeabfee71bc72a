"""Statistics of learned policies against loops over flocks, actions and agents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import FlockScenario, record
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.registry import NamedPolicy
from studies.findings import listening
from studies.findings.listening import SILENT, draw_listening, measure_listening

SCENARIO = small_flock(num_agents=8, num_steps=18, predator_range=45.0)
STEPS = 3
FLOCKS = 12


def listener(*, per_agent: bool, visible: bool = True, scenario: FlockScenario = SCENARIO) -> NamedPolicy:
    """Return a policy whose ranges fall below ``SILENT`` at different times for different agents."""
    names = (
        ("time", "predator_distance", "predator_direction_ahead") if per_agent else ("time", "min_distance")
    )
    numbers = [-3.0, 3.0, -0.8, -0.8] if per_agent else [-3.0, 3.0, -0.2]
    options = {
        "max_range": 20.0,
        "steps_per_action": STEPS,
        "predator_sensing_range": None if visible else "predator_range",
    }
    policy = NetworkPolicy(Architecture(names, ()), numbers)
    return NamedPolicy("it", policy, per_agent=per_agent, options=options, scenario=scenario)


def measured(entry: NamedPolicy, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.setattr(listening, "LISTENING_FLOCKS", FLOCKS)
    measure_listening(entry, folder / "listening.npz")
    with np.load(folder / "listening.npz") as file:
        return {name: file[name] for name in file.files}


def played(entry: NamedPolicy) -> list[Any]:
    """Record each flock separately."""
    return [
        record(entry.scenario, entry.policy, seed, per_agent=entry.per_agent, **entry.options)  # type: ignore[arg-type]
        for seed in HELD_OUT[:FLOCKS]
    ]


@pytest.mark.parametrize("per_agent", [False, True])
def test_quantiles_and_silence(per_agent: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = listener(per_agent=per_agent)
    kept, runs = measured(entry, tmp_path, monkeypatch), played(entry)
    assert ("range_by_place" in kept) == per_agent
    for action in range(SCENARIO.num_steps // STEPS):
        ranges = sorted(rho for run in runs for rho in run.interaction_ranges[action * STEPS])
        assert kept["silent"][action] == pytest.approx(sum(rho < SILENT for rho in ranges) / len(ranges))
        for row, share in enumerate((0.1, 0.25, 0.5, 0.75, 0.9)):
            at = share * (len(ranges) - 1)  # between the two nearest ranks
            low, high = ranges[int(at)], ranges[min(int(at) + 1, len(ranges) - 1)]
            expected = low + (at - int(at)) * (high - low)
            assert kept["quantiles"][row, action] == pytest.approx(expected, abs=1e-4)
    assert kept["quantiles"].shape == (5, SCENARIO.num_steps // STEPS)
    assert 0 < kept["silent"].mean() < 1


@pytest.mark.parametrize("visible", [True, False])
def test_ranges_by_place(visible: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = listener(per_agent=True, visible=visible)
    kept = measured(entry, tmp_path, monkeypatch)
    cosines, distances = kept["cosines"], kept["distances"]
    sums = np.zeros((len(cosines) - 1, len(distances) - 1))
    counts, hidden = np.zeros_like(sums), 0
    for run in played(entry):
        for step in range(0, SCENARIO.num_steps, STEPS):
            for agent in range(SCENARIO.num_agents):
                away = run.positions[step, agent] - run.predator_positions[step, 0]
                heading = run.velocities[step, agent]
                distance = np.linalg.norm(away)
                cosine = heading @ away / distance / np.linalg.norm(heading)
                if not visible and distance > SCENARIO.predator_range:
                    hidden += 1
                elif distances[0] <= distance <= distances[-1]:
                    at = np.searchsorted(cosines, cosine) - 1, np.searchsorted(distances, distance) - 1
                    sums[at] += run.interaction_ranges[step, agent]
                    counts[at] += 1
    expected = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    assert (hidden > 0) != visible
    assert (counts > 0).sum() > 20
    np.testing.assert_allclose(kept["range_by_place"], expected, rtol=0, atol=1e-3)


@pytest.mark.parametrize("visible", [True, False])
def test_when_agents_stop_listening(visible: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = listener(per_agent=True, visible=visible)
    kept, n = measured(entry, tmp_path, monkeypatch), SCENARIO.num_agents
    actions = SCENARIO.num_steps // STEPS
    stopped: list[list[list[bool]]] = [[[] for _ in range(actions)] for _ in range(3)]
    for run in played(entry):
        start = np.linalg.norm(run.positions[0] - run.predator_positions[0], axis=1)
        for rank, agent in enumerate(sorted(range(n), key=start.__getitem__)):
            for action in range(actions):
                rest = run.interaction_ranges[action * STEPS :, agent]
                stopped[rank * 3 // n if visible else 0][action].append(bool((rest < SILENT).all()))
    expected = [[np.mean(one) for one in third] for third in stopped[: 3 if visible else 1]]
    np.testing.assert_allclose(kept["stopped"], expected, rtol=0, atol=1e-12)
    assert 0 < np.mean(expected) < 1
    assert (np.diff(kept["stopped"], axis=1) >= 0).all()


@pytest.mark.parametrize("entry", [listener(per_agent=False), listener(per_agent=True)])
def test_the_figure_is_drawn(entry: NamedPolicy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = measured(entry, tmp_path, monkeypatch)
    np.testing.assert_allclose(kept["times"], np.arange(6) * STEPS * SCENARIO.time_step)
    draw_listening(tmp_path / "listening.npz").savefig(tmp_path / "listening.png")
    assert (tmp_path / "listening.png").stat().st_size > 5_000
