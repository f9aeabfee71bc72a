"""Randomization: each episode draws numbers of the scenario, and a seed determines them everywhere."""

from __future__ import annotations

import itertools
import json
import random
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from argument_table import PARTS, SLOTS
from option_table import small_flock

import flockesc_env as fe

POSITION = "predators[0].constant_velocity.position[1]"
DRAWS = (
    fe.Uniform("predator_range", 5.0, 60.0),
    fe.LogUniform("mass", 0.01, 1.0),
    fe.Choice("predators[1].pure_pursuit.max_turn_rate", (0.5, 1.0, 2.0)),
    fe.Uniform(POSITION, -30.0, 30.0),
    fe.Uniform("initial_positions.ring.radius", 5.0, 20.0),
)


def randomized(**changes: Any) -> fe.FlockScenario:
    fields: dict[str, Any] = {
        "predators": (fe.ConstantVelocity(), fe.PurePursuit((20.0, -20.0))),
        "initial_positions": fe.Ring(5.0, 2.0),
        "randomization": DRAWS,
    }
    return small_flock(**{**fields, **changes})


def assert_equal(first: fe.Trajectory, second: fe.Trajectory) -> None:
    assert not fe.run_differences(first, second)
    assert first.scenario == second.scenario


def test_the_draws_of_a_seed_never_change() -> None:
    drawn = randomized().drawn(0)
    assert drawn.predator_range == 13.540064715837513
    assert drawn.drawn(1) is drawn
    assert randomized().drawn(1) != drawn
    assert randomized().drawn(2**64 - 1) == randomized().drawn(2**64 - 1)


@pytest.mark.parametrize("seed", [0, 5, 2**40])
def test_everything_runs_the_drawn_scenario(seed: int) -> None:
    scenario = randomized()
    drawn = scenario.drawn(seed)
    run = fe.simulate(scenario, 10.0, seed=seed)
    assert_equal(run, fe.simulate(drawn, 10.0, seed=seed))
    assert run.scenario == drawn
    for each in (scenario, drawn):
        assert fe.sweep(each, [10.0], [seed]).min_mean_distance[0, 0] == run.mean_distance.min()
        episodes = fe.rollout(each, fe.policies.FixedRange(10.0), [seed], action_mode="range")
        assert episodes.min_mean_distance[0] == run.mean_distance.min()
        assert_equal(fe.record(each, fe.policies.FixedRange(10.0), seed, action_mode="range"), run)


def observations(env: Any, reset: Any) -> list[Any]:
    found = [reset]
    while len(found) < 5:
        found.append(env.step(np.full(env.action_space.shape, 0.1, np.float32))[:2])
    return found


@pytest.mark.parametrize("sensing", ["predator_range", None, 10.0])
def test_environments_play_and_show_the_drawn_scenario(sensing: Any) -> None:
    scenario = randomized()
    for seed in range(5):
        played = []
        for each in (scenario, scenario.drawn(seed)):
            env = fe.FlockEscapeEnv(scenario=each, predator_sensing_range=sensing)
            played.append(observations(env, env.reset(seed=seed)[0]))
        for first, second in zip(*played, strict=True):
            np.testing.assert_array_equal(first[0], second[0])
            np.testing.assert_array_equal(first[1], second[1])


def test_agents_sense_predators_within_the_drawn_range() -> None:
    scenario = small_flock(randomization=(fe.Uniform("predator_range", 5.0, 60.0),))
    env, sensed = fe.parallel_env(scenario=scenario), set()
    for seed in range(20):
        found, _ = env.reset_array(seed=seed)
        run = fe.simulate(scenario, 0.0, seed=seed)
        distance = np.linalg.norm(run.positions[0] - run.predator_positions[0], axis=1)
        is_sensed = distance <= scenario.drawn(seed).predator_range
        column = [name for name, *_ in fe._core.observation_entries('{"view": "agent"}', 2)].index(
            "predator_sensed"
        )
        np.testing.assert_array_equal(found[:, column], is_sensed.astype(np.float32))
        sensed |= set(is_sensed.tolist())
    assert sensed == {True, False}


@pytest.mark.parametrize(
    ("part", "field"),
    [
        (fe.Uniform("wings", 0.0, 1.0), "uniform.field"),
        (fe.Uniform("time_step", 0.01, 0.05), "uniform.field"),
        (fe.Uniform("predators[2].pure_pursuit.sight", 1.0, 2.0), "uniform.field"),
        (fe.Uniform("speed", 1.0, 2.0), "uniform.field"),
        (fe.Uniform("mass", -0.1, 2.0), "uniform.low"),
        (fe.LogUniform("mass", 0.0, 1.0), "log_uniform.low"),
        (fe.Uniform("initial_positions.ring.width", 2.0, 11.0), "uniform.high"),
        (fe.Choice("mass", (1.0, 0.0)), "choice.values[1]"),
    ],
)
def test_refused_distributions(part: Any, field: str) -> None:
    with pytest.raises(fe.ScenarioError) as caught:
        randomized(randomization=(fe.Uniform("speed", 5.0, 10.0), part))
    assert caught.value.field == f"randomization[1].{field}"


