"""Benchmarks time the right thing: peers compute what this project does, and a wrong one is refused.

Peers whose packages are in the ``speed`` extra alone are checked by every benchmark run itself.
"""

import json
from pathlib import Path

import pytest

from speed import instructions, models, page, peers
from speed.measure import Measurements
from speed.peers import Flocks, Outcome, Peer, numpy_flocks

ROOT = Path(__file__).parents[2]
RUN = Measurements.read(ROOT / "speed/results/benchmarks.json")


def test_peers_agree_with_this_project() -> None:
    peers.check(list(numpy_flocks.PEERS))
    for rule, ranges, peer in models.RULES.values():
        peers.check([peer], ranges, rule)


def test_a_peer_that_computes_something_else_is_refused() -> None:
    def run(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
        return numpy_flocks.PEERS[0].run(flocks, interaction_range * 1.001, steps)

    with pytest.raises(peers.DisagreementError, match=r"wider differs by .* at .* m"):
        peers.check([Peer("wider", run)])


@pytest.mark.parametrize("rho", models.LINE_RANGES)
def test_the_line_in_numpy_agrees_and_a_wrong_one_is_refused(rho: float) -> None:
    models.check_line(models.numpy_line, rho)
    with pytest.raises(peers.DisagreementError, match="on the line"):
        models.check_line(lambda x, scenario, rho, steps: models.numpy_line(x, scenario, rho, steps - 1), rho)


@pytest.mark.parametrize(("path", "blocks"), [(page.REPORT, 7), (page.README, 1)], ids=str)
def test_the_tables_show_the_committed_run(path: Path, blocks: int) -> None:
    text = path.read_text("utf-8")
    assert text.count("<!-- end -->") == blocks
    assert page.rendered(text, RUN) == text


def test_the_page_shows_the_committed_counts_of_instructions() -> None:
    text = page.REPORT.read_text("utf-8")
    assert page.with_counts(text, json.loads(instructions.RESULTS.read_text())) == text
