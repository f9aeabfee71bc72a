"""Tables of the section "Where learning loses": other starts, losses, and training where policies lose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flockesc_env import FlockScenario
from studies.findings.cells import Cell, lost, outcomes
from studies.findings.starts import STARTED
from studies.findings.summary import Summary
from studies.findings.tables import Table, gain_cell
from studies.findings.transfer import worlds
from studies.robustness.plan import grid_of

SHOWN = 10
"""Losses in the table of the largest."""


@dataclass(frozen=True)
class LossTables:
    """What the pages say about losses: tables, and the numbers in their sentences.

    ``num_interior`` starts have a best fixed range that is better than 0 and the longest range. Of ``cells``
    pairs of policy and world or start, ``out_of_reach`` are losses to a fixed range longer than the policy's
    largest. ``num_gone`` of the retrained policies no longer lose, and ``untried`` are the other losses.
    ``random_polarization`` is expected of random headings.
    """

    starts: Table
    num_interior: int
    num_starts: int
    cells: int
    every: Table
    largest: Table
    out_of_reach: int
    counts: Table
    retrained: Table
    num_retrained: int
    num_gone: int
    untried: list[str]
    random_polarization: float


def loss_tables(cells: Sequence[Cell], summaries: Sequence[Summary]) -> LossTables | None:
    """Return the tables of losses, or ``None`` without cells."""
    if not cells:
        return None

    def title(cell: Cell) -> str:
        return f"{cell.setting} in {cell.world}"

    policies = [cell for cell in cells if cell.kind in {"world", "start"}]
    losses = lost(policies)
    longest = {row.study.setting: _max_range(row) for row in summaries}
    every = [
        (title(cell), [gain_cell(cell), _best_range(cell), f"{longest[cell.setting]:g} m"]) for cell in losses
    ]
    columns = ["gain, m", "best fixed range there", "largest range of the policy"]
    trained = {(cell.setting, cell.world): cell for cell in cells if cell.kind == "trained there"}
    before = [cell for cell in losses if (cell.setting, cell.world) in trained]
    after = [trained[cell.setting, cell.world] for cell in before]
    interior = _interior(cells)
    return LossTables(
        starts=_starts(cells),
        num_interior=sum(interior.values()),
        num_starts=len(interior),
        cells=sum(cell.gain is not None for cell in policies),
        every=Table("policy", columns, every),
        largest=Table("policy", columns, every[:SHOWN]),
        out_of_reach=sum((cell.best_fixed_range or 0) > longest[cell.setting] for cell in losses),
        counts=_counts(policies),
        retrained=Table(
            "policy",
            ["gain before, m", "gain after training there, m", "loss"],
            [
                (
                    title(old),
                    [gain_cell(old), gain_cell(new), "stays" if new.outcome == "loss" else "disappears"],
                )
                for old, new in zip(before, after, strict=True)
            ],
        ),
        num_retrained=len(after),
        num_gone=sum(cell.outcome != "loss" for cell in after),
        untried=[title(cell) for cell in losses if (cell.setting, cell.world) not in trained],
        random_polarization=math.sqrt(math.pi / (4 * FlockScenario().num_agents)),
    )


def _starts(cells: Sequence[Cell]) -> Table:
    """Return a table of starts: gains of policies, and of the best fixed range over both ends of the grid."""
    found = {(cell.kind, cell.setting, cell.world): cell for cell in cells}
    started = {cell.setting for cell in cells if cell.kind == "start"}
    policies = [name for name in STARTED if name in started]
    rows: list[tuple[str, list[str]]] = []
    for start in dict.fromkeys(cell.world for cell in cells if cell.kind == "start"):
        over = found["over the longest", "", start]
        gains: list[Any] = [found.get(("start", setting, start)) for setting in policies]
        ends = [over, found["over none", "", start]]
        rows.append((start, [*map(gain_cell, gains), _best_range(over), *map(gain_cell, ends)]))
    columns = [*policies, "best fixed range", "its gain over the longest", "its gain over 0 m"]
    return Table("start", columns, rows)


def _interior(cells: Sequence[Cell]) -> dict[str, bool]:
    """Return for every start whether the best fixed range is better than both ends of the grid."""
    wins: dict[str, bool] = {}
    for cell in cells:
        if cell.kind in {"over the longest", "over none"}:
            wins[cell.world] = wins.get(cell.world, True) and cell.outcome == "win"
    return wins


def _counts(policies: Sequence[Cell]) -> Table:
    """Return the number of wins, ties and losses of each policy, the policy with most losses first."""
    counts = outcomes(cell for cell in policies if cell.kind == "world")
    rows = [
        (setting, [str(found[name]) for name in ("loss", "tie", "win", "refused")])
        for setting, found in sorted(counts.items(), key=lambda item: -item[1]["loss"])
    ]
    return Table("policy", ["losses", "ties", "wins", "cannot run"], rows)


def _best_range(cell: Cell) -> str:
    scenario = worlds().get(cell.world)
    unit = "m" if scenario is None else grid_of(scenario).unit
    return f"{cell.best_fixed_range:g} {unit}"


def _max_range(row: Summary) -> float:
    learner = row.study.learners.get(row.study.explained or row.study.best_learner)
    return float(learner.arguments.get("max_range", math.inf)) if learner else math.inf
