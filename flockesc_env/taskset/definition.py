"""``TaskDefinition``: what a task fixes, and the environments that follow from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import gymnasium
import msgspec

from flockesc_env.common.errors import InputError
from flockesc_env.envs.gymnasium import FlockEscapeEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.episodes.spaces import PolicySpec, policy_spec
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.objectives import ObjectiveSpec
from flockesc_env.scenario.presets import Scenario

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

    from flockesc_env.envs.pettingzoo import FlockParallelEnv
    from flockesc_env.sb3 import FlockEvalCallback

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
        reference: what reaches ``one``; results/scoreboard/README.md describes the kinds.
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
    """An experiment that shows what a task is about: a gain with and without warnings.

    Attributes:
        policy: the best known policy: a rule, ``fixed:RHO`` or TASK/LEARNER of a trained policy.
        baseline: the constant that it is compared with, on the same tuning flocks.
        gain: mean paired difference of their objectives; mean, lower and upper end of the 95 % interval.
        gain_blocked: the same with the scenario's ``blocks_warnings``: agents that no predator has reached
            do not hear agents that one has reached.
    """

    policy: str
    baseline: str
    gain: tuple[float, float, float]
    gain_blocked: tuple[float, float, float]


class Shortcut(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The best built-in policy without training, chosen on tuning flocks, and its score.

    It is one of the rules that fit the task, random ranges or the best fixed range.
    """

    policy: str
    score: float


@dataclass(frozen=True, kw_only=True)
class TaskDefinition:
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
        shortcut: the best built-in policy without training, and its score.
        scales: normalization of scores, by the names of the scenarios in which policies are scored.
        scenarios: these scenarios, by name.
        controls: experiments with blocked warnings, of tasks in which a warning decides.
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
    def id(self) -> str:
        """Gymnasium's id of the task, for ``gymnasium.make`` and ``gymnasium.make_vec``."""
        return f"flockesc/{self.name}-{VERSION}"

    @property
    def actor(self) -> str:
        """What sets a range: an agent, a flock or a line."""
        return "agent" if self.per_agent else self.spec.model

    def normalize(self, objectives: Mapping[str, Any]) -> Any:
        """Return the score, the mean over scenarios, from the objective, or an array of them, in each."""
        return sum(scale.score(objectives[name]) for name, scale in self.scales.items()) / len(self.scales)

    def env(self, **options: Any) -> FlockEscapeEnv | LineEscapeEnv:
        """Return the Gymnasium environment of a task with one range per flock or line.

        Args:
            **options: options beside the task's, such as ``reward`` and ``render_mode``.

        Raises:
            InputError: if every agent sets its own range; if an option is unknown or out of bounds.
        """
        options = {**self.options, **options}
        if isinstance(self.scenario, LineScenario):
            return LineEscapeEnv(self.scenario, **options)
        if self.per_agent:
            expected = "one range per flock; parallel_env and vec_env have one per agent"
            raise InputError("task", expected, self.name)
        return FlockEscapeEnv(self.scenario, **options)

    def parallel_env(self, **options: Any) -> FlockParallelEnv:
        """Return the PettingZoo environment of a task with one range per agent; see ``env``."""
        if not self.per_agent or isinstance(self.scenario, LineScenario):
            raise InputError("task", "one range per agent; env has one per flock or line", self.name)
        from flockesc_env.envs.pettingzoo import parallel_env  # fails in a deleted working folder

        return parallel_env(self.scenario, **{"reward": self.reward, **self.options, **options})

    def vec_env(self, num_flocks: int = 1, **options: Any) -> VecEnv:
        """Return the environment for stable-baselines3, with one slot per agent, per flock or per line.

        Args:
            num_flocks: number of flocks, or of lines.
            **options: options beside the task's, of ``flockesc_env.sb3.vec_env``; ``reward`` is
                ``Task.reward`` by default. ``scenario`` replaces the task's.

        Raises:
            MissingExtraError: if stable-baselines3 is not installed.
            InputError: if an option is unknown or out of bounds.
        """
        from flockesc_env.sb3 import vec_env

        options = {"scenario": self.scenario, "reward": self.reward, **self.options, **options}
        if self.spec.model == "flock":
            options = {"infos": "end", "per_agent": self.per_agent, **options}
        envs = vec_env(num_flocks=num_flocks, **options)
        if self.id in gymnasium.registry:
            envs.set_attr("spec", gymnasium.spec(self.id))
        return envs

    def eval_callback(
        self, num_flocks: int = 20, eval_freq: int = 1000, best_model_save_path: str | Path | None = None
    ) -> FlockEvalCallback:
        """Return a ``FlockEvalCallback``, for ``learn`` on ``vec_env``; it needs the extra ``sb3``."""
        from flockesc_env.sb3 import FlockEvalCallback

        return FlockEvalCallback(eval_freq, num_flocks, best_model_save_path=best_model_save_path)

    @property
    def reward(self) -> str:
        """The reward of training by default: what an agent, or the flock, adds to its objective."""
        if isinstance(self.scenario, LineScenario):
            return "change"
        return "individual" if self.per_agent else "team"

    def policy_spec(self, **options: Any) -> PolicySpec:
        """Return what a policy observes and sets; ``options`` replace the task's."""
        return policy_spec(
            self.scenario, self.scenario.env_options({**self.options, **options}), per_agent=self.per_agent
        )
