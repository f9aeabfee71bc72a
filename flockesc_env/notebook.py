"""HTML of results in notebooks: replays of runs, the curve of a sweep, tables of episodes.

The package imports this module, which registers the types with ``to_html``.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import fields
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from flockesc_env.common.checks import as_count
from flockesc_env.common.extras import MissingExtraError, figure_style
from flockesc_env.models.simulate import LineTrajectory, Trajectory, to_html
from flockesc_env.models.sweep import SweepResult
from flockesc_env.policies.playing import Episodes, LineEpisodes
from flockesc_env.render.palette import LIGHT
from flockesc_env.watch.page import check_runs, render, replay

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Replay:
    """Runs side by side: as the last value of a notebook's cell, it replays them.

    The page is part of the notebook: 0.1 MB, and for each run 1.3 kB per agent and 100 steps. Viewers that
    do not show pages show a picture instead, if Matplotlib is installed.

    Args:
        runs: names and runs. Runs of the same flock compare best.
        height: height of the frame in pixels.

    Raises:
        InputError: if there are no runs, they cannot be shown side by side, or ``height`` is not a
            positive integer.
    """

    def __init__(self, runs: Sequence[tuple[str, Trajectory]], *, height: int = 740) -> None:
        check_runs(runs)
        self.runs = list(runs)
        self.height = as_count(height, "height")

    def __repr__(self) -> str:
        return f"Replay({', '.join(name for name, _ in self.runs)})"

    def _repr_html_(self) -> str:
        page = render(self.runs, replay(self.runs), with_engine=False)
        source = page.replace("&", "&amp;").replace('"', "&quot;")
        style = f"width: 100%; height: {self.height}px; border: 0"
        return f'<iframe srcdoc="{source}" style="{style}">{_moment(self.runs)}</iframe>'


@to_html.register
def _(run: Trajectory) -> str:
    ranges = run.interaction_ranges
    name = f"fixed:{ranges.flat[0]:.4g}" if np.ptp(ranges) == 0 else "run"
    return Replay([(name, run)])._repr_html_()


@to_html.register
def _(run: LineTrajectory) -> str | None:
    """Return the positions of a line's agents over time, with the predator and its range."""
    with suppress(MissingExtraError), figure_style():
        from matplotlib.figure import Figure  # optional and slow to import

        figure = Figure(figsize=(6.0, 3.2), layout="constrained")
        axes = figure.add_subplot()
        axes.spines[["top", "right"]].set_visible(False)
        axes.plot(np.arange(len(run.states)), run.states, color=LIGHT.fixed, linewidth=0.6)
        predator, reach = run.scenario.predator_position, run.scenario.predator_range
        if predator is not None:
            axes.axhspan(predator - reach, predator + reach, color=LIGHT.predator, alpha=0.1, linewidth=0)
            axes.axhline(predator, color=LIGHT.predator, linewidth=1.5)
        axes.set_xlabel("step")
        axes.set_ylabel("position")
        return _picture(figure)
    return None


@to_html.register
def _(result: SweepResult) -> str:
    mean = result.values().mean(axis=1)
    if np.isfinite(mean).all():
        with suppress(MissingExtraError):
            return _picture(result.plot())
    objective = next(iter(result.objectives.values()))
    return _table(
        ["interaction_range", f"mean {objective.with_unit(objective.symbol)}"],
        zip(result.interaction_ranges, mean, strict=True),
    )


@to_html.register(Episodes)
@to_html.register(LineEpisodes)
def _(episodes: Episodes | LineEpisodes) -> str:
    columns = {
        field.name: getattr(episodes, field.name) for field in fields(episodes) if field.name != "seeds"
    }
    rows = ((name, column.mean(), column.min(), column.max()) for name, column in columns.items())
    return _table([f"{len(episodes.seeds)} seeds", "mean", "smallest", "largest"], rows)


def _moment(runs: Sequence[tuple[str, Trajectory]]) -> str:
    """Return a picture of flocks in the plane at their smallest mean predator distance, or nothing."""
    with suppress(MissingExtraError), figure_style():
        from matplotlib.figure import Figure  # optional and slow to import

        figure = Figure(figsize=(3.2 * len(runs), 3.4), layout="constrained")
        for axes, (name, run) in zip(figure.subplots(1, len(runs), squeeze=False)[0], runs, strict=True):
            step = int(run.mean_distance.argmin())
            axes.quiver(*run.positions[step].T[:2], *run.velocities[step].T[:2], color=LIGHT.fixed)
            axes.plot(*run.predator_positions[step].T[:2], "o", color=LIGHT.predator)
            axes.set_title(f"{name}: {run.mean_distance[step]:.1f} m at {run.times[step]:.1f} s", fontsize=9)
            axes.set_aspect("equal")
        file = BytesIO()
        figure.savefig(file, format="png", dpi=60)
        return f'<img alt="flocks" src="data:image/png;base64,{b64encode(file.getvalue()).decode()}">'
    return ""


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    def line(tag: str, cells: Iterable[object]) -> str:
        return f"<tr>{''.join(f'<{tag}>{cell}</{tag}>' for cell in cells)}</tr>"

    body = "".join(
        line("td", (cell if isinstance(cell, str) else f"{cell:.3f}" for cell in row)) for row in rows
    )
    return f"<table><thead>{line('th', heads)}</thead><tbody>{body}</tbody></table>"


@figure_style()
def _picture(figure: Figure) -> str:
    """Return a figure as an image in SVG, whose names do not collide with those of other images."""
    import matplotlib as mpl  # optional and slow to import

    file = BytesIO()
    with mpl.rc_context({"svg.fonttype": "none"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return f'<img alt="figure" src="data:image/svg+xml;base64,{b64encode(file.getvalue()).decode()}">'
