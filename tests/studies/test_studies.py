"""A whole study: its numbers, training flocks, cached files, continuation after a kill, and its page."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from tiny_studies import TINY, Spy, write_preset

from flockesc_env import built_in, load_policy, rollout, sweep
from studies.learned import explain
from studies.learned.held_out import FLOCK_GRID
from studies.learned.names import FREE_HEADINGS
from studies.learned.page import DETAILS, LEARNED
from studies.learned.results import BEST_FIXED, ORACLE, Study, load_study
from studies.learned.study import StudyArgs, study, study_explanations
from studies.learned.submit import submit
from training import seeds
from training.evaluation import objective
from training.outputs import save_checkpoint
from training.presets import presets
from training.record import RunRecord
from training.search import SearchRounds
from training.seeds import HELD_OUT, TRAINING, TUNING

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
        {seed for run in (0, 1) for seed in spy.training if seed in seeds.training_seeds(run, 0, 1_000_000)}
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


def test_the_page_shows_the_study(found: Study, folder: Path) -> None:
    page = folder / "page" / "results.md"
    LEARNED.write(folder / "results", page)
    text = page.with_name(DETAILS).read_text()
    for words in ("eight agents", "search", "an open-loop schedule", f"{values(found, ORACLE).mean():.2f}"):
        assert words in text
    pictures = ("learning_curves", "gains", "performance_profiles")
    for name in pictures:
        assert (folder / "results" / "figures" / f"{name}.png").stat().st_size > 5_000
        assert f"{name}.png" in text


def test_explanations_alone_are_those_of_the_study(found: Study, folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "results", tmp_path / "results")
    (tmp_path / "results" / "tiny" / "ablation.parquet").unlink()
    study_explanations(study_args(folder, output=tmp_path / "results"))
    assert contents(tmp_path / "results" / "tiny") == {
        str(tmp_path / "results" / Path(file).relative_to(folder / "results")): data
        for file, data in contents(folder / "results" / "tiny").items()
    }


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

    def count(rounds: SearchRounds) -> None:
        played.append(rounds.completed)
        round_(rounds)

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


def test_submissions_of_others_are_kept(found: Study, folder: Path, tmp_path: Path) -> None:
    results, page = tmp_path / "results", tmp_path / "page.md"
    args = study_args(folder, output=results)
    study(args)
    submit("tiny", "stubborn-leaders", "thumb", results, page)
    path = results / "tiny" / "episodes.parquet"
    before = pl.read_parquet(path)
    assert set(before["policy"]) == {*found.policies, "thumb"}

    stale = before.filter(policy="search").with_columns(policy=pl.lit("formerly"))
    partial = before.filter(policy="thumb").head(5).with_columns(policy=pl.lit("five flocks"))
    unreported = before.filter(policy="thumb").with_columns(policy=pl.lit("unreported"))
    pl.concat([before, stale, partial, unreported]).write_parquet(path)
    study(args)
    assert pl.read_parquet(path).equals(before)

    study(dataclasses.replace(args, held_out_flocks=10))  # flocks different from those of the submissions
    assert load_study(results / "tiny").policies == found.policies


def test_a_study_of_some_learners(found: Study, folder: Path, tmp_path: Path, spy: Spy) -> None:
    spy.forget()
    study(study_args(folder, output=tmp_path, learners=("schedule",)))
    alone = load_study(tmp_path / "tiny")
    assert spy.trained == []
    assert alone.trained == list(alone.learners) == ["schedule"]
    assert (alone.explained, alone.explained_seed) == ("schedule", 0)
    assert alone.command == "python -m studies learned tiny --learners schedule"
    np.testing.assert_array_equal(alone.values("schedule"), found.values("schedule"))


def test_the_record_holds_the_settings_of_learners(found: Study, folder: Path) -> None:
    document = json.loads((folder / "results" / "tiny" / "study.json").read_text())
    assert list(document["learners"]) == ["search", "schedule"]
    arguments = document["learners"]["search"]["arguments"]
    assert (arguments["generations"], arguments["memory"]) == (4, 1)
    assert not {"run", "seed", "progress"} & arguments.keys()
    assert document["learners"]["schedule"]["note"] == "an open-loop schedule"
    assert found.runs["episodes"].to_list() == [4 * 10, 4 * 10, 4 * 4]  # networks times flocks


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"setting": "nowhere"}, "setting: expected one of tiny, got 'nowhere'"),
        ({"learners": ("ppo",)}, "learners: expected any of search, schedule, unreported, got 'ppo'"),
        ({"held_out_flocks": 0}, "flocks: expected an integer from 1 to"),
        ({"tuning_flocks": 1_000_001}, "flocks: expected an integer from 1 to"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_written(
    changes: dict[str, Any], message: str, folder: Path, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=message):
        study(study_args(tmp_path, **changes))
    assert not list(tmp_path.iterdir())


def test_the_rule_of_thumb_uses_the_settings_observations(folder: Path) -> None:
    setting = presets()["tiny"].setting
    for visible, name in ((True, "stubborn-leaders"), (False, "stubborn-leaders-local")):
        entry = built_in(name)
        played = objective(
            dataclasses.replace(setting, predator_visible=visible, max_range=100.0, steps_per_action=1),
            entry.policy,
            HELD_OUT[:5],
        )
        alone = rollout(TINY, entry.policy, HELD_OUT[:5], per_agent=True, **entry.options)
        np.testing.assert_array_equal(played, alone.min_mean_distance)


def test_finished_runs_with_other_arguments_are_refused(found: Study, folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "runs", tmp_path / "runs")
    record = tmp_path / "runs" / "tiny" / "search-1" / "config.json"
    document = json.loads(record.read_text())
    document["args"]["generations"] = 5
    record.write_text(json.dumps(document))
    with pytest.raises(ValueError, match=r"runs: expected the preset's arguments in .*search-1, got others"):
        study(study_args(tmp_path))
    assert not (tmp_path / "results").exists()


def test_rules_run_on_the_tuning_flocks_of_learning_curves(found: Study) -> None:
    assert found.rules is not None
    assert found.rules["rule"].unique().to_list() == ["stubborn-leaders"]
    assert found.rules["seed"].to_list() == list(TUNING[:200])
    told = rollout(TINY, built_in("stubborn-leaders"), TUNING[:200])
    assert found.rules["objective"].to_numpy() == pytest.approx(told.min_mean_distance)
