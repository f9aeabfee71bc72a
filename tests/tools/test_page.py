"""The page in a browser: its first screen, pointer and keyboard, and links."""

import gzip
import html
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from page_browser import (
    BEST,
    COLORED,
    DUEL,
    OBJECTIVES,
    READY,
    SEED,
    STATE,
    lowest,
    needs_browser,
    scenario,
    set_range,
    text,
    wait,
)
from playwright.sync_api import Browser, Page

import flockesc_env as fe
from flockesc_env import tasks
from flockesc_env.watch.live import RANGES
from playground.__main__ import FIRST, HEADLINE

pytestmark = needs_browser


SHOWN = """["canvas", ".panel:last-of-type canvas", "#range", "#play", "#answer table"].map(
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
    tab.evaluate(f"""(() => {{
        document.getElementById("range").value = page.choice.ranges.indexOf({rho});
        document.getElementById("range").dispatchEvent(new Event("input"));
    }})()""")
    assert tab.evaluate("page.look.asking.range") == rho
    tab.click("#fly")
    wait(tab, "page.player.isPlaying")


ROWS = """[...document.querySelectorAll("#answer tbody th")].map((cell) => cell.textContent)"""


def test_a_guess_flies_until_no_ring_changes(tab: Page, playground: str) -> None:
    tab.goto(playground)
    tab.evaluate(READY)
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
    assert all(each in text(tab, "#announcement") for each in told)
    tab.evaluate("location.hash = ''")  # does not ask again
    wait(tab, "page.runs[0].spec === 'fixed:12'")
    assert not tab.evaluate("page.look.asking")


def test_a_link_with_a_guess_asks_a_friend_first(tab: Page, playground: str) -> None:
    tab.goto(f"{playground}#seed={FIRST}&policies=fixed:30,{HEADLINE}&guess=30")
    tab.evaluate(READY)
    guess(tab, 4)
    assert set(tab.evaluate(ROWS)) >= {"Your range: 4 m", "Your friend's guess: 30 m"}
    assert tab.evaluate("page.link()").endswith("guess=4")


def test_the_first_flock_agrees_with_the_means() -> None:
    ranges = fe.sweep("paper-flock", RANGES, seeds=[FIRST]).min_mean_distance[:, 0]
    assert RANGES[int(ranges.argmax())] == tasks["per-agent-visible"].scales["paper-flock"].best_fixed_range
    assert lowest(fe.simulate("paper-flock", policy=HEADLINE, seed=FIRST)) > ranges.max()


def test_the_playground_is_small(playground: str) -> None:
    assert len(gzip.compress(Path(playground.removeprefix("file://")).read_bytes())) < 450_000


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
    assert tab.evaluate(STATE) == ["paper-flock", "4", None, False, ["fixed:5"]]


def test_with_reduced_motion_the_page_waits_and_shows_the_predator(tab: Page, playground: str) -> None:
    tab.emulate_media(reduced_motion="reduce")
    tab.goto(f"{playground}#policies=fixed:12")
    tab.evaluate(READY)
    assert tab.evaluate("page.player.isPlaying") is False
    x, y = tab.evaluate("page.panels[0].scene.predatorPixels(0)")[:2]
    red, green, blue, _ = tab.evaluate(f"""Array.from(page.panels[0].canvas.getContext("2d").getImageData(
        {x} * devicePixelRatio, {y} * devicePixelRatio, 1, 1).data)""")
    assert (red, green, blue) == (0xD5, 0x5E, 0x00)


def test_a_range_flies_the_whole_run_and_shows_the_present_moment(
    tab: Page, open_at: Callable[..., None]
) -> None:
    open_at(f"seed={SEED}&policies=fixed:12,{HEADLINE}")
    tab.evaluate("page.seek(5)")
    wait(tab, "page.trials.size === 2")
    ranges = [0, 2, 16, 60]
    for rho in ranges:
        set_range(tab, rho)
        run = fe.simulate("paper-flock", rho, seed=SEED)
        assert text(tab, ".lowest") == f"{run.mean_distance[:101].min():.1f} m"
        assert text(tab, ".now-value") == f"now {run.mean_distance[100]:.1f} m"
        assert f"Your range: {rho} m{lowest(run):.1f}" in text(tab, "#answer tbody")
        assert tab.evaluate("[page.player.time, page.panels[0].run.objective]") == [5, lowest(run)]
    dots = tab.evaluate("[...page.trials.values()].map(({ range, objective }) => [range, objective])")
    learned = lowest(fe.simulate("paper-flock", policy=str(BEST), seed=SEED))
    expected = fe.sweep("paper-flock", [12.0, *ranges], seeds=[SEED]).min_mean_distance[:, 0].tolist()
    assert sorted(map(str, dots)) == sorted(
        map(str, [[None, learned], *map(list, zip([12, *ranges], expected, strict=True))])
    )
    assert tab.locator("#trials .dot").count() == 5


def test_every_key_moves_the_slider_by_one_range(tab: Page, open_at: Callable[..., None]) -> None:
    open_at("policies=fixed:12")
    tab.focus("#range")
    for key, rho in (("ArrowRight", 14), ("ArrowLeft", 12)):
        tab.keyboard.press(key)
        wait(tab, f"page.panels[0].run.spec === 'fixed:{rho}'")
    ranges = "page.scenarios.map(({ ranges }) => ranges.map((each) => placeOf(each, ranges)))"
    assert all(places == [*range(len(places))] for places in tab.evaluate(ranges))


PLAYS = ("page.player.isPlaying", {" ": True, "Space": False})  # one key
TIMES = {"Home": 0, "ArrowRight": 0.05, "Shift+ArrowRight": 1.05, "ArrowLeft": 1.0, "Shift+ArrowLeft": 0}
VIEWS = {
    "+": [1.25, 0, 0, 0],
    "ArrowRight": [1.25, -30, 0, 0],
    "ArrowUp": [1.25, -30, 30, 0],
    "0": [1, 0, 0, 0],
    "-": [0.8, 0, 0, 0],
}
KEYS: list[tuple[str, str, str, dict[str, Any]]] = [
    ("", "body", *PLAYS),
    ("", "#range", *PLAYS),
    ("", "#scrub", "page.player.time", TIMES | {"End": 12}),
    ("", ".panel canvas", "[page.camera.zoomFactor, ...page.camera.shift, page.player.time]", VIEWS),
    (
        "steer=you",
        ".panel canvas",
        "page.steering.pointer",
        {"ArrowLeft": [-35, -30], "ArrowUp": [-35, -25], "Escape": None},
    ),
]


def test_keys_play_and_move_time_camera_and_predator(tab: Page, open_at: Callable[..., None]) -> None:
    for address, selector, state, keys in KEYS:
        open_at(f"policies=fixed:12&{address}")
        tab.focus(selector)
        for key, expected in keys.items():
            tab.keyboard.press(key)
            assert tab.evaluate(state) == pytest.approx(expected), key


def test_two_fingers_zoom(tab: Page, open_at: Callable[..., None]) -> None:
    open_at()
    box = tab.query_selector(".panel canvas").bounding_box()  # type: ignore[union-attr]
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    devtools = tab.context.new_cdp_session(tab)
    for kind, apart in (("touchStart", 40), ("touchMove", 60), ("touchMove", 80)):
        points = [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    devtools.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert tab.evaluate("[page.camera.zoomFactor, page.player.time]") == pytest.approx([2, 0])


def test_a_link_restores_flock_policies_agents_and_steering(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"scenario=pursuit&seed={2**64 - 1}&policies=fixed:3.5,{HEADLINE}&agents=80&steer=you")
    expected = tab.evaluate(STATE)
    assert expected == ["pursuit", str(2**64 - 1), 80, True, ["fixed:3.5", HEADLINE]]
    link = tab.evaluate("page.link()")
    open_at()
    open_at(link)
    assert tab.evaluate(STATE) == expected


@pytest.mark.parametrize(("name", "rho"), [("torus", 60), ("ring", 100), ("pursuit", 6)])
def test_a_scenario_starts_alike_from_a_link_and_from_the_list(
    name: str, rho: int, tab: Page, open_at: Callable[..., None]
) -> None:
    open_at(f"policies={','.join(DUEL)}")
    assert text(tab, ".panel:last-of-type .note") == "predator always seen"
    tab.evaluate(f"page.fly({scenario(name)})")
    assert text(tab, ".panel:last-of-type .note") == "not trained for this scenario"
    assert tab.evaluate(STATE)[4] == [f"fixed:{rho}", HEADLINE]
    open_at(f"scenario={name}")
    assert tab.evaluate(STATE)[4] == [f"fixed:{rho}"]


INVALID = {
    "scenario=nowhere&seed=18446744073709551616&agents=1&guess=101&steer=maybe&world=1": (
        r"scenario: .*nowhere\. steer: .*maybe\. agents: .* from 2 to 3000, got 1\. "
        r"guess: .* to 100, got 101\. seed: .* world: unknown entry\.",
        DUEL,
    ),
    "policies=fixed:-3": ("fixed:-3: expected a range >= 0", ["fixed:12"]),
    "policies=fixed:0x10": ("fixed:0x10: expected a range >= 0", ["fixed:12"]),
    "policies=,toString,recording:0,": (".*: this page has no such policy.*", ["fixed:12"]),
    "seed=-1": (r"seed: expected an integer from 0 to 2\^64 - 1, got -1\.", DUEL),
    "policies=fixed:1,fixed:2,fixed:3": ("policies: expected at most 2, got 3.", ["fixed:1", "fixed:2"]),
}


def test_invalid_entries_of_a_link_are_named(tab: Page, open_at: Callable[..., None]) -> None:
    for address, (message, specs) in INVALID.items():
        open_at(address)
        assert re.fullmatch(message, text(tab, "#message"))
        assert tab.evaluate(STATE) == ["paper-flock", str(FIRST), None, False, specs]
    open_at("scenario=leaders&agents=2")  # numbers that this scenario cannot have
    assert text(tab, "#message").startswith("alignment_strength: expected")
    assert tab.evaluate(STATE)[:3] == ["leaders", str(FIRST), None]
    tab.evaluate("page.seek(1)")
    assert tab.evaluate("page.panels[0].run.numAgents") == 300


def test_a_finger_grabs_the_predator_of_both_flocks(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"policies={','.join(DUEL)}")
    tab.evaluate("page.seek(1)")
    x, y = tab.evaluate("page.panels[0].scene.predatorPixels(0)")[:2]
    past = "Array.from(page.panels[1].run.positions.subarray(0, 21 * 600))"
    before = tab.evaluate(past)
    tab.hover(".panel canvas", position={"x": x, "y": y})
    tab.mouse.down()
    tab.hover(".panel canvas", position={"x": x + 60, "y": y + 20})
    wait(tab, "page.player.time > 1.3")
    assert tab.evaluate("[page.flight.isSteered, page.player.isPlaying]") == [True, True]
    assert tab.evaluate(past) == before
    tab.evaluate("page.player.pause(), page.seek(8)")
    predators = tab.evaluate("page.panels.map(({ run }) => Array.from(run.predators.subarray(320, 322)))")
    assert predators[0] == predators[1]
    assert predators[0] == pytest.approx(tab.evaluate("page.steering.pointer"), abs=3)
    tab.mouse.up()
    assert tab.evaluate("page.steering.pointer") is None
    first, second = tab.evaluate(OBJECTIVES)
    straight = [lowest(fe.simulate("paper-flock", policy=spec, seed=FIRST)) for spec in DUEL]
    cells = tab.evaluate("[...document.querySelectorAll('#answer tbody td')].map((cell) => cell.textContent)")
    reached = zip(straight, (first, second), (first, second), strict=True)
    assert cells == [f"{value:.1f}" for row in reached for value in row]
