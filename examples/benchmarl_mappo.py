"""MAPPO, IPPO, IQL or QMIX of BenchMARL trains one policy that all agents share; each sets its own range.

```
pip install "flockesc-env[benchmarl]"
python examples/benchmarl_mappo.py --task per-agent-local --algorithm ippo --iterations 45
```
"""

import time
from pathlib import Path
from typing import Literal

import torch
import tyro
from benchmarl.algorithms import IppoConfig, IqlConfig, MappoConfig, QmixConfig
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models import DeepsetsConfig, MlpConfig
from torchrl.envs import ClipTransform, PettingZooWrapper, RewardScaling
from torchrl.envs.utils import MarlGroupMapType
from torchrl.modules import MultiAgentMLP

from flockesc_env import FixedRange, parallel_env, rollout, save_policy, tasks
from flockesc_env.benchmarl import FlockTaskClass
from flockesc_env.policies import torch_network

RANGES = (0.0, 5.0, 10.0, 15.0, 20.0)  # in m, of the discrete actions of IQL and QMIX
ALGORITHMS = {"mappo": MappoConfig, "ippo": IppoConfig, "iql": IqlConfig, "qmix": QmixConfig}
AGENTS, STEPS = 300, 60  # agents of the paper's flock; actions of an episode
MINIBATCH = 20  # frames: 6000 samples


class ScaledTask(FlockTaskClass):
    """The task with scaled rewards, which the critic learns faster, and with clipped actions."""

    def get_env_transforms(self, env):  # noqa: ARG002
        """Return the transforms of the environment."""
        transforms = [RewardScaling(loc=0.0, scale=0.1, in_keys=[("agents", "reward")])]
        if "range_grid" not in self.config:
            transforms.append(ClipTransform(in_keys_inv=[("agents", "action")], low=-1.0, high=1.0))
        return transforms


class PettingZooTask(ScaledTask):
    """The same task through PettingZoo's dicts of agents, for comparison."""

    def get_env_fun(self, num_envs, continuous_actions, seed, device):  # noqa: ARG002
        """Return a function that makes an environment of one flock."""
        groups = MarlGroupMapType.ALL_IN_ONE_GROUP
        return lambda: PettingZooWrapper(parallel_env(**self.config), group_map=groups, use_mask=False)

    @staticmethod
    def log_info(_):
        """Return no logs."""
        return {}


def networks():
    """Return the networks of the policy, of a critic of an agent and of a critic of the flock."""
    policy, critic, flock_critic = (
        Config.get_from_yaml() for Config in (MlpConfig, MlpConfig, DeepsetsConfig)
    )
    policy.num_cells = critic.num_cells = [32, 32]
    flock_critic.local_nn_num_cells = flock_critic.global_nn_num_cells = [32, 32]
    flock_critic.aggr, flock_critic.out_features_local_nn = "mean", 32
    return policy, critic, flock_critic


def configure(iterations, flocks, folder):
    """Return the configuration of the experiment."""
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames, config.max_n_iters = None, iterations
    config.lr, config.gamma = 1e-3, 0.98
    config.on_policy_n_envs_per_worker = config.off_policy_n_envs_per_worker = flocks
    frames = flocks * STEPS  # a frame holds all agents of a flock
    config.on_policy_collected_frames_per_batch = config.off_policy_collected_frames_per_batch = frames
    config.on_policy_minibatch_size = config.off_policy_train_batch_size = MINIBATCH
    config.on_policy_n_minibatch_iters = 5
    config.off_policy_n_optimizer_steps = 60
    config.off_policy_memory_size = iterations * frames
    config.evaluation, config.loggers, config.save_folder = False, ["csv"], str(folder)
    return config


def main(
    task: str = "per-agent-visible",
    algorithm: Literal["mappo", "ippo", "iql", "qmix"] = "mappo",
    iterations: int = 45,
    flocks: int = 4,
    seed: int = 0,
    held_out: int = 200,
    interface: Literal["flocks", "pettingzoo"] = "flocks",
    folder: Path = Path("runs"),
    output: Path | None = None,
) -> None:
    """Train, and compare with the best fixed range on held-out flocks.

    Args:
        task: name of a task in which every agent sets its range, with its options and reward.
        algorithm: ``"mappo"``: a critic of the flock; ``"ippo"``: a critic of each agent; ``"iql"``: Q values
            of each agent for a few ranges; ``"qmix"``: the same with a mixing network.
        iterations: number of iterations, each of one episode per flock.
        flocks: number of flocks.
        seed: seed of the training run.
        held_out: number of flocks of the comparison.
        interface: ``"flocks"``: all flocks at once; ``"pettingzoo"``: dicts of agents, many times slower.
        folder: folder for the logs of BenchMARL.
        output: file for the trained policy.
    """
    torch.set_num_threads(1)  # the networks are small
    folder.mkdir(exist_ok=True)
    policy, critic, flock_critic = networks()
    chosen = tasks[task]
    learner, ranges = ALGORITHMS[algorithm].get_from_yaml(), ()
    # The reward of PPO: that of the flock where agents see the predator within 30 m (docs/train.md).
    options = {"reward": chosen.reward, **chosen.options, **chosen.learner("ppo").options}
    if algorithm in ("mappo", "ippo"):
        learner.lmbda, learner.use_tanh_normal = 0.95, False
    else:
        options |= {"action_mode": "discrete", "range_grid": RANGES}
        ranges = RANGES
    task_class = ScaledTask if interface == "flocks" else PettingZooTask
    experiment = Experiment(
        task_class(task, {"scenario": chosen.scenario, **options}),
        learner,
        policy,
        seed,
        configure(iterations, flocks, folder),
        critic_model_config=flock_critic if algorithm == "mappo" else critic,
    )
    start = time.process_time()
    experiment.run()
    seconds, count = time.process_time() - start, iterations * flocks * AGENTS * STEPS
    print(f"{count} samples in {seconds:.1f} s of CPU time, {count / seconds:.0f} samples/s")

    mlp = next(part for part in experiment.policy.modules() if isinstance(part, MultiAgentMLP))
    inputs = parallel_env(chosen.scenario, **options).policy_spec.layout.names
    network = torch_network(mlp.get_stateful_net(), inputs, ranges=ranges)
    if output:
        known = {"per_agent": True, "scenario": chosen.scenario, **options}
        save_policy(network.with_options(name=f"BenchMARL {algorithm}", **known), output)
    flock_seeds = range(2_000_000, 2_000_000 + held_out)
    learned = rollout(chosen.scenario, network, flock_seeds, per_agent=True, **options)
    fixed = rollout(chosen.scenario, FixedRange(chosen.best_fixed_range), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")


if __name__ == "__main__":
    tyro.cli(main)
