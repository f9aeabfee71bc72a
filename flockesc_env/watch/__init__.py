"""Watch flocks in the browser: recorded runs as one HTML file, or a local server that simulates more."""

from flockesc_env.watch.page import write_page
from flockesc_env.watch.server import serve

__all__ = ["serve", "write_page"]
