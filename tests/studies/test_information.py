"""The value of candidate ranges: the table and the figure."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from flockesc_env import rollout
from flockesc_env.jobs import Cache, find_backend
from studies.learned.information import SENSING, draw_information, measure_information, objective
from studies.measurements import Runner
from training.seeds import HELD_OUT


def test_every_number_of_candidates_plays_the_same_flocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studies.learned.information._COUNTS", (0, 1, 4))
    file = measure_information(tmp_path, 2, Runner(Cache(tmp_path / "cache"), find_backend("serial")))
    table = pl.read_parquet(file)
    assert table.group_by("sensing", "candidates").len()["len"].to_list() == [2] * len(SENSING) * 3
    fixed = rollout(None, "fixed:12", HELD_OUT[:2]).min_mean_distance
    assert table.filter(candidates=0)["objective"].to_list() == fixed.tolist() * len(SENSING)
    seen = table.filter(candidates=4, sensing="any distance")["objective"].to_numpy()
    assert (seen > fixed).all()
    assert seen.tolist() == objective("any distance", 4, HELD_OUT[:2])["objective"].tolist()
    (axes,) = draw_information(file).axes
    lines = {tuple(line.get_ydata()) for line in axes.lines}
    assert len(lines) == len(SENSING)
