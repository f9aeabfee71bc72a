"""Writes the playground: ``index.html``, and the files beside it.

Usage: python -m playground FOLDER [ADDRESS]. Link previews need ADDRESS, that of the folder on the web.
"""

import json
import shutil
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from flockesc_env import sweep
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import mean
from flockesc_env.policies.registry import policy_file
from flockesc_env.scenario import preset
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.live import RANGES, file_document, scenario_documents
from flockesc_env.watch.page import Content, render

HERE = Path(__file__).parent
ROOT = HERE.parent
BOARD = ROOT / "scoreboard"
PRESET, TASK, HEADLINE = "paper-flock", "per-agent-visible", "per-agent-visible/search"

FIRST = 30
"""The seed of the first flock. On it, no offered range is better than the best one of the means."""

DESCRIPTION = "A flock flees from a predator in your browser. How far should each agent listen?"


def main(folder: Path, address: str = "", *, flocks: int = 1000) -> None:
    """Write the playground into a folder, with means over the task's first ``flocks`` flocks."""
    site = folder.parent / "index.html"
    links = {"README": "README.md", "The paper, measured": "paper.md", "Cite": "CITATION.cff"}
    if site.exists():  # the documentation
        links |= {"README": "../index.html", "The paper, measured": "../paper.html"}
        links |= {"Documentation": "../first-policy.html"}
    folder.mkdir(parents=True, exist_ok=True)
    for name in ["README.md", "CITATION.cff", "docs/paper.md", "docs/learned.gif"]:
        shutil.copyfile(ROOT / name, folder / Path(name).name)
    write_text(folder / "index.html", render([], content(links, address, flocks)))


def content(links: dict[str, str], address: str, flocks: int) -> Content:
    """Return the content of the page; ``links``: addresses by their text."""
    scenario = preset(PRESET)
    assert isinstance(scenario, FlockScenario)  # noqa: S101
    measured = json.loads((ROOT / "results" / "robustness" / "results.json").read_text("utf-8"))
    best = {entry["name"]: entry["outcomes"]["J_mean"]["best"]["mean"] for entry in measured["presets"]}
    name, documents = scenario_documents(scenario, best)
    rivals = [f"fixed:{best[PRESET]:g}", HEADLINE]
    file = policy_file(HEADLINE)
    assert file  # noqa: S101, part of the package
    anchors = [f'<a href="{target}">{text}</a>' for text, target in links.items()]
    metadata = {
        "title": "How far should each agent listen?",
        "description": DESCRIPTION,
        "image": f"{address}learned.gif",
    }
    return Content(
        scenarios=documents,
        policies=[{**file_document(file, HEADLINE), "title": "Learned: each decides"}],
        start={"scenario": name, "seed": str(FIRST), "policies": rivals, "headline": HEADLINE},
        playground=means(best[PRESET], flocks),
        heading="How far should each agent listen?",
        lead="The orange predator hunts. Each agent turns to the mean heading of all it hears. "
        "Guess the range that keeps them farthest away.",
        head="\n".join(f'<meta property="og:{key}" content="{text}">' for key, text in metadata.items()),
        film='<img src="learned.gif" alt="The best fixed range beside a learned policy">',
        footer=f"flockesc_env: environments whose action is the interaction range. {' '.join(anchors)}",
    )


def means(best: float, flocks: int) -> dict[str, Any]:
    """Return the mean objectives of ``RANGES`` and of the learned policies on the task's held-out flocks.

    ``alike`` are the ranges that are not measurably worse than the best one, flock by flock. ``scatter`` is
    the standard deviation of the best one over flocks.
    """
    board = json.loads((BOARD / "search" / f"{TASK}.json").read_text("utf-8"))
    first, _ = board["flocks"]
    learned = np.array([policy["objectives"][PRESET] for policy in board["policies"]])[:, :flocks]
    fixed = sweep(PRESET, RANGES, seeds=range(first, first + flocks)).min_mean_distance
    chosen = fixed[RANGES.index(int(best))]
    return {
        "ranges": RANGES,
        "fixed": [asdict(mean(values)) for values in fixed],
        "learned": asdict(mean(learned.mean(axis=0))),
        "alike": [rho for rho, row in zip(RANGES, fixed, strict=True) if mean(row - chosen).high >= 0],
        "scatter": float(chosen.std(ddof=1)),
        "policies": len(learned),
        "flocks": flocks,
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
