"""Headline policies on one flock, side by side, as a video."""

from __future__ import annotations

from pathlib import Path

from flockesc_env import load_policy, record
from flockesc_env.render.options import RenderOptions
from flockesc_env.render.video import write_video
from studies.learned.results import FIGURES, load_study
from training.seeds import HELD_OUT

VIDEO_FILE = "policies.gif"
SHOWN = {
    "per-agent-local-profile": "seen within 30 m, profile",
    "per-agent-visible-derived": "always seen, blind",
    "per-agent-visible-profile": "always seen, profile",
}
"""Settings of the video besides the best fixed range, with their titles."""


def record_video(results: Path) -> Path:
    """Write a video of the best policies of ``SHOWN`` on the first held-out flock; return the file."""
    flock = HELD_OUT[0]
    studies = {title: load_study(results / setting) for setting, title in SHOWN.items()}
    rho = next(iter(studies.values())).best_fixed_range
    runs = [(f"best fixed range, {rho:g} m", record(None, f"fixed:{rho}", flock))]
    runs += [(title, load_policy(study.file()).record(flock)) for title, study in studies.items()]
    path = results / FIGURES / VIDEO_FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    write_video(runs, path, fps=8, options=RenderOptions(size=300, color="range"))
    return path
