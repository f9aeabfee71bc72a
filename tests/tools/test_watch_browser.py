"""The watch page in a browser: opening from a file, playback, scrubbing and rotation."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import chromium
import pytest
from chromium import open_page, wait
from playwright.sync_api import Page

from flockesc_env import FlockScenario
from flockesc_env.policies.registry import built_in
from flockesc_env.watch import write_page

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

FLOCK = FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")
TITLES = ["fixed range 15 m", "rule: stubborn leaders"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("pages") / "page.html"
    write_page([(spec, built_in(spec).record(3, FLOCK)) for spec in SPECS], path)
    return path.as_uri()


COLORED = """(() => {
    // Pixels of every canvas that are neither see-through nor grey: agents and the predator.
    return [...document.querySelectorAll(".panel canvas")].map((canvas) => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        let colored = 0;
        for (let at = 0; at < data.length; at += 4) {
            const color = data.subarray(at, at + 3);
            if (data[at + 3] > 200 && Math.max(...color) - Math.min(...color) > 60) colored++;
        }
        return colored;
    });
})()"""


def test_a_file_opens_alone_with_both_panels(tab: Page, file: str) -> None:
    requests: list[str] = []
    tab.on("request", lambda request: requests.append(request.url))
    open_page(tab, file)
    titles = "[...document.querySelectorAll('.panel h2')].map((title) => title.textContent)"
    assert tab.evaluate(titles) == TITLES
    assert tab.evaluate("document.title") == " / ".join(TITLES)
    assert min(tab.evaluate(COLORED)) > 50
    assert tab.evaluate("document.querySelectorAll('.chart canvas').length") == 3
    assert not tab.evaluate("document.getElementById('live').checkVisibility()")
    assert tab.evaluate("document.getElementById('facts').textContent").endswith(
        f"seed 3 \u00b7 flockesc-env {version('flockesc-env')}"
    )
    assert [url.partition("#")[0] for url in requests] == [file]


def test_space_plays_and_stops_and_playback_stops_at_the_end(tab: Page, file: str) -> None:
    open_page(tab, file)
    assert tab.evaluate("[page.player.time, page.player.isPlaying]") == [0, False]
    tab.keyboard.press(" ")
    wait(tab, "page.player.time > 0.2")
    tab.keyboard.press(" ")
    stopped = tab.evaluate("page.player.time")
    tab.evaluate("new Promise((done) => setTimeout(done, 100))")
    assert tab.evaluate("page.player.time") == stopped
    tab.evaluate("page.player.seek(3.8)")
    tab.evaluate("document.getElementById('play').click()")
    wait(tab, "!page.player.isPlaying")
    assert tab.evaluate("page.player.time") == 4.0
    assert tab.evaluate("document.getElementById('time').textContent") == "4.00 of 4 s"


CURSORS = """[...document.querySelectorAll(".chart .u-over")].map((plot) => {
    const [box, now] = [plot, plot.querySelector(".now")].map((part) => part.getBoundingClientRect());
    return (now.left - box.left) / box.width;
})"""


def test_scrubbing_moves_the_cursor_the_flock_and_the_numbers(tab: Page, file: str) -> None:
    open_page(tab, file)
    before = tab.evaluate("page.panels[0].canvas.toDataURL()")
    tab.evaluate(
        "Object.assign(document.getElementById('scrub'), { value: 3 }).dispatchEvent(new Event('input'))"
    )
    assert tab.evaluate(CURSORS) == pytest.approx([0.75] * 3, abs=0.01)
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before
    run = built_in("fixed:15").record(3, FLOCK)
    expected = [
        f"{run.mean_distance[60]:.1f} m",
        f"{run.min_distance[60]:.1f} m",
        f"{run.mean_distance[:61].min():.1f} m",
        f"{run.num_components[60]}",
        "15.0 m",
    ]
    shown = "[...page.panels[0].root.querySelectorAll('div:not([hidden]) > dd')].map((dd) => dd.textContent)"
    assert tab.evaluate(shown) == expected


def test_neighbors_are_the_pairs_within_range(tab: Page, file: str) -> None:
    open_page(tab, f"{file}#t=2")
    for index, spec in enumerate(SPECS):
        run = built_in(spec).record(3, FLOCK)
        positions, ranges = run.positions[40], run.interaction_ranges[40]
        pairs = {
            (i, j)
            for i in range(40)
            for j in range(i)
            if ((positions[i] - positions[j]) ** 2).sum() ** 0.5
            <= max(ranges[i % len(ranges)], ranges[j % len(ranges)])
        }
        shown = tab.evaluate(f"neighborPairs(page.runs[{index}], 40, 1e6)")
        drawn = zip(shown[::2], shown[1::2], strict=True)
        assert {(max(pair), min(pair)) for pair in drawn} == pairs


def test_names_are_text(tab: Page, tmp_path: Path) -> None:
    name = "<!--<script></script><img src=x onerror='window.hacked = 1'><script>window.hacked = 1</script>"
    write_page([(name, built_in("fixed:5").record(3, FLOCK))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert tab.evaluate("document.querySelector('.panel h2').textContent") == name
    assert tab.evaluate("document.title") == name
    assert tab.evaluate("[typeof window.hacked, document.images.length]") == ["undefined", 0]
