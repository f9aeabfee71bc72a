"""Writes the playground: ``index.html``, and the files beside it.

Usage: python -m playground FOLDER [ADDRESS]. Link previews need ADDRESS, that of the folder on the web.
"""

import json
import shutil
import sys
from dataclasses import asdict
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from flockesc_env import load_policy, rollout, sweep
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import mean
from flockesc_env.scenario import preset
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.live import file_document, page_spec, scenario_documents
from flockesc_env.watch.page import Content, render

HERE = Path(__file__).parent
ROOT = HERE.parent
BOARD = ROOT / "scoreboard"
LEARNERS = ("search", "search-10x", "searched-rule", "imitation", "schedule", "ppo-10x", "ppo")
"""Learners of the scoreboard whose first policies the page can load."""

PRESET, TASK, HEADLINE = "paper-flock", "per-agent-visible", "per-agent-visible/search-0"
RANGES = (0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 25.0, 30.0, 40.0, 60.0, 100.0)
"""Ranges in m that a reader can guess."""

CANDIDATES, TOUR = range(300), 20
"""The page flies the ``TOUR`` seeds of ``CANDIDATES`` whose objectives are nearest to the means."""

FIRST = 242
"""The seed of the film in the README, one of them."""

DESCRIPTION = "A flock flees from a predator in your browser. How far should each agent listen?"


def main(folder: Path, address: str = "", *, flocks: int = 1000) -> None:
    """Write the playground into a folder, with means over the task's first ``flocks`` flocks."""
    policies = policy_documents()
    for policy in policies:
        target = folder / "policies" / f"{policy['spec']}.npz"
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / policy["file"], target)
    site = folder.parent / "index.html"
    links = {"README": "README.md", "The paper, measured": "paper.md", "Cite": "CITATION.cff"}
    if site.exists():  # the documentation
        links |= {"README": "../index.html", "The paper, measured": "../paper.html"}
        links |= {"Documentation": "../first-policy.html"}
    for name in ["README.md", "CITATION.cff", "docs/paper.md", "docs/learned.gif"]:
        shutil.copyfile(ROOT / name, folder / Path(name).name)
    write_text(folder / "index.html", render([], content(policies, links, address, flocks)))


def content(policies: list[dict[str, Any]], links: dict[str, str], address: str, flocks: int) -> Content:
    """Return the content of the page; ``links``: addresses by their text."""
    scenario = preset(PRESET)
    assert isinstance(scenario, FlockScenario)  # noqa: S101
    measured = json.loads((ROOT / "results" / "robustness" / "results.json").read_text("utf-8"))
    best = {entry["name"]: entry["outcomes"]["J_mean"]["best"]["mean"] for entry in measured["presets"]}
    name, documents = scenario_documents(scenario, best)
    seeds = tour(best[PRESET])
    rivals = [f"fixed:{best[PRESET]:g}", HEADLINE]
    named = [{**each, "title": "learned"} if each["spec"] == HEADLINE else each for each in policies]
    anchors = [f'<a href="{target}">{text}</a>' for text, target in links.items()]
    metadata = {
        "title": "How far should each agent listen?",
        "description": DESCRIPTION,
        "image": f"{address}learned.gif",
    }
    return Content(
        scenarios=documents,
        policies=named,
        start={"scenario": name, "seed": seeds[0], "policies": rivals, "headline": HEADLINE},
        playground={"tour": seeds, **means(flocks)},
        heading="How far should each agent listen?",
        lead="Agents flee from a predator, and align with the neighbors within their range. The ring shows "
        "their mean distance to the predator, the dotted ring that of the best fixed range.",
        head="\n".join(f'<meta property="og:{key}" content="{text}">' for key, text in metadata.items()),
        film='<img src="learned.gif" alt="The best fixed range beside a learned policy">',
        footer=f"flockesc_env: environments whose action is the interaction range. {' '.join(anchors)}",
    )


def tour(best: float) -> list[str]:
    """Return the seeds of the flocks that fly at first, ``FIRST`` and the others in order."""
    fixed = sweep(PRESET, [best], seeds=CANDIDATES).min_mean_distance[0]
    learned = rollout(PRESET, str(BOARD / "search/policies" / f"{TASK}-0.npz"), CANDIDATES).min_mean_distance
    away = abs(fixed - fixed.mean()) + abs(learned - learned.mean())
    nearest = np.sort(np.argsort(away, kind="stable")[:TOUR])
    return [str(seed) for seed in [FIRST, *nearest[nearest != FIRST]]]


def means(flocks: int) -> dict[str, Any]:
    """Return the mean objectives of ``RANGES`` and of the learned policies on the task's held-out flocks."""
    board = json.loads((BOARD / "search" / f"{TASK}.json").read_text("utf-8"))
    first, _ = board["flocks"]
    learned = np.array([policy["objectives"][PRESET] for policy in board["policies"]])[:, :flocks]
    fixed = sweep(PRESET, RANGES, seeds=range(first, first + flocks)).min_mean_distance
    return {
        "ranges": RANGES,
        "fixed": [asdict(mean(values)) for values in fixed],
        "learned": asdict(mean(learned.mean(axis=0))),
        "policies": len(learned),
        "flocks": flocks,
    }


def policy_documents() -> list[dict[str, Any]]:
    """Return the policy files that a page can run. It holds those of searches and of the headline's task."""
    found = []
    for learner in LEARNERS:
        for path in sorted((BOARD / learner / "policies").glob("*-0.npz")):
            if page_spec(str(path), load_policy(path)):
                task = path.stem.removesuffix("-0")
                is_held = learner == "search" or task == TASK
                entry = file_document(path, f"{task}/{learner}-0", task, with_data=is_held)
                found.append({**entry, "label": learner, "file": path.relative_to(ROOT).as_posix()})
    return sorted(found, key=itemgetter("spec"))


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
