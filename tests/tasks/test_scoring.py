"""Scores are those of a rollout, and a result that differs from its replay in one bit is refused."""

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_runs import policy_file

from flockesc_env import InputError, load_policy, rollout, save_policy
from flockesc_env.policies import NetworkPolicy, StubbornWitnesses
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.taskset import scoring
from flockesc_env.taskset.results import Result, Training, read_result, write_result
from flockesc_env.taskset.scoring import LoadedPolicy, draw_flocks, score, verify
from flockesc_env.taskset.task import tasks

TASK = tasks["held-out-predators"]
FILE, RULE = "policies/mine-0.npz", "stubborn-leaders"
BELOW = "below the result's folder"
BOUNDS: dict[str, Any] = {name: TASK.options[name] for name in ("max_range", "steps_per_action")}


def scored(folder: Path, *specs: str, training: Training | None = None) -> Path:
    path = folder / "result.json"
    policies = [LoadedPolicy.of(str(folder / spec) if spec == FILE else spec) for spec in specs]
    write_result(score(policies, TASK, learner="mine", output=path, training=training), path)
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
    checksum = hashlib.sha256(file.read_bytes()).hexdigest()
    assert [policy.sha256 for policy in result.policies] == [checksum, ""]
    normalized = []
    for name, scale in TASK.scales.items():
        played = [rollout(TASK.scenarios[name], spec, few_flocks, **BOUNDS) for spec in (str(file), RULE)]
        objectives = np.array([episodes.min_mean_distance for episodes in played])
        np.testing.assert_array_equal(result.values(name), objectives)
        normalized.append((objectives.mean(axis=1) - scale.zero) / (scale.one - scale.zero))
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


