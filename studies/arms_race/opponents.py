"""Both sides of the arms race as plain data, lead pursuit, and a network that corrects it."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from flockesc_env import FlockScenario, NetworkPolicy, load_policy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import Observations, PredatorPolicySpec
from flockesc_env.policies import BasePolicy, FlyStraight, Policy, Pursue
from flockesc_env.policies.network import tanh_layers
from flockesc_env.scenario import Learned

INPUTS: Final = (
    "time", "nearest_direction_ahead", "nearest_direction_left", "nearest_distance",
    "centroid_direction_ahead", "centroid_direction_left", "centroid_distance",
    "flock_velocity_ahead", "flock_velocity_left",
)  # fmt: skip
"""Entries of the predator's observation that ``NetworkPredator`` sees; the flock is in the plane."""

WIDTHS: Final = (len(INPUTS), 8, 2)  # of the layers of a ``NetworkPredator``
SIZE: Final = sum((rows + 1) * columns for rows, columns in pairwise(WIDTHS))  # number of its parameters
STEPS_PER_ACTION: Final = 4  # of the rules


@dataclass(frozen=True)
class Flock:
    """A flock policy: the name of a built-in one or a file; ``parameters`` replace those of its network."""

    spec: str
    parameters: tuple[float, ...] = ()

    def entry(self) -> BasePolicy:
        """Return the policy with its options."""
        found = load_policy(self.spec)
        if self.parameters:
            known: dict[str, Any] = {"per_agent": found.per_agent, "scenario": found.scenario}
            network = NetworkPolicy(cast("NetworkPolicy", found).architecture, self.parameters)
            found = network.with_options(name=found.name, **known, **(found.options or {}))
        return found if found.scenario is not None else found.with_options(steps_per_action=STEPS_PER_ACTION)


@dataclass(frozen=True)
class Predator:
    """A predator: ``"straight"``, pursuit of the ``"nearest"`` agent or the ``"centroid"``, or ``"lead"``.

    With ``parameters`` a network corrects lead pursuit.
    """

    kind: str
    lead: float = 0.0
    parameters: tuple[float, ...] = ()

    def policy(self, scenario: FlockScenario) -> Policy:
        """Return the policy for the ``Learned`` predator of a scenario."""
        if self.kind == "lead":
            pursuit = LeadPursuit(scenario, self.lead)
            return NetworkPredator(np.array(self.parameters), pursuit) if self.parameters else pursuit
        return FlyStraight() if self.kind == "straight" else Pursue(self.kind)  # type: ignore[arg-type]


class LeadPursuit:
    """A predator policy that aims ahead of the centroid, at a point on the way to their meeting.

    Let r be the vector from the predator to the centroid and u the mean velocity of the agents. If the flock
    keeps u and the predator flies at its largest speed s, it can meet the centroid after the time T with
    ||r + T u|| = s T. The predator accelerates as strongly as possible toward r + ``lead`` T u. It has to be
    faster than the agents, and the flock has to be in the plane.
    """

    def __init__(self, scenario: FlockScenario, lead: float) -> None:
        (predator,) = (each for each in scenario.predators if isinstance(each, Learned))
        self._max_speed = predator.max_speed
        self._length, self._speed = scenario.initial_side, float(np.mean(scenario.speed))
        self.lead = lead

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return one acceleration per observation row; see ``Policy.act``."""

        def read(name: str, count: int) -> FloatArray:
            first = spec.layout.index(name)
            return observations[:, first : first + count].astype(np.float64)

        distance = _unscaled(read("centroid_distance", 1), self._length)
        centroid = distance * read("centroid_direction_ahead", 2)
        velocity = _unscaled(read("flock_velocity_ahead", 2), self._speed)  # minus the predator's
        velocity[:, :1] += read("speed", 1) * self._max_speed
        # The meeting time T solves ||r + T u||^2 = s^2 T^2, a quadratic equation with one positive root.
        approach = (centroid * velocity).sum(axis=1, keepdims=True)
        excess = self._max_speed**2 - (velocity**2).sum(axis=1, keepdims=True)
        meeting = (approach + np.sqrt(approach**2 + excess * distance**2)) / excess
        aim = centroid + self.lead * meeting * velocity
        length = _norm(aim)
        action: FloatArray = np.divide(aim, length, out=np.zeros_like(aim), where=length > 0)
        return action


class NetworkPredator:
    """A predator policy: a network with one tanh layer whose output is added to another policy's action.

    The observation is reflected such that the centroid is on the left, and the output is reflected back. The
    sum's components are clipped to [-1, 1].
    """

    def __init__(self, parameters: FloatArray, base: Policy) -> None:
        self._base, self._parameters = base, parameters

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return one acceleration per observation row; see ``Policy.act``."""
        values: FloatArray = observations[:, [spec.layout.index(name) for name in INPUTS]].astype(np.float64)
        side = np.where(values[:, INPUTS.index("centroid_direction_left")] < 0, -1.0, 1.0)
        values[:, [name.endswith("_left") for name in INPUTS]] *= side[:, None]
        change = tanh_layers(WIDTHS, self._parameters, values)
        change[:, 1] *= side
        action: FloatArray = (self._base.act(observations, spec) + change).clip(-1, 1)
        return action


def _unscaled(values: FloatArray, half: float) -> FloatArray:
    """Return lengths or vectors whose scaled value is ``values``; ``half`` has the scaled length 1/2."""
    lengths: FloatArray = half * values / (1 - _norm(values))
    return lengths


def _norm(vectors: FloatArray) -> FloatArray:
    """Return the lengths of the rows, shape (rows, 1)."""
    norms: FloatArray = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    return norms
