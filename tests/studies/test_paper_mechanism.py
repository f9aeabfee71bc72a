"""The control of the paper's explanation: flights of agents, and verdicts on made-up flocks."""

from __future__ import annotations

import numpy as np
import pytest

from flockesc_env import FlockScenario, simulate
from flockesc_env.episodes.objectives import OBJECTIVES
from flockesc_env.jobs import Arrays
from studies.paper import anatomy
from studies.paper.claims import Claim, Verdict
from studies.paper.mechanism_claims import force_table, mechanism_claims
from studies.paper.plan import (
    CONTROL_GRID,
    LINE_GRID,
    NO_FORCE,
    PAPER_FORCE,
    PAPER_WORLD,
    STRENGTHS,
    SURVIVAL_WORLDS,
    WORLDS,
    Trials,
    captures,
    control,
    measurements,
)

CALM = FlockScenario(num_agents=40, repulsion_strength=0.0)
SEEDS = range(3)


def test_squared_distance_is_that_of_the_center_plus_squared_spread() -> None:
    scenario = CALM.replace(repulsion_strength=10.0)
    found = anatomy.anatomy(scenario, (0.0, 20.0), SEEDS)
    for i, rho in enumerate((0.0, 20.0)):
        for seed in SEEDS:
            run = simulate(scenario, rho, seed=seed)
            distances = np.linalg.norm(run.positions - run.predator_positions, axis=2)
            step = distances.mean(axis=1).argmin()
            assert found["mean_distance"][i, seed] == pytest.approx(distances[step].mean())
            assert found["time"][i, seed] == run.times[step]
            squares = found["center"][i, seed] ** 2 + found["dispersion"][i, seed] ** 2
            assert squares == pytest.approx((distances[step] ** 2).mean())
            headings = run.velocities[step] / np.linalg.norm(run.velocities[step], axis=1)[:, np.newaxis]
            assert found["patch"][i, seed] == pytest.approx(40 * (headings.mean(axis=0) ** 2).sum())
            outward = [run.positions[0, :, k] - run.positions[0, :, k].mean() for k in (0, 1)]
            moved = [run.positions[step, :, k] - run.positions[0, :, k] for k in (0, 1)]
            product = sum((a * b).sum() for a, b in zip(outward, moved, strict=True))
            norms = [np.sqrt(sum((part**2).sum() for part in parts)) for parts in (outward, moved)]
            assert found["outwardness"][i, seed] == pytest.approx(product / np.prod(norms))


def test_flights_of_agents_that_hear_nobody_are_the_run() -> None:
    found = anatomy.anatomy(CALM, (0.0, 8.0), SEEDS)
    np.testing.assert_allclose(found["straightness"][0], 1.0)
    for name in ("straightened", "stopped_1", "stopped_2"):
        np.testing.assert_allclose(found[name][0], found["mean_distance"][0], atol=1e-9)
        assert (np.abs(found[name][1] - found["mean_distance"][1]) > 0.01).any()
    np.testing.assert_allclose(found["exchanged"][0], found["aligned"][0], atol=1e-9)  # nobody turns
    assert (found["straightness"][1] < 1).all()


def test_flights_with_the_displacements_of_a_run_end_where_it_does() -> None:
    """Agents of one heading and speed fly nearly the same way in every order."""
    found = anatomy.anatomy(CALM, (150.0,), SEEDS)
    np.testing.assert_allclose(found["polarization"], 1.0, atol=1e-6)
    np.testing.assert_allclose(found["exchanged"], found["straightened"], atol=0.5)
    np.testing.assert_allclose(found["outwardness"], 0.0, atol=0.05)


