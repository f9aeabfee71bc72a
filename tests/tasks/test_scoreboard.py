"""The scoreboard: every result verifies on a drawn flock, and the page shows all of them."""

from pathlib import Path

import pytest

import flockesc_env
from flockesc_env.tasks.results import read_result
from flockesc_env.tasks.scoring import draw_flocks, verify
from flockesc_env.tasks.task import tasks
from studies.scoreboard.board import BOARD, load_board
from studies.scoreboard.page import entries_of, readme_table

ROOT = Path(flockesc_env.__file__).parents[1]
FILES = [path.relative_to(ROOT).as_posix() for path in sorted((ROOT / BOARD).rglob("*.json"))]
NUM_FLOCKS = 1
"""`flockesc verify FILE` plays all 1,000 flocks."""


@pytest.mark.parametrize("file", FILES)
def test_a_result_verifies_and_its_folder_has_no_other_policies(file: str) -> None:
    result = read_result(ROOT / file)
    assert not result.is_code
    assert file == f"{BOARD}/{result.learner}/{result.task}.json"
    if result.learner != "random":  # its numbers depend on all flocks before
        verify(ROOT / file, flocks=draw_flocks(NUM_FLOCKS, 0))


def test_every_policy_file_has_a_result() -> None:
    for entrant in load_board(ROOT / BOARD):
        named = {policy.policy for result in entrant.results.values() for policy in result.policies}
        files = (ROOT / BOARD / entrant.name).rglob("*.npz")
        assert {f"policies/{file.name}" for file in files} <= named, entrant.name


def test_the_page_and_the_readme_are_those_of_the_results() -> None:
    entries = entries_of(load_board(ROOT / BOARD))
    assert set(entries) == set(tasks)
    page = (ROOT / "docs/scoreboard.md").read_text()
    for shown in entries.values():
        for entry in shown:
            assert f"[{entry.result.learner}]" in page
            assert f"| {entry.row.score:z.3f} |" in page
    assert readme_table(entries) in (ROOT / "README.md").read_text()
