"""Pictures of flocks and lines, in environments and of recorded runs. Needs the ``video`` extra.

Importing this package does not load pygame. Pygame is loaded when an environment has a render mode, or when a
picture or video is asked for.
"""

from flockesc_env.render.environments import flock_viewer, frames_per_second, line_viewer, render
from flockesc_env.render.options import RENDER_MODES, RenderOptions
from flockesc_env.render.recorded import draw

__all__ = [
    "RENDER_MODES",
    "RenderOptions",
    "draw",
    "flock_viewer",
    "frames_per_second",
    "line_viewer",
    "render",
]
