"""The page in a browser: its first screen, pointer and keyboard, links, and numbers to the last digit."""

import gzip
import hashlib
import html
import json
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from cli_runs import SMALL, Cli, npz, policy_file
from playwright.sync_api import Browser, Page, sync_playwright
from watch_documents import needs_engine

import flockesc_env as fe
from flockesc_env import tasks
from flockesc_env.models import Trajectory
from flockesc_env.models.graph import neighbor_pairs
from flockesc_env.models.records import save_run
from flockesc_env.watch.live import RANGES, RULES, has_engine
from flockesc_env.watch.page import render, replay
from playground.__main__ import FIRST, HEADLINE, main, means

_NAMES = ("chromium", "chromium-browser", "google-chrome")
EXECUTABLE = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, _NAMES)), None)
MISSING = "needs Chromium: `apt-get install chromium`, or set CHROMIUM to the path of a browser"

TIMEOUT = 60  # seconds; reached only by a page that does not do what it should

_ARGUMENTS = [
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
]


READY = "startedPage.then((page) => { globalThis.page = page; })"


def open_page(tab: Page, address: str, width: int = 1280) -> None:
    tab.set_viewport_size({"width": width, "height": 900})
    tab.goto(address if "#" in address else f"{address}#t=0")
    tab.evaluate(READY)


def wait(tab: Page, condition: str) -> None:
    """Wait until a JavaScript expression is true.

    ``Page.wait_for_function`` evaluates text in the page, which the Content-Security-Policy forbids.
    """
    end = time.monotonic() + TIMEOUT
    while not tab.evaluate(condition):
        assert time.monotonic() < end, condition
        tab.wait_for_timeout(20)


ROOT = Path(__file__).parents[2]
BOARD = ROOT / "scoreboard"
BEST = BOARD / "search/policies/per-agent-visible-0.npz"
SEED = 7
COLORED = """[...document.querySelectorAll(".panel canvas")].map((canvas) => {
    // Pixels that are neither see-through nor grey: agents and the predator.
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let colored = 0;
    for (let at = 0; at < data.length; at += 4) {
        const color = data.subarray(at, at + 3);
        if (data[at + 3] > 200 && Math.max(...color) - Math.min(...color) > 60) colored++;
    }
    return colored;
})"""

DUEL = ["fixed:12", HEADLINE]
STATE = """[page.flight.scenario.name, page.flight.seed, page.flight.agents, page.flight.isSteered,
            page.panels.map(({ run }) => run.spec)]"""


def lowest(run: Trajectory) -> float:
    return float(run.mean_distance.min())


def fly(tab: Page, changes: str, spec: str) -> float:
    """Fly a policy on another flock to its end, and return the number that the page shows."""
    script = f"""(async () => {{
        page.fly({changes});
        await page.choose(page.panels[0], {json.dumps(spec)});
        page.seek(page.player.duration);
        return page.panels[0].run.objective;
    }})()"""
    return float(tab.evaluate(script))


def scenario(name: str, seed: int = SEED) -> str:
    return f"{{ scenario: page.scenarios.find(({{ name }}) => name === '{name}'), seed: '{seed}' }}"


def set_range(tab: Page, rho: float) -> None:
    """Move the slider of the first panel to a range, and wait for its flight."""
    tab.evaluate(f"""(() => {{
        const slider = document.getElementById("range");
        slider.value = page.choice.ranges.indexOf({rho});
        slider.dispatchEvent(new Event("input"));
    }})()""")
    wait(tab, f"page.panels[0].run.spec === 'fixed:{rho:g}'")


def text(tab: Page, selector: str) -> str:
    return str(tab.evaluate(f"document.querySelector('{selector}').textContent"))


def drop(tab: Page, name: str, content: bytes) -> None:
    tab.set_input_files("#file", {"name": name, "mimeType": "application/octet-stream", "buffer": content})


pytestmark = pytest.mark.skipif(EXECUTABLE is None, reason=MISSING)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=EXECUTABLE, args=_ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def problems() -> list[str]:
    """Errors and console messages of the page; empty at the end of every test."""
    return []


@pytest.fixture
def tab(browser: Browser, problems: list[str]) -> Iterator[Page]:
    with browser.new_context() as context, context.new_page() as tab:
        tab.set_default_timeout(1000 * TIMEOUT)
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda message: problems.append(message.text))
        yield tab
        tab.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    assert problems == []


