"""The scoreboard: results of rules and learners on the tasks in folders of their names, and their scores."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import numpy as np
import polars as pl

from flockesc_env import InputError, tasks
from flockesc_env.cli.output import note
from flockesc_env.common.files import atomic_write
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.jobs import Arrays
from flockesc_env.policies.registry import TRAINED, parse_policy
from flockesc_env.taskset import LoadedPolicy, Result, Task, Training, read_result, score, write_result
from studies.scoreboard.statistics import means
from studies.scoreboard.trainings import TRANSFERRED, Key, hyperparameters_of, versions_of
from training.families import rules_of

BOARD: Final = Path("scoreboard")
ABLATIONS: Final = Path("results/scoreboard/ablations")
"""Folders of learners that change one choice of ``ppo``; they have no card and no row on the scoreboard."""

ABLATION: Final = "ablation: "  # start of the note of such a learner; the rest names the change

BEST_FIXED: Final = Path("results/scoreboard/best_fixed.parquet")
"""The objective of the best fixed range on every held-out flock, a column per ``column_of``."""

ANY_RATE: Final = Path("results/scoreboard/any_rate.json")
"""What rules reach with their own options, by task and rule: the mean score."""

CONSTANTS: Final = Path("results/scoreboard/constants.json")
"""What a finer grid of fixed ranges gains in every task, and what a warning is worth to a constant range."""

CHOOSING, CONTROLLING = first_seeds(TUNING, 50), TUNING[1000:2000]
"""Tuning flocks that choose a constant range without warnings, and those that measure it."""

SHIPPED: Final = ("rule", "gradient", "search", "searched-rule", "schedule", "imitation", "ppo")
"""Learners with policies in the wheel, one of each kind."""


class Card(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person says about a learner: the file ``card.toml`` in its folder.

    A person chose the numbers of a ``"rule"``. ``code`` is a link or a command. ``license`` is the license of
    the policy files.
    """

    kind: Literal["rule", "search", "gradient", "imitation", "reinforcement learning"]
    summary: str
    authors: str
    code: str
    license: str


@dataclass(frozen=True, eq=False)
class Entrant:
    """A folder of the scoreboard: a learner or rule with its card and its results by task."""

    name: str
    card: Card
    results: Mapping[str, Result]


def load_board(folder: Path = BOARD) -> list[Entrant]:
    """Read the scoreboard; results are checked, but not played again.

    Raises:
        InputError: if a result is damaged; if a card is.
    """
    found = []
    for path in sorted(folder.iterdir()):
        card = path / "card.toml"
        try:
            read = msgspec.toml.decode(card.read_bytes(), type=Card)
        except (FileNotFoundError, msgspec.DecodeError) as error:
            raise InputError(str(card), "kind, summary, authors, code and license", error) from None
        results = {file.stem: read_result(file) for file in sorted(path.glob("*.json"))}
        found.append(Entrant(path.name, read, results))
    return found


_Unscored = tuple[str, Task, list[str], Training | None]
"""A rule or learner, a task, the policies of its training seeds, and how they were trained."""


def folder_of(learner: str, task: Task) -> Path:
    """Return the folder of the results of a learner or rule."""
    found = task.learners.get(learner)
    is_ablation = found is not None and found.note.startswith(ABLATION)
    return (ABLATIONS if is_ablation else BOARD) / learner


def write_scores(trained: Mapping[Key, Arrays]) -> None:
    """Score all rules and training runs that have no result yet, and write policies and results."""
    for learner, task, policies, training in (*_rules(), *_trained(trained)):
        file = folder_of(learner, task) / f"{task.name}.json"
        with suppress(InputError, FileNotFoundError):  # a result of an older task
            if read_result(file).training == training:
                continue
        note(f"{file}: {len(policies)} policies")
        file.parent.mkdir(parents=True, exist_ok=True)
        loaded = [LoadedPolicy.of(policy) for policy in policies]
        write_result(score(loaded, task, learner=learner, output=file, training=training), file)


