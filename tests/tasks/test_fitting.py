"""Which policies fit which tasks: nobody sees more than the task shows."""

import dataclasses
import math
from typing import Any

import pytest

from flockesc_env import FlockScenario, InputError, LineScenario, load_policy, simulate
from flockesc_env.episodes.options import EnvOptions, LineOptions
from flockesc_env.policies import NAMES, BasePolicy, FixedRange, RandomRange, ScheduledRange, StubbornLeaders
from flockesc_env.policies.registry import as_policy
from flockesc_env.tasks import fitting
from flockesc_env.tasks.fitting import FREE, fitted, is_checkable
from flockesc_env.tasks.task import Task, tasks


def changed(task: Task, **options: Any) -> Task:
    return dataclasses.replace(task, options={**task.options, **options})


LOCAL, VISIBLE, ONE_RANGE = (tasks[name] for name in ("per-agent-local", "per-agent-visible", "one-range"))
PROFILE = changed(VISIBLE, profile_ranges=[0.0, 5.0, 10.0])
LINE = tasks["line"]
RHO = FixedRange(0.1)


def named(per_agent: bool = True, scenario: Any = None, **options: Any) -> BasePolicy:
    policy = RHO.with_options(per_agent=per_agent, scenario=scenario)
    policy.options = {"max_range": 20.0, "steps_per_action": 4, **options}  # unchecked
    return policy


@pytest.mark.parametrize(
    ("entry", "task", "field", "message"),
    [
        (named(predator_sensing_range=math.inf), LOCAL, "predator_sensing_range", "in the task, got inf"),
        (named(per_agent=False), LOCAL, "per_agent", "True, as in the task, got False"),
        (named(per_agent=True), ONE_RANGE, "per_agent", "False, as in the task, got True"),
        (named(profile_ranges=(0, 5)), VISIBLE, "profile_ranges", "none, as in the task, got 0.0, 5.0"),
        (named(profile_ranges=(0, 5, 10, 15)), PROFILE, "profile_ranges", "got 0.0, 5.0, 10.0, 15.0"),
        (named(extra_entries=("escape_direction",)), VISIBLE, "extra_entries", "closest_approach, as in"),
        (named(False, extra_entries=("closest_approach",)), ONE_RANGE, "extra_entries", "none, as in"),
        (named(objective="min_min_distance"), VISIBLE, "objective", "'min_mean_distance', as in the task"),
        (named(scenario=LineScenario()), VISIBLE, "scenario", "a FlockScenario, got LineScenario"),
        (named(False, FlockScenario()), LINE, "scenario", "a LineScenario, got FlockScenario"),
        (named(False, predator_sensing_range=math.inf), LINE, "options", "got predator_sensing_range"),
        (named(max_rage=1.0), LOCAL, "options", "got max_rage"),
        (named(max_range=40.5), LOCAL, "max_range", "at most 40, as in the task, got 40.5"),
        (named(steps_per_action=3), LOCAL, "steps_per_action", "at least 4, as in the task, got 3"),
    ],
)
def test_policies_that_see_more_do_not(entry: BasePolicy, task: Task, field: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        fitting.check_fits(entry, task)
    assert caught.value.field == field
    assert message in str(caught.value)


def test_every_option_is_checked_or_free() -> None:
    """A new option must be listed here, in ``FREE`` or in a refusal above."""
    seen = {"objective", "predator_sensing_range", "profile_ranges", "extra_entries"}
    known = {field.name for options in (EnvOptions, LineOptions) for field in dataclasses.fields(options)}
    assert known == seen | {"max_range", "steps_per_action", *FREE}


def test_untrained_rules_and_random_ranges_play_with_the_ranges_and_the_rate_of_the_task() -> None:
    bounds = {"max_range": 40.0, "steps_per_action": 4}
    for policy in ("listen-while-threatened", "random", StubbornLeaders(interaction_range=99.0)):
        entry = fitted(as_policy(policy), LOCAL)
        assert {name: (entry.options or {})[name] for name in bounds} == bounds
        ranges = simulate(FlockScenario(num_steps=8), policy=entry, seed=0).interaction_ranges
        assert ranges.max() <= 40.0
        assert (ranges[0] == ranges[3]).all()
    assert (fitted(FixedRange(150.0), LOCAL).options or {})["max_range"] == 150.0
    trained = load_policy("stubborn-witnesses").with_options(scenario=FlockScenario())
    with pytest.raises(InputError, match="max_range: expected at most 40, as in the task, got 100"):
        fitted(trained, LOCAL)


class Own(StubbornLeaders):
    """Code of a user."""


def test_only_classes_of_the_package_are_checkable() -> None:
    assert all(is_checkable(load_policy(name.replace("RHO", "1"))) for name in NAMES)
    assert is_checkable(ScheduledRange([1.0]))
    assert is_checkable(RandomRange(0))
    assert not is_checkable(Own())