@pytest.fixture(scope="module")
def playground(tmp_path_factory: pytest.TempPathFactory) -> str:
    if not has_engine():
        pytest.skip("needs the core for web pages: `make engine`")
    folder = tmp_path_factory.mktemp("playground")
    main(folder, flocks=20)
    return (folder / "index.html").as_uri()


@pytest.fixture
def open_at(tab: Page, playground: str) -> Callable[[str], None]:
    """Open the playground, paused, at an address."""

    def open_at(address: str = "") -> None:
        tab.goto("about:blank")
        open_page(tab, f"{playground}#{address}&t=0", 1440)

    return open_at


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


OBJECTIVES = "(page.seek(page.player.duration), page.panels.map(({ run }) => run.objective))"


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


@pytest.fixture
def watched(tmp_path: Path, cli: Cli) -> str:
    """Return the address of a page of `flockesc watch`: fixed, learned with memory, and recorded."""
    (tmp_path / "small.json").write_text(SMALL.replace(num_steps=40).to_json())
    specs = ["stubborn-witnesses", policy_file(tmp_path / "mine.npz"), "fixed:10"]
    page = tmp_path / "page.html"
    flags = ["--scenario", tmp_path / "small.json", "--seed", SEED, "--output", page]
    assert cli("watch", *specs, *flags).code == 0
    return page.as_uri()


@needs_engine
def test_the_next_flock_is_played_by_all_policies_of_the_page(tab: Page, watched: str) -> None:
    open_page(tab, watched)
    mine = fe.load_policy(watched.removeprefix("file://").replace("page.html", "mine.npz"))
    flock = SMALL.replace(num_steps=40)
    for seed in (SEED, SEED + 1):
        tab.evaluate("page.player.pause(), page.seek(2)")
        run = fe.simulate(flock, policy=mine, seed=seed)
        lowest_shown = "page.panels.map(({ run }) => [run.seed, run.objective ?? null])"
        assert tab.evaluate(lowest_shown) == [[str(SEED), None], [str(seed), lowest(run)]]
        assert text(tab, ".note") == f"recorded, seed {SEED}"
        tab.click("#next")


def test_files_that_no_page_can_play_are_named(
    tab: Page, open_at: Callable[..., None], tmp_path: Path
) -> None:
    """test_engine.py has the options that are refused."""
    open_at("policies=fixed:3")
    save_run(fe.simulate(SMALL, 10.0, seed=1), tmp_path / "run.npz")
    with np.load(BEST) as file:
        arrays = dict(file)
    numbers, header = arrays["parameters"], str(arrays["header"])

    flipped = bytearray(npz(**arrays))
    flipped[flipped.index(numbers.tobytes()[-64:])] ^= 1
    bounds = np.array(header.replace('"options": {', '"options": {"min_range": -5, '))
    files = {
        "cut.npz": (BEST.read_bytes()[:-2000], "expected a policy file"),
        "sum.npz": (bytes(flipped), "damaged"),
        "run.npz": ((tmp_path / "run.npz").read_bytes(), "expected a policy file"),
        "rows.npz": (npz(**arrays | {"parameters": numbers[np.newaxis]}), "expected one dimension"),
        "nan.npz": (
            npz(**arrays | {"parameters": np.full_like(numbers, np.nan)}),
            "parameters[0, 0]: expected",
        ),
        "options.npz": (npz(**arrays | {"header": bounds}), "min_range: expected a finite number"),
        "line.npz": ((BOARD / "search/policies/line-0.npz").read_bytes(), "a policy for a line"),
        "rule.npz": (
            (BOARD / "searched-rule/policies/per-agent-local-0.npz").read_bytes(),
            "runs in Python",
        ),
        "stubborn-leaders": (BEST.read_bytes(), "expected a policy file (.npz)"),
        "flock.toml": (SMALL.to_toml().encode(), "expected a policy file (.npz)"),
    }
    for name, (content, message) in files.items():
        drop(tab, name, content)
        wait(tab, f"document.getElementById('message').textContent.startsWith('{name}: ')")
        assert message in text(tab, "#message")
        if name.endswith(".npz") and name != "rule.npz":
            (tmp_path / name).write_bytes(content)
            with pytest.raises(fe.InputError):
                fe.simulate("paper-flock", policy=tmp_path / name, seed=0)
    assert tab.evaluate(STATE)[4] == ["fixed:3"]


