"""Reset of policies that keep a memory between actions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def reset_policy(policy: Any, rows: NDArray[np.bool]) -> None:
    """Call ``policy.reset(rows)`` if the policy has this method."""
    reset = getattr(policy, "reset", None)
    if reset is not None:
        reset(rows)
