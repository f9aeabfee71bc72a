"""Pictures of flocks and lines, in environments and of recorded runs. Needs the ``video`` extra.

Importing this package does not load pygame. Environments with a render mode load it, and so do the functions
that draw.
"""

from flockesc_env.render.options import RENDER_MODES, RenderOptions
from flockesc_env.render.video import draw
from flockesc_env.render.viewer import flock_viewer, frames_per_second, line_viewer, render

__all__ = [
    "RENDER_MODES",
    "RenderOptions",
    "draw",
    "flock_viewer",
    "frames_per_second",
    "line_viewer",
    "render",
]
