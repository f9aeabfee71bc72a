"""PPO of TorchRL trains one policy that all agents share; each agent sets its own range.

```
pip install "flockesc-env[torchrl]"
python examples/torchrl_ppo.py --iterations 45
```
"""

import math
import time
from itertools import pairwise
from pathlib import Path
from typing import Literal

import torch
import tyro
from tensordict import TensorDict
from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
from torchrl.envs import (
    ClipTransform,
    Compose,
    PettingZooWrapper,
    RewardScaling,
    SerialEnv,
    TransformedEnv,
)
from torchrl.envs.utils import ExplorationType, MarlGroupMapType, set_exploration_type
from torchrl.modules import IndependentNormal, ProbabilisticActor
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from flockesc_env import FixedRange, FlockScenario, parallel_env, rollout, save_policy
from flockesc_env.policies import torch_network
from flockesc_env.torchrl import FlockTorchRLEnv

OPTIONS = {
    "reward": "individual",
    "predator_sensing_range": math.inf,
    "max_range": 20.0,
    "steps_per_action": 4,
}
AGENTS, STEPS = 300, 60  # agents of the paper's flock; actions of an episode
MINIBATCH = 6000  # samples
REWARD_SCALE = 0.1  # returns are tens of meters; the critic learns numbers near 1 faster
BEST_FIXED_RANGE = 12.0  # in m, chosen on other flocks than the held-out ones


def key(name):
    """Return the key of an entry of the agents."""
    return "agents", name


def network(inputs, outputs, gain):
    """Return a network with two hidden layers and orthogonal weights; the gain is that of the last layer."""
    widths, layers = (inputs, 32, 32, outputs), []
    for pair, layer_gain in zip(pairwise(widths), (2**0.5, 2**0.5, gain), strict=True):
        linear = torch.nn.Linear(*pair)
        torch.nn.init.orthogonal_(linear.weight, layer_gain)
        torch.nn.init.zeros_(linear.bias)
        layers += [linear, torch.nn.Tanh()]
    return torch.nn.Sequential(*layers[:-1])


def make_env(interface, flocks):
    """Return the environment of some flocks; its agents are the group ``"agents"``."""
    if interface == "flocks":
        env = FlockTorchRLEnv(flocks, **OPTIONS)
    else:
        groups = MarlGroupMapType.ALL_IN_ONE_GROUP
        env = SerialEnv(
            flocks, lambda: PettingZooWrapper(parallel_env(**OPTIONS), group_map=groups, use_mask=False)
        )
    rewards = RewardScaling(loc=0.0, scale=REWARD_SCALE, in_keys=[key("reward")])
    actions = ClipTransform(in_keys_inv=[key("action")], low=-1.0, high=1.0)
    return TransformedEnv(env, Compose(rewards, actions))


def train(env, iterations):
    """Train and return the network of the mean action."""
    entries = env.observation_spec[key("observation")].shape[-1]
    mean = network(entries, 1, gain=0.01)
    actor = ProbabilisticActor(
        TensorDictModule(
            torch.nn.Sequential(mean, AddStateIndependentNormalScale(1)),
            [key("observation")],
            [key("loc"), key("scale")],
        ),
        in_keys=[key("loc"), key("scale")],
        out_keys=[key("action")],
        distribution_class=IndependentNormal,
        return_log_prob=True,
        log_prob_key=key("sample_log_prob"),
    )
    critic = TensorDictModule(network(entries, 1, gain=1.0), [key("observation")], [key("state_value")])
    loss = ClipPPOLoss(
        actor,
        critic,
        entropy_coeff=0.0,
        critic_coeff=0.5,
        loss_critic_type="l2",
        normalize_advantage=True,
    )
    names = ("action", "sample_log_prob", "advantage", "value_target", "reward", "done", "terminated")
    loss.set_keys(value=key("state_value"), **{name: key(name) for name in names})
    loss.make_value_estimator(ValueEstimators.GAE, gamma=0.98, lmbda=0.95)
    optimizer = torch.optim.Adam(loss.parameters(), lr=1e-3)
    schedule = torch.optim.lr_scheduler.LinearLR(optimizer, 1.0, 0.0, iterations)
    for iteration in range(iterations):
        with torch.no_grad(), set_exploration_type(ExplorationType.RANDOM):
            data = env.rollout(STEPS, actor)  # one episode of every flock
            loss.value_estimator(data)
        samples = data["agents"].reshape(-1)  # of all agents at all times
        for _ in range(5):
            for indices in torch.randperm(len(samples)).split(MINIBATCH):
                losses = loss(TensorDict({"agents": samples[indices]}, [len(indices)]))
                optimizer.zero_grad()
                (losses["loss_objective"] + losses["loss_critic"]).backward()
                torch.nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
        schedule.step()
        mean_return = data[("next", *key("reward"))].sum(dim=1).mean() / REWARD_SCALE
        print(f"iteration {iteration + 1}: mean return {mean_return:.1f}")
    return mean


def main(
    iterations: int = 45,
    flocks: int = 4,
    seed: int = 0,
    held_out: int = 200,
    interface: Literal["flocks", "pettingzoo"] = "flocks",
    output: Path | None = None,
) -> None:
    """Train, and compare with the best fixed range on held-out flocks.

    Args:
        iterations: number of iterations of PPO, each of one episode per flock.
        flocks: number of flocks.
        seed: seed of the training run.
        held_out: number of flocks of the comparison.
        interface: ``"flocks"``: all flocks at once; ``"pettingzoo"``: dicts of agents, many times slower.
        output: file for the trained policy.
    """
    torch.set_num_threads(1)  # the networks are small
    torch.manual_seed(seed)
    env = make_env(interface, flocks)
    env.set_seed(seed)
    start = time.process_time()
    mean = train(env, iterations)
    seconds, count = time.process_time() - start, iterations * flocks * AGENTS * STEPS
    print(f"{count} samples in {seconds:.1f} s of CPU time, {count / seconds:.0f} samples/s")

    policy = torch_network(mean, parallel_env(**OPTIONS).policy_spec.layout.names)
    if output:
        known = {"per_agent": True, "scenario": FlockScenario(), **OPTIONS}
        save_policy(policy.with_options(name="TorchRL PPO", **known), output)
    flock_seeds = range(2_000_000, 2_000_000 + held_out)
    learned = rollout("paper-flock", policy, flock_seeds, per_agent=True, **OPTIONS)
    fixed = rollout("paper-flock", FixedRange(BEST_FIXED_RANGE), flock_seeds)
    gains = learned.min_mean_distance - fixed.min_mean_distance
    error = 1.96 * gains.std(ddof=1) / held_out**0.5
    low, high = gains.mean() - error, gains.mean() + error
    print(f"{gains.mean():+.1f} m [{low:+.1f}, {high:+.1f}] over the best fixed range")


if __name__ == "__main__":
    tyro.cli(main)
