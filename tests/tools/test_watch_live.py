"""A served watch page in a browser: its controls run flocks again."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Iterator

import chromium
import pytest
from chromium import open_page, wait
from playwright.sync_api import Page

from flockesc_env import FlockScenario
from flockesc_env.policies.registry import built_in

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

FLOCK = FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")


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
