"""Arguments of a training run: one flat dataclass, TOML presets, and the record beside the model."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from platform import python_version
from typing import Any, Literal

from flockesc_env import EnvOptions, FlockScenario

PRESETS = Path(__file__).parent / "configs"
CONFIG_FILE = "config.json"
_RECORDED = ("flockesc-env", "gymnasium", "numpy", "pettingzoo", "stable-baselines3", "torch")


@dataclass(frozen=True, kw_only=True)
class TrainArgs:
    """Arguments of ``train``; a preset sets them, the command line changes them.

    Attributes:
        run: folder of the run: model, checkpoints, TensorBoard logs, configuration.
        seed: seed of the weights, of the exploration and of the first flocks.
        per_agent: one range per agent, with one policy shared by all, or one range per flock.
        predator_visible: whether observations show the predator at any distance.
        objective: the distance that is to be kept large.
        reward: what training pays; reports always use the objective itself.
        action_mode: how actions set ranges.
        max_range: largest range in m.
        steps_per_action: model steps per action.
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
        log_std_init: logarithm of the first standard deviation of continuous actions.
        checkpoint_every: rollouts between checkpoints; 0: none.
        torch_threads: threads of torch.
        progress: whether to show a progress bar.
    """

    run: Path
    seed: int = 0
    per_agent: bool = True
    predator_visible: bool = True
    objective: Literal["mean", "minimum"] = "mean"
    reward: Literal["running_minimum", "distance", "own_distance", "own_distance_change", "terminal"] = (
        "running_minimum"
    )
    action_mode: Literal["normalized", "range", "discrete"] = "normalized"
    max_range: float = 20.0
    steps_per_action: int = 4
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
    checkpoint_every: int = 25
    torch_threads: int = 1
    progress: bool = True

    def env_options(self) -> EnvOptions:
        """Return the options of the environment that is trained in."""
        return EnvOptions(
            action_mode=self.action_mode,
            max_range=self.max_range,
            steps_per_action=self.steps_per_action,
            objective=self.objective,
            reward=self.reward,
            predator_sensing_range=None if self.predator_visible else "predator_range",
        )


@dataclass(frozen=True)
class RunRecord:
    """What a finished run is made of: enough to repeat it, and to use its model rightly."""

    args: TrainArgs
    scenario: FlockScenario
    versions: dict[str, str] = field(default_factory=lambda: versions())

    def write(self, run: Path) -> None:
        """Write the record into the run's folder."""
        document = {
            "args": {**dataclasses.asdict(self.args), "run": run.name},
            "scenario": json.loads(self.scenario.to_json()),
            "versions": self.versions,
        }
        (run / CONFIG_FILE).write_text(json.dumps(document, indent=2) + "\n")

    @classmethod
    def read(cls, run: Path) -> RunRecord:
        """Read the record of a run.

        Raises:
            FileNotFoundError: if the folder holds no run.
        """
        document = json.loads((run / CONFIG_FILE).read_text())
        args = _train_args({**document["args"], "run": run})
        scenario = FlockScenario.from_json(json.dumps(document["scenario"]))
        return cls(args, scenario, document["versions"])


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    return {"python": python_version(), **{name: version(name) for name in _RECORDED}}


def presets() -> dict[str, TrainArgs]:
    """Return the presets of ``training/configs`` by name; each trains into ``runs/<name>``."""
    files = sorted(PRESETS.glob("*.toml"))
    return {
        file.stem: _train_args({"run": Path("runs") / file.stem, **tomllib.loads(file.read_text())})
        for file in files
    }


def _train_args(values: dict[str, Any]) -> TrainArgs:
    return TrainArgs(**{**values, "net_arch": tuple(values.get("net_arch", TrainArgs.net_arch))})
