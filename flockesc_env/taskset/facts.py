"""What is known about a task: ``Scale``, ``Control`` and ``Shortcut``."""

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


class Control(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An experiment that shows what a task is about: a gain with and without warnings.

    Attributes:
        policy: the best known policy: a rule, ``fixed:RHO`` or TASK/LEARNER of a trained policy.
        baseline: the constant that it is compared with, on the same tuning flocks.
        gain: mean paired difference of their objectives; mean, lower and upper end of the 95 % interval.
        gain_blocked: the same with the scenario's ``blocks_warnings``: agents that no predator has reached
            do not hear agents that one has reached.
    """

    policy: str
    baseline: str
    gain: tuple[float, float, float]
    gain_blocked: tuple[float, float, float]


class Shortcut(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The best built-in policy without training, chosen on tuning flocks, and its score.

    It is one of the rules that fit the task, random ranges or the best fixed range.
    """

    policy: str
    score: float
