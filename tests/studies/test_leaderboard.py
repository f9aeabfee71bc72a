"""The page of policy files: it names every file with its checksum and what was measured."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest

from studies.learned.held_out import setting_job
from studies.learned.results import Study, load_studies
from training.presets import presets
from training.seeds import HELD_OUT

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "results" / "learned"
COMMITTED = sorted(RESULTS.glob("*/policies/*.npz"))
ROW = re.compile(r"^\| \[(\S+)\]\((\S+)\) \| (\d+) \|.*\| `([0-9a-f]{64})` \|$", re.MULTILINE)


def test_the_committed_page_has_a_row_with_the_checksum_of_every_policy_file() -> None:
    page = ROOT / "docs" / "leaderboard.md"
    rows = ROW.findall(page.read_text("utf-8"))
    files = {(page.parent / link).resolve(): digest for _, link, _, digest in rows}
    assert files == {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in COMMITTED}
    assert all(name == Path(link).name == f"{Path(link).stem}.npz" for name, link, _, _ in rows)
    assert all(Path(link).stem.endswith(f"-{seed}") for _, link, seed, _ in rows)


@pytest.mark.parametrize("study", load_studies(RESULTS), ids=lambda study: study.setting)
def test_policy_files_reproduce_their_rows(study: Study) -> None:
    name, seed = study.best_learner, study.best_seed
    file = study.file()
    flocks = HELD_OUT[:4]
    found = setting_job(file.read_bytes(), presets()[study.setting].setting, flocks).run()["objective"]
    row = study.values(name)[study.training_seeds(name).index(seed)]
    np.testing.assert_allclose(found, row[: len(flocks)], rtol=0, atol=5e-3)  # half of the last digit shown
