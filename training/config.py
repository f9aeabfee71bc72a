"""Settings and arguments of training runs."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from flockesc_env import FlockScenario, LineScenario, preset
from flockesc_env.common.files import suffix_of
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, Objective, ObjectiveSpec


@dataclass(frozen=True, kw_only=True)
class Setting:
    """The task of a training run: scenario, observations, actions and objective.

    Attributes:
        scenario: name of a preset scenario, or a scenario file (.toml) of a flock.
        per_agent: one range per agent, set by a policy that all agents share; otherwise one for all agents.
        predator_visible: agents observe the predator at any distance; otherwise within its range only.
        objective: what is maximized in a flock; see ``EnvOptions``. The line has one objective.
        max_range: largest range, in m for a flock.
        steps_per_action: number of model steps per action.
        profile_ranges: candidate ranges of the observation; empty: no profile.
        extra_entries: optional entries of the observation.
    """

    scenario: str = "paper-flock"
    per_agent: bool = True
    predator_visible: bool = True
    objective: Objective = "mean"
    max_range: float = 20.0
    steps_per_action: int = 4
    profile_ranges: tuple[float, ...] = ()
    extra_entries: tuple[str, ...] = ()

    @property
    def model(self) -> FlockScenario | LineScenario:
        """The scenario object."""
        if suffix_of(self.scenario) == ".toml":
            return FlockScenario.from_toml(Path(self.scenario).read_text("utf-8"))
        return preset(self.scenario)

    @property
    def is_line(self) -> bool:
        """Whether the scenario is a line."""
        return isinstance(self.model, LineScenario)

    @property
    def spec(self) -> ObjectiveSpec:
        """The objective of the scenario's model."""
        return LINE_OBJECTIVES["escape_distance"] if self.is_line else FLOCK_OBJECTIVES[self.objective]

    def env_options(self) -> dict[str, Any]:
        """Return the options of the environment, except the reward."""
        options: dict[str, Any] = {"max_range": self.max_range, "steps_per_action": self.steps_per_action}
        if self.profile_ranges:
            options["profile_ranges"] = self.profile_ranges
        if self.is_line:
            return options
        if self.extra_entries:
            options["extra_entries"] = self.extra_entries
        sensing = None if self.predator_visible else "predator_range"
        return {**options, "objective": self.objective, "predator_sensing_range": sensing}


@dataclass(frozen=True, kw_only=True)
class Args(Setting):
    """Arguments of all learners.

    Attributes:
        kind: name of the learner in presets.
        learner: module and class of the learner.
        budget: field that holds the length of a run.
        run: folder of the run; an unfinished run is continued.
        seed: seed of the learner and of the training flocks.
        checkpoint_every: number of generations or rounds between checkpoints.
        progress: show a progress bar.
    """

    kind: ClassVar[str]
    learner: ClassVar[str]
    budget: ClassVar[str]

    run: Path
    seed: int = 0
    checkpoint_every: int = 25
    progress: bool = True

    def setting(self) -> Setting:
        """Return the task of the run."""
        return Setting(**{f.name: getattr(self, f.name) for f in dataclasses.fields(Setting)})


@dataclass(frozen=True, kw_only=True)
class SearchArgs(Args):
    """Arguments of the search with CMA-ES, which maximizes the objective itself.

    Attributes:
        rule: search for the parameters of this rule instead of a network: ``"stubborn-witnesses"``,
            ``"listen-while-threatened"``, ``"win-stay-lose-shift"`` or ``"win-stay-lose-shift-escape"``. The
            learning curve begins with parameters chosen by hand. Empty: a network.
        inputs: observation entries that the network sees; empty: all. With ``time`` alone the network is an
            open-loop schedule.
        candidate_inputs: entries of a candidate range that the network sees; it then scores every candidate.
        hidden: widths of the hidden layers.
        memory: number of recurrent values of the network.
        mirror: reflect observations such that the predator is on the left.
        population: number of networks per generation.
        flocks: number of flocks per network in the first generation.
        final_flocks: number of flocks per network in the last generation; it grows geometrically.
        generations: number of generations.
        step_size: initial standard deviation of the parameters.
        start: policy from which the search starts: a policy file or the folder of a run, with the same
            architecture or with the same inputs and no hidden layers; or, if candidates are scored, the name
            of a built-in ``BestCandidate`` rule. The learning curve begins with this policy, so it is kept
            unless a better one is found. Empty: all parameters are 0.
        restarts: number of equal parts of the search. Each part starts again from the first parameters. The
            best checkpoint of all parts is kept.
    """

    kind: ClassVar = "search"
    learner: ClassVar = "training.search:SearchRounds"
    budget: ClassVar = "generations"

    rule: str = ""
    inputs: tuple[str, ...] = ()
    candidate_inputs: tuple[str, ...] = ()
    hidden: tuple[int, ...] = (8,)
    memory: int = 0
    mirror: bool = False
    population: int = 16
    flocks: int = 4
    final_flocks: int = 32
    generations: int = 300
    step_size: float = 0.5
    start: str = ""
    restarts: int = 1


