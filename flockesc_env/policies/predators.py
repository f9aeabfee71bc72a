"""Policies of learned predators: fly straight on, or accelerate toward the flock."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_choice
from flockesc_env.episodes.predators import Observations, PredatorPolicySpec


class FlyStraight:
    """Flies straight on."""

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Choose no acceleration for every row."""
        return np.zeros((len(observations), spec.dimension), np.float32)


class Pursue:
    """Accelerates toward its target with all its strength.

    Args:
        target: ``"nearest"``: the agent nearest to it; ``"centroid"``: the mean position of all agents.
    """

    def __init__(self, target: Literal["nearest", "centroid"] = "nearest") -> None:
        self.target = as_choice(target, "target", ("nearest", "centroid"))

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Choose the direction toward the target for every row."""
        first = spec.layout.index(f"{self.target}_direction_ahead")
        return observations[:, first : first + spec.dimension]
