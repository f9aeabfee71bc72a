"""Recorded runs as video files, one or several in a grid. Needs the ``video`` extra."""

import errno
import shutil
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flockesc_env.common.checks import as_callback, as_count, as_path
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.common.files import atomic_write, suffix_of
from flockesc_env.common.progress import Progress
from flockesc_env.models.simulate import Trajectory, as_runs
from flockesc_env.render.frames import (
    as_size,
    enclose,
    policy_kind,
    policy_title,
    recorded_frame,
    recorded_view,
)
from flockesc_env.render.palette import LIGHT, rgb
from flockesc_env.render.viewer import grid_shape, tiled

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

_COLORS = {"fixed": LIGHT.fixed, "rule": LIGHT.others[0], "learned": LIGHT.learned}

REST = 3.0
"""Seconds from the last change of a ring to the end of a video."""


def write_video(
    runs: Trajectory | Sequence[tuple[str, Trajectory]],
    path: str | Path,
    *,
    fps: int | None = None,
    size: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a video of runs in real time and in a grid, side by side if they are two, all at the same scale.

    The view does not move. The video ends ``REST`` seconds after the last run reached its lowest mean
    predator distance. The dotted ring shows that distance of the best fixed range among the runs.
    The new file replaces an older one when it is complete.

    Args:
        runs: one run, shown under the name of the file, or a list of names and runs.
        path: a file that ends in ``.mp4`` or ``.gif``.
        fps: frames per second; ``None``: 20, or 10 in a ``.gif``, which compresses less.
        size: width and height of one run in pixels; ``None``: 512, or 400 in a ``.gif``.
        progress: called with (frames written, all frames). If it raises an exception, no file is written.
    """
    path = as_path(path)
    suffix = suffix_of(path)
    if suffix not in _FORMATS:
        raise InputError("path", f"a file that ends in {' or '.join(_FORMATS)}", path)
    if not path.parent.is_dir():
        raise InputError("path", "a file in a folder that exists", path)
    default_fps, default_size = (10, 400) if suffix == ".gif" else (20, 512)
    size = as_size(default_size if size is None else size)
    fps = as_count(default_fps if fps is None else fps, "fps")
    runs = as_runs([(path.stem, runs)] if isinstance(runs, Trajectory) else runs)
    progress = as_callback(progress)
    largest = max(float(run.interaction_ranges.max()) for _, run in runs)
    require("video", ["imageio_ffmpeg"])
    import imageio_ffmpeg  # type: ignore[import-untyped]

    from flockesc_env.render.picture import draw_frame  # loads pygame, an extra

    last = max(_end(run) for _, run in runs)
    frames = last * fps
    if not frames < _MAX_FRAMES:
        raise InputError("fps", f"fewer than {_MAX_FRAMES} frames", f"{frames:g} frames")
    count = round(frames) + 1
    views = [recorded_view(run, _step_at(run, last)) for _, run in runs]
    view = enclose(*views)
    titles = [policy_title(name, run.scenario.range_unit) for name, run in runs]
    kinds = [policy_kind(name, run) for name, run in runs]
    fixed = [run for (_, run), kind in zip(runs, kinds, strict=True) if kind == "fixed"]
    best = max(fixed, key=lambda run: float(run.mean_distance.min()), default=None)
    falling = np.full(1, np.nan) if best is None else np.minimum.accumulate(best.mean_distance)
    with TemporaryDirectory() as folder:
        film = str(Path(folder, f"film{suffix}"))
        writer = imageio_ffmpeg.write_frames(
            film,
            tuple(count * size for count in grid_shape(len(runs))),
            fps=fps,
            macro_block_size=1,
            ffmpeg_log_level="error",  # ffmpeg warns of every GIF that it has colors twice
            **_FORMATS[suffix],
        )
        with closing(writer):  # waits for ffmpeg
            writer.send(None)  # starts ffmpeg
            for done in range(1, count + 1):
                pictures, time = [], (done - 1) / fps
                for (_, run), title, kind in zip(runs, titles, kinds, strict=True):
                    frame = recorded_frame(run, _step_at(run, time), view, largest)
                    rival = np.nan if best is None or best is run else falling[_step_at(best, time)]
                    frame = replace(frame, rival=rival, color=_COLORS[kind])
                    pictures.append(draw_frame(frame, size, title))
                for picture in pictures[1:]:
                    picture[:2] = picture[:, :2] = rgb(LIGHT.frame)
                try:
                    writer.send(tiled(pictures))
                except OSError:
                    break  # ffmpeg has ended
                if progress is not None:
                    progress(done, count)
        try:  # imageio-ffmpeg does not say whether ffmpeg failed
            written, _ = imageio_ffmpeg.count_frames_and_secs(film)
        except RuntimeError:
            written = 0
        if written != count:
            raise OSError(errno.EIO, f"ffmpeg wrote {written} of {count} frames", film)
        with Path(film).open("rb") as source, atomic_write(path) as file:
            shutil.copyfileobj(source, file)


def _end(run: Trajectory) -> float:
    """Return the time in s at which a run's video can end: no ring changes after it."""
    if not run.scenario.predators:
        return float(run.times[-1])
    return float(min(run.times[np.nanargmin(run.mean_distance)] + REST, run.times[-1]))


def _step_at(run: Trajectory, time: float) -> int:
    return min(round(time / run.scenario.time_step), run.scenario.num_steps)
