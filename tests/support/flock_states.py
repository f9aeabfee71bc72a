"""The current state of a flock from the public views of environments."""

from __future__ import annotations

from typing import Any

import numpy as np

from flockesc_env.episodes.current_state import FlockView

NAMES = (
    *("step", "positions", "velocities", "distances", "caught", "interaction_range"),
    *("predator_positions", "predator_velocities"),
)


def state(flock: FlockView) -> dict[str, Any]:
    """Return every property of a view by name; arrays are read-only and do not change."""
    now = {name: getattr(flock, name) for name in NAMES}
    assert not any(value.flags.writeable for value in now.values() if isinstance(value, np.ndarray))
    return now
