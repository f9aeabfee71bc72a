"""Compact tables of the details page: transfer, hidden entries, versions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flockesc_env.common.stats import Estimate
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from studies.learned.summary import UNKNOWN, Summary, elsewhere, hidden

CLOCK = ("time", "escape direction")
"""Hidden groups of entries that know when the predator is nearest in the paper's scenario."""

_TIED = "\u2020"


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes:
        title: what it shows.
        columns: titles of the columns after the first.
        rows: title and cells of every row.
    """

    title: str
    columns: list[str]
    rows: list[tuple[str, list[str]]]


def transfer_tables(summaries: Sequence[Summary]) -> list[Table]:
    """Return a table per objective: scenarios against the policies that run in them.

    A policy is marked if it depends on entries of ``CLOCK``.
    """
    tables = []
    for spec in FLOCK_OBJECTIVES.values():
        found = {
            f"{row.study.setting} `{row.study.explained}`{_TIED if is_tied(row) else ''}": elsewhere(
                row.study
            )
            for row in summaries
            if row.study.transfer is not None and row.study.spec == spec
        }
        worlds = {world: count for gains in found.values() for world, (count, _) in gains.items()}
        rows = [
            (f"{world} ({count} flocks)", [_gain(gains.get(world)) for gains in found.values()])
            for world, count in worlds.items()
        ]
        if rows:
            tables.append(Table(spec.symbol, list(found), rows))
    return tables


def is_tied(summary: Summary) -> bool:
    """Return whether hiding entries that know the paper's clock changes what the policy reaches."""
    return any(name in CLOCK and change != Estimate(0, 0, 0) for name, change in hidden(summary.study))


def _gain(found: tuple[int, Estimate] | None) -> str:
    """Return a gain with half the width of its interval; without it for very few flocks."""
    if found is None:
        return UNKNOWN
    count, gain = found
    half = f" \u00b1 {(gain.high - gain.low) / 2:.1f}" if count > 10 else ""
    return f"{round(gain.mean, 1) + 0.0:+.1f}{half}"


def ablation_table(summaries: Sequence[Summary]) -> Table | None:
    """Return the changes of the objective: groups of entries against policies that do not see them."""
    found = {
        f"{row.study.setting} `{row.study.explained}`": dict(hidden(row.study))
        for row in summaries
        if row.study.ablation is not None
    }
    groups = list(dict.fromkeys(name for changes in found.values() for name in changes))
    if not groups:
        return None
    rows = [
        (policy, [_change(changes[name]) if name in changes else UNKNOWN for name in groups])
        for policy, changes in found.items()
    ]
    return Table("policy", groups, rows)


def _change(change: Estimate) -> str:
    return "" if change == Estimate(0, 0, 0) else f"{round(change.mean, 1) + 0.0:+.1f}"


def versions(summaries: Sequence[Summary]) -> dict[str, list[str]]:
    """Return the settings by machine and versions, most common first."""
    found: dict[str, list[str]] = {}
    for row in summaries:
        packages = ", ".join(f"{name} {version}" for name, version in row.study.versions.items())
        found.setdefault(f"{row.study.machine}; {packages}", []).append(row.study.setting)
    return dict(sorted(found.items(), key=lambda item: -len(item[1])))
