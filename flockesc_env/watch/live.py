"""What a page can run by itself: scenarios and policies, as documents."""

import hashlib
import json
from base64 import b64encode
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np

from flockesc_env.common.errors import InputError
from flockesc_env.common.files import suffix_of
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.network import NetworkPolicy
from flockesc_env.policies.registry import SUFFIX, policy_file
from flockesc_env.policies.rules import FixedRange
from flockesc_env.render.frames import policy_title
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import PRESETS

LARGEST_RANGE: Final = 100.0
"""Range in m within which everybody hears everybody."""

RULES: Final = ("stubborn-leaders", "stubborn-leaders-local", "listen-while-fleeing")
"""Built-in policies that the page runs (``js/policies.js``), besides fixed ranges and networks."""

ENGINE: Final = files("flockesc_env.watch") / "engine"
"""The core in WebAssembly, which ``make engine`` builds."""

FIRST_RANGES: Final = {"torus": 60.0, "ring": LARGEST_RANGE}
"""Ranges in m at first, in scenarios whose best fixed range is not known and that need a long one."""

RANGES: Final = (0, 1, 2, 4, 6, 8, 10, 12, 14, 16, 20, 25, 30, 35, 40, 45, 50, 60, 70, 80, 100)
"""Ranges that the slider offers, the first and the last one included."""

GIVEN: Final = "given"
"""Name of a scenario that is not a preset."""


def has_engine() -> bool:
    """Return whether the package contains the core in WebAssembly."""
    return (ENGINE / "flockesc_wasm.js").is_file()


def page_spec(spec: str, policy: BasePolicy) -> str | None:
    """Return the text by which a page runs a policy that ``spec`` gave, or ``None`` if it cannot.

    A page runs fixed ranges, ``RULES`` and files of a flock's network.
    """
    if isinstance(policy, FixedRange):
        return f"fixed:{policy.interaction_range!r}".removesuffix(".0")
    is_network = isinstance(policy, NetworkPolicy) and isinstance(policy.scenario, FlockScenario)
    return spec if spec in RULES or (is_network and policy_file(spec) is not None) else None


def scenario_document(name: str, scenario: FlockScenario, best: float | None = None) -> dict[str, Any]:
    """Return the document of a preset or of ``GIVEN``, with its best fixed range if that is known."""
    unit = scenario.range_unit
    largest = LARGEST_RANGE if unit == "m" else float(max(scenario.num_agents - 1, 1))
    first = FIRST_RANGES.get(name, largest / 10) if best is None else best
    return {
        "name": name,
        "label": None if name in PRESETS else "given scenario",
        "title": PRESETS[name].description if name in PRESETS else "",
        "isPreset": name in PRESETS,
        "unit": unit,
        "ranges": sorted({*(each for each in RANGES if each < largest), first, largest}),
        "best": best,
        "first": first,
        "json": scenario.to_json(),
        "steered": _steered(scenario),
        "start": None,
    }


def scenario_documents(scenario: FlockScenario, best: dict[str, float]) -> tuple[str, list[dict[str, Any]]]:
    """Return the name of a scenario, a preset's or ``GIVEN``, and the documents of it and of all presets."""
    flocks = {
        name: each.scenario for name, each in PRESETS.items() if isinstance(each.scenario, FlockScenario)
    }
    known = [name for name, flock in flocks.items() if flock == scenario]
    documents = [scenario_document(name, flock, best.get(name)) for name, flock in flocks.items()]
    return (known[0], documents) if known else (GIVEN, [scenario_document(GIVEN, scenario), *documents])


def start_document(run: Trajectory) -> dict[str, Any] | None:
    """Return the given start of a recorded run, or ``None`` if a seed gives it."""
    if not run.is_start_given:
        return None
    return {
        name: b64encode(np.ascontiguousarray(values, "<f8").tobytes()).decode()
        for name, values in (("positions", run.positions[0]), ("velocities", run.velocities[0]))
    }


def file_document(path: Path, spec: str) -> dict[str, Any]:
    """Return the document of a policy file, ``spec`` in addresses."""
    content = path.read_bytes()
    return {
        "spec": spec,
        "title": policy_title(path.stem if suffix_of(spec) == SUFFIX else spec),
        "file": spec,
        "sha256": hashlib.sha256(content).hexdigest(),
        "data": b64encode(content).decode(),
    }


def _steered(scenario: FlockScenario) -> str | None:
    """Return the scenario with learned predators, or ``None`` where the reader cannot steer them."""
    try:
        return scenario.with_learned_predators().to_json() if scenario.dimension == 2 else None
    except InputError:
        return None


def safe_json(document: Any) -> str:
    """Return a JSON document in which nothing can end the script element around it."""
    text = json.dumps(document, allow_nan=False, separators=(",", ":"))
    return text.replace("&", r"\u0026").replace("<", r"\u003c").replace(">", r"\u003e")
