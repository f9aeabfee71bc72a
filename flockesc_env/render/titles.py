"""Titles of policies in pictures: "fixed range 12 m", not "fixed:12"."""

from __future__ import annotations

import re
from pathlib import PurePath

from flockesc_env.common.errors import printable
from flockesc_env.common.files import suffix_of
from flockesc_env.policies.registry import NAMES

_LEARNERS = {
    "search": "search",
    "ppo": "PPO",
    "tqc": "TQC",
    "imitation": "imitation",
    "schedule": "schedule",
    "rule": "rule",
}
_RUN = re.compile(rf"({'|'.join(_LEARNERS)})(-[a-z-]+)?-\d+")


def policy_title(name: str, unit: str = "m") -> str:
    """Return how pictures call a policy.

    Args:
        name: a built-in policy, a policy's file, or any other name, which is returned with its control
            characters escaped.
        unit: of a fixed range.
    """
    name = printable(name)
    if name.startswith("fixed:"):
        return f"fixed range {name.removeprefix('fixed:')} {unit}"
    if name in NAMES:
        return "random ranges" if name == "random" else f"rule: {_spaced(name)}"
    is_file = suffix_of(name) == ".npz"
    stem = PurePath(name).stem if is_file else name
    run = _RUN.fullmatch(stem)
    if run:
        return f"learned ({_LEARNERS[run[1]]}{_spaced(run[2] or '')})"
    return f"learned ({stem})" if is_file else name


def _spaced(text: str) -> str:
    return text.replace("-", " ")
