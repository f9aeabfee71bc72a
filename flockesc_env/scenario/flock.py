"""``FlockScenario``: parameters of the flock model and their defaults."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from flockesc_env import _core
from flockesc_env.common.checks import as_seed
from flockesc_env.common.errors import InputError
from flockesc_env.scenario import parts
from flockesc_env.scenario.document import Document, checked
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES, ObjectiveSpec
from flockesc_env.scenario.options import EnvOptions, EnvOptionsDict, check_names
from flockesc_env.scenario.predators import ConstantVelocity, Learned, Predator, Start, approach

_SEARCH_RANGES = (*(2.0 * k for k in range(11)), 25.0, 30.0, 40.0, 50.0, 75.0, 100.0, 150.0)


@dataclass(frozen=True)
class FlockScenario(Document):
    """Parameters of the flock model (docs/model.md, "Flock"); the defaults are the paper's.

    Attributes:
        num_agents: number of agents n.
        dimension: dimension D of space, 2 or 3.
        num_steps: number of model steps of an episode, which lasts ``num_steps * time_step`` seconds.
        time_step: duration dt of a model step in s.
        mass: mass m in kg, one number for all agents or one per agent.
        speed: speed v0 in m/s, one number for all agents or one per agent.
        initial_side: side in m of the initial region [0, side]^D. Agents start around its center.
            Observations are scaled by it.
        initial_positions: distribution of the initial positions: ``Square``, ``Disc``, ``Ring``, ``Segment``,
            ``Gaussian``, ``Clusters`` or ``GivenPositions``.
        initial_headings: distribution of the initial headings: ``RandomHeadings``, ``AlignedHeadings`` or
            ``GivenHeadings``.
        initial_plane: whether initial positions and headings lie in the plane z = 0, if D = 3.
        predator_range: distance rho_p in m within which agents flee from a predator.
        repulsion_strength: strength s of the escape force, one number for all agents or one per agent; 0:
            agents do not flee.
        alignment_strength: weight a of the consensus with neighbors, one number for all agents or one per
            agent; 0: agents ignore their neighbors.
        motion: law that turns forces into velocities: ``Inertial``, ``Vicsek``, ``Reynolds``,
            ``PreferredDistance``, ``Zones`` or ``FirstOrder``.
        angular_noise: width eta in rad of the noise added to the heading in every step, from 0 to 2 pi.
        sensing_noise: length of the noise vector added to the neighbors' mean velocity, in units of v0.
        sensing_delay: number of steps between sensing neighbors and reacting to them.
        constant_speed: True: agents keep speed v0 (step 4 in docs/model.md). False: the law as the paper
            prints it, under which speeds vary.
        capture_radius: distance in m within which a predator catches an agent. The agent is removed from the
            flock at the end of the step. ``None``: no captures.
        predators: tuple of predators (docs/model.md, "Predators"); may be empty.
        neighbor_rule: definition of neighbors: ``Metric()``, ``Topological()`` or ``Voronoi()``.
        blind_angle: angle in rad of the sector behind an agent in which it sees no neighbors, from 0 to 2 pi.
        mutual: True: two agents are neighbors only if each is in the other's neighborhood.
        frozen_graph: True: the neighbor graph of the first step is used in all steps, even if ranges change.
        blocks_warnings: True: an agent that no predator has reached does not hear agents that one has
            reached. A predator reaches an agent that is, or was, within ``predator_range`` of it.
        periodic_side: side in m of a periodic domain (a torus), which cannot contain predators; ``None``: an
            unbounded domain.
        randomization: fields that are drawn from the seed in every episode, in this order: a tuple of
            ``Uniform``, ``LogUniform``, ``Choice`` and ``RandomApproach``. Any number of the scenario can be
            drawn except ``initial_side`` and ``time_step``. An episode that draws a number out of bounds
            raises ``InputError`` at its reset.
        model: name of the model.
        objectives: the model's objectives by name; the first one is the default.
        search_ranges: fixed ranges in m among which the best one is chosen.
    """

    model: ClassVar[str] = "flock"
    objectives: ClassVar[Mapping[str, ObjectiveSpec]] = FLOCK_OBJECTIVES
    search_ranges: ClassVar[tuple[float, ...]] = _SEARCH_RANGES

    num_agents: int = 300
    dimension: int = 2
    num_steps: int = 240
    time_step: float = 0.05
    mass: float | tuple[float, ...] = 0.1
    speed: float | tuple[float, ...] = 10.0
    initial_side: float = 100.0
    initial_positions: parts.InitialPositions = parts.Square()  # noqa: RUF009, frozen
    initial_headings: parts.InitialHeadings = parts.RandomHeadings()  # noqa: RUF009, frozen
    initial_plane: bool = False
    predator_range: float = 30.0
    repulsion_strength: float | tuple[float, ...] = 10.0
    alignment_strength: float | tuple[float, ...] = 1.0
    motion: parts.Motion = parts.Inertial()  # noqa: RUF009, frozen
    angular_noise: float = 0.0
    sensing_noise: float = 0.0
    sensing_delay: int = 0
    constant_speed: bool = True
    capture_radius: float | None = None
    predators: tuple[Predator, ...] = (ConstantVelocity(),)
    neighbor_rule: parts.NeighborRule = parts.Metric()  # noqa: RUF009, frozen
    blind_angle: float = 0.0
    mutual: bool = False
    frozen_graph: bool = False
    blocks_warnings: bool = False
    periodic_side: float | None = None
    randomization: tuple[parts.Distribution, ...] = ()

    def __post_init__(self) -> None:
        given = self._given()
        position, velocity = approach(dimension=given["dimension"])
        for predator in given["predators"]:
            (fields,) = predator.values()
            for name, default in (("position", position), ("velocity", velocity)):
                if isinstance(fields, dict) and name in fields and fields[name] is None:
                    fields[name] = default
        self._set(checked(_core.check_flock_scenario, given))

    def env_options(
        self, given: Mapping[str, Any], known: type = EnvOptionsDict, own: Iterable[str] = ()
    ) -> EnvOptions:
        """Return the options of an environment with this scenario, from its keyword arguments.

        ``known`` is a ``TypedDict`` of all that the environment accepts; those that are not options are
        ignored. An error about an unknown name also lists ``own``, other arguments of the environment. A
        topological rule requires ``max_range``.
        """
        check_names(self, given, known, own)
        if isinstance(self.neighbor_rule, parts.Topological) and "max_range" not in given:
            expected = "the largest number of neighbors, required by a topological rule"
            raise InputError("max_range", expected, "none")
        return EnvOptions.among(given)

    @property
    def range_unit(self) -> str:
        """Unit of interaction ranges."""
        return "neighbors" if isinstance(self.neighbor_rule, parts.Topological) else "m"

    @property
    def length_scale(self) -> float:
        """A length of this many m is observed as 1/2."""
        return self.initial_side

    @property
    def speed_scale(self) -> float:
        """A speed of this many m/s is observed as 1/2."""
        return max(self.speed) if isinstance(self.speed, tuple) else self.speed

    @property
    def num_learned(self) -> int:
        """Number of ``Learned`` predators."""
        return sum(isinstance(predator, Learned) for predator in self.predators)

    def drawn(self, seed: int) -> "FlockScenario":
        """Return the scenario of the episode with this seed: with drawn fields and without ``randomization``.

        ``simulate(scenario.drawn(k), .., seed=k)`` equals ``simulate(scenario, .., seed=k)``, bit for bit.
        """
        start = as_seed(seed)
        if not self.randomization:
            return self
        return FlockScenario.__new__(FlockScenario)._set(_core.drawn_flock_scenario(self.to_json(), start))

    def with_learned_predators(self) -> "FlockScenario":
        """Return a copy in which every predator is ``Learned``, with the same initial position and velocity.

        The scenario has at least one predator, and none with a prescribed path.
        """
        if not self.predators:
            raise InputError("predators", "at least one predator", "none")
        learned = list(self.predators)
        for index, predator in enumerate(self.predators):
            if not isinstance(predator, Start):
                expected = "a predator without a prescribed path, which no policy can control"
                raise InputError(f"predators[{index}]", expected, type(predator).__name__)
            if not isinstance(predator, Learned):
                learned[index] = Learned(position=predator.position, velocity=predator.velocity)
        return self.replace(predators=tuple(learned))
