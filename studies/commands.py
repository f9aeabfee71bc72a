"""Commands of the studies, without their heavy imports: ``python -m studies paper`` and its like."""

from __future__ import annotations

import json as json_
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from flockesc_env.cli.flags import Backend, Json, Progress, optional
from flockesc_env.cli.output import Exit, note, show, show_json, table
from flockesc_env.common.checks import as_count
from flockesc_env.common.errors import InputError
from studies.flags import prepare
from studies.paper.plan import BATCH, LEAST_FLOCKS, Trials
from studies.robustness.plan import attacked_presets
from studies.validation.parts import PARTS

Output = Annotated[Path, arg(help="folder of results and figures; made if it is missing")]
Page = Annotated[Path | None, *optional("file of the Markdown page", "in the output folder")]


def paper(
    *,
    output: Output = Path("runs/paper"),
    flocks: Annotated[int, arg(help=f"flocks per range, at least {LEAST_FLOCKS}")] = Trials.flocks,
    lines: Annotated[int, arg(help=f"lines per range, at least {BATCH}")] = Trials.lines,
    figures: Annotated[
        tuple[str, ...],
        arg(
            help="write only these figures, 2 to 10, edge, force or anatomy, and measure only what they show",
            metavar="[NUMBER ..]",
            help_behavior_hint="(default: all, and the page)",
        ),
    ] = (),
    page: Page = None,
    backend: Backend = "processes",
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Set the paper's claims and figures beside what this package measures.

    Writes paper.html (self-contained), paper.md, figures (PNG, SVG), results.json.

    Takes about a quarter of an hour on two cores; interrupted, run it again to continue.

    Example: python -m studies paper --output runs/paper --figures 5 9
    """
    trials = Trials(flocks=flocks, lines=lines)
    runs_on = prepare(output, "analysis", page=page, backend=backend)
    from studies.paper.figures import measure_and_draw
    from studies.paper.page import PAPER

    if figures:
        for file in measure_and_draw(output, figures, trials, runs_on, progress=progress):
            note(f"saved: {file}")
        return Exit.DONE
    results = PAPER.run(trials, output, page or output / "paper.md", runs_on, progress=progress)
    note(f"saved: {output / 'paper.html'}")
    if json:
        show_json({"command": "paper", "output": str(output), **json_.loads(results.to_json())})
        return Exit.DONE
    for claim in results.claims:
        show(f"{claim.where}: {claim.claim}")
        show(f"    {claim.judgment.verdict}: {claim.measured[0]}")
    counts = Counter(claim.judgment.verdict for claim in results.claims)
    show("; ".join(f"{verdict}: {number}" for verdict, number in counts.items()))
    return Exit.DONE


def robustness(
    *,
    output: Output = Path("runs/robustness"),
    num_flocks: Annotated[
        int, arg(help="flocks to choose the best range on, and again as many to measure it on, at least 2")
    ] = 500,
    presets: Annotated[
        tuple[str, ...] | None,
        *optional(
            "which presets or scenario files (.toml, .json)",
            "all flock presets that have predators",
            metavar="NAME|FILE ..",
        ),
    ] = None,
    page: Page = None,
    backend: Backend = "processes",
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Find the best fixed range in every preset: does the paper's finding survive?

    Writes robustness.md, robustness.png and robustness.svg, results.json.

    About 35 minutes on two cores; interrupted, run it again to continue.

    Example: python -m studies robustness --num-flocks 50 --presets paper-flock pursuit
    """
    as_count(num_flocks, "num_flocks", least=2)  # without two there is no interval
    attacked_presets(presets)  # refuses unknown ones before heavy imports
    runs_on = prepare(output, "analysis", page=page, backend=backend)
    from studies.robustness.survey import ROBUSTNESS, SurveyOptions

    page = page or output / "robustness.md"
    results = ROBUSTNESS.run(SurveyOptions(num_flocks, presets), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    if json:
        show_json({"command": "robustness", "output": str(output), "results": json_.loads(results.to_json())})
        return Exit.DONE
    columns = ["preset", "best range", "J_mean (m)", "over 0 (m)", "over the longest (m)", "best range is"]
    rows: list[list[Any]] = []
    for row in results.presets:
        found = row.outcomes["J_mean"]
        best = f"{found.best:g} {row.grid.unit}"
        gains = found.gain_over_zero, found.gain_over_longest
        rows.append([row.name, best, *map(str, (found.min_mean_distance, *gains)), found.finding])
    show(*table(columns, rows))
    return Exit.DONE


def validation(
    *,
    output: Output = Path("results/validation"),
    only: Annotated[
        tuple[str, ...] | None,
        *optional(
            "measure these results; the others keep their stored ones",
            f"all: {', '.join(PARTS)}",
            metavar="NAME ..",
        ),
    ] = None,
    scale: Annotated[float, arg(help="share of the flocks that run")] = 1.0,
    page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/validation.md"),
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """Published results of other models and flocks, measured again with this simulator.

    Interrupted, run it again to continue.

    Example: python -m studies validation --only vicsek --scale 0.1
    """
    chosen = PARTS if only is None else only
    for name in chosen:
        if name not in PARTS:
            raise InputError("only", f"any of {', '.join(PARTS)}", repr(name))
    if not 0 < scale <= 1:
        raise InputError("scale", "a number in (0, 1]", scale)
    runs_on = prepare(output, "analysis", page=page, backend=backend)
    from studies.validation.survey import VALIDATION, ValidationOptions

    VALIDATION.run(ValidationOptions(chosen, scale), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE


def arms_race(
    *,
    output: Output = Path("results/arms_race"),
    rounds: Annotated[int, arg(help="rounds, in which a flock policy and then a predator is trained")] = 3,
    num_flocks: Annotated[int, arg(help="held-out flocks of the cross-play, at least 2")] = 1000,
    page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/arms-race.md"),
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """Train predators and flock policies against each other in turns, and play all against all.

    About 40 minutes on one core; interrupted, run it again to continue.

    Example: python -m studies arms-race --backend serial
    """
    as_count(rounds, "rounds")
    as_count(num_flocks, "num_flocks", least=2)
    runs_on = prepare(output, "train", page=page, backend=backend)
    from studies.arms_race.page import ARMS_RACE
    from studies.arms_race.race import RaceOptions

    ARMS_RACE.run(RaceOptions(rounds, num_flocks), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE
