"""The page in a browser as it opens: first screen, question, tour, accessibility, files beside it."""

import gzip
import html
import re
import threading
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import chromium
import pytest
from axe_playwright_python.sync_playwright import Axe
from chromium import BOARD, COLORED, DUEL, READY, SEED, STATE, lowest, open_page, text, wait
from playwright.sync_api import Browser, Page

import flockesc_env as fe
from playground.__main__ import FIRST, HEADLINE, RANGES

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

SHOWN = """["canvas", ".panel:last-of-type canvas", "#choice .ranges", "#play", "#score"].map(
    (name) => document.querySelector(name).getBoundingClientRect()
).map(({ top, bottom }) => [top, bottom])"""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (830, 900), (1366, 768), (1440, 900)])
def test_the_page_asks_first_and_then_flies_a_duel_in_the_first_screen(
    width: int, height: int, tab: Page, playground: str
) -> None:
    requests: list[str] = []
    tab.on("request", lambda request: requests.append(request.url))
    tab.set_viewport_size({"width": width, "height": height})
    tab.goto(playground)
    tab.evaluate(READY)
    assert not re.search(r"\d", tab.inner_text("body").partition("flockesc_env")[0])
    tab.click("#skip")
    wait(tab, "page.player.time > 0.2")
    assert tab.evaluate(STATE) == ["paper-flock", str(FIRST), {}, False, DUEL]
    assert min(tab.evaluate(COLORED)) > 1000
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    assert all(0 <= top < bottom <= height for top, bottom in tab.evaluate(SHOWN))
    before = tab.evaluate("[page.player.time, page.panels[0].canvas.toDataURL()]")
    wait(tab, f"page.player.time > {before[0]}")
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before[1]
    assert requests == [playground]


def test_a_guess_flies_and_the_next_flock_follows_the_end(tab: Page, playground: str) -> None:
    tab.goto(playground)
    tab.evaluate(READY)
    tab.fill("#guess", str(RANGES.index(40.0)))
    tab.click("#fly")
    wait(tab, "page.player.isPlaying")
    assert tab.evaluate(STATE)[4] == ["fixed:40", HEADLINE]
    assert "your range, 40 m" in text(tab, "#means")
    tab.evaluate("page.player.seek(11.9)")
    wait(tab, f"page.flight.seed !== '{FIRST}' && page.player.time > 0.1")
    assert tab.evaluate("[page.flight.seed === page.tour[1], location.hash]") == [True, ""]
    tab.click("#choice .buttons button")  # the reader's hand ends the tour
    assert tab.evaluate("page.isTouring") is False


def test_the_playground_is_small(playground: str) -> None:
    assert len(gzip.compress(Path(playground.removeprefix("file://")).read_bytes())) < 500_000


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(scheme: Any, tab: Page, playground: str) -> None:
    tab.emulate_media(color_scheme=scheme)
    tab.goto(playground)
    tab.evaluate(READY)
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


def test_links_that_follow_one_another_show_the_last_one(tab: Page, playground: str) -> None:
    """A chart draws the runs of the flock before later: none is freed."""
    tab.goto(playground)
    tab.evaluate(READY)
    links = [f"scenario=pursuit&policies=fixed:3,{HEADLINE}&seed=3", "policies=fixed:5&seed=4&t=1"]
    tab.evaluate(f"location.hash = '{links[0]}'")
    wait(tab, "page.panels.length === 2 && page.flight.seed === '3'")
    for link in (*links, *links):
        tab.evaluate(f"location.hash = '{link}'")
    wait(tab, "page.panels.length === 1 && page.flight.seed === '4'")
    tab.wait_for_timeout(300)
    assert tab.evaluate(STATE) == ["paper-flock", "4", {}, False, ["fixed:5"]]


def test_a_page_on_a_server_reads_the_files_beside_it(tab: Page, playground: str) -> None:
    folder = Path(playground.removeprefix("file://")).parent
    spec = "one-range/imitation-0"
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=folder)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            open_page(tab, f"http://127.0.0.1:{server.server_port}/#seed={SEED}&policies={spec}&t=12")
            assert tab.locator(".pick option[disabled]").count() == 0
        finally:
            server.shutdown()
    expected = fe.simulate("paper-flock", policy=str(BOARD / "imitation/policies/one-range-0.npz"), seed=SEED)
    assert tab.evaluate("[page.panels[0].run.spec, page.panels[0].run.objective]") == [spec, lowest(expected)]


def test_a_page_in_a_file_offers_only_what_it_holds(
    tab: Page, open_at: Callable[..., None], problems: list[str]
) -> None:
    open_at("policies=one-range/imitation-0")
    assert "this page cannot read policies/one-range/imitation-0.npz" in text(tab, "#message")
    assert tab.evaluate("page.panels[0].run.spec") == "fixed:12"
    assert tab.locator(".pick option[value='one-range/imitation-0']").is_disabled()
    for learner in ("search", "search-10x", "ppo", "ppo-10x"):
        assert tab.locator(f".pick option[value='per-agent-visible/{learner}-0']").is_enabled()
    problems.clear()  # the browser reports the file that it refuses to read


def test_with_reduced_motion_the_page_waits_and_shows_the_predator(tab: Page, playground: str) -> None:
    tab.emulate_media(reduced_motion="reduce")
    tab.goto(f"{playground}#policies=fixed:12")
    tab.evaluate(READY)
    assert tab.evaluate("[page.player.isPlaying, page.isTouring]") == [False, False]
    x, y = tab.evaluate("page.panels[0].scene.predatorPixels(0)")[:2]
    red, green, blue, _ = tab.evaluate(f"""Array.from(page.panels[0].canvas.getContext("2d").getImageData(
        {x} * devicePixelRatio, {y} * devicePixelRatio, 1, 1).data)""")
    assert (red, green, blue) == (0xD5, 0x5E, 0x00)
