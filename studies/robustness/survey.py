"""From measurements to results, figure and page. Needs the ``analysis`` extra."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from flockesc_env.common.files import atomic_write
from flockesc_env.models import records
from flockesc_env.models.sweep import Progress
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import PRESETS
from studies.paper import style
from studies.paper.jobs import Arrays, Cache, measure
from studies.robustness.figure import against_range
from studies.robustness.findings import OBJECTIVES, outcome
from studies.robustness.page import FIGURE, RESULTS_FILE, Results, World, markdown_page
from studies.robustness.plan import grid_of, studies, worlds
from studies.robustness.questions import question_of


def survey(
    output: Path,
    num_flocks: int,
    *,
    presets: Sequence[str] | None = None,
    cache: Path | None = None,
    page: Path | None = None,
    progress: Progress,
) -> Results:
    """Measure all worlds; write the results, the figure and the page.

    What is interrupted goes on where it stopped when it is called again, and ends with the same bytes.

    Args:
        output: folder of ``results.json`` and the figure (PNG and SVG).
        num_flocks: flocks in each half, at least 2.
        presets: which worlds; ``None``: all flock presets that have predators.
        cache: folder of finished chunks; default: ``cache`` in ``output``.
        page: where the Markdown page goes; default: ``worlds.md`` in ``output``.
        progress: called with the size of what is finished and of the whole (``jobs.total_size``).

    Raises:
        ArgumentError: for a preset that is no flock's or has no predator.
    """
    scenarios = worlds(presets)
    output.mkdir(parents=True, exist_ok=True)
    measured = measure(studies(scenarios, num_flocks), Cache(cache or output / "cache"), progress)
    rows = tuple(_world(name, scenario, measured[name]) for name, scenario in scenarios.items())
    chosen = "" if presets is None else f" --presets {' '.join(presets)}"
    results = Results(
        command=f"flockesc worlds --num-flocks {num_flocks}{chosen}",
        num_flocks=num_flocks,
        worlds=rows,
        versions={**records.versions(), "scipy": version("scipy")},
    )
    style.save(against_range(results), output / FIGURE)
    markdown = page or output / "worlds.md"
    _write(output / RESULTS_FILE, results.to_json())
    _write(markdown, markdown_page(results, output, markdown))
    return results


def _world(name: str, scenario: FlockScenario, measured: Arrays) -> World:
    grid = grid_of(scenario)
    outcomes = {symbol: outcome(symbol, grid.actions, measured) for symbol in OBJECTIVES}
    return World(name, PRESETS[name].description, question_of(scenario), grid, outcomes)


def _write(path: Path, text: str) -> None:
    with atomic_write(path) as file:
        file.write(text.encode())
