"""The parts as one study: their results, figures and page."""

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, get_type_hints

import msgspec
import numpy as np

from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import records
from studies.measurements import Runner
from studies.study import RESULTS_FILE, Results, Study, document, template
from studies.validation import PARTS, part

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
    def load(cls, folder: Path) -> Self:
        """Read the results in a folder."""
        found = super().load(folder)
        for name, stored in found.parts.items():
            kind = get_type_hints(part(name).results)["return"]
            found.parts[name] = replace(stored, results=msgspec.convert(stored.results, kind))
        return found


def timed(function: str, arguments: tuple[Any, ...]) -> Arrays:
    """Return the arrays of a job and its processor time in s, shape (1,)."""
    begun = time.process_time()
    found = Job(function, arguments).run()
    return found | {_SECONDS: np.array([time.process_time() - begun])}


def measure(runner: Runner, output: Path, only: Iterable[str], scale: float) -> None:
    """Measure parts with a share of their flocks, and write the results of all after each.

    Other parts keep their stored results.
    """
    file = output / RESULTS_FILE
    parts = ValidationResults.load(output).parts if file.exists() else {}
    share = "" if scale == 1 else f" --scale {scale:g}"
    for name in only:
        groups = {
            key: [Job(f"{__name__}:timed", (job.function, job.arguments), job.seconds) for job in group]
            for key, group in part(name).jobs(scale).items()
        }
        measured = runner.run(groups, f"Measuring {name}")
        seconds = sum(found.pop(_SECONDS).sum() for found in measured.values())
        parts[name] = Measured(
            command=f"python -m studies validation --only {name}{share}",
            versions=records.versions("scipy"),
            minutes=round(float(seconds) / 60, 1),
            results=part(name).results(measured),
        )
        ordered = {each: parts[each] for each in PARTS if each in parts}
        write_text(file, document(ValidationResults(ordered)))


def report(results: ValidationResults) -> str:
    """Return the report as Markdown."""
    sections = []
    for name, measured in results.parts.items():
        module = part(name)
        values = {"part": module, "results": measured.results, "picture": f"{name}.png"}
        section = template(f"validation/templates/{name}.md").make_module(values)
        sections.append((section, module.verdict(measured.results), measured))
    return template("validation/templates/validation.md").render(sections=sections)


VALIDATION = Study(
    measure=measure,
    load=ValidationResults.load,
    figures=lambda results: {name: part(name).figure(found.results) for name, found in results.parts.items()},
    report=report,
)
