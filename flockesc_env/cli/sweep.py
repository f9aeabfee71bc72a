"""``flockesc sweep``."""

from __future__ import annotations

import dataclasses
import json as json_
import os
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from tyro.conf import arg

from flockesc_env import records
from flockesc_env._atomic import writing
from flockesc_env._checks import FloatArray, as_count, as_floats, as_seed, as_threads
from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Json, Progress, Scenario, ScenarioFlags, Threads, optional
from flockesc_env.cli.output import check_output, note, require, show, show_json, table
from flockesc_env.errors import ArgumentError
from flockesc_env.options import GRID_SIZE, EnvOptions, LineOptions
from flockesc_env.progress import bar
from flockesc_env.scenario import FlockScenario
from flockesc_env.sweep import FlockSweepResult, LineSweepResult, SweepResult, sweep

_CHUNK_SECONDS = 0.5
"""Chunks of seeds grow until they take this long: about so much work is lost on Ctrl-C."""


def run(
    scenario: ScenarioFlags,
    *,
    interaction_ranges: Annotated[
        tuple[float, ...] | None,
        *optional(
            "ranges to try in place of a grid, in m (the line has no unit)",
            "the grid of the next two",
            metavar="FLOAT ..",
        ),
    ] = None,
    max_range: Annotated[
        float | None,
        *optional(
            "largest range of a grid that begins with 0, in m (the line has no unit)",
            f"{EnvOptions.max_range:g}, on the line {LineOptions.max_range:g}",
        ),
    ] = None,
    grid_size: Annotated[
        int | None, *optional("number of ranges in the grid, both ends included", str(GRID_SIZE))
    ] = None,
    seeds: Annotated[
        range, arg(help="seeds of the initial states, STOP left out; every range sees the same ones")
    ] = range(40),
    objective: Annotated[
        Literal["mean", "minimum", "escape_distance"] | None,
        *optional(
            "what is to be large: the minimum over time of the mean or the minimum predator distance, in m;"
            " on the line the escape distance",
            "mean, on the line escape_distance",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        *optional("file (.parquet or .csv) for one row per run; needs the analysis extra", "none"),
    ] = None,
    num_threads: Threads = None,
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Search for the best fixed interaction range, as the paper does.

    Prints the mean objective of every range with its 95 % bootstrap interval.

    All ranges are run on the same initial states. Ctrl-C keeps finished seeds.

    Example: flockesc sweep --max-range 50 --seeds 0:100 --output sweep.parquet
    """
    check_output(output, [".parquet", ".csv"])
    if output is not None:
        require("polars", "analysis", "output")
    chosen = scenario.build()
    ranges = _ranges(chosen, interaction_ranges, max_range, grid_size)
    objective_ = _objective(chosen, objective)
    _check_seeds(seeds)
    parts = _in_chunks(chosen, ranges, seeds, as_threads(num_threads), progress)
    finished = sum(part.seeds.size for part in parts)
    is_whole = finished == len(seeds)
    if not is_whole:
        note(f"interrupted after {finished} of {len(seeds)} seeds; no intervals, which would take time")
    if parts:
        result = _joined(parts)
        if output is not None:
            _write(result, output)
            note(f"saved: {output}")
        summary = _summary(result, objective_, with_intervals=is_whole)
        if json:
            _show_json(result, objective_, summary, seeds, output, is_whole)
        else:
            _show_table(result, objective_, summary)
    return Exit.DONE if is_whole else Exit.INTERRUPTED


def _check_seeds(seeds: range) -> None:
    if not 0 < seeds.stop - seeds.start < 2**63:
        raise ArgumentError("seeds", "START:STOP with START below STOP", f"{seeds.start}:{seeds.stop}")
    as_seed(seeds.start, "seeds")
    as_seed(seeds.stop - 1, "seeds")


def _ranges(
    scenario: Scenario, given: tuple[float, ...] | None, max_range: float | None, grid_size: int | None
) -> FloatArray:
    if given is not None:
        if max_range is not None or grid_size is not None:
            raise ArgumentError("interaction_ranges", "either these or a grid", "these and a grid")
        if not given:
            raise ArgumentError("interaction_ranges", "at least one range", "none")
        return as_floats(given, "interaction_ranges")
    if max_range is None:
        max_range = (EnvOptions if isinstance(scenario, FlockScenario) else LineOptions).max_range
    largest = float(as_floats(max_range, "max_range", ()))
    if largest < 0:
        raise ArgumentError("max_range", "a number of at least 0", largest)
    return np.linspace(0.0, largest, as_count(GRID_SIZE if grid_size is None else grid_size, "grid_size"))


def _objective(scenario: Scenario, name: str | None) -> str:
    known = (FlockSweepResult if isinstance(scenario, FlockScenario) else LineSweepResult).objectives
    if name is not None and name not in known:
        raise ArgumentError("objective", f"one of {', '.join(known)}", repr(name))
    return name or next(iter(known))


def _in_chunks(
    scenario: Scenario, ranges: FloatArray, seeds: range, threads: int | None, always: bool
) -> list[SweepResult]:
    """Return the sweeps of consecutive seeds; on Ctrl-C those that are finished."""
    parts: list[SweepResult] = []
    start = 0
    size = -(-4 * (threads or os.cpu_count() or 1) // ranges.size)  # some runs for every thread
    try:
        with bar("Sweep", ranges.size * len(seeds), always=always) as report:
            while start < len(seeds):
                began = time.perf_counter()
                before = start * ranges.size
                parts.append(
                    sweep(
                        scenario,
                        ranges,
                        seeds[start : start + size],
                        num_threads=threads,
                        progress=lambda done, total, before=before: report(before + done, total),
                    )
                )
                start += size
                if time.perf_counter() - began < _CHUNK_SECONDS:
                    size *= 2
    except KeyboardInterrupt:
        pass
    return parts


def _joined(parts: list[SweepResult]) -> SweepResult:
    """Return the result of all seeds, as one sweep over them would have given it."""
    of_seeds = [
        f.name for f in dataclasses.fields(parts[0]) if f.name not in {"scenario", "interaction_ranges"}
    ]
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in of_seeds
    }
    return dataclasses.replace(parts[0], **columns)


def _write(result: SweepResult, path: Path) -> None:
    if path.suffix == ".parquet":
        result.to_parquet(path)
    else:
        with writing(path) as file:
            result.table().write_csv(file)


def _summary(result: SweepResult, objective: str, *, with_intervals: bool) -> list[dict[str, Any]]:
    """Return per range: the mean objective, its interval where there can be one, and the mean components."""
    mean = result.values(objective).mean(axis=1)
    low = high = np.full_like(mean, np.nan)
    if with_intervals and len(result.seeds) > 1 and np.isfinite(mean).all():
        if find_spec("scipy") is None:
            note("no intervals: they need the analysis extra (pip install 'flockesc-env[analysis]')")
        else:
            _, low, high = result.mean_with_interval(objective)
    columns = {
        "interaction_range": result.interaction_ranges,
        "mean": mean,
        "low": low,
        "high": high,
        "num_components": result.num_components.mean(axis=1),
    }
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _best(result: SweepResult, objective: str) -> float | None:
    """Return the best range; none without a predator."""
    return result.best_range(objective) if np.isfinite(result.values(objective)).all() else None


def _show_json(
    result: SweepResult,
    objective: str,
    summary: list[dict[str, Any]],
    seeds: range,
    output: Path | None,
    is_whole: bool,
) -> None:
    show_json(
        {
            "command": "sweep",
            "scenario": json_.loads(result.scenario.to_json()),
            "seeds": {"start": seeds.start, "stop": seeds.start + len(result.seeds)},
            "interrupted": not is_whole,
            "objective": objective,
            "ranges": summary,
            "best_range": _best(result, objective),
            "hindsight_oracle": float(result.hindsight_oracle(objective).mean()),
            "output": None if output is None else str(output),
            "versions": records.versions(),
        }
    )


def _show_table(result: SweepResult, objective: str, summary: list[dict[str, Any]]) -> None:
    unit = " m" if isinstance(result, FlockSweepResult) else ""
    in_unit = unit and " (m)"
    rows = [
        [
            f"{row['interaction_range']:.4g}",
            f"{row['mean']:.4f}",
            f"[{row['low']:.4f}, {row['high']:.4f}]" if np.isfinite(row["low"]) else "-",
            f"{row['num_components']:.2f}",
        ]
        for row in summary
    ]
    show(table([f"range{in_unit}", f"{objective}{in_unit}", "95 % interval", "components"], rows))
    best = _best(result, objective)
    if best is not None:
        oracle = result.hindsight_oracle(objective).mean()
        show(f"best fixed range: {best:.4g}{unit}; the best range of every single seed: {oracle:.4f}{unit}")
