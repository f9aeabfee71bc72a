"""Submissions of this project: the policies of its studies, its rules, and the trained baselines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import polars as pl

from flockesc_env import ArgumentError
from flockesc_env.cli.output import note
from flockesc_env.common.files import atomic_write
from flockesc_env.jobs import Arrays
from flockesc_env.tasks.results import Result, Training, read_result, write_result
from flockesc_env.tasks.scoring import LoadedPolicy, score
from flockesc_env.tasks.task import Task, tasks
from studies.findings.results import Study, load_studies
from studies.scoreboard.baselines import Run, hyperparameters_of, versions_of

SUBMISSIONS: Final = Path("scoreboard")
CARD: Final = "card.toml"
Kind = Literal["rule", "search", "imitation", "reinforcement learning"]

SETTINGS: Final[Mapping[str, str]] = {
    "shared": "shared",
    "per-agent-visible": "per-agent-visible",
    "per-agent-local": "per-agent-local",
    "per-agent-visible-profile": "per-agent-visible-profile",
    "steering-predator": "steering-predator",
    "line": "line",
    "held-out-worlds": "per-agent-visible",
    "held-out-sizes": "per-agent-visible",
    "warned-nearest": "per-agent-local-minimum",
}
"""Setting of the study of learned ranges whose policies fit each task."""

STUDIED: Final[Mapping[str, str]] = {
    "search": "study-search",
    "rule": "study-searched-rule",
    "imitation": "study-imitation",
    "ppo": "study-ppo",
    "tqc": "study-tqc",
}
"""Learners of the study, and the names of their submissions."""


RULES: Final[Mapping[str, tuple[str, ...]]] = {
    "per-agent-visible": ("win-stay-lose-shift",),
    "per-agent-local": ("listen-while-threatened",),
    "per-agent-visible-profile": ("head-away",),
    "warned-agents": ("listen-while-threatened",),
    "warned-nearest": ("stubborn-witnesses",),
}
"""Further built-in rules of single tasks."""


TRANSFERRED: Final = ("sb3-ppo", "per-agent-visible")
"""Baseline that is also scored in the held-out worlds and sizes; others would take a minute per policy."""


class Card(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person says about a submission: the file ``card.toml`` in its folder.

    Attributes:
        kind: ``"rule"`` (nobody trained it), ``"search"``, ``"imitation"`` or ``"reinforcement learning"``.
        summary: one or two sentences.
        authors: names.
        code: where the code is; a link or a command.
        license: license of the policy files.
    """

    kind: Kind
    summary: str
    authors: str
    code: str
    license: str


@dataclass(frozen=True)
class Submission:
    """A folder of ``scoreboard`` with its card and results."""

    name: str
    card: Card
    results: Mapping[str, Result]


def load_submissions(folder: Path = SUBMISSIONS) -> list[Submission]:
    """Read all submissions; results are checked, but not played again.

    Raises:
        RecordError: if a result is damaged.
        ArgumentError: if a card is.
    """
    found = []
    for path in sorted(folder.iterdir()):
        card = path / CARD
        try:
            read = msgspec.toml.decode(card.read_bytes(), type=Card)
        except (FileNotFoundError, msgspec.DecodeError) as error:
            raise ArgumentError(str(card), "kind, summary, authors, code and license", error) from None
        results = {file.stem: read_result(file) for file in sorted(path.glob("*.json"))}
        found.append(Submission(path.name, read, results))
    return found


def write_own(trained: Mapping[Run, Arrays], folder: Path = SUBMISSIONS) -> None:
    """Score everything of this project that has no result yet, and write the results."""
    for name, task, found, training in (*_rules(), *_studied(folder), *_trained(trained, folder)):
        output = folder / name / f"{task.name}.json"
        if output.is_file() and read_result(output).training == training:
            continue
        note(f"{output}: {len(found)} policies")
        output.parent.mkdir(parents=True, exist_ok=True)
        result = score([*map(LoadedPolicy.of, found)], task, learner=name, output=output, training=training)
        write_result(result, output)


_Own = tuple[str, Task, list[str], Training | None]


def _rules() -> Iterator[_Own]:
    """Yield the known shortcut of every task, random ranges, and ``RULES``."""
    for task in tasks().values():
        for rule in dict.fromkeys((task.shortcuts[0].policy, "random", *RULES.get(task.name, ()))):
            yield rule, task, [rule], None


def _studied(folder: Path) -> Iterator[_Own]:
    """Yield the learners of the study of learned ranges; copy their policy files."""
    studies = {study.setting: study for study in load_studies(Path("results/findings"))}
    for name, setting in SETTINGS.items():
        study = studies[setting]
        for learner, title in STUDIED.items():
            if learner not in study.learners:
                continue
            runs = study.runs.filter(learner=learner).sort("training_seed")
            seeds = _distinct(study, learner, runs["training_seed"].to_list(), tasks()[name])
            runs = runs.filter(pl.col("training_seed").is_in(seeds))
            policies = {f"{setting}-{seed}": study.file(learner, seed).read_bytes() for seed in seeds}
            yield (
                title,
                tasks()[name],
                _write_policies(folder / title, policies),
                Training(
                    seeds=seeds,
                    samples=int(runs["samples"].max()),  # type: ignore[arg-type]
                    cpu_minutes=[round(minutes, 2) for minutes in runs["minutes"]],
                    versions=study.versions,
                    hyperparameters=study.learners[learner].arguments,
                ),
            )


def _distinct(study: Study, learner: str, seeds: list[int], task: Task) -> list[int]:
    """Return the training seeds without those that end with the policy of an earlier one.

    Several searches of a rule keep the hand-written one, from which they start.
    """
    found: dict[int, Any] = {}
    for seed in seeds:
        content = LoadedPolicy.of(str(study.file(learner, seed))).content(task)
        if content not in found.values():
            found[seed] = content
    return [*found]


def _trained(trained: Mapping[Run, Arrays], folder: Path) -> Iterator[_Own]:
    """Yield the trained baselines; write their policy files."""
    groups: dict[tuple[str, str], dict[int, Arrays]] = {}
    for run, found in trained.items():
        groups.setdefault((run.learner, run.task), {})[run.seed] = found
    for (learner, name), runs in groups.items():
        policies = {f"{name}-{seed}": found["policy"].tobytes() for seed, found in runs.items()}
        files = _write_policies(folder / learner, policies)
        training = Training(
            seeds=list(runs),
            samples=max(int(found["samples"]) for found in runs.values()),
            cpu_minutes=[round(float(found["cpu_seconds"]) / 60, 2) for found in runs.values()],
            versions=versions_of(learner),
            hyperparameters=hyperparameters_of(learner, tasks()[name]),
        )
        yield learner, tasks()[name], files, training
        if (learner, name) == TRANSFERRED:
            for held_out in ("held-out-worlds", "held-out-sizes"):
                yield learner, tasks()[held_out], files, training


def _write_policies(submission: Path, policies: Mapping[str, bytes]) -> list[str]:
    """Write policy files below the folder of a submission, and return their paths."""
    files = [submission / "policies" / f"{name}.npz" for name in policies]
    files[0].parent.mkdir(parents=True, exist_ok=True)
    for file, content in zip(files, policies.values(), strict=True):
        with atomic_write(file) as opened:
            opened.write(content)
    return [*map(str, files)]
