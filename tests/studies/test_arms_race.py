"""The arms race: predators, training runs, the pairing of the cross-play, its files and its page."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from option_table import small_flock

from flockesc_env import rollout
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import Observations, PredatorPolicySpec
from flockesc_env.jobs import find_backend
from flockesc_env.policies.predators import Pursue
from studies.arms_race import race
from studies.arms_race.opponents import SIZE, Flock, LeadPursuit, NetworkPredator, Predator
from studies.arms_race.page import ARMS_RACE, RaceResults, load_race, markdown_page
from studies.arms_race.race import FIXED, LEARNED, Budget, learner, play, train

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "arms_race"
PER_AGENT_FILE = LEARNED["per agent"]
SCENARIO = small_flock(num_agents=6, num_steps=24, initial_side=60.0).with_learned_predators()
BUDGET = Budget(population=4, generations=2, flocks=2, final_flocks=2, check_every=1, tuning_flocks=3)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(race, "SCENARIO", SCENARIO)
    monkeypatch.setattr(race, "LEAD_FLOCKS", 3)


def played(flock: Any, predator: Any, seeds: list[int], steps: int = 4) -> FloatArray:
    options: dict[str, Any] = {"predator_policy": predator, "steps_per_action": steps}
    return rollout(race.SCENARIO, flock, seeds, **options).min_mean_distance


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


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("spec", ["fixed:10", PER_AGENT_FILE], ids=["fixed", "learned"])
def test_a_generation_of_predators_plays_as_each_does_alone(
    spec: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(race, "BATCH", 6)  # groups of two vectors and one
    start, vectors = Predator("lead", 1.0), np.random.default_rng(1).normal(size=(3, SIZE))
    _, value = learner("predator", Flock(spec), start)
    pursuit = start.policy(SCENARIO)
    alone = [played(spec, NetworkPredator(vector, pursuit), [3, 4, 5]) for vector in vectors]
    np.testing.assert_array_equal(value(vectors, range(3, 6)), alone)
    assert np.unique(alone).size > 3


@pytest.mark.usefixtures("small")
def test_training_begins_with_the_stored_policy_and_never_ends_below_it() -> None:
    start, predator = Flock(PER_AGENT_FILE), Predator("nearest")
    result = train("flock", start, predator, BUDGET, 100)
    trained = dataclasses.replace(start, parameters=tuple(result["parameters"]))
    tuning = range(1_000_000, 1_000_003)
    means = [play(flock, predator, tuning)["objective"].mean() for flock in (start, trained)]
    assert [result["curve"][0], result["curve"].max()] == means


def test_losses_are_to_the_worst_predator_and_equal_policies_count_once() -> None:
    straight, own, other = [10.0, 20.0], [9.0, 18.0], [7.0, 15.0]
    rows = {
        "a": {"straight": straight, "a": own, "b": other},
        "b": {"straight": [30.0, 40.0], "a": [30.0, 39.0], "b": [29.0, 38.0]},
        "a again": {"straight": straight, "a": own, "b": other},
    }
    values = {(flock, name): np.array(row) for flock, cells in rows.items() for name, row in cells.items()}
    results = RaceResults({}, pl.DataFrame(), list(rows), ["straight", "a", "b"], values)
    assert results.worst("a") == "b"  # not its own
    assert results.loss("a", "straight", "b").mean == (3 + 5) / 2
    assert results.excess("a", "b").mean == ((3 - 1) + (5 - 2)) / 2
    assert results.distinct() == ["a", "b"]


@pytest.mark.usefixtures("small")
def test_the_race_is_paired_and_a_second_call_repeats_it(tmp_path: Path) -> None:
    options: dict[str, Any] = {"rounds": 1, "num_flocks": 4, "budget": BUDGET}
    output, page = tmp_path / "race", tmp_path / "page.md"
    results = ARMS_RACE.run(output, page, find_backend("serial"), **options)
    flocks = list(range(2_000_000, 2_000_004))
    for _, rows in pl.read_parquet(output / "cross_play.parquet").group_by("flock_policy", "predator"):
        assert rows["seed"].to_list() == flocks
    assert list(results.predators) == [*race.UNTRAINED, *results.flocks]
    assert len(results.objective) == len(results.flocks) * len(results.predators)
    straight = rollout(SCENARIO, "fixed:12", flocks, steps_per_action=4).min_mean_distance
    np.testing.assert_array_equal(results.objective[FIXED, "straight"], straight)
    expected = played(LEARNED["per agent, derived"], Pursue(), flocks, steps=1)
    np.testing.assert_array_equal(results.objective["per agent, derived", "nearest"], expected)
    stored = str(output / "policies" / "per-agent-round-1.npz")
    expected = played(stored, Pursue("centroid"), flocks)
    np.testing.assert_array_equal(results.objective["per agent, round 1", "centroid"], expected)

    files = [*output.glob("*.*"), *output.glob("policies/*"), page]
    before = {file: file.read_bytes() for file in files}
    ARMS_RACE.run(output, page, find_backend("serial"), **options)
    assert {file: file.read_bytes() for file in files} == before


def test_the_committed_policies_repeat_their_episodes() -> None:
    """A policy and a predator of the last round, bit for bit."""
    objective, last = load_race(COMMITTED).objective, "per agent, round 2"
    with np.load(COMMITTED / "policies" / "predators.npz") as stored:
        predator = Predator("lead", 1.0, tuple(stored[last].tolist())).policy(race.SCENARIO)
    policy = str(COMMITTED / "policies" / "per-agent-round-2.npz")
    found = played(policy, predator, list(range(2_000_000, 2_000_003)))
    np.testing.assert_array_equal(found, objective[last, last][:3])


def test_the_committed_page_follows_from_its_results() -> None:
    page = ROOT / "docs" / "arms-race.md"
    assert page.read_text("utf-8") == markdown_page(load_race(COMMITTED), COMMITTED, page)
