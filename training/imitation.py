"""Imitation of values: a network learns what each candidate range leads to, and sets the best one.

In every round the policy plays new flocks up to a random action, where some candidates are valued
(``Branches``). Then a new network is fitted to the values of all rounds. This is AggreVaTe (Ross and Bagnell,
"Reinforcement and imitation learning via interactive no-regret learning", 2014). If every network replaces
its teacher (``improve``), it is a policy iteration whose values come from rollouts (Lazaric, Ghavamzadeh and
Munos, "Analysis of classification-based policy iteration algorithms", 2016).
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from flockesc_env import Architecture, ArgumentError, NetworkPolicy
from flockesc_env.common.progress import progress_bar
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import Observations
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.sb3 import layer_parameters
from training.branches import GROUP, Branches
from training.choices import choosing_network
from training.config import ImitationArgs
from training.outputs import Measured, begin, finish, load_checkpoint, save_checkpoint
from training.policies import named_policy
from training.scorer import candidate_columns, tanh_layers
from training.seeds import training_seeds

_LEAST_SCALE = 1e-3
"""Least standard deviation by which an input is divided."""


@dataclass
class ImitationState:
    """Checkpoint of a run between two rounds.

    Attributes:
        round: number of the next round.
        policy: sets the best candidate after the last round; ``None`` before the first.
        observations: of the flocks of every round where they were copied, shape (flocks, entries).
        values: the objective under each candidate, shape (flocks, candidates); nan: not drawn.
        measured: measurements so far.
    """

    round: int = 0
    policy: NetworkPolicy | None = None
    observations: list[Observations] = field(default_factory=list)
    values: list[FloatArray] = field(default_factory=list)
    measured: Measured = field(default_factory=Measured)


def imitate(args: ImitationArgs) -> Path:
    """Run an imitation of values, or continue an unfinished one, and return the path of the policy file.

    Raises:
        ArgumentError: if there is no round, the setting is a line or has one range per agent, candidates are
            missing, or a name is unknown.
        FileExistsError: if the folder holds a finished run, or a run with other arguments.
    """
    if args.rounds < 1:
        raise ArgumentError("rounds", "at least 1", args.rounds)
    teacher = named_policy(args.teacher).policy
    branches = Branches(args, teacher)
    torch.set_num_threads(1)
    begin(args)
    state: ImitationState = load_checkpoint(args.run) or ImitationState()
    with progress_bar(f"Imitate {args.run.name}", args.rounds, always=args.progress) as report:
        while state.round < args.rounds:
            report(state.round, args.rounds)
            _round(state, args, branches)
            is_point = state.round % args.checkpoint_every == 0
            if is_point:
                state.measured.add_point(args, _policy(state))
            if is_point or state.round == args.rounds:
                save_checkpoint(state, args.run)
    if args.rounds % args.checkpoint_every:  # not in the checkpoint: a longer run lacks this point
        state.measured.add_point(args, _policy(state))
    return finish(args, _policy(state), state.measured)


def _round(state: ImitationState, args: ImitationArgs, branches: Branches) -> None:
    """Value candidates on new flocks and fit the network again."""
    begun, measured = time.process_time(), state.measured
    flocks = training_seeds(args.seed, state.round * args.flocks, args.flocks)
    policy = state.policy or branches.teacher
    if args.improve:
        branches.teacher = policy
    rng = np.random.default_rng([args.seed, state.round])
    for first in range(0, args.flocks, GROUP):
        observations, values = branches.values(policy, flocks[first : first + GROUP], rng)
        state.observations.append(observations)
        state.values.append(values)
    examples = np.concatenate(state.observations), np.concatenate(state.values)
    state.policy = fit(args, branches.spec, *examples, seed=int(rng.integers(2**31)))
    state.round += 1
    measured.episodes += args.flocks * args.branches
    measured.samples += branches.take_actions()
    measured.seconds += time.process_time() - begun


def _policy(state: ImitationState) -> NetworkPolicy:
    """Return the policy after a round."""
    assert state.policy is not None  # noqa: S101, for the type checker
    return state.policy


def fit(
    args: ImitationArgs, spec: PolicySpec, observations: Observations, values: FloatArray, seed: int
) -> NetworkPolicy:
    """Return the policy that sets the candidate with the largest output of a network.

    The outputs for two candidates differ as their values do. With a profile the network scores one candidate
    after the other; without, it has one output per candidate. The loss is the squared error of the difference
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
    inputs = torch.tensor(_inputs(args, spec, observations), dtype=torch.float32)
    rows = inputs.flatten(end_dim=-2)
    center, scale = rows.mean(0), rows.std(0).clamp(min=_LEAST_SCALE)
    inputs = (inputs - center) / scale

    widths = [inputs.shape[-1], *args.hidden]
    outputs = len(args.ranges) or 1
    network = nn.Sequential(*tanh_layers(widths), nn.Linear(widths[-1], outputs))
    optimizer = torch.optim.AdamW(network.parameters(), lr=args.learning_rate, weight_decay=args.weight_decay)
    num_batches = -(-len(inputs) // args.batch_size)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, args.learning_rate, total_steps=args.epochs * num_batches
    )
    for _ in range(args.epochs):
        order = torch.randperm(len(inputs))
        for first in range(0, len(order), args.batch_size):
            batch = order[first : first + args.batch_size]
            shown, scores = drawn[batch], network(inputs[batch]).flatten(1)
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
    if args.ranges:
        actions = spec.actions.from_ranges(np.array(args.ranges))
        return choosing_network(_names(args, spec), layers, actions.ravel())
    architecture = Architecture(args.inputs, args.hidden, candidate_inputs=args.candidate_inputs)
    return NetworkPolicy(architecture, layer_parameters(layers)[1])


def _inputs(args: ImitationArgs, spec: PolicySpec, observations: Observations) -> Observations:
    """Return the inputs of the network: per flock, shape (flocks, inputs), or per candidate of a profile."""
    if args.ranges:
        return observations[:, [spec.layout.index(name) for name in _names(args, spec)]]
    shape = (len(observations), len(spec.candidate_ranges))
    ranges = np.broadcast_to(spec.candidate_ranges / spec.candidate_ranges[-1], shape)
    entries = np.concatenate([observations, ranges], axis=1)
    inputs: Observations = entries[:, candidate_columns(args.inputs, args.candidate_inputs, spec)]
    return inputs


def _names(args: ImitationArgs, spec: PolicySpec) -> tuple[str, ...]:
    """Return the names of the inputs of a network with one output per candidate."""
    return args.inputs or spec.layout.names
