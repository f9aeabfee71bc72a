"""Where learning loses: headline policies in other worlds and starts, and training where they lose."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import polars as pl
from training.presets import presets

from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import atomic_write
from flockesc_env.jobs import Backend, Cache
from studies.findings.cells import LOSSES_FILE, Cell, Kind, cell, cells_of, lost, write_cells
from studies.findings.results import load_studies
from studies.findings.retrained import RETRAINED, chosen_pairs, file_name, train_there
from studies.findings.starts import STARTED, starts
from studies.findings.transfer import (
    FixedRanges,
    Headline,
    fixed_ranges,
    headline,
    refusals,
    transfer,
    worlds,
)
from studies.measurements import Runner

STARTS_FILE, EPISODES_FILE = "starts.parquet", "episodes.parquet"

FLOCKS = 50
"""Held-out flocks of a world; a start has twice as many."""


def measure_losses(results: Path, runs: Path, minutes: float, backend: Backend) -> Path:
    """Play the headline policies in all worlds and starts, and train policies where they lose.

    It writes ``transfer.parquet`` of every setting of a flock, ``starts.parquet``, the folder ``retrained``
    and ``losses.parquet``, whose path it returns. Training may take an estimated number of minutes; 0: no
    training. Interrupted, it continues from the parts in ``runs``.
    """
    known, runner = presets(), Runner(Cache(runs / "fixed"), backend)
    studies = {
        study.setting: study
        for study in load_studies(results)
        if study.setting in known and not study.is_line
    }
    policies = [headline(study) for study in studies.values()]

    beginnings = starts()
    fixed = fixed_ranges(beginnings, 2 * FLOCKS, runner)
    started = [policy for policy in policies if policy.setting in STARTED]
    tables = transfer(started, beginnings, fixed, runner)
    write_table(_joined(tables), results / STARTS_FILE)
    cells = _cells("start", tables)
    cells += [found for start in beginnings for found in _extremes(start, fixed[start])]

    scenarios = worlds()
    fixed |= fixed_ranges(scenarios, FLOCKS, runner)
    tables = transfer(policies, scenarios, fixed, runner)
    for setting, table in tables.items():
        write_table(table, studies[setting].folder / "transfer.parquet")
    cells += _cells("world", tables)
    for policy in policies:
        refused = refusals(policy, scenarios).items()
        cells += [Cell("world", policy.setting, world, 0, None, None, why) for world, why in refused]

    scenarios |= beginnings
    losses = [(found.setting, found.world) for found in lost(cells) if found.setting]
    pairs = chosen_pairs(losses, studies, scenarios, minutes)
    folder, episodes = results / RETRAINED, []
    folder.mkdir(exist_ok=True)
    for (setting, world), file in train_there(pairs, studies, scenarios, runs / RETRAINED, backend).items():
        with atomic_write(folder / f"{file_name(setting, world)}.npz") as copy:
            copy.write(file)
        policy = Headline(setting, file, studies[setting].spec.column)
        tables = transfer([policy], {world: scenarios[world]}, fixed, runner)
        cells += _cells("trained there", tables)
        episodes.append(_joined(tables))
    if episodes:
        write_table(pl.concat(episodes), folder / EPISODES_FILE)
    write_cells(cells, results / LOSSES_FILE)
    return results / LOSSES_FILE


def _cells(kind: Kind, tables: Mapping[str, pl.DataFrame]) -> list[Cell]:
    return [found for setting, table in tables.items() for found in cells_of(kind, setting, table)]


def _extremes(start: str, fixed: FixedRanges) -> list[Cell]:
    """Return the gains in J_mean of the best fixed range over the longest one and over 0."""
    values, best = fixed.held_out["min_mean_distance"], fixed.best("min_mean_distance")
    others: list[tuple[Kind, int]] = [("over the longest", -1), ("over none", 0)]
    return [cell(kind, "", start, fixed.ranges[best], values[best] - values[other]) for kind, other in others]


def _joined(tables: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    """Return the tables of several settings as one, with a column of the setting."""
    return pl.concat(
        table.select(pl.lit(setting).alias("setting"), pl.all()) for setting, table in tables.items()
    )
