"""Videos of recorded runs, and of the recorders of Gymnasium and stable-baselines3."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import imageio.v3 as iio
import numpy as np
import pytest
from gymnasium.wrappers import HumanRendering, RecordVideo
from gymnasium.wrappers.vector import RecordVideo as RecordVideoVector
from option_table import small_flock
from pettingzoo.test import render_test
from stable_baselines3.common.vec_env import VecVideoRecorder

import flockesc_env
from flockesc_env import ArgumentError, LineScenario, ScenarioError, simulate, simulate_line
from flockesc_env.render import RenderOptions, draw
from flockesc_env.render.video import write_video
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

# imageio leaves the pipes of its reader open until garbage collection.
pytestmark = pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")

FLOCK_ID = "flockesc_env:flockesc/FlockEscape-v0"
LINE_ID = "flockesc_env:flockesc/LineEscape-v0"
SMALL = RenderOptions(size=160)
RUN = simulate(small_flock(), 5.0, seed=0)
LONG_RUN = simulate(small_flock(3, num_steps=20), 5.0, seed=0)


def frames(path: Path) -> np.ndarray:
    plugin = "FFMPEG" if path.suffix == ".mp4" else "pillow"
    return np.asarray(iio.imread(path, plugin=plugin))


def only(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
@pytest.mark.parametrize("count", [1, 2])
def test_runs_become_a_video(tmp_path: Path, suffix: str, count: int) -> None:
    """A start and 10 steps of 0.05 s; each frame equals ``draw`` up to compression."""
    calls: list[tuple[int, int]] = []
    path = tmp_path / f"runs{suffix}"
    runs = [("first", RUN), ("second", RUN)][:count]
    write_video(runs, path, options=SMALL, progress=lambda done, total: calls.append((done, total)))
    assert only(tmp_path) == path
    video = frames(path)
    assert video.shape == (11, 160, 160 * count, 3)
    assert calls == [(done, 11) for done in range(1, 12)]
    for made in (0, 5, 10) if count == 1 else (10,):  # several runs share the view of the end
        expected = draw(RUN, made, options=SMALL, title="first").astype(int)
        errors = np.abs(video[made][:, :160] - expected)
        assert errors.mean() < 3
        assert (
            errors.mean()
            < np.abs(video[made][:, :160] - draw(RUN, (made + 5) % 11, options=SMALL).astype(int)).mean()
        )


@pytest.mark.parametrize(
    ("fps", "speed", "count"), [(20, 1.0, 21), (10, 1.0, 11), (20, 2.0, 11), (60, 0.5, 121)]
)
def test_time_passes_at_the_speed_asked_for(tmp_path: Path, fps: int, speed: float, count: int) -> None:
    path = tmp_path / "runs.mp4"
    write_video([("", RUN), ("", LONG_RUN)], path, fps=fps, speed=speed, options=SMALL)
    assert len(frames(path)) == count
    assert iio.immeta(path, plugin="FFMPEG")["fps"] == fps


def test_a_shorter_run_waits(tmp_path: Path) -> None:
    path = tmp_path / "runs.gif"
    write_video([("", RUN), ("", LONG_RUN)], path, options=SMALL)
    video = frames(path)
    np.testing.assert_array_equal(video[10][:, :160], video[20][:, :160])
    assert (video[10][:, 160:] != video[20][:, 160:]).any()


@pytest.mark.parametrize(
    ("field", "arguments"),
    [
        ("path", {"path": "runs.avi"}),
        ("path", {"path": "nowhere/runs.mp4"}),
        ("runs[1]", {"runs": [("flock", RUN), ("line", simulate_line(LineScenario(), 0.1, seed=0))]}),
        ("agents", {"options": RenderOptions(agents=(5,))}),
    ],
)
def test_bad_arguments_are_refused(tmp_path: Path, field: str, arguments: dict[str, Any]) -> None:
    given = {"runs": [("", RUN)], "path": "runs.mp4", "options": SMALL, **arguments}
    with pytest.raises((ArgumentError, ScenarioError)) as refused:
        write_video(given["runs"], tmp_path / given["path"], options=given["options"])
    assert refused.value.field == field
    assert not list(tmp_path.iterdir())


def test_a_stopped_video_leaves_the_older_file(tmp_path: Path) -> None:
    path = tmp_path / "runs.mp4"
    path.write_bytes(b"older")

    def stop(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video([("", RUN)], path, options=SMALL, progress=stop)
    assert only(tmp_path).read_bytes() == b"older"


@pytest.mark.parametrize("name", [FLOCK_ID, LINE_ID])
def test_gymnasium_records(tmp_path: Path, name: str) -> None:
    scenario = small_flock() if name == FLOCK_ID else LineScenario(num_agents=20)
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


def test_gymnasium_records_vectors(tmp_path: Path) -> None:
    envs = gymnasium.make_vec(
        FLOCK_ID, num_envs=4, scenario=small_flock(), render_mode="rgb_array", render_options=SMALL
    )
    envs = RecordVideoVector(
        envs, str(tmp_path / "videos"), video_length=5, step_trigger=lambda step: step == 0
    )
    envs.reset(seed=0)
    for _ in range(6):
        envs.step(envs.action_space.sample())
    envs.close()
    video = frames(only(tmp_path / "videos"))
    assert video.shape[0] == 6
    assert video[0].std() > 0


@pytest.mark.parametrize("maker", [FlockVecEnv, AgentVecEnv])
def test_sb3_records(tmp_path: Path, maker: Any) -> None:
    """One picture per flock; the pictures of four flocks form a square for any number of agents."""
    env = maker(4, small_flock(), render_mode="rgb_array", render_options=SMALL)
    recorder = VecVideoRecorder(
        env, str(tmp_path), record_video_trigger=lambda step: step == 0, video_length=12
    )
    recorder.seed(0)
    recorder.reset()
    for _ in range(13):
        recorder.step(np.zeros((env.num_envs, 1), np.float32))
    recorder.close()
    path = only(tmp_path)
    assert frames(path).shape == (13, 320, 320, 3)
    assert iio.immeta(path, plugin="FFMPEG")["fps"] == env.metadata["render_fps"] == 20


@pytest.mark.parametrize("maker", [flockesc_env.env, flockesc_env.raw_env])
def test_pettingzoo_renders(maker: Any) -> None:
    render_test(lambda render_mode: maker(small_flock(), render_mode=render_mode, render_options=SMALL))


def test_gymnasium_shows_arrays_in_its_own_window() -> None:
    env = HumanRendering(gymnasium.make(FLOCK_ID, scenario=small_flock(), render_mode="rgb_array"))
    for seed in (0, 1):
        env.reset(seed=seed)
        env.step(env.action_space.high)
    env.close()
