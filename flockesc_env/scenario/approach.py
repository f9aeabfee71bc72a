"""``approach``: start position and velocity of a predator from its aim."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from flockesc_env.common.checks import as_floats, as_integer
from flockesc_env.common.errors import InputError, shown

Vector = tuple[float, ...]


def approach(
    aim: Literal["center", "edge"] | float | Sequence[float] = "center",
    *,
    distance: float | None = None,
    speed: float | None = None,
    direction: Sequence[float] | None = None,
    initial_side: float = 100.0,
    dimension: int | None = None,
) -> tuple[Vector, Vector]:
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

    Raises:
        InputError: if an argument has the wrong type or shape, is not finite or is negative, or if the
            direction has length 0.
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
