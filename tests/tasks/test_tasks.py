"""Tasks can be played, are normalized and frozen; policies that fit them; the scoreboard verifies."""

import dataclasses
import hashlib
import math
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flockesc_env
from flockesc_env import FlockScenario, InputError, LineScenario, load_policy, policies, simulate, sweep
from flockesc_env.episodes.splits import TUNING
from flockesc_env.scenario.options import FREE, EnvOptions, LineOptions
from flockesc_env.taskset.fitting import is_checkable
from flockesc_env.taskset.results import read_result
from flockesc_env.taskset.scoring import draw_flocks, objective_of, verify
from flockesc_env.taskset.task import VERSION, Task, read_tasks, tasks
from studies.findings.report import rows_of, tasks_table
from studies.scoreboard.board import ABLATIONS, BOARD, folder_of, load_board
from studies.scoreboard.report import entries_of, report

ROOT = Path(flockesc_env.__file__).parents[1]
CHANGES = {
    "scored in": ("scales.flock-1000]", "scales.clusters]", {"held-out-sizes"}),
    "scenario": ('scenario = "pursuit"', 'scenario = "intercept"', {"pursuit"}),
    "option": ("max_range = 100.0", "max_range = 50.0", {"per-agent-visible-profile"}),
    "sentence": ('asks = "One range for the flock: ', 'asks = "One range: ', {"one-range"}),
    "version": (f'version = "{VERSION}"', 'version = "v2"', set(tasks)),
}
FILES = [
    path.relative_to(ROOT).as_posix()
    for folder in (BOARD, ABLATIONS)
    for path in sorted((ROOT / folder).rglob("*.json"))
]
NUM_FLOCKS = 1
"""`flockesc verify FILE` plays all 1,000 flocks."""


@pytest.mark.parametrize("name", tasks)
def test_the_best_fixed_range_reaches_in_a_task_what_it_reaches_in_a_sweep(name: str) -> None:
    task, flocks = tasks[name], TUNING[:2]
    for at, scale in task.scales.items():
        best = scale.best_fixed_range
        assert best in task.scenario.search_ranges
        entry = task.setup(f"fixed:{best}")
        expected = sweep(task.scenarios[at], [best], flocks).values(task.spec.name)[0]
        np.testing.assert_array_equal(objective_of(entry, task, at, flocks), expected)


@pytest.mark.parametrize("name", tasks)
def test_a_rule_with_chosen_numbers_shows_what_is_no_progress(name: str) -> None:
    """The wheel has the one of the first seed. Its search saw few episodes, none of them a held-out flock."""
    task, rule = tasks[name], load_policy(tasks[name].rule)
    assert task.setup(rule).per_agent is task.per_agent
    result = read_result(ROOT / "scoreboard" / "rule" / f"{name}.json")
    assert result.training is not None
    assert result.training.episodes + result.training.evaluations < 2000
    played = objective_of(task.setup(rule), task, first := next(iter(task.scales)), task.seeds[:2])
    assert played.tolist() == result.policies[0].objectives[first][:2]


@pytest.mark.parametrize("name", tasks)
def test_an_environment_of_each_kind_has_the_tasks_options_or_says_what_to_call(name: str) -> None:
    task = tasks[name]
    spec = task.policy_spec
    assert task.vec_env(2).observation_space == spec.layout.space()
    if isinstance(task.scenario, LineScenario):
        with pytest.raises(InputError, match="scenario: expected a FlockScenario"):
            task.parallel_env()
    else:
        env = task.parallel_env()
        assert env.observation_space(env.possible_agents[0]) == spec.layout.space()
    if task.per_agent:
        with pytest.raises(InputError, match="parallel_env and vec_env have one per agent"):
            task.env()
    else:
        assert task.env().observation_space == spec.layout.space()


def test_an_unknown_task_lists_the_near_ones() -> None:
    with pytest.raises(InputError, match=r"task: expected one of .* \(did you mean per-agent-visible, "):
        tasks["per-agent-visibel"]
    assert "per-agent-visible" in tasks
    assert all(name in repr(tasks) for name in tasks)
    for name, task in tasks.items():
        assert tasks[name.upper().replace("-", "_")] is task
        assert task.learner("PPO") == task.learner("ppo")
        facts = [name, task.asks, task.rule, f"{task.samples:,}", f'tasks["{name}"].']
        assert all(fact in str(task) for fact in facts)
        assert len(str(task).splitlines()) == 12


@pytest.mark.parametrize("name", ["line", "one-range", "per-agent-local"])
def test_an_unknown_argument_of_an_environment_lists_the_constructors_own(name: str) -> None:
    with pytest.raises(InputError, match=r"scenari: .*scenario.*max_range.*did you mean scenario\?"):
        (tasks[name].parallel_env if tasks[name].per_agent else tasks[name].env)(scenari="pursuit")
    with pytest.raises(InputError, match=r"num_flock: .*did you mean num_flocks\?"):
        tasks[name].vec_env(num_flock=2)
    assert tasks["one-range"].env(scenario="pursuit").scenario == tasks["pursuit"].scenario


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_the_file_changes_the_checksums_of_the_tasks_that_it_is_about(name: str) -> None:
    old, new, expected = CHANGES[name]
    text = files("flockesc_env.taskset").joinpath(f"{VERSION}.toml").read_text("utf-8")
    assert old in text
    changed = read_tasks(text.replace(old, new, 1))
    assert {task for task in tasks if changed[task].sha256 != tasks[task].sha256} == expected


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
    text = files("flockesc_env.taskset").joinpath(f"{VERSION}.toml").read_text("utf-8")
    with pytest.raises(InputError, match=message):
        read_tasks(text.replace(old, new, 1))


