"""Scores are those of a rollout, and a result that differs from its replay in one bit is refused."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_runs import policy_file

from flockesc_env import ArgumentError, rollout, save_policy
from flockesc_env.benchmark import scoring
from flockesc_env.benchmark.results import Result, Training, read_result, write_result
from flockesc_env.benchmark.scoring import score, verify
from flockesc_env.benchmark.tasks import task_of
from flockesc_env.common.errors import RecordError
from flockesc_env.policies import StubbornWitnesses, find_policy
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.scenario.flock import FlockScenario

TASK = task_of("held-out-worlds")
FILE, RULE = "policies/mine-0.npz", "stubborn-leaders"


def scored(folder: Path, *specs: str, training: Training | None = None) -> Path:
    """Score policies, write the result and return its path."""
    path = folder / "result.json"
    names = [str(folder / spec) if spec == FILE else spec for spec in specs]
    entries = [(name, find_policy(name)) for name in names]
    write_result(score(entries, TASK, learner="mine", output=path, training=training), path)
    return path


@pytest.fixture(scope="module")
def folder(few_flocks: range, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of a policy file and a rule, as if they were training seeds 0 and 1 of a learner."""
    folder = tmp_path_factory.mktemp("scored")
    (folder / "policies").mkdir()
    policy_file(folder / FILE)
    training = Training(seeds=[0, 1], samples=10, cpu_minutes=[0.5, 0.5], versions={"torch": "2.9"})
    return scored(folder, FILE, RULE, training=training).parent


@pytest.fixture
def path(folder: Path, tmp_path: Path) -> Path:
    """A copy of the result in another folder."""
    return Path(shutil.copytree(folder, tmp_path / "copy")) / "result.json"


def test_a_result_has_the_objectives_of_rollouts_and_is_verified(path: Path, few_flocks: range) -> None:
    result, file = read_result(path), path.parent / FILE
    assert [policy.policy for policy in result.policies] == [FILE, RULE]
    assert [policy.sha256 for policy in result.policies] == [
        hashlib.sha256(file.read_bytes()).hexdigest(),
        "",
    ]
    normalized = []
    for name, world in TASK.worlds.items():
        played = [rollout(TASK.scenarios[name], spec, few_flocks) for spec in (str(file), RULE)]
        objectives = np.array([episodes.min_mean_distance for episodes in played])
        np.testing.assert_array_equal(result.values(name), objectives)
        normalized.append((objectives.mean(axis=1) - world.zero) / (world.one - world.zero))
    np.testing.assert_allclose(result.scores(), np.mean(normalized, axis=0), rtol=1e-12)
    assert verify(path) == result
    assert not result.is_code


def change(path: Path, changes: Mapping[str, Any]) -> None:
    """Change entries of a result's file, by path: values, or functions of the old value."""
    document = json.loads(path.read_text())
    for name, value in changes.items():
        *parents, last = [int(key) if key.isdigit() else key for key in name.split(".")]
        entry: Any = document
        for key in parents:
            entry = entry[key]
        entry[last] = value(entry[last]) if callable(value) else value
    path.write_text(json.dumps(document))


