"""Pages in a browser: opening them, waiting for them, and reading what they show."""

import json
import os
import shutil
import time
from pathlib import Path

import pytest
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


READY = "startedPage.then((page) => { globalThis.page = page; })"


def open_page(tab: Page, address: str, width: int = 1280) -> None:
    tab.set_viewport_size({"width": width, "height": 900})
    tab.goto(address if "#" in address else f"{address}#t=0")
    tab.evaluate(READY)


def wait(tab: Page, condition: str) -> None:
    """Wait until a JavaScript expression is true.

    ``Page.wait_for_function`` evaluates text in the page, which the Content-Security-Policy forbids.
    """
    end = time.monotonic() + TIMEOUT
    while not tab.evaluate(condition):
        assert time.monotonic() < end, condition
        tab.wait_for_timeout(20)


ROOT = Path(__file__).parents[2]
BOARD = ROOT / "scoreboard"
BEST = BOARD / "search/policies/per-agent-visible-0.npz"
SEED = 7
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

DUEL = ["fixed:12", HEADLINE]
STATE = """[page.flight.scenario.name, page.flight.seed, page.flight.agents, page.flight.isSteered,
            page.panels.map(({ run }) => run.spec)]"""


def lowest(run: Trajectory) -> float:
    return float(run.mean_distance.min())


def fly(tab: Page, changes: str, spec: str) -> float:
    """Fly a policy on another flock to its end, and return the number that the page shows."""
    script = f"""(async () => {{
        page.fly({changes});
        await page.choose(page.panels[0], {json.dumps(spec)});
        page.seek(page.player.duration);
        return page.panels[0].run.objective;
    }})()"""
    return float(tab.evaluate(script))


def scenario(name: str, seed: int = SEED) -> str:
    return f"{{ scenario: page.scenarios.find(({{ name }}) => name === '{name}'), seed: '{seed}' }}"


def set_range(tab: Page, rho: float) -> None:
    """Move the slider of the first panel to a range, and wait for its flight."""
    tab.evaluate(f"""(() => {{
        const slider = document.getElementById("range");
        slider.value = page.choice.ranges.indexOf({rho});
        slider.dispatchEvent(new Event("input"));
    }})()""")
    wait(tab, f"page.panels[0].run.spec === 'fixed:{rho:g}'")


def text(tab: Page, selector: str) -> str:
    return str(tab.evaluate(f"document.querySelector('{selector}').textContent"))


def drop(tab: Page, name: str, content: bytes) -> None:
    tab.set_input_files("#file", {"name": name, "mimeType": "application/octet-stream", "buffer": content})


needs_browser = pytest.mark.skipif(EXECUTABLE is None, reason=MISSING)


OBJECTIVES = "(page.seek(page.player.duration), page.panels.map(({ run }) => run.objective))"
