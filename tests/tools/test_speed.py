"""Benchmarks time the right thing: peers compute what this project does, and a wrong one is refused.

Peers whose packages are in the ``speed`` extra alone are checked by every benchmark run itself.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from speed import (
    PROJECT,
    flocks,
    frameworks,
    instructions,
    line,
    page,
    peers,
    plots,
    size,
)
from speed.measure import Record
from speed.peers import numpy_flocks
from speed.peers.model import Flocks, Outcome, Peer


def test_peers_agree_with_this_project() -> None:
    peers.check(list(numpy_flocks.PEERS))
    for rule in flocks.RULES.values():
        peers.check([rule.peer], rule.ranges, rule.rule)


def test_a_peer_that_computes_something_else_is_refused() -> None:
    def run(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
        return numpy_flocks.PEERS[0].run(flocks, interaction_range * 1.001, steps)

    with pytest.raises(peers.DisagreementError, match=r"wider differs by .* at .* m"):
        peers.check([Peer("wider", run)])


def test_a_peer_in_float32_agrees_up_to_its_rounding_errors() -> None:
    def run(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
        single = replace(
            flocks, positions=np.float32(flocks.positions), velocities=np.float32(flocks.velocities)
        )
        return numpy_flocks.PEERS[0].run(single, interaction_range, steps)

    rounded = Peer("rounded", run, is_single=True)
    peers.check([rounded])
    late = replace(
        rounded, run=lambda flocks, interaction_range, steps: run(flocks, interaction_range, steps - 1)
    )
    for wrong in (replace(rounded, is_single=False), late):
        with pytest.raises(peers.DisagreementError):
            peers.check([wrong])


def test_the_limits_of_equal_numbers_are_one_number() -> None:
    document = json.loads((Path(__file__).parents[2] / "speed/results/benchmarks.json").read_text())
    for record in document["records"]:
        if record["section"] == "line":
            record["seconds"] = [2.7e-5 if record["contender"] == PROJECT else 2.66e-5]
    assert "takes 27 us; all pairs in NumPy take 27 us." in page.rendered(
        "<!-- grid and line --><!-- end -->", document
    ).replace("\n", " ")


@pytest.mark.parametrize("rho", line.RANGES)
def test_the_line_in_numpy_agrees_and_a_wrong_one_is_refused(rho: float) -> None:
    right = line.PEERS["NumPy, all pairs"]
    line.check("NumPy", right, rho)
    with pytest.raises(peers.DisagreementError, match="late"):
        line.check("late", lambda x, scenario, rho, steps: right(x, scenario, rho, steps - 1), rho)


def kernel_records(own: float, peer: float) -> list[Record]:
    costs = {PROJECT: own, "NumPy, all pairs": peer}
    return [
        Record("kernel", name, {"rho": rho}, "flock step", "cpu", [9.0, seconds, 0.0])
        for rho in flocks.RANGES
        for name, seconds in costs.items()
    ]


def test_figures_are_drawn_from_the_file_alone(tmp_path: Path) -> None:
    records = kernel_records(8e-6, 2e-3) + [
        Record("size", PROJECT, {"n": n, "rho": 10.0}, "flock step", "cpu", [1e-8 * n]) for n in size.SIZES
    ]
    left_out = Record("size", PROJECT, {"n": 10**7, "rho": 10.0}, "flock step", "cpu", [], "left out")
    text = json.dumps([record.document() for record in [*records, left_out]])
    read = [Record.from_document(entry) for entry in json.loads(text)]
    assert read == [*records, left_out]
    assert [path.name for path in plots.draw(read, tmp_path)] == [
        "cost_against_range.png",
        "cost_against_size.png",
    ]
    assert all(path.stat().st_size > 10_000 for path in tmp_path.iterdir())


@pytest.mark.parametrize("path", page.PAGES, ids=str)
def test_the_tables_of_the_pages_show_the_committed_run(path: Path) -> None:
    text = path.read_text("utf-8")
    assert text.count("<!-- end -->") == {"README.md": 2, "performance.md": 7}[path.name]
    assert page.rendered(text, json.loads(Path("speed/results/benchmarks.json").read_text())) == text


def test_the_table_of_frameworks_shows_the_committed_measurements() -> None:
    text = frameworks.PAGE.read_text("utf-8")
    assert text.count("\n| stable-baselines3 PPO: [sb3_ppo.py]") == 1
    assert frameworks.rendered(text) == text


def test_the_readme_has_the_gain_of_its_example(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    files = [frameworks.RESULTS / "sb3_ppo.json", *frameworks.RESULTS.glob("processors/sb3_ppo*.json")]
    gains = [[run["gain"] for run in json.loads(path.read_text())["runs"]] for path in files]
    assert len(files) == 3
    assert {len(of_seeds) for of_seeds in gains} == {5}
    readme = " ".join(Path("README.md").read_text("utf-8").split())
    expected = (
        f"about {np.mean(gains):.0f} m above the best fixed range (+{np.min(gains)} to +{np.max(gains)} m"
    )
    assert f"{expected} over five seeds and two processors)" in readme


def test_the_page_shows_the_committed_counts_of_instructions() -> None:
    text = instructions.PAGE.read_text("utf-8")
    assert instructions.rendered(text, json.loads(instructions.RESULTS.read_text())) == text


@pytest.mark.parametrize("example", frameworks.CHANGES)
def test_the_changes_of_examples_still_fit(example: str) -> None:
    text = (Path(__file__).parents[2] / "examples" / f"{example}.py").read_text("utf-8")
    for change in frameworks.CHANGES[example]:
        changed = change.applied(text)
        assert changed != text
        compile(changed, example, "exec")
    with pytest.raises(ValueError, match="2 times"):
        frameworks.Change("ambiguous", {"a": "b"}).applied("a a")
