"""The page of policy files: it names every file with its checksum and what was measured."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest
from study_folders import write_study

from flockesc_env import load_policy
from studies.learned.held_out import setting_job
from studies.learned.leaderboard import cards, leaderboard_page
from studies.learned.results import BEST_FIXED, Study, load_studies, load_study
from studies.learned.summary import summarize
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


@pytest.mark.parametrize("path", COMMITTED[::10], ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_policy_files_load(path: Path) -> None:
    assert load_policy(path).scenario is not None


@pytest.mark.parametrize("study", load_studies(RESULTS), ids=lambda study: study.setting)
def test_policy_files_reproduce_their_rows(study: Study) -> None:
    name, seed = study.best_learner, study.best_seed
    file = study.file()
    flocks = HELD_OUT[:4]
    found = setting_job(file.read_bytes(), presets()[study.setting].setting, flocks).run()["objective"]
    row = study.values(name)[study.training_seeds(name).index(seed)]
    np.testing.assert_allclose(found, row[: len(flocks)], rtol=0, atol=5e-3)  # half of the last digit shown


def test_cards_say_what_the_files_of_a_study_say(tmp_path: Path) -> None:
    fixed = 75 + np.random.default_rng(0).normal(size=40)
    gains = {"search": np.array([[20.0], [22.0], [21.0]]), "ppo": np.array([[10.0], [12.0]])}
    learned = {name: fixed + gain for name, gain in gains.items()}
    folder = write_study(tmp_path / "results", "shared", {BEST_FIXED: fixed}, learned)
    (folder / "policies").mkdir()
    for name in ("search-0", "search-1", "ppo-1"):
        (folder / "policies" / f"{name}.npz").write_text(name)
    (summary,) = summarize([load_study(folder)])
    found = cards(summary)
    assert [(card.learner, card.training_seed, round(card.gain.mean, 9)) for card in found] == [
        ("search", 0, 20.0),
        ("search", 1, 22.0),
        ("ppo", 1, 12.0),
    ]
    assert found[1].objective.mean == pytest.approx(fixed.mean() + 22)
    text = leaderboard_page([summary], tmp_path / "docs" / "leaderboard.md")
    best, _ = text.split("\n## shared\n")
    assert "[search-1.npz](../results/shared/policies/search-1.npz) | 3 |" in best
    assert ROW.findall(text)[0] == (
        "search-0.npz",
        "../results/shared/policies/search-0.npz",
        "0",
        hashlib.sha256(b"search-0").hexdigest(),
    )