def test_files_play_under_their_own_names(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"policies=fixed:3&seed={SEED}")
    expected = lowest(fe.simulate("paper-flock", policy=str(BEST), seed=SEED))
    for name in ("mine.npz", "stubborn-leaders.npz", "fixed:12.npz", "recording:0.npz"):
        drop(tab, name, BEST.read_bytes())
        wait(tab, f"page.panels[0].run.spec === '{name}'")
        assert tab.evaluate(OBJECTIVES) == [expected]
        assert text(tab, ".panel h2") == f"Your file {name}"
        assert tab.evaluate("page.panels[0].select.selectedOptions[0].textContent") == f"Your file {name}"
        tab.click("#copy")
        wait(tab, f"document.getElementById('message').textContent.includes('{name}')")


@needs_engine
def test_a_given_start_flies_with_another_range(tab: Page, tmp_path: Path) -> None:
    start = fe.simulate(SMALL, 10.0, seed=3)
    arrays = {"initial_positions": start.positions[4], "initial_velocities": start.velocities[4]}
    fe.watch.write_page([("given", fe.simulate(SMALL, 10.0, **arrays))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert text(tab, ".note") == "recorded, given start"
    assert tab.get_attribute("#range", "aria-valuetext") == "each agent decides"
    set_range(tab, 25)
    expected = lowest(fe.simulate(SMALL, 25.0, **arrays))
    assert tab.evaluate(OBJECTIVES) == [expected]
    tab.goto("about:blank")
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#scenario=capture&policies=fixed:3&t=0")
    assert tab.evaluate(STATE) == ["capture", "0", None, False, ["fixed:3"]]


def test_ranges_rules_and_files_keep_the_distance_that_they_keep_in_python(
    tab: Page, open_at: Callable[..., None]
) -> None:
    """test_engine.py plays every preset and file."""
    open_at("policies=fixed:12")
    run = fe.simulate("capture", 12.0, seed=SEED)
    assert fly(tab, scenario("capture"), "fixed:12") == lowest(run)
    assert text(tab, ".lowest") == f"{lowest(run):.1f} m"
    for name in ("capture", "topological"):
        for rule in RULES:
            played = fe.simulate(name, policy=rule, seed=SEED)
            assert fly(tab, scenario(name), rule) == lowest(played), (name, rule)


@pytest.mark.parametrize(
    "address", ["agents=50&policies=stubborn-leaders", f"scenario=capture&policies={HEADLINE}"]
)
def test_the_code_plays_the_same_flock_in_python(
    address: str, tab: Page, open_at: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    open_at(f"{address}&seed={SEED}")
    tab.click("#more summary")
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
    task, measured = tasks["per-agent-visible"], means(12, 20)
    best = measured["fixed"][RANGES.index(12)]
    assert task.scales["paper-flock"].best_fixed_range == 12
    fixed = fe.sweep("paper-flock", [12.0], seeds=task.seeds[:20]).min_mean_distance
    assert best["mean"] == fixed.mean()
    for each in (best, measured["learned"]):
        assert f"{each['mean']:.1f}" in text(tab, "#answer")


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
    tab.focus(".panel canvas")
    for key, other in (("n", agent + 1), ("Shift+N", agent)):
        tab.keyboard.press(key)
        assert tab.evaluate("page.look.chosen.agent") == other
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


CURSOR = """(() => {
    const boxOf = (name) => document.querySelector(name).getBoundingClientRect();
    const [box, now] = [boxOf(".chart"), boxOf(".chart .now")];
    return (now.left - box.left) / box.width;
})()"""


def test_without_the_engine_a_page_replays(tab: Page, tmp_path: Path) -> None:
    """Scrubbing moves the flock, the cursor of the chart, and the numbers."""
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
    assert tab.evaluate(CURSOR) == pytest.approx(0.75, abs=0.01)
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before
    distances = runs[0][1].mean_distance
    shown = "['now', 'lowest', 'listening'].map((name) => page.panels[0][name].textContent)"
    numbers = [f"now {distances[60]:.1f} m", f"{distances[:61].min():.1f} m"]
    assert tab.evaluate(shown) == [*numbers, "all listen to 15 m"]
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
