"""Results of ``simulate``, ``sweep`` and ``scan``, neighbor graphs, measures of order, and recorded runs."""

from flockesc_env.models.flock import Flock
from flockesc_env.models.graph import component_labels, laplacian, neighbor_pairs, perron_matrix
from flockesc_env.models.order import (
    autocorrelation_time,
    binder_cumulant,
    correlation_length,
    density,
    nearest_neighbor_distance,
    nearest_neighbor_distances,
    polarization,
    rotation,
)
from flockesc_env.models.records import RecordedRun, load_run, replay_run, run_differences, save_run
from flockesc_env.models.scan import ScanResult
from flockesc_env.models.simulate import LineTrajectory, Trajectory, simulate_line
from flockesc_env.models.sweep import FlockSweepResult, LineSweepResult, SweepResult

__all__ = [
    "Flock",
    "FlockSweepResult",
    "LineSweepResult",
    "LineTrajectory",
    "RecordedRun",
    "ScanResult",
    "SweepResult",
    "Trajectory",
    "autocorrelation_time",
    "binder_cumulant",
    "component_labels",
    "correlation_length",
    "density",
    "laplacian",
    "load_run",
    "nearest_neighbor_distance",
    "nearest_neighbor_distances",
    "neighbor_pairs",
    "perron_matrix",
    "polarization",
    "replay_run",
    "rotation",
    "run_differences",
    "save_run",
    "simulate_line",
]
