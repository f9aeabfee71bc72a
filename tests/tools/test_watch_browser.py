"""The watch page in a browser: opening from a file, playback, scrubbing and rotation."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import chromium
import imageio.v3 as iio
import numpy as np
import pytest
from chromium import open_page, wait
from playwright.sync_api import Page

from flockesc_env import ConstantVelocity, FlockScenario
from flockesc_env.policies.registry import built_in
from flockesc_env.render.colors import range_colors
from flockesc_env.render.palette import LIGHT
from flockesc_env.watch import write_page

pytest_plugins = ("watch_browser",)
pytestmark = pytest.mark.skipif(chromium.EXECUTABLE is None, reason=chromium.MISSING)

FLOCK = FlockScenario(num_agents=40, num_steps=80)  # 4 s
SPECS = ("fixed:15", "stubborn-leaders")
TITLES = ["fixed range 15 m", "rule: stubborn leaders"]


def drag(tab: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Press the mouse, move it and release it."""
    tab.mouse.move(*start)
    tab.mouse.down()
    tab.mouse.move(*end)
    tab.mouse.up()


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


def test_a_file_opens_alone_with_both_panels(tab: Page, file: str) -> None:
    requests: list[str] = []
    tab.on("request", lambda request: requests.append(request.url))
    open_page(tab, file)
    titles = "[...document.querySelectorAll('.panel h2')].map((title) => title.textContent)"
    assert tab.evaluate(titles) == TITLES
    assert tab.evaluate("document.title") == " / ".join(TITLES)
    assert min(tab.evaluate(COLORED)) > 50
    assert tab.evaluate("document.querySelectorAll('.chart canvas').length") == 3
    assert not tab.evaluate("document.getElementById('live').checkVisibility()")
    assert tab.evaluate("document.getElementById('facts').textContent").endswith(
        f"seed 3 \u00b7 flockesc-env {version('flockesc-env')}"
    )
    assert [url.partition("#")[0] for url in requests] == [file]


def test_the_page_plays_by_itself_unless_a_time_is_asked_for(tab: Page, file: str) -> None:
    open_page(tab, f"{file}#")
    wait(tab, "page.player.isPlaying && page.player.time > 0.1")
    tab.emulate_media(reduced_motion="reduce")
    open_page(tab, f"{file}?still#")
    assert tab.evaluate("[page.player.time, page.player.isPlaying]") == [0, False]


def test_colors_of_ranges_are_those_of_all_pictures(tab: Page, file: str) -> None:
    open_page(tab, file)
    shares = np.linspace(0, 1, 64)
    shown = tab.evaluate(f"{shares.tolist()}.map((share) => page.look.theme.ramp(share))")
    channels = [[int(channel) for channel in color[4:-1].split(",")] for color in shown]
    np.testing.assert_allclose(channels, range_colors(shares, 1.0).astype(int), atol=1)
    assert tab.evaluate("NUM_GROUP_COLORS") == len(LIGHT.components)


def test_a_picture_of_all_panels_is_saved(tab: Page, file: str) -> None:
    open_page(tab, f"{file}#t=2")
    with tab.expect_download() as download:
        tab.evaluate("document.getElementById('save').click()")
    assert download.value.suggested_filename == "flock-2.00s.png"
    picture = iio.imread(download.value.path())
    width, height = tab.evaluate("[page.panels[0].canvas.width, page.panels[0].canvas.height]")
    assert picture.shape[:2] == (height + 30, 2 * width)
    assert np.ptp(picture[40:, :width]) > 100
    assert np.ptp(picture[40:, width:]) > 100


# imageio leaves the pipes of its reader open until garbage collection.
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
def test_a_video_of_the_replay_is_saved(tab: Page, file: str) -> None:
    """The video is as long as the replay at its speed and shows all panels, in motion."""
    open_page(tab, f"{file}#t=2")
    width, height = tab.evaluate("[page.panels[0].canvas.width, page.panels[0].canvas.height]")
    tab.select_option("#speed", "2")
    with tab.expect_download() as download:
        tab.click("#save-video")
        assert tab.text_content("#save-video") == "Stop and save"
    assert tab.evaluate("[page.player.time, page.player.isPlaying]") == [4, False]
    assert tab.text_content("#save-video") == "Save video"
    assert download.value.suggested_filename == "flock.webm"
    frames = iio.imread(download.value.path(), plugin="FFMPEG", extension=".webm", fps=10)
    assert 15 <= len(frames) <= 30  # 2 s
    assert frames.shape[1:3] == (height + 30, 2 * width)
    for panel in (frames[:, 40:, :width], frames[:, 40:, width:]):
        assert np.ptp(panel[0]) > 100
        assert np.abs(panel[-1].astype(int) - panel[0]).max() > 100


def test_space_plays_and_stops_and_playback_stops_at_the_end(tab: Page, file: str) -> None:
    open_page(tab, file)
    assert tab.evaluate("[page.player.time, page.player.isPlaying]") == [0, False]
    tab.keyboard.press(" ")
    wait(tab, "page.player.time > 0.2")
    tab.keyboard.press(" ")
    stopped = tab.evaluate("page.player.time")
    tab.evaluate("new Promise((done) => setTimeout(done, 100))")
    assert tab.evaluate("page.player.time") == stopped
    tab.evaluate("page.player.seek(3.8)")
    tab.evaluate("document.getElementById('play').click()")
    wait(tab, "!page.player.isPlaying")
    assert tab.evaluate("page.player.time") == 4.0
    assert tab.evaluate("document.getElementById('time').textContent") == "4.00 of 4 s"


