"""Writes the data of the playground: ``worlds.json`` with presets and a learned policy, and ``theme.css``.

Usage: python -m playground.worlds FOLDER
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from flockesc_env import PRESETS, FlockScenario, NetworkPolicy, load_policy
from flockesc_env.common.errors import OptionError, ScenarioError
from flockesc_env.common.files import write_text
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import EnvOptions, View
from flockesc_env.watch.page import theme

ROOT = Path(__file__).parents[1]
POLICY = "results/learned/per-agent-visible-derived/policies/search-7.npz"
ROBUSTNESS = ROOT / "results" / "robustness" / "results.json"

MAX_RANGE = 100.0
"""Range in m within which everybody hears everybody."""

DEFAULT_BEST = 12.0
"""Best fixed range of the paper's flock, for presets whose best range is not measured."""


def write(folder: Path) -> None:
    """Write both files into a folder."""
    write_text(folder / "worlds.json", json.dumps(document()))
    write_text(folder / "theme.css", theme() + "\n")


def document() -> dict[str, Any]:
    """Return the presets of the flock and the learned policy."""
    best = best_ranges()
    flocks = {name: flock for name, (_, flock) in PRESETS.items() if isinstance(flock, FlockScenario)}
    worlds = [world(name, flock, best.get(name, DEFAULT_BEST)) for name, flock in flocks.items()]
    return {"worlds": sorted(worlds, key=lambda entry: int(entry["dimension"])), "policy": policy()}


def best_ranges() -> dict[str, float]:
    """Return the best fixed range of every measured preset."""
    measured = json.loads(ROBUSTNESS.read_text("utf-8"))["presets"]
    return {preset["name"]: preset["outcomes"]["J_mean"]["best"]["mean"] for preset in measured}


def world(name: str, scenario: FlockScenario, best: float) -> dict[str, Any]:
    """Return the entry of a preset. ``steered`` is its scenario with predators that the reader steers."""
    options, plays_policy = options_of(scenario)
    return {
        "name": name,
        "title": PRESETS[name].description,
        "unit": scenario.neighbor_rule.unit,
        "maxRange": MAX_RANGE if scenario.neighbor_rule.unit == "m" else float(scenario.num_agents),
        "best": best,
        "dimension": scenario.dimension,
        "options": options.to_core(View.AGENT),
        "playsPolicy": plays_policy,
        "scenario": scenario.to_json(),
        "steered": steered(scenario),
    }


def options_of(scenario: FlockScenario) -> tuple[EnvOptions, bool]:
    """Return options with one range per agent and step, and whether the learned policy can act."""
    if scenario.neighbor_rule.unit == "m":
        chosen: dict[str, Any] = {**load_policy(ROOT / POLICY).options, "steps_per_action": 1}
        options = EnvOptions(**chosen)
        try:
            FlockBatch(scenario, options, view=View.AGENT)
        except (OptionError, ScenarioError):
            pass
        else:
            return options, True
    return EnvOptions(max_range=float(scenario.num_agents)), False


def steered(scenario: FlockScenario) -> str | None:
    """Return the scenario with learned predators, or None where no policy can control them."""
    try:
        return scenario.with_learned_predators().to_json() if scenario.dimension == 2 else None
    except ScenarioError:
        return None


def policy() -> dict[str, Any]:
    """Return the learned policy. Its action holds for ``stepsPerAction`` model steps."""
    stored = load_policy(ROOT / POLICY)
    network, options = stored.policy, EnvOptions(**stored.options)
    assert isinstance(network, NetworkPolicy)  # noqa: S101
    return {
        "file": POLICY,
        "architecture": network.architecture.to_core(),
        "parameters": network.parameters.tolist(),
        "ranges": [options.min_range, options.max_range],
        "stepsPerAction": options.steps_per_action,
    }


if __name__ == "__main__":
    write(Path(sys.argv[1]))
