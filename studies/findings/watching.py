"""Observations and ranges of a policy, action by action."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env import NamedPolicy, Policy, PolicySpec, rollout
from flockesc_env.episodes.policy_reset import reset_policy
from flockesc_env.episodes.spaces import ObservationLayout

Observations = NDArray[np.float32]


@dataclass
class Watching:
    """A policy that records the observations and ranges of another one."""

    policy: Policy

    def __post_init__(self) -> None:
        self.layouts: list[ObservationLayout] = []
        self.seen: list[Observations] = []
        self.ranges: list[NDArray[np.float64]] = []

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset the other policy."""
        reset_policy(self.policy, rows)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Let the other policy choose."""
        actions = self.policy.act(observations, spec)
        self.layouts.append(spec.layout)
        self.seen.append(observations.copy())
        self.ranges.append(spec.actions.to_ranges(actions, len(observations)))
        return actions


def watch(entry: NamedPolicy, flocks: range) -> tuple[ObservationLayout, Observations, NDArray[np.float64]]:
    """Run a policy on some flocks of the scenario that it was trained in.

    Returns:
        Layout; observations (actions, rows, entries); ranges in m (actions, rows).
    """
    watching = Watching(entry.policy)
    rollout(None, replace(entry, policy=watching), flocks, batch_size=len(flocks))
    return watching.layouts[0], np.array(watching.seen), np.array(watching.ranges)
