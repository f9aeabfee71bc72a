"""Watch flocks in the browser: one HTML file that replays runs and simulates more."""

from flockesc_env.watch.page import write_page

__all__ = ["write_page"]
