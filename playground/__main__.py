"""Writes the playground: ``index.html``, and the policy files that it reads.

Usage: python -m playground FOLDER
"""

from __future__ import annotations

import json
import shutil
import sys
from operator import itemgetter
from pathlib import Path
from typing import Any

from flockesc_env import load_policy
from flockesc_env.common.files import write_text
from flockesc_env.scenario import preset
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.live import file_document, page_spec, scenario_documents
from flockesc_env.watch.page import Content, render

HERE = Path(__file__).parent
RESULTS = HERE.parent / "results"
BOARD = HERE.parent / "scoreboard"
LEARNERS = ("search", "search-10x", "searched-rule", "imitation", "schedule", "ppo-10x", "ppo")
"""Learners of the scoreboard whose policies the page can load."""

PRESET, SEED = "paper-flock", "242"
"""The flock at first: of the seeds from 0 to 299, the one whose objectives are nearest to the means."""

HEADLINE = "per-agent-visible/search-0"
CHAPTERS = {
    "chapter-nobody": ["fixed:0"],
    "chapter-everybody": ["fixed:100"],
    "chapter-learned": [HEADLINE],
}


def main(folder: Path) -> None:
    """Write the playground into a folder."""
    policies = policy_documents()
    for policy in policies:
        target = folder / "policies" / f"{policy['spec']}.npz"
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(HERE.parent / policy["file"], target)
    write_text(folder / "index.html", render([], content(policies)))


def content(policies: list[dict[str, Any]]) -> Content:
    """Return the content of the page."""
    scenario = preset(PRESET)
    assert isinstance(scenario, FlockScenario)  # noqa: S101
    measured = json.loads((RESULTS / "robustness" / "results.json").read_text("utf-8"))
    best = {entry["name"]: entry["outcomes"]["J_mean"]["best"]["mean"] for entry in measured["presets"]}
    name, documents = scenario_documents(scenario, best)
    return Content(
        scenarios=documents,
        policies=policies,
        start={"scenario": name, "seed": SEED, "policies": [f"fixed:{best[PRESET]:g}"], "headline": HEADLINE},
        playground={"published": published(measured), "chapters": CHAPTERS},
        parts={name: (HERE / f"{name}.html").read_text("utf-8") for name in ("chapters", "predict")},
        heading="How far should each agent listen?",
        lead="A predator flies through a flock. Agents flee from it, and align with the neighbors within "
        "their range. Change the range, and watch how far the flock stays away.",
    )


def published(measured: dict[str, Any]) -> dict[str, Any]:
    """Return the published curve of the objective against the fixed range."""
    (entry,) = (entry for entry in measured["presets"] if entry["name"] == PRESET)
    curve = entry["outcomes"]["J_mean"]["curve"]
    return {
        "scenario": PRESET,
        "flocks": measured["num_flocks"],
        "ranges": entry["grid"]["actions"],
        "mean": [point["mean"] for point in curve],
    }


def policy_documents() -> list[dict[str, Any]]:
    """Return the policy files that a page can run: it holds one per task, and others lie beside it."""
    found = []
    for learner in LEARNERS:
        for path in sorted((BOARD / learner / "policies").glob("*.npz")):
            if page_spec(str(path), load_policy(path)):
                task, _, seed = path.stem.rpartition("-")
                spec = f"{task}/{learner}-{seed}"
                entry = file_document(path, spec, task, with_data=(learner, seed) == ("search", "0"))
                found.append({**entry, "file": path.relative_to(HERE.parent).as_posix()})
    return sorted(found, key=itemgetter("spec"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
