"""Videos of recorded runs."""

from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from option_table import small_flock
from pictures import draw

from flockesc_env import simulate
from flockesc_env.render.video import write_video

# imageio leaves the pipes of its reader open until garbage collection.
pytestmark = pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")

SIZE = 160
RUN = simulate(small_flock(), 5.0, seed=0)


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 1, 1), (2, 2, 1), (4, 2, 2)])
def test_runs_become_a_video(tmp_path: Path, suffix: str, count: int, columns: int, rows: int) -> None:
    """A start and 10 steps of 0.05 s; each frame equals ``draw`` up to compression."""
    calls: list[tuple[int, int]] = []
    path = tmp_path / f"runs{suffix}"
    runs = [("first", RUN), ("second", RUN), ("third", RUN), ("fourth", RUN)][:count]
    write_video(runs, path, fps=20, size=SIZE, progress=lambda done, total: calls.append((done, total)))
    assert list(tmp_path.iterdir()) == [path]
    video = np.asarray(iio.imread(path, plugin="FFMPEG" if suffix == ".mp4" else "pillow"))
    assert video.shape == (11, 160 * rows, 160 * columns, 3)
    assert calls == [(done, 11) for done in range(1, 12)]
    for made in (0, 5, 10) if count == 1 else (10,):  # several runs share the view of the end
        errors = [
            np.abs(video[made][:160, :160] - draw(RUN, at, size=SIZE, title="first").astype(int)).mean()
            for at in (made, (made + 5) % 11)
        ]
        assert errors[0] < min(3, errors[1])
