"""Videos of recorded runs, and of the recorders of Gymnasium and stable-baselines3."""

from pathlib import Path

import gymnasium
import imageio.v3 as iio
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo
from option_table import small_flock

from flockesc_env import LineScenario, simulate
from flockesc_env.render import RenderOptions, draw
from flockesc_env.render.video import write_video

# imageio leaves the pipes of its reader open until garbage collection.
pytestmark = pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")

FLOCK_ID = "flockesc_env:flockesc/FlockEscape-v1"
LINE_ID = "flockesc_env:flockesc/LineEscape-v1"
SMALL = RenderOptions(size=160)
RUN = simulate(small_flock(), 5.0, seed=0)


def frames(path: Path) -> np.ndarray:
    plugin = "FFMPEG" if path.suffix == ".mp4" else "pillow"
    return np.asarray(iio.imread(path, plugin=plugin))


def only(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
@pytest.mark.parametrize(("count", "columns", "rows"), [(1, 1, 1), (2, 2, 1), (4, 2, 2)])
def test_runs_become_a_video(tmp_path: Path, suffix: str, count: int, columns: int, rows: int) -> None:
    """A start and 10 steps of 0.05 s; each frame equals ``draw`` up to compression."""
    calls: list[tuple[int, int]] = []
    path = tmp_path / f"runs{suffix}"
    runs = [("first", RUN), ("second", RUN), ("third", RUN), ("fourth", RUN)][:count]
    write_video(runs, path, fps=20, options=SMALL, progress=lambda done, total: calls.append((done, total)))
    assert only(tmp_path) == path
    video = frames(path)
    assert video.shape == (11, 160 * rows, 160 * columns, 3)
    assert calls == [(done, 11) for done in range(1, 12)]
    for made in (0, 5, 10) if count == 1 else (10,):  # several runs share the view of the end
        expected = draw(RUN, made, options=SMALL, title="first").astype(int)
        errors = np.abs(video[made][:160, :160] - expected)
        assert errors.mean() < 3
        assert (
            errors.mean()
            < np.abs(video[made][:160, :160] - draw(RUN, (made + 5) % 11, options=SMALL).astype(int)).mean()
        )


@pytest.mark.parametrize("name", [FLOCK_ID, LINE_ID])
def test_gymnasium_records(tmp_path: Path, name: str) -> None:
    scenario = small_flock(num_steps=40) if name == FLOCK_ID else LineScenario(num_agents=20)
    env = gymnasium.make(name, scenario=scenario, render_mode="rgb_array", render_options=SMALL)
    env = RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda _: True)
    env.action_space.seed(0)
    env.reset(seed=0)
    count, has_ended = 1, False
    while not has_ended:
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        count, has_ended = count + 1, terminated or truncated
    env.close()
    video = frames(only(tmp_path / "videos"))
    assert video.shape[1:] == (160, 160, 3)
    assert len(video) in {count - 1, count}  # moviepy 2.2 may drop the last frame by rounding
