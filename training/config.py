"""Settings and arguments of training runs: flat dataclasses, TOML presets, and the record beside a run."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from platform import python_version
from typing import Any, Literal

from flockesc_env import FlockScenario, LineScenario, preset
from flockesc_env.common.files import atomic_write

PRESETS = Path(__file__).parent / "configs"
CONFIG_FILE = "config.json"
POLICY_FILE = "policy.npz"
CURVE_FILE = "curve.parquet"
RUN_FILE = "run.json"
_RECORDED = (
    "cmaes",
    "flockesc-env",
    "gymnasium",
    "numpy",
    "pettingzoo",
    "sb3-contrib",
    "stable-baselines3",
    "torch",
)


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What is to be solved: one row of the comparison.

    Attributes:
        scenario: name of the preset that is played, or a file (.toml) of a flock.
        per_agent: one range per agent, with one policy shared by all, or one range for all.
        predator_visible: whether agents see the predator at any distance, or only within its range.
        objective: the distance that is to be kept large: the mean (Eq. 12) or the minimum one (Eq. 13).
        max_range: largest range in m.
        steps_per_action: model steps per action.
    """

    scenario: str = "paper-flock"
    per_agent: bool = True
    predator_visible: bool = True
    objective: Literal["mean", "minimum"] = "mean"
    max_range: float = 20.0
    steps_per_action: int = 4

    @property
    def model(self) -> FlockScenario | LineScenario:
        """The scenario itself."""
        if Path(self.scenario).suffix == ".toml":
            return FlockScenario.from_toml(Path(self.scenario).read_text())
        return preset(self.scenario)

    @property
    def is_line(self) -> bool:
        """Whether it is about the line."""
        return isinstance(self.model, LineScenario)

    def env_options(self) -> dict[str, Any]:
        """Return the options of the environment, those of the reward aside."""
        actions = {"max_range": self.max_range, "steps_per_action": self.steps_per_action}
        if self.is_line:
            return actions
        sensing = None if self.predator_visible else "predator_range"
        return {**actions, "objective": self.objective, "predator_sensing_range": sensing}


@dataclass(frozen=True, kw_only=True)
class TrainArgs(Setting):
    """What all learners have in common.

    Attributes:
        run: folder of the run; an unfinished run in it is continued.
        seed: seed of the learner's draws and of the first flocks.
        checkpoint_every: updates between checkpoints.
        progress: whether to show a progress bar.
    """

    run: Path
    seed: int = 0
    checkpoint_every: int = 25
    progress: bool = True

    def setting(self) -> Setting:
        """Return what is to be solved."""
        return Setting(**{f.name: getattr(self, f.name) for f in dataclasses.fields(Setting)})


@dataclass(frozen=True, kw_only=True)
class SearchArgs(TrainArgs):
    """CMA-ES over the parameters of a small network or of a rule, on the objective itself.

    Attributes:
        rule: whether it searches for parameters of the rule ``StubbornWitnesses`` instead of a network.
        inputs: entries of the observation that the network sees; none: all. With ``time`` alone the network
            is an open-loop schedule.
        hidden: hidden layers of the network.
        memory: numbers that the network hands from one action to the next.
        mirror: whether agents see the world reflected such that the predator is on their left.
        population: networks per generation.
        flocks: flocks that every network of the first generation plays, the same for all.
        final_flocks: the same of the last generation; in between the number grows geometrically.
        generations: how many.
        step_size: first standard deviation of the parameters.
    """

    rule: bool = False
    inputs: tuple[str, ...] = ()
    hidden: tuple[int, ...] = (8,)
    memory: int = 0
    mirror: bool = False
    population: int = 16
    flocks: int = 4
    final_flocks: int = 32
    generations: int = 300
    step_size: float = 0.5


@dataclass(frozen=True, kw_only=True)
class SB3Args(TrainArgs):
    """What the learners of stable-baselines3 have in common.

    They train in rounds, each on flocks of its own: one episode of every flock or, on the line, where
    episodes last a few steps, 64 actions of every line.

    Attributes:
        reward: what training pays; reports always use the objective itself.
        num_flocks: flocks (or lines) stepped together.
        num_episodes: rounds.
        batch_size: rows per gradient step.
        learning_rate: of Adam.
        gamma: discount per action.
        net_arch: hidden layers of policy and value networks.
        threads: of torch and of the engine.
        tensorboard: whether to write logs for TensorBoard.
    """

    reward: str = "running_minimum"
    num_flocks: int = 4
    num_episodes: int = 100
    batch_size: int = 256
    learning_rate: float = 5e-4
    gamma: float = 0.99
    net_arch: tuple[int, ...] = (64, 64)
    threads: int = 1
    tensorboard: bool = False


