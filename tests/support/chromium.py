"""The system's Chromium for tests, driven by Playwright."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Browser, Page, sync_playwright

_NAMES = ("chromium", "chromium-browser", "google-chrome")
EXECUTABLE = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, _NAMES)), None)
MISSING = "needs Chromium: `apt-get install chromium`, or set CHROMIUM to the path of a browser"

TIMEOUT = 60  # seconds; reached only by a page that does not do what it should

_ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@contextmanager
def chromium() -> Iterator[Browser]:
    """Start a headless browser and close it at the end."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=EXECUTABLE, args=_ARGUMENTS)
        yield browser
        browser.close()


def open_page(tab: Page, address: str, width: int = 1280) -> None:
    tab.set_viewport_size({"width": width, "height": 900})
    tab.goto(address if "#" in address else f"{address}#t=0")
    tab.evaluate("startedPage.then((page) => { globalThis.page = page; })")


def wait(tab: Page, condition: str) -> None:
    """Wait until a JavaScript expression is true.

    ``Page.wait_for_function`` evaluates text in the page, which the Content-Security-Policy forbids.
    """
    end = time.monotonic() + TIMEOUT
    while not tab.evaluate(condition):
        assert time.monotonic() < end, condition
        tab.wait_for_timeout(20)
