"""Summary of one setting: statistics of its policies as text for the page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate
from flockesc_env.tasks.statistics import Aggregate, aggregate, means
from studies.findings.kinds import LEARNED as LEARNED_KINDS
from studies.findings.kinds import TRAINED, Kind, best_by_kind, kind_of, searched_rule, tuning_objectives
from studies.findings.questions import QUESTIONS, question_of
from studies.findings.results import BEST_FIXED, Study
from studies.tables import values_by

NOTHING = "nothing"
LEARNED, BEST_THERE = "learned", "best fixed range there"
UNKNOWN = "-"

LENDERS = {"shared-profile": "shared", "shared-profile-minimum": "shared-minimum"}
"""Settings with the references of another one: the same flocks, and ranges up to that one's largest."""


@dataclass(frozen=True)
class Reference:
    """Statistics of a reference: on its flocks, and paired with the best fixed range there."""

    num_flocks: int
    objective: Estimate
    difference: Estimate


@dataclass(frozen=True, eq=False)
class Summary:
    """A study and its statistics; those of policies are paired with the best fixed range.

    ``best`` names the policy of each kind that is best on tuning flocks. ``over_rule`` holds the paired
    differences of ``best`` to the best untrained rule; it is empty without a rule.
    """

    study: Study
    policies: dict[str, Aggregate]
    references: dict[str, Reference]
    best: dict[Kind, str]
    over_rule: dict[Kind, Estimate]

    @property
    def chosen(self) -> Kind:
        """The kind whose best policy has the largest objective on tuning flocks."""
        tuned = tuning_objectives(self.study)
        return max(self.best, key=lambda kind: tuned[self.best[kind]])

    @property
    def learned(self) -> Kind | None:
        """The same among networks and reinforcement learning; ``None`` without either."""
        tuned = tuning_objectives(self.study)
        found = [kind for kind in LEARNED_KINDS if kind in self.best]
        return max(found, key=lambda kind: tuned[self.best[kind]], default=None)

    @property
    def question(self) -> str:
        """The question that the setting answers."""
        return question_of(self.study.setting, self.study.title)

    def kind(self, policy: str) -> str:
        """Return the kind of a policy as text."""
        return kind_of(self.study, policy) or UNKNOWN

    def origin(self, policy: str) -> str:
        """Return a policy's name with its training seeds and the rule at which its search began, if any."""
        if policy not in self.study.learners:
            return f"`{policy}`"
        began = searched_rule(self.study, policy)
        return f"`{policy}`{f' from `{began}`' if began else ''}, {self.seeds(policy)} seeds"

    def iqm(self, policy: str) -> str:
        """Return the interquartile mean over training seeds."""
        if policy not in self.study.learners:
            return UNKNOWN
        return f"{self.policies[policy].iqm:.{self.study.spec.digits}f}"

    def short(self, policy: str | None) -> str:
        """Return the mean objective of a policy, without unit and interval."""
        if policy is None:
            return UNKNOWN
        return f"{self.policies[policy].objective.mean:.{self.study.spec.digits}f}"

    def over_best_rule(self, kind: Kind) -> str:
        """Return the paired difference of the best policy of a kind to the best untrained rule."""
        return self.show(self.over_rule[kind], "+") if kind in self.over_rule else UNKNOWN

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


def losses_first(summaries: Iterable[Summary]) -> list[Summary]:
    """Return the settings by the difference of what was trained to the best untrained rule, smallest first.

    It is that of the learned policy, or without one of the searched rule. Settings without a rule come last.
    """

    def gain(summary: Summary) -> float:
        found = summary.over_rule.get(summary.learned or Kind.SEARCHED)
        return np.inf if found is None else found.mean

    return sorted(summaries, key=gain)


def outcomes(summaries: Iterable[Summary]) -> dict[str, list[str]]:
    """Return the settings with a learned policy and an untrained rule, by which of them is better."""
    found: dict[str, list[str]] = {
        "worse than": [],
        "as good as (the interval includes 0)": [],
        "better than": [],
    }
    worse, equal, better = found.values()
    for summary in summaries:
        gain = summary.over_rule.get(summary.learned) if summary.learned else None
        if gain is not None:
            (worse if gain.high < 0 else better if gain.low > 0 else equal).append(summary.study.setting)
    return found


def _summary(study: Study, lender: Study) -> Summary:
    baseline = study.values(BEST_FIXED)[0]
    policies = {name: aggregate(study.values(name), baseline) for name in study.policies}
    references = {}
    for name in lender.reference_names:
        values, fixed = lender.reference(name)
        objective, difference = means(np.stack([values, values - fixed])[:, np.newaxis])
        references[name] = Reference(len(values), objective, difference)
    best = best_by_kind(study)
    over_rule = {}
    if Kind.RULE in best:
        rule = study.values(best[Kind.RULE])[0]
        for kind in TRAINED:
            if kind in best:
                (over_rule[kind],) = means((study.values(best[kind]) - rule)[np.newaxis])
    return Summary(study, policies, references, best, over_rule)


def hidden(study: Study) -> list[tuple[str, Estimate]]:
    """Return the change of the objective for each hidden part of the observation, largest loss first."""
    if study.ablation is None:
        return []
    values = values_by(study.ablation, "removed")
    rows = [(name, stats.mean(row - values[NOTHING])) for name, row in values.items() if name != NOTHING]
    return sorted(rows, key=lambda row: row[1].mean)
