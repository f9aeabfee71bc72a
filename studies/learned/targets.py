"""What every setting asks, what was hoped for, and the rule that says what came of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flockesc_env.common.stats import Estimate
from studies.learned.aggregate import Aggregate


class Verdict(Enum):
    """What an interval says of a target."""

    REACHED = "reached"
    OPEN = "not decided"
    MISSED = "missed"


@dataclass(frozen=True)
class Target:
    """A number that a learner is to exceed.

    Attributes:
        value: the number, in the objective's unit.
        name: what it is.
        is_gain: whether it is about the paired difference to the best fixed range, or the objective itself.
        learner: whom it is about; ``None``: the best learner.
    """

    value: float
    name: str
    is_gain: bool = False
    learner: str | None = None

    def verdict(self, measured: Aggregate) -> Verdict:
        """Judge by the interval: all of it above the number, all of it below, or neither."""
        estimate = self.estimate(measured)
        if estimate.low > self.value:
            return Verdict.REACHED
        return Verdict.MISSED if estimate.high < self.value else Verdict.OPEN

    def estimate(self, measured: Aggregate) -> Estimate:
        """Return the figure that the target is about."""
        return measured.difference if self.is_gain else measured.objective


@dataclass(frozen=True)
class Aim:
    """One setting.

    Attributes:
        question: what it asks.
        targets: what was hoped for.
    """

    question: str
    targets: tuple[Target, ...]


RULE = (
    "a target is reached if the whole 95 % interval is above it, missed if the whole interval is below it,"
    " and not decided otherwise"
)

BETTER = Target(0.0, "better than the best fixed range", is_gain=True)

AIMS = {
    "shared": Aim(
        "Does one range for all agents that changes over time beat the best constant one?",
        (BETTER, Target(6.0, "target", is_gain=True), Target(10.0, "stretch target", is_gain=True)),
    ),
    "per-agent-visible": Aim(
        "Does one range per agent pay where everybody sees the predator?",
        (
            BETTER,
            Target(88.1, "the rule stubborn-leaders"),
            Target(96.0, "an earlier search by CMA-ES"),
            Target(97.0, "target"),
            Target(99.0, "stretch target"),
            Target(95.0, "target of ppo", learner="ppo"),
        ),
    ),
    "per-agent-local": Aim(
        "Does one range per agent pay where only those near the predator see it?",
        (BETTER, Target(5.0, "target", is_gain=True), Target(10.0, "stretch target", is_gain=True)),
    ),
    "shared-minimum": Aim("Does one range for all agents save the nearest agent too?", (BETTER,)),
    "per-agent-visible-minimum": Aim(
        "Does one range per agent save the nearest agent, where everybody sees the predator?",
        (
            BETTER,
            Target(21.8, "the hindsight oracle over fixed ranges"),
            Target(23.4, "an earlier result"),
            Target(26.0, "target"),
        ),
    ),
    "per-agent-local-minimum": Aim(
        "Does one range per agent save the nearest agent, where only those near the predator see it?",
        (BETTER,),
    ),
    "line": Aim(
        "Does a range that changes over time move the line away farther than a constant one?", (BETTER,)
    ),
    "steering-predator": Aim("Does learning pay against a predator that steers?", (BETTER,)),
}


def aim_of(setting: str, title: str) -> Aim:
    """Return what a setting is about; of one that is not listed only whether learning pays."""
    return AIMS.get(setting, Aim(f"Does learning pay: {title}?", (BETTER,)))
