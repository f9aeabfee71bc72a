"""The watch page in a browser: it opens from a file, plays, scrubs and turns; served, it runs flocks anew."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import chromium
import pytest

from flockesc_env import ConstantVelocity, FlockScenario
from flockesc_env.policies.registry import built_in
from flockesc_env.watch import write_page

pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason="needs Chromium")

FLOCK = FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[chromium.Tab]:
    with chromium.chromium(tmp_path_factory.mktemp("profile")) as devtools:
        tab = chromium.Tab(devtools)
        yield tab
        tab.close()


@pytest.fixture
def tab(browser: chromium.Tab) -> Iterator[chromium.Tab]:
    yield browser
    browser.run("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    assert browser.problems == []


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("pages") / "page.html"
    write_page([(spec, built_in(spec).record(3, FLOCK)) for spec in SPECS], path)
    return path.as_uri()


COLORED = """(() => {
    // Pixels of every canvas that are neither see-through nor grey: agents and the predator.
    return [...document.querySelectorAll(".panel canvas")].map((canvas) => {
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        let colored = 0;
        for (let at = 0; at < data.length; at += 4) {
            const color = data.subarray(at, at + 3);
            if (data[at + 3] > 200 && Math.max(...color) - Math.min(...color) > 60) colored++;
        }
        return colored;
    });
})()"""


def test_a_file_opens_alone_with_both_panels(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    assert tab.run("[...document.querySelectorAll('.panel h2')].map((title) => title.textContent)") == [
        *SPECS
    ]
    assert min(tab.run(COLORED)) > 50
    assert tab.run("document.querySelectorAll('.chart canvas').length") == 3
    assert not tab.run("document.getElementById('live').checkVisibility()")
    assert tab.run("document.getElementById('facts').textContent").endswith(
        f"seed 3 \u00b7 flockesc-env {version('flockesc-env')}"
    )
    assert tab.requests == [file]


def test_space_plays_and_stops_and_the_end_ends(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    assert tab.run("[page.player.time, page.player.isPlaying]") == [0, False]
    tab.press(" ")
    tab.wait("page.player.time > 0.2")
    tab.press(" ")
    stopped = tab.run("page.player.time")
    tab.run("new Promise((done) => setTimeout(done, 100))")
    assert tab.run("page.player.time") == stopped
    tab.run("page.player.seek(3.8)")
    tab.run("document.getElementById('play').click()")
    tab.wait("!page.player.isPlaying")
    assert tab.run("page.player.time") == 4.0
    assert tab.run("document.getElementById('time').textContent") == "4.00 of 4 s"


def test_arrows_step(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    for key, shift, expected in (
        ("ArrowRight", False, 0.05),
        ("ArrowRight", True, 1.05),
        ("ArrowLeft", False, 1.0),
        ("End", False, 4.0),
        ("ArrowLeft", True, 3.0),
        ("Home", False, 0.0),
        ("ArrowLeft", False, 0.0),
    ):
        tab.press(key, shift=shift)
        assert tab.run("page.player.time") == pytest.approx(expected, abs=1e-9)


CURSORS = """[...document.querySelectorAll(".chart .u-over")].map((plot) => {
    const [box, now] = [plot, plot.querySelector(".now")].map((part) => part.getBoundingClientRect());
    return (now.left - box.left) / box.width;
})"""


def test_scrubbing_moves_the_cursor_the_flock_and_the_numbers(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    before = tab.run("page.panels[0].canvas.toDataURL()")
    tab.run("Object.assign(document.getElementById('scrub'), { value: 3 }).dispatchEvent(new Event('input'))")
    assert tab.run(CURSORS) == pytest.approx([0.75] * 3, abs=0.01)
    assert tab.run("page.panels[0].canvas.toDataURL()") != before
    run = built_in("fixed:15").record(3, FLOCK)
    expected = [
        f"{run.mean_distance[60]:.1f} m",
        f"{run.min_distance[60]:.1f} m",
        f"{run.mean_distance[:61].min():.1f} m",
        f"{run.num_components[60]}",
        "15.0 m",
    ]
    shown = "[...page.panels[0].root.querySelectorAll('div:not([hidden]) > dd')].map((dd) => dd.textContent)"
    assert tab.run(shown) == expected


def test_a_press_on_a_curve_goes_to_its_time(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    tab.run("document.getElementById('charts').scrollIntoView()")
    left, top, width = tab.run(
        "(({ left, top, width }) => [left, top, width])"
        "(document.querySelector('.chart .u-over').getBoundingClientRect())"
    )
    tab.drag((left + 0.2 * width, top + 20), (left + 0.5 * width, top + 30))
    assert tab.run("page.player.time") == pytest.approx(2.0, abs=4.0 / width)


@pytest.mark.parametrize("look", ["trails", "edges", "discs", "color"])
def test_every_look_changes_the_picture_and_goes_back(tab: chromium.Tab, file: str, look: str) -> None:
    tab.open(f"{file}#t=1")
    assert tab.run("page.player.time") == 1
    picture = "page.panels[0].canvas.toDataURL()"
    before = tab.run(picture)
    if look == "color":
        change = "Object.assign(document.getElementById('color'), {{ value: '{}' }})"
        changes = [change.format(value) for value in ("range", "component")]
        changes = [f"{change}.dispatchEvent(new Event('change', {{ bubbles: true }}))" for change in changes]
    else:
        changes = [f"document.getElementById('{look}').click()"] * 2
    tab.run(changes[0])
    assert tab.run(picture) != before
    tab.run(changes[1])
    assert tab.run(picture) == before


def test_neighbors_are_the_pairs_within_range(tab: chromium.Tab, file: str) -> None:
    tab.open(f"{file}#t=2")
    for index, spec in enumerate(SPECS):
        run = built_in(spec).record(3, FLOCK)
        positions, ranges = run.positions[40], run.interaction_ranges[40]
        pairs = {
            (i, j)
            for i in range(40)
            for j in range(i)
            if ((positions[i] - positions[j]) ** 2).sum() ** 0.5
            <= max(ranges[i % len(ranges)], ranges[j % len(ranges)])
        }
        shown = tab.run(f"neighborPairs(page.runs[{index}], 40, 1e6)")
        drawn = zip(shown[::2], shown[1::2], strict=True)
        assert {(max(pair), min(pair)) for pair in drawn} == pairs


def test_a_color_is_one_component_and_the_largest_have_one(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    for index, spec in enumerate(SPECS):
        run = built_in(spec).record(3, FLOCK)
        labels, groups = (tab.run(f"Array.from(page.runs[{index}].{name})") for name in ("labels", "groups"))
        for t in range(0, 81, 8):
            of_group: dict[int, set[int]] = {}
            sizes: dict[int, int] = {}
            for label, group in zip(labels[40 * t : 40 * t + 40], groups[40 * t : 40 * t + 40], strict=True):
                of_group.setdefault(group, set()).add(label)
                sizes[label] = sizes.get(label, 0) + 1
            assert len(sizes) == run.num_components[t]
            colored = [of_group[group] for group in range(5) if group in of_group]
            assert all(len(components) == 1 for components in colored)
            smallest = min((sizes[label] for components in colored for label in components), default=0)
            assert all(sizes[label] <= smallest for label in of_group.get(5, set()))
            assert all(sizes[label] == 1 for label in of_group.get(6, set()))


def test_dragging_turns_space_and_double_click_resets(tab: chromium.Tab, tmp_path: Path) -> None:
    flock = FLOCK.replace(dimension=3, predators=(ConstantVelocity(),))
    write_page([(spec, built_in(spec).record(3, flock)) for spec in SPECS], tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri())
    assert min(tab.run(COLORED)) > 50
    pictures = "page.panels.map((panel) => panel.canvas.toDataURL())"
    before = tab.run(pictures)
    tab.drag((200, 300), (260, 320))
    turned = tab.run(pictures)
    assert all(one != other for one, other in zip(before, turned, strict=True))
    tab.run("page.panels[1].canvas.dispatchEvent(new Event('dblclick'))")
    assert tab.run(pictures) == before


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("width", [400, 1280])
def test_all_that_happens_is_in_the_window(
    tab: chromium.Tab, tmp_path: Path, dimension: int, width: int
) -> None:
    flock = FLOCK.replace(dimension=dimension, predators=(ConstantVelocity(),))
    write_page([(spec, built_in(spec).record(3, flock)) for spec in SPECS], tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri(), width=width)
    seen = tab.run("""page.runs.flatMap(({ positions, predators, dimension }) =>
        [positions, predators].flatMap((points) => {
            const seen = [];
            for (let at = 0; at < points.length; at += dimension) {
                const z = dimension === 3 ? points[at + 2] : 0;
                const [x, y] = page.camera.project(points[at], points[at + 1], z, [0, 0, 0]);
                seen.push(x / page.camera.width, y / page.camera.height);
            }
            return [Math.min(...seen), Math.max(...seen)];
        }))""")
    assert min(seen) > 0.01
    assert max(seen) < 0.99


def test_dragging_moves_the_plane_by_as_many_pixels(tab: chromium.Tab, file: str) -> None:
    tab.open(file)
    where = "[...page.camera.project(20, 30, 0, [0, 0, 0])].slice(0, 2)"
    x, y = tab.run(where)
    tab.drag((200, 300), (260, 320))
    assert tab.run(where) == pytest.approx([x + 60, y + 20])
    tab.run("page.camera.zoom(2, 100, 100)")
    assert tab.run(where) == pytest.approx([2 * (x + 60) - 100, 2 * (y + 20) - 100])


def test_names_are_text(tab: chromium.Tab, tmp_path: Path) -> None:
    name = "<!--<script></script><img src=x onerror='window.hacked = 1'><script>window.hacked = 1</script>"
    write_page([(name, built_in("fixed:5").record(3, FLOCK))], tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri())
    assert tab.run("document.querySelector('.panel h2').textContent") == name
    assert tab.run("document.title") == name
    assert tab.run("[typeof window.hacked, document.images.length]") == ["undefined", 0]


@pytest.mark.parametrize("width", [400, 800, 1280])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_nothing_is_wider_than_the_window(tab: chromium.Tab, tmp_path: Path, width: int, count: int) -> None:
    runs = [(spec, built_in(spec).record(3, FLOCK)) for spec in ("fixed:15", "random", "stubborn-leaders")]
    write_page(runs[:count], tmp_path / "page.html")
    tab.open((tmp_path / "page.html").as_uri(), width=width)
    assert tab.run("document.documentElement.scrollWidth") <= width
    # Numbers under a panel stay beside one another.
    assert tab.run(
        "[...document.querySelectorAll('.stats dt')]"
        ".every((dt) => dt.scrollWidth <= dt.parentElement.clientWidth)"
    )


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    script = f"""
        from flockesc_env import ConstantVelocity, FlockScenario
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


