"""Step 5 of the flock model in plain NumPy: the strategies of docs/model.md that set the next velocity."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from hypothesis import reject
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.scenario.predators import Predator

Floats = NDArray[np.float64]
Names = NDArray[np.int64]
MASK = 2**32 - 1
PREDATORS = 4  # number of the predators' stream
FAST = {"max_speed": 30.0, "acceleration": 8.0}
PACKS: dict[str, Any] = {
    "straight": lambda s: [sc.ConstantVelocity(*s[0])],
    "coasting": lambda s: [sc.Learned(*s[0], max_speed=1e3)],
    "nearest": lambda s: [sc.PurePursuit(*s[0]), sc.PurePursuit(*s[1], max_turn_rate=0.4, **FAST)],
    "centroid": lambda s: [sc.PurePursuit(*s[0], target="centroid", **FAST)],
    "most isolated": lambda s: [sc.PurePursuit(*s[0], target="most_isolated", **FAST)],
    "assigned": lambda s: [sc.PurePursuit(*at, max_turn_rate=2.0, target="assigned", **FAST) for at in s],
    "intercept": lambda s: [
        sc.Intercept(*s[0]),
        sc.Intercept(*s[1], max_turn_rate=2.0, navigation_constant=4.0, **FAST),
    ],
    "confused": lambda s: [sc.PurePursuit(*start, confusion_rate=0.5) for start in s],
    "wandering": lambda s: [sc.Wandering(*start, angular_diffusion=1.0) for start in s],
    "encircle": lambda s: [sc.Encircle(*start, radius=25.0, **FAST) for start in s],
    "closing in": lambda s: [sc.Encircle(*start, radius=25.0, closing_speed=12.0) for start in s],
    "herd": lambda s: [
        sc.PurePursuit(*s[0]),
        sc.Herd(*s[1], distance=20.0, **FAST),
        sc.Herd(*s[2], partner=1),
    ],
    "attracted": lambda s: [sc.Attracted(*s[0]), sc.Attracted(*s[1], strength=50.0, exponent=1.0)],
    "path": lambda s: [sc.PrescribedPath([place for place, _ in s], interval=0.5)],
    "limits": lambda s: [
        sc.PurePursuit(*s[0], max_turn_rate=0.0),
        sc.PurePursuit(*s[1], max_turn_rate=1e3, max_speed=1e3),
        sc.Intercept(*s[2], navigation_constant=0.0),
        sc.Attracted(*s[3], exponent=0.0),
        sc.Wandering(*s[4], angular_diffusion=0.0),
    ],
    "all at once": lambda s: [
        sc.Wandering(*s[0], angular_diffusion=1.0),
        sc.PurePursuit(*s[1], target="assigned"),
        sc.Herd(*s[2], partner=1, **FAST),
        sc.PurePursuit(*s[3], confusion_rate=0.5),
        sc.PurePursuit(*s[4], target="assigned", **FAST),
        sc.Encircle(*s[5], radius=10.0),
        sc.Encircle(*s[6], radius=20.0),
        sc.PrescribedPath([place for place, _ in s[::2]], interval=0.7),
    ],
}
"""All strategies, by positions and velocities of up to seven predators. Learned ones get no actions."""


class Stream:
    """The draws of the core for one seed and purpose, in order: ChaCha8 (D. J. Bernstein 2008)."""

    def __init__(self, seed: int, purpose: int) -> None:
        self._words = _words(_key(seed), purpose)

    def uniform(self, end: float = 1.0) -> float:
        """Draw from U[0, end) with 53 bits."""
        low, high = next(self._words), next(self._words)
        return end * ((high << 32 | low) >> 11) * 2.0**-53

    def normal(self) -> float:
        """Draw from N(0, 1), by Box and Muller."""
        return math.sqrt(-2 * math.log(1 - self.uniform())) * math.cos(self.uniform(math.tau))


def _key(seed: int) -> list[int]:
    """Return the key of eight words for a seed of 64 bits: PCG32, as in ``seed_from_u64`` of rand_core."""
    key = []
    for _ in range(8):
        seed = (seed * 6364136223846793005 + 11634580027462260723) % 2**64
        shifted, turn = ((seed >> 18 ^ seed) >> 27) & MASK, seed >> 59
        key.append((shifted >> turn | shifted << (32 - turn)) & MASK)
    return key


def _words(key: list[int], stream: int) -> Iterator[int]:
    counter = 0
    while True:
        start = [0x61707865, 0x3320646E, 0x79622D32, 0x6B206574, *key]
        start += [counter & MASK, counter >> 32, stream & MASK, stream >> 32]
        state = start.copy()
        for _ in range(4):
            for column in range(4):
                _quarter(state, column, column + 4, column + 8, column + 12)
            for k in range(4):
                _quarter(state, k, 4 + (k + 1) % 4, 8 + (k + 2) % 4, 12 + (k + 3) % 4)
        yield from ((word + first) & MASK for word, first in zip(state, start, strict=True))
        counter += 1


def _quarter(state: list[int], a: int, b: int, c: int, d: int) -> None:
    for one, two, three, turn in ((a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)):
        state[one] = (state[one] + state[two]) & MASK
        mixed = state[three] ^ state[one]
        state[three] = (mixed << turn | mixed >> (32 - turn)) & MASK


@dataclass
class Minds:
    """State of predators that persists between steps, besides position and velocity."""

    draws: Stream
    steps: int = 0
    kept: dict[int, int] = field(default_factory=dict)


def steered(
    scenario: fe.FlockScenario,
    flock: tuple[Floats, Floats, Names],
    places: Floats,
    velocities: Floats,
    minds: Minds,
) -> Floats:
    """Return the next velocities of the predators at ``places``.

    ``flock`` has the positions, velocities and initial indices of the surviving agents.
    """
    r, v, names = flock
    dt, pack = scenario.time_step, scenario.predators
    minds.steps += 1
    centroid = r.mean(axis=0) if len(r) else None
    assigned, stations = assignment(pack, r, places), encirclement(pack, centroid, places)
    new = velocities.copy()
    for k, predator in enumerate(pack):
        own = velocities[k]
        match predator:
            case sc.ConstantVelocity() | sc.Learned():  # no action: straight on
                continue
            case sc.PrescribedPath():
                new[k] = (path_position(predator, minds.steps + 1, dt) - places[k]) / dt
                continue
            case sc.Wandering():
                new[k] = wandered(own, predator.angular_diffusion * dt, minds.draws)
                continue
            case sc.PurePursuit() if predator.confusion_rate and not len(r):
                minds.draws.uniform()
        if not len(r):
            new[k] = sped_up(predator, own, dt)
            continue
        nearest = int(np.argmin(np.linalg.norm(r - places[k], axis=1)))
        match predator:
            case sc.Attracted():
                offsets = r - places[k]
                distances = np.linalg.norm(offsets, axis=1, keepdims=True)
                pull = predator.strength * (offsets / distances**predator.exponent).mean(axis=0)
                new[k] = pull * min(1, predator.max_speed / np.linalg.norm(pull))
                continue
            case sc.Intercept():
                rate = sight_rate(r[nearest] - places[k], v[nearest] - own)
                gain, limit = predator.navigation_constant * dt, predator.max_turn_rate * dt
                turned_own = navigated(own, rate, gain, limit)
            case sc.PurePursuit():
                aims = {"nearest": nearest, "most_isolated": most_isolated(r), "assigned": assigned.get(k)}
                if predator.confusion_rate:
                    kept = np.flatnonzero(names == minds.kept.get(k))
                    aims["nearest"] = confused(predator, r, places[k], dt, kept, minds.draws)
                    minds.kept[k] = names[aims["nearest"]]
                aim = centroid if predator.target == "centroid" else r[aims[predator.target]]
                turned_own = turned(own, aim - places[k], predator.max_turn_rate * dt)
            case sc.Encircle():
                radius = max(predator.radius - predator.closing_speed * minds.steps * dt, 0)
                aim = centroid.copy()
                aim[:2] += radius * np.array([np.cos(stations[k]), np.sin(stations[k])])
                turned_own = turned(own, aim - places[k], predator.max_turn_rate * dt)
            case sc.Herd():
                away = centroid - places[predator.partner]
                aim = centroid + predator.distance * away / np.linalg.norm(away)
                turned_own = turned(own, aim - places[k], predator.max_turn_rate * dt)
        new[k] = sped_up(predator, turned_own, dt)
    return new


def sped_up(predator: Predator, own: Floats, dt: float) -> Floats:
    """Return a velocity after the acceleration of a step."""
    speed, limit = np.linalg.norm(own), getattr(predator, "max_speed", None)
    if limit is None or not hasattr(predator, "acceleration") or not 0 < speed < limit:
        return own
    return own / speed * min(speed + predator.acceleration * dt, limit)


def start(predator: Predator, scenario: fe.FlockScenario) -> tuple[Floats, Floats]:
    """Return the initial position and velocity of a predator."""
    if isinstance(predator, sc.PrescribedPath):
        first, second = (path_position(predator, steps, scenario.time_step) for steps in (0, 1))
        return first, (second - first) / scenario.time_step
    return np.array(predator.position), np.array(predator.velocity)


def path_position(predator: sc.PrescribedPath, steps: int, dt: float) -> Floats:
    """Return the position on the path after ``steps`` steps, extended straight on beyond its end."""
    points, interval = np.array(predator.positions), predator.interval or dt
    end, time = (len(points) - 1) * interval, steps * dt
    times = interval * np.arange(len(points))
    position = np.array([np.interp(time, times, column) for column in points.T])
    return position + max(time - end, 0) * (points[-1] - points[-2]) / interval


def assignment(pack: tuple, r: Floats, places: Floats) -> dict[int, int]:
    """Return the agent assigned to each predator, by an assignment over all agents without a shortlist."""
    hunters = [k for k, p in enumerate(pack) if isinstance(p, sc.PurePursuit) and p.target == "assigned"]
    if not len(r):
        return {}
    distances = np.linalg.norm(places[hunters, None] - r[None], axis=-1)
    agents = {k: int(row.argmin()) for k, row in zip(hunters, distances, strict=True)}
    rows, columns = linear_sum_assignment(distances)
    return agents | {hunters[row]: int(column) for row, column in zip(rows, columns, strict=True)}


def encirclement(pack: tuple, centroid: Floats | None, places: Floats) -> dict[int, float]:
    """Return the angle of each encircling predator's station: evenly spaced, with the smallest turns."""
    ring = [k for k, p in enumerate(pack) if isinstance(p, sc.Encircle)]
    if not ring or centroid is None:
        return {}
    bearings = {k: np.arctan2(*(places[k] - centroid)[1::-1]) for k in ring}
    order = sorted(ring, key=bearings.__getitem__)
    spaced = 2 * np.pi * np.arange(len(ring)) / len(ring)
    first = np.mean([bearings[k] for k in order] - spaced)
    return {k: first + angle for k, angle in zip(order, spaced, strict=True)}


