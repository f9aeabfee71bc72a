"""The line scenario: the parameters of the line model and their defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flockesc_env import _core
from flockesc_env.scenario.document import Document

EscapeForce = Literal["constant", "linear", "linear_as_printed"]


@dataclass(frozen=True)
class LineScenario(Document):
    """The line model (docs/model.md, "Line"); the defaults are the paper's setting.

    Attributes:
        num_agents: number of agents n.
        predator_position: position of the predator, x_p; ``None``: no predator.
        predator_range: distance rho_p below which agents flee.
        repulsion_strength: strength s of the escape force.
        escape_force: ``"constant"`` (Eq. 8), ``"linear"`` (Eq. 9 as it must have been simulated) or
            ``"linear_as_printed"``.
        tolerance: the line is steady when no agent moves by more than this in one step.
        max_steps: number of steps after which an unsteady run stops.

    Raises:
        ScenarioError: naming a field of a wrong type or out of bounds.
    """

    num_agents: int = 100
    predator_position: float | None = 0.6
    predator_range: float = 0.2
    repulsion_strength: float = 2.0
    escape_force: EscapeForce = "linear"
    tolerance: float = 1e-12
    max_steps: int = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        _core.check_line_scenario(self.to_json())