def test_the_parts_of_a_gain_add_up_to_it() -> None:
    columns = anatomy.with_parts(anatomy.anatomy(CALM, (0.0, 8.0, 30.0), SEEDS))
    parts = columns["agreement"] + columns["turning"] + columns["sorting"]
    np.testing.assert_allclose(parts, columns["mean_distance"] - columns["mean_distance"][0], atol=1e-9)
    np.testing.assert_allclose(parts, columns["gain"], atol=1e-9)
    table = anatomy.anatomy_table({name: columns[name] for name in anatomy.anatomy(CALM, (0.0,), range(1))})
    assert table["sorting"][1].mean == pytest.approx(columns["sorting"][1].mean())


def made_up(without: dict[float, float], fleeing: dict[float, float]) -> dict[str, Arrays]:
    """Return results of 40 flocks and lines: the objective by range is 0 but for the given ranges."""
    noise = np.random.default_rng(0).normal(scale=0.01, size=40)

    def values(peaks: dict[float, float], grid: tuple[float, ...]) -> Arrays:
        rows = np.array([peaks.get(rho, 0.0) for rho in grid])[:, np.newaxis] + noise
        return dict.fromkeys((spec.column for spec in OBJECTIVES), rows)

    found = {}
    for world in WORLDS:
        for strength in STRENGTHS:
            peaks = without if strength == NO_FORCE else fleeing
            for name in (control, captures):
                found[name(world, strength)] = values(peaks, CONTROL_GRID)
    line = [{rho / 100: value for rho, value in peaks.items()} for peaks in (without, fleeing)]
    found["fearless line"], found["grid linear"] = (values(peaks, LINE_GRID) for peaks in line)
    return found


def verdicts(rows: list[Claim]) -> dict[str, set[Verdict]]:
    """Return the verdicts of all objectives and worlds, by the claim's first word."""
    found: dict[str, set[Verdict]] = {}
    for row in rows:
        found.setdefault(row.claim.split()[0], set()).add(row.judgment.verdict)
    return found


def test_the_explanation_holds_where_the_force_makes_the_optimum() -> None:
    rows = mechanism_claims(made_up({}, {10.0: 2.0, 100.0: 1.0}))
    assert all(row.judgment.verdict is Verdict.HOLDS for row in rows)


def test_the_explanation_fails_where_the_optimum_needs_no_force() -> None:
    same = {10.0: 2.0, 100.0: 1.0}
    assert all(row.judgment.verdict is Verdict.FAILS for row in mechanism_claims(made_up(same, same)))


def test_warning_and_masking_are_judged_apart() -> None:
    """The force adds most at 0 and 100 m: neither. Less at 100 m: masking only."""

    def by_claim(fleeing: dict[float, float]) -> dict[str, set[Verdict]]:
        return verdicts(mechanism_claims(made_up({10.0: 1.0}, fleeing)))

    neither = by_claim({0.0: 1.5, 10.0: 2.0, 100.0: 2.5})
    assert neither["Some"] == neither["Too"] == {Verdict.FAILS}
    masking = by_claim({0.0: 1.5, 10.0: 2.0})
    assert masking["Some"] == {Verdict.FAILS}
    assert masking["Too"] == {Verdict.HOLDS}


def test_control_runs_differ_in_the_force_alone() -> None:
    plan = measurements(Trials(flocks=4, lines=40))
    for world, scenario in WORLDS.items():
        calm, fleeing = (plan[control(world, strength)].scenario for strength in (NO_FORCE, PAPER_FORCE))
        assert fleeing == scenario
        assert isinstance(calm, FlockScenario)
        assert calm.replace(repulsion_strength=PAPER_FORCE) == scenario
        if world in SURVIVAL_WORLDS:
            caught = plan[captures(world, NO_FORCE)].scenario
            assert isinstance(caught, FlockScenario)
            assert caught.replace(capture_radius=None) == calm
    table = force_table(made_up({}, {10.0: 2.0}))
    assert table["J_mean 10"][CONTROL_GRID.index(10.0)].mean == pytest.approx(2.0, abs=0.01)
    assert table["J_min 0"][0].mean == pytest.approx(0.0, abs=0.01)
    assert PAPER_WORLD in WORLDS
