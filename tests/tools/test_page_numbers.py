"""The numbers of the page in a browser are Python's, to the last digit, also those of recorded runs."""

import hashlib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from chromium import BEST, COLORED, ROOT, SEED, fly, lowest, open_page, scenario, text, wait
from cli_runs import SMALL
from playwright.sync_api import Page

import flockesc_env as fe
from flockesc_env import tasks
from flockesc_env.models.graph import neighbor_pairs
from flockesc_env.watch.live import RULES
from flockesc_env.watch.page import render, replay
from playground.__main__ import HEADLINE, RANGES, means

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)


def test_ranges_rules_and_files_keep_the_distance_that_they_keep_in_python(
    tab: Page, open_at: Callable[..., None]
) -> None:
    """test_engine.py plays every preset and file."""
    open_at("policies=fixed:12")
    run = fe.simulate("capture", 12.0, seed=SEED)
    assert fly(tab, scenario("capture"), "fixed:12") == lowest(run)
    assert text(tab, ".readout div:nth-child(2) dd") == f"{lowest(run):.1f} m"
    tab.evaluate("page.panels[0].run.countComponents()")
    counts = tab.evaluate("Array.from(page.panels[0].run.numComponents.subarray(0, 241))")
    assert counts == list(run.num_components)
    for name in ("capture", "topological"):
        for rule in RULES:
            played = fe.simulate(name, policy=rule, seed=SEED)
            assert fly(tab, scenario(name), rule) == lowest(played), (name, rule)


@pytest.mark.parametrize(
    "address", ["agents=50&noise=0.25&policies=stubborn-leaders", f"scenario=capture&policies={HEADLINE}"]
)
def test_the_code_plays_the_same_flock_in_python(
    address: str, tab: Page, open_at: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    open_at(f"{address}&seed={SEED}")
    tab.click("#python summary")
    wait(tab, "document.getElementById('code').textContent.includes('#')")
    code, printed = text(tab, "#code").split("  # ")
    monkeypatch.chdir(ROOT)
    names: dict[str, Any] = {"print": lambda value: names.update(value=value)}
    exec(code, names)  # noqa: S102, the code that the page offers
    assert names["value"] == float(printed)
    tab.evaluate("page.seek(page.player.duration)")
    assert tab.evaluate("page.panels[0].run.objective") == names["value"]
    checksum = hashlib.sha256(BEST.read_bytes()).hexdigest()
    assert (checksum in text(tab, "#code-note")) == (HEADLINE in address)


def test_the_means_are_those_of_the_held_out_flocks_of_the_task(
    tab: Page, open_at: Callable[..., None]
) -> None:
    open_at()
    task, measured = tasks["per-agent-visible"], means(20)
    best = measured["fixed"][RANGES.index(12.0)]
    assert task.scales["paper-flock"].best_fixed_range == 12
    fixed = fe.sweep("paper-flock", [12.0], seeds=task.seeds[:20]).min_mean_distance
    assert best["mean"] == fixed.mean()
    for each in (best, measured["learned"]):
        estimate = f"{each['mean']:.1f} m [{each['low']:.1f}, {each['high']:.1f}]"
        assert estimate in text(tab, "#means")


def test_a_click_shows_whom_an_agent_hears_and_what_it_observes(
    tab: Page, open_at: Callable[..., None]
) -> None:
    name = "field-of-view"
    open_at(f"scenario={name}&seed={SEED}&policies=fixed:9")
    tab.evaluate("page.seek(5); page.seek(4)")
    run = fe.simulate(name, 9.0, seed=SEED)
    x, y = tab.evaluate("page.panels[0].scene.points.subarray(30, 32)")
    tab.click(".panel canvas", position={"x": x, "y": y})
    agent, heard = tab.evaluate("[page.look.chosen.agent, page.look.chosen.heard]")
    assert text(tab, "#agent") == f"Agent {agent} listens within 9 m"
    pairs = neighbor_pairs(run.scenario, run.positions[80], 9.0, velocities=run.velocities[80])
    assert sorted(heard) == pairs[pairs[:, 0] == agent, 1].tolist()
    for step in (60, 100):
        tab.evaluate(f"page.seek({step} * page.player.timeStep)")
        shown = tab.evaluate("""Object.fromEntries([...document.querySelectorAll("#agent-entries div")].map(
            (row) => [...row.children].map((part) => part.textContent)))""")
        before = run.positions[step - 1], run.velocities[step - 1]
        pairs = neighbor_pairs(run.scenario, before[0], 9.0, velocities=before[1])
        way = run.predator_positions[step, 0] - run.positions[step, agent]
        others = pairs[pairs[:, 0] == agent, 1]
        assert (
            shown.items()
            >= {
                "time": f"{run.times[step]:.2f} s",
                "lowest mean distance so far": f"{run.mean_distance[: step + 1].min():.1f} m",
                "heard in the last step": f"{len(others)} agents",
                "distance to the predator": f"{np.linalg.norm(way):.1f} m",
            }.items()
        )


FLOCK = fe.FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")
TITLES = ["fixed range 15 m", "rule: stubborn leaders"]


CURSORS = """[...document.querySelectorAll(".chart .u-over")].map((plot) => {
    const [box, now] = [plot, plot.querySelector(".now")].map((part) => part.getBoundingClientRect());
    return (now.left - box.left) / box.width;
})"""


def test_without_the_engine_a_page_replays(tab: Page, tmp_path: Path) -> None:
    """Scrubbing moves the flock, the cursors of three charts, and the numbers."""
    runs = [(spec, fe.simulate(FLOCK, policy=spec, seed=3)) for spec in SPECS]
    (tmp_path / "page.html").write_text(render(runs, replay(runs), with_engine=False))
    open_page(tab, (tmp_path / "page.html").as_uri())
    titles = "[...document.querySelectorAll('.panel h2')].map((title) => title.textContent)"
    assert tab.evaluate(titles) == TITLES
    assert tab.evaluate("document.title") == " / ".join(TITLES)
    assert min(tab.evaluate(COLORED)) > 50
    live = "[...document.querySelectorAll('.live')].some((part) => part.checkVisibility())"
    assert tab.evaluate(live) is False
    assert text(tab, "#facts").endswith(f"seed 3 \u00b7 flockesc-env {version('flockesc-env')}")
    before = tab.evaluate("page.panels[0].canvas.toDataURL()")
    tab.fill("#scrub", "3")
    assert tab.evaluate(CURSORS) == pytest.approx([0.75] * 3, abs=0.01)
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before
    distances = runs[0][1].mean_distance
    shown = "[...page.panels[0].root.querySelectorAll('div:not([hidden]) > dd')].map((dd) => dd.textContent)"
    assert tab.evaluate(shown) == [f"{distances[60]:.1f} m", f"{distances[:61].min():.1f} m"]
    tab.evaluate("page.seek(3.8); page.player.play()")
    wait(tab, "!page.player.isPlaying")
    assert text(tab, "#time") == "4.0 of 4 s"


def test_names_are_text(tab: Page, tmp_path: Path) -> None:
    hack = "<img src=x onerror='window.hacked = 1'><script>window.hacked = 1</script>"
    name = f"</script><!--<script></script>{hack}&amp;$title ${{data}}"
    fe.watch.write_page([(name, fe.simulate(SMALL, 5.0, seed=3))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert text(tab, ".panel h2") == name
    assert tab.evaluate("document.title") == name
    assert tab.evaluate("[typeof window.hacked, document.images.length]") == ["undefined", 0]