def test_the_tasks_are_frozen() -> None:
    """A change of a task is another version of the tasks, in another file."""
    content = files("flockesc_env.taskset").joinpath("v1.toml").read_bytes()
    assert hashlib.sha256(content).hexdigest() == (
        "4aa29b0548ab6edd950bfe8cde8317ecd845a83e66520fe18499d701a7e087b9"
    )


@pytest.mark.parametrize("file", FILES)
def test_a_result_verifies_and_its_folder_has_no_other_policies(file: str) -> None:
    result = read_result(ROOT / file)
    assert file == f"{folder_of(result.learner, tasks[result.task])}/{result.task}.json"
    if not result.is_code and result.learner != "random":  # its numbers depend on all flocks before
        verify(ROOT / file, flocks=draw_flocks(NUM_FLOCKS, 0))


def test_every_policy_file_has_a_result() -> None:
    for folder in (*(ROOT / BOARD).iterdir(), *(ROOT / ABLATIONS).iterdir()):
        results = [read_result(file) for file in folder.glob("*.json")]
        named = {policy.policy for result in results for policy in result.policies}
        assert {f"policies/{file.name}" for file in folder.rglob("*.npz")} <= named, folder


def test_the_report_and_the_readme_follow_from_the_results() -> None:
    entries = entries_of(board := load_board(ROOT / BOARD))
    assert set(entries) == set(tasks)
    assert (ROOT / "results/scoreboard/README.md").read_text() == report(board)
    assert tasks_table(rows_of(entries)) in (ROOT / "README.md").read_text()


def changed(task: Task, **options: Any) -> Task:
    return dataclasses.replace(task, options={**task.options, **options})


LOCAL, VISIBLE, ONE_RANGE = (tasks[name] for name in ("per-agent-local", "per-agent-visible", "one-range"))
PROFILE = changed(VISIBLE, profile_ranges=[0.0, 5.0, 10.0])
LINE = tasks["line"]
ZERO = policies.NetworkPolicy(policies.Architecture(("time",), ()), [0.0, 0.0])


def named(per_agent: bool = True, scenario: Any = None, **options: Any) -> policies.BasePolicy:
    policy = ZERO.with_options(per_agent=per_agent, scenario=scenario)
    policy.options = {"max_range": 20.0, "steps_per_action": 4, **options}  # unchecked
    return policy


@pytest.mark.parametrize(
    ("entry", "task", "field", "message"),
    [
        (named(predator_sensing_range=math.inf), LOCAL, "predator_sensing_range", "in the task, got inf"),
        (named(False), LOCAL, "per_agent", "False, because the policy needs one observation per flock"),
        (named(), ONE_RANGE, "per_agent", "True, because the policy needs one observation per agent"),
        (named(profile_ranges=(0, 5)), VISIBLE, "profile_ranges", "none, as in the task, got 0.0, 5.0"),
        (named(profile_ranges=(0, 5, 10, 15)), PROFILE, "profile_ranges", "got 0.0, 5.0, 10.0, 15.0"),
        (named(extra_entries=("escape_direction",)), VISIBLE, "extra_entries", "closest_approach, as in"),
        (named(False, extra_entries=("closest_approach",)), ONE_RANGE, "extra_entries", "none, as in"),
        (named(objective="min_min_distance"), VISIBLE, "objective", "'min_mean_distance', as in the task"),
        (named(scenario=LineScenario()), VISIBLE, "policy", "a policy for a flock"),
        (named(False, FlockScenario()), LINE, "policy", "a policy for a line"),
        (named(False, range_cost=1.0), LINE, "range_cost", "expected one of action_mode"),
        (named(max_rage=1.0), LOCAL, "max_rage", "did you mean max_range"),
        (named(max_range=40.5), LOCAL, "max_range", "at most 40, as in the task, got 40.5"),
        (named(steps_per_action=3), LOCAL, "steps_per_action", "at least 4, as in the task, got 3"),
    ],
)
def test_policies_that_see_more_do_not(entry: Any, task: Task, field: str, message: str) -> None:
    with pytest.raises(InputError, check=lambda error: error.field == field and message in str(error)):
        task.setup(entry)


def test_every_option_is_checked_or_free() -> None:
    """A new option must be listed here, in ``FREE`` or in a refusal above."""
    seen = {"objective", "predator_sensing_range", "profile_ranges", "extra_entries"}
    known = {field.name for options in (EnvOptions, LineOptions) for field in dataclasses.fields(options)}
    assert known == seen | {"max_range", "steps_per_action", *FREE}


def test_untrained_rules_and_random_ranges_play_with_the_ranges_and_the_rate_of_the_task() -> None:
    bounds = {"max_range": 40.0, "steps_per_action": 4}
    for each in ("listen-while-threatened", "random", policies.StubbornLeaders(interaction_range=99.0)):
        entry = LOCAL.setup(each)
        assert {name: getattr(entry.options, name) for name in bounds} == bounds
        ranges = simulate(FlockScenario(num_steps=8), policy=each, seed=0, **LOCAL.options).interaction_ranges
        assert ranges.max() <= 40.0
        assert (ranges[0] == ranges[3]).all()
    assert LOCAL.setup(policies.FixedRange(150.0)).options.max_range == 150.0
    trained = load_policy("stubborn-witnesses").with_options(scenario=FlockScenario())
    with pytest.raises(InputError, match="max_range: expected at most 40, as in the task, got 100"):
        LOCAL.setup(trained)


class Own(policies.StubbornLeaders):
    """Code of a user."""


def test_only_classes_of_the_package_are_checkable() -> None:
    assert all(is_checkable(load_policy(name.replace("RHO", "1"))) for name in policies.NAMES)
    assert is_checkable(policies.ScheduledRange([1.0]))
    assert is_checkable(policies.RandomRange(0))
    assert not is_checkable(Own())
