"""Initial states from files and from ``GivenPositions`` and ``GivenHeadings``."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env.scenario import GivenHeadings, GivenPositions, RandomHeadings, read_initial_state

RNG = np.random.default_rng(0)


def state(dimension: int) -> tuple[Any, Any]:
    return RNG.uniform(0, 100, (7, dimension)), RNG.normal(size=(7, dimension))


def write(path: Path, positions: Any, velocities: Any = None) -> Path:
    arrays = {"positions": positions} | ({} if velocities is None else {"velocities": velocities})
    table = np.hstack(list(arrays.values()))
    if path.suffix.lower() == ".npz":
        with path.open("wb") as file:  # NumPy appends .npz to other suffixes
            np.savez(file, **arrays)
    elif path.suffix == ".npy":
        np.save(path, table)
    else:
        axes = "xyz"[: positions.shape[1]]
        names = [*axes, *(f"v{axis}" for axis in axes)][: table.shape[1]]
        np.savetxt(path, table, "%.17g", ",", header=",".join(names), comments="")
    return path


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("suffix", [".CSV", ".npy", ".Npz"])
def test_a_file_sets_the_start_bit_for_bit(tmp_path: Path, suffix: str, dimension: int) -> None:
    positions, velocities = state(dimension)
    fields = read_initial_state(write(tmp_path / f"flock{suffix}", positions, velocities))
    scenario = fe.FlockScenario(num_steps=5, **fields)
    run = fe.simulate(scenario, 10.0, seed=1)
    np.testing.assert_array_equal(run.positions[0], positions)
    headings = velocities / np.linalg.norm(velocities, axis=1, keepdims=True)
    np.testing.assert_allclose(run.velocities[0], 10.0 * headings, rtol=1e-15)
    assert not run.is_start_given
    again = fe.simulate(scenario, 10.0, initial_positions=positions, initial_velocities=run.velocities[0])
    np.testing.assert_array_equal(run.positions, again.positions)
    assert fe.sweep(scenario, [10.0], [1]).min_mean_distance[0, 0] == run.mean_distance.min()

    fields = read_initial_state(write(tmp_path / f"positions{suffix}", positions))
    assert "initial_headings" not in fields
    assert fe.FlockScenario(**fields).initial_headings == RandomHeadings()


def test_points_of_the_plane_lie_at_z_0_in_space() -> None:
    positions, velocities = state(2)
    for in_plane in (False, True):
        scenario = fe.FlockScenario(
            num_agents=7,
            num_steps=1,
            dimension=3,
            initial_plane=in_plane,
            initial_positions=GivenPositions(positions),  # type: ignore[arg-type]
            initial_headings=GivenHeadings(velocities),  # type: ignore[arg-type]
        )
        run = fe.simulate(scenario, 10.0, seed=0)
        assert (run.positions[0, :, :2] == positions).all()
        assert not run.positions[0, :, 2].any()
        assert not run.velocities[0, :, 2].any()


@pytest.mark.parametrize(
    ("name", "content", "where", "expected"),
    [
        ("a.csv", b"1,2\n3,4\n", "", "the first line x,y or x,y,z"),
        ("a.csv", b"x,y\n1,2\n3\n", ": line 3", "2 numbers"),
        *(
            ("a.csv", f"x,y\n1,{text}\n".encode(), ": line 2", "2 numbers")
            for text in ("1_5", "2_0.5", "\N{ARABIC-INDIC DIGIT ONE}", "\N{FULLWIDTH DIGIT ONE}")
        ),
        ("a.csv", b"x,y\n1,2\n1,nan\n", ": positions[1, 1]", "a finite number"),
        ("a.csv", b"x,y,vx,vy\n1,2,3,4\n1,2,0,0\n", ": velocities[1]", "a nonzero vector"),
        ("a.npy", np.zeros(3), "", "the columns x,y or x,y,z"),
        ("a.npz", b"PK", "", "an initial state (.npz)"),
        ("a.npz", {"states": np.zeros((3, 2))}, "", "the arrays positions and"),
        ("a.npz", {"positions": np.ones((3, 2)), "velocities": np.ones((2, 2))}, ": velocities", "(3, 2)"),
    ],
)
def test_refused_files(tmp_path: Path, name: str, content: Any, where: str, expected: str) -> None:
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif isinstance(content, dict):
        np.savez(path, **content)
    else:
        np.save(path, content)
    with pytest.raises(fe.InputError) as caught:
        read_initial_state(path)
    assert caught.value.field == f"{path}{where}"
    assert expected in caught.value.expected
