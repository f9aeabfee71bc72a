"""``Task`` and ``tasks``: the frozen tasks, which ``v1.toml`` defines."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import gymnasium
import msgspec
import numpy as np

from flockesc_env.common.checks import as_choice, as_count, as_name
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.extras import require
from flockesc_env.envs.gymnasium import FlockEscapeEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.episodes.spaces import PolicySpec, policy_spec
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.policies import SB3Policy, compare
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.comparison import Comparison
from flockesc_env.policies.setup import Setup
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.objectives import ObjectiveSpec
from flockesc_env.scenario.presets import PRESETS, Scenario
from flockesc_env.taskset.fitting import fitted
from flockesc_env.taskset.learners import OWN_ALGORITHMS, Learner, learners_of

if TYPE_CHECKING:  # of an extra, or slow to import
    from stable_baselines3.common.vec_env import VecEnv

    from flockesc_env.envs.pettingzoo import FlockParallelEnv
    from flockesc_env.sb3 import FlockEvalCallback

VERSION: Final = "v1"
"""Version of the tasks. A change of a task gets another version; old ones stay."""

FLOCKS: Final = first_seeds(HELD_OUT, 1000)
"""Seeds of the flocks, or lines, that every policy is scored on."""


class Scale(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two objectives that normalize the scores of a task in one scenario.

    ``python -m studies scoreboard-freeze`` measures them.

    Attributes:
        best_fixed_range: fixed range with the largest mean objective on tuning flocks, in m for a flock.
        zero: mean objective of the best fixed range on the held-out flocks; the score 0.
        one: ``zero`` plus the reference's mean gain over the best fixed range; the score 1. The gain is
            paired: both play the same held-out flocks, all of them or the first ones.
        one_error: half width of the 95 % interval of ``one``; 0 if the reference plays all flocks.
        reference: what reaches ``one``; results/scoreboard/README.md describes the kinds.
    """

    best_fixed_range: float
    zero: float
    one: float
    one_error: float = 0.0
    reference: Literal["free headings", "clairvoyant", "informed greedy", "hindsight"]

    def score(self, objective: Any) -> Any:
        """Return the normalized score of an objective or an array of them."""
        return (objective - self.zero) / (self.one - self.zero)


