"""Couzin et al. 2002: swarm, torus and parallel groups over the width of the zone of orientation.

I. D. Couzin, J. Krause, R. James, G. D. Ruxton and N. R. Franks, "Collective memory and spatial sorting in
animal groups", J. Theor. Biol. 218 (2002) 1-11.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, simulate
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import rotation
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import Disc, Zones
from studies.measurements import by_name, means, share_of, split
from studies.style import curve, letter, subplots
from studies.validation import Verdict

WIDTHS: Final = tuple(0.5 * step for step in range(13))
"""Widths of the zone of orientation, in radii of the zone of repulsion."""

ATTRACTION: Final = 14.0  # width of the zone of attraction
TORUS: Final = 2.5  # width of the control
SPEED: Final = 3.0
FAST: Final = 10 * SPEED
"""Speed of the control, which moves a tenth of a second's way in a hundredth of a second's turn."""

STEPS: Final = 2_000
MEASURED: Final = 500  # last steps of each width, over which measures are averaged
NOISE: Final = 2 * math.sqrt(3) * 0.05  # uniform; its rms angle is that of the published Gaussian, 0.05 rad
FLOCKS: Final = 10
TURNING: Final = 0.5  # rotation above which a group with a smaller polarization is a torus
LITTLE: Final = 0.3  # polarization and rotation below which a group is a swarm
PARALLEL: Final = 0.9  # polarization above which a group is parallel


@dataclass(frozen=True)
class Ramp:
    """Polarization, rotation and number of groups, by the widths of a ramp."""

    polarization: tuple[Estimate, ...]
    rotation: tuple[Estimate, ...]
    num_groups: tuple[Estimate, ...]


@dataclass(frozen=True)
class Milling:
    """Ramps with rising and falling widths, both in the order of ``WIDTHS``; rotation of the control.

    ``memory`` is the paired difference of the polarization on the way down and up, by width. ``torus`` has
    the positions of the agents and their headings at the largest rotation, shape (2, n, 3).
    """

    num_flocks: int
    up: Ramp
    down: Ramp
    memory: tuple[Estimate, ...]
    slow_rotation: Estimate
    fast_rotation: Estimate
    torus: list[list[list[float]]]

    def states(self) -> dict[str, list[float]]:
        """Return the widths of swarms, tori and parallel groups on the way up."""
        rows = [*zip(WIDTHS, self.up.rotation, self.up.polarization, strict=True)]
        return {
            "swarm": [width for width, turning, order in rows if max(turning.high, order.high) < LITTLE],
            "torus": [width for width, turning, order in rows if turning.low > max(TURNING, order.high)],
            "parallel": [width for width, _, order in rows if order.low > PARALLEL],
        }

    def remembered(self) -> list[float]:
        """Return the widths at which groups have more polarization and less rotation on the way down."""
        rows = zip(WIDTHS, self.memory, self.up.rotation, self.down.rotation, strict=True)
        return [width for width, memory, up, down in rows if memory.low > 0 and down.high < up.low]


def scenario(width: float, speed: float = SPEED) -> FlockScenario:
    """Return the published model with this width of the zone of orientation; lengths in its units."""
    return FlockScenario(
        num_agents=100,
        dimension=3,
        num_steps=STEPS,
        time_step=0.1,
        speed=speed,
        initial_side=10.0,
        initial_positions=Disc(radius=5.0),
        motion=Zones(repulsion_radius=1.0, orientation_radius=1.0 + width, max_turn_rate=math.radians(40)),
        blind_angle=math.radians(90),
        angular_noise=NOISE,
        predators=(),
    )


def ramp(seeds: range) -> Arrays:
    """Return measures of one flock while the width rises and falls, and its agents in a torus.

    Returns:
        The fields of ``Ramp`` on the way up and then down, shape (2 widths, 1); ``positions`` and
        ``headings`` at the largest rotation on the way up, shape (n, 1, 3).
    """
    (seed,) = seeds
    ends, measures = [], []
    state: dict[str, Any] = {}
    for number, width in enumerate((*WIDTHS, *WIDTHS[::-1])):
        run = simulate(scenario(width), 1.0 + width + ATTRACTION, seed=seed + number * 2**32, **state)
        state = {"initial_positions": run.positions[-1], "initial_velocities": run.velocities[-1]}
        ends.append(state)
        late = {"polarization": run.polarization[-MEASURED:], "rotation": rotation(run)[-MEASURED:]}
        found = {name: values.mean() for name, values in late.items()}
        measures.append({**found, "num_groups": float(run.num_components[-1])})
    ramps = {name: values[:, np.newaxis] for name, values in by_name(measures).items()}
    torus = ends[int(np.argmax(ramps["rotation"][: len(WIDTHS)]))]
    return ramps | {
        "positions": torus["initial_positions"][:, np.newaxis],
        "headings": torus["initial_velocities"][:, np.newaxis] / SPEED,
    }


def turning(speed: float, seeds: range) -> Arrays:
    """Return the rotation of one flock at the width of the control from a random start, shape (1,)."""
    run = simulate(scenario(TORUS, speed), 1.0 + TORUS + ATTRACTION, seed=seeds[0])
    return {"rotation": rotation(run)[-MEASURED:].mean(keepdims=True)}


def jobs(scale: float) -> dict[str, list[Job]]:
    """Return the jobs by purpose, for ``results``."""
    seeds = share_of(HELD_OUT, FLOCKS, scale)
    return {
        "ramp": split(ramp, flocks=seeds, size=1, seconds=20.0),
        "slow": split(turning, SPEED, flocks=seeds, size=1, seconds=1.0),
        "fast": split(turning, FAST, flocks=seeds, size=1, seconds=1.0),
    }


def results(measured: Mapping[str, Arrays]) -> Milling:
    """Return the results of the jobs of ``jobs``."""
    found = dict(measured["ramp"])
    positions, headings = found.pop("positions")[:, 0], found.pop("headings")[:, 0]
    up = {name: values[: len(WIDTHS)] for name, values in found.items()}
    down = {name: values[: -len(WIDTHS) - 1 : -1] for name, values in found.items()}
    return Milling(
        num_flocks=up["rotation"].shape[1],
        up=Ramp(**{name: means(rows) for name, rows in up.items()}),
        down=Ramp(**{name: means(rows) for name, rows in down.items()}),
        memory=means(down["polarization"] - up["polarization"]),
        slow_rotation=mean(measured["slow"]["rotation"]),
        fast_rotation=mean(measured["fast"]["rotation"]),
        torus=[(positions - positions.mean(axis=0)).tolist(), headings.tolist()],
    )


def verdict(results: Milling) -> Verdict:
    """Return the verdict: three states in the published order, and memory of a parallel group."""
    swarms, tori, parallel = results.states().values()
    is_ordered = bool(swarms and tori and parallel) and swarms[-1] < tori[0] and tori[-1] < parallel[0]
    return Verdict.of(is_ordered, results.remembered())


def figure(results: Milling) -> Figure:
    """Draw a torus, and both measures against the width on the way up and down."""
    figure, (picture, *panels) = subplots(3.0, 1, 3)
    positions, headings = np.array(results.torus)
    axis = np.cross(positions, headings).sum(axis=0)
    across = np.linalg.svd(axis[None])[2][1:]  # two directions across the axis of rotation
    places, directions = across @ positions.T, across @ headings.T
    picture.quiver(*places, *directions, color=LIGHT.ink, angles="xy", scale=18, width=0.008)
    picture.set_aspect("equal")
    picture.set_axis_off()
    letter(picture, 0, "a torus, along its axis")
    for index, (axes, name) in enumerate(zip(panels, ("polarization", "rotation"), strict=True), start=1):
        for label, color in zip(("up", "down"), LIGHT.others, strict=False):
            rows = getattr(getattr(results, label), name)
            curve(axes, WIDTHS, rows, color, ".-", band=0.2, lw=1.5, label=label)
        axes.set(xlabel="width of the zone of orientation", ylim=(0, 1))
        letter(axes, index, name)
    panels[1].legend()
    return figure
