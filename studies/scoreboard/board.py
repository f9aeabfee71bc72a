"""The scoreboard: results of rules and learners on the tasks, in folders of the name of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from flockesc_env import InputError, tasks
from flockesc_env.cli.output import note
from flockesc_env.common.files import atomic_write
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.jobs import Arrays
from flockesc_env.policies import NAMES
from flockesc_env.policies.registry import TRAINED, parse_policy
from flockesc_env.taskset import (
    LoadedPolicy,
    Result,
    Task,
    Training,
    read_result,
    score,
    write_result,
)
from studies.scoreboard.trainings import TRANSFERRED, Key, hyperparameters_of, versions_of

BOARD: Final = Path("scoreboard")
ANY_RATE: Final = Path("results/scoreboard/any_rate.json")
"""What rules reach with their own options, by task and rule: the mean score."""

CHOOSING, CONTROLLING = first_seeds(TUNING, 200), TUNING[1000:2000]
"""Tuning flocks that choose the shortcuts, and those of the controls, on which nothing was chosen."""

SHIPPED: Final = ("search", "searched-rule", "schedule", "imitation", "ppo")
"""Learners with policies in the wheel, one of each kind."""


class Card(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person says about a learner: the file ``card.toml`` in its folder.

    Nobody trained a ``"rule"``. ``code`` is a link or a command. ``license`` is the license of the policy
    files.
    """

    kind: Literal["rule", "search", "imitation", "reinforcement learning"]
    summary: str
    authors: str
    code: str
    license: str


@dataclass(frozen=True)
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


def write_scores(trained: Mapping[Key, Arrays], folder: Path = BOARD) -> None:
    """Score all rules and training runs that have no result yet, and write policies and results."""
    for name, task, found, training in (*_rules(), *_trained(trained, folder)):
        output = folder / name / f"{task.name}.json"
        with suppress(InputError, FileNotFoundError):  # a result of an older task
            if read_result(output).training == training:
                continue
        note(f"{output}: {len(found)} policies")
        output.parent.mkdir(parents=True, exist_ok=True)
        result = score([*map(LoadedPolicy.of, found)], task, learner=name, output=output, training=training)
        write_result(result, output)


def ship(board: Sequence[Entrant]) -> None:
    """Copy the policies that the wheel ships: those of the first training seed of ``SHIPPED``."""
    for entrant in board:
        for task, result in entrant.results.items() if entrant.name in SHIPPED else ():
            file = TRAINED / task / f"{entrant.name}.npz"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes((BOARD / entrant.name / result.policies[0].policy).read_bytes())


_Scored = tuple[str, Task, list[str], Training | None]


def rules_of(task: Task) -> list[str]:
    """Return the names of the built-in rules that fit a task."""
    found = []
    for name in NAMES[2:]:  # without fixed and random ranges
        with suppress(InputError):
            task.setup(name)
            found.append(name)
    return found


def _rules() -> Iterator[_Scored]:
    """Yield the rules that fit every task, random ranges, and a shortcut that is a fixed range."""
    for task in tasks.values():
        for rule in dict.fromkeys((task.shortcut.policy, "random", *rules_of(task))):
            yield "fixed-range" if rule.startswith("fixed:") else rule, task, [rule], None


def _trained(trained: Mapping[Key, Arrays], folder: Path) -> Iterator[_Scored]:
    """Yield the learners; write their policy files. Runs that end with an equal policy count once.

    Several searches of a rule keep the hand-written one, from which they start.
    """
    groups: dict[tuple[str, str], dict[int, Arrays]] = {}
    for key, arrays in trained.items():
        groups.setdefault((key.learner, key.task), {})[key.seed] = arrays
    for (learner, name), runs in groups.items():
        first: dict[bytes, int] = {}  # seeds by the parameters, in which alone runs of a learner differ
        for seed, arrays in runs.items():
            policy: Any = parse_policy(arrays["policy"].tobytes(), Path(f"{name}-{seed}.npz"))
            first.setdefault(policy.parameters.tobytes(), seed)
        kept = {seed: runs[seed] for seed in first.values()}
        files = [folder / learner / "policies" / f"{name}-{seed}.npz" for seed in kept]
        files[0].parent.mkdir(parents=True, exist_ok=True)
        for file, arrays in zip(files, kept.values(), strict=True):
            with atomic_write(file) as opened:
                opened.write(arrays["policy"].tobytes())
        training = Training(
            seeds=list(kept),
            samples=max(int(arrays["samples"]) for arrays in kept.values()),
            episodes=max(int(arrays["episodes"]) for arrays in kept.values()),
            evaluations=max(int(arrays["evaluations"]) for arrays in kept.values()),
            cpu_minutes=[round(float(arrays["cpu_seconds"]) / 60, 2) for arrays in kept.values()],
            versions=dict(versions_of(learner)),
            hyperparameters=hyperparameters_of(learner, name),
        )
        on = (name, *TRANSFERRED) if name == "per-agent-visible" and learner in SHIPPED else (name,)
        for other in on:
            yield learner, tasks[other], [*map(str, files)], training
