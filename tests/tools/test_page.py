"""The page in a browser: it answers pointer and keyboard, and restores links."""

import re
from collections.abc import Callable
from pathlib import Path

import chromium
import numpy as np
import pytest
from chromium import BEST, BOARD, DUEL, SEED, STATE, drop, lowest, open_page, set_range, text, wait
from cli_runs import SMALL, Ran, policy_file
from playwright.sync_api import Page
from watch_documents import needs_engine

import flockesc_env as fe
from flockesc_env.models.records import save_run
from playground.__main__ import FIRST, HEADLINE

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

OBJECTIVES = "(page.seek(page.player.duration), page.panels.map(({ run }) => run.objective))"


def test_a_range_flies_the_whole_run_and_shows_the_present_moment(
    tab: Page, open_at: Callable[..., None]
) -> None:
    open_at(f"seed={SEED}&policies=fixed:12,{HEADLINE}")
    tab.evaluate("page.seek(5)")
    wait(tab, "page.trials.size === 2")
    ranges = [0, 2.5, 16, 64]
    for rho in ranges:
        set_range(tab, rho)
        run = fe.simulate("paper-flock", rho, seed=SEED)
        assert text(tab, ".whole") == f"{lowest(run):.1f} m"
        assert text(tab, ".readout dd") == f"{run.mean_distance[100]:.1f} m"
        assert tab.evaluate("[page.player.time, page.panels[0].run.objective]") == [5, lowest(run)]
    dots = tab.evaluate("[...page.trials.values()].map(({ range, objective }) => [range, objective])")
    learned = lowest(fe.simulate("paper-flock", policy=str(BEST), seed=SEED))
    expected = fe.sweep("paper-flock", [12.0, *ranges], seeds=[SEED]).min_mean_distance[:, 0].tolist()
    assert sorted(map(str, dots)) == sorted(
        map(str, [[None, learned], *map(list, zip([12, *ranges], expected, strict=True))])
    )
    assert tab.locator(".trials circle").count() == 5


def test_every_key_moves_the_slider_by_one_range(tab: Page, open_at: Callable[..., None]) -> None:
    open_at("policies=fixed:12")
    tab.focus("#choice .ranges")
    for key, rho in (("ArrowRight", 12.5), ("ArrowLeft", 12)):
        tab.keyboard.press(key)
        wait(tab, f"page.panels[0].run.spec === 'fixed:{rho:g}'")
    for unit, largest in (("m", 100), ("neighbors", 299)):
        ranges = tab.evaluate(f"rangesUpTo({largest}, '{unit}')")
        assert (ranges[0], ranges[-1]) == (0, largest)
        assert (np.diff(ranges) > 0).all()
        assert tab.evaluate(f"rangesUpTo({largest}, '{unit}').map((each, _, all) => placeOf(each, all))") == [
            *range(len(ranges))
        ]
    assert all(isinstance(number, int) for number in ranges)  # of neighbors


def test_the_keyboard_plays_and_moves_through_time(tab: Page, open_at: Callable[..., None]) -> None:
    open_at()
    tab.keyboard.press(" ")
    wait(tab, "page.player.time > 0.2")
    tab.keyboard.press(" ")
    assert not tab.evaluate("page.player.isPlaying")
    tab.focus("#choice .ranges")
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


def test_a_link_restores_flock_policies_numbers_and_steering(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"scenario=pursuit&seed={2**64 - 1}&policies=fixed:3.5,{HEADLINE}&agents=80&noise=0.3&steer=you")
    steer = """for (let step = 0; step < 150; step++) {
        page.steering.pointer = step < 40 ? null : [90 - step / 3, step / 2 - 20];
        page.seek((step + 1) * page.player.timeStep);
    }"""
    tab.evaluate(f"(() => {{ {steer} page.steering.pointer = null; }})()")
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


INVALID = {
    "scenario=nowhere&seed=18446744073709551616&agents=1&noise=x&speed=&steer=maybe&world=1": (
        r"scenario: .*nowhere\. steer: .*maybe\. agents: .* from 2 to 3000, got 1\. noise: .*x\. "
        r"speed: .* seed: .* world: unknown entry\.",
        DUEL,
    ),
    "policies=fixed:-3": ("fixed:-3: expected a range >= 0", ["fixed:12"]),
    "policies=fixed:0x10": ("fixed:0x10: expected a range >= 0", ["fixed:12"]),
    "policies=,toString,recording:0,": (".*: this page has no such policy.*", ["fixed:12"]),
    "path=%%%&seed=-1": (r"seed: expected an integer from 0 to 2\^64 - 1, got -1\.", DUEL),
    "policies=fixed:1,fixed:2,fixed:3,fixed:4,fixed:5": (
        "policies: expected at most 4, got 5.",
        [f"fixed:{each}" for each in (1, 2, 3, 4)],
    ),
}


def test_invalid_entries_of_a_link_are_named(tab: Page, open_at: Callable[..., None]) -> None:
    for address, (message, specs) in INVALID.items():
        open_at(address)
        assert re.fullmatch(message, text(tab, "#message"))
        assert tab.evaluate(STATE) == ["paper-flock", "242", {}, False, specs]
    open_at("scenario=leaders&agents=2")  # numbers that this scenario cannot have
    assert text(tab, "#message").startswith("alignment_strength: expected")
    assert tab.evaluate(STATE)[:3] == ["leaders", "242", {}]
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
    straight = lowest(fe.simulate("paper-flock", 12.0, seed=FIRST))
    reached = rf"than {straight:.1f} m .* You: {first:.1f} m. Best try: {first:.1f} m"
    assert re.search(reached, text(tab, "#aim"))
    assert text(tab, "#score").startswith(f"+{second - first:.1f} mlearned is ahead of")
    assert tab.locator("#challenge").is_visible()
    tab.click(".panel:last-of-type .close")
    assert tab.evaluate("[page.panels.length, document.getElementById('score').hidden]") == [1, True]


