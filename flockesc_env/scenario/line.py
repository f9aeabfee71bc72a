"""``LineScenario``: parameters of the line model and their defaults."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

from flockesc_env import _core
from flockesc_env.scenario.document import Document

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

    Raises:
        InputError: if a field has the wrong type or is out of bounds.
    """

    num_agents: int = 100
    predator_position: float | None = 0.6
    predator_range: float = 0.2
    repulsion_strength: float = 2.0
    escape_force: EscapeForce = "linear"
    tolerance: float = 1e-12
    max_steps: int = 1000

    def __post_init__(self) -> None:
        self._set(_core.check_line_scenario(json.dumps(self._given())))
