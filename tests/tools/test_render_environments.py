"""Pictures of flocks and runs, and rendering in every mode of every interface."""

import signal
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from typing import Any
from unittest import mock

import envs
import numpy as np
import pytest
from argument_table import PARTS, SLOTS
from envs import start
from hypothesis import given
from hypothesis import strategies as st
from option_table import DIMENSIONS, small_flock
from pictures import draw

import flockesc_env as fe
from flockesc_env.common.extras import MissingExtraError
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models import Trajectory
from flockesc_env.render.frames import recorded_view
from flockesc_env.render.palette import LIGHT, rgb
from flockesc_env.render.picture import PREDATOR, Canvas, camera
from flockesc_env.sb3 import vec_env
from flockesc_env.scenario import ConstantVelocity

SIZE = 512

SINGLE = {
    "flock": lambda **options: fe.FlockEscapeEnv(small_flock(), **options),
    "space": lambda **options: fe.FlockEscapeEnv(small_flock(3), **options),
    "line": lambda **options: fe.LineEscapeEnv(fe.LineScenario(num_agents=30), **options),
    "parallel": lambda **options: fe.parallel_env(small_flock(), **options),
}
BATCHED = {
    "vector": lambda **options: BatchVectorEnv(3, small_flock(), **options),
    "sb3 flocks": lambda **options: vec_env(small_flock(), 3, **options),
    "sb3 agents": lambda **options: vec_env(small_flock(), 3, per_agent=True, **options),
}
every = pytest.mark.parametrize("interface", [*SINGLE, *BATCHED])


def make(interface: str, **options: Any) -> Any:
    return (SINGLE | BATCHED)[interface](**options)


def step(env: Any) -> None:
    envs.step(env, envs.same_action(env, np.array([-0.8], np.float32)))


@pytest.mark.parametrize("interface", SINGLE)
def test_pictures_follow_the_episode(interface: str) -> None:
    env = make(interface, render_mode="rgb_array")
    start(env, 0)
    pictures = [env.render()]
    for _ in range(3):
        step(env)
        pictures.append(env.render())
    assert {(picture.shape, picture.dtype.name) for picture in pictures} == {((SIZE, SIZE, 3), "uint8")}
    for before, after in pairwise(pictures):
        assert not np.array_equal(before, after)
    np.testing.assert_array_equal(env.render(), pictures[-1])
    start(env, 0)
    np.testing.assert_array_equal(env.render(), pictures[0])
    env.close()
    env.close()


@pytest.mark.parametrize("interface", BATCHED)
def test_a_batch_shows_every_flock(interface: str) -> None:
    env = make(interface, render_mode="rgb_array")
    twin = make("parallel" if interface == "sb3 agents" else "flock", render_mode="rgb_array")
    start(env, 4)
    step(env)
    pictures = env.render() if interface == "vector" else env.get_images()
    assert len(pictures) == 3
    for flock, picture in enumerate(pictures):
        start(twin, 4 + flock)
        step(twin)
        np.testing.assert_array_equal(picture, twin.render())
    if interface != "vector":
        assert env.render().shape == (2 * SIZE, 2 * SIZE, 3)
    env.close()
    env.close()
    assert interface != "vector" or env.closed


@pytest.mark.parametrize("interface", ["flock", "parallel", "line"])
def test_environments_and_recorded_runs_look_the_same(interface: str) -> None:
    ranges = {"flock": np.array([7.0]), "parallel": np.arange(5.0, 10.0), "line": np.array([0.1])}[interface]
    options: Any = {"action_mode": "range", "max_range": ranges.max(), "steps_per_action": 1}
    env = make(interface, render_mode="rgb_array", **options)
    env.reset(seed=3)
    run: Any = fe.simulate_line if interface == "line" else fe.simulate
    run = run(env.scenario, ranges if interface == "parallel" else ranges[0], seed=3)
    for made in range(min(run.steps if interface == "line" else run.scenario.num_steps, 20)):
        if made or interface == "line":
            np.testing.assert_array_equal(env.render(), draw(run, made))
        each = zip(getattr(env, "agents", ()), ranges, strict=False)
        env.step({agent: [rho] for agent, rho in each} if interface == "parallel" else ranges)


