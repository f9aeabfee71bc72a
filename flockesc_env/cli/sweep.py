"""The command sweep: a search over fixed ranges."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from tyro.conf import arg

from flockesc_env.cli.flags import BACKEND, Json, Progress, ScenarioFlags, Seeds, Threads, described, optional
from flockesc_env.cli.output import Exit, check_output, conclude, note, table
from flockesc_env.common.array_files import PICTURES, TABLES, origin, write_result
from flockesc_env.common.checks import FloatArray, as_choice, as_floats, as_seeds
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import MissingExtraError, require
from flockesc_env.common.files import suffix_of
from flockesc_env.common.progress import progress_bar
from flockesc_env.jobs import Cache, find_backend
from flockesc_env.jobs import run as run_all
from flockesc_env.jobs.sweeps import OUTCOMES, joined, seed_jobs
from flockesc_env.models.scan import ScanResult
from flockesc_env.models.sweep import RESULTS, SweepResult, sweep
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.objectives import OBJECTIVES, ObjectiveSpec
from flockesc_env.scenario.options import EnvOptions, LineOptions
from flockesc_env.scenario.presets import Scenario

GRID_SIZE = 21
"""Number of ranges in the default grid."""

Output = Annotated[
    Path | None,
    *optional(
        "file for a table with one row per run (.parquet, .csv) or for a curve with its interval (.png, .svg,"
        " .pdf); needs the analysis extra",
        "none",
    ),
]


def run(
    scenario: ScenarioFlags,
    *,
    interaction_ranges: Annotated[
        tuple[float, ...] | None,
        *optional("ranges to try instead of a grid, in m for a flock", "a grid", "FLOAT .."),
    ] = None,
    max_range: Annotated[
        float | None,
        *optional(
            f"largest of {GRID_SIZE} ranges, which begin at 0, in m for a flock",
            f"{EnvOptions.max_range:g}, for a line {LineOptions.max_range:g}",
        ),
    ] = None,
    seeds: Annotated[
        Seeds, arg(help="seeds of the initial states, STOP excluded; the same for every range")
    ] = range(40),
    objective: Annotated[
        str | None,
        *optional(
            "quantity to maximize; " + "; ".join(f"{spec.name}: {spec.definition}" for spec in OBJECTIVES),
            f"{next(iter(FlockScenario.objectives))}, for a line {next(iter(LineScenario.objectives))}",
            metavar=f"{{{','.join(spec.name for spec in OBJECTIVES)}}}",
        ),
    ] = None,
    output: Output = None,
    num_threads: Threads = None,
    backend: Annotated[str | None, *optional(BACKEND, "threads of this process", "BACKEND")] = None,
    cache: Annotated[
        Path, arg(help="folder of finished jobs, with --backend; a second call continues there")
    ] = Path("runs/sweep"),
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Search for the best fixed interaction range, as in the paper.

    Prints mean objectives and the best range, with 95 % intervals (t, bootstrap).

    All ranges start from the same states. With --backend, Ctrl-C keeps finished jobs.

    Example: flockesc sweep --max-range 50 --seeds 0:100 --output sweep.parquet
    """
    check_output(output, [*TABLES, *PICTURES])
    is_picture = output is not None and suffix_of(output) in PICTURES
    if output is not None:
        require("analysis", ["matplotlib", "scipy"] if is_picture else ["polars"])
    chosen = scenario.build()
    known = chosen.objectives
    spec = known[as_choice(next(iter(known)) if objective is None else objective, "objective", known)]
    if is_picture and not spec.is_defined_in(chosen):
        expected = f"a .parquet or .csv file for {spec.name} without {spec.requires}"
        raise InputError("output", expected, repr(str(output)))
    ranges = _ranges(chosen, interaction_ranges, max_range)
    if backend is None:
        with progress_bar("Sweep", ranges.size * len(seeds), always=progress) as bar:
            result = sweep(chosen, ranges, seeds, num_threads=num_threads, progress=bar)
    elif num_threads is None:
        numbers = np.array(as_seeds(seeds), np.uint64)
        jobs = seed_jobs(OUTCOMES, chosen, tuple(ranges.tolist()), seeds)
        parts = run_all(jobs, Cache(cache), find_backend(backend), title="Sweep", progress=progress)
        result = RESULTS[chosen.model](chosen, ranges, numbers, **joined(parts))
    else:
        raise InputError("num_threads", "no number with --backend, whose jobs take one thread", num_threads)
    document = {
        **described("sweep", chosen, output),
        "seeds": {"start": seeds.start, "stop": seeds.stop},
        "objective": spec.name,
        **_outcome(result, spec.name),
    }
    lines = _table(document, spec, chosen.range_unit)
    conclude(document if json else lines, output, partial(save, result, spec.name))
    return Exit.DONE


