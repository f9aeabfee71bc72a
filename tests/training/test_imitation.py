"""Imitation of values: values equal single episodes, and the network sets the better candidate."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_runs import SMALL, small_run
from training.config import ImitationArgs
from training.evaluation import policy_spec
from training.policies import named_policy

from flockesc_env import FlockEscapeEnv
from training.branches import Branches
from training.imitation import fit


def imitation_args(folder: Path, **changes: Any) -> ImitationArgs:
    args = small_run(folder / "run", "imitation", **changes)
    assert isinstance(args, ImitationArgs)
    return args


def _agreement(args: ImitationArgs, names: Sequence[str], ranges: Sequence[float]) -> float:
    """Return how often a network takes the range whose entry is largest, on unseen flocks."""
    spec = policy_spec(args)
    rng = np.random.default_rng(0)
    shape = (400, len(spec.layout.names))
    known, unseen = (0.5 + 0.1 * rng.normal(size=shape).astype(np.float32) for _ in range(2))
    columns = [spec.layout.index(name) for name in names]
    values = 70 + 5 * known[:, columns] + 100 * rng.normal(size=(400, 1))
    values[np.arange(400), rng.integers(len(columns), size=400)] = np.nan
    network = fit(args, spec, known, values, seed=0)
    np.testing.assert_array_equal(network.parameters, fit(args, spec, known, values, seed=0).parameters)
    chosen = spec.actions.to_ranges(network.act(unseen, spec), 400)
    best = np.array(ranges)[unseen[:, columns].argmax(axis=1)]
    return float(np.mean(np.isclose(chosen, best, atol=1e-4)))


@pytest.mark.parametrize("objective", ["mean", "minimum"])
def test_values_equal_single_episodes(
    tmp_path: Path, objective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each flock is played again in an environment of its own, up to where it was copied and to the end."""
    monkeypatch.setattr("training.branches.EXPLORATION", 0.0)
    args = imitation_args(tmp_path, objective=objective, branches=3)
    visitor, teacher = named_policy("turn-flock-from-predator").policy, named_policy(args.teacher).policy
    flocks = range(100, 104)
    branches = Branches(args)
    rng = np.random.default_rng(2)
    actions_before = set()
    for _ in range(6):
        seen, values, num_actions = branches.values(visitor, teacher, flocks, rng)
        taken = 0
        assert (np.isfinite(values).sum(axis=1) == 3).all()
        for flock, row, expected in zip(flocks, seen, values, strict=True):
            before = []
            for k in np.flatnonzero(np.isfinite(expected)):
                env = FlockEscapeEnv(SMALL, **args.env_options())
                spec = env.policy_spec
                observation, _ = env.reset(seed=flock)
                count, has_ended = 0, False
                while not np.array_equal(observation, row):
                    observation, *_ = env.step(visitor.act(observation[np.newaxis], spec)[0])
                    count += 1
                before.append(count)
                action = spec.actions.from_ranges(np.array(args.profile_ranges[k : k + 1]))[0]
                while not has_ended:
                    observation, *_, has_ended, info = env.step(action)
                    action = teacher.act(observation[np.newaxis], spec)[0]
                    taken += 1
                assert info["min_mean_distance" if objective == "mean" else "min_min_distance"] == expected[k]
            assert len(set(before)) == 1
            actions_before.add(before[0])
            taken += before[0]
        assert np.ptp(values[np.isfinite(values)]) > 0
        assert num_actions == taken
    assert len(actions_before) > 1


@pytest.mark.parametrize("hidden", [(), (8,)])
@pytest.mark.parametrize("has_profile", [True, False])
def test_the_network_sets_the_better_candidate(
    tmp_path: Path, has_profile: bool, hidden: tuple[int, ...]
) -> None:
    """The values are those of a candidate's entry plus what depends on the flock alone."""
    ranges, changes = (0.0, 5.0, 10.0), dict[str, Any]()
    names = [f"profile_{k}_heading_away" for k in range(len(ranges))]
    if not has_profile:
        names = ["polarization", "mean_distance", "heading_away"]
        changes = {"profile_ranges": (), "candidate_inputs": (), "ranges": ranges, "inputs": ("time", *names)}
    args = imitation_args(
        tmp_path, hidden=hidden, epochs=100, learning_rate=0.03, weight_decay=0.01, **changes
    )
    assert _agreement(args, names, ranges) > 0.9
