"""PPO over a few ranges: a categorical policy, stored as a network that sets the most probable range."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from torch import nn

from flockesc_env import Architecture, NetworkPolicy
from flockesc_env.common.stats import FloatArray
from flockesc_env.policies.sb3 import layer_parameters
from training.scorer import Networks, tanh_layers

_SHARPNESS = 1e4
"""Factor of the difference of two outputs: tanh decides which one is larger."""

_CERTAINTY = 20.0
"""tanh of this number is 1 in float64."""


class ChoicePolicy(ActorCriticPolicy):
    """Policy of stable-baselines3 that sees some entries of the observation; its value network sees all.

    Args:
        *args: spaces and learning rate, from stable-baselines3.
        columns: columns of the entries that the policy sees.
        **kwargs: arguments of ``ActorCriticPolicy``. ``net_arch`` holds the widths of the hidden layers
            of both networks.
    """

    def __init__(self, *args: Any, columns: list[int], **kwargs: Any) -> None:
        self._columns = columns
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = _Choice(self._columns, self.features_dim, self.net_arch)  # type: ignore[assignment, arg-type]

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        _prefer_short_ranges(self.action_net)


class _Choice(Networks):
    """Hidden layers of the policy and of the value network."""

    def __init__(self, columns: list[int], entries: int, hidden: list[int]) -> None:
        super().__init__(nn.Sequential(*tanh_layers([len(columns), *hidden])), hidden[-1], entries, hidden)
        self._columns = columns

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the last hidden layer of the policy, shape (rows, width)."""
        hidden: torch.Tensor = self.policy_net(features[:, self._columns])
        return hidden


def _prefer_short_ranges(outputs: Any) -> None:
    """Let every range be less probable at the start than the next shorter one, by a factor of e.

    With equal probabilities the flock agrees in its first steps, and no agent's action changes its reward.
    """
    with torch.no_grad():
        outputs.bias.copy_(-torch.arange(outputs.out_features))


def choosing_network(inputs: tuple[str, ...], linear: Sequence[Any], actions: FloatArray) -> NetworkPolicy:
    """Return the network that sets the action of the largest output.

    Two hidden layers follow after those of the categorical policy. The first compares each pair of outputs.
    In the second the unit of the largest output is 1 and the others are -1.

    Args:
        inputs: names of the inputs.
        linear: linear layers of torch, with tanh between them; the last one has an output per action.
        actions: normalized actions, shape (outputs,).
    """
    hidden, parameters = layer_parameters(linear)
    last = linear[-1].weight.T.numel() + len(actions)
    outputs: NDArray[np.float64] = parameters[-last:].astype(np.float64).reshape(-1, len(actions))
    pairs = list(combinations(range(len(actions)), 2))
    votes = np.zeros((len(pairs), len(actions)))
    for row, (one, other) in enumerate(pairs):
        votes[row, one], votes[row, other] = 1, -1
    compare = _SHARPNESS * outputs @ votes.T
    # The largest output wins all of its pairs, one less 2 votes or fewer.
    select = _CERTAINTY * np.vstack([votes, np.full(len(actions), 2.0 - len(actions))])
    act = np.append(actions / 2, actions.sum() / 2)
    layers: list[NDArray[Any]] = [parameters[:-last], compare.ravel(), select.ravel(), act]
    return NetworkPolicy(Architecture(inputs, (*hidden, len(pairs), len(actions))), np.concatenate(layers))
