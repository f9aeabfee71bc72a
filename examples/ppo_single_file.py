"""PPO in one file, in the style of CleanRL: torch, NumPy and a slot per agent.

All agents share one policy; each sets its own range.

```
pip install flockesc-env torch
python examples/ppo_single_file.py --iterations 45
```
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
import tyro
from gymnasium.wrappers.vector import NormalizeReward
from torch import nn
from torch.distributions import Normal

from flockesc_env import FixedRange, FlockScenario, parallel_env, rollout, save_policy
from flockesc_env.policies import torch_network

OPTIONS: dict[str, Any] = {
    "reward": "individual",
    "predator_sensing_range": math.inf,
    "max_range": 20.0,
    "steps_per_action": 4,
}
AGENTS = 300  # of the paper's flock
BEST_FIXED_RANGE = 12.0  # in m, chosen on other flocks than the held-out ones


@dataclass
class Args:
    """Hyperparameters.

    Attributes:
        iterations: number of iterations, each a rollout and its updates.
        flocks: number of flocks, with one slot per agent.
        seed: seed of the networks, of the actions and of the flocks.
        held_out: number of flocks of the final comparison.
        output: file for the trained policy.
        num_steps: actions of a slot per iteration; 60 are one episode.
        learning_rate: learning rate of Adam, which falls linearly to 0.
        gamma: discount factor.
        gae_lambda: lambda of the generalized advantage estimate.
        minibatch_size: number of samples per gradient step.
        epochs: passes over the samples of a rollout.
        clip: clipping parameter of the surrogate objective.
        value_weight: weight of the value loss.
        max_gradient: largest norm of a gradient.
    """

    iterations: int = 45
    flocks: int = 4
    seed: int = 0
    held_out: int = 200
    output: Path | None = None
    num_steps: int = 60
    learning_rate: float = 1e-3
    gamma: float = 0.98
    gae_lambda: float = 0.95
    minibatch_size: int = 6000
    epochs: int = 5
    clip: float = 0.2
    value_weight: float = 0.5
    max_gradient: float = 0.5


def _network(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    layers = nn.Linear(inputs, 32), nn.Linear(32, 32), nn.Linear(32, outputs)
    for layer, layer_gain in zip(layers, (2**0.5, 2**0.5, gain), strict=True):
        nn.init.orthogonal_(layer.weight, layer_gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])


class Agent(nn.Module):
    """Actor and critic."""

    def __init__(self, entries: int) -> None:
        super().__init__()
        self.actor_mean = _network(entries, 1, 0.01)
        self.critic = _network(entries, 1, 1.0)
        self.actor_log_std = nn.Parameter(torch.zeros(1))

    def value(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the value of every row."""
        values: torch.Tensor = self.critic(observations)[:, 0]
        return values

    def distribution(self, observations: torch.Tensor) -> Normal:
        """Return the distribution of the actions."""
        return Normal(self.actor_mean(observations), self.actor_log_std.exp())


class Rollout:
    """The samples of one iteration: tensors of shape (num_steps, slots, ...)."""

    def __init__(self, num_steps: int, slots: int, entries: int) -> None:
        self.observations = torch.zeros(num_steps, slots, entries)
        self.actions = torch.zeros(num_steps, slots, 1)
        self.log_probs = torch.zeros(num_steps, slots)
        self.rewards = torch.zeros(num_steps, slots)
        self.values = torch.zeros(num_steps, slots)
        self.next_values = torch.zeros(num_steps, slots)  # of the observation after the step
        self.ends = torch.zeros(num_steps, slots)  # 1 where the episode ended in the step

    @torch.no_grad()
    def collect(self, envs: Any, agent: Agent, observation: torch.Tensor) -> torch.Tensor:
        """Fill all tensors and return the next observation.

        With ``SameStep`` the observation after an end is the first of the next episode. The last one of an
        episode is in ``final_obs``: its value is bootstrapped if the episode was truncated.
        """
        for step in range(len(self.rewards)):
            distribution = agent.distribution(observation)
            action = distribution.sample()
            self.observations[step] = observation
            self.actions[step] = action
            self.log_probs[step] = distribution.log_prob(action)[:, 0]
            self.values[step] = agent.value(observation)
            rows, rewards, terminations, truncations, infos = envs.step(action.clamp(-1, 1).numpy())
            self.rewards[step] = torch.from_numpy(rewards)
            self.ends[step] = torch.from_numpy(terminations | truncations)
            observation = torch.from_numpy(rows)
            self.next_values[step] = agent.value(observation)
            if truncations.any():
                last = torch.from_numpy(np.stack(infos["final_obs"][truncations]))
                self.next_values[step, truncations] = agent.value(last)
            self.next_values[step, terminations] = 0.0
        return observation

    def advantages(self, gamma: float, gae_lambda: float) -> torch.Tensor:
        """Return the generalized advantage estimates, shape (num_steps, slots)."""
        errors = self.rewards + gamma * self.next_values - self.values
        advantages = torch.zeros_like(errors)
        running = torch.zeros(errors.shape[1])
        for step in reversed(range(len(errors))):
            running = errors[step] + gamma * gae_lambda * (1 - self.ends[step]) * running
            advantages[step] = running
        return advantages