@every
def test_the_window_shows_the_same_pixels_as_arrays(interface: str) -> None:
    import pygame

    env, twin = make(interface, render_mode="human"), make(interface, render_mode="rgb_array")
    try:
        for act in (lambda each: start(each, 0), step):
            for each in (env, twin):
                act(each)
            screen = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
            picture = twin.render()[0] if interface == "vector" else twin.render()
            np.testing.assert_array_equal(screen[:SIZE, :SIZE], picture[:SIZE, :SIZE])
        assert env.render() is None
    finally:
        env.close()
    assert pygame.display.get_surface() is None
    env.close()


@every
def test_pygame_is_needed_at_the_first_picture(interface: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """stable-baselines3 makes environments with ``render_mode="rgb_array"``."""
    monkeypatch.delitem(sys.modules, "flockesc_env.render.picture")
    monkeypatch.setattr("flockesc_env.common.extras.find_spec", lambda _: None)
    env, window = make(interface, render_mode="rgb_array"), make(interface, render_mode="human")
    start(env, 0)
    step(env)
    for act in (env.render, lambda: start(window, 0)):
        with pytest.raises(MissingExtraError, match="pygame is not installed"):
            act()
    env.close()
    window.close()


@every
def test_a_picture_before_a_reset_is_refused(interface: str) -> None:
    with pytest.raises(fe.FlockescError, match="render"):
        make(interface, render_mode="rgb_array").render()


def test_a_window_leaves_signals_alone() -> None:
    """SDL would turn SIGTERM into an event, and pools of forked workers would wait forever."""
    script = """
import os, signal
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env import FlockEscapeEnv
env = FlockEscapeEnv(render_mode="human")
env.reset(seed=0)
os.kill(os.getpid(), signal.SIGTERM)
"""
    run = subprocess.run([sys.executable, "-c", script], check=False)  # noqa: S603
    assert run.returncode == -signal.SIGTERM


def near(picture: np.ndarray, at: np.ndarray, color: Any, reach: int = 2) -> bool:
    column, row = np.round(at).astype(int)
    patch = picture[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
    return bool((patch == np.array(color, np.uint8)).all(axis=-1).any())


def still(positions: list[tuple[float, ...]], ranges: Any, **changes: Any) -> Trajectory:
    """Return a run of one step from given positions in which agents hardly move."""
    scenario = fe.FlockScenario(
        num_agents=len(positions), num_steps=1, time_step=1e-6, dimension=len(positions[0]), **changes
    )
    velocities = np.zeros((len(positions), len(positions[0])))
    velocities[:, 0] = 1.0
    return fe.simulate(scenario, ranges, initial_positions=positions, initial_velocities=velocities)


def place(run: Trajectory, point: Any) -> np.ndarray:
    return camera(recorded_view(run, 1), SIZE).pixels(np.array(point, float))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_predator_and_agents_are_where_the_camera_says(dimension: int) -> None:
    depth = (0.0,) * (dimension - 2)
    predator, agents = (30.0, 20.0, *depth), [(80.0, 60.0, *depth), (10.0, 95.0, *depth)]
    run = still(agents, 0.0, predators=(ConstantVelocity(position=predator, velocity=(1.0, 0.0, *depth)),))
    picture = draw(run, 1)
    assert near(picture, place(run, predator), PREDATOR)
    assert not near(picture, place(run, (80.0, 20.0, *depth)), PREDATOR, reach=9)

    def is_marked(point: tuple[float, ...]) -> bool:
        column, row = np.round(place(run, point)).astype(int)
        darkest = int(picture[row - 3 : row + 4, column - 3 : column + 4].max(axis=-1).min())
        return darkest < min(rgb(LIGHT.frame))

    assert all(is_marked(agent) for agent in agents)
    assert not is_marked((60.0, 90.0, *depth))


@given(st.integers(2, 3), st.integers(0, 10_000), st.floats(1.0, 300.0))
def test_the_view_holds_everything(dimension: int, seed: int, rho: float) -> None:
    scenario = fe.FlockScenario(num_agents=12, num_steps=60, dimension=dimension)
    run = fe.simulate(scenario, rho, seed=seed)
    eye = camera(recorded_view(run, 60), SIZE)
    pixels = eye.pixels(np.concatenate([run.positions, run.predator_positions], axis=1))
    assert eye.scale > 0
    assert (pixels > 0).all()
    assert (pixels < SIZE).all()


def test_colors_are_those_of_ranges() -> None:
    """The scale ends at the largest range of the run."""
    positions = [(10.0, 10.0), (80.0, 80.0), (14.0, 10.0), (84.0, 80.0), (50.0, 20.0)]
    run = still(positions, np.arange(5.0), predators=())
    picture = draw(run, 1)
    for position, color in zip(positions, LIGHT.ranges, strict=True):
        for other in LIGHT.ranges:
            assert near(picture, place(run, position), rgb(other), reach=3) == (other == color)


@pytest.mark.parametrize(("slot", "part"), PARTS)
def test_every_part_of_a_scenario_is_drawn(slot: str, part: Any) -> None:
    draw(fe.simulate(small_flock(**{slot: SLOTS[slot][0](part)}), 2.0, seed=3), 10)


def words(picture: Callable[[], object]) -> set[str]:
    with mock.patch.object(Canvas, "text", autospec=True, return_value=9) as text:
        picture()
    return {call.args[1] for call in text.call_args_list}


def test_the_first_picture_shows_the_range_of_the_first_action() -> None:
    env = make("flock", action_mode="range", render_mode="rgb_array")
    env.reset(seed=3)
    assert not any("listen" in text for text in words(env.render))  # no action yet
    run = fe.simulate(env.scenario, 300.0, seed=3)
    assert {"all listen to 300 m", "300 m"} <= words(lambda: draw(run, 0))


def test_the_ring_is_the_lowest_mean_distance_so_far() -> None:
    run = fe.simulate("paper-flock", policy="per-agent-visible/search", seed=242)
    eye = camera(recorded_view(run, 240), SIZE)
    for distance, is_ring in ((run.mean_distance.min(), True), (run.mean_distance[-1], False)):
        edge = eye.pixels(run.predator_positions[-1, 0] + distance * np.array([0.6, -0.8]))
        assert near(draw(run, 240), edge, rgb(LIGHT.ink)) == is_ring
    assert {"95 m", "27 of 100 listen to 20 m", "70 to nobody"} <= words(lambda: draw(run, 240))


def test_a_picture_without_predators_or_agents_says_so() -> None:
    alone = still([(10.0, 10.0), (80.0, 80.0)], 5.0, predators=())
    assert "no predator" in words(lambda: draw(alone, 1))
    near = ConstantVelocity(position=(30.0, 20.0), velocity=(1.0, 0.0))
    eaten = still([(30.0, 20.0), (30.0, 21.0)], 5.0, predators=(near,), capture_radius=9.0)
    assert "2 caught" in words(lambda: draw(eaten, 1))


def test_pictures_can_be_drawn_after_pygame_quit() -> None:
    """Gymnasium's ``HumanRendering.close`` quits all of pygame."""
    import pygame

    run = fe.simulate(small_flock(), 1.0, seed=0)
    before = draw(run, 1, title="first")
    pygame.quit()
    np.testing.assert_array_equal(draw(run, 1, title="first"), before)
    assert draw(run, 2, title="second").shape == before.shape
