"""BenchMARL tasks: every agent of a flock under attack sets its own interaction range."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from flockesc_env.common.extras import require

require("benchmarl", ["benchmarl"])
import yaml  # noqa: E402, after the check
from benchmarl.environments import Task, TaskClass  # noqa: E402
from tensordict import TensorDictBase  # noqa: E402
from torchrl.data import Composite  # noqa: E402
from torchrl.envs import EnvBase  # noqa: E402

from flockesc_env.torchrl import GROUP, INFO, FlockTorchRLEnv  # noqa: E402

CONFIGS: Final = Path(__file__).parent


class FlockTaskClass(TaskClass):
    """A flock under attack as a BenchMARL task.

    The entries of ``config`` are keyword arguments of ``FlockTorchRLEnv``: a scenario and options.
    BenchMARL's ``prefer_continuous_actions`` decides between normalized and discrete actions. A list of
    scenarios needs as many flocks in training as in evaluation (``evaluation_episodes``).

    The logs contain the objectives (``collection/info/min_mean_distance``, ..) of the episodes that ended.
    """

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], EnvBase]:
        mode = "normalized" if continuous_actions else "discrete"
        arguments = {"action_mode": mode, **self.config}

        def make() -> FlockTorchRLEnv:
            env = FlockTorchRLEnv(num_envs, device=device, **arguments)
            env.set_seed(seed)
            return env

        return make

    def supports_continuous_actions(self) -> bool:
        return True

    def supports_discrete_actions(self) -> bool:
        return True

    def max_steps(self, env: EnvBase) -> int:
        return int(env.policy_spec.num_actions)

    def has_render(self, env: EnvBase) -> bool:  # noqa: ARG002
        return False  # BenchMARL does not record videos of flocks

    def group_map(self, env: EnvBase) -> dict[str, list[str]]:
        return dict(env.group_map)

    def observation_spec(self, env: EnvBase) -> Composite:
        group = env.full_observation_spec_unbatched[GROUP]
        return Composite({GROUP: Composite(observation=group["observation"].clone(), shape=group.shape)})

    def action_spec(self, env: EnvBase) -> Composite:
        return env.full_action_spec_unbatched

    def action_mask_spec(self, env: EnvBase) -> None:
        """Return None: every action is allowed."""

    def state_spec(self, env: EnvBase) -> None:
        """Return None: centralized critics see the observations of all agents."""

    def info_spec(self, env: EnvBase) -> None:
        """Return None: the group has no info."""

    @staticmethod
    def env_name() -> str:
        return "flockesc"

    @staticmethod
    def log_info(batch: TensorDictBase) -> dict[str, float]:
        ended = batch["next", "done"]
        infos = {f"collection/info/{name}": batch["next", "info", name][ended] for name in INFO}
        return {name: values.mean().item() for name, values in infos.items() if len(values)}


class FlockTask(Task):
    """All settings of ``docs/findings.md`` with one range per agent, as tasks of the same options.

    The reward of all tasks is ``"individual_running_minimum"``. Learners of the page can have other options
    (``max_range``, ``steps_per_action``) than their setting.

    ``FlockTask.PER_AGENT_VISIBLE.get_task()`` returns the task of the file ``per_agent_visible.yaml``;
    ``get_task(config)`` one with another scenario and other options.
    """

    PER_AGENT_VISIBLE = None
    PER_AGENT_VISIBLE_MINIMUM = None
    PER_AGENT_LOCAL = None
    PER_AGENT_LOCAL_MINIMUM = None
    PER_AGENT_VISIBLE_DERIVED = None
    PER_AGENT_VISIBLE_PROFILE = None
    STEERING_PREDATOR = None

    @staticmethod
    def associated_class() -> type[TaskClass]:
        return FlockTaskClass

    def get_from_yaml(self, path: str | None = None) -> TaskClass:
        """Return the task of a yaml file; ``None``: the task's own file."""
        file = CONFIGS / f"{self.name.lower()}.yaml" if path is None else Path(path)
        return self.get_task(yaml.safe_load(file.read_text("utf-8")))
