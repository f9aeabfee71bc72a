"""Pages that replay recorded runs, in a browser."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import chromium
import pytest
from chromium import COLORED, open_page, text, wait
from cli_runs import SMALL
from playwright.sync_api import Page

import flockesc_env as fe
from flockesc_env.policies.registry import built_in
from flockesc_env.watch.page import render, replay

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

FLOCK = fe.FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")
TITLES = ["fixed range 15 m", "rule: stubborn leaders"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("pages") / "page.html"
    runs = [(spec, built_in(spec).record(3, FLOCK)) for spec in SPECS]
    path.write_text(render(runs, replay(runs), with_engine=False))
    return path.as_uri()


def test_without_the_engine_a_page_replays(tab: Page, recorded: str) -> None:
    open_page(tab, recorded)
    titles = "[...document.querySelectorAll('.panel h2')].map((title) => title.textContent)"
    assert tab.evaluate(titles) == TITLES
    assert tab.evaluate("document.title") == " / ".join(TITLES)
    assert min(tab.evaluate(COLORED)) > 50
    assert tab.evaluate("document.querySelectorAll('.chart canvas').length") == 3
    live = "[...document.querySelectorAll('.live')].some((part) => part.checkVisibility())"
    assert tab.evaluate(live) is False
    assert text(tab, "#facts").endswith(f"seed 3 \u00b7 flockesc-env {version('flockesc-env')}")
    tab.evaluate("page.seek(3.8); page.player.play()")
    wait(tab, "!page.player.isPlaying")
    assert text(tab, "#time") == "4.0 of 4 s"


CURSORS = """[...document.querySelectorAll(".chart .u-over")].map((plot) => {
    const [box, now] = [plot, plot.querySelector(".now")].map((part) => part.getBoundingClientRect());
    return (now.left - box.left) / box.width;
})"""


def test_scrubbing_moves_the_cursor_the_flock_and_the_numbers(tab: Page, recorded: str) -> None:
    open_page(tab, recorded)
    before = tab.evaluate("page.panels[0].canvas.toDataURL()")
    tab.fill("#scrub", "3")
    assert tab.evaluate(CURSORS) == pytest.approx([0.75] * 3, abs=0.01)
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before
    run = built_in("fixed:15").record(3, FLOCK)
    expected = [
        f"{run.mean_distance[60]:.1f} m",
        f"{run.mean_distance[:61].min():.1f} m",
        f"{run.min_distance[60]:.1f} m",
        f"{run.num_components[60]}",
        "15.0 m",
    ]
    shown = "[...page.panels[0].root.querySelectorAll('div:not([hidden]) > dd')].map((dd) => dd.textContent)"
    assert tab.evaluate(shown) == expected


def test_a_page_of_3000_agents_opens_and_seeks(tab: Page, tmp_path: Path) -> None:
    run = fe.simulate(fe.FlockScenario(num_agents=3000), 10.0, seed=1)
    runs = [("fixed:10", run)]
    (tmp_path / "page.html").write_text(render(runs, replay(runs), with_engine=False))
    open_page(tab, (tmp_path / "page.html").as_uri())
    tab.evaluate("page.seek(6)")
    assert text(tab, ".readout dd") == f"{run.mean_distance[120]:.1f} m"
    assert min(tab.evaluate(COLORED)) > 1000


def test_names_are_text(tab: Page, tmp_path: Path) -> None:
    name = "<!--<script></script><img src=x onerror='window.hacked = 1'><script>window.hacked = 1</script>"
    fe.watch.write_page([(name, fe.simulate(SMALL, 5.0, seed=3))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert text(tab, ".panel h2") == name
    assert tab.evaluate("document.title") == name
    assert tab.evaluate("[typeof window.hacked, document.images.length]") == ["undefined", 0]
