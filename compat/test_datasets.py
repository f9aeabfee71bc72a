"""Data sets of episodes: mlcroissant accepts and reads the metadata, Minari reads its data sets back."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import minari
import mlcroissant
import numpy as np
import polars as pl
import pytest

from flockesc_env.benchmark.episodes import create_minari, record_episodes
from flockesc_env.benchmark.scoring import LoadedPolicy
from flockesc_env.benchmark.seeds import TRAINING
from flockesc_env.benchmark.tasks import task_of
from flockesc_env.common.errors import ArgumentError

# mlcroissant uses deprecated names of rdflib and pandas.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

POLICIES = ("random", "fixed:0.3")


def record(task: str, folder: Path) -> None:
    record_episodes([*map(LoadedPolicy.of, POLICIES)], task_of(task), TRAINING[:2], folder)


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))


@pytest.mark.parametrize("task", ["shared", "per-agent-local", "line"])
def test_mlcroissant_reads_every_record(task: str, tmp_path: Path) -> None:
    folder = tmp_path / "data"
    record(task, folder)
    command = [Path(sys.prefix, "bin", "mlcroissant"), "validate", "--jsonld", folder / "croissant.json"]
    validated = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert validated.returncode == 0
    assert "warning" not in validated.stderr.lower()
    data = mlcroissant.Dataset(jsonld=folder / "croissant.json")
    assert not data.metadata.ctx.issues.warnings
    tables = [record_set.name for record_set in data.metadata.record_sets]
    assert tables == ["random", "fixed-0-3", "episodes", "policies"]
    for table in tables:
        expected = pl.read_parquet(folder / f"{table}.parquet")
        records = list(data.records(table))
        assert len(records) == len(expected)
        for column in expected.columns:
            read = [plain(record[f"{table}/{column}"]) for record in records]
            assert read == expected[column].to_list()


def plain(value: object) -> object:
    """Return a value of mlcroissant, which reads strings as bytes, as polars returns it."""
    if isinstance(value, list):
        return [plain(each) for each in value]
    return value.decode() if isinstance(value, bytes) else np.asarray(value).item()


@pytest.mark.parametrize("task", ["shared", "line"])
def test_minari_reads_the_recorded_episodes_and_their_environment(task: str, tmp_path: Path) -> None:
    folder = tmp_path / "data"
    record(task, folder)
    ids = create_minari(task_of(task), folder)
    assert ids == [f"flockesc/{task}/{name}-v0" for name in ("random", "fixed-0-3")]
    for identifier, name in zip(ids, ("random", "fixed-0-3"), strict=True):
        data = minari.load_dataset(identifier)
        rows = pl.read_parquet(folder / f"{name}.parquet")
        env = data.recover_environment()
        assert (env.observation_space, env.action_space) == (data.observation_space, data.action_space)
        for seed, episode in zip(TRAINING[:2], data, strict=True):
            expected = rows.filter(seed=seed)
            np.testing.assert_array_equal(episode.observations[:-1], expected["observation"].to_numpy())
            np.testing.assert_array_equal(episode.actions[:, 0], expected["action"].to_numpy())
            observation, _ = env.reset(seed=seed)
            np.testing.assert_array_equal(episode.observations[0], observation)
            for step, action in enumerate(episode.actions):
                observation, *results, _ = env.step(action)
                ends = (episode.rewards[step], episode.terminations[step], episode.truncations[step])
                assert (*ends,) == (*results,)
                np.testing.assert_array_equal(episode.observations[step + 1], observation)
        env.close()
    with pytest.raises(ArgumentError, match="minari delete removes old ones"):
        create_minari(task_of(task), folder)
