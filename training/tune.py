"""Tuning of hyperparameters with Optuna: short training runs, evaluated on tuning flocks."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import optuna
from optuna.storages import JournalStorage, RDBStorage
from optuna.storages.journal import JournalFileBackend

from flockesc_env.benchmark import seeds
from flockesc_env.common.checks import as_choice
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Cache, Job, find_backend
from flockesc_env.jobs import run as run_all
from training.arguments import TuneArgs
from training.config import Args, ImitationArgs, PPOArgs, SearchArgs
from training.evaluation import objective
from training.policies import named_policy
from training.presets import train_presets
from training.runs import RUN_SECONDS, run

_NUMBER = "job"

_NAMES = {
    *("max_range", "steps_per_action", "hidden", "memory", "population", "step_size"),
    *("learning_rate", "weight_decay", "gamma", "n_epochs", "gae_lambda", "batch_size"),
}
"""Hyperparameters that are tuned, for all learners."""


def tune(args: TuneArgs) -> optuna.Study:
    """Start or continue the Optuna study of a preset, and return it; the first trial is the preset itself.

    Raises:
        ArgumentError: if the preset or the back end is unknown.
        JobError: if trials failed; a second call tries them again.
    """
    known = train_presets()
    as_choice(args.run, "run", known)
    backend = find_backend(args.backend)
    args.output.mkdir(parents=True, exist_ok=True)
    study = _study(args)
    jobs = [Job("training.tune:trial", (args, number), RUN_SECONDS) for number in range(args.trials)]
    run_all(jobs, Trials(args), backend, title=f"Trials of {args.run}")
    write_text(args.output / f"{args.run}.csv", study.trials_dataframe().to_csv(index=False))
    return study


def trial(args: TuneArgs, number: int) -> Arrays:
    """Run one trial of a study and return its number; the first trial is the preset itself."""
    preset = train_presets()[args.run]
    study = _study(args, number)
    if number == 0:
        study.enqueue_trial(_as_trial(preset))
    study.optimize(lambda trial: _value(trial, preset, args, number), n_trials=1)
    return {"number": np.array(number)}


class Trials(Cache):
    """An Optuna study as a cache: a job is finished if a completed trial has its number."""

    def __init__(self, args: TuneArgs) -> None:
        super().__init__(args.output)
        self.args = args

    def find(self, job: Job) -> Arrays | None:
        """Return the number of the trial."""
        number = job.arguments[1]
        done = any(trial.user_attrs.get(_NUMBER) == number for trial in completed(_study(self.args)))
        return {"number": np.array(number)} if done else None

    def put(self, job: Job, results: Arrays) -> None:
        """Do nothing: the worker has reported to the study."""


def completed(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    """Return the trials that have a value."""
    return study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.COMPLETE])


def _study(args: TuneArgs, number: int = 0) -> optuna.Study:
    """Open or create the study; the number of the job seeds the sampler."""
    return optuna.create_study(
        storage=(
            RDBStorage(args.storage, heartbeat_interval=60)
            if args.storage
            else JournalStorage(JournalFileBackend(str(args.output / f"{args.run}.journal")))
        ),
        sampler=optuna.samplers.TPESampler(seed=number),
        study_name=args.run,
        direction="maximize",
        load_if_exists=True,
    )


def _value(trial: optuna.Trial, preset: Args, args: TuneArgs, number: int) -> float:
    """Train with the hyperparameters of a trial and return the mean objective on tuning flocks."""
    trial.set_user_attr(_NUMBER, number)
    folder = args.runs / f"{args.run}-{trial.number}"
    length = max(round(args.share * getattr(preset, preset.budget)), 1)
    own = {preset.budget: length, "run": folder, "seed": seeds.TUNING_RUN, "progress": False}
    short = dataclasses.replace(preset, **suggest(trial, preset), **own)
    run(short)
    policy = named_policy(str(folder)).policy
    return float(objective(short, policy, seeds.first_seeds(seeds.TUNING, args.flocks)).mean())


def _as_trial(preset: Args) -> dict[str, Any]:
    """Return the hyperparameters of a preset in the form of a trial: one number each."""
    fields = dataclasses.asdict(preset)
    if "hidden" in fields:
        fields["hidden"] = sum(fields["hidden"][:1])  # 0 without a hidden layer
    return {name: fields[name] for name in _NAMES & fields.keys()}


def suggest(trial: optuna.Trial, preset: Args) -> dict[str, Any]:
    """Return hyperparameters from a trial; the values of the preset are always among the choices."""
    own = _as_trial(preset)

    def one_of(name: str, *choices: float) -> Any:
        return trial.suggest_categorical(name, sorted({*choices, own[name]}))

    def between(name: str, low: float, high: float) -> float:
        return trial.suggest_float(name, low, high, log=True)

    # These choices are for flocks; on the line ranges are below 1 and episodes last a few steps. Candidate
    # ranges go up to the preset's largest range.
    found: dict[str, Any] = {}
    if not preset.is_line:
        largest = () if preset.profile_ranges else (10.0, 15.0, 20.0, 30.0, 40.0)
        found["max_range"] = one_of("max_range", *largest)
        found["steps_per_action"] = one_of("steps_per_action", 2, 3, 4, 6)
    if isinstance(preset, SearchArgs):
        width = one_of("hidden", 4, 8, 16)
        found["hidden"] = (width,) if width else ()
        found["memory"] = one_of("memory", 0, *(() if preset.candidate_inputs else (2,)))
        found["population"] = one_of("population", 12, 16, 24, 32)
        found["step_size"] = between("step_size", min(0.2, preset.step_size), 1.0)
    elif isinstance(preset, ImitationArgs):
        found["learning_rate"] = between("learning_rate", 1e-3, 3e-2)
        found["weight_decay"] = between("weight_decay", 0.01, 1.0)
    else:
        found["learning_rate"] = between("learning_rate", 1e-4, 1e-2)
        found["gamma"] = one_of("gamma", 0.8, 0.9, 0.95, 0.98)
    if isinstance(preset, PPOArgs):
        found["n_epochs"] = one_of("n_epochs", 3, 5, 10)
        found["gae_lambda"] = one_of("gae_lambda", 0.8, 0.9, 0.95, 1.0)
        found["batch_size"] = one_of("batch_size", 2000, 8000, 24000)
    return found
