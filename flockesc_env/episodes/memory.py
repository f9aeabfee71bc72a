"""Tells policies with a memory which rows begin an episode."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def reset_policy(policy: Any, rows: NDArray[np.bool]) -> None:
    """Call ``policy.reset(rows)``; a policy without that method remembers nothing.

    Args:
        policy: a policy of ranges or of predators.
        rows: True where an episode begins, one entry per observation row of the next ``act``.
    """
    reset = getattr(policy, "reset", None)
    if reset is not None:
        reset(rows)
