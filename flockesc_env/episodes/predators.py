"""Learned predators: their actions, their observations and the protocol of their policies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_array
from flockesc_env.common.errors import ActionError
from flockesc_env.episodes.spaces import ObservationLayout, predator_layout
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.predators import Learned

Observations = NDArray[np.float32]

_BOUNDS = "numbers from -1.0 to 1.0"


@dataclass(frozen=True)
class PredatorPolicySpec:
    """Shapes and meaning of the observations and actions of a predator policy.

    Attributes:
        layout: the entries of an observation row.
        dimension: D, numbers of an action: the acceleration ahead, to the left and, in space, up, over the
            largest.
        count: learned predators per flock; rows come flock after flock.
        num_steps: steps of an episode.
    """

    layout: ObservationLayout
    dimension: int
    count: int
    num_steps: int

    @classmethod
    def of(cls, scenario: FlockScenario) -> PredatorPolicySpec:
        """Return the spec of a scenario's learned predators; ``count`` may be 0."""
        return cls(
            layout=predator_layout(scenario.dimension),
            dimension=scenario.dimension,
            count=sum(isinstance(predator, Learned) for predator in scenario.predators),
            num_steps=scenario.num_steps,
        )

    def space(self) -> spaces.Box:
        """Return a new action space of one predator: Box [-1, 1] of shape (D,)."""
        return spaces.Box(-1.0, 1.0, (self.dimension,), np.float32)

    def plain(self, actions: Any, count: int, name: str = "predator_actions") -> FloatArray:
        """Return ``count`` stacked actions of shape (count, D), of any real type, as new float64.

        Raises:
            ActionError: naming ``name``, for a wrong dtype or shape, or an action outside of the space.
        """
        plain = _numbers(actions, (count, self.dimension), name)
        refused = ~(np.abs(plain) <= 1).all(axis=1)  # also NaN
        if refused.any():
            first = int(np.argmax(refused))
            raise ActionError(f"{name}[{first}]", _BOUNDS, plain[first].tolist())
        return plain

    def plain_one(self, action: Any, name: str = "action") -> FloatArray:
        """Return a single action of shape (D,) as new float64 of shape (1, D).

        Raises:
            ActionError: as ``plain``.
        """
        plain = _numbers(action, (self.dimension,), name)
        if not (np.abs(plain) <= 1).all():
            raise ActionError(name, _BOUNDS, plain.tolist())
        return plain[np.newaxis]

    def plain_of(self, names: list[str], actions: Mapping[str, Any]) -> FloatArray:
        """Return the actions of some agents as new float64, shape (len(names), D).

        Raises:
            ActionError: naming the agent whose action is missing or, as ``plain``, wrong.
        """
        labels = {name: f"action of {name!r}" for name in names}
        for name, label in labels.items():
            if name not in actions:
                raise ActionError(label, "an action", "none")
        return np.concatenate([self.plain_one(actions[name], label) for name, label in labels.items()])


class PredatorPolicy(Protocol):
    """Anything that turns observation rows of learned predators into their actions.

    ``SB3Policy`` follows it, too. A policy with a memory also has ``reset(rows)``.
    """

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Choose an action per row.

        Args:
            observations: shape (k, entries), one row per learned predator, flock after flock.
            spec: shapes and meaning of rows and actions.

        Returns:
            Actions, shape (k, D), in [-1, 1].
        """
        ...


def _numbers(value: Any, shape: tuple[int, ...], name: str) -> FloatArray:
    array = as_array(value, name, ActionError)
    if array.dtype.kind not in "fiu":
        raise ActionError(name, "real numbers", f"dtype {array.dtype}")
    if array.shape != shape:
        raise ActionError(name, f"shape {shape}", f"shape {array.shape}")
    with np.errstate(over="ignore"):  # too large for a float64: infinite, thus out of bounds
        return np.array(array, np.float64, order="C")
