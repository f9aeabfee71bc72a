"""MAPPO or IPPO of BenchMARL trains one policy that all agents share; each agent sets its own range.

```
pip install "flockesc-env[benchmarl]"
python examples/benchmarl_mappo.py --iterations 20
```
"""

import time
from pathlib import Path
from typing import Literal

import torch
import tyro
from benchmarl.algorithms import IppoConfig, MappoConfig
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models import DeepsetsConfig, MlpConfig
from tensordict import TensorDict
from torchrl.envs import PettingZooWrapper
from torchrl.envs.utils import ExplorationType, MarlGroupMapType, set_exploration_type

from flockesc_env import FixedRange, parallel_env, rollout
from flockesc_env.benchmarl import FlockTask, FlockTaskClass

AGENTS, STEPS = 300, 60  # agents of the paper's flock; actions of an episode
BEST_FIXED_RANGE = 12.0  # in m, chosen on other flocks than the held-out ones


class Learned:
    """The policy of an experiment, without exploration, as a policy of ``rollout``."""

    per_agent = True

    def __init__(self, experiment):
        self.policy = experiment.policy

    def act(self, observations, spec):
        """Return the action of every observation row."""
        rows = torch.from_numpy(observations).unflatten(0, (-1, spec.num_agents))
        flocks = TensorDict({"agents": {"observation": rows}}, rows.shape[:1])
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            return self.policy(flocks)["agents", "action"].flatten(0, 1).numpy()


class PettingZooTask(FlockTaskClass):
    """The same task through PettingZoo's dicts of agents, for comparison."""

    def get_env_fun(self, num_envs, continuous_actions, seed, device):  # noqa: ARG002
        """Return a function that makes an environment of one flock."""
        groups = MarlGroupMapType.ALL_IN_ONE_GROUP
        return lambda: PettingZooWrapper(parallel_env(**self.config), group_map=groups, use_mask=False)

    @staticmethod
    def log_info(_):
        """Return no logs."""
        return {}


def networks(algorithm):
    """Return the configurations of the algorithm, its actor and its critic."""
    actor, local_critic, critic = (
        Config.get_from_yaml() for Config in (MlpConfig, MlpConfig, DeepsetsConfig)
    )
    actor.num_cells = local_critic.num_cells = [32, 32]
    critic.local_nn_num_cells = critic.global_nn_num_cells = [32, 32]
    critic.aggr, critic.out_features_local_nn = "mean", 32
    if algorithm == "ippo":  # the critic sees the observation of its agent
        return IppoConfig.get_from_yaml(), actor, local_critic
    return (
        MappoConfig.get_from_yaml(),
        actor,
        critic,
    )  # the critic sees the observations of all agents as a set


def main(
    iterations: int = 20,
    flocks: int = 8,
    seed: int = 0,
    held_out: int = 200,
    algorithm: Literal["mappo", "ippo"] = "mappo",
    interface: Literal["flocks", "pettingzoo"] = "flocks",
    folder: Path = Path("runs"),
) -> None:
    """Train, and compare with the best fixed range on held-out flocks.

    Args:
        iterations: number of iterations, each of one episode per flock.
        flocks: number of flocks.
        seed: seed of the training run.
        held_out: number of flocks of the comparison.
        algorithm: ``"mappo"``: a critic of the flock; ``"ippo"``: a critic of each agent.
        interface: ``"flocks"``: all flocks at once; ``"pettingzoo"``: dicts of agents, many times slower.
        folder: folder for the logs of BenchMARL.
    """
    torch.set_num_threads(1)  # the networks are small
    folder.mkdir(exist_ok=True)
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames, config.max_n_iters = None, iterations
    config.on_policy_n_envs_per_worker = flocks
    config.on_policy_collected_frames_per_batch = flocks * STEPS  # a frame holds all agents of a flock
    config.on_policy_minibatch_size = 54  # 16,200 samples
    config.on_policy_n_minibatch_iters = 5
    config.lr, config.gamma = 1e-3, 0.98
    config.evaluation, config.loggers, config.save_folder = False, ["csv"], str(folder)
    ppo, actor, critic = networks(algorithm)
    ppo.lmbda = 0.95
    task = FlockTask.PER_AGENT_VISIBLE.get_task()
    if interface == "pettingzoo":
        task = PettingZooTask(task.name, task.config)
    experiment = Experiment(task, ppo, actor, seed, config, critic_model_config=critic)
    start = time.process_time()
    experiment.run()
    seconds, count = time.process_time() - start, iterations * flocks * AGENTS * STEPS
    print(f"{count} samples in {seconds:.1f} s of CPU time, {count / seconds:.0f} samples/s")

    options = {name: value for name, value in task.config.items() if name != "scenario"}
    flock_seeds = range(2_000_000, 2_000_000 + held_out)
    learned = rollout("paper-flock", Learned(experiment), flock_seeds, **options)
    fixed = rollout("paper-flock", FixedRange(BEST_FIXED_RANGE), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")


if __name__ == "__main__":
    tyro.cli(main)