@dataclass(frozen=True, kw_only=True)
class PPOArgs(SB3Args):
    """PPO of stable-baselines3.

    Attributes:
        n_epochs: passes over a round.
        anneal: whether the learning rate falls linearly to 0.
        gae_lambda: of the advantage estimate.
        clip_range: of PPO.
        ent_coef: weight of the entropy bonus.
        log_std_init: logarithm of the first standard deviation of actions.
    """

    batch_size: int = 8000
    gamma: float = 0.9
    net_arch: tuple[int, ...] = (32, 32)
    n_epochs: int = 5
    anneal: bool = True
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    log_std_init: float = 0.0


@dataclass(frozen=True, kw_only=True)
class TQCArgs(SB3Args):
    """Truncated quantile critics of sb3-contrib, off-policy; for one range for all.

    Attributes:
        learning_starts: transitions before the first gradient step.
        gradient_steps: per action of all flocks.
        buffer_size: transitions that are kept.
    """

    num_flocks: int = 16
    learning_starts: int = 5000
    gradient_steps: int = 4
    buffer_size: int = 100_000


Args = SearchArgs | PPOArgs | TQCArgs
_TYPES: dict[str, type[Args]] = {"search": SearchArgs, "ppo": PPOArgs, "tqc": TQCArgs}
KINDS: dict[type[Args], str] = {args: kind for kind, args in _TYPES.items()}
"""What a preset calls each learner."""


@dataclass(frozen=True)
class Learner:
    """One way to solve a setting.

    Attributes:
        args: of its runs, but for folder and seed.
        seeds: number of training seeds that the comparison reports.
        note: what is to know about it.
    """

    args: Args
    seeds: int
    note: str = ""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments that runs of all seeds share."""
        own = {"run", "seed", "progress"}
        return {name: value for name, value in dataclasses.asdict(self.args).items() if name not in own}


@dataclass(frozen=True)
class Preset:
    """A file of ``training/configs``.

    Attributes:
        title: what the page calls the row.
        setting: what is to be solved.
        learners: by name.
        explained: the learner whose policy is looked into; empty: none.
    """

    title: str
    setting: Setting
    learners: dict[str, Learner]
    explained: str = ""


@dataclass(frozen=True)
class RunRecord:
    """What a run is made of: enough to repeat it, and to continue it."""

    args: Args
    versions: dict[str, str] = field(default_factory=lambda: versions())

    def write(self, run: Path) -> None:
        """Write the record into the run's folder."""
        args = {**dataclasses.asdict(self.args), "run": run.name}
        document = {"learner": KINDS[type(self.args)], "args": args, "versions": self.versions}
        with atomic_write(run / CONFIG_FILE) as file:
            file.write(json.dumps(document, indent=2).encode() + b"\n")

    @classmethod
    def read(cls, run: Path) -> RunRecord:
        """Read the record of a run.

        Raises:
            FileNotFoundError: if the folder holds no run.
        """
        document = json.loads((run / CONFIG_FILE).read_text())
        args = _args(document["learner"], {**document["args"], "run": run})
        return cls(args, document["versions"])


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    return {"python": python_version(), **{name: version(name) for name in _RECORDED}}


def presets() -> dict[str, Preset]:
    """Return the presets of ``training/configs`` by name."""
    return {
        file.stem: _preset(tomllib.loads(file.read_text()), file.stem)
        for file in sorted(PRESETS.glob("*.toml"))
    }


def train_presets() -> dict[str, Args]:
    """Return the arguments of every learner of every preset; each trains into ``runs/<preset>-<learner>``."""
    return {
        f"{name}-{learner}": entry.args
        for name, chosen in presets().items()
        for learner, entry in chosen.learners.items()
    }


def train_descriptions() -> dict[str, str]:
    """Return a line about every entry of ``train_presets``."""
    return {
        f"{name}-{learner}": "; ".join(filter(None, (chosen.title, KINDS[type(entry.args)], entry.note)))
        for name, chosen in presets().items()
        for learner, entry in chosen.learners.items()
    }


def _preset(document: dict[str, Any], name: str) -> Preset:
    setting = document.get("setting", {})
    learners = {}
    for learner, values in document["learners"].items():
        fields = {**setting, "run": Path("runs") / f"{name}-{learner}", **values}
        seeds, note, kind = fields.pop("seeds", 0), fields.pop("note", ""), fields.pop("kind")
        learners[learner] = Learner(_args(kind, fields), seeds, note)
    return Preset(document["title"], Setting(**setting), learners, document.get("explained", ""))


def _args(kind: str, values: dict[str, Any]) -> Args:
    """Build arguments from a document, where tuples are lists."""
    fields: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
    return _TYPES[kind](**fields)
