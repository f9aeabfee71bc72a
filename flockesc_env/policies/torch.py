"""``torch_network``: networks trained with torch as ``NetworkPolicy``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.errors import ArgumentError
from flockesc_env.policies.network import Architecture, NetworkPolicy, Squash


def torch_network(
    layers: Iterable[Any], inputs: tuple[str, ...], *, squash: Squash = "clip", ranges: tuple[float, ...] = ()
) -> NetworkPolicy:
    """Return a network of torch as a ``NetworkPolicy``, which ``save_policy`` can store.

    Args:
        layers: ``Linear`` and ``Tanh`` in turn, with ``Linear`` first and last, such as a
            ``torch.nn.Sequential``.
        inputs: names of the observation entries that the network receives, such as ``spec.layout.names``.
        squash: function that maps the first output to the action: ``"clip"`` for the mean of a Gaussian,
            ``"tanh"`` for that of a Gaussian squashed by tanh. Further outputs, such as a scale, are ignored.
        ranges: range in m of every output, for a network with one score per range, such as Q values. The
            policy sets the range with the highest score.

    Raises:
        ArgumentError: if the layers are of other types, or their sizes do not fit
            ``inputs`` and ``ranges``.
    """
    found = list(layers)
    kinds = [type(layer).__name__ for layer in found]
    if kinds != ["Linear", "Tanh"] * (len(kinds) // 2) + ["Linear"]:
        expected = "Linear and Tanh in turn, Linear first and last"
        advice = " (in stable-baselines3: policy_kwargs={'activation_fn': torch.nn.Tanh})"
        raise ArgumentError("layers", expected + advice, ", ".join(kinds) or "none")
    hidden, parameters = layer_parameters(found[::2], None if ranges else 1)
    return NetworkPolicy(Architecture(inputs, hidden, squash=squash, ranges=ranges), parameters)


def layer_parameters(
    linear: Sequence[Any], outputs: int | None = None
) -> tuple[tuple[int, ...], NDArray[np.float32]]:
    """Return the hidden widths and the parameters, for ``NetworkPolicy``, of linear layers of torch.

    With ``outputs``, only the first outputs of the last layer are kept.
    """
    last = linear[-1]
    parts = [part for at in linear[:-1] for part in (at.weight.T, at.bias)]
    parts += [last.weight[:outputs].T, last.bias[:outputs]]
    numbers = [part.detach().cpu().numpy().ravel() for part in parts]
    return tuple(at.out_features for at in linear[:-1]), np.concatenate(numbers)
