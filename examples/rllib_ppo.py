"""PPO of RLlib (new API stack) over a slot per agent, or over PettingZoo for policies that differ.

```
pip install flockesc-env "ray[rllib]" torch
python examples/rllib_ppo.py --iterations 45  # four minutes
```

With a slot per agent, RLlib's single-agent runner steps all flocks as one vector environment.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any, Literal

import gymnasium
import ray
import torch
import tyro
from gymnasium.vector import VectorEnv
from gymnasium.wrappers.vector import TransformReward
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune import register_env

from flockesc_env import FixedRange, FlockScenario, parallel_env, rollout, save_policy
from flockesc_env.policies import NetworkPolicy, torch_network

OPTIONS: dict[str, Any] = {
    "reward": "individual",
    "predator_sensing_range": math.inf,
    "max_range": 20.0,
    "steps_per_action": 4,
}
AGENTS, STEPS = 300, 60  # agents of the paper's flock; actions of an episode
BEST_FIXED_RANGE = 12.0  # in m, chosen on other flocks than the held-out ones


def mean_action(module: Any) -> NetworkPolicy:
    """Return the mean of a trained RLModule's distribution as a policy."""
    layers = [*module.encoder.actor_encoder.net.mlp, *module.pi.net.mlp]
    return torch_network(layers, parallel_env(**OPTIONS).policy_spec.layout.names)


def scaled_flock(num_envs: int, **options: Any) -> VectorEnv:
    """Return a slot per agent with scaled rewards, which the critic learns faster."""
    env = gymnasium.make_vec("flockesc/FlockAgents-v1", num_envs, **options)
    return TransformReward(env, lambda rewards: 0.1 * rewards)


def configure(interface: str, iterations: int, flocks: int, seed: int) -> PPOConfig:
    """Return the configuration of PPO."""
    samples = STEPS * AGENTS * flocks  # of an iteration
    config = (
        PPOConfig()
        .env_runners(num_env_runners=0, rollout_fragment_length=STEPS)
        .training(
            train_batch_size_per_learner=samples,
            lr=[[0, 1e-3], [iterations * samples, 0.0]],
            gamma=0.98,
            lambda_=0.95,
            clip_param=0.2,
            vf_clip_param=float("inf"),
            use_kl_loss=False,
            num_epochs=5,
            minibatch_size=6000,
            shuffle_batch_per_epoch=True,
        )
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=[32, 32],
                fcnet_activation="tanh",
                fcnet_kernel_initializer="orthogonal_",
                fcnet_kernel_initializer_kwargs={"gain": 2**0.5},
                head_fcnet_kernel_initializer="orthogonal_",
                head_fcnet_kernel_initializer_kwargs={"gain": 0.01},
                vf_share_layers=False,
                free_log_std=True,
            )
        )
        .debugging(seed=seed)
    )
    if interface == "slots":
        if "ScaledFlock-v0" not in gymnasium.registry:
            gymnasium.register("ScaledFlock-v0", vector_entry_point=scaled_flock)
        return config.environment("ScaledFlock-v0", env_config=OPTIONS).env_runners(
            num_envs_per_env_runner=AGENTS * flocks, gym_env_vectorize_mode="vector_entry_point"
        )
    register_env("flock", lambda _: ParallelPettingZooEnv(parallel_env(**OPTIONS)))
    return (
        config.environment("flock")
        .env_runners(num_envs_per_env_runner=flocks)
        .multi_agent(
            policies={"shared"},
            policy_mapping_fn=lambda *_, **__: "shared",
            count_steps_by="agent_steps",
        )
    )


def main(
    iterations: int = 45,
    flocks: int = 4,
    seed: int = 0,
    held_out: int = 200,
    interface: Literal["slots", "pettingzoo"] = "slots",
    output: Path | None = None,
) -> None:
    """Train, and compare with the best fixed range on held-out flocks.

    Args:
        iterations: number of iterations of PPO, each of one episode per flock.
        flocks: number of flocks.
        seed: seed of the training run.
        held_out: number of flocks of the comparison.
        interface: ``"slots"``: a slot per agent; ``"pettingzoo"``: dicts of agents, many times slower.
        output: file for the trained policy.
    """
    torch.set_num_threads(1)  # the network is small
    ray.init(num_cpus=1, include_dashboard=False)
    algorithm = configure(interface, iterations, flocks, seed).build_algo()
    start = time.process_time()
    for iteration in range(iterations):
        result = algorithm.train()["env_runners"]
        print(f"iteration {iteration + 1}: mean return {result['episode_return_mean']:.2f}")
    seconds, count = time.process_time() - start, iterations * flocks * AGENTS * STEPS
    print(f"{count} samples in {seconds:.1f} s of CPU time, {count / seconds:.0f} samples/s")

    policy = mean_action(algorithm.get_module("default_policy" if interface == "slots" else "shared"))
    if output:
        known = {"per_agent": True, "scenario": FlockScenario(), **OPTIONS}
        save_policy(policy.with_options(name="RLlib PPO", **known), output)
    flock_seeds = range(2_000_000, 2_000_000 + held_out)
    learned = rollout("paper-flock", policy, flock_seeds, per_agent=True, **OPTIONS)
    fixed = rollout("paper-flock", FixedRange(BEST_FIXED_RANGE), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")
    algorithm.stop()
    ray.shutdown()


if __name__ == "__main__":
    tyro.cli(main)
