"""The watch page holds the runs, loads nothing and executes no foreign text, also from ``flockesc watch``."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import imageio_ffmpeg
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Ran, policy_file
from watch_documents import FLOCK, RUNS, assert_shows, document_in

from flockesc_env import (
    load_policy,
    simulate,
)
from flockesc_env.cli.exits import Exit
from flockesc_env.models.records import save_run, versions
from flockesc_env.policies.registry import built_in
from flockesc_env.watch import write_page


@pytest.mark.parametrize("name", RUNS)
def test_the_page_holds_the_run(name: str, tmp_path: Path) -> None:
    run = RUNS[name]()
    write_page([(name, run)], tmp_path / "page.html")
    document = document_in((tmp_path / "page.html").read_text("utf-8"))
    (shown,) = document["runs"]
    assert shown["name"] == name
    assert_shows(shown, run)
    assert document["versions"] == versions()
    assert document["live"] is None


class Loads(HTMLParser):
    """Collects the addresses that elements load, and counts the elements."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.asked: list[str | None] = []
        self.tags: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.asked += [value for name, value in attrs if name in {"src", "href", "srcset", "action", "data"}]


def test_nothing_is_loaded_from_anywhere(tmp_path: Path) -> None:
    write_page([("run", simulate(FLOCK, 10.0, seed=3))], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    assert Loads(page).asked == ["data:,"]
    assert not re.search(r"url\(|@import|\bimport\b *[({'\"]|\beval\(|new Function", page)
    # The only address is in the comment that names uPlot's project.
    assert re.findall(r"https?://\S+", page) == ["https://github.com/leeoniya/uPlot"]
    assert "default-src 'none'" in page


HOSTILE = "</script><script>alert(1)</script><!-- <b>&amp;\u2028'\"$title ${data}"


def test_names_cannot_end_their_element(tmp_path: Path) -> None:
    run = simulate(FLOCK, 10.0, seed=3)
    write_page([("plain", run)], tmp_path / "plain.html")
    write_page([(HOSTILE, run)], tmp_path / "hostile.html")
    plain, hostile = ((tmp_path / f"{name}.html").read_text("utf-8") for name in ("plain", "hostile"))
    assert document_in(hostile)["runs"][0]["name"] == HOSTILE
    assert Loads(hostile).tags == Loads(plain).tags
    assert "alert(1)</script>" not in hostile


def test_a_page_of_policies_on_one_flock(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page, expected = tmp_path / "page.html", tmp_path / "expected.html"
    spec = str(policy_file(tmp_path / "mine.npz"))
    policies = {"fixed:10": built_in("fixed:10"), "stubborn-leaders": built_in("stubborn-leaders")}
    policies[spec] = load_policy(spec)
    ran = Ran(capsys, "watch", "--policies", *policies, "--seed", 7, *SMALL_FLAGS, "--output", page)
    assert (ran.code, ran.out) == (Exit.DONE, "")
    write_page([(name, policy.record(7, SMALL)) for name, policy in policies.items()], expected)
    assert page.read_bytes() == expected.read_bytes()


def test_a_page_of_recorded_runs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    runs = [("ten", simulate(SMALL, 10.0, seed=3)), ("", simulate(SMALL, 20.0, seed=3))]
    files = [tmp_path / "a.npz", tmp_path / "b.npz"]
    for file, (name, run) in zip(files, runs, strict=True):
        save_run(run, file, name=name)
    page, expected = tmp_path / "page.html", tmp_path / "expected.html"
    assert Ran(capsys, "watch", *files, "--output", page).code == Exit.DONE
    write_page([("ten", runs[0][1]), ("b", runs[1][1])], expected)
    assert page.read_bytes() == expected.read_bytes()


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_a_video(suffix: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / f"flock.{suffix}"
    ran = Ran(capsys, "watch", "--policies", "fixed:10", *SMALL_FLAGS, "--output", path)
    assert (ran.code, ran.out) == (Exit.DONE, "")
    count, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert count == SMALL.num_steps + 1
    assert seconds == pytest.approx(count * SMALL.time_step, abs=0.06)  # GIFs store times in units of 0.01 s
