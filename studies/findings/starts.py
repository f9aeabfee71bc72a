"""Other starts of the paper's flock: initial polarization, direction of attack, speed and density."""

from __future__ import annotations

import math
from typing import Final

from scipy.optimize import brentq

from flockesc_env import AlignedHeadings, ConstantVelocity, FlockScenario
from flockesc_env.scenario.approach import approach

POLARIZATIONS: Final = (0.47, 0.85, 0.96, 0.99)
"""Expected initial polarization of an infinite flock."""

ATTACKS: Final = {"across": (1.0, -1.0), "head-on": (-1.0, -1.0)}
"""Mean initial heading, by how it lies to the predator's path, which is the diagonal (1, 1)."""

RANDOM = "random headings"
FAST, DENSE = "predator twice as fast", "half the side"

STARTED = (
    "per-agent-visible",
    "per-agent-visible-derived",
    "per-agent-visible-profile",
    "per-agent-local",
    "shared",
)
"""Settings whose headline policies are tried in the starts; the objective of all is J_mean."""


def starts() -> dict[str, FlockScenario]:
    """Return the worlds by name."""
    aligned = {
        start_name(polarization, attack): FlockScenario(
            initial_headings=AlignedHeadings(direction, max_angle(polarization))
        )
        for polarization in POLARIZATIONS
        for attack, direction in ATTACKS.items()
    }
    return {
        RANDOM: FlockScenario(),
        **aligned,
        FAST: FlockScenario(predators=(ConstantVelocity(*approach(speed=20 * math.sqrt(2))),)),
        DENSE: FlockScenario(initial_side=50.0),
    }


def start_name(polarization: float, attack: str) -> str:
    """Return the name of a start with aligned headings."""
    return f"polarization {polarization:g}, {attack}"


def max_angle(polarization: float) -> float:
    """Return the angle in rad within which headings are drawn.

    The mean of unit vectors that are uniform within the angle a of a direction has the length sin(a) / a.
    """
    return float(brentq(lambda angle: math.sin(angle) / angle - polarization, 1e-6, math.pi))
