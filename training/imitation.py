"""Imitation of values: a network learns what each candidate range leads to, and sets the best one.

In every round the policy plays new flocks up to a random action. There some candidates are valued: each is
set for one action in a copy of the flock, and a teacher plays the copy to the end. Then a new network is
fitted to the values of all rounds. This is AggreVaTe (Ross and Bagnell, "Reinforcement and imitation learning
via interactive no-regret learning", 2014). If every network replaces its teacher (``improve``), it is a
policy iteration whose values come from rollouts (Lazaric, Ghavamzadeh and Munos, "Analysis of
classification-based policy iteration algorithms", 2016).
"""

from itertools import pairwise
from typing import Any, cast

import numpy as np
import torch
from torch import nn

from flockesc_env import FlockScenario, InputError, NetworkPolicy, Policy
from flockesc_env.cli.flags import policy_of
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import FlockBatch, Observations
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.episodes.splits import training_seeds
from flockesc_env.policies import Architecture
from flockesc_env.policies.network import layer_parameters
from flockesc_env.scenario.options import EnvOptions
from training.rounds import Arguments, Rounds, hyperparameters_of
from training.run import Run

_BATCH_SIZE = 256
"""Flocks per gradient step."""

_LEAST_SCALE = 1e-3
"""Least standard deviation by which an input is divided."""

GROUP = 16
"""Flocks that are played up to the same action and copied there."""

EXPLORATION = 0.1
"""Probability of a random candidate as an action before the flock is copied."""

_EARLINESS = 3
"""Exponent of the uniform random number that chooses the action: early ones decide more."""


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
        InputError: if a hyperparameter is unknown or there is no round or candidate, or if the task is a
            line or has one range per agent.
    """

    kept = ("_network", "_observations", "_values")

    def __init__(self, run: Run) -> None:
        args = hyperparameters_of(run, ImitationArguments)
        super().__init__(run, args, args.rounds)
        if args.rounds < 1:
            raise InputError("rounds", "at least 1", args.rounds)
        if run.task.per_agent or not isinstance(run.task.scenario, FlockScenario):
            raise InputError("task", "one range for a flock", run.task.name)
        if not args.ranges:
            raise InputError("ranges", "at least one candidate range", "none")
        self._model = run.task.scenario
        self._teacher = policy_of(args.teacher)
        self._network: NetworkPolicy | None = None
        self._observations: list[Observations] = []  # of every flock where it was copied
        self._values: list[FloatArray] = []  # shape (flocks, candidates); nan: not drawn
        torch.set_num_threads(1)

    def round(self) -> float:
        """Value candidates on new flocks and fit the network again; return the mean value."""
        args, seed = self.args, self.run.seed
        flocks = training_seeds(seed, self.completed * args.flocks, args.flocks)
        policy = self._network or self._teacher
        teacher = policy if args.improve else self._teacher
        rng = np.random.default_rng([seed, self.completed])
        for first in range(0, args.flocks, GROUP):
            some = flocks[first : first + GROUP]
            observations, values, num_actions = self.values(policy, teacher, some, rng)
            self._observations.append(observations)
            self._values.append(values)
            self.measured.samples += num_actions
        examples = np.concatenate(self._observations), np.concatenate(self._values)
        self._network = fit(args, self.run.policy_spec, *examples, seed=int(rng.integers(2**31)))
        self.measured.episodes += args.flocks * args.branches
        return float(np.nanmean(examples[1][-args.flocks :]))

    def values(
        self, policy: Policy, teacher: Policy, flocks: range, rng: np.random.Generator
    ) -> tuple[Observations, FloatArray, int]:
        """Play flocks up to a random action and value some candidates there.

        Args:
            policy: chooses the actions before, except those that are drawn at random (``EXPLORATION``).
            teacher: plays the copies of the flocks to the end.
            flocks: seeds of the flocks.
            rng: draws the action, the exploration and the candidates.

        Returns:
            The observations, shape (flocks, entries); the values in m, shape (flocks, candidates), which
            are nan for candidates that were not drawn; and the number of actions.
        """
        spec, num_flocks = self.run.policy_spec, len(flocks)
        source = self._batch(num_flocks)
        observations, _ = source.reset(range(num_flocks), list(flocks))
        before = int(spec.num_actions * rng.random() ** _EARLINESS)
        for _ in range(before):
            actions = policy.act(observations, spec)
            explored = rng.random(num_flocks) < EXPLORATION
            drawn = rng.choice(self.args.ranges, int(explored.sum()))
            actions[explored] = spec.actions.from_ranges(drawn)
            observations, *_ = source.step(actions)
        candidates, branches = np.array(self.args.ranges), self.args.branches
        chosen = np.array([rng.permutation(len(candidates))[:branches] for _ in flocks])
        values = np.full((num_flocks, len(candidates)), np.nan)
        found, after = self._play(source, candidates[chosen], teacher)
        np.put_along_axis(values, chosen, found, axis=1)
        return observations, values, before * num_flocks + after

    def _play(self, source: FlockBatch, ranges: FloatArray, teacher: Policy) -> tuple[FloatArray, int]:
        """Return the objective of copies that begin with ``ranges``, (flocks, copies), and the actions."""
        num_flocks, num_copies = ranges.shape
        copies = self._batch(ranges.size)
        copies.set_state(source.get_state(np.repeat(np.arange(num_flocks), num_copies).tolist()))
        spec, taken = self.run.policy_spec, 0
        actions = spec.actions.from_ranges(ranges.ravel())
        while True:
            observations, _, has_ended, *_ = copies.step(actions, at_end="stay")
            taken += ranges.size
            if has_ended.all():
                break
            actions = teacher.act(observations, spec)
        values: FloatArray = copies.core.metrics()[self.run.task.spec.name]
        return values.reshape(ranges.shape), taken

    def _batch(self, num_flocks: int) -> FlockBatch:
        options = cast("EnvOptions", self.run.policy_spec.options)
        return FlockBatch(self._model, options, num_flocks=num_flocks, num_threads=1)

    def policy(self) -> NetworkPolicy:
        """Return the policy that sets the best candidate."""
        assert self._network is not None  # noqa: S101, for the type checker
        return self._network


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
