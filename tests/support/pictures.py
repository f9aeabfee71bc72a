"""Pictures of recorded runs at one time."""

import numpy as np

from flockesc_env.models import LineTrajectory, Trajectory
from flockesc_env.render.frames import LineFrame, recorded_frame, recorded_view
from flockesc_env.render.picture import draw_frame


def draw(run: Trajectory | LineTrajectory, step: int, size: int = 512, title: str = "") -> np.ndarray:
    """Return the picture of a run after ``step`` steps."""
    if isinstance(run, LineTrajectory):
        history = [(t, run.states[t], run.interaction_range if t else 0.0) for t in range(step + 1)]
        return draw_frame(LineFrame(run.scenario, history, run.interaction_range), size, title)
    largest = float(run.interaction_ranges.max())
    return draw_frame(recorded_frame(run, step, recorded_view(run, step), largest), size, title)