def update(args: Args, agent: Agent, optimizer: torch.optim.Optimizer, samples: Rollout) -> None:
    """Take the gradient steps of one iteration."""
    estimates = samples.advantages(args.gamma, args.gae_lambda)
    returns = (estimates + samples.values).flatten()
    advantages, log_probs = estimates.flatten(), samples.log_probs.flatten()
    observations, actions = samples.observations.flatten(0, 1), samples.actions.flatten(0, 1)
    for _ in range(args.epochs):
        for batch in torch.randperm(len(returns)).split(args.minibatch_size):
            advantage = advantages[batch]
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            log_prob = agent.distribution(observations[batch]).log_prob(actions[batch])[:, 0]
            ratio = (log_prob - log_probs[batch]).exp()
            clipped = ratio.clamp(1 - args.clip, 1 + args.clip)
            policy_loss = -torch.min(advantage * ratio, advantage * clipped).mean()
            value_loss = (agent.value(observations[batch]) - returns[batch]).square().mean()
            optimizer.zero_grad()
            (policy_loss + args.value_weight * value_loss).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), args.max_gradient)
            optimizer.step()


def train(args: Args) -> Agent:
    """Train and return the agent."""
    torch.set_num_threads(1)  # the network is small
    torch.manual_seed(args.seed)
    slots = AGENTS * args.flocks
    envs = gymnasium.make_vec(
        "flockesc_env:flockesc/FlockAgents-v1",
        num_envs=slots,
        autoreset_mode="SameStep",
        **OPTIONS,
    )
    scaled = NormalizeReward(envs, gamma=args.gamma)
    observation = torch.from_numpy(scaled.reset(seed=args.seed)[0])
    entries = observation.shape[1]
    agent, samples = Agent(entries), Rollout(args.num_steps, slots, entries)
    optimizer = torch.optim.Adam(agent.parameters(), eps=1e-5)
    start = time.process_time()
    for iteration in range(args.iterations):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1 - iteration / args.iterations)
        observation = samples.collect(scaled, agent, observation)
        update(args, agent, optimizer, samples)
    seconds, count = time.process_time() - start, args.iterations * args.num_steps * slots
    print(f"{count} samples in {seconds:.1f} s of CPU time, {count / seconds:.0f} samples/s")
    return agent


def main(args: Args) -> None:
    """Train, and compare with the best fixed range on held-out flocks."""
    layers = train(args).actor_mean
    policy = torch_network(layers, parallel_env(**OPTIONS).policy_spec.layout.names)
    if args.output:
        known = {"per_agent": True, "scenario": FlockScenario(), **OPTIONS}
        save_policy(policy.with_options(name="PPO in one file", **known), args.output)
    flock_seeds = range(2_000_000, 2_000_000 + args.held_out)
    learned = rollout("paper-flock", policy, flock_seeds, per_agent=True, **OPTIONS)
    fixed = rollout("paper-flock", FixedRange(BEST_FIXED_RANGE), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / args.held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")


if __name__ == "__main__":
    main(tyro.cli(Args))
