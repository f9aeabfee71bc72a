"""PPO of stable-baselines3 trains one policy that all agents share; each agent sets its own range.

```
pip install "flockesc-env[sb3]" tensorboard
python examples/sb3_ppo.py
tensorboard --logdir runs/sb3_ppo
```
"""

import time
from pathlib import Path

import torch
import tyro
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from flockesc_env import FixedRange, SB3Policy, rollout, save_policy, tasks

TASK = tasks["per-agent-visible"]
HYPERPARAMETERS = TASK.hyperparameters("ppo")  # of flockesc_env/taskset/learners/every-agent.toml


def main(
    iterations: int = 45,
    flocks: int = 4,
    seed: int = 0,
    held_out: int = 200,
    folder: Path = Path("runs/sb3_ppo"),
    output: Path | None = None,
) -> None:
    """Train, and compare with the best fixed range on held-out flocks.

    Args:
        iterations: number of iterations of PPO, each of one episode per flock.
        flocks: number of flocks; each has a slot per agent.
        seed: seed of the training run.
        held_out: number of flocks of the comparison.
        folder: folder of the best model and of the files for TensorBoard.
        output: file for the trained policy.
    """
    torch.set_num_threads(1)  # the network is small
    env = VecNormalize(TASK.vec_env(flocks), norm_obs=False, gamma=HYPERPARAMETERS["gamma"])  # scales rewards
    model = PPO(env=env, seed=seed, device="cpu", tensorboard_log=str(folder), **HYPERPARAMETERS)
    judge = TASK.eval_callback(eval_freq=300, best_model_save_path=folder)  # every five episodes
    start = time.process_time()
    model.learn(iterations * model.n_steps * env.num_envs, callback=judge)
    seconds, count = time.process_time() - start, model.num_timesteps
    print(f"{count} samples in {seconds:.1f} s of CPU time, {count / seconds:.0f} samples/s")
    for samples, objective in judge.history:
        print(f"{samples:>9,} samples: J_mean {objective:.1f} m on {judge.num_flocks} tuning flocks")

    model.set_parameters(folder / "best_model")  # the best of these evaluations, the untrained one included
    policy = SB3Policy(model).network()
    if output:
        save_policy(policy.with_options(name="stable-baselines3 PPO"), output)
    flock_seeds = TASK.seeds[:held_out]
    learned = rollout(policy, flock_seeds)
    best = TASK.scales["paper-flock"].best_fixed_range  # chosen on other flocks
    fixed = rollout(TASK.scenario, FixedRange(best), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")


if __name__ == "__main__":
    tyro.cli(main)