def test_arrows_lead_the_predator(tab: Page, open_at: Callable[..., None]) -> None:
    open_at("steer=you&policies=fixed:12")
    tab.focus(".panel canvas")
    tab.keyboard.press("ArrowLeft")
    tab.keyboard.press("ArrowUp")
    assert tab.evaluate("page.steering.pointer") == [-35, -25]
    tab.evaluate("page.seek(3)")
    assert tab.evaluate("Array.from(page.panels[0].run.predators.subarray(120, 122))") != [0, 0]
    tab.keyboard.press("Escape")
    assert tab.evaluate("page.steering.pointer") is None


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
        tab.evaluate("page.player.pause(), page.seek(2)")
        runs = [fe.simulate(flock, 10.0, seed=seed), fe.simulate(flock, policy=mine, seed=seed)]
        lowest_shown = "page.panels.map(({ run }) => [run.seed, run.objective ?? null])"
        assert tab.evaluate(lowest_shown) == [*([str(seed), lowest(run)] for run in runs), [str(SEED), None]]
        notes = tab.evaluate("[...document.querySelectorAll('.note')].map((note) => note.textContent)")
        assert notes[2] == f"recorded, seed {SEED}"
        tab.click("#next")
    # Nobody is ahead between flocks of different seeds.
    tab.evaluate("page.removePanel(page.panels[0])")
    assert tab.evaluate("[page.panels.length, document.getElementById('score').hidden]") == [2, True]


def test_files_that_no_page_can_play_are_named(
    tab: Page, open_at: Callable[..., None], tmp_path: Path
) -> None:
    """test_engine.py has the options that are refused."""
    open_at("policies=fixed:3")
    save_run(fe.simulate(SMALL, 10.0, seed=1), tmp_path / "run.npz")
    with np.load(BEST) as file:
        arrays = dict(file)
    numbers, header = arrays["parameters"], str(arrays["header"])
    bad = {
        "rows": {"parameters": numbers[np.newaxis]},
        "nan": {"parameters": np.full_like(numbers, np.nan)},
        "options": {"header": np.array(header.replace('"options": {', '"options": {"min_range": -5, '))},
    }
    for name, changes in bad.items():
        np.savez(tmp_path / f"{name}.npz", **{**arrays, **changes})
    np.savez(tmp_path / "sum.npz", **arrays)
    flipped = bytearray((tmp_path / "sum.npz").read_bytes())
    flipped[flipped.index(numbers.tobytes()[-64:])] ^= 1
    files = {
        "cut.npz": (BEST.read_bytes()[:-2000], "expected a policy file"),
        "sum.npz": (bytes(flipped), "damaged"),
        "run.npz": ((tmp_path / "run.npz").read_bytes(), "expected a policy file"),
        "rows.npz": ((tmp_path / "rows.npz").read_bytes(), "expected one dimension"),
        "nan.npz": ((tmp_path / "nan.npz").read_bytes(), "parameters[0, 0]: expected"),
        "options.npz": ((tmp_path / "options.npz").read_bytes(), "min_range: expected a finite number"),
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
        if name.endswith(".npz"):
            (tmp_path / name).write_bytes(content)
            assert name == "rule.npz" or not plays(tmp_path / name)
    assert tab.evaluate(STATE)[4] == ["fixed:3"]


def plays(path: Path) -> bool:
    try:
        fe.simulate("paper-flock", policy=path, seed=0)
    except fe.InputError:
        return False
    return True


def test_files_play_under_their_own_names(tab: Page, open_at: Callable[..., None]) -> None:
    open_at(f"policies=fixed:3&seed={SEED}")
    expected = lowest(fe.simulate("paper-flock", policy=str(BEST), seed=SEED))
    for name in ("mine.npz", "stubborn-leaders.npz", "fixed:12.npz", "recording:0.npz"):
        drop(tab, name, BEST.read_bytes())
        wait(tab, f"page.panels[0].run.spec === '{name}'")
        assert tab.evaluate(OBJECTIVES) == [expected]
        assert text(tab, ".panel h2") == f"your file {name}"
        assert tab.evaluate("page.panels[0].select.selectedOptions[0].textContent") == name
        tab.click("#copy")
        wait(tab, f"document.getElementById('message').textContent.includes('{name}')")


@needs_engine
def test_a_given_start_flies_with_another_range(tab: Page, tmp_path: Path) -> None:
    start = fe.simulate(SMALL, 10.0, seed=3)
    arrays = {"initial_positions": start.positions[4], "initial_velocities": start.velocities[4]}
    fe.watch.write_page([("given", fe.simulate(SMALL, 10.0, **arrays))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert text(tab, ".note") == "recorded, given start"
    assert text(tab, "#choice h2") == "All agents follow given"
    set_range(tab, 25)
    expected = lowest(fe.simulate(SMALL, 25.0, **arrays))
    assert tab.evaluate(OBJECTIVES) == [expected]
    tab.goto("about:blank")
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#scenario=capture&policies=fixed:3&t=0")
    assert tab.evaluate(STATE) == ["capture", "0", {}, False, ["fixed:3"]]
