"""The observations and actions of ``Learned`` predators, and the reset of policies."""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_numbers
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.spaces import ObservationLayout
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import EnvOptions

Observations = NDArray[np.float32]


@dataclass(frozen=True)
class PredatorPolicySpec:
    """Shapes and meaning of the observations and actions of a predator policy.

    Attributes:
        layout: names and bounds of the entries of an observation row.
        dimension: dimension D of space. An action has D numbers in [-1, 1]: the acceleration ahead, to the
            left and, if D = 3, up, in units of the predator's ``max_acceleration``.
        count: number of ``Learned`` predators per flock. Rows are ordered by flock, then by predator.
        num_steps: number of model steps of an episode; the largest if flocks have different scenarios.
        scenario: the scenario of the environment; the first one if flocks have different scenarios.
        options: the options of the environment; ``None`` if they are unknown.
        opponent: name of the policy that sets the flock's ranges; ``None`` if it is unknown.
    """

    layout: ObservationLayout
    dimension: int
    count: int
    num_steps: int
    scenario: FlockScenario
    options: EnvOptions | None = None
    opponent: str | None = None
    per_agent: ClassVar[bool] = False

    @classmethod
    def of(cls, scenario: FlockScenario) -> Self:
        """Return the spec for the ``Learned`` predators of a scenario; ``count`` may be 0."""
        layout = ObservationLayout.of(_core.predator_observation_entries(scenario.dimension))
        return cls(layout, scenario.dimension, scenario.num_learned, scenario.num_steps, scenario)

    def space(self) -> spaces.Box:
        """Return the action space of one predator, a new Box [-1, 1] of shape (D,)."""
        return spaces.Box(-1.0, 1.0, (self.dimension,), np.float32)

    def plain(
        self,
        actions: Any,
        count: int | None,
        name: str = "predator_actions",
        ignored: NDArray[np.bool] | None = None,
    ) -> FloatArray:
        """Return stacked actions, shape (count, D), as a new float64 array; ``name``: of the argument.

        With ``count=None``, ``actions`` is a single action, shape (D,), and the result has one row. Rows that
        are ``ignored`` are not checked and become 0.
        """
        shape = (self.dimension,) if count is None else (count, self.dimension)
        plain = as_numbers(actions, name, shape).reshape(-1, self.dimension)
        clipped = _core.clipped(plain)  # misses by rounding in float32; NaN farther outside
        if ignored is not None:
            clipped[ignored] = 0
        is_invalid = np.isnan(clipped).any(axis=1)
        if is_invalid.any():
            first = int(np.argmax(is_invalid))
            field = name if count is None else f"{name}[{first}]"
            raise InputError(field, "numbers from -1.0 to 1.0", plain[first].tolist())
        return clipped


def reset_policy(policy: Any, rows: NDArray[np.bool]) -> None:
    """Call ``policy.reset(rows)`` if the policy has this method."""
    reset = getattr(policy, "reset", None)
    if reset is not None:
        reset(rows)
