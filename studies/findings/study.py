"""One setting from the start: training runs, fixed ranges, held-out flocks, files for the page."""

from __future__ import annotations

import dataclasses
import json
import shlex
import shutil
from collections.abc import Sequence
from pathlib import Path

import polars as pl
from training.config import Args
from training.presets import Preset, presets
from training.record import CURVE_FILE, POLICY_FILE, RUN_FILE, RunRecord
from training.runs import RunFolders, run_job
from training.versions import versions

from flockesc_env import ArgumentError
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.episodes import splits
from flockesc_env.jobs import Backend, Cache, find_backend, run
from studies.findings.explain import write_explanations
from studies.findings.held_out import choose_range, play_all, rules_of, write_rules
from studies.findings.references import write_references
from studies.findings.results import POLICIES, STUDY_FILE, load_study
from studies.measurements import Runner
from studies.study import document, machine

TrainingRun = tuple[str, int, Path]
"""Learner, training seed and folder."""


@dataclasses.dataclass(frozen=True)
class StudyArgs:
    """Arguments of a study; the results of the setting go into a folder of its name.

    Without learners, all of the preset that have training seeds run. Finished training runs in ``runs`` are
    used, and unfinished ones continued.
    """

    setting: str
    output: Path = Path("results/findings")
    runs: Path = Path("runs/study")
    learners: tuple[str, ...] = ()
    held_out_flocks: int = 1000
    tuning_flocks: int = 1000
    backend: str = "processes"


def study(args: StudyArgs) -> Path:
    """Train, evaluate and write the files of one setting; return its folder."""
    preset, runner = _preset(args), _runner(args)
    held_out = splits.first_seeds(splits.HELD_OUT, args.held_out_flocks)
    tuning = splits.first_seeds(splits.TUNING, args.tuning_flocks)
    runs = _train(args, preset, runner.backend)
    folder = args.output / args.setting
    (folder / POLICIES).mkdir(parents=True, exist_ok=True)

    best = choose_range(preset.setting, tuning, runner)
    files = [(name, seed, (run_folder / POLICY_FILE).read_bytes()) for name, seed, run_folder in runs]
    play_all(args.setting, preset.setting, best, files, held_out, runner).write(folder)
    write_references(preset.setting, held_out, runner, folder)
    write_rules(rules_of(args.setting, preset.setting), preset.setting, runner, folder)
    _collect(runs, folder)
    _describe(args, preset, best, folder)
    if not preset.setting.is_line:
        study_explanations(args)
    return folder


def study_references(args: StudyArgs) -> Path:
    """Compute the references of one setting without training; return their file."""
    preset, held_out = _preset(args), splits.first_seeds(splits.HELD_OUT, args.held_out_flocks)
    path = write_references(preset.setting, held_out, _runner(args), args.output / args.setting)
    if path is None:
        raise ArgumentError("setting", "a setting with references", repr(args.setting))
    return path


def study_explanations(args: StudyArgs) -> Path:
    """Explain the headline policy of one setting that was studied, without training; return its folder."""
    preset, folder = _preset(args), args.output / args.setting
    if preset.setting.is_line:
        raise ArgumentError("setting", "a setting of a flock", repr(args.setting))
    write_explanations(load_study(folder), preset.setting, _runner(args))
    return folder


def _runner(args: StudyArgs) -> Runner:
    return Runner(Cache(args.runs / "fixed"), find_backend(args.backend))


def _preset(args: StudyArgs) -> Preset:
    """Return the preset of a setting with the learners that are asked for."""
    known = presets()
    if args.setting not in known:
        raise ArgumentError("setting", f"one of {', '.join(known)}", repr(args.setting))
    preset = known[args.setting]
    for name in args.learners:
        if name not in preset.learners:
            raise ArgumentError("learners", f"any of {', '.join(preset.learners)}", repr(name))
    reported = {
        name: learner
        for name, learner in preset.learners.items()
        if learner.seeds and (not args.learners or name in args.learners)
    }
    return dataclasses.replace(preset, learners=reported)


def _train(args: StudyArgs, preset: Preset, backend: Backend) -> list[TrainingRun]:
    """Do all training runs that are not finished; return learner, training seed and folder of each."""
    runs = [
        (name, seed, args.runs / args.setting / f"{name}-{seed}")
        for name, learner in preset.learners.items()
        for seed in range(learner.seeds)
    ]
    for training_run in runs:
        folder = training_run[2]
        if (folder / POLICY_FILE).is_file() and not _is_of(preset, training_run):
            raise ArgumentError("runs", f"the preset's arguments in {folder}", "others; remove it")
    jobs = [run_job(_args(preset, training_run)) for training_run in runs]
    run(jobs, RunFolders(args.runs), backend, title=f"Training runs of {args.setting}")
    return runs


def _is_of(preset: Preset, run: TrainingRun) -> bool:
    found = RunRecord.read(run[2]).args
    return dataclasses.replace(found, progress=True) == _args(preset, run)


def _args(preset: Preset, run: TrainingRun) -> Args:
    learner, seed, folder = run
    return dataclasses.replace(preset.learners[learner].args, run=folder, seed=seed)


def _collect(runs: Sequence[TrainingRun], folder: Path) -> None:
    """Copy the policies, and put what the runs measured into one file each."""
    outputs, curves = [], []
    for name, seed, source in runs:
        shutil.copy(source / POLICY_FILE, folder / POLICIES / f"{name}-{seed}.npz")
        origin = {"learner": name, "training_seed": seed}
        outputs.append({**origin, **json.loads((source / RUN_FILE).read_text("utf-8"))})
        labels = [pl.lit(label).alias(column) for column, label in origin.items()]
        curves.append(pl.read_parquet(source / CURVE_FILE).select(*labels, pl.all()))
    write_table(pl.DataFrame(outputs), folder / "runs.parquet")
    write_table(pl.concat(curves), folder / "curves.parquet")


def _describe(args: StudyArgs, preset: Preset, best: float, folder: Path) -> None:
    chosen = ["--learners", *args.learners] if args.learners else []
    fields = {
        "setting": args.setting,
        "title": preset.title,
        "command": shlex.join(["python", "-m", "studies", "findings", args.setting, *chosen]),
        "objective": preset.setting.objective,
        "is_line": preset.setting.is_line,
        "tuning_flocks": args.tuning_flocks,
        "held_out_flocks": args.held_out_flocks,
        "best_fixed_range": best,
        "learners": {
            name: {"kind": learner.args.kind, "arguments": learner.arguments(), "note": learner.note}
            for name, learner in preset.learners.items()
        },
        "versions": versions(),
        "machine": machine(),
    }
    write_text(folder / STUDY_FILE, document(fields))
