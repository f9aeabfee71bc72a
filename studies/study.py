"""A study: what it measures, its results, figures and pages, and the one runner of all studies."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import msgspec
from matplotlib.figure import Figure

from flockesc_env.common.files import write_text
from flockesc_env.jobs import Backend, Cache
from studies.measurements import Runner
from training.figure_style import save_figure

RESULTS_FILE = "results.json"


class Results:
    """Results that a JSON document holds; equal results give equal bytes."""

    def to_json(self) -> str:
        """Return the results as a JSON document."""
        return document(msgspec.to_builtins(self))

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Build results from their JSON document."""
        return msgspec.json.decode(text, type=cls)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read the results in a folder."""
        return cls.from_json((folder / RESULTS_FILE).read_text("utf-8"))


def document(fields: Any) -> str:
    """Return a JSON document as the studies write it."""
    return json.dumps(fields, indent=1) + "\n"


def machine() -> str:
    """Return a description of this machine."""
    return f"{os.cpu_count()} cores, {platform.machine()}"


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study: how it measures, and its figures and pages, which are made from the results in a folder.

    ``measure`` takes the study's options, runs jobs and writes results into a folder. ``figures`` returns
    figures by the names of their files. ``pages`` takes results, their folder and the main page, and returns
    texts by files.
    """

    measure: Callable[[Any, Runner, Path], Any]
    load: Callable[[Path], Any]
    figures: Callable[[Any], Mapping[str, Figure]]
    pages: Callable[[Any, Path, Path], Mapping[Path, str]]
    formats: tuple[str, ...] = ("png",)

    def run(self, options: Any, output: Path, page: Path, backend: Backend, *, progress: bool = False) -> Any:
        """Measure, and write results, figures and pages; return the results.

        Called again after an interrupt, it continues where it stopped and ends with the same bytes.
        """
        output.mkdir(parents=True, exist_ok=True)
        self.measure(options, Runner(Cache(output / "cache"), backend, progress), output)
        return self.write(output, page)

    def write(self, output: Path, page: Path) -> Any:
        """Write figures and pages from the results in a folder; return the results."""
        results = self.load(output)
        for name, figure in self.figures(results).items():
            save_figure(figure, output / name, self.formats)
        page.parent.mkdir(parents=True, exist_ok=True)
        for file, text in self.pages(results, output, page).items():
            write_text(file, text)
        return results