def test_a_change_without_effect_is_refused() -> None:
    scenario = small_flock(randomization=(fe.Uniform("predator_range", 5.0, 60.0),))
    with pytest.raises(
        fe.ScenarioError, match="predator_range: expected a field that randomization does not"
    ):
        scenario.replace(predator_range=9.0)
    assert scenario.replace(predator_range=9.0, randomization=()).predator_range == 9.0


def numbers_in(value: Any, path: str) -> Iterator[str]:
    """Yield the paths of all real numbers in a document."""
    if isinstance(value, dict):
        for name, entry in value.items():
            yield from numbers_in(entry, f"{path}.{name}")
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from numbers_in(entry, f"{path}[{index}]")
    elif isinstance(value, float):
        yield path


def set_number(document: Any, path: str, number: float) -> None:
    *outer, last = (int(key) if key.isdigit() else key for key in re.findall(r"\w+", path))
    for key in outer:
        document = document[key]
    document[last] = number


def is_accepted(document: dict[str, Any]) -> bool:
    try:
        fe._core.check_flock_scenario(json.dumps(document))
    except fe.ScenarioError:
        return False
    return True


def some_values(rng: random.Random) -> list[float]:
    """Return three values around 0, or close enough to those of other numbers that combinations decide."""
    middle = rng.uniform(0.5, 20.0)
    near = [middle * rng.uniform(0.7, 1.3) for _ in range(3)]
    return near if rng.random() < 0.75 else rng.choices([-2.0, 0.0, 1.0], k=3)


@pytest.mark.parametrize(("slot", "part"), PARTS)
def test_randomization_is_accepted_if_all_combinations_are(slot: str, part: Any) -> None:
    """The core tests few of the combinations of the values; this test tests all."""
    place, _ = SLOTS[slot]
    document = json.loads(small_flock(num_agents=5, **{slot: place(part)}).to_json())
    document["randomization"] = []
    rng = random.Random(part.kind)  # noqa: S311, no secret
    numbers = [path for path in numbers_in(document[slot], slot) if part.kind in path]
    bounded = [path for path in numbers if re.search("velocity|max_speed|radius|width|direction", path)]
    for _ in range(100 if numbers else 0):
        among = rng.choice([numbers, bounded or numbers])
        values = {path: some_values(rng) for path in rng.sample(among, min(3, len(among)))}
        plain = json.loads(json.dumps(document))
        all_accepted = True
        for combination in itertools.product(*values.values()):
            for path, number in zip(values, combination, strict=True):
                set_number(plain, path, number)
            all_accepted = all_accepted and is_accepted(plain)
        choices = [{"choice": {"field": path, "values": each}} for path, each in values.items()]
        assert is_accepted(document | {"randomization": choices}) == all_accepted, values


def masses(count: int, draws: list[Any]) -> dict[str, Any]:
    return {"num_agents": count, "mass": [0.5] * count, "randomization": draws}


LARGE: dict[str, tuple[dict[str, Any], str | None]] = {
    "masses": (
        masses(4000, [{"uniform": {"field": f"mass[{k}]", "low": 0.1, "high": 1.0}} for k in range(4000)]),
        None,
    ),
    "values": (
        masses(1000, [{"choice": {"field": f"mass[{k}]", "values": [0.5] * 1000}} for k in range(100)]),
        None,
    ),
    "the last value": (
        masses(1000, [{"choice": {"field": "mass[999]", "values": [*[0.5] * 9_999, 0.0]}}]),
        "randomization[0].choice.values[9999]: expected",
    ),
    "distributions": (
        masses(1, [{"uniform": {"field": "mass[0]", "low": 0.1, "high": 1.0}}] * 10_001),
        "randomization: expected at most 10000 distributions, got 10001",
    ),
    "predators": (
        {"predators": [{"constant_velocity": {"position": [0.0, 0.0], "velocity": [1.0, 0.0]}}] * 10_001},
        "predators: expected at most 10000 predators, got 10001",
    ),
}


@pytest.mark.parametrize(("document", "error"), LARGE.values(), ids=LARGE)
def test_large_documents_are_accepted_or_refused(document: dict[str, Any], error: str | None) -> None:
    """The check of these documents takes minutes if it is not linear in their size."""
    text = json.dumps(document)
    if error is None:
        assert fe.FlockScenario.from_json(text).drawn(1).num_agents == document["num_agents"]
        return
    for read in (fe.FlockScenario.from_json, fe._core.check_flock_scenario):
        with pytest.raises(fe.ScenarioError, match=f"^{re.escape(error)}"):
            read(text)
