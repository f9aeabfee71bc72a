"""The command scan: measures of a flock against fields of its scenario, or its range."""

from functools import partial
from typing import Annotated, Any

import numpy as np
from tyro.conf import UseAppendAction, arg

from flockesc_env.cli.flags import Json, Progress, ScenarioFlags, Seeds, Threads, described
from flockesc_env.cli.output import Exit, check_output, conclude, note, table
from flockesc_env.cli.sweep import Output, save
from flockesc_env.common.array_files import PICTURES, TABLES
from flockesc_env.common.checks import parse_number
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.common.progress import progress_bar
from flockesc_env.models.scan import NAMES, scan


def run(
    scenario: ScenarioFlags,
    *,
    interaction_range: Annotated[
        tuple[float, ...], arg(help="range in m, or one per value", metavar="FLOAT ..")
    ],
    values: Annotated[
        UseAppendAction[tuple[str, ...]],
        arg(
            help="values of a field, such as angular_noise=1,2,3; repeat it for fields that change together",
            metavar="PATH=FLOAT,..",
            help_behavior_hint="(default: no changes)",
        ),
    ] = (),
    seeds: Annotated[Seeds, arg(help="seeds of the flocks, STOP excluded")] = range(10),
    measures: Annotated[
        tuple[str, ...], arg(help=f"what to measure: {', '.join(NAMES)}", metavar="NAME ..")
    ] = ("polarization",),
    skip: Annotated[int, arg(help="number of steps before the first time that counts")] = 0,
    every: Annotated[int, arg(help="number of steps between times that count")] = 1,
    output: Output = None,
    num_threads: Threads = None,
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Measure a flock against fields of its scenario, or its range.

    Prints means with 95 % intervals, fluctuations and autocorrelation times.

    Needs the analysis extra.

    Example: flockesc scan --interaction-range 10 --values speed=5,10,20
    """
    check_output(output, [*TABLES, *PICTURES])
    require("analysis", ["matplotlib", "polars", "scipy"])
    chosen: Any = scenario.build()
    given = dict(_values(each) for each in values)
    rho = interaction_range if len(interaction_range) > 1 else interaction_range[0]
    total = len(seeds) * len(next(iter(given.values()), interaction_range))
    options: dict[str, Any] = {"measures": measures, "skip": skip, "every": every}
    with progress_bar("Scan", total, always=progress) as bar:
        result = scan(chosen, given, rho, seeds, num_threads=num_threads, progress=bar, **options)
    lines, measured = list[str](), {}
    for name in result.series:
        columns = {**result.values, **result.summary(name)}
        rows = np.transpose([*columns.values()]).tolist()
        lines += [name, *table([*columns], [[f"{each:.4g}" for each in row] for row in rows])]
        measured[name] = {column: each.tolist() for column, each in columns.items()}
        if notes := result.notes(name):
            note("runs are shorter than ten autocorrelation times:", *notes)
    document = {
        **described("scan", chosen, output),
        "seeds": {"start": seeds.start, "stop": seeds.stop},
        **options,
        "measured": measured,
    }
    conclude(document if json else lines, output, partial(save, result, None))
    return Exit.DONE


def _values(change: str) -> tuple[str, list[float]]:
    path, _, text = change.partition("=")
    try:
        return path, [parse_number(number, float) for number in text.split(",")]
    except ValueError:
        raise InputError("values", "PATH=NUMBER,NUMBER,..", repr(change)) from None
