"""Every task can be played, its scores are normalized, and its checksum covers what defines it."""

from __future__ import annotations

import hashlib
import math
from importlib.resources import files

import numpy as np
import polars as pl
import pytest
from scipy import stats
from training.config import Setting

from flockesc_env import ArgumentError, built_in, sweep
from flockesc_env.episodes.splits import HELD_OUT, TRAINING, TUNING, refuse_held_out
from flockesc_env.scenario.presets import PRESETS
from flockesc_env.tasks.fitting import fitted
from flockesc_env.tasks.scoring import play
from flockesc_env.tasks.task import VERSION, read_tasks, tasks
from studies.findings.held_out import choose_range
from studies.findings.names import CLAIRVOYANT

TASKS = tasks()
HELD_OUT_TASKS = {"held-out-worlds", "held-out-sizes"}


@pytest.mark.parametrize("name", TASKS)
def test_the_best_fixed_range_reaches_in_a_task_what_it_reaches_in_a_sweep(
    name: str,
) -> None:
    task, flocks = TASKS[name], TUNING[:2]
    for at, world in task.scales.items():
        best = world.best_fixed_range
        entry = fitted(built_in(f"fixed:{best}"), task)
        expected = sweep(task.scenarios[at], [best], flocks).values(task.spec.name)[0]
        np.testing.assert_array_equal(play(entry, task, at, flocks), expected)


@pytest.mark.parametrize("name", TASKS)
def test_policies_are_trained_in_the_world_that_scores_them_except_in_held_out_tasks(name: str) -> None:
    task = TASKS[name]
    assert (task.scenario not in task.scenarios.values()) == (name in HELD_OUT_TASKS)
    assert len(task.scenarios) == 1 + (name in HELD_OUT_TASKS)


@pytest.mark.parametrize("name", TASKS)
def test_the_scores_of_the_best_fixed_range_and_of_the_reference_are_0_and_1(name: str) -> None:
    task = TASKS[name]
    for score in (0, 1, -0.25):
        objectives = {at: world.zero + score * (world.one - world.zero) for at, world in task.scales.items()}
        assert task.score(objectives) == pytest.approx(score, abs=1e-12)
    assert all(world.zero < world.one for world in task.scales.values())


def test_the_reference_and_the_best_fixed_range_play_the_same_flocks() -> None:
    """``shared`` has a reference of 200 flocks, on which the best fixed range is 0.58 m worse than on all."""
    task = TASKS["shared"]
    world = task.scales["paper-flock"]
    known = pl.read_parquet("results/findings/shared/references.parquet").filter(reference=CLAIRVOYANT)
    fixed = fitted(built_in(f"fixed:{world.best_fixed_range}"), task)
    gain = known["objective"].to_numpy() - play(fixed, task, "paper-flock", known["seed"].to_list())
    assert world.one - world.zero == pytest.approx(gain.mean(), rel=1e-12)
    t = stats.t.ppf(0.975, len(gain) - 1)
    assert world.one_error == pytest.approx(t * stats.sem(gain) * math.sqrt(1 - len(gain) / 1000), rel=1e-12)
    assert {name for name, one in TASKS.items() if any(w.one_error for w in one.worlds.values())} == {
        *("shared", "warned-flock")
    }


@pytest.mark.parametrize("name", TASKS)
def test_a_world_with_the_name_of_a_preset_is_that_preset(name: str) -> None:
    for world, scenario in TASKS[name].scenarios.items():
        assert world not in PRESETS or PRESETS[world].scenario == scenario


@pytest.mark.parametrize("name", TASKS)
def test_a_simple_policy_shows_what_is_no_progress(name: str) -> None:
    task = TASKS[name]
    assert task.shortcuts
    for shortcut in task.shortcuts:
        fitted(built_in(shortcut.policy), task)
        assert shortcut.score < 1


def test_tasks_about_warnings_have_controls_in_which_the_gain_needs_the_escape_force() -> None:
    assert {name for name in TASKS if TASKS[name].controls} == {name for name in TASKS if "warned" in name}
    for task in TASKS.values():
        for control in task.controls:
            _, low, _ = control.gain
            _, _, high = control.gain_without_force
            assert low > high, (task.name, control)
        assert not task.controls or any(control.gain[1] > 0 for control in task.controls), task.name


CHANGES = {
    "size": ("num_agents = 1000\n", "num_agents = 999\n", {"held-out-sizes"}),
    "second predator": ("130.0,\n", "131.0,\n", {"held-out-worlds"}),
    "option": ("max_range = 60.0\n", "max_range = 50.0\n", {"warned-nearest"}),
    "sentence": ('asks = "One range for the flock: ', 'asks = "One range: ', {"shared"}),
    "version": (f'version = "{VERSION}"', 'version = "v2"', set(TASKS)),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_the_file_changes_the_checksums_of_the_tasks_that_it_is_about(name: str) -> None:
    old, new, expected = CHANGES[name]
    text = files("flockesc_env.tasks").joinpath(f"{VERSION}.toml").read_text("utf-8")
    assert old in text
    changed = read_tasks(text.replace(old, new, 1))
    assert {task for task in TASKS if changed[task].sha256 != TASKS[task].sha256} == expected


@pytest.mark.parametrize("seed", [HELD_OUT[0], HELD_OUT[-1]])
def test_nothing_is_chosen_on_held_out_flocks(seed: int) -> None:
    message = f"seeds: expected seeds outside of the held-out ones, 2000000 to 2999999, got {seed}"
    with pytest.raises(ArgumentError, match=message):
        refuse_held_out([TUNING[-1], seed])
    with pytest.raises(ArgumentError, match=message):
        choose_range(Setting(), range(seed, seed + 1), None)  # type: ignore[arg-type]  # plays nothing
    refuse_held_out([TUNING[-1], TRAINING[0]])


def test_the_tasks_are_frozen() -> None:
    """A change of a task is another version of the benchmark, in another file."""
    content = files("flockesc_env.tasks").joinpath("v1.toml").read_bytes()
    assert hashlib.sha256(content).hexdigest() == (
        "be117e0bf6050d4812c222496c6f599e886ad44bb375c4bc913f108ffcbe7cd0"
    )
