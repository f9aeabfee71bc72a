"""What environments show: the right things at the right places, with or without a display."""

from __future__ import annotations

import copy
import os
import signal
import subprocess
import sys
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from gymnasium.utils.env_checker import check_env
from hypothesis import given
from hypothesis import strategies as st
from option_table import DIMENSIONS, small_flock

import flockesc_env
from flockesc_env import (
    ArgumentError,
    ConstantVelocity,
    EpisodeError,
    FlockEscapeEnv,
    FlockParallelEnv,
    FlockScenario,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    ScenarioError,
    Trajectory,
    parallel_env,
    simulate,
    simulate_line,
)
from flockesc_env.render import RenderOptions, draw
from flockesc_env.render.camera import VIEW_ASPECT, Rect, camera
from flockesc_env.render.colors import ALONE, GRID, PAPER, PREDATOR, component_colors, label_colors
from flockesc_env.render.frame import recorded_frames
from flockesc_env.render.line import line_labels
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

SIZE = 512
VIEW = Rect(0, 0, SIZE, SIZE / VIEW_ASPECT)
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


def near(picture: np.ndarray, at: np.ndarray, color: Any, reach: int = 2) -> bool:
    """Whether a pixel of a color is within ``reach`` px of a point."""
    column, row = np.round(at).astype(int)
    patch = picture[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
    return bool((patch == np.array(color, np.uint8)).all(axis=-1).any())


def still(positions: list[tuple[float, ...]], ranges: Any, **changes: Any) -> Trajectory:
    """A flock of given positions, one step old, that has hardly moved."""
    scenario = FlockScenario(
        num_agents=len(positions), num_steps=1, time_step=1e-6, dimension=len(positions[0]), **changes
    )
    velocities = np.zeros((len(positions), len(positions[0])))
    velocities[:, 0] = 1.0
    return simulate(scenario, ranges, initial_positions=positions, initial_velocities=velocities)


def place(run: Trajectory, point: Any) -> np.ndarray:
    """Where a point of the world is in the last picture of a run."""
    *_, last = recorded_frames(run)
    pixels, _ = camera(last.view, VIEW).project(np.array([point], float))
    return pixels[0]


@single
def test_pictures_follow_the_episode(interface: str) -> None:
    env = make(interface, render_mode="rgb_array")
    reset(env)
    pictures = [env.render()]
    for _ in range(3):
        step(env)
        pictures.append(env.render())
    for picture in pictures:
        assert picture.shape == (SIZE, SIZE, 3)
        assert picture.dtype == np.uint8
        assert picture.flags.writeable
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


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_new_episode_starts_a_new_picture(mode: str) -> None:
    """Nothing of the last episode is left, whoever resets, and a slot left alone keeps its picture."""
    env = FlockVectorEnv(2, small_flock(), autoreset_mode=mode, render_mode="rgb_array")
    env.reset(seed=0)
    for _ in range(10):
        step(env)
    last = env.render()
    if mode == "NextStep":
        step(env)
    elif mode == "Disabled":
        env.reset(options={"reset_mask": np.array([True, False])})
        np.testing.assert_array_equal(env.render()[1], last[1])
    fresh = FlockEscapeEnv(small_flock(), render_mode="rgb_array")
    fresh.reset(seed=flockesc_env.episode_seed(0, 1))
    np.testing.assert_array_equal(env.render()[0], fresh.render())


@pytest.mark.parametrize("per_agent", [False, True])
def test_environments_and_recorded_runs_look_the_same(per_agent: bool) -> None:
    scenario = small_flock(num_steps=20)
    ranges = np.arange(5.0, 10.0) if per_agent else np.array([7.0])
    maker = FlockParallelEnv if per_agent else FlockEscapeEnv
    env = maker(scenario, action_mode="range", render_mode="rgb_array")
    env.reset(seed=3)
    run = simulate(scenario, ranges if per_agent else 7.0, seed=3)
    np.testing.assert_array_equal(env.render(), draw(run, 0))
    for made in range(1, 21):
        env.step(
            {agent: [rho] for agent, rho in zip(env.agents, ranges, strict=True)} if per_agent else ranges
        )
        np.testing.assert_array_equal(env.render(), draw(run, made))


def test_line_environments_and_recorded_runs_look_the_same() -> None:
    scenario = LineScenario(num_agents=30)
    env = LineEscapeEnv(scenario, action_mode="range", render_mode="rgb_array")
    env.reset(seed=3)
    run = simulate_line(scenario, 0.1, seed=3)
    for made in range(run.steps):
        np.testing.assert_array_equal(env.render(), draw(run, made))
        env.step([0.1])
    np.testing.assert_array_equal(env.render(), draw(run, run.steps))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_predator_and_agents_are_where_the_camera_says(dimension: int) -> None:
    depth = (0.0,) * (dimension - 2)
    predator, agents = (30.0, 20.0, *depth), [(80.0, 60.0, *depth), (10.0, 95.0, *depth)]
    run = still(agents, 0.0, predators=(ConstantVelocity(position=predator, velocity=(1.0, 0.0)),))
    picture = draw(run, 1)
    assert near(picture, place(run, predator), PREDATOR)
    assert not near(picture, place(run, (80.0, 20.0, *depth)), PREDATOR, reach=9)

    def is_marked(point: tuple[float, ...]) -> bool:
        column, row = np.round(place(run, point)).astype(int)
        darkest = int(picture[row - 3 : row + 4, column - 3 : column + 4].max(axis=-1).min())
        return darkest < min(GRID) - 5

    assert all(is_marked(agent) for agent in agents)
    assert not is_marked((60.0, 90.0, *depth))


def test_a_mark_points_along_its_velocity() -> None:
    """A dart is symmetric about its velocity, and widest behind its middle."""
    start = FlockScenario(num_agents=1, num_steps=1, time_step=1e-6)
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        ahead = np.array([np.cos(angle), np.sin(angle)])
        run = simulate(start, 0.0, initial_positions=[[70.0, 70.0]], initial_velocities=[ahead])
        column, row = place(run, (70.0, 70.0))
        rows, columns = np.nonzero((draw(run, 1)[: int(VIEW.height)] == ALONE).all(axis=-1))
        offsets = np.stack([columns + 0.5 - column, row - rows - 0.5], axis=1)
        offsets = offsets[np.linalg.norm(offsets, axis=1) < 15]
        along, across = offsets @ ahead, offsets @ (-ahead[1], ahead[0])
        assert abs(across.mean()) < 0.7
        assert np.average(along, weights=across**2) < along.mean() - 1


@given(st.integers(2, 3), st.integers(0, 10_000), st.floats(1.0, 300.0))
def test_the_view_holds_everything_and_never_shrinks(dimension: int, seed: int, rho: float) -> None:
    scenario = FlockScenario(num_agents=12, num_steps=60, dimension=dimension)
    run = simulate(scenario, rho, seed=seed)
    before = None
    for frame in recorded_frames(run):
        points = np.concatenate([frame.moment.positions, frame.moment.predator_positions])
        pixels, scale = camera(frame.view, VIEW).project(points)
        assert (pixels > (VIEW.left, VIEW.top)).all()
        assert (pixels < (VIEW.right, VIEW.bottom)).all()
        assert (scale > 0).all()
        if before is not None:
            assert (frame.view[0] <= before[0]).all()
            assert (frame.view[1] >= before[1]).all()
        before = frame.view


def test_scales_of_both_axes_are_equal() -> None:
    *_, frame = recorded_frames(simulate(FlockScenario(num_steps=40), 10.0, seed=0))
    eye = camera(frame.view, VIEW)
    origin, right, up = eye.project(np.array([(0.0, 0.0), (10.0, 0.0), (0.0, 10.0)]))[0]
    np.testing.assert_allclose(right - origin, (10 * eye.pixels_per_meter, 0.0), atol=1e-9)
    np.testing.assert_allclose(up - origin, (0.0, -10 * eye.pixels_per_meter), atol=1e-9)
    assert np.ptp(frame.view, axis=0)[0] / np.ptp(frame.view, axis=0)[1] == pytest.approx(VIEW_ASPECT)


def test_colors_are_those_of_components() -> None:
    positions = [(10.0, 10.0), (80.0, 80.0), (14.0, 10.0), (84.0, 80.0), (50.0, 20.0)]
    run = still(positions, 5.0, predators=())
    picture = draw(run, 1)
    colors = [label_colors(5)[0], label_colors(5)[1], label_colors(5)[0], label_colors(5)[1], ALONE]
    for position, color in zip(positions, colors, strict=True):
        for other in {tuple(np.array(each).tolist()) for each in colors}:
            assert near(picture, place(run, position), other, reach=3) == (
                other == tuple(np.array(color).tolist())
            )
    assert (draw(run, 0)[: int(VIEW.height)] == ALONE).all(axis=-1).any()
    assert not (draw(run, 0)[: int(VIEW.height)] == label_colors(5)[0]).all(axis=-1).any()  # nobody heard yet


def test_labels_have_colors_of_their_own() -> None:
    labels = np.array([0, 0, 2, 3, 3, 2, 6])
    colors = component_colors(labels)
    assert (colors[0] == colors[1]).all()
    assert tuple(colors[6]) == ALONE
    assert len({tuple(color) for color in colors}) == 4
    first = label_colors(24).astype(int)
    gaps = np.abs(first[:, np.newaxis] - first).sum(axis=-1)[~np.eye(24, dtype=bool)]
    assert gaps.min() > 24
    assert np.abs(first - np.array(PREDATOR)).sum(axis=-1).min() > 60
    np.testing.assert_array_equal(label_colors(300)[:24], label_colors(24))


def changed(run: Trajectory, **options: Any) -> np.ndarray:
    """Which px of the view an option changes, shape (height, width)."""
    pictures = [draw(run, 1, options=RenderOptions(**each)) for each in ({}, options)]
    different: np.ndarray = (pictures[0] != pictures[1]).any(axis=-1)[: int(VIEW.height)]
    return different


def test_discs_have_the_radius_of_the_range() -> None:
    positions = [(20.0, 75.0), (80.0, 25.0)]
    run = still(positions, [8.0, 16.0], predators=())
    scale = np.linalg.norm(place(run, (0.0, 0.0)) - place(run, (1.0, 0.0)))
    rows, columns = np.indices((int(VIEW.height), SIZE))
    distances = [np.hypot(columns - x, rows - y) for x, y in (place(run, point) for point in positions)]
    inside = (distances[0] < 8 * scale) | (distances[1] < 16 * scale)
    edge = (np.abs(distances[0] - 8 * scale) < 2) | (np.abs(distances[1] - 16 * scale) < 2)
    marks = np.minimum(*distances) < 12
    np.testing.assert_array_equal(changed(run, show="discs")[~edge & ~marks], inside[~edge & ~marks])
    alone = changed(run, show="discs", agents=[1])
    assert not alone[(distances[0] < 8 * scale) & ~edge].any()
    assert alone[(distances[1] < 16 * scale) & ~edge & ~marks].all()


def test_edges_join_whoever_hears_the_other() -> None:
    positions = [(10.0, 10.0), (40.0, 10.0), (10.0, 70.0), (90.0, 70.0)]
    run = still(positions, [1.0, 35.0, 1.0, 70.0], predators=())

    def is_drawn(i: int, j: int, **options: Any) -> bool:
        ends = [place(run, positions[k]) for k in (i, j)]
        column, row = np.round(np.mean(ends, axis=0)).astype(int)
        return bool(changed(run, show="edges", **options)[row - 2 : row + 3, column - 2 : column + 3].any())

    assert is_drawn(0, 1)  # only 1 hears 0
    assert not is_drawn(2, 3)  # 80 m apart
    assert not is_drawn(0, 2)
    assert is_drawn(0, 1, agents=(0,))
    assert not is_drawn(0, 1, agents=(2,))


def test_a_trail_is_as_long_as_asked() -> None:
    run = simulate(FlockScenario(num_agents=3, num_steps=100), 0.0, seed=0)
    pictures = [draw(run, 100, options=RenderOptions(trail=seconds)) for seconds in (0.0, 1.0, 3.0)]
    counts = [int((picture != pictures[0]).any(axis=-1).sum()) for picture in pictures]
    assert counts[0] == 0
    assert 2.5 < counts[2] / counts[1] < 6  # the first third hides below the mark, in part


def test_no_predator_and_a_lone_agent() -> None:
    run = simulate(FlockScenario(num_agents=1, num_steps=3, predators=()), 5.0, seed=0)
    assert not (draw(run, 3) == PREDATOR).all(axis=-1).any()
    line = simulate_line(LineScenario(num_agents=1, predator_position=None), 0.1, seed=0)
    assert (draw(line, line.steps) != PAPER).any()


def test_line_labels_are_those_of_the_chain() -> None:
    states = np.array([0.5, 0.1, 0.9, 0.55, 0.15, 0.1])
    np.testing.assert_array_equal(line_labels(states, 0.06), [0, 1, 2, 0, 1, 1])
    np.testing.assert_array_equal(line_labels(states, 0.0), [0, 1, 2, 3, 4, 1])
    np.testing.assert_array_equal(line_labels(states, 1.0), [0] * 6)
    run = simulate_line(LineScenario(), 0.05, seed=2)
    for x, count in zip(run.states, run.num_components, strict=True):
        assert len(np.unique(line_labels(x, 0.05))) == count


@every
def test_the_window_shows_what_arrays_hold(interface: str) -> None:
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
def test_nothing_is_kept_without_a_mode(interface: str) -> None:
    env = make(interface)
    reset(env)
    step(env)
    assert env.render_mode is None
    with pytest.warns(UserWarning, match="render"):
        assert env.render() is None
    env.close()
    env.close()


@every
def test_bad_modes_and_options_are_refused(interface: str) -> None:
    with pytest.raises(
        ScenarioError, match="render_mode: expected one of human, rgb_array or None, got 'ansi'"
    ):
        make(interface, render_mode="ansi")
    with pytest.raises(ScenarioError, match="render_options"):
        make(interface, render_mode="rgb_array", render_options={"size": 512})
    if interface != "line":
        with pytest.raises(ScenarioError, match="agents: expected indices below 5, got 5"):
            make(interface, render_options=RenderOptions(agents=(0, 5)))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("size", 511),
        ("size", 100),
        ("size", 512.0),
        ("show", "all"),
        ("agents", ()),
        ("agents", (-1,)),
        ("agents", (0.5,)),
        ("trail", -1.0),
        ("trail", np.nan),
    ],
)
def test_bad_options_name_the_field(field: str, value: Any) -> None:
    with pytest.raises(ScenarioError) as refused:
        RenderOptions(**{field: value})
    assert refused.value.field == field


