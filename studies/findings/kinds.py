"""Kinds of policies, and the best policy of each kind on tuning flocks."""

from __future__ import annotations

from enum import StrEnum

import polars as pl

from studies.findings.results import BEST_FIXED, ORACLE, Study


class Kind(StrEnum):
    """How a policy came about. Only networks and reinforcement learning count as learned."""

    RULE = "untrained rule"
    """A built-in rule with the numbers that a person chose."""
    SEARCHED = "searched rule"
    """A built-in rule whose numbers a search moved; the search began at the rule."""
    NETWORK = "network"
    """A network whose weights a search or an imitation found."""
    REINFORCEMENT = "reinforcement learning"
    """A network that PPO or TQC trained."""


LEARNED = (Kind.NETWORK, Kind.REINFORCEMENT)
TRAINED = (Kind.SEARCHED, *LEARNED)


def kind_of(study: Study, policy: str) -> Kind | None:
    """Return the kind of a policy; ``None`` for fixed ranges."""
    if policy in study.learners:
        if study.learners[policy].kind in ("ppo", "tqc"):
            return Kind.REINFORCEMENT
        return Kind.SEARCHED if searched_rule(study, policy) else Kind.NETWORK
    is_rule = policy not in (BEST_FIXED, ORACLE) and policy in tuning_objectives(study)
    return Kind.RULE if is_rule else None


def searched_rule(study: Study, learner: str) -> str:
    """Return the name of the rule at which a search began; "" for a learner that began at none."""
    arguments = study.learners[learner].arguments
    return str(arguments.get("rule") or arguments.get("start") or "")


def tuning_objectives(study: Study) -> dict[str, float]:
    """Return the mean objective on tuning flocks of every learner, over training seeds, and of every rule."""
    seeds: dict[str, list[float]] = {}
    for (learner, _), objective in study.tuned.items():
        seeds.setdefault(learner, []).append(objective)
    learners = {learner: sum(values) / len(values) for learner, values in seeds.items()}
    if study.rules is None:
        return learners
    rules = study.rules.group_by("rule").agg(pl.col("objective").mean()).sort("rule")
    return {**learners, **dict(rules.iter_rows())}


def best_by_kind(study: Study) -> dict[Kind, str]:
    """Return the policy of each kind that is best on tuning flocks. Held-out flocks choose nothing."""
    tuned = tuning_objectives(study)
    chosen: dict[Kind, str] = {}
    for policy in study.policies:
        kind = kind_of(study, policy)
        if kind and (kind not in chosen or tuned[policy] > tuned[chosen[kind]]):
            chosen[kind] = policy
    return {kind: chosen[kind] for kind in Kind if kind in chosen}
