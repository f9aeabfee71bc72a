"""``Task`` and ``tasks``: the frozen tasks, which ``v1.toml`` defines."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec
import tomli_w

from flockesc_env.common.errors import ArgumentError, shown_name
from flockesc_env.envs.gymnasium import FlockEscapeEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, ObjectiveSpec
from flockesc_env.episodes.options import View, env_options, line_options
from flockesc_env.episodes.spaces import PolicySpec, flock_policy_spec, line_policy_spec
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import PRESETS, Scenario

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

    from flockesc_env.envs.pettingzoo import FlockParallelEnv
    from flockesc_env.tasks.comparison import Comparison

VERSION: Final = "v1"
"""Version of the tasks. A change of a task gets another version; old ones stay."""

FLOCKS: Final = first_seeds(HELD_OUT, 1000)
"""Seeds of the flocks, or lines, that every policy is scored on."""

Reference = Literal["free headings", "clairvoyant", "informed greedy", "hindsight"]


class Scale(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two objectives that normalize the scores of a task in one scenario.

    Attributes:
        best_fixed_range: fixed range with the largest mean objective on tuning flocks, in m for a flock.
        zero: mean objective of the best fixed range on the held-out flocks; the score 0.
        one: ``zero`` plus the reference's mean gain over the best fixed range; the score 1. The gain is
            paired: both play the same held-out flocks, all of them or the first ones.
        one_error: half width of the 95 % interval of ``one``; 0 if the reference plays all flocks.
        reference: what reaches ``one``; docs/scoreboard.md describes the kinds.
    """

    best_fixed_range: float
    zero: float
    one: float
    one_error: float = 0.0
    reference: Reference

    def score(self, objective: Any) -> Any:
        """Return the normalized score of an objective or an array of them."""
        return (objective - self.zero) / (self.one - self.zero)


