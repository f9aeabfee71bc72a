"""Committed pages to the letter, and every policy file on every held-out flock (45 minutes on two cores)."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_folders import check_results

from flockesc_env.jobs import Cache, find_backend
from studies.findings.replay import replay
from studies.findings.results import Study, load_studies
from studies.measurements import Runner


def test_results() -> None:
    check_results()


RESULTS = Path("results/findings")


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Cache:
    return Cache(tmp_path_factory.mktemp("replay"))


@pytest.mark.parametrize("study", load_studies(RESULTS), ids=lambda study: study.setting)
def test_every_file_reproduces_its_episodes(study: Study, cache: Cache) -> None:
    found = replay(study, Runner(cache, find_backend("serial")))
    print(*found.lines(), sep="\n")
    assert not found.differences
    assert found.files == len(list((RESULTS / study.setting / "policies").iterdir()))
