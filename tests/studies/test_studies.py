"""A whole study: its numbers, training flocks, cached files, continuation after a kill, and its page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from tiny_studies import TINY, Spy, write_preset
from training.outputs import save_checkpoint
from training.record import RunRecord

from flockesc_env import load_policy, rollout, sweep
from flockesc_env.episodes import splits
from flockesc_env.episodes.splits import HELD_OUT, TRAINING, TUNING
from studies.findings import explain
from studies.findings.held_out import FLOCK_GRID
from studies.findings.names import FREE_HEADINGS
from studies.findings.results import BEST_FIXED, ORACLE, Study, load_study
from studies.findings.study import StudyArgs, study
from training.search import SearchRounds

FLOCKS = 70  # more flocks than a rollout steps together


@pytest.fixture(scope="module")
def patch() -> Iterator[pytest.MonkeyPatch]:
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield monkeypatch


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, patch: pytest.MonkeyPatch) -> Path:
    path = tmp_path_factory.mktemp("study")
    write_preset(path, patch)
    return path


@pytest.fixture(scope="module")
def spy(patch: pytest.MonkeyPatch) -> Spy:
    return Spy(patch)


def study_args(folder: Path, **changes: Any) -> StudyArgs:
    few = {"held_out_flocks": FLOCKS, "tuning_flocks": 12, "backend": "serial"}
    return StudyArgs(
        **{"setting": "tiny", "output": folder / "results", "runs": folder / "runs", **few, **changes}
    )


@pytest.fixture(scope="module")
def found(folder: Path, spy: Spy) -> Study:
    """Return the study's results; tests that change its files use other folders."""
    study(study_args(folder))
    return load_study(folder / "results" / "tiny")


def values(found: Study, policy: str, seed: int | None = None) -> np.ndarray:
    rows = found.values(policy)
    return rows[0] if seed is None else rows[seed]


def policy(folder: Path, name: str) -> Any:
    return load_policy(folder / "results" / "tiny" / "policies" / f"{name}.npz")


def test_training_and_tuning_see_no_held_out_flock(found: Study, spy: Spy) -> None:
    assert found.held_out_flocks == FLOCKS
    assert len(spy.trained) == 3
    assert spy.training
    assert not spy.training & set(HELD_OUT)
    assert spy.training <= {*TUNING[:200]} | {seed for seed in spy.training if seed in TRAINING}
    assert spy.elsewhere & set(HELD_OUT) == set(HELD_OUT[:FLOCKS])
    assert spy.elsewhere <= {*TUNING[:200], *HELD_OUT[:FLOCKS]}
    assert len([seed for seed in spy.training if seed in TRAINING]) == len(
        {seed for run in (0, 1) for seed in spy.training if seed in splits.training_seeds(run, 0, 1_000_000)}
    )


def test_every_policy_plays_the_held_out_flocks(found: Study, folder: Path) -> None:
    grid = [float(rho) for rho in FLOCK_GRID]
    tuned, held_out = (sweep(TINY, grid, purpose) for purpose in (TUNING[:12], HELD_OUT[:FLOCKS]))
    best = grid[int(tuned.min_mean_distance.mean(axis=1).argmax())]
    assert found.best_fixed_range == best
    expected = held_out.min_mean_distance
    np.testing.assert_array_equal(values(found, BEST_FIXED), expected[grid.index(best)])
    np.testing.assert_array_equal(values(found, ORACLE), expected.max(axis=0))
    np.testing.assert_allclose(found.grid["mean"].to_numpy(), expected.mean(axis=1), rtol=1e-12)
    assert found.grid["interaction_range"].to_list() == grid

    assert found.policies == [BEST_FIXED, ORACLE, "stubborn-leaders", "search", "schedule"]
    assert found.trained == ["search", "schedule"]
    options: dict[str, Any] = {"per_agent": True, "steps_per_action": 4, "predator_sensing_range": None}
    for name, seed in (("search", 0), ("search", 1), ("schedule", 0)):
        entry = policy(folder, f"{name}-{seed}")
        alone = rollout(TINY, entry.policy, HELD_OUT[:FLOCKS], max_range=30.0, **options)
        np.testing.assert_array_equal(values(found, name, seed), alone.min_mean_distance)
    assert (values(found, "search", 0) != values(found, "search", 1)).any()


def test_no_policy_is_above_the_bound_of_free_headings(found: Study) -> None:
    bounds, fixed = found.reference(FREE_HEADINGS)
    np.testing.assert_array_equal(fixed, values(found, BEST_FIXED))
    for name in found.policies:
        assert (found.values(name) <= bounds).all(), name


def test_the_explained_run_is_the_best_on_tuning_flocks(found: Study) -> None:
    runs = found.curves.group_by("learner", "training_seed").agg(pl.col("objective").max())
    means = runs.group_by("learner").agg(pl.col("objective").mean()).sort("objective")
    best = runs.filter(learner=means["learner"][-1]).sort("objective")
    assert (found.explained, found.explained_seed) == best.row(-1)[:2]
    assert found.explained == "search"


def test_hiding_entries_that_a_policy_does_not_see_changes_nothing(found: Study) -> None:
    """Also hiding the time, which tells a network with memory that an episode starts."""
    assert found.ablation is not None
    hidden = {name: rows["objective"].to_numpy() for (name,), rows in found.ablation.group_by("removed")}
    plain = values(found, "search", found.explained_seed)
    assert set(hidden) < {"nothing", *explain.GROUPS}  # the setting has no extra entries
    unseen = {"nothing", "time", "running minimum", "last range", "heard velocity", "predator velocity"}
    assert set(hidden) > unseen
    for name, objectives in hidden.items():
        assert (objectives == plain).all() == (name in unseen), name


def contents(folder: Path) -> dict[str, bytes]:
    return {str(file): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def test_a_second_call_trains_and_sweeps_nothing(found: Study, folder: Path, spy: Spy) -> None:
    before = contents(folder / "results"), contents(folder / "runs")
    spy.forget()
    study(study_args(folder))
    assert (spy.trained, spy.jobs) == ([], [])
    assert (contents(folder / "results"), contents(folder / "runs")) == before


def test_a_killed_study_continues(
    found: Study, folder: Path, tmp_path: Path, spy: Spy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second training run is killed at its first checkpoint, and the study continues from there."""
    round_, played = SearchRounds.round, []

    def die(record: RunRecord, state: Any) -> None:
        save_checkpoint(record, state)
        if record.args.run.name == "search-1":
            raise RuntimeError("killed")

    def count(rounds: SearchRounds) -> float:
        played.append(rounds.completed)
        return round_(rounds)

    monkeypatch.setattr(SearchRounds, "round", count)
    with monkeypatch.context() as patch:
        patch.setattr("training.train.save_checkpoint", die)
        with pytest.raises(RuntimeError, match=r"(?s)1 of 3 jobs failed.*search-1.*killed"):
            study(study_args(tmp_path))
    assert not (tmp_path / "results").exists()
    assert played[:6] == [0, 1, 2, 3, 0, 1]
    finished = contents(tmp_path / "runs" / "tiny" / "search-0")
    played.clear()
    study(study_args(tmp_path))
    assert played[:2] == [2, 3]
    assert contents(tmp_path / "runs" / "tiny" / "search-0") == finished
    again = load_study(tmp_path / "results" / "tiny")
    for name in ("episodes", "grid", "ablation"):
        assert getattr(again, name).equals(getattr(found, name)), name