Policies = Callable[[Sequence[Any]], Sequence[Any]]
same_file: Policies = lambda found: [found[0], {**found[0], "policy": "copy.npz"}]  # noqa: E731
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "last bit": (
        {"policies.0.objectives.two-predators.3": lambda value: np.nextafter(value, 0)},
        "policies[0]: expected objectives in two-predators with the bits that policies/mine-0.npz reaches, "
        "got 1 of 6 others (flock 2000003: ",
    ),
    "another rule": ({"policies.1.policy": "stubborn-leaders-local"}, "got 6 of 6 others (flock 2000000: "),
    "checksum": ({"policies.0.sha256": "0" * 64}, f"mine-0.npz with the sha256 {'0' * 64}, got "),
    "no file": ({"policies.0.policy": "none.npz"}, "an existing policy file, got 'none.npz'"),
    "code": ({"policies.1.policy": "my:rule"}, "which can be played again, got 'my:rule', played by its"),
    "sees more": ({"policies.1.policy": "turn-away"}, "[1]: profile_ranges: expected none, as in the task"),
    "flock's view": (
        {"policies.1.policy": "listen-while-fleeing"},
        "per_agent: expected True, as in the task",
    ),
    "first flock": ({"flocks": [2_000_001, 6]}, "number (2000000, 6), got (2000001, 6)"),
    "fewer flocks": ({"flocks": [2_000_000, 5]}, "number (2000000, 6), got (2000000, 5)"),
    "version": ({"benchmark": "v2"}, "benchmark: expected v1, got 'v2'"),
    "task": ({"task": "held-out-sizes"}, "of the task held-out-sizes, got '"),
    "unknown task": ({"task": "held-out-world"}, "(did you mean held-out-worlds?)"),
    "checksum of the task": ({"task_sha256": "0" * 64}, f"of the task held-out-worlds, got '{'0' * 64}'"),
    "unknown field": ({"note": "mine"}, "unknown field `note`"),
    "no policies": ({"policies": []}, "policies: expected at least one, got none"),
    "rule twice": ({"policies": lambda found: [found[1]] * 2}, "different policies, got one of them twice"),
    "file twice": ({"policies": same_file}, "different policies, got one of them twice"),
    "missing seed": ({"training.seeds": [0]}, "seeds: expected 2 different seeds, one per policy, got [0]"),
    "seed twice": ({"training.seeds": [0, 0]}, "expected 2 different seeds, one per policy, got [0, 0]"),
    "no seeds": ({"training": {"samples": 10}}, "missing required field `seeds` - at `$.training`"),
    "NaN": ({"policies.1.objectives.intercept.2": np.nan}, "6 finite numbers, got 5 finite of 6"),
    "5 numbers": (
        {"policies.1.objectives.intercept": [80.0] * 5},
        "policies[1].objectives.intercept: expected 6 finite numbers, got 5 finite of 5",
    ),
    "one world": (
        {"policies.1.objectives": {"intercept": [80.0] * 6}},
        "policies[1].objectives: expected the worlds intercept, two-predators, got intercept",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_changed_result_is_refused_with_a_line_that_names_the_change(name: str, path: Path) -> None:
    changes, message = REFUSED[name]
    change(path, changes)
    with pytest.raises(RecordError) as caught:
        verify(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_another_policy_under_the_name_of_the_file_is_refused(path: Path) -> None:
    file = path.parent / FILE
    other = NamedPolicy("mine", StubbornWitnesses(), True, {}, FlockScenario())
    save_policy(other, file)
    with pytest.raises(RecordError, match="with the sha256"):
        verify(path)
    change(path, {"policies.0.sha256": hashlib.sha256(file.read_bytes()).hexdigest()})
    with pytest.raises(RecordError, match="got 6 of 6 others"):
        verify(path)


def test_damaged_files_are_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(RecordError, match="expected a result of the benchmark"):
        verify(path)


def test_some_flocks_are_drawn_by_every_byte_of_the_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[tuple[int, ...]] = []
    choices = set()

    def spy(*arguments: Any) -> Any:
        drawn.append(tuple(arguments[-1]))
        return play(*arguments)

    play = scoring.play
    monkeypatch.setattr(scoring, "play", spy)
    for _ in range(4):
        path.write_bytes(path.read_bytes() + b"\n")
        drawn.clear()
        verify(path, flocks=3)
        assert len(set(drawn)) == 1, "the same flocks for all policies and worlds"
        assert len(set(drawn[0])) == 3
        choices.add(drawn[0])
    assert len(choices) > 1
    verify(path, flocks=3)
    assert len(set(drawn)) == 1, "the same flocks again"


@pytest.mark.parametrize("flocks", [0, -1])
def test_verifying_without_a_flock_is_refused(flocks: int, path: Path) -> None:
    with pytest.raises(ArgumentError, match="flocks: expected an integer from 1"):
        verify(path, flocks=flocks)


def test_some_flocks_of_a_random_policy_are_verified(few_flocks: range, tmp_path: Path) -> None:
    """Its numbers depend on all flocks before."""
    path = scored(tmp_path, "random")
    assert isinstance(verify(path, flocks=1), Result)
    change(path, {f"policies.0.objectives.{world}": [80.0] * 6 for world in TASK.worlds})
    with pytest.raises(RecordError, match="got 1 of 1 others"):
        verify(path, flocks=1)