@dataclass(frozen=True, kw_only=True, repr=False)
class Task:
    """Who sets which ranges, what is observed and scored, and the environments of a task.

    Attributes:
        name: name of the task.
        asks: the question that the task asks, in a sentence.
        scenario: the scenario in which policies are trained.
        per_agent: True: a policy sets one range per agent. False: one per flock, or per line.
        spec: the objective.
        options: options of the environment, which say what a policy may see; without the reward, which a
            trainer chooses.
        samples: number of actions, of one agent or of one flock, that a training run may take.
        scales: normalization of scores, by the names of the scenarios in which policies are scored.
        scenarios: these scenarios, by name.
        seeds: seeds of the held-out flocks that policies are scored on.
        preset: name of the scenario in which policies are trained.
        version: version of the tasks.
    """

    name: str
    asks: str
    scenario: Scenario
    per_agent: bool
    spec: ObjectiveSpec
    options: Mapping[str, Any]
    samples: int
    scales: Mapping[str, Scale]
    scenarios: Mapping[str, Scenario]
    preset: str
    version: str
    seeds: range = FLOCKS

    def __repr__(self) -> str:
        scales, text = self.scales.items(), self.spec.text
        way = "parallel_env" if self.per_agent else "env"
        facts = {
            "asks": self.asks,
            "ranges": f"one per {self.actor}, every {self.options['steps_per_action']} steps",
            "options": ", ".join(f"{name}={value!r}" for name, value in self.options.items()),
            "trained in": self.preset,
            "objective": self.spec.with_unit(self.spec.symbol),
            "score 0": "; ".join(
                f"{text(one.zero)} in {name} (best fixed range {one.best_fixed_range:g})"
                for name, one in scales
            ),
            "score 1": "; ".join(f"{text(one.one)} in {name} ({one.reference})" for name, one in scales),
            "rule": self.rule,
            "samples": f"at most {self.samples:,} actions, each of one {self.actor}",
            "learners": ", ".join(self.learners),
            "make": f'tasks["{self.name}"].{way}(), .vec_env(num_flocks)',
        }
        return "\n".join([self.name, *(f"  {name:<10}  {fact}" for name, fact in facts.items())])

    @property
    def id(self) -> str:
        """Gymnasium's id of the task, for ``gymnasium.make`` and ``gymnasium.make_vec``."""
        return f"flockesc/{self.name}-{self.version}"

    @property
    def actor(self) -> str:
        """What sets a range: an agent, a flock or a line."""
        return "agent" if self.per_agent else self.spec.model

    @property
    def best_fixed_range(self) -> float:
        """The best fixed range of the first scenario, in m for a flock."""
        return next(iter(self.scales.values())).best_fixed_range

    @property
    def rule(self) -> str:
        """Name of the best rule with numbers that a search chose: the learner ``rule``, its first seed."""
        return f"{self.name}/rule"

    @property
    def num_actions(self) -> int:
        """Number of actions of an episode that does not end early."""
        return int(-(-self.scenario.num_steps // self.options["steps_per_action"]))

    @property
    def reward(self) -> str:
        """The reward of training by default: what an agent, or the flock, adds to its objective."""
        return "change" if self.spec.model == "line" else "individual" if self.per_agent else "team"

    @cached_property
    def sha256(self) -> str:
        """Checksum of everything that defines the task."""
        scenarios = {self.preset: self.scenario, **self.scenarios}
        table: dict[str, Any] = {name: getattr(self, name) for name in _SHARED}
        table |= {"scenario": self.preset, "objective": self.spec.name}
        table["options"] = {name: value for name, value in self.options.items() if name != "objective"}
        defining = {
            "version": self.version,
            "flocks": [self.seeds.start, len(self.seeds)],
            "scenarios": {name: json.loads(scenario.to_json()) for name, scenario in scenarios.items()},
            "task": msgspec.to_builtins(table),
        }
        return hashlib.sha256(json.dumps(defining, sort_keys=True).encode()).hexdigest()

    def normalize(self, objectives: Mapping[str, Any]) -> Any:
        """Return the score, the mean over scenarios, from the objective, or an array of them, in each."""
        return sum(scale.score(objectives[name]) for name, scale in self.scales.items()) / len(self.scales)

    @property
    def policy_spec(self) -> PolicySpec:
        """What a policy observes and sets, as ``env.policy_spec``."""
        return self.spec_with()

    def spec_with(self, **options: Any) -> PolicySpec:
        """Return ``policy_spec`` with options that replace the task's, for example those of a ``Learner``."""
        chosen = self.scenario.env_options({**self.options, **options})
        return policy_spec(self.scenario, chosen, per_agent=self.per_agent)

    def setup(self, policy: Any, env: Any = None) -> Setup:
        """Return how a policy that fits the task (``fitted``) plays it; a model plays in ``env`` if given."""
        return fitted(policy, self.policy_spec, [*self.scenarios.values()], env)

    def env(self, **options: Any) -> FlockEscapeEnv | LineEscapeEnv:
        """Return the Gymnasium environment of a task with one range per flock or line, not per agent.

        ``options`` are those beside the task's, such as ``reward`` and ``render_mode``; ``scenario`` replaces
        the task's.
        """
        options = {"scenario": self.scenario, **self.options, **options}
        if isinstance(self.scenario, LineScenario):
            return LineEscapeEnv(**options)
        if self.per_agent:
            expected = "one range per flock; parallel_env and vec_env have one per agent"
            raise InputError("task", expected, self.name)
        return FlockEscapeEnv(**options)

    def parallel_env(self, **options: Any) -> FlockParallelEnv:
        """Return the PettingZoo environment of a task for flocks; its agent is ``flock`` for one range."""
        from flockesc_env.envs.pettingzoo import parallel_env  # fails in a deleted working folder

        view = {"scenario": self.scenario, "per_agent": self.per_agent, "reward": self.reward}
        return parallel_env(**{**view, **self.options, **options})

    def vec_env(self, num_flocks: int = 1, *, learner: str | None = "ppo", **options: Any) -> VecEnv:
        """Return the environment for stable-baselines3 (extra ``sb3``), a slot per agent, flock or line.

        Args:
            num_flocks: number of flocks, or of lines.
            learner: name of the learner of ``hyperparameters``, whose table may choose the reward and the
                action mode. ``None``: only the task decides.
            **options: options of ``flockesc_env.sb3.vec_env`` that replace those of the task and the learner;
                ``reward`` is ``Task.reward`` by default. ``scenario`` replaces the task's.
        """
        from flockesc_env.sb3 import vec_env

        chosen = {"scenario": self.scenario, "reward": self.reward, **self.options}
        if self.spec.model == "flock":
            chosen |= {"infos": "end", "per_agent": self.per_agent}
        if learner is not None:
            chosen |= self.learner(learner).options
        envs = vec_env(num_flocks=num_flocks, **(chosen | options))
        if self.id in gymnasium.registry:
            envs.set_attr("spec", gymnasium.spec(self.id))
        return envs

    def eval_callback(self, *, eval_freq: int = 1000, **arguments: Any) -> FlockEvalCallback:
        """Return a ``FlockEvalCallback`` of these arguments, for ``learn`` on ``vec_env`` (extra ``sb3``)."""
        from flockesc_env.sb3 import FlockEvalCallback

        return FlockEvalCallback(eval_freq, **arguments)

    @property
    def learners(self) -> dict[str, Learner]:
        """The learners of the task by name."""
        return learners_of(self.name, self.actor)

    def learner(self, name: str) -> Learner:
        """Return the learner ``"ppo"``, or ``"PPO"``, and so on; an unknown name raises ``InputError``."""
        known = self.learners
        return known[as_name(name, "learner", known)]

    def hyperparameters(self, learner: str | Learner) -> dict[str, Any]:
        """Return the arguments of the algorithm of a learner of stable-baselines3, given by name or itself.

        ``RangePolicy`` starts at the learner's ``first_range``, or at the largest range of an action if that
        is shorter. Example: ``PPO(env=task.vec_env(4), **task.hyperparameters("ppo"))``.
        """
        found = self.learner(learner) if isinstance(learner, str) else learner
        if found.algorithm in OWN_ALGORITHMS:
            command = f"python -m training train {self.name} --learner {learner} runs this one"
            raise InputError("learner", f"one of stable-baselines3; {command}", repr(learner))
        return found.arguments(self.spec_with(**found.options), self.best_fixed_range)

    def compare(
        self,
        *policies: Any,
        scenario: str | None = None,
        num_flocks: int = 200,
        num_threads: int | None = None,
        env: Any = None,
    ) -> Comparison:
        """Play policies and the best fixed range on the same held-out flocks, as ``flockesc_env.compare``.

        Args:
            *policies: policies that fit the task (``setup``), their names, paths of policy files, or models
                of stable-baselines3 that were trained on this task.
            scenario: one of ``scenarios``; ``None``: the first one.
            num_flocks: number of flocks.
            num_threads: number of threads; ``None``: one per core.
            env: an environment of ``scenario``, in which models play, as in ``rollout``.
        """
        require("analysis", ["scipy"])
        seeds = self.seeds[: as_count(num_flocks, "num_flocks", most=len(self.seeds))]
        name = as_choice(scenario or next(iter(self.scenarios)), "scenario", self.scenarios)
        chosen, best = self.scenarios[name], self.scales[name].best_fixed_range

        def prepare(policy: BasePolicy) -> Setup:
            entry = self.setup(policy, env if isinstance(policy, SB3Policy) else None)
            if entry.env is not None and entry.scenario != chosen:
                raise InputError("env", f"flocks of {name}, as of vec_env(scenario={name!r})", shown(env))
            return replace(entry, scenario=chosen, num_threads=num_threads)

        entries, grid = compare.prepared((self.rule, *policies), prepare), np.array(chosen.search_ranges)
        facts = {"scenario": name, "task": self.name, "rule": self.rule}
        return compare.judged(entries, self.spec, grid, best, seeds, **facts)


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of the file, with the names of the scenario and the objective; see ``Task``."""

    asks: str
    scenario: str
    per_agent: bool
    objective: str
    samples: int
    options: dict[str, Any]
    scales: dict[str, Scale]

    def task(self, name: str, version: str) -> Task:
        """Return the task that the table defines."""
        names = (self.scenario, *self.scales)
        scenarios = {one: PRESETS[as_choice(one, f"{name}.scenario", PRESETS)].scenario for one in names}
        model = scenarios[self.scenario]
        spec = model.objectives[as_choice(self.objective, f"{name}.objective", model.objectives)]
        if not spec.is_defined_in(model):
            raise InputError("scenario", f"{spec.requires}, which the objective {spec.name} requires", "none")
        options = self.options if model.model == "line" else self.options | {"objective": self.objective}
        known: dict[str, Any] = {one: getattr(self, one) for one in _SHARED}
        known |= {"scenario": model, "scenarios": {one: scenarios[one] for one in self.scales}}
        return Task(name=name, spec=spec, options=options, preset=self.scenario, version=version, **known)


_SHARED: Final = ("asks", "per_agent", "samples", "scales")
"""Fields that a table and its task share."""


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    version: str
    tasks: dict[str, _Table]


def read_tasks(text: str) -> dict[str, Task]:
    """Return the tasks of a file's text; a field or a name that does not fit raises ``InputError``."""
    try:
        file = msgspec.convert(tomllib.loads(text), _File)
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise InputError("tasks", "a file of tasks", error) from None
    return {name: table.task(name, file.version) for name, table in file.tasks.items()}


class Tasks(dict[str, Task]):
    """The tasks by name; printing it is the table."""

    def __missing__(self, name: str) -> Task:
        """Return ``"per-agent-visible"`` for ``"Per_Agent_Visible"``; refuse an unknown name."""
        return self[as_name(name, "task", self)]

    def __repr__(self) -> str:
        return "\n".join(f"{name:<28}{task.actor:<7}{task.asks}" for name, task in self.items())


tasks: Final = Tasks(read_tasks(Path(__file__).with_name(f"{VERSION}.toml").read_text("utf-8")))
"""The tasks by name, for example ``tasks["per-agent-visible"]``."""