def test_the_slider_runs_the_flock_anew(tab: chromium.Tab, address: str) -> None:
    tab.open(f"{address}#t=1.5")
    assert tab.run("document.getElementById('live').checkVisibility()")
    curves = "page.curves.charts[0].data.map((column) => Array.from(column))"
    before = tab.run(curves)
    for value in (12, 40, 3, 8.5):
        tab.run(SLIDE.format(value))
    tab.wait("page.runs[0].name === 'fixed:8.5'")
    after = tab.run(curves)
    run = built_in("fixed:8.5").record(3, FLOCK)
    assert after[3] == pytest.approx(run.mean_distance.tolist(), rel=1e-6)  # time, lowest mean, minimum, mean
    assert after[3] != before[3]
    assert after[4:] == before[4:]  # the other panels stay
    assert tab.run("page.player.time") == 1.5
    assert tab.run("document.querySelector('.panel h2').textContent") == "fixed:8.5"


def test_another_policy_and_another_flock(tab: chromium.Tab, address: str) -> None:
    tab.open(address)
    select = (
        "Object.assign(page.live.controls[{}].select, {{ value: '{}' }}).dispatchEvent(new Event('change'))"
    )
    assert tab.run("page.live.controls.map(({ select }) => select.value)") == ["fixed:RHO", SPECS[1], ""]
    tab.run(select.format(2, "stubborn-leaders-local"))
    tab.wait("page.runs[2].name === 'stubborn-leaders-local'")
    tab.run("document.getElementById('next-seed').click()")
    tab.wait("page.runs.every(({ seed }) => seed === '4')")
    for index, spec in enumerate((*SPECS, "stubborn-leaders-local")):
        expected = built_in(spec).record(4, FLOCK).mean_distance.min()
        assert tab.run(f"page.runs[{index}].lowestMean.at(-1)") == pytest.approx(expected, rel=1e-6)
    tab.run(select.format(2, ""))
    assert tab.run("[page.runs[2].name, page.runs[2].seed]") == ["mine.npz", "3"]
    assert tab.run("[...document.querySelectorAll('.panel .note')].map((note) => note.textContent)") == [
        "",
        "",
        "seed 3",
    ]
    assert "seed 4" in tab.run("document.getElementById('facts').textContent")


