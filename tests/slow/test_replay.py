"""Every policy file, rule and fixed range on every held-out flock: about 30 minutes on two cores."""

from __future__ import annotations

from pathlib import Path

import pytest

from flockesc_env.jobs import Cache, find_backend
from studies.learned.replay import replay
from studies.learned.results import Study, load_studies

RESULTS = Path("results/learned")


@pytest.mark.parametrize("study", load_studies(RESULTS), ids=lambda study: study.setting)
def test_every_file_reproduces_its_episodes(study: Study, tmp_path: Path) -> None:
    found = replay(study, RESULTS / study.setting, Cache(tmp_path), find_backend("serial"))
    print(*found.lines(), sep="\n")
    assert not found.differences
    assert found.files == len(list((RESULTS / study.setting / "policies").iterdir()))
