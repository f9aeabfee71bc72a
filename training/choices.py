"""PPO over a few ranges: a categorical policy, stored as a network that sets the most probable range."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from flockesc_env import Architecture, NetworkPolicy
from flockesc_env.common.stats import FloatArray
from flockesc_env.policies.sb3 import layer_parameters

_SHARPNESS = 1e4
"""Factor of the difference of two outputs: tanh decides which one is larger."""

_CERTAINTY = 20.0
"""tanh of this number is 1 in float64."""


def prefer_short_ranges(outputs: nn.Linear) -> None:
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
    layers = [parameters[:-last], compare.ravel(), select.ravel(), act]
    return NetworkPolicy(Architecture(inputs, (*hidden, len(pairs), len(actions))), np.concatenate(layers))
