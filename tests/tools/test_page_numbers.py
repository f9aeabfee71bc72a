"""The numbers of the page in a browser are Python's, to the last digit, also those of recorded runs."""

import hashlib
import json
import math
import re
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from chromium import BEST, COLORED, ROOT, SEED, drop, fly, lowest, open_page, scenario, text, wait
from cli_runs import SMALL
from playwright.sync_api import Page

import flockesc_env as fe
from flockesc_env.models.graph import neighbor_pairs
from flockesc_env.watch.live import RULES
from flockesc_env.watch.page import render, replay
from playground.__main__ import HEADLINE

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)


def test_ranges_rules_and_files_keep_the_distance_that_they_keep_in_python(
    tab: Page, open_at: Callable[..., None]
) -> None:
    """test_engine.py plays every preset and file."""
    open_at()
    run = fe.simulate("capture", 12.0, seed=SEED)
    assert fly(tab, scenario("capture"), "fixed:12") == lowest(run)
    assert text(tab, ".objective dd") == f"{lowest(run):.1f} m"
    tab.evaluate("page.panels[0].run.countComponents()")
    counts = tab.evaluate("Array.from(page.panels[0].run.numComponents.subarray(0, 241))")
    assert counts == list(run.num_components)
    for rule in RULES:
        assert fly(tab, scenario("capture"), rule) == lowest(
            fe.simulate("capture", policy=rule, seed=SEED)
        ), rule
    tab.evaluate(f"page.fly({scenario('topological')})")
    assert "listen to a number of neighbors" in text(tab, "#message")
    assert tab.evaluate("page.panels.map(({ run }) => run.kind)") == ["fixed"]
    open_at(f"seed={SEED}&policies=fixed:0")
    tab.evaluate("page.seek(0)")
    drop(tab, "learned.npz", BEST.read_bytes())
    wait(tab, "page.panels[0].run.spec === 'learned'")
    tab.evaluate("page.seek(12)")
    assert tab.evaluate("page.panels[0].run.objective") == lowest(
        fe.simulate("paper-flock", policy=str(BEST), seed=SEED)
    )


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


def test_the_numbers_in_the_texts_of_the_playground() -> None:
    seeds = range(300)
    fixed = fe.sweep("paper-flock", [0.0, 12.0, 100.0], seeds=seeds).min_mean_distance
    learned = fe.rollout("paper-flock", str(BEST), seeds).min_mean_distance
    kept = np.vstack([fixed, learned])
    chapters, predict = (
        (ROOT / "playground" / f"{name}.html").read_text("utf-8") for name in ("chapters", "predict")
    )
    note = chapters.partition('id="chosen-note"')[2]
    said = [float(number) for number in re.findall(r"\d+\.\d", note)]
    assert said == [*kept[:, 242].round(1), *kept.mean(axis=1).round(1)]
    assert re.findall(r"keeps ([\d.]+) m on average over (\d+) flocks", predict) == [
        (f"{learned.mean():.1f}", "300")
    ]


def test_the_chapters_say_what_their_flocks_do() -> None:
    everybody, learned = fe.simulate("paper-flock", 100.0, seed=242), fe.simulate(policy=str(BEST), seed=242)
    assert everybody.polarization[10] > 0.99  # one heading after half a second
    to_predator = learned.predator_positions[:60] - learned.positions[:60]  # the first 3 s
    cosine = np.sum(to_predator * learned.velocities[:60], axis=-1)
    cosine /= np.linalg.norm(to_predator, axis=-1) * np.linalg.norm(learned.velocities[:60], axis=-1)
    angle, ranges = np.degrees(np.arccos(cosine)), learned.interaction_ranges[:60]
    toward, past = ranges[angle < 60].mean(), ranges[(angle >= 90) & (angle < 135)].mean()
    said = re.findall(r"within (\d+\.\d) m", (ROOT / "playground" / "chapters.html").read_text("utf-8"))
    assert said == [f"{toward:.1f}", f"{past:.1f}"]


def test_the_answer_is_the_published_curve_and_flocks_of_the_page(
    tab: Page, open_at: Callable[..., None]
) -> None:
    open_at()
    tab.fill("#guess", "32")  # 10 m on the square-root scale
    tab.click("#predict-show")
    results = json.loads((ROOT / "results" / "robustness" / "results.json").read_text("utf-8"))
    (entry,) = (entry for entry in results["presets"] if entry["name"] == "paper-flock")
    curve = dict(zip(entry["grid"]["actions"], entry["outcomes"]["J_mean"]["curve"], strict=True))
    wait(tab, "page.controls.prediction.total - page.controls.prediction.jobs.length > 12")
    said = text(tab, "#predict-text")
    for rho in (10, 12):
        assert f"{rho} m: {curve[rho]['mean']:.1f} m" in said
    assert f"over {results['num_flocks']} flocks" in said
    assert tab.evaluate("page.controls.prediction.means()") == [None] * 12  # a few flocks say little
    tab.evaluate("page.controls.prediction.jobs = page.controls.prediction.jobs.filter(([at]) => at === 1)")
    wait(tab, "page.controls.prediction.means()[1] !== null")
    expected = np.mean([lowest(fe.simulate("paper-flock", 2.0, seed=seed)) for seed in range(16)])
    assert tab.evaluate("page.controls.prediction.means()[1]") == pytest.approx(expected)


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
    assert text(tab, "#agent") == f"Agent {agent}"
    pairs = neighbor_pairs(run.scenario, run.positions[80], 9.0, velocities=run.velocities[80])
    assert sorted(heard) == pairs[pairs[:, 0] == agent, 1].tolist()
    env = fe.parallel_env(
        name, action_mode="range", max_range=100.0, predator_sensing_range=math.inf, steps_per_action=1
    )
    rows = [env.reset_array(seed=SEED)[0]]
    rows += [env.step_array(np.full((300, 1), 9.0, np.float32))[0] for _ in range(100)]
    for step in (80, 95, 60, 100):
        tab.evaluate(f"page.seek({step} * page.player.timeStep)")
        shown = tab.evaluate(
            "[...document.querySelectorAll('#agent-entries dd')].map((value) => Number(value.textContent))"
        )
        assert shown == [round(float(value), 3) for value in rows[step][agent]]


FLOCK = fe.FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")
TITLES = ["fixed range 15 m", "rule: stubborn leaders"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("pages") / "page.html"
    runs = [(spec, fe.simulate(FLOCK, policy=spec, seed=3)) for spec in SPECS]
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
    run = fe.simulate(FLOCK, policy="fixed:15", seed=3)
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