def ship(board: Sequence[Entrant]) -> None:
    """Copy the policies that the wheel ships: those of the first training seed of ``SHIPPED``."""
    for entrant in board:
        for task, result in entrant.results.items() if entrant.name in SHIPPED else ():
            file = TRAINED / task / f"{entrant.name}.npz"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes((BOARD / entrant.name / result.policies[0].policy).read_bytes())


def _rules() -> Iterator[_Unscored]:
    """Yield random ranges and the rules that fit every task, and the best fixed range of one scenario."""
    for task in tasks.values():
        for rule in ("random", *rules_of(task)):
            yield rule, task, [rule], None
        if len(task.scales) == 1:
            yield "fixed-range", task, [f"fixed:{task.best_fixed_range:g}"], None


def _trained(trained: Mapping[Key, Arrays]) -> Iterator[_Unscored]:
    """Yield the learners of finished training runs; write their policy files."""
    runs_of: dict[tuple[str, str], dict[int, Arrays]] = {}
    for key, arrays in trained.items():
        runs_of.setdefault((key.learner, key.task), {})[key.seed] = arrays
    for (learner, name), runs in runs_of.items():
        task, files = tasks[name], []
        runs = _distinct(runs)
        folder = folder_of(learner, task) / "policies"
        folder.mkdir(parents=True, exist_ok=True)
        for seed, run in runs.items():
            files.append(str(folder / f"{name}-{seed}.npz"))
            with atomic_write(Path(files[-1])) as opened:
                opened.write(run["policy"].tobytes())
        counts = ("samples", "episodes", "evaluations")
        training = Training(
            seeds=list(runs),
            **{count: max(int(run[count]) for run in runs.values()) for count in counts},
            cpu_minutes=[round(float(run["cpu_seconds"]) / 60, 2) for run in runs.values()],
            versions=dict(versions_of(learner)),
            hyperparameters=hyperparameters_of(learner, name),
        )
        yield learner, task, files, training
        if name == "per-agent-visible" and learner in SHIPPED:
            for other in TRANSFERRED:
                yield learner, tasks[other], files, training


def _distinct(runs: Mapping[int, Arrays]) -> dict[int, Arrays]:
    """Return the runs of a learner by seed; of those with equal parameters, the first one."""
    distinct: dict[bytes, int] = {}
    for seed, run in runs.items():
        policy: Any = parse_policy(run["policy"].tobytes(), Path(f"{seed}.npz"))
        distinct.setdefault(policy.parameters.tobytes(), seed)
    return {seed: runs[seed] for seed in distinct.values()}


def scores_of(result: Result) -> FloatArray:
    """Return the score of every policy on every flock, shape (policies, flocks); the mean over scenarios.

    The best fixed range has score 0 on each flock, so intervals are those of paired differences.
    """
    task = tasks[result.task]
    best_fixed = _best_fixed()[: result.flocks[1]]
    paired = {
        name: scale.zero + (result.values(name) - best_fixed[column_of(task, name)].to_numpy())
        for name, scale in task.scales.items()
    }
    scores: FloatArray = task.normalize(paired)
    return scores


def score_of(result: Result) -> Estimate:
    """Return the mean score; its interval covers training seeds, flocks and the error of score 1."""
    (score,) = means(scores_of(result)[np.newaxis])
    return with_reference_error(score, tasks[result.task])


def column_of(task: Task, scenario: str) -> str:
    """Return the column of ``BEST_FIXED`` for the objective of a task in a scenario."""
    return f"{scenario} {task.spec.name}"


@cache
def _best_fixed() -> pl.DataFrame:
    return pl.read_parquet(BEST_FIXED)


def with_reference_error(estimate: Estimate, task: Task) -> Estimate:
    """Return a score, or a difference of scores, with the error of score 1 in its interval.

    An error of ``one`` changes every score by the same factor. Half widths of independent errors add in
    quadrature.
    """
    error = estimate.mean * max(scale.one_error / (scale.one - scale.zero) for scale in task.scales.values())
    low, high = (math.hypot(end - estimate.mean, error) for end in (estimate.low, estimate.high))
    return Estimate(estimate.mean, estimate.mean - low, estimate.mean + high)
