"""Shared by tests of the page in a browser: the headline policy, ways to fly a flock and to read the page."""

from __future__ import annotations

import json
from pathlib import Path

from playwright.sync_api import Page

import flockesc_env as fe

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


def lowest(run: fe.Trajectory) -> float:
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


def world(name: str, seed: int = SEED) -> str:
    return f"{{ world: page.worlds.find(({{ name }}) => name === '{name}'), seed: '{seed}' }}"


def text(tab: Page, selector: str) -> str:
    return str(tab.evaluate(f"document.querySelector('{selector}').textContent"))


def drop(tab: Page, name: str, content: bytes) -> None:
    tab.set_input_files("#file", {"name": name, "mimeType": "application/octet-stream", "buffer": content})
