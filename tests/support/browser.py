"""The browser that opens pages, and what tests of pages do and read in it."""

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page

from flockesc_env.models import Trajectory
from playground.__main__ import HEADLINE

_NAMES = ("chromium", "chromium-browser", "google-chrome")
EXECUTABLE = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, _NAMES)), None)
MISSING = "needs Chromium: `apt-get install chromium`, or set CHROMIUM to the path of a browser"

TIMEOUT = 60  # seconds; reached only by a page that does not do what it should

ARGUMENTS = [
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
]
"""Arguments of the browser."""

ROOT = Path(__file__).parents[2]
BEST = ROOT / "scoreboard/search/policies/per-agent-visible-0.npz"
SEED, FLOCKS = 7, 4  # flocks of the means
DUEL = ["fixed:12", HEADLINE]
OpenAt = Callable[..., None]
"""The fixture ``open_at``: opens the playground, paused, at an address."""

READY = "startedPage.then((page) => { globalThis.page = page; })"
COLORED = """[...document.querySelectorAll(".panel canvas")].map((canvas) => {
    // Pixels that are neither see-through nor grey: agents and the predator.
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let colored = 0;
    for (let at = 0; at < data.length; at += 4) {
        const color = data.subarray(at, at + 3);
        if (data[at + 3] > 200 && Math.max(...color) - Math.min(...color) > 60) colored++;
    }
    return colored;
})"""

STATE = """[page.flight.scenario.name, page.flight.seed, page.flight.agents, page.flight.isSteered,
            page.panels.map(({ run }) => run.spec)]"""
OBJECTIVES = "(page.seek(page.player.duration), page.panels.map(({ run }) => run.objective))"


def open_page(tab: Page, address: str) -> None:
    tab.goto(address)
    tab.evaluate(READY)


def wait(tab: Page, condition: str) -> None:
    """Wait until a JavaScript expression is true.

    ``Page.wait_for_function`` evaluates text in the page, which the Content-Security-Policy forbids.
    """
    end = time.monotonic() + TIMEOUT
    while not tab.evaluate(condition):
        assert time.monotonic() < end, condition
        tab.wait_for_timeout(20)


def lowest(run: Trajectory) -> float:
    return float(run.mean_distance.min())


def scenario(name: str) -> str:
    return f"{{ scenario: page.scenarios.find(({{ name }}) => name === '{name}'), seed: '{SEED}' }}"


def slide(tab: Page, rho: float) -> None:
    """Move the slider to a range."""
    tab.evaluate(f"""(() => {{
        const slider = document.getElementById("range");
        slider.value = page.choice.ranges.indexOf({rho});
        slider.dispatchEvent(new Event("input"));
    }})()""")


def set_range(tab: Page, rho: float) -> None:
    """Move the slider of the first panel to a range, and wait for its flight."""
    slide(tab, rho)
    wait(tab, f"page.panels[0].run.spec === 'fixed:{rho:g}'")


def text(tab: Page, selector: str) -> str:
    return str(tab.evaluate(f"document.querySelector('{selector}').textContent"))
