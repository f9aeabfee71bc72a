"""The first screen of the playground: a guess, a duel, and the film for browsers that cannot fly."""

import gzip
import html
import re
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import COLORED, DUEL, READY, STATE, lowest, open_page, slide, text, wait
from playwright.sync_api import Browser, Page

import flockesc_env as fe
from flockesc_env.watch.live import RANGES
from playground.__main__ import FIRST, HEADLINE

SHOWN = """["canvas", ".panel:last-of-type canvas", "#range", "#play", "#answer table"].map(
    (name) => document.querySelector(name).getBoundingClientRect()
).map(({ top, bottom }) => [top, bottom])"""
ROWS = """[...document.querySelectorAll("#answer tbody th")].map((cell) => cell.textContent)"""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (830, 900), (1366, 768), (1440, 900)])
def test_the_page_asks_first_and_then_flies_a_duel_in_the_first_screen(
    width: int, height: int, tab: Page, playground: str
) -> None:
    requests: list[str] = []
    tab.on("request", lambda request: requests.append(request.url))
    tab.set_viewport_size({"width": width, "height": height})
    open_page(tab, playground)
    assert not re.search(r"\d", tab.inner_text("body").partition("flockesc_env")[0])
    tab.click("#skip")
    wait(tab, "page.player.time > 0.2")
    assert tab.evaluate(STATE) == ["paper-flock", str(FIRST), None, False, DUEL]
    assert min(tab.evaluate(COLORED)) > 1000
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    assert all(0 <= top < bottom <= height for top, bottom in tab.evaluate(SHOWN))
    before = tab.evaluate("[page.player.time, page.panels[0].canvas.toDataURL()]")
    wait(tab, f"page.player.time > {before[0]}")
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before[1]
    assert requests == [playground]


def guess(tab: Page, rho: float) -> None:
    """Guess a range, which no circle shows before, and fly."""
    assert tab.evaluate("[page.look.asking.range, document.getElementById('fly').disabled]") == [None, True]
    slide(tab, rho)
    assert tab.evaluate("page.look.asking.range") == rho
    tab.click("#fly")
    wait(tab, "page.player.isPlaying")


def test_a_guess_flies_until_no_ring_changes(tab: Page, playground: str) -> None:
    open_page(tab, playground)
    guess(tab, 40)
    assert tab.evaluate(STATE)[4] == ["fixed:40", HEADLINE]
    assert tab.evaluate(ROWS)[0] == "Your range: 40 m"
    wait(tab, "page.player.stop < page.player.duration")  # the rings change until 3 s before
    lows = [fe.simulate("paper-flock", policy=spec, seed=FIRST) for spec in ("fixed:40", HEADLINE)]
    stop = max(run.times[run.mean_distance.argmin()] for run in lows) + 3
    assert tab.evaluate("page.player.stop") == pytest.approx(stop)
    tab.evaluate("page.player.seek(page.player.stop - 0.1)")
    wait(tab, "!page.player.isPlaying")
    assert tab.evaluate("page.player.time") == pytest.approx(stop)
    told = [f"{title}: {lowest(run):.1f} m" for title, run in zip(tab.evaluate(ROWS)[::2], lows, strict=True)]
    assert all(each in text(tab, "#announcement") for each in [f"seed {FIRST}", *told])
    tab.evaluate("location.hash = ''")  # does not ask again
    wait(tab, "page.runs[0].spec === 'fixed:12'")
    assert not tab.evaluate("page.look.asking")


def test_a_link_with_a_guess_asks_a_friend_first(tab: Page, playground: str) -> None:
    open_page(tab, f"{playground}#seed={FIRST}&policies=fixed:30,{HEADLINE}&guess=30")
    guess(tab, 4)
    assert set(tab.evaluate(ROWS)) >= {"Your range: 4 m", "Your friend's guess: 30 m"}
    assert tab.evaluate("page.link()").endswith("guess=4")


def test_the_first_flock_agrees_with_the_means() -> None:
    ranges = fe.sweep("paper-flock", RANGES, seeds=[FIRST]).min_mean_distance[:, 0]
    scale = fe.tasks["per-agent-visible"].scales["paper-flock"]
    assert RANGES[int(ranges.argmax())] == scale.best_fixed_range
    assert lowest(fe.simulate("paper-flock", policy=HEADLINE, seed=FIRST)) > ranges.max()


def test_the_playground_is_small(playground: str) -> None:
    assert len(gzip.compress(Path(playground.removeprefix("file://")).read_bytes())) < 450_000


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(scheme: Any, tab: Page, playground: str) -> None:
    tab.emulate_media(color_scheme=scheme)
    open_page(tab, playground)
    for act in (
        "null",
        "document.getElementById('skip').click(), page.player.pause()",
        "page.inspect(page.panels[1], 3)",
        "document.querySelectorAll('details').forEach((each) => (each.open = true))",
        "page.steer(true), page.player.pause(), page.seek(12)",
    ):
        tab.evaluate(act)
        assert Axe().run(tab).response["violations"] == []


@pytest.mark.parametrize("lacks", ["JavaScript", "WebAssembly"])
def test_a_browser_that_cannot_fly_shows_the_film(lacks: str, browser: Browser, playground: str) -> None:
    with browser.new_context(java_script_enabled=lacks != "JavaScript") as context, context.new_page() as tab:
        tab.add_init_script("delete globalThis.WebAssembly")
        tab.goto(playground)
        tab.wait_for_selector("#unable", state="visible")
        assert "WebAssembly" in tab.inner_text("#unable")
        assert tab.locator("main").is_hidden()
        width = "document.querySelector('#unscripted img').naturalWidth"
        assert lacks == "JavaScript" or tab.evaluate(width) > 0


@pytest.mark.parametrize("sandbox", ["", 'sandbox="allow-scripts"'])
def test_a_page_in_a_frame_without_an_address_flies(sandbox: str, tab: Page, playground: str) -> None:
    content = html.escape(Path(playground.removeprefix("file://")).read_text("utf-8"))
    tab.set_content(f'<iframe {sandbox} width="1280" height="900" srcdoc="{content}"></iframe>')
    (frame,) = tab.frames[1:]
    frame.evaluate(READY)
    frame.click("#skip")
    frame.evaluate("page.player.pause()")
    frame.click("#next")
    frame.click("#copy")
    frame.wait_for_selector("#message:not(:empty)")
    assert frame.evaluate("[page.panels.length, location.protocol]") == [2, "about:"]
    assert frame.locator("#unable").is_hidden()


def test_with_reduced_motion_the_page_waits_and_shows_the_predator(tab: Page, playground: str) -> None:
    tab.emulate_media(reduced_motion="reduce")
    open_page(tab, f"{playground}#policies=fixed:12")
    assert tab.evaluate("page.player.isPlaying") is False
    x, y = tab.evaluate("page.panels[0].scene.predatorPixels(0)")[:2]
    color = tab.evaluate(f"""Array.from(page.panels[0].canvas.getContext("2d").getImageData(
        {x} * devicePixelRatio, {y} * devicePixelRatio, 1, 1).data)""")
    assert color[:3] == [0xD5, 0x5E, 0x00]
