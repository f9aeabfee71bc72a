"""One setting's figures, and how the page words them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import polars as pl

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate
from studies.learned.aggregate import Aggregate, aggregate
from studies.learned.results import BEST_FIXED, Study
from studies.learned.targets import AIMS, Aim, Target, aim_of

NOTHING = "nothing"
LEARNED = "learned"
UNKNOWN = "-"


@dataclass(frozen=True, eq=False)
class Summary:
    """A study and what was computed from it.

    Attributes:
        study: the files.
        contenders: figures by contender; differences are to the best fixed range.
    """

    study: Study
    contenders: dict[str, Aggregate]

    @property
    def best(self) -> Aggregate:
        """Figures of the learner that was best on tuning flocks."""
        return self.contenders[self.study.best_learner]

    @property
    def aim(self) -> Aim:
        """What the setting is about."""
        return aim_of(self.study.setting, self.study.title)

    def seeds(self, contender: str) -> str:
        """Return the number of training seeds."""
        return str(len(self.study.values(contender))) if contender in self.study.learners else UNKNOWN

    def median(self, learner: str, column: str, digits: str) -> str:
        """Return the median over training seeds of a column of the table of runs."""
        values = self.study.runs.filter(learner=learner)[column].drop_nulls().to_numpy()
        return f"{np.median(values):{digits}}" if values.size else UNKNOWN

    def show(self, estimate: Estimate, sign: str = "") -> str:
        """Return a figure of the objective, or with the sign "+" a difference, with its interval."""
        digits = f"{sign}.{3 if self.study.is_line else 2}f"
        return f"{estimate.mean:{digits}} [{estimate.low:{digits}}, {estimate.high:{digits}}]"

    def difference(self, contender: str) -> str:
        """Return the paired difference to the best fixed range."""
        return UNKNOWN if contender == BEST_FIXED else self.show(self.contenders[contender].difference, "+")

    def improvement(self, contender: str) -> str:
        """Return the probability of improvement over the best fixed range."""
        return UNKNOWN if contender == BEST_FIXED else str(self.contenders[contender].improvement)

    def spread(self, contender: str) -> str:
        """Return how far the mean difference lies apart over training seeds."""
        if contender not in self.study.learners:
            return UNKNOWN
        digits = "+.3f" if self.study.is_line else "+.2f"
        row = self.contenders[contender]
        return f"{row.lowest:{digits}} to {row.highest:{digits}}"

    def verdicts(self) -> list[str]:
        """Return a sentence per target, made by ``studies.learned.targets.RULE``."""
        return [self._sentence(target, who) for target, who in self._judged()]

    def verdict(self) -> str:
        """Return the verdicts in short."""
        told = []
        for target, who in self._judged():
            subject = f"`{target.learner}` " if target.learner else ""
            verdict = target.verdict(self.contenders[who]).value
            told.append(
                f"{subject}{'gain ' if target.is_gain else ''}above {self._number(target)}: {verdict}"
            )
        return "; ".join(told)

    def _judged(self) -> list[tuple[Target, str]]:
        """Return the targets with whom they are about, those left out whose learner was not run."""
        pairs = [(target, target.learner or self.study.best_learner) for target in self.aim.targets]
        return [(target, who) for target, who in pairs if who in self.contenders]

    def _sentence(self, target: Target, who: str) -> str:
        row = self.contenders[who]
        what, sign = ("gains", "+") if target.is_gain else ("reaches", "")
        told = self.show(target.estimate(row), sign) + self.study.unit
        goal = f"{target.name}, above {self._number(target)}"
        return f"`{who}` {what} {told}; {goal}: **{target.verdict(row).value}**."

    def _number(self, target: Target) -> str:
        sign = "+" if target.is_gain else ""
        return f"{target.value:{sign}g}{self.study.unit}" if target.value else "0"


def summarize(studies: Iterable[Study]) -> list[Summary]:
    """Compute the figures of all contenders, settings in the order of ``AIMS``."""
    order = list(AIMS)
    last = len(order)
    ordered = sorted(studies, key=lambda s: order.index(s.setting) if s.setting in AIMS else last)
    return [Summary(study, _figures(study)) for study in ordered]


def _figures(study: Study) -> dict[str, Aggregate]:
    baseline = study.values(BEST_FIXED)[0]
    return {name: aggregate(study.values(name), baseline) for name in study.contenders}


def hidden(study: Study) -> list[tuple[str, Estimate]]:
    """Return what the objective loses or gains where a part of the observation is hidden, worst first."""
    if study.ablation is None:
        return []
    values = _by_name(study.ablation, "removed")
    rows = [(name, stats.mean(row - values[NOTHING])) for name, row in values.items() if name != NOTHING]
    return sorted(rows, key=lambda row: row[1].mean)


def elsewhere(study: Study) -> dict[str, list[tuple[str, Estimate]]]:
    """Return the paired differences of the learned policy to each other contender, world by world."""
    found: dict[str, list[tuple[str, Estimate]]] = {}
    if study.transfer is None:
        return found
    for (world,), rows in study.transfer.group_by("world", maintain_order=True):
        values = _by_name(rows, "contender")
        for name, row in values.items():
            if name != LEARNED:
                found.setdefault(name, []).append((str(world), stats.mean(values[LEARNED] - row)))
    return found


def _by_name(table: pl.DataFrame, column: str) -> dict[str, stats.FloatArray]:
    """Return the objective, flocks in rising order, by the names in a column."""
    groups = table.group_by(column, maintain_order=True)
    return {str(name): rows.sort("flock")["objective"].to_numpy() for (name,), rows in groups}
