"""Pictures: positions, colors and sizes of agents, predators, discs, edges and trails."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from option_table import DIMENSIONS, small_flock

from flockesc_env import (
    ConstantVelocity,
    FlockScenario,
    Trajectory,
    simulate,
)
from flockesc_env.render import RenderOptions, draw
from flockesc_env.render.camera import VIEW_ASPECT, Rect, camera
from flockesc_env.render.colors import (
    ALONE,
    GRID,
    PREDATOR,
    label_colors,
    range_colors,
)
from flockesc_env.render.frame import recorded_frames
from flockesc_env.render.palette import LIGHT

SIZE = 512
VIEW = Rect(0, 0, SIZE, SIZE / VIEW_ASPECT)


def near(picture: np.ndarray, at: np.ndarray, color: Any, reach: int = 2) -> bool:
    column, row = np.round(at).astype(int)
    patch = picture[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
    return bool((patch == np.array(color, np.uint8)).all(axis=-1).any())


def still(positions: list[tuple[float, ...]], ranges: Any, **changes: Any) -> Trajectory:
    """Return a run of one step from given positions in which agents hardly move."""
    scenario = FlockScenario(
        num_agents=len(positions), num_steps=1, time_step=1e-6, dimension=len(positions[0]), **changes
    )
    velocities = np.zeros((len(positions), len(positions[0])))
    velocities[:, 0] = 1.0
    return simulate(scenario, ranges, initial_positions=positions, initial_velocities=velocities)


def place(run: Trajectory, point: Any) -> np.ndarray:
    *_, last = recorded_frames(run)
    pixels, _ = camera(last.view, VIEW)(np.array([point], float))
    return pixels[0]


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
        return darkest < min(GRID) - 5

    assert all(is_marked(agent) for agent in agents)
    assert not is_marked((60.0, 90.0, *depth))


@given(st.integers(2, 3), st.integers(0, 10_000), st.floats(1.0, 300.0))
def test_the_view_holds_everything_and_never_shrinks(dimension: int, seed: int, rho: float) -> None:
    scenario = FlockScenario(num_agents=12, num_steps=60, dimension=dimension)
    run = simulate(scenario, rho, seed=seed)
    before = None
    for frame in recorded_frames(run):
        points = np.concatenate([frame.moment.positions, frame.moment.predator_positions])
        pixels, scale = camera(frame.view, VIEW)(points)
        assert (pixels > (VIEW.left, VIEW.top)).all()
        assert (pixels < (VIEW.right, VIEW.bottom)).all()
        assert (scale > 0).all()
        if before is not None:
            assert (frame.view[0] <= before[0]).all()
            assert (frame.view[1] >= before[1]).all()
        before = frame.view


def test_the_scale_of_ranges_is_the_palettes() -> None:
    stops = [tuple(bytes.fromhex(color[1:])) for color in LIGHT.ranges]
    assert [tuple(color) for color in range_colors(np.linspace(0, 8, 5), 8.0).tolist()] == stops
    assert (range_colors(np.array([9.0]), 8.0) == stops[-1]).all()
    positions, ranges = [(10.0, 10.0), (80.0, 80.0), (50.0, 20.0)], np.array([0.0, 5.0, 20.0])
    run = still(positions, ranges, predators=())
    picture = draw(run, 1, options=RenderOptions(color="range", largest_range=20.0))
    for position, color in zip(positions, range_colors(ranges, 20.0), strict=True):
        assert near(picture, place(run, position), color)


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
    assert not (draw(run, 0)[: int(VIEW.height)] == label_colors(5)[0]).all(axis=-1).any()  # all alone


def changed(run: Trajectory, **options: Any) -> np.ndarray:
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


def test_edges_join_agents_if_one_hears_the_other() -> None:
    positions = [(10.0, 10.0), (40.0, 10.0), (10.0, 70.0), (90.0, 70.0)]
    run = still(positions, [1.0, 35.0, 1.0, 70.0], predators=())

    def is_drawn(i: int, j: int, **options: Any) -> bool:
        ends = [place(run, positions[k]) for k in (i, j)]
        column, row = np.round(np.mean(ends, axis=0)).astype(int)
        return bool(changed(run, show="edges", **options)[row - 2 : row + 3, column - 2 : column + 3].any())

    assert is_drawn(0, 1)  # only agent 1 hears agent 0
    assert not is_drawn(2, 3)  # 80 m apart
    assert not is_drawn(0, 2)
    assert is_drawn(0, 1, agents=(0,))
    assert not is_drawn(0, 1, agents=(2,))


def test_pictures_can_be_drawn_after_pygame_quit() -> None:
    """Gymnasium's ``HumanRendering.close`` quits all of pygame."""
    import pygame

    run = simulate(small_flock(), 1.0, seed=0)
    before = draw(run, 1, title="first")
    pygame.quit()
    np.testing.assert_array_equal(draw(run, 1, title="first"), before)
    assert draw(run, 2, title="second").shape == before.shape
