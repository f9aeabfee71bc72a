"""Add what a studied setting lacks and keep what it has: learners, rules, rules on tuning flocks."""

from __future__ import annotations

import dataclasses
import json
import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path

import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Backend, Cache, find_backend, run
from studies.learned.held_out import play_job, policy_rows, rules_of
from studies.learned.results import BEST_FIXED, EPISODES_FILE, ORACLE, STUDY_FILE, Study, load_study
from studies.learned.rules import write_rules
from studies.learned.study import (
    StudyArgs,
    TrainingRun,
    collect_runs,
    preset_of,
    study_explanations,
    train_all,
)
from training import seeds
from training.config import KINDS
from training.presets import Preset, presets
from training.record import POLICY_FILE


def extend_study(args: StudyArgs) -> Path:
    """Train and play the learners and rules that the results of a setting lack; return its folder.

    The rows that the results have stay as they are. All rules run on tuning flocks, too.

    Raises:
        ArgumentError: for an unknown setting or learner, or an argument out of bounds.
        RecordError: if the setting has no results.
        JobError: if jobs fail; finished runs stay.
    """
    preset, folder = preset_of(args), args.output / args.setting
    known, cache, backend = load_study(folder), Cache(args.runs / "fixed"), find_backend(args.backend)
    learners = {name: entry for name, entry in preset.learners.items() if name not in known.learners}
    runs = train_all(args, dataclasses.replace(preset, learners=learners), backend)
    _add_episodes(known, preset, runs, cache, backend, folder)
    if runs:
        collect_runs(runs, folder)
        for name in ("runs", "curves"):
            added = pl.read_parquet(folder / f"{name}.parquet")
            write_table(
                pl.concat([getattr(known, name), added], how="diagonal_relaxed"), folder / f"{name}.parquet"
            )
        _add_learners(args.setting, learners, folder)
    write_rules(rules_of(args.setting, preset.setting), preset.setting, cache, backend, folder)
    if known.explained and load_study(folder).best_learner != known.explained:
        study_explanations(args)
    return folder


def _add_episodes(
    known: Study, preset: Preset, runs: Sequence[TrainingRun], cache: Cache, backend: Backend, folder: Path
) -> None:
    """Play rules without rows and new policies on the held-out flocks, and add them in the usual order."""
    rules = rules_of(known.setting, preset.setting)
    policies: list[tuple[str, int | None, str | bytes]]
    policies = [(name, None, name) for name in rules if name not in known.policies]
    policies += [(name, seed, (run_folder / POLICY_FILE).read_bytes()) for name, seed, run_folder in runs]
    held_out = seeds.first_seeds(seeds.HELD_OUT, known.held_out_flocks)
    jobs = [play_job(policy, preset.setting, held_out) for _, _, policy in policies]
    results = run(jobs, cache, backend, title="Policies on held-out flocks")
    rows = [known.episodes]
    for (name, seed, _), result in zip(policies, results, strict=True):
        rows.append(policy_rows(name, seed, held_out, result["objective"]))
    made = pl.concat(rows)
    parts = made.partition_by("policy", as_dict=True, maintain_order=True)
    usual = [(name,) for name in (BEST_FIXED, ORACLE, *rules, *presets()[known.setting].learners)]
    order = dict.fromkeys([*(name for name in usual if name in parts), *parts])
    write_table(pl.concat(parts[name] for name in order), folder / EPISODES_FILE)


def _add_learners(setting: str, learners: Iterable[str], folder: Path) -> None:
    """Describe the added learners in the file of the study, with the command that repeats all of them."""
    given = presets()[setting].learners
    document = json.loads((folder / STUDY_FILE).read_text())
    document["learners"] |= {
        name: {
            "kind": KINDS[type(given[name].args)],
            "arguments": given[name].arguments(),
            "note": given[name].note,
        }
        for name in learners
    }
    reported = [name for name, learner in given.items() if learner.seeds]
    chosen = [name for name in reported if name in document["learners"]]
    some = [] if chosen == reported else ["--learners", *chosen]
    document["command"] = shlex.join(["python", "-m", "studies", "learned", setting, *some])
    write_text(folder / STUDY_FILE, json.dumps(document, indent=1) + "\n")
