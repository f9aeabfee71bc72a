"""The parts as one study: their results, figures and page."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, get_type_hints

import msgspec
import numpy as np

from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import records
from studies.measurements import Runner
from studies.pages import path_from, render, signed
from studies.study import RESULTS_FILE, Results, Study
from studies.validation.parts import PARTS, part

_SECONDS = "processor_seconds"


@dataclass(frozen=True)
class Measured:
    """Results of a part, with the command that measured them and its processor minutes."""

    command: str
    versions: dict[str, str]
    minutes: float
    results: Any


@dataclass(frozen=True)
class ValidationResults(Results):
    """Results by part; parts that were not measured are missing."""

    parts: dict[str, Measured]

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Build results from their JSON document."""
        stored = msgspec.json.decode(text, type=cls).parts
        kinds = {name: get_type_hints(part(name).results)["return"] for name in PARTS if name in stored}
        return cls(
            {
                name: dataclasses.replace(stored[name], results=msgspec.convert(stored[name].results, kind))
                for name, kind in kinds.items()
            }
        )


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


def measure(options: ValidationOptions, runner: Runner, output: Path) -> None:
    """Measure parts, and write the results of all after each."""
    file = output / RESULTS_FILE
    parts = ValidationResults.load(output).parts if file.exists() else {}
    scale = "" if options.scale == 1 else f" --scale {options.scale:g}"
    for name in options.only:
        groups = {
            key: [
                Job(f"{__name__}:timed", (job.function, job.arguments), job.seconds)
                for job in ([group] if isinstance(group, Job) else group)
            ]
            for key, group in part(name).jobs(options.scale).items()
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


def markdown_page(results: ValidationResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the pictures in the folder ``figures``."""
    sections = []
    for name, measured in results.parts.items():
        module, found = part(name), measured.results
        picture = path_from(page, figures / f"{name}.png")
        section = render(f"validation/{name}.md", part=module, results=found, picture=picture, signed=signed)
        sections.append((module, module.here(found), module.verdict(found), measured, section.strip()))
    return render("validation/validation.md", sections=sections)


VALIDATION = Study(
    measure=measure,
    load=ValidationResults.load,
    figures=lambda results: {name: part(name).figure(found.results) for name, found in results.parts.items()},
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
)
