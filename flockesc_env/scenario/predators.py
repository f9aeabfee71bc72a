"""Predators: each a rule that sets its next velocity (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

Target = Literal["nearest", "centroid", "most_isolated", "assigned"]


@dataclass(frozen=True)
class Start:
    """Where a predator is at t = 0 and how it moves. The base class of all predators, not a predator itself.

    A scenario replaces ``None`` by the paper's predator, which flies along the diagonal of the initial region
    through its middle: ``approach(dimension=D)``.

    Attributes:
        position: r_p(0) in m, one number per dimension; ``None``: -30 on every axis.
        velocity: v_p(0) in m/s, one number per dimension; ``None``: 10 on every axis.
    """

    position: tuple[float, ...] | None = None
    velocity: tuple[float, ...] | None = None


@dataclass(frozen=True)
class ConstantVelocity(Start):
    """A predator that flies straight on, as in the paper."""

    kind: ClassVar[str] = "constant_velocity"


@dataclass(frozen=True, kw_only=True)
class Wandering(Start):
    """A predator whose heading does a random walk at constant speed, independent of the flock.

    Attributes, besides those of ``Start``:
        angular_diffusion: rotational diffusion coefficient of the heading in rad^2/s.
    """

    kind: ClassVar[str] = "wandering"
    angular_diffusion: float = 0.1


@dataclass(frozen=True, kw_only=True)
class Steering(Start):
    """The base class of the predators that steer, not a predator itself.

    Attributes, besides those of ``Start``:
        max_turn_rate: largest turn rate in rad/s.
        max_speed: speed in m/s up to which it accelerates, at least the initial one; ``None``: the initial
            one.
        acceleration: how fast the speed grows, in m/s^2; needs a ``max_speed``.
    """

    max_turn_rate: float = 1.0
    max_speed: float | None = None
    acceleration: float = 0.0


@dataclass(frozen=True, kw_only=True)
class PurePursuit(Steering):
    """A predator that turns toward its target.

    Attributes, besides those of ``Steering``:
        target: ``"nearest"``: the agent nearest to the predator; ``"centroid"``: the mean position of all
            agents; ``"most_isolated"``: the agent whose nearest other agent is farthest; ``"assigned"``: an
            agent of its own; the predators with this target divide the agents such that the sum of their
            distances is smallest.
        confusion_rate: rate in 1/s at which each further agent in sight distracts it from its target; 0: it
            always turns toward its target.
        sight: distance in m up to which agents distract it.
    """

    kind: ClassVar[str] = "pure_pursuit"
    target: Target = "nearest"
    confusion_rate: float = 0.0
    sight: float = 30.0


@dataclass(frozen=True, kw_only=True)
class Intercept(Steering):
    """A predator that flies toward the nearest agent by proportional navigation.

    Attributes, besides those of ``Steering``:
        navigation_constant: turn rate over the rate at which the line of sight turns, N; has no unit.
    """

    kind: ClassVar[str] = "intercept"
    navigation_constant: float = 3.0


@dataclass(frozen=True, kw_only=True)
class Encircle(Steering):
    """A predator that turns toward its station on a circle around the flock's centroid.

    The encircling predators of a scenario share the circle. Their stations are evenly spaced and keep the
    predators' order. In space the circle lies in a plane of constant z.

    Attributes, besides those of ``Steering``:
        radius: radius of the circle at t = 0 in m.
        closing_speed: how fast the radius shrinks, down to 0, in m/s.
    """

    kind: ClassVar[str] = "encircle"
    radius: float = 60.0
    closing_speed: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Herd(Steering):
    """A predator that drives the flock toward its partner: it turns toward the point behind the flock.

    Attributes, besides those of ``Steering``:
        distance: distance of that point from the flock's centroid in m.
        partner: index of another predator of the scenario.
    """

    kind: ClassVar[str] = "herd"
    distance: float = 60.0
    partner: int = 0


@dataclass(frozen=True, kw_only=True)
class Learned(Start):
    """A predator that a policy controls; without a policy it flies straight on.

    Attributes, besides those of ``Start``:
        max_acceleration: acceleration of an action of norm 1, in m/s^2.
        max_speed: largest speed after a step, in m/s.
    """

    kind: ClassVar[str] = "learned"
    max_acceleration: float = 20.0
    max_speed: float = 15.0


Predator = ConstantVelocity | PurePursuit | Intercept | Wandering | Encircle | Herd | Learned
