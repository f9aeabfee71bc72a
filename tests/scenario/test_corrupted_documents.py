"""A corrupted scenario is refused or loads and plays; ``tests/slow`` has ten thousand of them."""

from __future__ import annotations

import json
from typing import Any

import pytest
from corrupted_documents import check, outcome_of

from flockesc_env import FlockScenario, LineScenario
from flockesc_env.common.errors import ScenarioError


def test_a_few_hundred() -> None:
    check(outcome_of(1_000_000, 500), 500)


@pytest.mark.parametrize("model", [FlockScenario, LineScenario])
@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"mass": ' + "[" * 600 + "1" + "]" * 600 + "}",
        '{"num_agents": ' + "[" * 100 + "1" + "]" * 100 + "}",
        '{"num_agents": 1' + "0" * 5000 + "}",
        '{"num_agents": 5, "num_agents": 6}',
        '{"\\ud800": 5}',
        "\0",
        "\ufeff{}",
    ],
    ids=["open", "deep", "nested", "huge", "twice", "surrogate", "null", "byte order mark"],
)
def test_json(model: Any, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        model.from_json(text)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("model", [FlockScenario, LineScenario])
@pytest.mark.parametrize(
    "text",
    [
        "mass = " + "[" * 100_000,
        "num_agents = 1" + "0" * 5000,
        "num_agents = 0x" + "f" * 5000,
        "num_agents = 5\nnum_agents = 6",
        "num_agents = 1979-05-27",
        "num_agents = nan",
        "é = 1",
    ],
    ids=["open", "huge", "hexadecimal", "twice", "date", "nan", "name"],
)
def test_toml(model: Any, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        model.from_toml(text)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("field", ["num_agents", "num_steps", "sensing_delay"])
def test_large_numbers_take_no_memory_before_they_are_used(field: str) -> None:
    """Loading a scenario allocates no flock; only environments and simulations do."""
    text = json.dumps({field: 10**7})
    assert getattr(FlockScenario.from_json(text), field) == 10**7
