"""Tasks can be played, are normalized and frozen; results of the scoreboard verify on a drawn flock."""

import hashlib
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import flockesc_env
from flockesc_env import InputError, load_policy, sweep
from flockesc_env.episodes.splits import HELD_OUT, TRAINING, TUNING, refuse_held_out
from flockesc_env.tasks.comparison import grid_of
from flockesc_env.tasks.definition import VERSION
from flockesc_env.tasks.fitting import fitted
from flockesc_env.tasks.results import read_result
from flockesc_env.tasks.scoring import draw_flocks, play, verify
from flockesc_env.tasks.task import read_tasks, tasks
from studies.scoreboard.board import BOARD, load_board
from studies.scoreboard.page import entries_of, readme_table

TASKS = tasks
ROOT = Path(flockesc_env.__file__).parents[1]


@pytest.mark.parametrize("name", TASKS)
def test_the_best_fixed_range_reaches_in_a_task_what_it_reaches_in_a_sweep(name: str) -> None:
    task, flocks = TASKS[name], TUNING[:2]
    for at, scale in task.scales.items():
        best = scale.best_fixed_range
        assert best in grid_of(task)
        entry = fitted(load_policy(f"fixed:{best}"), task)
        expected = sweep(task.scenarios[at], [best], flocks).values(task.spec.name)[0]
        np.testing.assert_array_equal(play(entry, task, at, flocks), expected)


@pytest.mark.parametrize("name", TASKS)
def test_the_scores_of_the_best_fixed_range_and_of_the_reference_are_0_and_1(name: str) -> None:
    task = TASKS[name]
    for score in (0, 1, -0.25):
        objectives = {at: one.zero + score * (one.one - one.zero) for at, one in task.scales.items()}
        assert task.normalize(objectives) == pytest.approx(score, abs=1e-12)
    assert all(scale.zero < scale.one for scale in task.scales.values())


@pytest.mark.parametrize("name", TASKS)
def test_a_simple_policy_shows_what_is_no_progress(name: str) -> None:
    """Its score is that of the scoreboard; that of random ranges depends on how many flocks play together."""
    task = TASKS[name]
    fitted(load_policy(task.shortcut.policy), task)
    rule = task.shortcut.policy
    folder = "fixed-range" if rule.startswith("fixed:") else rule
    result = read_result(ROOT / "scoreboard" / folder / f"{name}.json")
    assert result.policies[0].policy == rule
    error = 0.02 if rule == "random" else 1e-12
    assert task.shortcut.score == pytest.approx(result.scores()[0], abs=error)


@pytest.mark.parametrize("name", TASKS)
def test_an_environment_of_each_kind_has_the_tasks_options_or_says_what_to_call(name: str) -> None:
    task = TASKS[name]
    spec = task.policy_spec()
    assert task.vec_env(2).observation_space == spec.layout.space()
    if task.per_agent:
        env = task.parallel_env()
        assert env.observation_space(env.possible_agents[0]) == spec.layout.space()
        with pytest.raises(InputError, match="parallel_env and vec_env have one per agent"):
            task.env()
    else:
        assert task.env().observation_space == spec.layout.space()
        with pytest.raises(InputError, match="env has one per flock or line"):
            task.parallel_env()


def test_an_unknown_task_lists_the_near_ones() -> None:
    with pytest.raises(InputError, match=r"task: expected one of .* \(did you mean per-agent-visible, "):
        tasks["per-agent-visibel"]
    assert "per-agent-visible" in tasks
    assert all(name in repr(tasks) for name in tasks)


CHANGES = {
    "scored in": ("scales.flock-1000]", "scales.clusters]", {"held-out-sizes"}),
    "scenario": ('scenario = "pursuit"', 'scenario = "intercept"', {"pursuit"}),
    "option": ("max_range = 100.0", "max_range = 50.0", {"per-agent-visible-profile"}),
    "sentence": ('asks = "One range for the flock: ', 'asks = "One range: ', {"one-range"}),
    "version": (f'version = "{VERSION}"', 'version = "v2"', set(TASKS)),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_the_file_changes_the_checksums_of_the_tasks_that_it_is_about(name: str) -> None:
    old, new, expected = CHANGES[name]
    text = files("flockesc_env.tasks").joinpath(f"{VERSION}.toml").read_text("utf-8")
    assert old in text
    changed = read_tasks(text.replace(old, new, 1))
    assert {task for task in TASKS if changed[task].sha256 != TASKS[task].sha256} == expected


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('objective = "min_mean_distance"', 'objective = "fraction_surviving"', "expected capture_radius"),
        ('objective = "min_mean_distance"', 'objective = "means"', r"one-range.objective: .*'means'"),
        ('scenario = "paper-flock"', 'scenario = "paper-flok"', r"one-range.scenario: .*'paper-flok'"),
        ("samples = ", "sample = ", "unknown field `sample`"),
    ],
)
def test_a_bad_field_of_a_task_is_named(old: str, new: str, message: str) -> None:
    text = files("flockesc_env.tasks").joinpath(f"{VERSION}.toml").read_text("utf-8")
    with pytest.raises(InputError, match=message):
        read_tasks(text.replace(old, new, 1))


@pytest.mark.parametrize("seed", [HELD_OUT[0], HELD_OUT[-1]])
def test_nothing_is_chosen_on_held_out_flocks(seed: int) -> None:
    message = f"seeds: expected seeds outside of the held-out ones, 2000000 to 2999999, got {seed}"
    with pytest.raises(InputError, match=message):
        refuse_held_out([TUNING[-1], seed])
    refuse_held_out([TUNING[-1], TRAINING[0]])


def test_the_tasks_are_frozen() -> None:
    """A change of a task is another version of the tasks, in another file."""
    content = files("flockesc_env.tasks").joinpath("v1.toml").read_bytes()
    assert hashlib.sha256(content).hexdigest() == (
        "94456e3a5751e0ca6ebd6bc9da17b299273dedf69de00316ff0db95a8f1b314d"
    )


ROOT = Path(flockesc_env.__file__).parents[1]
FILES = [path.relative_to(ROOT).as_posix() for path in sorted((ROOT / BOARD).rglob("*.json"))]
NUM_FLOCKS = 1
"""`flockesc verify FILE` plays all 1,000 flocks."""


@pytest.mark.parametrize("file", FILES)
def test_a_result_verifies_and_its_folder_has_no_other_policies(file: str) -> None:
    result = read_result(ROOT / file)
    assert not result.is_code
    assert file == f"{BOARD}/{result.learner}/{result.task}.json"
    if result.learner != "random":  # its numbers depend on all flocks before
        verify(ROOT / file, flocks=draw_flocks(NUM_FLOCKS, 0))


def test_every_policy_file_has_a_result() -> None:
    for entrant in load_board(ROOT / BOARD):
        named = {policy.policy for result in entrant.results.values() for policy in result.policies}
        files = (ROOT / BOARD / entrant.name).rglob("*.npz")
        assert {f"policies/{file.name}" for file in files} <= named, entrant.name


def test_the_page_and_the_readme_are_those_of_the_results() -> None:
    entries = entries_of(load_board(ROOT / BOARD))
    assert set(entries) == set(tasks)
    page = (ROOT / "docs/scoreboard.md").read_text()
    for shown in entries.values():
        for entry in shown:
            assert f"[{entry.result.learner}]" in page
            assert f"| {entry.row.score:z.3f} |" in page
    assert readme_table(entries) in (ROOT / "README.md").read_text()
