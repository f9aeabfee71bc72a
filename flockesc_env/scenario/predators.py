"""Predators and their strategies (docs/model.md), and ``approach``: their start from their aim."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from flockesc_env.common.checks import as_floats, as_integer
from flockesc_env.common.errors import InputError, shown
from flockesc_env.scenario.parts import Part

Target = Literal["nearest", "centroid", "most_isolated", "assigned"]


@dataclass(frozen=True)
class Start(Part):
    """Abstract base class of predators with a given initial position and velocity.

    The defaults are the paper's: the predator flies along the diagonal of the initial region,
    ``approach(dimension=D)``.

    Attributes:
        position: r_p(0) in m, D numbers; ``None``: -30 on every axis.
        velocity: v_p(0) in m/s, D numbers; ``None``: 10 on every axis.
    """

    position: tuple[float, ...] | None = None
    velocity: tuple[float, ...] | None = None


@dataclass(frozen=True)
class ConstantVelocity(Start):
    """A predator that flies straight on at constant speed, as in the paper."""


@dataclass(frozen=True, kw_only=True)
class Wandering(Start):
    """A predator whose heading performs a random walk at constant speed, independent of the flock.

    Attributes:
        angular_diffusion: rotational diffusion coefficient of the heading in rad^2/s.
    """

    angular_diffusion: float = 0.1


@dataclass(frozen=True, kw_only=True)
class Steering(Start):
    """Abstract base class of predators with a limited turn rate.

    Attributes:
        max_turn_rate: largest turn rate in rad/s.
        max_speed: largest speed in m/s, at least the initial speed; ``None``: the initial speed.
        acceleration: rate in m/s^2 at which the speed grows to ``max_speed``; requires ``max_speed``.
    """

    max_turn_rate: float = 1.0
    max_speed: float | None = None
    acceleration: float = 0.0


@dataclass(frozen=True, kw_only=True)
class PurePursuit(Steering):
    """A predator that turns toward its target (pure pursuit).

    Attributes:
        target: ``"nearest"``: the agent nearest to the predator; ``"centroid"``: the mean position of all
            agents; ``"most_isolated"``: the agent whose nearest other agent is farthest; ``"assigned"``: the
            agent assigned to this predator. All predators with this target are assigned different agents such
            that the sum of the distances is smallest.
        confusion_rate: rate in 1/s at which each other agent within ``sight`` distracts the predator from
            its target; 0: no distraction.
        sight: distance in m within which agents distract the predator.
    """

    target: Target = "nearest"
    confusion_rate: float = 0.0
    sight: float = 30.0


@dataclass(frozen=True, kw_only=True)
class Intercept(Steering):
    """A predator that intercepts the nearest agent by proportional navigation.

    Attributes:
        navigation_constant: ratio N of the turn rate to the rotation rate of the line of sight.
    """

    navigation_constant: float = 3.0


@dataclass(frozen=True, kw_only=True)
class Encircle(Steering):
    """A predator that turns toward its place on a circle around the flock's centroid.

    All ``Encircle`` predators of a scenario share the circle. Their places are evenly spaced, in the order of
    the predators. In space the circle lies in a plane of constant z.

    Attributes:
        radius: radius of the circle at t = 0 in m.
        closing_speed: rate in m/s at which the radius shrinks to 0.
    """

    radius: float = 60.0
    closing_speed: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Herd(Steering):
    """A predator that drives the flock toward another predator: it turns toward a point behind the flock.

    Attributes:
        distance: distance in m between the flock's centroid and this point.
        partner: index of the other predator in the scenario.
    """

    distance: float = 60.0
    partner: int = 0


@dataclass(frozen=True, kw_only=True)
class Learned(Start):
    """A predator whose acceleration a policy sets; without a policy it flies straight on.

    Attributes:
        max_acceleration: acceleration in m/s^2 of an action of norm 1.
        max_speed: largest speed in m/s.
    """

    max_acceleration: float = 20.0
    max_speed: float = 15.0


@dataclass(frozen=True)
class PrescribedPath(Part):
    """A predator that follows given positions, for example those of a tracked animal.

    It flies straight between two positions, and straight on after the last one. Its initial position and
    velocity follow from the path.

    Attributes:
        positions: r_p in m at the times 0, ``interval``, 2 ``interval``, ..; at least two, each of D numbers.
        interval: time in s between two positions; ``None``: the scenario's ``time_step``.
    """

    positions: tuple[tuple[float, ...], ...]
    interval: float | None = None


@dataclass(frozen=True, kw_only=True)
class Attracted(Start):
    """A predator that moves toward all agents at once, toward near ones more (Chen and Kolokolnikov 2014).

    Attributes:
        strength: strength c of the attraction in m^p/s.
        exponent: exponent p; an agent at the distance d adds a speed proportional to d^(1 - p).
        max_speed: largest speed in m/s.
    """

    strength: float = 10_000.0
    exponent: float = 3.0
    max_speed: float = 15.0


Predator = (
    ConstantVelocity
    | PurePursuit
    | Intercept
    | Wandering
    | Encircle
    | Herd
    | Learned
    | PrescribedPath
    | Attracted
)


def approach(
    aim: Literal["center", "edge"] | float | Sequence[float] = "center",
    *,
    distance: float | None = None,
    speed: float | None = None,
    direction: Sequence[float] | None = None,
    initial_side: float = 100.0,
    dimension: int | None = None,
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the start position in m and velocity in m/s of a predator that flies toward the flock.

    The defaults give the paper's predator, which flies along the diagonal of the initial region:
    ``ConstantVelocity(*approach())``, or ``ConstantVelocity(*approach(dimension=3))`` in space.

    Args:
        aim: the point or line that the straight path passes. ``"center"``: the center of the initial region.
            ``"edge"``: the path touches the initial region on the left of its center. A number: the distance
            in m at which the path passes the center on the left (negative: on the right). A vector of D
            numbers: a point on the path, in m. In space "left" is horizontal.
        distance: distance in m from the start to ``aim``, if that is a point, otherwise to the point of the
            path nearest to the center; ``None``: 80 sqrt(D).
        speed: speed in m/s; ``None``: 10 sqrt(D).
        direction: direction of flight, a nonzero vector of D numbers; ``None``: the diagonal, (1, .., 1).
        initial_side: side of the initial region in m, as in the scenario.
        dimension: dimension D of space, 2 or 3; ``None``: the length of ``aim`` if that is a vector,
            otherwise 2.

    Returns:
        Position and velocity, tuples of D numbers.
    """
    target = None if isinstance(aim, str) else as_floats(aim, "aim")
    if dimension is None:
        dimension = target.size if target is not None and target.ndim else 2
    dimension = as_integer(dimension, "dimension")
    if dimension not in {2, 3}:
        raise InputError("dimension", "2 or 3", dimension)
    heading = [1.0] * dimension
    if direction is not None:
        heading = as_floats(direction, "direction", (dimension,)).tolist()
    exponent = math.frexp(max(map(abs, heading)))[1]
    heading = [math.ldexp(entry, -exponent) for entry in heading]  # exact, and squares do not overflow
    # Not math.hypot, whose last bit depends on the version of Python and on the machine.
    squares = [entry * entry for entry in heading]
    flat, norm = math.sqrt(squares[0] + squares[1]), math.sqrt(squares[0] + squares[1] + sum(squares[2:]))
    if norm == 0:
        raise InputError("direction", "a nonzero vector", direction)
    distance = 80 * math.sqrt(dimension) if distance is None else _length(distance, "distance")
    speed = 10 * math.sqrt(dimension) if speed is None else _length(speed, "speed")
    half = _length(initial_side, "initial_side") / 2
    point, offset = [half] * dimension, 0.0
    if target is not None and target.ndim:
        point = as_floats(target, "aim", (dimension,)).tolist()
    elif target is not None:
        offset = float(target)
    elif aim == "edge":
        offset = half * (abs(heading[0]) + abs(heading[1])) / (flat or 1.0)
    elif aim != "center":
        raise InputError("aim", "center, edge, a number or a point", shown(aim))
    left = [-heading[1], heading[0], 0.0][:dimension]
    if flat == 0 and (offset != 0 or aim == "edge"):
        expected = "a direction that is not vertical, because the aim is to its left"
        raise InputError("direction", expected, direction)
    position = tuple(
        middle - distance * ahead / norm + offset * aside / (flat or 1.0)
        for middle, ahead, aside in zip(point, heading, left, strict=True)
    )
    return position, tuple(speed * ahead / norm for ahead in heading)


def _length(value: float, field: str) -> float:
    return float(as_floats(value, field, (), least=0.0))
