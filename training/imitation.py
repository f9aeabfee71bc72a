"""Imitation of values: a network learns what each candidate range leads to, and sets the best one.

In every round the policy plays new flocks up to a random action, where some candidates are valued
(``Branches``). Then a new network is fitted to the values of all rounds. This is AggreVaTe (Ross and Bagnell,
"Reinforcement and imitation learning via interactive no-regret learning", 2014). If every network replaces
its teacher (``improve``), it is a policy iteration whose values come from rollouts (Lazaric, Ghavamzadeh and
Munos, "Analysis of classification-based policy iteration algorithms", 2016).
"""

from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import nn

from flockesc_env import InputError, NetworkPolicy
from flockesc_env.cli.flags import policy_of
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import Observations
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.episodes.splits import training_seeds
from flockesc_env.policies import Architecture
from flockesc_env.policies.network import layer_parameters
from training.branches import GROUP, Branches
from training.rounds import Arguments, Rounds, hyperparameters_of
from training.run import Run

_BATCH_SIZE = 256
"""Flocks per gradient step."""

_LEAST_SCALE = 1e-3
"""Least standard deviation by which an input is divided."""


class ImitationArguments(Arguments, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Hyperparameters of the imitation of values; only for one range for all agents of a flock.

    Attributes:
        teacher: policy that plays every copy of a flock to the end, after its first action, and that visits
            flocks in the first round: a built-in policy, a policy file or the folder of a run.
        ranges: candidate ranges in m; the network has one output per candidate.
        improve: after a round, its network replaces the teacher. The values of older teachers are kept.
        inputs: observation entries that the network sees; empty: all.
        hidden: widths of the hidden layers.
        rounds: number of rounds. After each, a new network is fitted to the values of all rounds.
        flocks: number of new flocks per round.
        branches: number of candidates per flock that are drawn at random and valued.
        epochs: number of passes over the values.
        learning_rate: largest learning rate of AdamW.
        weight_decay: weight decay of AdamW.
    """

    teacher: str
    ranges: tuple[float, ...]
    improve: bool = False
    inputs: tuple[str, ...] = ()
    hidden: tuple[int, ...] = (64, 64)
    rounds: int = 3
    flocks: int = 1200
    branches: int = 3
    epochs: int = 150
    learning_rate: float = 1e-2
    weight_decay: float = 0.3
    checkpoint_every: int = 1


class ImitationRounds(Rounds[ImitationArguments]):
    """An imitation of values.

    Raises:
        InputError: if a hyperparameter is unknown or there is no round, or if the task is a line or has
            one range per agent.
    """

    def __init__(self, run: Run) -> None:
        args = hyperparameters_of(run, ImitationArguments)
        super().__init__(run, args, args.rounds)
        if args.rounds < 1:
            raise InputError("rounds", "at least 1", args.rounds)
        self._branches = Branches(run, args.ranges, args.branches)
        self._teacher = policy_of(args.teacher)
        self._network: NetworkPolicy | None = None
        self._observations: list[Observations] = []  # of every flock where it was copied
        self._values: list[FloatArray] = []  # shape (flocks, candidates); nan: not drawn
        torch.set_num_threads(1)

    def round(self) -> float:
        """Value candidates on new flocks and fit the network again; return the mean value."""
        args, branches, seed = self.args, self._branches, self.run.seed
        flocks = training_seeds(seed, self.completed * args.flocks, args.flocks)
        policy = self._network or self._teacher
        teacher = policy if args.improve else self._teacher
        rng = np.random.default_rng([seed, self.completed])
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
    args: ImitationArguments, spec: PolicySpec, observations: Observations, values: FloatArray, seed: int
) -> NetworkPolicy:
    """Return the policy that sets the candidate with the largest output of a network.

    The outputs for two candidates differ as their values do. The loss is the squared error of the difference
    to the mean over the drawn candidates of the same flock.

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
    inputs = torch.tensor(observations[:, [spec.layout.index(name) for name in names]])
    center, scale = inputs.mean(0), inputs.std(0).clamp(min=_LEAST_SCALE)
    inputs = (inputs - center) / scale

    widths = [len(names), *args.hidden]
    hidden = [layer for sizes in pairwise(widths) for layer in (nn.Linear(*sizes), nn.Tanh())]
    network = nn.Sequential(*hidden, nn.Linear(widths[-1], len(args.ranges)))
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
    return NetworkPolicy(Architecture(names, args.hidden, ranges=args.ranges), layer_parameters(layers)[1])