@dataclass(frozen=True, kw_only=True)
class SB3Args(Args):
    """Arguments of the learners of stable-baselines3.

    They train in rounds on new flocks. A round is one episode of every flock, or 64 actions of every line,
    whose episodes are short.

    Attributes:
        reward: reward during training; results always report the objective.
        num_flocks: number of flocks (or lines) stepped together.
        num_episodes: number of rounds.
        batch_size: number of observation rows per gradient step.
        learning_rate: learning rate of Adam.
        gamma: discount factor per action.
        net_arch: widths of the hidden layers of the policy and value networks.
    """

    budget: ClassVar = "num_episodes"

    reward: str = "running_minimum"
    num_flocks: int = 4
    num_episodes: int = 100
    batch_size: int = 256
    learning_rate: float = 5e-4
    gamma: float = 0.99
    net_arch: tuple[int, ...] = (64, 64)


@dataclass(frozen=True, kw_only=True)
class PPOArgs(SB3Args):
    """Arguments of PPO.

    Attributes:
        n_epochs: number of passes over the data of a round.
        anneal: decrease the learning rate linearly to 0.
        gae_lambda: lambda of the generalized advantage estimate.
        log_std_init: logarithm of the initial standard deviation of actions.
        inputs: observation entries that the policy sees, besides those of candidates. Empty: no others if
            candidates are scored, otherwise all.
        candidate_inputs: entries of a candidate range; the policy then scores every candidate and is
            categorical. Empty: a Gaussian policy, unless there are ``ranges``.
        ranges: rising ranges in m among which a categorical policy chooses, without a profile.
        episode_steps: model steps of an episode of training, if that decides the objective; 0: all. The entry
            ``time`` is then another one, so ``inputs`` must leave it out. Only for flocks.
        range_cost: deducted from the reward of an action with the range ``max_range``; in proportion from
            others. Listening far can be good for an agent and bad for the flock, which then agrees.
    """

    kind: ClassVar = "ppo"
    learner: ClassVar = "training.ppo:PPORounds"

    batch_size: int = 8000
    gamma: float = 0.9
    net_arch: tuple[int, ...] = (32, 32)
    n_epochs: int = 5
    anneal: bool = True
    gae_lambda: float = 0.95
    log_std_init: float = 0.0
    inputs: tuple[str, ...] = ()
    candidate_inputs: tuple[str, ...] = ()
    ranges: tuple[float, ...] = ()
    episode_steps: int = 0
    range_cost: float = 0.0


@dataclass(frozen=True, kw_only=True)
class TQCArgs(SB3Args):
    """Arguments of TQC (truncated quantile critics); only for one range for all agents.

    Attributes:
        learning_starts: number of transitions before the first gradient step.
        buffer_size: number of transitions in the replay buffer.
    """

    kind: ClassVar = "tqc"
    learner: ClassVar = "training.tqc:TQCRounds"

    num_flocks: int = 16
    learning_starts: int = 5000
    buffer_size: int = 100_000


@dataclass(frozen=True, kw_only=True)
class ImitationArgs(Args):
    """Arguments of the imitation of values; only for one range for all agents of a flock.

    Attributes:
        teacher: policy that plays every copy of a flock to the end, after its first action, and that visits
            flocks in the first round: a built-in policy, a policy file or the folder of a run.
        improve: after a round, its network replaces the teacher. The values of older teachers are kept.
        inputs: observation entries that the network sees; empty: all.
        ranges: candidate ranges in m; the network has one output per candidate.
        hidden: widths of the hidden layers.
        rounds: number of rounds. After each, a new network is fitted to the values of all rounds.
        flocks: number of new flocks per round.
        branches: number of candidates per flock that are drawn at random and valued.
        epochs: number of passes over the values.
        learning_rate: largest learning rate of AdamW.
        weight_decay: weight decay of AdamW.
    """

    kind: ClassVar = "imitation"
    learner: ClassVar = "training.imitation:ImitationRounds"
    budget: ClassVar = "rounds"

    teacher: str
    improve: bool = False
    inputs: tuple[str, ...] = ()
    ranges: tuple[float, ...] = ()
    hidden: tuple[int, ...] = (64, 64)
    rounds: int = 3
    flocks: int = 1200
    branches: int = 3
    epochs: int = 150
    learning_rate: float = 1e-2
    weight_decay: float = 0.3
    checkpoint_every: int = 1


TYPES: dict[str, type[Args]] = {args.kind: args for args in (SearchArgs, PPOArgs, TQCArgs, ImitationArgs)}
"""Arguments by name of the learner."""


def make_args(kind: str, values: dict[str, Any]) -> Args:
    """Return the arguments of a document, in which tuples are lists."""
    return TYPES[kind](**tuples(values))


def tuples(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values of a document with tuples for lists."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
