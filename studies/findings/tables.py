"""Compact tables of the details page: transfer, hidden entries, versions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flockesc_env.common.stats import Estimate
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from studies.findings.cells import Cell
from studies.findings.summary import UNKNOWN, Summary, hidden

CLOCK = ("time", "escape direction")
"""Hidden groups of entries that know when the predator is nearest in the paper's scenario."""

REFUSED = {"profile_ranges": "no profile"}
"""Words for the options that a world refuses."""

_TIED = "\u2020"


@dataclass(frozen=True)
class Table:
    """A table of text: what it shows, titles of the columns after the first, title and cells of every row."""

    title: str
    columns: list[str]
    rows: list[tuple[str, list[str]]]


def transfer_tables(cells: Iterable[Cell], summaries: Sequence[Summary]) -> list[Table]:
    """Return a table per objective: worlds against the headline policies that are tried in them.

    A policy is marked if it depends on entries of ``CLOCK``.
    """
    found = {(cell.setting, cell.world): cell for cell in cells if cell.kind == "world"}
    tables = []
    for spec in FLOCK_OBJECTIVES.values():
        tried = {setting for setting, _ in found}
        policies = [row for row in summaries if row.study.setting in tried and row.study.spec == spec]
        settings = [row.study.setting for row in policies]
        flocks = {
            world: max(found[setting, world].flocks for setting in settings if (setting, world) in found)
            for world in dict.fromkeys(world for setting, world in found if setting in settings)
        }
        rows = [
            (f"{world} ({count} flocks)", [gain_cell(found.get((setting, world))) for setting in settings])
            for world, count in flocks.items()
        ]
        columns = [
            f"{row.study.setting} `{row.study.explained}`{_TIED if is_tied(row) else ''}" for row in policies
        ]
        if rows:
            tables.append(Table(spec.symbol, columns, rows))
    return tables


def is_tied(summary: Summary) -> bool:
    """Return whether hiding entries that know the paper's clock changes what the policy reaches."""
    return any(name in CLOCK and change != Estimate(0, 0, 0) for name, change in hidden(summary.study))


def gain_cell(cell: Cell | None) -> str:
    """Return a gain with half the width of its interval, or why the policy cannot run."""
    if cell is None:
        return UNKNOWN
    if cell.gain is None:
        return REFUSED.get(cell.refused or "", f"no {cell.refused}")
    half = (cell.gain.high - cell.gain.low) / 2
    return f"{round(cell.gain.mean, 1) + 0.0:+.1f} \u00b1 {half:.1f}"


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
