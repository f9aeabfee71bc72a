"""Tuning of hyperparameters: a study starts with its preset, evaluates on tuning flocks, and can continue."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import polars as pl
import pytest
from tiny_studies import Spy, write_preset

from flockesc_env.benchmark.seeds import HELD_OUT, TRAINING, TUNING, TUNING_RUN, training_seeds
from training.arguments import TuneArgs
from training.config import SearchArgs
from training.evaluation import objective
from training.policies import named_policy
from training.presets import train_presets
from training.record import RunRecord
from training.tune import _as_trial, completed, suggest, tune


@pytest.fixture
def spy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Spy:
    write_preset(tmp_path, monkeypatch)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return Spy(monkeypatch)


def tune_args(folder: Path, **changes: Any) -> TuneArgs:
    few = {"run": "tiny-search", "trials": 2, "flocks": 5, "backend": "serial"}
    return TuneArgs(**{**few, "output": folder / "tuning", "runs": folder / "runs", **changes})


@pytest.mark.parametrize("name", train_presets())
def test_the_first_trial_is_the_preset(name: str) -> None:
    preset = train_presets()[name]
    trial = optuna.trial.FixedTrial(_as_trial(preset))
    assert dataclasses.replace(preset, **suggest(trial, preset)) == preset
    assert trial.params


def test_trials_are_evaluated_on_tuning_flocks_only(tmp_path: Path, spy: Spy) -> None:
    study = tune(tune_args(tmp_path))
    preset = train_presets()["tiny-search"]
    assert [trial.number for trial in completed(study)] == [0, 1]
    for trial in completed(study):
        run = tmp_path / "runs" / f"tiny-search-{trial.number}"
        args = RunRecord.read(run).args
        assert isinstance(args, SearchArgs)
        hyperparameters = suggest(optuna.trial.FixedTrial(trial.params), preset)
        expected = dataclasses.replace(
            preset, **hyperparameters, generations=2, run=run, seed=TUNING_RUN, progress=False
        )
        assert args == expected
        assert trial.value == objective(args, named_policy(str(run)).policy, TUNING[:5]).mean()
    assert study.trials[0].params.items() <= _as_trial(preset).items()
    assert study.trials[1].params != study.trials[0].params
    assert study.best_value == max(trial.value for trial in study.trials)

    assert spy.elsewhere == set(TUNING[:5])
    assert not spy.training & set(HELD_OUT)
    played = {seed for seed in spy.training if seed in TRAINING}
    assert played
    assert played <= set(training_seeds(TUNING_RUN, 0, 1_000))
    assert spy.training - played <= set(TUNING[:200])


def test_a_study_continues(tmp_path: Path, spy: Spy) -> None:
    first = [(trial.params, trial.value) for trial in tune(tune_args(tmp_path)).trials]
    spy.forget()
    again = tune(tune_args(tmp_path))
    assert [(trial.params, trial.value) for trial in again.trials] == first
    assert (spy.trained, spy.elsewhere) == ([], set())

    more = tune(tune_args(tmp_path, trials=3))
    assert len(spy.trained) == 1
    assert [(trial.params, trial.value) for trial in more.trials[:2]] == first
    table = pl.read_csv(tmp_path / "tuning" / "tiny-search.csv")
    np.testing.assert_allclose(table["value"].to_numpy(), [trial.value for trial in more.trials])
    assert sorted(file.name for file in (tmp_path / "runs").iterdir()) == [
        f"tiny-search-{number}" for number in range(3)
    ]