def confused(
    predator: sc.PurePursuit, r: Floats, place: Floats, dt: float, kept: Names, draws: Stream
) -> int:
    """Return the target of a predator that others can confuse; ``kept`` is its last one, if alive."""
    distances = np.linalg.norm(r - place, axis=1)
    seen = np.flatnonzero(distances <= predator.sight)
    if draws.uniform() < 1 - np.exp(-predator.confusion_rate * max(len(seen) - 1, 0) * dt):
        return int(seen[int(draws.uniform(len(seen)))])
    return int(kept[0]) if np.isin(kept, seen).any() else int(distances.argmin())


def wandered(velocity: Floats, diffused: float, draws: Stream) -> Floats:
    """Turn ``velocity`` by random angles with variance 2 ``diffused`` along each perpendicular axis."""
    drawn = np.array([draws.normal() for _ in velocity])
    speed = np.linalg.norm(velocity)
    across = drawn - velocity * (velocity @ drawn) / speed**2
    size = np.linalg.norm(across)
    angle = size * np.sqrt(2 * diffused)
    return np.cos(angle) * velocity + np.sin(angle) * speed * across / size


def turned(velocity: Floats, sight: Floats, limit: float) -> Floats:
    """Turn ``velocity`` toward ``sight`` by at most ``limit`` rad, along their great circle."""
    speed, distance = np.linalg.norm(velocity), np.linalg.norm(sight)
    if speed == 0 or distance == 0:
        return velocity
    heading, aim = velocity / speed, sight / distance
    angle = 2 * np.arctan2(np.linalg.norm(heading - aim), np.linalg.norm(heading + aim))
    if angle <= limit:
        return speed * aim
    if angle > np.pi - 1e-6:
        reject()  # straight behind, where rounding decides the side
    part = limit / angle
    return speed * (np.sin((1 - part) * angle) * heading + np.sin(part * angle) * aim) / np.sin(angle)


def most_isolated(positions: Floats) -> int:
    """Return the first agent whose nearest other agent is farthest."""
    distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
    np.fill_diagonal(distances, np.inf)
    return int(distances.min(axis=1).argmax())


def sight_rate(offset: Floats, relative_velocity: Floats) -> Floats:
    """Return the angular velocity of a line of sight in rad/s, a vector in space."""
    squared = offset @ offset
    return np.cross(in_space(offset), in_space(relative_velocity)) / squared if squared else np.zeros(3)


def navigated(velocity: Floats, rate: Floats, gain: float, limit: float) -> Floats:
    """Turn ``velocity`` along ``rate`` x velocity by ``gain`` times the angle, at most ``limit`` rad."""
    speed = np.linalg.norm(velocity)
    across = np.cross(rate, in_space(velocity))[: len(velocity)]
    if not across.any():
        return velocity
    angle = min(gain * np.linalg.norm(across) / speed, limit)
    return np.cos(angle) * velocity + np.sin(angle) * speed * across / np.linalg.norm(across)


def in_space(vector: Floats) -> Floats:
    """Return a vector with D = 2 or 3 as one with three coordinates."""
    return np.append(vector, np.zeros(3 - len(vector)))
