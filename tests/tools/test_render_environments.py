"""Rendering of environments: every mode in every interface, with and without a display."""

from __future__ import annotations

import signal
import subprocess
import sys
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from option_table import small_flock

from flockesc_env import (
    EpisodeError,
    FlockEscapeEnv,
    FlockParallelEnv,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    ScenarioError,
    parallel_env,
    simulate,
    simulate_line,
)
from flockesc_env.render import RenderOptions, draw
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

SIZE = 512
FLOCK_ID = "flockesc_env:flockesc/FlockEscape-v0"
LINE_ID = "flockesc_env:flockesc/LineEscape-v0"

SINGLE = {
    "flock": lambda **options: FlockEscapeEnv(small_flock(), **options),
    "space": lambda **options: FlockEscapeEnv(small_flock(3), **options),
    "line": lambda **options: LineEscapeEnv(LineScenario(num_agents=30), **options),
    "parallel": lambda **options: parallel_env(small_flock(), **options),
}
BATCHED = {
    "vector": lambda **options: FlockVectorEnv(3, small_flock(), **options),
    "sb3 flocks": lambda **options: FlockVecEnv(3, small_flock(), **options),
    "sb3 agents": lambda **options: AgentVecEnv(3, small_flock(), **options),
}
single = pytest.mark.parametrize("interface", SINGLE)
every = pytest.mark.parametrize("interface", [*SINGLE, *BATCHED])


def make(interface: str, **options: Any) -> Any:
    return (SINGLE | BATCHED)[interface](**options)


def reset(env: Any, seed: int = 0) -> None:
    if hasattr(env, "env_is_wrapped"):  # SB3
        env.seed(seed)
        env.reset()
    else:
        env.reset(seed=seed)


def step(env: Any, value: float = -0.8) -> None:
    if isinstance(env, FlockParallelEnv):
        env.step({agent: np.array([value], np.float32) for agent in env.agents})
    else:
        slots = (env.num_envs, 1) if hasattr(env, "num_envs") else (1,)
        env.step(np.full(slots, value, np.float32))


@single
def test_pictures_follow_the_episode(interface: str) -> None:
    env = make(interface, render_mode="rgb_array")
    reset(env)
    pictures = [env.render()]
    for _ in range(3):
        step(env)
        pictures.append(env.render())
    assert {(picture.shape, picture.dtype.name) for picture in pictures} == {((SIZE, SIZE, 3), "uint8")}
    for before, after in pairwise(pictures):
        assert not np.array_equal(before, after)
    np.testing.assert_array_equal(env.render(), pictures[-1])
    reset(env)
    np.testing.assert_array_equal(env.render(), pictures[0])
    env.close()
    env.close()


@pytest.mark.parametrize("interface", BATCHED)
def test_a_batch_shows_every_flock(interface: str) -> None:
    env = make(interface, render_mode="rgb_array")
    twin = make("parallel" if interface == "sb3 agents" else "flock", render_mode="rgb_array")
    reset(env, 4)
    step(env)
    pictures = env.render() if interface == "vector" else env.get_images()
    assert len(pictures) == 3
    for flock, picture in enumerate(pictures):
        reset(twin, 4 + flock)
        step(twin)
        np.testing.assert_array_equal(picture, twin.render())
    if interface != "vector":
        assert env.render().shape == (2 * SIZE, 2 * SIZE, 3)
    env.close()
    env.close()


@pytest.mark.parametrize("interface", ["flock", "parallel", "line"])
def test_environments_and_recorded_runs_look_the_same(interface: str) -> None:
    env = make(interface, action_mode="range", render_mode="rgb_array")
    env.reset(seed=3)
    ranges = {"flock": np.array([7.0]), "parallel": np.arange(5.0, 10.0), "line": np.array([0.1])}[interface]
    run: Any = simulate_line if interface == "line" else simulate
    run = run(env.scenario, ranges if interface == "parallel" else ranges[0], seed=3)
    for made in range(min(run.steps if interface == "line" else run.scenario.num_steps, 20)):
        np.testing.assert_array_equal(env.render(), draw(run, made))
        each = zip(getattr(env, "agents", ()), ranges, strict=False)
        env.step({agent: [rho] for agent, rho in each} if interface == "parallel" else ranges)


@every
def test_the_window_shows_the_same_pixels_as_arrays(interface: str) -> None:
    import pygame

    env, twin = make(interface, render_mode="human"), make(interface, render_mode="rgb_array")
    try:
        for each in (env, twin):
            reset(each)
        shown = [pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)]
        pictures = [twin.render()]
        for each in (env, twin):
            step(each)
        shown.append(pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2))
        pictures.append(twin.render())
        assert env.render() is None
        for screen, picture in zip(shown, pictures, strict=True):
            first = picture[0] if interface == "vector" else picture
            np.testing.assert_array_equal(
                screen[: first.shape[0], : first.shape[1]][:SIZE, :SIZE], first[:SIZE, :SIZE]
            )
    finally:
        env.close()
    assert pygame.display.get_surface() is None
    env.close()


@every
def test_bad_modes_options_and_calls_are_refused(interface: str) -> None:
    with pytest.raises(ScenarioError, match="render_mode: expected one of human, rgb_array or None"):
        make(interface, render_mode="ansi")
    with pytest.raises(ScenarioError, match="render_options"):
        make(interface, render_mode="rgb_array", render_options={"size": 512})
    if interface != "line":
        with pytest.raises(ScenarioError, match="agents: expected indices below 5, got 5"):
            make(interface, render_options=RenderOptions(agents=(0, 5)))
    with pytest.raises(EpisodeError, match="render"):
        make(interface, render_mode="rgb_array").render()


@every
def test_without_pygame_the_extra_is_named(interface: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "flockesc-env\[video\]"'):
        make(interface, render_mode="rgb_array")
    make(interface)


def test_a_window_leaves_signals_alone() -> None:
    """SDL would turn SIGTERM into an event, and pools of forked workers would wait forever."""
    script = """
import os, signal
from flockesc_env import FlockEscapeEnv
env = FlockEscapeEnv(render_mode="human")
env.reset(seed=0)
os.kill(os.getpid(), signal.SIGTERM)
"""
    run = subprocess.run([sys.executable, "-c", script], check=False)  # noqa: S603
    assert run.returncode == -signal.SIGTERM
