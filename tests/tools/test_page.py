"""The page in a browser: it flies, answers pointer and keyboard, and restores links."""

import gzip
import re
import threading
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import chromium
import imageio_ffmpeg
import numpy as np
import pytest
from chromium import BEST, BOARD, COLORED, SEED, drop, fly, lowest, open_page, text, wait
from cli_runs import SMALL, Ran, policy_file
from playwright.sync_api import Page
from watch_documents import needs_engine

import flockesc_env as fe
from flockesc_env.models.records import save_run
from playground.__main__ import HEADLINE

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

BOTTOMS = """["canvas", ".ranges", "#play"].map(
    (name) => document.querySelector(name).getBoundingClientRect().bottom
)"""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (830, 900), (1440, 900)])
def test_the_flock_flies_at_once_in_the_first_screen(
    width: int, height: int, tab: Page, playground: str
) -> None:
    requests: list[str] = []
    tab.on("request", lambda request: requests.append(request.url))
    tab.set_viewport_size({"width": width, "height": height})
    tab.goto(playground)
    tab.evaluate("startedPage.then(() => {})")
    wait(tab, "page.player.time > 0.2")
    assert min(tab.evaluate(COLORED)) > 1000
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    assert max(tab.evaluate(BOTTOMS)) <= height
    before = tab.evaluate("[page.player.time, page.panels[0].canvas.toDataURL()]")
    wait(tab, f"page.player.time > {before[0]}")
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before[1]
    assert requests == [playground]


def test_the_playground_is_small(playground: str) -> None:
    assert len(gzip.compress(Path(playground.removeprefix("file://")).read_bytes())) < 500_000


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *args: object) -> None:
        pass


def test_a_page_on_a_server_reads_the_files_beside_it(tab: Page, playground: str) -> None:
    folder = Path(playground.removeprefix("file://")).parent
    spec = "one-range/search-0"
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            open_page(tab, f"http://127.0.0.1:{server.server_port}/#seed={SEED}&policies={spec}&t=12")
        finally:
            server.shutdown()
    expected = fe.simulate("paper-flock", policy="one-range/search", seed=SEED)
    assert tab.evaluate("[page.panels[0].run.spec, page.panels[0].run.objective]") == [spec, lowest(expected)]


def test_a_page_in_a_file_says_that_it_cannot_read_other_files(
    tab: Page, open_at: Callable[..., None], problems: list[str]
) -> None:
    open_at("policies=one-range/imitation-1")
    assert text(tab, "#message").startswith("this page cannot read policies/one-range/imitation-1.npz")
    assert tab.evaluate("page.panels[0].run.spec") == "fixed:12"
    problems.clear()  # the browser reports the file that it refuses to read


def slide(tab: Page, place: float) -> None:
    tab.evaluate(
        f"(() => {{ const slider = document.querySelector('.choice .ranges'); slider.value = {place};"
        " slider.dispatchEvent(new Event('input')); })()"
    )


def test_the_slider_acts_on_the_running_flock(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"seed={SEED}&policies=fixed:12")
    tab.evaluate("page.seek(5); globalThis.past = page.panels[0].run.positions.slice(0, 61 * 600)")
    schedule = np.full((240, 1), 12.0)
    # 16 m from 3 s on, then 64 m from 7 s on and, back from the end, 25 m from 1 s on.
    for start, rho in ((60, 16.0), (140, 64.0), (20, 25.0)):
        tab.evaluate(f"page.seek({start * 0.05 - 0.01})")
        slide(tab, 10 * rho**0.5)  # a square-root scale
        wait(tab, f"page.panels[0].run.spec === 'fixed:{rho:g}'")
        schedule[start:] = rho
        tab.evaluate("page.seek(11.99)")
        if start == 60:
            same = "past.every((value, at) => value === page.panels[0].run.positions[at])"
            assert tab.evaluate(same)
        tab.evaluate("page.seek(12)")
        expected = lowest(fe.simulate("paper-flock", policy=fe.ScheduledRange(schedule), seed=SEED))
        assert tab.evaluate("page.panels[0].run.objective") == expected


