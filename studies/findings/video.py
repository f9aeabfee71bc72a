"""Headline policies on one flock, as a video."""

from __future__ import annotations

from pathlib import Path

from flockesc_env import load_policy, record
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.render.options import RenderOptions
from flockesc_env.render.video import write_video
from studies.findings.results import FIGURES, load_study

VIDEO_FILE = "policies.gif"
SHOWN = ("per-agent-local-profile", "per-agent-visible-derived", "per-agent-visible-profile")
"""Settings of the video besides the best fixed range."""


def record_video(results: Path) -> Path:
    """Write a video of the best policies of ``SHOWN`` on the first held-out flock; return the file."""
    flock = HELD_OUT[0]
    studies = [load_study(results / setting) for setting in SHOWN]
    fixed = f"fixed:{studies[0].best_fixed_range:g}"
    runs = [(fixed, record(None, fixed, flock))]
    runs += [(study.setting, load_policy(study.file()).record(flock)) for study in studies]
    path = results / FIGURES / VIDEO_FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    write_video(runs, path, fps=8, options=RenderOptions(size=300, color="range"))
    return path
