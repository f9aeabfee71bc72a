"""``Task`` and ``tasks``: the frozen tasks, which ``v1.toml`` defines."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

import msgspec
import numpy as np

from flockesc_env.common.checks import as_choice, as_count
from flockesc_env.common.errors import InputError, errors_at
from flockesc_env.common.extras import require
from flockesc_env.common.progress import progress_bar
from flockesc_env.models.sweep import sweep
from flockesc_env.policies.registry import as_policy
from flockesc_env.policies.rollout import rollout
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import PRESETS
from flockesc_env.taskset import learners
from flockesc_env.taskset.definition import FLOCKS, VERSION, Control, Scale, Shortcut, TaskDefinition
from flockesc_env.taskset.fitting import fitted

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

    from flockesc_env.taskset.comparison import Comparison


class Task(TaskDefinition):
    """A task: its definition, the hyperparameters of its learners, and comparisons of policies."""

    def hyperparameters(self, learner: str) -> dict[str, Any]:
        """Return the arguments of the algorithm of a learner of stable-baselines3; see ``learners``.

        Example: ``PPO(env=task.vec_env(4), **task.hyperparameters("ppo"))``.

        Raises:
            InputError: if the task has no such learner, or it is none of stable-baselines3.
        """
        return learners.arguments(self, learner, learners.learner_of(self, learner))

    def vec_env(self, num_flocks: int = 1, *, learner: str | None = "ppo", **options: Any) -> VecEnv:
        """Return the environment for ``hyperparameters(learner)``; see ``TaskDefinition.vec_env``.

        Args:
            num_flocks: number of flocks, or of lines.
            learner: name of the learner, whose table may choose the reward and the action mode. ``None``:
                only the task decides.
            **options: options that replace those of the task and the learner.

        Raises:
            MissingExtraError: if stable-baselines3 is not installed.
            InputError: if the learner is unknown; if an option is unknown or out of bounds.
        """
        if learner is not None:
            options = {**learners.learner_of(self, learner).options, **options}
        return super().vec_env(num_flocks, **options)

    def compare(
        self,
        *policies: Any,
        scenario: str | None = None,
        num_flocks: int = 200,
        num_threads: int | None = None,
    ) -> Comparison:
        """Play policies and the best fixed range on the same held-out flocks; see ``Comparison``.

        Args:
            *policies: policies, names of built-in ones, paths of policy files, or models of
                stable-baselines3 that were trained on this task.
            scenario: one of ``scenarios``; ``None``: the first one.
            num_flocks: number of flocks.
            num_threads: number of threads; ``None``: one per core.

        Raises:
            InputError: if a policy does not fit the task, or an argument is out of bounds.
        """
        require("analysis", ["scipy"])
        from flockesc_env.taskset.comparison import ORACLE, Comparison, grid_of  # slow to import

        seeds = self.seeds[: as_count(num_flocks, "num_flocks", most=len(self.seeds))]
        name = as_choice(scenario or next(iter(self.scenarios)), "scenario", self.scenarios)
        model, best = self.scenarios[name], self.scales[name].best_fixed_range
        entries = {}
        for policy in map(as_policy, (self.shortcut.policy, *policies)):
            with errors_at(f"{policy.name}: "):
                entries[policy.name] = fitted(policy, self)
        ranges = np.union1d(grid_of(self), best)
        with progress_bar("Fixed ranges", ranges.size * len(seeds)) as report:
            search: Any = sweep(model, ranges, seeds, num_threads=num_threads, progress=report)
        fixed = f"best fixed range ({best:g}{self.spec.unit and ' m'})"
        values = {fixed: self.spec.values(search)[ranges.searchsorted(best)]}
        values[ORACLE] = search.hindsight_oracle(self.spec.name)
        for entry in entries.values():
            with progress_bar(f"Policy {entry.name}", len(seeds)) as report:
                episodes = rollout(model, entry, seeds, num_threads=num_threads, progress=report)
            values[entry.name] = self.spec.values(episodes)
        return Comparison(self, name, search, values)


class _Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A task in the file, with names of its scenario and objective: see ``Task``."""

    asks: str
    scenario: str
    per_agent: bool
    objective: str
    samples: int
    options: dict[str, Any]
    shortcut: Shortcut
    scales: dict[str, Scale]
    controls: tuple[Control, ...] = ()


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    version: str
    tasks: dict[str, _Entry]


class Tasks(Mapping[str, Task]):
    """The tasks by name; printing it is the table."""

    @cached_property
    def _tasks(self) -> dict[str, Task]:
        return read_tasks(files(__package__).joinpath(f"{VERSION}.toml").read_text("utf-8"))

    def __getitem__(self, name: str) -> Task:
        """Return a task.

        Raises:
            InputError: if the name is unknown. It names the near ones.
        """
        return self._tasks[as_choice(name, "task", self._tasks)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tasks)

    def __len__(self) -> int:
        return len(self._tasks)

    def __contains__(self, name: object) -> bool:
        return name in self._tasks

    def __repr__(self) -> str:
        return "\n".join(f"{name:<28}{task.actor:<7}{task.asks}" for name, task in self.items())


tasks: Final = Tasks()
"""The tasks by name, for example ``tasks["per-agent-visible"]``."""


def read_tasks(text: str) -> dict[str, Task]:
    """Return the tasks of a file's text; a field or a name that does not fit raises ``InputError``."""
    try:
        file = msgspec.convert(tomllib.loads(text), _File)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise InputError("tasks", "a file of tasks", error) from None
    return {name: _task(name, entry, file.version) for name, entry in file.tasks.items()}


def _task(name: str, entry: _Entry, version: str) -> Task:
    names = (entry.scenario, *entry.scales)
    scenarios = {one: PRESETS[as_choice(one, f"{name}.scenario", PRESETS)].scenario for one in names}
    model = scenarios[entry.scenario]
    is_line = isinstance(model, LineScenario)
    spec = model.objectives[as_choice(entry.objective, f"{name}.objective", model.objectives)]
    if not spec.is_defined_in(model):
        raise InputError("scenario", f"{spec.requires}, which the objective {spec.name} requires", "none")
    defining = {
        "version": version,
        "flocks": [FLOCKS.start, len(FLOCKS)],
        "scenarios": {one: json.loads(scenario.to_json()) for one, scenario in scenarios.items()},
        "task": msgspec.to_builtins(entry),
    }
    fields = msgspec.structs.asdict(entry) | {
        "scenario": model,
        "scenarios": {one: scenarios[one] for one in entry.scales},
        "options": entry.options if is_line else {**entry.options, "objective": entry.objective},
        "sha256": hashlib.sha256(json.dumps(defining, sort_keys=True).encode()).hexdigest(),
    }
    del fields["objective"]
    return Task(name=name, spec=spec, seeds=FLOCKS, **fields)
