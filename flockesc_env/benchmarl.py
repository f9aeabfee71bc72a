"""BenchMARL tasks: every agent of a flock under attack sets its own interaction range."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from flockesc_env.common.extras import require

require("benchmarl", ["benchmarl"])
import yaml  # noqa: E402, after the check
from benchmarl.environments import Task, TaskClass  # noqa: E402
from tensordict import TensorDictBase  # noqa: E402
from torchrl.data import Composite  # noqa: E402
from torchrl.envs import EnvBase  # noqa: E402

from flockesc_env.taskset.task import tasks  # noqa: E402
from flockesc_env.torchrl import GROUP, INFO, FlockTorchRLEnv  # noqa: E402


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


class _FlockTask(Task):
    """Base class of ``FlockTask``; BenchMARL calls members of an enumeration tasks."""

    @staticmethod
    def associated_class() -> type[TaskClass]:
        return FlockTaskClass

    def get_from_yaml(self, path: str | None = None) -> TaskClass:
        """Return the task of a yaml file; ``None``: the task itself."""
        if path is not None:
            return self.get_task(yaml.safe_load(Path(path).read_text("utf-8")))
        task = tasks[self.name.lower().replace("_", "-")]
        return self.get_task({"scenario": task.scenario, "reward": task.reward, **task.options})


_NAMES = [name.upper().replace("-", "_") for name, task in tasks.items() if task.per_agent]
FlockTask: Any = _FlockTask("FlockTask", dict.fromkeys(_NAMES), module=__name__)
"""The tasks with one range per agent, with their options and reward.

``FlockTask.PER_AGENT_VISIBLE.get_task()`` returns a task; ``get_task(config)`` one with another scenario and
other options, the keyword arguments of ``FlockTorchRLEnv``.
"""
