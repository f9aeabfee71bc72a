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

PRESETS = Path(__file__).parent / "configs"
CONFIG_FILE = "config.json"
POLICY_FILE = "policy.npz"
CURVE_FILE = "curve.parquet"
_RECORDED = (
    *("cmaes", "flockesc-env", "gymnasium", "numpy", "pettingzoo", "sb3-contrib", "stable-baselines3", "torch"),
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
    """CMA-ES over the parameters of a small network, on the objective itself.

    Attributes:
        inputs: entries of the observation that the network sees; none: all. With ``time`` alone the network
            is an open-loop schedule.
        hidden: hidden layers of the network.
        memory: numbers that the network hands from one action to the next.
        population: networks per generation.
        flocks: flocks that every network of a generation plays, the same for all.
        generations: how many.
        step_size: first standard deviation of the parameters.
    """

    inputs: tuple[str, ...] = ()
    hidden: tuple[int, ...] = (8,)
    memory: int = 0
    population: int = 16
    flocks: int = 16
    generations: int = 200
    step_size: float = 0.5


@dataclass(frozen=True, kw_only=True)
class PPOArgs(TrainArgs):
    """PPO of stable-baselines3.

    Attributes:
        reward: what training pays; reports always use the objective itself.
        num_flocks: flocks stepped together.
        num_episodes: episodes of every flock.
        batch_size: rows per gradient step.
        n_epochs: passes over a rollout, which is one episode of every flock.
        learning_rate: of Adam.
        gamma: discount per action.
        gae_lambda: of the advantage estimate.
        clip_range: of PPO.
        ent_coef: weight of the entropy bonus.
        net_arch: hidden layers of policy and value network.
        log_std_init: logarithm of the first standard deviation of actions.
        torch_threads: threads of torch.
    """

    reward: str = "running_minimum"
    num_flocks: int = 4
    num_episodes: int = 100
    batch_size: int = 8000
    n_epochs: int = 5
    learning_rate: float = 5e-4
    gamma: float = 0.9
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    net_arch: tuple[int, ...] = (32, 32)
    log_std_init: float = 0.0
    torch_threads: int = 1


@dataclass(frozen=True, kw_only=True)
class TQCArgs(TrainArgs):
    """Truncated quantile critics of sb3-contrib, off-policy; one range for all.

    Attributes:
        reward: what training pays; reports always use the objective itself.
        num_flocks: flocks stepped together.
        num_episodes: episodes of every flock.
        learning_starts: transitions before the first gradient step.
        gradient_steps: per action of all flocks.
        batch_size: rows per gradient step.
        learning_rate: of Adam.
        gamma: discount per action.
        net_arch: hidden layers of policy and value networks.
        torch_threads: threads of torch.
    """

    reward: str = "running_minimum"
    num_flocks: int = 16
    num_episodes: int = 100
    learning_starts: int = 5000
    gradient_steps: int = 4
    batch_size: int = 256
    learning_rate: float = 5e-4
    gamma: float = 0.99
    net_arch: tuple[int, ...] = (64, 64)
    torch_threads: int = 1


Args = SearchArgs | PPOArgs | TQCArgs
_KINDS: dict[str, type[Args]] = {"search": SearchArgs, "ppo": PPOArgs, "tqc": TQCArgs}


@dataclass(frozen=True)
class Learner:
    """One way to solve a setting.

    Attributes:
        args: of its runs, but for folder and seed.
        seeds: training seeds that the comparison reports.
    """

    args: Args
    seeds: int


@dataclass(frozen=True)
class Preset:
    """A file of ``training/configs``.

    Attributes:
        title: what the page calls the row.
        setting: what is to be solved.
        learners: by name.
    """

    title: str
    setting: Setting
    learners: dict[str, Learner]


@dataclass(frozen=True)
class RunRecord:
    """What a run is made of: enough to repeat it, and to continue it."""

    args: Args
    versions: dict[str, str] = field(default_factory=lambda: versions())

    def write(self, run: Path) -> None:
        """Write the record into the run's folder."""
        kind = next(kind for kind, args in _KINDS.items() if type(self.args) is args)
        args = {**dataclasses.asdict(self.args), "run": run.name}
        document = {"learner": kind, "args": args, "versions": self.versions}
        (run / CONFIG_FILE).write_text(json.dumps(document, indent=2) + "\n")

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
    return {file.stem: _preset(tomllib.loads(file.read_text()), file.stem) for file in sorted(PRESETS.glob("*.toml"))}


def train_presets() -> dict[str, Args]:
    """Return the arguments of every learner of every preset; each trains into ``runs/<preset>-<learner>``."""
    return {
        f"{name}-{learner}": entry.args
        for name, chosen in presets().items()
        for learner, entry in chosen.learners.items()
    }


def _preset(document: dict[str, Any], name: str) -> Preset:
    setting = document.get("setting", {})
    learners = {}
    for learner, values in document["learners"].items():
        fields = {**setting, "run": Path("runs") / f"{name}-{learner}", **values}
        seeds, kind = fields.pop("seeds", 0), fields.pop("kind")
        learners[learner] = Learner(_args(kind, fields), seeds)
    return Preset(document["title"], Setting(**setting), learners)


def _args(kind: str, values: dict[str, Any]) -> Args:
    """Build arguments from a document, where tuples are lists."""
    return _KINDS[kind](**{k: tuple(v) if isinstance(v, list) else v for k, v in values.items()})
