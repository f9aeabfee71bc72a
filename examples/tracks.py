"""Tracks in and out: a tracker's CSV starts a flock; a run becomes tables for xarray, movement and trackpy.

``python examples/tracks.py [tracks.csv]`` needs the extra ``analysis`` and pandas. Without a file it makes
tracks of six fish with pixels, ids and gaps, as trackers write them.
"""

import sys
from io import StringIO

import numpy as np
import polars as pl

from flockesc_env import FlockScenario, models, simulate
from flockesc_env.scenario import GivenHeadings, GivenPositions

PIXELS_PER_M, FRAMES_PER_S, START = 40.0, 25.0, 5  # of the camera; the frame in which the flock starts


def synthetic() -> str:
    """Return a CSV with the columns frame, id, x and y (pixels, y down); the tracker misses some fish."""
    frame, fish = np.divmod(np.arange(180), 6)
    x, y = 300 + 80 * fish + frame * (4 + fish), 900 - 50 * fish - 3 * frame
    table = pl.DataFrame({"frame": frame, "id": 3 + fish, "x": x, "y": y})
    return table.filter((pl.col("frame") + pl.col("id")) % 7 > 0).write_csv()


def arrays(tracks: pl.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return positions in m and velocities in m/s, shape (T, n, 2), with NaN where an agent was not seen."""
    frames = pl.DataFrame({"frame": range(tracks["frame"].min(), tracks["frame"].max() + 1)})
    ids = tracks.select(pl.col("id").unique().sort())
    grid = frames.join(ids, how="cross").join(tracks, on=["frame", "id"], how="left", maintain_order="left")
    pixels = grid.select(pl.col("x").cast(float), -pl.col("y").cast(float)).to_numpy()
    positions = pixels.reshape(len(frames), len(ids), 2) / PIXELS_PER_M
    velocities = np.gradient(positions, 1 / FRAMES_PER_S, axis=0)
    return positions, np.where(np.isnan(positions), np.nan, velocities)


def main() -> None:
    """Measure the tracks, start a flock from one of their frames, and convert its run."""
    tracks = pl.read_csv(sys.argv[1] if len(sys.argv) > 1 else StringIO(synthetic()))
    positions, velocities = arrays(tracks)
    print(
        "polarization of the tracks:", models.polarization(positions, velocities).round(3)
    )  # gaps do not count

    here = ~np.isnan(velocities[START]).any(axis=1)
    flock = FlockScenario(
        num_agents=int(here.sum()),
        time_step=1 / FRAMES_PER_S,
        num_steps=50,
        speed=float(np.linalg.norm(velocities[START, here], axis=1).mean()),
        initial_positions=GivenPositions(positions[START, here]),
        initial_headings=GivenHeadings(velocities[START, here]),
        predators=(),
    )
    run = simulate(flock, 10.0, seed=7)
    print("polarization of the flock:", run.polarization[[0, -1]].round(3))

    # xarray: a Dataset with the dimensions time and agent is ``table.to_xarray()``.
    table = run.agents_table().to_pandas().set_index(["time", "agent"])
    # movement: positions of shape (frames, space, keypoints, individuals) go to
    # ``movement.io.load_poses.from_numpy(poses, fps=FRAMES_PER_S)``.
    poses = run.unwrapped_positions().transpose(0, 2, 1)[:, :, np.newaxis]
    # trackpy: a pandas table with the columns particle, frame, x and y goes to ``trackpy.emsd(trackpy_table,
    # mpp=1, fps=FRAMES_PER_S)``.
    frame = (pl.col("time").rank("dense") - 1).cast(int).alias("frame")
    trackpy_table = run.agents_table().select("x", "y", frame, particle="agent").to_pandas()
    print(table.shape, poses.shape, trackpy_table.shape)


if __name__ == "__main__":
    main()
