"""Where learning loses: outcomes of pairs, starts, policies that cannot run, training where they lose."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from tiny_studies import TINY, write_preset

from flockesc_env import built_in, load_policy, rollout, sweep
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import find_backend
from studies.findings import losses, retrained
from studies.findings.cells import LOSSES_FILE, read_cells
from studies.findings.held_out import FLOCK_GRID
from studies.findings.losses import measure_losses
from studies.findings.results import load_study
from studies.findings.study import StudyArgs, study
from studies.findings.summary import BEST_THERE, LEARNED
from studies.findings.transfer import refusal, worlds

OTHER = TINY.replace(num_agents=5)
FLOCKS = 6


def table(gains: dict[str, np.ndarray]) -> pl.DataFrame:
    """Return a table of a policy that reaches 50 m, and of fixed ranges of 8 m that reach less by a gain."""
    parts = [
        pl.DataFrame({"seed": range(len(values)), "objective": objective}).select(
            pl.lit(world).alias("world"),
            pl.lit(name).alias("policy"),
            pl.lit(8.0).alias("interaction_range"),
            pl.all(),
        )
        for world, values in gains.items()
        for name, objective in ((LEARNED, np.full(len(values), 50.0)), (BEST_THERE, 50.0 - values))
    ]
    return pl.concat(parts)


def test_a_policy_that_cannot_run_is_named_with_the_option() -> None:
    profile, plain = built_in("turn-flock-away"), built_in("listen-while-fleeing")
    assert refusal(profile, worlds()["frozen-graph"]) == "profile_ranges"
    assert refusal(profile, worlds()["reynolds"]) == "profile_ranges"
    assert refusal(built_in("turn-away"), worlds()["reynolds"]) is None
    # Where agents count neighbors, a policy has to say how many an action of 1 is.
    refused = {name for name, world in worlds().items() if refusal(plain, world) is not None}
    assert refused == {"topological", "mutual"}
    told = replace(plain, options={**plain.options, "max_range": 100.0})
    assert all(refusal(told, world) is None for world in worlds().values())


@pytest.fixture
def measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a tiny setting that was measured and trained in one other world."""
    write_preset(tmp_path, monkeypatch)
    monkeypatch.setattr(losses, "worlds", lambda: {"home": TINY, "fewer": OTHER})
    monkeypatch.setattr(losses, "starts", lambda: {"start": OTHER})
    monkeypatch.setattr(losses, "STARTED", ("tiny",))
    monkeypatch.setattr(losses, "FLOCKS", FLOCKS)
    monkeypatch.setattr(losses, "chosen_pairs", lambda *_: [("tiny", "fewer")])
    results = tmp_path / "results"
    study(StudyArgs("tiny", results, tmp_path / "runs", ("search",), 12, 12, "serial"))
    for _ in range(2):  # the second time from the cache
        assert measure_losses(results, tmp_path / "runs", 1.0, find_backend("serial")).is_file()
    return results


def test_policies_are_compared_with_the_best_fixed_range_of_each_world(measured: Path) -> None:
    found = load_study(measured / "tiny")
    assert found.transfer is not None
    reached = {key: rows["objective"].to_numpy() for key, rows in found.transfer.group_by("world", "policy")}
    name = f"{found.explained}-{found.explained_seed}"
    entry, held_out = load_policy(measured / "tiny" / "policies" / f"{name}.npz"), HELD_OUT[:FLOCKS]
    assert set(reached) == {(world, who) for world in ("home", "fewer") for who in (LEARNED, BEST_THERE)}
    for world, scenario in (("home", TINY), ("fewer", OTHER)):
        learned = rollout(scenario, entry, held_out).min_mean_distance
        np.testing.assert_array_equal(reached[world, LEARNED], learned)
        tuned = sweep(scenario, FLOCK_GRID, TUNING[: 2 * FLOCKS]).min_mean_distance.mean(axis=1)
        best = float(FLOCK_GRID[int(tuned.argmax())])
        np.testing.assert_array_equal(
            reached[world, BEST_THERE], sweep(scenario, [best], held_out).min_mean_distance[0]
        )
        (cell,) = [
            cell for cell in read_cells(measured / LOSSES_FILE) if (cell.kind, cell.world) == ("world", world)
        ]
        assert cell.gain is not None
        assert (cell.best_fixed_range, cell.flocks) == (best, FLOCKS)
        assert cell.gain.mean == pytest.approx((learned - reached[world, BEST_THERE]).mean())


def test_a_policy_that_was_trained_there_is_replayed_from_its_file(measured: Path) -> None:
    (path,) = (measured / retrained.RETRAINED).glob("*.npz")
    assert path.name == "tiny-in-fewer.npz"
    episodes = pl.read_parquet(path.with_name(losses.EPISODES_FILE)).filter(policy=LEARNED)
    played = rollout(None, load_policy(path), HELD_OUT[:FLOCKS])
    np.testing.assert_array_equal(episodes["objective"].to_numpy(), played.min_mean_distance)
    alone = rollout(OTHER, load_policy(path), HELD_OUT[:FLOCKS])
    np.testing.assert_array_equal(alone.min_mean_distance, played.min_mean_distance)
    kinds = [cell.kind for cell in read_cells(measured / LOSSES_FILE)]
    assert kinds == ["start", "over the longest", "over none", "world", "world", "trained there"]
