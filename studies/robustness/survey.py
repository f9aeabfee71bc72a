"""Run the survey: measurements, results, figure and page. Needs the ``analysis`` extra."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from flockesc_env.cli.output import note
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Backend, Cache
from flockesc_env.models import records
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import PRESETS
from studies.measurements import measure
from studies.robustness.figure import gains
from studies.robustness.findings import OBJECTIVES, outcome
from studies.robustness.page import FIGURE, RESULTS_FILE, PresetResult, RobustnessResults, markdown_page
from studies.robustness.plan import attacked_presets, grid_of, measurements
from studies.robustness.questions import question_of
from training.figure_style import save_figure


def survey(
    output: Path,
    num_flocks: int,
    backend: Backend,
    *,
    presets: Sequence[str] | None = None,
    cache: Path | None = None,
    page: Path | None = None,
    progress: bool = False,
) -> RobustnessResults:
    """Measure all presets; write the results, the figure and the page.

    Called again after an interrupt, it continues where it stopped and ends with the same bytes.

    Args:
        output: folder of ``results.json`` and the figure (PNG and SVG).
        num_flocks: flocks in each half, at least 2.
        backend: where the measurements run.
        presets: which presets or scenario files; ``None``: all flock presets that have predators.
        cache: folder of finished jobs; default: ``cache`` in ``output``.
        page: where the Markdown page goes; default: ``robustness.md`` in ``output``.
        progress: whether to show the progress bar even if stderr is not a terminal.

    Raises:
        ArgumentError: for a preset that is not a flock or has no predator.
        JobError: if measurements failed.
    """
    scenarios = attacked_presets(presets)
    output.mkdir(parents=True, exist_ok=True)
    plan, kept = measurements(scenarios, num_flocks), Cache(cache or output / "cache")
    measured = measure(plan, kept, backend, progress=progress)
    note("measured; statistics take some seconds per preset")
    rows = tuple(_preset(name, scenario, measured[name]) for name, scenario in scenarios.items())
    chosen = "" if presets is None else f" --presets {' '.join(presets)}"
    results = RobustnessResults(
        command=f"python -m studies robustness --num-flocks {num_flocks}{chosen}",
        num_flocks=num_flocks,
        presets=rows,
        versions={**records.versions(), "scipy": version("scipy")},
    )
    save_figure(gains(results), output / FIGURE)
    markdown = page or output / "robustness.md"
    write_text(output / RESULTS_FILE, results.to_json())
    write_text(markdown, markdown_page(results, output, markdown))
    return results


def _preset(name: str, scenario: FlockScenario, measured: Arrays) -> PresetResult:
    grid = grid_of(scenario)
    outcomes = {symbol: outcome(symbol, grid.actions, measured) for symbol in OBJECTIVES}
    description = PRESETS[name].description if name in PRESETS else "a scenario file"
    return PresetResult(name, description, question_of(scenario), grid, outcomes)
