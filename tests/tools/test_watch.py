"""The watch page: it holds the runs, loads nothing and executes no foreign text."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from watch_documents import FLOCK, RUNS, assert_shows, document_in

from flockesc_env import (
    simulate,
)
from flockesc_env.models.records import versions
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
