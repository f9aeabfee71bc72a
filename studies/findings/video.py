"""Headline policies on one flock, as a film."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from flockesc_env import record
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.render.options import RenderOptions
from flockesc_env.render.video import write_video
from studies.findings.headlines import Headline

FILE: Final = "figures/policies.gif"
SHOWN: Final = ("per-agent-local", "per-agent-visible-derived", "per-agent-visible-profile")
"""Tasks of the film beside the best fixed range."""


def write(headlines: Sequence[Headline], output: Path) -> None:
    """Write a film of the headline policies of ``SHOWN`` on the first held-out flock."""
    shown, flock = [one for one in headlines if one.task.name in SHOWN], HELD_OUT[0]
    if not shown:
        return
    fixed = f"fixed:{shown[0].best_fixed_range:g}"
    runs = [(fixed, record(None, fixed, flock))]
    runs += [(one.task.name, one.entry.record(flock)) for one in shown]
    (output / FILE).parent.mkdir(parents=True, exist_ok=True)
    write_video(runs, output / FILE, fps=8, options=RenderOptions(size=300, color="range"))