class Control(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An experiment that shows what a task is about: a gain with and without the escape force.

    Attributes:
        policy: the policy that hears the warning.
        baseline: the policy that it is compared with, on the same flocks.
        gain: mean paired difference of their objectives; mean, lower and upper end of the 95 % interval.
        gain_without_force: the same in flocks without the escape force, where nobody gives a warning.
    """

    policy: str
    baseline: str
    gain: tuple[float, float, float]
    gain_without_force: tuple[float, float, float]


class Shortcut(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A simple policy without training and its score, so that nobody mistakes it for progress."""

    policy: str
    says: str
    score: float


class _Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A task in the file: see ``Task``."""

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
    scenarios: dict[str, dict[str, Any]]
    tasks: dict[str, _Entry]


@dataclass(frozen=True, kw_only=True)
class Task:
    """A task: who sets which ranges, what it observes, and what is scored.

    Attributes:
        name: name of the task.
        asks: the question that the task asks, in a sentence.
        scenario: the scenario in which policies are trained.
        per_agent: True: a policy sets one range per agent. False: one per flock, or per line.
        spec: the objective.
        options: options of the environment, which say what a policy may see; without the reward, which a
            trainer chooses.
        samples: number of actions, of one agent or of one flock, that a training run may take.
        shortcut: a simple policy without training, and its score.
        scales: normalization of scores, by the names of the scenarios in which policies are scored.
        scenarios: these scenarios, by name.
        controls: experiments without the escape force, of tasks in which a warning decides.
        seeds: seeds of the held-out flocks that policies are scored on.
        sha256: checksum of everything that defines the task.
    """

    name: str
    asks: str
    scenario: Scenario
    per_agent: bool
    spec: ObjectiveSpec
    options: Mapping[str, Any]
    samples: int
    shortcut: Shortcut
    scales: Mapping[str, Scale]
    scenarios: Mapping[str, Scenario]
    controls: tuple[Control, ...]
    seeds: range
    sha256: str

    @property
    def actor(self) -> str:
        """What sets a range: an agent, a flock or a line."""
        return "agent" if self.per_agent else self.spec.model

    def normalize(self, objectives: Mapping[str, float]) -> float:
        """Return the score of a policy, the mean over scenarios, from its mean objective in each."""
        scores = [scale.score(objectives[name]) for name, scale in self.scales.items()]
        return float(sum(scores) / len(scores))

    def env(self, **options: Any) -> FlockEscapeEnv | LineEscapeEnv:
        """Return the Gymnasium environment of a task with one range per flock or line.

        Args:
            **options: options beside the task's, such as ``reward`` and ``render_mode``.

        Raises:
            ArgumentError: if every agent sets its own range.
            OptionError: if an option is unknown or out of bounds.
        """
        options = {**self.options, **options}
        if isinstance(self.scenario, LineScenario):
            return LineEscapeEnv(self.scenario, **options)
        if self.per_agent:
            raise ArgumentError(
                "task", "one range per flock; parallel_env and vec_env have one per agent", self.name
            )
        return FlockEscapeEnv(self.scenario, **options)

    def parallel_env(self, **options: Any) -> FlockParallelEnv:
        """Return the PettingZoo environment of a task with one range per agent; see ``env``."""
        if not self.per_agent or isinstance(self.scenario, LineScenario):
            raise ArgumentError("task", "one range per agent; env has one per flock or line", self.name)
        from flockesc_env.envs.pettingzoo import parallel_env  # fails in a deleted working folder

        options = {**self.options, **options}
        return parallel_env(self.scenario, **{"reward": self.reward, **options})

    def vec_env(self, num_flocks: int, **options: Any) -> VecEnv:
        """Return the environment for stable-baselines3, with one slot per agent, per flock or per line.

        Args:
            num_flocks: number of flocks, or of lines.
            **options: options beside the task's, of ``flockesc_env.sb3.AgentVecEnv`` and ``FlockVecEnv``;
                ``reward`` is ``Task.reward`` by default. ``scenario`` replaces the task's.

        Raises:
            MissingExtraError: if stable-baselines3 is not installed.
            OptionError: if an option is unknown or out of bounds.
        """
        from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv, line_vec_env

        options = {"reward": self.reward, **self.options, **options}
        scenario = options.pop("scenario", self.scenario)
        if isinstance(scenario, LineScenario):
            return line_vec_env(num_flocks, scenario, **options)
        make = AgentVecEnv if self.per_agent else FlockVecEnv
        return make(num_flocks, scenario, **{"infos": "end", **options})

    @property
    def reward(self) -> str:
        """The reward of training by default: what an agent, or the flock, adds to its objective."""
        if isinstance(self.scenario, LineScenario):
            return "change"
        return "individual_running_minimum" if self.per_agent else "running_minimum"

    def policy_spec(self, **options: Any) -> PolicySpec:
        """Return what a policy observes and sets; ``options`` replace the task's."""
        chosen: Any = {**self.options, **options}
        if isinstance(self.scenario, LineScenario):
            return line_policy_spec(self.scenario, line_options(chosen))
        return flock_policy_spec(self.scenario, env_options(self.scenario, chosen), View.of(self.per_agent))

    def hyperparameters(self, learner: str) -> dict[str, Any]:
        """Return the arguments of the algorithm of a learner of stable-baselines3; see ``learners``.

        Example: ``PPO("MlpPolicy", task.vec_env(4), **task.hyperparameters("ppo"))``.

        Raises:
            ArgumentError: if the task has no such learner, or it is none of stable-baselines3.
        """
        from flockesc_env.tasks.learners import arguments, learner_of

        return arguments(self, learner, learner_of(self, learner))

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
            ArgumentError: if a policy does not fit the task, or an argument is out of bounds.
        """
        from flockesc_env.tasks.comparison import compare

        return compare(self, policies, scenario=scenario, num_flocks=num_flocks, num_threads=num_threads)


class Tasks(Mapping[str, Task]):
    """The tasks by name; printing it is the table."""

    @cached_property
    def _tasks(self) -> dict[str, Task]:
        return read_tasks(files(__package__).joinpath(f"{VERSION}.toml").read_text("utf-8"))

    def __getitem__(self, name: str) -> Task:
        """Return a task.

        Raises:
            ArgumentError: if the name is unknown. It names the near ones.
        """
        if name not in self._tasks:
            raise ArgumentError("task", f"one of {', '.join(self)}", shown_name(name, list(self)))
        return self._tasks[name]

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
    """Return the tasks of a file's text."""
    file = msgspec.convert(tomllib.loads(text), _File)
    scenarios = {name: preset.scenario for name, preset in PRESETS.items()}
    scenarios |= {name: _scenario(dict(document)) for name, document in file.scenarios.items()}
    return {name: _task(name, entry, file.version, scenarios) for name, entry in file.tasks.items()}


def _scenario(document: dict[str, Any]) -> Scenario:
    """Return a preset's scenario with the fields that differ."""
    model = PRESETS[document.pop("preset")].scenario
    return model.from_toml(tomli_w.dumps({**tomllib.loads(model.to_toml()), **document}))


def _task(name: str, entry: _Entry, version: str, scenarios: Mapping[str, Scenario]) -> Task:
    model, used = scenarios[entry.scenario], [entry.scenario, *entry.scales]
    is_line = isinstance(model, LineScenario)
    spec = (LINE_OBJECTIVES if is_line else FLOCK_OBJECTIVES)[entry.objective]
    spec.check_defined_in(model)
    options = {option: None if value == "None" else value for option, value in entry.options.items()}
    if not is_line:
        options["objective"] = entry.objective
    defining = {
        "version": version,
        "flocks": [FLOCKS.start, len(FLOCKS)],
        "scenarios": {one: json.loads(scenarios[one].to_json()) for one in used},
        "task": msgspec.to_builtins(entry),
    }
    return Task(
        name=name,
        asks=entry.asks,
        scenario=model,
        per_agent=entry.per_agent,
        spec=spec,
        options=options,
        samples=entry.samples,
        shortcut=entry.shortcut,
        scales=entry.scales,
        scenarios={one: scenarios[one] for one in entry.scales},
        controls=entry.controls,
        seeds=FLOCKS,
        sha256=hashlib.sha256(json.dumps(defining, sort_keys=True).encode()).hexdigest(),
    )
