"""The watch page in a browser: playback, scrubbing, and runs that a server plays again."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Iterator
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


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    script = f"""
        from flockesc_env import FlockScenario
        from flockesc_env.policies.registry import built_in
        from flockesc_env.watch import serve

        flock = FlockScenario(num_agents=40, num_steps=80)
        runs = [(name, built_in(name).record(3, flock)) for name in {SPECS}]
        runs.append(("mine.npz", built_in("random").record(3, flock)))
        serve(runs, scenario=flock, seed=3, open_browser=False)
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603
        assert process.stdout is not None
        yield process.stdout.readline().split()[2]
        process.kill()


SLIDE = "Object.assign(page.live.controls[0].slider, {{ value: {} }}).dispatchEvent(new Event('input'))"


def test_the_slider_runs_the_flock_again(tab: Page, address: str) -> None:
    open_page(tab, f"{address}#t=1.5")
    assert tab.evaluate("document.getElementById('live').checkVisibility()")
    curves = "page.curves.charts[0].data.map((column) => Array.from(column))"
    before = tab.evaluate(curves)
    for value in (12, 40, 3, 8.5):
        tab.evaluate(SLIDE.format(value))
    wait(tab, "page.runs[0].name === 'fixed:8.5'")
    after = tab.evaluate(curves)
    run = built_in("fixed:8.5").record(3, FLOCK)
    assert after[3] == pytest.approx(run.mean_distance.tolist(), rel=1e-6)  # time, lowest mean, minimum, mean
    assert after[3] != before[3]
    assert after[4:] == before[4:]  # the other panels do not change
    assert tab.evaluate("page.player.time") == 1.5
    assert tab.evaluate("document.querySelector('.panel h2').textContent") == "fixed range 8.5 m"


def test_another_policy_and_another_flock(tab: Page, address: str) -> None:
    open_page(tab, address)
    select = (
        "Object.assign(page.live.controls[{}].select, {{ value: '{}' }}).dispatchEvent(new Event('change'))"
    )
    assert tab.evaluate("page.live.controls.map(({ select }) => select.value)") == ["fixed:RHO", SPECS[1], ""]
    tab.evaluate(select.format(2, "stubborn-leaders-local"))
    wait(tab, "page.runs[2].name === 'stubborn-leaders-local'")
    tab.evaluate("document.getElementById('next-seed').click()")
    wait(tab, "page.runs.every(({ seed }) => seed === '4')")
    for index, spec in enumerate((*SPECS, "stubborn-leaders-local")):
        expected = built_in(spec).record(4, FLOCK).mean_distance.min()
        assert tab.evaluate(f"page.runs[{index}].lowestMean.at(-1)") == pytest.approx(expected, rel=1e-6)
    tab.evaluate(select.format(2, ""))
    assert tab.evaluate("[page.runs[2].name, page.runs[2].seed]") == ["mine.npz", "3"]
    assert tab.evaluate("[...document.querySelectorAll('.panel .note')].map((note) => note.textContent)") == [
        "",
        "",
        "seed 3",
    ]
    assert "seed 4" in tab.evaluate("document.getElementById('facts').textContent")