def two(first: str, second: str) -> Policies:
    """Return the rule's entry under two names."""
    return lambda found: [{**found[1], "policy": name} for name in (first, second)]


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "last bit": (
        {"policies.0.objectives.two-predators.3": lambda value: np.nextafter(value, 0)},
        "policies[0]: expected objectives in two-predators with the bits that policies/mine-0.npz reaches, "
        "got 1 of 6 others (flock 2000003: ",
    ),
    "checksum": ({"policies.0.sha256": "0" * 64}, f"mine-0.npz with the sha256 {'0' * 64} (restore"),
    "no file": ({"policies.0.policy": "none.npz"}, "none.npz'"),
    "training run": (
        {"policies.0.policy": "policies", "policies.0.sha256": ""},
        f"policies[0].policy: expected a policy file {BELOW}",
    ),
    "mark": ({"is_code": True}, "is_code: expected False, as its policies are, got True"),
    **{
        f"path {path}": ({"policies.0.policy": path}, f"expected a relative path of a file in or {BELOW}")
        for path in ("/mine-0.npz", "policies/../mine-0.npz")
    },
    "folder": ({"policies.0.policy": f"{FILE}/"}, f"a relative path of a file in or {BELOW}, such as"),
    "checksum of a rule": ({"policies.1.sha256": "0" * 64}, "checksum for a policy without a file, got '0"),
    "code": (
        {"policies.1.policy": "my:rule", "is_code": True},
        "which can be played again, got 'my:rule', played by its",
    ),
    "sees more": ({"policies.1.policy": "turn-away"}, "[1]: profile_ranges: expected none, as in the task"),
    "first flock": ({"flocks": [2_000_001, 6]}, "number (2000000, 6), got (2000001, 6)"),
    "version": ({"version": "v2"}, "version: expected v1, got 'v2'"),
    "task": ({"task": "held-out-sizes"}, "of the task held-out-sizes, got '"),
    "unknown task": ({"task": "held-out-predator"}, "(did you mean held-out-predators"),
    "unknown field": ({"note": "mine"}, "unknown field `note`"),
    "no policies": ({"policies": []}, "policies: expected at least one, got none"),
    "rule twice": ({"policies": two(RULE, RULE)}, f"got one of them twice ({RULE} and {RULE})"),
    "file twice": ({"policies": same_file}, f"got one of them twice ({FILE} and copy.npz)"),
    "negative seed": ({"training.seeds.0": -1}, "Expected `int` >= 0 - at `$.training.seeds[0]`"),
    "minutes of one": ({"training.cpu_minutes": [1.0]}, "expected 2 numbers, one per policy, got [1.0]"),
    "seed twice": ({"training.seeds": [0, 0]}, "expected 2 different seeds, one per policy, got [0, 0]"),
    "NaN": ({"policies.1.objectives.intercept.2": np.nan}, "6 finite numbers, got 5 finite of 6"),
    "one scenario": (
        {"policies.1.objectives": {"intercept": [80.0] * 6}},
        "policies[1].objectives: expected the scenarios intercept, two-predators, got intercept",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_changed_result_is_refused_with_a_line_that_names_the_change(name: str, path: Path) -> None:
    changes, message = REFUSED[name]
    change(path, changes)
    with pytest.raises(InputError) as caught:
        verify(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def mine() -> StubbornWitnesses:
    known: dict[str, Any] = {"scenario": FlockScenario(), "predator_sensing_range": 30.0, **BOUNDS}
    return StubbornWitnesses().with_options(name="mine", **known)


def test_another_policy_under_the_name_of_the_file_is_refused(path: Path) -> None:
    file = path.parent / FILE
    save_policy(mine(), file)
    with pytest.raises(InputError, match="with the sha256"):
        verify(path)
    change(path, {"policies.0.sha256": hashlib.sha256(file.read_bytes()).hexdigest()})
    with pytest.raises(InputError, match="got 6 of 6 others"):
        verify(path)


def test_damaged_files_are_refused(path: Path) -> None:
    for file, expected in (
        (path.parent / FILE, "with the sha256 .* score it again"),
        (path, "a result on a task"),
    ):
        file.write_bytes(file.read_bytes()[:-100])
        with pytest.raises(InputError, match=f"expected .*{expected}"):
            verify(path)


def with_an_idle_unit(policy: Any) -> Any:
    """Return a network with one more hidden unit, of weight 0."""
    (rows, width), (_, outputs) = policy.architecture.shapes
    first, last = np.split(policy.parameters, [(rows + 1) * width])
    first = np.insert(first.reshape(rows + 1, width), width, 0, axis=1)
    last = np.insert(last.reshape(width + 1, outputs), width, 0, axis=0)
    wide = replace(policy.architecture, hidden=(width + 1,))
    known = {"per_agent": policy.per_agent, "scenario": policy.scenario, **policy.options}
    return NetworkPolicy(wide, np.concatenate([first.ravel(), last.ravel()])).with_options(**known)


def test_a_policy_counts_once_whatever_its_file_is_called(path: Path) -> None:
    """Equal objectives on all flocks are one policy."""
    file, copy = path.parent / FILE, path.parent / "policies/mine-1.npz"
    save_policy(with_an_idle_unit(load_policy(file)), copy)
    policies = [LoadedPolicy.of(str(one)) for one in (file, copy)]
    twice = r"differ on some flock \(list equal ones once\), got one of them twice"
    with pytest.raises(InputError, match=twice):
        score(policies, TASK, learner="mine", output=path)
    sha256 = hashlib.sha256(copy.read_bytes()).hexdigest()
    change(path, {"policies.1": {**json.loads(path.read_text())["policies"][0]}})
    change(path, {"policies.1.policy": "policies/mine-1.npz", "policies.1.sha256": sha256})
    for check in (read_result, verify):
        with pytest.raises(InputError, match=twice):
            check(path)


def test_the_checksum_is_that_of_the_bytes_that_play(path: Path) -> None:
    """A file is read once, so it may be replaced; a link stays the file that the result names."""
    link = path.parent / "link.npz"
    link.symlink_to(FILE)
    before, recorded = LoadedPolicy.of(str(link)), read_result(path).policies[0]
    save_policy(mine(), path.parent / FILE)
    (found,) = score([before], TASK, learner="mine", output=path).policies
    assert (found.policy, found.sha256) == ("link.npz", recorded.sha256)
    assert found.objectives == recorded.objectives


def test_files_lie_below_the_folder_of_the_result(path: Path) -> None:
    """The folder of a training run stands for its file."""
    run, recorded = path.parent / "run", read_result(path).policies[0]
    run.mkdir()
    shutil.copy(path.parent / FILE, run / "policy.npz")
    policies, elsewhere = [LoadedPolicy.of(str(run))], path.parent / "other" / "mine.json"
    (found,) = score(policies, TASK, learner="mine", output=path).policies
    assert (found.policy, found.sha256) == ("run/policy.npz", recorded.sha256)
    with pytest.raises(
        InputError, match=f"policy.npz: policy: expected .* {BELOW} .*--output .*run/mine.json"
    ):
        score(policies, TASK, learner="mine", output=elsewhere)


def test_some_flocks_are_drawn_by_whoever_verifies(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same ones for all policies and scenarios."""
    drawn, play = set(), scoring.play
    monkeypatch.setattr(scoring, "play", lambda *given: drawn.add(tuple(given[-1])) or play(*given))
    verify(path, flocks=draw_flocks(3, 7))
    assert drawn == {tuple(draw_flocks(3, 7))}
    choices = {tuple(draw_flocks(3, seed)) for seed in range(20)}
    assert len(choices) > 10
    assert all(len(set(chosen)) == 3 for chosen in choices)


@pytest.mark.parametrize("flocks", [[], [2_000_006]])
def test_verifying_without_a_flock_is_refused(flocks: list[int], path: Path) -> None:
    with pytest.raises(InputError, match="flocks: expected"):
        verify(path, flocks=flocks)


def test_some_flocks_of_a_random_policy_are_verified(few_flocks: range, tmp_path: Path) -> None:
    """Its numbers depend on all flocks before."""
    path = scored(tmp_path, "random")
    assert isinstance(verify(path, flocks=[2_000_003]), Result)
    change(path, {f"policies.0.objectives.{name}": [80.0] * 6 for name in TASK.scales})
    with pytest.raises(InputError, match="got 1 of 1 others"):
        verify(path, flocks=[2_000_003])
