"""Where a predator comes from, said by what it aims at."""

from __future__ import annotations

import math
from typing import Literal

from flockesc_env.common.checks import as_floats
from flockesc_env.common.errors import ArgumentError, shown

Pair = tuple[float, float]


def approach(
    aim: Literal["center", "edge"] | float = "center",
    *,
    distance: float = 80 * math.sqrt(2),
    speed: float = 10 * math.sqrt(2),
    direction: Pair = (1.0, 1.0),
    initial_side: float = 100.0,
) -> tuple[Pair, Pair]:
    """Return position in m and velocity in m/s of a predator in the plane that flies at the initial region.

    The defaults are the paper's predator: ``ConstantVelocity(*approach())``. In space the predator is in the
    plane z = 0.

    Args:
        aim: ``"center"`` of the initial region; its ``"edge"``, which the straight path touches on the left;
            or how far to the left of the center the path passes, in m (negative: to the right).
        distance: how far before its nearest point to the center the predator starts, in m.
        speed: its speed in m/s.
        direction: where it heads, a vector of any length other than 0.
        initial_side: side of the initial region in m, as in the scenario.

    Raises:
        ArgumentError: naming the argument of a wrong type or shape, not finite or negative, or a
            direction of length 0.
    """
    x, y = map(float, as_floats(direction, "direction", (2,)))
    norm = math.hypot(x, y)
    if norm == 0:
        raise ArgumentError("direction", "a vector of a length other than 0", direction)
    distance = float(as_floats(distance, "distance", (), least=0.0))
    speed = float(as_floats(speed, "speed", (), least=0.0))
    half = float(as_floats(initial_side, "initial_side", (), least=0.0)) / 2
    if not isinstance(aim, str):
        offset = float(as_floats(aim, "aim", ()))
    elif aim == "center":
        offset = 0.0
    elif aim == "edge":
        offset = half * (abs(x) + abs(y)) / norm
    else:
        raise ArgumentError("aim", "center, edge or a number", shown(aim))
    position = (
        half - distance * x / norm - offset * y / norm,
        half - distance * y / norm + offset * x / norm,
    )
    return position, (speed * x / norm, speed * y / norm)
