"""Imitation of values: a network learns what each candidate range leads to, and sets the best one.

In every round the policy plays new flocks up to a random action, where some candidates are valued
(``Branches``). Then a new network is fitted to the values of all rounds. This is AggreVaTe (Ross and Bagnell,
"Reinforcement and imitation learning via interactive no-regret learning", 2014). If every network replaces
its teacher (``improve``), it is a policy iteration whose values come from rollouts (Lazaric, Ghavamzadeh and
Munos, "Analysis of classification-based policy iteration algorithms", 2016).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from flockesc_env import Architecture, ArgumentError, NetworkPolicy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import Observations
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.torch import layer_parameters
from flockesc_env.tasks.seeds import training_seeds
from training.branches import GROUP, Branches
from training.config import ImitationArgs
from training.policies import named_policy
from training.scorer import tanh_layers
from training.train import Rounds

_BATCH_SIZE = 256
"""Flocks per gradient step."""

_LEAST_SCALE = 1e-3
"""Least standard deviation by which an input is divided."""


class ImitationRounds(Rounds[ImitationArgs]):
    """An imitation of values.

    Raises:
        ArgumentError: if there is no round, the setting is a line or has one range per agent, candidates are
            missing, or a name is unknown.
    """

    def __init__(self, args: ImitationArgs) -> None:
        super().__init__(args)
        if args.rounds < 1:
            raise ArgumentError("rounds", "at least 1", args.rounds)
        self._branches, self._teacher = Branches(args), named_policy(args.teacher).policy
        self._network: NetworkPolicy | None = None
        self._observations: list[Observations] = []  # of every flock where it was copied
        self._values: list[FloatArray] = []  # shape (flocks, candidates); nan: not drawn
        torch.set_num_threads(1)

    def round(self) -> float:
        """Value candidates on new flocks and fit the network again; return the mean value."""
        args, branches = self.args, self._branches
        flocks = training_seeds(args.seed, self.completed * args.flocks, args.flocks)
        policy = self._network or self._teacher
        teacher = policy if args.improve else self._teacher
        rng = np.random.default_rng([args.seed, self.completed])
        for first in range(0, args.flocks, GROUP):
            some = flocks[first : first + GROUP]
            observations, values, num_actions = branches.values(policy, teacher, some, rng)
            self._observations.append(observations)
            self._values.append(values)
            self.measured.samples += num_actions
        examples = np.concatenate(self._observations), np.concatenate(self._values)
        self._network = fit(args, branches.spec, *examples, seed=int(rng.integers(2**31)))
        self.measured.episodes += args.flocks * args.branches
        return float(np.nanmean(examples[1][-args.flocks :]))

    def policy(self) -> NetworkPolicy:
        """Return the policy that sets the best candidate."""
        assert self._network is not None  # noqa: S101, for the type checker
        return self._network

    def state(self) -> Any:
        """Return the network and all values."""
        return self._network, self._observations, self._values

    def restore(self, state: Any) -> None:
        """Restore the network and all values."""
        self._network, self._observations, self._values = state


def fit(
    args: ImitationArgs, spec: PolicySpec, observations: Observations, values: FloatArray, seed: int
) -> NetworkPolicy:
    """Return the policy that sets the candidate with the largest output of a network.

    The network has one output per candidate. The outputs for two candidates differ as their values do. The
    loss is the squared error of the difference to the mean over the drawn candidates of the same flock.

    Args:
        args: inputs, layers and arguments of the optimizer.
        spec: policy spec of the environment.
        observations: shape (flocks, entries).
        values: shape (flocks, candidates); nan: not drawn.
        seed: of the first weights and the order of the flocks.
    """
    torch.manual_seed(seed)
    drawn = torch.tensor(~np.isnan(values), dtype=torch.float32)
    gains = np.nan_to_num(values - np.nanmean(values, axis=1, keepdims=True))
    targets = torch.tensor(gains / max(np.sqrt(np.nanmean(gains**2)), 1e-9), dtype=torch.float32)
    names = args.inputs or spec.layout.names
    columns = [spec.layout.index(name) for name in names]
    inputs = torch.tensor(observations[:, columns], dtype=torch.float32)
    center, scale = inputs.mean(0), inputs.std(0).clamp(min=_LEAST_SCALE)
    inputs = (inputs - center) / scale

    widths = [len(columns), *args.hidden]
    network = nn.Sequential(*tanh_layers(widths), nn.Linear(widths[-1], len(args.ranges)))
    optimizer = torch.optim.AdamW(network.parameters(), lr=args.learning_rate, weight_decay=args.weight_decay)
    num_batches = -(-len(inputs) // _BATCH_SIZE)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, args.learning_rate, total_steps=args.epochs * num_batches
    )
    for _ in range(args.epochs):
        order = torch.randperm(len(inputs))
        for first in range(0, len(order), _BATCH_SIZE):
            batch = order[first : first + _BATCH_SIZE]
            shown, scores = drawn[batch], network(inputs[batch])
            means = (scores * shown).sum(1, keepdim=True) / shown.sum(1, keepdim=True)
            loss = ((scores - means - targets[batch]) * shown).square().sum() / shown.sum()
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
    layers: list[Any] = list(network)[::2]
    with torch.no_grad():  # the network gets inputs that are not standardized
        layers[0].weight /= scale
        layers[0].bias -= layers[0].weight @ center
    architecture = Architecture(names, args.hidden, ranges=args.ranges)
    return NetworkPolicy(architecture, layer_parameters(layers)[1])
