"""Cells of the transfer tables: the gain of one policy in one world, and whether it wins or loses there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, FloatArray, mean
from studies.findings.summary import BEST_THERE, LEARNED
from studies.tables import values_by

LOSSES_FILE: Final = "losses.parquet"

Kind = Literal["world", "start", "over the longest", "over none", "trained there"]

_COLUMNS = {
    **dict.fromkeys(("kind", "setting", "world"), pl.String),
    "flocks": pl.Int64,
    **dict.fromkeys(("best_fixed_range", "gain", "low", "high"), pl.Float64),
    "refused": pl.String,
}


@dataclass(frozen=True)
class Cell:
    """The gain in m of one policy in one world, paired flock by flock.

    The gain of a policy is over the best fixed range of the world, maybe a number of neighbors.
    Kinds: ``"world"`` and ``"start"``: a headline policy in another world, or in another start of the paper's
    flock; ``"over the longest"`` and ``"over none"``: the best fixed range of a start, without a setting,
    against the longest one and against 0; ``"trained there"``: a policy that was trained in the world. A
    policy that cannot run has neither range nor gain, but the option that the world refuses.
    """

    kind: Kind
    setting: str
    world: str
    flocks: int
    best_fixed_range: float | None
    gain: Estimate | None
    refused: str | None = None

    @property
    def outcome(self) -> Literal["win", "tie", "loss", "refused"]:
        """The outcome; a tie if the interval of the gain contains 0."""
        if self.gain is None:
            return "refused"
        if self.gain.low > 0:
            return "win"
        return "loss" if self.gain.high < 0 else "tie"


def lost(cells: Iterable[Cell]) -> list[Cell]:
    """Return the cells whose interval lies below 0, the largest loss first."""
    found = [(cell.gain.mean, cell) for cell in cells if cell.gain and cell.outcome == "loss"]
    return [cell for _, cell in sorted(found, key=lambda pair: pair[0])]


def outcomes(cells: Iterable[Cell]) -> dict[str, Counter[str]]:
    """Return the number of cells by outcome, by setting."""
    counts: dict[str, Counter[str]] = {}
    for cell in cells:
        counts.setdefault(cell.setting, Counter())[cell.outcome] += 1
    return counts


def cells_of(kind: Kind, setting: str, table: pl.DataFrame) -> list[Cell]:
    """Return the cells of one setting's table of world, policy, interaction_range, seed and objective."""
    values, ranges = (
        values_by(table, "world", "policy"),
        values_by(table, "world", "policy", column="interaction_range"),
    )
    return [
        cell(
            kind,
            setting,
            world,
            float(ranges[world, BEST_THERE][0]),
            values[world, LEARNED] - values[world, BEST_THERE],
        )
        for world in table["world"].unique(maintain_order=True)
    ]


def cell(kind: Kind, setting: str, world: str, best_fixed_range: float, gains: FloatArray) -> Cell:
    """Return a cell from the gains, shape (flocks,)."""
    return Cell(kind, setting, world, len(gains), best_fixed_range, mean(np.asarray(gains)))


def read_cells(path: Path) -> list[Cell]:
    """Return the cells of a file; none if there is no file."""
    found = []
    for row in pl.read_parquet(path).iter_rows(named=True) if path.is_file() else ():
        ends = [row.pop(name) for name in ("gain", "low", "high")]
        found.append(Cell(**row, gain=None if ends[0] is None else Estimate(*ends)))
    return found


def write_cells(cells: Iterable[Cell], path: Path) -> None:
    """Write cells as a table, one row per cell."""
    records = []
    for cell in cells:
        ends = (cell.gain.mean, cell.gain.low, cell.gain.high) if cell.gain else (None, None, None)
        place = (cell.kind, cell.setting, cell.world, cell.flocks, cell.best_fixed_range)
        records.append((*place, *ends, cell.refused))
    write_table(pl.DataFrame(records, _COLUMNS, orient="row"), path)
