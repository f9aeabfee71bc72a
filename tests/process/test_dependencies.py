"""Licenses and sources of the crates: one registry, and only licenses that deny.toml allows."""

from __future__ import annotations

import json
import re
import subprocess
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


@cache
def crates() -> list[dict[str, Any]]:
    """Return all crates of Cargo.lock for this platform, including the workspace's own."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--offline"]
    platform = ["--filter-platform", "x86_64-unknown-linux-gnu"]
    done = subprocess.run([*command, *platform], cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S603
    packages: list[dict[str, Any]] = json.loads(done.stdout)["packages"]
    return packages


def is_allowed(expression: str, allowed: set[str]) -> bool:
    """Return whether an SPDX expression (or the older form with slashes) is satisfied."""
    alternatives = re.split(r"\s+(?:OR|or)\s+|\s*/\s*", expression)
    if "(" in expression:
        parts = re.split(r"\s+AND\s+(?![^(]*\))", expression)
        return all(is_allowed(part.strip("() "), allowed) for part in parts)
    return any(all(name in allowed for name in re.split(r"\s+AND\s+", part)) for part in alternatives)


def test_licenses() -> None:
    allowed = set(tomllib.loads((ROOT / "deny.toml").read_text())["licenses"]["allow"])
    refused = {crate["name"] for crate in crates() if not is_allowed(crate["license"], allowed)}
    assert not refused
    assert len(crates()) > 50
    assert not is_allowed("MIT AND GPL-3.0", allowed)
    assert not is_allowed("(MIT OR Apache-2.0) AND GPL-3.0", allowed)


def test_sources() -> None:
    """All crates except the workspace's own come from the registry."""
    own = {crate["name"] for crate in crates() if crate["source"] is None}
    assert own == {"flockesc-core", "flockesc-kernels", "flockesc-peers", "flockesc-py"}
    others = {crate["source"].partition("+")[0] for crate in crates() if crate["source"]}
    assert others == {"registry"}