def test_arrows_step(tab: Page, file: str) -> None:
    open_page(tab, file)
    for key, expected in (
        ("ArrowRight", 0.05),
        ("Shift+ArrowRight", 1.05),
        ("ArrowLeft", 1.0),
        ("End", 4.0),
        ("Shift+ArrowLeft", 3.0),
        ("Home", 0.0),
        ("ArrowLeft", 0.0),
    ):
        tab.keyboard.press(key)
        assert tab.evaluate("page.player.time") == pytest.approx(expected, abs=1e-9)


CURSORS = """[...document.querySelectorAll(".chart .u-over")].map((plot) => {
    const [box, now] = [plot, plot.querySelector(".now")].map((part) => part.getBoundingClientRect());
    return (now.left - box.left) / box.width;
})"""


def test_scrubbing_moves_the_cursor_the_flock_and_the_numbers(tab: Page, file: str) -> None:
    open_page(tab, file)
    before = tab.evaluate("page.panels[0].canvas.toDataURL()")
    tab.evaluate(
        "Object.assign(document.getElementById('scrub'), { value: 3 }).dispatchEvent(new Event('input'))"
    )
    assert tab.evaluate(CURSORS) == pytest.approx([0.75] * 3, abs=0.01)
    assert tab.evaluate("page.panels[0].canvas.toDataURL()") != before
    run = built_in("fixed:15").record(3, FLOCK)
    expected = [
        f"{run.mean_distance[60]:.1f} m",
        f"{run.min_distance[60]:.1f} m",
        f"{run.mean_distance[:61].min():.1f} m",
        f"{run.num_components[60]}",
        "15.0 m",
    ]
    shown = "[...page.panels[0].root.querySelectorAll('div:not([hidden]) > dd')].map((dd) => dd.textContent)"
    assert tab.evaluate(shown) == expected


@pytest.mark.parametrize("look", ["trails", "edges", "discs", "color"])
def test_every_display_option_changes_the_picture_and_back(tab: Page, file: str, look: str) -> None:
    open_page(tab, f"{file}#t=1")
    assert tab.evaluate("page.player.time") == 1
    picture = "page.panels[0].canvas.toDataURL()"
    before = tab.evaluate(picture)
    if look == "color":
        change = "Object.assign(document.getElementById('color'), {{ value: '{}' }})"
        changes = [change.format(value) for value in ("component", "range")]
        changes = [f"{change}.dispatchEvent(new Event('change', {{ bubbles: true }}))" for change in changes]
    else:
        changes = [f"document.getElementById('{look}').click()"] * 2
    tab.evaluate(changes[0])
    assert tab.evaluate(picture) != before
    tab.evaluate(changes[1])
    assert tab.evaluate(picture) == before


def test_neighbors_are_the_pairs_within_range(tab: Page, file: str) -> None:
    open_page(tab, f"{file}#t=2")
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
        shown = tab.evaluate(f"neighborPairs(page.runs[{index}], 40, 1e6)")
        drawn = zip(shown[::2], shown[1::2], strict=True)
        assert {(max(pair), min(pair)) for pair in drawn} == pairs


def test_a_color_is_one_component_and_the_largest_components_have_colors(tab: Page, file: str) -> None:
    open_page(tab, file)
    for index, spec in enumerate(SPECS):
        run = built_in(spec).record(3, FLOCK)
        labels, groups = (
            tab.evaluate(f"Array.from(page.runs[{index}].{name})") for name in ("labels", "groups")
        )
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


def test_dragging_turns_space_and_double_click_resets(tab: Page, tmp_path: Path) -> None:
    flock = FLOCK.replace(dimension=3, predators=(ConstantVelocity(),))
    write_page([(spec, built_in(spec).record(3, flock)) for spec in SPECS], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert min(tab.evaluate(COLORED)) > 0
    pictures = "page.panels.map((panel) => panel.canvas.toDataURL())"
    before = tab.evaluate(pictures)
    drag(tab, (200, 300), (260, 320))
    turned = tab.evaluate(pictures)
    assert all(one != other for one, other in zip(before, turned, strict=True))
    tab.evaluate("page.panels[1].canvas.dispatchEvent(new Event('dblclick'))")
    assert tab.evaluate(pictures) == before


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("width", [400, 1280])
def test_the_whole_run_is_in_the_window(tab: Page, tmp_path: Path, dimension: int, width: int) -> None:
    flock = FLOCK.replace(dimension=dimension, predators=(ConstantVelocity(),))
    write_page([(spec, built_in(spec).record(3, flock)) for spec in SPECS], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri(), width=width)
    seen = tab.evaluate("""page.runs.flatMap(({ positions, predators, dimension }) =>
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


def test_names_are_text(tab: Page, tmp_path: Path) -> None:
    name = "<!--<script></script><img src=x onerror='window.hacked = 1'><script>window.hacked = 1</script>"
    write_page([(name, built_in("fixed:5").record(3, FLOCK))], tmp_path / "page.html")
    open_page(tab, (tmp_path / "page.html").as_uri())
    assert tab.evaluate("document.querySelector('.panel h2').textContent") == name
    assert tab.evaluate("document.title") == name
    assert tab.evaluate("[typeof window.hacked, document.images.length]") == ["undefined", 0]
