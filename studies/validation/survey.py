"""The parts as one study. Needs the ``analysis`` extra."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import records
from studies.measurements import Runner
from studies.study import RESULTS_FILE, Study
from studies.validation.page import markdown_page
from studies.validation.results import PARTS, Measured, ValidationResults, part

_SECONDS = "processor_seconds"


@dataclass(frozen=True)
class ValidationOptions:
    """The parts that are measured, and the share of their flocks; others keep their stored results."""

    only: tuple[str, ...]
    scale: float


def timed(function: str, arguments: tuple[Any, ...]) -> Arrays:
    """Return the arrays of a job and its processor time in s, shape (1,)."""
    begun = time.process_time()
    found = Job(function, arguments).run()
    return found | {_SECONDS: np.array([time.process_time() - begun])}


def _measure(options: ValidationOptions, runner: Runner, output: Path) -> None:
    file = output / RESULTS_FILE
    parts = ValidationResults.load(output).parts if file.exists() else {}
    scale = "" if options.scale == 1 else f" --scale {options.scale:g}"
    for name in options.only:
        jobs = part(name).jobs(options.scale)
        groups = {
            key: [_timed(job) for job in ([group] if isinstance(group, Job) else group)]
            for key, group in jobs.items()
        }
        measured = runner.groups(groups, part(name).TITLE)
        seconds = sum(found.pop(_SECONDS).sum() for found in measured.values())
        parts[name] = Measured(
            command=f"python -m studies validation --only {name}{scale}",
            versions=records.versions("scipy"),
            minutes=round(float(seconds) / 60, 1),
            results=part(name).results(measured),
        )
        ordered = {each: parts[each] for each in PARTS if each in parts}
        write_text(file, ValidationResults(ordered).to_json())


def _timed(job: Job) -> Job:
    return Job(f"{__name__}:timed", (job.function, job.arguments), job.seconds)


def _figures(results: ValidationResults) -> Mapping[str, Any]:
    return {name: part(name).figure(measured.results) for name, measured in results.parts.items()}


VALIDATION = Study(
    measure=_measure,
    load=ValidationResults.load,
    figures=_figures,
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
    formats=("png",),
)
