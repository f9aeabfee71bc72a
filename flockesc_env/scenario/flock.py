"""The flock scenario: the parameters of the flock model and their defaults."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from flockesc_env import _core
from flockesc_env.common.checks import as_seed
from flockesc_env.common.errors import ScenarioError, shown
from flockesc_env.scenario.approach import approach
from flockesc_env.scenario.document import Document
from flockesc_env.scenario.initial import InitialHeadings, InitialPositions, RandomHeadings, Square
from flockesc_env.scenario.motion import Inertial, Motion
from flockesc_env.scenario.neighbors import Metric, NeighborRule
from flockesc_env.scenario.predators import ConstantVelocity, Learned, Predator
from flockesc_env.scenario.randomization import Distribution


@dataclass(frozen=True)
class FlockScenario(Document):
    """The flock model (docs/model.md, "Flock"); the defaults are the paper's setting.

    Attributes:
        num_agents: number of agents n.
        dimension: dimension D of space, 2 or 3.
        num_steps: steps of an episode; its horizon is ``num_steps * time_step`` seconds.
        time_step: length dt of a step in s.
        mass: mass m in kg, one number for all agents or one per agent.
        speed: speed v0 in m/s, one number for all agents or one per agent.
        initial_side: side in m of the initial region [0, side]^D, around whose center agents start; also the
            length scale of observations.
        initial_positions: where agents start: ``Square()``, ``Disc(radius)``, ``Ring(radius, width)``,
            ``Segment(start, end)``, ``Gaussian(standard_deviation)``, ``Clusters(num_clusters,
            standard_deviation)`` or ``GivenPositions(points)``.
        initial_headings: where they head: ``RandomHeadings()``, ``AlignedHeadings(direction, max_angle)`` or
            ``GivenHeadings(directions)``.
        initial_plane: whether a flock in space starts in the plane z = 0, positions and headings.
        predator_range: distance rho_p in m up to which agents flee from a predator.
        repulsion_strength: strength s of the escape force, one number for all agents or one per agent; 0:
            agents do not flee.
        alignment_strength: weight a of the consensus with neighbors, one number for all agents or one per
            agent; 0: agents ignore their neighbors.
        motion: how forces set velocities: ``Inertial()``, ``Vicsek()`` or
            ``Reynolds(separation_strength, cohesion_strength, separation_range)``.
        angular_noise: width eta in rad of the error in the new heading, from 0 to 2 pi.
        sensing_noise: error in the neighbors' mean velocity, over v0.
        sensing_delay: number of steps between sensing neighbors and reacting to them.
        constant_speed: whether agents keep speed v0 (step 4 of docs/model.md); ``False`` is the literal law.
        capture_radius: distance in m to the nearest predator up to which an agent is caught at the end of a
            step and leaves the flock for good; ``None``: no captures.
        predators: a tuple of any number of predators (``ConstantVelocity``, ``PurePursuit``, ``Intercept``,
            ``Wandering``, ``Encircle``, ``Herd``, ``Learned``); may be empty.
        neighbor_rule: who is a neighbor: ``Metric()``, ``Topological()`` or ``Voronoi()``.
        blind_angle: full angle in rad of the sector behind an agent in which it sees no neighbor, from 0 to
            2 pi.
        mutual: whether two agents are neighbors only if each would listen to the other.
        frozen_graph: whether the neighbor graph of the first step stays, for any range.
        periodic_side: side in m of a periodic world (a torus), which has no predators; ``None``: an open
            world.
        randomization: numbers that every episode draws again from its seed, in this order: any of
            ``Uniform(field, low, high)``, ``LogUniform(field, low, high)`` and ``Choice(field, values)``, for
            other fields than ``initial_side`` and ``time_step``.

    Raises:
        ScenarioError: naming a field of a wrong type or out of bounds.
    """

    num_agents: int = 300
    dimension: int = 2
    num_steps: int = 240
    time_step: float = 0.05
    mass: float | tuple[float, ...] = 0.1
    speed: float | tuple[float, ...] = 10.0
    initial_side: float = 100.0
    initial_positions: InitialPositions = Square()  # noqa: RUF009, frozen
    initial_headings: InitialHeadings = RandomHeadings()  # noqa: RUF009, frozen
    initial_plane: bool = False
    predator_range: float = 30.0
    repulsion_strength: float | tuple[float, ...] = 10.0
    alignment_strength: float | tuple[float, ...] = 1.0
    motion: Motion = Inertial()  # noqa: RUF009, frozen
    angular_noise: float = 0.0
    sensing_noise: float = 0.0
    sensing_delay: int = 0
    constant_speed: bool = True
    capture_radius: float | None = None
    predators: tuple[Predator, ...] = (ConstantVelocity(),)
    neighbor_rule: NeighborRule = Metric()  # noqa: RUF009, frozen
    blind_angle: float = 0.0
    mutual: bool = False
    frozen_graph: bool = False
    periodic_side: float | None = None
    randomization: tuple[Distribution, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.dimension not in {2, 3}:
            raise ScenarioError("dimension", "2 or 3", self.dimension)
        placed = tuple(_placed(predator, k, self.dimension) for k, predator in enumerate(self.predators))
        object.__setattr__(self, "predators", placed)
        _core.check_flock_scenario(self.to_json())

    def drawn(self, seed: int) -> FlockScenario:
        """Return the scenario of the episode with this seed, with the drawn numbers and no ``randomization``.

        ``simulate(scenario.drawn(k), .., seed=k)`` equals ``simulate(scenario, .., seed=k)``, bit for bit.

        Raises:
            ArgumentError: if ``seed`` is not an integer in [0, 2^64).
        """
        document = _core.drawn_flock_scenario(self.to_json(), as_seed(seed)) if self.randomization else None
        return self if document is None else FlockScenario.from_json(document)

    def with_learned_predators(self) -> FlockScenario:
        """Return the scenario with every predator ``Learned``, at its position and velocity.

        Raises:
            ScenarioError: if there is no predator.
        """
        if not self.predators:
            raise ScenarioError("predators", "at least one predator", "none")
        learned = (
            predator
            if isinstance(predator, Learned)
            else Learned(position=predator.position, velocity=predator.velocity)
            for predator in self.predators
        )
        return self.replace(predators=tuple(learned))


def _placed(predator: Predator, index: int, dimension: int) -> Predator:
    """Return a predator with the default start of the dimension instead of ``None``, after a check."""
    position, velocity = approach(dimension=dimension)
    position = position if predator.position is None else predator.position
    velocity = velocity if predator.velocity is None else predator.velocity
    for name, vector in (("position", position), ("velocity", velocity)):
        if len(vector) != dimension:
            field = f"predators[{index}].{predator.kind}.{name}"
            raise ScenarioError(field, f"{dimension} numbers, as the dimension is {dimension}", shown(vector))
    return dataclasses.replace(predator, position=position, velocity=velocity)
