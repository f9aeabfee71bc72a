"""The law of the best range: two ends of the curve by quadrature, and a form with four fitted numbers.

Lengths are in sides L of the initial square and times in L / v0. The predator flies along a diagonal and
starts at 0.8 sqrt(D) from the center, as in the paper.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from flockesc_env.common.stats import Estimate, FloatArray

PAPER_SPEED: Final = math.sqrt(2)  # of the predator in v0
STEP: Final = 0.005  # path of an agent in one step of the paper's flock
POINTS: Final = 12  # nodes of the quadrature along a side
MOMENTS: Final = 241  # times at which distances are compared, as in the paper's flock


class Ends(NamedTuple):
    """J_mean of agents that turn at the start or never.

    Agents fly ``alone`` along independent random headings, with angular noise, or ``straight`` without. All
    fly along one random heading (``aligned``), or each away from the center (``outward``). ``time`` is that
    of the smallest mean distance of straight flight.
    """

    alone: float
    straight: float
    aligned: float
    outward: float
    time: float


def duration(dimension: int, speed: float) -> float:
    """Return the time that the predator takes to the center and half as much: 12 s in the paper's flock."""
    return 1.2 * math.sqrt(dimension) / speed


@cache
def ends(dimension: int, speed: float, noise: float = 0.0) -> Ends:
    """Return the ends of the curve for a predator's speed in v0 and an angular noise in two dimensions.

    An agent starts at r, uniform in the cube around 0, and has moved by s(t) along its heading e when the
    predator is at q(t). ``alone`` is the minimum over t of the mean of |r + s e - q| over r and e.
    ``aligned`` is the mean over e of the minimum over t of the mean over r. With noise, s is the rms
    displacement of a walk whose heading keeps the cosine c = sin(noise / 2) / (noise / 2) per step.
    """
    nodes, weights = (part / 2 for part in np.polynomial.legendre.leggauss(POINTS))
    starts = np.array([*product(nodes, repeat=dimension)])
    masses = np.prod([*product(weights, repeat=dimension)], axis=1)
    times = np.linspace(0, duration(dimension, speed), MOMENTS)
    headings = _headings(dimension)[:, None]

    def distances(moved: FloatArray, along: FloatArray) -> FloatArray:
        """Return the mean over starts by time and heading; ``along`` has shape (headings, 1 or starts, D)."""
        predators = speed * times / math.sqrt(dimension) - 0.8
        paths = zip(moved, predators, strict=True)
        return np.array([np.linalg.norm(starts + s * along - q, axis=2) @ masses for s, q in paths])

    straight = distances(times, headings)
    kept, steps = float(np.sinc(noise / (2 * np.pi))), times / STEP
    walked = times
    if noise > 0:
        squares = steps * (1 + kept) / (1 - kept) - 2 * kept * (1 - kept**steps) / (1 - kept) ** 2
        walked = STEP * np.sqrt(squares)
    outwards = starts / np.linalg.norm(starts, axis=1, keepdims=True)
    return Ends(
        alone=float(distances(walked, headings).mean(axis=1).min()),
        straight=float(straight.mean(axis=1).min()),
        aligned=float(straight.min(axis=0).mean()),
        outward=float(distances(times, outwards[None]).min()),
        time=float(times[straight.mean(axis=1).argmin()]),
    )


def _headings(dimension: int) -> FloatArray:
    """Return evenly spread unit vectors: 64 of a circle, or 256 on a spiral around a sphere."""
    count = 4 ** (dimension + 1)
    places = (np.arange(count) + 0.5) / count
    angles = 2 * np.pi * places if dimension == 2 else np.pi * (1 + math.sqrt(5)) * count * places
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if dimension == 2:
        return circle
    heights = 1 - 2 * places[:, None]
    return np.hstack([circle * np.sqrt(1 - heights**2), heights])


@dataclass(frozen=True)
class Law:
    """Four numbers, fitted to flocks of the paper's shape without an escape force.

    ``share`` is that of outward flight which flocks reach by sorting. It takes ``meetings``: the number of
    agents met after which 1 / e of the sorting is missing. Around the range ``length`` the flock begins to
    agree on one heading. This happens the more suddenly the larger ``sharpness``.
    """

    share: float
    meetings: float
    length: float
    sharpness: float

    def gain(self, num_agents: int, ranges: FloatArray, found: Ends, dimension: int = 2) -> FloatArray:
        """Return J_mean minus that at range 0."""
        is_sorted = 1 - np.exp(-meetings(num_agents, ranges, found.time, dimension) / self.meetings)
        agree = 1 - np.exp(-((ranges / self.length) ** self.sharpness))
        reached = found.straight + self.share * (found.outward - found.straight)
        gain: FloatArray = is_sorted * (1 - agree) * (reached - found.alone)
        return gain + agree * (found.aligned - found.alone)


def meetings(num_agents: int, ranges: FloatArray, time: float, dimension: int = 2) -> FloatArray:
    """Return how many agents come within range of one until a time, if all fly straight.

    It is density times cross section times time times the mean relative speed, 4 / pi or 4 / 3 of v0.
    """
    swept = 8 / np.pi * ranges if dimension == 2 else 4 / 3 * np.pi * ranges**2
    found: FloatArray = num_agents * time * swept
    return found


def fit(ranges: FloatArray, curves: Iterable[tuple[int, Iterable[Estimate]]]) -> Law:
    """Fit the law to gains of flocks by number of agents, under ranges from 0 on."""
    found, rows = ends(2, PAPER_SPEED), [(num_agents, [*curve][1:]) for num_agents, curve in curves]
    means = np.array([[one.mean for one in curve] for _, curve in rows])
    widths = np.array([[one.high - one.low for one in curve] for _, curve in rows])

    def errors(numbers: FloatArray) -> FloatArray:
        gains = [Law(*numbers).gain(num_agents, ranges[1:], found) for num_agents, _ in rows]
        off: FloatArray = ((gains - means) / widths).ravel()
        return off

    return Law(*map(float, least_squares(errors, [0.15, 5.0, 0.25, 3.0]).x))
