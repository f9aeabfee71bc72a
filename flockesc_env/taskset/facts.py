"""``Scale``: what normalizes the scores of a task."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

Reference = Literal["free headings", "clairvoyant", "informed greedy", "hindsight"]


class Scale(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two objectives that normalize the scores of a task in one scenario.

    ``python -m studies scoreboard-freeze`` measures them.

    Attributes:
        best_fixed_range: fixed range with the largest mean objective on tuning flocks, in m for a flock.
        zero: mean objective of the best fixed range on the held-out flocks; the score 0.
        one: ``zero`` plus the reference's mean gain over the best fixed range; the score 1. The gain is
            paired: both play the same held-out flocks, all of them or the first ones.
        one_error: half width of the 95 % interval of ``one``; 0 if the reference plays all flocks.
        reference: what reaches ``one``; results/scoreboard/README.md describes the kinds.
    """

    best_fixed_range: float
    zero: float
    one: float
    one_error: float = 0.0
    reference: Reference

    def score(self, objective: Any) -> Any:
        """Return the normalized score of an objective or an array of them."""
        return (objective - self.zero) / (self.one - self.zero)
