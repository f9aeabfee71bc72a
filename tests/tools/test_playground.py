"""The playground in a browser: it flies at every width, restores links, and gives Python's numbers."""

from __future__ import annotations

import re
import shutil
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import product
from pathlib import Path

import chromium
import numpy as np
import pytest
from chromium import wait
from playwright.sync_api import Page

from flockesc_env import PRESETS, FlockScenario, load_policy, rollout, simulate, sweep
from playground.worlds import write

pytest_plugins = ("watch_browser",)
ROOT = Path(__file__).parents[2]
PAGE, ENGINE = ROOT / "playground", ROOT / "target" / "playground"

pytestmark = [
    pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING),
    pytest.mark.skipif(
        not (ENGINE / "flockesc_wasm.js").is_file(), reason="needs the module of `make playground`"
    ),
]


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *args: object) -> None:
        pass


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("playground")
    page = (path for path in PAGE.iterdir() if path.suffix in {".html", ".css", ".js"})
    for path in (*page, ENGINE / "flockesc_wasm.js", ENGINE / "flockesc_wasm_bg.wasm"):
        shutil.copy(path, folder)
    write(folder)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=folder)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def visit(tab: Page, address: str, width: int = 1440) -> None:
    tab.set_viewport_size({"width": width, "height": 900})
    tab.goto(address)
    wait(tab, "Boolean(window.playground)")


STEPS = "playground.run.flock.steps"
COLORED = """(() => {
    const canvas = document.getElementById("flock");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let colored = 0; // pixels of agents and the predator
    for (let at = 0; at < data.length; at += 4) {
        const color = data.subarray(at, at + 3);
        if (data[at + 3] > 200 && Math.max(...color) - Math.min(...color) > 60) colored++;
    }
    return colored;
})()"""


@pytest.mark.parametrize("width", [390, 830, 1440])
def test_the_flock_flies_at_once_and_fits_the_window(tab: Page, address: str, width: int) -> None:
    visit(tab, address, width)
    wait(tab, f"{STEPS} > 3")
    assert tab.evaluate(COLORED) > 1000
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    before = tab.evaluate("document.getElementById('flock').toDataURL()")
    wait(tab, f"{STEPS} > 6")
    assert tab.evaluate("document.getElementById('flock').toDataURL()") != before
    assert tab.evaluate("location.hash") == "#world=paper-flock&seed=242&range=12"


def test_the_page_says_the_numbers_of_its_flock_and_the_means(tab: Page, address: str) -> None:
    visit(tab, address)
    said = tab.evaluate("document.getElementById('chosen-seed').textContent")
    seeds, learned = range(300), ROOT / tab.evaluate("playground.policy.file")
    fixed = sweep("paper-flock", [0.0, 12.0, 100.0], seeds=seeds).min_mean_distance
    lowest = np.vstack([fixed, rollout("paper-flock", str(learned), seeds).min_mean_distance])
    numbers = [float(number) for number in re.findall(r"\d+\.\d", said)]
    assert numbers == [*lowest[:, 242].round(1), *lowest.mean(axis=1).round(1)]


def test_the_keyboard_pauses_steps_and_restarts(tab: Page, address: str) -> None:
    visit(tab, address)
    tab.keyboard.press(" ")
    assert not tab.evaluate("playground.isPlaying")
    before = tab.evaluate(STEPS)
    tab.wait_for_timeout(150)
    assert tab.evaluate(STEPS) == before
    tab.keyboard.press("ArrowRight")
    assert tab.evaluate(STEPS) == before + 1
    tab.keyboard.press("ArrowLeft")
    assert tab.evaluate(STEPS) == 0


def test_reduced_motion_starts_paused(tab: Page, address: str) -> None:
    tab.emulate_media(reduced_motion="reduce")
    visit(tab, address)
    tab.wait_for_timeout(150)
    assert tab.evaluate(f"[playground.isPlaying, {STEPS}]") == [False, 0]


def test_a_link_restores_the_state(tab: Page, address: str) -> None:
    visit(tab, address)
    tab.select_option("#worlds", "pursuit")
    tab.fill("#seed", "18446744073709551615")
    tab.press("#seed", "Enter")
    tab.fill("#slider", "50")
    link = tab.evaluate("location.href")
    assert link == f"{address}#world=pursuit&seed=18446744073709551615&range=25"
    tab.goto("about:blank")
    visit(tab, link)
    state = "[playground.run.world.name, playground.state.seed, playground.state.range]"
    assert tab.evaluate(state) == ["pursuit", "18446744073709551615", 25]
    tab.click("#learned")
    assert tab.evaluate("location.hash").endswith("&policy=learned")


def test_the_objective_equals_that_of_python(tab: Page, address: str) -> None:
    visit(tab, address)
    for world, rho in product(("paper-flock", "capture", "topological", "space"), (0.0, 12.0)):
        tab.evaluate(f"location.hash = 'world={world}&seed=7&range={rho:g}'")
        wait(tab, f"playground.run.world.name === '{world}' && playground.state.range === {rho}")
        assert tab.evaluate("playground.finish()") == simulate(world, rho, seed=7).mean_distance.min()


def test_the_policy_and_the_code_give_the_numbers_of_python(tab: Page, address: str) -> None:
    visit(tab, f"{address}#seed=3&policy=learned")
    file = tab.evaluate("playground.policy.file")
    expected = load_policy(ROOT / file).record(3, "paper-flock").mean_distance.min()
    assert tab.evaluate("playground.finish()") == expected
    tab.click("#nobody")
    tab.click("summary")
    wait(tab, "document.getElementById('code').textContent.includes('#')")
    code, printed = tab.evaluate("document.getElementById('code').textContent").split("  # ")
    names: dict[str, object] = {"print": lambda value: names.update(value=value)}
    exec(code, names)  # noqa: S102
    assert names["value"] == float(printed)


def test_the_predator_follows_the_pointer(tab: Page, address: str) -> None:
    visit(tab, f"{address}#steer=you")
    tab.keyboard.press(" ")
    tab.evaluate("playground.pointer = playground.camera.project([20, 90])")
    tab.keyboard.press("ArrowLeft")
    tab.evaluate("for (let step = 0; step < 230; step++) playground.step()")
    away = "Math.hypot(...playground.target.map((part, axis) => part - playground.run.predators[axis]))"
    assert tab.evaluate(away) < 2
    tab.click("summary")
    wait(tab, "document.getElementById('note').textContent.includes('nobody steers')")


def test_every_world_of_the_package_is_offered(tab: Page, address: str) -> None:
    visit(tab, address)
    flocks = {name for name, (_, flock) in PRESETS.items() if isinstance(flock, FlockScenario)}
    assert set(tab.evaluate("playground.worlds.map(({ name }) => name)")) == flocks
    tab.evaluate("playground.worlds.forEach((world) => (playground.change({ world }), playground.step()))")
