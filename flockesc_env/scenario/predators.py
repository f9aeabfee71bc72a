"""Predators: each a rule by which its next velocity is set (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

Target = Literal["nearest", "centroid", "most_isolated", "assigned"]


@dataclass(frozen=True)
class ConstantVelocity:
    """A predator that flies straight on, as in the paper.

    Attributes:
        position: r_p(0) in m, 2 numbers or as many as the scenario's dimension (a missing z is 0).
        velocity: v_p in m/s, likewise.
    """

    kind: ClassVar[str] = "constant_velocity"
    position: tuple[float, ...] = (-30.0, -30.0)
    velocity: tuple[float, ...] = (10.0, 10.0)


@dataclass(frozen=True)
class Wandering:
    """A predator whose heading does a random walk, at constant speed and without regard to the flock.

    Attributes:
        position: r_p(0) in m, 2 numbers or as many as the scenario's dimension (a missing z is 0).
        velocity: v_p(0) in m/s, likewise; its norm is the speed at all times.
        angular_diffusion: rotational diffusion coefficient of the heading in rad^2/s.
    """

    kind: ClassVar[str] = "wandering"
    position: tuple[float, ...] = (-30.0, -30.0)
    velocity: tuple[float, ...] = (10.0, 10.0)
    angular_diffusion: float = 0.1


@dataclass(frozen=True)
class Steering:
    """What all predators that steer have in common; no predator by itself.

    Attributes:
        position: r_p(0) in m, 2 numbers or as many as the scenario's dimension (a missing z is 0).
        velocity: v_p(0) in m/s, likewise.
        max_turn_rate: largest turn rate in rad/s.
        max_speed: speed in m/s up to which it accelerates, at least the initial one; ``None``: it keeps that.
        acceleration: how fast the speed grows, in m/s^2; needs a ``max_speed``.
    """

    position: tuple[float, ...] = (-30.0, -30.0)
    velocity: tuple[float, ...] = (10.0, 10.0)
    max_turn_rate: float = 1.0
    max_speed: float | None = field(default=None, kw_only=True)
    acceleration: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True)
class PurePursuit(Steering):
    """A predator that turns toward its target.

    Attributes, besides those of ``Steering``:
        target: ``"nearest"``: the agent nearest to the predator; ``"centroid"``: the mean position of all
            agents; ``"most_isolated"``: the agent whose nearest other agent is farthest; ``"assigned"``: an
            agent of its own, where all predators with this target share out agents such that the sum of
            their distances is smallest.
        confusion_rate: how often each further agent in sight draws it off the agent that it is after, in
            1/s; 0: it always turns toward its target.
        sight: how far it sees for that, in m.
    """

    kind: ClassVar[str] = "pure_pursuit"
    target: Target = "nearest"
    confusion_rate: float = 0.0
    sight: float = 30.0


@dataclass(frozen=True)
class Intercept(Steering):
    """A predator that flies by proportional navigation toward the nearest agent.

    Attributes, besides those of ``Steering``:
        navigation_constant: turn rate over the rate at which the line of sight turns, N; has no unit.
    """

    kind: ClassVar[str] = "intercept"
    navigation_constant: float = 3.0


@dataclass(frozen=True)
class Encircle(Steering):
    """A predator that turns toward its station on a circle around the flock's centroid.

    All encircling predators of a scenario share the circle: their stations are evenly spaced, and none has to
    pass another one. In space the circle lies in a plane of constant z.

    Attributes, besides those of ``Steering``:
        radius: of the circle at t = 0, in m.
        closing_speed: how fast its radius shrinks, down to 0, in m/s.
    """

    kind: ClassVar[str] = "encircle"
    radius: float = 60.0
    closing_speed: float = 0.0


@dataclass(frozen=True)
class Herd(Steering):
    """A predator that turns toward the point behind the flock as its partner sees it, to drive it there.

    Attributes, besides those of ``Steering``:
        distance: of that point from the flock's centroid, in m.
        partner: index of another one of the scenario's predators.
    """

    kind: ClassVar[str] = "herd"
    distance: float = 60.0
    partner: int = 0


@dataclass(frozen=True)
class Learned:
    """A predator that is steered from outside, by a policy; without one it flies straight on.

    Attributes:
        position: r_p(0) in m, 2 numbers or as many as the scenario's dimension (a missing z is 0).
        velocity: v_p(0) in m/s, likewise.
        max_acceleration: acceleration of an action of norm 1, in m/s^2.
        max_speed: speed in m/s that no step leaves it beyond.
    """

    kind: ClassVar[str] = "learned"
    position: tuple[float, ...] = (-30.0, -30.0)
    velocity: tuple[float, ...] = (10.0, 10.0)
    max_acceleration: float = 20.0
    max_speed: float = 15.0


Predator = ConstantVelocity | PurePursuit | Intercept | Wandering | Encircle | Herd | Learned
