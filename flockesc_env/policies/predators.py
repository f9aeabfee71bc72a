"""Built-in predator policies: ``FlyStraight`` and ``Pursue``."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_choice
from flockesc_env.episodes.predators import Observations, PredatorPolicySpec


class FlyStraight:
    """A predator policy that flies straight on."""

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return an acceleration of 0 for every row; see ``PredatorPolicy.act``."""
        return np.zeros((len(observations), spec.dimension), np.float32)


class Pursue:
    """A predator policy that accelerates toward its target as strongly as possible.

    Args:
        target: ``"nearest"``: the agent nearest to the predator; ``"centroid"``: the mean position of all
            agents.
    """

    def __init__(self, target: Literal["nearest", "centroid"] = "nearest") -> None:
        self.target = as_choice(target, "target", ("nearest", "centroid"))

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return the direction toward the target for every row; see ``PredatorPolicy.act``."""
        first = spec.layout.index(f"{self.target}_direction_ahead")
        return observations[:, first : first + spec.dimension]
