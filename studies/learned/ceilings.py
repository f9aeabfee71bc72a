"""Figure of what is reached and what bounds it: learned ranges without and with a profile, and references."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from flockesc_env.common.stats import Estimate
from flockesc_env.render.palette import LIGHT
from studies.forest import Group
from studies.learned.figures import forests
from studies.learned.names import policy_title
from studies.learned.results import ORACLE
from studies.learned.summary import Summary

_LABELS = {
    "mean": "J_mean: gain over the best fixed range (m)",
    "minimum": "J_min: gain over the best fixed range (m)",
}
_SETTINGS = {
    "shared": "one range for the flock",
    "per-agent-local": "one per agent, predator visible within 30 m",
    "per-agent-visible": "one per agent, predator always visible",
}

Row = tuple[str, Estimate]


def ceilings(summaries: Sequence[Summary]) -> Figure | None:
    """Draw gains over the best fixed range, a panel per objective; ``None`` if no setting was run."""
    by_name = {summary.study.setting: summary for summary in summaries}
    panels = {}
    for objective, label in _LABELS.items():
        end = "" if objective == "mean" else "-minimum"
        blind, informed = list[Row](), list[Row]()
        rules, references = list[Row](), list[Row]()
        for name, title in _SETTINGS.items():
            plain, profiled = by_name.get(f"{name}{end}"), by_name.get(f"{name}-profile{end}")
            blind += _best(plain, title)
            blind += _best(by_name.get(f"{name}-derived{end}"), f"{title}, escape direction")
            informed += _best(profiled, title)
            for found, rows in ((plain, blind), (profiled, rules)):
                rows += _best_rule(found, title)
            if plain is not None:
                references += [
                    (f"{reference}: {title}", plain.references[reference].difference)
                    for reference in plain.references
                    if name != "per-agent-local"
                ]
        if f"shared{end}" in by_name:
            oracle = by_name[f"shared{end}"].policies[ORACLE].difference
            references.insert(0, (policy_title(ORACLE), oracle))
        groups = [
            Group("learned or a rule, without a profile", blind, LIGHT.learned),
            Group("a rule, with a profile", rules, LIGHT.others[0]),
            Group("learned, with a profile", informed, LIGHT.others[0]),
            Group("references, which know what no policy knows", references, LIGHT.alone),
        ]
        panels[label] = [group for group in groups if group.rows]
    shown = {label: groups for label, groups in panels.items() if groups}
    return forests(shown) if shown else None


def _best(summary: Summary | None, title: str) -> list[Row]:
    """Return the best learner of a setting."""
    return [] if summary is None else [(f"learned: {title}", summary.best.difference)]


def _best_rule(summary: Summary | None, title: str) -> list[Row]:
    """Return the built-in rule of a setting with the largest mean, if it has one."""
    if summary is None:
        return []
    rules = [
        name
        for name in summary.policies
        if name not in summary.study.learners and policy_title(name).startswith("rule")
    ]
    best = max(rules, key=lambda name: summary.policies[name].objective.mean, default="")
    return [(f"{policy_title(best)}: {title}", summary.policies[best].difference)] if best else []
