"""MAPPO of BenchMARL trains one policy that all agents share; each agent sets its own range.

```
pip install "flockesc-env[benchmarl]"
python examples/benchmarl_mappo.py --iterations 45
```
"""

import time
from pathlib import Path

import torch
import tyro
from benchmarl.algorithms import MappoConfig
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models import DeepsetsConfig, MlpConfig
from tensordict import TensorDict
from torchrl.envs.utils import ExplorationType, set_exploration_type

from flockesc_env import FixedRange, rollout
from flockesc_env.benchmarl import FlockTask

AGENTS = 300  # of the paper's flock
STEPS = 60  # actions of an episode: 240 model steps, 4 per action
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


def make_experiment(task, iterations, flocks, seed, folder):
    """Return an experiment with MAPPO: the critic sees the observations of all agents as a set."""
    folder.mkdir(exist_ok=True)
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames, config.max_n_iters = None, iterations
    config.on_policy_n_envs_per_worker = flocks
    config.on_policy_collected_frames_per_batch = flocks * STEPS  # a frame holds all agents of a flock
    config.on_policy_minibatch_size = 27  # 8,100 samples
    config.on_policy_n_minibatch_iters = 5
    config.lr, config.gamma = 1e-3, 0.98
    config.evaluation, config.loggers, config.save_folder = False, ["csv"], str(folder)
    mappo = MappoConfig.get_from_yaml()
    mappo.lmbda = 0.95
    actor, critic = MlpConfig.get_from_yaml(), DeepsetsConfig.get_from_yaml()
    actor.num_cells = critic.local_nn_num_cells = critic.global_nn_num_cells = [32, 32]
    critic.aggr, critic.out_features_local_nn = "mean", 32
    return Experiment(task, mappo, actor, seed, config, critic_model_config=critic)


def main(
    iterations: int = 45, flocks: int = 4, seed: int = 0, held_out: int = 200, folder: Path = Path("runs")
) -> None:
    """Train, and compare with the best fixed range on held-out flocks.

    Args:
        iterations: number of iterations of MAPPO, each of one episode per flock.
        flocks: number of flocks.
        seed: seed of the training run.
        held_out: number of flocks of the comparison.
        folder: folder for the logs of BenchMARL.
    """
    torch.set_num_threads(1)  # the networks are small
    task = FlockTask.PER_AGENT_VISIBLE.get_task()
    experiment = make_experiment(task, iterations, flocks, seed, folder)
    start = time.process_time()
    experiment.run()
    seconds, samples = time.process_time() - start, iterations * flocks * STEPS * AGENTS
    print(f"{samples} samples in {seconds:.1f} s of CPU time, {samples / seconds:.0f} samples/s")

    options = {name: value for name, value in task.config.items() if name not in {"scenario", "reward"}}
    flock_seeds = range(2_000_000, 2_000_000 + held_out)
    learned = rollout("paper-flock", Learned(experiment), flock_seeds, **options)
    fixed = rollout("paper-flock", FixedRange(BEST_FIXED_RANGE), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")


if __name__ == "__main__":
    tyro.cli(main)
