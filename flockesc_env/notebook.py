"""``Replay``: runs that play in a notebook."""

from base64 import b64encode
from collections.abc import Sequence
from contextlib import suppress
from io import BytesIO

from flockesc_env.common.extras import MissingExtraError, figure_style
from flockesc_env.models.simulate import Trajectory, as_runs
from flockesc_env.render.palette import LIGHT
from flockesc_env.watch.page import render, replay


class Replay:
    """Runs side by side: as the last value of a notebook's cell, it replays them.

    The page is part of the notebook: 0.1 MB, and for each run 1.3 kB per agent and 100 steps. Viewers that
    do not show pages show a picture instead, if Matplotlib is installed.

    Args:
        runs: names and runs, as for ``flockesc_env.watch.write_page``.
    """

    def __init__(self, runs: Sequence[tuple[str, Trajectory]]) -> None:
        self.runs = as_runs(runs)

    def __repr__(self) -> str:
        return f"Replay({', '.join(name for name, _ in self.runs)})"

    def _repr_html_(self) -> str:
        page = render(self.runs, replay(self.runs), with_engine=False)
        source = page.replace("&", "&amp;").replace('"', "&quot;")
        style = "width: 100%; height: 740px; border: 0"
        return f'<iframe srcdoc="{source}" style="{style}">{_moment(self.runs)}</iframe>'


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
