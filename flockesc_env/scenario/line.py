"""``LineScenario``: parameters of the line model and their defaults."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from flockesc_env import _core
from flockesc_env.scenario.document import Document, checked
from flockesc_env.scenario.objectives import LINE_OBJECTIVES, ObjectiveSpec
from flockesc_env.scenario.options import LineOptions, LineOptionsDict, check_names

EscapeForce = Literal["constant", "linear", "linear_as_printed"]


@dataclass(frozen=True)
class LineScenario(Document):
    """Parameters of the line model (docs/model.md, "Line"); the defaults are the paper's.

    Attributes:
        num_agents: number of agents n.
        predator_position: position of the predator, x_p; ``None``: no predator.
        predator_range: distance rho_p within which agents flee from the predator.
        repulsion_strength: strength s of the escape force.
        escape_force: ``"constant"``: Eq. 8; ``"linear"``: Eq. 9 in the form that reproduces the paper's
            figures; ``"linear_as_printed"``: Eq. 9 as printed (docs/model.md, "Line").
        tolerance: the line is in its steady state when no agent moves by more than this in one step.
        max_steps: number of steps after which a run stops if it has not reached its steady state.
        model: name of the model.
        objectives: the model's objectives by name; the first one is the default.
        search_ranges: fixed ranges among which the best one is chosen.
        range_unit: unit of interaction ranges.
        length_scale, speed_scale: a length and a speed that are observed as 1/2.
        time_step: duration of a model step.
    """

    model: ClassVar[str] = "line"
    objectives: ClassVar[Mapping[str, ObjectiveSpec]] = LINE_OBJECTIVES
    search_ranges: ClassVar[tuple[float, ...]] = tuple(0.02 * k for k in range(51))
    range_unit: ClassVar[str] = ""
    length_scale: ClassVar[float] = 1.0
    speed_scale: ClassVar[float] = 1.0
    time_step: ClassVar[float] = 1.0

    num_agents: int = 100
    predator_position: float | None = 0.6
    predator_range: float = 0.2
    repulsion_strength: float = 2.0
    escape_force: EscapeForce = "linear"
    tolerance: float = 1e-12
    max_steps: int = 1000

    def __post_init__(self) -> None:
        self._set(checked(_core.check_line_scenario, self._given()))

    def env_options(
        self, given: Mapping[str, Any], known: type = LineOptionsDict, own: Iterable[str] = ()
    ) -> LineOptions:
        """Return the options of an environment with this scenario; see ``FlockScenario.env_options``."""
        check_names(self, given, known, own)
        return LineOptions.among(given)

    @property
    def num_steps(self) -> int:
        """Number of model steps of an episode that does not end early, as of a flock."""
        return self.max_steps
