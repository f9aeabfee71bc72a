"""Imitation of values: values equal single episodes, and the network sets the better candidate."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from small_runs import small_run, small_task

from flockesc_env import InputError, load_policy
from flockesc_env.tasks.learners import Learner
from training.branches import Branches
from training.imitation import ImitationArguments, ImitationRounds, fit

RANGES = (0.0, 5.0, 10.0)
NAMES = ["polarization", "mean_distance", "heading_away"]


@pytest.mark.parametrize("objective", ["min_mean_distance", "min_min_distance"])
def test_values_equal_single_episodes(
    tmp_path: Path, objective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each flock is played again in an environment of its own, up to where it was copied and to the end."""
    monkeypatch.setattr("training.branches.EXPLORATION", 0.0)
    run = small_run(tmp_path / "run", "imitation")
    task = small_task("one-range" if objective == "min_mean_distance" else "one-range-minimum")
    run = dataclasses.replace(run, task=task)
    visitor, teacher = load_policy("listen-while-fleeing"), load_policy("fixed:5")
    flocks = range(100, 104)
    branches = Branches(run, RANGES, 3)
    rng = np.random.default_rng(2)
    actions_before = set()
    for _ in range(6):
        seen, values, num_actions = branches.values(visitor, teacher, flocks, rng)
        taken = 0
        assert (np.isfinite(values).sum(axis=1) == 3).all()
        for flock, row, expected in zip(flocks, seen, values, strict=True):
            before = []
            for k in np.flatnonzero(np.isfinite(expected)):
                env = task.env()
                spec = env.policy_spec
                observation, _ = env.reset(seed=flock)
                count, has_ended = 0, False
                while not np.array_equal(observation, row):
                    observation, *_ = env.step(visitor.act(observation[np.newaxis], spec)[0])
                    count += 1
                before.append(count)
                action = spec.actions.from_ranges(np.array(RANGES[k : k + 1]))[0]
                while not has_ended:
                    observation, *_, has_ended, info = env.step(action)
                    action = teacher.act(observation[np.newaxis], spec)[0]
                    taken += 1
                assert info[task.spec.name] == expected[k]
            assert len(set(before)) == 1
            actions_before.add(before[0])
            taken += before[0]
        assert np.ptp(values[np.isfinite(values)]) > 0
        assert num_actions == taken
    assert len(actions_before) > 1


@pytest.mark.parametrize("hidden", [(), (8,)])
def test_the_network_sets_the_better_candidate(hidden: tuple[int, ...], tmp_path: Path) -> None:
    """The values are those of a candidate's entry plus what depends on the flock alone."""
    args = ImitationArguments(
        teacher="fixed:5",
        ranges=RANGES,
        inputs=("time", *NAMES),
        hidden=hidden,
        epochs=100,
        learning_rate=0.03,
        weight_decay=0.01,
    )
    spec = small_run(tmp_path / "run", "imitation").policy_spec
    rng = np.random.default_rng(0)
    shape = (400, len(spec.layout.names))
    known, unseen = (0.5 + 0.1 * rng.normal(size=shape).astype(np.float32) for _ in range(2))
    columns = [spec.layout.index(name) for name in NAMES]
    values = 70 + 5 * known[:, columns] + 100 * rng.normal(size=(400, 1))
    values[np.arange(400), rng.integers(len(columns), size=400)] = np.nan
    network = fit(args, spec, known, values, seed=0)
    np.testing.assert_array_equal(network.parameters, fit(args, spec, known, values, seed=0).parameters)
    chosen = spec.actions.to_ranges(network.act(unseen, spec), 400)
    best = np.array(RANGES)[unseen[:, columns].argmax(axis=1)]
    assert np.mean(np.isclose(chosen, best, atol=1e-4)) > 0.9


def test_imitation_refuses_what_it_cannot_learn(tmp_path: Path) -> None:
    run = dataclasses.replace(small_run(tmp_path / "run", "imitation"), task=small_task("per-agent-visible"))
    with pytest.raises(InputError, match="task: expected one range for a flock, got per-agent-visible"):
        Branches(run, RANGES, 3)
    with pytest.raises(InputError, match=r"imitation\.hyperparameters: .* missing required field `teacher`"):
        ImitationRounds(
            dataclasses.replace(
                run, learner=Learner(algorithm="imitation", hyperparameters={"ranges": [1.0]})
            )
        )
