"""What a search looks among: networks of one architecture, or rules of one kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flockesc_env.common.stats import FloatArray
from flockesc_env.policies import StubbornWitnesses
from flockesc_env.policies.files import Stored
from flockesc_env.policies.network import Architecture, NetworkPolicy
from training.config import SearchArgs
from training.evaluation import policy_spec


class Family(Protocol):
    """Policies that differ by a vector of numbers, each of which is 0 at first and varies by about 1."""

    @property
    def size(self) -> int:
        """Numbers per policy."""
        ...

    def policies(self, vectors: FloatArray) -> Stored:
        """Return one policy, of shape (size,), or several, (k, size), which share rows in equal parts."""
        ...


@dataclass(frozen=True)
class Networks:
    """Networks of one architecture."""

    architecture: Architecture

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.architecture.size

    def policies(self, vectors: FloatArray) -> NetworkPolicy:
        """Return the networks of these parameters."""
        return NetworkPolicy(self.architecture, vectors)


@dataclass(frozen=True)
class Witnesses:
    """Rules of the kind ``StubbornWitnesses``.

    Attributes:
        max_range: largest range in m.
    """

    max_range: float
    size: int = 3

    def policies(self, vectors: FloatArray) -> StubbornWitnesses:
        """Return the rules: a wait of about a tenth of the episode, a range of about 40 m, then 20 m."""
        patience, first_range, interaction_range = vectors.T
        return StubbornWitnesses(
            np.clip(0.1 + 0.05 * patience, 0, 1),
            np.clip(40 + 20 * first_range, 0, self.max_range),
            np.clip(20 + 10 * interaction_range, 0, self.max_range),
        )


def family_of(args: SearchArgs) -> Family:
    """Return what a run searches among."""
    if args.rule:
        return Witnesses(args.max_range)
    inputs = args.inputs or policy_spec(args).layout.names
    return Networks(Architecture(inputs, args.hidden, args.memory, args.mirror))