@pytest.mark.parametrize("step", [-1, 11, 1.5, None])
def test_times_that_a_run_does_not_have_are_refused(step: Any) -> None:
    with pytest.raises(ArgumentError, match="step"):
        draw(simulate(small_flock(), 1.0, seed=0), step)


@every
def test_render_before_reset_is_refused(interface: str) -> None:
    with pytest.raises(EpisodeError, match="render"):
        make(interface, render_mode="rgb_array").render()


@every
def test_without_pygame_the_extra_is_named(interface: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "flockesc-env\[video\]"'):
        make(interface, render_mode="rgb_array")
    make(interface)


@single
def test_copies_show_the_same_and_then_their_own(interface: str) -> None:
    env = make(interface, render_mode="rgb_array")
    reset(env)
    step(env)
    twin = copy.deepcopy(env)
    before = env.render()
    np.testing.assert_array_equal(twin.render(), before)
    step(twin)
    np.testing.assert_array_equal(env.render(), before)
    step(env)
    np.testing.assert_array_equal(env.render(), twin.render())


@pytest.mark.parametrize("size", [160, 300])
@single
def test_sizes(interface: str, size: int) -> None:
    env = make(interface, render_mode="rgb_array", render_options=RenderOptions(size=size))
    reset(env)
    assert env.render().shape == (size, size, 3)


@pytest.mark.parametrize(("steps_per_action", "fps"), [(1, 20), (4, 5), (7, 3), (100, 1)])
def test_pictures_per_second_are_those_of_the_model(steps_per_action: int, fps: int) -> None:
    for interface in ("flock", "parallel", *BATCHED):
        env = make(interface, steps_per_action=steps_per_action)
        assert env.metadata["render_fps"] == fps
        assert env.metadata["render_modes"] == ["human", "rgb_array"]


def test_pictures_outlive_a_quit_of_pygame() -> None:
    """Gymnasium's ``HumanRendering.close`` quits all of pygame."""
    import pygame

    run = simulate(small_flock(), 1.0, seed=0)
    before = draw(run, 1, title="first")
    pygame.quit()
    np.testing.assert_array_equal(draw(run, 1, title="first"), before)
    assert draw(run, 2, title="second").shape == before.shape


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
@pytest.mark.parametrize(
    ("name", "arguments"), [(FLOCK_ID, {}), (FLOCK_ID, {"scenario": small_flock(3)}), (LINE_ID, {})]
)
def test_gymnasium_checks_every_mode(name: str, arguments: dict[str, Any], mode: str) -> None:
    check_env(gymnasium.make(name, render_mode=mode, **arguments).unwrapped)


def test_a_window_leaves_signals_alone() -> None:
    """SDL would turn SIGTERM into an event, and pools of forked workers would wait for ever."""
    script = """
import os, signal
from flockesc_env import FlockEscapeEnv
env = FlockEscapeEnv(render_mode="human")
env.reset(seed=0)
os.kill(os.getpid(), signal.SIGTERM)
"""
    run = subprocess.run([sys.executable, "-c", script], check=False)  # noqa: S603
    assert run.returncode == -signal.SIGTERM


def test_no_display_is_needed() -> None:
    script = """
import gymnasium
env = gymnasium.make("flockesc_env:flockesc/FlockEscape-v0", render_mode="rgb_array")
env.reset(seed=0)
env.step(env.action_space.high)
assert env.render().std() > 0
import pygame
assert not pygame.display.get_init()
"""
    bare = {name: value for name, value in os.environ.items() if name not in {"DISPLAY", "SDL_VIDEODRIVER"}}
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, env=bare, capture_output=True, text=True, check=False)  # noqa: S603
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
