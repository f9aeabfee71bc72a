"""Summary of one setting: statistics of its policies as text for the page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import polars as pl

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate
from studies.learned.aggregate import Aggregate, aggregate, means
from studies.learned.questions import QUESTIONS, question_of
from studies.learned.results import BEST_FIXED, Study

NOTHING = "nothing"
LEARNED, BEST_THERE = "learned", "best fixed range there"
UNKNOWN = "-"

LENDERS = {"shared-profile": "shared", "shared-profile-minimum": "shared-minimum"}
"""Settings with the references of another one: the same flocks, and ranges up to that one's largest."""


@dataclass(frozen=True)
class Reference:
    """Statistics of a reference.

    Attributes:
        num_flocks: number of held-out flocks.
        objective: mean objective on these flocks.
        difference: paired difference to the best fixed range on the same flocks.
    """

    num_flocks: int
    objective: Estimate
    difference: Estimate


@dataclass(frozen=True, eq=False)
class Summary:
    """A study and its statistics.

    Attributes:
        study: the files.
        policies: statistics by policy; differences are to the best fixed range.
        references: statistics by reference.
    """

    study: Study
    policies: dict[str, Aggregate]
    references: dict[str, Reference]

    @property
    def best(self) -> Aggregate:
        """Statistics of the learner that was best on tuning flocks."""
        return self.policies[self.study.best_learner]

    @property
    def question(self) -> str:
        """The question that the setting answers."""
        return question_of(self.study.setting, self.study.title)

    def seeds(self, policy: str) -> str:
        """Return the number of training seeds."""
        return str(len(self.study.values(policy))) if policy in self.study.learners else UNKNOWN

    def median(self, learner: str, column: str, digits: str) -> str:
        """Return the median over training seeds of a column of the table of runs."""
        values = self.study.runs.filter(learner=learner)[column].drop_nulls().to_numpy()
        return f"{np.median(values):{digits}}" if values.size else UNKNOWN

    def throughput(self, learner: str) -> str:
        """Return the samples per second of training, with the share of the time that environments take."""
        share = self.median(learner, "environment_share", ".0%")
        rate = self.median(learner, "samples_per_second", ",.0f")
        return rate if share == UNKNOWN else f"{rate} ({share})"

    def show(self, estimate: Estimate, sign: str = "") -> str:
        """Return an estimate with its interval as text; with ``sign="+"`` as a difference."""
        return f"{estimate:{sign}.{self.study.spec.digits}f}"

    def difference(self, policy: str) -> str:
        """Return the paired difference to the best fixed range."""
        return UNKNOWN if policy == BEST_FIXED else self.show(self.policies[policy].difference, "+")

    def improvement(self, policy: str) -> str:
        """Return the probability of improvement over the best fixed range."""
        return UNKNOWN if policy == BEST_FIXED else str(self.policies[policy].improvement)

    def spread(self, policy: str) -> str:
        """Return the smallest and the largest mean difference of a training seed."""
        if policy not in self.study.learners:
            return UNKNOWN
        digits = f"+.{self.study.spec.digits}f"
        row = self.policies[policy]
        return f"{row.lowest:{digits}} to {row.highest:{digits}}"

    def ceilings(self) -> str:
        """Return the gains of the references over the best fixed range."""
        gains = [f"{name} {found.difference.mean:+.1f}" for name, found in self.references.items()]
        return ", ".join(gains) or UNKNOWN


def summarize(studies: Iterable[Study]) -> list[Summary]:
    """Compute the statistics of all policies, with the settings in the order of ``QUESTIONS``."""
    order = list(QUESTIONS)
    last = len(order)
    ordered = sorted(studies, key=lambda s: order.index(s.setting) if s.setting in QUESTIONS else last)
    by_name = {study.setting: study for study in ordered}
    return [_summary(study, by_name.get(LENDERS.get(study.setting, ""), study)) for study in ordered]


def _summary(study: Study, lender: Study) -> Summary:
    baseline = study.values(BEST_FIXED)[0]
    policies = {name: aggregate(study.values(name), baseline) for name in study.policies}
    references = {}
    for name in lender.reference_names:
        values, fixed = lender.reference(name)
        objective, difference = means(np.stack([values, values - fixed])[:, np.newaxis])
        references[name] = Reference(len(values), objective, difference)
    return Summary(study, policies, references)


def hidden(study: Study) -> list[tuple[str, Estimate]]:
    """Return the change of the objective for each hidden part of the observation, largest loss first."""
    if study.ablation is None:
        return []
    values = _by_name(study.ablation, "removed")
    rows = [(name, stats.mean(row - values[NOTHING])) for name, row in values.items() if name != NOTHING]
    return sorted(rows, key=lambda row: row[1].mean)


def _by_name(table: pl.DataFrame, column: str) -> dict[str, stats.FloatArray]:
    """Return the objective, flocks in rising order, by the names in a column."""
    groups = table.group_by(column, maintain_order=True)
    return {str(name): rows.sort("seed")["objective"].to_numpy() for (name,), rows in groups}
