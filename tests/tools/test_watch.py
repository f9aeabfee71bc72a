"""The watch page: it holds the runs, loads nothing and executes no foreign text."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from watch_documents import FLOCK, RUNS, assert_shows, document_in, numbers

from flockesc_env import (
    ArgumentError,
    LineScenario,
    record,
    simulate,
    simulate_line,
)
from flockesc_env.models.records import versions
from flockesc_env.policies import StubbornLeaders, StubbornWitnesses
from flockesc_env.policies.registry import NAMES, built_in
from flockesc_env.render.palette import DARK, LIGHT
from flockesc_env.watch import write_page
from flockesc_env.watch.document import run_document


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


def test_the_band_of_ranges_is_a_standard_deviation() -> None:
    run = record(FLOCK, StubbornLeaders(), 5, per_agent=True, predator_sensing_range=None)
    columns = run_document("", run)["columns"]
    row = run.interaction_ranges[4]
    assert 0 < row.std() < 10
    low, high = row.mean() - row.std(), row.mean() + row.std()
    assert numbers(columns["lowRange"])[4] == pytest.approx(max(low, row.min()), abs=1e-5)
    assert numbers(columns["highRange"])[4] == pytest.approx(min(high, row.max()), abs=1e-5)


def test_runs_stand_side_by_side_in_order(tmp_path: Path) -> None:
    runs = [("b", simulate(FLOCK, 5.0, seed=3)), ("a", simulate(FLOCK, 9.0, seed=3))]
    write_page(runs, tmp_path / "page.html")
    shown = document_in((tmp_path / "page.html").read_text("utf-8"))["runs"]
    assert [run["name"] for run in shown] == ["b", "a"]


def test_the_papers_flock_is_a_small_page(tmp_path: Path) -> None:
    run = built_in("random").record(7)  # a new range for every agent and step compresses least
    write_page([("random", run)], tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size < 1_500_000


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


def test_the_page_has_the_palette_of_all_pictures(tmp_path: Path) -> None:
    write_page(simulate(FLOCK, 10.0, seed=3), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    light, dark = re.findall(r":root \{ (--[^}]*) \}", page)
    for css, palette in ((light, LIGHT), (dark, DARK)):
        assert f"--predator: {palette.predator};" in css
        assert f"--components: {', '.join(palette.components)};" in css
        assert f"--ranges: {', '.join(palette.ranges)};" in css
    own = files("flockesc_env.watch")
    styles = [own / "page.css", own / "page.html", *(own / "js").iterdir()]
    assert not [style.name for style in styles if re.search(r"#[0-9a-fA-F]{6}\b", style.read_text("utf-8"))]


def test_a_run_has_the_kind_of_its_policy() -> None:
    fixed, drawn = simulate(FLOCK, 10.0, seed=3), built_in("random").record(3, FLOCK)
    runs = [("any name", fixed), ("random", drawn), ("mine", drawn)]
    assert [run_document(*run)["kind"] for run in runs] == ["fixed", "rule", "learned"]


HOSTILE = "</script><script>alert(1)</script><!-- <b>&amp;\u2028'\"$title ${data}"


def test_names_cannot_end_their_element(tmp_path: Path) -> None:
    run = simulate(FLOCK, 10.0, seed=3)
    write_page([("plain", run)], tmp_path / "plain.html")
    write_page([(HOSTILE, run)], tmp_path / "hostile.html")
    plain, hostile = ((tmp_path / f"{name}.html").read_text("utf-8") for name in ("plain", "hostile"))
    assert document_in(hostile)["runs"][0]["name"] == HOSTILE
    assert Loads(hostile).tags == Loads(plain).tags
    assert "alert(1)</script>" not in hostile


@pytest.mark.parametrize(
    ("runs", "field"),
    [
        ([("a", RUNS["one range"]()), ("b", RUNS["in space, two predators"]())], "runs"),
        ([("line", simulate_line(LineScenario(), 0.1, seed=3))], "runs[0]"),
    ],
)
def test_bad_runs_are_named(runs: Any, field: str, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError) as caught:
        write_page(runs, tmp_path / "page.html")
    assert caught.value.field == field
    assert not list(tmp_path.iterdir())


def test_named_policies_are_the_policies_of_their_names() -> None:
    for spec, policy, sensing in (
        ("stubborn-witnesses", StubbornWitnesses(), "predator_range"),
        ("stubborn-leaders", StubbornLeaders(), None),
        ("stubborn-leaders-local", StubbornLeaders(), "predator_range"),
    ):
        mine = record(FLOCK, policy, 5, per_agent=True, predator_sensing_range=sensing)
        np.testing.assert_array_equal(built_in(spec).record(5, FLOCK).positions, mine.positions)
    for spec in NAMES[1:]:
        run, width = built_in(spec).record(5, FLOCK), 12 if built_in(spec).per_agent else 1
        assert run.interaction_ranges.shape[1] == width
    # A fixed range may exceed the default maximum.
    np.testing.assert_array_equal(built_in("fixed:400").record(5, FLOCK).interaction_ranges, 400.0)


@pytest.mark.parametrize("spec", ["", "fixed:", "fixed:-1", "fixed:nan", "Random"])
def test_unknown_policies_are_named(spec: str) -> None:
    with pytest.raises(ArgumentError, match=r"^policies: expected one of fixed:RHO, random"):
        built_in(spec)
