"""Pictures of flocks and lines, in environments and of recorded runs. Needs the ``video`` extra.

Importing this package does not load pygame. Environments with a render mode load it, and so do the functions
that draw.
"""

from flockesc_env.render.frames import RenderOptions
from flockesc_env.render.video import draw

__all__ = ["RenderOptions", "draw"]
