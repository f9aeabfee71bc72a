"""Bounds on the rounding errors of networks that torch computes in float32.

The order in which torch adds products depends on the processor, the number of rows and the number of threads.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

EPS = float(np.finfo(np.float32).eps)
"""Spacing of float32 numbers above 1, two unit roundoffs."""


def actor_layers(model: Any) -> list[nn.Module]:
    """Return the layers between the features and the mode of the actions of a model of stable-baselines3."""
    actor = getattr(model.policy, "actor", None)
    if actor is not None:
        last = actor.mu if isinstance(actor.mu, nn.Sequential) else [actor.mu]
        return [*getattr(actor, "latent_pi", []), *last]
    return [*model.policy.mlp_extractor.policy_net, model.policy.action_net]


def choose_alike(layers: Iterable[nn.Module], inputs: NDArray[np.float32], one: Any, other: Any) -> bool:
    """Return whether the scores of two choices of every row are equal but for rounding errors of float32.

    Args:
        layers: ``Linear``, ``Tanh`` and ``ReLU`` modules.
        inputs: shape (rows, inputs); (rows, candidates, inputs) if the layers give the score of a candidate.
        one: index of a score for every row.
        other: index of another score for every row.
    """
    layers, rows = list(layers), np.arange(len(inputs))
    scores = nn.Sequential(*layers)(torch.from_numpy(inputs)).detach().numpy().reshape(len(inputs), -1)
    error = float32_error(layers, inputs).reshape(scores.shape).max(axis=1)
    return bool((np.abs(scores[rows, one] - scores[rows, other]) <= 2 * error).all())


def float32_error(layers: Iterable[nn.Module], inputs: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the largest errors of the outputs of layers, and of actions with a magnitude of at most 1.

    A sum of n products, added in any order, has an error of at most n u / (1 - n u) times the sum of their
    magnitudes (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.1). Tanh is monotone:
    an error in its argument has the largest effect at one of the ends.

    Args:
        layers: ``Linear``, ``Tanh`` and ``ReLU`` modules.
        inputs: shape (..., inputs of the first layer).

    Returns:
        Shape (..., outputs of the last layer).
    """
    values, error = inputs.astype(np.float64), np.zeros(inputs.shape)
    for layer in layers:
        if isinstance(layer, nn.Linear):
            weight, bias = (part.detach().double().numpy() for part in (layer.weight.T, layer.bias))
            roundings = (len(weight) + 1) * EPS / 2
            magnitudes = (np.abs(values) + error) @ np.abs(weight) + np.abs(bias)
            error = error @ np.abs(weight) + roundings / (1 - roundings) * magnitudes
            values = values @ weight + bias
        elif isinstance(layer, nn.Tanh):
            low, values, high = (np.tanh(values + change) for change in (-error, 0, error))
            error = np.maximum(high - values, values - low) + 4 * EPS
        elif isinstance(layer, nn.ReLU):
            values = np.maximum(values, 0)
    return error + 4 * EPS  # the squashing, scaling and rounding of an action
