"""Golden results from an independent implementation of docs/model.md."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flockesc_env import FlockScenario, LineScenario, simulate, simulate_line
from flockesc_env.scenario import ConstantVelocity

GOLDEN = Path(__file__).parents[1] / "golden"
LINE = json.loads((GOLDEN / "line.json").read_text())
FLOCKS = json.loads((GOLDEN / "flock.json").read_text())

Case = dict[str, Any]


FIELDS = {
    "position": "predator_position",
    "range": "predator_range",
    "strength": "repulsion_strength",
    "force": "escape_force",
}
"""Fields of ``LineScenario`` by their names in the file."""


@pytest.mark.parametrize("case", LINE["cases"])
def test_line(case: Case) -> None:
    shared = {"num_agents": len(LINE["x0"]), "tolerance": LINE["tolerance"], "max_steps": LINE["max_steps"]}
    predator = {FIELDS[name]: value for name, value in (case["predator"] or {"position": None}).items()}
    run = simulate_line(LineScenario(**shared, **predator), case["rho"], initial_state=LINE["x0"])
    np.testing.assert_allclose(run.states[-1], case["final"], rtol=0, atol=1e-9)
    assert run.num_components.tolist() == case["components"]
    assert run.steps == case["steps"]
    assert run.converged is case["converged"]
    expected = case.get("escape_distance", np.inf)
    np.testing.assert_allclose(run.escape_distance[-1], expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("flock", "run"), [(flock, run) for flock in FLOCKS for run in flock["runs"]])
def test_flock(flock: Case, run: Case) -> None:
    dimension = flock["dimension"]
    predator = ConstantVelocity((-30.0, -30.0, 0.0)[:dimension], (10.0, 10.0, 0.0)[:dimension])
    size = {"num_agents": flock["n"], "num_steps": flock["steps"]}
    scenario = FlockScenario(dimension=dimension, predators=(predator,), **size)
    start = {name: flock[name.partition("_")[2]] for name in ("initial_positions", "initial_velocities")}
    trajectory = simulate(scenario, run["rho"], **start)
    np.testing.assert_allclose(trajectory.positions[10], run["positions_10"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(trajectory.velocities[10], run["velocities_10"], rtol=0, atol=1e-9)
    assert trajectory.num_components[10] == run["components_10"]
    np.testing.assert_allclose(trajectory.mean_distance, run["mean_distance"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(trajectory.min_distance, run["min_distance"], rtol=0, atol=1e-6)
