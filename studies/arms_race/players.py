"""Flock policies and predators of the arms race as plain data."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from flockesc_env import FlockScenario, NamedPolicy, NetworkPolicy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.policies import find_policy
from flockesc_env.policies.predators import FlyStraight, Pursue
from studies.arms_race.predators import LeadPursuit, NetworkPredator

MOST_PARAMETERS: Final = 500
"""Most parameters of a network that is trained here: CMA-ES keeps a full covariance matrix."""


@dataclass(frozen=True)
class Flock:
    """A flock policy: the name of a built-in one or the path of a file.

    ``parameters`` replace those of the file's network.
    """

    spec: str
    parameters: tuple[float, ...] = ()

    def entry(self) -> NamedPolicy:
        """Return the policy with its options."""
        found = find_policy(self.spec)
        if not self.parameters:
            return found
        assert isinstance(found.policy, NetworkPolicy)  # noqa: S101, only networks have parameters
        network = NetworkPolicy(found.policy.architecture, self.parameters)
        return dataclasses.replace(found, policy=network)

    def vector(self) -> FloatArray:
        """Return the parameters of a network of at most ``MOST_PARAMETERS``, shape (size,)."""
        network = self.entry().policy
        if not isinstance(network, NetworkPolicy):
            raise TypeError(f"{self.spec}: expected a network, got {type(network).__name__}")
        size = network.architecture.size
        if size > MOST_PARAMETERS:
            raise ValueError(f"{self.spec}: expected at most {MOST_PARAMETERS} parameters, got {size}")
        return network.parameters.astype(np.float64)


@dataclass(frozen=True)
class Predator:
    """A predator policy: flies straight, pursues, or adds a network's output to lead pursuit."""

    kind: Literal["straight", "nearest", "centroid", "lead", "network"]
    lead: float = 0.0
    parameters: tuple[float, ...] = ()

    def policy(self, scenario: FlockScenario) -> PredatorPolicy:
        """Return the policy for the ``Learned`` predator of a scenario."""
        match self.kind:
            case "straight":
                return FlyStraight()
            case "nearest" | "centroid":
                return Pursue(self.kind)
        pursuit = LeadPursuit(scenario, self.lead)
        return NetworkPredator(np.array(self.parameters), pursuit) if self.parameters else pursuit