def test_a_recording_that_is_asked_for_last_stays(tab: chromium.Tab, address: str) -> None:
    tab.open(address)
    tab.run("""(({ live }) => {
        globalThis.shown = [];
        const replaceRun = live.replaceRun;
        live.replaceRun = (index, run) => { shown.push(run.name); replaceRun(index, run); };
        const { select, run } = live.controls[2];
        for (const name of ["random", "stubborn-leaders", ""]) { select.value = name; run(); }
    })(page)""")
    tab.wait("shown.length === 2")
    assert tab.run("shown") == ["random", "mine.npz"]  # what was asked for between was never run


def test_a_server_that_is_gone_is_noticed(tab: chromium.Tab, address: str) -> None:
    tab.open(address)
    tab.call(
        "Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0
    )
    tab.run(SLIDE.format(20))
    tab.wait("document.getElementById('message').value === 'The server does not answer any more.'")
    assert tab.run("page.runs[0].name") == SPECS[0]
    tab.call(
        "Network.emulateNetworkConditions",
        offline=False,
        latency=0,
        downloadThroughput=-1,
        uploadThroughput=-1,
    )
    tab.run(SLIDE.format(21))
    tab.wait("page.runs[0].name === 'fixed:21' && document.getElementById('message').value === ''")
    assert all("ERR_INTERNET_DISCONNECTED" in problem["entry"]["text"] for problem in tab.problems)
    tab.problems.clear()


def test_a_refused_seed_is_shown_and_changes_nothing(tab: chromium.Tab, address: str) -> None:
    tab.open(address)
    tab.run(
        "Object.assign(document.getElementById('seed'), { value: 'x' }).dispatchEvent(new Event('input'))"
    )
    tab.wait("document.getElementById('message').value.startsWith('seed: expected')")
    assert tab.run("page.runs.map(({ seed }) => seed)") == ["3"] * 3
    tab.run(
        "Object.assign(document.getElementById('seed'), { value: '5' }).dispatchEvent(new Event('input'))"
    )
    tab.wait("document.getElementById('message').value === '' && page.runs[0].seed === '5'")
    # The browser itself notes the refusal, and nothing else went wrong.
    refused = [problem["entry"]["text"] for problem in tab.problems]
    assert refused
    assert all("status of 400" in text for text in refused)
    tab.problems.clear()
