"""The survey as a study. Needs the ``analysis`` extra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flockesc_env.cli.output import note
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays
from flockesc_env.models import records
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import PRESETS
from studies.measurements import Runner
from studies.robustness.figure import gains
from studies.robustness.findings import OBJECTIVES, outcome
from studies.robustness.page import FIGURE, PresetResult, RobustnessResults, markdown_page
from studies.robustness.plan import attacked_presets, grid_of, measurements
from studies.robustness.questions import question_of
from studies.study import RESULTS_FILE, Study


@dataclass(frozen=True)
class SurveyOptions:
    """The number of flocks in each half, and the presets or scenario files; None: all that are attacked."""

    num_flocks: int
    presets: Sequence[str] | None = None


def _measure(options: SurveyOptions, runner: Runner, output: Path) -> None:
    scenarios = attacked_presets(options.presets)
    measured = runner.measure(measurements(scenarios, options.num_flocks))
    note("measured; statistics take some seconds per preset")
    chosen = "" if options.presets is None else f" --presets {' '.join(options.presets)}"
    results = RobustnessResults(
        command=f"python -m studies robustness --num-flocks {options.num_flocks}{chosen}",
        num_flocks=options.num_flocks,
        presets=tuple(_preset(name, scenario, measured[name]) for name, scenario in scenarios.items()),
        versions=records.versions("scipy"),
    )
    write_text(output / RESULTS_FILE, results.to_json())


def _preset(name: str, scenario: FlockScenario, measured: Arrays) -> PresetResult:
    grid = grid_of(scenario)
    outcomes = {symbol: outcome(symbol, grid.actions, measured) for symbol in OBJECTIVES}
    description = PRESETS[name].description if name in PRESETS else "a scenario file"
    return PresetResult(name, description, question_of(scenario), grid, outcomes)


ROBUSTNESS = Study(
    measure=_measure,
    load=RobustnessResults.load,
    figures=lambda results: {FIGURE: gains(results)},
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
    formats=("svg", "png"),
)
