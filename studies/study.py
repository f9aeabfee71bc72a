"""A study: what it measures, its results, figures and report, and the one runner of all studies."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import msgspec
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from matplotlib.figure import Figure

from flockesc_env.common.files import write_text
from studies.measurements import Runner
from training.figure_style import save_figure

RESULTS_FILE = "results.json"
REPORT = "README.md"


def document(fields: Any) -> str:
    """Return a JSON document as the studies write it: equal fields give equal bytes."""
    return json.dumps(msgspec.to_builtins(fields), indent=1) + "\n"


class Results:
    """Results that the JSON document ``RESULTS_FILE`` in a folder holds."""

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read the results in a folder."""
        return msgspec.json.decode((folder / RESULTS_FILE).read_bytes(), type=cls)


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study: how it measures, and its figures and report, which are made from the results in a folder.

    ``measure`` takes a runner of jobs, the folder of the results and the study's options. It returns
    ``Results``, or writes other files into the folder.
    ``figures`` returns figures by the names of their PNG files. ``report`` takes results and returns the text
    of README.md in their folder.
    """

    measure: Callable[..., Any]
    load: Callable[[Path], Any]
    figures: Callable[[Any], Mapping[str, Figure]]
    report: Callable[[Any], str]

    def run(self, runner: Runner, output: Path, **options: Any) -> Any:
        """Measure, and write results, figures and the report; return the results.

        Called again after an interrupt, it continues where it stopped and ends with the same bytes.
        """
        output.mkdir(parents=True, exist_ok=True)
        measured = self.measure(runner, output, **options)
        if isinstance(measured, Results):
            write_text(output / RESULTS_FILE, document(measured))
        return self.write(output)

    def write(self, output: Path) -> Any:
        """Write figures and the report from the results in a folder; return the results."""
        results = self.load(output)
        for name, figure in self.figures(results).items():
            save_figure(figure, output / f"{name}.png")
        write_text(output / REPORT, self.report(results))
        return results


def template(name: str, module: Mapping[str, Any] | None = None) -> Template:
    """Return the template of a report, such as ``"paper/templates/paper.md"``.

    It sees the names of the module that renders it, ``globals()``. All templates have ``signed``: an
    estimate with its interval as text, with signs.
    """
    # No text that a user typed gets onto the pages unchecked, so nothing has to be escaped.
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=False,  # noqa: S701
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals["signed"] = "{:+.2f}".format
    return environment.get_template(name, globals=dict(module or {}))
