"""The arms race: predators, training runs, the pairing of the cross-play, its files and its page."""

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from option_table import small_flock

from flockesc_env import rollout
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.jobs import find_backend
from flockesc_env.policies import Pursue
from studies.arms_race import race
from studies.arms_race.opponents import SIZE, Flock, LeadPursuit, NetworkPredator, Predator
from studies.arms_race.race import FIXED, LEARNED, Budget, learner
from studies.arms_race.report import ARMS_RACE, load_race

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


def test_lead_pursuit_aims_at_the_meeting_point() -> None:
    # The predator flies at 15 m/s along x, the centroid is at (36, 0) and flies at 9 m/s along y. They meet
    # after 3 s at (36, 27): 36^2 + 27^2 = 45^2 = (15 m/s 3 s)^2. The velocity is observed minus the
    # predator's: (-15, 9), and vectors w as w / (||w|| + 10), lengths as l / (l + 60).
    scale = np.hypot(15, 9) + 10
    spec = PredatorPolicySpec.of(SCENARIO)
    observation = np.zeros((1, len(spec.layout.names)), np.float32)
    for name, value in {
        "speed": 1.0,
        "centroid_direction_ahead": 1.0,
        "centroid_distance": 36 / 96,
        "flock_velocity_ahead": -15 / scale,
        "flock_velocity_left": 9 / scale,
    }.items():
        observation[0, spec.layout.index(name)] = value
    for lead, aim in ((0.0, (36, 0)), (0.5, (36, 13.5)), (1.0, (36, 27)), (2.0, (36, 54))):
        action = LeadPursuit(SCENARIO, lead).act(observation, spec)
        np.testing.assert_allclose(action[0], np.array(aim) / np.hypot(*aim), atol=1e-6)


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
def test_the_race_is_paired_and_a_second_call_repeats_it(tmp_path: Path) -> None:
    options: dict[str, Any] = {"rounds": 1, "num_flocks": 4, "budget": BUDGET}
    output = tmp_path / "race"
    results = ARMS_RACE.run(output, find_backend("serial"), **options)
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

    files = [*output.glob("*.*"), *output.glob("policies/*")]
    before = {file: file.read_bytes() for file in files}
    ARMS_RACE.run(output, find_backend("serial"), **options)
    assert {file: file.read_bytes() for file in files} == before


def test_the_committed_policies_repeat_their_episodes() -> None:
    """A policy and a predator of the last round, bit for bit."""
    objective, last = load_race(COMMITTED).objective, "per agent, round 2"
    with np.load(COMMITTED / "policies" / "predators.npz") as stored:
        predator = Predator("lead", 1.0, tuple(stored[last].tolist())).policy(race.SCENARIO)
    policy = str(COMMITTED / "policies" / "per-agent-round-2.npz")
    found = played(policy, predator, list(range(2_000_000, 2_000_003)))
    np.testing.assert_array_equal(found, objective[last, last][:3])
