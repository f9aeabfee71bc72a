"""What a page flies and shows has the numbers of Python, to the last digit; files and names are text."""

import hashlib
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import browser
import numpy as np
import pytest
from browser import BEST, OBJECTIVES, SEED, STATE, OpenAt, lowest, open_page, scenario, set_range, text, wait
from cli_runs import SMALL, Cli, npz, policy_file
from playwright.sync_api import Page
from watch_documents import needs_engine

import flockesc_env as fe
from flockesc_env.watch.live import RULES
from flockesc_env.watch.page import render, replay
from playground.__main__ import HEADLINE


def drop(tab: Page, name: str, content: bytes) -> None:
    tab.set_input_files("#file", {"name": name, "mimeType": "application/octet-stream", "buffer": content})


@needs_engine
def test_the_next_flock_is_played_by_all_policies_of_the_page(tab: Page, tmp_path: Path, cli: Cli) -> None:
    """Of a page of `flockesc watch`: a recorded one, a learned one with a memory, and a fixed range."""
    flock, page = SMALL.replace(num_steps=40), tmp_path / "page.html"
    mine = policy_file(tmp_path / "mine.npz")
    (tmp_path / "small.json").write_text(flock.to_json())
    flags = ["--scenario", tmp_path / "small.json", "--seed", SEED, "--output", page]
    assert cli("watch", "stubborn-witnesses", mine, "fixed:10", *flags).code == 0
    open_page(tab, f"{page.as_uri()}#t=0")
    for seed in (SEED, SEED + 1):
        tab.evaluate("page.player.pause(), page.seek(2)")
        run = fe.simulate(flock, policy=mine, seed=seed)
        lowest_shown = "page.panels.map(({ run }) => [run.seed, run.objective ?? null])"
        assert tab.evaluate(lowest_shown) == [[str(SEED), None], [str(seed), lowest(run)]]
        assert text(tab, ".note") == f"recorded, seed {SEED}"
        tab.click("#next")


def test_files_that_no_page_can_play_are_named(tab: Page, open_at: OpenAt, tmp_path: Path) -> None:
    """test_engine.py has the options that are refused."""
    open_at("policies=fixed:3")
    fe.save_run(fe.simulate(SMALL, 10.0, seed=1), tmp_path / "run.npz")
    with np.load(BEST) as file:
        arrays = dict(file)
    numbers = arrays["parameters"]
    rule = browser.ROOT / "scoreboard/searched-rule/policies/per-agent-local-0.npz"
    flipped = bytearray(npz(**arrays))
    flipped[flipped.index(numbers.tobytes()[-64:])] ^= 1
    files = {
        "cut.npz": (BEST.read_bytes()[:-2000], "expected a policy file"),
        "sum.npz": (bytes(flipped), "damaged"),
        "run.npz": ((tmp_path / "run.npz").read_bytes(), "expected a policy file"),
        "rows.npz": (npz(**arrays | {"parameters": numbers[np.newaxis]}), "expected one dimension"),
        "nan.npz": (npz(**arrays | {"parameters": numbers * np.nan}), "parameters[0, 0]: expected"),
        "line.npz": ((BEST.parent / "line-0.npz").read_bytes(), "a policy for a line"),
        "rule.npz": (rule.read_bytes(), "runs in Python"),
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


def test_files_play_under_their_own_names(tab: Page, open_at: OpenAt) -> None:
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
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#t=0")
    assert text(tab, ".note") == "recorded, given start"
    assert tab.get_attribute("#range", "aria-valuetext") == "each agent decides"
    set_range(tab, 25)
    assert tab.evaluate(OBJECTIVES) == [lowest(fe.simulate(SMALL, 25.0, **arrays))]
    tab.goto("about:blank")
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#scenario=capture&policies=fixed:3&t=0")
    assert tab.evaluate(STATE) == ["capture", "0", None, False, ["fixed:3"]]


def test_ranges_and_rules_keep_the_distance_that_they_keep_in_python(tab: Page, open_at: OpenAt) -> None:
    """test_engine.py plays every preset and file."""
    open_at("policies=fixed:12")
    for name, spec in (("capture", "fixed:12"), *product(("capture", "topological"), RULES)):
        tab.evaluate(f"""(async () => {{
            page.fly({scenario(name)});
            await page.choose(page.panels[0], '{spec}');
        }})()""")
        run = fe.simulate(name, policy=spec, seed=SEED)
        assert tab.evaluate(OBJECTIVES) == [lowest(run)], (name, spec)
        assert text(tab, ".lowest") == f"{lowest(run):.1f} m"


@pytest.mark.parametrize(
    "address", ["agents=50&policies=stubborn-leaders", f"scenario=capture&policies={HEADLINE}"]
)
def test_the_code_plays_the_same_flock_in_python(
    address: str, tab: Page, open_at: OpenAt, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_at(f"{address}&seed={SEED}")
    tab.click("#more summary")
    tab.click("#python summary")
    wait(tab, "document.getElementById('code').textContent.includes('#')")
    code, printed = text(tab, "#code").split("  # ")
    monkeypatch.chdir(browser.ROOT)
    names: dict[str, Any] = {"print": lambda value: names.update(value=value)}
    exec(code, names)  # noqa: S102, the code that the page offers
    assert names["value"] == float(printed)
    tab.evaluate("page.seek(page.player.duration)")
    assert tab.evaluate("page.panels[0].run.objective") == names["value"]
    checksum = hashlib.sha256(BEST.read_bytes()).hexdigest()
    assert (checksum in text(tab, "#code-note")) == (HEADLINE in address)


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
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#t=0")
    titles = "[...document.querySelectorAll('.panel h2')].map((title) => title.textContent)"
    assert tab.evaluate(titles) == TITLES
    assert tab.evaluate("document.title") == " / ".join(TITLES)
    assert min(tab.evaluate(browser.COLORED)) > 50
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
    open_page(tab, f"{(tmp_path / 'page.html').as_uri()}#t=0")
    assert text(tab, ".panel h2") == name
    assert tab.evaluate("document.title") == name
    assert tab.evaluate("[typeof window.hacked, document.images.length]") == ["undefined", 0]
