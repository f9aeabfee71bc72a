"""Rendering of environments: viewers by render mode, frame rates, the warning without a mode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.render.dependencies import require_video
from flockesc_env.render.options import as_render_mode, as_render_options
from flockesc_env.scenario.line import LineScenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer, LineViewer, Viewer


def flock_viewer(batch: FlockBatch, render_mode: Any, render_options: Any, fps: int) -> FlockViewer | None:
    """Return the viewer of a batch of flocks; ``None`` if the environment has no render mode."""
    mode, options = as_render_mode(render_mode), as_render_options(render_options)
    options.selected(batch.scenario.num_agents)
    if mode is None:
        return None
    require_video("pygame")
    from flockesc_env.render.viewer import FlockViewer

    return FlockViewer(batch, mode, options, fps)


def line_viewer(scenario: LineScenario, render_mode: Any, render_options: Any, fps: int) -> LineViewer | None:
    """Return the viewer of a line; ``None`` if the environment has no render mode."""
    mode, options = as_render_mode(render_mode), as_render_options(render_options)
    if mode is None:
        return None
    require_video("pygame")
    from flockesc_env.render.viewer import LineViewer

    return LineViewer(scenario, mode, options, fps)


def render(viewer: Viewer | None) -> list[NDArray[np.uint8]] | None:
    """Return a picture of every flock. Mode ``"human"`` shows them instead; without a mode, warn.

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
    """Return the frame rate, 1 to 1000, at which actions of ``seconds`` of model time play in real time."""
    return max(1, round(min(1.0 / seconds, 1000.0)))
