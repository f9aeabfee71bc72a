"""Flock policies and predators of the arms race as plain data, and ``NetworkPredator``."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env import NamedPolicy, NetworkPolicy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import Observations, PredatorPolicy, PredatorPolicySpec
from flockesc_env.policies import find_policy
from flockesc_env.policies.predators import FlyStraight, Pursue

INPUTS: Final = (
    *("time", "nearest_direction_ahead", "nearest_direction_left", "nearest_distance"),
    *("centroid_direction_ahead", "centroid_direction_left", "centroid_distance"),
    *("flock_velocity_ahead", "flock_velocity_left"),
)
"""Entries of the predator's observation that ``NetworkPredator`` sees; the flock is in the plane."""

SHAPES: Final = tuple(pairwise([len(INPUTS), 8, 2]))
"""Shape of the weight matrix of every layer, (inputs, outputs)."""

SIZE: Final = sum((rows + 1) * columns for rows, columns in SHAPES)
"""Number of parameters of a ``NetworkPredator``."""


class NetworkPredator:
    """A predator policy: a network with one tanh layer, whose output is added to a pursuit of the centroid.

    The observation is reflected such that the centroid is on the left, and the action is reflected back. The
    acceleration's components are clipped to [-1, 1]. Parameters of 0 are ``Pursue("centroid")``.

    Args:
        parameters: for every layer the weights in row-major order, then the biases, shape (``SIZE``,).
    """

    def __init__(self, parameters: FloatArray) -> None:
        self._layers: list[tuple[FloatArray, FloatArray]] = []
        at = 0
        for rows, columns in SHAPES:
            weights = parameters[at : at + rows * columns].reshape(rows, columns)
            at += rows * columns
            self._layers.append((weights, parameters[at : at + columns]))
            at += columns

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return one acceleration per observation row; see ``PredatorPolicy.act``."""
        values: FloatArray = observations[:, [spec.layout.index(name) for name in INPUTS]].astype(np.float64)
        side = np.where(values[:, INPUTS.index("centroid_direction_left")] < 0, -1.0, 1.0)
        values[:, [name.endswith("_left") for name in INPUTS]] *= side[:, None]
        (first, first_biases), (last, last_biases) = self._layers
        action = np.tanh(values @ first + first_biases) @ last + last_biases
        ahead = INPUTS.index("centroid_direction_ahead")
        action = (action + values[:, ahead : ahead + 2]).clip(-1, 1)
        action[:, 1] *= side
        return action


@dataclass(frozen=True)
class Flock:
    """A flock policy.

    Attributes:
        spec: name of a built-in policy, or path of a policy file.
        parameters: parameters of the network instead of the file's; empty: the file's.
    """

    spec: str
    parameters: tuple[float, ...] = ()

    def entry(self) -> NamedPolicy:
        """Return the policy with its options."""
        found = find_policy(self.spec)
        if not self.parameters:
            return found
        return dataclasses.replace(found, policy=self._network(found, self.parameters))

    def vector(self) -> FloatArray:
        """Return the parameters of the network, shape (size,)."""
        network = self.entry().policy
        assert isinstance(network, NetworkPolicy)  # noqa: S101, only networks are trained
        return network.parameters.astype(np.float64)

    def _network(self, found: NamedPolicy, parameters: tuple[float, ...]) -> NetworkPolicy:
        assert isinstance(found.policy, NetworkPolicy)  # noqa: S101, only networks have parameters
        return NetworkPolicy(found.policy.architecture, parameters)


@dataclass(frozen=True)
class Predator:
    """A predator policy.

    Attributes:
        kind: ``"straight"``, pursuit of the ``"nearest"`` agent or of the ``"centroid"``, or ``"network"``.
        parameters: of the ``NetworkPredator``.
    """

    kind: Literal["straight", "nearest", "centroid", "network"]
    parameters: tuple[float, ...] = ()

    def policy(self) -> PredatorPolicy:
        """Return the policy."""
        if self.kind == "network":
            return NetworkPredator(np.array(self.parameters))
        return FlyStraight() if self.kind == "straight" else Pursue(self.kind)
