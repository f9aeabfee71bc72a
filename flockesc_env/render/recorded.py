"""Pictures of recorded runs."""

from __future__ import annotations

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_choice, as_count, as_text
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, Objective
from flockesc_env.models.simulate import LineTrajectory, Trajectory, as_run
from flockesc_env.render.dependencies import require_video
from flockesc_env.render.options import RenderOptions, as_render_options


def draw(
    run: Trajectory | LineTrajectory,
    step: int,
    *,
    options: RenderOptions | None = None,
    title: str = "",
    objective: Objective = "mean",
) -> NDArray[np.uint8]:
    """Return a picture of a recorded run, shape (size, size, 3).

    Args:
        run: the run.
        step: the time, as a number of steps from 0 to T.
        options: what the picture shows; ``None`` takes the defaults.
        title: text above the picture.
        objective: the objective J in the picture of a flock; see ``EnvOptions``.

    Raises:
        ArgumentError: if the run has no such step, or an argument has a wrong type.
        ScenarioError: if the options do not fit the flock.
        DependencyNotInstalled: if pygame is missing.
    """
    as_run(run, "run")
    options, title = as_render_options(options), as_text(title, "title")
    as_choice(objective, "objective", FLOCK_OBJECTIVES)
    last = run.steps if isinstance(run, LineTrajectory) else run.scenario.num_steps
    step = as_count(step, "step", least=0, most=last)
    require_video("pygame")
    if isinstance(run, LineTrajectory):
        from flockesc_env.render.line import draw_line, recorded_line

        return draw_line(recorded_line(run, step), options, title)
    from flockesc_env.render.flock import draw_flock
    from flockesc_env.render.frame import recorded_frames

    return draw_flock(next(islice(recorded_frames(run, objective), step, None)), options, title)