def test_the_keyboard_plays_and_moves_through_time(tab: Page, open_at: Callable[..., None]) -> None:
    open_at()
    tab.keyboard.press(" ")
    wait(tab, "page.player.time > 0.2")
    tab.keyboard.press(" ")
    assert not tab.evaluate("page.player.isPlaying")
    tab.focus(".choice .ranges")
    for is_playing in (True, False):
        tab.keyboard.press(" ")
        assert tab.evaluate("page.player.isPlaying") is is_playing
    tab.focus("#scrub")
    time = "page.player.time"
    for key, expected in {
        "Home": 0,
        "ArrowRight": 0.05,
        "Shift+ArrowRight": 1.05,
        "ArrowLeft": 1.0,
        "Shift+ArrowLeft": 0,
        "End": 12,
    }.items():
        tab.keyboard.press(key)
        assert tab.evaluate(time) == pytest.approx(expected), key


def test_keys_and_two_fingers_move_the_camera(tab: Page, open_at: Callable[..., None]) -> None:
    open_at()
    camera = "[page.camera.zoomFactor, ...page.camera.shift, page.player.time]"
    tab.focus(".panel canvas")
    for key, expected in {
        "+": [1.25, 0, 0, 0],
        "ArrowRight": [1.25, -30, 0, 0],
        "ArrowUp": [1.25, -30, 30, 0],
        "0": [1, 0, 0, 0],
        "-": [0.8, 0, 0, 0],
    }.items():
        tab.keyboard.press(key)
        assert tab.evaluate(camera) == pytest.approx(expected), key
    tab.keyboard.press("0")
    box = tab.query_selector(".panel canvas").bounding_box()  # type: ignore[union-attr]
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    devtools = tab.context.new_cdp_session(tab)
    for kind, apart in (("touchStart", 40), ("touchMove", 60), ("touchMove", 80)):
        points = [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    devtools.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert tab.evaluate("[page.camera.zoomFactor, page.player.time]") == pytest.approx([2, 0])


def test_reduced_motion_starts_paused(tab: Page, playground: str) -> None:
    tab.emulate_media(reduced_motion="reduce")
    tab.goto(playground)
    tab.evaluate("startedPage.then(() => {})")
    assert tab.evaluate("page.player.isPlaying") is False


STATE = """[page.flight.scenario.name, page.flight.seed, page.flight.numbers, page.flight.isSteered,
            page.panels.map(({ run }) => run.spec)]"""


OBJECTIVES = "(page.seek(page.player.duration), page.panels.map(({ run }) => run.objective))"


def test_a_link_restores_flock_policies_numbers_and_steering(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"scenario=pursuit&seed={2**64 - 1}&policies=fixed:3.5,{HEADLINE}&agents=80&noise=0.3&steer=you")
    steer = """for (let step = 0; step < 150; step++) {
        page.pointer = step < 40 ? null : [90 - step / 3, step / 2 - 20];
        page.seek((step + 1) * page.player.timeStep);
    }"""
    tab.evaluate(f"(() => {{ {steer} page.pointer = null; }})()")
    expected = tab.evaluate(OBJECTIVES)
    link = tab.evaluate("page.link()")
    open_at(link)
    assert tab.evaluate(STATE) == [
        "pursuit",
        str(2**64 - 1),
        {"agents": 80, "noise": 0.3},
        True,
        ["fixed:3.5", HEADLINE],
    ]
    assert tab.evaluate(OBJECTIVES) == expected
    open_at(re.sub("&path=.*", "", link))
    assert tab.evaluate(OBJECTIVES) != expected


@pytest.mark.parametrize(
    ("address", "message", "policies"),
    [
        ("scenario=nowhere&seed=18446744073709551616&agents=1&noise=x&steer=maybe", "", [12]),
        ("policies=fixed:-3", "fixed:-3: expected a range >= 0", [12]),
        ("policies=toString", "toString: unknown policy", [12]),
        ("policies=,recording:0,", "recording:0: unknown policy", [12]),
        ("path=%%%&seed=-1", "", [12]),
        ("policies=fixed:1,fixed:2,fixed:3,fixed:4,fixed:5", "", [1, 2, 3, 4]),  # four side by side
    ],
)
def test_invalid_entries_of_a_link_fall_back(
    address: str, message: str, policies: list[int], tab: Page, open_at: Callable[..., None]
) -> None:
    open_at(address)
    assert text(tab, "#message") == message
    assert tab.evaluate(STATE) == ["paper-flock", "242", {}, False, [f"fixed:{rho}" for rho in policies]]


def test_a_link_to_numbers_that_a_scenario_cannot_have_flies_the_scenario(
    tab: Page, open_at: Callable[..., None]
) -> None:
    open_at("scenario=leaders&agents=2")
    assert text(tab, "#message").startswith("alignment_strength: expected")
    assert tab.evaluate(STATE)[:3] == ["leaders", "242", {}]
    tab.evaluate("page.seek(1)")
    assert tab.evaluate("page.panels[0].run.numAgents") == 300


def test_predators_of_a_duel_follow_one_pointer(tab: Page, open_at: Callable[..., None]) -> None:
    open_at("steer=you")
    tab.click("#duel")
    wait(tab, "page.panels.length === 2")
    tab.hover(".panel canvas", position={"x": 200, "y": 120})
    tab.evaluate("page.seek(12)")
    predators = tab.evaluate("page.panels.map(({ run }) => Array.from(run.predators.subarray(-2)))")
    assert predators[0] == predators[1]
    assert predators[0] == pytest.approx(tab.evaluate("page.pointer"), abs=3)
    seeds = tab.evaluate("page.panels.map(({ run }) => run.seed)")
    assert seeds == ["242", "242"]
    ahead, behind = sorted(tab.evaluate(OBJECTIVES), reverse=True)
    title = tab.evaluate(f"page.panels.find(({{ run }}) => run.objective === {ahead}).run.title")
    assert text(tab, "#score").startswith(f"{title} is ahead by {ahead - behind:.1f} m")
    tab.click(".panel:last-child .close")
    assert tab.evaluate("[page.panels.length, document.getElementById('score').hidden]") == [1, True]


@pytest.fixture
def watched(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return the address of a page of `flockesc watch`: fixed, learned with memory, and recorded."""
    (tmp_path / "small.json").write_text(SMALL.replace(num_steps=40).to_json())
    specs = ["fixed:10", policy_file(tmp_path / "mine.npz"), "stubborn-witnesses"]
    page = tmp_path / "page.html"
    flags = ["--scenario", tmp_path / "small.json", "--seed", SEED, "--output", page]
    assert Ran(capsys, "watch", *specs, *flags).code == 0
    return page.as_uri()


@needs_engine
def test_the_next_flock_is_played_by_all_policies_of_the_page(tab: Page, watched: str) -> None:
    open_page(tab, watched)
    mine = fe.load_policy(watched.removeprefix("file://").replace("page.html", "mine.npz"))
    flock = SMALL.replace(num_steps=40)
    for seed in (SEED, SEED + 1):
        assert text(tab, "#outcomes") == ""
        tab.evaluate("page.seek(2)")
        runs = [fe.simulate(flock, 10.0, seed=seed), fe.simulate(flock, policy=mine, seed=seed)]
        lowest_shown = "page.panels.map(({ run }) => [run.seed, run.objective ?? null])"
        assert tab.evaluate(lowest_shown) == [*([str(seed), lowest(run)] for run in runs), [str(SEED), None]]
        assert f"fixed range 10 m {lowest(runs[0]):.1f} m" in text(tab, "#outcomes")
        notes = tab.evaluate("[...document.querySelectorAll('.note')].map((note) => note.textContent)")
        assert notes[2] == f"recorded, seed {SEED}"
        tab.click("#next")


@needs_engine
def test_a_video_that_starts_during_playback_lasts_as_long_as_the_run(
    tab: Page, watched: str, tmp_path: Path
) -> None:
    open_page(tab, watched)
    tab.evaluate("page.player.play()")
    wait(tab, "page.player.time > 0.1")
    with tab.expect_download() as download:
        tab.evaluate("document.getElementById('save-video').click()")
    download.value.save_as(tmp_path / "flock.webm")
    _, seconds = imageio_ffmpeg.count_frames_and_secs(tmp_path / "flock.webm")
    assert seconds > 0.85 * 2  # with two clocks it would last 1 s; a slow machine makes it longer


def test_a_picture_is_saved_as_png(tab: Page, open_at: Callable[..., None], tmp_path: Path) -> None:
    open_at()
    with tab.expect_download() as download:
        tab.click("#save")
    assert download.value.url.startswith("data:image/png;base64,")
    assert download.value.suggested_filename == "flock-0.00s.png"


def test_a_color_keeps_its_range(tab: Page, open_at: Callable[..., None]) -> None:
    open_at("policies=fixed:10")
    colors = "[...page.panels[0].scene.agentsByColor()].map(([color]) => color)"
    (ten,) = tab.evaluate(colors)
    fly(tab, "{}", "fixed:100")
    assert tab.evaluate(colors) != [ten]
    fly(tab, "{}", "fixed:10")
    assert tab.evaluate(colors) == [ten]


@pytest.mark.parametrize(
    ("chapter", "spec"),
    [("chapter-nobody", "fixed:0"), ("chapter-everybody", "fixed:100"), ("chapter-learned", HEADLINE)],
)
def test_chapters_fly_what_they_say(chapter: str, spec: str, tab: Page, open_at: Callable[..., None]) -> None:
    open_at("scenario=capture&seed=1&agents=20&policies=fixed:3,fixed:4")
    tab.click(f"#{chapter}")
    wait(tab, f"page.panels.length === 1 && page.panels[0].run.spec === '{spec}' && page.player.isPlaying")
    assert tab.evaluate(STATE) == ["paper-flock", "242", {}, False, [spec]]


def test_files_that_no_page_can_play_are_named(
    tab: Page, open_at: Callable[..., None], tmp_path: Path
) -> None:
    open_at("policies=fixed:3")
    save_run(fe.simulate(SMALL, 10.0, seed=1), tmp_path / "run.npz")
    files = {
        "text": (b"not a policy", "expected a policy file"),
        "cut": (BEST.read_bytes()[:-2000], "expected a policy file"),
        "run": ((tmp_path / "run.npz").read_bytes(), "expected a policy file"),
        "line": ((BOARD / "search/policies/line-0.npz").read_bytes(), "a policy for a line"),
        "rule": ((BOARD / "searched-rule/policies/per-agent-local-0.npz").read_bytes(), "runs in Python"),
    }
    for name, (content, message) in files.items():
        drop(tab, f"{name}.npz", content)
        wait(tab, f"document.getElementById('message').textContent.startsWith('{name}.npz')")
        assert message in text(tab, "#message")
    assert tab.evaluate(STATE)[4] == ["fixed:3"]


@needs_engine
def test_a_given_start_flies_with_another_range(tab: Page, tmp_path: Path) -> None:
    start = fe.simulate(SMALL, 10.0, seed=3)
    arrays = {"initial_positions": start.positions[4], "initial_velocities": start.velocities[4]}
    fe.watch.write_page([("given", fe.simulate(SMALL, 10.0, **arrays))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert text(tab, ".note") == "recorded, given start"
    slide(tab, 50)
    wait(tab, "page.panels[0].run.spec === 'fixed:25'")
    expected = lowest(fe.simulate(SMALL, 25.0, **arrays))
    assert tab.evaluate(OBJECTIVES) == [expected]
    tab.goto("about:blank")
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#scenario=capture&policies=fixed:3&t=0")
    assert tab.evaluate(STATE) == ["capture", "0", {}, False, ["fixed:3"]]
