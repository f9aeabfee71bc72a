"""The arms race: predators, training runs, the pairing of the cross-play, files of a second call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from option_table import small_flock
from study_folders import check_race, skip_bootstraps, without_intervals

from flockesc_env import rollout
from flockesc_env.common import stats
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import Observations, PredatorPolicySpec
from flockesc_env.jobs import Cache, find_backend
from flockesc_env.policies import find_policy
from flockesc_env.policies.predators import Pursue
from studies.arms_race import evolve, page, race
from studies.arms_race.evolve import Budget, train_flock, train_predator
from studies.arms_race.players import Flock, Predator
from studies.arms_race.predators import SIZE, LeadPursuit, NetworkPredator
from studies.arms_race.race import BEST_FIXED, CROSS_PLAY_FILE, LEARNED, PER_AGENT, RaceOptions, arms_race
from studies.arms_race.results import RaceResults, load_race
from studies.measurements import Runner

LEARNED_RESULTS = Path(__file__).parents[2] / "results" / "findings"
PER_AGENT_FILE = str(LEARNED_RESULTS / "per-agent-visible" / "policies" / "search-0.npz")
SCENARIO = small_flock(num_agents=6, num_steps=24, initial_side=60.0).with_learned_predators()
BUDGET = Budget(population=4, generations=2, flocks=2, final_flocks=2, check_every=1, tuning_flocks=3)
SEEDS = [3, 4, 5]


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolve, "SCENARIO", SCENARIO)
    monkeypatch.setattr(race, "SCENARIO", SCENARIO)
    monkeypatch.setattr(race, "LEAD_FLOCKS", 3)


def played(flock: str, predator: Any) -> FloatArray:
    return rollout(
        SCENARIO, flock, SEEDS, predator_policy=predator, steps_per_action=evolve.STEPS_PER_ACTION
    ).min_mean_distance


def predator_view(**entries: float) -> tuple[Observations, PredatorPolicySpec]:
    """Return an observation of a predator; entries that are not given are 0."""
    spec = PredatorPolicySpec.of(SCENARIO)
    observation = np.zeros((1, len(spec.layout.names)), np.float32)
    for name, value in entries.items():
        observation[0, spec.layout.index(name)] = value
    return observation, spec


def test_lead_pursuit_aims_at_the_meeting_point() -> None:
    # The predator flies at 15 m/s along x, the centroid is at (36, 0) and flies at 9 m/s along y. They meet
    # after 3 s at (36, 27): 36^2 + 27^2 = 45^2 = (15 m/s 3 s)^2. The velocity is observed minus the
    # predator's: (-15, 9), and vectors w as w / (||w|| + 10), lengths as l / (l + 60).
    scale = np.hypot(15, 9) + 10
    observation, spec = predator_view(
        speed=1.0,
        centroid_direction_ahead=1.0,
        centroid_distance=36 / 96,
        flock_velocity_ahead=-15 / scale,
        flock_velocity_left=9 / scale,
    )
    for lead, aim in ((0.0, (36, 0)), (0.5, (36, 13.5)), (1.0, (36, 27)), (2.0, (36, 54))):
        action = LeadPursuit(SCENARIO, lead).act(observation, spec)
        np.testing.assert_allclose(action[0], np.array(aim) / np.hypot(*aim), atol=1e-6)


def test_a_predator_treats_left_and_right_alike() -> None:
    spec, rng = PredatorPolicySpec.of(SCENARIO), np.random.default_rng(0)
    observations = rng.uniform(-0.5, 0.5, (20, len(spec.layout.names))).astype(np.float32)
    observations[:, spec.layout.index("centroid_distance")] += 0.5
    observations[:, spec.layout.index("speed")] = 0.5
    velocity = spec.layout.index("flock_velocity_ahead")
    observations[:, velocity : velocity + 2] *= 0.6  # agents are slower than the predator
    reflected = observations.copy()
    reflected[:, [name.endswith("_left") for name in spec.layout.names]] *= -1
    predator = NetworkPredator(0.2 * rng.normal(size=SIZE), LeadPursuit(SCENARIO, 0.5))
    expected = predator.act(observations, spec) * [1, -1]
    np.testing.assert_array_equal(predator.act(reflected, spec), expected)
    assert np.unique(expected).size > 20


@pytest.mark.parametrize("flock", ["fixed:10", "learned"])
def test_a_generation_of_predators_plays_as_each_does_alone(
    flock: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, start = PER_AGENT_FILE if flock == "learned" else flock, Predator("lead", 1.0)
    pursuit = start.policy(SCENARIO)
    seen: list[FloatArray] = []

    def watched(value: evolve.Play, size: int, *_: Any) -> dict[str, Any]:
        vectors = np.random.default_rng(1).normal(size=(3, size))
        seen.append(value(vectors, range(3, 6)))
        seen.append(np.array([-played(spec, NetworkPredator(vector, pursuit)) for vector in vectors]))
        return {"parameters": vectors[0], "curve": np.zeros(1)}

    monkeypatch.setattr(evolve, "evolve", watched)
    monkeypatch.setattr(evolve, "BATCH", 6)  # groups of two vectors and one
    train_predator(Flock(spec), start, BUDGET, 100)
    together, alone = seen
    np.testing.assert_array_equal(together, alone)
    assert len(set(alone.ravel().round(6))) > 3


def test_training_begins_with_the_stored_policy_and_never_ends_below_it() -> None:
    start = Flock(PER_AGENT_FILE)
    predator = Predator("nearest")
    result = train_flock(start, predator, BUDGET, 100)
    tuning = range(1_000_000, 1_000_003)
    before = evolve.play(start, predator, tuning)["objective"].mean()
    after = evolve.play(Flock(start.spec, tuple(result["parameters"])), predator, tuning)["objective"].mean()
    assert result["curve"][0] == before
    assert result["curve"].max() == after


def made_up(objective: dict[tuple[str, str], list[float]]) -> RaceResults:
    """Return results with a given J_mean of every flock policy against every predator."""
    values = {pair: np.array(row) for pair, row in objective.items()}
    flocks = tuple(dict.fromkeys(flock for flock, _ in objective))
    predators = tuple(dict.fromkeys(predator for _, predator in objective))
    cells = {pair: stats.mean(row) for pair, row in values.items()}
    return RaceResults({}, pl.DataFrame(), flocks, predators, values, cells)


def test_losses_are_to_the_worst_predator_and_equal_policies_count_once() -> None:
    results = made_up(
        {
            ("a", "straight"): [10.0, 20.0],
            ("a", "a"): [9.0, 18.0],
            ("a", "b"): [7.0, 15.0],  # worse than its own
            ("b", "straight"): [30.0, 40.0],
            ("b", "a"): [30.0, 39.0],
            ("b", "b"): [29.0, 38.0],
            ("a again", "straight"): [10.0, 20.0],
            ("a again", "a"): [9.0, 18.0],
            ("a again", "b"): [7.0, 15.0],
        }
    )
    assert results.worst("a")[0] == "b"
    assert results.loss_to_worst("a").mean == (3 + 5) / 2
    assert results.excess_loss("a", "b").mean == ((3 - 1) + (5 - 2)) / 2
    assert results.distinct == ("a", "b")


def test_the_race_is_paired_and_a_second_call_repeats_it(tmp_path: Path) -> None:
    options = RaceOptions(LEARNED_RESULTS, rounds=1, num_flocks=4, budget=BUDGET)
    output, runner = tmp_path / "race", Runner(Cache(tmp_path / "race" / "cache"), find_backend("serial"))
    found = arms_race(options, runner, output)
    table = pl.read_parquet(output / CROSS_PLAY_FILE)
    rounds = [f"{track}, round 1" for track in race.TRACKS]
    names = [BEST_FIXED, race.LEADERS, *LEARNED, *rounds]
    assert list(found.flocks) == names
    assert list(found.predators) == ["straight", "nearest", "centroid", "lead", *names]
    flocks = list(range(2_000_000, 2_000_004))
    for _, rows in table.group_by("flock_policy", "predator"):
        assert rows["seed"].to_list() == flocks
    assert table.height == len(found.flocks) * len(found.predators) * len(flocks)

    results = load_race(output)
    straight = rollout(SCENARIO, "fixed:12", flocks, steps_per_action=4).min_mean_distance
    np.testing.assert_array_equal(results.objective[BEST_FIXED, "straight"], straight)
    own = results.objective[BEST_FIXED, BEST_FIXED]
    assert results.loss(BEST_FIXED) == stats.mean(straight - own)
    derived = results.objective[race.DERIVED, "nearest"]
    file = found.flocks[race.DERIVED].spec
    np.testing.assert_array_equal(
        derived, rollout(SCENARIO, file, flocks, predator_policy=Pursue()).min_mean_distance
    )
    assert results.record["lead"] == min(found.leads, key=lambda lead: found.leads[lead])
    stored = find_policy(str(output / "policies" / "per-agent-round-1.npz"))
    replayed = rollout(SCENARIO, stored, flocks, predator_policy=Pursue("centroid")).min_mean_distance
    np.testing.assert_array_equal(results.objective[f"{PER_AGENT}, round 1", "centroid"], replayed)

    page.ARMS_RACE.write(output, tmp_path / "page.md")
    files = [*output.glob("*.*"), *output.glob("policies/*"), tmp_path / "page.md"]
    before = {file: file.read_bytes() for file in files}
    page.ARMS_RACE.run(options, output, tmp_path / "page.md", find_backend("serial"))
    assert {file: file.read_bytes() for file in files} == before


def test_the_committed_page_follows_from_its_results(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables without intervals; tests/slow/test_committed_pages.py compares whole pages."""
    skip_bootstraps(monkeypatch)

    def tables(text: str) -> str:
        return without_intervals("\n".join(line for line in text.splitlines() if line.startswith("|")))

    check_race(tables)
