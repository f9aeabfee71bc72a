"""The headline policy of each task: the best trained one on tuning flocks, which the study explains."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Final

from flockesc_env.common.files import write_text
from flockesc_env.episodes.splits import TUNING
from flockesc_env.policies import BasePolicy
from flockesc_env.taskset import Task, tasks
from flockesc_env.taskset.results import is_file
from studies.measurements import Runner, play_jobs, policy_of, share_of
from studies.scoreboard.board import BOARD, load_board
from studies.study import document

HEADLINES: Final = "headlines.json"
TUNING_FLOCKS: Final = 200

EXPLAINED: Final = (
    "one-range",
    "one-range-minimum",
    "per-agent-visible",
    "per-agent-visible-derived",
    "per-agent-visible-minimum",
    "per-agent-local",
    "per-agent-visible-profile",
    "pursuit",
)
"""Tasks whose headline policies the study explains."""


@dataclass(frozen=True)
class Headline:
    """A task and the file of its headline policy."""

    task: Task
    file: Path

    @property
    def name(self) -> str:
        """The learner and its training seed, such as ``search-1``."""
        return f"{self.file.parts[-3]}-{self.file.stem.rpartition('-')[2]}"

    @cached_property
    def content(self) -> bytes:
        """The bytes of the file."""
        return self.file.read_bytes()

    @property
    def entry(self) -> BasePolicy:
        """The policy."""
        return policy_of(self.content)

    @property
    def max_range(self) -> float:
        """The largest range in m that the policy can set."""
        return float((self.entry.options or {})["max_range"])


def candidates(task: str) -> dict[str, list[str]]:
    """Return the policy files of the trained learners of a task, relative to the scoreboard, by learner."""
    found = {}
    for entrant in load_board():
        result = entrant.results.get(task)
        policies = result.policies if result and result.training else ()
        files = [f"{entrant.name}/{one.policy}" for one in policies if is_file(one.policy)]
        if files:
            found[entrant.name] = files
    return found


def measure(names: Iterable[str], scale: float, runner: Runner, output: Path) -> list[Headline]:
    """Choose the headline policies of tasks on tuning flocks, and write their files' names.

    The best learner has the largest mean objective over its training seeds. Its best training seed follows.
    """
    flocks = share_of(TUNING, TUNING_FLOCKS, scale)
    files_of = {name: candidates(name) for name in names}
    jobs = {}
    for name, by_learner in files_of.items():
        task = tasks[name]
        for file in chain.from_iterable(by_learner.values()):
            jobs[name, file] = play_jobs((BOARD / file).read_bytes(), task.scenario, task.spec.name, flocks)
    played = runner.run(jobs, "Headline policies")
    reached = {key: float(found["objective"].mean()) for key, found in played.items()}
    chosen = {}
    for name, by_learner in files_of.items():
        means = {file: reached[name, file] for file in chain.from_iterable(by_learner.values())}
        best = max(by_learner.values(), key=lambda files: sum(means[file] for file in files) / len(files))
        chosen[name] = max(best, key=means.__getitem__)
    write_text(output / HEADLINES, document(chosen))
    return load(output)


def load(output: Path) -> list[Headline]:
    """Read the headline policies."""
    chosen = json.loads((output / HEADLINES).read_text("utf-8"))
    return [Headline(tasks[name], BOARD / file) for name, file in chosen.items()]