def save(result: SweepResult | ScanResult, quantity: str | None, path: Path) -> None:
    """Write the table of a result or, to a file of a picture, the curve of an objective or a measure."""
    found = result.plot(quantity) if suffix_of(path) in PICTURES else result.table()
    write_result(path, found, origin(result))


def _ranges(scenario: Scenario, given: tuple[float, ...] | None, max_range: float | None) -> FloatArray:
    if given is not None:
        if max_range is not None:
            raise InputError("interaction_ranges", "either ranges or a grid (max_range)", "both")
        return as_floats(given, "interaction_ranges")
    if max_range is None:
        max_range = (EnvOptions if isinstance(scenario, FlockScenario) else LineOptions).max_range
    return np.linspace(0.0, float(as_floats(max_range, "max_range", (), least=0.0)), GRID_SIZE)


def _outcome(result: SweepResult, objective: str) -> dict[str, Any]:
    """Return the rows of the table and the best range, with intervals where they are defined."""
    values, best = result.values(objective), list[float]()
    low, high = np.full((2, len(values)), np.nan)
    is_finite = bool(np.isfinite(values).all())
    if is_finite and len(result.seeds) > 1:
        try:
            _, low, high = result.mean_with_interval(objective)
            _, *best = result.best_range_with_interval(objective)
        except MissingExtraError as error:
            note(f"intervals are omitted: {error}")
    for word, end, last in zip(("shorter", "longer"), best, (min, max), strict=False):
        if end == last(result.interaction_ranges) > 0:
            note(f"{word} ranges may be better: the best range's interval ends with the grid, at {end:.4g}")
    names = ("interaction_range", "mean", "low", "high", "num_components")
    columns = (result.interaction_ranges, values.mean(axis=1), low, high, result.num_components.mean(axis=1))
    return {
        "ranges": [dict(zip(names, row, strict=True)) for row in np.transpose(columns).tolist()],
        "best_range": result.best_range(objective) if is_finite else None,
        "best_range_interval": best or None,
        "hindsight_oracle": float(result.hindsight_oracle(objective).mean()),
    }


def _table(document: dict[str, Any], objective: ObjectiveSpec, range_unit: str) -> list[str]:
    best, digits = document["best_range"], objective.digits
    rows = [
        [
            ("* " if row["interaction_range"] == best else "") + f"{row['interaction_range']:.4g}",
            f"{row['mean']:.{digits}f}",
            "-" if np.isnan(row["low"]) else f"[{row['low']:.{digits}f}, {row['high']:.{digits}f}]",
            f"{row['num_components']:.2f}",
        ]
        for row in document["ranges"]
    ]
    heads = [f"range ({range_unit})" if range_unit else "range", objective.with_unit(objective.symbol)]
    lines = table([*heads, "95 % interval", "components"], rows)
    if best is not None:
        found = f"* best fixed range: {best:.4g} {range_unit}".rstrip()
        if ends := document["best_range_interval"]:
            found += f" [{ends[0]:.4g}, {ends[1]:.4g}]"
        oracle = f"{document['hindsight_oracle']:.{digits}f} {objective.unit}".rstrip()
        lines.append(f"{found}; objective with the best range of every seed: {oracle}")
    return lines
