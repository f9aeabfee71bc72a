"""Pictures of flocks and lines, in environments and of recorded runs. Needs the ``video`` extra.

Importing this loads no pygame: what draws is imported when an environment has a render mode, or when a
picture is asked for.
"""

from __future__ import annotations

import os
from importlib import import_module
from itertools import islice
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from flockesc_env.common.checks import as_count, as_text
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.models.simulate import LineTrajectory, Trajectory, as_run
from flockesc_env.render.options import RENDER_MODES, RenderOptions, as_render_mode, as_render_options
from flockesc_env.scenario.line import LineScenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer, LineViewer, Viewer

__all__ = ["RENDER_MODES", "RenderOptions", "draw", "flock_viewer", "line_viewer", "render", "require"]


def draw(
    run: Trajectory | LineTrajectory, step: int, *, options: RenderOptions | None = None, title: str = ""
) -> NDArray[np.uint8]:
    """Return the picture of a recorded run at one of its times, shape (size, size, 3).

    Args:
        run: the run; J is that of the mean distance.
        step: 0..T.
        options: what the picture shows.
        title: a word above it.

    Raises:
        ArgumentError: for a time that the run does not have, or an argument of a wrong type.
        ScenarioError: for options that do not fit the flock.
        DependencyNotInstalled: without pygame.
    """
    as_run(run, "run")
    options, title = as_render_options(options), as_text(title, "title")
    last = run.steps if isinstance(run, LineTrajectory) else run.scenario.num_steps
    step = as_count(step, "step", least=0, most=last)
    require("pygame")
    if isinstance(run, LineTrajectory):
        from flockesc_env.render.line import draw_line, recorded_line

        return draw_line(recorded_line(run, step), options, title)
    from flockesc_env.render.flock import draw_flock
    from flockesc_env.render.frame import recorded_frames

    return draw_flock(next(islice(recorded_frames(run), step, None)), options, title)


def flock_viewer(batch: FlockBatch, render_mode: Any, render_options: Any, fps: int) -> FlockViewer | None:
    """Return what shows the flocks of a batch; ``None`` without a render mode.

    Raises:
        ScenarioError: for a bad mode, or options that are none or do not fit the flock.
        DependencyNotInstalled: without pygame.
    """
    mode, options = as_render_mode(render_mode), as_render_options(render_options)
    options.selected(batch.scenario.num_agents)
    if mode is None:
        return None
    require("pygame")
    from flockesc_env.render.viewer import FlockViewer

    return FlockViewer(batch, mode, options, fps)


def line_viewer(scenario: LineScenario, render_mode: Any, render_options: Any, fps: int) -> LineViewer | None:
    """Return what shows a line, as ``flock_viewer``."""
    mode, options = as_render_mode(render_mode), as_render_options(render_options)
    if mode is None:
        return None
    require("pygame")
    from flockesc_env.render.viewer import LineViewer

    return LineViewer(scenario, mode, options, fps)


def render(viewer: Viewer | None) -> list[NDArray[np.uint8]] | None:
    """Return a picture of every flock, or show them in mode ``"human"``; without a mode, warn.

    Raises:
        ResetNeededError: before the first reset.
    """
    if viewer is None:
        gymnasium.logger.warn(
            'render: no render mode was chosen; pass render_mode="rgb_array" or "human" to the constructor'
        )
        return None
    return viewer.render()


def frames_per_second(seconds: float) -> int:
    """Return how many pictures a second are shown where each is ``seconds`` after the one before."""
    return max(1, round(min(1.0 / seconds, 1000.0)))  # of the shortest steps it would be infinite


def require(*modules: str) -> None:
    """Import modules of the ``video`` extra.

    Raises:
        DependencyNotInstalled: if one of them is missing.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # no greeting on standard output
    os.environ.setdefault(
        "SDL_NO_SIGNAL_HANDLERS", "1"
    )  # a window must not swallow SIGTERM, nor in forked workers
    for module in modules:
        try:
            import_module(module)
        except ImportError as error:
            raise DependencyNotInstalled(
                f'{module} is not installed, run `pip install "flockesc-env[video]"`'
            ) from error
