"""Recorded runs as video files, one or several in a grid. Needs the ``video`` extra."""

from __future__ import annotations

import errno
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flockesc_env.common.checks import FloatArray, as_callback, as_choice, as_count, as_floats, as_path
from flockesc_env.common.errors import ArgumentError
from flockesc_env.common.files import atomic_write, suffix_of
from flockesc_env.common.progress import Progress
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, Objective
from flockesc_env.models.simulate import Trajectory, as_runs
from flockesc_env.render.colors import FRAME
from flockesc_env.render.dependencies import require_video
from flockesc_env.render.frame import FlockFrame, recorded_frames, shared_view
from flockesc_env.render.options import ColorBy, RenderOptions, as_render_options
from flockesc_env.render.titles import policy_title

_FORMATS: dict[str, dict[str, Any]] = {
    ".mp4": {"codec": "libx264", "quality": 6},
    ".gif": {
        "codec": "gif",
        "pix_fmt_out": "pal8",
        # One palette for all frames, and only the changes of each frame: small files without flicker.
        # It repeats forever and rests 2 s on its last frame.
        "output_params": [
            *("-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none"),
            *("-loop", "0", "-final_delay", "200"),
        ],
    },
}
"""Options of ffmpeg by the suffix of the file."""

_MAX_FRAMES = 10_000_000


def write_video(
    runs: Trajectory | Sequence[tuple[str, Trajectory]],
    path: str | Path,
    *,
    fps: int | None = None,
    speed: float = 1.0,
    options: RenderOptions | None = None,
    objective: Objective = "mean",
    progress: Progress | None = None,
) -> None:
    """Write a video of runs in a grid, side by side if they are two, all at the same scale.

    The last picture of a run stays until the longest run ends. The new file replaces an older one when it is
    complete.

    Args:
        runs: one run, shown under the name of the file, or a list of names and runs.
        path: a file that ends in ``.mp4`` or ``.gif``.
        fps: frames per second; ``None``: 20, or 10 in a ``.gif``, which compresses less.
        speed: seconds of the model per second of the video.
        options: what the pictures show; ``size`` is the width of one run. ``None``: agents are colored by
            range if the ranges differ, and by component otherwise; the size is 512, or 400 in a ``.gif``.
        objective: the objective J in the pictures; see ``EnvOptions``.
        progress: called with (frames written, all frames). If it raises an exception, no file is written.

    Raises:
        ArgumentError: if an argument has a wrong type or value; it names the argument.
        ScenarioError: if the options do not fit a flock.
        DependencyNotInstalled: if pygame or imageio-ffmpeg is missing.
        OSError: if the file cannot be written; an older file stays as it was.
    """
    path = as_path(path)
    chosen = None if options is None else as_render_options(options)
    as_choice(objective, "objective", FLOCK_OBJECTIVES)
    suffix = suffix_of(path)
    if suffix not in _FORMATS:
        raise ArgumentError("path", f"a file that ends in {' or '.join(_FORMATS)}", path)
    if not path.parent.is_dir():
        raise ArgumentError("path", "a file in a folder that exists", path)
    default_fps, size = (10, 400) if suffix == ".gif" else (20, 512)
    fps = as_count(default_fps if fps is None else fps, "fps")
    pace = float(as_floats(speed, "speed", ()))
    if pace <= 0:
        raise ArgumentError("speed", "a number above 0", pace)
    runs = as_runs([(path.stem, runs)] if isinstance(runs, Trajectory) else runs)
    progress = as_callback(progress)
    options = _with_scale(RenderOptions(color=_telling(runs), size=size) if chosen is None else chosen, runs)
    for _, run in runs:
        options.selected(run.scenario.num_agents)
    require_video("pygame", "imageio_ffmpeg")
    import imageio_ffmpeg  # type: ignore[import-untyped]

    from flockesc_env.render.flock import draw_flock
    from flockesc_env.render.viewer import grid_shape, tiled

    times = np.arange(_count_frames(runs, pace, fps)) * pace / fps
    view = shared_view([run for _, run in runs]) if len(runs) > 1 else None
    titles = [policy_title(name, run.scenario.neighbor_rule.unit) for name, run in runs]
    films = [_frames(run, objective, times.tolist(), view) for _, run in runs]
    columns, rows = grid_shape(len(runs))
    film_size = columns * options.size, rows * options.size
    with TemporaryDirectory() as folder:
        film = str(Path(folder, f"film{suffix}"))
        writer = imageio_ffmpeg.write_frames(
            film,
            film_size,
            fps=fps,
            macro_block_size=1,
            ffmpeg_log_level="error",  # ffmpeg warns of every GIF that it has colors twice
            **_FORMATS[suffix],
        )
        with closing(writer):  # waits for ffmpeg
            writer.send(None)  # starts ffmpeg
            for done, frames in enumerate(zip(*films, strict=True), 1):
                pictures = [
                    draw_flock(frame, options, title) for frame, title in zip(frames, titles, strict=True)
                ]
                for picture in pictures[1:]:
                    picture[:2] = picture[:, :2] = FRAME
                try:
                    writer.send(tiled(pictures))
                except OSError:
                    break  # ffmpeg has ended
                if progress is not None:
                    progress(done, len(times))
        _check_film(film, len(times))
        with Path(film).open("rb") as source, atomic_write(path) as file:
            shutil.copyfileobj(source, file)


def _check_film(film: str, expected: int) -> None:
    """Check that a film has all frames: imageio-ffmpeg does not say whether ffmpeg failed."""
    import imageio_ffmpeg

    try:
        found, _ = imageio_ffmpeg.count_frames_and_secs(film)
    except RuntimeError:
        found = 0
    if found != expected:
        raise OSError(errno.EIO, f"ffmpeg wrote {found} of {expected} frames", film)


def _count_frames(runs: Sequence[tuple[str, Trajectory]], pace: float, fps: int) -> int:
    last = max(float(run.times[-1]) for _, run in runs)
    with np.errstate(over="ignore"):
        count = np.float64(last) / pace * fps
    if not count < _MAX_FRAMES:
        raise ArgumentError("fps", f"fewer than {_MAX_FRAMES} frames at speed {pace}", f"{count:g} frames")
    return round(count) + 1


def _telling(runs: Sequence[tuple[str, Trajectory]]) -> ColorBy:
    """Return what the colors show: the range, if it differs between runs, agents or times."""
    first = runs[0][1].interaction_ranges.flat[0]
    return "range" if any((run.interaction_ranges != first).any() for _, run in runs) else "component"


def _with_scale(options: RenderOptions, runs: Sequence[tuple[str, Trajectory]]) -> RenderOptions:
    """Return the options with one color scale for all runs."""
    if options.largest_range is not None:
        return options
    return replace(options, largest_range=max(float(run.interaction_ranges.max()) for _, run in runs))


def _frames(
    run: Trajectory, objective: str, times: Iterable[float], view: FloatArray | None
) -> Iterator[FlockFrame]:
    """Yield the frames of a run at ascending times in s, in a view; after its end, the last frame."""
    frames = enumerate(recorded_frames(run, objective))
    step, frame = next(frames)
    for time in times:
        wanted = min(round(time / run.scenario.time_step), run.scenario.num_steps)
        while step < wanted:
            step, frame = next(frames)
        yield frame if view is None else replace(frame, view=view)
